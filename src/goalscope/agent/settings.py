"""The settings of an episode, and what they choose for an agent."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, cast, get_args

from goalscope.agent.agent import Ablation, K, role_play
from goalscope.agent.people import Habit
from goalscope.agent.toolkit import Module, Preset, Toolkit, toolkit_of
from goalscope.base.types import TRACKING, InvalidInputError
from goalscope.belief.calibration import DEFAULT, Calibration, calibration_named
from goalscope.belief.goal_manager import Trigger
from goalscope.belief.likelihood import (
    Layout,
    Likelihood,
    calibration_of,
    misfit,
    unusable,
)
from goalscope.belief.method import implied
from goalscope.envs.registry import OWN, DomainSettings, domain_named
from goalscope.models import LikelihoodModel, Model


@dataclass(frozen=True, slots=True)
class Settings(DomainSettings):
    """The settings of an episode, which are stored with it.

    Attributes:
        human: "you" at the terminal, or a person with a profile: "scripted", "simulated", or
            simulated with a `Habit`.
        method: "good" or an ablation (see `Agent`, as for the next), or one's own (`load_own`).
        preset: "paper", or None.
        model: See `open_model`, as for the next four; None for the embedded model.
        generator: Writes, if not `model`.
        scorer: Scores, if not `model`.
        tokenizer: Of a served model.
        adapter: For the model that scores; None for the one that comes with the embedded model.
        likelihood: A likelihood of one's own (see `load_own`); None for the role-play one.
        layout: Where the role-play prompt states the goal; None for the default place.
        calibration: Name or file of one; None for that of `Agent`, as for `propose`.
        propose: See `Agent`, as for the next two.
        k: Number of goals to act on.
        prompted: Modules that use the paper's prompts, whatever the model was taught.
        seed: Seed of all random draws.
        rounds: Most rounds.
    """

    human: Literal["you", "scripted", "simulated"] | Habit = "you"
    method: str = "good"
    preset: Preset | None = None
    model: str | None = None
    generator: str | None = None
    scorer: str | None = None
    tokenizer: str | None = None
    adapter: str | None = None
    likelihood: str | None = None
    layout: Layout | None = None
    calibration: str | None = None
    propose: Trigger | None = None
    k: int = K
    prompted: tuple[Module, ...] = ()
    seed: int = 0
    rounds: int = 100


def settings_of(stored: Mapping[str, Any]) -> Settings:
    """The settings that an episode was stored with, without those of tracking."""
    given: dict[str, Any] = {key: value for key, value in stored.items() if key != TRACKING}
    given["prompted"] = tuple(given.get("prompted", ()))
    return Settings(**given)


def load_own(name: str, what: str = "likelihood") -> str:
    """Make a likelihood or method of one's own known to this process; returns its full name.

    The file is run. A file that only a stored episode names is never run.

    Args:
        name: "FILE.py:NAME", a file of Python and a function or class in it, which is called with
            the model and returns a `Likelihood`, or a `goalscope.belief.method.Method`.
        what: What it is, for errors.

    Raises:
        InvalidInputError: There is no such file or function, or the file cannot be run.
    """
    file, _, function = name.rpartition(":")
    path = Path(file).absolute()
    if not (path.is_file() and path.suffix == ".py" and function.isidentifier()):
        raise InvalidInputError(
            f"A {what} is an existing Python file and the function in it that makes the "
            f"{what}, such as mine.py:Mine, not {name!r}."
        )
    return f"{OWN.run(path, (function,))}:{function}"


def load_method(name: str) -> str:
    """The name of a method in settings: an ablation, or one's own (see `load_own`).

    Raises:
        InvalidInputError: There is none of this name.
    """
    if ":" in name or name.endswith(".py"):
        return load_own(name, "method")
    if name not in get_args(Ablation):
        raise InvalidInputError(
            f"There is no method {name!r}. Choose one of {', '.join(get_args(Ablation))}, or name "
            "your own, such as mine.py:Mine."
        )
    return name


def toolkit_for(settings: Settings, model: Model) -> Toolkit:
    """The modules that propose, remove, plan and ask in the domain."""
    found = toolkit_of(model, settings.prompted, preset=settings.preset)
    open_planner = domain_named(settings.domain).open_planner
    return replace(found, planner=open_planner(model, settings.seed)) if open_planner else found


def inference_of(settings: Settings, model: Model) -> tuple[Ablation, Likelihood | None]:
    """The ablation of an episode, and its likelihood; "good" with the evidence of one's own."""
    if settings.method in get_args(Ablation):
        method = cast("Ablation", settings.method)
        good = method == "good"
        return method, likelihood_for(settings, model, DEFAULT) if good else None
    return "good", own_likelihood(settings.method, model)


def likelihood_for(
    settings: Settings, model: Model, calibration: Calibration | None = None
) -> Likelihood:
    """The likelihood of an episode.

    Args:
        settings: Of the episode.
        model: Scores.
        calibration: What it goes with, unless the settings name one; None for its own.
    """
    if settings.likelihood:
        return own_likelihood(settings.likelihood, model)
    named = calibration_named(settings.calibration) if settings.calibration else calibration
    is_paper = settings.preset == "paper" and settings.adapter is None
    return role_play(model, named, settings.layout, paper=is_paper)


def own_likelihood(name: str, model: LikelihoodModel) -> Likelihood:
    """The likelihood of a file that `load_own` has run, or that which a method implies.

    Raises:
        InvalidInputError: It was not run, or returns no likelihood.
    """
    file, _, function = name.rpartition(":")
    make: Callable[[LikelihoodModel], Likelihood] = getattr(OWN.module(file), function)
    if wrong := misfit(make, model):
        raise InvalidInputError(
            f"{name} must take one argument, the model ({wrong}), such as `def __init__(self, "
            "model)` of a class."
        )
    found = make(model)
    if hasattr(found, "probabilities"):
        return implied(cast("Any", found))
    if wrong := unusable(found):
        raise InvalidInputError(f"{name} must return a likelihood: {wrong}.")
    calibration_of(found)
    return found
