"""Types that the whole package shares: goals, turns, messages, actions and errors."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from goalscope.base.text import JOINERS, plain


class GoalscopeError(Exception):
    """Every error that goalscope raises on purpose; the message says what to do."""


class InvalidInputError(GoalscopeError, ValueError):
    """Something that a person gave (text, a file, an option) cannot be used as it is."""


class ConflictError(GoalscopeError):
    """The state has changed, perhaps because somebody else was faster."""


class ModelError(GoalscopeError):
    """A language model is missing or broken, or its answer cannot be used."""


class UnreadableAnswerError(ModelError):
    """A language model answered in another form than it was asked for."""


_UNSEEN = frozenset({"Cc", "Cf", "Zs", "Zl", "Zp"})  # controls, format characters, spaces


def readable(text: object, what: str) -> str:
    """Return `text`, perhaps empty, if it is text that can be encoded.

    Raises:
        InvalidInputError: It is no text, as JSON may hold, or has a lone surrogate.
    """
    if not isinstance(text, str):
        raise InvalidInputError(f"The {what} must be a text, not {type(text).__name__}.")
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise InvalidInputError(
            f"The {what} holds a broken character at position {error.start} (a lone surrogate). "
            "Type it again, or save the file as UTF-8."
        ) from None
    return text


def checked_text(text: object, what: str, longest: int | None = None) -> str:
    """Return `text` without surrounding whitespace if a model can read it.

    Args:
        text: From a person, a file or another program.
        what: Its name in errors.
        longest: Largest number of characters; None for no limit.

    Raises:
        InvalidInputError: `text` is not `readable`, empty, or too long.
    """
    text = readable(text, what)
    if longest is not None and len(text) > longest:
        raise InvalidInputError(f"The {what} is longer than {longest} characters. Make it shorter.")
    if all(unicodedata.category(each) in _UNSEEN for each in text):
        raise InvalidInputError(f"The {what} is empty. Give at least one word.")
    return text.strip()


def pluralize(number: int, noun: str) -> str:
    """A number of things: "1 turn", "2,000 turns"."""
    return f"{number:,} {noun}" + "s" * (number != 1)


def shortlist(told: Sequence[str], most: int) -> str:
    """The first of a list, as in a sentence, and how many more there are."""
    more = f" and {len(told) - most} more" if len(told) > most else ""
    return ", ".join(told[:most]) + more


def canonical(text: str) -> str:
    """A goal's text apart from case, spaces, joiners, the final mark and how it was typed.

    How it was typed is what `plain` leaves out. Joiners shape words; most people leave some out.
    """
    words = plain(text).translate(dict.fromkeys(map(ord, JOINERS))).casefold().split()
    return " ".join(words).rstrip(".!? ")


@dataclass(frozen=True, slots=True)
class Goal:
    """One hypothesis about what the person wants, in natural language (Sec. 3.2)."""

    text: str

    def __str__(self) -> str:
        return self.text


TRACKING = "tracking"
"""Domain of episodes in which another program talks and acts; see `goalscope.storage.tracking`."""

UNSPECIFIED = Goal("Unspecified")
"""The person with no stated goal. If it is the likeliest, the true goal is missing (Sec. 3.2)."""


def distinct(goals: Iterable[Goal], known: Iterable[Goal] = (UNSPECIFIED,)) -> list[Goal]:
    """Goals without repeats by `canonical`; a known goal stands for its repeats."""
    known = dict.fromkeys(known)
    same = {canonical(goal.text): goal for goal in known}
    return list(
        dict.fromkeys(
            goal if goal in known else same.setdefault(canonical(goal.text), goal) for goal in goals
        )
    )


def goals_of(goals: Iterable[str | Goal], longest: int | None = None) -> list[Goal]:
    """The goals of a list of texts or goals, each of at most so many characters.

    Raises:
        InvalidInputError: It is a single text, a goal is empty, broken or too long, or two are the
            same by `canonical`.
    """
    if isinstance(goals, str):  # an iterable of texts, too
        raise InvalidInputError(f"goals must be a list of texts, not {goals!r}")
    found: dict[str, str] = {}
    for number, goal in enumerate(goals, 1):
        text = checked_text(goal.text if isinstance(goal, Goal) else goal, "goal", longest)
        same = found.setdefault(canonical(text), text)
        if len(found) < number:
            how = "stands twice among the goals" if same == text else f"is the same as {same!r}"
            raise InvalidInputError(f"{text!r} {how}. Leave one out.")
    return [Goal(text) for text in found.values()]


@dataclass(frozen=True, slots=True)
class Turn:
    """The agent's question and the person's reply; a transcript is a sequence of turns."""

    query: str
    utterance: str

    def plain(self) -> Turn:
        """The turn as models read it; see `goalscope.base.text.plain`."""
        return Turn(plain(self.query), plain(self.utterance))


@dataclass(frozen=True, slots=True)
class Message:
    """One chat message for a language model. The content is data: it never holds control tokens."""

    role: Literal["system", "user", "assistant"]
    content: str


@dataclass(frozen=True, slots=True)
class Action:
    """One action of an environment, such as `Action("add item", "Whole Milk, 1 L", 2)`.

    Attributes:
        name: What is done.
        target: The thing it is done to.
        quantity: How many of them.
        destination: Where the thing goes, if the action moves it.
        irreversible: Whether it cannot be undone, in the state for which the environment made it.
            Two actions are equal whether or not they say so.
    """

    name: str
    target: str = ""
    quantity: int = 1
    destination: str = ""
    irreversible: bool = field(default=False, compare=False, repr=False)

    @property
    def things(self) -> tuple[str, ...]:
        """The names of what it is done to and of where that goes, as far as it has them."""
        return tuple(filter(None, (self.target, self.destination)))

    def __str__(self) -> str:
        times = f" x{self.quantity}" if self.quantity != 1 else ""
        to = f" -> {self.destination}" if self.destination else ""
        return f"{self.name}: {self.target}{times}{to}" if self.target else self.name


@dataclass(frozen=True, slots=True)
class StepResult:
    """The result of one action.

    Attributes:
        action: The action.
        ok: Whether it succeeded; if not, nothing has changed.
        observation: What happened, or why it failed.
        terminated: Whether it completed the task.
        irreversible: Whether it succeeded and cannot be undone, such as a slice or a purchase.
    """

    action: Action
    ok: bool
    observation: str
    terminated: bool = False
    irreversible: bool = False


@dataclass(frozen=True, slots=True)
class GoalChange:
    """A goal that was added, removed or confirmed, and why.

    Attributes:
        kind: What happened.
        goal: The goal.
        reason: Why, for people.
        final: Whether a removed goal stays out, whatever is said later.
        source: Who added the goal: the model proposed it, the person named it, or a program listed
            it.
    """

    kind: Literal["added", "removed", "pinned"]
    goal: Goal
    reason: str
    final: bool = False
    source: Literal["model", "person", "program"] = "model"


@dataclass(frozen=True, slots=True)
class Profile:
    """A simulated person (Sec. 4.2): what they want, and what the scripted one says.

    Attributes:
        name: Short name for `--profile`.
        description: What the person wants; a simulated human sees it, the agent never does.
        replies: What the scripted human says, in order, before the completion phrase.
        checks: Conditions on the final state, in the form that the environment documents.
        scene: Name of the place, in environments that have several.
        welcome: Things that are fine in the outcome besides what the checks ask for, in the form
            that the environment documents.
    """

    name: str
    description: str
    replies: tuple[str, ...]
    checks: tuple[Mapping[str, Any], ...] = field(default=())
    scene: str = ""
    welcome: tuple[str, ...] = ()
