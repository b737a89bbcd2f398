"""What a person wants taken back: what their last words led to."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from goalscope.envs.grocery.moods import Mood
from goalscope.envs.grocery.orders import besides_buying
from goalscope.envs.grocery.rewording import heard
from goalscope.envs.grocery.words import sentences
from goalscope.envs.remarks import is_remark
from goalscope.envs.speech import evened
from goalscope.types import Action, StepResult

__all__ = ["asks_for_guesses", "standing", "steps", "undoes", "undoing_notes"]

_LEAD = (
    r"(?:(?:no|oh|oops|ok(?:ay)?|wait|sorry|actually|now|please|and|then|can you|could you|can we"
    r"|can i|let's|i want to|i'd like to|i want you to|i need to)[ ,.!]+)*+"
)
_END = r"(?:[ ,]+(?:please|now|again|for me|thanks))*+[ .!?]*+"
_LAST = (
    r"(?:that|it|this|(?:the|my|your) (?:last|previous) (?:one|thing|step|order|change|request|bit"
    r"|action|message)|what you(?: just|'ve)? d(?:id|one)|what i(?: just|'ve)? said)"
)
_UNDOES = re.compile(
    rf"{_LEAD}(?:(?:undo|revert|reverse)(?: {_LAST})?|(?:cancel|scratch) {_LAST}"
    rf"|take (?:{_LAST} back|back {_LAST})|go back(?: one)?(?: step)?"
    rf"|put (?:it|everything|things) back (?:how|(?:to )?the way|as) (?:it|everything|they|things)"
    rf" (?:was|were)(?: before)?){_END}"
)
_CALLS_OFF = re.compile(rf"{_LEAD}(?:cancel|stop shopping|undo (?:everything|all)){_END}")
_GUESSED = re.compile(
    rf"{_LEAD}(?:(?:what|which(?: \w+)?) (?:did you(?: just)? guess|(?:have you|was|were|is|are)"
    rf" guessed|(?:are|were) (?:your|the) guesses)|(?:show|tell|list)(?: me)? (?:your|the) guesses)"
    rf"{_END}"
)
_HARM = re.compile(r"allerg|intoleran|c(?:o)?eliac|\b(?:ill|sick)\b")


def undoes(utterance: str) -> bool:
    """Whether words ask to take back what the last ones led to, and nothing else."""
    return bool(_UNDOES.fullmatch(evened(utterance)))


def asks_for_guesses(utterance: str) -> bool:
    """Whether a person asks what was guessed."""
    return bool(_GUESSED.fullmatch(evened(utterance)))


def undoing_notes(
    utterance: str, results: Sequence[StepResult], guessed: Sequence[str]
) -> list[str]:
    """What is told of words that want something taken back, or ask what was guessed."""
    told: list[str] = []
    if undoes(utterance) and not results:
        told.append("There is nothing that I can take back. Please say what is to change.")
    if _CALLS_OFF.fullmatch(evened(utterance)):
        told.append('For the last change say "Undo that", and for all of it "Empty the basket".')
    if asks_for_guesses(utterance):
        told.append(f"Guessed, not asked for: {', '.join(guessed) or 'nothing'}.")
    return told


def steps(now: Mapping[str, int], before: Mapping[str, int]) -> list[Action]:
    """What makes a basket what it was, item name to quantity: removals, then additions."""
    more = {name: before.get(name, 0) - now.get(name, 0) for name in {**now, **before}}
    return [
        *(Action("remove item", name, -number) for name, number in more.items() if number < 0),
        *(Action("add item", name, number) for name, number in more.items() if number > 0),
    ]


def standing(utterances: Sequence[str]) -> tuple[list[str], int | None]:
    """The utterances, without what was taken back; and which one the newest takes back.

    Of what is taken back an allergy stays. Remarks, questions and attempts to buy have changed
    nothing, so that none of them is taken back.
    """
    stands, changes = [*utterances], list[int]()
    last = None
    for place, utterance in enumerate(utterances):
        last = None
        if undoes(utterance):
            stands[place] = ""
            if changes:
                last = changes.pop()
                said = sentences(utterances[last])
                stands[last] = " ".join(each for each in said if _HARM.search(each.casefold()))
        elif _may_change(utterance):
            changes.append(place)
    return stands, last


def _may_change(utterance: str) -> bool:
    said = besides_buying(utterance)
    asks = all(clause.mood is Mood.QUESTION for clause in heard(said))
    return not (asks or is_remark(utterance))
