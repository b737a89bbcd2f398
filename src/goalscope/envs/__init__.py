"""What an environment offers the agent (Sec. 4.2), after Gymnasium's reset and step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

from goalscope.occasions import Occasion
from goalscope.orders import Example, Order, Verb
from goalscope.standing import Standing
from goalscope.types import Action, GoalscopeError, Profile, StepResult

__all__ = ["GUESSED", "REQUIRED", "SEARCH"]
__all__ += ["Environment", "Pick", "Resolution"]
__all__ += ["execute", "met_checks", "missing", "occasions_like", "resolution_of"]

GUESSED = "Guessed, not asked for: "
"""How a note begins that tells what was guessed."""

SEARCH = "search inventory"
"""Name of the action that only looks something up, in every domain."""

REQUIRED = ("task", "verbs", "reset", "status", "step", "resolve", "offers")
"""The members of `Environment` that have no default."""

Pick = Callable[[str, Sequence[str]], str]
"""Which of some names a person's words mean, as the model finds; "" where it is none of them."""


@dataclass(frozen=True, slots=True)
class Resolution:
    """What an order comes to, here and now.

    Attributes:
        actions: The actions that carry it out, in order.
        why: One sentence that says which part cannot be done and why, or that it is so already;
            "" where the actions do all of it.
    """

    actions: tuple[Action, ...] = ()
    why: str = ""


class Environment:
    """A domain in which the agent acts; the members of `REQUIRED` are a domain's own.

    It declares what can be asked for, and reads no words: orders come to it as they were
    understood.

    Attributes:
        task: The agent and its task in one or two sentences, for prompts.
        verbs: What can be asked for, besides the dialogue acts of `goalscope.orders`.
        examples: Some readings, for a model that was not taught to read.
        completion_phrase: What a person says to end the task.
        notes: What a person should know about what was loaded, one sentence each.
        agreed: Share of the occasions like what was said that must call for something before it is
            done unasked.
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
        """Stop whatever runs behind it."""

    def status(self) -> str:
        """The present state, for people and prompts."""
        raise NotImplementedError

    def fingerprint(self) -> str:
        """A text that is the same for the same state, and for no other."""
        return self.status()

    def step(self, action: Action) -> StepResult:
        """Take one action. An impossible one changes nothing and says why."""
        raise NotImplementedError

    def resolve(self, order: Order, standing: Standing, pick: Pick) -> Resolution:
        """What an order comes to: actions, or one sentence that says why not.

        The order is by a verb of the domain, or a limit ("avoid", "only", "budget", "leave"), for
        which the actions undo what violates it; `Resolution()` where nothing does.

        Args:
            order: What was asked for.
            standing: What holds, this order included.
            pick: Finds which of the names here is meant.
        """
        raise NotImplementedError

    def lasting(self, action: Action) -> bool:
        """Whether nobody could undo the action now; by default, where the verb of its name says so.

        The agent asks before such an action, and never guesses one.
        """
        return any(verb.irreversible and verb.name == action.name for verb in self.verbs)

    def offers(self, text: str, limit: int) -> list[str]:
        """Generic names of things here that may serve `text`, nearest first."""
        raise NotImplementedError

    def actions(self, name: str, standing: Standing) -> list[Action]:
        """What may be done unasked with things of a generic name, best first.

        What the person ruled out is not among it.
        """
        return []

    def phrase(self, action: Action) -> str:
        """The action in words."""
        return str(action)

    def serving(self, need: str, standing: Standing) -> list[Action]:
        """The actions for one thing that an aim calls for, such as "flour"; none if there are none.

        Args:
            need: As occasions and the writer name it (see `like`); by default, a generic name.
            standing: What holds.
        """
        return self.actions(need, standing)[:1]

    def kind(self, action: Action) -> str:
        """The same for actions that serve a need equally well: the need, if there is one."""
        return self.phrase(action)

    def like(self, text: str, most: int) -> list[Occasion]:
        """Occasions like what a text tells, nearest first, with needs that may be served here."""
        return []

    def here(self) -> str:
        """What is here, in words, if what an aim calls for depends on it."""
        return ""

    def undo(self, results: Sequence[StepResult], standing: Standing) -> Resolution | None:
        """What reverses some results, and a sentence on what cannot be reversed.

        None if nothing can be undone here.

        Args:
            results: The last that was done.
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
        return []

    def unwanted(self, profile: Profile) -> list[str]:
        """Names of what came about that neither the profile's checks nor its `welcome` ask for."""
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
        GoalscopeError: The environment gives something else than a `StepResult`.
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


def occasions_like(env: Environment, text: str, most: int) -> list[Occasion]:
    """The occasions that `env.like` finds.

    Raises:
        GoalscopeError: It gives something else.
    """
    found = env.like(text, most)
    if not _is_list(found, Occasion):
        raise _wrong(env, "like", "a list of Occasions (see goalscope.occasions)", found)
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
