"""Acting in a home: likelihood chooses, for each object that matters, among what can be done."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Protocol, cast

from goalscope.envs import Environment
from goalscope.models import Model
from goalscope.policy import Array, Planner, Want, Wordings, choose, weigh
from goalscope.types import Action, StepResult, Turn, spoken

__all__ = ["ActionPlanner", "SpokenEnvironment"]

FEW_WORDS = 4
"""Fewer words than this, without the name of a thing, say nothing new: "yes", "that's all"."""

REPLANS = 8
"""Plans that may fail in one round: each leaves out one more act that is impossible."""

_ASIDE = re.compile(r"n't\b|\b(?:no|not|never|nothing|stop|undo|back|cancel)\b")
_QUESTION = re.compile(r"(?!.*\b(?:can|could|would|will) (?:you|we)\b).*\?\W*")
"""Words that rule out or take back, and questions that are no request: no reason to act unasked."""

ACT: Wordings = (("act", "I {}."),)
LEAVE = "leave the {thing} where it is"


class SpokenEnvironment(Environment, Protocol):
    """An environment whose actions can be said in words."""

    def phrase(self, action: Action) -> str:
        """The action in words, such as "put the egg in the fridge"."""
        ...

    def fulfilled(self, kind: str) -> list[str]:
        """What was to be done with things of this kind if it were not so already, in words."""
        ...


class ActionPlanner(Planner):
    """Chooses what to do with each relevant object by how much likelier it is under the goals.

    What the person asks for outright is done, and nothing besides.

    The objects are found as the basket's are (see `Planner`), among all that are there. For each
    kind of them the model weighs what the environment allows, said in words, against leaving it
    where it is; the action that gains most by the goals is taken for all objects of the kind (but
    what needs leave for one at a time). When
    the person has just named things, only things that were named are touched. What was moved
    before, or had something put into it, stays unless the person has just named it.

    Args:
        model: Writes and scores.
        limit: Most kinds of things that nobody mentioned, in one round.
        bar: Nats by which the goals must make such a kind likelier, and what to do with it likelier
            than leaving it alone.
        margin: The same for what to do with things that were named.
        seed: Seed of everything that is drawn.
    """

    wordings = (*Planner.wordings, ("use", "The {}"), ("use", "The {}"))

    def __init__(
        self,
        model: Model,
        *,
        limit: int = 3,
        bar: float = 1.5,
        margin: float = 0.5,
        seed: int = 0,
    ) -> None:
        super().__init__(
            model, draws=0, limit=limit, bar=bar, discount=1.0, replans=REPLANS, seed=seed
        )
        self.margin = margin

    def search_terms(
        self, env: Environment, wants: Sequence[Want], utterances: Sequence[str]
    ) -> tuple[list[str], list[str]]:
        """See `Planner.search_terms`; what nobody named only when nothing was named just now."""
        newest = " ".join(utterances[-1:]).casefold()
        if _QUESTION.fullmatch(newest):
            return [], []
        named = env.mentioned(utterances) if env.mentioned(utterances[-1:]) else []
        if not named and (len(newest.split()) < FEW_WORDS or _ASIDE.search(newest)):
            return [], []
        terms, held = super().search_terms(env, wants, utterances)
        return ([term for term in terms if term in named], []) if named else (terms, held)

    def plan(
        self,
        env: Environment,
        wants: Sequence[Want],
        terms: Sequence[str],
        turns: Sequence[Turn],
        history: Sequence[StepResult],
        requested: Sequence[Action],
    ) -> tuple[list[Action], list[str]]:
        """What the person asks for outright, and that alone; else the best for each thing.

        And what to hold back, in words: what is best on average, but wrong for some goal.
        """
        if requested:
            return [*requested], []
        plan: list[Action] = []
        held: list[str] = []
        served: set[str] = set()
        before = {result.action.target for result in history}
        before |= {result.action.destination for result in history}
        utterances = spoken(turns)
        named, newest = set(env.mentioned(utterances)), set(env.mentioned(utterances[-1:]))
        speaker = cast(SpokenEnvironment, env)
        for term in terms:
            settled = served if term in newest else served | before
            options: dict[str, list[Action]] = {}
            for action in env.actions([term], turns):
                if action.target not in settled:
                    options.setdefault(speaker.phrase(action), []).append(action)
            if not options:
                continue
            fulfilled = [phrase for phrase in speaker.fulfilled(term) if phrase not in options]
            phrases = [LEAVE.format(thing=term), *fulfilled, *options]
            probability, gains = self.log_gains(term, phrases, wants, turns)
            best = int((probability @ gains).argmax())
            if best <= len(fulfilled):
                continue
            enough = self.margin if term in named else self.bar
            choice = choose(probability, gains[:, [best]] - gains[:, [0]] - enough, self.cost)
            if choice.hold[0]:
                held.append(phrases[best])
            if choice.act[0]:
                chosen = options[phrases[best]]
                if env.permission(chosen[0], []):
                    chosen = chosen[:1]
                plan += chosen
                served |= {action.target for action in chosen}
                served |= {action.destination for action in chosen}
        return plan, held

    def log_gains(
        self, thing: str, phrases: Sequence[str], wants: Sequence[Want], turns: Sequence[Turn]
    ) -> tuple[Array, Array]:
        """[G + 1] probabilities, and [G + 1, len(phrases)] gains in nats; see `weigh`."""
        words = self.newest(spoken(turns))
        probability, gains, _ = weigh(
            wants, words, lambda goal: self.log_probability(phrases, goal, ACT, thing=thing)
        )
        return probability, gains
