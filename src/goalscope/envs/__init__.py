"""The interface of environments (Sec. 4.2), modelled on Gymnasium's reset and step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

from goalscope.base.types import Action, GoalscopeError, Profile, StepResult
from goalscope.envs.scenarios import Scenario
from goalscope.language.dialogue_state import DialogueState
from goalscope.language.orders import Example, Order, Verb

__all__ = ["GUESSED", "MENTIONED", "REQUIRED", "SEARCH"]
__all__ += ["Environment", "Pick", "Resolution"]
__all__ += ["execute", "met_checks", "missing", "resolution_of", "scenarios_like"]

GUESSED = "Guessed, not asked for: "
"""Prefix of notes about guessed actions."""

MENTIONED = "Because you mentioned it: "
"""Prefix of notes about actions that nobody ordered, for things that the person named."""

SEARCH = "search inventory"
"""Name of the action that only looks something up, in all domains."""

REQUIRED = ("task", "verbs", "reset", "status", "step", "resolve", "offers")
"""The members of `Environment` without a default."""

Pick = Callable[[str, Sequence[str]], str]
"""Picks the name that a person's words mean, by the model; "" for none of them."""


@dataclass(frozen=True, slots=True)
class Resolution:
    """The resolution of an order in the current state.

    Attributes:
        actions: The actions that carry it out, in order.
        why: One sentence on what cannot be done and why, or that it is already so; "" if the
            actions do all of it.
    """

    actions: tuple[Action, ...] = ()
    why: str = ""


class Environment:
    """A domain that the agent acts in; subclasses must define the members of `REQUIRED`.

    It declares its verbs and never parses language: orders arrive already read.

    Attributes:
        task: The agent and its task in one or two sentences, for prompts.
        verbs: The verbs of orders, besides the dialogue acts of `goalscope.language.orders`.
        examples: Example readings, for models not fitted for reading.
        completion_phrase: The words that end the task.
        notes: Notes for the person about what was loaded, one sentence each.
        agreed: Share of similar occasions that must need something before it is guessed.
    """

    task: str
    verbs: Sequence[Verb]
    examples: Sequence[Example] = ()
    completion_phrase: str = "That is all"
    notes: Sequence[str] = ()
    agreed: float = 0.4

    def reset(self) -> None:
        """Go back to the start."""
        raise NotImplementedError

    def close(self) -> None:
        """Stop background processes."""

    def status(self) -> str:
        """The current state, for people and prompts."""
        raise NotImplementedError

    def fingerprint(self) -> str:
        """A text that identifies the state: equal if and only if the states are equal."""
        return self.status()

    def step(self, action: Action) -> StepResult:
        """Execute an action. An impossible one changes nothing and says why."""
        raise NotImplementedError

    def resolve(self, order: Order, standing: DialogueState, pick: Pick) -> Resolution:
        """Resolve an order to actions, or to one sentence that says why not.

        The order has a verb of the domain, or is a limit ("avoid", "only", "budget", "leave"), for
        which the actions undo violations; `Resolution()` if there are none.

        Args:
            order: What was asked for.
            standing: What holds, this order included.
            pick: Finds which of the names here is meant.
        """
        raise NotImplementedError

    def lasting(self, action: Action) -> bool:
        """Whether the action cannot be undone now; by default, as declared by its verb.

        The agent asks before such an action, and never guesses one.
        """
        return any(verb.irreversible and verb.name == action.name for verb in self.verbs)

    def offers(self, text: str, limit: int) -> list[str]:
        """Generic names of available things that may serve `text`, nearest first."""
        raise NotImplementedError

    def actions(self, name: str, standing: DialogueState) -> list[Action]:
        """Actions that may be guessed for things of a generic name, best first.

        Excludes what the person ruled out.
        """
        return []

    def phrase(self, action: Action) -> str:
        """The action in words."""
        return str(action)

    def serving(self, need: str, standing: DialogueState) -> list[Action]:
        """The actions for one need of an aim, such as "flour"; empty if there are none.

        Args:
            need: As named by occasions and the writer (see `like`); by default, a generic name.
            standing: What holds.
        """
        return self.actions(need, standing)[:1]

    def kind(self, action: Action) -> str:
        """A key shared by actions that serve a need equally well: the need, if there is one."""
        return self.phrase(action)

    def like(self, text: str, most: int) -> list[Scenario]:
        """Scenarios similar to a text, nearest first, with needs that can be served here."""
        return []

    def here(self) -> str:
        """A description of what is here, if the needs of aims depend on it."""
        return ""

    def undo(self, results: Sequence[StepResult], standing: DialogueState) -> Resolution | None:
        """The actions that undo some results, and a sentence on what cannot be undone.

        None if nothing can be undone here.

        Args:
            results: The latest results.
            standing: What holds without it.
        """
        return None

    def answer(self, order: Order, standing: DialogueState, pick: Pick) -> str:
        """The facts about the thing in a question; "" if there are none.

        Args:
            order: The question: `what` and `where` name the thing, or nothing for all.
            standing: What holds.
            pick: Finds which of the names here is meant.
        """
        return ""

    def caution(self, results: Sequence[StepResult], standing: DialogueState) -> str:
        """What to warn of after orders were carried out, in one line; "" for nothing.

        Args:
            results: Of the orders.
            standing: What holds.
        """
        return ""

    def mentions(self, text: str) -> list[str]:
        """The things here that a text names, as in "is oat milk dearer than soy milk?".

        A question is answered for each of them, and what was guessed is told apart from them.
        """
        return []

    def checks_met(self, profile: Profile) -> list[bool]:
        """Whether the current state meets each of the profile's checks, in order."""
        return []

    def unwanted(self, profile: Profile) -> list[str]:
        """Names of results that neither the profile's checks nor its `welcome` list includes."""
        return []


def missing(env: Environment) -> list[str]:
    """The members of `REQUIRED` that an environment lacks."""
    return [
        name
        for name in REQUIRED
        if getattr(env, name, None) is None
        or getattr(type(env), name, None) is vars(Environment).get(name, env)
    ]


def execute(env: Environment, action: Action) -> StepResult:
    """Take one action.

    Raises:
        GoalscopeError: The environment does not return a `StepResult`.
    """
    result = cast("object", env.step(action))
    if not isinstance(result, StepResult):
        raise GoalscopeError(
            f"`step` of {type(env).__name__} must return a StepResult(action, ok, observation), "
            f"not {result!r}, for {action}."
        )
    return result


def resolution_of(env: Environment, member: str, found: object) -> Resolution:
    """What `resolve` or `undo` gave, if it is a resolution.

    Raises:
        GoalscopeError: It is something else.
    """
    if not isinstance(found, Resolution):
        raise _wrong(env, member, "a Resolution(actions, why)", found)
    if not isinstance(cast("object", found.why), str):
        raise _wrong(env, member, "a Resolution whose `why` is a text", found)
    if not _is_list(found.actions, Action):
        raise _wrong(env, member, "a Resolution with a tuple of actions, as in (action,)", found)
    for each in found.actions:
        texts = (each.name, each.target, each.destination)
        if type(each.quantity) is not int or not _is_list(texts, str):
            raise _wrong(env, member, "actions of texts, with an int as the quantity", each)
    return found


def scenarios_like(env: Environment, text: str, most: int) -> list[Scenario]:
    """The occasions that `env.like` finds.

    Raises:
        GoalscopeError: It gives something else.
    """
    found = env.like(text, most)
    if not _is_list(found, Scenario):
        raise _wrong(env, "like", "a list of Scenarios (see goalscope.envs.scenarios)", found)
    return [*found]


def met_checks(env: Environment, profile: Profile) -> list[bool]:
    """Which checks of a profile are met, in their order; none where the domain does not score.

    Raises:
        GoalscopeError: `env.checks_met` gives something else.
    """
    found = env.checks_met(profile)
    if not _is_list(found, bool) or len(found) not in (0, len(profile.checks)):
        wanted = f"a list of {len(profile.checks)} bools, one for each check of {profile.name}"
        raise _wrong(env, "checks_met", wanted, found)
    return found


def _is_list(found: object, kind: type) -> bool:
    """Whether it is a list or tuple of nothing but this kind."""
    return isinstance(found, list | tuple) and all(
        isinstance(each, kind) for each in cast("Sequence[object]", found)
    )


def _wrong(env: Environment, member: str, wanted: str, found: object) -> GoalscopeError:
    return GoalscopeError(
        f"`{member}` of {type(env).__name__} must return {wanted}, not {found!r}."
    )
