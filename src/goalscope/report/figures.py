"""The figures of a report, each with a caption on how to read it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from goalscope.base.stats import Interval, Reliability, proportion
from goalscope.experiment.changes import read_changes
from goalscope.experiment.dialogues import (
    after_turn,
    number_of,
    read_dialogues,
    reliability_of,
)
from goalscope.experiment.episodes import read_episodes
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
from goalscope.report.drawing import COLOURS, INK, MARKERS, Figure, draw_figure, wrapped
from goalscope.report.methods import ablation_figure, method_figures

__all__ = ["Figure", "accuracy_figure", "figures_of", "truth_figure"]

_Line = tuple[str, Sequence[tuple[int, Estimate]]]
"""A predictor, and its figures by place on the axis (from 1)."""

LEAST = 10
"""Minimum number of dialogues for a turn to be drawn, unless there are fewer in all."""
PAPER = {"Llama 3 8B Instruct": (0.944, 0.932), "Llama 3 70B Instruct": (0.883, 0.864)}
"""Accuracy without and with Unspecified in the paper (Sec. 5)."""


def figures_of(cells: Sequence[Cell]) -> Iterator[Figure]:
    """The figures of the cells with results."""
    done = [cell for cell in cells if cell.result is not None]
    measured = [(cell.spec, cell.result or {}) for cell in done]
    for table in question_tables(measured):
        yield from _made(_mcq(table.rows))
    for dialogues in read_dialogues(measured):
        yield from _made(accuracy_figure(dialogues))
        yield from _made(truth_figure(dialogues))
        yield from _made(_calibration(dialogues))
    for changes in read_changes(measured):
        yield _change(changes)
    samples = read_episodes(done)
    yield from _made(ablation_figure(samples))
    for episodes in samples:
        yield from method_figures(episodes)


def _made(figure: Figure | None) -> list[Figure]:
    return [figure] if figure else []


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
    return draw_figure(
        f"calibration-{dialogues.name}", caption, (0.6 + 2.3 * len(found), 2.9), paint
    )


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
    shown = _turns(dialogues, turns)
    if after_turn(dialogues, UNIFORM, 2):
        shown.append(None)  # the last turn, where some dialogues have several

    def paint(axis: Any, lines: Sequence[_Line]) -> None:
        for i, (name, points) in enumerate(lines):
            shift = 0.09 * (i - (len(lines) - 1) / 2)
            style: dict[str, Any] = {"color": COLOURS[i], "marker": MARKERS[i], "ms": 4}
            joined: tuple[list[float], list[float]] = ([], [])
            for x, estimate in points:
                _whisker(axis.vlines, x + shift, estimate, COLOURS[i])
                if shown[x - 1] is None:  # belongs to no line
                    axis.plot(x + shift, 100 * estimate.value, ls="", **style)
                else:
                    joined[0].append(x + shift)
                    joined[1].append(100 * estimate.value)
            line = "-" if name in (GOALSCOPE, OUTRIGHT) else "--"
            axis.plot(*joined, lw=1.4, ls=line, label=name, **style)
        axis.set_ylabel("accuracy, %")

    return _by_turn(
        dialogues, shown, "turns", "Accuracy of the likeliest goal", "top1",
        "; at the turn called last, each has its own", paint,
        lambda axis: axis.plot([], [], "|", color=INK, ms=9),
    )  # fmt: skip


def truth_figure(dialogues: Sample, turns: int = 10) -> Figure | None:
    """Probability of the true goal by turn; None where too few dialogues have several turns."""
    if len(shown := _turns(dialogues, turns)) < 2:
        return None

    def paint(axis: Any, lines: Sequence[_Line]) -> None:
        for i, (name, points) in enumerate(lines):
            spans = [each.interval or Interval(each.value, each.value) for _, each in points]
            places = [x for x, _ in points]
            low, high = ([100 * getattr(span, end) for span in spans] for end in ("low", "high"))
            axis.fill_between(places, low, high, color=COLOURS[i], alpha=0.15, lw=0)
            axis.plot(
                places, [100 * each.value for _, each in points], color=COLOURS[i],
                marker=MARKERS[i], ms=4, lw=1.4, label=name,
                ls="-" if name in (GOALSCOPE, OUTRIGHT) else "--",
            )  # fmt: skip
        axis.set_ylabel("probability of the true goal, %")

    return _by_turn(
        dialogues, shown, "truth", "Probability of the true goal", "truth", "", paint,
        lambda axis: [axis.fill_between([], [], [], color=INK, alpha=0.15, lw=0)],
    )  # fmt: skip


def _turns(dialogues: Sample, turns: int) -> list[int | None]:
    """The turns up to a number that enough dialogues have."""
    least = _least(dialogues)
    each = range(1, turns + 1)
    return [turn for turn in each if len(after_turn(dialogues, UNIFORM, turn)) >= least]


def _least(dialogues: Sample) -> int:
    return min(LEAST, len(after_turn(dialogues, UNIFORM, None)))


def _by_turn(
    dialogues: Sample,
    shown: Sequence[int | None],
    name: str,
    measure: str,
    key: str,
    told: str,
    draw: Callable[[Any, Sequence[_Line]], None],
    sign: Callable[[Any], Sequence[Any]],
) -> Figure | None:
    """The mean of a measure by turn for each predictor, and for chance; None without predictors.

    Args:
        dialogues: What was measured.
        shown: Turns; None for each dialogue's last.
        name: First part of the figure's name.
        measure: What the lines show.
        key: Its key in the records.
        told: What else the caption says of the turns.
        draw: Draws the lines.
        sign: Draws the sign of an interval, for the legend.
    """
    least = _least(dialogues)

    def points_of(predictor: str) -> Iterator[tuple[int, Estimate]]:
        for x, turn in enumerate(shown, 1):
            found = [
                {**each, "truth": math.exp(-each["log_loss"])}
                for each in after_turn(dialogues, predictor, turn)
            ]
            if len(found) >= least and (estimate := mean_of(found, key, "percent")):
                yield x, estimate

    lines = [
        (predictor, points)
        for predictor in PREDICTORS
        if predictor not in (UNIFORM, *SEEN.values())
        and len(after_turn(dialogues, predictor, shown[0])) >= least
        and (points := [*points_of(predictor)])
    ]
    if not lines:
        return None
    ends = (0.5, len(shown) + 0.5)
    sure = any(estimate.interval for _, points in lines for _, estimate in points)

    def paint(figure: Any) -> None:
        axis = figure.subplots()
        draw(axis, lines)
        height = [100 * each.value for _, each in points_of(UNIFORM)]
        axis.plot(
            (ends[0], *range(1, len(shown) + 1), ends[1]), (height[0], *height, height[-1]),
            color=INK, ls=":", lw=1.2, label="chance",
        )  # fmt: skip
        axis.set(ylim=(-2.5, 102), xlim=ends, xlabel="turn, and number of dialogues that have it")
        counts = [len(after_turn(dialogues, UNIFORM, turn)) for turn in shown]
        ticks = [f"{turn or 'last'}\nn = {n}" for turn, n in zip(shown, counts, strict=True)]
        axis.set_xticks(range(1, len(shown) + 1), ticks)
        if sure:
            sign(axis)[0].set_label("95 % interval")
        figure.legend(loc="outside right upper")

    caption = (
        f"{measure} by turn: {dialogues.title}, n = {number_of(dialogues)}; turns that fewer than "
        f"{least} have are left out{told}. "
        + (
            "Intervals: 95 %, by a bootstrap over groups of dialogues that share people."
            if sure
            else "There are no intervals of a single group of dialogues."
        )
    )
    return draw_figure(f"{name}-{dialogues.name}", caption, (7.4, 3.3), paint)


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
    return draw_figure(f"change-{changes.name}", caption, (7.4, 3.3), paint)


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
        axis.set_yticks(range(len(bars)), [wrapped(label, 120, 34) for label in bars])
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
    return draw_figure("accuracy", caption, (7.4, 1.3 + 0.5 * len(bars)), paint)


def _whisker(lines: Any, at: float, value: Estimate, colour: str) -> None:
    """The interval of a percentage, by the axis' `vlines` or `hlines`."""
    if value.interval is not None:
        lines(at, 100 * value.interval.low, 100 * value.interval.high, color=colour, lw=1)
