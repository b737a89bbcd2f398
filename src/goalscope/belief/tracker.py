"""A belief over the goals of a person in dialogue, for any program that acts on it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import wraps
from threading import RLock
from typing import Any, Literal, TypeVar, cast, get_args

from goalscope.base.arrays import Array
from goalscope.base.inputs import nearest, parse_json
from goalscope.base.types import (
    UNSPECIFIED,
    Goal,
    GoalChange,
    InvalidInputError,
    Turn,
    canonical,
    checked_text,
    distinct,
    goals_of,
    readable,
)
from goalscope.belief.belief import Belief, belief_from_json, belief_to_json
from goalscope.belief.calibration import Calibration, calibration_named
from goalscope.belief.likelihood import (
    Likelihood,
    RolePlay,
    calibration_of,
    evidence_of,
    unusable,
)
from goalscope.models import LikelihoodModel, model_name
from goalscope.models.opening import embedded_scorer
from goalscope.models.trace import during

Correction = Literal["pin", "veto", "reword"]
"""How a person corrects the goals; see `GoalTracker.correct`."""


_Method = TypeVar("_Method", bound=Callable[..., Any])


def _synchronized(method: _Method) -> _Method:
    """A method of a tracker that waits until no other one runs."""

    @wraps(method)
    def waiting(tracker: GoalTracker, *args: Any, **kwargs: Any) -> Any:
        with tracker._busy:  # pyright: ignore[reportPrivateUsage] -- it is the tracker's own
            return method(tracker, *args, **kwargs)

    return cast("_Method", waiting)


class GoalTracker:
    """A belief over the goals of a person in one conversation, in any domain.

    A tracker is thread-safe. Trackers may share a model.

    Args:
        model: Scores the words; by default the embedded model.
        task: The assistant's task, in a sentence.
        goals: Goals to start with, besides `UNSPECIFIED`; None if they are to be added later.
        include_unspecified: Whether "no stated goal" is one of the hypotheses.
        likelihood: Evidence of a turn; by default the role-play likelihood of `model`.
        calibration: A `Calibration`, its name ("paper", "default") or a file of
            `goalscope calibrate`; None for that of the likelihood.

    Attributes:
        belief: Over the goals.
        turns: What was said.
        since: Number of turns before the newest goals were added. Those turns cannot tell whether
            others are missing.

    Raises:
        InvalidInputError: An argument cannot be used, such as goals that are none or repeated.
        ModelError: The embedded model cannot be opened.
    """

    def __init__(
        self,
        model: LikelihoodModel | None = None,
        *,
        task: str = "Help the human with what they want.",
        goals: Iterable[str | Goal] | None = None,
        include_unspecified: bool = True,
        likelihood: Likelihood | None = None,
        calibration: Calibration | str | None = None,
    ) -> None:
        if model is not None and (isinstance(model, type) or not hasattr(model, "token_logprobs")):
            raise InvalidInputError(
                f"model must be one that is open, such as open_model('model.gguf'), not {model!r}. "
                "Goals are given as goals=[...]."
            )
        if likelihood is not None and (wrong := unusable(likelihood)):
            raise InvalidInputError(f"The likelihood {likelihood!r} cannot be used: {wrong}.")
        self.task = checked_text(task, "task")
        support = [UNSPECIFIED] if include_unspecified else []
        given = goals_of(() if goals is None else goals)
        if not given and goals is not None:
            raise InvalidInputError(
                "goals is empty. Name at least one, or leave goals out and add them later."
            )
        named = calibration_named(calibration) if isinstance(calibration, str) else calibration
        self.likelihood = likelihood or RolePlay(
            model or embedded_scorer(), similarity=named.similarity if named else None
        )
        self._busy = RLock()
        self.turns: list[Turn] = []
        self.since = 0
        self.belief = Belief.uniform(
            distinct([*support, *given]), named or calibration_of(self.likelihood)
        )

    def __getstate__(self) -> dict[str, Any]:
        """All but the lock; a copy gets its own."""
        return {name: value for name, value in self.__dict__.items() if name != "_busy"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__ |= state
        self._busy = RLock()

    def __repr__(self) -> str:
        """The task and the likeliest goals."""
        return f"GoalTracker({self.task!r}, {self.belief!r})"

    @_synchronized
    def observe(self, query: str, utterance: str, *, weight: float = 1.0) -> Belief:
        """Update the belief with a turn (Eq. 1); on an error it stays as it was.

        Args:
            query: What the person was asked.
            utterance: What they answered.
            weight: Weight of the evidence, from 0 to 1.

        Raises:
            InvalidInputError: The utterance is empty, a text is broken or too long for the model,
                or the weight is out of range.
        """
        if not 0 <= weight <= 1:
            raise InvalidInputError(f"weight must be a number from 0 to 1, not {weight!r}")
        said = Turn(readable(query, "query"), checked_text(utterance, "utterance"))
        turns = [*self.turns, said]
        (row,) = self._scored(self.belief.goals, turns, since=len(self.turns))
        self.belief = self.belief.observe(row, float(weight))
        self.turns = turns
        return self.belief

    @_synchronized
    def add(self, goals: Iterable[str | Goal]) -> Belief:
        """Add goals; each is scored on all past turns, as if it had been there from the start.

        A goal that is there already, apart from case, spaces and the final mark, is skipped.

        Raises:
            InvalidInputError: A goal is empty, broken, too long for the model or named twice, or
                the person has ruled it out.
        """
        added = [goal for goal in self._known(goals) if goal not in self.belief.goals]
        out = {canonical(goal.text) for goal in self.belief.ruled_out}
        if UNSPECIFIED in added:
            raise InvalidInputError(
                f"{UNSPECIFIED.text!r} stands for goals that are missing, and is no goal. "
                "GoalTracker(include_unspecified=True) has it."
            )
        for goal in added:
            if canonical(goal.text) in out:
                raise InvalidInputError(
                    f"{goal.text!r} was ruled out. If the person names it after all, pin it."
                )
        self._add(added)
        self.since = len(self.turns) if added else self.since
        return self.belief

    def _add(self, added: Sequence[Goal]) -> Belief:
        return self._among(self.belief.add(added, lambda new: self._scored(new, self.turns)))

    def _among(self, belief: Belief) -> Belief:
        """Take a belief over other goals; evidence that depends on all of them is made again."""
        if belief.goals != self.belief.goals and getattr(self.likelihood, "joint", False):
            belief = replace(belief, log_likelihood=self._scored(belief.goals, self.turns))
        self.belief = belief
        return belief

    @during(module="infer")
    def _scored(self, goals: Sequence[Goal], turns: Sequence[Turn], *, since: int = 0) -> Array:
        """[T - since, G] evidence in nats.

        Raises:
            InvalidInputError: The likelihood returned something else.
        """
        return evidence_of(self.likelihood, self.task, goals, turns, since=since)

    @_synchronized
    def drop(self, goals: Iterable[str | Goal]) -> Belief:
        """Remove goals; see `Belief.drop`.

        Raises:
            InvalidInputError: There is no such goal, or it is `UNSPECIFIED`.
        """
        gone = self._known(goals)
        for goal in gone:
            if goal == UNSPECIFIED:
                raise InvalidInputError(
                    f"{UNSPECIFIED.text!r} stands for goals that are missing, and stays. "
                    "GoalTracker(include_unspecified=False) does without it."
                )
            if goal not in self.belief.goals:
                raise InvalidInputError(
                    f"There is no goal {goal.text!r} to drop; {self._nearest(goal)}"
                )
        return self._among(self.belief.drop(gone))

    @_synchronized
    def pin(self, goal: str | Goal) -> Belief:
        """Record that the person confirmed a goal, perhaps a new one; see `correct`."""
        self.correct("pin", goal)
        return self.belief

    @_synchronized
    def veto(self, goal: str | Goal) -> Belief:
        """Record that the person ruled out a goal; see `correct`."""
        self.correct("veto", goal)
        return self.belief

    @_synchronized
    def correct(self, correction: Correction, goal: str | Goal, text: str = "") -> list[GoalChange]:
        """Apply what the person says about a goal itself, and return what changed.

        Repeating a correction changes nothing.

        Args:
            correction: "pin" confirms the goal, perhaps a new one, in place of one that was
                confirmed before (see `Belief.pinned`). "veto" rules it out; it comes back only if
                it is pinned (see `Belief.ruled_out`). "reword" replaces it by the same goal in
                other words, and pins them.
            goal: The goal.
            text: The new words, for "reword".

        Raises:
            InvalidInputError: There is no such correction, goal or belief, or a text is empty or
                broken.
        """
        if correction not in get_args(Correction):
            raise InvalidInputError(
                f'A goal is corrected by "pin", "veto" or "reword", not {correction!r}.'
            )
        (named,) = self._known([goal])
        reworded = correction == "reword"
        (kept,) = self._known([checked_text(text, "new wording")]) if reworded else (named,)
        if UNSPECIFIED in (named, kept):
            raise InvalidInputError(
                f"There is no goal {UNSPECIFIED.text!r} to pin, veto or reword to."
            )
        if correction != "pin" and named not in self.belief.goals:
            out = canonical(named.text) in {canonical(each.text) for each in self.belief.ruled_out}
            if out and (correction == "veto" or kept in self.belief.goals):
                return []
            raise InvalidInputError(
                f"There is no goal {named.text!r} to correct; {self._nearest(named)}"
            )
        changes: list[GoalChange] = []
        if correction == "pin" and (len(self.belief.log_likelihood), kept) in self.belief.pinned:
            return []
        if correction != "veto":
            if kept not in self.belief.goals:
                changes.append(GoalChange("added", kept, "you named it", source="person"))
            self.belief = self._add([kept]).pin(kept)
            changes.append(GoalChange("pinned", kept, "you confirmed it"))
        if correction == "veto" or (correction == "reword" and changes[-1].goal != named):
            self._among(self.belief.rule_out(named))
            reason = "you ruled it out" if correction == "veto" else "you said it in other words"
            changes.append(GoalChange("removed", named, reason, final=True))
        return changes

    @_synchronized
    def to_json(self) -> str:
        """The tracker's state and its model's name, for `from_json`."""
        return json.dumps(
            {
                "task": self.task,
                "model": self._model_name,
                "turns": [[turn.query, turn.utterance] for turn in self.turns],
                "belief": belief_to_json(self.belief),
                "since": self.since,
            },
            allow_nan=False,
        )

    @classmethod
    def from_json(
        cls,
        text: str,
        model: LikelihoodModel | None = None,
        *,
        likelihood: Likelihood | None = None,
    ) -> GoalTracker:
        """The tracker that `to_json` wrote; nothing is scored again.

        Args:
            text: What `to_json` wrote.
            model: The same model as before. It is compared by name, or by class if it has none: a
                change of adapter or layout is not noticed.
            likelihood: The same likelihood as before.

        Raises:
            InvalidInputError: The text is something else, or the model is another one.
        """
        try:
            data = parse_json(text)
            belief = belief_from_json(data["belief"])
            turns = [
                Turn(readable(query, "query"), checked_text(utterance, "utterance"))
                for query, utterance in data["turns"]
            ]
            task, since = data["task"], data["since"]
            if since not in range(len(turns) + 1):
                raise ValueError(f"the newest goals came after {since!r} of {len(turns)} turns")
            if len(turns) != len(belief.log_likelihood):
                raise ValueError(f"{len(turns)} turns, a belief over {len(belief.log_likelihood)}")
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise InvalidInputError(
                f"This is not what GoalTracker.to_json wrote ({type(error).__name__}: {error})."
            ) from None
        tracker = cls(model, task=task, likelihood=likelihood)
        here = tracker._model_name
        saved = data.get("model", here)
        if saved != here:
            raise InvalidInputError(
                f"This tracker was saved with the model {saved}, and here is {here}. Give the one "
                "that it had, or let a new tracker observe its turns."
            )
        tracker.restore(belief, turns)
        tracker.since = since
        return tracker

    @property
    def _model_name(self) -> str:
        likelihood: Any = self.likelihood
        return str(model_name(getattr(likelihood, "model", likelihood)))

    def _nearest(self, goal: Goal) -> str:
        known = [each.text for each in self.belief.goals if each != UNSPECIFIED]
        return nearest(goal.text, known) if known else "there is none yet."

    def _known(self, goals: Iterable[str | Goal]) -> list[Goal]:
        return distinct(goals_of(goals), (UNSPECIFIED, *self.belief.goals))

    @property
    def notes(self) -> tuple[str, ...]:
        """What the person should know about the last update."""
        if not self.turns or not isinstance(self.likelihood, RolePlay):
            return ()
        start = self.likelihood.window(self.task, self.turns)
        if not start:
            return ()
        return (f"The conversation is long: the first {start} turns are no longer read.",)

    @_synchronized
    def restore(self, belief: Belief, turns: Sequence[Turn]) -> None:
        """Go back to an earlier state.

        Args:
            belief: A belief that this tracker had.
            turns: The turns that it was over.
        """
        self.belief, self.turns = belief, [*turns]
        self.since = min(self.since, len(self.turns))
