"""Small honest stand-ins: a normalised model of words, and a room with a lamp."""

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np

from goalscope.models import Completion
from goalscope.types import Action, Message, Profile, StepResult, Turn


class WordModel:
    """Words are drawn independently; a word that the context holds is `boost` times as likely.

    Over its vocabulary the probabilities sum to one, so posteriors have closed forms. It writes
    the scripted replies, whichever prompt's words they are listed under.
    """

    name = "words"
    vocabulary = 1000
    boost = 50.0

    def __init__(self, replies: Mapping[str, str] | None = None, context_size: int = 4096) -> None:
        self.replies = dict(replies or {})
        self.context_size = context_size
        self.calls = 0

    def token_logprobs(
        self,
        contexts: Sequence[Sequence[Message]],
        continuations: Sequence[str],
        *,
        end_of_turn: bool = False,
    ) -> list[np.ndarray]:
        self.calls += 1
        rows = []
        for context, text in zip(contexts, continuations, strict=True):
            seen = {word for message in context for word in words(message.content)}
            total = self.vocabulary + len(seen) * (self.boost - 1)
            row = [math.log((self.boost if w in seen else 1) / total) for w in words(text)]
            rows.append(np.array(row + [math.log(0.5)] * end_of_turn))
        return rows

    def count_tokens(self, messages: Sequence[Message]) -> int:
        return sum(len(words(message.content)) + 2 for message in messages)

    def generate(self, messages: Sequence[Message], **settings) -> Completion:
        prompt = " ".join(message.content for message in messages)
        text = next((reply for mark, reply in self.replies.items() if mark in prompt), "")
        if heard := settings.get("heard"):
            for end in [match.end() for match in re.finditer(r"\S+", text)]:
                heard(text[:end])
        return Completion(text, "stop", len(words(prompt)), len(words(text)))


class RefusesAll(WordModel):
    """Finds every refusal likelier than any consent."""

    def token_logprobs(self, contexts, continuations, *, end_of_turn=False):
        rows = super().token_logprobs(contexts, continuations, end_of_turn=end_of_turn)
        return [
            np.zeros(1) if text.startswith("I'm sorry") else row
            for row, text in zip(rows, continuations, strict=True)
        ]


class LampRoom:
    """An environment with lamps; the switch `broken` always fails, and `smash` needs leave."""

    task = "The agent looks after a lamp."
    notes = ()
    completion_phrase = "Good night"

    def __init__(self, offers: Sequence[str] = ("lamp",)) -> None:
        self.offers = list(offers)
        self.on: list[str] = []
        self.smashed: list[str] = []

    def reset(self) -> None:
        self.on.clear()
        self.smashed.clear()

    def status(self) -> str:
        return f"On: {', '.join(self.on) or 'nothing'}."

    def kinds(self, text: str, limit: int) -> list[str]:
        return self.offers[:limit]

    def mentioned(self, utterances: Sequence[str]) -> list[str]:
        return [word for word in words(" ".join(utterances)) if word in self.offers]

    def actions(self, relevant: Sequence[str], turns: Sequence[Turn] = ()) -> list[Action]:
        return [Action("switch on", term) for term in relevant if term in self.offers]

    def requests(self, turns: Sequence[Turn]) -> list[Action]:
        return []

    def is_order(self, turns: Sequence[Turn]) -> bool:
        return turns[-1].utterance.startswith("just ")

    def unmet(self, turns: Sequence[Turn], results: Sequence[StepResult]) -> list[str]:
        asked = [word for word in words(turns[-1].utterance) if word.endswith("lamp")]
        return [f"There is no {word} here." for word in asked if word not in self.offers]

    def permission(self, action: Action, turns: Sequence[Turn]) -> str:
        asked = [turn for turn in turns if turn.query == f"May I smash the {action.target}?"]
        if action.name != "smash" or any(turn.utterance == "yes" for turn in asked):
            return ""
        return f"May I smash the {action.target}?"

    def reversal(
        self, results: Sequence[StepResult], before: Sequence[StepResult], turns: Sequence[Turn]
    ) -> None:
        """Nothing is undone in this room."""

    def close(self) -> None:
        pass

    def fingerprint(self) -> str:
        return f"{self.on} {self.smashed}"

    def completion_actions(self) -> list[Action]:
        return []

    def step(self, action: Action) -> StepResult:
        if action.name == "search inventory":
            return StepResult(action, True, action.target)
        if action.target == "broken" or action.target in self.on:
            return StepResult(action, False, "The switch does not move.")
        if action.name == "smash":
            self.smashed.append(action.target)
            return StepResult(action, True, "It is in pieces.", irreversible=True)
        self.on.append(action.target)
        return StepResult(action, True, "It is on.")

    def answer(self, question: str, turns: Sequence[Turn] = ()) -> str | None:
        return self.status() if question.endswith("on?") else None

    def is_completion(self, turn: Turn) -> bool:
        return turn.utterance == self.completion_phrase

    def checks_met(self, profile: Profile) -> list[bool]:
        return [bool(self.on)]


def said(*utterances: str) -> list[Turn]:
    return [Turn("", utterance) for utterance in utterances]


def words(text: str) -> list[str]:
    return re.findall(r"\w+", text.lower())
