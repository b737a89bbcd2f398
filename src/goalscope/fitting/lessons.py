"""What a model that writes is taught by: prompts, and what is to be written after them."""

from __future__ import annotations

import hashlib
import random
import re
from abc import abstractmethod
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, cast

from goalscope.benchmarks.reading import Language, Line, line_from_json, read_rows
from goalscope.fitting.recombining import Conversation, Recombining
from goalscope.models import Generator
from goalscope.occasions import Nearest, Occasion, occasion_from_json
from goalscope.reader import Exchange, Reader
from goalscope.types import InvalidInputError, Message, Turn
from goalscope.words import singulars
from goalscope.writer import (
    JUDGEMENTS,
    LIKE,
    NOTHING,
    goals_prompt,
    needs_prompt,
    needs_written,
    question_prompt,
)

__all__ = ["Lesson", "Lessons", "Talk", "Taught", "corpus_facts", "lessons_of", "read_lessons"]

_NEGATIVES = (("near", 5), ("any", 2))
_POSITIVES = 8
_RECIPES = 2400


@dataclass(frozen=True, slots=True)
class Lesson:
    """A prompt, and what is to be written after it; `kind` says what it teaches."""

    kind: str
    prompt: Sequence[Message]
    answer: str


class Lessons(Protocol):
    """Lessons that are drawn anew in each epoch, those that share beginnings together."""

    @property
    def size(self) -> int:
        """Number of what is drawn in one epoch."""
        ...

    @abstractmethod
    def drawn(self, index: int, draw: random.Random) -> list[Lesson]:
        """The lessons of one of them."""
        ...


class Recombined(Protocol):
    """How messages are recombined; see `ReadingLessons`."""

    @property
    def renamed(self) -> float: ...
    @property
    def joined(self) -> float: ...


@dataclass(frozen=True, slots=True)
class Talk:
    """A point of a conversation: the goals that explain it, and the next question.

    Attributes:
        id: Its name.
        domain: Where it was said.
        turns: All so far.
        done: What the agent has done, in words.
        goals: Likeliest first.
        question: "" where nothing is to be asked.
    """

    id: str
    domain: str
    turns: tuple[Turn, ...]
    done: str
    goals: tuple[str, ...]
    question: str


Taught = Line | Talk | Occasion
"""What a line of a corpus is."""


class ReadingLessons:
    """Conversations whose orders are known, recombined.

    Args:
        model: Whose readings are taught.
        languages: What can be asked for, by domain.
        lines: The messages.
        renamed: Share of things that become others, each time anew.
        joined: Share of conversations that begin with another one's first message, likewise.
    """

    def __init__(
        self,
        model: Generator,
        languages: Mapping[str, Language],
        lines: Sequence[Line],
        *,
        renamed: float,
        joined: float,
    ) -> None:
        self._readers = {
            name: Reader(model, each.verbs, taught=True) for name, each in languages.items()
        }
        self._conversations = _conversations(lines)
        self._recombining = Recombining(self._conversations, renamed=renamed, joined=joined)
        self.size = len(self._conversations)

    def drawn(self, index: int, draw: random.Random) -> list[Lesson]:
        """See `Lessons`."""
        conversation = self._recombining.drawn(self._conversations[index], draw)
        reader = self._readers[conversation[0].domain]
        before: list[Exchange] = []
        found: list[Lesson] = []
        for line in conversation:
            prompt = reader.prompt(line.message, question=line.question, before=before)
            found.append(Lesson("reading", prompt, reader.written(line.orders)))
            before.append(Exchange(line.question, line.message, line.orders))
        return found


class TalkLessons:
    """Goals and questions at each point of conversations.

    Args:
        talks: The points.
        tasks: The agent's task, by domain.
    """

    def __init__(self, talks: Sequence[Talk], tasks: Mapping[str, str]) -> None:
        self._talks, self._tasks = talks, tasks
        self.size = len(talks)

    def drawn(self, index: int, draw: random.Random) -> list[Lesson]:
        """See `Lessons`."""
        talk = self._talks[index]
        task = self._tasks.get(talk.domain) or f"The agent is an assistant for {talk.domain}."
        goals = [*talk.goals]
        if len(goals) > 1 and draw.random() < 0.3:  # others are held, too, as they may be later
            draw.shuffle(goals)
        return [
            Lesson("goals", goals_prompt(task, talk.turns), "\n".join(talk.goals) or NOTHING),
            Lesson(
                "question",
                question_prompt(task, talk.turns, talk.done, goals),
                talk.question or NOTHING,
            ),
        ]


class NeedLessons:
    """What aims call for, with the occasions nearest to each in the prompt.

    Args:
        occasions: Those that teach.
        known: Those that are looked up, of all domains.
    """

    def __init__(self, occasions: Sequence[Occasion], known: Sequence[Occasion]) -> None:
        self._occasions = occasions
        self._nearest = {
            domain: Nearest([each for each in known if each.domain == domain])
            for domain in {each.domain for each in occasions}
        }
        self._things = {
            domain: sorted({thing for each in near.occasions for thing in each.needed + each.nice})
            for domain, near in self._nearest.items()
        }
        self.size = len(occasions)

    def drawn(self, index: int, draw: random.Random) -> list[Lesson]:
        """See `Lessons`."""
        each = self._occasions[index]
        said = draw.choice(each.said) if each.said and draw.random() < 0.8 else ""
        aim = each.aim if not said or draw.random() < 0.75 else ""
        like = self._nearest[each.domain](f"{said} {aim}".strip(), LIKE, without=each.id)
        if draw.random() < 0.1:
            like = []
        written = needs_written(each.needed, each.nice)
        found = [Lesson("needs", needs_prompt(aim, said, like, each.room), written)]
        for thing, label in self._judged(each, like, draw):
            prompt = needs_prompt(aim, said, like, each.room, thing)
            found.append(Lesson("judging", prompt, label))
        return found

    def _judged(
        self, each: Occasion, like: Sequence[Occasion], draw: random.Random
    ) -> Iterator[tuple[str, str]]:
        """Things with what is to be said of them."""
        needed, nice, unwanted = JUDGEMENTS
        own = {" ".join(singulars(thing)) for thing in each.needed + each.nice}
        words = {word for thing in own for word in thing.split()}
        near = {thing for other in like for thing in other.needed + other.nice + other.unwanted}
        for thing in draw.sample(each.needed, min(_POSITIVES, len(each.needed))):
            yield thing, needed
        for thing in draw.sample(each.nice, min(_POSITIVES // 2, len(each.nice))):
            yield thing, nice
        for thing in each.unwanted:
            yield thing, unwanted
        pools = {"near": sorted(near), "any": self._things[each.domain]}
        for name, count in _NEGATIVES:
            for thing in draw.sample(pools[name], min(count, len(pools[name]))):
                stem = singulars(thing)
                if thing not in each.unwanted and not (stem and stem[-1] in words):
                    yield thing, unwanted


def read_lessons(path: Path) -> list[Taught]:
    """What a file of JSON Lines teaches, or all files of a folder: messages, talks, or needs.

    (Rows with a `title` and `ingredients` are recipes: what a dish calls for. Of many, 2,400 are
    drawn, always the same ones.)

    Raises:
        InvalidInputError: There is none, or a line is wrong; says which and why.
    """
    found = read_rows(path, _lessons)
    recipes = [each for each in found if isinstance(each, Occasion) and not each.said]
    if len(recipes) > _RECIPES:
        left_out = {each.id for each in random.Random(1).sample(recipes, len(recipes) - _RECIPES)}
        found = [each for each in found if each.id not in left_out]
    return found


def _lessons(data: object, number: int) -> list[Taught]:
    """What a row teaches: one thing, or of some recipes nothing."""
    if not isinstance(data, dict):
        raise InvalidInputError("a line must be an object")
    each = cast("dict[str, Any]", data)
    if "ingredients" in each:
        return [*_recipe(each, number)]
    if "orders" in each:
        return [line_from_json(each)]
    if "needed" in each:
        return [occasion_from_json(each)]
    if "goals" not in each:
        raise InvalidInputError("a line must have 'orders', 'goals' or 'needed'")
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


_ASIDE = re.compile(r"\([^)]*\)|,.*| - .*|\bor\b.*|\bto taste\b.*|[®™*]")
# What stands before an ingredient and is no part of it.
_BEFORE = (
    r"a|an|one|two|few|pinch|dash|large|small|medium|fresh|freshly|finely|chopped|minced|grated|"
    r"shredded|sliced|diced|crushed|packed|cold|warm|hot|ripe|softened|melted|cooked|uncooked|"
    r"peeled|whole|cup|tablespoon|teaspoon|tbsp|tsp|pound|lb|ounce|oz|can|clove|package|pkg|"
    r"packet|envelope|bunch|stick|slice|stalk|head|sprig|quart|pint|gallon|gram|g|kg|ml|jar|"
    r"bottle|bag|container|inch|of|and"
)
_NUMBERS = r"[\d\s/.\u00bc-\u00be\u2150-\u215e\u2009-]+"
_AMOUNT = re.compile(rf"^(?:{_NUMBERS}|(?:{_BEFORE})(?:s|es)?\b\.?\s*)+", re.IGNORECASE)
_LONGEST = 3  # words of an ingredient
_AT_HOME = ("water", "salt", "ice")


def _recipe(data: Mapping[str, Any], number: int) -> list[Occasion]:
    """What a dish calls for; none where too little of it is understood."""
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
    return [Occasion(f"recipe-{number}", "grocery", f"make {title.lower()}", (), tuple(found))]


def _conversations(lines: Sequence[Line]) -> list[Conversation]:
    """Lines that follow one another in one conversation, together."""
    found: list[list[Line]] = []
    for line in lines:
        last = found[-1][-1] if found else None
        if last and line.context and line.context[-1] == last.message:
            found[-1].append(line)
        else:
            found.append([line])
    return [*found]


def lessons_of(
    found: Sequence[Taught],
    model: Generator,
    languages: Mapping[str, Language],
    settings: Recombined,
    *,
    known: Sequence[Taught],
) -> list[Lessons]:
    """What was read from a corpus, as lessons.

    Args:
        found: What teaches.
        model: That is taught.
        languages: What can be asked for, by domain.
        settings: How it is taught.
        known: Among these are the occasions that are looked up.
    """
    lines = [each for each in found if isinstance(each, Line)]
    talks = [each for each in found if isinstance(each, Talk)]
    needs = [each for each in found if isinstance(each, Occasion)]
    shown = {each.id: each for each in known if isinstance(each, Occasion) and each.said}
    lessons: list[Lessons] = []
    if lines:
        lessons.append(
            ReadingLessons(
                model, languages, lines, renamed=settings.renamed, joined=settings.joined
            )
        )
    if talks:
        lessons.append(TalkLessons(talks, {name: each.task for name, each in languages.items()}))
    if needs:
        lessons.append(NeedLessons(needs, [*shown.values()]))
    return lessons


def corpus_facts(found: Sequence[Taught], files: Sequence[str]) -> dict[str, Any]:
    """Of what was read from a corpus: its files, hash, and how many of what kind it holds."""
    text = "\n".join(map(repr, found))
    counts = Counter(f"{_KINDS[type(each)]}, {each.domain}" for each in found)
    return {
        "files": list(files),
        "sha256": hashlib.sha256(text.encode()).hexdigest(),
        "counts": dict(counts),
        "writers": len({each.id.rpartition("-")[0] for each in found if isinstance(each, Line)}),
    }


_KINDS = {Line: "messages", Talk: "points of talks", Occasion: "occasions"}
