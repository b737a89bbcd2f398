"""Choose examples of reading for models that were not taught: python training/choose_examples.py.

They are messages of the reading corpus that stand alone, spread over verbs and over what questions
are about, no two alike. They stand in `data/examples.jsonl` of each domain.
"""

from __future__ import annotations

import json
import random
from collections import defaultdict
from pathlib import Path

from goalscope.experiment.reading_scores import Line, read_corpus, turn_to_json
from goalscope.language.orders import orders_to_text, words_of
from goalscope.models.embedding import embedded

CORPUS = Path("corpus/reading/train")
DATA = Path("src/goalscope/envs")
MOST = 400
LONGEST = 140  # characters of a message
ALIKE = 0.85  # cosine above which two messages are too alike


def alone(line: Line) -> Line | None:
    """The line with as much context as its orders need; None if they need earlier messages."""
    wanted = {word for order in line.orders for text in order.phrases for word in words_of(text)}
    wanted -= {*words_of(line.message)}
    asked = wanted & {*words_of(line.question)}
    seen = wanted - asked
    if len(line.message) > LONGEST or seen - {*words_of(line.here)}:
        return None
    answers = any(order.do in ("yes", "no") for order in line.orders)
    question = line.question if asked or answers or len(line.message.split()) < 4 else ""
    return Line(
        line.id, line.domain, question, line.message, line.orders, line.here if seen else ""
    )


def chosen(lines: list[Line]) -> list[Line]:
    """At most `MOST` of the lines, each kind in turn."""
    random.Random(1).shuffle(lines)
    vectors = embedded([line.message for line in lines])
    kinds: dict[tuple[str, ...], list[int]] = defaultdict(list)
    for number, line in enumerate(lines):
        first = line.orders[0]
        kinds[first.do, first.about].append(number)
    found: list[int] = []
    while len(found) < MOST and any(kinds.values()):
        for left in kinds.values():
            if left and len(found) < MOST:
                number = left.pop()
                if not found or (vectors[found] @ vectors[number]).max() < ALIKE:
                    found.append(number)
    return [lines[number] for number in found]


def as_json(line: Line) -> str:
    """A line of `examples.jsonl`."""
    told = {**turn_to_json(line), "orders": orders_to_text(line.orders)}
    return json.dumps(told, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    corpus = read_corpus(CORPUS)
    for domain in ("grocery", "house"):
        found = [each for line in corpus if line.domain == domain and (each := alone(line))]
        text = "".join(map(as_json, chosen(found)))
        (DATA / domain / "data" / "examples.jsonl").write_text(text, encoding="utf-8")
