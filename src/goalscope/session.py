"""An episode that is stored while it runs, so that it can go on after any interruption."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from typing import get_args

from goalscope.agent import Agent, run_episode
from goalscope.belief import Belief
from goalscope.calibrations import calibration_named
from goalscope.dialog import ConsoleHuman, Human, ScriptedHuman, SimulatedHuman
from goalscope.domains import (
    Domain,
    Settings,
    modules_for,
    profile_named,
    profiles_of,
    settings_of,
)
from goalscope.envs import Environment
from goalscope.episode import Round
from goalscope.habits import habitual
from goalscope.models import Model, OnText, model_name
from goalscope.store import Ended, EpisodeInfo, Store
from goalscope.tracker import Correction
from goalscope.types import TRACKING, Goal, GoalChange, InvalidInputError, Turn, pluralize

__all__ = ["Session", "more_rounds", "resuming", "saved_settings"]


def resuming(info: EpisodeInfo) -> str:
    """The command that goes on with an episode; a domain that is a file must be named again."""
    own = [] if info.domain in get_args(Domain) else [info.domain]
    return shlex.join(["goalscope", "chat", *own, "--resume", info.id])


def more_rounds(info: EpisodeInfo, rounds: int) -> str:
    """How an episode goes on that has had its `rounds`."""
    return f"To go on, say `{resuming(info)} --rounds {2 * rounds}`."


def saved_settings(info: EpisodeInfo, *, rounds: int | None = None) -> Settings:
    """The settings of a stored episode that is to go on.

    Args:
        info: The episode.
        rounds: Most rounds, if not as before.

    Raises:
        InvalidInputError: The episode is complete, has had all its rounds, or is another program's.
    """
    if info.domain == TRACKING:
        raise InvalidInputError(f"In episode {info.id} another program talks, and only it goes on.")
    settings = settings_of(info.settings)
    if rounds is not None:
        settings = replace(settings, rounds=rounds)
    if info.ended == "terminated":
        raise InvalidInputError(
            f"Episode {info.id} is complete. `goalscope replay {info.id}` shows it."
        )
    if info.rounds >= settings.rounds:
        raise InvalidInputError(
            f"Episode {info.id} has had its {pluralize(settings.rounds, 'round')}. "
            + more_rounds(info, settings.rounds)
        )
    return settings


class Session:
    """One episode on its way into the store.

    Attributes:
        id: The episode's id in the store.
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
        owner: str | None = None,
        resume: EpisodeInfo | None = None,
        progress: Callable[[str], None] | None = None,
        draft: OnText | None = None,
        understood: Callable[[Round], None] | None = None,
    ) -> None:
        """Begin an episode, or continue one.

        Args:
            store: Keeps the rounds.
            settings: What is to run.
            env: Where; it is reset.
            model: Writes and scores.
            profile: Name of the simulated person; needed to `run` without a person.
            read: Shows a query to the person at the terminal, and returns their words; needed to
                `run` with one.
            owner: Whose episode it is, on the web page.
            resume: The stored episode to continue.
            progress: Is told what the agent does, as for `Agent`.
            draft: Is told each question that it writes, as for `Agent`.
            understood: Is told each round before the agent acts, as for `Agent`.

        Raises:
            InvalidInputError: There is no such profile, or no other one whose goal they could
                have before they change their mind.
        """
        self.profile = profile_named(settings, profile) if profile else None
        self._store, self._settings, self._env = store, settings, env
        self._agent = Agent(
            env,
            model,
            method=settings.method,
            layout=settings.layout,
            end_of_turn=settings.end_of_turn,
            calibration=calibration_named(settings.calibration) if settings.calibration else None,
            propose=settings.propose,
            modules=modules_for(settings, model),
            progress=progress,
            draft=draft,
            understood=understood,
        )
        self._human = self._make_human(model, read)
        self.earlier = store.rounds(resume.id) if resume else []
        self._agent.resume(self.earlier)
        said = store.corrections(resume.id, len(self.earlier)) if resume else []
        for correction, goal, text in said:
            self._agent.correct(correction, Goal(goal), text)
        self.id = (
            resume.id
            if resume
            else store.begin(
                domain=settings.domain,
                profile=profile,
                owner=owner,
                method=settings.method,
                model=model_name(model),
                task=env.task,
                settings=asdict(settings),
            )
        )

    @property
    def info(self) -> EpisodeInfo:
        """What the store knows of the episode."""
        return self._store.episode(self.id)

    def run(self) -> Iterator[Round]:
        """Yield each new round as soon as it is on disk; afterwards the episode has its end."""
        if self._human is None:
            raise ValueError("a person at the terminal needs a `read` function")
        for round in run_episode(self._agent, self._human, max_rounds=self._settings.rounds):
            self._keep(round)
            yield round
        if self.info.ended is None:
            ended, score = self._end(self.rounds)
            self._store.finish(self.id, ended=ended, score=score)

    def ask(self) -> str:
        """See `Agent.ask`."""
        return self._agent.ask()

    def step(self, query: str, utterance: str, *, confirmed: str = "") -> Round:
        """See `Agent.step`; the round is on disk when it returns."""
        return self._agent.step(query, utterance, confirmed=confirmed, keep=self._keep)

    def _keep(self, round: Round) -> None:
        ends = round.terminated or round.number >= self._settings.rounds
        self._store.append(self.id, round, end=self._end([round]) if ends else None)

    def _end(self, rounds: Sequence[Round]) -> tuple[Ended, float | None]:
        met = self.checks_met()
        ended = "terminated" if rounds and rounds[-1].terminated else "truncated"
        return ended, sum(met) / len(met) if met else None

    def correct(self, correction: Correction, goal: Goal, text: str = "") -> Belief:
        """See `Agent.correct`; it is on disk before it is shown."""
        belief = self._agent.correct(correction, goal, text)
        try:
            self._store.correct(self.id, len(self._agent.rounds), (correction, goal.text, text))
        except BaseException:
            self._agent.undo_correction()
            raise
        return belief

    def undo_correction(self) -> Belief:
        """See `Agent.undo_correction`; it is on disk before it is shown."""
        if self.can_undo_correction:
            self._store.undo_correction(self.id, len(self._agent.rounds))
        return self._agent.undo_correction()

    @property
    def corrections(self) -> list[GoalChange]:
        """What the person said of the goals themselves since the last round."""
        return self._agent.corrections

    @property
    def can_undo_correction(self) -> bool:
        """Whether there is a correction to take back."""
        return self._agent.can_undo_correction

    @property
    def belief(self) -> Belief | None:
        """The belief as it is now; None for the method that holds none."""
        return self._agent.tracker.belief if self._agent.tracker else None

    @property
    def rounds(self) -> list[Round]:
        """The rounds so far."""
        return self._agent.rounds

    @property
    def turns(self) -> list[Turn]:
        """The transcript so far."""
        return self._agent.turns

    def checks_met(self) -> list[bool]:
        """Which of the profile's checks the present state meets; none without a profile."""
        return self._env.checks_met(self.profile) if self.profile else []

    def unwanted(self) -> list[str] | None:
        """What came about that neither a check nor `welcome` asks for; None if there is no list."""
        profile = self.profile
        return self._env.unwanted(profile) if profile and profile.welcome else None

    def _make_human(self, model: Model, read: Callable[[str], str] | None) -> Human | None:
        human, seed = self._settings.human, self._settings.seed
        if human == "you":
            return read and ConsoleHuman(read)
        if self.profile is None:
            raise ValueError("a scripted or simulated person needs a profile")
        if human == "scripted":
            return ScriptedHuman(self.profile, self._env)
        if human == "simulated":
            return SimulatedHuman(model, self.profile, self._env, seed)
        people = profiles_of(self._settings)
        return habitual(human, model, self.profile, self._env, seed=seed, people=people)
