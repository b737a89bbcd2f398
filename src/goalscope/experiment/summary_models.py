"""Several models on the same dialogues: how good each is, and how far from the first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from goalscope.experiment.predictors import GOALSCOPE
from goalscope.experiment.summary import NO_INTERVAL, Entry, Table, slug
from goalscope.experiment.summary_dialogues import Dialogues, Outcome, mean_of

__all__ = ["model_tables"]

COLUMNS = (
    "model",
    "turn",
    "n",
    "top-1",
    "top-1, difference",
    "log-loss",
    "log-loss, difference",
    "open-set AUROC",
)
TURNS = (1, 2, 3, None)
"""Turns that are shown; None for each dialogue's last."""

NOTES = (
    "goalscope with each model, as in the tables of each. Difference: from the first model, on the "
    "dialogues that both have met; less log-loss is better. AUROC: is the goal in the set?",
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
    for task, models in tasks.items():
        longer = any((GOALSCOPE, 2) in each.outcomes for each in models)
        rows = [
            _row(each, models[0], turn)
            for turn in (TURNS if longer else TURNS[:1])
            for each in models
            if each.outcomes.get((GOALSCOPE, turn))
        ]
        if len(models) > 1:
            yield Table(
                f"models-{slug(task)}",
                f"Models compared: {task}",
                COLUMNS,
                tuple(rows),
                NOTES,
                command,
            )


def _row(own: Dialogues, first: Dialogues, turn: int | None) -> tuple[Entry, ...]:
    after = "last" if turn is None else str(turn)
    outcomes = own.outcomes[GOALSCOPE, turn]
    row: list[Entry] = [own.model, after, len(outcomes)]
    before = {each.id: each for each in first.outcomes.get((GOALSCOPE, turn), ())}
    pairs = [(each, before[each.id]) for each in outcomes if each.id in before]
    groups, shared = [each.group for each in outcomes], [each.group for each, _ in pairs]
    for field in ("top1", "log_loss"):
        row.append(mean_of([_value(each, field) for each in outcomes], groups, field))
        gaps = [_value(one, field) - _value(other, field) for one, other in pairs]
        row.append(mean_of(gaps, shared, field) if gaps and own is not first else None)
    return (*row, own.area(turn))


def _value(outcome: Outcome, field: str) -> float:
    return getattr(outcome.scores, field)
