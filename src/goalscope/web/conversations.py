"""Running episodes: the state that the page shows, and the actions of a person."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import OrderedDict
from collections.abc import Callable, Generator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from threading import RLock
from typing import Any, Literal, TypeVar

from pydantic import BaseModel

from goalscope.agent.people import FALLBACK
from goalscope.agent.settings import Settings
from goalscope.base.types import (
    ConflictError,
    Goal,
    GoalscopeError,
    InvalidInputError,
    checked_text,
)
from goalscope.belief.belief import Belief
from goalscope.belief.explain import word_evidence
from goalscope.belief.likelihood import RolePlay
from goalscope.belief.tracker import Correction
from goalscope.envs import completion_phrase
from goalscope.envs.registry import open_environment
from goalscope.models import Model
from goalscope.storage.session import Session, saved_settings
from goalscope.storage.store import EpisodeInfo, Store
from goalscope.web.views import BeliefView, ChangeView, Confirm, EpisodeView, Live, RoundView

T = TypeVar("T")

log = logging.getLogger(__name__)

MAX_LENGTH = 2000
"""Characters of an utterance or a goal."""

MAX_OPEN = 100
"""Number of conversations beyond which idle ones are closed; they stay in the store."""

Kind = Literal["live", "round", "ended"]
Event = tuple[Kind, BaseModel]


class Conversation:
    """One person and their agent.

    Its methods return at once: the agent works in a thread, and every listener receives what
    happens.

    Args:
        store: Store of the rounds.
        worker: Runs what needs the model.
        model: The session's.
        settings: The session's.
        resumed: The stored episode to resume; its session is opened by the worker.

    Raises:
        GoalscopeError: It cannot be started with these settings.
    """

    def __init__(
        self,
        store: Store,
        worker: Executor,
        model: Model,
        settings: Settings,
        resumed: EpisodeInfo | None = None,
    ) -> None:
        self._store, self._worker, self._model = store, worker, model
        self._settings = settings
        self._closing = ExitStack()
        self._env = self._closing.enter_context(open_environment(settings))
        self._lock = RLock()
        self._state = Live(
            version=time.time_ns() // 1_000_000,
            phase="idle",
            completion_phrase=completion_phrase(self._env),
        )
        self._listeners: dict[asyncio.Queue[Event], asyncio.AbstractEventLoop] = {}
        self._opened: Session | None = None
        try:
            if resumed:
                self.id = resumed.id
                self.catch_up(resumed, again=True)
            else:
                self._opened = self._open(None)
                self.id = self._opened.id
                self._ask()
                worker.submit(self._opened.prepare)
        except BaseException:
            self.close()
            raise

    @property
    def _session(self) -> Session:
        if self._opened is None:
            raise ConflictError(self._state.error or "This episode is still being opened.")
        return self._opened

    @property
    def belief(self) -> Belief | None:
        """The belief with the corrections since the last round; None while it changes."""
        with self._lock:
            at_rest = self._state.phase == "idle"
            return self._opened.agent.belief if self._opened and at_rest else None

    @property
    def is_idle(self) -> bool:
        """Whether nothing is running, and nobody is listening."""
        with self._lock:
            return self._state.phase == "idle" and not self._listeners

    def live(self) -> Live:
        """The state that the page shows."""
        with self._lock:
            state, session = self._state, self._opened
            if session is None:
                return state
            agent = session.agent
            last = agent.rounds[-1] if agent.rounds else None
            asked = bool(last and last.question and (state.query or "").endswith(last.question))
            waits = asked and state.utterance is None
            return self._changed(
                round=len(agent.rounds) + 1,
                belief=BeliefView.of(agent.belief) if agent.belief.inferred else None,
                changes=[*map(ChangeView.model_validate, agent.corrections)],
                can_undo=agent.can_undo_correction,
                confirm=Confirm.model_validate(last) if waits else None,
            )

    def _changed(self, **changes: Any) -> Live:
        return self._state.model_copy(update=changes)

    def catch_up(self, info: EpisodeInfo, *, again: bool = False) -> None:
        """Reopen the episode if it was continued elsewhere, such as on another server.

        Args:
            info: What the store knows of it.
            again: Also reopen it if it could not be opened before.
        """
        with self._lock:
            behind = len(self._opened.agent.rounds) < info.rounds if self._opened else again
            if self._state.phase != "idle" or not behind:
                return
            self._claim("opening")
            self._opened = None
            self._update(query=None)
        self._submit(lambda: self._reopen(info))

    def say(self, text: str, round: int, confirmed: str = "") -> Live:
        """Send the person's words to the agent.

        Args:
            text: Their words.
            round: The round that they answer.
            confirmed: See `Agent.step`.

        Raises:
            ConflictError: The agent is working, or this round is already answered.
            InvalidInputError: The text is empty, broken or too long.
        """
        text = checked_text(text, "message", MAX_LENGTH)
        with self._lock:
            query = self._state.query
            if round != len(self._session.agent.rounds) + 1 or query is None:
                raise ConflictError(
                    "This round has already been answered, perhaps in another window."
                )
            self._claim("reading", text)
        self._submit(lambda: self._step(query, text, confirmed))
        return self.live()

    def correct(self, kind: Correction, goal: str, text: str = "") -> Future[object]:
        """See `Agent.correct`; a goal that is new must be scored first.

        Raises:
            ConflictError: The agent is at work.
            InvalidInputError: A text is empty, broken or too long.
        """
        goal = checked_text(goal, "goal", MAX_LENGTH)
        text = text and checked_text(text, "goal", MAX_LENGTH)
        return self._change(lambda: self._session.correct(kind, Goal(goal), text))

    def undo_correction(self) -> Future[object]:
        """See `Agent.undo_correction`.

        Raises:
            ConflictError: The agent is at work.
        """
        return self._change(self._session.undo_correction)

    def words(self, goal: str, turn: int) -> Future[list[tuple[str, float]]]:
        """See `goalscope.belief.explain.word_evidence`.

        Raises:
            ConflictError: The agent is at work.
            InvalidInputError: There is no such goal or turn.
        """
        turns, belief = self._session.agent.turns[:turn], self._session.agent.belief
        likelihood = self._session.agent.tracker.likelihood
        if not isinstance(likelihood, RolePlay):
            raise InvalidInputError("This method computes no evidence of single words.")
        if Goal(goal) not in belief.goals or not 1 <= turn <= len(turns):
            raise InvalidInputError("There is no such goal or turn.")
        self._claim("weighing words")
        return self._submit(
            lambda: word_evidence(likelihood, self._env.task, belief, turns, Goal(goal))
        )

    @contextmanager
    def listening(self) -> Generator[asyncio.Queue[Event]]:
        """A queue of everything that happens inside this context."""
        queue: asyncio.Queue[Event] = asyncio.Queue()
        with self._lock:
            self._listeners[queue] = asyncio.get_running_loop()
        try:
            yield queue
        finally:
            with self._lock:
                del self._listeners[queue]

    def close(self) -> None:
        """Close the environment; everything is in the store."""
        self._closing.close()

    def _open(self, resume: EpisodeInfo | None) -> Session:
        session = Session(
            self._store,
            self._settings,
            self._env,
            self._model,
            resume=resume,
            progress=lambda step: self._update(step=step),
        )
        session.begin()  # its page is found by the id
        return session

    def _change(self, change: Callable[[], object]) -> Future[object]:
        self._claim("weighing what you say")
        return self._submit(change)

    def _claim(self, step: str, utterance: str | None = None) -> None:
        """Block other steps of this conversation until this one is done."""
        with self._lock:
            if self._state.phase != "idle":
                raise ConflictError(
                    "The agent is still working. Wait for it to finish, then try again."
                )
            self._update(phase="thinking", step=step, utterance=utterance, error=None)

    def _submit(self, work: Callable[[], T]) -> Future[T]:
        """Run the claimed step; then, even if it is cancelled, it is the person's turn."""
        future = self._worker.submit(work)
        future.add_done_callback(lambda _: self._update(phase="idle", step=""))
        return future

    def _step(self, query: str, text: str, confirmed: str) -> None:
        try:
            round = self._session.step(query, text, confirmed=confirmed)
        except Exception as error:
            message = _told(error, "Something went wrong, and nothing was changed. Try again.")
            # A confirmation is not repeated unseen.
            self._update(error=message, utterance=None if confirmed else text)
            return
        self._publish("round", lambda: RoundView.of(round))
        info = self._session.info
        self._update(query=None, utterance=None)
        if info.ended:
            self._publish("ended", lambda: EpisodeView.model_validate(info))
        else:
            self._ask()

    def _reopen(self, info: EpisodeInfo) -> None:
        try:
            self._opened = self._open(info)
        except Exception as error:
            message = _told(error, "This episode cannot be opened. Start a new one.")
            self._update(error=message)
        else:
            self._ask()

    def _ask(self) -> None:
        try:
            query = self._session.agent.ask()
        except Exception:
            log.exception("a question failed")
            query = FALLBACK
        self._update(query=query)

    def _update(self, **changes: Any) -> None:
        with self._lock:
            self._state = self._changed(version=self._state.version + 1, **changes)
            self._publish("live", self.live)

    def _publish(self, kind: Kind, view: Callable[[], BaseModel]) -> None:
        with self._lock:
            if self._listeners:
                event = kind, view()
                for queue, loop in self._listeners.items():
                    loop.call_soon_threadsafe(queue.put_nowait, event)


def _told(error: Exception, otherwise: str) -> str:
    """What people are told of an error; one that nobody expected stands in the log."""
    if isinstance(error, GoalscopeError):
        return str(error)
    log.error(otherwise, exc_info=error)
    return otherwise


class Conversations:
    """All conversations of this server.

    Args:
        store: Keeps their rounds.
        model: Shared by all; it serves one after the other.
    """

    def __init__(self, store: Store, model: Model) -> None:
        self._store, self._model = store, model
        self._worker = ThreadPoolExecutor(1, "model")
        self._lock = RLock()
        self._open: OrderedDict[str, Conversation] = OrderedDict()

    def resume(self, info: EpisodeInfo, *, again: bool = False) -> Conversation:
        """The conversation of an episode that has not ended.

        Args:
            info: The episode.
            again: Whether to try again if it could not be opened.

        Raises:
            GoalscopeError: It cannot be continued.
        """
        with self._lock:
            if found := self._open.get(info.id):
                self._open.move_to_end(info.id)
                found.catch_up(info, again=again)
                return found
            return self.begin(saved_settings(self._store, info), info)

    def close(self) -> None:
        """Close all conversations; their rounds are in the store."""
        self._worker.shutdown(cancel_futures=True)
        for conversation in self._open.values():
            conversation.close()

    def begin(self, settings: Settings, resume: EpisodeInfo | None = None) -> Conversation:
        """Start an episode, or resume one.

        Raises:
            GoalscopeError: It cannot be started with these settings.
        """
        entered = Conversation(self._store, self._worker, self._model, settings, resume)
        with self._lock:
            self._open[entered.id] = entered
            idle = [each for each in self._open.values() if each.is_idle and each is not entered]
            for each in idle[: max(0, len(self._open) - MAX_OPEN)]:
                del self._open[each.id]
                each.close()
        return entered
