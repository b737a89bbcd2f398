"""Experiments, and the specs of the cells to measure."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args

from goalscope.agent.agent import K, Method
from goalscope.agent.people import Habit
from goalscope.agent.settings import Domain, Settings, load_domain, load_likelihood, profiles_of
from goalscope.agent.toolkit import modules_named
from goalscope.base.inputs import nearest, shown
from goalscope.base.types import InvalidInputError
from goalscope.belief.goal_manager import Trigger
from goalscope.belief.likelihood import DEFAULT_LAYOUT, Layout
from goalscope.datasets import DATASETS, data_folder, load, read_cases
from goalscope.datasets.case import case_to_json
from goalscope.datasets.goal_sets import changes_of
from goalscope.experiment.identity import hashes_of, person_of
from goalscope.experiment.judge import JUDGE_TEMPERATURE
from goalscope.experiment.multiple_choice import read_questions
from goalscope.experiment.results import Cell

__all__ = [
    "DialoguesPart",
    "EpisodesPart",
    "Experiment",
    "Judge",
    "QuestionsPart",
    "judging",
    "specs_of",
]

Model = Mapping[str, str]
Human = Literal["scripted", "simulated"] | Habit


@dataclass(frozen=True, slots=True)
class QuestionsPart:
    """Multiple-choice questions (Sec. 4.1).

    Attributes:
        file: Path, or file in the data folder.
        limit: Use only the first N.
        layouts: Where the likelihood prompt states the goal.
    """

    file: str
    limit: int | None = None
    layouts: tuple[Layout, ...] = (DEFAULT_LAYOUT,)


@dataclass(frozen=True, slots=True)
class DialoguesPart:
    """Real dialogues.

    Attributes:
        set: Name of a dataset; alternatively
        jsonl: path of your own file, or file in the data folder.
        split: Of the dataset.
        goal_sets: How wrong goals are drawn.
        goals: Number of goals per dialogue.
        seed: Seed for drawing goals.
        limit: Use only the first N dialogues.
        turns: Use only the first N turns of each dialogue.
        layouts: Where the likelihood prompt states the goal.
        outright: Whether to ask the model for the goal outright, too.
        likelihood: A likelihood of your own in place of the role-play one (see `load_likelihood`).
        change: The round (from 1) at which people change their mind (see `changes_of`), or None.
            With a change, goals are random and the model is not asked outright.
        models: As for the experiment; its own if there are none.
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
    outright: bool = True
    likelihood: str | None = None
    change: int | None = None
    models: tuple[Model, ...] = ()


@dataclass(frozen=True, slots=True)
class EpisodesPart:
    """Episodes with simulated people, in every combination (Sec. 4.2 and 4.3).

    Attributes:
        domain: "grocery", "house", or a Python file (see `load_domain`).
        profiles: Names, or "all".
        people: TOML file of profiles; None for those of the domain.
        methods: See `Agent`.
        humans: How the profile's person is played.
        layouts: Where the likelihood prompt states the goal.
        calibrations: Names or files; by default that of `Agent`.
        propose: See `Agent`; None for its default.
        k: Number of goals to act on; see `Agent`.
        likelihood: A likelihood of your own in place of the role-play one (see `load_likelihood`).
        prompted: Toolkit that use the paper's prompts; "all" for all of them.
        seeds: One run for each.
        rounds: Maximum number of rounds.
        catalogue: CSV file of the shop; None for the default one.
        scene: Room of the house; None for the profile's.
        models: As for the experiment; its own if there are none.
    """

    domain: str
    profiles: tuple[str, ...] = ("all",)
    people: str | None = None
    methods: tuple[Method, ...] = get_args(Method)
    humans: tuple[Human, ...] = ("scripted",)
    layouts: tuple[Layout, ...] = (DEFAULT_LAYOUT,)
    calibrations: tuple[str, ...] = ()
    propose: Trigger | None = None
    k: int = K
    likelihood: str | None = None
    prompted: tuple[str, ...] = ()
    seeds: tuple[int, ...] = (0,)
    rounds: int = 20
    catalogue: str | None = None
    scene: str | None = None
    models: tuple[Model, ...] = ()


@dataclass(frozen=True, slots=True)
class Judge:
    """The language-model evaluator of episodes (Sec. 5.1).

    Attributes:
        trials: Trials per run; 0 for no evaluator.
        seed: Seed of the trials.
        temperature: What it is sampled at; the paper has 0.
        model: The evaluator; None for the model of the run.
    """

    trials: int = 20
    seed: int = 0
    temperature: float = JUDGE_TEMPERATURE
    model: Model | None = None


@dataclass(frozen=True, slots=True)
class Experiment:
    """What to measure, and with which models.

    Attributes:
        name: Name of the file of results.
        title: Title of tables and reports.
        source: The section or figure of the paper that it reproduces, if any.
        models: Arguments of `open_model` for each model.
        questions: Parts with multiple-choice questions.
        dialogues: Parts.
        episodes: Parts.
        judge: The evaluator of the episodes.
    """

    name: str
    title: str = ""
    source: str = ""
    models: tuple[Model, ...] = ({},)
    questions: tuple[QuestionsPart, ...] = ()
    dialogues: tuple[DialoguesPart, ...] = ()
    episodes: tuple[EpisodesPart, ...] = ()
    judge: Judge = field(default_factory=lambda: Judge(trials=0))

    def with_models(self, models: tuple[Model, ...]) -> Experiment:
        """The experiment with other models, once for each combination of the other settings."""
        return replace(
            self,
            models=models,
            dialogues=tuple(dict.fromkeys(replace(part, models=()) for part in self.dialogues)),
            episodes=tuple(dict.fromkeys(replace(part, models=()) for part in self.episodes)),
        )


def specs_of(experiment: Experiment, folder: Path | None) -> list[dict[str, Any]]:
    """The specs of all cells that can be planned before any is measured.

    Args:
        experiment: What is to be measured.
        folder: Folder of the datasets; None if nothing is read from it.

    Raises:
        InvalidInputError: A file is missing or broken, or a name is unknown.
    """
    specs: list[dict[str, Any]] = []
    for part, model in itertools.product(experiment.questions, experiment.models):
        specs += _question_specs(part, model, folder)
    for part in experiment.dialogues:
        for model in part.models or experiment.models:
            specs += _dialogue_specs(part, model, folder)
    for part in experiment.episodes:
        for model in part.models or experiment.models:
            specs += _episode_specs(part, model)
    return specs


def judging(experiment: Experiment, cells: Sequence[Cell]) -> list[dict[str, Any]]:
    """The specs of the evaluator's cells, one per finished episode."""
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
            **({"temperature": heat} if (heat := judge.temperature) != JUDGE_TEMPERATURE else {}),
            **{key: result[key] for key in ("task", "description", "empty")},
            **_achieved(cell),
        })  # fmt: skip
    return specs


def _question_specs(
    part: QuestionsPart, model: Model, folder: Path | None
) -> Iterator[dict[str, Any]]:
    for question in read_questions(_file(part.file, folder), part.limit):
        for layout in part.layouts:
            yield {"kind": "mcq", "row": asdict(question), "model": model, "layout": layout}


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
    if part.change is not None:
        yield from _change_specs(part, part.change, model, folder)
        return
    own = _own_likelihood(part)
    goal_sets = part.goal_sets or (DATASETS[part.set].goal_sets if part.set else ("own",))
    for goal_set in goal_sets:
        is_drawn = goal_set in ("random", "hard")
        drawn = {"goals": part.goals, "seed": part.seed} if is_drawn else {}
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
                limit=part.limit,
            )
        for case in cases:
            for layout in part.layouts:
                yield {
                    "kind": "dialogue",
                    "set": part.set or Path(part.jsonl).stem,
                    "split": split,
                    "goal_set": goal_set,
                    "case": case_to_json(replace(case, turns=case.turns[: part.turns])),
                    "model": model,
                    **drawn,
                    "turns": part.turns,
                    "layout": layout,
                    "outright": part.outright,
                    **own,
                }


def _change_specs(
    part: DialoguesPart, round: int, model: Model, folder: Path | None
) -> Iterator[dict[str, Any]]:
    if part.jsonl or part.turns or part.goal_sets not in ((), ("random",)):
        raise InvalidInputError(
            "A change of mind is scripted from the dialogues of a dataset, with random goals "
            "and turns up to the third after it. Leave out 'jsonl', 'turns' and 'goal_sets'."
        )
    own = _own_likelihood(part)
    split = part.split or DATASETS[part.set].split
    cases = load(part.set, data_folder(folder), split=split, goals=part.goals, seed=part.seed)
    found = changes_of(cases, round=round, goals=part.goals, seed=part.seed)
    for script, layout in itertools.product(found[: part.limit], part.layouts):
        yield {
            "kind": "change",
            "set": part.set,
            "split": split,
            "goal_set": "random",
            "case": {**case_to_json(script.case), "second": script.second},
            "change": round,
            "model": model,
            "goals": part.goals,
            "seed": part.seed,
            "layout": layout,
            **own,
        }


def _own_likelihood(part: DialoguesPart | EpisodesPart) -> dict[str, Any]:
    """The likelihood of a part, if it is not the role-play one, with a hash of its file.

    Raises:
        InvalidInputError: It cannot be loaded, or an option of the role-play one is given, too.
    """
    if part.likelihood is None:
        return {}
    if part.layouts != (DEFAULT_LAYOUT,):
        raise InvalidInputError(
            "'layouts' only applies to the role-play likelihood. Leave it out, or leave out "
            "'likelihood'."
        )
    name = load_likelihood(part.likelihood)
    return {"likelihood": name, "files": hashes_of(Settings(likelihood=name))}


def _episode_specs(part: EpisodesPart, model: Model) -> Iterator[dict[str, Any]]:
    domain = load_domain(part.domain)
    if domain not in get_args(Domain) and (part.catalogue or part.scene):
        raise InvalidInputError(
            f"'catalogue' and 'scene' do not apply to the domain {shown(part.domain)}."
        )
    fixed: dict[str, Any] = {
        "domain": domain,
        "profiles": part.people,
        "catalogue": part.catalogue,
        "scene": part.scene,
        "rounds": part.rounds,
    }
    if part.propose is not None:
        fixed["propose"] = part.propose
    if part.k != K:
        fixed["k"] = part.k
    if own := _own_likelihood(part):
        fixed["likelihood"] = own["likelihood"]
    if part.prompted:
        fixed["prompted"] = [*modules_named(part.prompted)]
    settings = Settings(
        domain=domain,
        profiles=fixed["profiles"],
        catalogue=fixed["catalogue"],
        scene=part.scene,
        likelihood=fixed.get("likelihood"),
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
        part.layouts,
        names,
        part.methods,
    ):
        axes = {
            "human": human,
            "method": method,
            "calibration": calibration,
            "layout": layout,
        }
        yield {
            "kind": "episode",
            "settings": {**fixed, **axes, "seed": seed},
            "profile": name,
            "person": person_of(known[name]),
            "files": hashes_of(replace(settings, calibration=calibration)),
            "model": model,
        }


def _run_of(cell: Cell) -> dict[str, Any]:
    """The part of a run that an evaluator's cell contains."""
    return {
        "key": cell.key,
        "kind": "episode",
        **{key: cell.spec[key] for key in ("model", "profile", "settings")},
    }


def _achieved(cell: Cell) -> dict[str, Any]:
    """What an evaluator sees (Sec. 5.1): the basket, or the record of the robot's actions.

    In a domain of one's own it sees both the final state and the record.
    """
    result, domain = cell.result or {}, cell.spec["settings"]["domain"]
    if domain == "grocery":
        return {"outcome": result["outcome"], "actions": []}
    if domain == "house":
        return {"outcome": "", "actions": result["actions"]}
    return {key: result[key] for key in ("outcome", "actions", "possible")}


def _file(name: str, folder: Path | None) -> Path:
    """A file by its path, or in the data folder."""
    name = os.path.expanduser(name)
    places = [Path(name), *([folder / name] if folder else [])]
    for file in places:
        if file.is_file():
            return file
    hint = "" if folder else " If it is in the data folder, name that folder with --data."
    raise InvalidInputError(f"There is no file {' or '.join(map(shown, map(str, places)))}.{hint}")
