"""The Conversation Module (Sec. 3.2): the agent's queries, and the people who answer them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal, Protocol

from goalscope.agent.guards import SAY_YES
from goalscope.base.text import plain
from goalscope.base.types import InvalidInputError, Message, Profile, Turn, checked_text
from goalscope.envs import Environment, completion_phrase
from goalscope.models import Generator, LanguageModel
from goalscope.prompts import recent, render, transcript

AGREES, DECLINES = "Yes.", "No, not yet."
"""What the person of a profile answers when asked to confirm something."""

OPENING = "What can I help you with?"
FALLBACK = "What else would you like?"
"""The query if there is no better one."""

Habit = Literal[
    "terse", "distracted", "changes-mind", "volunteers-late", "forgets", "drifts", "tells-little",
    "bluffs",
]  # fmt: skip
"""A habit that makes a simulated person harder to understand than the paper's.

The last four never state their goal ("Future Work" of the paper).
"""

_UNSAID = "You never say what you want, only what follows from it."

HABITS: Mapping[Habit, str] = {
    "terse": "You never say more than six words at a time.",
    "distracted": "In every third message you only make a remark about something else, such as the "
    "weather or a neighbour.",
    "changes-mind": "In your first two messages you want something quite different. In the third "
    "you say that you have changed your mind.",
    "volunteers-late": "In your first two messages you only say roughly what you want. You tell "
    "the details later.",
    "forgets": f"{_UNSAID} You forget what you have said, and repeat or contradict it.",
    "drifts": f"{_UNSAID} What you talk about moves on a little with each question.",
    "tells-little": f"{_UNSAID} You tell one small detail at a time, and only what is asked for.",
    "bluffs": f"{_UNSAID} You pretend that something else matters more to you, so that nobody "
    "guesses it.",
}
"""What the model that plays a person is told of their habit."""

_HEAT = 0.7
"""Temperature of the replies of a person with a seed."""
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


def person_prompt(
    model: LanguageModel,
    *,
    task: str,
    description: str,
    habit: Habit | None = None,
    completion_phrase: str = "",
    turns: Sequence[Turn],
    query: str,
    status: str = "",
) -> list[Message]:
    """The prompt by which a model plays a person (Sec. 3.2), whose next words answer `query`.

    The oldest turns are left out where the model could not read them all, and the status where it
    would leave no room for a reply.
    """
    past = recent(model, turns, 20)
    for shown in (status, ""):
        *before, last = render(
            "human",
            task=task,
            status=shown,
            description=" ".join(description.split()),
            habit=HABITS[habit] if habit else "",
            completion_phrase=completion_phrase,
            turns=past,
            query=query,
        )
        prompt = [*before, *transcript(past), last]
        if model.count_tokens(prompt) + _REPLY <= model.context_size:
            break
    return prompt


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


def completes(env: Environment, said: str, *, alone: bool = False) -> bool:
    """Whether an utterance ends with the phrase that ends the task, or is nothing else."""
    words = " ".join(plain(said).casefold().split()).strip(" .!\"'*_")
    phrase = completion_phrase(env).casefold()
    return words == phrase if alone else words.endswith(phrase)


def consents(query: str, env: Environment, *, done: bool) -> str:
    """What the person of a profile answers to a request to confirm; "" to any other query.

    They agree, but to the end of the task only when they have nothing more to say (`done`).
    """
    if not query.endswith(SAY_YES):
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
        said = sum(not turn.query.endswith(SAY_YES) for turn in turns)
        if consent := consents(query, self.env, done=said >= len(replies)):
            return consent
        return replies[said] if said < len(replies) else completion_phrase(self.env)


class SimulatedHuman:
    """A model that plays the person of a profile (Sec. 4.2).

    Args:
        model: Plays them.
        profile: Who they are.
        env: Where they are.
        seed: Of the model's replies; 0 for the likeliest words, as in the paper.
        habit: How they speak; see `HABITS`.
    """

    def __init__(
        self,
        model: Generator,
        profile: Profile,
        env: Environment,
        seed: int = 0,
        habit: Habit | None = None,
    ) -> None:
        self.model = model
        self.profile = profile
        self.env = env
        self.seed = seed
        self.habit: Habit | None = habit

    def reply(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """What the model says as this person; the completion phrase if it says nothing.

        Requests to confirm something are answered by `consents`.
        """
        ended = bool(turns) and completes(self.env, turns[-1].utterance)
        if consent := consents(query, self.env, done=ended):
            return consent
        prompt = person_prompt(
            self.model,
            task=self.env.task,
            description=self.profile.description,
            habit=self.habit,
            completion_phrase=completion_phrase(self.env),
            turns=turns,
            query=query,
            status=status,
        )
        reply = self.model.generate(
            prompt,
            max_tokens=_REPLY,
            temperature=_HEAT if self.seed else 0.0,
            stop=("\n",),
            seed=self.seed + len(turns),
        )
        return " ".join(reply.text.split()).strip('" ') or completion_phrase(self.env)
