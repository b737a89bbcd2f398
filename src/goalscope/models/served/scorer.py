"""A model that scores on a server, and the protocols for log-probabilities."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from textwrap import shorten
from threading import RLock
from typing import Any

import numpy as np

from goalscope.base.types import Message, ModelError
from goalscope.models import Array
from goalscope.models.chat import ChatTokenizer
from goalscope.models.scoring import LEAST, Pair, TokenScorer
from goalscope.models.served.client import Server, understood

_BATCH = 8  # whole prompts of one request: a slow server too answers it in time


class Protocol(ABC):
    """One way to ask a server.

    Attributes:
        name: What is sent, and to what kind of server.
    """

    name: str

    def __init__(self, server: Server, tokenizer: ChatTokenizer) -> None:
        self.server, self.tokenizer = server, tokenizer

    def score(self, pairs: Sequence[Pair]) -> list[Array]:
        """See `TokenScorer.score`; equal pairs are asked for once."""
        keys = [(tuple(pair.prompt), tuple(pair.answer)) for pair in pairs]
        different = dict(zip(keys, pairs, strict=True))
        with understood(self.server.url):
            rows = dict(zip(different, self._score([*different.values()]), strict=True))
        return [rows[key].copy() for key in keys]

    def likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        """See `TokenScorer.likeliest`."""
        with understood(self.server.url):
            return self._likeliest(prompt)

    @abstractmethod
    def _score(self, pairs: Sequence[Pair]) -> list[Array]: ...

    @abstractmethod
    def _likeliest(self, prompt: Sequence[int]) -> tuple[int, float]: ...


class PromptTokens(Protocol):
    """Prompts with their answers, and all their tokens' log-probabilities back."""

    name = "prompt_logprobs (vLLM)"

    def _score(self, pairs: Sequence[Pair]) -> list[Array]:
        rows: list[Array] = []
        for batch in _batches(pairs):
            prompts = [[*pair.prompt, *pair.answer] for pair in batch]
            choices = self._complete(prompts, len(prompts), prompt_logprobs=0)
            for pair, prompt, choice in zip(batch, prompts, choices, strict=True):
                given: list[Any] = choice.get("prompt_logprobs") or []
                if len(given) != len(prompt):
                    raise ValueError(f"{len(prompt)} tokens have {len(given)} prompt_logprobs")
                tail = zip(given[len(pair.prompt) :], pair.answer, strict=True)
                rows.append(_array(entry[str(token)]["logprob"] for entry, token in tail))
        return rows

    def _likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        (choice,) = self._complete([prompt], 1, logprobs=1, return_tokens_as_token_ids=True)
        logprobs = choice["logprobs"]
        token = logprobs["tokens"][0].removeprefix("token_id:")
        return int(token), float(logprobs["token_logprobs"][0])

    def _complete(self, prompts: object, count: int, **options: Any) -> list[Any]:
        """The choices of `/completions` with one greedy token, in the order of the prompts."""
        body = {"model": self.server.model, "prompt": prompts, "max_tokens": 1, "temperature": 0}
        answer = self.server.post("completions", {**body, **options})
        choices: list[Any] = sorted(answer["choices"], key=lambda each: int(each.get("index") or 0))
        if len(choices) != count:
            raise ValueError(f"{count} prompts have {len(choices)} answers")
        return choices


class Forced(Protocol):
    """One request a token: a large bias makes the server write it, and tell its own number.

    The cache of the server has all but the last token, if requests come one after another.
    """

    name = "forced tokens (llama.cpp)"

    def _score(self, pairs: Sequence[Pair]) -> list[Array]:
        wanted = dict.fromkeys(path for pair in pairs for path in _paths(pair))
        known = {path: self._next(path[:-1], path[-1]) for path in wanted}
        return [_array(known[path] for path in _paths(pair)) for pair in pairs]

    def _next(self, prompt: Sequence[int], token: int) -> float:
        for written in self._write(prompt, token, 1):
            if written["id"] != token:
                raise ValueError(f"token {written['id']} was written instead of {token}")
            return written["logprob"]
        # Of half a character the server says nothing, but among those that were not written.
        for count in (1000, 1 << 18):
            (written,) = self._write(prompt, self.tokenizer.end_of_turn, count)
            for other in written["top_logprobs"]:
                if other["id"] == token:
                    return other["logprob"]
        raise ValueError(f"there is no number for token {token}")

    def _likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        (written,) = self._write(prompt, None, 1)
        return int(written["id"]), float(written["logprob"])

    def _write(self, prompt: Sequence[int], token: int | None, told: int) -> list[dict[str, Any]]:
        """What the server says of the one token that it wrote: none, or all it `told`."""
        body = {
            "prompt": prompt,
            "n_predict": 1,
            "temperature": 0,
            "n_probs": told,
            "cache_prompt": True,
            "logit_bias": [] if token is None else [[token, 1000.0]],
        }
        answer = self.server.post("/completion", body)
        if answer["tokens_predicted"] != 1:
            raise ValueError(f"{answer['tokens_predicted']} tokens were written instead of one")
        return answer.get("completion_probabilities", [])


PROTOCOLS = (PromptTokens, Forced)
"""In the order in which a server is tried."""


class ServedScorer(TokenScorer):
    """A model on a server that returns the log-probabilities of given tokens.

    At the first use, `PROTOCOLS` are tried, and the first that passes the self-test is used.

    Attributes:
        server: Where it is.
    """

    def __init__(
        self, server: Server, tokenizer: ChatTokenizer, *, context_size: int | None = None
    ) -> None:
        """Prepare to ask `server`; nothing is sent yet.

        Args:
            server: Where the model is.
            tokenizer: The model's own; the server's answers are checked against it.
            context_size: Most tokens of a pair; as the server says if None.
        """
        self.server, self.tokenizer = server, tokenizer
        self._context_size = context_size
        self._protocol: Protocol | None = None
        self._testing = RLock()

    @property
    def name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride] (only read)
        """The model's name at its server."""
        return self.server.model

    @property
    def context_size(self) -> int:
        """Most tokens that one pair may have; the server writes one more."""
        self._context_size = self._context_size or self.server.context_size - 1
        return self._context_size

    @property
    def protocol(self) -> str:
        """How the server is asked; found by the self-test at the first use.

        Raises:
            ModelError: It cannot score; says what each way led to.
        """
        return self._found().name

    def score(self, pairs: Sequence[Pair]) -> list[Array]:
        """See `TokenScorer.score`."""
        return self._found().score(pairs)

    def likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        """See `TokenScorer.likeliest`."""
        return self._found().likeliest(prompt)

    def clear_cache(self) -> None:
        """Do nothing: what a server keeps is its own affair."""

    @property
    def fingerprint(self) -> str:
        """The server's, and how likely it finds known words, which differs with the weights."""
        prompt = self.tokenizer.render([Message("user", "What is the capital of France?")])
        answer = self.tokenizer.tokenize("The capital of France is Paris.")
        (row,) = self.score([Pair(prompt, answer)])
        return f"{self.server.fingerprint} {row.sum():.1f}"

    def describe(self) -> str:
        """One line on what is asked."""
        how = self._protocol.name if self._protocol else "not yet tested"
        return f"{self.name} at {self.server.url}, by {how}"

    def close(self) -> None:
        """Close the connections."""
        self.server.close()

    def _found(self) -> Protocol:
        with self._testing:
            if self._protocol is None:
                _ = self.server.facts  # a server that is down is not asked in many ways
                complaints: list[str] = []
                for kind in PROTOCOLS:
                    complaint = self._complaint(kind(self.server, self.tokenizer))
                    if self._protocol is not None:
                        return self._protocol
                    complaint = complaint.removeprefix(f"{self.server.url} ")
                    complaints.append(f"{kind.name}: {shorten(complaint, 200, placeholder='...')}")
                raise ModelError(
                    f"{self.server.url} cannot score given words. "
                    + " ".join(complaints)
                    + " Use vLLM or llama.cpp's server, or score with a local model and use "
                    "the server only for writing (--generator)."
                )
            return self._protocol

    def _complaint(self, protocol: Protocol) -> str:
        """What is wrong with a protocol, which is kept if nothing is."""
        self._protocol, complaint = protocol, "It was not tested to the end."
        try:
            complaint = self.self_test().complaint
        except ModelError as error:
            complaint = str(error)
        finally:
            if complaint:
                self._protocol = None
        return complaint


def _paths(pair: Pair) -> list[tuple[int, ...]]:
    """The token ids up to each token of the answer, with it."""
    ids, start = (*pair.prompt, *pair.answer), len(pair.prompt)
    return [ids[:end] for end in range(start + 1, len(ids) + 1)]


def _batches(pairs: Sequence[Pair]) -> list[Sequence[Pair]]:
    return [pairs[start : start + _BATCH] for start in range(0, len(pairs), _BATCH)]


def _array(values: Iterable[Any]) -> Array:
    """Log-probabilities as an array; what is null becomes NaN, which no caller takes."""
    row = np.array([np.nan if value is None else float(value) for value in values])
    if (row < LEAST).any():
        raise ValueError(f"{row.min():.0f} stands for a log-probability that it does not tell")
    return row
