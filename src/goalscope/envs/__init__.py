"""What an environment offers the agent (Sec. 4.2), after Gymnasium's reset and step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, cast

from goalscope.types import Action, GoalscopeError, Profile, StepResult, Turn

__all__ = ["GUESSED", "MAY_LACK", "SEARCH", "Environment", "Reversal", "missing", "taken"]

GUESSED = "Guessed, not asked for: "
"""How a note begins that tells what was guessed."""

SEARCH = "search inventory"
"""Name of the action that only looks something up, in every domain."""


Reversal = tuple[list[Action], list[str]]
"""What brings back what was changed, and a sentence for each change that nothing brings back."""

MAY_LACK = frozenset(
    {"notes", "close", "is_order", "unmet", "permission", "reversal", "answer"}
    | {"completion_actions"}
)
"""What a class that inherits from `Environment` may leave out."""


class Environment(Protocol):
    """A domain in which the agent acts.

    A class that inherits from it may leave out what it has no use for of `MAY_LACK`.
    """

    @property
    def task(self) -> str:
        """The agent and its task in one or two sentences, for prompts."""
        ...

    @property
    def notes(self) -> Sequence[str]:
        """What a person should know about what was loaded, one sentence each."""
        return ()

    @property
    def completion_phrase(self) -> str:
        """What a person says to end the task."""
        ...

    def reset(self) -> None:
        """Go back to the start."""
        ...

    def close(self) -> None:
        """Let go of whatever runs behind it."""

    def fingerprint(self) -> str:
        """A text that is the same for the same state, and for no other."""
        ...

    def status(self) -> str:
        """The present state, for people and prompts."""
        ...

    def kinds(self, text: str, limit: int) -> list[str]:
        """Generic names of things here that may serve `text`, nearest first."""
        ...

    def mentioned(self, utterances: Sequence[str]) -> list[str]:
        """Generic names of things here that the person spoke of, and did not refuse."""
        ...

    def actions(self, relevant: Sequence[str], turns: Sequence[Turn] = ()) -> list[Action]:
        """The actions that are possible now, given search terms or object names.

        What the person ruled out in `turns` is not possible.
        """
        ...

    def requests(self, turns: Sequence[Turn]) -> list[Action]:
        """What the person asks for outright and lacks, and the mending of what they refuse."""
        ...

    def is_order(self, turns: Sequence[Turn]) -> bool:
        """Whether the newest words leave nothing to guess.

        They say exactly what is to be done, are orders that nobody here can follow, or call off,
        put off, refuse or ask something without any aim besides.
        """
        return False

    def unmet(self, turns: Sequence[Turn], results: Sequence[StepResult]) -> list[str]:
        """What the newest turn asks for outright and did not get, one sentence each.

        The present state is that after `results`, which were done for this turn; what failed or
        waits for leave is told elsewhere.
        """
        return []

    def permission(self, action: Action, turns: Sequence[Turn]) -> str:
        """What to ask before the action may be taken; empty where it may be taken now.

        An act that nobody can undo needs the person's word in `turns`.
        """
        return ""

    def reversal(
        self, results: Sequence[StepResult], before: Sequence[StepResult], turns: Sequence[Turn]
    ) -> Reversal | None:
        """What brings back what a person wants undone; None where nothing is undone here.

        Without any results it only tells whether anything is.

        Args:
            results: What is to be undone.
            before: Everything that was done before `results`, in order. What was done after them
                has been undone, or changed nothing that they changed.
            turns: What the person said, where what is taken back is a `TakenBack`; the newest is
                what they said besides asking to undo. There may be none.
        """
        return None

    def step(self, action: Action) -> StepResult:
        """Take one action. An impossible one changes nothing and says why."""
        ...

    def answer(self, question: str, turns: Sequence[Turn] = ()) -> str | None:
        """Answer a person's question; None where it is no such question.

        Args:
            question: What they ask.
            turns: What was said so far, as far as the answer may rest on it.
        """
        return None

    def is_completion(self, turn: Turn) -> bool:
        """Whether the person, in this context, says that the task is complete."""
        ...

    def completion_actions(self) -> list[Action]:
        """What to do when the person says that the task is complete."""
        return []

    def checks_met(self, profile: Profile) -> list[bool]:
        """Which of the profile's checks the present state meets, in their order."""
        ...


def missing(env: object) -> list[str]:
    """Names of what agents call, and `env` does not have."""
    return [
        name
        for name, stub in vars(Environment).items()
        if not name.startswith("_")
        and (
            not hasattr(env, name)
            or (name not in MAY_LACK and getattr(type(env), name, None) is stub)
        )
    ]


def taken(env: Environment, action: Action) -> StepResult:
    """Take one action.

    Raises:
        GoalscopeError: The environment gives something else than a `StepResult`.
    """
    result = cast("object", env.step(action))
    if not isinstance(result, StepResult):
        raise GoalscopeError(
            f"`step` of {type(env).__name__} must return a StepResult(action, ok, observation), "
            f"not {result!r}, for {action}."
        )
    return result
