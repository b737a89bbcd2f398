"""The evaluators of episodes (Sec. 5.1): who they are, how they were asked, what they gave."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from goalscope.experiment.summary import Labels
from goalscope.judge import JUDGE_TEMPERATURE
from goalscope.types import counted

__all__ = ["JUDGE_NOTES", "Reading", "evaluator_of", "how_asked", "reading_of"]

TOP = 3.0
"""The best that the evaluator can give (Sec. 5)."""

JUDGE_NOTES = (
    "The judge's score is a share of its best, 3. Trials whose answer could not be read are "
    "counted as unscored and are in no mean; a run that left nothing scores 0 in all its trials.",
)


@dataclass(frozen=True, slots=True)
class Reading:
    """What one evaluator made of one run.

    Attributes:
        trials: Fractions of the best score; all 0 where the run left nothing (Sec. 5.1).
        unscored: Trials whose answer could not be read.
    """

    trials: tuple[float, ...]
    unscored: int


def reading_of(spec: Mapping[str, Any], result: Mapping[str, Any], *, empty: bool) -> Reading:
    """A cell of the kind "judge"; `empty` where the run left nothing."""
    given = [trial["score"] for trial in result["trials"]]
    if spec["empty"] or empty:
        return Reading((0.0,) * (len(given) or spec["trials"]), 0)
    scored = tuple(score / TOP for score in given if score is not None)
    return Reading(scored, len(given) - len(scored))


def evaluator_of(spec: Mapping[str, Any]) -> dict[str, Any]:
    """What tells evaluators apart, of a cell of the kind "judge" or "compare"."""
    return {name: spec.get(name) for name in ("model", "trials", "comparisons", "seed")}


def how_asked(
    specs: Iterable[Mapping[str, Any]], labels: Labels, acting: Mapping[str, Any]
) -> tuple[str, ...]:
    """Each evaluator once: its name, how often and how warm it was asked, and whether it acted.

    Args:
        specs: Of cells of the kind "judge" or "compare".
        labels: Names of the evaluators.
        acting: The model whose runs they saw.
    """
    told: dict[str, None] = {}
    for spec in specs:
        often = (
            f"{counted(spec['comparisons'], 'time')} in each order of two runs"
            if spec["kind"] == "compare"
            else f"{counted(spec['trials'], 'time')} about each run"
        )
        also = (
            " It is the model that also acted." if _writer(spec["model"]) == _writer(acting) else ""
        )
        told[
            f"The judge {labels[evaluator_of(spec)]} was asked {often}, at temperature "
            f"{JUDGE_TEMPERATURE:g} (the paper has 0).{also}"
        ] = None
    return tuple(told)


def _writer(model: Mapping[str, Any]) -> object:
    return model.get("generator") or model.get("model")
