"""Beliefs over the goals of people who talk with other programs; the store keeps every turn."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from threading import Lock
from typing import Any

from goalscope.advice import Advice, Advised, advised
from goalscope.belief import Belief
from goalscope.calibration import DEFAULT, calibration_from_json
from goalscope.calibrations import calibration_named
from goalscope.domains import Settings, roleplay_of, settings_of
from goalscope.episode import Round
from goalscope.goals import GoalManager, made_from
from goalscope.models import Model, model_name
from goalscope.modules import modules_of
from goalscope.store import EpisodeInfo, Store
from goalscope.tracker import YOURS, Correction, GoalTracker
from goalscope.types import (
    TRACKING,
    UNSPECIFIED,
    ConflictError,
    Goal,
    GoalChange,
    InvalidInputError,
    Turn,
    checked_text,
    distinct,
    goals_of,
    readable,
)
from goalscope.why import Reason, reasons

__all__ = ["Tracked", "Trackers"]

GOALS, TURNS = 200, 200
"""Most goals and turns of a session."""

LONGEST, LONGEST_GOAL = 4000, 500
"""Characters of a task, a query or an utterance, and of a goal."""

KEPT = 16
"""Sessions whose rounds stay in memory."""

GIVEN = "it was given"
TOO_MANY = f"A session has at most {GOALS} goals. Rule some out, or leave some away."


@dataclass(frozen=True, eq=False, slots=True)
class Tracked:
    """How a session stands after a turn.

    Attributes:
        id: Of the session, which is an episode of the store.
        task: The assistant's task.
        turns: What was said so far.
        belief: Over the goals and `UNSPECIFIED`, with the corrections since the last turn.
        changes: Goals that came, went or were confirmed with the last turn and since.
        notes: What should be known of how the last turn was understood.
        closed: Whether no turn can follow.
        made_from: See `goalscope.goals.incomplete`.
        proposed: See `goalscope.advice.advice`.
    """

    id: str
    task: str
    turns: tuple[Turn, ...]
    belief: Belief
    changes: tuple[GoalChange, ...]
    notes: tuple[str, ...]
    closed: bool
    made_from: int
    proposed: Mapping[Goal, int]

    @property
    def advice(self) -> Advice:
        """What an assistant should do next; see `goalscope.advice.advice`."""
        return self.advised.advice

    @property
    def advised(self) -> Advised:
        """The same, and why."""
        return advised(self, since=self.made_from, proposed=self.proposed)


class Trackers:
    """Tracking sessions. What a call has changed is on disk when it returns.

    Threads may share it; what needs the model is done one at a time, and reading waits for nobody.

    Args:
        store: Keeps the sessions, as episodes of the domain `TRACKING`.
        model: Opens the model, or returns the one that is open.
        defaults: Settings of new sessions: the model's, layout, end of turn, calibration, seed.
    """

    def __init__(
        self, store: Store, model: Callable[[], Model], defaults: Settings | None = None
    ) -> None:
        self._store, self._model = store, model
        self._defaults = defaults or Settings()
        self._lock, self._remembering = Lock(), Lock()
        self._known: OrderedDict[str, tuple[Round, ...]] = OrderedDict()

    def open(
        self,
        task: str,
        goals: Iterable[str | Goal] = (),
        *,
        propose: bool = False,
        owner: str | None = None,
    ) -> Tracked:
        """Begin a session.

        Args:
            task: The assistant's task, in a sentence.
            goals: What the person may want.
            propose: Whether the model proposes goals when none explains the words, and takes its
                own out again.
            owner: Whose session it is.

        Raises:
            InvalidInputError: A text is empty, broken or too long, or the goals are too many.
        """
        settings = self._defaults
        task = checked_text(task, "task", LONGEST)
        with self._lock:
            model = self._model()
            likelihood = roleplay_of(settings, model)
            tracker = GoalTracker(task=task, likelihood=likelihood)
            given = _new(tracker.belief, goals)
            tracker.add(given)  # refuses goals with too many tokens
            calibration = DEFAULT if propose and not given else likelihood.calibration
            if settings.calibration:
                calibration = calibration_named(settings.calibration)
            begun: dict[str, Any] = {
                "goals": [goal.text for goal in given],
                "propose": propose,
                "calibration": asdict(calibration),
                "changes": [],
            }
            id = self._store.begin(
                domain=TRACKING,
                method="good",
                model=model_name(model),
                task=task,
                settings={**asdict(settings), TRACKING: begun},
                owner=owner,
            )
        return self.read(id)

    def read(self, id: str) -> Tracked:
        """How a session stands.

        Raises:
            InvalidInputError: There is no such session.
        """
        return self._load(id).tracked()

    def observe(self, id: str, turn: int | None, query: str, utterance: str) -> Tracked:
        """Take in what the person said.

        The same turn told again changes nothing, and is answered as the first time (with the
        corrections since, if it is the last one).

        Args:
            id: Of the session.
            turn: 1 for the first; None for the next.
            query: What the assistant had said; may be empty.
            utterance: What the person answered.

        Raises:
            ConflictError: The turn was told in other words, is not the next one, or the session is
                closed or belongs to another model.
            InvalidInputError: There is no such session, or a text is broken or too long.
        """
        query = checked_text(query, "query", LONGEST) if readable(query, "query").strip() else ""
        said = Turn(query, checked_text(utterance, "utterance", LONGEST))
        if turn is not None and not hasattr(turn, "__index__"):
            raise InvalidInputError(
                f"turn must be a whole number, 1 for the first, or None for the next, not {turn!r}."
            )
        with self._lock:
            session = self._load(id)
            rounds = session.rounds
            turn = len(rounds) + 1 if turn is None else turn
            if 1 <= turn <= len(rounds):
                if rounds[turn - 1].turn != said:
                    raise ConflictError(f"Turn {turn} was told before with different words.")
                return replace(session, rounds=rounds[:turn]).tracked()
            if turn != len(rounds) + 1:
                raise ConflictError(f"The next turn is {len(rounds) + 1}, not {turn}.")
            if turn > TURNS:
                raise ConflictError(f"A session has at most {TURNS} turns. Open another one.")
            model, tracker = self._resumed(session)
            tracker.observe(said.query, said.utterance)
            changes = session.managed(model, tracker)
            round = Round(
                number=turn,
                turn=said,
                belief=tracker.belief,
                changes=(*(() if rounds else session.earlier), *changes),
                results=(),
                replans=0,
                status="",
                notes=tracker.notes,
                terminated=False,
            )
            self._store.append(id, round, after=rounds[-1] if rounds else session.info.settings)
            return replace(session, rounds=(*rounds, round)).tracked()

    def add(self, id: str, goals: Iterable[str | Goal]) -> Tracked:
        """Add goals; those that are there already change nothing.

        Raises:
            ConflictError: As for `observe`.
            InvalidInputError: There is no such session, a text is empty, broken or too long, or the
                goals are too many.
        """
        goals = goals_of(goals)

        def change(tracker: GoalTracker) -> list[GoalChange]:
            new = _new(tracker.belief, goals)
            tracker.add(new)
            return [GoalChange("added", goal, GIVEN) for goal in new]

        return self._change(id, change)

    def correct(self, id: str, correction: Correction, goal: str | Goal, text: str = "") -> Tracked:
        """See `GoalTracker.correct`.

        Raises:
            ConflictError: As for `observe`.
            InvalidInputError: There is no such session or goal, a text is empty, broken or too
                long, or the goals are too many.
        """
        (named,) = _checked([goal])
        if text:
            _checked([text])

        def change(tracker: GoalTracker) -> list[GoalChange]:
            changes = tracker.correct(correction, named, text)
            if len(tracker.belief.goals) > GOALS + 1:
                raise InvalidInputError(TOO_MANY)
            return changes

        return self._change(id, change)

    def why(self, id: str, goal: str | Goal = "") -> tuple[Goal, list[Reason]]:
        """What each utterance says for a goal, the likeliest one if none is named.

        Raises:
            InvalidInputError: There is no such session or goal.
        """
        tracked = self.read(id)
        named = tracked.belief.top(1)[0][0]
        if goal:
            (named,) = distinct(goals_of([goal]), tracked.belief.goals)
        return named, reasons(tracked.belief, tracked.turns, named)

    def close(self, id: str) -> Tracked:
        """End a session; it can still be read.

        Raises:
            InvalidInputError: There is no such session.
        """
        with self._lock:
            self._load(id)
            self._store.finish(id, ended="terminated")
        return self.read(id)

    def delete(self, id: str) -> None:
        """Remove a session with all that was said in it; a turn that is being read is not kept.

        Raises:
            InvalidInputError: There is no such session.
        """
        self._load(id)
        self._store.delete(id)
        with self._remembering:
            self._known.pop(id, None)

    def _change(self, id: str, change: Callable[[GoalTracker], list[GoalChange]]) -> Tracked:
        """Change the goals, and keep that with the last turn, or before the first."""
        with self._lock:
            session = self._load(id)
            _, tracker = self._resumed(session)
            changes = change(tracker)
            if not changes:
                return session.tracked()
            if session.rounds:
                last = session.rounds[-1]
                new = replace(last, belief=tracker.belief, changes=(*last.changes, *changes))
                self._store.amend(id, last, new)
            else:
                earlier = [*session.earlier, *(each for each in changes if each.kind != "added")]
                begun = {
                    **session.begun,
                    "goals": [goal.text for goal in tracker.belief.goals if goal != UNSPECIFIED],
                    "changes": [asdict(each) for each in earlier],
                }
                settings = session.info.settings
                self._store.configure(id, settings, {**settings, TRACKING: begun})
        return self.read(id)

    def _load(self, id: str) -> _Session:
        try:
            info = self._store.episode(readable(id, "id"))
        except InvalidInputError:
            info = None
        if info is None or info.id != id or info.domain != TRACKING:
            raise InvalidInputError(f"There is no tracking session {id!r}.")
        return _Session(info, self._rounds(id))

    def _rounds(self, id: str) -> tuple[Round, ...]:
        """Only the newest round can change, perhaps by another server; the others are read once."""
        known = self._known.get(id, ())
        rounds = (*known[:-1], *self._store.rounds(id, since=max(len(known), 1)))
        with self._remembering:
            self._known[id] = rounds
            self._known.move_to_end(id)
            while len(self._known) > KEPT:
                self._known.popitem(last=False)
        return rounds

    def _resumed(self, session: _Session) -> tuple[Model, GoalTracker]:
        """The model, and a tracker that stands where the session does."""
        if session.info.ended:
            raise ConflictError("This session is closed. Open another one.")
        model = self._model()
        if model_name(model) != session.info.model:
            raise ConflictError(
                f"This session belongs to the model {session.info.model}, and here is "
                f"{model_name(model)}. Open another one."
            )
        likelihood = roleplay_of(settings_of(session.info.settings), model)
        tracker = GoalTracker(task=session.info.task, likelihood=likelihood)
        tracker.belief, tracker.turns = session.belief, [round.turn for round in session.rounds]
        return model, tracker


@dataclass(frozen=True, eq=False, slots=True)
class _Session:
    info: EpisodeInfo
    rounds: tuple[Round, ...]

    @property
    def begun(self) -> dict[str, Any]:
        """Goals and what was said of them before the first turn, and how it tracks."""
        return self.info.settings[TRACKING]

    @property
    def earlier(self) -> list[GoalChange]:
        """Goals that were confirmed or ruled out before the first turn."""
        return [
            GoalChange(each["kind"], Goal(**each["goal"]), each["reason"], each["final"])
            for each in self.begun["changes"]
        ]

    @property
    def belief(self) -> Belief:
        if self.rounds and self.rounds[-1].belief:
            return self.rounds[-1].belief
        goals = [UNSPECIFIED, *map(Goal, self.begun["goals"])]
        belief = Belief.uniform(goals, calibration_from_json(self.begun["calibration"]))
        for change in self.earlier:
            if change.kind == "removed" and change.goal not in belief.goals:
                belief = belief.rule_out(change.goal)
            elif change.kind == "pinned" and change.goal in belief.goals:
                belief = belief.pin(change.goal)
        return belief

    @property
    def made_from(self) -> int:
        return made_from([round.changes for round in self.rounds])

    @property
    def proposed(self) -> dict[Goal, int]:
        return {
            each.goal: 0 if each.reason in (GIVEN, YOURS) else round.number
            for round in self.rounds
            for each in round.changes
            if each.kind == "added"
        }

    def tracked(self) -> Tracked:
        last = self.rounds[-1] if self.rounds else None
        return Tracked(
            id=self.info.id,
            task=self.info.task,
            turns=tuple(round.turn for round in self.rounds),
            belief=self.belief,
            changes=last.changes if last else tuple(self.earlier),
            notes=last.notes if last else (),
            closed=self.info.ended is not None,
            made_from=self.made_from,
            proposed=self.proposed,
        )

    def managed(self, model: Model, tracker: GoalTracker) -> list[GoalChange]:
        """Have goals proposed and removed, as an agent does; those that were given stay."""
        if not self.begun["propose"]:
            return []
        settings = settings_of(self.info.settings)
        modules = modules_of(model, settings.prompted)
        goals = GoalManager(
            modules.proposer,
            model,
            tracker.task,
            remover=modules.remover,
            propose=settings.propose,
        )
        earlier = () if self.rounds else self.earlier
        past = [*(change for round in self.rounds for change in round.changes), *earlier]
        named = {each.goal for each in past if each.kind == "added" and each.reason != GIVEN}
        given = {*tracker.belief.goals} - named - {UNSPECIFIED}
        changes, _ = tracker.manage(goals, self.rounds, earlier, given=given, most=GOALS + 1)
        return changes


def _new(belief: Belief, goals: object) -> list[Goal]:
    """Those goals that the belief does not hold yet."""
    asked = distinct(_checked(goals), belief.goals)
    if UNSPECIFIED in asked:
        raise InvalidInputError(f"{UNSPECIFIED.text!r} always counts besides; leave it out.")
    found = [goal for goal in asked if goal not in belief.goals]
    if len(belief.goals) + len(found) > GOALS + 1:
        raise InvalidInputError(TOO_MANY)
    return found


def _checked(goals: object) -> list[Goal]:
    return [Goal(checked_text(goal.text, "goal", LONGEST_GOAL)) for goal in goals_of(goals)]
