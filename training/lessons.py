"""Lessons for a model that writes: prompts with the right answers, redrawn in each epoch.

Messages are recombined, which teaches a reader to copy what was said rather than guess what is
usual (Jia & Liang, 2016: "Data Recombination for Neural Semantic Parsing").
"""

from __future__ import annotations

import random
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from corpus import Entry, Talk
from goalscope.agent.writer import JUDGEMENTS, NOTHING
from goalscope.base.nouns import singulars
from goalscope.base.types import Message
from goalscope.envs.scenarios import Scenario
from goalscope.experiment.reading_scores import Language, Line
from goalscope.language.amounts import figures
from goalscope.language.dialogue_state import acting
from goalscope.language.orders import speaks, words_of
from goalscope.language.reader import Reader, ReadExample
from goalscope.models import Generator
from goalscope.models.nearest import Nearest
from goalscope.prompts import render

RENAMED = 0.4
"""Share of the things in a message that are replaced."""
JOINED = 0.1
"""Share of conversations that start with another conversation's first message."""

_LIKE = 4
"""Number of scenarios in the prompt that asks what an aim calls for."""
_NEGATIVES = (("near", 5), ("any", 2))
_POSITIVES = 8


@dataclass(frozen=True, slots=True)
class Lesson:
    """A prompt and the right answer; `kind` is the skill that it teaches."""

    kind: str
    prompt: Sequence[Message]
    answer: str


Draw = Callable[[random.Random], list[Lesson]]
"""Draws the lessons of one conversation or scenario; they share prefixes."""

Conversation = Sequence[Line]
"""Lines of one person, each with the previous ones as its context."""


def lessons_of(
    found: Sequence[Entry],
    model: Generator,
    languages: Mapping[str, Language],
    *,
    known: Sequence[Entry],
) -> list[Draw]:
    """The lessons of a corpus.

    Args:
        found: The entries of the corpus.
        model: The model to teach.
        languages: The verbs, by domain.
        known: The scenarios to look up.
    """
    lines = [each for each in found if isinstance(each, Line)]
    talks = [each for each in found if isinstance(each, Talk)]
    needs = [each for each in found if isinstance(each, Scenario)]
    shown = {each.id: each for each in known if isinstance(each, Scenario) and each.said}
    return [
        *_reading_lessons(lines, model, languages),
        *(partial(_talk_lessons, talk, _task(talk.domain, languages)) for talk in talks),
        *_need_lessons(needs, [*shown.values()]),
    ]


def _task(domain: str, languages: Mapping[str, Language]) -> str:
    language = languages.get(domain)
    return (language and language.task) or f"The agent is an assistant for {domain}."


def _talk_lessons(talk: Talk, task: str, draw: random.Random) -> list[Lesson]:
    """Lessons on the goals at a point of a conversation, and the next question."""
    goals = [*talk.goals]
    if len(goals) > 1 and draw.random() < 0.3:  # another order of the same goals, as may come later
        draw.shuffle(goals)
    named = render("write_goals", task=task, turns=talk.turns)
    question = render("write_question", task=task, turns=talk.turns, done=talk.done, goals=goals)
    return [
        Lesson("goals", named, "\n".join(talk.goals) or NOTHING),
        Lesson("question", question, talk.question or NOTHING),
    ]


def _need_lessons(scenarios: Sequence[Scenario], known: Sequence[Scenario]) -> list[Draw]:
    """Lessons on what aims need, with the nearest scenarios in the prompt."""
    found: list[Draw] = []
    nearest: dict[str, Nearest[Scenario]] = {}
    things: dict[str, list[str]] = {}
    for each in scenarios:
        if each.domain not in nearest:
            near = Nearest([other for other in known if other.domain == each.domain])
            nearest[each.domain] = near
            things[each.domain] = sorted(
                {thing for other in near.things for thing in other.needed + other.nice}
            )
        found.append(partial(_need_lesson, each, nearest[each.domain], things[each.domain]))
    return found


def _need_lesson(
    each: Scenario, nearest: Nearest[Scenario], things: Sequence[str], draw: random.Random
) -> list[Lesson]:
    said = draw.choice(each.said) if each.said and draw.random() < 0.8 else ""
    aim = each.aim if not said or draw.random() < 0.75 else ""
    like = nearest(f"{said} {aim}".strip(), _LIKE, without=each)
    if draw.random() < 0.1:
        like = []
    told = {"aim": aim, "said": said, "like": like, "room": each.room}
    lists = zip(JUDGEMENTS, (each.needed, each.nice), strict=False)
    written = "\n".join(f"{head}: {', '.join(some)}" for head, some in lists if some)
    return [
        Lesson("needs", render("write_needs", **told, thing=""), written),
        *(
            Lesson("judging", render("write_needs", **told, thing=thing), label)
            for thing, label in _judgements(each, like, things, draw)
        ),
    ]


def _judgements(
    each: Scenario, like: Sequence[Scenario], things: Sequence[str], draw: random.Random
) -> Iterator[tuple[str, str]]:
    """Things, and how an aim needs them."""
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
    pools = {"near": sorted(near), "any": things}
    for name, count in _NEGATIVES:
        for thing in draw.sample(pools[name], min(count, len(pools[name]))):
            stem = singulars(thing)
            if thing not in each.unwanted and not (stem and stem[-1] in words):
                yield thing, unwanted


def _reading_lessons(
    lines: Sequence[Line], model: Generator, languages: Mapping[str, Language]
) -> list[Draw]:
    """Lessons on the orders of each message, in recombined conversations."""
    if not lines:
        return []
    readers = {name: Reader(model, each.verbs, taught=True) for name, each in languages.items()}
    conversations = _conversations(lines)
    recombine = Recombining(conversations)
    return [
        partial(_reading_lesson, each, recombine, readers[each[0].domain]) for each in conversations
    ]


def _reading_lesson(
    conversation: Conversation, recombine: Recombining, reader: Reader, draw: random.Random
) -> list[Lesson]:
    before: list[ReadExample] = []
    found: list[Lesson] = []
    for line in recombine(conversation, draw):
        prompt = reader.prompt(line.message, question=line.question, before=before, here=line.here)
        # Numbers in names are as the reader is shown them.
        orders = tuple(order.reworded(figures) for order in line.orders)
        found.append(Lesson("reading", prompt, reader.written(orders)))
        before.append(ReadExample(line.question, line.message, orders))
    return found


def _conversations(lines: Sequence[Line]) -> list[Conversation]:
    """Lines grouped by conversation, in order."""
    found: list[list[Line]] = []
    for line in lines:
        if found and line.before == found[-1][-1]:
            found[-1].append(line)
        else:
            found.append([line])
    return [*found]


class Recombining:
    """Draws variants of conversations: about other things, and with merged messages.

    Args:
        corpus: Conversations to draw things and first messages from.
    """

    def __init__(self, corpus: Sequence[Conversation]) -> None:
        things = defaultdict[tuple[str, str, bool], dict[str, None]](dict)
        self._first = defaultdict[str, list[Line]](list)
        for conversation in corpus:
            line = conversation[0]
            if not line.question and all(each.do != "undo" for each in line.orders):
                self._first[line.domain].append(line)
            for what, kind in _named_things(conversation):
                things[kind][what] = None
        self._things = {kind: [*names] for kind, names in things.items()}

    def __call__(self, conversation: Conversation, draw: random.Random) -> Conversation:
        """A variant of a conversation, often the conversation itself."""
        for what, kind in dict(_named_things(conversation)).items():
            if draw.random() < RENAMED:
                other = draw.choice(self._things[kind])
                if _only_in_full(what, conversation) and not _shares(other, conversation):
                    conversation = [_renamed(line, what, other) for line in conversation]
        if draw.random() < JOINED:
            conversation = self._joined(conversation, draw)
        return conversation

    def _joined(self, conversation: Conversation, draw: random.Random) -> Conversation:
        first, *rest = conversation
        others = self._first[first.domain]
        if first.question or not others or not any(map(speaks, first.orders)):
            return conversation
        other = draw.choice(others)
        spoken = tuple(each for each in (*other.orders, *first.orders) if each.do != "none")
        end = "" if other.message[-1:] in ".!?," else draw.choice((".", ",", " and", ""))
        message = f"{other.message}{end} {first.message}"
        return [replace(first, message=message, orders=tuple(dict.fromkeys(spoken))), *rest]


def _named_things(conversation: Conversation) -> Iterator[tuple[str, tuple[str, str, bool]]]:
    """The things that orders name, each with the kind of thing that may replace it."""
    for line in conversation:
        for order in acting(line.orders):
            if order.what:
                yield order.what, (line.domain, order.do, order.what.endswith("s"))


def _texts(line: Line) -> list[str]:
    slots = (text for each in line.orders for text in each.phrases)
    return [line.message, line.question, line.here, *filter(None, slots)]


def _only_in_full(what: str, conversation: Conversation) -> bool:
    """Whether a thing was said, and its last word occurs only in its whole name."""
    said = any(_named(what).search(line.message) for line in conversation)
    rest = " ".join(_named(what).sub(" ", text) for each in conversation for text in _texts(each))
    last = words_of(what)[-1:]
    return said and bool(last) and not any(word.startswith(last[0][:4]) for word in words_of(rest))


def _shares(what: str, conversation: Conversation) -> bool:
    """Whether a thing shares a word with a conversation."""
    said = {word for line in conversation for text in _texts(line) for word in words_of(text)}
    return not said.isdisjoint(words_of(what))


def _named(what: str) -> re.Pattern[str]:
    return re.compile(rf"(?<!\w){re.escape(what)}(?!\w)", re.IGNORECASE)


def _renamed(line: Line, what: str, other: str) -> Line:
    def renamed(text: str) -> str:
        return _named(what).sub(lambda _: other, text)

    return replace(
        line,
        message=renamed(line.message),
        question=renamed(line.question),
        here=renamed(line.here),
        orders=tuple(order.reworded(renamed) for order in line.orders),
    )
