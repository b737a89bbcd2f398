"""An episode that is stored while it runs, so that it can go on after any interruption."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Literal

from goalscope.agent import Agent, Method, run_episode
from goalscope.dialog import ConsoleHuman, Human, ScriptedHuman, SimulatedHuman
from goalscope.envs import Environment
from goalscope.envs.grocery import Catalogue, GroceryShop, load_profiles
from goalscope.episode import Round
from goalscope.likelihood import Layout
from goalscope.models import Model
from goalscope.store import EpisodeInfo, Store
from goalscope.types import DEFAULT_TEMPERATURE, InvalidInputError, Profile

__all__ = ["Session", "Settings", "open_environment", "saved_settings"]


@dataclass(frozen=True, slots=True)
class Settings:
    """Everything that makes an episode what it is; stored with it.

    Attributes:
        human: Who answers: "you" at the terminal, or the profile's "scripted" or "simulated" one.
        method: See `Agent`.
        model: See `open_model`, as for the next three; None for the embedded model.
        generator: Writes, if not `model`.
        scorer: Scores, if not `model`.
        tokenizer: Of a served model.
        profiles: TOML file of profiles; None for those of the domain.
        catalogue: CSV file of the shop; None for the one of the domain.
        columns: Which heading of that file holds what.
        layout: See `Agent`, as for the next four.
        evidence: "sum" or "last".
        end_of_turn: Whether the end of the utterance is scored.
        temperature: Divides the evidence.
        seed: Seed of everything that is drawn.
        rounds: Most rounds.
    """

    human: Literal["you", "scripted", "simulated"] = "you"
    method: Method = "good"
    model: str | None = None
    generator: str | None = None
    scorer: str | None = None
    tokenizer: str | None = None
    profiles: str | None = None
    catalogue: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict[str, str])
    layout: Layout | None = None
    evidence: str = "sum"
    end_of_turn: bool = False
    temperature: float = DEFAULT_TEMPERATURE
    seed: int = 0
    rounds: int = 20


def open_environment(settings: Settings) -> Environment:
    """The grocery shop with the catalogue that the settings name."""
    return GroceryShop(Catalogue.load(settings.catalogue, columns=settings.columns))


def saved_settings(info: EpisodeInfo, *, rounds: int | None = None) -> Settings:
    """The settings of a stored episode that is to go on.

    Args:
        info: The episode.
        rounds: Most rounds, if not as before.

    Raises:
        InvalidInputError: The episode is complete, or has had all its rounds.
    """
    settings = Settings(**info.settings)
    if rounds is not None:
        settings = replace(settings, rounds=rounds)
    if info.ended == "terminated":
        raise InvalidInputError(
            f"Episode {info.id} is complete. `goalscope replay {info.id}` shows it."
        )
    if info.rounds >= settings.rounds:
        raise InvalidInputError(
            f"Episode {info.id} has had its {settings.rounds} rounds. "
            f"To go on, say `goalscope chat --resume {info.id} --rounds {2 * settings.rounds}`."
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
        resume: EpisodeInfo | None = None,
    ) -> None:
        """Begin an episode, or continue one.

        Args:
            store: Keeps the rounds.
            settings: What is to run.
            env: Where; it is reset.
            model: Writes and scores.
            profile: Name of the simulated person; needed unless a person is at the terminal.
            read: Shows a query to the person at the terminal, and returns their words.
            resume: The stored episode to continue.

        Raises:
            InvalidInputError: There is no such profile.
        """
        self.profile = _find_profile(settings.profiles, profile) if profile else None
        self._store, self._settings, self._env = store, settings, env
        self._agent = Agent(
            env,
            model,
            method=settings.method,
            layout=settings.layout,
            end_of_turn=settings.end_of_turn,
            temperature=settings.temperature,
            evidence=settings.evidence,
            seed=settings.seed,
        )
        self._human = self._make_human(model, read)
        self.earlier = store.rounds(resume.id) if resume else []
        self._agent.resume(self.earlier)
        self.id = (
            resume.id
            if resume
            else store.begin(
                domain="grocery",
                profile=profile,
                method=settings.method,
                model=getattr(model, "name", type(model).__name__),
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
        most = self._settings.rounds
        for round in run_episode(self._agent, self._human, max_rounds=most):
            self._store.append(self.id, round)
            if round.terminated or round.number >= most:
                self._finish()
            yield round
        if self.info.ended is None:
            self._finish()

    def _finish(self) -> None:
        rounds = self._agent.rounds
        ended = "terminated" if rounds and rounds[-1].terminated else "truncated"
        met = self.checks_met()
        self._store.finish(self.id, ended=ended, score=sum(met) / len(met) if met else None)

    def checks_met(self) -> list[bool]:
        """Which of the profile's checks the present state meets; none without a profile."""
        return self._env.checks_met(self.profile) if self.profile else []

    def _make_human(self, model: Model, read: Callable[[str], str] | None) -> Human:
        if self._settings.human == "you":
            if read is None:
                raise ValueError("a person at the terminal needs a `read` function")
            return ConsoleHuman(read)
        if self.profile is None:
            raise ValueError("a scripted or simulated person needs a profile")
        if self._settings.human == "scripted":
            return ScriptedHuman(self.profile, self._env)
        return SimulatedHuman(model, self.profile, self._env, seed=self._settings.seed)


def _find_profile(file: str | None, name: str) -> Profile:
    profiles = {profile.name: profile for profile in load_profiles(file)}
    if name not in profiles:
        raise InvalidInputError(
            f'There is no profile "{name}". There are: {", ".join(profiles)}; or say "all".'
        )
    return profiles[name]
