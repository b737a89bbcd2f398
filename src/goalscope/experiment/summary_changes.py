"""People who change their mind: how soon a belief follows, and what it costs to expect that."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from goalscope.calibration import DEFAULT, PAPER, calibration_from_json
from goalscope.datasets.changes import AFTER
from goalscope.experiment.predictors import AS_IN_PAPER, GOALSCOPE, among_goals
from goalscope.experiment.summary import (
    NO_INTERVAL,
    Entry,
    Estimate,
    Measured,
    Row,
    Table,
    averaged,
    slug,
)
from goalscope.experiment.summary_dialogues import by_settings
from goalscope.types import pluralize

__all__ = ["FRESH", "Changes", "read_changes"]

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

AS_AGENT = "goalscope, an agent's"
FRESH = "goalscope, told of the change"
"""The evidence before the change is left out."""

NOTES = (
    "Each dialogue is scripted: turns of real people who had one goal, then of one who had another "
    f"({AFTER} turns). Followed within k rounds: the second goal was the likeliest after at least "
    "one of the first k turns of that person. Then, before the change: how often the first goal "
    "was the likeliest, in all of these rounds and in the last, and there its log-loss in nats.",
    f"{GOALSCOPE}: with the calibration known when it was measured; {AS_AGENT}: with that of an "
    f"agent that proposes its goals itself; {AS_IN_PAPER}: Bayes' rule as it stands in the paper; "
    f"{FRESH}: the evidence before the change is left out.",
    "Beliefs are over the goals alone. Intervals are 95 %, by a bootstrap that resamples whole "
    "groups of dialogues with the same first goal, since these begin with the same people's words. "
    f"{NO_INTERVAL}",
)


@dataclass(frozen=True, slots=True)
class Changes:
    """What beliefs made of one set of scripted changes of mind with one model.

    Attributes:
        set: Name of the data set.
        split: Which part of it.
        model: The model's label.
        round: The first round (from 1) of the second goal.
        groups: Of each dialogue.
        beliefs: [N, T, G] log-posteriors in nats after each turn, first those of the first and of
            the second goal, by the way in which they came about; T is `AFTER` for `FRESH`.
    """

    set: str
    split: str
    model: str
    round: int
    groups: tuple[str, ...]
    beliefs: Mapping[str, Array]

    @property
    def name(self) -> str:
        """For files."""
        return "-".join(map(slug, (self.set, self.split, self.model)))

    @property
    def title(self) -> str:
        """What changed, and with which model it was followed."""
        goals = self.beliefs[GOALSCOPE].shape[-1]
        return (
            f"{self.set}, {self.split}, {goals} random goals each, {self.model}, "
            f"{pluralize(len(self.groups), 'dialogue')}"
        )

    def table(self) -> Table:
        """In how many dialogues each belief follows, and holds the first goal before that."""
        rows: list[Row] = []
        last = self.round - 1
        for way, beliefs in self.beliefs.items():
            followed = np.logical_or.accumulate(_leads(beliefs[:, -AFTER:], 1), axis=1)
            row: dict[str, Entry] = {"belief": way, "n": len(self.groups)}
            row |= {f"followed within {k + 1}": self._share(followed[:, k]) for k in range(AFTER)}
            if way != FRESH:
                before = beliefs[:, :-AFTER]
                leads = _leads(before, 0)
                row[f"first goal leads, rounds 1-{last}"] = self._share(leads.mean(axis=1))
                row[f"round {last}"] = self._share(leads[:, -1])
                loss: list[float] = (-before[:, -1, 0]).tolist()
                row[f"log-loss, round {last}"] = averaged(loss, self.groups)
            rows.append(row)
        title = f"A change of mind at round {self.round}: {self.title}"
        return Table(f"changes-{self.name}", title, rows, NOTES)

    def probabilities(self, way: str) -> Array:
        """[T, 2] of the first and the second goal after each turn, mean over the dialogues."""
        mean: Array = np.exp(self.beliefs[way][:, :, :2]).mean(axis=0)
        return mean

    def _share(self, values: Array | Flags) -> Estimate | None:
        return averaged(values.astype(float).tolist(), self.groups, "percent")


def read_changes(cells: Iterable[Measured]) -> tuple[Changes, ...]:
    """The cells of the kind "change", for each set, split and model, in this order.

    Args:
        cells: Of any kind.
    """
    return tuple(
        Changes(
            name,
            split,
            model,
            group[0][0]["change"],
            tuple(spec["case"]["group"] for spec, _ in group),
            _beliefs(group),
        )
        for (name, split, _, model), group in by_settings(cells, "change")
    )


def _beliefs(cells: Sequence[Measured]) -> dict[str, Array]:
    found: dict[str, list[Array]] = {}
    for spec, result in cells:
        own = calibration_from_json(result["calibration"])
        ways = {
            GOALSCOPE: own,
            f"{GOALSCOPE}, without switching": replace(own, switching=0.0),
            AS_AGENT: DEFAULT,
            AS_IN_PAPER: PAPER,
        }
        table = np.array(result["role-play"], dtype=np.float64)
        pair = [spec["case"]["truth"], spec["case"]["second"]]
        table = np.column_stack([table[:, pair], np.delete(table, pair, axis=1)])
        for way, calibration in ways.items():
            found.setdefault(way, []).append(among_goals(table, calibration))
        found.setdefault(FRESH, []).append(among_goals(table[-AFTER:], own))
    return {way: np.stack(beliefs) for way, beliefs in found.items()}


def _leads(beliefs: Array, goal: int) -> Flags:
    """[N, T] whether this goal is likelier than each other one."""
    others: Array = np.delete(beliefs, goal, axis=2).max(axis=2)
    return beliefs[:, :, goal] > others
