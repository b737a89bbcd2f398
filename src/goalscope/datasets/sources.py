"""Dialogues with known goals to fit on, by the names of files and datasets."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from goalscope.base.inputs import nearest, shown
from goalscope.base.types import InvalidInputError
from goalscope.datasets import DATASETS, data_folder, load
from goalscope.datasets.case import Case, read_cases
from goalscope.datasets.goal_sets import goal_key

_NAME = re.compile(r"(?P<name>[^\[]+)(\[(?P<places>[^\]]*)\])?")
_PLACES = re.compile(r"(?P<start>\d*):(?P<stop>\d*)")


@dataclass(frozen=True, slots=True)
class Source:
    """Dialogues from one source.

    Attributes:
        name: As the user named it, such as "multiwoz:val[200:]".
        cases: The dialogues, one list for each way to draw wrong goals.
        sha256: Of the file.
        licence: Of the dataset; empty for your own file.
    """

    name: str
    cases: Sequence[Case]
    sha256: str
    licence: str = ""


def read_source(name: str, folder: Path | None, *, goals: int = 20, seed: int = 1) -> Source:
    """Read a file of dialogues, or a dataset.

    Args:
        name: FILE.jsonl, SET or SET:SPLIT, optionally with a slice of the dialogues, as in
            `teach:train[:100]`. The dialogues before the slice are reserved for evaluation: other
            dialogues of their groups are left out, and so are their true goals as wrong goals,
            unless they are also true in the slice.
        folder: Folder of the datasets; $GOALSCOPE_DATA if None.
        goals: Number of goals per dialogue of a dataset.
        seed: Seed for drawing goals.

    Raises:
        InvalidInputError: There is no such file, dataset or split, or no dialogue in it.
    """
    match = _NAME.fullmatch(name)
    if match is None:
        raise InvalidInputError(f"{shown(name)} is not a file or dataset to fit on.")
    places = _PLACES.fullmatch(match["places"] or ":")
    if places is None:
        raise InvalidInputError(
            f"{shown(name)}: expected a slice [FROM:TO], counted from 0, where either can be "
            "left out: [200:] is all dialogues but the first 200."
        )
    start, stop = (int(places[key]) if places[key] else None for key in ("start", "stop"))
    text, licence = match["name"], ""
    if text.endswith(".jsonl"):
        file = Path(os.path.expanduser(text))
        lists = [read_cases(file)]
    else:
        set, _, split = text.partition(":")
        known = [each for each, dataset in DATASETS.items() if dataset.goal_sets]
        if set not in known:
            raise InvalidInputError(
                f"{shown(text)} is neither a file whose name ends in .jsonl nor a dataset; "
                f"{nearest(set, known)}"
            )
        dataset, where = DATASETS[set], data_folder(folder)
        split = split or ("train" if "train" in dataset.files else dataset.split)
        file, licence = dataset.file(where, split), dataset.licence
        lists = [
            load(set, where, split=split, goal_set=goal_set, goals=goals, seed=seed)
            for goal_set in dataset.goal_sets
        ]
    judging = [case for cases in lists for case in cases[: start or 0]]
    groups = {case.group for case in judging}
    taken = [case for cases in lists for case in cases[start:stop] if case.group not in groups]
    held_out = {_truth(case) for case in judging} - {_truth(case) for case in taken}
    taken = [each for case in taken if (each := _without(case, held_out))]
    if not taken:
        raise InvalidInputError(
            f"{name} leaves no dialogues to fit on. Of {len(lists[0])} in all, some may share "
            "groups or goals with those before the slice."
        )
    return Source(name, taken, digest_of(file), licence)


def digest_of(file: Path) -> str:
    """The SHA-256 of a file."""
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


def _truth(case: Case) -> str:
    return goal_key(case.true_goal.text)


def _without(case: Case, keys: set[str]) -> Case | None:
    """The case without some wrong goals; None if no wrong goal is left."""
    true = {case.goals[each] for each in case.each_truth if each is not None}
    goals = [goal for goal in case.goals if goal in true or goal_key(goal.text) not in keys]
    return case.among(goals) if len(goals) > 1 else None
