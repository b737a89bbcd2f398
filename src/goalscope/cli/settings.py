"""What an episode's options say, checked and as a resumed episode finds it again."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from goalscope.cli.terminal import model_names, opened_model
from goalscope.types import InvalidInputError

if TYPE_CHECKING:
    from goalscope.domains import Settings
    from goalscope.goals import Trigger
    from goalscope.models import OpenModel
    from goalscope.modules import Module

__all__ = ["check_picture", "engine_of", "settings_given"]


def engine_of(settings: Settings, calls: Path | None = None) -> AbstractContextManager[OpenModel]:
    """The model of an episode; see `opened_model`."""
    from goalscope.models.opening import MODEL_KEYS

    return opened_model({key: getattr(settings, key) for key in MODEL_KEYS}, calls)


def settings_given(picture: Path | None = None, **given: Any) -> Settings:
    """The settings of options as they were given, if these fit the domain.

    Args:
        picture: File to draw the house's room into.
        **given: By the names of `Settings`; those of the model as `--model` and so on take them.

    Raises:
        InvalidInputError: An option cannot be used or would be silently without effect, or the
            picture's folder is missing.
    """
    from goalscope.domains import Settings, load_domain
    from goalscope.models.opening import MODEL_KEYS

    readers: dict[str, Callable[[Any], Any]] = {
        **dict.fromkeys(("profiles", "catalogue", "unity"), _absolute),
        "domain": load_domain,
        "columns": _columns,
        "scene": _scene,
        "calibration": _calibration,
        "propose": _propose,
        "prompted": _prompted,
    }
    names = model_names(**{key: given.pop(key) for key in MODEL_KEYS if key in given})
    read = {key: readers[key](value) if key in readers else value for key, value in given.items()}
    settings = Settings(**names, **read)
    shop = {"--catalogue": settings.catalogue, "--column": settings.columns}
    home = {"--scene": settings.scene, "--unity": settings.unity}
    home["--simulator"] = settings.simulator if settings.simulator != "house" else None
    others = {
        **(shop if settings.domain != "grocery" else {}),
        **(home if settings.domain != "house" else {}),
    }
    for option, value in others.items():
        if value:
            raise InvalidInputError(f"{option} is not for the domain {settings.domain!r}.")
    if settings.unity and settings.simulator != "thor":
        raise InvalidInputError("--unity goes with --simulator thor.")
    check_picture(picture, settings.domain)
    if settings.method != "good":
        for option in ("layout", "end_of_turn", "calibration", "propose"):
            if given.get(option):
                raise InvalidInputError(
                    f"--{option.replace('_', '-')} is for the method 'good': {settings.method!r} "
                    "weighs no evidence. Leave it out."
                )
    return settings


def check_picture(picture: Path | None, domain: str) -> None:
    """Refuse a picture that could not be drawn.

    Raises:
        InvalidInputError: The domain has no rooms, or the picture's folder is missing.
    """
    if picture and domain != "house":
        raise InvalidInputError(f"--picture is not for the domain {domain!r}.")
    if picture and not picture.absolute().parent.is_dir():
        raise InvalidInputError(f"There is no folder {picture.parent} for the picture.")


def _scene(given: str | None) -> str | None:
    """A scene's name, or its file as a resumed episode finds it again from any folder."""
    return _absolute(Path(given)) if given and Path(given).is_file() else given


def _absolute(path: Path | None) -> str | None:
    """The path as a resumed episode finds it again from any folder."""
    return None if path is None else str(path.absolute())


def _calibration(given: str | None) -> str | None:
    """The name or file, once it is known to be one."""
    from goalscope.calibrations import NAMED, calibration_named

    if given is None or given in NAMED:
        return given
    calibration_named(given)
    return _absolute(Path(given))


def _propose(given: str | None) -> Trigger:
    """A probability, or "paper"."""
    from goalscope.goals import UNEXPLAINED

    if given is None or given == "paper":
        return given or UNEXPLAINED
    try:
        return float(given)
    except ValueError:
        raise InvalidInputError(
            f'--propose takes a probability or "paper", not "{given}".'
        ) from None


def _prompted(given: list[str] | None) -> tuple[Module, ...]:
    from goalscope.modules import modules_named

    return modules_named(given or ())


def _columns(given: list[str] | None) -> dict[str, str]:
    pairs = [each.partition("=") for each in given or ()]
    for name, mark, title in pairs:
        if not (name and mark and title):
            raise InvalidInputError(f'--column takes NAME=TITLE, not "{name}{mark}{title}".')
    return {name: title for name, _, title in pairs}
