"""Options that commands share, alone or grouped in classes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from inspect import Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

import typer

from goalscope.base.types import InvalidInputError
from goalscope.cli.terminal import model_names

if TYPE_CHECKING:
    from goalscope.agent.settings import Settings
    from goalscope.belief.goal_manager import Trigger

__all__ = [
    "Adapter",
    "CalibrationName",
    "Calls",
    "EndOfTurn",
    "EpisodeOptions",
    "Json",
    "Layout",
    "Method",
    "Model",
    "ModelOptions",
    "OwnLikelihood",
    "ReadingAdapter",
    "ReadingForm",
    "Scorer",
    "Seed",
    "StoreFile",
    "Tokenizer",
    "Writer",
    "calibration_file",
    "check_likelihood",
    "check_picture",
    "expand_options",
]

Method = Annotated[
    Literal["good", "no-goals", "no-inference"],
    typer.Option(help="GOOD, or a baseline of the paper."),
]
Layout = Annotated[
    Literal["goal-first", "goal-last"] | None,
    typer.Option(help="Where the likelihood prompt puts the goal."),
]
EndOfTurn = Annotated[bool, typer.Option(help="Also score the end of the utterance.")]
CalibrationName = Annotated[
    str | None,
    typer.Option(
        "--calibration",
        metavar="paper|default|last-turn|FILE",
        help="How evidence becomes probabilities.  [default: the model's own for given goals, the "
        "default one for an agent]",
    ),
]
Seed = Annotated[int, typer.Option(min=0, help="Random seed.")]
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
Calls = Annotated[Path | None, typer.Option(help="Cache file for the model's answers.")]
StoreFile = Annotated[
    str | None,
    typer.Option(
        "--store",
        metavar="FILE|postgresql://USER:PASSWORD@HOST/DATABASE",
        help="Store of episodes.  [default: $GOALSCOPE_STORE]",
    ),
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
Json = Annotated[bool, typer.Option("--json", help="Print only JSON to standard output.")]
ReadingAdapter = Annotated[
    str | None,
    typer.Option(
        "--adapter",
        metavar="ADAPTER",
        help="Adapter fitted by `fit-writer`, or none.  [default: the one that ships with "
        "goalscope, for its own model]",
    ),
]
ReadingForm = Annotated[
    Literal["text", "json"],
    typer.Option("--form", help="Form in which the model writes a reading."),
]


@dataclass(frozen=True)
class ModelOptions:
    """The models that write and score."""

    model: Model = None
    generator: Writer = None
    scorer: Scorer = None
    tokenizer: Tokenizer = None
    adapter: Adapter = None

    def names(self) -> dict[str, Any]:
        """The arguments of `open_model`; files are named by their full path."""
        return model_names(self.model, self.generator, self.scorer, self.tokenizer, self.adapter)


@dataclass(frozen=True)
class EpisodeOptions(ModelOptions):
    """The options that define an episode."""

    domain: Annotated[
        str,
        typer.Argument(
            metavar="[grocery|house|FILE.py]",
            help="Domain to act in, or the Python file of your own.",
        ),
    ] = "grocery"
    method: Method = "good"
    catalogue: Annotated[Path | None, typer.Option(help="CSV file of your own shop's items.")] = (
        None
    )
    columns: Annotated[
        list[str] | None,
        typer.Option(
            "--column",
            metavar="NAME=TITLE",
            help="Map a field (name, price, ...) to a column heading.",
        ),
    ] = None
    scene: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="Room of the house; see `house scenes`."),
    ] = None
    simulator: Annotated[
        Literal["house", "thor"], typer.Option(help="The embedded simulator, or AI2-THOR.")
    ] = "house"
    unity: Annotated[
        Path | None, typer.Option(help="Program for AI2-THOR to start.  [default: its own build]")
    ] = None
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE.svg", help="Draw the room to this file each round."),
    ] = None
    likelihood: OwnLikelihood = None
    layout: Layout = None
    end_of_turn: EndOfTurn = False
    calibration: CalibrationName = None
    propose: Annotated[
        str | None,
        typer.Option(
            metavar="PROBABILITY|paper",
            help="Propose goals once the probability of Unspecified, given the words since the "
            "newest goals, exceeds this; paper: once it is the likeliest.  [default: 0.5]",
        ),
    ] = None
    k: Annotated[
        int | None,
        typer.Option(
            "--k", min=1, help="Number of likeliest goals to act on and to ask about.  [default: 3]"
        ),
    ] = None
    prompted: Annotated[
        list[str] | None,
        typer.Option(
            metavar="all|propose|remove|plan|query",
            help="Use the paper's prompt for this module even if the model is fitted for it; "
            "repeatable. Other models always propose, plan and ask by prompts.",
        ),
    ] = None
    seed: Seed = 0

    def settings(self, **more: Any) -> Settings:
        """The settings of an episode, with full paths so that it can be resumed from any folder.

        Args:
            **more: Settings from the command's own options: human, profiles, rounds.

        Raises:
            InvalidInputError: An option cannot be used, or would have no effect.
        """
        from goalscope.agent.agent import K
        from goalscope.agent.settings import Settings, load_domain, load_likelihood
        from goalscope.agent.toolkit import modules_named

        settings = Settings(
            **self.names(),
            domain=load_domain(self.domain),
            method=self.method,
            catalogue=_absolute(self.catalogue),
            columns=_columns(self.columns or ()),
            scene=_scene(self.scene),
            simulator=self.simulator,
            unity=_absolute(self.unity),
            likelihood=None if self.likelihood is None else load_likelihood(self.likelihood),
            layout=self.layout,
            end_of_turn=self.end_of_turn,
            calibration=calibration_file(self.calibration),
            propose=_trigger(self.propose),
            k=self.k or K,
            prompted=modules_named(self.prompted or ()),
            seed=self.seed,
            **more,
        )
        self._check_effects(settings.domain)
        check_picture(self.picture, settings.domain)
        return settings

    def _check_effects(self, domain: str) -> None:
        """Refuse options that would have no effect."""
        foreign: dict[str, object] = {}
        if domain != "grocery":
            foreign |= {"--catalogue": self.catalogue, "--column": self.columns}
        if domain != "house":
            foreign |= {"--scene": self.scene, "--unity": self.unity}
            foreign["--simulator"] = self.simulator != "house"
        for option, given in foreign.items():
            if given:
                raise InvalidInputError(f"{option} does not apply to the domain {domain!r}.")
        if self.unity and self.simulator != "thor":
            raise InvalidInputError("--unity needs --simulator thor.")
        if self.method != "good":
            for name in ("likelihood", "layout", "end_of_turn", "calibration", "propose"):
                if getattr(self, name):
                    raise InvalidInputError(
                        f"--{name.replace('_', '-')} only applies to the method 'good'; "
                        f"{self.method!r} computes no evidence. Leave it out."
                    )
        if self.method == "no-goals" and self.k:
            raise InvalidInputError(
                "--k does not apply to the method 'no-goals', which has no goals. Leave it out."
            )
        check_likelihood(self.likelihood, self.layout, self.end_of_turn)


def expand_options(command: Callable[..., None]) -> Callable[..., None]:
    """Expand a parameter that is a class of options into one parameter per field.

    Typer sees the fields; the command receives the class.
    """
    classes: dict[str, type[Any]] = {}
    expanded = list[Any]()
    hints = get_type_hints(command, include_extras=True)
    for parameter in signature(command).parameters.values():
        hint = hints[parameter.name]
        if not (isinstance(hint, type) and is_dataclass(hint)):
            expanded.append(parameter.replace(annotation=hint))
            continue
        classes[parameter.name] = hint
        types = get_type_hints(hint, include_extras=True)
        expanded += [
            parameter.replace(name=each.name, annotation=types[each.name], default=each.default)
            for each in fields(hint)
        ]

    @wraps(command)
    def call(**given: Any) -> None:
        for name, options in classes.items():
            names = [each.name for each in fields(options) if each.name in given]
            given[name] = options(**{each: given.pop(each) for each in names})
        command(**given)

    call.__signature__ = Signature(expanded)  # pyright: ignore[reportAttributeAccessIssue]
    return call


def check_likelihood(own: str | None, layout: object, end_of_turn: bool) -> None:
    """Refuse options of the role-play likelihood beside one of the user's own.

    Raises:
        InvalidInputError: One is given.
    """
    for option, given in (("--layout", layout), ("--end-of-turn", end_of_turn)):
        if own and given:
            raise InvalidInputError(
                f"{option} only applies to the role-play likelihood. Leave it out, or leave out "
                "--likelihood."
            )


def check_picture(picture: Path | None, domain: str) -> None:
    """Refuse a picture that could not be drawn.

    Raises:
        InvalidInputError: The domain has no rooms, or the picture's folder is missing.
    """
    if picture and domain != "house":
        raise InvalidInputError(f"--picture does not apply to the domain {domain!r}.")
    if picture and not picture.absolute().parent.is_dir():
        raise InvalidInputError(f"There is no folder {picture.parent} for the picture.")


def calibration_file(given: str | None) -> str | None:
    """The name of a calibration, or the full path of its file, once it is checked."""
    from goalscope.belief.calibrations import NAMED, calibration_named

    if given is None or given in NAMED:
        return given
    calibration_named(given)
    return str(Path(given).absolute())


def _absolute(path: Path | None) -> str | None:
    return None if path is None else str(path.absolute())


def _scene(given: str | None) -> str | None:
    """The name of a scene, or the full path of its file."""
    return str(Path(given).absolute()) if given and Path(given).is_file() else given


def _trigger(given: str | None) -> Trigger:
    from goalscope.belief.goal_manager import UNEXPLAINED

    if given is None or given == "paper":
        return given or UNEXPLAINED
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
