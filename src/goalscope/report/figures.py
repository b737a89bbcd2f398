"""The figures of a report, drawn by Matplotlib as SVG, each with a caption on how to read it."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Any

import numpy as np
import numpy.typing as npt

from goalscope.base.optional_packages import package
from goalscope.base.stats import Interval, proportion
from goalscope.base.text import terminal_safe
from goalscope.base.types import GoalscopeError
from goalscope.experiment.dialogues import (
    AS_IN_PAPER,
    GOALSCOPE,
    OUTRIGHT,
    SEEN,
    UNIFORM,
    after_turn,
    number_of,
    predictors_of,
    read_dialogues,
    reliability_of,
)
from goalscope.experiment.episodes import headings_of_judges, methods_of, outcome_of, read_episodes
from goalscope.experiment.results import Cell
from goalscope.experiment.summary import Estimate, Form, Row, Sample, mean_of, without_shared
from goalscope.experiment.tables import question_tables

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#999999")
"""The palette of Okabe and Ito, safe for colour-blind readers and for print."""
MARKERS = "osD^vPX"
"""One for each colour, so that a print without colours can be read."""
INK = "#222222"
STYLE = {
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E6E6E6",
    "lines.linewidth": 1.3,
    "lines.markersize": 4.5,
    "errorbar.capsize": 2,
    "legend.frameon": False,
}
NAMES = {"good": "GOOD", "no-goals": "No Goals", "no-inference": "No Inference"}
"""The paper's names of the methods."""
MOST = 10
"""Maximum number of turns that are drawn."""
LEAST = 10
"""Minimum number of dialogues for a turn to be drawn, unless there are fewer in all."""
PAPER = {"Llama 3 8B Instruct": (0.944, 0.932), "Llama 3 70B Instruct": (0.883, 0.864)}
"""Accuracy without and with Unspecified in the paper (Sec. 5)."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A picture with its caption.

    Attributes:
        name: Name of its file.
        caption: How to read it, and the number of cases. Its first sentence is also the picture's
            title for screen readers.
        svg: The picture.
    """

    name: str
    caption: str
    svg: str


def figures_of(cells: Sequence[Cell]) -> Iterator[Figure]:
    """The figures of the cells with results."""
    done = [cell for cell in cells if cell.result is not None]
    measured = [(cell.spec, cell.result or {}) for cell in done]
    for table in question_tables(measured):
        yield from question_figures(table.rows)
    for dialogues in read_dialogues(measured):
        yield from belief_figures(dialogues)
    yield from method_figures(read_episodes(done))


def draw_figure(
    name: str, caption: str, size: tuple[float, float], paint: Callable[[Any], None]
) -> Figure:
    """Draw a figure; the same figure always gives the same bytes.

    Args:
        name: Its name, and the seed of the ids in the SVG.
        caption: Its caption.
        size: Width and height in inches.
        paint: Paints on a Matplotlib figure.

    Raises:
        GoalscopeError: Matplotlib is missing.
    """
    mpl, figures, canvas = (
        package(module, "Figures need", GoalscopeError)
        for module in ("matplotlib", "matplotlib.figure", "matplotlib.backends.backend_agg")
    )
    svg = io.StringIO()
    with mpl.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")  # the SVG has it all the same
        mpl.rcdefaults()
        mpl.rcParams.update({**STYLE, "svg.hashsalt": name})
        figure = figures.Figure(figsize=size, layout="constrained")
        canvas.FigureCanvasAgg(figure)
        paint(figure)
        figure.draw_without_rendering()  # the first layout does not know the width of the text
        title = shortened(caption.partition(". ")[0], 300)
        figure.savefig(svg, format="svg", metadata={"Title": title, "Date": None, "Creator": None})
    return Figure(name, caption, svg.getvalue())


def shortened(text: str, most: int) -> str:
    """`text` on one line, cut to a length, without characters that must not be drawn."""
    shown = re.sub(
        "[\ufffe\uffff\ufdd0-\ufdef]", "\N{REPLACEMENT CHARACTER}", terminal_safe(text).plain
    )
    line = " ".join(shown.split())
    return line if len(line) <= most else line[: most - 1].rstrip() + "\N{HORIZONTAL ELLIPSIS}"


def wrapped(text: str, width: int) -> str:
    """`text` on lines of a width."""
    return "\n".join(wrap(shortened(text, 120), width))


def errors(estimates: Sequence[Estimate], scale: float = 1) -> npt.NDArray[np.float64]:
    """[2, N] distances from estimates to the ends of their intervals, for Matplotlib."""
    spans = [each.interval or Interval(each.value, each.value) for each in estimates]
    ends = [
        (each.value - span.low, span.high - each.value)
        for each, span in zip(estimates, spans, strict=True)
    ]
    return scale * np.maximum(0.0, np.array(ends).reshape(-1, 2).T)


def question_figures(rows: Sequence[Row]) -> Iterator[Figure]:
    """Accuracy on multiple-choice questions beside the paper's; none without results."""
    bars: dict[str, dict[str, Estimate]] = {}
    counts: dict[str, object] = {}
    for row in rows:
        if isinstance(row["accuracy"], Estimate):
            label = f"{row['model']}: {row['prompt']}" if row["prompt"] else str(row["model"])
            counts.setdefault(label, row["n"])
            bars.setdefault(label, {})[str(row["Unspecified"])] = row["accuracy"]
    if not bars:
        return

    def paint(figure: Any) -> None:
        axis = figure.subplots()
        for shift, unspecified, colour in (-0.2, "without", COLOURS[0]), (0.2, "with", COLOURS[1]):
            places = [y + shift for y, values in enumerate(bars.values()) if unspecified in values]
            values = [each[unspecified] for each in bars.values() if unspecified in each]
            axis.barh(
                places,
                [100 * each.value for each in values],
                0.36,
                xerr=errors(values, 100),
                color=colour,
                label=f"{unspecified} Unspecified among the goals",
            )
        for model, accuracies in PAPER.items():
            for accuracy in accuracies:
                axis.axvline(100 * accuracy, color=INK, ls=":", lw=1.2)
            axis.text(
                100 * sum(accuracies) / 2,
                -0.62,
                model.removesuffix(" Instruct"),
                ha="right" if "70B" in model else "left",
                fontsize=7.5,
            )
        axis.set_yticks(range(len(bars)), [wrapped(label, 34) for label in bars])
        axis.set(xlim=(0, 104), ylim=(len(bars) - 0.45, -0.5), xlabel="accuracy, %")
        figure.legend(loc="outside lower center", ncols=2)

    papers = ", ".join(f"{m} {100 * a:g} % and {100 * b:g} %" for m, (a, b) in PAPER.items())
    caption = (
        "Accuracy on multiple-choice questions. Bars: Wilson's 95 % interval. Dotted: the paper's "
        f"figures without Unspecified and with it: {papers}. "
        + "; ".join(f"{label} n = {n}" for label, n in counts.items())
        + " questions."
    )
    yield draw_figure("accuracy", caption, (7.4, 1.3 + 0.5 * len(bars)), paint)


def belief_figures(dialogues: Sample) -> Iterator[Figure]:
    """Accuracy and log-loss by turn, and the calibration after the last turn."""
    ends = after_turn(dialogues, UNIFORM, None)
    least = min(LEAST, len(ends))
    turns: list[int | None] = [
        turn for turn in range(1, MOST + 1) if len(after_turn(dialogues, UNIFORM, turn)) >= least
    ]
    if after_turn(dialogues, UNIFORM, 2):
        turns.append(None)  # each dialogue's last
    predictors = [
        name
        for name in predictors_of(dialogues)
        if name not in SEEN.values() and len(after_turn(dialogues, name, turns[0])) >= least
    ]
    if predictors and predictors != [UNIFORM]:
        yield _turns_figure(dialogues, turns, predictors, least)
    reliabilities = {
        name: reliability_of(records)
        for name in (GOALSCOPE, AS_IN_PAPER, OUTRIGHT)
        if (records := after_turn(dialogues, name, None))
    }
    if not reliabilities:
        return

    def paint(figure: Any) -> None:
        axes = figure.subplots(1, len(reliabilities), sharey=True, squeeze=False)[0]
        for axis, (name, made) in zip(axes, reliabilities.items(), strict=True):
            sure, right, counts = map(np.array, zip(*made.bins, strict=True))
            shares = [
                Estimate(share, proportion(min(share * n, n), n))
                for share, n in zip(right.tolist(), counts.tolist(), strict=True)
            ]
            axis.plot((0, 1), (0, 1), color=INK, ls=":", lw=1)
            axis.errorbar(sure, right, errors(shares), ls="", color=COLOURS[0])
            axis.scatter(sure, right, 8 + 90 * counts / counts.max(), color=COLOURS[0], zorder=3)
            axis.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), xlabel="confidence", box_aspect=1)
            axis.set_title(f"{name}: ECE {made.ece:.3f}")
        axes[0].set_ylabel("share correct")

    caption = (
        f"Reliability after each dialogue's last turn: {dialogues.title}, "
        f"{number_of(dialogues)}. A point is a bin of confidence in the first "
        "choice, its area the number of dialogues; bars: Wilson's 95 % interval, as if dialogues "
        "were independent; dotted: calibrated."
    )
    size = (0.6 + 2.3 * len(reliabilities), 2.9)
    yield draw_figure(f"calibration-{dialogues.name}", caption, size, paint)


def _turns_figure(
    dialogues: Sample, turns: Sequence[int | None], predictors: Sequence[str], least: int
) -> Figure:
    measures: tuple[tuple[str, str, float, Form], ...] = (
        ("accuracy, %", "top1", 100, "percent"),
        ("log-loss of the true goal, nats", "log_loss", 1, "number"),
    )

    def paint(figure: Any) -> None:
        axes = figure.subplots(1, len(measures))
        counts = [len(after_turn(dialogues, UNIFORM, turn)) for turn in turns]
        ticks = [f"{turn or 'last'}\nn = {n}" for turn, n in zip(turns, counts, strict=True)]
        for axis, (label, key, scale, form) in zip(axes, measures, strict=True):
            for i, name in enumerate(predictors):
                points: list[tuple[float, int | None, Estimate]] = []
                for x, turn in enumerate(turns, 1):
                    records = after_turn(dialogues, name, turn)
                    if len(records) >= least and (estimate := mean_of(records, key, form)):
                        points.append((x + 0.09 * (i - len(predictors) / 2), turn, estimate))
                colour = INK if name == UNIFORM else COLOURS[i % len(COLOURS)]
                style = ":" if name == UNIFORM else "-" if i < len(COLOURS) else "--"
                for last in (False, True):  # the last turn belongs to no line
                    part = [point for point in points if (point[1] is None) == last]
                    values = [estimate for _, _, estimate in part]
                    axis.errorbar(
                        [x for x, _, _ in part],
                        [scale * each.value for each in values],
                        errors(values, scale),
                        color=colour,
                        marker="" if name == UNIFORM and not last else MARKERS[i % len(MARKERS)],
                        ls="" if last else style,
                        label=None if last else "chance" if name == UNIFORM else name,
                    )
            axis.set(xlabel="turn, and number of dialogues that have it", ylabel=label)
            axis.set_xticks(range(1, len(turns) + 1), ticks)
        axes[0].set_ylim(-2.5, 102)
        axes[1].set_ylim(bottom=0)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)

    caption = (
        f"Accuracy of the likeliest goal, and log-loss, by turn: {dialogues.title}, "
        f"n = {number_of(dialogues)}; turns that fewer than {least} have are left out; the last "
        "turn is each dialogue's own. Bars: 95 % intervals, by a bootstrap over groups of "
        "dialogues that share people; none where all values are equal."
    )
    return draw_figure(f"turns-{dialogues.name}", caption, (9, 3.5), paint)


def method_figures(samples: Sequence[Sample]) -> Iterator[Figure]:
    """The methods in all settings, then person by person in each setting (Sec. 5)."""
    if not samples:
        return
    labels = without_shared([sample.title for sample in samples])
    yield _methods_figure(
        "ablation",
        f"The ablation in every setting. Settings: {'; '.join(each.title for each in samples)}",
        [
            (f"{label}, n = {len(people_in(sample))}", sample, None)
            for label, sample in zip(labels, samples, strict=True)
        ],
    )
    for sample in samples:
        if len(people := people_in(sample)) > 1:
            rows = [(person, sample, person) for person in people]
            title = f"Methods person by person: {sample.title}"
            yield _methods_figure(f"people-{sample.name}", title, rows)


def people_in(sample: Sample) -> list[str]:
    """The people of a sample of episodes."""
    return sorted({run["profile"] for run in sample.records})


def _methods_figure(
    name: str, title: str, rows: Sequence[tuple[str, Sample, str | None]]
) -> Figure:
    """A point for each method in each row.

    Args:
        name: Of the figure.
        title: The beginning of the caption.
        rows: Label, sample, and person (None for all of them), from top to bottom.
    """
    samples = [sample for _, sample, _ in rows]
    judges = dict.fromkeys(by for sample in samples for by in headings_of_judges(sample))
    measures = [(f"evaluator's score{by}, %", f"judge score{by}", 100.0) for by in judges]
    measures.append(("score, %", "score", 100.0))
    if any("unwanted" in run for sample in samples for run in sample.records):
        measures.append(("unwanted things, number", "unwanted", 1.0))
    methods = methods_of(*samples)
    step = 0.8 / len(methods)

    def paint(figure: Any) -> None:
        axes = figure.subplots(1, len(measures), sharey=True, squeeze=False)[0]
        for axis, (label, measure, scale) in zip(axes, measures, strict=True):
            for i, method in enumerate(methods):
                points: list[tuple[float, Estimate]] = []
                for y, (_, sample, person) in enumerate(rows):
                    value, spread = outcome_of(sample, measure, method, person)
                    if value and spread and not value.interval:
                        ends = Interval(value.value - spread, value.value + spread)
                        value = Estimate(value.value, ends)
                    if value:
                        points.append((y + step * (i - (len(methods) - 1) / 2), value))
                values = [value for _, value in points]
                axis.errorbar(
                    [scale * value.value for value in values],
                    [y for y, _ in points],
                    xerr=errors(values, scale),
                    ls="",
                    color=COLOURS[i % len(COLOURS)],
                    marker=MARKERS[i % len(MARKERS)],
                    label=shortened(NAMES.get(method, method), 30),
                )
            axis.set_title(wrapped(label, 30))
            axis.set_xlim((-3, 104) if scale == 100 else (-0.05 * axis.get_xlim()[1], None))
        axes[0].set_ylim(len(rows) - 0.5, -0.5)
        axes[0].set_yticks(range(len(rows)), [wrapped(label, 34) for label, _, _ in rows])
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(methods))

    caption = (
        f"{title}. Points: means over people of the means over their runs; a point is missing "
        "where nothing was measured. Error bars: 95 % interval over people (bootstrap); of one "
        "person \N{PLUS-MINUS SIGN} the pooled SD of the mean over the evaluator's trials, or else "
        "over seeds."
    )
    lines = max(wrapped(label, 34).count("\n") for label, _, _ in rows) + 1
    height = 1.6 + max(0.35, 0.17 * lines) * len(rows)
    return draw_figure(name, caption, (2.2 + 2.2 * len(measures), height), paint)
