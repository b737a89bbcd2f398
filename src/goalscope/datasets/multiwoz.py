"""MultiWOZ: a person looks for trains, hotels and so on, after a goal that they were given."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from goalscope.datasets.case import Case, turns_of
from goalscope.datasets.files import Row, json_rows
from goalscope.datasets.goal_sets import chance, draw

__all__ = ["TASK", "detokenised", "multiwoz"]

TASK = "Help the human to find and book places and transport in and around Cambridge."
"""What the assistant is to do, in a sentence."""


def multiwoz(file: Path, goal_set: str, goals: int, seed: int) -> Iterator[Case | str]:
    """Dialogues in the order of the file; instead of one that is left out, the reason.

    "random" draws from the goals of all other dialogues, "hard" from those with the very same
    domains; a dialogue whose domains give too few is left out of "hard".

    Raises:
        InvalidInputError: The file is broken.
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
        drawn = draw(chance(seed, id), message, [tier], goals)
        if drawn is None:
            yield f"fewer than {goals} goals " + (
                "in the file" if goal_set == "random" else "with its domains"
            )
            continue
        yield Case(id, id, TASK, turns, *drawn)


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
