"""How likely a person's words are under each goal (Sec. 3.2, Eq. 2)."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from inspect import signature
from typing import Any, Literal, Protocol, cast

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.text import plain
from goalscope.base.types import (
    UNSPECIFIED,
    Goal,
    InvalidInputError,
    Message,
    ModelError,
    Turn,
)
from goalscope.belief.calibration import Calibration, known_calibration
from goalscope.models import LikelihoodModel, Roles
from goalscope.models.adapters import FITTED_LAYOUT, NO_ADAPTER
from goalscope.models.embedding import embedded
from goalscope.models.opening import adapter_metadata
from goalscope.models.scoring import logprobs_of
from goalscope.models.trace import scoring
from goalscope.prompts import render, transcript

Layout = Literal["goal-first", "goal-last"]
"""Where the likelihood prompt states the goal; see `RolePlay`."""

DEFAULT_LAYOUT: Layout = "goal-last"
"""The layout that separated goals better on development dialogues (docs/log.md)."""

UNRELATED = 0.1
"""Cosine of words and a wrong goal of their domain, in the mean (corpus/changes)."""

GOAL_TOKENS = 256
"""Tokens that every context reserves for the goal, so that all goals see the same turns."""


class Likelihood(Protocol):
    """Evidence for each goal from each turn.

    A column must depend on its own goal alone: then a goal that is added later gets the evidence
    that it would have had from the start. (What scores all goals together is a
    `goalscope.belief.method.Method`.) `UNSPECIFIED` may be among the goals, and stands for a
    person with no stated goal.
    """

    @property
    def calibration(self) -> Calibration:
        """The default calibration for this evidence; `PAPER` uses it as it is."""
        ...

    def log_likelihood(
        self, task: str, goals: Sequence[Goal], turns: Sequence[Turn], *, since: int = 0
    ) -> Array:
        """Score the utterances of `turns[since:]`, each given all turns before it.

        Returns:
            [T - since, G] log P(utterance | goal) in nats; -inf means impossible.

        Raises:
            InvalidInputError: A goal or an utterance is too long for the model.
        """
        ...


class RolePlay:
    """log P(u | g, q, transcript): the model plays a person who has goal g (Eq. 2).

    With a `similarity`, it is a product of experts (Hinton, 2002): how like the words and the goal
    are in meaning counts beside it, which is no likelihood of words by itself. 0 is the paper's.

    In the chat that the model sees, the person is the *assistant* and the agent's queries are the
    user's messages. `UNSPECIFIED` is the same prompt without a goal. When the context is full, the
    oldest turns are dropped, the same ones for every goal; task and goal always stay.

    Args:
        model: Scores the words; by its `speaker`, if it has one (see `ModelSet`).
        layout: Where the goal stands: in the instruction ("goal-first"), or beside the agent's
            last query ("goal-last"). With both, goals share their common prefix in the cache.
        similarity: Nats for a cosine of 1 between the words and a goal, beside the log-likelihood;
            None for that of the calibration.

    Raises:
        InvalidInputError: There is no such layout, or the model's adapter was fitted with another.
    """

    def __init__(
        self,
        model: LikelihoodModel,
        *,
        layout: Layout = DEFAULT_LAYOUT,
        similarity: float | None = None,
    ) -> None:
        self.model = model.speaker if isinstance(model, Roles) else model
        fitted = adapter_metadata(model).get(FITTED_LAYOUT, layout)
        if fitted != layout:
            raise InvalidInputError(
                f"The adapter was fitted with the layout {fitted}, not {layout}. Give --layout "
                f"{fitted}, or --adapter {NO_ADAPTER}."
            )
        self.layout: Layout = layout
        self._similarity = similarity
        self._calibration: Calibration | None = None

    @property
    def calibration(self) -> Calibration:
        """The calibration for this model, adapter and prompt; see `known_calibration`."""
        if self._calibration is None:
            self._calibration, _ = known_calibration(self.model, self.layout)
        return self._calibration

    def log_likelihood(
        self, task: str, goals: Sequence[Goal], turns: Sequence[Turn], *, since: int = 0
    ) -> Array:
        """See `Likelihood.log_likelihood`; the words count as they are in `plain` text."""
        turns = [turn.plain() for turn in turns]
        contexts: list[list[Message]] = []
        pairs: list[dict[str, Any]] = []
        for t in range(since, len(turns)):
            start = self.window(task, turns[: t + 1])
            for goal in goals:
                contexts.append(self.context(task, goal, turns[start : t + 1]))
                pairs.append({"goal": goal.text, "turn": t + 1})
        for goal in goals:
            tokens = self.model.count_tokens([Message("user", goal.text)])
            if tokens > GOAL_TOKENS:
                raise InvalidInputError(
                    f"A goal has {tokens} tokens; a goal may have {GOAL_TOKENS}. "
                    f"Say it in fewer words: {goal.text[:60]!r}..."
                )
        words = [turn.utterance for turn in turns[since:] for _ in goals]
        with scoring(pairs):
            scores = logprobs_of(self.model, contexts, words)
        values = np.array([float(score.sum()) for score in scores])
        table = values.reshape(len(turns) - since, len(goals))
        if similarity := self.similarity:
            table += similarity * likeness(goals, turns)[since:]
        return table

    @property
    def similarity(self) -> float:
        """Nats for a cosine of 1 between the words and a goal."""
        return self.calibration.similarity if self._similarity is None else self._similarity

    def token_log_likelihood(
        self, task: str, goals: Sequence[Goal], turns: Sequence[Turn]
    ) -> tuple[list[str], Array]:
        """The tokens of the last utterance as text, and their [N, G] log-probabilities, nats.

        A character of several tokens belongs to the last of them.

        Raises:
            ModelError: The model has no tokenizer.
        """
        tokenizer = getattr(self.model, "tokenizer", None)
        if tokenizer is None:
            raise ModelError("The model that scores has no tokenizer.")
        turns = [turn.plain() for turn in turns]
        read = turns[self.window(task, turns) :]
        words = turns[-1].utterance
        contexts = [self.context(task, goal, read) for goal in goals]
        scores = logprobs_of(self.model, contexts, [words] * len(goals))
        tokens: list[int] = tokenizer.tokenize(words)
        ends = [
            len(tokenizer.detokenize(tokens[:end]).rstrip("\N{REPLACEMENT CHARACTER}"))
            for end in range(len(tokens))
        ]
        pieces = [words[start:end] for start, end in itertools.pairwise([*ends, len(words)])]
        return pieces, np.stack(scores, axis=1)

    def window(self, task: str, turns: Sequence[Turn]) -> int:
        """Index of the first turn that fits the context when the last utterance is scored.

        Turns are dropped in blocks of four, so that the cache stays useful in later rounds.
        """
        last = Message("assistant", turns[-1].utterance)
        for start in (*range(0, len(turns) - 1, 4), len(turns) - 1):
            context = [*self.context(task, UNSPECIFIED, turns[start:]), last]
            if self.model.count_tokens(context) + GOAL_TOKENS <= self.model.context_size:
                return start
        texts = {"utterance": turns[-1].utterance, "query": turns[-1].query, "task": task}
        what = max(texts, key=lambda each: len(texts[each]))
        raise InvalidInputError(
            f"The {what} is too long for the model ({len(texts[what]):,} characters; it reads "
            f"{self.model.context_size:,} tokens at once). Say it in fewer words."
        )

    def context(self, task: str, goal: Goal, turns: Sequence[Turn]) -> list[Message]:
        """The chat up to the last utterance, which the person with this goal says next."""
        text = "" if goal == UNSPECIFIED else plain(goal.text)
        *past, last = turns
        if self.layout == "goal-first":
            (system,) = render("goal_first", task=task, goal=text)
            query = Message("user", last.query)
        else:
            system, query = render("goal_last", task=task, goal=text, query=last.query)
        return [system, *transcript(past), query]


def likeness(goals: Sequence[Goal], turns: Sequence[Turn]) -> Array:
    """[T, G] how much each turn adds to the likeness of the talk and a goal; 0 for `UNSPECIFIED`.

    A talk is as like a goal as its most similar turn, by the cosine of static word vectors above
    `UNRELATED`. So likeness counts once, however long they talk: turns that go on about the same
    are no news of it.
    """
    words = embedded([plain(turn.utterance) for turn in turns])
    meant = embedded([plain(goal.text) for goal in goals])
    stated = np.array([goal != UNSPECIFIED for goal in goals], np.float64)
    most = np.maximum.accumulate(np.asarray(words @ meant.T, np.float64) - UNRELATED)
    return np.diff(most, axis=0, prepend=0) * stated


def evidence_of(
    likelihood: Likelihood,
    task: str,
    goals: Sequence[Goal],
    turns: Sequence[Turn],
    *,
    since: int = 0,
) -> Array:
    """[T - since, G] evidence in nats, from any likelihood.

    Raises:
        InvalidInputError: The likelihood returned something else.
    """
    found = likelihood.log_likelihood(task, goals, turns, since=since)
    expected = (len(turns) - since, len(goals))
    shape = getattr(found, "shape", type(found).__name__)
    if shape != expected:
        raise InvalidInputError(
            f"{type(likelihood).__name__}.log_likelihood must return an array of "
            f"{list(expected)} (turns from `since` on, goals), not {shape}."
        )
    try:
        table = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(
            f"{type(likelihood).__name__}.log_likelihood must return numbers in nats ({error})."
        ) from None
    wrong = np.isnan(table) | np.isposinf(table)
    if wrong.any():
        goal = goals[int(wrong.any(axis=0).argmax())]
        raise InvalidInputError(
            f"{type(likelihood).__name__}.log_likelihood must return numbers in nats, or -inf for "
            f"what is impossible, not {table[wrong][0]} for {goal.text!r}."
        )
    return table


def unusable(likelihood: object) -> str:
    """Why a user's own likelihood cannot be used; empty if it can."""
    signature = "log_likelihood(task, goals, turns, *, since=0)"
    return lacking(likelihood, signature, "likelihood.Likelihood", since=0)


def lacking(thing: object, signature: str, protocol: str, **named: object) -> str:
    """Why an object lacks a method of a task, goals and turns; empty if it has it.

    Args:
        thing: A user's own object.
        signature: The method as it is written, its name first.
        protocol: Where in `goalscope.belief` it is described.
        **named: Further arguments that it must take.
    """
    if isinstance(thing, type):
        return f"it is a class; give an instance, {thing.__name__}(...)"
    name = signature.partition("(")[0]
    if not callable(method := getattr(thing, name, None)):
        return f"it has no method {name}; see goalscope.belief.{protocol}"
    if wrong := misfit(method, "", [], [], **named):
        return f"{signature} is what it needs ({wrong})"
    return ""


def misfit(function: Callable[..., object], *given: object, **named: object) -> str:
    """Why a function cannot be called with these arguments; empty if it can."""
    try:
        signature(function).bind(*given, **named)
    except TypeError as error:
        return str(error)
    except ValueError:
        pass  # it is not written in Python
    return ""


def calibration_of(likelihood: Likelihood) -> Calibration:
    """The calibration of any likelihood.

    Raises:
        InvalidInputError: It has none.
    """
    found = cast("object", getattr(likelihood, "calibration", None))
    if not isinstance(found, Calibration):
        raise InvalidInputError(
            f"The attribute calibration of {type(likelihood).__name__} must be a Calibration, such "
            f"as PAPER, not {found!r}."
        )
    return found
