"""Several models on the same dialogues: how good each is, and how far from the first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from goalscope.experiment.predictors import AS_IN_PAPER, GOALSCOPE
from goalscope.experiment.summary import NO_INTERVAL, Entry, Estimate, Table, slug
from goalscope.experiment.summary_beliefs import PAPERS
from goalscope.experiment.summary_dialogues import Dialogues, Outcome, mean_of
from goalscope.types import counted

__all__ = ["model_tables"]

COLUMNS = (
    "model",
    "turn",
    "n",
    "top-1",
    "top-1, difference",
    "log-loss",
    "log-loss, difference",
    f"{PAPERS}: log-loss, difference",
    "open-set AUROC",
)
TURNS = (1, 2, 3, None)
"""Turns that are shown; None for each dialogue's last."""

NOTES = (
    "goalscope with each model, as in the tables of each. Difference: from the first model, on the "
    "dialogues that both have met, in the same words and with the same goals; less log-loss is "
    "better. AUROC: is the goal in the set?",
    f"Each model has the calibration known for it, or the usual one. {PAPERS}: without any, "
    "so that only the models differ.",
    "Intervals are 95 %, by a bootstrap that resamples whole groups of dialogues that share "
    f"people. {NO_INTERVAL}",
)


def model_tables(found: Iterable[Dialogues], *, command: str = "") -> Iterator[Table]:
    """A table for each task that more than one model has met.

    Args:
        found: Of each task and model; the first model is what the others are compared with.
        command: What makes it again.
    """
    tasks: dict[str, list[Dialogues]] = {}
    for each in found:
        tasks.setdefault(each.task, []).append(each)
    for task, (first, *others) in tasks.items():
        longer = any((GOALSCOPE, 2) in each.outcomes for each in (first, *others))
        rows = [
            _row(each, first, turn)
            for turn in (TURNS if longer else TURNS[:1])
            for each in (first, *others)
            if each.outcomes.get((GOALSCOPE, turn))
        ]
        if others:
            unlike = sum(_unlike(each, first) for each in others)
            changed = (
                f"NOT compared: {counted(unlike, 'dialogue')} that the first model met in other "
                "words or with other goals, as they were corrected in between. Measure them anew.",
            )
            yield Table(
                f"models-{slug(task)}",
                f"Models compared: {task}",
                COLUMNS,
                tuple(rows),
                (*(changed if unlike else ()), *NOTES),
                command,
            )


def _row(own: Dialogues, first: Dialogues, turn: int | None) -> tuple[Entry, ...]:
    after = "last" if turn is None else str(turn)
    outcomes = own.outcomes[GOALSCOPE, turn]
    groups = [each.group for each in outcomes]
    row: list[Entry] = [own.model, after, len(outcomes)]
    for field in ("top1", "log_loss"):
        row.append(mean_of([_value(each, field) for each in outcomes], groups, field))
        row.append(_difference(own, first, GOALSCOPE, turn, field))
    return (*row, _difference(own, first, AS_IN_PAPER, turn, "log_loss"), own.area(turn))


def _difference(
    own: Dialogues, first: Dialogues, predictor: str, turn: int | None, field: str
) -> Estimate | None:
    """How much more a figure is than with the first model, on the dialogues of both."""
    before = _by_id(first, predictor, turn)
    pairs = [
        (each, before[id])
        for id, each in _by_id(own, predictor, turn).items()
        if id in before and before[id].case == each.case
    ]
    gaps = [_value(one, field) - _value(other, field) for one, other in pairs]
    if own is first or not gaps:
        return None
    return mean_of(gaps, [each.group for each, _ in pairs], field)


def _unlike(own: Dialogues, first: Dialogues) -> int:
    """Dialogues that both have met, and not in the same words with the same goals."""
    before = _by_id(first, GOALSCOPE, None)
    met = _by_id(own, GOALSCOPE, None)
    return sum(id in before and before[id].case != each.case for id, each in met.items())


def _by_id(found: Dialogues, predictor: str, turn: int | None) -> dict[str, Outcome]:
    return {each.case["id"]: each for each in found.outcomes.get((predictor, turn), ())}


def _value(outcome: Outcome, field: str) -> float:
    return getattr(outcome.scores, field)
