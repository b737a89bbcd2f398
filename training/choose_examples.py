"""Choose examples of reading for models that were not taught: python training/choose_examples.py.

They are messages of the reading corpus that stand alone, spread over verbs and over what makes a
message hard, no two alike. They go behind the first ones of each domain's `data/examples.toml`.
"""

from __future__ import annotations

import json
import random
from collections import defaultdict
from pathlib import Path

from goalscope.experiment.reading_scores import Line, read_corpus
from goalscope.language.orders import orders_to_text, words_of
from goalscope.models.embedding import embedded

CORPUS = Path("corpus/reading/train")
DATA = Path("src/goalscope/envs")
MARK = "# Chosen by training/choose_examples.py; written by hand above.\n"
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
        kinds[first.do, first.about, line.kind.removeprefix("not ")].append(number)
    found: list[int] = []
    while len(found) < MOST and any(kinds.values()):
        for left in kinds.values():
            if left and len(found) < MOST:
                number = left.pop()
                if not found or (vectors[found] @ vectors[number]).max() < ALIKE:
                    found.append(number)
    return [lines[number] for number in found]


def as_toml(line: Line) -> str:
    """A table of `examples.toml`."""
    told = {"here": line.here, "question": line.question, "message": line.message}
    told["orders"] = orders_to_text(line.orders)
    rows = [f"{key} = {json.dumps(text, ensure_ascii=False)}" for key, text in told.items() if text]
    return "\n".join(["", "[[example]]", *rows, ""])


if __name__ == "__main__":
    corpus = read_corpus(CORPUS)
    for domain in ("grocery", "house"):
        file = DATA / domain / "data" / "examples.toml"
        kept = file.read_text(encoding="utf-8").partition(MARK)[0].rstrip("\n")
        found = [each for line in corpus if line.domain == domain and (each := alone(line))]
        text = "".join(map(as_toml, chosen(found)))
        file.write_text(f"{kept}\n\n{MARK}{text}", encoding="utf-8")
