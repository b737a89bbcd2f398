"""An episode stored as it runs, so that it can be resumed after any interruption."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from goalscope.agent.agent import Agent, run_episode
from goalscope.agent.people import OPENING, ConsoleHuman, Human, ScriptedHuman, SimulatedHuman
from goalscope.agent.round import Round
from goalscope.agent.settings import Settings, inference_of, settings_of, toolkit_for
from goalscope.base.types import (
    TRACKING,
    UNSPECIFIED,
    Goal,
    InvalidInputError,
    Turn,
    pluralize,
)
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import calibration_named
from goalscope.belief.goal_manager import irrelevant, objectionable
from goalscope.belief.tracker import Correction
from goalscope.envs import Environment, Outcome, scenarios_like
from goalscope.envs.registry import BUILT_IN, profile_named
from goalscope.models import Model, model_name
from goalscope.models.opening import is_local
from goalscope.models.trace import note
from goalscope.storage.store import EpisodeInfo, Store, new_episode


def resuming(store: Store, info: EpisodeInfo, **more: object) -> str:
    """The command that resumes an episode, with `more` options but those that are None.

    Python files of one's own must be named again; paths are full.
    """
    words = [] if info.domain in BUILT_IN else [info.domain]
    named = {key: str(info.settings.get(key)) for key in ("likelihood", "method")}
    own = {key: name for key, name in named.items() if ":" in name}
    for option, value in {**own, "resume": info.id, **more}.items():
        full = value.absolute() if isinstance(value, Path) else value
        words += [] if value is None else [f"--{option}", str(full)]
    return store.command("chat", *words)


def saved_settings(store: Store, info: EpisodeInfo, *, rounds: int | None = None) -> Settings:
    """The settings with which a stored episode is resumed.

    Args:
        store: Has the episode.
        info: The episode.
        rounds: Most rounds, if not as before.

    Raises:
        InvalidInputError: The episode is complete, has had all its rounds, or is another program's.
    """
    if info.domain == TRACKING:
        raise InvalidInputError(
            f"Episode {info.id} belongs to another program, and only that program can continue it."
        )
    settings = settings_of(info.settings)
    if rounds is not None:
        settings = replace(settings, rounds=rounds)
    if info.ended == "terminated":
        raise InvalidInputError(
            f"Episode {info.id} is complete. `{store.command('replay', info.id)}` shows it."
        )
    if info.rounds >= settings.rounds:
        raise InvalidInputError(
            f"Episode {info.id} has reached its limit of "
            f"{pluralize(settings.rounds, 'round')}. To continue, run "
            f"`{resuming(store, info, rounds=2 * settings.rounds)}`."
        )
    return settings


class Session:
    """One episode, which is stored with its first round and grows in the store round by round.

    Attributes:
        id: The episode's id in the store.
        agent: Holds the rounds and the belief; `step` and `correct` here store what they change.
        profile: The simulated person; None for a real one.
        earlier: Rounds that a resumed episode had before.
    """

    def __init__(
        self,
        store: Store,
        settings: Settings,
        env: Environment,
        model: Model,
        *,
        profile: str | None = None,
        read: Callable[[str], str] | None = None,
        resume: EpisodeInfo | None = None,
        progress: Callable[[str], None] | None = None,
        understood: Callable[[Round], None] | None = None,
    ) -> None:
        """Begin an episode, or resume one.

        Args:
            store: Keeps the rounds.
            settings: What is to run.
            env: Where the agent acts; it is reset.
            model: Writes and scores.
            profile: Name of the simulated person; `run` needs it unless the human is "you".
            read: Shows a query to the person at the terminal and returns their words; `run` needs
                it if the human is "you".
            resume: The stored episode to resume.
            progress: See `Agent`, as for the next.
            understood: Called with each round before the agent acts.

        Raises:
            InvalidInputError: There is no such profile, or it needs nothing.
        """
        self.profile = profile_named(settings, profile) if profile else None
        self._store, self._settings, self._env = store, settings, env
        method, likelihood = inference_of(settings, model)
        self.agent = Agent(
            env,
            model,
            method=method,
            preset=settings.preset,
            likelihood=likelihood,
            calibration=calibration_named(settings.calibration) if settings.calibration else None,
            propose=settings.propose,
            k=settings.k,
            toolkit=toolkit_for(settings, model),
            progress=progress,
            understood=understood,
        )
        self._human = self._make_human(model, read)
        self._start: tuple[bool, ...] = ()
        if self.profile:
            env.reset()
            self._start = env.checks_met(self.profile).met
        if self._start and all(self._start):
            raise InvalidInputError(
                f"The profile {profile} needs nothing: all of its checks hold at the start. Add a "
                "check that does not."
            )
        self.earlier = store.rounds(resume.id) if resume else []
        self.agent.resume(self.earlier)
        corrections = store.corrections(resume.id, len(self.earlier)) if resume else []
        for correction, goal, text in corrections:
            self.agent.correct(correction, Goal(goal), text)
        self._new: dict[str, Any] | None = None
        if resume:
            self.id = resume.id
        else:
            self._new = new_episode(
                domain=settings.domain,
                profile=profile,
                method=settings.method,
                model=model_name(model),
                task=env.task,
                settings=asdict(settings),
            )
            self.id = str(self._new["id"])
        self.agent.episode = self.id
        note("episode", id=self.id, profile=profile, settings=asdict(settings))

    @property
    def is_stored(self) -> bool:
        """Whether the store has the episode: once there is a round, a correction, or `begin`."""
        return self._new is None

    @property
    def info(self) -> EpisodeInfo:
        """What the store knows of the episode, or will know once it is stored."""
        if self._new is None:
            return self._store.episode(self.id)
        row = {**self._new, "settings": json.loads(self._new["settings"])}
        return EpisodeInfo(**row, ended=None, score=None, rounds=0)

    def resuming(self, **more: object) -> str:
        """The command that resumes it; see `resuming`. It gets more rounds if all are used up."""
        info, rounds = self.info, self._settings.rounds
        rounds = 2 * rounds if info.rounds >= rounds else rounds
        changed = None if rounds == info.settings.get("rounds") else rounds
        return resuming(self._store, info, rounds=changed, **more)

    def begin(self) -> None:
        """Store the episode now, not only with its first round."""
        if self._new is not None:
            self._store.add(self._new)
            self._new = None

    def prepare(self) -> None:
        """Compute what everyone's first round begins with, while this person is still typing."""
        if self.agent.rounds or self._settings.preset or not is_local(self.agent.model):
            return
        agent, turn, goals = self.agent, Turn(OPENING, "Hello."), [Goal("say hello")]
        scenarios_like(self._env, turn.utterance, 1)
        agent.reader.read(turn.utterance)
        if agent.tracker.likelihood:
            agent.tracker.likelihood.log_likelihood(self._env.task, [UNSPECIFIED], [turn])
            agent.goal_manager.proposer.goals(self._env.task, [turn], ())
            irrelevant(agent.model, self._env.task, goals)
            objectionable(agent.model, goals)

    def run(self) -> Iterator[Round]:
        """Yield each new round as soon as it is on disk."""
        if self._human is None:
            raise ValueError("a person at the terminal needs a `read` function")
        yield from run_episode(
            self.agent, self._human, max_rounds=self._settings.rounds, keep=self._keep
        )

    def step(self, query: str, utterance: str, *, confirmed: str = "") -> Round:
        """See `Agent.step`; the round is on disk when it returns."""
        return self.agent.step(query, utterance, confirmed=confirmed, keep=self._keep)

    def _keep(self, round: Round) -> None:
        end = None
        if round.terminated or round.number >= self._settings.rounds:
            outcome = self.outcome()
            score = outcome.score if outcome else None
            end = "terminated" if round.terminated else "truncated", score
        self._store.append(self.id, round, new=self._new, end=end)
        self._new = None

    def correct(self, correction: Correction, goal: Goal, text: str = "") -> Belief:
        """See `Agent.correct`; it is on disk before it is shown."""
        belief = self.agent.correct(correction, goal, text)
        try:
            self.begin()
            self._store.correct(self.id, len(self.agent.rounds), (correction, goal.text, text))
        except BaseException:
            self.agent.undo_correction()
            raise
        return belief

    def undo_correction(self) -> Belief:
        """See `Agent.undo_correction`; it is on disk before it is shown."""
        if self.agent.can_undo_correction:
            self._store.undo_correction(self.id, len(self.agent.rounds))
        return self.agent.undo_correction()

    def outcome(self) -> Outcome | None:
        """What was made of the start; None without a profile, or where the domain has no score."""
        if self.profile is None or not self._start:
            return None
        now = self._env.checks_met(self.profile)
        return Outcome(self._start, now.met, now.unwanted)

    def _make_human(self, model: Model, read: Callable[[str], str] | None) -> Human | None:
        human, seed = self._settings.human, self._settings.seed
        if human == "you":
            return read and ConsoleHuman(read)
        if self.profile is None:
            raise ValueError("a scripted or simulated person needs a profile")
        if human == "scripted":
            return ScriptedHuman(self.profile, self._env)
        habit = None if human == "simulated" else human
        return SimulatedHuman(model, self.profile, self._env, seed, habit)
