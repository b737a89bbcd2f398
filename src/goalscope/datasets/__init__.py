"""Public datasets of real dialogues, read from the user's folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from goalscope.base.inputs import nearest, read_table, shown
from goalscope.base.text import command_line
from goalscope.base.types import InvalidInputError
from goalscope.datasets.case import Case
from goalscope.datasets.desks import hint3, multidogo, sgd
from goalscope.datasets.loaders import alfred, casino, multiwoz, taskmaster, teach

_Reader = Callable[[Path, str, int, int], Iterator[Case | str]]


@dataclass(frozen=True, slots=True)
class Dataset:
    """A public dataset.

    Attributes:
        name: Short name.
        title: What its authors call it.
        what: Its content, in one line.
        licence: Licence of the dataset.
        source: Where it comes from.
        files: The file of each split, relative to the data folder.
        split: The default split.
        goal_sets: Ways to draw wrong goals, the default first; empty without dialogues.
    """

    name: str
    title: str
    what: str
    licence: str
    source: str
    files: Mapping[str, str]
    split: str
    goal_sets: tuple[str, ...]

    def file(self, folder: Path, split: str | None = None) -> Path:
        """The file of a split.

        Raises:
            InvalidInputError: There is no such split, or its file is missing.
        """
        split = split or self.split
        if split not in self.files:
            raise InvalidInputError(
                f"{self.title} has no split {shown(split)}; {nearest(split, self.files)}"
            )
        file = folder / self.files[split]
        if not file.is_file():
            raise InvalidInputError(
                f"{self.title} ({split}) is missing: there is no file {file}. It is "
                f"{self.what}; it comes from {self.source}. Put it there. "
                f"`{command_line('data', 'list', '--data', folder)}` lists the files."
            )
        return file


DATASETS: Mapping[str, Dataset] = {
    name: Dataset(name, **row | {"goal_sets": tuple(row.get("goal_sets", ("random", "hard")))})
    for name, row in read_table(resources.files("goalscope.datasets") / "datasets.toml").items()
}
"""All datasets by their names."""

READERS: Mapping[str, _Reader] = {
    "teach": teach,
    "multiwoz": multiwoz,
    "casino": casino,
    "alfred": alfred,
    "taskmaster4": taskmaster,
    "sgd": sgd,
    "multidogo": multidogo,
    "hint3": hint3,
}
"""Readers by the names of datasets: of a file, a goal set, a number of goals and a seed."""


def data_folder(given: Path | None) -> Path:
    """The given folder of the datasets, or that of GOALSCOPE_DATA.

    Raises:
        InvalidInputError: No folder is named, or it does not exist.
    """
    named = given or os.environ.get("GOALSCOPE_DATA")
    if not named:
        raise InvalidInputError(
            "Name the folder of the datasets with --data, or in the environment variable "
            "GOALSCOPE_DATA. `goalscope data list` shows which files belong there."
        )
    if not (folder := Path(os.path.expanduser(named))).is_dir():
        raise InvalidInputError(
            f"There is no folder {folder} for the datasets. Name another one with --data, or "
            "in the environment variable GOALSCOPE_DATA."
        )
    return folder


def named_folder(given: Path | None) -> Path | None:
    """Like `data_folder`, but None if no folder is named."""
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
    """Cases of a dataset; each depends only on the split and the seed.

    They are in file order, except for ALFRED, whose order depends on the seed.

    Args:
        name: Name of the dataset.
        folder: Folder of all datasets.
        split: Split; by default, the dataset's default.
        goal_set: How wrong goals are drawn; by default, the dataset's first way.
        goals: Number of goals per case, including the true one; "complete" sets have their own.
        seed: Seed for drawing goals.
        limit: Use only the first N cases.

    Raises:
        InvalidInputError: An option is unknown, a file is missing or broken, or there is no case.
    """
    if name not in READERS:
        raise InvalidInputError(f"Unknown dataset {shown(name)}; {nearest(name, READERS)}")
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
        raise InvalidInputError(f"{file} has no usable dialogues: {why or 'it is empty'}.")
    return cases[:limit]
