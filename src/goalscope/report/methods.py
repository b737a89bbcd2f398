"""The ablation's figures: each method's scores, over all people and person by person (Sec. 5)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from goalscope.experiment.episodes import headings_of_judges, methods_of, outcome_of
from goalscope.experiment.summary import Estimate, Sample, without_shared
from goalscope.report.drawing import COLOURS, INK, MARKERS, Figure, draw_figure, shortened, wrapped

__all__ = ["ablation_figure", "method_figures"]

PAGE = 30
"""Most people in one figure; more go into the next one."""
NAMES = {"good": "GOOD", "no-goals": "No Goals", "no-inference": "No Inference"}
"""The paper's names of the methods."""
OVER_PEOPLE = "95 % interval over people (bootstrap)"
OVER_TRIALS = "\N{PLUS-MINUS SIGN} pooled SD of the mean over trials, as in the paper"
OVER_SEEDS = "\N{PLUS-MINUS SIGN} pooled SD of the mean over seeds"
_DIFFER = "Not all means are of the same people. "
OVER_BOTH = f"{OVER_TRIALS}; of other scores over seeds"


@dataclass(frozen=True, slots=True)
class _Panel:
    """One measure of the episodes.

    Attributes:
        title: Its heading.
        measure: Its key in the records.
        scale: Factor from the records to the axis.
        spread: What its SD is over.
    """

    title: str
    measure: str
    scale: float = 100.0
    spread: str = OVER_SEEDS


_Row = tuple[str, Sample, str | None]
"""A row's label, its sample, and its person; None for all of them."""


def method_figures(episodes: Sample) -> Iterator[Figure]:
    """Bars over all people; where there are several, also a row of points for each of them."""
    panels = _panels(episodes)
    yield _pooled(episodes, panels)
    people = sorted({run["profile"] for run in episodes.records})
    if len(people) > 1:
        pages = range(0, len(people), PAGE)
        for number, first in enumerate(pages, 1):
            yield _people(episodes, panels, people[first : first + PAGE], number, len(pages))


def _panels(episodes: Sample) -> list[_Panel]:
    panels = [
        _Panel(f"evaluator's score{by}, %", f"judge score{by}", spread=OVER_TRIALS)
        for by in headings_of_judges(episodes)
    ]
    panels.append(_Panel("state-based score, %", "score"))
    if any("unwanted" in run for run in episodes.records):
        panels.append(_Panel("unwanted things, number", "unwanted", 1.0))
    return panels


def _pooled(episodes: Sample, panels: Sequence[_Panel]) -> Figure:
    methods = methods_of(episodes)
    found = {
        (panel, method): outcome_of(episodes, panel.measure, method)
        for panel in panels
        for method in methods
    }
    bars = [
        *(OVER_PEOPLE for value, _ in found.values() if value and value.interval),
        *(panel.spread for (panel, _), (_, spread) in found.items() if spread),
    ]

    def paint(figure: Any) -> None:
        for axis, panel in zip(_axes(figure, panels), panels, strict=True):
            names: list[str] = []
            for x, method in enumerate(methods):
                value, spread = found[panel, method]
                words = shortened(NAMES.get(method, method), 16).replace(" ", "\n")
                if value is None:
                    names.append(f"no data\n{words}")
                    continue
                middle = panel.scale * value.value
                names.append(f"{middle:.1f}\n{words}")
                colour = COLOURS[x % len(COLOURS)]
                axis.bar(x, middle, 0.7, color=_light(colour), edgecolor=colour, linewidth=1.2)
                if value.interval:
                    _bar(axis, "y", x - (0.17 if spread else 0), value, panel.scale)
                if spread:
                    wide = panel.scale * spread
                    axis.vlines(x + 0.17, middle - wide, middle + wide, color=INK, lw=4, alpha=0.6)
            axis.set_xticks(range(len(methods)), names)
            axis.set_xlim(-0.6, len(methods) - 0.4)
            _scale(axis, "y", panel)
        _legend(figure, bars)

    caption = (
        f"Methods over {_number_of(episodes)}: {episodes.title}. Bars: "
        f"means over people of the means over their runs. {_told(bars)}{_counts(episodes, panels)}"
    )
    size = (0.4 + len(panels) * max(2.0, 0.75 * len(methods)), 3.3)
    return draw_figure(f"methods-{episodes.name}", caption, size, paint)


def ablation_figure(samples: Sequence[Sample]) -> Figure | None:
    """A row for each sample, such as a domain or a planner; None if there are fewer than two."""
    if len(samples) < 2:
        return None
    panels = [*dict.fromkeys(panel for each in samples for panel in _panels(each))]
    panels.sort(key=lambda panel: panel.measure in ("score", "unwanted"))
    labels = without_shared([each.title for each in samples])
    rows = [
        (wrapped(f"{label}, {_number_of(each)}", 120, 34), each, None)
        for label, each in zip(labels, samples, strict=True)
    ]
    lead = "The ablation in every setting. Points: means over people of the means over their runs. "
    tail = (
        f"{_DIFFER if any(_differ(each, panels) for each in samples) else ''}"
        f"Settings in full: {'; '.join(each.title for each in samples)}."
    )
    return _points("ablation", lead, tail, rows, panels)


def _people(
    episodes: Sample, panels: Sequence[_Panel], people: Sequence[str], page: int, pages: int
) -> Figure:
    everyone = _people_in(episodes)
    rows: list[_Row] = [(_label(each), episodes, each) for each in people]
    rows.append((f"all {everyone} people", episodes, None))
    part = f", part {page} of {pages}" if pages > 1 else ""
    lead = (
        f"Methods person by person{part}: {episodes.title}. Points: means over a person's runs; "
        f"last row: means over all {everyone:,} people. "
    )
    name = f"people-{episodes.name}{f'-{page}' * (pages > 1)}"
    return _points(name, lead, _counts(episodes, panels), rows, panels)


def _points(
    name: str, lead: str, tail: str, rows: Sequence[_Row], panels: Sequence[_Panel]
) -> Figure:
    """A point for each method in each row, with its error bars.

    Args:
        name: Of the figure.
        lead: What the caption says before it tells the error bars.
        tail: What it says after them.
        rows: From top to bottom.
        panels: From left to right.
    """
    methods = methods_of(*(each for _, each, _ in rows))
    found = {
        (panel, method, row): outcome_of(episodes, panel.measure, method, person)
        for panel in panels
        for method in methods
        for row, (_, episodes, person) in enumerate(rows)
    }
    bars = [
        *(OVER_PEOPLE for value, _ in found.values() if value and value.interval),
        *(panel.spread for (panel, _, _), (_, spread) in found.items() if spread),
    ]
    gaps = any(value is None for value, _ in found.values())
    step = 0.8 / len(methods)
    last = rows[-1][2] is None and rows[0][2] is not None  # a row of all people below the others

    def paint(figure: Any) -> None:
        axes = _axes(figure, panels, sharey=True)
        for axis, panel in zip(axes, panels, strict=True):
            for row in range(len(rows)):
                for i, method in enumerate(methods):
                    at = row + step * (i - (len(methods) - 1) / 2)
                    value, spread = found[panel, method, row]
                    if value is None:
                        continue
                    colour, middle = COLOURS[i % len(COLOURS)], panel.scale * value.value
                    if value.interval:
                        _bar(axis, "x", at, value, panel.scale, colour, min(0.09, 0.35 * step))
                    if spread:
                        wide = panel.scale * spread
                        axis.hlines(at, middle - wide, middle + wide, color=colour, lw=4, alpha=0.6)
                    axis.plot(middle, at, clip_on=False, zorder=3, **_point(i))
            for row in range(1, len(rows)):
                heavy = last and row == len(rows) - 1
                axis.axhline(row - 0.5, color=INK if heavy else "#E6E6E6", lw=0.8)
            axis.grid(visible=True, axis="x")
            axis.grid(visible=False, axis="y")
            axis.set_ylim(len(rows) - 0.5, -0.5)
            _scale(axis, "x", panel)
        axes[0].set_yticks(range(len(rows)), [label for label, _, _ in rows])
        for i, method in enumerate(methods):
            axes[0].plot([], [], label=shortened(NAMES.get(method, method), 30), **_point(i))
        figure.legend(loc="outside upper center", ncols=min(len(methods), 2 * len(panels)))
        _legend(figure, bars)

    told = f"{_told(bars)}{'A point is missing where nothing was measured. ' * gaps}"
    lines = max(label.count("\n") for label, _, _ in rows) + 1
    height = max(0.3, 0.11 * len(methods), 0.17 * lines)
    size = (2.2 + 2.2 * len(panels), 1.6 + height * len(rows))
    return draw_figure(name, f"{lead}{told}{tail}", size, paint)


def _axes(figure: Any, panels: Sequence[_Panel], **shared: Any) -> Sequence[Any]:
    figure.get_layout_engine().set(wspace=0.06)
    return figure.subplots(1, len(panels), squeeze=False, **shared)[0]


def _scale(axis: Any, along: str, panel: _Panel) -> None:
    """The title and the range of a measure; percentages always show 0 to 100."""
    axis.set_title(wrapped(panel.title, 90, 30))
    lines = axis.dataLim
    top = max(float(lines.y1 if along == "y" else lines.x1), 0.0)
    if panel.scale == 100:
        ends, ticks = (0, max(104.0, top + 2)), range(0, 101, 20)
        getattr(axis, f"set_{along}ticks")(ticks)
    else:
        ends = (0, max(1.0, 1.08 * top))
        axis.locator_params(axis=along, integer=True, nbins=5)
    getattr(axis, f"set_{along}lim")(*ends)


def _bar(
    axis: Any,
    along: str,
    at: float,
    value: Estimate,
    scale: float,
    colour: str = INK,
    cap: float = 0.09,
) -> None:
    """The interval of an estimate, with caps."""
    if value.interval:
        low, high = scale * value.interval.low, scale * value.interval.high
        lines, caps = (axis.vlines, axis.hlines) if along == "y" else (axis.hlines, axis.vlines)
        lines(at, low, high, color=colour, lw=1.2)
        caps((low, high), at - cap, at + cap, color=colour, lw=1.2)


def _point(number: int) -> dict[str, Any]:
    """The colour and shape of a method's points."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "marker": MARKERS[(number + number // len(COLOURS)) % len(MARKERS)],
        "ls": "",
        "ms": 4.5,
        "markeredgecolor": INK,
        "markeredgewidth": 0.4,
    }


def _legend(figure: Any, bars: Sequence[str]) -> None:
    """The kinds of error bars, below the panels."""
    styles = {OVER_PEOPLE: {"marker": "|", "ms": 7, "lw": 1.2}}
    lines = [
        figure.axes[0].plot([], [], color=INK, **styles.get(kind, {"lw": 4, "alpha": 0.6}))[0]
        for kind in _kinds(bars)
    ]
    if lines:
        figure.legend(lines, _kinds(bars), loc="outside lower center")


def _kinds(bars: Sequence[str]) -> list[str]:
    """The kinds of error bars, in words."""
    if {OVER_TRIALS, OVER_SEEDS} <= {*bars}:
        bars = [*bars, OVER_BOTH]
    spread = next((each for each in (OVER_BOTH, OVER_TRIALS, OVER_SEEDS) if each in bars), None)
    return [each for each in (OVER_PEOPLE, spread) if each in bars and each]


def _told(bars: Sequence[str]) -> str:
    """A sentence on the error bars."""
    if not (kinds := _kinds(bars)):
        return "There are no error bars: nothing was repeated, or all repetitions are equal. "
    return f"Error bars: {'; '.join(kinds)}. "


def _counts(episodes: Sample, panels: Sequence[_Panel]) -> str:
    """How many runs each mean is of, and whether the methods had the same people."""
    said: list[str] = []
    for panel in panels:
        runs = {
            NAMES.get(method, method): sum(
                panel.measure in run for run in episodes.where(method=method)
            )
            for method in methods_of(episodes)
        }
        same = f"{max(runs.values())} by each method" if len({*runs.values()}) == 1 else ""
        counted = same or ", ".join(f"{n} by {method}" for method, n in runs.items())
        said.append(f"{panel.title.partition(',')[0]} {counted}")
    differ = _DIFFER if _differ(episodes, panels) else ""
    return f"{differ}Runs: {'; '.join(said)}."


def _differ(episodes: Sample, panels: Sequence[_Panel]) -> bool:
    """Whether the means are of different people."""
    who = [
        {run["profile"] for run in episodes.where(method=method) if panel.measure in run}
        for panel in panels
        if any(panel.measure in run for run in episodes.records)
        for method in methods_of(episodes)
    ]
    return any(each != who[0] for each in who)


def _people_in(episodes: Sample) -> int:
    return len({run["profile"] for run in episodes.records})


def _number_of(episodes: Sample) -> str:
    number = _people_in(episodes)
    return f"{number:,} {'person' if number == 1 else 'people'}"


def _label(name: str) -> str:
    """A name for an axis; of a long one the beginning and the end, where names differ."""
    name = shortened(name, 1000)
    return name if len(name) <= 30 else f"{name[:18]}\N{HORIZONTAL ELLIPSIS}{name[-11:]}"


def _light(colour: str) -> str:
    """The colour mixed with white, so that dark text and lines show on it."""
    parts = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return "#" + "".join(f"{round(0.45 * each + 0.55 * 255):02X}" for each in parts)
