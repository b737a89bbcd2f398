"""The figures of a report, each with a caption on how to read it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from goalscope.experiment.changes import read_changes
from goalscope.experiment.dialogues import (
    after_turn,
    number_of,
    read_dialogues,
    reliability_of,
)
from goalscope.experiment.episodes import headings_of_judges, method_rows, read_episodes
from goalscope.experiment.predictors import (
    AS_IN_PAPER,
    GOALSCOPE,
    OUTRIGHT,
    PREDICTORS,
    SEEN,
    UNIFORM,
)
from goalscope.experiment.questions import question_tables
from goalscope.experiment.results import Cell
from goalscope.experiment.summary import Estimate, Row, Sample, mean_of
from goalscope.report.drawing import COLOURS, GREY, INK, draw, shortened
from goalscope.stats import Reliability, proportion

__all__ = ["Figure", "accuracy_figure", "figures_of"]

LEAST = 10
"""Minimum number of dialogues for a turn to be drawn, unless there are fewer in all."""
MARKERS = "osD^vPX"
PAPER = {"Llama 3 8B Instruct": (0.944, 0.932), "Llama 3 70B Instruct": (0.883, 0.864)}
"""Accuracy without and with Unspecified in the paper (Sec. 5)."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A picture with its caption.

    Attributes:
        name: Name of its file.
        caption: How to read it, and the number of cases.
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
        yield from _made(_mcq(table.rows))
    for dialogues in read_dialogues(measured):
        yield from _made(accuracy_figure(dialogues))
        yield from _made(_calibration(dialogues))
    for changes in read_changes(measured):
        yield _change(changes)
    for episodes in read_episodes(done):
        yield _methods(episodes)


def _made(figure: Figure | None) -> list[Figure]:
    return [figure] if figure else []


def _methods(episodes: Sample) -> Figure:
    """The methods side by side: by the final state, and by each evaluator (Sec. 5)."""
    rows = method_rows(episodes)
    panels = [("state-based score", "score", "SD", "runs")]
    for by in headings_of_judges(episodes):
        heads = ("judge's score", "judge score", "judge SD", "runs judged")
        panels.append((heads[0] + by, heads[1] + by, heads[2] + by, heads[3] + by))

    def paint(figure: Any) -> None:
        axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for axis, (title, score, sd, _) in zip(axes, panels, strict=True):
            for x, row in enumerate(rows):
                value, spread = row[score], row[sd]
                if not isinstance(value, Estimate):
                    axis.text(x, 2, "no data", ha="center", color=GREY)
                    continue
                middle = 100 * value.value
                axis.bar(x, middle, 0.62, color=COLOURS[x % len(COLOURS)])
                if isinstance(spread, Estimate):
                    ends = middle - 100 * spread.value, middle + 100 * spread.value
                    axis.vlines(x, *ends, color=INK, lw=4.5, alpha=0.55)
                _whisker(axis.vlines, x, value, INK)
                axis.text(x + 0.1, middle + 1, f"{middle:.1f}", va="bottom")
            axis.set_xticks(range(len(rows)), [shortened(str(row["method"]), 16) for row in rows])
            axis.set_xlim(-0.6, len(rows) - 0.4)
            axis.set_title(shortened(title, 40))
        axes[0].set_ylim(0, 109)
        axes[0].set_yticks(range(0, 101, 20))
        axes[0].set_ylabel("% of the best score")

    counts = "; ".join(
        f"{title} " + ", ".join(f"{row[n]} {row['method']}" for row in rows)
        for title, _, _, n in panels
    )
    caption = (
        f"Methods: {episodes.title}. Thin bars: 95 % bootstrap interval over profiles. Thick bars: "
        "one pooled SD of the mean either way, as in the paper. "
        f"{len({run['profile'] for run in episodes.records})} profiles; n, runs: {counts}."
    )
    size = (1.1 + len(panels) * max(2.0, 0.85 * len(rows)), 2.9)
    return _figure(f"methods-{episodes.name}", caption, size, paint)


def _calibration(dialogues: Sample) -> Figure | None:
    """Reliability of each belief after the last turn; None if there are no beliefs."""
    names = (GOALSCOPE, AS_IN_PAPER, OUTRIGHT)
    found = {
        name: reliability_of(records)
        for name in names
        if (records := after_turn(dialogues, name, None))
    }
    if not found:
        return None

    def paint(figure: Any) -> None:
        axes = figure.subplots(1, len(found), sharey=True, squeeze=False)[0]
        for axis, (predictor, made) in zip(axes, found.items(), strict=True):
            _reliability(axis, predictor, made)
        axes[0].set_ylabel("share correct")

    caption = (
        f"Reliability after each dialogue's last turn: {dialogues.title}, "
        f"{number_of(dialogues)}. A point is a bin of confidence in the first "
        "choice, its area the number of dialogues; bars: Wilson's 95 % interval, as if dialogues "
        "were independent; dotted: calibrated."
    )
    return _figure(f"calibration-{dialogues.name}", caption, (0.6 + 2.3 * len(found), 2.9), paint)


def _reliability(axis: Any, predictor: str, made: Reliability) -> None:
    axis.plot((0, 1), (0, 1), color=INK, ls=":", lw=1)
    for sure, right, n in made.bins:
        interval = proportion(min(right * n, n), n)
        axis.vlines(sure, interval.low, interval.high, color=COLOURS[0], lw=1)
    sure, right, counts = zip(*made.bins, strict=True)
    areas = [8 + 90 * n / max(counts) for n in counts]
    axis.scatter(
        sure, right, areas, color=COLOURS[0], edgecolor="white", linewidth=0.6, zorder=3,
        clip_on=False,
    )  # fmt: skip
    axis.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), xlabel="confidence", box_aspect=1)
    axis.set_title(f"{predictor}: ECE {made.ece:.3f}")


def accuracy_figure(dialogues: Sample, turns: int = 10) -> Figure | None:
    """Accuracy of each predictor by turn; None if there are no predictions."""
    least = min(LEAST, len(after_turn(dialogues, UNIFORM, None)))
    shown = [
        turn
        for turn in (*range(1, turns + 1), None)
        if len(after_turn(dialogues, UNIFORM, turn)) >= least
        and (turn or after_turn(dialogues, UNIFORM, 2))  # the last where some have several
    ]
    lines = [
        name
        for name in PREDICTORS
        if name not in (UNIFORM, *SEEN.values())
        and len(after_turn(dialogues, name, shown[0])) >= least
    ]
    if not lines:
        return None
    ends = (0.5, len(shown) + 0.5)

    def paint(figure: Any) -> None:
        axis = figure.subplots()
        for i, name in enumerate(lines):
            shift = 0.09 * (i - (len(lines) - 1) / 2)
            style: dict[str, Any] = {"color": COLOURS[i], "marker": MARKERS[i], "ms": 4}
            joined: tuple[list[float], list[float]] = ([], [])
            for x, turn in enumerate(shown, 1):
                found = after_turn(dialogues, name, turn)
                estimate = mean_of(found, "top1", "percent")
                if estimate is None or len(found) < least:
                    continue
                _whisker(axis.vlines, x + shift, estimate, COLOURS[i])
                if turn is None:  # belongs to no line
                    axis.plot(x + shift, 100 * estimate.value, ls="", **style)
                else:
                    joined[0].append(x + shift)
                    joined[1].append(100 * estimate.value)
            line = "-" if name in (GOALSCOPE, OUTRIGHT) else "--"
            axis.plot(*joined, lw=1.4, ls=line, label=name, **style)
        uniform = [after_turn(dialogues, UNIFORM, turn) for turn in shown]
        chance = [mean_of(found, "top1") for found in uniform]
        height = [100 * each.value for each in chance if each]
        axis.plot(
            (ends[0], *range(1, len(shown) + 1), ends[1]), (height[0], *height, height[-1]),
            color=INK, ls=":", lw=1.2, label="chance",
        )  # fmt: skip
        axis.set(ylim=(-2.5, 102), xlim=ends, xlabel="turn, and number of dialogues that have it")
        axis.set_ylabel("accuracy, %")
        ticks = [
            f"{turn or 'last'}\nn = {len(found)}"
            for turn, found in zip(shown, uniform, strict=True)
        ]
        axis.set_xticks(range(1, len(shown) + 1), ticks)
        figure.legend(loc="outside right upper")

    caption = (
        f"Accuracy of the likeliest goal by turn: {dialogues.title}, n = "
        f"{number_of(dialogues)}; turns that fewer than {least} have are left out; "
        "at the turn called last, each has its own. Bars: 95 % bootstrap interval over groups of "
        "dialogues that share people."
    )
    return _figure(f"turns-{dialogues.name}", caption, (7.4, 3.3), paint)


def _change(changes: Sample) -> Figure:
    """Probability of the first and second goal by round, under each belief."""
    means_of: dict[str, Any] = {
        way: np.mean([each["probabilities"] for each in changes.where(belief=way)], axis=0)
        for way in dict.fromkeys(each["belief"] for each in changes.records)
    }
    change = changes.records[0]["round"]

    def paint(figure: Any) -> None:
        axis = figure.subplots()
        last = len(means_of[GOALSCOPE])
        for (way, means), colour in zip(means_of.items(), COLOURS, strict=False):
            rounds = range(last - len(means) + 1, last + 1)
            axis.plot(rounds, means[:, 1], color=colour, marker="o", ms=3, lw=1.4, label=way)
            axis.plot(rounds, means[:, 0], color=colour, ls="--", lw=1)
        axis.axvline(change - 0.5, color=INK, ls=":", lw=1)
        axis.set(ylim=(-0.02, 1.02), xlabel="round", ylabel="probability")
        axis.set_xticks(range(1, last + 1))
        figure.legend(loc="outside right upper")

    caption = (
        "Probability of the goal before the change (dashed), and of the one after it (solid), "
        f"mean: {changes.title}. Dotted: the change, at round {change}."
    )
    return _figure(f"change-{changes.name}", caption, (7.4, 3.3), paint)


def _mcq(rows: Sequence[Row]) -> Figure | None:
    """Accuracy on multiple-choice questions next to the paper's; None without results."""
    bars: dict[str, dict[str, Estimate]] = {}
    counts: dict[str, Any] = {}
    for row in rows:
        if isinstance(row["accuracy"], Estimate):
            label = f"{row['model']}: {row['prompt']}" if row["prompt"] else str(row["model"])
            counts.setdefault(label, row["n"])
            bars.setdefault(label, {})[str(row["Unspecified"])] = row["accuracy"]
    if not bars:
        return None
    colours = {"without": COLOURS[0], "with": COLOURS[1]}

    def paint(figure: Any) -> None:
        axis = figure.subplots()
        for y, values in enumerate(bars.values()):
            for unspecified, estimate in values.items():
                at = y + (0.2 if unspecified == "with" else -0.2)
                middle, dark = 100 * estimate.value, unspecified == "without"
                axis.barh(at, middle, 0.36, color=colours[unspecified])
                _whisker(axis.hlines, at, estimate, INK)
                axis.text(1, at, f"{middle:.1f}", va="center", fontsize=7.5, fontweight="bold",
                          color="white" if dark else INK)  # fmt: skip
        for model, values in PAPER.items():
            for value in values:
                axis.axvline(100 * value, color=INK, ls=":", lw=1.2)
            axis.text(100 * sum(values) / 2, -0.62, model.replace(" Instruct", ""),
                      ha="right" if "70B" in model else "left", fontsize=7.5)  # fmt: skip
        axis.set_yticks(range(len(bars)), [shortened(label, 44) for label in bars])
        axis.set(xlim=(0, 104), ylim=(len(bars) - 0.45, -0.5), xlabel="accuracy, %")
        axis.grid(visible=True, axis="x")
        axis.grid(visible=False, axis="y")
        for unspecified, colour in colours.items():
            axis.barh(0, 0, color=colour, label=f"{unspecified} Unspecified among the goals")
        figure.legend(loc="outside lower center", ncols=2)

    papers = ", ".join(f"{m} {100 * a:g} % and {100 * b:g} %" for m, (a, b) in PAPER.items())
    caption = (
        "Accuracy on multiple-choice questions. Bars: Wilson's 95 % interval. Dotted: the paper's "
        f"figures without Unspecified and with it: {papers}. "
        + "; ".join(f"{label} n = {n}" for label, n in counts.items())
        + " questions."
    )
    return _figure("accuracy", caption, (7.4, 1.3 + 0.5 * len(bars)), paint)


def _figure(name: str, caption: str, size: tuple[float, float], paint: Any) -> Figure:
    return Figure(name, caption, draw(name, caption.partition(". ")[0], size, paint))


def _whisker(lines: Any, at: float, value: Estimate, colour: str) -> None:
    """The interval of a percentage, by the axis' `vlines` or `hlines`."""
    if value.interval is not None:
        lines(at, 100 * value.interval.low, 100 * value.interval.high, color=colour, lw=1)
