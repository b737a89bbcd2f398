"""Studies as TOML files; errors name the place and the remedy."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any, get_args

from goalscope.agent.agent import Method
from goalscope.agent.settings import Domain
from goalscope.base.inputs import is_list, nearest, read_table, refuse_unknown, shown
from goalscope.base.types import InvalidInputError

__all__ = ["BEST", "Plan", "plan_of", "read_plan"]

BEST = 3
"""The best rating (Sec. 5); the worst is 0."""


@dataclass(frozen=True, slots=True)
class Plan:
    """A study.

    Attributes:
        name: Part of its address: lowercase letters, digits and hyphens.
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

    name: str
    consent: str
    instructions: str
    title: str = "How well did the assistant do?"
    question: str = (
        "How relevant and reasonable is this for the person's profile and the assistant's task? "
        "Please do not penalise inefficiency or repeats."
    )
    scale: tuple[str, ...] = (
        "least reasonable", "less reasonable", "more reasonable", "most reasonable",
    )  # fmt: skip
    thanks: str = "You may close this page."
    domain: str = ""
    methods: tuple[str, ...] = ()
    transcript: bool = False
    ratings_per_item: int = 5
    items_per_participant: int = 10
    min_explanation: int = 20
    seed: int = 0


LEAST = {"ratings_per_item": 1, "items_per_participant": 1}
MOST = {"min_explanation": 500, "items_per_participant": 200}
CHOICES = {"domain": get_args(Domain), "methods": get_args(Method)}


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
    known = {each.name: each for each in fields(Plan)}
    refuse_unknown(table, tuple(known), label)
    for key, each in known.items():
        if key not in table and each.default is MISSING:
            raise InvalidInputError(f"{label}: the key {key!r} is missing.")
    read = {key: _value(key, table[key], str(known[key].type), label) for key in table}
    plan = Plan(**read)
    if not re.fullmatch("[a-z0-9][a-z0-9-]{0,59}", plan.name):
        raise InvalidInputError(
            f"{label}: 'name' is part of the study's address. Use up to 60 lowercase letters, "
            f"digits and hyphens, not {shown(plan.name)}."
        )
    for key in ("consent", "instructions", "title", "question"):
        if not getattr(plan, key).strip():
            raise InvalidInputError(f"{label}: {key!r} must not be empty.")
    if len(plan.scale) != BEST + 1:
        raise InvalidInputError(
            f"{label}: 'scale' must have {BEST + 1} texts, the labels of 0 to {BEST}."
        )
    return plan


def _value(key: str, value: Any, kind: str, label: str) -> Any:
    where = f"{label}: {key!r}"
    if kind.startswith("tuple"):
        if not is_list(value, str):
            raise InvalidInputError(f"{where} must be a list of texts, not {shown(value)}.")
        return tuple(_value(key, each, "str", label) for each in value)
    if kind == "int":
        least, most = LEAST.get(key, 0), MOST.get(key, 1_000_000)
        if type(value) is not int or not least <= value <= most:
            raise InvalidInputError(
                f"{where} must be a whole number from {least} to {most}, not {shown(value)}."
            )
        return value
    if not isinstance(value, bool if kind == "bool" else str):
        what = "true or false" if kind == "bool" else "a text"
        raise InvalidInputError(f"{where} must be {what}, not {shown(value)}.")
    if isinstance(value, str) and value and value not in CHOICES.get(key, (value,)):
        raise InvalidInputError(
            f"{where}: {shown(value)} is unknown; {nearest(value, CHOICES[key])}"
        )
    return value
