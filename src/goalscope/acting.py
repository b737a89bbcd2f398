"""Acting in a home: likelihood chooses, for each object that matters, among what can be done."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, cast

from goalscope.envs import Environment
from goalscope.models import Model
from goalscope.policy import Array, Planner, Want, Wordings, choose, names_in, weigh
from goalscope.standing import Standing
from goalscope.types import Action, StepResult, Turn

__all__ = ["ActionPlanner", "SpokenEnvironment"]

_EVERY = 1000
"""More than the generic names of any scene."""

REPLANS = 8
"""Plans that may fail in one round: each leaves out one more act that is impossible."""

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

    The objects are found as the basket's are (see `Planner`), among all that are there. For each
    kind of them the model weighs what the environment allows, said in words, against leaving it
    where it is; the action that gains most by the goals is taken for all objects of the kind. When
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
        """See `Planner.search_terms`; where the newest words name things, only those."""
        named = _named(env, utterances[-1:])
        terms, held = super().search_terms(env, wants, utterances)
        return ([term for term in terms if term in named], []) if named else (terms, held)

    def plan(
        self,
        env: Environment,
        wants: Sequence[Want],
        terms: Sequence[str],
        turns: Sequence[Turn],
        history: Sequence[StepResult],
        standing: Standing,
    ) -> tuple[list[Action], list[str]]:
        """The best for each thing; and what is best on average, but wrong for some goal."""
        plan: list[Action] = []
        held: list[str] = []
        served: set[str] = set()
        before = {result.action.target for result in history}
        before |= {result.action.destination for result in history}
        utterances = [turn.utterance for turn in turns]
        named, newest = _named(env, utterances), _named(env, utterances[-1:])
        speaker = cast(SpokenEnvironment, env)
        for term in terms:
            settled = served if term in newest else served | before
            options: dict[str, list[Action]] = {}
            for action in env.actions(term, standing):
                if action.target not in settled and not env.lasting(action):
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
                plan += chosen
                served |= {action.target for action in chosen}
                served |= {action.destination for action in chosen}
        return plan, held

    def log_gains(
        self, thing: str, phrases: Sequence[str], wants: Sequence[Want], turns: Sequence[Turn]
    ) -> tuple[Array, Array]:
        """[G + 1] probabilities, and [G + 1, len(phrases)] gains in nats; see `weigh`."""
        words = self.newest([turn.utterance for turn in turns])
        probability, gains, _ = weigh(
            wants, words, lambda goal: self.log_probability(phrases, goal, ACT, thing=thing)
        )
        return probability, gains


def _named(env: Environment, utterances: Sequence[str]) -> set[str]:
    """Generic names of things here that the person spoke of."""
    return {*names_in(" ".join(utterances), env.offers("", _EVERY))}
