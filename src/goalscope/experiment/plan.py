"""Experiments, read from TOML files, and the specs of the cells to measure."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, cast

from annotated_types import Ge, Le, Lt, MinLen
from pydantic import BeforeValidator

from goalscope.agent.agent import K
from goalscope.agent.people import Habit
from goalscope.agent.settings import Settings, load_method, load_own
from goalscope.agent.toolkit import Preset, modules_named
from goalscope.base.inputs import nearest, read_table, shown, validated
from goalscope.base.types import InvalidInputError
from goalscope.belief.calibration import NAMED, calibration_named
from goalscope.belief.likelihood import DEFAULT_LAYOUT, Layout
from goalscope.datasets import DATASETS, data_folder, load
from goalscope.datasets.case import case_to_json, read_cases
from goalscope.datasets.goal_sets import changes_of
from goalscope.envs.registry import BUILT_IN, domain_named, load_domain, profiles_of
from goalscope.experiment.fitted_baselines import cases_digest, check_unseen, training_cases
from goalscope.experiment.judge import JUDGE_TEMPERATURE
from goalscope.experiment.measure import hashes_of, person_of
from goalscope.experiment.multiple_choice import read_questions
from goalscope.experiment.results import Cell
from goalscope.models.adapters import NO_ADAPTER
from goalscope.models.opening import ModelKey

EMBEDDED = "embedded"
"""The name of the embedded model in a file."""

T = TypeVar("T")


def _listed(value: object) -> tuple[object, ...]:
    return tuple(cast("list[object]", value)) if isinstance(value, list) else (value,)


def _table(value: object) -> object:
    """A model as a table, from its name."""
    return {"model": value} if isinstance(value, str) and value else value


Human = Literal["scripted", "simulated"] | Habit
Listed = Annotated[tuple[T, ...], MinLen(1), BeforeValidator(_listed)]
"""A list in which a single value stands for a list of one."""

Model = Annotated[Mapping[ModelKey, str], BeforeValidator(_table)]
Count = Annotated[int, Ge(1), Lt(10**9)]
Number = Annotated[int, Ge(0), Lt(10**9)]
Probability = Annotated[float, Ge(0), Lt(1)]


@dataclass(frozen=True, slots=True)
class QuestionsPart:
    """Multiple-choice questions (Sec. 4.1); `file` may be in the data folder."""

    file: str
    limit: Count | None = None
    layouts: Listed[Layout] = (DEFAULT_LAYOUT,)


@dataclass(frozen=True, slots=True)
class DialoguesPart:
    """Real dialogues of the dataset `set`, or of a file of your own, `jsonl`.

    `change` is the round (from 1) at which people change their mind (see `changes_of`): goals are
    then random, and the model is not asked outright. `likelihood` is one of your own (see
    `load_own`). Baselines are fitted on the sources of `fit`, see `read_source`, and on none
    without it. `methods` are of your own (see `load_own`). Without `models`, those of the
    experiment are used.
    """

    set: str = ""
    jsonl: str = ""
    split: str | None = None
    goal_sets: Listed[str] = ()
    goals: Annotated[Count, Ge(2)] = 20
    seed: Number = 1
    limit: Count | None = None
    turns: Count | None = None
    layouts: Listed[Layout] = (DEFAULT_LAYOUT,)
    outright: bool = True
    likelihood: str | None = None
    fit: Listed[str] = ()
    methods: Listed[str] = ()
    change: Annotated[Count, Ge(2)] | None = None
    models: Listed[Model] = ()


@dataclass(frozen=True, slots=True)
class EpisodesPart:
    """Episodes with simulated people, in every combination (Sec. 4.2 and 4.3).

    `domain` is a name or a Python file (see `load_domain`), `people` a TOML file of profiles, and
    `likelihood` one of your own (see `load_own`). What is None or empty is as the domain,
    the experiment or `Agent` has it.
    """

    domain: str
    profiles: Listed[str] = ("all",)
    people: str | None = None
    methods: Listed[str] = ("good", "no-goals", "no-inference")
    preset: Preset | None = None
    humans: Listed[Human] = ("scripted",)
    layouts: Listed[Layout] = ()
    calibrations: Listed[str] = ()
    propose: Probability | Literal["paper"] | None = None
    k: Count = K
    likelihood: str | None = None
    prompted: Listed[str] = ()
    seeds: Listed[Number] = (0,)
    rounds: Count = 20
    catalogue: str | None = None
    scene: str | None = None
    models: Listed[Model] = ()


P = TypeVar("P", DialoguesPart, EpisodesPart)


@dataclass(frozen=True, slots=True)
class Judge:
    """The language-model evaluator of episodes (Sec. 5.1).

    The paper's temperature is 0. Without a model, the model of the run is asked.
    """

    trials: Count = 20
    seed: Number = 0
    temperature: Annotated[float, Ge(0), Le(2)] = JUDGE_TEMPERATURE
    model: Model | None = None


@dataclass(frozen=True, slots=True)
class Experiment:
    """What to measure, and with which models (arguments of `open_model`).

    `source` is the section or figure of the paper that it reproduces, if any. `provenance` says who
    the people are, who or what wrote them, and what was fitted or chosen on their like. The tables
    of a report's summary leave out an experiment that stands `aside`.
    """

    name: str
    title: str = ""
    source: str = ""
    models: Listed[Model] = ({},)
    mcq: tuple[QuestionsPart, ...] = ()
    dialogues: tuple[DialoguesPart, ...] = ()
    episodes: tuple[EpisodesPart, ...] = ()
    judge: Judge | None = None
    provenance: str = ""
    aside: bool = False

    def with_models(self, models: tuple[Model, ...]) -> Experiment:
        """The experiment with other models, once for each combination of the other settings."""
        return replace(
            self,
            models=models,
            dialogues=tuple(dict.fromkeys(replace(part, models=()) for part in self.dialogues)),
            episodes=tuple(dict.fromkeys(replace(part, models=()) for part in self.episodes)),
        )


def read_experiment(file: Path) -> Experiment:
    """Read an experiment from a TOML file.

    Raises:
        InvalidInputError: The file cannot be read, or has an unknown key or value; the message
            names the place and the nearest known one.
    """
    table, label, folder = read_table(file), file.name, file.parent
    for key in ("mcq", "dialogues", "episodes"):
        if isinstance(table.get(key), dict):
            table[key] = [table[key]]
    if "name" in table:
        raise InvalidInputError(f"{label}: leave out 'name': the file's name is the experiment's.")
    found = validated({"title": file.stem, **table, "name": file.stem}, Experiment, label)
    if not (found.mcq or found.dialogues or found.episodes):
        raise InvalidInputError(
            f"{label}: there is nothing to measure. Add a table [mcq], [dialogues] or [episodes]."
        )
    if found.judge and not found.episodes:
        raise InvalidInputError(f"{label}: a [judge] scores episodes. Add [episodes].")
    judge = found.judge
    if judge and judge.model is not None:
        judge = replace(judge, model=_placed_model(judge.model, folder))
    return replace(
        found,
        models=tuple(_placed_model(model, folder) for model in found.models),
        dialogues=tuple(_placed(part, folder) for part in found.dialogues),
        episodes=tuple(_placed_episodes(part, folder) for part in found.episodes),
        judge=judge,
    )


def _placed(part: P, folder: Path) -> P:
    """A part with full paths, so that its files are found from any folder."""
    found: dict[str, Any] = {}
    for key, place in _PLACES.items():
        value = getattr(part, key, None)
        if isinstance(value, tuple):
            found[key] = tuple(place(each, folder) for each in cast("tuple[Any, ...]", value))
        elif value:
            found[key] = place(value, folder)
    return replace(part, **found)


def _own_place(name: str, folder: Path) -> str:
    """FILE.py:NAME with the full path of the file; other names unchanged."""
    file, colon, function = name.rpartition(":")
    return f"{_place(file, folder)}:{function}" if colon else name


def _placed_source(name: str, folder: Path) -> str:
    """A source of dialogues with the full path of its file, if it is one."""
    file, *places = re.split(r"(?=\[)", name, maxsplit=1)
    return "".join([_place(file, folder), *places]) if file.endswith(".jsonl") else name


def _placed_episodes(part: EpisodesPart, folder: Path) -> EpisodesPart:
    domain = part.domain
    if domain not in BUILT_IN:
        domain = _place(domain, folder)
        if not domain.endswith(".py"):
            raise InvalidInputError(
                f"'domain': {shown(part.domain)} is unknown; "
                f"{nearest(part.domain, BUILT_IN)} Or name a Python file."
            )
    found = replace(_placed(part, folder), domain=domain)
    for name in found.calibrations:
        calibration_named(name)  # refuses an unknown one now
    return found


def _placed_model(model: Model, folder: Path) -> Model:
    return {
        key: name if key == "adapter" and name == NO_ADAPTER else _place(name, folder)
        for key, name in model.items()
        if name != EMBEDDED
    }


def _place(name: str, folder: Path) -> str:
    """The full path of a file or folder next to the TOML file, or here; other names unchanged."""
    name = os.path.expanduser(name)
    return next(
        (str(each.absolute()) for each in (folder / name, Path(name)) if os.path.exists(each)), name
    )


_PLACES: Mapping[str, Callable[[Any, Path], Any]] = {
    **dict.fromkeys(("people", "catalogue", "scene"), _place),
    **dict.fromkeys(("likelihood", "methods"), _own_place),
    "calibrations": lambda name, folder: name if name in NAMED else _place(name, folder),
    "fit": _placed_source,
    "models": _placed_model,
}
"""What makes the full path of what a part names under a key."""


def specs_of(experiment: Experiment, folder: Path | None) -> list[dict[str, Any]]:
    """The specs of all cells that can be planned before any is measured.

    Args:
        experiment: What is to be measured.
        folder: Folder of the datasets; None if nothing is read from it.

    Raises:
        InvalidInputError: A file is missing or broken, or a name is unknown.
    """
    specs: list[dict[str, Any]] = []
    for part in experiment.mcq:
        questions = read_questions(_file(part.file, folder), part.limit)
        for model, question, layout in itertools.product(
            experiment.models, questions, part.layouts
        ):
            row = asdict(question)
            specs.append({"kind": "mcq", "row": row, "model": model, "layout": layout})
    for part in experiment.dialogues:
        for model in part.models or experiment.models:
            specs += _dialogue_specs(part, model, folder)
    for part in experiment.episodes:
        for model in part.models or experiment.models:
            specs += _episode_specs(part, model)
    return specs


def judging(experiment: Experiment, cells: Sequence[Cell]) -> list[dict[str, Any]]:
    """The specs of the evaluator's cells, one per finished episode.

    It sees (Sec. 5.1) the basket, or the record of the robot's actions; in a domain of one's own,
    both the final state and the record.
    """
    judge = experiment.judge
    if judge is None:
        return []
    done = [cell for cell in cells if cell.spec["kind"] == "episode" and cell.result]
    specs: list[dict[str, Any]] = []
    for cell in done:
        spec, result = cell.spec, cell.result or {}
        judged = domain_named(spec["settings"]["domain"]).judged
        run = {key: spec[key] for key in ("model", "profile", "settings")}
        specs.append({
            "kind": "judge",
            "of": {"key": cell.key, "kind": "episode", **run},
            "model": judge.model if judge.model is not None else spec["model"],
            "trials": judge.trials,
            "seed": judge.seed,
            **({"temperature": heat} if (heat := judge.temperature) != JUDGE_TEMPERATURE else {}),
            **{key: result[key] for key in ("task", "description", "empty")},
            "outcome": "",
            "actions": [],
            **{key: result[key] for key in judged},
        })  # fmt: skip
    return specs


def _dialogue_specs(
    part: DialoguesPart, model: Model, folder: Path | None
) -> Iterator[dict[str, Any]]:
    if bool(part.set) == bool(part.jsonl):
        raise InvalidInputError("Dialogues need either 'set', the name of a dataset, or 'jsonl'.")
    known = [name for name, dataset in DATASETS.items() if dataset.goal_sets]
    if part.set and part.set not in known:
        raise InvalidInputError(f"Unknown dataset {shown(part.set)}; {nearest(part.set, known)}")
    if part.jsonl and (part.split or part.goal_sets):
        raise InvalidInputError(
            f"{part.jsonl} has its own goals. Leave out 'split' and 'goal_sets', which only "
            "apply to datasets."
        )
    if part.change and (part.jsonl or part.turns or part.goal_sets not in ((), ("random",))):
        raise InvalidInputError(
            "A change of mind is scripted from the dialogues of a dataset, with random goals "
            "and turns up to the third after it. Leave out 'jsonl', 'turns' and 'goal_sets'."
        )
    own = _own_likelihood(part)
    if part.methods:
        named = [load_own(name, "method") for name in part.methods]
        own["methods"] = {name: hashes_of(Settings(method=name)).get("method") for name in named}
    sources = tuple(_placed_source(name, Path()) for name in part.fit)
    data = str(folder.absolute()) if folder else None
    training = training_cases(sources, data)
    if sources:
        own["fit"] = {"sources": [*sources], "folder": data, "sha256": cases_digest(training)}
    every = ("random",) if part.change else DATASETS[part.set].goal_sets if part.set else ("own",)
    goal_sets = part.goal_sets or every
    for goal_set in goal_sets:
        is_drawn = part.set and goal_set != "complete"
        drawn: dict[str, Any] = {"goals": part.goals, "seed": part.seed} if is_drawn else {}
        if part.jsonl:
            split = "own"
            cases = read_cases(_file(part.jsonl, folder))[: part.limit]
        else:
            split = part.split or DATASETS[part.set].split
            cases = load(
                part.set,
                data_folder(folder),
                split=split,
                goal_set=goal_set,
                goals=part.goals,
                seed=part.seed,
                limit=None if part.change else part.limit,
            )
        if part.change:
            scripts = changes_of(cases, round=part.change, goals=part.goals, seed=part.seed)
            cases, drawn["change"] = scripts[: part.limit], part.change
        check_unseen(cases, training)
        for case in cases:
            for layout in part.layouts:
                yield {
                    "kind": "dialogue",
                    "set": part.set or Path(part.jsonl).stem,
                    "split": split,
                    "goal_set": goal_set,
                    "case": case_to_json(case.until(part.turns)),
                    "model": model,
                    **drawn,
                    "turns": part.turns,
                    "layout": layout,
                    "outright": part.outright and not part.change,
                    **own,
                }


def _own_likelihood(part: DialoguesPart | EpisodesPart) -> dict[str, Any]:
    """The likelihood of a part, if it is not the role-play one, with a hash of its file.

    Raises:
        InvalidInputError: It cannot be loaded, or an option of the role-play one is given, too.
    """
    if part.likelihood is None:
        return {}
    if part.layouts not in ((), (DEFAULT_LAYOUT,)):
        raise InvalidInputError(
            "'layouts' only applies to the role-play likelihood. Leave it out, or leave out "
            "'likelihood'."
        )
    name = load_own(part.likelihood)
    return {"likelihood": name, "files": hashes_of(Settings(likelihood=name))}


def _episode_specs(part: EpisodesPart, model: Model) -> Iterator[dict[str, Any]]:
    domain = load_domain(part.domain)
    for name in ("catalogue", "scene"):
        if getattr(part, name) and name not in domain_named(domain).settings:
            raise InvalidInputError(f"{name!r} does not apply to the domain {shown(part.domain)}.")
    likelihood = _own_likelihood(part).get("likelihood")
    given = {
        "preset": part.preset,
        "propose": part.propose,
        "k": None if part.k == K else part.k,
        "prompted": [*modules_named(part.prompted)] or None,
    }
    fixed: dict[str, Any] = {
        "domain": domain,
        "profiles": part.people,
        "catalogue": part.catalogue,
        "scene": part.scene,
        "rounds": part.rounds,
        **{key: value for key, value in given.items() if value is not None},
    }
    settings = Settings(
        domain=domain, profiles=part.people, catalogue=part.catalogue, scene=part.scene
    )
    known = {profile.name: profile for profile in profiles_of(settings)}
    if not known:
        raise InvalidInputError(f"{shown(part.domain)} has nobody to simulate: no profiles.")
    names = tuple(known) if part.profiles == ("all",) else part.profiles
    for name in names:
        if name not in known:
            hint = " A file of people is named by 'people'." if name.endswith(".toml") else ""
            raise InvalidInputError(f"Unknown profile {shown(name)}; {nearest(name, known)}{hint}")
    for human, seed, calibration, layout, name, method in itertools.product(
        part.humans,
        part.seeds,
        part.calibrations or (None,),
        part.layouts or (None if part.preset else DEFAULT_LAYOUT,),
        names,
        [*map(load_method, part.methods)],
    ):
        axes = {"human": human, "method": method, "calibration": calibration, "layout": layout}
        own = {"likelihood": likelihood} if likelihood and method == "good" else {}
        yield {
            "kind": "episode",
            "settings": {**fixed, **axes, **own, "seed": seed},
            "profile": name,
            "person": person_of(known[name]),
            "files": hashes_of(replace(settings, calibration=calibration, method=method, **own)),
            "model": model,
        }


def _file(name: str, folder: Path | None) -> Path:
    """A file by its path, or in the data folder."""
    name = os.path.expanduser(name)
    places = [Path(name), *([folder / name] if folder else [])]
    for file in places:
        if file.is_file():
            return file
    hint = "" if folder else " If it is in the data folder, name that folder with --data."
    raise InvalidInputError(f"There is no file {' or '.join(map(shown, map(str, places)))}.{hint}")
