"""Acting on likely goals (Sec. 3.2 and 4.2): act, hold back or not; a plan, and replanning."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from goalscope.envs import SEARCH, Environment, taken
from goalscope.goals import drawn_lines
from goalscope.models import Model
from goalscope.models.scoring import logprobs_of
from goalscope.prompts import recent, render
from goalscope.standing import Standing
from goalscope.types import Action, GoalscopeError, StepResult, Turn
from goalscope.words import contains, singulars

__all__ = ["Choice", "Outcome", "Planner", "Want", "choose", "names_in", "undo", "weigh"]

OTHER_GOALS = ("get through the week", "clean the bathroom", "have breakfast")
"""Everyday goals that stand for having no particular one."""

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Wordings = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Want:
    """Something to act for: a goal, or in No Goals the person's own words.

    Where the probabilities of all that is wanted do not sum to 1, the rest is that of other goals,
    of which nothing is known but what the person said.
    """

    text: str
    probability: float


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of planning.

    Attributes:
        results: The actions that stand, in order.
        replans: How many plans were impossible before them.
        failed: What was tried and could not be done.
        held: What would be right for one goal and wrong for another, and waits for an answer.
        guessed: Targets of what was done.
    """

    results: tuple[StepResult, ...]
    replans: int
    failed: tuple[StepResult, ...] = ()
    held: tuple[str, ...] = ()
    guessed: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Choice:
    """What to do about each of `n` things under the whole belief; to do nothing where neither.

    Attributes:
        act: [n] whether to act at once.
        hold: [n] whether an answer is worth a question's cost before that.
    """

    act: Flags
    hold: Flags


def choose(probability: Array, advantage: Array, cost: float) -> Choice:
    """Act, hold back for an answer, or do nothing: whichever has the greatest expected value.

    To act is worth tanh(advantage / 2) under a goal: the probability that it is right less that
    it is wrong, if both were as likely before. To do nothing is worth nothing. To ask, and then to
    act if that is right, saves the expected harm of acting now, and has its cost (value of perfect
    information; Howard, 1966).

    Args:
        probability: [G] of each goal; sums to 1.
        advantage: [G, n] nats by which each goal speaks for something, as `weigh` finds them.
        cost: Of a question, where something wrong costs 1.
    """
    value = np.tanh(advantage / 2)
    now = probability @ value
    asked = probability @ np.maximum(value, 0) - cost
    act = (now > 0) & (now >= asked)
    return Choice(act=act, hold=~act & (asked > 0))


class Planner:
    """Chooses what to act on by how much more likely it is under a goal than without it.

    A model that writes badly still scores well, so it only proposes: search terms are the kinds
    of things here that several drawn lists name, and those near the goal or the person's words;
    log-probability chooses among them. What is possible, the environment says.

    Args:
        model: Writes and scores.
        draws: Lists of search terms to draw for each want.
        kinds: Kinds of things that the environment may add for each want.
        near: Kinds of things that it may add for the person's words.
        limit: Most search terms that one round acts on.
        bar: Nats by which a goal must make a term likelier that nobody mentioned.
        cost: Of a question before acting (see `choose`).
        discount: Weight of a term's log-probability without the goal. At 1 rare things are
            favoured, at 0 things that people need for anything.
        replans: Most plans to make in one round after the first.
        seed: Seed of the draws.
    """

    wordings: Wordings = (("relevant", "- {}"), ("need", "I need {}"))
    """Prompts under which a term is likely or not, and how it is said there."""

    def __init__(
        self,
        model: Model,
        *,
        draws: int = 2,
        kinds: int = 120,
        near: int = 20,
        limit: int = 8,
        bar: float = 0.0,
        cost: float = 0.2,
        discount: float = 0.6,
        replans: int = 2,
        seed: int = 0,
    ) -> None:
        self.model = model
        self.draws = draws
        self.kinds = kinds
        self.near = near
        self.limit = limit
        self.bar = bar
        self.cost = cost
        self.discount = discount
        self.replans = replans
        self.seed = seed
        self._candidates: dict[str, list[str]] = {}
        self._log_probability: dict[tuple[str, Wordings, str], float] = {}

    def act(
        self,
        env: Environment,
        wants: Sequence[Want],
        turns: Sequence[Turn],
        history: Sequence[StepResult],
        standing: Standing,
    ) -> Outcome:
        """Plan and act; a plan that fails is undone and made anew without the failed action.

        What nobody could undo is never done unasked.

        Args:
            env: Where to act.
            wants: What to act for.
            turns: The conversation, the newest turn last.
            history: Every action that stands so far, for undoing.
            standing: What holds after what was said.

        Raises:
            GoalscopeError: After undoing a plan, the environment is not as it was before it.
        """
        impossible: dict[Action, StepResult] = {}
        terms, held = self.search_terms(env, wants, [turn.utterance for turn in turns])
        held = [term for term in held if env.actions(term, standing)]
        start = env.fingerprint()
        results: list[StepResult] = []
        for _ in range(self.replans + 1):
            plan, unsure = self.plan(env, wants, terms, turns, history, standing)
            for action in plan:
                if action in impossible or env.lasting(action):
                    continue
                result = taken(env, action)
                if not result.ok:
                    impossible[action] = result
                    break
                results.append(result)
            else:
                held += unsure
                break
            undo(env, history, start)
            results = []
        acts = [each.action for each in results if each.action.name != SEARCH]
        return Outcome(
            tuple(results),
            len(impossible),
            tuple(impossible.values()),
            tuple(held),
            tuple(action.target for action in acts),
        )

    def search_terms(
        self, env: Environment, wants: Sequence[Want], utterances: Sequence[str]
    ) -> tuple[list[str], list[str]]:
        """What to look for, best first, and what to hold back until a question is answered.

        All must be likelier with what is wanted than without it. Things that the person mentioned
        come first; of those that nobody mentioned there are at most `limit`.
        """
        if not wants:
            return [], []
        for want in wants:
            if want.text not in self._candidates:
                drawn = drawn_lines(
                    self.model,
                    "relevant",
                    draws=self.draws,
                    seed=self.seed,
                    max_tokens=48,
                    goal=want.text,
                )
                near = [name for line in drawn for name in env.offers(line, 1)]
                self._candidates[want.text] = near + env.offers(want.text, self.kinds)
        words = self.newest(utterances)
        near_words = env.offers(words, self.near)
        wanted_kinds = (term for want in wants for term in self._candidates[want.text])
        terms = list(dict.fromkeys([*near_words, *wanted_kinds]))
        mentioned = names_in(words, terms)
        if not terms:
            return [], []
        probability, gains, without = weigh(wants, words, partial(self.log_probability, terms))
        mean = probability @ gains
        choice = choose(probability, gains - self.bar, self.cost)
        best: list[int] = np.argsort(
            -(mean + (1 - self.discount) * without), kind="stable"
        ).tolist()
        named = [
            term for term, gain in zip(terms, mean, strict=True) if gain > 0 and term in mentioned
        ]
        unnamed = [i for i in best if terms[i] not in mentioned]
        act = [terms[i] for i in unnamed if choice.act[i]]
        hold = [terms[i] for i in unnamed if choice.hold[i]]
        return named + act[: self.limit], hold[: self.limit]

    def newest(self, utterances: Sequence[str]) -> str:
        """The newest of the person's words, as many as a prompt can hold."""
        turns = recent(self.model, [Turn("", utterance) for utterance in utterances], 6)
        return " ".join(turn.utterance for turn in turns)

    def plan(
        self,
        env: Environment,
        wants: Sequence[Want],
        terms: Sequence[str],
        turns: Sequence[Turn],
        history: Sequence[StepResult],
        standing: Standing,
    ) -> tuple[list[Action], list[str]]:
        """For each term a search and its best find, and what to hold back.

        That is nothing more here than what `search_terms` holds back.
        """
        plan: list[Action] = []
        served: set[str] = set()
        for term in terms:
            actions = env.actions(term, standing)
            if actions and not any(action.target in served for action in actions):
                served.add(actions[0].target)
                plan += [Action(SEARCH, term), actions[0]]
        return plan, []

    def log_probability(
        self, texts: Sequence[str], goal: str, wordings: Wordings = (), **values: str
    ) -> Array:
        """[len(texts)] in nats: how likely each text is, given this goal.

        The mean over the wordings; each text and goal is scored once.

        Args:
            texts: Such as search terms: what a person with this goal names.
            goal: The goal.
            wordings: As `self.wordings`, which stand for none.
            **values: What else the prompts use.
        """
        wordings = wordings or self.wordings
        known, key = self._log_probability, (goal, wordings)
        new = [text for text in texts if (*key, text) not in known]
        if new:
            total = np.zeros(len(new))
            for prompt, said in wordings:
                context = render(prompt, goal=goal, **values)
                scores = logprobs_of(
                    self.model, [context] * len(new), [said.format(text) for text in new]
                )
                total += np.array([float(score.sum()) for score in scores]) / len(wordings)
            for text, value in zip(new, total, strict=True):
                known[*key, text] = float(value)
        return np.array([known[*key, text] for text in texts])


def names_in(text: str, names: Sequence[str]) -> list[str]:
    """Those of the names of which a text holds every word, in the singular or plural."""
    said = {*singulars(text)}
    return [name for name in names if contains(said, singulars(name))]


def weigh(
    wants: Sequence[Want], words: str, score: Callable[[str], Array]
) -> tuple[Array, Array, Array]:
    """How much each goal, and what the person said, half each, speak for something.

    Args:
        wants: What is wanted.
        words: The person's own.
        score: [n] log-probabilities in nats, given a goal or words.

    Returns:
        [G + 1] probabilities of what is wanted, and of other goals at the end; [G + 1, n] gains in
        nats against having no particular goal; and [n] log-probabilities without one.
    """
    without = np.mean([score(goal) for goal in OTHER_GOALS], axis=0)
    known = np.array([want.probability for want in wants])
    given = np.array([*(score(want.text) for want in wants), without])
    probability = np.append(known, max(0.0, 1.0 - known.sum()))
    return probability / probability.sum(), (given + score(words)) / 2 - without, without


def undo(env: Environment, history: Sequence[StepResult], expected: str | None = None) -> None:
    """Take `env` back to where `history` left it: reset, and replay what succeeded.

    Args:
        env: Where the actions were taken.
        history: What stands.
        expected: The fingerprint that the environment then must have, where it is known.

    Raises:
        GoalscopeError: An action that once succeeded now fails, or the state is another one.
    """
    env.reset()
    for result in history:
        again = taken(env, result.action)
        if not again.ok:
            raise GoalscopeError(
                f"The action {result.action} cannot be done again: {again.observation} "
                "Has the catalogue or scene changed since? Start a new episode."
            )
    if expected is not None and env.fingerprint() != expected:
        raise GoalscopeError(
            "Doing the earlier actions again led to another state than before, so that the agent "
            "stops. Look at what has changed, and start a new episode."
        )
