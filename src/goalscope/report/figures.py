"""The figures of a report, each from what was measured, with what one must know to read it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from goalscope.episode import Round
from goalscope.experiment.predictors import (
    AS_IN_PAPER,
    GOALSCOPE,
    OUTRIGHT,
    PREDICTORS,
    SEEN,
    UNIFORM,
)
from goalscope.experiment.summary import Estimate, Table
from goalscope.experiment.summary_changes import Changes
from goalscope.experiment.summary_dialogues import Dialogues
from goalscope.experiment.summary_episodes import Episodes
from goalscope.report.drawing import COLOURS, GREY, INK, PALE, Drawing, draw, shortened
from goalscope.stats import Reliability, proportion
from goalscope.types import UNSPECIFIED, counted

__all__ = ["Figure", "accuracy_figure", "belief_figure", "calibration_figure", "change_figure",
           "mcq_figure", "methods_figure"]  # fmt: skip

RIBBONS = 9
"""Goals of an episode that have a ribbon of their own, besides Unspecified."""
RIBBON_COLOURS = (*COLOURS, "#882255", "#332288")
TURNS = 10
LEAST = 10
"""Dialogues that must have a turn that is drawn, unless there are fewer in all."""
MARKERS = "osD^vPX"
PAPER = {"Llama 3 8B Instruct": (0.944, 0.932), "Llama 3 70B Instruct": (0.883, 0.864)}
"""Accuracy without and with Unspecified, as the paper has it (Sec. 5)."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A picture, and what is said below it.

    Attributes:
        name: Of its files and its place on the page.
        caption: How to read it, with the number of cases.
        drawing: The picture.
        group: What it is shown with, such as a person; empty for what stands by itself.
    """

    name: str
    caption: str
    drawing: Drawing
    group: str = ""


def methods_figure(name: str, episodes: Episodes) -> Figure:
    """The methods side by side: by the state in the end, and by each evaluator (Sec. 5)."""
    table = episodes.by_method()
    panels = [("state-based score", "score", "SD", "runs")]
    panels += [
        ("judge's score" + by, "judge score" + by, "judge SD" + by, "runs judged" + by)
        for by in (c[len("judge score") :] for c in table.columns if c.startswith("judge score"))
    ]
    methods = episodes.methods

    def paint(figure: Any) -> None:
        axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for axis, (title, score, sd, _) in zip(axes, panels, strict=True):
            for x in range(len(methods)):
                value, spread = _entry(table, x, score), _entry(table, x, sd)
                if value is None:
                    axis.text(x, 2, "no data", ha="center", color=GREY)
                    continue
                axis.bar(x, 100 * value.value, 0.62, color=COLOURS[x % len(COLOURS)])
                if spread is not None:
                    low, high = value.value - spread.value, value.value + spread.value
                    axis.vlines(x, 100 * low, 100 * high, color=INK, lw=4.5, alpha=0.55)
                _whisker(axis, x, value)
                axis.text(x + 0.1, 100 * value.value + 1, f"{100 * value.value:.1f}", va="bottom")
            axis.set_xticks(range(len(methods)), [shortened(m, 16) for m in methods])
            axis.set_xlim(-0.6, len(methods) - 0.4)
            axis.set_title(shortened(title, 40))
        axes[0].set_ylim(0, 109)
        axes[0].set_yticks(range(0, 101, 20))
        axes[0].set_ylabel("% of the best score")

    counts = "; ".join(
        f"{title} "
        + ", ".join(f"{table.rows[i][table.columns.index(n)]} {m}" for i, m in enumerate(methods))
        for title, _, _, n in panels
    )
    spread = any(_entry(table, x, p[2]) for x in range(len(methods)) for p in panels)
    caption = (
        f"Methods: {episodes.title}. Thin bars: 95 % bootstrap interval over profiles."
        + (" Thick bars: one pooled SD of the mean either way, as in the paper." if spread else "")
        + f" {len({run.profile for run in episodes.runs})} profiles; n, runs: {counts}."
    )
    size = (1.1 + len(panels) * max(2.0, 0.85 * len(methods)), 2.9)
    return Figure(name, caption, draw(name, f"Bars of scores: {episodes.title}", size, paint))


def belief_figure(name: str, label: str, rounds: Sequence[Round], group: str) -> Figure | None:
    """Probability of each goal, round by round; None where no round has a belief."""
    believed = [round for round in rounds if round.belief is not None]
    if not believed:
        return None
    numbers = [round.number for round in rounds]
    table = _probabilities(rounds)
    peaks = sorted((g for g in table if g != UNSPECIFIED.text), key=lambda g: -max(table[g]))
    own = [g for g in table if g in peaks[:RIBBONS]]
    rest = [g for g in peaks if g not in own]
    layers: list[tuple[str, list[float], str]] = []
    if UNSPECIFIED.text in table:
        layers.append((UNSPECIFIED.text, table[UNSPECIFIED.text], GREY))
    if rest:
        sums = [math.fsum(values) for values in zip(*(table[g] for g in rest), strict=True)]
        layers.append((counted(len(rest), "other goal"), sums, PALE))
    layers += [(g, table[g], RIBBON_COLOURS[i]) for i, g in enumerate(own)]
    last = believed[-1].belief
    gone = set(table) - {goal.text for goal in last.goals} if last else set[str]()
    x = [float(n) for n in numbers]
    if len(x) == 1:  # a single round is a column
        x = [x[0] - 0.25, x[0] + 0.25]
        layers = [(text, values * 2, colour) for text, values, colour in layers]

    def paint(figure: Any) -> None:
        axis, side = figure.subplots(1, 2, width_ratios=(1, 1.25))
        axis.stackplot(
            x,
            [values for _, values, _ in layers],
            colors=[colour for _, _, colour in layers],
            edgecolor="white",
            linewidth=0.5,
        )
        axis.set(xlim=(x[0], x[-1]), ylim=(0, 1), xlabel="round", ylabel="probability")
        step = max(1, len(numbers) // 10)
        axis.set_xticks(numbers[::step])
        axis.set_yticks((0, 0.5, 1), ("0", "½", "1"))
        axis.grid(visible=False)
        side.set_axis_off()
        side.set(xlim=(0, 1), ylim=(max(len(layers), 6), 0))
        for row, (text, values, colour) in enumerate(reversed(layers)):
            side.bar(0, 0.56, 0.045, bottom=row + 0.22, align="edge", color=colour)
            share = "-" if text in gone else f"{100 * values[-1]:.0f} %"
            side.text(0.17, row + 0.5, share, va="center", ha="right", fontsize=8)
            side.text(0.2, row + 0.5, shortened(text, 58), va="center", fontsize=8)

    height = 0.75 + 0.185 * max(len(layers), 6)
    caption = (
        f"{label}: {counted(len(rounds), 'round')}, {counted(len(table), 'goal')}. Percentages: "
        "after the last round; -, the goal was gone."
    )
    drawing = draw(name, f"Belief over goals, round by round: {label}", (7.6, height), paint)
    return Figure(name, caption, drawing, group)


def calibration_figure(name: str, dialogues: Dialogues) -> Figure | None:
    """Reliability of each belief after the last turn; None where there is no such belief."""
    every = dialogues.reliabilities()
    found = {p: every[p] for p in (GOALSCOPE, AS_IN_PAPER, OUTRIGHT) if p in every}
    if not found:
        return None

    def paint(figure: Any) -> None:
        axes = figure.subplots(1, len(found), sharey=True, squeeze=False)[0]
        for axis, (predictor, made) in zip(axes, found.items(), strict=True):
            _reliability(axis, predictor, made)
        axes[0].set_ylabel("share correct")

    errors = "; ".join(
        f"{predictor}: ECE {made.ece:.3f} ({made.band.low:.3f} to {made.band.high:.3f}), "
        f"n = {made.n}"
        for predictor, made in found.items()
    )
    caption = (
        f"Reliability after each dialogue's last turn: {dialogues.title}. A point is a bin of "
        "confidence in the first choice, its area the number of dialogues; bars: Wilson's 95 % "
        "interval, as if dialogues were independent; dotted: calibrated. In parentheses, where "
        f"95 % of a calibrated forecaster's errors lie. {errors}."
    )
    size = (0.6 + 2.3 * len(found), 2.9)
    drawing = draw(name, f"Reliability diagrams: {dialogues.title}", size, paint)
    return Figure(name, caption, drawing)


def accuracy_figure(name: str, dialogues: Dialogues) -> Figure | None:
    """Accuracy of each predictor by turn; None where nothing was predicted."""
    least = min(LEAST, dialogues.n)
    every = dialogues.accuracy_by_turn(TURNS)
    found = {p: [row for row in rows if row[1] >= least] for p, rows in every.items()}
    apart = (UNIFORM, *SEEN.values())
    lines = [p for p in PREDICTORS if found[p] and p not in apart]
    if not lines:
        return None
    counts = {turn: n for turn, n, _ in found[UNIFORM]}
    places = {turn: place for place, turn in enumerate(counts, 1)}
    ends = (0.5, len(places) + 0.5)

    def paint(figure: Any) -> None:
        axis = figure.subplots()
        for i, predictor in enumerate(lines):
            shift = 0.09 * (i - (len(lines) - 1) / 2)
            rows = found[predictor]
            at = [places[turn] + shift for turn, _, _ in rows]
            values = [100 * estimate.value for _, _, estimate in rows]
            style: dict[str, Any] = {"color": COLOURS[i], "marker": MARKERS[i], "ms": 4}
            line = "-" if predictor in (GOALSCOPE, OUTRIGHT) else "--"
            apart = len(rows) - (rows[-1][0] is None)  # the last turn belongs to no line
            axis.plot(at[:apart], values[:apart], lw=1.4, ls=line, label=predictor, **style)
            axis.plot(at[apart:], values[apart:], ls="", **style)
            for x, (_, _, estimate) in zip(at, rows, strict=True):
                if estimate.interval is not None:
                    low, high = estimate.interval.low, estimate.interval.high
                    axis.vlines(x, 100 * low, 100 * high, color=COLOURS[i], lw=0.9)
        chance = [100 * estimate.value for _, _, estimate in found[UNIFORM]]
        axis.plot(
            (ends[0], *places.values(), ends[1]), (chance[0], *chance, chance[-1]),
            color=INK, ls=":", lw=1.2, label="chance",
        )  # fmt: skip
        axis.set(ylim=(-2.5, 102), xlim=ends, xlabel="turn, and number of dialogues that have it")
        axis.set_ylabel("accuracy, %")
        ticks = [f"{turn or 'last'}\nn = {n}" for turn, n in counts.items()]
        axis.set_xticks([*places.values()], ticks)
        figure.legend(loc="outside right upper")

    caption = (
        f"Accuracy of the likeliest goal by turn: {dialogues.title}. "
        f"n = {counted(dialogues.n, 'dialogue')}; later turns have those that are longer, and "
        f"turns that fewer than {least} have are left out; at the turn called last, each has its "
        "own. Bars: 95 % bootstrap interval over groups of dialogues that share people; none where "
        "there is a single group."
    )
    drawing = draw(name, f"Accuracy by turn: {dialogues.title}", (7.4, 3.3), paint)
    return Figure(name, caption, drawing)


def change_figure(name: str, changes: Changes) -> Figure:
    """Probability of the first and of the second goal by round, under each belief."""

    def paint(figure: Any) -> None:
        axis = figure.subplots()
        for way, colour in zip(changes.beliefs, COLOURS, strict=False):
            means = changes.probabilities(way)
            rounds = range(changes.rounds - len(means) + 1, changes.rounds + 1)
            axis.plot(rounds, means[:, 1], color=colour, marker="o", ms=3, lw=1.4, label=way)
            axis.plot(rounds, means[:, 0], color=colour, ls="--", lw=1)
        axis.axvline(changes.round - 0.5, color=INK, ls=":", lw=1)
        axis.set(ylim=(-0.02, 1.02), xlabel="round", ylabel="probability")
        axis.set_xticks(range(1, changes.rounds + 1))
        figure.legend(loc="outside right upper")

    caption = (
        "Probability of the goal before the change (dashed), and of the one after it (solid): "
        f"{changes.title}. Mean of {counted(len(changes.groups), 'dialogue')}; dotted: the change, "
        f"at round {changes.round}."
    )
    title = f"Belief over a change of mind: {changes.title}"
    return Figure(name, caption, draw(name, title, (7.4, 3.3), paint))


def mcq_figure(name: str, table: Table) -> Figure | None:
    """Accuracy on multiple-choice questions beside that of the paper; None without any."""
    bars: dict[str, dict[str, Estimate]] = {}
    counts: list[str] = []
    baselines: set[str] = set()
    for model, prompt, unspecified, n, accuracy, *_ in table.rows:
        if isinstance(accuracy, Estimate):
            label = f"{model}: {prompt}" if prompt else str(model)
            if label not in bars:
                counts.append(f"{label} n = {n}")
            if not prompt:
                baselines.add(label)
            bars.setdefault(label, {})[str(unspecified)] = accuracy
    if not bars:
        return None
    colours = {"without": COLOURS[0], "with": COLOURS[1]}

    def paint(figure: Any) -> None:
        axis = figure.subplots()
        for y, (label, values) in enumerate(bars.items()):
            for side, (unspecified, estimate) in zip((-1, 1), values.items(), strict=False):
                at = y + (0.2 * side if len(values) > 1 else 0)
                colour = GREY if label in baselines else colours[unspecified]
                axis.barh(at, 100 * estimate.value, 0.36, color=colour)
                if estimate.interval is not None:
                    low, high = estimate.interval.low, estimate.interval.high
                    axis.hlines(at, 100 * low, 100 * high, color=INK, lw=1.2)
                dark = colour == colours["with"]
                axis.text(1, at, f"{100 * estimate.value:.1f}", va="center", fontsize=7.5,
                          fontweight="bold", color=INK if dark else "white")  # fmt: skip
        for model, values in PAPER.items():
            for value in values:
                axis.axvline(100 * value, color="white", lw=1.6, alpha=0.8)
                axis.axvline(100 * value, color=INK, ls=":", lw=1.2)
            axis.text(100 * sum(values) / 2, -0.62, shortened(model, 40).replace(" Instruct", ""),
                      ha="right" if "70B" in model else "left", fontsize=7.5)  # fmt: skip
        axis.set_yticks(range(len(bars)), [shortened(label, 44) for label in bars])
        axis.set(xlim=(0, 104), ylim=(len(bars) - 0.45, -0.5), xlabel="accuracy, %")
        axis.grid(visible=True, axis="x")
        axis.grid(visible=False, axis="y")
        for unspecified, colour in colours.items():
            axis.barh(0, 0, color=colour, label=f"{unspecified} Unspecified among the goals")
        figure.legend(loc="outside lower center", ncols=2)

    caption = (
        "Accuracy on multiple-choice questions. Bars: Wilson's 95 % interval. Dotted: the paper's "
        "figures without Unspecified and, to the left of it, with it: "
        + ", ".join(f"{m} {100 * a:g} % and {100 * b:g} %" for m, (a, b) in PAPER.items())
        + f". {'; '.join(counts)} questions."
    )
    size = (7.4, 1.3 + 0.5 * len(bars))
    return Figure(name, caption, draw(name, "Accuracy on multiple-choice questions", size, paint))


def _reliability(axis: Any, predictor: str, made: Reliability) -> None:
    axis.plot((0, 1), (0, 1), color=INK, ls=":", lw=1)
    for sure, right, n in made.bins:
        interval = proportion(min(right * n, n), n)
        axis.vlines(sure, interval.low, interval.high, color=COLOURS[0], lw=1)
    largest = max(n for _, _, n in made.bins)
    axis.scatter(
        [sure for sure, _, _ in made.bins],
        [right for _, right, _ in made.bins],
        [8 + 90 * n / largest for _, _, n in made.bins],
        color=COLOURS[0],
        edgecolor="white",
        linewidth=0.6,
        zorder=3,
        clip_on=False,
    )
    axis.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), xlabel="confidence", box_aspect=1)
    ticks = ((0, 0.25, 0.5, 0.75, 1), ("0", ".25", ".5", ".75", "1"))
    axis.set_xticks(*ticks)
    axis.set_yticks(*ticks)
    axis.set_title(f"{predictor}: ECE {made.ece:.3f}")


def _probabilities(rounds: Sequence[Round]) -> Mapping[str, list[float]]:
    """Of each goal in each round, 0 before it came and after it went; in the order they came."""
    table: dict[str, list[float]] = {}
    for i, round in enumerate(rounds):
        if round.belief is None:
            continue
        for goal, value in zip(round.belief.goals, round.belief.probability, strict=True):
            table.setdefault(goal.text, [0.0] * len(rounds))[i] = float(value)
    return table


def _entry(table: Table, row: int, column: str) -> Estimate | None:
    found = table.rows[row][table.columns.index(column)]
    return found if isinstance(found, Estimate) else None


def _whisker(axis: Any, x: float, value: Estimate) -> None:
    if value.interval is not None:
        low, high = value.interval.low, value.interval.high
        axis.vlines(x, 100 * low, 100 * high, color=INK, lw=1.1)
        axis.hlines((100 * low, 100 * high), x - 0.07, x + 0.07, color=INK, lw=1.1)
