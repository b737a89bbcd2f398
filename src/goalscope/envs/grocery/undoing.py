"""What a person wants taken back: what their last words led to."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache

from goalscope.envs import GUESSED
from goalscope.envs.grocery.diets import diet
from goalscope.envs.grocery.moods import Mood
from goalscope.envs.grocery.orders import besides_buying
from goalscope.envs.grocery.requests import wanted
from goalscope.envs.grocery.rewording import heard
from goalscope.envs.grocery.words import sentences
from goalscope.envs.remarks import asks_for_guesses, is_remark
from goalscope.envs.speech import evened
from goalscope.types import Action, StepResult

__all__ = ["Starts", "besides_undoing", "standing", "steps", "undoing_notes"]

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
    rf"{_LEAD}(?:(?:undo|revert|reverse)(?: {_LAST})?|(?:cancel|scratch|scrap) {_LAST}"
    rf"|take (?:{_LAST} back|back {_LAST})|go back(?: one)?(?: step)?"
    rf"|put (?:it|everything|things) back (?:how|(?:to )?the way|as) (?:it|everything|they|things)"
    rf" (?:was|were)(?: before)?){_END}"
)
_CALLS_OFF = re.compile(rf"{_LEAD}(?:cancel|stop shopping|undo (?:everything|all)){_END}")
_SEVERAL = re.compile(
    rf"{_LEAD}(?:undo|revert|reverse|cancel|take back) (?:(?:{_LAST} )?(?:twice|\d+ times)"
    r"|(?:both|(?:all )?(?:the|my|your) (?:last|previous) (?:\d+|two|three|four|five|few))"
    rf"(?: \w+)?){_END}"
)
_PARTS = re.compile(r"([.;:!?]+(?: +|$)|,+ *| (?:and|then|but) )")
_WHEN = re.compile(r"(?:but|if|unless|until|when|once|before|after|except|only)\b")
_HARM = re.compile(r"allerg|intoleran|c(?:o)?eliac|\b(?:ill|sick)\b")
_CLAUSE = re.compile(r"([,;]|\b(?:and|because|but|so|since|as|for)\b)")

_NEAR = 8
"""Clauses before and after one about an allergy that may belong to it."""


@lru_cache(maxsize=1024)
def besides_undoing(utterance: str) -> tuple[bool, str] | None:
    """Whether words plainly ask to take back what the last ones led to; and what else they say.

    It is not plain that an order is to be taken back along with one that comes before it in the
    same words, as in "Add milk. No, undo that", nor several. None where nothing asks for it.
    """
    text = evened(re.sub(r"\s*\n\s*", ". ", utterance.strip()))
    if _SEVERAL.fullmatch(text):
        return False, ""
    parts = _PARTS.split(text)
    places = [i for i in range(0, len(parts), 2) if _UNDOES.fullmatch(parts[i])]
    if not places:
        return None
    first = places[0]
    before, after = parts[:first], parts[first + 2 :]
    joint = "".join(parts[first + 1 : first + 2]).strip()
    told = all(
        not each or is_remark(each) or re.fullmatch(_LEAD, f"{each} ") for each in before[::2]
    )
    if told and len(places) == 1 and not _WHEN.match("".join(after) if joint != "but" else joint):
        return True, "".join(after)
    kept = (parts[i : i + 2] for i in range(0, len(parts), 2) if i not in places)
    return False, "".join(each for pair in kept for each in pair)


def undoing_notes(
    utterance: str,
    results: Sequence[StepResult],
    guessed: Sequence[str],
    *,
    taken_back: bool | None,
) -> list[str]:
    """What is told of words that want something taken back, or ask what was guessed.

    Args:
        utterance: The newest words.
        results: What came of them.
        guessed: Names of items that nobody asked for.
        taken_back: Whether anything is; None where what the basket held is not known.
    """
    told: list[str] = []
    undoing = besides_undoing(utterance)
    if undoing and not undoing[0]:
        told.append('Nothing is taken back. Say "Undo that" by itself.')
    elif undoing and taken_back and not results:
        told.append("That is taken back, and the basket stays as it is.")
    elif undoing and not taken_back:
        why = "What the basket held before is not known. " if taken_back is None else ""
        told.append(f"There is nothing that I can take back. {why}Please say what is to change.")
    if _CALLS_OFF.fullmatch(evened(utterance)):
        told.append('For the last change say "Undo that", and for all of it "Empty the basket".')
    if asks_for_guesses(utterance):
        told.append(f"{GUESSED}{', '.join(guessed) or 'nothing'}.")
    return told


def steps(now: Mapping[str, int], before: Mapping[str, int]) -> list[Action]:
    """What makes a basket what it was, item name to quantity: removals, then additions."""
    more = {name: before.get(name, 0) - now.get(name, 0) for name in {**now, **before}}
    return [
        *(Action("remove item", name, -number) for name, number in more.items() if number < 0),
        *(Action("add item", name, number) for name, number in more.items() if number > 0),
    ]


class Starts:
    """The baskets before the rounds of an episode, each by all that was said until then."""

    def __init__(self) -> None:
        """Nothing is known yet, as after a restart of the program."""
        self._baskets: dict[tuple[str, ...], dict[str, int]] = {}
        self._lost: set[tuple[str, ...]] = set()

    def note(self, said: tuple[str, ...], basket: Mapping[str, int], *, first: bool) -> None:
        """Keep the basket before a round, once; that of an episode's first round ends another."""
        if len(said) == 1 and first:
            self._baskets, self._lost = {}, set()
        elif len(said) > 1:
            self._baskets = {k: v for k, v in self._baskets.items() if said[: len(k)] == k}
            self._lost = {key for key in self._lost if said[: len(key)] == key}
        self._baskets.setdefault(said, {**basket})
        _, last = self.standing(said)
        if last is not None and said[: last + 1] not in self._baskets:
            self._lost.add(said)

    def correct(self, said: tuple[str, ...], basket: Mapping[str, int]) -> None:
        """Have a round start with this basket, once an earlier one is taken back in it."""
        self._baskets[said] = {**basket}

    def before(self, said: tuple[str, ...]) -> dict[str, int] | None:
        """The basket before what is taken back; None for nothing, or where it is not known."""
        _, last = self.standing(said)
        return None if last is None else self._baskets.get(said[: last + 1])

    def takes_back(self, said: tuple[str, ...]) -> bool | None:
        """Whether the newest words take something back; None where the basket is not known."""
        return None if said in self._lost else self.standing(said)[1] is not None

    def standing(self, said: tuple[str, ...]) -> tuple[tuple[str, ...], int | None]:
        """What `standing` gives; what was asked in vain took nothing back."""
        lost = frozenset(len(key) - 1 for key in self._lost if said[: len(key)] == key)
        return standing(said, lost)


@lru_cache(maxsize=256)
def standing(
    utterances: tuple[str, ...], lost: frozenset[int] = frozenset()
) -> tuple[tuple[str, ...], int | None]:
    """The utterances, without what was taken back; and which one the newest takes back.

    Of what is taken back an allergy stays. Remarks, questions and attempts to buy have changed
    nothing, so that none of them is taken back.

    Args:
        utterances: What the person said.
        lost: Which of them asked in vain, as the earlier basket was not known.
    """
    stands, changes = [*utterances], list[int]()
    last = None
    for place, utterance in enumerate(utterances):
        last = None
        if undoing := besides_undoing(utterance):
            plain, stands[place] = undoing
            last = changes[-1] if plain and changes else None
            if last is not None and place not in lost:
                stands[changes.pop()] = _harm(utterances[last])
        if _may_change(stands[place]):
            changes.append(place)
    return tuple(stands), last


@lru_cache(maxsize=1024)
def _may_change(utterance: str) -> bool:
    said = besides_buying(utterance)
    asks = all(clause.mood is Mood.QUESTION for clause in heard(said))
    return not (asks or is_remark(utterance))


@lru_cache(maxsize=256)
def _harm(utterance: str) -> str:
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
