"""ALFRED's step sentences as messages with their orders: python training/steps.py OUT.jsonl.

ALFRED (Shridhar et al., 2020) has sentences by thousands of people for each step of a household
task, and the step itself as an action with its objects. A sentence is taken where it names them:
the thing of an order is what the person called it, "yellow pencil". The data are those of
GOALSCOPE_DATA.
"""

from __future__ import annotations

import argparse
import gzip
import json
import random
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from goalscope.datasets import data_folder
from goalscope.envs.house.simulator.object_types import object_types
from goalscope.envs.house.view import called
from goalscope.experiment.reading_scores import Line, turn_to_json
from goalscope.language.orders import Order

FILE = "dialogue/alfred/alfred_goals_train.jsonl.gz"

_STEPS = 2500
"""Number of tasks that are drawn; each gives the steps of one of its people."""

_VERBS = {
    "PickupObject": "pick up",
    "ToggleObject": "turn on",
    "SliceObject": "slice",
    "CleanObject": "clean",
}
_LEADING = r"(?:the|a|an|that|this|its|your)"
_JOINS = re.compile(r"\b(?:of|with|and|to|in|on|from|then)\b")
_PLACE = re.compile(
    r" (?:(?:that is|that's|which is|sitting) )?(?:on|in|from|inside|off) (?:of )?(?:the|a) "
    r"((?:[a-z]+ ){0,2}[a-z]+)"
)
_ACTS = re.compile(
    r"\b(?:pick|grab|take|get|put|place|set|open|close|shut|turn on|turn off|slice|cut|wash|clean|"
    r"rinse|remove|lay|drop|heat|cook|cool|fill|empty)\b"
)
"""What somebody does in a sentence; one that tells of two things done is no single step."""


def orders_of(step: Mapping[str, Any], said: str) -> tuple[Order, ...] | None:
    """The orders that a sentence comes to; None where it says less, or more, than the step."""
    do, args = str(step["a"]), [*map(str, step["args"])]
    said = said.rstrip(".! ")
    if do == "GotoLocation":
        return None if _ACTS.search(said) else (Order("none"),)
    if len(_ACTS.findall(said)) != 1 or " and " in said:
        return None
    what, rest = _named(said, args[0])
    if do == "PutObject" and what and len(args) > 1:
        where, rest = _named(rest, args[1])
        return (Order("put", what, where=where),) if where and not rest else None
    place = _PLACE.fullmatch(rest)
    if do not in _VERBS or not what or (rest and not place):
        return None
    return (Order(_VERBS[do], what, where=place[1] if place else ""),)


def _named(said: str, kind: str) -> tuple[str, str]:
    """What a sentence calls an object of a kind, and what it says after that; "" for nothing."""
    for name in sorted(_names(kind), key=len, reverse=True):
        found = re.search(rf"\b{_LEADING} ((?:[a-z]+ ){{0,2}}{re.escape(name)})\b(.*)", said)
        if found and not _JOINS.search(found[1]):
            return found[1], found[2]
    return "", ""


def _names(kind: str) -> Sequence[str]:
    """The names of one of ALFRED's kinds, such as "floorlamp"."""
    types = (each for each in object_types() if each.casefold() == kind.casefold())
    return [name.casefold() for each in types for name in called(each)]


def conversations(rows: Sequence[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    """A conversation for each task: its steps in one person's words, as far as they are clear."""
    draw = random.Random(1)
    for number, row in enumerate(draw.sample([*rows], min(_STEPS, len(rows)))):
        person = draw.choice(row["anns"])
        steps = row["high_pddl"]
        if len(person["high_descs"]) > len(steps):
            continue
        lines: list[Line] = []
        for step, text in zip(steps, person["high_descs"], strict=False):
            orders = orders_of(step, " ".join(str(text).casefold().split()))
            if orders is None or (orders == (Order("none"),) and draw.random() < 0.7):
                continue
            lines.append(Line("", "house", "", str(text).strip(), orders))
        if lines:
            turns = [turn_to_json(line) for line in lines]
            yield {"id": f"alfred-{number}", "domain": "house", "turns": turns}


def main() -> None:
    """Write the conversations."""
    parser = argparse.ArgumentParser(description="Make messages of ALFRED's step sentences.")
    parser.add_argument("out", type=Path)
    out: Path = parser.parse_args().out
    with gzip.open(data_folder(None) / FILE, "rt", encoding="utf-8") as lines:
        rows = [json.loads(line) for line in lines]
    found = [*conversations(rows)]
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text("".join(json.dumps(each) + "\n" for each in found), encoding="utf-8")
    print(f"{out}: {sum(len(each['turns']) for each in found)} messages of {len(found)} tasks")


if __name__ == "__main__":
    main()
