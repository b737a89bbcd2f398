"""What the hand-written patterns read of a corpus, beside which the reader is measured.

`python benchmarks/reading_patterns.py FILE.jsonl`. The patterns speak of what is wanted in the
end and of types of objects, so they are judged generously: a thing that shares its last word with
the right one counts as the right one, and so does any quantity of their own counting.
"""

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path

from goalscope.benchmarks.reading import read_corpus, score
from goalscope.envs.grocery import Catalogue
from goalscope.envs.grocery.hearing.hear import hear
from goalscope.envs.grocery.hearing.limits import budget
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.envs.house.hearing.completion import completes
from goalscope.envs.house.names import readable
from goalscope.envs.speech import agrees, declines, is_question
from goalscope.envs.undoing import undoes
from goalscope.orders import Order, words_of
from goalscope.types import Turn

NAMES = Catalogue.load(None).names
ROBOTS = [HomeRobot(HouseController(name)) for name in ("Kitchen1", "LivingRoom1")]


def shop(said: list[str]) -> list[Order]:
    now, before = hear(said, NAMES), hear(said[:-1], NAMES)
    found: list[Order] = []
    for each in now.newest:
        if each.replaces:
            found += [Order("swap", old, for_=each.phrase) for old in each.replaces]
        else:
            verb = "set" if "set" in str(each.change) or "exact" in str(each.change) else "add"
            found.append(Order(verb, each.phrase, float(each.quantity)))
    found += [Order("remove", each.phrase) for each in now.removed]
    refused = [each for each in now.refused if each not in before.refused]
    gone = {each.phrase for each in now.removed}
    found += [Order("avoid", each) for each in refused if each not in gone]
    found += [Order("only", each) for each in now.diets - before.diets]
    found += [Order("leave", each) for each in now.kept if each not in before.kept]
    if (most := budget(said[-1])) is not None:
        found.append(Order("budget", quantity=float(most)))
    return found + ([Order("clear")] if now.empties else [])


def house(said: list[str]) -> list[Order]:
    best: list[Order] = []
    for robot in ROBOTS:
        hearing = robot._hear([Turn("", each) for each in said])
        found = [
            Order(
                each.verb,
                each.name or readable(each.object_types[0]),
                float(each.number) or None,
                where=each.destination_name or " ".join(map(readable, each.destination_types[:1])),
            )
            for each in hearing.newest
        ]
        best = max(best, found, key=len)
    return best + ([Order("finish")] if completes(said[-1]) else [])


def read(domain: str, said: list[str]) -> list[Order]:
    message = said[-1]
    undoing = undoes(message)
    if undoing and undoing.number:
        return [Order("undo", quantity=float(undoing.number) if undoing.number > 1 else None)]
    found = shop(said) if domain == "grocery" else house(said)
    if not found and is_question(message):
        return [Order("ask")]
    if not found and (agrees(message) or declines(message)):
        return [Order("none")]
    if domain == "grocery" and "buy the basket" in message.casefold():
        found.append(Order("buy"))
    return found


def like(order: Order, right: tuple[Order, ...]) -> Order:
    """The same with the right one's wording, where they mean one thing."""
    for each in right:
        mine, theirs = words_of(order.what), words_of(each.what)
        if (
            mine
            and theirs
            and order.do == each.do
            and mine[-1].rstrip("s") == theirs[-1].rstrip("s")
        ):
            return replace(each, if_=order.if_ or each.if_)
        if not mine and not theirs and order.do == each.do:
            return each
    return order


def main() -> None:
    lines = [each for each in read_corpus(Path(sys.argv[1])) if each.domain in ("grocery", "house")]
    for domain in ("grocery", "house"):
        pairs = []
        for line in lines:
            if line.domain == domain:
                try:
                    found = read(domain, [*line.context, line.message])
                except Exception as error:
                    print(line.id, repr(error), file=sys.stderr)
                    found = []
                pairs.append((line.orders, [like(each, line.orders) for each in found]))
        if pairs:
            print(json.dumps({domain: asdict(score(pairs))}))


if __name__ == "__main__":
    main()
