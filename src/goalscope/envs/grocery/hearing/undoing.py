"""What stays of words that are taken back, and what is told of those that call off."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache

from goalscope.envs import GUESSED
from goalscope.envs.grocery.hearing.diets import diet
from goalscope.envs.grocery.hearing.requests import wanted
from goalscope.envs.grocery.hearing.rewording import heard
from goalscope.envs.grocery.words import sentences
from goalscope.envs.remarks import asks_for_guesses
from goalscope.envs.speech import evened
from goalscope.envs.undoing import END, LEAD
from goalscope.types import Action, StepResult

__all__ = ["ALLERGY", "calling_notes", "harm", "net", "steps"]

ALLERGY = "What you said of what somebody must not eat still counts."
"""Told where words are taken back that name an allergy."""

_MOVES = {"add item": 1, "remove item": -1}
"""What moves an item, and whether into the basket or out of it."""

_CALLS_OFF = re.compile(rf"{LEAD}(?:cancel|stop shopping|go back){END}")
_HARM = re.compile(
    r"allerg|intoleran|c(?:o)?eliac|anaphyla|epi-?pen|\b(?:ill|sick|shock|hospital|react(?:s|ions?)?)\b"
    r"|\b(?:can't|cannot|can not|must not|mustn't|may not) (?:have|eat|tolerate)\b"
)
_CLAUSE = re.compile(r"([,;]|\b(?:and|because|but|so|since|as|for)\b)")

_NEAR = 8
"""Clauses before and after one about an allergy that may belong to it."""


def calling_notes(utterance: str, guessed: Sequence[str]) -> list[str]:
    """What is told of words that call off, or ask what was guessed.

    Args:
        utterance: The newest words.
        guessed: Names of items that nobody asked for.
    """
    told: list[str] = []
    if _CALLS_OFF.fullmatch(evened(utterance)):
        told.append('For the last change say "Undo that", and for all of it "Undo everything".')
    if asks_for_guesses(utterance):
        told.append(f"{GUESSED}{', '.join(guessed) or 'nothing'}.")
    return told


def net(results: Sequence[StepResult]) -> dict[str, int]:
    """How many of each item these results put in, less what they took out."""
    found: dict[str, int] = {}
    for action in (result.action for result in results if result.action.name in _MOVES):
        number = found.get(action.target, 0) + _MOVES[action.name] * action.quantity
        found[action.target] = number
    return found


def steps(moved: Mapping[str, int], basket: Mapping[str, int]) -> list[Action]:
    """What takes out again what was put in, as far as it is there, and puts back the rest."""
    out = {name: min(number, basket.get(name, 0)) for name, number in moved.items()}
    return [
        *(Action("remove item", name, number) for name, number in out.items() if number > 0),
        *(Action("add item", name, -number) for name, number in moved.items() if number < 0),
    ]


@lru_cache(maxsize=256)
def harm(utterance: str) -> str:
    """What of an utterance tells of allergies, without what asks for things."""
    told: list[str] = []
    for sentence in sentences(utterance):
        parts = _CLAUSE.split(evened(sentence))
        for i in range(0, len(parts), 2):
            if not _HARM.search(parts[i]) or _asks_for_things(parts[i]):
                continue
            start, end = i, i + 1
            for further in range(i + 3, min(i + 2 * _NEAR, len(parts)) + 1, 2):
                if _asks_for_things("".join(parts[start:further])):
                    break
                end = further
            for earlier in range(i - 2, max(i - 2 * _NEAR, 0) - 1, -2):
                if _asks_for_things("".join(parts[earlier:end])):
                    break
                start = earlier
            told.append("".join(parts[start:end]).strip(" .,;!?"))
        if _HARM.search(sentence.casefold()):
            more = diet(sentence) - diet(". ".join(told))
            told += [f"everything must be {name}" for name in sorted(more)]
    return ". ".join(dict.fromkeys(told))


def _asks_for_things(text: str) -> bool:
    return any(wanted(clause) for clause in heard(text))
