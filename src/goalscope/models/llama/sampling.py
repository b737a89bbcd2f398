"""From logits to tokens: log-probabilities, sampling, and grammars as a filter."""

from __future__ import annotations

import ctypes
import json
import weakref
from collections.abc import Mapping
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from goalscope.base.types import ModelError, UnreadableAnswerError
from goalscope.models.llama.engine import Candidate, Candidates
from goalscope.models.llama.weights import Weights

MIN_P = 0.05
"""Tokens less likely than this share of the likeliest are never sampled."""

_NEAR = 32  # tokens among which the next likeliest is looked for, under a grammar

Logits = npt.NDArray[np.float32]
"""[vocabulary] unnormalised log-probabilities of the next token."""


class LlamaGrammar:
    """Rules in GBNF as a filter of next tokens, by llama.cpp."""

    def __init__(self, weights: Weights, rules: str) -> None:
        """Compile rules in GBNF.

        Raises:
            ModelError: llama.cpp cannot turn them into a grammar.
        """
        self._lib, self._weights = weights.lib, weights  # whose vocabulary the sampler keeps
        if "\0" in rules:
            raise ModelError("Rules of a grammar cannot hold a NUL character.")
        self._sampler = self._lib.llama_sampler_init_grammar(weights.vocab, rules.encode(), b"root")
        if not self._sampler:
            raise ModelError("Cannot compile this grammar. Simplify it.")
        weakref.finalize(self, self._lib.llama_sampler_free, self._sampler)
        dtype = [("id", np.int32), ("logit", np.float32), ("p", np.float32)]
        self._candidates = np.zeros(weights.vocab_size, dtype)

    def filter(self, logits: Logits, tokens: npt.NDArray[np.int32]) -> Logits:
        """The `logits` of `tokens`, with -inf for tokens that cannot come next."""
        data = self._candidates[: len(tokens)]
        data["id"], data["logit"] = tokens, logits[tokens]
        pointer = ctypes.cast(data.ctypes.data, ctypes.POINTER(Candidate))
        array = Candidates(pointer, len(tokens), -1, False)
        self._lib.llama_sampler_apply(self._sampler, ctypes.byref(array))
        return np.array(data["logit"])

    def accept(self, token: int) -> None:
        """Move on past `token`."""
        self._lib.llama_sampler_accept(self._sampler, token)


class LLGuidanceGrammar:
    """A JSON schema, or rules in GBNF, as a filter of next tokens, by llguidance."""

    def __init__(self, tokenizer: Any, rules: Mapping[str, Any] | str) -> None:
        """Compile a JSON schema, or rules in GBNF.

        Args:
            tokenizer: An `llguidance.LLTokenizer`.
            rules: The schema or the rules.

        Raises:
            ModelError: llguidance cannot turn them into a grammar.
        """
        import llguidance

        matcher = cast("Any", llguidance.LLMatcher)
        layout = {"whitespace_flexible": False, "item_separator": ", ", "key_separator": ": "}
        if isinstance(rules, str):
            from llguidance.gbnf_to_lark import gbnf_to_lark

            form = matcher.grammar_from_lark(gbnf_to_lark(rules))
        else:
            form = matcher.grammar_from_json_schema(json.dumps(rules), overrides=layout)
        self._matcher = matcher(tokenizer, form, log_level=0)
        if self._matcher.is_error():
            reason = self._matcher.get_error().partition("\n")[0]
            kind = "These rules" if isinstance(rules, str) else "This JSON schema"
            raise ModelError(f"{kind} cannot be compiled ({reason}). Simplify it.")
        self._allowed: npt.NDArray[np.uint8] | None = None

    def filter(self, logits: Logits, tokens: npt.NDArray[np.int32]) -> Logits:
        """The `logits` of `tokens`, with -inf for tokens that cannot come next."""
        if self._allowed is None:
            bits = np.frombuffer(self._matcher.compute_bitmask(), np.uint8)
            self._allowed = np.unpackbits(bits, bitorder="little")
        return np.where(self._allowed[tokens], logits[tokens], np.float32(-np.inf))

    def accept(self, token: int) -> None:
        """Move on past `token`."""
        self._matcher.consume_token(token)
        self._allowed = None


Grammar = LlamaGrammar | LLGuidanceGrammar
"""What a reply must keep to, as a filter of next tokens."""


class _Vocabulary:
    """The tokens of a GGUF file, as `llguidance.TokenizerWrapper` asks for them."""

    bos_token_id = None

    def __init__(self, weights: Weights) -> None:
        tokenizer = weights.chat_tokenizer
        ids = range(weights.vocab_size)
        self._weights = weights
        self.eos_token_id = tokenizer.end_of_turn
        self.special_token_ids = [token for token in ids if tokenizer.is_control(token)]
        hidden = frozenset(self.special_token_ids)
        self.tokens = [b"" if i in hidden else weights.piece(i, markup=False) for i in ids]

    def __call__(self, text: bytes) -> list[int]:
        return self._weights.tokenize(text.decode(errors="replace"), markup=False)


def gguf_vocabulary(weights: Weights) -> Any:
    """The tokens of a GGUF file as an `llguidance.LLTokenizer`; it takes a fifth of a second."""
    import llguidance

    vocabulary = _Vocabulary(weights)
    wrapper = llguidance.TokenizerWrapper(vocabulary)
    return llguidance.LLTokenizer(wrapper, eos_token=vocabulary.special_token_ids)


def choose(
    logits: Logits, temperature: float, random: np.random.Generator, grammar: Grammar | None
) -> tuple[int, float]:
    """Sample the next token from its logits [vocabulary]; at temperature 0, take the likeliest.

    The whole vocabulary meets the grammar, which is slow, only if the first choice fails it.

    Raises:
        UnreadableAnswerError: No token fits the grammar.

    Returns:
        The token, and the nats by which it is likelier than the likeliest other one that may come;
        below 0 if it is not.
    """
    token = _sample(logits, temperature, random)
    if grammar is None:
        return token, _lead(logits, token)
    near = np.argpartition(logits, -_NEAR)[-_NEAR:].astype(np.int32)
    near = np.append(near[near != token], np.int32(token))
    allowed = grammar.filter(logits, near)
    if np.isneginf(allowed[-1]):
        near = np.arange(len(logits), dtype=np.int32)
        allowed = grammar.filter(logits, near)
        if np.isneginf(allowed.max()):  # llama.cpp would end the process at the next token
            raise UnreadableAnswerError("The model has no token that fits the grammar.")
        token = _sample(allowed, temperature, random)
        lead = _lead(allowed, token)
    else:
        lead = _lead(allowed, len(near) - 1)
    grammar.accept(token)
    return token, lead


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


def _lead(logits: Logits, token: int) -> float:
    """Nats by which a token is likelier than the likeliest other one; below 0 if it is not."""
    rest = max(logits[:token].max(initial=-np.inf), logits[token + 1 :].max(initial=-np.inf))
    return float(logits[token]) - float(rest)
