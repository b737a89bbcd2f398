"""Studies as TOML files; errors name the place and the remedy."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from annotated_types import Interval, Len, Predicate

from goalscope.agent.agent import Method
from goalscope.base.inputs import read_toml, shown, validated
from goalscope.envs.registry import BuiltIn

BEST = 3
"""The best rating (Sec. 5); the worst is 0."""


def _is_not_blank(text: str) -> bool:
    return bool(text.strip())


Text = Annotated[str, Predicate(_is_not_blank)]
Count = Annotated[int, Interval(ge=0, le=1_000_000)]


@dataclass(frozen=True, slots=True)
class Plan:
    """A study.

    Attributes:
        name: Part of its address: up to 60 lowercase letters, digits and hyphens.
        consent: What people consent to; an empty line starts a paragraph, as in `instructions`.
        instructions: What participants should do.
        title: Shown to participants.
        question: Question asked about each item.
        scale: Labels of the ratings 0 to 3.
        thanks: Shown at the end.
        domain: Domain of the episodes to rate; "" for all that come with goalscope.
        methods: Methods of the episodes to rate, see `Agent`; empty for all.
        transcript: Whether the conversation is shown, which the paper leaves out.
        ratings_per_item: Number of ratings wanted, from people who finish.
        items_per_participant: Number of items that each participant rates.
        min_explanation: Minimum length of an explanation in characters, not counting spaces.
        seed: Of the choice and order of items.
    """

    name: str
    consent: Text
    instructions: Text
    title: Text = "How well did the assistant do?"
    question: Text = (
        "How relevant and reasonable is this for the person's profile and the assistant's task? "
        "Please do not penalise inefficiency or repeats."
    )
    scale: Annotated[tuple[str, ...], Len(BEST + 1, BEST + 1)] = (
        "least reasonable", "less reasonable", "more reasonable", "most reasonable",
    )  # fmt: skip
    thanks: str = "You may close this page."
    domain: BuiltIn | Literal[""] = ""
    methods: tuple[Method, ...] = ()
    transcript: bool = False
    ratings_per_item: Annotated[int, Interval(ge=1, le=1_000_000)] = 5
    items_per_participant: Annotated[int, Interval(ge=1, le=200)] = 10
    min_explanation: Annotated[int, Interval(ge=0, le=500)] = 20
    seed: Count = 0

    def __post_init__(self) -> None:
        """Refuse a name that cannot be a part of an address."""
        if not re.fullmatch("[a-z0-9][a-z0-9-]{0,59}", self.name):
            raise ValueError(
                "'name' is part of the study's address: use up to 60 lowercase letters, digits "
                f"and hyphens, not {shown(self.name)}."
            )


def read_plan(file: Path) -> Plan:
    """Read a study from a TOML file.

    Raises:
        InvalidInputError: The file cannot be read, or has an unknown key or value.
    """
    return read_toml(file, Plan)


def plan_of(table: Mapping[str, Any], label: str) -> Plan:
    """Read a study from a table of JSON; `label` names the table in messages.

    Raises:
        InvalidInputError: The table is invalid.
    """
    return validated(table, Plan, label)
