"""What a study is: a TOML file, read with care, or refused with the place and the remedy."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar, cast, get_args
from urllib.parse import urlsplit

from goalscope.agent import Method
from goalscope.domains import Domain
from goalscope.envs.tables import is_list, nearest, read_table, refuse_unknown, shown
from goalscope.types import InvalidInputError, counted

__all__ = ["BEST", "Check", "Completion", "Exclusion", "Plan", "Selection", "plan_of", "read_plan"]

BEST = 3
"""The best rating (Sec. 5); the worst is 0."""


@dataclass(frozen=True, slots=True)
class Selection:
    """Which episodes of the store are rated: those that fit all that is named.

    Attributes:
        ids: Of episodes.
        domain: "grocery" or "house".
        methods: See `Agent`.
        profiles: Names of the people.
    """

    ids: tuple[str, ...] = ()
    domain: str = ""
    methods: tuple[str, ...] = ()
    profiles: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Check:
    """An item whose right rating is known, which tells who reads what they rate.

    Attributes:
        profile: The person, in words.
        rating: The right one.
        outcome: What the assistant is said to have achieved; "" for what it achieved in an episode
            of the study, which nobody can tell from the others.
        conversation: What is shown of it where the study shows conversations: by turns what the
            assistant says and what the person answers; of an episode, too, where it is empty.
    """

    profile: str
    rating: int
    outcome: str = ""
    conversation: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Exclusion:
    """Whose ratings do not count; stated before the first one, and judged once all are given.

    Attributes:
        failed_checks: As many checks with another rating than the right one, or more; 0 for never.
        same_rating: The same rating of all episodes, if there are two or more; checks do not count.
        same_explanation: The same explanation, likewise, but for case, spaces and the last mark.
        min_seconds: Half of the items in less time; 0 for never.
    """

    failed_checks: int = 1
    same_rating: bool = True
    same_explanation: bool = True
    min_seconds: int = 0


@dataclass(frozen=True, slots=True)
class Completion:
    """What proves to a recruiting service that somebody has finished.

    Attributes:
        code: Is shown in the end.
        url: Where they go back to.
    """

    code: str = ""
    url: str = ""


@dataclass(frozen=True, slots=True)
class Plan:
    """A study.

    Attributes:
        name: In its address: small letters, digits and hyphens.
        consent: What people agree to; an empty line begins a paragraph, as in `instructions`.
        instructions: What they are to do.
        title: For them.
        question: What they are asked of each item.
        scale: The words of the ratings 0 to 3.
        episodes: What they rate.
        transcript: Whether the conversation is shown, which the paper leaves out.
        ratings_per_item: How many are wanted of people who count.
        items_per_participant: How many each gives, besides all checks.
        min_explanation: Characters, not counting spaces.
        seed: Of the choice and order of items.
        hold_minutes: For how long the items of people who have not finished are kept for them.
        id_parameter: Of the address, in which a recruiting service names the participant.
        id_required: Whether nobody takes part without one.
        checks: Each participant gets all of them.
        exclusion: Whose ratings do not count.
        completion: What is shown in the end.
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
    episodes: Selection = field(default_factory=Selection)
    transcript: bool = False
    ratings_per_item: int = 5
    items_per_participant: int = 10
    min_explanation: int = 20
    seed: int = 0
    hold_minutes: int = 60
    id_parameter: str = "PROLIFIC_PID"
    id_required: bool = False
    checks: tuple[Check, ...] = ()
    exclusion: Exclusion = field(default_factory=Exclusion)
    completion: Completion = field(default_factory=Completion)


LEAST = {"ratings_per_item": 1, "items_per_participant": 1, "hold_minutes": 1}
MOST = {"rating": BEST, "min_explanation": 500, "items_per_participant": 200}
CHOICES = {"domain": get_args(Domain), "methods": get_args(Method)}


def read_plan(file: Path) -> Plan:
    """Read a study from a TOML file.

    Raises:
        InvalidInputError: The file cannot be read, or holds what is unknown; names the place, and
            the nearest key or value that is known.
    """
    table = read_table(file, f"The study {file} is")
    if "check" in table:
        table["checks"] = table.pop("check")
    plan = plan_of(table, file.name)
    label = file.name
    if not re.fullmatch("[a-z0-9][a-z0-9-]{0,59}", plan.name):
        raise InvalidInputError(
            f"{label}: 'name' stands in the study's address: up to 60 small letters, digits and "
            f"hyphens, not {shown(plan.name)}."
        )
    for key in ("consent", "instructions", "title", "question"):
        if not getattr(plan, key).strip():
            raise InvalidInputError(f"{label}: {key!r} must not be empty.")
    if len(plan.scale) != BEST + 1:
        raise InvalidInputError(
            f"{label}: 'scale' must hold {BEST + 1} texts, the words of 0 to {BEST}."
        )
    if not re.fullmatch("[A-Za-z0-9_-]+", plan.id_parameter) or plan.id_parameter == "key":
        raise InvalidInputError(
            f"{label}: 'id_parameter' is a name in an address, such as PROLIFIC_PID, and not "
            f"{shown(plan.id_parameter)}."
        )
    if plan.completion.url and not _is_https(plan.completion.url):
        raise InvalidInputError(
            f"{label}, completion: 'url' must begin with https://, not "
            f"{shown(plan.completion.url)}."
        )
    if plan.exclusion.failed_checks > len(plan.checks) and "failed_checks" in table.get(
        "exclusion", {}
    ):
        raise InvalidInputError(
            f"{label}, exclusion: nobody can fail {plan.exclusion.failed_checks} of "
            f"{counted(len(plan.checks), 'check')}. Add a [[check]], or lower 'failed_checks'."
        )
    for number, check in enumerate(plan.checks, 1):
        if len(check.conversation) % 2:
            raise InvalidInputError(
                f"{label}, check {number}: 'conversation' must hold pairs: what the assistant "
                "says, and what the person answers."
            )
        if check.conversation and not plan.transcript:
            raise InvalidInputError(
                f"{label}, check {number}: nobody sees a 'conversation' without transcript = true."
            )
    return plan


def plan_of(table: Mapping[str, Any], label: str = "The study") -> Plan:
    """The study of a table, as TOML and JSON have it.

    Raises:
        InvalidInputError: It holds what is unknown.
    """
    return _read(Plan, table, label)


T = TypeVar("T")
PARTS = {"episodes": Selection, "exclusion": Exclusion, "completion": Completion}


def _read(kind: type[T], value: object, label: str) -> T:
    if not isinstance(value, dict):
        raise InvalidInputError(f"{label} must be a table, not {shown(value)}.")
    row = cast("dict[str, Any]", value)
    known = {each.name: each for each in fields(cast("Any", kind))}
    refuse_unknown(row, tuple(known), label)
    for name, each in known.items():
        if name not in row and each.default is each.default_factory is MISSING:
            raise InvalidInputError(f"{label}: the key {name!r} is missing.")
    read = {key: _value(key, each, str(known[key].type), label) for key, each in row.items()}
    return kind(**read)


def _value(key: str, value: Any, kind: str, label: str) -> Any:
    where = f"{label}: {key!r}"
    if key in PARTS:
        return _read(PARTS[key], value, f"{label}, {key}")
    if key == "checks":
        if not isinstance(value, list):
            raise InvalidInputError(f"{label}: a check is a table [[check]].")
        rows = enumerate(cast("list[object]", value), 1)
        return tuple(_read(Check, row, f"{label}, check {n}") for n, row in rows)
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


def _is_https(url: str) -> bool:
    try:
        parts = urlsplit(url)
        return parts.scheme == "https" and bool(parts.hostname)
    except ValueError:
        return False
