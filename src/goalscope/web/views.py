"""Episodes, rounds and beliefs as JSON for the page and other programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, AliasPath, BaseModel, BeforeValidator, Field, computed_field

from goalscope.agent import round as episodes
from goalscope.agent.agent import NO_GOAL
from goalscope.agent.people import AGREES, DECLINES
from goalscope.base.text import model_shown
from goalscope.base.types import TRACKING, UNSPECIFIED, pluralize
from goalscope.belief import belief as beliefs
from goalscope.belief.advice import Advice
from goalscope.belief.explain import Reason, in_words
from goalscope.envs.registry import BUILT_IN, View, domain_named
from goalscope.language.orders import Order, order_in_words
from goalscope.storage.store import EpisodeInfo
from goalscope.storage.tracking import Tracked


class RequestBody(BaseModel, extra="forbid"):
    """Base of request bodies. Unknown fields are errors: a typo must not mean the default."""


def explained(faults: Any, body: type[BaseModel]) -> str:
    """What is wrong with the fields of a body, in a sentence; unknown fields come first.

    Args:
        faults: The errors that pydantic found.
        body: What was expected.
    """
    fault = next((each for each in faults if each["type"] == "extra_forbidden"), faults[0])
    name = ".".join(str(part) for part in fault["loc"] if part != "body")
    takes = f"It takes {', '.join(body.model_fields)}."
    if fault["type"] == "extra_forbidden":
        return f"There is no field {name!r}. {takes}"
    if fault["type"] == "missing" and name:
        return f"The field {name!r} is missing. {takes}"
    return f"{name}: {fault['msg']}. {takes}"


class GoalView(BaseModel):
    """A goal with its probability; `pinned` if it is the one that the person confirmed last."""

    text: str
    probability: float
    unspecified: bool
    pinned: bool


class BeliefView(BaseModel):
    """A belief, likeliest goal first.

    `entropy` is in nats. `set_90` holds the true goal in 90 % of dialogues; it is null if the
    calibration gives no such set. `degenerate`: no goal explains what was said.
    """

    goals: list[GoalView]
    entropy: float
    set_90: list[str] | None
    degenerate: bool

    @classmethod
    def of(cls, belief: beliefs.Belief) -> BeliefView:
        """The view of a belief."""
        pinned = {goal for _, goal in belief.pinned}
        return cls(
            goals=[
                GoalView(
                    text=goal.text,
                    probability=probability,
                    unspecified=goal == UNSPECIFIED,
                    pinned=goal in pinned,
                )
                for goal, probability in belief.top()
            ],
            entropy=belief.entropy,
            set_90=[goal.text for goal in belief.conformal_set(0.1)]
            if any(eps <= 0.1 for eps, _ in belief.calibration.thresholds)
            else None,
            degenerate=belief.is_degenerate,
        )


class ChangeView(BaseModel, from_attributes=True):
    """A goal that was added, removed or confirmed, and why; of a `GoalChange`."""

    kind: Literal["added", "removed", "pinned"]
    goal: str = Field(validation_alias=AliasPath("goal", "text"))
    reason: str
    final: bool


class ActionView(BaseModel, from_attributes=True):
    """An action and its result; of a `StepResult`."""

    text: Annotated[str, BeforeValidator(str)] = Field(validation_alias="action")
    ok: bool
    observation: str
    irreversible: bool


class RoundView(BaseModel):
    """One round: words, belief and actions.

    `understood` is how the words were read, one order each. `state` is the fingerprint of the state
    after the round. The page shows `belief_note` beside the belief, or in place of one that was not
    inferred, and `notes` below the actions.
    """

    number: int
    query: str
    utterance: str
    understood: list[str]
    belief: BeliefView | None
    belief_note: str
    changes: list[ChangeView]
    actions: list[ActionView]
    replans: int
    status: str
    notes: list[str]
    question: str
    state: str
    terminated: bool

    @classmethod
    def of(cls, round: episodes.Round) -> RoundView:
        """The view of a round."""
        order: list[str] = []
        if round.belief.goals and not round.belief.inferred:
            ranked = (goal.text.rstrip(".") for goal, _ in round.belief.top())
            order.append(f"The model's order of the goals: {'; '.join(ranked)}.")
        values = {each.name: getattr(round, each.name) for each in fields(round)}
        read = round.reading.orders if round.reading else ()
        values |= {
            "query": round.turn.query,
            "utterance": round.turn.utterance,
            "understood": [order_in_words(each) for each in read if each != Order("aim")],
            "belief": BeliefView.of(round.belief) if round.belief.inferred else None,
            "belief_note": " ".join([*order, *(each for each in round.notes if each == NO_GOAL)]),
            "actions": round.results,
            "notes": [note for note in round.notes if note != NO_GOAL],
        }
        return cls.model_validate(values)


class EpisodeView(BaseModel, from_attributes=True):
    """An episode without its rounds.

    `first_words` is what the person said first, cut short. `view` is how its states are shown; it
    is null if another program acts, and goalscope only tracks the goals.
    """

    id: str
    created: str
    domain: str
    profile: str | None
    method: str
    model: Annotated[str, AfterValidator(model_shown)]
    task: str
    ended: Literal["terminated", "truncated"] | None
    score: float | None
    rounds: int
    first_words: str

    @computed_field
    @property
    def view(self) -> View | None:
        """The view of its domain; a file of one's own need not have been run."""
        if self.domain == TRACKING:
            return None
        return domain_named(self.domain).view if self.domain in BUILT_IN else "text"


class StoredEpisode(BaseModel):
    """An episode with its rounds."""

    episode: EpisodeView
    rounds: list[RoundView]

    @classmethod
    def of(cls, info: EpisodeInfo, rounds: Sequence[episodes.Round]) -> StoredEpisode:
        """The view of an episode."""
        return StoredEpisode(
            episode=EpisodeView.model_validate(info), rounds=[*map(RoundView.of, rounds)]
        )


class Confirm(BaseModel, from_attributes=True):
    """An irreversible action that waits until exactly this state is confirmed; of a `Round`.

    `yes` and `no` are the words that answer the question.
    """

    state: str
    status: str
    question: str
    yes: str = AGREES
    no: str = DECLINES


class Live(BaseModel):
    """The live state of a running episode.

    Attributes:
        version: Grows with each change, also over restarts of the server.
        phase: "idle" for the person's turn, "thinking" while the agent works or waits for the
            model.
        step: What the agent is doing.
        query: The question that it asks; None until it is chosen.
        round: Number of the next utterance's round; 0 while the episode is being opened.
        utterance: The words that the agent is processing, or failed on.
        belief: With the corrections since the last round.
        changes: These corrections.
        can_undo: Whether the newest of them can be undone.
        confirm: The pending confirmation.
        completion_phrase: Words that end the task.
        error: Why the last attempt failed.
    """

    version: int
    phase: Literal["idle", "thinking"]
    completion_phrase: str
    step: str = ""
    query: str | None = None
    round: int = 0
    utterance: str | None = None
    belief: BeliefView | None = None
    changes: list[ChangeView] = []
    can_undo: bool = False
    confirm: Confirm | None = None
    error: str | None = None


class TrackerView(BaseModel):
    """A tracking session after `turn` turns.

    `advice` is what to do next: "act" on the likeliest goal, "ask" the person, or "propose" goals,
    because none explains the words; `because` is the reason. Both are null if the session is
    closed. `in_words` explains the belief to the person: the goal, how sure it is, why, and the
    alternatives. `changes` lists goals added, removed or confirmed with that turn and since.
    """

    id: str
    task: str
    turn: int
    advice: Advice | None
    because: str | None
    in_words: str
    belief: BeliefView
    changes: list[ChangeView]
    notes: list[str]
    closed: bool

    @classmethod
    def of(cls, tracked: Tracked, *, top: int | None = None) -> TrackerView:
        """The view of a session, with at most so many goals."""
        closed = tracked.info.ended is not None
        advice, because = (None, None) if closed else tracked.advised
        belief, notes = BeliefView.of(tracked.belief), list(tracked.last.notes)
        if len(belief.goals) == 1 and not (closed or tracked.info.settings[TRACKING]):
            notes.append("There is no goal yet, so nothing can be inferred. Add some.")
        if top is not None and (count := len(belief.goals)) > top:
            notes.append(f"Of {count} goals, the {top} likeliest are shown.")
            belief.goals = belief.goals[:top]
            if belief.set_90 is not None and len(belief.set_90) > top:
                notes.append(f"The set of 90 % holds {pluralize(len(belief.set_90), 'goal')}.")
                belief.set_90 = None
        return cls(
            id=tracked.id,
            task=tracked.info.task,
            turn=len(tracked.turns),
            advice=advice,
            because=because,
            in_words=in_words(tracked.belief, tracked.turns, doubted=advice not in ("act", None)),
            belief=belief,
            changes=[*map(ChangeView.model_validate, tracked.last.changes)],
            notes=notes,
            closed=closed,
        )


class Why(BaseModel):
    """The evidence of each utterance for a goal."""

    goal: str
    reasons: list[Reason]
