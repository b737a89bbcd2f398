"""The language-model evaluator (Sec. 5.1): scores what an agent achieved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from goalscope.base.inputs import parse_json, validated
from goalscope.base.types import InvalidInputError, Message, UnreadableAnswerError
from goalscope.models import Generator
from goalscope.models.trace import during
from goalscope.prompts import render

SCORES = tuple(n / 4 for n in range(13))
"""Every score that there is: 0, the least reasonable, to 3 in quarters."""

JUDGE_TEMPERATURE = 0.7
"""What trials are sampled at by default. The paper has 0, where a model in this process always
answers the same and a server nearly so: the spread of trials then does not say how sure the
evaluator is."""

_LONGEST = 1000  # characters that are kept of what a model wrote
_ROOM = 512  # tokens of a verdict
_SCHEMA: Mapping[str, Any] = {
    "type": "object",
    "properties": {
        "explanation": {"type": "string", "maxLength": 400},
        "score": {"type": "number", "enum": [int(s) if s.is_integer() else s for s in SCORES]},
    },
    "required": ["explanation", "score"],
    "additionalProperties": False,
}


@dataclass(frozen=True, slots=True)
class _Verdict:
    explanation: str
    score: float


@dataclass(frozen=True, slots=True)
class Trial:
    """One reading by the evaluator.

    Attributes:
        score: One of `SCORES`; None where the answer could not be read.
        explanation: Why that score, or why there is none.
        answer: What the model wrote, if it was handed over and could not be read.
    """

    score: float | None
    explanation: str
    answer: str = ""


@during(module="judge")
def judge(
    generator: Generator,
    *,
    task: str,
    description: str,
    outcome: str = "",
    actions: Sequence[str] = (),
    possible: Sequence[str] = (),
    empty: bool = False,
    trials: int = 20,
    seed: int = 0,
    temperature: float = JUDGE_TEMPERATURE,
) -> list[Trial]:
    """Have an episode's outcome scored; the conversation is not shown, as in the paper.

    Models invent a basket where there is none, so an outcome in which nothing was achieved is never
    shown to one: all its trials are 0, as in the paper.

    Args:
        generator: The evaluator.
        task: The agent and its task.
        description: The person's profile.
        outcome: The final state, such as the basket; empty to show the actions alone.
        actions: Every action that stands, in order; none to show the final state alone.
        possible: Names of all actions that the agent can take.
        empty: Whether nothing was achieved, whatever `outcome` says of it.
        trials: How often to ask, at any temperature.
        seed: Seed of the trials: as many with another seed are all others.
        temperature: What is sampled at; the paper has 0.

    Raises:
        ModelError: The model failed, or the prompt does not fit. A reply that came and cannot be
            read raises nothing: its trial has no score.
    """
    if trials < 1:
        raise InvalidInputError(f"An outcome is scored in at least 1 trial, not {trials}.")
    if empty or not (outcome.strip() or actions):
        return [Trial(0.0, "Nothing was achieved; the model was not asked.")] * trials
    prompt = render(
        "judge",
        task=task,
        description=" ".join(description.split()),
        outcome=outcome.strip(),
        actions=actions,
        possible=possible,
    )
    return [_ask(generator, prompt, temperature, seed * trials + n) for n in range(trials)]


def _ask(generator: Generator, prompt: Sequence[Message], temperature: float, seed: int) -> Trial:
    """One trial, whatever the model answers."""
    try:
        text = generator.generate(
            prompt, max_tokens=_ROOM, temperature=temperature, seed=seed, schema=_SCHEMA
        ).text
    except UnreadableAnswerError as error:
        return Trial(None, _kept(str(error)))
    try:
        verdict = validated(parse_json(text), _Verdict, "The answer")
        if verdict.score not in SCORES:
            raise InvalidInputError("The score is not one from 0 to 3 in quarters.")
    except (ValueError, RecursionError) as error:
        return Trial(None, _kept(str(error)), _kept(text))
    return Trial(verdict.score, _kept(verdict.explanation))


def _kept(text: str) -> str:
    """The beginning of a text, without halves of characters, which no file can hold."""
    whole = text.encode(errors="replace").decode()
    return whole if len(whole) <= _LONGEST else f"{whole[:_LONGEST]} [...]"
