"""The Conversation Module (Sec. 3.2): the agent's queries, and the people who answer them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from goalscope.agent.guards import CONFIRM
from goalscope.base.text import plain
from goalscope.base.types import InvalidInputError, Message, Profile, Turn, checked_text
from goalscope.envs import Environment, completion_phrase
from goalscope.models import Generator, LanguageModel
from goalscope.prompts import recent, render, transcript

__all__ = [
    "AGREES",
    "DECLINES",
    "FALLBACK",
    "Asker",
    "ConsoleHuman",
    "Human",
    "ScriptedHuman",
    "SimulatedHuman",
    "ask",
    "completes",
    "consents",
    "question_of",
]

AGREES, DECLINES = "Yes.", "No, not yet."
"""What the person of a profile answers when asked to confirm something."""

OPENING = "What can I help you with?"
FALLBACK = "What else would you like?"
"""The query if there is no better one."""

_REPLY = 80
"""Token limit of a reply."""


class Asker(Protocol):
    """Writes queries; see `Writer` and `PromptedWriter`."""

    def question(self, task: str, turns: Sequence[Turn], done: str, goals: Sequence[str]) -> str:
        """The next question; "" if there is nothing to ask.

        Args:
            task: The agent and its task.
            turns: The conversation.
            done: What the agent has done, in words.
            goals: The likeliest ones.
        """
        ...


class Human(Protocol):
    """A person who answers the agent, real or simulated."""

    def reply(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """The person's words in answer to `query`."""
        ...


def ask(
    asker: Asker,
    env: Environment,
    turns: Sequence[Turn],
    done: str,
    goals: Sequence[str],
) -> str:
    """The agent's next question; none is asked twice.

    Args:
        asker: Writes it.
        env: Where the agent acts.
        turns: The conversation.
        done: What the agent has done, in words.
        goals: The likeliest ones.
    """
    if not turns:
        return OPENING
    question = question_of(asker.question(env.task, turns, done, goals))
    asked = {question_of(turn.query) for turn in turns}
    return question if question.endswith("?") and question not in asked else FALLBACK


def question_of(text: str) -> str:
    """The first question in `text`, on one line; the whole text if there is none."""
    line = " ".join(text.split()).strip('" ')
    head, mark, _ = line.partition("?")
    if not mark:
        return line
    for end in (". ", "! ", ": "):
        head = head.rpartition(end)[2]
    return head.strip('" ') + "?"


def _with_status(model: LanguageModel, name: str, status: str, **values: object) -> list[Message]:
    """The prompt with the status, or without it if that leaves no room for a reply."""
    prompt = render(name, status=status, **values)
    if model.count_tokens(prompt) + _REPLY <= model.context_size:
        return prompt
    return render(name, status="", **values)


class ConsoleHuman:
    """A person behind a function that shows a query and returns their words."""

    def __init__(self, read: Callable[[str], str]) -> None:
        self.read = read

    def reply(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """Ask until the words can be used; the next query says what is wrong with them."""
        hint = ""
        while True:
            try:
                return checked_text(self.read(query + hint), "reply")
            except InvalidInputError as error:
                hint = f"\n({error})"


def completes(env: Environment, said: str) -> bool:
    """Whether an utterance ends with the phrase that ends the task."""
    return plain(said).casefold().rstrip(" .!\"'").endswith(completion_phrase(env).casefold())


def consents(query: str, env: Environment, *, done: bool) -> str:
    """What the person of a profile answers to a request to confirm; "" to any other query.

    They agree, but to the end of the task only when they have nothing more to say (`done`).
    """
    if not query.endswith(CONFIRM):
        return ""
    ends = any(f'"{verb.name}"' in query for verb in env.verbs if verb.ends)
    return DECLINES if ends and not done else AGREES


class ScriptedHuman:
    """Says the replies that its profile lists, in order, and then the completion phrase.

    Requests to confirm something are answered in between; see `consents`.
    """

    def __init__(self, profile: Profile, env: Environment) -> None:
        self.profile = profile
        self.env = env

    def reply(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """The reply for this round."""
        replies = self.profile.replies
        said = sum(turn.utterance not in (AGREES, DECLINES) for turn in turns)
        if consent := consents(query, self.env, done=said >= len(replies)):
            return consent
        return replies[said] if said < len(replies) else completion_phrase(self.env)


class SimulatedHuman:
    """A model that plays the person of a profile (Sec. 4.2)."""

    def __init__(self, model: Generator, profile: Profile, env: Environment, seed: int = 0) -> None:
        self.model = model
        self.profile = profile
        self.env = env
        self.seed = seed

    def reply(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """What the model says as this person; the completion phrase if it says nothing.

        Requests to confirm something are answered by `consents`.
        """
        ended = bool(turns) and completes(self.env, turns[-1].utterance)
        consent = consents(query, self.env, done=ended)
        return consent or self.answer(query, turns, status)

    def answer(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """What the model says as this person to any other query."""
        said = self.speak(self.profile.description, query, turns, status)
        return said or completion_phrase(self.env)

    def speak(
        self,
        description: str,
        query: str,
        turns: Sequence[Turn],
        status: str,
        *,
        words: int | None = None,
        max_tokens: int = _REPLY,
    ) -> str:
        """What the model says as the person of a description; "" if it says nothing.

        Args:
            description: What the person wants, as far as they know.
            query: The agent's question.
            turns: The conversation before it, as far as the person remembers.
            status: The environment's status.
            words: Word limit that the person is told; None for a sentence or two.
            max_tokens: Token limit.
        """
        past = recent(self.model, turns, 8)
        *before, last = _with_status(
            self.model,
            "human",
            status,
            description=" ".join(description.split()),
            completion_phrase=completion_phrase(self.env),
            turns=past,
            query=query,
            words=words,
        )
        prompt = [*before, *transcript(past), last]
        reply = self.model.generate(
            prompt, max_tokens=max_tokens, stop=("\n",), seed=self.seed + len(turns)
        )
        return " ".join(reply.text.split()).strip('" ')
