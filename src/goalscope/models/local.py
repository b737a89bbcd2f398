"""The base of models in this process: writing token by token from logits."""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from pathlib import Path
from threading import RLock
from typing import Any, TypeVar, cast

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.stats import log_softmax
from goalscope.base.types import Message, ModelError
from goalscope.models import CLOSED, Completion, unfinished_json
from goalscope.models.chat import answer_of, opens_thought
from goalscope.models.llama.sampling import (
    Grammar,
    LlamaGrammar,
    LLGuidanceGrammar,
    Logits,
    choose,
    log_prob,
)
from goalscope.models.llama.weights import Weights
from goalscope.models.scoring import TokenScorer
from goalscope.models.trace import traced

_SUREST = 99.0
"""Nats by which a token leads at most: all, where the grammar allows no other."""

_FORKED = (
    "This process was forked from one that has opened a model, whose threads it lacks. Open models "
    "after the fork, or start processes by the method 'spawn'."
)

_process: int | None = None
"""The id of the process that has opened a model, of which a fork inherits a copy."""

_Method = TypeVar("_Method", bound=Callable[..., Any])


def _refuse_fork() -> None:
    """Refuse to compute in a fork, which would wait for ever for threads that it lacks.

    Raises:
        ModelError: A model was opened before this process was forked.
    """
    global _process
    _process = _process or os.getpid()
    if _process != os.getpid():
        raise ModelError(_FORKED)


def synchronized(method: _Method) -> _Method:
    """Have a method of a `LocalModel` wait for the calls of other threads, and refuse when closed.

    Raises:
        ModelError: The model is closed, or this is a fork of the process that opened it.
    """

    @wraps(method)
    def waiting(model: LocalModel, *args: Any, **kwargs: Any) -> Any:
        _refuse_fork()
        with model.busy:
            if model.closed:
                raise ModelError(CLOSED)
            return method(model, *args, **kwargs)

    return cast("_Method", waiting)


class LocalModel(TokenScorer):
    """A model that computes the logits of the next token.

    Threads can share it; calls run one at a time. (Callers of `read` and `push` hold `busy` from
    the first call to the last.)

    Attributes:
        takes_grammar: Whether `generate` takes a `grammar`.
        adapter: The file of its LoRA adapter, if it has one.
        adapter_metadata: The text metadata of that file, by key.
        vocabulary: The GGUF file that the tokens are from; None if from another kind of file.
        busy: Held during a call.
        closed: Whether `close` was called.
    """

    takes_grammar = True
    adapter: Path | None
    adapter_metadata: Mapping[str, str]
    vocabulary: Weights | None

    def __init__(self) -> None:
        _refuse_fork()
        self.busy, self.closed = RLock(), False
        self._guide: Any = None

    count_tokens = synchronized(TokenScorer.count_tokens)
    token_logprobs = synchronized(TokenScorer.token_logprobs)
    self_test = synchronized(TokenScorer.self_test)

    def close(self) -> None:
        """Free the memory; later calls raise a `ModelError`. A fork leaves it to its parent."""
        if _process != os.getpid():
            return
        with self.busy:
            if not self.closed:
                self.closed = True
                self.free()

    @property
    def remedy(self) -> str:
        """The remedy for damaged weights."""
        return "Download them again, or choose another model."

    @abstractmethod
    def with_adapter(self, adapter: Path) -> LocalModel:
        """The same model with a LoRA adapter; both are closed on their own."""

    @abstractmethod
    def free(self) -> None:
        """Free the memory; see `close`."""

    @abstractmethod
    def read(self, prompt: Sequence[int], room: int) -> Logits:
        """Logits [vocabulary] after a prompt that up to `room` tokens will be added to."""

    @abstractmethod
    def push(self, token: int) -> Logits:
        """Logits [vocabulary] after one more token than at the last `read` or `push`."""

    @synchronized
    def grammar(self, rules: Mapping[str, Any] | str) -> Grammar:
        """A JSON schema, or rules in GBNF, as a filter of next tokens.

        Raises:
            ModelError: They cannot be turned into one.
        """
        if self.vocabulary is not None and isinstance(rules, str):
            return LlamaGrammar(self.vocabulary, rules)  # llguidance forbids some of it
        self._guide = self._guide or self.guide()
        return LLGuidanceGrammar(self._guide, rules)

    @abstractmethod
    def guide(self) -> Any:
        """The tokens as an `llguidance.LLTokenizer`."""

    @traced
    @synchronized
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
        """Write the assistant's next message; see `Generator.generate`.

        At a temperature above 0, tokens less than 0.05 times as likely as the likeliest are
        excluded, since a small model's tail is noise.

        Raises:
            ModelError: The messages do not fit the context, or a constrained reply was not finished
                within `max_tokens`.
        """
        prompt = self.tokenizer.render(messages, writing=True)
        self.check_length(len(prompt) + 1)
        room = min(max_tokens, self.context_size - len(prompt))
        random = np.random.default_rng(seed)
        rules = schema if schema is not None else grammar
        form = self.grammar(rules) if rules is not None else None
        total, margins = 0.0, [_SUREST]
        text, written, finish, ended_by = "", list[int](), "length", ""
        logits = self.read(prompt, room)
        while len(written) < room:
            if not np.isfinite(logits.max()):
                raise ModelError(f"The weights are damaged: {self.describe()}. {self.remedy}")
            token, lead = choose(logits, temperature, random, form)
            total += log_prob(logits, token)
            if self.tokenizer.is_control(token):
                finish = "stop"
                margins[-1] = min(margins[-1], lead)
                mark = self.tokenizer.detokenize([token], markup=True)
                ended_by = mark if opens_thought(mark) else ""
                break
            written.append(token)
            text = self.tokenizer.detokenize(written)
            margins += [_SUREST] * (text.count("\n") + 1 - len(margins))
            margins[-1] = min(margins[-1], lead)
            cuts = [at for at in map(text.find, stop) if at >= 0]
            if cuts:
                text, finish = text[: min(cuts)], "stop"
                break
            if len(written) < room:
                logits = self.push(token)
        if form is not None and finish == "length":
            raise unfinished_json(room)
        answer = text
        if form is None:
            answer = answer_of(text + ended_by, self.name)
        known = (total, tuple(margins)) if answer == text else (None, None)
        return Completion(answer, finish, len(prompt), len(written), *known)

    @synchronized
    def next_logprobs(self, prompt: Sequence[int]) -> Array:
        """Log-probability in nats of every token [vocabulary] after a prompt's token ids."""
        self.check_length(len(prompt) + 1)
        return log_softmax(self.read(prompt, 0).astype(np.float64))

    @synchronized
    def likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        """See `TokenScorer.likeliest`."""
        logprobs = self.next_logprobs(prompt)
        token = int(np.argmax(logprobs))
        return token, float(logprobs[token])
