"""Methods of inference of one's own, some thirty lines each. See docs/experiments.md."""

import json
import math
from collections import Counter, defaultdict

import numpy as np

from goalscope import UNSPECIFIED
from goalscope.base.types import Message
from goalscope.belief.likelihood import RolePlay
from goalscope.datasets.sources import read_source


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


def training_cases():
    """Dialogues whose goal is known: TEACh's training games, each once, in $GOALSCOPE_DATA."""
    return list(
        dict.fromkeys(
            (" ".join(turn.utterance for turn in case.turns), case.true_goal.text)
            for case in read_source("teach:train", None).cases
        )
    )


def words(text):
    """The words of a text."""
    return text.lower().split()


class Unigram:
    """P(words | goal), counted: how often a word was said with each word of the goal."""

    def __init__(self, model):
        self.said, self.total = defaultdict(Counter), Counter()
        for text, goal in training_cases():
            self.total.update(words(text))
            for each in {*words(goal)}:
                self.said[each].update(words(text))
        self.size = sum(self.total.values())

    def probabilities(self, task, goals, turns):
        text = [word for turn in turns for word in words(turn.utterance)]
        nats = np.array([sum(math.log(self.chance(word, goal)) for word in text) for goal in goals])
        share = np.exp(nats - nats.max())
        return share / share.sum()

    def chance(self, word, goal):
        plain = (self.total[word] + 1) / (self.size + len(self.total) + 1)
        given = [self.said[each] for each in words(goal.text) if each in self.said]
        if goal == UNSPECIFIED or not given:
            return plain
        counts = [(each[word] + 100 * plain) / (each.total() + 100) for each in given]
        return sum(counts) / len(counts)


class Neighbours:
    """What people wanted who said the most similar things (nearest neighbours)."""

    def __init__(self, model, k=10):
        self.k, self.cases = (
            k,
            [({*words(said)}, {*words(goal)}) for said, goal in training_cases()],
        )
        self.rarity = Counter(word for said, _ in self.cases for word in said)

    def probabilities(self, task, goals, turns):
        text = {word for turn in turns for word in words(turn.utterance)}
        near = sorted(self.cases, key=lambda case: -self.likeness(text, case[0]))[: self.k]
        likes = [
            sum(self.likeness({*words(goal.text)}, wanted) for _, wanted in near) for goal in goals
        ]
        share = np.exp(np.array(likes) - max(likes))
        return share / share.sum()

    def likeness(self, one, other):
        shared = sum(1 / (1 + self.rarity[word]) for word in one & other)
        return shared / (1e-9 + sum(1 / (1 + self.rarity[word]) for word in one | other))


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
