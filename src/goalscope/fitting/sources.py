"""What an adapter is fitted on: dialogues with known goals, and which of them validate it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest
from pathlib import Path

from goalscope.datasets import DATASETS, Case, data_folder, load, read_cases
from goalscope.datasets.goal_sets import chance
from goalscope.envs.tables import shown
from goalscope.types import InvalidInputError

__all__ = ["Source", "parted", "read_source"]

_NAME = re.compile(r"(?P<name>.+?)(\[(?P<start>\d*):(?P<stop>\d*)\])?")


@dataclass(frozen=True, slots=True)
class Source:
    """Dialogues of one origin.

    Attributes:
        name: As it was asked for, such as "multiwoz:val[200:]".
        cases: The dialogues; one for each way to draw its wrong goals.
        sha256: Of the file.
        licence: Of the dataset; empty for a file of one's own.
    """

    name: str
    cases: Sequence[Case]
    sha256: str
    licence: str = ""


def read_source(name: str, folder: Path | None, *, goals: int = 10, seed: int = 1) -> Source:
    """Read a file of dialogues, or a dataset.

    Args:
        name: FILE.jsonl, SET or SET:SPLIT; perhaps with the places of the dialogues to take, as in
            `teach:train[:100]`. Dialogues of a group, some of which stand before the first place,
            are left out: `multiwoz:val[200:]` has nothing in common with the first 200.
        folder: Of the datasets; that of GOALSCOPE_DATA if None.
        goals: How many for each dialogue of a dataset.
        seed: Of their draw.

    Raises:
        InvalidInputError: There is no such file, dataset or split, or no dialogue in it.
    """
    match = _NAME.fullmatch(name)
    if match is None:
        raise InvalidInputError("The name of a file or dataset to fit on is empty.")
    start, stop = (int(match[key]) if match[key] else None for key in ("start", "stop"))
    text, licence = match["name"], ""
    if text.endswith(".jsonl"):
        file = Path(text).expanduser()
        lists = [read_cases(file)]
    else:
        set, _, split = text.partition(":")
        known = [each for each, dataset in DATASETS.items() if dataset.goal_sets]
        if set not in known:
            raise InvalidInputError(
                f"{shown(name)} is neither a file FILE.jsonl nor one of the datasets "
                f"{', '.join(known)}."
            )
        dataset, where = DATASETS[set], data_folder(folder)
        split = split or ("train" if "train" in dataset.files else dataset.split)
        file, licence = dataset.file(where, split), dataset.licence
        lists = [
            load(set, where, split=split, goal_set=goal_set, goals=goals, seed=seed).cases
            for goal_set in dataset.goal_sets
        ]
    before = {case.group for cases in lists for case in cases[: start or 0]}
    taken = [
        case for cases in lists for case in cases[start:stop] if case.group not in before
    ]  # fmt: skip
    if not taken:
        raise InvalidInputError(f"{name} holds no dialogue.")
    with file.open("rb") as opened:
        digest = hashlib.file_digest(opened, "sha256").hexdigest()
    return Source(name, taken, digest, licence)


def parted(
    sources: Iterable[Source], *, share: float, most: int, seed: int
) -> tuple[list[list[Case]], list[Case]]:
    """Part groups of dialogues into those that train, by source, and those that validate.

    Args:
        sources: At least one.
        share: Of the groups that validate.
        most: Most dialogues that validate; the same number of each source, as far as they go.
        seed: Of the draw.

    Raises:
        InvalidInputError: There are too few groups.
    """
    train: list[list[Case]] = []
    candidates: list[list[Case]] = []
    for source in sources:
        groups = sorted({case.group for case in source.cases})
        chance(seed, source.name).shuffle(groups)
        held = set(groups[: max(1, round(share * len(groups)))])
        if len(groups) < 2:
            raise InvalidInputError(
                f"{source.name} holds a single group of dialogues; one part has to train and "
                "another to validate. Give at least two."
            )
        train.append([case for case in source.cases if case.group not in held])
        candidates.append([case for case in source.cases if case.group in held])
        chance(seed, f"validation {source.name}").shuffle(candidates[-1])
    turns = chain.from_iterable(zip_longest(*candidates))
    return train, [case for case in turns if case is not None][:most]
