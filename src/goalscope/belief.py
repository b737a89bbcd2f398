"""A belief over goals: the evidence table, and the posterior that follows from it (Eq. 1)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from goalscope.types import Goal

__all__ = ["Belief"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Belief:
    """Log-evidence for each goal, turn by turn; immutable.

    The table is the belief: the posterior is derived from it whenever it is asked for, so a goal
    can be added late or dropped without a trace, and no evidence can count twice. Eq. 2's sum over
    goals is the same for every goal and cancels in Eq. 1, so rows hold plain log-likelihoods.

    Attributes:
        goals: The support, `G` distinct goals.
        log_prior: [G] in nats, unnormalised.
        log_likelihood: [T, G] in nats, log P(u_t | g, q_t, transcript before t).
        temperature: Divides the summed evidence; above 1 the belief moves more slowly.
        evidence: Turns that count: "sum" for all of them, "last" for the last one only.

    Raises:
        ValueError: Shapes disagree, a goal occurs twice, a value is NaN or +inf, or the
            temperature is not positive.
    """

    goals: tuple[Goal, ...]
    log_prior: Array
    log_likelihood: Array
    temperature: float = 1.0
    evidence: str = "sum"

    def __post_init__(self) -> None:
        """Check every invariant that the arithmetic rests on."""
        if len(set(self.goals)) != len(self.goals):
            raise ValueError("goals must be distinct; Belief.add merges exact duplicates")
        g = len(self.goals)
        if self.log_prior.shape != (g,) or self.log_likelihood.shape[1:] != (g,):
            raise ValueError(
                f"{g} goals need log_prior [{g}] and log_likelihood [T, {g}], "
                f"not {self.log_prior.shape} and {self.log_likelihood.shape}"
            )
        for name, values in (
            ("log_prior", self.log_prior),
            ("log_likelihood", self.log_likelihood),
        ):
            if np.isnan(values).any() or np.isposinf(values).any():
                raise ValueError(f"{name} must not hold NaN or +inf; -inf means impossible")
        if not (np.isfinite(self.temperature) and self.temperature > 0):
            raise ValueError(f"temperature must be positive, not {self.temperature}")
        if self.evidence not in ("sum", "last"):
            raise ValueError(f'evidence must be "sum" or "last", not {self.evidence!r}')

    @classmethod
    def uniform(
        cls, goals: Iterable[Goal], *, temperature: float = 1.0, evidence: str = "sum"
    ) -> Belief:
        """A belief before any evidence, with a flat prior; exact duplicates merge."""
        support = tuple(dict.fromkeys(goals))
        g = len(support)
        return cls(support, np.zeros(g), np.zeros((0, g)), temperature, evidence)

    @property
    def log_evidence(self) -> Array:
        """[G] evidence in nats that counts, after the temperature."""
        rows = self.log_likelihood[-1:] if self.evidence == "last" else self.log_likelihood
        return rows.sum(axis=0) / self.temperature

    @property
    def log_posterior(self) -> Array:
        """[G] log P(g | transcript) in nats; all -inf where `is_degenerate`."""
        joint = self.log_prior + self.log_evidence
        peak = joint.max(initial=-np.inf)
        if np.isneginf(peak):
            return joint
        return (joint - peak) - np.log(np.exp(joint - peak).sum())

    @property
    def probability(self) -> Array:
        """[G] posterior probabilities; they sum to 1, or are all 0 where `is_degenerate`."""
        return np.exp(self.log_posterior)

    @property
    def is_degenerate(self) -> bool:
        """Whether no goal can have said what was said (or there is no goal at all)."""
        return bool(np.isneginf(self.log_prior + self.log_evidence).all())

    @property
    def entropy(self) -> float:
        """Posterior entropy in nats; 0 where `is_degenerate`."""
        p = self.probability
        p = p[p > 0]
        return float(max(0.0, -(p * np.log(p)).sum()))

    @property
    def effective_goals(self) -> float:
        """Number of equally likely goals with the same entropy, 1 to G."""
        return float(np.exp(self.entropy))

    def top(self, k: int | None = None) -> list[tuple[Goal, float]]:
        """The `k` likeliest goals with their probabilities, likeliest first; ties keep order."""
        p = self.probability
        order = np.argsort(-self.log_posterior, kind="stable")[:k]
        return [(self.goals[i], float(p[i])) for i in order]

    def observe(self, row: npt.ArrayLike) -> Belief:
        """Add one turn's evidence.

        Args:
            row: [G] log-likelihood of the turn's utterance under each goal, in nats.
        """
        values = np.asarray(row, dtype=np.float64).reshape(1, -1)
        if values.shape[1] != len(self.goals):
            raise ValueError(f"expected {len(self.goals)} log-likelihoods, got {values.shape[1]}")
        return replace(self, log_likelihood=np.vstack([self.log_likelihood, values]))

    def add(
        self, goals: Iterable[Goal], columns: Callable[[Sequence[Goal]], npt.ArrayLike]
    ) -> Belief:
        """Add goals, with their evidence over all past turns.

        A late goal stands exactly where it would, had it been tracked from the start. Its prior
        is that of the average present goal (0 nats in an empty belief). Goals that are already
        present change nothing.

        Args:
            goals: Goals to add.
            columns: Gives the [T, len(new)] log-likelihoods of the goals that are really new.
        """
        new = [goal for goal in dict.fromkeys(goals) if goal not in self.goals]
        if not new:
            return self
        turns = self.log_likelihood.shape[0]
        table = np.asarray(columns(new), dtype=np.float64).reshape(turns, len(new))
        prior = np.full(len(new), _log_mean(self.log_prior))
        return replace(
            self,
            goals=(*self.goals, *new),
            log_prior=np.concatenate([self.log_prior, prior]),
            log_likelihood=np.hstack([self.log_likelihood, table]),
        )

    def drop(self, goals: Iterable[Goal]) -> Belief:
        """Condition on the true goal being none of `goals`; unknown goals change nothing."""
        gone = set(goals)
        keep = [i for i, goal in enumerate(self.goals) if goal not in gone]
        return replace(
            self,
            goals=tuple(self.goals[i] for i in keep),
            log_prior=self.log_prior[keep],
            log_likelihood=self.log_likelihood[:, keep],
        )


def _log_mean(log_values: Array) -> float:
    """Log of the mean of exp(values); 0 for none, so that a first goal has prior 1."""
    peak = log_values.max(initial=-np.inf)
    if np.isneginf(peak):
        return 0.0
    return float(peak + np.log(np.exp(log_values - peak).mean()))
