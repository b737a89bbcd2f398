"""The base of scoring models: chats to token ids, and a self-test."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.types import Message, ModelError
from goalscope.models import LikelihoodModel, model_name
from goalscope.models.chat import ChatTokenizer, opens_thought
from goalscope.models.trace import traced

TOLERANCE = 0.2
"""Maximum difference in nats between two ways to compute a number; BF16 needs some."""

LEAST = -1000.0
"""Log-probability below which a number is a placeholder; servers write -9999 for unknown ones."""

PREFERENCE = 0.5
"""Minimum nats per token by which a true sentence beats scrambled words; 10 is usual."""

_QUESTION = "What is the capital of France?"
_LIKELY, _UNLIKELY = "The capital of France is Paris.", "Cheese seven the under is sings."


class Pair(NamedTuple):
    """A prompt, and the answer to score after it, as token ids."""

    prompt: list[int]
    answer: list[int]
    opening: Message | None = None  # of the chat; pairs that share it have the most in common


@dataclass(frozen=True, slots=True)
class SelfTest:
    """The consistency of a model's answers.

    Attributes:
        generation_error: The likeliest next token: its log-probability as the model generates it,
            and as it scores it, nats.
        batch_error: Two sentences scored together, and each alone with nothing kept, nats.
        preference: How much likelier a true sentence is than scrambled words, nats a token.
        in_thought: Whether the words are scored as part of a thought that the prompt opens.
    """

    generation_error: float
    batch_error: float
    preference: float
    in_thought: bool = False

    @property
    def complaint(self) -> str:
        """The problem; empty if there is none."""
        if self.in_thought:
            return (
                "The prompt opens a thought, so that words would be scored as part of it and not "
                "as what is said. Use a chat template that closes it."
            )
        if not self.generation_error < TOLERANCE:
            return (
                "The log-probability of a token as the model writes it and as it scores it differ "
                f"by {self.generation_error:.2f} nats (at most {TOLERANCE} is sound)."
            )
        if not self.batch_error < TOLERANCE:
            return (
                "Sentences scored together and alone differ by "
                f"{self.batch_error:.2f} nats (at most {TOLERANCE} is sound)."
            )
        if not self.preference > PREFERENCE:
            return (
                "A true sentence is hardly likelier than scrambled words: by "
                f"{self.preference:.2f} nats a token (at least {PREFERENCE} is sound)."
            )
        return ""


def are_logprobs(row: Array) -> bool:
    """Whether all numbers can be log-probabilities of tokens, nats; NaN cannot."""
    return bool(((row > LEAST) & (row < 1e-3)).all())


def logprobs_of(
    model: LikelihoodModel,
    contexts: Sequence[Sequence[Message]],
    continuations: Sequence[str],
) -> list[Array]:
    """What a model's `token_logprobs` returns, checked, whoever wrote the model.

    Raises:
        ModelError: As the model does; or it returned what `LikelihoodModel` does not ask for.
    """
    rows = model.token_logprobs(contexts, continuations)
    if wrong := _wrong(rows, continuations):
        raise ModelError(
            f"token_logprobs of the model {model_name(model)} must return a list with one array of "
            "floats for each pair: the log-probability in nats of each token of the words, whose "
            f"number is the same after any chat. But {wrong}."
        )
    return rows


def _wrong(rows: Any, continuations: Sequence[str]) -> str:
    """What is wrong with what a model returned for these words; empty if nothing is."""
    if not isinstance(rows, list) or len(cast("list[Any]", rows)) != len(continuations):
        return f"{len(continuations)} pairs have {str(cast('Any', rows))[:60]}"
    sizes: dict[str, int] = {}
    for row, words in zip(cast("list[Any]", rows), continuations, strict=True):
        shown = f"{words[:60]!r} has {str(row)[:60]} ({type(row).__name__})"
        if getattr(row, "ndim", 0) != 1 or row.dtype.kind != "f":
            return shown
        if not are_logprobs(row):
            return f"{shown}, which no log-probabilities can be"
        if not len(row) and any(map(str.isalnum, words)):
            return shown
        if sizes.setdefault(words, len(row)) != len(row):
            return f"{words[:60]!r} has {sizes[words]} after one chat and {len(row)} after another"
    return ""


class TokenScorer(ABC):
    """A likelihood model that works on token ids.

    Text never becomes a control token, whatever it says. Some chat templates (SmolLM2's, Qwen2.5's)
    put a default system message before a chat that does not begin with one.

    Attributes:
        name: The model's name.
        tokenizer: Turns chats into token ids.
        context_size: Most tokens that one pair (context and continuation) may have.
    """

    name: str
    tokenizer: ChatTokenizer
    context_size: int

    @abstractmethod
    def score(self, pairs: Sequence[Pair]) -> list[Array]:
        """Log-probability [N] in nats of each token of each pair's answer, at least one token."""

    @abstractmethod
    def likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        """The likeliest token after a prompt, as the model would write it, and its nats."""

    @abstractmethod
    def clear_cache(self) -> None:
        """Clear the cached prompts; results stay the same, but the next calls take longer."""

    @property
    @abstractmethod
    def fingerprint(self) -> str:
        """Differs where answers may differ: other weights, another type of them, another engine."""

    @abstractmethod
    def describe(self) -> str:
        """One line on what is loaded."""

    @abstractmethod
    def close(self) -> None:
        """Free the model's resources."""

    @property
    def remedy(self) -> str:
        """The remedy for answers that are not log-probabilities."""
        return "Run `goalscope models check MODEL` for details."

    def count_tokens(self, messages: Sequence[Message]) -> int:
        """Number of tokens of the rendered chat, up to where the assistant's words begin."""
        return self.tokenizer.count(messages)

    @traced
    def token_logprobs(
        self,
        contexts: Sequence[Sequence[Message]],
        continuations: Sequence[str],
    ) -> list[Array]:
        """See `LikelihoodModel.token_logprobs`.

        Raises:
            ModelError: A pair does not fit the context window (`count_tokens` tells beforehand),
                or the model's answer is no log-probability.
        """
        pairs: list[Pair] = []
        for messages, words in zip(contexts, continuations, strict=True):
            answer = self.tokenizer.tokenize(words)
            pair = Pair(self.tokenizer.render(messages), answer, messages[0] if messages else None)
            self.check_length(len(pair.prompt) + len(answer))
            pairs.append(pair)
        scored = iter(self.score([pair for pair in pairs if pair.answer]))
        rows = [next(scored) if pair.answer else np.zeros(0) for pair in pairs]
        for row, pair in zip(rows, pairs, strict=True):
            if len(row) != len(pair.answer) or not are_logprobs(row):
                raise ModelError(
                    f"{self.describe()} returned invalid log-probabilities: "
                    f"{row[:8].tolist()} for {len(pair.answer)} tokens. {self.remedy}"
                )
        return rows

    def check_length(self, tokens: int) -> None:
        """Refuse a text that does not fit the context.

        Raises:
            ModelError: It is too long.
        """
        if tokens > self.context_size:
            raise ModelError(
                f"The text has {tokens} tokens, but the model's context holds "
                f"{self.context_size}. Shorten it, or raise the context size."
            )

    def self_test(self) -> SelfTest:
        """Score a known pair of texts in several ways that must agree."""
        prompt = self.tokenizer.render([Message("user", _QUESTION)])
        token, generated = self.likeliest(prompt)
        answers = [self.tokenizer.tokenize(text) for text in (_LIKELY, _UNLIKELY)]
        pairs = [Pair(prompt, answer) for answer in answers]
        (scored,) = self.score([Pair(prompt, [token])])
        together = self.score(pairs)
        alone: list[Array] = []
        for pair in pairs:
            self.clear_cache()
            alone += self.score([pair])
        return SelfTest(
            generation_error=abs(float(scored[0]) - generated),
            batch_error=max(
                abs(float(a.sum() - b.sum())) for a, b in zip(together, alone, strict=True)
            ),
            preference=float(together[0].mean() - together[1].mean()),
            in_thought=opens_thought(self.tokenizer.detokenize(prompt, markup=True)),
        )
