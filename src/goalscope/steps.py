"""Acting in a home: likelihood chooses, for each object that matters, among what can be done."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, cast

import numpy as np

from goalscope.envs import Environment
from goalscope.models import Model
from goalscope.policy import OTHER_GOALS, Array, Planner, Want
from goalscope.prompts import render
from goalscope.types import Action, StepResult, Turn

__all__ = ["StepEnvironment", "StepPlanner"]

LEAVE = "leave the {thing} where it is"


class StepEnvironment(Environment, Protocol):
    """An environment whose actions can be said in words."""

    def phrase(self, action: Action) -> str:
        """The action in words, such as "put the egg in the fridge"."""
        ...


class StepPlanner(Planner):
    """Chooses what to do with each relevant object by how much likelier it is under the goals.

    The objects are found as the basket's are (see `Planner`). For each kind of them the model
    weighs what the environment allows, said in words, against leaving it where it is; the action
    that gains most by the goals is taken for all objects of the kind. What was moved before is
    moved again only when the person asks for it.

    Args:
        model: Writes and scores.
        bar: Nats by which an action must beat leaving the object alone.
        **settings: See `Planner`.
    """

    def __init__(self, model: Model, *, bar: float = 0.0, limit: int = 6, seed: int = 0) -> None:
        super().__init__(model, limit=limit, seed=seed)
        self.bar = bar
        self._step: dict[tuple[str, str], float] = {}

    def plan(
        self,
        env: Environment,
        wants: Sequence[Want],
        terms: Sequence[str],
        turns: Sequence[Turn],
        history: Sequence[StepResult],
    ) -> list[Action]:
        """What the person asked for outright, then the best step for each kind of object."""
        plan = env.requests(turns)
        served = {action.target for action in plan}
        served |= {result.action.target for result in history}
        speaker = cast(StepEnvironment, env)
        for term in terms:
            options: dict[str, list[Action]] = {}
            for action in env.actions([term], turns):
                if action.target not in served:
                    options.setdefault(speaker.phrase(action), []).append(action)
            if not options:
                continue
            phrases = [LEAVE.format(thing=term), *options]
            values = self.values(term, phrases, wants, turns)
            best = int(values.argmax())
            if best and values[best] > values[0] + self.bar:
                plan += options[phrases[best]]
                served |= {action.target for action in options[phrases[best]]}
        return plan

    def values(
        self, thing: str, phrases: Sequence[str], wants: Sequence[Want], turns: Sequence[Turn]
    ) -> Array:
        """[len(phrases)] in nats: how much the goals and the person's words speak for each."""
        weights = np.array([want.probability for want in wants])
        given = np.array([self.step_log_probability(thing, phrases, want.text) for want in wants])
        words = self.newest([turn.utterance for turn in turns])
        said = self.step_log_probability(thing, phrases, words)
        wanted = (weights @ given / weights.sum() + said) / 2
        others = [self.step_log_probability(thing, phrases, goal) for goal in OTHER_GOALS]
        return wanted - self.discount * np.mean(others, axis=0)

    def step_log_probability(self, thing: str, phrases: Sequence[str], goal: str) -> Array:
        """[len(phrases)] in nats: how likely a robot that serves this goal says each phrase."""
        new = [phrase for phrase in phrases if (goal, phrase) not in self._step]
        if new:
            context = render("step", goal=goal, thing=thing)
            scores = self.model.token_logprobs([context] * len(new), [f"I {p}." for p in new])
            for phrase, score in zip(new, scores, strict=True):
                self._step[goal, phrase] = float(score.sum())
        return np.array([self._step[goal, phrase] for phrase in phrases])
