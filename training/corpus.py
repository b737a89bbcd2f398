"""Corpora for writing adapters: messages, conversations, scenarios and recipes, as JSON Lines."""

from __future__ import annotations

import hashlib
import random
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from goalscope.base.types import InvalidInputError, Turn
from goalscope.datasets.files import Row
from goalscope.envs.registry import SHOP
from goalscope.envs.scenarios import Scenario
from goalscope.experiment.reading_scores import Line, lines_of, read_rows

_RECIPES = 2400
_LISTS = ("said", "needed", "nice", "unwanted")


@dataclass(frozen=True, slots=True)
class Talk:
    """A point in a conversation: the goals that explain it, and the next question.

    Attributes:
        id: Its name.
        domain: The domain of the conversation.
        turns: The turns so far.
        done: The agent's actions so far, as text.
        goals: Likeliest first.
        question: The next question; "" for none.
    """

    id: str
    domain: str
    turns: tuple[Turn, ...]
    done: str
    goals: tuple[str, ...]
    question: str


Entry = Line | Talk | Scenario
"""A line of a corpus."""

_KINDS = {Line: "messages", Talk: "points of talks", Scenario: "scenarios"}


def read_entries(path: Path) -> list[Entry]:
    """The entries of a JSON Lines file, or of all files in a folder.

    A row with a `title` and `ingredients` is a recipe: a scenario to make that dish. At most 2,400
    recipes are used, always the same sample.

    Raises:
        InvalidInputError: There are none, or a line is invalid; the message says which and why.
    """
    found: list[Entry] = []
    for number, row in enumerate(read_rows(path), 1):
        if _is_of_messages(row):
            found += lines_of(row)
            continue
        try:
            found += _entries(row.values, number)
        except (LookupError, TypeError, ValueError) as error:
            raise InvalidInputError(f"{row.label}: {error}") from None
    recipes = [each for each in found if isinstance(each, Scenario) and not each.said]
    if len(recipes) > _RECIPES:
        left_out = {each.id for each in random.Random(1).sample(recipes, len(recipes) - _RECIPES)}
        found = [each for each in found if each.id not in left_out]
    return found


def corpus_facts(found: Sequence[Entry], files: Sequence[str]) -> dict[str, Any]:
    """The files, the hash, and the counts of a corpus by kind and domain."""
    text = "\n".join(map(repr, found))
    counts = Counter(f"{_KINDS[type(each)]}, {each.domain}" for each in found)
    return {
        "files": list(files),
        "sha256": hashlib.sha256(text.encode()).hexdigest(),
        "counts": dict(counts),
        "writers": len({each.id.rpartition("-")[0] for each in found if isinstance(each, Line)}),
    }


def _is_of_messages(row: Row) -> bool:
    match row.values:
        case {"id": _, "turns": [{"message": _}, *_]}:
            return "ingredients" not in row.values
        case _:
            return False


def _entries(each: Mapping[str, Any], number: int) -> list[Entry]:
    """The entries of a row without messages; none for some recipes."""
    if "ingredients" in each:
        return [*_recipe(each, number)]
    if "needed" in each:
        return [scenario_from_json(each)]
    if "goals" not in each:
        raise InvalidInputError("a line must have 'goals', 'needed', or 'turns' with messages")
    turns = tuple(Turn(str(turn["query"]), str(turn["utterance"])) for turn in each["turns"])
    if not turns:
        raise InvalidInputError("there are no turns")
    return [
        Talk(
            str(each["id"]),
            str(each["domain"]),
            turns,
            str(each.get("done") or ""),
            tuple(map(str, each["goals"])),
            str(each.get("question") or ""),
        )
    ]


def scenario_from_json(data: object) -> Scenario:
    """The scenario in a row of JSON.

    Raises:
        InvalidInputError: A key is missing, or its value is of another kind.
    """
    if not isinstance(data, dict):
        raise InvalidInputError("a line must be an object")
    each = cast("dict[str, Any]", data)
    for key in ("id", "domain", "aim"):
        if not isinstance(each.get(key), str) or not each[key].strip():
            raise InvalidInputError(f"{key!r} must be a text")
    lists: dict[str, tuple[str, ...]] = {}
    for key in _LISTS:
        values = each.get(key, [])
        if not isinstance(values, list) or not all(
            isinstance(value, str) and value.strip() for value in cast("list[object]", values)
        ):
            raise InvalidInputError(f"{key!r} must be a list of texts")
        lists[key] = tuple(cast("list[str]", values))
    return Scenario(
        each["id"], each["domain"], each["aim"], **lists, room=str(each.get("room", ""))
    )


_ASIDE = re.compile(r"\([^)]*\)|,.*| - .*|\bor\b.*|\bto taste\b.*|[®™*]")
_BEFORE = (
    r"a|an|one|two|few|pinch|dash|large|small|medium|fresh|freshly|finely|chopped|minced|grated|"
    r"shredded|sliced|diced|crushed|packed|cold|warm|hot|ripe|softened|melted|cooked|uncooked|"
    r"peeled|whole|cup|tablespoon|teaspoon|tbsp|tsp|pound|lb|ounce|oz|can|clove|package|pkg|"
    r"packet|envelope|bunch|stick|slice|stalk|head|sprig|quart|pint|gallon|gram|g|kg|ml|jar|"
    r"bottle|bag|container|inch|of|and"
)
_NUMBERS = r"[\d\s/.\u00bc-\u00be\u2150-\u215e\u2009-]+"
_AMOUNT = re.compile(rf"^(?:{_NUMBERS}|(?:{_BEFORE})(?:s|es)?\b\.?\s*)+", re.IGNORECASE)
"""The amount and preparation in front of an ingredient's name."""
_LONGEST = 3  # words of an ingredient
_AT_HOME = ("water", "salt", "ice")


def _recipe(data: Mapping[str, Any], number: int) -> list[Scenario]:
    """The scenario to make a dish; None if too few of its ingredients are recognised."""
    title = re.sub(r"\([^)]*\)|[^\w\s'&-]|\b[IVX]+$", "", str(data.get("title", ""))).strip()
    found: dict[str, None] = {}
    for text in map(str, data["ingredients"]):
        name = " ".join(_AMOUNT.sub("", _ASIDE.sub("", text).strip()).lower().split())
        if 1 <= len(name.split()) <= _LONGEST and re.fullmatch(r"[a-z' -]+", name):
            found[name] = None
    for each in _AT_HOME:
        found.pop(each, None)
    if not 3 <= len(found) <= 14 or not 2 <= len(title.split()) <= 7:
        return []
    return [Scenario(f"recipe-{number}", SHOP, f"make {title.lower()}", (), tuple(found))]
