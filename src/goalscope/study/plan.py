"""What a study asks, read from TOML, and what raters see of an episode."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from annotated_types import Interval, Len, Predicate

from goalscope.agent.agent import Ablation
from goalscope.agent.round import Round
from goalscope.agent.settings import settings_of
from goalscope.base.inputs import read_toml, shown
from goalscope.base.types import InvalidInputError, Turn
from goalscope.envs.registry import (
    BUILT_IN,
    domain_named,
    load_domain,
    open_environment,
    profile_named,
)
from goalscope.storage.store import EpisodeInfo, Store

BEST = 3
"""The best rating (Sec. 5); the worst is 0."""
NOTHING = "The assistant did nothing."
DID, LEFT = "It did this, in this order:", "The situation at the end:"


Text = Annotated[str, Predicate(lambda text: bool(text.strip()))]


@dataclass(frozen=True, slots=True)
class Plan:
    """A study.

    Attributes:
        name: Part of its address: up to 60 lowercase letters, digits and hyphens.
        consent: What people consent to; an empty line starts a paragraph, as in `instructions`.
        instructions: What participants should do.
        title: Shown to participants.
        question: Question asked about each item.
        scale: Labels of the ratings 0 to 3.
        thanks: Shown at the end.
        domain: Domain of the episodes to rate, or its Python file; "" for all that come with
            goalscope.
        methods: Ablations of the episodes to rate, see `Agent`; empty for all.
        transcript: Whether the conversation is shown, which the paper leaves out.
        ratings_per_item: Number of ratings wanted, from people who finish.
        items_per_participant: Number of items that each participant rates.
        min_explanation: Minimum length of an explanation in characters, not counting spaces.
        seed: Of the choice and order of items.
    """

    name: str
    consent: Text
    instructions: Text
    title: Text = "How well did the assistant do?"
    question: Text = (
        "How relevant and reasonable is this for the person's profile and the assistant's task? "
        "Please do not penalise inefficiency or repeats."
    )
    scale: Annotated[tuple[str, ...], Len(BEST + 1, BEST + 1)] = (
        "least reasonable", "less reasonable", "more reasonable", "most reasonable",
    )  # fmt: skip
    thanks: str = "You may close this page."
    domain: str = ""
    methods: tuple[Ablation, ...] = ()
    transcript: bool = False
    ratings_per_item: Annotated[int, Interval(ge=1, le=1_000_000)] = 5
    items_per_participant: Annotated[int, Interval(ge=1, le=200)] = 10
    min_explanation: Annotated[int, Interval(ge=0, le=500)] = 20
    seed: Annotated[int, Interval(ge=0, le=1_000_000)] = 0

    def __post_init__(self) -> None:
        """Refuse a name that cannot be a part of an address."""
        if not re.fullmatch("[a-z0-9][a-z0-9-]{0,59}", self.name):
            raise ValueError(
                "'name' is part of the study's address: use up to 60 lowercase letters, digits "
                f"and hyphens, not {shown(self.name)}."
            )


def read_plan(file: Path) -> Plan:
    """Read a study from a TOML file; runs the Python file of a domain that it names.

    Raises:
        InvalidInputError: The file cannot be read, or has an unknown key or value.
    """
    plan = read_toml(file, Plan)
    if not plan.domain:
        return plan
    try:
        return replace(plan, domain=load_domain(plan.domain, file.parent))
    except InvalidInputError as error:
        raise InvalidInputError(f"{file.name}: {error}") from None


@dataclass(frozen=True, slots=True)
class Item:
    """What is rated, presented as in the paper (Sec. 5.1).

    Attributes:
        task: The assistant and its task.
        possible: What it can do.
        profile: Description of the person; empty for a real one.
        outcome: The final basket, or all actions that were not undone and what they changed.
        transcript: The conversation, if the study shows it.
    """

    task: str
    possible: tuple[str, ...]
    profile: str
    outcome: str
    transcript: tuple[Turn, ...] = ()


def chosen_episodes(store: Store, plan: Plan) -> list[EpisodeInfo]:
    """The episodes of the store to rate, in order of their start.

    A person is included only if each method has an episode with them, so that methods are compared
    rather than people, and a real person only if the conversation is shown.

    Raises:
        InvalidInputError: There are none.
    """
    found = [
        info
        for info in store.episodes()
        if info.ended
        and info.domain in ([plan.domain] if plan.domain else BUILT_IN)
        and (not plan.methods or info.method in plan.methods)
        and (info.profile or plan.transcript)
    ]
    methods = plan.methods or {info.method for info in found}
    served = [{info.profile for info in found if info.method == each} for each in methods]
    people = set[str | None]().union(*served).intersection(*served)
    if not people:
        raise InvalidInputError(
            "No person has a finished episode with each of the study's methods "
            f"({', '.join(methods) or 'any'}). `{store.command('episodes')}` lists the episodes, "
            f"and `{store.command('run')}` makes new ones; transcript = true includes those of "
            "real people."
        )
    return [info for info in found if info.profile in people]


def item_of(store: Store, info: EpisodeInfo, plan: Plan) -> Item:
    """The item of a stored episode."""
    rounds = store.rounds(info.id)
    settings = settings_of(info.settings)
    person = profile_named(settings, info.profile) if info.profile else None
    profile = " ".join(person.description.split()) if person else ""
    domain = domain_named(info.domain)
    possible = domain.possible
    if possible is None:
        with open_environment(settings, person) as env:
            possible = tuple(verb.name for verb in env.verbs)
    if domain.judged == ("outcome",):
        outcome = rounds[-1].status if rounds else ""
    else:
        outcome = _actions(rounds)
    return Item(
        info.task,
        tuple(dict.fromkeys(possible)),
        profile,
        outcome or NOTHING,
        tuple(round.turn for round in rounds) if plan.transcript else (),
    )


def _actions(rounds: Sequence[Round]) -> str:
    """The actions, and the status at the end, which lists what they changed."""
    results = [result for round in rounds for result in round.results if result.ok]
    done = "\n".join(f"- {result.action}" for result in results if not result.terminated)
    if not done:
        return ""
    left = rounds[-1].status
    return f"{DID}\n{done}\n{LEFT}\n{left}" if left else done
