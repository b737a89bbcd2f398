"""Readers of public dialogues: a function for each set, which yields cases.

Each reads a split's file and takes the way to draw wrong goals ("random" or "hard"), the number of
goals of a case, and a seed. In place of a dialogue that is left out it yields the reason. It raises
`InvalidInputError` with the place where the file is broken.
"""

from __future__ import annotations

import difflib
import json
import random
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import permutations
from pathlib import Path

from goalscope.base.inputs import shown
from goalscope.base.types import Goal, InvalidInputError, Turn, canonical
from goalscope.datasets.case import OPENING, Case, turns_of
from goalscope.datasets.files import Row, json_rows, line_rows
from goalscope.datasets.goal_sets import by_shared_words, chance, drawn_case

HOUSEHOLD = "Do a household task in this room for the human."


def teach(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """Games in the order of the file; instead of one that is left out, the reason.

    Many games share a goal text. "random" draws from the other texts of the file; "hard" first from
    those of the same task with other parameters, then from those that share the most words.
    """
    games = [
        (row.text("game_id"), row.text("task_name"), row.text("desc"), tuple(
            (each.text("agent") == "commander", each.text("utterance", empty=True))
            for each in row.rows("interactions") if "utterance" in each.values
        ))
        for row in line_rows(file)
    ]  # fmt: skip
    every = sorted({goal for _, _, goal, _ in games})
    of_task: dict[str, set[str]] = {}
    for _, name, goal, _ in games:
        of_task.setdefault(name, set()).add(goal)
    for id, name, goal, said in games:
        turns = turns_of(said)
        if not turns:
            yield "the commander says nothing"
            continue
        tiers = [every]
        if goal_set == "hard":
            tiers = [sorted(of_task[name]), *by_shared_words(goal, every)]
        yield drawn_case(id, HOUSEHOLD, turns, chance(seed, id), goal, tiers, goals)


_Plan = tuple[str, ...]  # the type of the task, then what it is done with


def alfred(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """One turn for each trajectory; instead of one that is left out, the reason.

    The file goes by the type of the task, so the seed puts the trajectories in another order: the
    first ones are a fair sample. What belongs to one plan is one group, as it shares its meaning.

    One sentence is what the person says, another one of the same trajectory the true goal. The
    wrong goals are sentences for other plans, no two for one plan, and never a text that somebody
    said for the true plan. "hard" takes plans of the same type that differ in one thing, then
    in two, and so on, and then other types. Plans that differ in the lamp alone are one: people
    just say "lamp".
    """
    trajectories = [(row.text("task_id"), _plan(row), _sentences(row)) for row in line_rows(file)]
    gathered: dict[_Plan, dict[str, str]] = {}
    for _, plan, sentences in trajectories:
        for key, text in sentences.items():
            own = gathered.setdefault(plan, {})
            own[key] = min(text, own.get(key, text))
    said = {plan: dict(sorted(gathered[plan].items())) for plan in sorted(gathered)}
    tiers = {plan: _tiers(plan, said, goal_set) for plan in said}
    # Where a trajectory stands does not depend on the others.
    places = {id: (chance(seed, f"place of {id}").random(), id) for id, _, _ in trajectories}
    for id, plan, sentences in sorted(trajectories, key=lambda each: places[each[0]]):
        if len(sentences) < 2:
            yield "fewer than two different sentences"
            continue
        rng = chance(seed, id)
        words, goal = rng.sample(list(sentences.values()), 2)
        wrong = (_one_each(rng, tier, said, said[plan], 2 * goals) for tier in tiers[plan])
        turns, group = (Turn(OPENING, words),), "|".join(plan)
        yield drawn_case(id, HOUSEHOLD, turns, rng, goal, wrong, goals, group=group)


def _plan(row: Row) -> _Plan:
    parameters = row.row("pddl_params")
    keys = ("object_target", "mrecep_target", "parent_target")
    return (
        row.text("task_type"),
        *(parameters.text(key, empty=True) for key in keys),
        "sliced" if parameters.values.get("object_sliced") else "",
    )


def _sentences(row: Row) -> dict[str, str]:
    texts = (person.text("task_desc", empty=True) for person in row.rows("anns"))
    return {canonical(text): text for text in texts if canonical(text)}


def _tiers(plan: _Plan, plans: Iterable[_Plan], goal_set: str) -> list[list[_Plan]]:
    if goal_set == "random":
        return [[other for other in plans if other != plan]]
    tiers: list[list[_Plan]] = [[] for _ in range(len(plan) + 1)]
    for other in plans:
        apart = sum(a != b for a, b in zip(plan, other, strict=True))
        tiers[apart if plan[0] == other[0] else -1].append(other)
    return tiers[1:]


def _one_each(
    rng: random.Random,
    plans: list[_Plan],
    said: Mapping[_Plan, Mapping[str, str]],
    taken: Mapping[str, str],
    most: int,
) -> list[str]:
    """A sentence for each of at most so many plans, none of them among those taken."""
    found: list[str] = []
    for plan in rng.sample(plans, min(len(plans), most)):
        if texts := [text for key, text in said[plan].items() if key not in taken]:
            found.append(rng.choice(texts))
    return found


CAMPING = "Negotiate with the human, a fellow camper, over packages of food, water and firewood."

_GREETING = "Hello!"
_ISSUES: tuple[str, ...] = ("Food", "Water", "Firewood")
_NO_WORDS = frozenset({"Submit-Deal", "Accept-Deal", "Reject-Deal", "Walk-Away"})


def casino(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """Two cases of one group for each dialogue: what either camper ranks highest.

    The goals are all six rankings, whatever `goals` asks for; dialogues gave people each ranking
    with the same chance.
    """
    rankings: dict[tuple[str, ...], Goal] = {
        (high, medium, low): Goal(
            f"Get packages of {high.lower()} above all, then {medium.lower()}; "
            f"{low.lower()} matters least."
        )
        for high, medium, low in permutations(_ISSUES)
    }
    for row in json_rows(file):
        number = row.values.get("dialogue_id")
        group = str(number if isinstance(number, int | str) else row.text("dialogue_id"))
        log = [
            (entry.text("id"), entry.text("text", empty=True)) for entry in row.rows("chat_logs")
        ]
        people = row.row("participant_info")
        for person in people.values:
            values = people.row(person).row("value2issue")
            order = tuple(values.text(rank) for rank in ("High", "Medium", "Low"))
            if order not in rankings:
                raise InvalidInputError(
                    f"{values.label}: expected a ranking of {', '.join(_ISSUES)}, "
                    f"got {shown(order)}."
                )
            said = [(who == person, text) for who, text in log if text not in _NO_WORDS]
            turns = turns_of(said, _GREETING)
            if not turns:
                yield "a camper says nothing"
                continue
            id = f"{group}-{person}"
            support = list(rankings.values())
            chance(seed, id).shuffle(support)
            yield Case(id, group, CAMPING, turns, tuple(support), support.index(rankings[order]))


CAMBRIDGE = "Help the human to find and book places and transport in and around Cambridge."


def multiwoz(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """Dialogues in the order of the file; instead of one that is left out, the reason.

    "random" draws from the goals of all other dialogues, "hard" from those with the very same
    domains; a dialogue whose domains give too few is left out of "hard".
    """
    rows = list(json_rows(file, member=file.name.removesuffix(".zip")))
    messages: list[str] = []
    domains: list[frozenset[str]] = []
    alike: dict[frozenset[str], set[str]] = {}
    for row in rows:
        goal = row.row("goal")
        messages.append(_message(goal))
        domains.append(
            frozenset(key for key, value in goal.values.items() if value and key not in _NO_DOMAINS)
        )
        if messages[-1]:
            alike.setdefault(domains[-1], set()).add(messages[-1])
    every = sorted({message for message in messages if message})
    ordered = {key: sorted(texts) for key, texts in alike.items()}
    for row, message, own in zip(rows, messages, domains, strict=True):
        # the person speaks first, and then the two alternate
        said = [
            (number % 2 == 0, detokenised(entry.text("text", empty=True)))
            for number, entry in enumerate(row.rows("log"))
        ]
        turns, id = turns_of(said), row.text("id")
        if not message or not turns:
            yield "no goal, or no words of the person"
            continue
        tier = every if goal_set == "random" else ordered[own]
        yield drawn_case(id, CAMBRIDGE, turns, chance(seed, id), message, [tier], goals)


_NO_DOMAINS = ("message", "topic")


def _message(goal: Row) -> str:
    """What the person was told to look for; the sentences are a list, and some have none."""
    match goal.values.get("message"):
        case None | []:
            return ""
        case str():
            text = goal.text("message", empty=True)
        case _:
            text = ". ".join(goal.texts("message"))
    return detokenised(re.sub(r"<[^>]*>", "", text))


def detokenised(text: str) -> str:
    """Text without the spaces that a tokeniser put before punctuation and clitics."""
    text = re.sub(r"\s+([.,?!:;)])", r"\1", text)
    text = re.sub(r"\s+(n't|'(?:s|m|re|ve|ll|d))\b", r"\1", text, flags=re.IGNORECASE)
    return re.sub(r"\s+", " ", text.replace("( ", "(")).strip()


COFFEE = "Take the human's order at a coffee bar."

_CHANGED = ("temperature", "caffeine", "shots", "drink", "milk")
_ATTRIBUTES = (*_CHANGED, "extras", "note")
_WORDS = {
    "temperature": {"iced", "cold", "hot", "warm", "extra hot"},
    "caffeine": {"decaf", "half-caf", "half caf", "caffeinated"},
    "shots": {"single", "double", "triple", "quadruple"},
}
_USUAL = 3  # a spelling that occurs so often is no slip

_Item = tuple[str, ...]  # a value for each attribute, "" for none
_Order = tuple[_Item, ...]


def taskmaster(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """Dialogues in the order of the file; instead of one that is left out, the reason.

    The goal is the final order in a sentence of ours, in the usual spelling of each name. "random"
    draws from other people's orders. "hard" changes exactly one attribute of one item (drink, milk,
    temperature, caffeine, shots) to another value of the file or to none, each attribute as
    often as the others. It leaves out orders with a note or another extra, which can say the same
    as an attribute ("double shot") or be no wish at all (a name), so that a changed order could be
    as true; and it adds none, as orders leave out most of the syrups that people ask for.
    """
    rows = list(line_rows(file))
    whole = [row for row in rows if "var_" not in json.dumps(row.values)]
    yield from ["a blank in the template was never filled (var_)"] * (len(rows) - len(whole))
    orders = _orders(whole)
    every = sorted({_order_text(order) for order in orders})
    values = {
        name: sorted({item[at] for order in orders for item in order} - {""})
        for at, name in enumerate(_CHANGED)
    }
    for row, order in zip(whole, orders, strict=True):
        id, turns = row.text("id"), turns_of(_said(row))
        if not turns or not order:
            yield "no order, or no words of the customer"
            continue
        if goal_set == "hard" and any(item[len(_CHANGED) :] != ("", "") for item in order):
            yield "a note or an extra, which other attributes could contradict or repeat"
            continue
        rng = chance(seed, id)
        tiers = [every] if goal_set == "random" else _one_change(rng, order, values)
        yield drawn_case(id, COFFEE, turns, rng, _order_text(order), tiers, goals)


def _said(row: Row) -> Iterator[tuple[bool, str]]:
    for number, turn in enumerate(row.entries("turns"), 1):
        match turn:
            case [str(speaker), str(text)] if speaker in ("user", "assistant"):
                said = Row(f"{row.label}, turn {number}", {"text": text})
                yield speaker == "user", said.text("text", empty=True)
            case _:
                raise InvalidInputError(
                    f'{row.label}, turn {number}: expected ["user" or "assistant", text], '
                    f"got {shown(turn)}."
                )


def _orders(rows: Sequence[Row]) -> list[_Order]:
    read = [
        [
            (
                _plain(item.text("drink")),
                [_plain(option) for option in item.texts("options")],
                _plain(item.text("notes", empty=True)) if item.values.get("notes") else "",
            )
            for item in row.rows("order_items")
        ]
        for row in rows
    ]
    items = [item for order in read for item in order]
    drinks = _usual(drink for drink, _, _ in items)
    options = _usual(option for _, options, _ in items for option in options)
    notes = _usual(note for _, _, note in items if note)
    return [
        tuple(
            _item(drinks[drink], [options[option] for option in given], notes.get(note, ""))
            for drink, given, note in order
        )
        for order in read
    ]


def _item(drink: str, options: Iterable[str], note: str) -> _Item:
    values = dict.fromkeys(_ATTRIBUTES, "") | {"drink": drink, "note": note}
    for option in sorted(set(options)):
        of = [name for name, words in _WORDS.items() if option in words]
        name = of[0] if of else "milk" if option.endswith("milk") else "extras"
        values[name] = f"{values[name]} and {option}" if values[name] else option
    return tuple(values.values())


def _plain(text: str) -> str:
    """Lower case, without what stands in brackets and marks around it."""
    words = " ".join(text.casefold().split())
    return re.sub(r"\s*\([^)]*(\)|$)", "", words).strip(" -.?!") or words


def _usual(names: Iterable[str]) -> dict[str, str]:
    """The usual spelling of each name: the nearest one, or the longest that it contains."""
    counts = Counter(names)
    usual = sorted(name for name, count in counts.items() if count >= _USUAL)

    def known(name: str) -> str:
        if name in usual:
            return name
        if near := difflib.get_close_matches(name, usual, 1, 0.8):
            return near[0]
        within = [each for each in usual if re.search(rf"(?<!\w){re.escape(each)}(?!\w)", name)]
        return max(within, key=len, default=name)

    return {name: known(name) for name in counts}


def _one_change(
    rng: random.Random, order: _Order, values: Mapping[str, Sequence[str]]
) -> Iterator[list[str]]:
    """Sentences for other orders, one by one, with a different attribute each time around."""
    changes: dict[str, list[str]] = {}
    seen = {tuple(sorted(order))}
    for at, name in enumerate(_CHANGED):
        found = changes.setdefault(name, [])
        for place, item in enumerate(order):
            others = [*values[name], *([""] if name != "drink" else [])]
            for value in others:
                changed = (*item[:at], value, *item[at + 1 :])
                other = (*order[:place], changed, *order[place + 1 :])
                if (key := tuple(sorted(other))) not in seen:
                    seen.add(key)
                    found.append(_order_text(other))
        rng.shuffle(found)
    while left := [found for found in changes.values() if found]:
        rng.shuffle(left)
        yield from ([found.pop()] for found in left)


def _order_text(order: _Order) -> str:
    """Such as "Order iced decaf mocha with oat milk (note: extra foam), and latte."."""
    told: list[str] = []
    for item in order:
        temperature, caffeine, shots, drink, milk, extras, note = item
        words = " ".join(word for word in (temperature, caffeine, shots, drink) if word)
        words += f" with {milk}" if milk else ""
        words += f", {extras}" if extras else ""
        told.append(words + (f" (note: {note})" if note else ""))
    return f"Order {', and '.join(told)}."
