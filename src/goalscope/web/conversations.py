"""Episodes that people are in the middle of: what they see now, and what they may do."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import OrderedDict
from collections.abc import Callable, Generator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from threading import RLock
from typing import Any, Literal, TypeVar

from pydantic import BaseModel

from goalscope.belief import Belief
from goalscope.dialog import FALLBACK
from goalscope.domains import Settings, open_environment
from goalscope.envs import Environment
from goalscope.likelihood import DEFAULT_LAYOUT, RolePlay
from goalscope.models import Model, OnText
from goalscope.session import Session, saved_settings
from goalscope.store import EpisodeInfo, Store
from goalscope.tracker import Correction
from goalscope.types import ConflictError, Goal, GoalscopeError, InvalidInputError, checked_text
from goalscope.web.queue import ModelQueue
from goalscope.web.views import BeliefView, ChangeView, Confirm, EpisodeView, Live, RoundView
from goalscope.why import word_evidence

__all__ = ["Conversation", "Conversations"]

T = TypeVar("T")

log = logging.getLogger(__name__)

LONGEST = 2000
"""Characters of an utterance or a goal."""

KEPT = 100
"""Conversations that stay open while nobody looks at them; the others are in the store."""

SETTLED = 60.0
"""Seconds from a request on in which a conversation stays open."""

PAUSE = 0.1
"""Seconds between two tellings of what the agent is writing."""

Event = tuple[Literal["live", "round", "ended"], BaseModel]


@dataclass(frozen=True, slots=True)
class _State:
    version: int
    phase: Literal["idle", "waiting", "thinking"] = "idle"
    place: int = 0
    step: str = ""
    draft: str = ""
    query: str | None = None
    utterance: str | None = None
    error: str | None = None


class Conversation:
    """One person and their agent.

    Its methods return at once; what the agent does, it does at the desk, and everybody who
    listens is told.

    Args:
        desk: Where the model works.
        env: Where the agent acts.
        model: Of the session.
        open: Makes the session, given what is to be told of the agent's progress and of what it
            writes, and the episode that goes on.
        resumed: The stored episode that goes on; its session is opened at the desk.
    """

    def __init__(
        self,
        desk: ModelQueue,
        env: Environment,
        model: Model,
        open: Callable[[OnText, OnText, EpisodeInfo | None], Session],
        resumed: EpisodeInfo | None = None,
    ) -> None:
        self._desk, self._env, self._model = desk, env, model
        self._lock = RLock()
        self._state = _State(time.time_ns() // 1_000_000)
        self._listeners: dict[asyncio.Queue[Event], asyncio.AbstractEventLoop] = {}
        self._opened: Session | None = None
        self._viewed: tuple[Belief | None, BeliefView | None] = None, None
        self._open = partial(open, lambda step: self._become(step=step), self._drafted)
        self._drafted_at = 0.0
        self.used = time.monotonic()
        if resumed:
            self.id = resumed.id
            self.catch_up(resumed, again=True)
        else:
            self._opened = self._open(None)
            self.id = self._opened.id
            self._ask()

    @property
    def _session(self) -> Session:
        if self._opened is None:
            raise ConflictError(self._state.error or "This episode is still being opened.")
        return self._opened

    @property
    def belief(self) -> Belief | None:
        """With what the person said of the goals since the last round; None while that changes."""
        with self._lock:
            at_rest = self._state.phase == "idle"
            return self._opened.belief if self._opened and at_rest else None

    @property
    def is_idle(self) -> bool:
        """Whether nothing is being done, nobody listens, and no request is about to do either."""
        with self._lock:
            at_rest = self._state.phase == "idle" and not self._listeners
            return at_rest and time.monotonic() - self.used > SETTLED

    def live(self) -> Live:
        """How it stands."""
        with self._lock:
            state, session = self._state, self._opened
            told: dict[str, Any] = asdict(state)
            told["completion_phrase"] = self._env.completion_phrase
            if session is None:
                return Live(**told)
            last = session.rounds[-1] if session.rounds else None
            asked = bool(last and last.question and (state.query or "").endswith(last.question))
            waits = asked and state.utterance is None
            return Live(
                **told,
                round=len(session.rounds) + 1,
                belief=self._view(session.belief),
                changes=[ChangeView.of(change) for change in session.corrections],
                can_undo=session.can_undo_correction,
                confirm=Confirm.of(last) if last and waits else None,
            )

    def _view(self, belief: Belief | None) -> BeliefView | None:
        """As it is told again and again while people wait, it is made once."""
        if belief is not self._viewed[0]:
            self._viewed = belief, belief and BeliefView.of(belief)
        return self._viewed[1]

    def catch_up(self, info: EpisodeInfo, *, again: bool = False) -> None:
        """Open the episode anew where it has gone on elsewhere.

        Args:
            info: What the store knows of it.
            again: Also where it could not be opened before.
        """
        with self._lock:
            behind = len(self._opened.rounds) < info.rounds if self._opened else again
            if self._state.phase != "idle" or not behind:
                return
            self._claim("opening")
            self._opened = None
            self._become(query=None)
        self._submit(lambda: self._reopen(info))

    def say(self, text: str, round: int, confirmed: str = "") -> Live:
        """Have the agent take in what the person says.

        Args:
            text: Their words.
            round: The round that they answer in.
            confirmed: See `Agent.step`.

        Raises:
            ConflictError: The agent is at work, or this round has had its answer.
            InvalidInputError: The text is empty, broken or too long.
        """
        text = checked_text(text, "message", LONGEST)
        with self._lock:
            query = self._state.query
            if round != len(self._session.rounds) + 1 or query is None:
                raise ConflictError("That was answered already, perhaps in another window.")
            self._claim("reading", text)
        self._submit(lambda: self._step(query, text, confirmed))
        return self.live()

    def correct(self, kind: Correction, goal: str, text: str = "") -> Future[None]:
        """See `Agent.correct`; a goal that is new must be scored first.

        Raises:
            ConflictError: The agent is at work.
            InvalidInputError: A text is empty, broken or too long.
        """
        goal, text = (
            checked_text(goal, "goal", LONGEST),
            text and checked_text(text, "goal", LONGEST),
        )
        return self._change(lambda: self._session.correct(kind, Goal(goal), text))

    def undo_correction(self) -> Future[None]:
        """See `Agent.undo_correction`.

        Raises:
            ConflictError: The agent is at work.
        """
        return self._change(self._session.undo_correction)

    def words(self, goal: str, turn: int) -> Future[list[tuple[str, float]]]:
        """What each word of a turn says for a goal, as `why.word_evidence`.

        Raises:
            ConflictError: The agent is at work.
            InvalidInputError: There is no such goal or turn.
        """
        turns, belief = self._session.turns[:turn], self._session.belief
        if belief is None or Goal(goal) not in belief.goals or not 1 <= turn <= len(turns):
            raise InvalidInputError("There is no such goal or turn.")
        roleplay = RolePlay(self._model, layout=DEFAULT_LAYOUT)
        self._claim("weighing words")
        return self._submit(
            lambda: word_evidence(roleplay, self._env.task, belief, turns, Goal(goal))
        )

    @contextmanager
    def listening(self) -> Generator[asyncio.Queue[Event]]:
        """A queue into which goes everything that happens, meanwhile."""
        queue: asyncio.Queue[Event] = asyncio.Queue()
        with self._lock:
            self._listeners[queue] = asyncio.get_running_loop()
        try:
            yield queue
        finally:
            with self._lock:
                del self._listeners[queue]

    def close(self) -> None:
        """Let go of what runs behind it; everything is in the store."""
        self._env.close()

    def _change(self, change: Callable[[], object]) -> Future[None]:
        def work() -> None:
            change()

        self._claim("weighing what you say")
        return self._submit(work)

    def _claim(self, step: str, utterance: str | None = None) -> None:
        """Nothing else of this conversation may begin until what is claimed has been done."""
        with self._lock:
            if self._state.phase != "idle":
                raise ConflictError("The agent is still at work. Wait for it, and try again.")
            self._become(phase="waiting", step=step, utterance=utterance, error=None)

    def _submit(self, work: Callable[[], T]) -> Future[T]:
        """Do at the desk what was claimed; then, or if it is cancelled, it is the person's turn."""
        future = self._desk.submit(work, self._moved)
        future.add_done_callback(lambda _: self._become(phase="idle", place=0, step="", draft=""))
        return future

    def _moved(self, place: int) -> None:
        with self._lock:
            if self._state.phase != "idle":  # what was cancelled stands in line until its turn
                self._become(phase="waiting" if place else "thinking", place=place)

    def _step(self, query: str, text: str, confirmed: str) -> None:
        kept = None if confirmed else text  # what is confirmed must be looked at anew
        try:
            round = self._session.step(query, text, confirmed=confirmed)
        except GoalscopeError as error:
            self._become(error=str(error), utterance=kept)
            return
        except Exception:
            log.exception("a round failed")
            told = "Something went wrong here, and nothing was done. Try again."
            self._become(error=told, utterance=kept)
            return
        self._publish("round", lambda: RoundView.of(round))
        info = self._session.info
        self._become(query=None, utterance=None)
        if info.ended:
            self._publish("ended", lambda: EpisodeView.of(info, mine=True))
        else:
            self._ask()

    def _reopen(self, info: EpisodeInfo) -> None:
        try:
            self._opened = self._open(info)
        except GoalscopeError as error:
            self._become(error=str(error))
            return
        except Exception:
            log.exception("an episode could not be opened")
            self._become(error="This episode cannot be opened. Begin another one.")
            return
        self._ask()

    def _ask(self) -> None:
        try:
            query = self._session.ask()
        except Exception:
            log.exception("a question failed")
            query = FALLBACK
        self._become(query=query, draft="")

    def _become(self, **changes: Any) -> None:
        with self._lock:
            self._state = replace(self._state, version=self._state.version + 1, **changes)
            self._publish("live", self.live)

    def _drafted(self, text: str) -> None:
        now = time.monotonic()
        if self._listeners and now - self._drafted_at >= PAUSE:
            self._drafted_at = now
            self._become(draft=text)

    def _publish(
        self, kind: Literal["live", "round", "ended"], view: Callable[[], BaseModel]
    ) -> None:
        with self._lock:
            if self._listeners:
                event = kind, view()
                for queue, loop in self._listeners.items():
                    loop.call_soon_threadsafe(queue.put_nowait, event)


class Conversations:
    """All that go on here.

    Args:
        store: Keeps their rounds.
        model: Shared by all.
    """

    def __init__(self, store: Store, model: Model) -> None:
        self._store, self._model = store, model
        self.desk = ModelQueue()
        self._lock = RLock()
        self._open: OrderedDict[str, Conversation] = OrderedDict()

    def begin(self, owner: str, settings: Settings) -> Conversation:
        """Start an episode.

        Raises:
            GoalscopeError: It cannot be started so.
        """
        return self._enter(owner, settings, None)

    def resume(self, info: EpisodeInfo, *, again: bool = False) -> Conversation:
        """The conversation of an episode that has not ended.

        Args:
            info: The episode.
            again: Whether to try once more where it could not be opened.

        Raises:
            GoalscopeError: It cannot go on.
        """
        with self._lock:
            if found := self._open.get(info.id):
                self._open.move_to_end(info.id)
                found.used = time.monotonic()
                found.catch_up(info, again=again)
                return found
            return self._enter(info.owner or "", saved_settings(info), info)

    def close(self) -> None:
        """Close all; their rounds are in the store."""
        self.desk.close()
        for conversation in self._open.values():
            conversation.close()

    def _enter(self, owner: str, settings: Settings, resume: EpisodeInfo | None) -> Conversation:
        env = open_environment(settings)

        def open(progress: OnText, draft: OnText, resume: EpisodeInfo | None) -> Session:
            session = Session(
                self._store,
                settings,
                env,
                self._model,
                owner=owner,
                resume=resume,
                progress=progress,
                draft=draft,
            )
            session.begin()  # its page is found by the id
            return session

        try:
            entered = Conversation(self.desk, env, self._model, open, resume)
        except BaseException:
            env.close()
            raise
        with self._lock:
            self._open[entered.id] = entered
            idle = [each for each in self._open.values() if each.is_idle and each is not entered]
            for each in idle[: max(0, len(self._open) - KEPT)]:
                del self._open[each.id]
                each.close()
        return entered
