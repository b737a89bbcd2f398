"""Options that commands share, and the settings of an episode from them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from goalscope.base.types import InvalidInputError
from goalscope.cli.terminal import model_names

if TYPE_CHECKING:
    from goalscope.agent.settings import Settings
    from goalscope.belief.goal_manager import Trigger

Domain = Annotated[
    str | None,
    typer.Argument(
        metavar="DOMAIN|FILE.py",
        help="Domain to act in, or the Python file of your own.  [default: grocery]",
    ),
]
Method = Annotated[
    str,
    typer.Option(
        metavar="good|no-goals|no-inference|FILE.py:NAME",
        help="GOOD, a baseline of the paper, or a method of your own: the Python file, and the "
        "function or class in it that makes it from a model.",
    ),
]
Preset = Annotated[
    Literal["paper"] | None,
    typer.Option(help="paper: Algorithm 1 as it stands; goals alone lead to actions."),
]
Model = Annotated[
    str | None,
    typer.Option(
        metavar="MODEL",
        help="GGUF file; folder or hf:NAME (Transformers); http://HOST/v1#NAME (a server).  "
        "[default: SmolLM2-135M-Instruct]",
    ),
]
Writer = Annotated[
    str | None, typer.Option(metavar="MODEL", help="Model that writes.  [default: --model]")
]
Scorer = Annotated[
    str | None,
    typer.Option(metavar="MODEL", help="Model that scores utterances.  [default: --model]"),
]
Tokenizer = Annotated[
    str | None,
    typer.Option(help="Tokenizer of a server's model: GGUF file, folder or hub name."),
]
Adapter = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|FOLDER|none",
        help="LoRA adapter for the scoring model.  [default: the one that ships with goalscope, "
        "for its own model]",
    ),
]
Catalogue = Annotated[Path | None, typer.Option(help="CSV file of your own shop's items.")]
Columns = Annotated[
    list[str] | None,
    typer.Option(
        "--column", metavar="NAME=TITLE", help="Map a field (name, price, ...) to a column heading."
    ),
]
Scene = Annotated[
    str | None, typer.Option(metavar="NAME|FILE", help="Room of the house; see `house scenes`.")
]
Simulator = Annotated[
    Literal["embedded", "thor"], typer.Option(help="The embedded simulator, or AI2-THOR.")
]
Unity = Annotated[
    Path | None, typer.Option(help="Program for AI2-THOR to start.  [default: its own build]")
]
Picture = Annotated[
    Path | None, typer.Option(metavar="FILE.svg", help="Draw the room to this file each round.")
]
OwnLikelihood = Annotated[
    str | None,
    typer.Option(
        "--likelihood",
        metavar="FILE.py:NAME",
        help="A likelihood of your own: the Python file, and the function or class in it that "
        "makes it from a model.",
    ),
]
Layout = Annotated[
    Literal["goal-first", "goal-last"] | None,
    typer.Option(help="Where the likelihood prompt puts the goal."),
]
CalibrationName = Annotated[
    str | None,
    typer.Option(
        "--calibration",
        metavar="paper|default|FILE",
        help="How evidence becomes probabilities.  [default: the model's own for given goals, the "
        "default one for an agent]",
    ),
]
Propose = Annotated[
    str | None,
    typer.Option(
        metavar="PROBABILITY|paper",
        help="Propose goals once the probability of Unspecified, given the words since the newest "
        "goals, exceeds this; paper: once it is the likeliest.  [default: 0.5]",
    ),
]
Likeliest = Annotated[
    int | None,
    typer.Option(
        "--k", min=1, help="Number of likeliest goals to act on and to ask about.  [default: 3]"
    ),
]
Prompted = Annotated[
    list[str] | None,
    typer.Option(
        metavar="all|propose|remove|plan|query",
        help="Use the paper's prompt for this module even if the model is fitted for it; "
        "repeatable. Other models always propose, plan and ask by prompts.",
    ),
]
Seed = Annotated[int, typer.Option(min=0, help="Random seed.")]
StoreFile = Annotated[
    str | None,
    typer.Option(
        "--store",
        metavar="FILE|postgresql://USER:PASSWORD@HOST/DATABASE",
        help="Store of episodes.  [default: $GOALSCOPE_STORE]",
    ),
]
TraceFile = Annotated[
    Path | None,
    typer.Option(
        "--trace",
        metavar="FILE.jsonl",
        help="Add each model call to this file; see `goalscope trace`.",
    ),
]
Data = Annotated[
    Path | None,
    typer.Option("--data", help="Folder of the datasets.  [default: $GOALSCOPE_DATA]"),
]
Goals = Annotated[int, typer.Option(min=2, help="Number of goals per dialogue.")]
Limit = Annotated[int | None, typer.Option(min=1, help="Use only the first N.")]
Json = Annotated[bool, typer.Option("--json", help="Print only JSON to standard output.")]
ReadingAdapter = Annotated[
    str | None,
    typer.Option(
        "--adapter",
        metavar="ADAPTER",
        help="Adapter that reads messages, or none.  [default: the one that ships with "
        "goalscope, for its own model]",
    ),
]
ReadingForm = Annotated[
    Literal["text", "json"],
    typer.Option("--form", help="Form in which the model writes a reading."),
]


def episode_settings(context: typer.Context, **more: Any) -> Settings:
    """The settings of an episode from a command's options, with full paths.

    Full paths let it be resumed from any folder.

    Args:
        context: Of the command, with the options from `Domain` to `Seed`.
        **more: The settings from its own options: human, profiles, rounds.

    Raises:
        InvalidInputError: An option cannot be used, or would have no effect.
    """
    from goalscope.agent.agent import K
    from goalscope.agent.settings import Settings, load_method, load_own
    from goalscope.agent.toolkit import modules_named
    from goalscope.envs.registry import SHOP, load_domain
    from goalscope.models.opening import MODEL_KEYS

    given = context.params
    likelihood, scene = given["likelihood"], given["scene"]
    settings = Settings(
        **model_names(**{key: given[key] for key in MODEL_KEYS}),
        domain=load_domain(given["domain"] or SHOP),
        method=load_method(given["method"]),
        preset=given["preset"],
        catalogue=_absolute(given["catalogue"]),
        columns=_columns(given["columns"] or ()),
        scene=_absolute(scene) if scene and Path(scene).is_file() else scene,
        simulator=given["simulator"],
        unity=_absolute(given["unity"]),
        likelihood=None if likelihood is None else load_own(likelihood),
        layout=given["layout"],
        calibration=calibration_file(given["calibration"]),
        propose=_trigger(given["propose"]),
        k=given["k"] or K,
        prompted=modules_named(given["prompted"] or ()),
        seed=given["seed"],
        **more,
    )
    _check_effects(given, settings.domain)
    check_picture(given["picture"], settings.domain)
    return settings


def _check_effects(given: dict[str, Any], domain: str) -> None:
    """Refuse options that would have no effect."""
    from goalscope.envs.registry import domain_named

    for name in ("catalogue", "columns", "scene", "unity", "simulator"):
        is_given = given[name] and given[name] != "embedded"  # the default simulator
        if is_given and name not in domain_named(domain).settings:
            option = f"--{name.removesuffix('s')}"
            raise InvalidInputError(f"{option} does not apply to the domain {domain!r}.")
    if given["unity"] and given["simulator"] != "thor":
        raise InvalidInputError("--unity needs --simulator thor.")
    method = given["method"]
    own = ":" in method
    for name in ("likelihood", "layout", "calibration", *(() if own else ("propose",))):
        if method != "good" and given[name]:
            why = "makes its own probabilities" if own else "computes no evidence"
            raise InvalidInputError(
                f"--{name} only applies to the method 'good'; {method!r} {why}. Leave it out."
            )
    if method == "no-goals" and given["k"]:
        raise InvalidInputError(
            "--k does not apply to the method 'no-goals', which has no goals. Leave it out."
        )
    if given["preset"] and given["prompted"]:
        raise InvalidInputError("--preset paper has all modules prompted. Leave out --prompted.")
    check_likelihood(given["likelihood"], given["layout"])


def check_likelihood(own: str | None, layout: str | None) -> None:
    """Refuse the layout of the role-play likelihood beside a likelihood of the user's own.

    Raises:
        InvalidInputError: Both are given.
    """
    if own and layout:
        raise InvalidInputError(
            "--layout only applies to the role-play likelihood. Leave it out, or leave out "
            "--likelihood."
        )


def check_picture(picture: Path | str | None, domain: str) -> None:
    """Refuse a picture that could not be drawn.

    Raises:
        InvalidInputError: The domain has no rooms, or the picture's folder is missing.
    """
    from goalscope.envs.registry import domain_named

    if picture and domain_named(domain).snapshot is None:
        raise InvalidInputError(f"--picture does not apply to the domain {domain!r}.")
    if picture and not Path(picture).absolute().parent.is_dir():
        raise InvalidInputError(f"There is no folder {Path(picture).parent} for the picture.")


def calibration_file(given: str | None) -> str | None:
    """The name of a calibration, or the full path of its file, once it is checked."""
    from goalscope.belief.calibration import NAMED, calibration_named

    if given is None or given in NAMED:
        return given
    calibration_named(given)
    return _absolute(given)


def _absolute(path: Path | str | None) -> str | None:
    return None if path is None else str(Path(path).absolute())


def _trigger(given: str | None) -> Trigger | None:
    if given is None or given == "paper":
        return given
    try:
        return float(given)
    except ValueError:
        raise InvalidInputError(
            f'--propose takes a probability or "paper", not "{given}".'
        ) from None


def _columns(given: Sequence[str]) -> dict[str, str]:
    pairs = [each.partition("=") for each in given]
    for name, mark, title in pairs:
        if not (name and mark and title):
            raise InvalidInputError(f'--column takes NAME=TITLE, not "{name}{mark}{title}".')
    return {name: title for name, _, title in pairs}
