"""Readers of public dialogues with desks and services, whose goals are intents.

Each works as those in `goalscope.datasets.loaders`. The goal set "terse" words goals as a developer
would label them ("report lost card"), the others as sentences.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from goalscope.base.inputs import read_table
from goalscope.base.types import Goal, Turn, canonical
from goalscope.datasets.case import OPENING, Case
from goalscope.datasets.files import Row, line_rows
from goalscope.datasets.goal_sets import chance, draw, drawn_case

SERVICES = "Help the human with bookings, money, media and other services."

_SLOTS = 4  # of a goal, the newest; more are seldom said in one breath


@dataclass(slots=True)
class _Part:
    """Turns in a row in which a person wants one thing; `does` says what the intent is."""

    service: str
    intent: str
    does: str
    slots: dict[str, str]
    turns: int = 1

    def text(self, goal_set: str) -> str:
        """The goal."""
        if goal_set == "terse":
            return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", self.intent).lower()
        told = [f"{key.replace('_', ' ')}: {value}" for key, value in self.slots.items()][-_SLOTS:]
        return f"{self.does} ({'; '.join(told)})" if told else self.does


def sgd(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """Dialogues in the order of the file, in which people go on to other goals.

    A goal is an intent with the slots that it has in the end ("random" and "hard"), or the intent
    alone ("terse"). It becomes another one where the state says so, or where a slot changes its
    value. "random" draws wrong goals from those of other dialogues, "hard" first from those of the
    same services.
    """
    read = [(row.text("id"), *_parts(row)) for row in line_rows(file)]
    of_service: dict[str, set[str]] = {}
    for _, _, parts in read:
        for part in parts:
            of_service.setdefault(part.service, set()).add(part.text(goal_set))
    every = sorted(set[str]().union(*of_service.values()))
    for id, turns, parts in read:
        if not parts:
            yield "no intent"
            continue
        texts = [part.text(goal_set) for part in parts]
        near = sorted({text for part in parts for text in of_service[part.service]})
        tiers = [near, every] if goal_set == "hard" else [every]
        rng = chance(seed, id)
        own = [*{canonical(text): text for text in reversed(texts)}.values()]
        drawn = draw(rng, own[0], [own[1:], *tiers], goals)
        if drawn is None or len(own) > goals:
            yield f"fewer than {goals} goals to choose from, or more in the dialogue"
            continue
        support, _ = drawn
        keys = [canonical(goal.text) for goal in support]
        truths = tuple(
            keys.index(canonical(text))
            for text, part in zip(texts, parts, strict=True)
            for _ in range(part.turns)
        )
        yield Case(id, id, SERVICES, turns[: len(truths)], support, truths[-1], truths)


def _parts(row: Row) -> tuple[tuple[Turn, ...], list[_Part]]:
    turns: list[Turn] = []
    found: list[_Part] = []
    before: dict[str, tuple[str, dict[str, str]]] = {}
    for turn in row.rows("turns"):
        frames = [
            _Part(
                frame.text("service"),
                frame.text("intent"),
                frame.text("does"),
                {key: str(value) for key, value in frame.row("slots").values.items()},
            )
            for frame in turn.rows("state")
        ]
        if not frames and not found:
            return (), []
        query = turn.text("query", empty=True) or OPENING
        turns.append(Turn(query, turn.text("utterance")))
        if not frames:
            found[-1].turns += 1
            continue
        # With two services at once, the person goes on to the other one.
        changed = [each for each in frames if before.get(each.service) != (each.intent, each.slots)]
        others = [each for each in changed if found and each.service != found[-1].service]
        part = next(iter([*others, *changed, *frames]))
        before = {each.service: (each.intent, each.slots) for each in frames}
        last = found[-1] if found else None
        same = last and (last.service, last.intent) == (part.service, part.intent)
        if last and same and not _conflict(last.slots, part.slots):
            part.turns += last.turns
            found[-1] = part
        else:
            found.append(part)
    return tuple(turns), found


def _conflict(before: Mapping[str, str], after: Mapping[str, str]) -> bool:
    """Whether a slot has another value, and none that says the same in more or fewer words."""
    return any(
        not {*re.findall(r"\w+", before[key].casefold())}
        & {*re.findall(r"\w+", after[key].casefold())}
        for key in before.keys() & after.keys()
    )


def _intents() -> Mapping[str, Any]:
    """The meaning of intents, by set and desk."""
    return read_table(resources.files("goalscope.datasets") / "goals.toml")


def multidogo(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """Dialogues with one desk, up to the turn before a second intent comes up.

    The goals are all intents of the four desks, of which `goals` are drawn: those of the same desk
    first. The file does not hold what the desk said.
    """
    domain = file.name.split("_")[1]
    table = _intents()["multidogo"]
    own = table[domain]
    names = {
        intent: text if goal_set == "full" else _SPACED.get(intent) or intent.removesuffix("intent")
        for each in table.values()
        for intent, text in each.items()
        if intent != "task"
    }
    for row in line_rows(file):
        id, turns, intent = row.text("id"), list[Turn](), ""
        for turn in row.rows("turns"):
            told = [each for each in turn.texts("intents") if each in own and each != "task"]
            if len({*told} | ({intent} - {""})) > 1:
                break
            intent = intent or (told[0] if told else "")
            if words := turn.text("utterance", empty=True):
                turns.append(Turn("" if turns else OPENING, words))
        if not intent or not turns:
            yield "no goal, or two at once"
            continue
        near = [names[each] for each in own if each != "task"]
        tiers = [near, [*names.values()]]
        yield drawn_case(
            id, own["task"], tuple(turns), chance(seed, id), names[intent], tiers, goals
        )


_SPACED = {
    "".join(words.split()): words
    for words in (
        *("book flight", "change seat assignment", "get seat info", "get boarding pass"),
        *("check balance", "transfer money", "report lost card", "replace card", "update address"),
        *("dispute charge", "close account", "get routing number", "order checks"),
        *("check offer eligibility", "start order", "change order", "stop order"),
        *("report broken software", "software update", "check server status", "expense report"),
        *("provide receipt", "get promotions"),
    )
} | {
    f"order{what}intent": f"order {what}"
    for what in ("pizza", "burger", "salad", "drink", "dessert", "side", "breakfast")
}
"""Such as "report lost card" for "reportlostcard"."""


def hint3(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """One message each to a shop's chatbot; the goal of more than a third is not listed.

    The goals are the shop's intents, of which `goals` are drawn. The file goes by intents, so the
    seed puts the messages in another order: the first ones are a fair sample.
    """
    shop = file.name.removeprefix("hint3_").partition(".")[0]
    own = dict(_intents()["hint3"][shop])
    task = own.pop("task")
    names = own if goal_set == "full" else {intent: intent for intent in own}
    every, count = [*names.values()], min(goals, len(names))
    rows = {f"{shop}-{number}": row for number, row in enumerate(line_rows(file), 1)}
    for id in sorted(rows, key=lambda id: chance(seed, f"place of {id}").random()):
        row, rng = rows[id], chance(seed, id)
        if not (words := row.text("utterance", empty=True)):
            yield "no words"
            continue
        turns = (Turn(OPENING, words),)
        if row.values.get("intent") is None:
            support = tuple(map(Goal, rng.sample(every, count)))
            yield Case(id, id, task, turns, support, None, (None,))
        else:
            yield drawn_case(id, task, turns, rng, names[row.text("intent")], [every], count)
