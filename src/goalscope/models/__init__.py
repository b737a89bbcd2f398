"""What goalscope asks of a language model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from goalscope.types import Message, UnreadableAnswerError

__all__ = [
    "CLOSED",
    "Completion",
    "Generator",
    "LanguageModel",
    "LikelihoodModel",
    "Model",
    "OnText",
    "OpenGenerator",
    "OpenModel",
    "OpenScorer",
    "model_name",
    "unfinished_json",
]

Array = npt.NDArray[np.float64]

CLOSED = "This model is closed; open it again with open_model(...)."
"""The error of any call after `close`."""

OnText = Callable[[str], None]
"""Called with a text as it grows: all of it so far, each time."""


@dataclass(frozen=True, slots=True)
class Completion:
    """What a model wrote, and what it took.

    Attributes:
        text: The reply, without the end-of-turn token.
        finish: "stop" at an end-of-turn or stop string, "length" at `max_tokens`.
        prompt_tokens: Tokens of the prompt.
        completion_tokens: Tokens written.
        log_probability: Of the text and its end, nats; None where the model does not tell.
        margins: Line by line, the nats by which its least sure token led the next likeliest that
            could have come; None likewise. A line's end counts to what follows, the text's end to
            the last line.
    """

    text: str
    finish: str
    prompt_tokens: int
    completion_tokens: int
    log_probability: float | None = None
    margins: tuple[float, ...] | None = None


class LanguageModel(Protocol):
    """What is common to a model that writes and one that scores."""

    @property
    def context_size(self) -> int:
        """Most tokens of a prompt with what is written or scored after it."""
        ...

    def count_tokens(self, messages: Sequence[Message]) -> int:
        """Number of tokens of the rendered chat, up to where the assistant's words begin."""
        ...


class Generator(LanguageModel, Protocol):
    """A model that writes."""

    @property
    def takes_grammar(self) -> bool:
        """Whether `generate` takes a `grammar`."""
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
        on_text: OnText | None = None,
    ) -> Completion:
        """Write the assistant's next message.

        Args:
            messages: The chat so far; the last one is not the assistant's.
            max_tokens: Most tokens to write.
            temperature: 0 takes the likeliest token each time.
            seed: Seed of the sampler; the same seed gives the same text.
            stop: Strings that end the reply; they are not part of it.
            schema: JSON schema that the reply must satisfy.
            grammar: Rules of the reply in place of a schema, in llama.cpp's GBNF.
            on_text: Called with the reply as it is written, as far as that will not change; only
                at the end by a model that does not stream.

        Raises:
            ModelError: The messages do not fit the context, or the model failed, or takes no
                grammar.
        """
        ...


class LikelihoodModel(LanguageModel, Protocol):
    """A model that tells how likely given words are."""

    def token_logprobs(
        self,
        contexts: Sequence[Sequence[Message]],
        continuations: Sequence[str],
        *,
        end_of_turn: bool = False,
    ) -> list[Array]:
        """Log-probability of each token of an assistant message, given the chat before it.

        Args:
            contexts: One chat per pair; the message after it is the assistant's.
            continuations: The assistant's words, one per context.
            end_of_turn: Also score the token that ends the assistant's turn.

        Returns:
            One float64 array [N] in nats per pair; N is the number of scored tokens.

        Raises:
            ModelError: A pair does not fit the context window (`count_tokens` tells beforehand).
        """
        ...


class Model(Generator, LikelihoodModel, Protocol):
    """A model that both writes and scores."""


class Opened(Protocol):
    """What `open_model` adds to a model."""

    @property
    def name(self) -> str:
        """What the model is called."""
        ...

    @property
    def fingerprint(self) -> str:
        """Differs where answers may differ: other weights, another type of them, another engine."""
        ...

    def describe(self) -> str:
        """One line on what it is, and where."""
        ...

    def close(self) -> None:
        """Give back what it holds; nothing may be done with it afterwards."""
        ...


class OpenGenerator(Generator, Opened, Protocol):
    """An opened model that writes."""


class OpenScorer(LikelihoodModel, Opened, Protocol):
    """An opened model that scores."""


class OpenModel(OpenGenerator, OpenScorer, Protocol):
    """An opened model that does both."""


def unfinished_json(room: int) -> UnreadableAnswerError:
    """The error of a model whose JSON is not complete after `room` tokens."""
    return UnreadableAnswerError(
        f"The model did not finish its answer within {room} tokens. Allow more tokens, or "
        "limit the schema's lengths (maxLength, maxItems)."
    )


def model_name(model: object) -> str:
    """What a model, and its calibrations, are filed under: its name, or what kind it is."""
    return getattr(model, "name", type(model).__name__)
