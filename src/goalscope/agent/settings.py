"""The domains of Sec. 4.2 and those of users, and the settings of an episode."""

from __future__ import annotations

import importlib.util
import os
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from goalscope.agent.agent import K, Method
from goalscope.agent.people import Habit
from goalscope.agent.toolkit import Module, Toolkit, toolkit_of
from goalscope.base.types import TRACKING, InvalidInputError, Profile
from goalscope.belief.goal_manager import UNEXPLAINED, Trigger
from goalscope.belief.likelihood import (
    DEFAULT_LAYOUT,
    Layout,
    Likelihood,
    RolePlay,
    calibration_of,
    misfit,
    unusable,
)
from goalscope.envs import Environment, missing
from goalscope.language.reader import check_verbs
from goalscope.models import LikelihoodModel, Model

if TYPE_CHECKING:
    from goalscope.envs.grocery import Catalogue
    from goalscope.envs.grocery.search import Search

__all__ = [
    "Domain",
    "Settings",
    "failure_in",
    "likelihood_for",
    "load_domain",
    "load_likelihood",
    "notes_of",
    "open_environment",
    "own_likelihood",
    "possible_actions",
    "profile_named",
    "profiles_of",
    "settings_of",
    "toolkit_for",
]

Domain = Literal["grocery", "house"]
"""The shop, or the home robot."""
SCENE = "Kitchen1"
THOR_SCENE = "FloorPlan1"
"""Where the robot is when nobody says, in the embedded house and in AI2-THOR."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of an episode, which are stored with it.

    Attributes:
        domain: "grocery", "house", or a file (see `load_domain`).
        human: "you" at the terminal, or a person with a profile: "scripted", "simulated", or
            simulated with a `Habit`.
        method: See `Agent`.
        model: See `open_model`, as for the next four; None for the embedded model.
        generator: Writes, if not `model`.
        scorer: Scores, if not `model`.
        tokenizer: Of a served model.
        adapter: For the model that scores; None for the one that comes with the embedded model.
        profiles: TOML file of profiles; None for those of the domain.
        catalogue: CSV file of the shop; None for the one of the domain.
        columns: Which heading of that file holds what.
        scene: Name or file of the house's scene; None for the profile's, or the first.
        simulator: The embedded house, or AI2-THOR ("thor").
        unity: Program that AI2-THOR starts; None for its own build.
        likelihood: A likelihood of one's own (see `load_likelihood`); None for the role-play one.
        layout: Where the role-play prompt states the goal; None for the default place.
        calibration: Name or file of one; None for that of `Agent`.
        propose: See `Agent`, as for the next two.
        k: Number of goals to act on.
        prompted: Toolkit that use the paper's prompts, whatever the model was taught.
        seed: Seed of all random draws.
        rounds: Most rounds.
    """

    domain: str = "grocery"
    human: Literal["you", "scripted", "simulated"] | Habit = "you"
    method: Method = "good"
    model: str | None = None
    generator: str | None = None
    scorer: str | None = None
    tokenizer: str | None = None
    adapter: str | None = None
    profiles: str | None = None
    catalogue: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict[str, str])
    scene: str | None = None
    simulator: Literal["house", "thor"] = "house"
    unity: str | None = None
    likelihood: str | None = None
    layout: Layout | None = None
    calibration: str | None = None
    propose: Trigger = UNEXPLAINED
    k: int = K
    prompted: tuple[Module, ...] = ()
    seed: int = 0
    rounds: int = 100


def settings_of(stored: Mapping[str, Any]) -> Settings:
    """The settings that an episode was stored with, without those of tracking."""
    given: dict[str, Any] = {key: value for key, value in stored.items() if key != TRACKING}
    given["prompted"] = tuple(given.get("prompted", ()))
    return Settings(**given)


def load_domain(name: str) -> str:
    """Make a domain known to this process; returns its name for `Settings`.

    A file of Python is run. It must have functions `open_environment(profile)`, where the profile
    may be None, and `load_profiles(path)`, where None stands for its own people; it may have
    `open_planner(model, seed)`. A file that only a stored episode names is never run.

    Args:
        name: "grocery", "house" or a file.

    Raises:
        InvalidInputError: It is none of these, it cannot be run, or a function is missing.
    """
    if name in get_args(Domain):
        return name
    path = Path(name).absolute()
    if not (path.is_file() and path.suffix == ".py"):
        raise InvalidInputError(
            f'A domain must be "grocery", "house" or an existing Python file (.py), not {name!r}.'
        )
    return _loaded(path, ("open_environment", "load_profiles"))


def load_likelihood(name: str) -> str:
    """Make a likelihood of one's own known to this process; returns its name for `Settings`.

    The file is run. A file that only a stored episode names is never run.

    Args:
        name: "FILE.py:NAME", a file of Python and a function or class in it, which is called with
            the model and returns a `Likelihood`.

    Raises:
        InvalidInputError: There is no such file or function, or the file cannot be run.
    """
    file, _, function = name.rpartition(":")
    path = Path(file).absolute()
    if not (path.is_file() and path.suffix == ".py" and function.isidentifier()):
        raise InvalidInputError(
            "A likelihood is an existing Python file and the function in it that makes the "
            f"likelihood, such as mine.py:Mine, not {name!r}."
        )
    return f"{_loaded(path, (function,))}:{function}"


def _loaded(path: Path, functions: tuple[str, ...]) -> str:
    """Run a file of Python that has these functions; returns its full path."""
    spec = importlib.util.spec_from_file_location(f"goalscope_own_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise InvalidInputError(f"{path} is no file of Python.")
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # whatever it runs into
        del sys.modules[spec.name]
        raise InvalidInputError(f"{path}{_where(error, path)}. Fix the file.") from error
    for function in functions:
        if not callable(getattr(module, function, None)):
            raise InvalidInputError(f"{path}: the function {function} is missing.")
    _OWN[str(path)] = module
    return str(path)


def _where(error: BaseException, file: Path) -> str:
    """The line of the file that failed, and why."""
    if isinstance(error, SyntaxError) and error.filename == str(file):
        return f", line {error.lineno}: {error.msg}"
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename == str(file)
    ]
    return f"{f', line {lines[-1]}' if lines else ''}: {type(error).__name__}: {error}"


def failure_in(error: BaseException) -> str:
    """The line of a user's domain that an error passed through, and why; "" if it passed none."""
    for name in _OWN:
        for frame in traceback.extract_tb(error.__traceback__):
            if frame.filename == name:
                return f"{name}{_where(error, Path(name))}. Correct `{frame.name}` in that file."
    return ""


_OWN: dict[str, Any] = {}


def _own(file: str) -> Any:
    """The module of a domain or likelihood that is a file."""
    if file not in _OWN:
        raise InvalidInputError(
            f"{file} is a Python file, which only runs if you name it on the command line, such as "
            "`goalscope chat FILE.py --resume ID`, or `goalscope chat --likelihood FILE.py:NAME "
            "--resume ID`."
        )
    return _OWN[file]


def open_environment(settings: Settings, profile: Profile | None = None) -> Environment:
    """Open the shop, the home robot in the settings' scene or the profile's, or a user's domain."""
    if settings.domain not in get_args(Domain):
        found = _own(settings.domain).open_environment(profile)
        if not isinstance(found, Environment):
            raise InvalidInputError(
                f"{settings.domain}: open_environment must return a "
                f"goalscope.envs.Environment, not {found!r}."
            )
        for name in missing(found):
            raise InvalidInputError(
                f"{settings.domain}: `{name}` is missing in {type(found).__name__}. Add it; "
                "see docs/domain.md."
            )
        try:
            check_verbs(found.verbs)
        except InvalidInputError as error:
            raise InvalidInputError(f"{settings.domain}: {error}") from None
        return found
    if settings.domain == "grocery":
        from goalscope.envs.grocery import GroceryShop

        path = settings.catalogue
        changed = os.stat(path).st_mtime_ns if path and os.path.exists(path) else 0
        catalogue, search = _stock(path, tuple(settings.columns.items()), changed)
        return GroceryShop(catalogue, search=search)
    from goalscope.envs.house import HomeRobot, HouseController, load_scene, start_thor

    scene = settings.scene or (profile.scene if profile else "")
    if settings.simulator == "thor":
        if profile and not settings.scene:
            raise InvalidInputError(
                f"The profile {profile.name} needs the scene {scene}, which AI2-THOR may not "
                "have. Name one of its scenes with --scene."
            )
        return HomeRobot(start_thor(scene or THOR_SCENE, settings.unity))
    loaded = load_scene(scene or SCENE)
    notes = loaded.notes
    if profile and settings.scene and settings.scene != profile.scene:
        notes += (
            f"The profile {profile.name} is written for {profile.scene}; this room may lack "
            "what it needs.",
        )
    return HomeRobot(HouseController(loaded), notes=notes)


def notes_of(env: Environment) -> Sequence[str]:
    """What a person should know about what was loaded, one sentence each."""
    from goalscope.envs.grocery import GroceryShop
    from goalscope.envs.house import HomeRobot

    if isinstance(env, GroceryShop):
        return env.catalogue.notes
    return env.notes if isinstance(env, HomeRobot) else ()


@lru_cache(maxsize=4)
def _stock(
    path: str | None, columns: tuple[tuple[str, str], ...], changed: int
) -> tuple[Catalogue, Search]:
    """What all shops of one catalogue share, until the file is `changed`."""
    from goalscope.envs.grocery import Catalogue
    from goalscope.envs.grocery.search import Search

    catalogue = Catalogue.load(path, columns=dict(columns))
    return catalogue, Search(catalogue)


def toolkit_for(settings: Settings, model: Model) -> Toolkit:
    """The modules that propose, remove, plan and ask in the domain."""
    found = toolkit_of(model, settings.prompted)
    own = None
    if settings.domain not in get_args(Domain):
        own = getattr(_own(settings.domain), "open_planner", None)
    return replace(found, planner=own(model, settings.seed)) if own else found


def likelihood_for(settings: Settings, model: LikelihoodModel) -> Likelihood:
    """The likelihood of an episode."""
    if settings.likelihood:
        return own_likelihood(settings.likelihood, model)
    return RolePlay(model, layout=settings.layout or DEFAULT_LAYOUT)


def own_likelihood(name: str, model: LikelihoodModel) -> Likelihood:
    """The likelihood of a file that `load_likelihood` has run.

    Raises:
        InvalidInputError: It was not run, or returns no likelihood.
    """
    file, _, function = name.rpartition(":")
    make: Callable[[LikelihoodModel], Likelihood] = getattr(_own(file), function)
    if wrong := misfit(make, model):
        raise InvalidInputError(f"{name} is called with the model alone ({wrong}).")
    found = make(model)
    if wrong := unusable(found):
        raise InvalidInputError(f"{name} must return a likelihood: {wrong}.")
    calibration_of(found)
    return found


def profiles_of(settings: Settings) -> tuple[Profile, ...]:
    """The profiles of the domain, or of the settings' file.

    Raises:
        InvalidInputError: The file is none of this domain's profiles.
    """
    if settings.domain == "grocery":
        from goalscope.envs.grocery import load_profiles
    elif settings.domain == "house":
        from goalscope.envs.house import load_profiles
    else:
        load_profiles = _own(settings.domain).load_profiles
    return load_profiles(settings.profiles)


def profile_named(settings: Settings, name: str) -> Profile:
    """The domain's profile of this name.

    Raises:
        InvalidInputError: There is none.
    """
    profiles = {profile.name: profile for profile in profiles_of(settings)}
    if name not in profiles:
        raise InvalidInputError(
            f'There is no profile "{name}". Choose one of {", ".join(profiles)}, or "all".'
        )
    return profiles[name]


def possible_actions(domain: str) -> tuple[str, ...]:
    """What an agent of "grocery" or "house" can do, for `possible` of `judge`."""
    if domain == "grocery":
        from goalscope.envs.grocery.shop import NAMES
    else:
        from goalscope.envs.house.actions import NAMES
    return NAMES
