"""From logits to tokens: log-probabilities, sampling, and JSON schemas as a filter."""

from __future__ import annotations

import ctypes
import json
import weakref
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from goalscope.extras import package
from goalscope.models.native import Weights
from goalscope.types import ModelError

__all__ = ["MIN_P", "Grammar", "LLGuidanceGrammar", "LlamaGrammar", "Logits", "choose", "log_prob"]

MIN_P = 0.05
"""Tokens less likely than this share of the likeliest are never sampled."""

Logits = npt.NDArray[np.float32]


class Grammar(Protocol):
    """A JSON schema as a filter of next tokens."""

    def filter(self, logits: Logits, tokens: npt.NDArray[np.int32]) -> Logits:
        """The `logits` of `tokens`, with -inf for tokens that cannot come next."""
        ...

    def accept(self, token: int) -> None:
        """Move on past `token`."""
        ...


class LlamaGrammar:
    """A `Grammar` by llama.cpp."""

    def __init__(self, weights: Weights, schema: Mapping[str, Any]) -> None:
        """Compile `schema`.

        Raises:
            ModelError: llama.cpp cannot turn it into a grammar.
        """
        from llama_cpp.llama_grammar import json_schema_to_gbnf

        self._lib = weights.lib
        rules = json_schema_to_gbnf(json.dumps(schema)).encode()
        self._sampler = self._lib.llama_sampler_init_grammar(weights.vocab, rules, b"root")
        if not self._sampler:
            raise ModelError("This JSON schema cannot be turned into a grammar. Simplify it.")
        weakref.finalize(self, self._lib.llama_sampler_free, self._sampler)
        dtype = [("id", np.int32), ("logit", np.float32), ("p", np.float32)]
        self._candidates = np.zeros(weights.vocab_size, dtype)

    def filter(self, logits: Logits, tokens: npt.NDArray[np.int32]) -> Logits:
        """See `Grammar.filter`."""
        data = self._candidates[: len(tokens)]
        data["id"], data["logit"] = tokens, logits[tokens]
        pointer = ctypes.cast(data.ctypes.data, self._lib.llama_token_data_p)
        array = self._lib.llama_token_data_array(pointer, len(tokens), -1, False)
        self._lib.llama_sampler_apply(self._sampler, ctypes.byref(array))
        return np.array(data["logit"])

    def accept(self, token: int) -> None:
        """See `Grammar.accept`."""
        self._lib.llama_sampler_accept(self._sampler, token)


class LLGuidanceGrammar:
    """A `Grammar` by llguidance."""

    def __init__(self, tokenizer: Any, schema: Mapping[str, Any]) -> None:
        """Compile a schema.

        Args:
            tokenizer: An `llguidance.LLTokenizer`.
            schema: A JSON schema.

        Raises:
            ModelError: llguidance cannot turn it into a grammar.
        """
        matcher = package("llguidance").LLMatcher
        layout = {"whitespace_flexible": False, "item_separator": ", ", "key_separator": ": "}
        rules = matcher.grammar_from_json_schema(json.dumps(schema), overrides=layout)
        self._matcher = matcher(tokenizer, rules, log_level=0)
        if self._matcher.is_error():
            reason = self._matcher.get_error().partition("\n")[0]
            raise ModelError(
                f"This JSON schema cannot be turned into a grammar ({reason}). Simplify it."
            )
        self._allowed: npt.NDArray[np.uint8] | None = None

    def filter(self, logits: Logits, tokens: npt.NDArray[np.int32]) -> Logits:
        """See `Grammar.filter`."""
        if self._allowed is None:
            bits = np.frombuffer(self._matcher.compute_bitmask(), np.uint8)
            self._allowed = np.unpackbits(bits, bitorder="little")
        return np.where(self._allowed[tokens], logits[tokens], np.float32(-np.inf))

    def accept(self, token: int) -> None:
        """See `Grammar.accept`."""
        self._matcher.consume_token(token)
        self._allowed = None


def choose(
    logits: Logits, temperature: float, random: np.random.Generator, grammar: Grammar | None
) -> int:
    """Sample the next token from its logits [vocabulary]; at temperature 0, take the likeliest.

    The whole vocabulary meets the grammar, which is slow, only if the first choice fails it.
    """
    token = _sample(logits, temperature, random)
    if grammar is not None:
        if np.isneginf(grammar.filter(logits, np.array([token], np.int32))[0]):
            everything = np.arange(len(logits), dtype=np.int32)
            token = _sample(grammar.filter(logits, everything), temperature, random)
        grammar.accept(token)
    return token


def _sample(logits: Logits, temperature: float, random: np.random.Generator) -> int:
    if temperature <= 0:
        return int(np.argmax(logits))
    ratios = np.exp(logits - logits.max())
    kept = np.flatnonzero(ratios >= MIN_P)
    weights = ratios[kept].astype(np.float64) ** (1 / temperature)
    return int(random.choice(kept, p=weights / weights.sum()))


def log_prob(logits: Logits, token: int) -> float:
    """Log-probability of a token in nats, from the logits [vocabulary] before it."""
    top = logits.max()
    total = np.exp(logits - top).sum(dtype=np.float64)
    return float(logits[token]) - float(top) - float(np.log(total))
