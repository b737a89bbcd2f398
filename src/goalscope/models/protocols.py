"""How servers are asked for the log-probabilities of given tokens; each has its own way."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Any

import numpy as np

from goalscope.models import Array
from goalscope.models.chat import ChatTokenizer
from goalscope.models.http import Server, understood
from goalscope.models.scoring import LEAST, Pair
from goalscope.types import ModelError

__all__ = ["PROTOCOLS", "Echo", "Forced", "NextTokens", "PromptTokens", "Protocol", "SGLang"]

_BATCH = 8  # whole prompts of one request: a slow server too answers it in time
_NEXT = 128  # prompts of one request for next tokens; vLLM allows as many different tokens


class Protocol(ABC):
    """One way to ask a server.

    Attributes:
        name: What is sent, and to what kind of server.
        attempts: Most requests for one answer.
    """

    name: str

    def __init__(self, server: Server, tokenizer: ChatTokenizer) -> None:
        self.server, self.tokenizer = server, tokenizer
        self.attempts = 2  # until it has proved to be the server's

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

    def _complete(self, prompts: object, count: int, **options: Any) -> list[Any]:
        """The choices of `/completions` with one greedy token, in the order of the prompts."""
        body = {"model": self.server.model, "prompt": prompts, "max_tokens": 1, "temperature": 0}
        answer = self.server.post("completions", {**body, **options}, attempts=self.attempts)
        choices: list[Any] = sorted(answer["choices"], key=lambda each: int(each.get("index") or 0))
        if len(choices) != count:
            raise ValueError(f"{count} prompts have {len(choices)} answers")
        return choices


class _VLLM(Protocol):
    def _likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        (choice,) = self._complete([prompt], 1, logprobs=1, return_tokens_as_token_ids=True)
        logprobs = choice["logprobs"]
        token = logprobs["tokens"][0].removeprefix("token_id:")
        return int(token), float(logprobs["token_logprobs"][0])


class NextTokens(_VLLM):
    """Each answer's beginnings as prompts: unlike `PromptTokens`, vLLM's prefix cache serves it."""

    name = "logprob_token_ids (vLLM)"

    def _score(self, pairs: Sequence[Pair]) -> list[Array]:
        known: dict[tuple[int, ...], float] = {}
        wanted = dict.fromkeys(path for pair in pairs for path in _paths(pair))
        rest = iter(wanted)
        while batch := list(islice(rest, _NEXT)):
            tokens = sorted({path[-1] for path in batch})
            choices = self._complete(
                [path[:-1] for path in batch],
                len(batch),
                logprobs=0,
                logprob_token_ids=tokens,
                return_tokens_as_token_ids=True,
            )
            for path, choice in zip(batch, choices, strict=True):
                known[path] = choice["logprobs"]["top_logprobs"][0][f"token_id:{path[-1]}"]
        return [_array(known[path] for path in _paths(pair)) for pair in pairs]


class PromptTokens(_VLLM):
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


class SGLang(Protocol):
    """SGLang's own `/generate`; what is before the answer stays in its cache."""

    name = "input_token_logprobs (SGLang)"

    def _score(self, pairs: Sequence[Pair]) -> list[Array]:
        rows: list[Array] = []
        for batch in _batches(pairs):
            prompts = [[*pair.prompt, *pair.answer] for pair in batch]
            answers = self._generate(prompts, [len(pair.prompt) - 1 for pair in batch])
            for pair, given in zip(batch, answers, strict=True):
                tail = given["input_token_logprobs"][-len(pair.answer) :]
                if [entry[1] for entry in tail] != pair.answer:
                    raise ValueError("the log-probabilities are those of other tokens")
                rows.append(_array(entry[0] for entry in tail))
        return rows

    def _likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        (given,) = self._generate([prompt], [len(prompt) - 1])
        logprob, token, *_ = given["output_token_logprobs"][0]
        return int(token), float(logprob)

    def _generate(self, prompts: object, starts: object) -> list[Any]:
        body = {
            "input_ids": prompts,
            "sampling_params": {"max_new_tokens": 1, "temperature": 0},
            "return_logprob": True,
            "logprob_start_len": starts,
        }
        answer = self.server.post("/generate", body, attempts=self.attempts)
        return [each["meta_info"] for each in answer]


class Echo(Protocol):
    """OpenAI's older form (llama-cpp-python): text goes in, and comes back with its numbers.

    Text is only scored where the server reads it as the very tokens that were meant: it takes words
    that look like the model's markup for markup.
    """

    name = "echo and logprobs"

    def _score(self, pairs: Sequence[Pair]) -> list[Array]:
        return [self._score_one(pair) for pair in pairs]

    def _score_one(self, pair: Pair) -> Array:
        ids, size = [*pair.prompt, *pair.answer], len(pair.answer)
        given, logprobs = self._ask(ids, echo=True)
        theirs = [token.strip("\ufffd") for token in given]
        ours = [self.tokenizer.detokenize([token]).strip("\ufffd") for token in ids]
        for end in (len(theirs) - 1, len(theirs)):  # one more token is written, or its end
            # Before the answer, servers leave out some tokens that have no text of their own.
            same_words = [*filter(None, theirs[:end])] == [*filter(None, ours)]
            if same_words and theirs[end - size : end] == ours[-size:]:
                return _array(logprobs[end - size : end])
        raise ModelError(
            f"{self.server.url} read other tokens than it was sent (the last are "
            f"{theirs[-size - 1 :][-9:]} instead of {ours[-size:][-9:]}). It reads text and cannot "
            "score words that hold the model's own markup. Use a server that reads token ids."
        )

    def _likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        tokens, logprobs = self._ask(prompt, echo=False)
        ids = self.tokenizer.tokenize(tokens[0])
        if len(ids) != 1:
            raise ValueError(f"{tokens[0]!r} is no token of the tokenizer")
        return ids[0], float(logprobs[0])

    def _ask(self, ids: Sequence[int], *, echo: bool) -> tuple[list[str], list[Any]]:
        text = self.tokenizer.detokenize(ids, markup=True)
        (choice,) = self._complete(text, 1, echo=echo, logprobs=1)
        logprobs = choice["logprobs"]
        tokens, values = logprobs["tokens"], logprobs["token_logprobs"]
        if len(tokens) != len(values):
            raise ValueError(f"{len(tokens)} tokens have {len(values)} log-probabilities")
        return tokens, values


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
        answer = self.server.post("/completion", body, attempts=self.attempts)
        if answer["tokens_predicted"] != 1:
            raise ValueError(f"{answer['tokens_predicted']} tokens were written instead of one")
        return answer.get("completion_probabilities", [])


PROTOCOLS = (NextTokens, PromptTokens, SGLang, Echo, Forced)
"""In the order in which a server is tried."""


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
