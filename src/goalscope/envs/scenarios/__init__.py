"""Scenarios with what they call for, of which those nearest to what a person says are found.

A small model knows few of them, so the nearest are put into its prompt (retrieval-augmented
generation; Lewis et al., 2020).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from goalscope.models.nearest import Nearest


@dataclass(frozen=True, slots=True)
class Scenario:
    """An aim, and what it calls for.

    Attributes:
        id: Its name.
        domain: Such as "grocery".
        aim: In one phrase.
        said: First utterances of people who have it.
        needed: What it cannot do without, the most important first.
        nice: What many people would like.
        unwanted: What the words may suggest although nobody wants it here.
        room: What is in the room, where that matters.
    """

    id: str
    domain: str
    aim: str
    said: tuple[str, ...]
    needed: tuple[str, ...]
    nice: tuple[str, ...] = ()
    unwanted: tuple[str, ...] = ()
    room: str = ""

    @property
    def texts(self) -> tuple[str, ...]:
        """The aim, and the words that tell it."""
        return (self.aim, *self.said)


@cache
def shipped_scenarios(domain: str) -> Nearest[Scenario]:
    """The scenarios that come with goalscope for a domain."""
    folder = files("goalscope.envs.scenarios")
    rows: Iterator[dict[str, Any]] = (
        json.loads(line)
        for file in sorted(folder.iterdir(), key=lambda each: each.name)
        if file.name.endswith(".jsonl")
        for line in file.read_text(encoding="utf-8").splitlines()
    )
    lists = ("said", "needed", "nice", "unwanted")
    found = (row | {name: tuple(row[name]) for name in lists} for row in rows)
    return Nearest([Scenario(**row) for row in found if row["domain"] == domain])
