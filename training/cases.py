"""Scenarios and conversations of the corpus as dialogues with a known goal among wrong ones.

python training/cases.py OUT.jsonl FOLDER... [--asides corpus/reading/train]

`goalscope fit` and `goalscope bench dialogues --jsonl` read the file. Beside the true goal stand 19
wrong ones: drawn from all of its domain, or from those that are nearest to it in meaning.

Desks of corpus/changes become what was said there first (`--said`), or dialogues in which the goal
changes, or does not. Each is drawn twice: among the desk's six goals, and among three to twenty,
some of other desks. Goals are worded as labels, as sentences, or some of each. With `--denials` the
opposite of the goal that it is about is listed, too ("do not block a card"), beside one or two
others: it is the true one where the person wants no such thing, and wrong where they do.

With `--asides` half of the scenarios go on: the person asks for things that the aim calls for, and
says what tells nothing of it ("Perfect, thanks", "buy it"), taken from messages of that corpus.
"""

from __future__ import annotations

import argparse
import json
import random
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from goalscope.agent.people import FALLBACK, OPENING
from goalscope.agent.settings import Settings
from goalscope.base.types import Goal, Turn, distinct
from goalscope.datasets.case import Case, write_cases
from goalscope.datasets.goal_sets import chance, draw
from goalscope.envs.house import HomeRobot
from goalscope.envs.registry import open_environment
from goalscope.language.orders import orders_from_text
from goalscope.models.embedding import embedded

GOALS = 20
NEAREST = 40
ANOTHER = 0.5  # cosine below which a goal is another aim
SAME = 0.9  # cosine from which two goals say the same

DENIAL = 6  # the place of a denied goal, after the six of its desk
FEW = 2  # goals beside a goal and its denial, so that these are often compared
DENYING = {"denied", "opposite", "postponed", "delegated", "done", "withdrawn"}

LONGER = 0.5  # share of scenarios that go on
MOST = 4  # turns after the first
ASIDE = 0.4  # share of these that tell nothing
NOTHING = {"yes", "no", "undo", "ask", "buy", "finish", "clear", "none"}
SHORT = 4  # words up to which what was read as nothing is taken to tell nothing
THINGS = (
    *("{}", "{} please", "I need {}", "and {}", "get me {}", "we need {}", "Could I have {}?"),
    *("some {}", "put in {}", "Then {}, please.", "oh and {}", "Do you have {}?", "add {}"),
)
ACTS = ("{}", "{} please", "Could you {}?", "Now {}.", "and {}", "Then {}, please.", "please {}")


@dataclass(frozen=True)
class Told:
    """What a person said, and their goal."""

    id: str
    group: str
    domain: str
    turns: tuple[Turn, ...]
    goal: str


def scenarios(
    row: Mapping[str, str],
    said: Sequence[str],
    needed: Sequence[str],
    asides: Mapping[str, Sequence[str]],
) -> Iterator[Told]:
    """One for each way to tell the aim."""
    id, domain = row["id"], row["domain"]
    for number, words in enumerate(said, 1):
        rng = chance(1, f"{id}-{number}")
        more = [*later(rng, domain, needed, asides[domain])] if asides else []
        turns = (Turn(OPENING, words), *(Turn(FALLBACK, each) for each in more))
        yield Told(f"{id}-{number}", id, domain, turns, row["aim"])


def later(
    rng: random.Random, domain: str, needed: Sequence[str], asides: Sequence[str]
) -> Iterator[str]:
    """What the person goes on to say."""
    if rng.random() > LONGER:
        return
    rest = rng.sample(needed, len(needed)) if domain == "grocery" else [*needed]
    for _ in range(rng.randint(1, MOST)):
        if rng.random() < ASIDE or not rest:
            yield rng.choice(asides)
        elif domain == "grocery":
            count = rng.randint(1, 3)
            yield rng.choice(THINGS).format(" and ".join(rest[:count]))
            rest = rest[count:]
        else:
            (order,) = orders_from_text(rest.pop(0), HomeRobot.verbs)
            where = f" at the {order.where}" if order.where else ""
            yield rng.choice(ACTS).format(f"{order.do} the {order.what}{where}")


def telling_nothing(folder: Path) -> dict[str, list[str]]:
    """Messages of a corpus of readings that tell nothing of an aim, by domain."""
    found: dict[str, list[str]] = defaultdict(list)
    for file in sorted(folder.glob("*.jsonl")):
        for line in file.read_text(encoding="utf-8").splitlines():
            row = json.loads(line)
            acts = {order["do"] for order in row["orders"]}
            bare = all(len(order) == 1 for order in row["orders"])
            if (
                bare
                and acts <= NOTHING
                and ("none" not in acts or len(row["message"].split()) <= SHORT)
            ):
                found[row["domain"]].append(row["message"])
    return found


def talk(points: list[dict[str, Any]]) -> Iterator[Told]:
    """The whole of it, if one aim explains it."""
    goals = [point["goals"][0] for point in points if point["goals"]]
    if not points[-1]["goals"] or min(embedded(goals) @ embedded([goals[-1]])[0]) < ANOTHER:
        return
    row = points[-1]
    turns = tuple(Turn(each["query"], each["utterance"]) for each in row["turns"])
    yield Told(row["talk"], row["talk"], row["domain"], turns, goals[-1])


def rows(folder: Path) -> Iterator[dict[str, Any]]:
    """The rows of a folder's files."""
    for file in sorted(folder.glob("*.jsonl")):
        for line in file.read_text(encoding="utf-8").splitlines():
            yield json.loads(line)


def read(folder: Path, asides: Mapping[str, Sequence[str]]) -> Iterator[Told]:
    """What the files of a folder tell."""
    talks: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows(folder):
        if "aim" in row:
            yield from scenarios(row, row["said"], row["needed"], asides)
        elif "talk" in row:
            talks[row["talk"]].append(row)
    for points in talks.values():
        yield from talk(points)


def desk_cases(desks: Sequence[Mapping[str, Any]], *, said: bool, denials: bool) -> Iterator[Case]:
    """What was said at desks whose goals are known turn by turn, or first words alone."""
    for desk in desks:
        writer = desk["id"].partition("-")[0]
        others = [
            goal for each in desks for goal in each["goals"]
            if each["id"] != desk["id"] and each["id"].partition("-")[0] == writer
        ]  # fmt: skip
        for number, (turns, truths, about) in enumerate(_at(desk, said=said, denials=denials), 1):
            own = [*desk["goals"], [f"do not {way}" for way in desk["goals"][about]]]
            for draw_ in ("few",) if denials else ("own", "others"):
                id = f"{desk['id']}-{number} {draw_}"
                rng = chance(1, id)
                true = sorted({each for each in truths if each is not None})
                both = [about, DENIAL] if denials else []
                true += [each for each in both if each not in true]
                wrong = [n for n in range(len(desk["goals"])) if n not in true]
                if draw_ != "own":
                    most = FEW if denials else len(wrong)
                    wrong = rng.sample(wrong, rng.randint(1, min(most, len(wrong))))
                ways = [own[n] for n in [*true, *wrong]]
                if draw_ == "others":
                    least = max(0, 3 - len(ways))
                    ways += rng.sample(others, rng.randint(least, GOALS - len(ways)))
                style = rng.choice((0, 0, 1, 1, 2, None))
                goals = distinct(
                    Goal(way[rng.randrange(3) if style is None else style]) for way in ways
                )
                if len(goals) < len(ways):
                    continue
                places = {each: place for place, each in enumerate(true)} | {None: None}
                order = rng.sample(range(len(goals)), len(goals))
                now = {None: None} | {place: order.index(place) for place in range(len(goals))}
                found = tuple(now[places[each]] for each in truths)
                support = tuple(goals[place] for place in order)
                changes = len({*found}) > 1 or None in found
                yield Case(
                    id, desk["id"], desk["task"], turns, support, found[-1],
                    found if changes else (),
                )  # fmt: skip


def _at(
    desk: Mapping[str, Any], *, said: bool, denials: bool
) -> Iterator[tuple[tuple[Turn, ...], list[int | None], int]]:
    """Turns, the index of the true goal after each, and of the goal that they are about.

    With `denials`, a goal that the person does not want makes `DENIAL` true in place of none.
    """
    if said:
        for each in desk["said"]:
            yield (Turn(OPENING, each["utterance"]),), [each["true"]], each["true"]
        return
    dialogues = desk["dialogues"]
    for number, each in enumerate(dialogues):
        control = next((row for row in dialogues[number : number + 2] if row["control"]), each)
        listed = [place for place in (*each["true"], *control["true"]) if place is not None]
        if denials and not listed:
            continue
        denied = DENIAL if denials and each["kind"] in DENYING and not each["control"] else None
        queries = [
            turn["query"] or (FALLBACK if n else OPENING) for n, turn in enumerate(each["turns"])
        ]
        yield (
            tuple(Turn(query, turn["utterance"])
                  for query, turn in zip(queries, each["turns"], strict=True)),
            [denied if place is None else place for place in each["true"]],
            next(iter(listed), 0),
        )  # fmt: skip


def cases(told: list[Told]) -> Iterator[Case]:
    """Each with two draws of wrong goals."""
    tasks = {
        name: open_environment(Settings(domain=name, scene=None)).task
        for name in ("grocery", "house")
    }
    for domain in sorted({each.domain for each in told}):
        own = [each for each in told if each.domain == domain]
        goals = sorted({each.goal for each in own})
        if len(goals) <= GOALS:
            continue
        task = tasks.get(domain) or f"The agent is an assistant for {domain}."
        vectors = embedded(goals)
        near = vectors @ vectors.T
        place = {goal: number for number, goal in enumerate(goals)}
        for each in own:
            like = near[place[each.goal]]
            others = [n for n in np.argsort(-like, kind="stable") if like[n] < SAME]
            for set, tiers in (("random", [others]), ("hard", [others[:NEAREST]])):
                id = f"{each.id} {set}"
                drawn = draw(
                    chance(1, id), each.goal, [[goals[n] for n in tier] for tier in tiers], GOALS
                )
                if drawn:
                    yield Case(id, each.group, task, each.turns, *drawn)


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("folder", type=Path, nargs="+")
    parser.add_argument("--asides", type=Path)
    parser.add_argument("--said", action="store_true")
    parser.add_argument("--denials", action="store_true")
    asked = parser.parse_args()
    asides = telling_nothing(asked.asides) if asked.asides else {}
    told = [each for folder in asked.folder for each in read(folder, asides)]
    desks = [row for folder in asked.folder for row in rows(folder) if "desk" in row]
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    write_cases(
        [*cases(told), *desk_cases(desks, said=asked.said, denials=asked.denials)], asked.out
    )


if __name__ == "__main__":
    main()
