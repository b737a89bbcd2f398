"""The interface of environments (Sec. 4.2), modelled on Gymnasium's reset and step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import cast

from goalscope.base.types import Action, GoalscopeError, Profile, StepResult
from goalscope.envs.scenarios import Scenario
from goalscope.language.dialogue_state import DialogueState
from goalscope.language.orders import Order, Verb

GUESSED = "Guessed, not asked for: "
"""Prefix of notes about guessed actions."""

MENTIONED = "Because you mentioned it: "
"""Prefix of notes about actions that nobody ordered, for things that the person named."""

SEARCH = "search inventory"
"""Name of the action that only looks something up, in all domains."""

REQUIRED = ("task", "verbs", "reset", "step", "state", "resolve", "offers")
"""The members of `Environment` without a default."""

Pick = Callable[[str, Sequence[str]], str]
"""Picks the name that a person's words mean, by the model; "" for none of them."""


@dataclass(frozen=True, slots=True)
class State:
    """The state of an environment.

    Attributes:
        text: The state for people and prompts.
        fingerprint: Equal if and only if the states are equal; by default, the text.
        here: The state in few words for the reader, which may use them: names of things, and what
            is open, on, or held; by default, the text.
    """

    text: str
    fingerprint: str = ""
    here: str = ""

    def __post_init__(self) -> None:
        """Let the text stand for what is not given."""
        for name in ("fingerprint", "here"):
            if not getattr(self, name):
                object.__setattr__(self, name, self.text)


@dataclass(frozen=True, slots=True)
class Resolution:
    """The resolution of an order in the current state.

    Attributes:
        actions: The actions that carry it out, in order. Those that cannot be undone have
            `Action.irreversible` set: the agent asks before it executes them.
        why: One sentence on what cannot be done and why, or that it is already so; "" if the
            actions do all of it.
        warning: One line to add once the actions are executed, such as that nobody knows whether
            a thing is free of nuts; "" for nothing.
        missing: Whether there is no such thing. Then the words may tell an aim: "get me spag bol".
    """

    actions: tuple[Action, ...] = ()
    why: str = ""
    warning: str = ""
    missing: bool = False


@dataclass(frozen=True, slots=True)
class Checks:
    """How a state stands to a profile.

    Attributes:
        met: Whether each of the profile's checks holds, in order; empty in a domain that does not
            score.
        unwanted: Names of results that neither the checks nor the profile's `welcome` include;
            None where the profile does not say what is welcome.
    """

    met: tuple[bool, ...] = ()
    unwanted: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Outcome:
    """What was made of the start for a profile: the score of an episode.

    A check that does not hold at the start is a need. One that holds is a prohibition: it must not
    be broken, and earns nothing.

    Attributes:
        start: Whether each check held at the start; one at least did not.
        met: Whether each holds now.
        unwanted: See `Checks`.
    """

    start: tuple[bool, ...]
    met: tuple[bool, ...]
    unwanted: tuple[str, ...] | None = None

    @property
    def needs(self) -> int:
        """Number of needs."""
        return self.start.count(False)

    @property
    def needs_met(self) -> int:
        """Number of needs that are met."""
        return sum(now and not before for before, now in self._pairs())

    @property
    def violated(self) -> int:
        """Number of prohibitions that are broken."""
        return sum(before and not now for before, now in self._pairs())

    @property
    def score(self) -> float:
        """The Jaccard index of what was needed and what was done, 0 to 1.

        It is m / (n + u + v) for n needs, of which m are met, u unwanted things and v violations;
        u is 0 where `unwanted` is None.
        """
        return self.needs_met / (self.needs + len(self.unwanted or ()) + self.violated)

    def _pairs(self) -> Iterable[tuple[bool, bool]]:
        return zip(self.start, self.met, strict=True)


class Environment(AbstractContextManager["Environment"]):
    """A domain that the agent acts in; subclasses must define the members of `REQUIRED`.

    It declares its verbs and never parses language: orders arrive already read. Use it in a `with`
    statement to stop its background processes, if it has any.

    Attributes:
        task: The agent and its task in one or two sentences, for prompts.
        verbs: The verbs of orders, besides the dialogue acts of `goalscope.language.orders`.
    """

    task: str
    verbs: Sequence[Verb]

    def reset(self) -> None:
        """Go back to the start."""
        raise NotImplementedError

    def step(self, action: Action) -> StepResult:
        """Execute an action. An impossible one changes nothing and says why."""
        raise NotImplementedError

    def state(self) -> State:
        """The current state."""
        raise NotImplementedError

    def resolve(self, order: Order, dialogue: DialogueState, pick: Pick) -> Resolution:
        """Resolve an order to actions, or to one sentence that says why not.

        The order has a verb of the domain, or is a limit ("avoid", "only", "have", "budget",
        "leave"), for which the actions undo violations, or is an "undo", for which they undo the
        results `dialogue.to_undo`. `Resolution()` stands for a limit that needs no action, and for
        an undo that the domain does not know.

        Args:
            order: What was asked for.
            dialogue: What holds, this order included.
            pick: Finds which of the names here is meant.
        """
        raise NotImplementedError

    def offers(self, text: str, limit: int) -> list[str]:
        """Generic names of available things that may serve `text`, nearest first."""
        raise NotImplementedError

    def answer(self, question: Order, said: str, dialogue: DialogueState, pick: Pick) -> str:
        """The facts that a question asks for; "" if there are none.

        Args:
            question: `about` is "any", "total", "count", "enough" or "" for facts; the agent
                answers the rest. `what` and `where` name the thing, or nothing for all.
            said: The utterance that holds it.
            dialogue: What holds.
            pick: Finds which of the names here is meant.
        """
        return ""

    def checks_met(self, profile: Profile) -> Checks:
        """How the current state stands to a profile; `Outcome` makes it a score."""
        return Checks()

    def __exit__(self, *error: object) -> None:
        """Stop background processes."""


class Proactive(Environment):
    """An environment in which the agent may act unasked, for a goal that is likely.

    In any other environment it only follows orders.

    Attributes:
        agreed: Share of similar scenarios that must need something before it is guessed.
    """

    agreed: float = 0.4

    def actions(self, name: str, dialogue: DialogueState) -> list[Action]:
        """Actions that may be guessed for things of a generic name, best first.

        Excludes what the person ruled out.
        """
        raise NotImplementedError

    def serving(self, need: str, dialogue: DialogueState) -> list[Action]:
        """The actions for one need of a goal, such as "flour"; empty if there are none.

        Args:
            need: As named by scenarios and the writer (see `like`); by default, a generic name.
            dialogue: What holds.
        """
        return self.actions(need, dialogue)[:1]

    def possible(self, terms: Sequence[str]) -> list[Action]:
        """All actions that a plan may be made of, most relevant first (Sec. 4.2).

        Unlike `actions`, nothing is left out that the person ruled out or that cannot be undone.

        Args:
            terms: Names of relevant things, as a model wrote them.
        """
        return [action for term in terms for action in self.actions(term, DialogueState())]

    def kind(self, action: Action) -> str:
        """A key shared by actions that serve a need equally well: the need, if there is one."""
        return self.phrase(action)

    def like(self, text: str, most: int) -> list[Scenario]:
        """Scenarios similar to a text, nearest first, with needs that can be served here."""
        return []

    def room(self) -> str:
        """A description of what is here, if the needs of goals depend on it."""
        return ""

    def phrase(self, action: Action) -> str:
        """The action in words."""
        return str(action)

    def irreversible(self, action: Action) -> bool:
        """Whether an action cannot be undone now, even one that does not say so itself.

        Agents ask `is_irreversible`, which knows the actions and verbs that say so, too.
        """
        return False


def missing(env: Environment) -> list[str]:
    """The members without a default that an environment lacks."""
    required = (*REQUIRED, "actions") if isinstance(env, Proactive) else REQUIRED
    defaults = {**vars(Environment), **vars(Proactive)}
    return [
        name
        for name in required
        if getattr(env, name, None) is None
        or getattr(type(env), name, None) is defaults.get(name, env)
    ]


def is_irreversible(env: Environment, action: Action) -> bool:
    """Whether an action cannot be undone now, whoever made it: it is asked about, never guessed.

    It is enough that the action says so, that the verb of its name declares it, or that a
    `Proactive` environment knows it.
    """
    declared = any(verb.irreversible for verb in env.verbs if verb.name == action.name)
    known = isinstance(env, Proactive) and env.irreversible(action)
    return action.irreversible or declared or known


def completion_phrase(env: Environment) -> str:
    """The words that end the task: those of the first verb that declares some."""
    phrases = (verb.phrase for verb in env.verbs if verb.ends and verb.phrase)
    return next(phrases, "That is all")


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


def resolve(env: Environment, order: Order, dialogue: DialogueState, pick: Pick) -> Resolution:
    """Resolve an order, and see that the answer is a resolution.

    Raises:
        GoalscopeError: It is something else.
    """
    found = cast("object", env.resolve(order, dialogue, pick))
    if (
        isinstance(found, Resolution)
        and isinstance(cast("object", found.actions), tuple)
        and all(isinstance(cast("object", action), Action) for action in found.actions)
        and all(type(cast("object", text)) is str for text in (found.why, found.warning))
    ):
        return found
    raise GoalscopeError(
        f"`resolve` of {type(env).__name__} must return a Resolution((action, ...), why), with a "
        f"tuple of actions and a text, not {found!r}, for {order}."
    )


def scenarios_like(env: Environment, text: str, most: int) -> list[Scenario]:
    """The scenarios that an environment finds similar to a text; none if it is not proactive."""
    return env.like(text, most) if isinstance(env, Proactive) else []
