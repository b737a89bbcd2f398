"""Methods of inference of one's own, some thirty lines each. See docs/experiments.md."""

import json

import numpy as np

from goalscope import UNSPECIFIED
from goalscope.base.types import Message
from goalscope.belief.likelihood import RolePlay


class Outright:
    """The model is asked for the probability of each goal, in percent."""

    def __init__(self, model):
        self.model = model

    def probabilities(self, task, goals, turns):
        order = sorted(goals, key=str)  # so that the answer does not depend on it
        listed = "\n".join(f"{n}. {goal.text}" for n, goal in enumerate(order, 1))
        talk = "\n".join(f"Agent: {turn.query}\nHuman: {turn.utterance}" for turn in turns)
        prompt = f"{task}\n\n{talk}\n\nWhat the human may want:\n{listed}\n\nHow likely is each?"
        percent = {"type": "integer", "minimum": 0, "maximum": 100}
        keys = [str(n) for n in range(1, len(order) + 1)]
        schema = {
            "type": "object",
            "properties": dict.fromkeys(keys, percent),
            "required": keys,
            "additionalProperties": False,
        }
        written = self.model.generate(
            [Message("user", f"{prompt} Answer in percent, as JSON.")],
            max_tokens=10 * len(order) + 10,
            schema=schema,
        )
        share = np.array([1 + json.loads(written.text)[key] for key in keys], float)
        found = dict(zip(order, share / share.sum(), strict=True))
        return np.array([found[goal] for goal in goals])


class Hypotheses:
    """Weighted hypotheses as in thought-tracing: each turn resamples what explains the words.

    A hypothesis is a goal. After each turn its weight is multiplied by the likelihood of the words,
    and where few hypotheses hold most of the weight, they are drawn again, a little evened out.
    """

    def __init__(self, model, number=200, spread=0.02):
        self.likelihood, self.number, self.spread = RolePlay(model), number, spread

    def probabilities(self, task, goals, turns):
        order = sorted(goals, key=str)
        random = np.random.default_rng(0)
        nats = self.likelihood.log_likelihood(task, order, turns) / 2
        held = np.arange(self.number) % len(order)
        weight = np.full(self.number, 1 / self.number)
        for row in nats:
            weight *= np.exp(row[held] - row.max())
            weight /= weight.sum()
            if 1 / (weight**2).sum() < self.number / 2:
                held = random.choice(held, self.number, p=weight)
                moved = random.random(self.number) < self.spread
                held = np.where(moved, random.integers(len(order), size=self.number), held)
                weight = np.full(self.number, 1 / self.number)
        mass = np.bincount(held, weight, len(order)) + self.spread / len(order)
        found = dict(zip(order, mass / mass.sum(), strict=True))
        return np.array([found[goal] for goal in goals])


class Overlap:
    """Words shared with the goal, the simplest method there is."""

    def __init__(self, model):
        pass

    def probabilities(self, task, goals, turns):
        said = {word for turn in turns for word in turn.utterance.lower().split()}
        shared = [
            1.0 if goal == UNSPECIFIED else 2.0 ** len(said & {*goal.text.lower().split()})
            for goal in goals
        ]
        return np.array(shared) / sum(shared)
