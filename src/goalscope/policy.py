"""Acting on likely goals (Sec. 3.2 and 4.2): search terms, a plan, and replanning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from goalscope.dialog import Model
from goalscope.envs import Environment
from goalscope.goals import drawn_lines
from goalscope.likelihood import contrast
from goalscope.prompts import render
from goalscope.types import Action, StepResult

__all__ = ["Outcome", "Planner", "Want", "undo"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Want:
    """Something to act for: a goal, or in No Goals the person's own words."""

    text: str
    probability: float


@dataclass(frozen=True, slots=True)
class Outcome:
    """The actions that stand, in order, and how many plans were impossible before them."""

    results: tuple[StepResult, ...]
    replans: int


class Planner:
    """Chooses actions by how much more likely they are under what is wanted than without it.

    A model that writes badly still scores well, so it only proposes: search terms come from
    several drawn lists and from the kinds of things that the environment has, actions from
    what the environment says is possible, and log-probability chooses among them.

    Args:
        model: Writes and scores.
        draws: Lists of search terms to draw for each want.
        kinds: Kinds of things that the environment may add for each want.
        limit: Most search terms that one round acts on.
        margin: Gain in nats that a term needs, as a share of the best term's.
        replans: Most plans to make in one round after the first.
        seed: Seed of the draws.
    """

    def __init__(
        self,
        model: Model,
        *,
        draws: int = 3,
        kinds: int = 60,
        limit: int = 8,
        margin: float = 0.4,
        replans: int = 2,
        seed: int = 0,
    ) -> None:
        self.model = model
        self.draws = draws
        self.kinds = kinds
        self.limit = limit
        self.margin = margin
        self.replans = replans
        self.seed = seed

    def act(
        self,
        env: Environment,
        wants: Sequence[Want],
        utterances: Sequence[str],
        history: Sequence[StepResult],
    ) -> Outcome:
        """Plan and act; a plan that fails is undone and made anew without the failed action.

        Args:
            env: Where to act.
            wants: What to act for; none means that only direct requests are met.
            utterances: All that the person has said, the last utterance last.
            history: Every action that stands so far, for undoing.
        """
        impossible: set[Action] = set()
        terms = self.search_terms(env, wants)
        for replans in range(self.replans + 1):
            plan = [
                action
                for action in self.plan(env, wants, terms, utterances)
                if action not in impossible
            ]
            results: list[StepResult] = []
            for action in plan:
                result = env.step(action)
                if not result.ok:
                    impossible.add(action)
                    break
                results.append(result)
            else:
                return Outcome(tuple(results), replans)
            undo(env, history)
        return Outcome((), self.replans + 1)

    def search_terms(self, env: Environment, wants: Sequence[Want]) -> list[str]:
        """The terms that gain most from what is wanted, best first."""
        terms: dict[str, None] = {}
        for want in wants:
            drawn = drawn_lines(
                self.model, "relevant", draws=self.draws, seed=self.seed, goal=want.text
            )
            for term in (*drawn, *env.kinds(want.text, self.kinds)):
                if len(term.split()) <= 4:
                    terms.setdefault(term.casefold())
        names = list(terms)
        if not names:
            return []
        gains = self.gains(names, wants)
        order = np.argsort(-gains, kind="stable")
        floor = max(0.0, self.margin * gains[order[0]])
        return [names[i] for i in order[: self.limit] if gains[i] > floor]

    def plan(
        self,
        env: Environment,
        wants: Sequence[Want],
        terms: Sequence[str],
        utterances: Sequence[str],
    ) -> list[Action]:
        """Direct requests first, then for each term the action that gains most."""
        plan = env.requests(utterances)
        served = {action.target for action in plan}
        for term in terms:
            actions = env.actions([term], utterances)
            if not actions or any(action.target in served for action in actions):
                continue
            gains = self.gains([action.target for action in actions], wants)
            best = actions[int(gains.argmax())]
            served.add(best.target)
            plan += [Action("search inventory", term), best]
        return plan

    def gains(self, texts: Sequence[str], wants: Sequence[Want]) -> Array:
        """[len(texts)] expected gain in nats over the wants, averaged over two wordings."""
        total = np.zeros(len(texts))
        for want in wants:
            for prompt, prefix in (("relevant", "- "), ("need", "I need ")):
                lines = [prefix + text for text in texts]
                total += 0.5 * want.probability * contrast(
                    self.model,
                    lines,
                    render(prompt, goal=want.text),
                    render(prompt, goal=""),
                )
        return total


def undo(env: Environment, history: Sequence[StepResult]) -> None:
    """Take `env` back to where `history` left it: reset, and replay what succeeded.

    Raises:
        RuntimeError: An action that once succeeded now fails.
    """
    env.reset()
    for result in history:
        if not env.step(result.action).ok:
            raise RuntimeError(f"cannot replay {result.action}: {result.observation}")
