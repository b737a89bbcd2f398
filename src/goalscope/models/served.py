"""Models on an OpenAI-compatible server: one that writes, and one that scores given words."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from textwrap import shorten
from threading import RLock
from typing import Any

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.types import Message, ModelError, UnreadableAnswerError
from goalscope.models import Completion, unfinished_json
from goalscope.models.chat import ChatTokenizer, answer_of
from goalscope.models.scoring import LEAST, Pair, TokenScorer
from goalscope.models.server import Refusal, Server, understood
from goalscope.models.trace import traced

_BATCH = 8  # whole prompts of one request: a slow server too answers it in time
_BYTES_A_TOKEN = 2.0  # a cautious guess, for models whose tokenizer is not at hand


class ServedGenerator:
    """A chat model behind `/chat/completions`.

    The server converts the chat to tokens, so it decides whether text that looks like markup acts
    as markup.

    Attributes:
        takes_grammar: Whether `generate` takes a `grammar`.
        server: Where it is.
        name: Its name there.
    """

    takes_grammar = False

    def __init__(self, server: Server, tokenizer: ChatTokenizer | None = None) -> None:
        """Prepare to ask `server`; nothing is sent yet.

        Args:
            server: Where the model is.
            tokenizer: The model's own, to count tokens; without one they are estimated.
        """
        self.server, self.tokenizer = server, tokenizer
        self._length_key = "max_tokens"
        self._takes_json_schema = True

    @property
    def name(self) -> str:
        """The model's name at its server."""
        return self.server.model

    @property
    def context_size(self) -> int:
        """Most tokens of a prompt with what is written after it."""
        return self.server.context_size

    def count_tokens(self, messages: Sequence[Message]) -> int:
        """How many tokens a chat has; without a tokenizer rather too many, 8 and 1 for 2 bytes."""
        if self.tokenizer:
            return self.tokenizer.count(messages)
        return sum(8 + int(len(m.content.encode()) / _BYTES_A_TOKEN) for m in messages)

    @traced
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

        The seed is sent, but few servers guarantee the same text for it.

        Raises:
            ModelError: There was no usable answer, it does not satisfy the schema, or a grammar was
                given.
        """
        if grammar is not None:
            raise ModelError(f"The server at {self.server.url} accepts schemas but no grammars.")
        body: dict[str, Any] = {
            "model": self.server.model,
            "messages": [{"role": m.role, "content": m.content} for m in messages],
            "temperature": temperature,
            "seed": seed,
        }
        if stop:
            body["stop"] = list(stop)
        answer = self._post(body, max_tokens, schema)
        with understood(self.server.url):
            choice: dict[str, Any] = answer["choices"][0]
            usage: dict[str, Any] = answer.get("usage") or {}
            message: dict[str, Any] = choice["message"]
            reason = choice.get("finish_reason")
            text, refusal = message.get("content"), message.get("refusal")
            read, written = usage.get("prompt_tokens") or 0, usage.get("completion_tokens") or 0
        if not isinstance(text, str) or reason == "content_filter":
            raise ModelError(
                f"{self.name} wrote no reply ({reason}: {refusal or 'no content'}). Use another "
                "model, or allow more tokens if it reasons first."
            )
        finish = "length" if reason == "length" else "stop"
        if schema is None:
            text = answer_of(text, self.name)
        elif finish == "length":
            raise unfinished_json(max_tokens)
        else:
            text = self._checked(text, schema)
        return Completion(text, finish, read, written)

    @property
    def fingerprint(self) -> str:
        """Address, name, and what the server lists of the model; it may hide other weights."""
        return self.server.fingerprint

    def describe(self) -> str:
        """One line on what is asked."""
        return f"{self.name} at {self.server.url}"

    def close(self) -> None:
        """Close the connections."""
        self.server.close()

    def _post(
        self, body: Mapping[str, Any], max_tokens: int, schema: Mapping[str, Any] | None
    ) -> Any:
        """Ask, and again without what the server says that it does not know."""
        while True:
            extra: dict[str, Any] = {self._length_key: max_tokens}
            if schema is not None:
                named = {"name": "reply", "strict": True, "schema": _object(schema)}
                extra["response_format"] = (
                    {"type": "json_schema", "json_schema": named}
                    if self._takes_json_schema
                    else {"type": "json_object", "schema": _object(schema)}
                )
            try:
                return self.server.post("chat/completions", {**body, **extra})
            except Refusal as refusal:
                said = str(refusal)
                if self._length_key == "max_tokens" and "max_completion_tokens" in said:
                    self._length_key = "max_completion_tokens"
                elif self._takes_json_schema and "response_format" in said:
                    self._takes_json_schema = False
                else:
                    raise

    def _checked(self, text: str, schema: Mapping[str, Any]) -> str:
        """The reply without a thought, if it keeps to the schema."""
        whole = _object(schema)
        try:
            try:
                value: Any = json.loads(text)  # its strings may hold the marks of a thought
            except ValueError:
                text = answer_of(text, self.name)
                value = json.loads(text)
            missing = [key for key in whole.get("required", ()) if key not in value]
            if missing or not isinstance(value, dict):
                raise ValueError(f"{', '.join(missing) or 'an object'} is missing")
        except (ValueError, TypeError, RecursionError) as error:
            raise UnreadableAnswerError(
                f"{self.name} did not keep to the JSON schema ({str(error)[:200]}): {text[:200]!r}."
                " Use a server with structured outputs (response_format json_schema)."
            ) from None
        return text if whole is schema else json.dumps(value["answer"])


def _object(schema: Mapping[str, Any]) -> Mapping[str, Any]:
    """The schema of an object, as servers want it; any other becomes its "answer"."""
    if schema.get("type") == "object":
        return schema
    return {
        "type": "object",
        "properties": {"answer": dict(schema)},
        "required": ["answer"],
        "additionalProperties": False,
    }


class PromptTokens:
    """How to ask vLLM: whole prompts, with log-probabilities of all their tokens back."""

    name = "prompt_logprobs (vLLM)"

    def __init__(self, server: Server, _: ChatTokenizer) -> None:
        self._server = server

    def score(self, pairs: Sequence[Pair]) -> list[Array]:
        """See `TokenScorer.score`."""
        rows: list[Array] = []
        for start in range(0, len(pairs), _BATCH):
            batch = pairs[start : start + _BATCH]
            prompts = [[*pair.prompt, *pair.answer] for pair in batch]
            choices = self._complete(prompts, prompt_logprobs=0)
            for pair, prompt, choice in zip(batch, prompts, choices, strict=True):
                given: list[Any] = choice.get("prompt_logprobs") or []
                if len(given) != len(prompt):
                    raise ValueError(f"{len(prompt)} tokens have {len(given)} prompt_logprobs")
                tail = zip(given[len(pair.prompt) :], pair.answer, strict=True)
                rows.append(_array(entry[str(token)]["logprob"] for entry, token in tail))
        return rows

    def likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        """See `TokenScorer.likeliest`."""
        (choice,) = self._complete([prompt], logprobs=1, return_tokens_as_token_ids=True)
        logprobs = choice["logprobs"]
        token = logprobs["tokens"][0].removeprefix("token_id:")
        return int(token), float(logprobs["token_logprobs"][0])

    def _complete(self, prompts: Sequence[Sequence[int]], **options: Any) -> list[Any]:
        """The choices of `/completions` with one greedy token, in the order of the prompts."""
        body = {"model": self._server.model, "prompt": prompts, "max_tokens": 1, "temperature": 0}
        answer = self._server.post("completions", {**body, **options})
        choices: list[Any] = sorted(answer["choices"], key=lambda each: int(each.get("index") or 0))
        if len(choices) != len(prompts):
            raise ValueError(f"{len(prompts)} prompts have {len(choices)} answers")
        return choices


class Forced:
    """How to ask llama.cpp: a large bias makes it write a token, and tell its own number.

    One request a token; its cache has all but the last one.
    """

    name = "forced tokens (llama.cpp)"

    def __init__(self, server: Server, tokenizer: ChatTokenizer) -> None:
        self._server, self._tokenizer = server, tokenizer

    def score(self, pairs: Sequence[Pair]) -> list[Array]:
        """See `TokenScorer.score`."""
        wanted = dict.fromkeys(path for pair in pairs for path in _paths(pair))
        known = {path: self._next(path[:-1], path[-1]) for path in wanted}
        return [_array(known[path] for path in _paths(pair)) for pair in pairs]

    def likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        """See `TokenScorer.likeliest`."""
        (written,) = self._write(prompt, None, 1)
        return int(written["id"]), float(written["logprob"])

    def _next(self, prompt: Sequence[int], token: int) -> float:
        for written in self._write(prompt, token, 1):
            if written["id"] != token:
                raise ValueError(f"token {written['id']} was written instead of {token}")
            return written["logprob"]
        # Of half a character the server says nothing, but among those that were not written.
        for count in (1000, 1 << 18):
            (written,) = self._write(prompt, self._tokenizer.end_of_turn, count)
            for other in written["top_logprobs"]:
                if other["id"] == token:
                    return other["logprob"]
        raise ValueError(f"there is no number for token {token}")

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
        answer = self._server.post("/completion", body)
        if answer["tokens_predicted"] != 1:
            raise ValueError(f"{answer['tokens_predicted']} tokens were written instead of one")
        return answer.get("completion_probabilities", [])


class ServedScorer(TokenScorer):
    """A model on a server that returns the log-probabilities of given tokens.

    At the first use it is asked as vLLM and then as llama.cpp; what passes the self-test is used.

    Attributes:
        server: Where it is.
    """

    def __init__(self, server: Server, tokenizer: ChatTokenizer) -> None:
        """Prepare to ask `server`; nothing is sent yet.

        Args:
            server: Where the model is.
            tokenizer: The model's own; the server's answers are checked against it.
        """
        self.server, self.tokenizer = server, tokenizer
        self._protocol: PromptTokens | Forced | None = None
        self._testing = RLock()

    @property
    def name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride] (only read)
        """The model's name at its server."""
        return self.server.model

    @property
    def context_size(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Most tokens that one pair may have; the server writes one more."""
        return self.server.context_size - 1

    @property
    def protocol(self) -> str:
        """How the server is asked; found by the self-test at the first use.

        Raises:
            ModelError: It cannot score; says what each way led to.
        """
        return self._found().name

    def score(self, pairs: Sequence[Pair]) -> list[Array]:
        """See `TokenScorer.score`; equal pairs are asked for once."""
        protocol = self._found()
        keys = [(tuple(pair.prompt), tuple(pair.answer)) for pair in pairs]
        different = dict(zip(keys, pairs, strict=True))
        with understood(self.server.url):
            rows = dict(zip(different, protocol.score([*different.values()]), strict=True))
        return [rows[key].copy() for key in keys]

    def likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        """See `TokenScorer.likeliest`."""
        protocol = self._found()
        with understood(self.server.url):
            return protocol.likeliest(prompt)

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

    def _found(self) -> PromptTokens | Forced:
        with self._testing:
            if self._protocol is not None:
                return self._protocol
            _ = self.server.facts  # a server that is down is not asked in many ways
            complaints: list[str] = []
            for kind in (PromptTokens, Forced):
                protocol = kind(self.server, self.tokenizer)
                complaint = self._complaint(protocol)
                if not complaint:
                    return protocol
                complaint = complaint.removeprefix(f"{self.server.url} ")
                complaints.append(f"{kind.name}: {shorten(complaint, 200, placeholder='...')}")
            raise ModelError(
                f"{self.server.url} cannot score given words. "
                + " ".join(complaints)
                + " Use vLLM or llama.cpp's server, or score with a local model and use "
                "the server only for writing (--generator)."
            )

    def _complaint(self, protocol: PromptTokens | Forced) -> str:
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


def _array(values: Iterable[Any]) -> Array:
    """Log-probabilities as an array; what is null becomes NaN, which no caller takes."""
    row = np.array([np.nan if value is None else float(value) for value in values])
    if (row < LEAST).any():
        raise ValueError(f"{row.min():.0f} stands for a log-probability that it does not tell")
    return row
