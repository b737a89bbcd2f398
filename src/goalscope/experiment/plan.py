"""What an experiment is to measure: a TOML file, or a command's options, as cells' specs."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal, cast, get_args

from goalscope.agent import Method
from goalscope.benchmarks.dialogues import case_to_json
from goalscope.benchmarks.mcq import read_questions
from goalscope.datasets import DATASETS, load, read_cases
from goalscope.domains import Domain, Settings, profiles_of
from goalscope.envs.tables import nearest, read_table, refuse_unknown, shown
from goalscope.experiment.identity import MODEL_KEYS
from goalscope.experiment.results import Cell
from goalscope.habits import Habit
from goalscope.likelihood import DEFAULT_LAYOUT, Layout
from goalscope.types import DEFAULT_TEMPERATURE, InvalidInputError

__all__ = [
    "Dialogues",
    "Episodes",
    "Experiment",
    "Judge",
    "Questions",
    "judging",
    "models_of",
    "read_experiment",
    "specs_of",
]

Model = Mapping[str, str]
EMBEDDED = "embedded"
Human = Literal["scripted", "simulated"] | Habit
HUMANS = (*get_args(get_args(Human)[0]), *get_args(Habit))


@dataclass(frozen=True, slots=True)
class Questions:
    """Multiple-choice questions (Sec. 4.1).

    Attributes:
        file: From the data folder, or a path of its own.
        limit: Only so many, the first ones.
        layouts: Where the likelihood prompt states the goal.
    """

    file: str
    limit: int | None = None
    layouts: tuple[Layout, ...] = (DEFAULT_LAYOUT,)


@dataclass(frozen=True, slots=True)
class Dialogues:
    """Real dialogues.

    Attributes:
        set: Name of a dataset; or
        jsonl: a file of one's own, from the data folder or a path.
        split: Of the dataset.
        goal_sets: How wrong goals are drawn.
        goals: How many goals there are for each dialogue.
        seed: Of the draw of goals.
        limit: Only so many dialogues, the first ones.
        turns: Only so many turns of each, the first ones.
        layouts: Where the likelihood prompt states the goal.
        end_of_turn: Whether the end of the utterance is scored.
        outright: Whether the model is asked for the goal outright, too.
    """

    set: str = ""
    jsonl: str = ""
    split: str | None = None
    goal_sets: tuple[str, ...] = ()
    goals: int = 20
    seed: int = 1
    limit: int | None = None
    turns: int | None = None
    layouts: tuple[Layout, ...] = (DEFAULT_LAYOUT,)
    end_of_turn: bool = False
    outright: bool = True


@dataclass(frozen=True, slots=True)
class Episodes:
    """Episodes with simulated people, in every combination (Sec. 4.2 and 4.3).

    Attributes:
        domain: "grocery" or "house".
        profiles: Names, or "all".
        people: TOML file of profiles; None for those of the domain.
        methods: See `Agent`.
        humans: How the profile's person is played.
        evidence: "sum", "last".
        layouts: Where the likelihood prompt states the goal.
        end_of_turn: Whether the end of the utterance is scored.
        temperature: Divides the evidence.
        seeds: One run for each.
        rounds: Most rounds.
        catalogue: CSV file of the shop; None for the domain's own.
        scene: Of the house; None for the profile's.
    """

    domain: Domain
    profiles: tuple[str, ...] = ("all",)
    people: str | None = None
    methods: tuple[Method, ...] = get_args(Method)
    humans: tuple[Human, ...] = ("scripted",)
    evidence: tuple[Literal["sum", "last"], ...] = ("sum",)
    layouts: tuple[Layout, ...] = (DEFAULT_LAYOUT,)
    end_of_turn: bool = False
    temperature: float = DEFAULT_TEMPERATURE
    seeds: tuple[int, ...] = (0,)
    rounds: int = 20
    catalogue: str | None = None
    scene: str | None = None


@dataclass(frozen=True, slots=True)
class Judge:
    """The language-model evaluator of episodes (Sec. 5.1).

    Attributes:
        trials: For each run; 0 for no evaluator.
        comparisons: How often two methods' outcomes are scored side by side, in both orders, as a
            control of the evaluator.
        seed: Of the trials.
        model: The evaluator; None for the model of the run.
    """

    trials: int = 20
    comparisons: int = 0
    seed: int = 0
    model: Model | None = None


@dataclass(frozen=True, slots=True)
class Experiment:
    """What is to be measured, and with which models.

    Attributes:
        name: Of the file of results.
        title: For people.
        source: What of the paper it reproduces, if anything.
        models: Arguments of `open_model`, each a model.
        questions: Parts of one kind, as for the next two.
        dialogues: Parts.
        episodes: Parts.
        judge: Scores the episodes.
    """

    name: str
    title: str = ""
    source: str = ""
    models: tuple[Model, ...] = ({},)
    questions: tuple[Questions, ...] = ()
    dialogues: tuple[Dialogues, ...] = ()
    episodes: tuple[Episodes, ...] = ()
    judge: Judge = field(default_factory=lambda: Judge(trials=0))


def read_experiment(file: Path) -> Experiment:
    """Read an experiment from a TOML file.

    Raises:
        InvalidInputError: The file cannot be read, or holds what is unknown; names the place, and
            the nearest key or value that is known.
    """
    table = read_table(file, f"The experiment {file} is")
    label = file.name
    known = ("title", "source", "models", "mcq", "dialogues", "episodes", "judge")
    refuse_unknown(table, known, label)
    models = table.get("models", EMBEDDED)
    models = cast("list[object]", models if isinstance(models, list) else [models])
    if not models:
        raise InvalidInputError(f"{label}: 'models' must hold at least one model.")
    parts: dict[str, tuple[Any, ...]] = {}
    for key, kind in (("mcq", Questions), ("dialogues", Dialogues), ("episodes", Episodes)):
        given: object = table.get(key, [])
        if not isinstance(given, dict | list):
            raise InvalidInputError(f"{label}: '{key}' must be a table: [{key}] or [[{key}]].")
        found = cast("list[object]", given if isinstance(given, list) else [given])
        parts[key] = tuple(_part(kind, row, f"{label}, [{key}]") for row in found)
    if not any(parts.values()):
        raise InvalidInputError(
            f"{label}: nothing to measure. Add a table [mcq], [dialogues] or [episodes]."
        )
    judge = Judge(trials=0)
    if "judge" in table:
        row = dict(_table(table["judge"], f"{label}, [judge]"))
        refuse_unknown(row, [each.name for each in fields(Judge)], f"{label}, [judge]")
        chosen = row.pop("model", None)
        judge = _part(Judge, row, f"{label}, [judge]")
        if chosen is not None:
            judge = replace(judge, model=_model(chosen, f"{label}, [judge]"))
    return Experiment(
        file.stem,
        _text(table.get("title", file.stem), f"{label}: 'title'"),
        _text(table.get("source", ""), f"{label}: 'source'"),
        tuple(_model(each, f"{label}, models") for each in models),
        parts["mcq"],
        parts["dialogues"],
        parts["episodes"],
        judge,
    )


def specs_of(experiment: Experiment, folder: Path | None) -> list[dict[str, Any]]:
    """Specs of all cells that can be planned before any is measured.

    Args:
        experiment: What is to be measured.
        folder: Of the datasets; None where nothing is read from it.

    Raises:
        InvalidInputError: A file is missing or broken, or a name is unknown.
    """
    specs: list[dict[str, Any]] = []
    for model in experiment.models:
        for part in experiment.questions:
            specs += _question_specs(part, model, folder)
        for part in experiment.dialogues:
            specs += _dialogue_specs(part, model, folder)
        for part in experiment.episodes:
            specs += _episode_specs(part, model)
    return specs


def judging(experiment: Experiment, cells: Sequence[Cell]) -> list[dict[str, Any]]:
    """Specs of the evaluator's cells, for the episodes that are done."""
    judge = experiment.judge
    done = [cell for cell in cells if cell.spec["kind"] == "episode" and cell.result]
    specs: list[dict[str, Any]] = []
    for cell in done if judge.trials else ():
        result = cell.result or {}
        specs.append({
            "kind": "judge",
            "of": _run_of(cell),
            "model": judge.model if judge.model is not None else cell.spec["model"],
            "trials": judge.trials,
            "seed": judge.seed,
            **{key: result[key] for key in ("task", "description", "empty")},
            **_achieved(cell),
        })  # fmt: skip
    shown = [cell for cell in done if not (cell.result or {})["empty"]]
    for one, other in itertools.combinations(shown, 2) if judge.comparisons else ():
        if _without(one, "method") != _without(other, "method"):
            continue
        result = one.result or {}
        specs.append({
            "kind": "compare",
            "of": [_run_of(one), _run_of(other)],
            "model": judge.model if judge.model is not None else one.spec["model"],
            "comparisons": judge.comparisons,
            "seed": judge.seed,
            "task": result["task"],
            "description": result["description"],
            "outcomes": ["\n".join([each["outcome"], *each["actions"]]).strip()
                         for each in (_achieved(one), _achieved(other))],
        })  # fmt: skip
    return specs


def _question_specs(part: Questions, model: Model, folder: Path | None) -> Iterator[dict[str, Any]]:
    for question in read_questions(_file(part.file, folder), part.limit):
        for layout in part.layouts:
            yield {"kind": "mcq", "row": question.to_json(), "model": model, "layout": layout}


def _dialogue_specs(part: Dialogues, model: Model, folder: Path | None) -> Iterator[dict[str, Any]]:
    if bool(part.set) == bool(part.jsonl):
        raise InvalidInputError("Dialogues need either 'set', the name of a dataset, or 'jsonl'.")
    known = [name for name, dataset in DATASETS.items() if dataset.goal_sets]
    if part.set and part.set not in known:
        raise InvalidInputError(f"There are no dialogues {shown(part.set)}; "
                                f"{nearest(part.set, known)}")  # fmt: skip
    if part.jsonl and (part.split or part.goal_sets):
        raise InvalidInputError(
            f"{part.jsonl} names the goals of its dialogues itself. Leave out the split and the "
            "goal sets, which are those of a dataset."
        )
    goal_sets = part.goal_sets or (DATASETS[part.set].goal_sets if part.set else ("own",))
    for goal_set in goal_sets:
        if part.jsonl:
            split = "own"
            cases = read_cases(_file(part.jsonl, folder))[: part.limit]
        else:
            if folder is None:
                raise InvalidInputError("Name the folder of the datasets with --data.")
            split = part.split or DATASETS[part.set].split
            cases = load(
                part.set,
                folder,
                split=split,
                goal_set=goal_set,
                goals=part.goals,
                seed=part.seed,
                limit=part.limit,
            ).cases
        for case in cases:
            for layout in part.layouts:
                yield {
                    "kind": "dialogue",
                    "set": part.set or Path(part.jsonl).stem,
                    "split": split,
                    "goal_set": goal_set,
                    "case": case_to_json(replace(case, turns=case.turns[: part.turns])),
                    "model": model,
                    "goals": part.goals,
                    "seed": part.seed,
                    "turns": part.turns,
                    "layout": layout,
                    "end_of_turn": part.end_of_turn,
                    "outright": part.outright,
                }


def _episode_specs(part: Episodes, model: Model) -> Iterator[dict[str, Any]]:
    fixed: dict[str, Any] = {
        "domain": part.domain,
        "profiles": part.people and str(Path(part.people).absolute()),
        "catalogue": part.catalogue and str(Path(part.catalogue).absolute()),
        "scene": part.scene,
        "end_of_turn": part.end_of_turn,
        "temperature": part.temperature,
        "rounds": part.rounds,
    }
    known = {profile.name: profile for profile in profiles_of(Settings(
        domain=part.domain, profiles=fixed["profiles"]))}  # fmt: skip
    names = tuple(known) if part.profiles == ("all",) else part.profiles
    for name in names:
        if name not in known:
            raise InvalidInputError(f"There is no profile {shown(name)}; {nearest(name, known)}")
    for human, seed, evidence, layout, name, method in itertools.product(
        part.humans, part.seeds, part.evidence, part.layouts, names, part.methods
    ):
        axes = {"human": human, "method": method, "evidence": evidence, "layout": layout}
        yield {
            "kind": "episode",
            "settings": {**fixed, **axes, "seed": seed},
            "profile": name,
            "person": {"description": known[name].description, "replies": known[name].replies},
            "model": model,
        }


def _run_of(cell: Cell) -> dict[str, Any]:
    settings = cell.spec["settings"]
    axes = ("domain", "method", "human", "evidence", "layout", "seed")
    run = {key: settings[key] for key in axes}
    return {**run, "profile": cell.spec["profile"], "model": cell.spec["model"], "key": cell.key}


def _without(cell: Cell, axis: str) -> dict[str, Any]:
    return {key: value for key, value in _run_of(cell).items() if key not in (axis, "key")}


def _achieved(cell: Cell) -> dict[str, Any]:
    """What an evaluator is shown (Sec. 5.1): the basket, or the record of the robot's actions."""
    result = cell.result or {}
    if cell.spec["settings"]["domain"] == "grocery":
        return {"outcome": result["outcome"], "actions": []}
    return {"outcome": "", "actions": result["actions"]}


def _file(name: str, folder: Path | None) -> Path:
    """A file that is named by itself, or from the data folder."""
    places = [Path(name), *([folder / name] if folder else [])]
    for file in places:
        if file.is_file():
            return file
    hint = "" if folder else " Name the data folder with --data if it is one of its files."
    raise InvalidInputError(f"There is no file {' or '.join(map(shown, map(str, places)))}.{hint}")


def _model(value: object, label: str) -> Model:
    row = {"model": value} if isinstance(value, str) and value else value
    if not isinstance(row, dict):
        raise InvalidInputError(
            f"{label}: a model must be a name or a table, such as {EMBEDDED!r}, not {shown(value)}."
        )
    row = cast("dict[str, Any]", row)
    refuse_unknown(row, MODEL_KEYS, label)
    named = {key: _text(each, f"{label}: {key!r}") for key, each in row.items()}
    return {key: name for key, name in named.items() if name != EMBEDDED}


_CHOICES: Mapping[str, Sequence[str]] = {
    "domain": get_args(Domain),
    "methods": get_args(Method),
    "humans": HUMANS,
    "evidence": ("sum", "last"),
    "layouts": get_args(Layout),
}
_LEAST = {"limit": 1, "turns": 1, "goals": 2, "rounds": 1, "trials": 1, "comparisons": 0}


def _part(kind: type[Any], value: object, label: str) -> Any:
    """A part of the experiment from its table, each value checked by the type of its field."""
    row = _table(value, label)
    known = {each.name: str(each.type) for each in fields(kind) if each.name != "model"}
    refuse_unknown(row, tuple(known), label)
    read = {key: _value(key, each, known[key], f"{label}: {key!r}") for key, each in row.items()}
    try:
        return kind(**read)
    except TypeError:
        needed = next(name for name in known if name not in read)
        raise InvalidInputError(f"{label}: the key {needed!r} is missing.") from None


def _value(key: str, value: object, kind: str, label: str) -> Any:
    if kind.startswith("tuple"):
        entries = cast("list[object]", value) if isinstance(value, list) else [value]
        if not entries:
            raise InvalidInputError(f"{label} must not be empty.")
        one = "int" if "int" in kind else "str"
        return tuple(_value(key, entry, one, label) for entry in entries)
    if kind == "bool":
        if not isinstance(value, bool):
            raise InvalidInputError(f"{label} must be true or false, not {shown(value)}.")
        return value
    if kind.startswith(("int", "float")):
        whole = kind.startswith("int")
        if isinstance(value, bool) or not isinstance(value, int if whole else int | float):
            what = "a whole number" if whole else "a number"
            raise InvalidInputError(f"{label} must be {what}, not {shown(value)}.")
        least = _LEAST.get(key, 0)
        if not least <= value < 1e9 or (not whole and value == 0):
            bounds = f"at least {least}" if whole else f"above {least}"
            raise InvalidInputError(
                f"{label} must be {bounds}, and below a billion, not {shown(value)}."
            )
        return value if whole else float(value)  # equal numbers make equal cells
    text = _text(value, label)
    if key in _CHOICES and text not in _CHOICES[key]:
        raise InvalidInputError(
            f"{label}: {shown(text)} is unknown; {nearest(text, _CHOICES[key])}"
        )
    return text


def _text(value: object, label: str) -> str:
    if not isinstance(value, str):
        raise InvalidInputError(f"{label} must be a text, not {shown(value)}.")
    return value


def _table(value: object, label: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise InvalidInputError(f"{label} must be a table, not {shown(value)}.")
    return cast("dict[str, Any]", value)


def models_of(specs: Iterable[Mapping[str, Any]]) -> list[Model]:
    """Each model of the specs once."""
    found: list[Model] = []
    for spec in specs:
        if spec["model"] not in found:
            found.append(spec["model"])
    return found
