"""Simulated people with a habit that makes them harder to understand than the paper's.

A schedule in code decides what such a person knows and does in each round, so that a model that
follows prompts badly keeps to it, too. It depends on the profile, the seed and the transcript
alone, so that a resumed episode continues as it would have.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from random import Random
from typing import Literal

from goalscope.agent.people import SimulatedHuman, completes
from goalscope.base.types import InvalidInputError, Profile, Turn
from goalscope.envs import Environment, completion_phrase
from goalscope.models import Generator
from goalscope.prompts import render

__all__ = [
    "CHANGED",
    "HESITATION",
    "REMARKS",
    "WORDS",
    "ChangesMind",
    "Distracted",
    "Habit",
    "Terse",
    "VolunteersLate",
    "habitual",
    "shortened",
]

Habit = Literal["terse", "distracted", "changes-mind", "volunteers-late"]
"""The habit of a simulated person: `Terse`, `Distracted`, `ChangesMind` or `VolunteersLate`."""

WORDS = 6
"""Most words that a terse person says at a time."""

EARLY = 2
"""First rounds, in which a person does not know or tell what they really want."""

HESITATION = "Let me think."
"""Said by a person who would fall silent or end the task too early."""

CHANGED = "I've changed my mind."
"""Said first by a person who now wants something else."""

REMARKS = {
    "the weather": "It rained all night and I hardly slept.",
    "the traffic": "The traffic was terrible this morning.",
    "our football team": "Our team lost again on Saturday.",
    "a neighbour": "My neighbour sang in the stairwell until midnight.",
    "a dream": "I had a strange dream about flying last night.",
    "the election": "They counted the votes until two in the morning.",
    "a train": "My train was an hour late yesterday.",
    "a colleague": "A colleague of mine retired on Friday.",
}
"""Topics of a distracted person, with the words for each if the model's own will not do."""

_TERSE_TOKENS = 24
_REMARK_TOKENS = 40
_SENTENCE = re.compile(r"(?<=[.!?])\s+(?![a-z])")
_PART = re.compile(rf"{_SENTENCE.pattern}|(?<=[:;])\s+")
_ANSWER = re.compile(r"\W*(?:yes|yeah|yep|sure|ok|okay|no|nope|please|fine|go)\b", re.IGNORECASE)


class Terse(SimulatedHuman):
    """Says at most `WORDS` words at a time: whole sentences, if one is that short."""

    def answer(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """What the model says as this person, cut short, but for the completion phrase.

        Words that would end the task only because they were cut are not said.
        """
        said = self.speak(
            self.profile.description,
            query,
            turns,
            status,
            words=WORDS,
            max_tokens=_TERSE_TOKENS,
        )
        if not said or completes(self.env, said):
            return completion_phrase(self.env)
        return _going_on(self.env, query, shortened(said, WORDS))


class Distracted(SimulatedHuman):
    """Says something beside the point in one of rounds 2 to 4, one of 5 to 7, and so on.

    These words are generated without the profile, the query and the transcript, so that they are
    no evidence of any goal; and they ask for nothing that the environment would do.
    """

    def answer(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """What the model says as this person, or a remark."""
        three, place = divmod(len(turns) - 1, 3)
        if not turns or place != self._random(three).randrange(3):
            return super().answer(query, turns, status)
        topics = self._random("topics").sample(list(REMARKS), len(REMARKS))
        return self._remark(topics[three % len(topics)], query)

    def _remark(self, topic: str, query: str) -> str:
        prompt = render("remark", topic=topic)
        reply = self.model.generate(prompt, max_tokens=_REMARK_TOKENS, stop=("\n",), seed=self.seed)
        said = shortened(" ".join(reply.text.split()).strip('" '), 20)
        ends = completes(self.env, said)
        return REMARKS[topic] if not said or _ANSWER.match(said) or ends else said

    def _random(self, what: object) -> Random:
        return Random(f"{self.profile.name} {self.seed} {what}")


class VolunteersLate(SimulatedHuman):
    """Knows only the beginning of their description for `EARLY` rounds, and all of it afterwards.

    The beginning is the first sentence, up to a colon or semicolon.
    """

    def answer(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """What the model says as this person, who does not end the task before knowing all."""
        if len(turns) >= EARLY:
            return super().answer(query, turns, status)
        start = _PART.split(self.profile.description.strip(), maxsplit=1)[0]
        start = start.rstrip(":;") + "." if start.endswith((":", ";")) else start
        return _going_on(self.env, query, self.speak(start, query, turns, status))


class ChangesMind(SimulatedHuman):
    """Wants what another profile wants for `EARLY` rounds, then says so and wants their own.

    Afterwards they remember nothing of those rounds.
    """

    def __init__(
        self, model: Generator, profile: Profile, env: Environment, seed: int, first: Profile
    ) -> None:
        """See `SimulatedHuman`; `first` is the profile of the early rounds."""
        super().__init__(model, profile, env, seed)
        self.first = first

    def answer(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """What the model says as either person, who does not end the task too early."""
        if len(turns) > EARLY:
            return super().answer(query, turns[EARLY:], status)
        changing = len(turns) == EARLY
        description = self.profile.description if changing else self.first.description
        said = self.speak(description, query, [] if changing else turns, status)
        said = _going_on(self.env, query, said)
        return f"{CHANGED} {said}" if changing else said


def habitual(
    habit: Habit,
    model: Generator,
    profile: Profile,
    env: Environment,
    *,
    seed: int = 0,
    people: Sequence[Profile] = (),
) -> SimulatedHuman:
    """A simulated person with a habit.

    Args:
        habit: The habit.
        model: Plays them.
        profile: Who they are.
        env: Where they are.
        seed: Of everything that is drawn.
        people: The profiles of the domain. A person who changes their mind is another of them at
            first, one of the same scene if there is one.

    Raises:
        InvalidInputError: Nobody in `people` wants anything else.
    """
    match habit:
        case "terse":
            return Terse(model, profile, env, seed)
        case "distracted":
            return Distracted(model, profile, env, seed)
        case "volunteers-late":
            return VolunteersLate(model, profile, env, seed)
        case "changes-mind":
            others = [each for each in people if each.description != profile.description]
            near = [each for each in others if each.scene == profile.scene] or others
            if not near:
                raise InvalidInputError(
                    f"{profile.name} can only change their mind where another profile wants "
                    "something else, and there is none. Add one to the file of profiles."
                )
            first = Random(f"{profile.name} {seed}").choice(near)
            return ChangesMind(model, profile, env, seed, first)


def shortened(text: str, most: int) -> str:
    """As many whole sentences as `most` words hold; the first `most` words if none does."""
    kept = ""
    for sentence in _SENTENCE.split(text):
        longer = f"{kept} {sentence}".strip()
        if len(longer.split()) > most:
            break
        kept = longer
    return kept or " ".join(text.split()[:most]).rstrip(",;:")


def _going_on(env: Environment, query: str, said: str) -> str:
    """The words, or a hesitation if they are empty or end the task."""
    return HESITATION if not said or completes(env, said) else said
