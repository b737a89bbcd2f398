"""The domains that agents act in: those of Sec. 4.2, and files of one's own."""

from __future__ import annotations

import importlib.util
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, get_args

from goalscope.base.types import Action, InvalidInputError, Profile
from goalscope.envs import Environment, missing
from goalscope.language.reader import check_verbs

BuiltIn = Literal["grocery", "house"]
BUILT_IN: tuple[BuiltIn, ...] = get_args(BuiltIn)
"""Names of the domains that come with goalscope."""

SHOP, HOUSE = BUILT_IN

Judged = Literal["outcome", "actions", "possible"]
"""What an evaluator can see of a result."""

View = Literal["basket", "map", "text"]
"""How the page shows a state: as a table of items, drawn from above, or as its text."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DomainSettings:
    """The settings that define an environment. Some apply to one domain only.

    Attributes:
        domain: Name of a domain, or a file (see `load_domain`).
        profiles: TOML file of profiles; None for those of the domain.
        catalogue: CSV file of the shop; None for the one of the domain.
        columns: Which heading of that file holds what.
        scene: Name or file of the house's scene; None for the profile's, or the first.
        simulator: The embedded house, or AI2-THOR ("thor").
        unity: Program that AI2-THOR starts; None for its own build.
    """

    domain: str = SHOP
    profiles: str | None = None
    catalogue: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict[str, str])
    scene: str | None = None
    simulator: Literal["embedded", "thor"] = "embedded"
    unity: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Domain:
    """What the rest of goalscope knows of a domain.

    Attributes:
        name: In settings: a short name, or the full path of a file.
        label: For people.
        open: Opens an environment, for a profile if there is one.
        load_profiles: Reads the profiles of a file; None for those of the domain.
        possible: What an agent can do here; None for the verbs.
        about: What the page says of it; "" for the environment's task.
        view: How the page shows its state.
        settings: Names of the settings that only this domain takes.
        alias: Another name of it in corpora.
        scenes: Names of its scenes.
        notes: What a person should know about what an environment has loaded.
        replays: Whether a stored episode can be replayed without running anybody else's program.
        judged: What an evaluator sees of a result.
        snapshot: What `draw` needs of an earlier state; None where there is nothing to draw.
        draw: Draws the state as an SVG of a width in px; what has changed since a snapshot stands
            out.
        open_planner: Opens a planner of its own, for a model and a seed; None for the usual one.
        trivial: Policies that do the same for everybody, by name: each takes one of its lists of
            actions, at random.
    """

    name: str
    label: str
    open: Callable[[DomainSettings, Profile | None], Environment]
    load_profiles: Callable[[str | None], Sequence[Profile]]
    possible: tuple[str, ...] | None = None
    about: str = ""
    view: View = "text"
    settings: frozenset[str] = frozenset()
    alias: str = ""
    scenes: Callable[[], Sequence[str]] = lambda: ()
    notes: Callable[[Environment], Sequence[str]] = lambda _: ()
    replays: Callable[[DomainSettings], bool] = lambda _: False
    judged: tuple[Judged, ...] = get_args(Judged)
    snapshot: Callable[[Environment], Any] | None = None
    draw: Callable[[Environment, Any, int | None], str] = lambda _, before, width: ""
    open_planner: Callable[[Any, int], Any] | None = None
    trivial: Callable[[Environment], Mapping[str, Sequence[Sequence[Action]]]] = lambda _: {}


def domain_named(name: str) -> Domain:
    """The domain of this name in settings.

    Raises:
        InvalidInputError: It is a file that this process was not told to run.
    """
    if name in BUILT_IN:
        domain: Domain = import_module(f"goalscope.envs.{name}.domain").DOMAIN
        return domain
    module = OWN.module(name)
    return Domain(
        name=name,
        label=Path(name).stem,
        open=lambda _, profile: _opened(name, module, profile),
        load_profiles=module.load_profiles,
        open_planner=getattr(module, "open_planner", None),
    )


def known_as(name: str) -> str:
    """The name of the domain that comes with goalscope under an alias; any other as it is."""
    if name in BUILT_IN:
        return name  # without importing the other domain
    return next((each for each in BUILT_IN if domain_named(each).alias == name), name)


def load_domain(name: str, folder: Path | None = None) -> str:
    """Make a domain known to this process; returns its name for settings.

    A file of Python is run. It must have functions `open_environment(profile)`, where the profile
    may be None, and `load_profiles(path)`, where None stands for its own people; it may have
    `open_planner(model, seed)`. A file that only a stored episode names is never run.

    Args:
        name: A name or an alias of a domain, or a file.
        folder: Where the file is, if its path is relative; None for here.

    Raises:
        InvalidInputError: It is none of these, it cannot be run, or a function is missing.
    """
    if known_as(name) in BUILT_IN:
        return known_as(name)
    path = Path(folder or "", name).absolute()
    if not (path.is_file() and path.suffix == ".py"):
        known = ", ".join(f'"{each}"' for each in BUILT_IN)
        raise InvalidInputError(
            f"A domain must be {known} or an existing Python file (.py), not {name!r}."
        )
    return OWN.run(path, ("open_environment", "load_profiles"))


def open_environment(settings: DomainSettings, profile: Profile | None = None) -> Environment:
    """Open the environment of some settings, for a profile if there is one."""
    return domain_named(settings.domain).open(settings, profile)


def task_of(settings: DomainSettings) -> str:
    """The task of the agent in the domain."""
    with open_environment(settings) as env:
        return env.task


def profiles_of(settings: DomainSettings) -> tuple[Profile, ...]:
    """The profiles of the domain, or of the settings' file.

    Raises:
        InvalidInputError: The file holds none of this domain's profiles.
    """
    return tuple(domain_named(settings.domain).load_profiles(settings.profiles))


def profile_named(settings: DomainSettings, name: str) -> Profile:
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


def _opened(name: str, module: ModuleType, profile: Profile | None) -> Environment:
    """An environment of a file, once it has what agents call."""
    env = module.open_environment(profile)
    if not isinstance(env, Environment):
        raise InvalidInputError(
            f"{name}: open_environment must return a goalscope.envs.Environment, not {env!r}."
        )
    for member in missing(env):
        raise InvalidInputError(
            f"{name}: `{member}` is missing in {type(env).__name__}. Add it; see docs/domain.md."
        )
    try:
        check_verbs(env.verbs)
    except InvalidInputError as error:
        raise InvalidInputError(f"{name}: {error}") from None
    return env


class OwnFiles:
    """The Python files that a user named, and that this process has run."""

    def __init__(self) -> None:
        self.modules: dict[str, ModuleType] = {}

    def run(self, path: Path, functions: tuple[str, ...]) -> str:
        """Run a file that has these functions; returns its full path.

        Raises:
            InvalidInputError: It cannot be run, or a function is missing.
        """
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
        self.modules[str(path)] = module
        return str(path)

    def module(self, file: str) -> ModuleType:
        """The module of a file.

        Raises:
            InvalidInputError: The file was not run.
        """
        if file not in self.modules:
            raise InvalidInputError(
                f"{file} is a Python file, which only runs if you name it on the command line, "
                "such as `goalscope chat FILE.py --resume ID`, or `goalscope chat --likelihood "
                "FILE.py:NAME --resume ID`."
            )
        return self.modules[file]

    def failure_in(self, error: BaseException) -> str:
        """The line of a file that an error passed through, and why; "" if it passed none."""
        for name in self.modules:
            for frame in traceback.extract_tb(error.__traceback__):
                if frame.filename == name:
                    where = _where(error, Path(name))
                    return f"{name}{where}. Correct `{frame.name}` in that file."
        return ""


OWN = OwnFiles()
"""The files that were run in this process."""


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
