"""The conversation (Sec. 3.2): what the agent asks, and who answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from goalscope.envs import Environment
from goalscope.guards import CONFIRM
from goalscope.models import Generator, LanguageModel, OnText
from goalscope.prompts import recent, render, transcript
from goalscope.types import InvalidInputError, Message, Profile, Turn, checked_text

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
"""What a person of a profile says where they are asked to confirm something."""

OPENING = "What can I help you with?"
FALLBACK = "What else would you like?"
"""Asked where there is nothing better to ask."""

_REPLY = 80
"""Most tokens of what is written in the conversation."""


class Asker(Protocol):
    """Asks; see `goalscope.writer.Writer` and `goalscope.prompted.PromptedWriter`."""

    def question(
        self,
        task: str,
        turns: Sequence[Turn],
        done: str,
        goals: Sequence[str],
        *,
        on_text: OnText | None = None,
    ) -> str:
        """The next question; "" where there is nothing to ask.

        Args:
            task: The agent and its task.
            turns: The conversation.
            done: What the agent has done, in words.
            goals: The likeliest ones.
            on_text: Called with the question as it grows, where it is written when it is asked.
        """
        ...


class Human(Protocol):
    """Whoever answers the agent."""

    def reply(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """The person's words in answer to `query`."""
        ...


def ask(
    writer: Asker,
    env: Environment,
    turns: Sequence[Turn],
    done: str,
    goals: Sequence[str],
    on_text: OnText | None = None,
) -> str:
    """The agent's next question; none is asked twice.

    Args:
        writer: Writes it.
        env: Where the agent acts.
        turns: The conversation.
        done: What the agent has done, in words.
        goals: The likeliest ones.
        on_text: Called with the question as it grows.
    """
    if not turns:
        return OPENING
    question = question_of(writer.question(env.task, turns, done, goals, on_text=on_text))
    asked = {question_of(turn.query) for turn in turns}
    return question if question.endswith("?") and question not in asked else FALLBACK


def question_of(text: str) -> str:
    """The last question in `text`, on one line; all of it where there is none."""
    line = " ".join(text.split()).strip('" ')
    head, mark, _ = line.partition("?")
    if not mark:
        return line
    for end in (". ", "! ", ": "):
        head = head.rpartition(end)[2]
    return head.strip('" ') + "?"


def _with_status(model: LanguageModel, name: str, status: str, **values: object) -> list[Message]:
    """The prompt with the state; without it where that is too long to leave room for a reply."""
    prompt = render(name, status=status, **values)
    if model.count_tokens(prompt) + _REPLY <= model.context_size:
        return prompt
    return render(name, status="", **values)


class ConsoleHuman:
    """A person at the terminal, or behind any function that shows a query and returns words."""

    def __init__(self, read: Callable[[str], str]) -> None:
        self.read = read

    def reply(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """Ask until the words can be used; what is wrong with them is said in the next query."""
        hint = ""
        while True:
            try:
                return checked_text(self.read(query + hint), "reply")
            except InvalidInputError as error:
                hint = f"\n({error})"


def completes(env: Environment, said: str) -> bool:
    """Whether words end with the phrase that ends the task."""
    return said.casefold().rstrip(" .!\"'").endswith(env.completion_phrase.casefold())


def consents(query: str, turns: Sequence[Turn], env: Environment, *, done: bool) -> str:
    """What a person of a profile answers who is asked to confirm something; "" where they are not.

    They agree, but to the end of the task only when they are done.

    Args:
        query: The question.
        turns: The conversation before it.
        env: Where the agent acts.
        done: Whether they have nothing more to say.
    """
    if not query.endswith(CONFIRM):
        return ""
    ends = any(f'"{verb.name}"' in query for verb in env.verbs if not verb.slots)
    return DECLINES if ends and not done else AGREES


class ScriptedHuman:
    """Says the replies that its profile lists, in order, and then the completion phrase.

    Asked to confirm what cannot be undone, it agrees first; but while it has more to say, not to
    the end of the task.
    """

    def __init__(self, profile: Profile, env: Environment) -> None:
        self.profile = profile
        self.env = env

    def reply(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """The reply for this round."""
        replies = self.profile.replies
        said = sum(turn.utterance not in (AGREES, DECLINES) for turn in turns)
        if consent := consents(query, turns, self.env, done=said >= len(replies)):
            return consent
        return replies[said] if said < len(replies) else self.env.completion_phrase


class SimulatedHuman:
    """A model that plays the person of a profile (Sec. 4.2)."""

    def __init__(self, model: Generator, profile: Profile, env: Environment, seed: int = 0) -> None:
        self.model = model
        self.profile = profile
        self.env = env
        self.seed = seed

    def reply(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """What the model says as this person; the completion phrase if it falls silent.

        To what is to be confirmed they agree, but to the end of the task only once they asked for
        it.
        """
        ended = bool(turns) and completes(self.env, turns[-1].utterance)
        consent = consents(query, turns, self.env, done=ended)
        return consent or self.answer(query, turns, status)

    def answer(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """What the model says as this person, where nothing is to be confirmed."""
        said = self.speak(self.profile.description, query, turns, status)
        return said or self.env.completion_phrase

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
        """What the model says as the person of a description; empty if it says nothing.

        Args:
            description: What the person wants, as far as they know.
            query: The agent's question.
            turns: The conversation before it, as far as the person remembers.
            status: The environment's status.
            words: Most words that the person is asked to say; None for a sentence or two.
            max_tokens: Most tokens to write.
        """
        past = recent(self.model, turns, 8)
        *before, last = _with_status(
            self.model,
            "human",
            status,
            description=" ".join(description.split()),
            completion_phrase=self.env.completion_phrase,
            turns=past,
            query=query,
            words=words,
        )
        prompt = [*before, *transcript(past), last]
        reply = self.model.generate(
            prompt, max_tokens=max_tokens, stop=("\n",), seed=self.seed + len(turns)
        )
        return " ".join(reply.text.split()).strip('" ')
