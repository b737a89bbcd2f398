"""Tracking sessions: beliefs over the goals of people who talk with other programs, stored."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from threading import Lock

from goalscope.agent.round import Round
from goalscope.agent.settings import Settings, likelihood_for, settings_of
from goalscope.agent.toolkit import toolkit_of
from goalscope.base.types import (
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
from goalscope.belief.advice import Advised, advised
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import DEFAULT
from goalscope.belief.explain import Reason, reasons
from goalscope.belief.goal_manager import GoalManager, made_from
from goalscope.belief.tracker import Correction, GoalTracker
from goalscope.models import Model, model_name
from goalscope.storage.store import EpisodeInfo, Store, new_episode

MAX_GOALS, MAX_TURNS = 200, 200
"""Of a session."""

MAX_TEXT, MAX_GOAL = 4000, 500
"""Characters of a task, a query or an utterance, and of a goal."""

CACHED = 16
"""Sessions whose rounds stay in memory."""

TOO_MANY = f"A session has at most {MAX_GOALS} goals. Rule out or leave out some."


@dataclass(frozen=True, eq=False, slots=True)
class Tracked:
    """A session as it stands after a turn.

    Attributes:
        info: The episode of the store that keeps it.
        start: The state before the first turn, as a round of number 0.
        rounds: One for each turn so far.
    """

    info: EpisodeInfo
    start: Round
    rounds: tuple[Round, ...]

    @property
    def id(self) -> str:
        """The session's id."""
        return self.info.id

    @property
    def turns(self) -> tuple[Turn, ...]:
        """The dialogue so far."""
        return tuple(round.turn for round in self.rounds)

    @property
    def last(self) -> Round:
        """The newest round, or `start`, with the corrections since."""
        return (self.start, *self.rounds)[-1]

    @property
    def belief(self) -> Belief:
        """Over the goals and `UNSPECIFIED`."""
        return self.last.belief

    @property
    def since(self) -> int:
        """Number of turns that the newest goals were proposed from."""
        return made_from([round.changes for round in self.rounds])

    @property
    def advised(self) -> Advised:
        """What an assistant should do next, and why; see `goalscope.belief.advice.advice`."""
        return advised(self, proposed=self.proposed)

    @property
    def proposed(self) -> set[Goal]:
        """The goals that a model proposed; see `goalscope.belief.advice.advice`."""
        came = [each for r in self.rounds for each in r.changes if each.kind == "added"]
        source = {each.goal: each.source for each in came}  # of the newest change
        return {goal for goal, each in source.items() if each == "model"}


class Trackers:
    """Tracking sessions. What a call has changed is on disk when it returns.

    Threads may share it; calls that need the model run one at a time, and reading waits for none.

    All methods raise `InvalidInputError` if there is no such session or goal, if a text is empty,
    broken or too long, or if the goals are too many or repeated. Those that change a session raise
    `ConflictError` if it is closed, belongs to another model, or was changed elsewhere meanwhile.

    Args:
        store: Keeps the sessions, as episodes of the domain `TRACKING`.
        model: Opens the model, or returns the one that is open.
        defaults: Settings of new sessions: the model's, layout, calibration, seed.
    """

    def __init__(
        self, store: Store, model: Callable[[], Model], defaults: Settings | None = None
    ) -> None:
        self._store, self._model = store, model
        self._defaults = defaults or Settings()
        self._lock, self._cache_lock = Lock(), Lock()
        self._cache: OrderedDict[str, tuple[Round, ...]] = OrderedDict()

    def open(
        self,
        task: str,
        goals: Iterable[str | Goal] = (),
        *,
        propose: bool = False,
    ) -> Tracked:
        """Begin a session.

        Args:
            task: The assistant's task, in a sentence.
            goals: What the person may want.
            propose: Whether the model proposes goals when none explains the words, and removes its
                own again.
        """
        settings = self._defaults
        task = checked_text(task, "task", MAX_TEXT)
        with self._lock:
            model = self._model()
            given = goals_of(goals, MAX_GOAL)
            proposes = DEFAULT if propose and not given else None
            likelihood = likelihood_for(settings, model, proposes)
            tracker = GoalTracker(
                task=task, likelihood=likelihood, calibration=settings.calibration or proposes
            )
            tracker.add(_new(tracker.belief, given))  # refuses goals with too many tokens
            new = new_episode(
                domain=TRACKING,
                method="good",
                model=model_name(model),
                task=task,
                settings={**asdict(settings), TRACKING: propose},
            )
            self._store.append(new["id"], Round(0, Turn("", ""), tracker.belief, ()), new=new)
        return self.read(new["id"])

    def sessions(self, *, limit: int | None = None, offset: int = 0) -> list[EpisodeInfo]:
        """The sessions, newest first."""
        return self._store.episodes(domain=TRACKING, newest_first=True, limit=limit, offset=offset)

    def read(self, id: str) -> Tracked:
        """The session as it stands."""
        try:
            info = self._store.episode(readable(id, "id"))
        except InvalidInputError:
            info = None
        if info is None or info.id != id or info.domain != TRACKING:
            raise InvalidInputError(f"There is no tracking session {id!r}.")
        start, *rounds = self._rounds(id)
        return Tracked(info, start, tuple(rounds))

    def observe(self, id: str, turn: int | None, query: str, utterance: str) -> Tracked:
        """Take in what the person said.

        The same turn again changes nothing, and returns what it did the first time (with the
        corrections since, if it is the last one).

        Args:
            id: The session's.
            turn: 1 for the first; None for the next.
            query: What the assistant had said; may be empty.
            utterance: What the person answered.

        Raises:
            ConflictError: The turn was sent in other words, or is not the next one.
        """
        query = checked_text(query, "query", MAX_TEXT) if readable(query, "query").strip() else ""
        said = Turn(query, checked_text(utterance, "utterance", MAX_TEXT))
        with self._lock:
            session = self.read(id)
            rounds = session.rounds
            turn = len(rounds) + 1 if turn is None else turn
            if 1 <= turn <= len(rounds):
                if rounds[turn - 1].turn.plain() != said.plain():
                    raise ConflictError(f"Turn {turn} was sent before with different words.")
                return replace(session, rounds=rounds[:turn])
            if turn != len(rounds) + 1:
                raise ConflictError(f"The next turn is {len(rounds) + 1}, not {turn}.")
            if turn > MAX_TURNS:
                raise ConflictError(f"A session has at most {MAX_TURNS} turns. Open another one.")
            model, tracker = self._resume(session)
            tracker.observe(said.query, said.utterance)
            corrections = () if rounds else session.last.changes
            changes = _manage(session, model, tracker, corrections)
            round = Round(
                number=turn,
                turn=said,
                belief=tracker.belief,
                changes=(*corrections, *changes),
                notes=tracker.notes,
            )
            self._store.append(id, round, after=session.last)
            return replace(session, rounds=(*rounds, round))

    def add(self, id: str, goals: Iterable[str | Goal]) -> Tracked:
        """Add at least one goal; those that are there already change nothing."""
        if not (given := goals_of(goals, MAX_GOAL)):
            raise InvalidInputError("goals is empty. Name at least one to add.")

        def change(tracker: GoalTracker) -> list[GoalChange]:
            new = _new(tracker.belief, given)
            tracker.add(new)
            return [GoalChange("added", goal, "it was given", source="program") for goal in new]

        return self._change(id, change)

    def correct(self, id: str, correction: Correction, goal: str | Goal, text: str = "") -> Tracked:
        """See `GoalTracker.correct`."""
        (named,) = goals_of([goal], MAX_GOAL)
        if text:
            goals_of([text], MAX_GOAL)

        def change(tracker: GoalTracker) -> list[GoalChange]:
            changes = tracker.correct(correction, named, text)
            if len(tracker.belief.goals) > MAX_GOALS + 1:
                raise InvalidInputError(TOO_MANY)
            return changes

        return self._change(id, change)

    def why(self, id: str, goal: str | Goal = "") -> tuple[Goal, list[Reason]]:
        """What each utterance says for a goal, the likeliest one if none is named."""
        session = self.read(id)
        belief = session.belief
        (named,) = distinct(goals_of([goal or belief.top(1)[0][0]]), belief.goals)
        return named, reasons(belief, session.turns, named)

    def close(self, id: str) -> Tracked:
        """End a session; it can still be read."""
        with self._lock:
            self.read(id)
            self._store.finish(id, ended="terminated")
        return self.read(id)

    def delete(self, id: str) -> None:
        """Delete a session with everything said in it, also a turn that is being observed."""
        self.read(id)
        self._store.delete(id)
        with self._cache_lock:
            self._cache.pop(id, None)

    def _change(self, id: str, change: Callable[[GoalTracker], list[GoalChange]]) -> Tracked:
        """Change the goals, and store that in the newest round."""
        with self._lock:
            session = self.read(id)
            _, tracker = self._resume(session)
            changes = change(tracker)
            if not changes:
                return session
            if not session.rounds:  # goals before the first turn are given, and not changes
                changes = [each for each in changes if each.kind != "added"]
            last = session.last
            new = replace(last, belief=tracker.belief, changes=(*last.changes, *changes))
            self._store.amend(id, last, new)
        return self.read(id)

    def _rounds(self, id: str) -> tuple[Round, ...]:
        """The rounds of a session; all but the newest, which can change, are read only once."""
        known = self._cache.get(id, ())
        rounds = (*known[:-1], *self._store.rounds(id, since=max(len(known) - 1, 0)))
        with self._cache_lock:
            self._cache[id] = rounds
            self._cache.move_to_end(id)
            while len(self._cache) > CACHED:
                self._cache.popitem(last=False)
        return rounds

    def _resume(self, session: Tracked) -> tuple[Model, GoalTracker]:
        """The model, and a tracker in the state of the session."""
        if session.info.ended:
            raise ConflictError("This session is closed. Open another one.")
        model = self._model()
        if model_name(model) != session.info.model:
            raise ConflictError(
                f"This session uses the model {session.info.model}, not {model_name(model)}. "
                "Open another one."
            )
        likelihood = likelihood_for(
            settings_of(session.info.settings), model, session.belief.calibration
        )
        tracker = GoalTracker(task=session.info.task, likelihood=likelihood)
        tracker.restore(session.belief, session.turns)
        return model, tracker


def _manage(
    session: Tracked, model: Model, tracker: GoalTracker, corrections: Sequence[GoalChange]
) -> list[GoalChange]:
    """Propose and remove goals after a turn, as an agent does; those that were given stay."""
    if not session.info.settings[TRACKING]:
        return []
    settings = settings_of(session.info.settings)
    modules = toolkit_of(model, settings.prompted)
    goals = GoalManager(modules.proposer, model, tracker.task, remover=modules.remover)
    past = [*(change for round in session.rounds for change in round.changes), *corrections]
    named = {each.goal for each in past if each.kind == "added" and each.source != "program"}
    given = {*tracker.belief.goals} - named - {UNSPECIFIED}
    changes, _ = goals.manage(
        tracker, session.rounds, corrections=corrections, given=given, most=MAX_GOALS + 1
    )
    return changes


def _new(belief: Belief, goals: Iterable[Goal]) -> list[Goal]:
    """Those goals that the belief does not hold yet."""
    asked = distinct(goals, belief.goals)
    if UNSPECIFIED in asked:
        raise InvalidInputError(f"{UNSPECIFIED.text!r} is always among the goals. Leave it out.")
    found = [goal for goal in asked if goal not in belief.goals]
    if len(belief.goals) + len(found) > MAX_GOALS + 1:
        raise InvalidInputError(TOO_MANY)
    return found
