"""The domains of Sec. 4.2 and those of users, and the settings of an episode."""

from __future__ import annotations

import importlib.util
import os
import sys
import traceback
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from goalscope.agent import Method
from goalscope.envs import Environment, missing
from goalscope.goals import UNEXPLAINED, Trigger
from goalscope.habits import Habit
from goalscope.likelihood import DEFAULT_LAYOUT, Layout, RolePlay
from goalscope.models import Model
from goalscope.modules import Module, Modules, modules_of
from goalscope.reader import check_verbs
from goalscope.types import TRACKING, InvalidInputError, Profile

if TYPE_CHECKING:
    from goalscope.envs.grocery import Catalogue
    from goalscope.envs.grocery.search import Search

__all__ = [
    "Domain",
    "Settings",
    "failure_in",
    "load_domain",
    "modules_for",
    "open_environment",
    "possible_actions",
    "profile_named",
    "profiles_of",
    "roleplay_of",
    "settings_of",
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
        layout: See `Agent`, as for the next one.
        end_of_turn: Whether the end of the utterance is scored.
        calibration: Name or file of one; None for that of `Agent`.
        propose: See `Agent`.
        prompted: Modules that use the paper's prompts, whatever the model was taught.
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
    layout: Layout | None = None
    end_of_turn: bool = False
    calibration: str | None = None
    propose: Trigger = UNEXPLAINED
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
    spec = importlib.util.spec_from_file_location(f"goalscope_domain_{path.stem}", path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise InvalidInputError(
            f'A domain must be "grocery", "house" or an existing Python file (.py), not {name!r}.'
        )
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # whatever it runs into
        del sys.modules[spec.name]
        raise InvalidInputError(f"{name}{_where(error, path)}. Fix the file.") from error
    for function in ("open_environment", "load_profiles"):
        if not callable(getattr(module, function, None)):
            raise InvalidInputError(f"{name}: the function {function} is missing.")
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


def _own(domain: str) -> Any:
    """The module of a domain that is a file."""
    if domain not in _OWN:
        raise InvalidInputError(
            f"The domain {domain} is a Python file, which only runs if you name it on the "
            "command line, such as `goalscope chat FILE.py --resume ID`."
        )
    return _OWN[domain]


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
            check_verbs(found.verbs, found.examples)
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


@lru_cache(maxsize=4)
def _stock(
    path: str | None, columns: tuple[tuple[str, str], ...], changed: int
) -> tuple[Catalogue, Search]:
    """What all shops of one catalogue share, until the file is `changed`."""
    from goalscope.envs.grocery import Catalogue
    from goalscope.envs.grocery.search import Search

    catalogue = Catalogue.load(path, columns=dict(columns))
    return catalogue, Search(catalogue)


def modules_for(settings: Settings, model: Model) -> Modules:
    """The modules that propose, remove, plan and ask in the domain."""
    found = modules_of(model, settings.prompted)
    own = None
    if settings.domain not in get_args(Domain):
        own = getattr(_own(settings.domain), "open_planner", None)
    return replace(found, planner=own(model, settings.seed)) if own else found


def roleplay_of(settings: Settings, model: Model) -> RolePlay:
    """The role-play likelihood of an episode."""
    layout = settings.layout or DEFAULT_LAYOUT
    return RolePlay(model, layout=layout, end_of_turn=settings.end_of_turn)


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
    """What an agent of "grocery" or "house" can do, for `possible` of `goalscope.judge.judge`."""
    if domain == "grocery":
        from goalscope.envs.grocery.shop import NAMES
    else:
        from goalscope.envs.house.actions import NAMES
    return NAMES
