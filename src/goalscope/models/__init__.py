"""The interfaces of language models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from goalscope.base.arrays import Array
from goalscope.base.types import Message, UnreadableAnswerError

CLOSED = "This model is closed; open it again with open_model(...)."
"""The error of any call after `close`."""


@dataclass(frozen=True, slots=True)
class Completion:
    """A reply of a model, and its cost.

    Attributes:
        text: The reply, without the end-of-turn token.
        finish: "stop" at an end-of-turn or stop string, "length" at `max_tokens`.
        prompt_tokens: Tokens of the prompt.
        completion_tokens: Tokens written.
        log_probability: Of the text and its end, nats; None if the model does not report it.
        margins: For each line, the smallest lead in nats of one of its tokens over the likeliest
            alternative; None likewise. The end of a line belongs to the next line, the end of the
            text to the last one.
    """

    text: str
    finish: str
    prompt_tokens: int
    completion_tokens: int
    log_probability: float | None = None
    margins: tuple[float, ...] | None = None


class LanguageModel(Protocol):
    """The common interface of models that write and models that score."""

    @property
    def context_size(self) -> int:
        """Maximum number of tokens of a prompt with its continuation."""
        ...

    def count_tokens(self, messages: Sequence[Message]) -> int:
        """Number of tokens of the rendered chat, up to where the assistant's words begin."""
        ...


class Generator(LanguageModel, Protocol):
    """A model that writes."""

    @property
    def takes_grammar(self) -> bool:
        """Whether `generate` accepts a `grammar`."""
        ...

    def generate(
        self,
        messages: Sequence[Message],
        *,
        max_tokens: int = 256,
        temperature: float = 0.0,
        seed: int = 0,
        stop: Sequence[str] = (),
        schema: Mapping[str, Any] | None = None,
        grammar: str | None = None,
    ) -> Completion:
        """Write the assistant's next message.

        Args:
            messages: The chat so far; the last one is not the assistant's.
            max_tokens: Maximum number of tokens to write.
            temperature: 0 always takes the likeliest token.
            seed: Seed of the sampler; the same seed gives the same text.
            stop: Strings that end the reply, and are not part of it.
            schema: JSON schema that the reply must satisfy.
            grammar: GBNF grammar of the reply, in place of a schema.

        Raises:
            ModelError: The messages do not fit the context, the model failed, or it does not accept
                a grammar.
        """
        ...


class LikelihoodModel(LanguageModel, Protocol):
    """A model that scores given words."""

    def token_logprobs(
        self,
        contexts: Sequence[Sequence[Message]],
        continuations: Sequence[str],
    ) -> list[Array]:
        """Log-probability of each token of an assistant message, given the chat before it.

        Args:
            contexts: One chat per pair; the message after it is the assistant's.
            continuations: The assistant's words, one per context.

        Returns:
            One float64 array [N] in nats per pair; N is the number of scored tokens.

        Raises:
            ModelError: A pair does not fit the context window (check with `count_tokens`).
        """
        ...


class Model(Generator, LikelihoodModel, Protocol):
    """A model that both writes and scores."""


@runtime_checkable
class Roles(Protocol):
    """Which part of a model does what, for one with adapters; see `ModelSet`.

    Attributes:
        speaker: Scores utterances.
        scorer: Scores, without an adapter.
        reader: Reads utterances.
        taught: Whether the reader has an adapter.
        writer: Proposes goals, needs and questions with an adapter; None without one.
    """

    speaker: LikelihoodModel
    scorer: LikelihoodModel
    reader: Generator
    taught: bool
    writer: Model | None


class OpenGenerator(Generator, Protocol):
    """A model that writes, with what `open_model` adds."""

    @property
    def name(self) -> str:
        """The name of the model."""
        ...

    @property
    def fingerprint(self) -> str:
        """An identifier that changes with anything that may change answers, such as weights."""
        ...

    def describe(self) -> str:
        """A one-line description."""
        ...

    def close(self) -> None:
        """Free its resources; it cannot be used afterwards."""
        ...


def unfinished_json(room: int) -> UnreadableAnswerError:
    """The error for JSON that is incomplete after `room` tokens."""
    return UnreadableAnswerError(
        f"The model did not finish its answer within {room} tokens. Allow more tokens, or "
        "limit the schema's lengths (maxLength, maxItems)."
    )


def model_name(model: object) -> str:
    """The name under which a model and its calibrations are filed."""
    return getattr(model, "name", type(model).__name__)
