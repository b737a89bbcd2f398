"""Goal management (Sec. 3.2): propose goals that explain the words, remove those that do not."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Literal

import numpy as np

from goalscope.belief import Belief
from goalscope.likelihood import Likelihood, PromptedRanking
from goalscope.models import Generator, LikelihoodModel, Model
from goalscope.models.scoring import logprobs_of
from goalscope.prompts import examples, recent, render, topics
from goalscope.types import UNSPECIFIED, Goal, GoalChange, InvalidInputError, Turn, meaning

__all__ = [
    "UNEXPLAINED",
    "GoalManager",
    "Trigger",
    "drawn_lines",
    "incomplete",
    "irrelevant",
    "made_from",
    "objectionable",
    "overdue",
    "propose",
]

Trigger = float | Literal["paper"]
"""When goals are proposed; see `GoalManager`."""

UNEXPLAINED = 0.5
"""Probability of Unspecified above which goals are proposed (LOG.md)."""

CONSENT = "Sure, I can help you with that."
REFUSAL = "I'm sorry, but I can't help you with that."
ANY_TASK = "The agent helps the human."

_SPEAKERS = {
    "Name one.": ("You name crimes and cruel acts.", "You name good and harmless plans."),
    "What do you want to do?": ("You are a cruel criminal.", "You are a kind person."),
}
"""Who is asked what: those who answer with something harmful, and with something harmless."""

_BORROWED = 2
"""Words of the prompt's examples that nobody said, from which on a goal speaks of those."""

_NOT_ONE = re.compile(r":(?: |$)|;")
"""In a line that holds several things, or their heading."""

_DETERMINERS = frozenset(("a", "an", "the", "my", "your", "our", "his", "her", "their", "some"))
"""Words by which two goals hardly differ."""

_BULLET = re.compile(r"^\s*(?:[-*•]|\d+[.)])\s*")


def incomplete(belief: Belief, propose: Trigger = UNEXPLAINED, *, since: int = 0) -> bool:
    """Whether the person's goal seems to be missing, so that some are to be proposed.

    Args:
        belief: The present one; `UNSPECIFIED` is one of its goals.
        propose: See `GoalManager`.
        since: Number of turns that the newest goals were made from. They explain these words well,
            whatever they are worth; only later ones put them to the test.
    """
    if propose == "paper":
        return belief.top(1)[0][0] == UNSPECIFIED
    later = belief.since(since)
    return bool(later.probability[later.goals.index(UNSPECIFIED)] > propose + 1e-9)


def made_from(changes: Sequence[Sequence[GoalChange]]) -> int:
    """Number of turns that the newest goals were made from; see `incomplete`.

    Args:
        changes: Of each round. Goals that the person named were not made from their words.
    """
    made = 0
    for number, each in enumerate(changes, 1):
        named = {change.goal for change in each if change.kind == "pinned"}
        if any(change.kind == "added" and change.goal not in named for change in each):
            made = number
    return made


class GoalManager:
    """Decides which goals the belief is over (Sec. 3.2): proposes some, and removes some.

    Args:
        model: Writes goals, and tells which are relevant and safe.
        task: The agent's task.
        propose: Goals are proposed once Unspecified is likelier than this by the words since the
            newest goals; in the "paper", once it is the likeliest.
        patience: A goal goes when it was the least likely for more than this many rounds (n).
        seed: Seed of what is drawn.
    """

    def __init__(
        self,
        model: Model,
        task: str,
        *,
        propose: Trigger = UNEXPLAINED,
        patience: int = 3,
        seed: int = 0,
    ) -> None:
        try:
            known = propose == "paper" or 0 <= propose < 1
        except TypeError:
            known = False
        if not known:
            raise InvalidInputError(
                f'propose must be a probability below 1, such as {UNEXPLAINED}, or "paper", not '
                f"{propose!r}"
            )
        self.model = model
        self.task = task
        self.propose: Trigger = propose
        self.patience = patience
        self.seed = seed
        self._cleared: set[Goal] = set()

    def added(
        self,
        likelihood: Likelihood,
        belief: Belief,
        turns: Sequence[Turn],
        changes: Sequence[GoalChange],
    ) -> list[GoalChange]:
        """Goals to add.

        Args:
            likelihood: Evidence of a turn.
            belief: The present goals.
            turns: The transcript.
            changes: All changes before. A goal that was removed as the least likely can come back
                if the evidence turns; one that was removed for good is not proposed again.
        """
        removed = [change for change in changes if change.kind == "removed"]
        ruled_out = [*belief.ruled_out, *(change.goal for change in removed if change.final)]
        out = {meaning(goal.text) for goal in (*belief.goals, *ruled_out)}
        past = {meaning(change.goal.text): change.goal for change in removed}
        return propose(
            self.model,
            None if isinstance(likelihood, PromptedRanking) else likelihood,
            self.task,
            turns,
            [*belief.goals, *ruled_out],
            past=[goal for text, goal in past.items() if text not in out],
            seed=self.seed + 100 * len(turns),
        )

    def removed(self, beliefs: Sequence[Belief]) -> list[GoalChange]:
        """Goals to remove: irrelevant, unsafe, and long the least likely ones.

        The likeliest goal stays, if otherwise none would. What the person has confirmed is
        relevant.

        Args:
            beliefs: The belief after each round, the present one last.
        """
        belief = beliefs[-1]
        pinned = {goal for _, goal in belief.pinned}
        new = [goal for goal in belief.goals if goal not in self._cleared]
        free = [goal for goal in new if goal not in pinned]
        unfit: list[GoalChange] = []
        if new:
            unfit += irrelevant(self.model, self.task, free)
            unfit += objectionable(self.model, self.task, new)
        self._cleared |= {*new} - {change.goal for change in unfit}
        found = {change.goal: change for change in (*overdue(beliefs, self.patience), *unfit)}
        if set(belief.goals) - {UNSPECIFIED} <= found.keys():
            likeliest = next((goal for goal, _ in belief.top() if goal != UNSPECIFIED), None)
            if likeliest and likeliest not in pinned:
                del found[likeliest]
        return list(found.values())


def drawn_lines(
    generator: Generator,
    prompt: str,
    *,
    draws: int,
    seed: int,
    max_tokens: int = 96,
    **values: object,
) -> list[str]:
    """Distinct lines of several lists that a model writes, in the order of their first mention.

    The first draw is the likeliest text, the others are sampled: a small model that repeats
    itself in one draw says something else in another.

    Raises:
        InvalidInputError: `generator` is no model that writes.
    """
    _check_writes(generator)
    messages = render(prompt, **values)
    lines: dict[str, str] = {}
    for draw in range(draws):
        reply = generator.generate(
            messages, max_tokens=max_tokens, temperature=0.8 if draw else 0.0, seed=seed + draw
        )
        whole = reply.text.split("\n")
        if reply.finish == "length":
            whole = whole[:-1]
        for line in whole:
            text = " ".join(_BULLET.sub("", line).split()).strip(" .,;\"'")
            if 2 <= len(text) <= 100 and not _NOT_ONE.search(text):
                lines.setdefault(meaning(text), text)
    return list(lines.values())


def _check_writes(generator: object) -> None:
    needs = ("generate", "count_tokens", "context_size")
    lacks = [each for each in needs if not hasattr(generator, each)]
    if lacks or isinstance(generator, type):
        raise InvalidInputError(
            "generator must be a model that is open and can write, such as "
            f"open_model('model.gguf'), not {generator!r}"
            f"{f', which lacks {lacks[0]}' if 0 < len(lacks) < len(needs) else ''}."
        )


def _gist(text: str) -> str:
    """What is equal for goals that say the same in the same words, determiners aside."""
    return " ".join(word for word in meaning(text).split() if word not in _DETERMINERS)


def propose(
    generator: Generator,
    likelihood: Likelihood | None,
    task: str,
    turns: Sequence[Turn],
    goals: Sequence[Goal],
    *,
    past: Sequence[Goal] = (),
    draws: int = 4,
    keep: int = 3,
    seed: int = 0,
) -> list[GoalChange]:
    """Goals to add, given the task, the transcript and the known goals.

    Known are those of the belief, and its `ruled_out`.

    Several lists are drawn from the model. With a likelihood, those `keep` candidates are taken
    that explain the person's words best, and better than no goal; without one, the first
    `keep`. Goals of the `past`, which were removed when other words had been said, are candidates
    again, where there is a likelihood. What speaks of the prompt's examples is none, nor what
    differs from another goal by an article or the like.

    Raises:
        InvalidInputError: `generator` is no model that writes.
    """
    _check_writes(generator)
    known = {_gist(goal.text) for goal in (*goals, *past)}
    shown = examples(render("propose", task=task, turns=(), goals=()))
    borrowed = topics(shown) - topics(" ".join([task, *(turn.utterance for turn in turns)]))
    candidates = [*past] if likelihood else []
    for text in drawn_lines(
        generator,
        "propose",
        draws=draws,
        seed=seed,
        task=task,
        turns=recent(generator, turns, 6),
        goals=[goal for goal in goals if goal != UNSPECIFIED],
    ):
        if _gist(text) not in known and len(topics(text) & borrowed) < _BORROWED:
            candidates.append(Goal(text))
            known.add(_gist(text))
    if likelihood is None:
        return [GoalChange("added", goal, "the model proposed it") for goal in candidates[:keep]]
    if not candidates:
        return []
    table = likelihood.log_likelihood(task, [*candidates, UNSPECIFIED], turns)
    gains: list[float] = (table[:, :-1].sum(axis=0) - table[:, -1].sum()).tolist()
    best = sorted(zip(candidates, gains, strict=True), key=lambda each: -each[1])[:keep]
    return [
        GoalChange(
            "added",
            goal,
            f"explains the words {gain:+.1f} nats against no goal"
            + (", after it had been removed" if goal in past else ""),
        )
        for goal, gain in best
        if gain > 0
    ]


def objectionable(
    model: LikelihoodModel, task: str, goals: Sequence[Goal], *, margin: float = 1.0
) -> list[GoalChange]:
    """Goals that are unsafe, as far as the model can tell.

    The log-odds, in nats, of two contrasts add up: how likely it is to refuse the goal, against a
    yes, and how likely the goal is as a crime, against a harmless plan (the mean of two prompts).

    Args:
        model: Weighs the answers and the goals.
        task: The agent's task.
        goals: Goals to check; `UNSPECIFIED` is never removed.
        margin: Log-odds above which a goal goes.
    """
    asked = [goal for goal in goals if goal != UNSPECIFIED]
    requests = [render("remove", task=task, goal=goal) for goal in asked]
    plans = [
        render("harm", question=question, speaker=speaker, harmful=harmful)
        for question, speakers in _SPEAKERS.items()
        for speaker, harmful in zip(speakers, (True, False), strict=True)
    ]
    scores = logprobs_of(
        model,
        [*requests, *requests, *(plan for plan in plans for _ in asked)],
        [REFUSAL] * len(asked) + [CONSENT] * len(asked) + [goal.text for goal in asked] * 4,
    )
    no, yes, harm, good, cruel, kind = np.array([float(s.sum()) for s in scores]).reshape(6, -1)
    odds: list[float] = (no - yes + (harm - good + cruel - kind) / 2).tolist()
    return [
        GoalChange("removed", goal, f"unsafe, the model finds ({value:+.1f} nats)", final=True)
        for goal, value in zip(asked, odds, strict=True)
        if value > margin
    ]


def irrelevant(
    model: LikelihoodModel, task: str, goals: Sequence[Goal], *, margin: float = 0.5
) -> list[GoalChange]:
    """Goals that people have less often under the agent's task than under any.

    Args:
        model: Tells how likely a goal is, given a task.
        task: The agent's task.
        goals: Goals to check; `UNSPECIFIED` is never removed.
        margin: Loss in nats a token above which a goal goes.
    """
    asked = [goal for goal in goals if goal != UNSPECIFIED]
    contexts = [render("relevance", task=each) for each in (ANY_TASK, task)]
    scores = logprobs_of(
        model, [context for context in contexts for _ in asked], [goal.text for goal in asked] * 2
    )
    means = np.array([float(score.mean()) for score in scores]).reshape(2, -1)
    losses: list[float] = (means[0] - means[1]).tolist()
    return [
        GoalChange(
            "removed",
            goal,
            f"irrelevant: the task makes it less likely (-{loss:.1f} nats)",
            final=True,
        )
        for goal, loss in zip(asked, losses, strict=True)
        if loss > margin
    ]


def overdue(beliefs: Sequence[Belief], patience: int) -> list[GoalChange]:
    """The goal that was the least likely in more than `patience` rounds in a row, if any.

    Args:
        beliefs: The belief after each round, the present one last.
        patience: n in the paper (Sec. 3.2).
    """
    worst = _least_likely(beliefs[-1]) if beliefs else None
    if worst is None:
        return []
    streak = 0
    for belief in reversed(beliefs):
        if _least_likely(belief) != worst:
            break
        streak += 1
    if streak <= patience:
        return []
    return [GoalChange("removed", worst, f"the least likely for {streak} rounds in a row")]


def _least_likely(belief: Belief) -> Goal | None:
    """The least likely specified goal; None where there are fewer than two to compare."""
    ranked = [goal for goal, _ in belief.top() if goal != UNSPECIFIED]
    return ranked[-1] if len(ranked) > 1 else None
