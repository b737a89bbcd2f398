"""Public datasets of real dialogues, read from a folder that the user names."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from goalscope.datasets.alfred import alfred
from goalscope.datasets.case import OPENING, Case, said_key, turns_of
from goalscope.datasets.casino import casino
from goalscope.datasets.jsonl import read_cases, write_cases
from goalscope.datasets.multiwoz import multiwoz
from goalscope.datasets.taskmaster import taskmaster
from goalscope.datasets.teach import teach
from goalscope.envs.tables import nearest, shown
from goalscope.types import InvalidInputError

__all__ = [
    "DATASETS",
    "OPENING",
    "READERS",
    "Case",
    "Dataset",
    "data_folder",
    "load",
    "named_folder",
    "read_cases",
    "said_key",
    "turns_of",
    "write_cases",
]

_Reader = Callable[[Path, str, int, int], Iterator[Case | str]]


@dataclass(frozen=True, slots=True)
class Dataset:
    """A public dataset.

    Attributes:
        name: Short name.
        title: What its authors call it.
        what: What it holds, in one line.
        licence: Under which it is published.
        source: Where it comes from.
        files: The file of each split, from the data folder.
        split: The split that is read if none is named.
        goal_sets: How wrong goals can be drawn, the default first; none where it holds no
            dialogues.
    """

    name: str
    title: str
    what: str
    licence: str
    source: str
    files: Mapping[str, str]
    split: str
    goal_sets: tuple[str, ...] = ("random", "hard")

    def file(self, folder: Path, split: str | None = None) -> Path:
        """The file of a split.

        Raises:
            InvalidInputError: There is no such split, or its file is not there.
        """
        split = split or self.split
        if split not in self.files:
            raise InvalidInputError(
                f"{self.title} has no split {shown(split)}; {nearest(split, self.files)}"
            )
        file = folder / self.files[split]
        if not file.is_file():
            raise InvalidInputError(
                f"{self.title} ({split}) is missing: there is no file {file}. It is {self.what}; "
                f"it comes from {self.source}. Put it there; `goalscope data list` names the files."
            )
        return file


DATASETS: Mapping[str, Dataset] = {
    each.name: each
    for each in (
        Dataset(
            "teach",
            "TEACh",
            "people telling a robot in AI2-THOR what to do in a home",
            "CDLA-Sharing-1.0",
            "TEACh by Amazon, https://github.com/alexa/teach",
            {
                "train": "dialogue/teach/teach_train.jsonl.gz",
                "valid_seen": "dialogue/teach/teach_valid_seen.jsonl.gz",
                "valid_unseen": "dialogue/teach/teach_valid_unseen.jsonl.gz",
            },
            "valid_seen",
        ),
        Dataset(
            "multiwoz",
            "MultiWOZ 2.1",
            "people looking for trains, hotels and so on in Cambridge",
            "MIT",
            "MultiWOZ, https://github.com/budzianowski/multiwoz",
            {
                "val": "dialogue/multiwoz/val.json.zip",
                "test": "dialogue/multiwoz/test.json.zip",
            },
            "val",
        ),
        Dataset(
            "casino",
            "CaSiNo",
            "pairs of campers negotiating over food, water and firewood",
            "CC-BY 4.0",
            "CaSiNo, https://github.com/kushalchawla/CaSiNo",
            {
                "train": "dialogue/casino/casino_train.json",
                "valid": "dialogue/casino/casino_valid.json",
                "test": "dialogue/casino/casino_test.json",
            },
            "valid",
            ("complete",),
        ),
        Dataset(
            "alfred",
            "ALFRED",
            "three or more people's sentences for each household goal",
            "MIT",
            "ALFRED, https://github.com/askforalfred/alfred",
            {
                "train": "dialogue/alfred/alfred_goals_train.jsonl.gz",
                "valid_seen": "dialogue/alfred/alfred_goals_valid_seen.jsonl.gz",
                "valid_unseen": "dialogue/alfred/alfred_goals_valid_unseen.jsonl.gz",
            },
            "train",
        ),
        Dataset(
            "taskmaster4",
            "Taskmaster-4",
            "coffee orders, with what was ordered in the end",
            "CC-BY 4.0",
            "Taskmaster by Google, https://github.com/google-research-datasets/Taskmaster",
            {
                "dev": "dialogue/taskmaster4/orders_dev.jsonl.gz",
                "test": "dialogue/taskmaster4/orders_test.jsonl.gz",
            },
            "dev",
        ),
        Dataset(
            "mcq",
            "Multiple-choice questions",
            "the paper's questions with five choices, some of them rephrased",
            "not stated",
            "R. Osmulski's additional training data (2023) for Kaggle's LLM Science Exam, "
            "https://www.kaggle.com/competitions/kaggle-llm-science-exam",
            {"train": "mcq/6000_train_examples.csv", "dev": "mcq/rephrased_dev.jsonl"},
            "dev",
            (),
        ),
    )
}
"""All datasets by their names."""

READERS: Mapping[str, _Reader] = {
    "teach": teach,
    "multiwoz": multiwoz,
    "casino": casino,
    "alfred": alfred,
    "taskmaster4": taskmaster,
}
"""Readers by the names of datasets: of a file, a goal set, a number of goals and a seed."""


def data_folder(given: Path | None) -> Path:
    """The folder of the datasets: the one given, or else that of GOALSCOPE_DATA.

    Raises:
        InvalidInputError: None is named, or it is not there.
    """
    named = given or os.environ.get("GOALSCOPE_DATA")
    if not named:
        raise InvalidInputError(
            "Name the folder of the datasets with --data, or in the environment variable "
            "GOALSCOPE_DATA. `goalscope data list` says what goes where."
        )
    if not (folder := Path(named)).is_dir():
        raise InvalidInputError(
            f"The folder of the datasets, {folder}, is not there. Name another one with --data, or "
            "in the environment variable GOALSCOPE_DATA."
        )
    return folder


def named_folder(given: Path | None) -> Path | None:
    """As `data_folder`, but None where none is named."""
    return data_folder(given) if given or os.environ.get("GOALSCOPE_DATA") else None


def load(
    name: str,
    folder: Path,
    *,
    split: str | None = None,
    goal_set: str | None = None,
    goals: int = 20,
    seed: int = 1,
    limit: int | None = None,
) -> list[Case]:
    """Cases of a dataset, each of which depends on the split and the seed, not on other cases.

    They are in the order of the file; those of ALFRED in one that the seed draws.

    Args:
        name: Of the dataset.
        folder: Of all datasets.
        split: By default the dataset's own default.
        goal_set: How the wrong goals are drawn; by default the dataset's first way.
        goals: How many for each case, the true one among them; "complete" sets have their own.
        seed: Of the draw.
        limit: Only so many cases, the first ones.

    Raises:
        InvalidInputError: An option is unknown, a file is missing or broken, or there is no case.
    """
    if name not in READERS:
        raise InvalidInputError(f"There are no dialogues {shown(name)}; {nearest(name, READERS)}")
    dataset = DATASETS[name]
    goal_set = goal_set or dataset.goal_sets[0]
    if goal_set not in dataset.goal_sets:
        raise InvalidInputError(
            f"{dataset.title} has no goal set {shown(goal_set)}; "
            f"{nearest(goal_set, dataset.goal_sets)}"
        )
    if goals < 2:
        raise InvalidInputError(f"A case needs at least 2 goals, not {goals}.")
    if limit is not None and limit < 1:
        raise InvalidInputError(f"The limit must be at least 1, not {limit}.")
    file = dataset.file(folder, split)
    cases: list[Case] = []
    left_out: dict[str, int] = {}
    ids: set[str] = set()
    for case in READERS[name](file, goal_set, goals, seed):
        if isinstance(case, str):
            left_out[case] = left_out.get(case, 0) + 1
            continue
        if case.id in ids:
            raise InvalidInputError(f"{file}: two dialogues have the id {shown(case.id)}.")
        ids.add(case.id)
        cases.append(case)
    if not cases:
        why = "; ".join(f"{reason} ({count})" for reason, count in left_out.items())
        raise InvalidInputError(
            f"{file} holds no dialogue that can be used: {why or 'it is empty'}."
        )
    return cases[:limit]
