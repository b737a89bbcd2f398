"""What an environment offers the agent (Sec. 4.2), after Gymnasium's reset and step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, cast

from goalscope.occasions import Occasion
from goalscope.orders import Example, Order, Verb
from goalscope.standing import Standing
from goalscope.types import Action, GoalscopeError, Profile, StepResult

__all__ = ["GUESSED", "MAY_LACK", "SEARCH"]
__all__ += ["Environment", "Pick", "Resolution", "execute", "missing"]

GUESSED = "Guessed, not asked for: "
"""How a note begins that tells what was guessed."""

SEARCH = "search inventory"
"""Name of the action that only looks something up, in every domain."""

MAY_LACK = frozenset(
    {
        "examples",
        "notes",
        "close",
        "fingerprint",
        "lasting",
        "actions",
        "phrase",
        "serving",
        "kind",
        "like",
        "agreed",
        "here",
        "undo",
        "answer",
        "unwanted",
    }
)
"""What a class that inherits from `Environment` may leave out."""

Pick = Callable[[str, Sequence[str]], str]
"""Which of some names a person's words mean, as the model finds; "" where it is none of them."""


@dataclass(frozen=True, slots=True)
class Resolution:
    """What an order comes to, here and now.

    Attributes:
        actions: What does it, in order.
        why: One sentence that says what of it cannot be done and why, or that it is so already;
            "" where the actions do all of it.
    """

    actions: tuple[Action, ...] = ()
    why: str = ""


class Environment(Protocol):
    """A domain in which the agent acts.

    A class that inherits from it may leave out what it has no use for of `MAY_LACK`. It declares
    what can be asked for, and reads no words itself: orders come to it as they were understood.
    """

    @property
    def task(self) -> str:
        """The agent and its task in one or two sentences, for prompts."""
        ...

    @property
    def verbs(self) -> Sequence[Verb]:
        """What can be asked for; besides, there are the dialogue acts of `goalscope.orders`."""
        ...

    @property
    def examples(self) -> Sequence[Example]:
        """Some readings, for a model that was not taught to read."""
        return ()

    @property
    def completion_phrase(self) -> str:
        """What a person says to end the task."""
        ...

    @property
    def notes(self) -> Sequence[str]:
        """What a person should know about what was loaded, one sentence each."""
        return ()

    def reset(self) -> None:
        """Go back to the start."""
        ...

    def close(self) -> None:
        """Let go of whatever runs behind it."""

    def status(self) -> str:
        """The present state, for people and prompts."""
        ...

    def fingerprint(self) -> str:
        """A text that is the same for the same state, and for no other."""
        return self.status()

    def step(self, action: Action) -> StepResult:
        """Take one action. An impossible one changes nothing and says why."""
        ...

    def resolve(self, order: Order, standing: Standing, pick: Pick) -> Resolution:
        """What an order comes to: actions, or one sentence that says why not.

        The order is by a verb of the domain, or a limit ("avoid", "only", "budget", "leave"), for
        which the actions mend what is against it.

        Args:
            order: What was asked for.
            standing: What holds, this order included.
            pick: Finds which of the names here is meant.
        """
        ...

    def lasting(self, action: Action) -> bool:
        """Whether nobody could undo the action; by default, where its verb says so."""
        return any(verb.irreversible and verb.name == action.name for verb in self.verbs)

    def offers(self, text: str, limit: int) -> list[str]:
        """Generic names of things here that may serve `text`, nearest first."""
        ...

    def actions(self, name: str, standing: Standing) -> list[Action]:
        """What may be done with things of a generic name though nobody asked, best first.

        What the person ruled out is not in it.
        """
        return []

    def phrase(self, action: Action) -> str:
        """The action in words."""
        return str(action)

    def serving(self, need: str, standing: Standing) -> list[Action]:
        """What does one thing that an aim calls for, such as "flour"; none where nothing does.

        Args:
            need: As occasions and the writer have it (see `like`); by default, a generic name.
            standing: What holds.
        """
        return self.actions(need, standing)[:1]

    def kind(self, action: Action) -> str:
        """The same for actions of which one serves a need as well as another: a need, if any."""
        return self.phrase(action)

    def like(self, text: str, most: int) -> list[Occasion]:
        """Occasions like what a text tells, nearest first, with needs that may be served here."""
        return []

    @property
    def agreed(self) -> float:
        """Share of the occasions like what was said that must call for something to be done."""
        return 0.4

    def here(self) -> str:
        """What is here, in words, where what an aim calls for depends on it."""
        return ""

    def undo(self, results: Sequence[StepResult], standing: Standing) -> Resolution | None:
        """What brings back what some results changed, and a sentence on what nothing brings back.

        None where nothing is undone here.

        Args:
            results: What is to be undone: the last that was done.
            standing: What holds without it.
        """
        return None

    def answer(self, order: Order, standing: Standing, pick: Pick) -> str:
        """The facts of the thing that a question is about; "" where there are none.

        Args:
            order: The question: `what` and `where` name the thing, or nothing for all.
            standing: What holds.
            pick: Finds which of the names here is meant.
        """
        return ""

    def checks_met(self, profile: Profile) -> list[bool]:
        """Which of the profile's checks the present state meets, in their order."""
        ...

    def unwanted(self, profile: Profile) -> list[str]:
        """Names of what came about that neither the profile's checks nor its `welcome` ask for."""
        return []


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


def execute(env: Environment, action: Action) -> StepResult:
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
