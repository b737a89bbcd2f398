"""What one round of Algorithm 1 leaves behind; an episode is its rounds, and what comes between."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from goalscope.types import GoalChange, StepResult, Turn

if TYPE_CHECKING:
    from goalscope.belief import Belief

__all__ = ["Round"]


@dataclass(frozen=True, eq=False)
class Round:
    """One pass of Algorithm 1: a turn, the belief after it, and what was done.

    Attributes:
        number: 1 for the first.
        turn: The agent's question and the person's reply.
        belief: After goals were added and removed; None for the No Goals method.
        changes: Goals that came and went, with reasons.
        results: Outcomes of the actions that stand, in order (undone plans are not in it).
        replans: How often a plan was impossible and made anew.
        status: The environment's status after the actions.
        notes: What the person should be told, such as turns dropped from a full context.
        question: What the agent has to ask next: leave for an act that cannot be undone.
        state: Fingerprint of the environment after the actions.
        terminated: Whether the task is complete.
        takes_back: Numbers of earlier rounds, the newest first, that this one takes back.
        reversals: How many of the results, the first ones, brought back what those had changed.
    """

    number: int
    turn: Turn
    belief: Belief | None
    changes: tuple[GoalChange, ...]
    results: tuple[StepResult, ...]
    replans: int
    status: str
    notes: tuple[str, ...]
    terminated: bool
    question: str = ""
    state: str = ""
    takes_back: tuple[int, ...] = ()
    reversals: int = 0
