"""Questions worth asking: those whose answers are expected to tell most about the goal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from goalscope.belief import Belief
from goalscope.dialog import FALLBACK, OPENING, question_of, written
from goalscope.envs import Environment
from goalscope.likelihood import RolePlay
from goalscope.models import Generator, Heard
from goalscope.prompts import recent, render, transcript
from goalscope.types import UNSPECIFIED, Turn

__all__ = ["COST", "expected_gain", "information_gain", "informative", "narrowed", "unasked"]

Array = npt.NDArray[np.float64]

COST = 0.1
"""Nats that a question must be expected to tell."""

SAME = 0.7
"""Cosine of two questions' vectors from which on they ask the same (LOG.md)."""

_ANSWER = 16
"""Most tokens of a simulated answer, which is one sentence at most."""


def informative(
    model: Generator,
    likelihood: RolePlay,
    env: Environment,
    belief: Belief,
    turns: Sequence[Turn],
    *,
    most: int = 4,
    cost: float = COST,
    seed: int = 0,
    heard: Heard | None = None,
) -> tuple[str, float | None]:
    """The agent's next query: the question that is expected to tell most about the goal.

    An open question, which the person may wave off, where none is expected to tell more than it
    costs. Where the belief is so sure that no answer could, nothing is simulated: an answer cannot
    be expected to tell more than the belief's entropy.

    Args:
        model: Writes the questions, and the answers of simulated people.
        likelihood: Scores the answers.
        env: Where the agent acts.
        belief: Over the person's goals.
        turns: The conversation.
        most: Goals to tell apart, the likeliest ones.
        cost: Nats that a question must be expected to tell.
        seed: Of all that is drawn.
        heard: Is told each question as it is written.

    Returns:
        The query, and what its answer is expected to tell, in nats; None for an open question.
    """
    if not turns:
        return OPENING, None
    now = narrowed(belief, most)
    known = sum(p for _, p in belief.top(most))
    question, gain = FALLBACK, None
    if now.entropy > cost:
        stated = [goal for goal in now.goals if goal != UNSPECIFIED]
        _, questions = written(model, env, turns, stated, seed=seed, heard=heard)
        for each in unasked(questions, turns):
            found = known * expected_gain(each, model, likelihood, env.task, now, turns, seed=seed)
            if found > (cost if gain is None else gain):
                question, gain = each, found
    return question, gain


def narrowed(belief: Belief, most: int) -> Belief:
    """A belief over the `most` likeliest goals alone, as likely beside each other as they are."""
    top = belief.top(most)
    kept = [(goal, p) for goal, p in top if p > 0]
    return Belief(
        tuple(goal for goal, _ in kept),
        np.log([p for _, p in kept]),
        np.zeros((0, len(kept))),
        replace(belief.calibration, unstated=None),
    )


def unasked(questions: Sequence[str], turns: Sequence[Turn]) -> list[str]:
    """The questions that mean another thing than those that were asked."""
    from goalscope.models.embedding import embedded

    if not questions:
        return []
    asked = embedded([question_of(turn.query) for turn in turns])
    nearness = (embedded(questions) @ asked.T).max(axis=1)
    return [each for each, near in zip(questions, nearness, strict=True) if near < SAME]


def expected_gain(
    question: str,
    model: Generator,
    likelihood: RolePlay,
    task: str,
    belief: Belief,
    turns: Sequence[Turn],
    *,
    seed: int = 0,
) -> float:
    """What the answer to a question is expected to tell about the goal, in nats.

    One answer is drawn for each goal: `model` plays the person who has it, and what they say is
    scored under all goals, as real words are. The mean is at most the mutual information of goal
    and such answers (Lindley, 1956), since the scores are not those that the answers are drawn by
    (Barber and Agakov, 2003): people are played by the prompt of simulated ones, and not by that of
    the likelihood, which tells its goal whatever is asked (LOG.md).
    """
    past = recent(model, turns, 8)
    rows: list[Array] = []
    for number, goal in enumerate(belief.goals):
        wish = "You do not know yet what you want."
        if goal != UNSPECIFIED:
            wish = f"You want this: {goal.text}."
        *before, last = render("human", description=wish, turns=(), query=question, words=None)
        reply = model.generate(
            [*before, *transcript(past), last],
            max_tokens=_ANSWER,
            temperature=1.0,
            seed=seed + number,
            stop=(".", "!", "?", "\n"),
        )
        said = [*turns, Turn(question, " ".join(reply.text.split()).strip('" '))]
        rows.append(
            likelihood.log_likelihood(task, belief.goals, said, since=len(turns))[0]
            if said[-1].utterance
            else np.zeros(len(belief.goals))
        )
    return information_gain(belief, np.array(rows))


def information_gain(belief: Belief, answers: Array) -> float:
    """How much likelier the true goal is expected to be after an answer: mean log-ratio, nats.

    Args:
        belief: Before it, over `G` possible goals.
        answers: [G, G] log-likelihood in nats of the answer that the person with the goal of the
            row gives, under the goal of the column.
    """
    after = np.array([belief.observe(row).log_posterior for row in answers])
    return float(belief.probability @ (np.diagonal(after) - belief.log_posterior))
