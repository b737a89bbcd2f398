"""Studies as TOML files; errors name the place and the remedy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, ValidationError
from pydantic.dataclasses import dataclass

from goalscope.agent.agent import Method
from goalscope.agent.settings import Domain
from goalscope.base.inputs import nearest, read_table, shown
from goalscope.base.types import InvalidInputError

BEST = 3
"""The best rating (Sec. 5); the worst is 0."""

Text = Annotated[str, Field(pattern=r"\S")]
Count = Annotated[int, Field(ge=0, le=1_000_000)]


@dataclass(frozen=True, slots=True, config=ConfigDict(extra="forbid", strict=True))
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
        domain: Domain of the episodes to rate: "grocery", "house" or "" for both.
        methods: Methods of the episodes to rate, see `Agent`; empty for all.
        transcript: Whether the conversation is shown, which the paper leaves out.
        ratings_per_item: Number of ratings wanted, from people who finish.
        items_per_participant: Number of items that each participant rates.
        min_explanation: Minimum length of an explanation in characters, not counting spaces.
        seed: Of the choice and order of items.
    """

    name: Annotated[str, Field(pattern="^[a-z0-9][a-z0-9-]{0,59}$")]
    consent: Text
    instructions: Text
    title: Text = "How well did the assistant do?"
    question: Text = (
        "How relevant and reasonable is this for the person's profile and the assistant's task? "
        "Please do not penalise inefficiency or repeats."
    )
    scale: Annotated[tuple[str, ...], Field(strict=False, min_length=4, max_length=4)] = (
        "least reasonable", "less reasonable", "more reasonable", "most reasonable",
    )  # fmt: skip
    thanks: str = "You may close this page."
    domain: Domain | Literal[""] = ""
    methods: Annotated[tuple[Method, ...], Field(strict=False)] = ()
    transcript: bool = False
    ratings_per_item: Annotated[Count, Field(ge=1)] = 5
    items_per_participant: Annotated[Count, Field(ge=1, le=200)] = 10
    min_explanation: Annotated[Count, Field(le=500)] = 20
    seed: Count = 0


def read_plan(file: Path) -> Plan:
    """Read a study from a TOML file.

    Raises:
        InvalidInputError: The file cannot be read, or has an unknown key or value; the message
            names the place and the nearest known one.
    """
    return plan_of(read_table(file), file.name)


def plan_of(table: Mapping[str, Any], label: str) -> Plan:
    """Read a study from a table of TOML or JSON; `label` names the table in messages.

    Raises:
        InvalidInputError: The table is invalid.
    """
    try:
        return Plan(**table)
    except ValidationError as error:
        fault = error.errors()[0]
    key, *inner = map(str, fault["loc"])
    if fault["type"] == "unexpected_keyword_argument":
        hint = nearest(key, [each.name for each in fields(Plan)])
        raise InvalidInputError(f"{label}: the key {shown(key)} is unknown; {hint}")
    if fault["type"] == "missing" and not inner:
        raise InvalidInputError(f"{label}: the key {key!r} is missing.")
    raise InvalidInputError(f"{label}: {key!r}: {fault['msg']}, not {shown(fault['input'])}.")
