"""Models behind an OpenAI-compatible server: one that writes, and one that scores."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import islice
from typing import Any

import numpy as np

from goalscope.models import Array, Completion
from goalscope.models.chat import ChatTokenizer
from goalscope.models.http import ATTEMPTS, Refusal, Server, understood
from goalscope.models.scoring import Pair, TokenScorer
from goalscope.types import Message, ModelError

__all__ = ["ServedGenerator", "ServedScorer"]

CONTEXT_SIZE = 8192
"""Tokens that a served model is taken to read, where the server does not tell."""

_BATCH = 32  # prompts of one request
_BYTES_A_TOKEN = 2.0  # a cautious guess, for models whose tokenizer is not at hand


def _strict(schema: Mapping[str, Any]) -> dict[str, Any]:
    form = {"name": "reply", "strict": True, "schema": schema}
    return {"type": "json_schema", "json_schema": form}


def _loose(schema: Mapping[str, Any]) -> dict[str, Any]:
    return {"type": "json_object", "schema": schema}


_Dialect = tuple[str, Callable[[Mapping[str, Any]], dict[str, Any]]]
_OPENAI: _Dialect = ("max_tokens", _strict)
"""How the reply's length and its schema are said; see `ServedGenerator._post` for the others."""


class ServedGenerator:
    """A chat model behind `/chat/completions`.

    Attributes:
        server: Where it is.
        name: Its name there.
    """

    def __init__(
        self,
        server: Server,
        tokenizer: ChatTokenizer | None = None,
        *,
        context_size: int | None = None,
    ) -> None:
        """Prepare to ask `server`; nothing is sent yet.

        Args:
            server: Where the model is.
            tokenizer: The model's own, to count tokens; without one they are estimated.
            context_size: Most tokens of a prompt with its reply; as the server says if None.
        """
        self.server, self.tokenizer = server, tokenizer
        self._context_size = context_size
        self._dialect: _Dialect = _OPENAI

    @property
    def name(self) -> str:
        """The model's name at its server."""
        return self.server.model

    @property
    def context_size(self) -> int:
        """Most tokens of a prompt with what is written after it."""
        self._context_size = self._context_size or _context_size(self.server)
        return self._context_size

    def count_tokens(self, messages: Sequence[Message]) -> int:
        """How many tokens a chat has; without a tokenizer rather too many, 8 and 1 for 2 bytes."""
        if self.tokenizer:
            return len(self.tokenizer.render(messages))
        return sum(8 + int(len(m.content.encode()) / _BYTES_A_TOKEN) for m in messages)

    def generate(
        self,
        messages: Sequence[Message],
        *,
        max_tokens: int = 256,
        temperature: float = 0.0,
        seed: int = 0,
        stop: Sequence[str] = (),
        schema: Mapping[str, Any] | None = None,
    ) -> Completion:
        """Write the assistant's next message; see `Generator.generate`.

        A seed is passed on, but few servers promise the same text for it.

        Raises:
            ModelError: No usable answer came, or it does not satisfy the schema.
        """
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
            read, written = usage.get("prompt_tokens", 0), usage.get("completion_tokens", 0)
        if not isinstance(text, str) or reason == "content_filter":
            raise ModelError(
                f"{self.name} wrote no reply ({reason}: {refusal or 'no content'}). "
                "Use another model."
            )
        finish = "length" if reason == "length" else "stop"
        if schema is not None:
            text = self._checked(text, finish, schema, max_tokens)
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
        """Ask, in the next dialect where the server does not know a key of this one."""
        while True:
            length, form = self._dialect
            extra: dict[str, Any] = {length: max_tokens}
            if schema is not None:
                extra["response_format"] = form(_object(schema))
            try:
                return self.server.post("chat/completions", {**body, **extra})
            except Refusal as refusal:
                said = str(refusal)
                if self._dialect is _OPENAI and "max_completion_tokens" in said:
                    self._dialect = ("max_completion_tokens", form)
                elif self._dialect is _OPENAI and "response_format" in said:
                    self._dialect = (length, _loose)
                else:
                    raise

    def _checked(self, text: str, finish: str, schema: Mapping[str, Any], room: int) -> str:
        import jsonschema

        if finish == "length":
            raise ModelError(
                f"The model did not finish its JSON within {room} tokens. Allow more tokens, or "
                "limit the schema's lengths (maxLength, maxItems)."
            )
        try:
            value: Any = json.loads(text)
            jsonschema.validate(value, _object(schema))
        except (ValueError, RecursionError, jsonschema.ValidationError) as error:
            why = getattr(error, "message", str(error))
            raise ModelError(
                f"{self.name} did not keep to the JSON schema ({why[:200]}): {text[:200]!r}. "
                "Use a server with structured outputs (response_format json_schema)."
            ) from None
        return text if _object(schema) is schema else json.dumps(value["answer"])


class ServedScorer(TokenScorer):
    """A model behind a server that tells the log-probabilities of a prompt's tokens.

    Four protocols are known: vLLM's `prompt_logprobs`; SGLang's input log-probabilities; `echo`
    with `logprobs` (llama-cpp-python, and others in OpenAI's older form), which reads text and not
    tokens, so that words which hold the model's own markup are refused; and one request a token
    that makes the server write just that token (llama.cpp's own server). At the first use each is
    put to the self-test, and the first that passes is kept.

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
        self._protocol: _Protocol | None = None

    @property
    def name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The model's name at its server."""
        return self.server.model

    @property
    def context_size(self) -> int:
        """Most tokens that one pair may have; the server writes one more."""
        self._context_size = self._context_size or _context_size(self.server) - 1
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
        protocol, rows, rest = self._found(), list[Array](), iter(pairs)
        while batch := list(islice(rest, _BATCH)):
            rows += protocol.score(batch)
        return rows

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
        return f"{self.name} at {self.server.url}, by {self.protocol}"

    def close(self) -> None:
        """Close the connections."""
        self.server.close()

    def _found(self) -> _Protocol:
        if self._protocol is None:
            self.server.facts  # a server that is down is not asked in three ways  # noqa: B018
            complaints: list[str] = []
            for kind in (_VLLM, _SGLang, _Echo, _Forced):
                self._protocol = kind(self.server, self.tokenizer)
                try:
                    complaint = self.self_test().complaint
                except ModelError as error:
                    complaint = str(error)
                if not complaint:
                    self._protocol.attempts = ATTEMPTS
                    return self._protocol
                complaints.append(f"{kind.name}: {complaint}")
            self._protocol = None
            raise ModelError(
                f"{self.server.url} cannot tell how likely given words are. "
                + " ".join(complaints)
                + " Use vLLM, SGLang or a server of llama.cpp; or score with a model in this "
                "process, and let the server only write (--generator)."
            )
        return self._protocol


class _Protocol:
    """One way to ask a server for the log-probabilities of a prompt's tokens."""

    name: str

    def __init__(self, server: Server, tokenizer: ChatTokenizer) -> None:
        self.server, self.tokenizer = server, tokenizer
        self.attempts = 2  # until it has proved to be the server's

    def score(self, pairs: Sequence[Pair]) -> list[Array]:
        """See `TokenScorer.score`."""
        with understood(self.server.url):
            return self._score(pairs)

    def likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        """See `TokenScorer.likeliest`."""
        with understood(self.server.url):
            return self._likeliest(prompt)

    def _score(self, pairs: Sequence[Pair]) -> list[Array]:
        raise NotImplementedError

    def _likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        raise NotImplementedError

    def _complete(self, prompts: object, count: int, **options: Any) -> list[Any]:
        """The choices of `/completions` with one greedy token, in the order of the prompts."""
        body = {"model": self.server.model, "prompt": prompts, "max_tokens": 1, "temperature": 0}
        answer = self.server.post("completions", {**body, **options}, attempts=self.attempts)
        choices: list[Any] = sorted(answer["choices"], key=lambda choice: choice.get("index") or 0)
        if len(choices) != count:
            raise ValueError(f"{count} prompts have {len(choices)} answers")
        return choices


class _VLLM(_Protocol):
    name = "prompt_logprobs (vLLM)"

    def _score(self, pairs: Sequence[Pair]) -> list[Array]:
        prompts = [[*pair.prompt, *pair.answer] for pair in pairs]
        rows: list[Array] = []
        choices = self._complete(prompts, len(prompts), prompt_logprobs=0)
        for pair, prompt, choice in zip(pairs, prompts, choices, strict=True):
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


class _SGLang(_Protocol):
    name = "input_token_logprobs (SGLang)"

    def _score(self, pairs: Sequence[Pair]) -> list[Array]:
        prompts = [[*pair.prompt, *pair.answer] for pair in pairs]
        starts = [len(pair.prompt) - 1 for pair in pairs]  # what is before stays in its cache
        rows: list[Array] = []
        for pair, given in zip(pairs, self._generate(prompts, starts), strict=True):
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


class _Echo(_Protocol):
    name = "echo and logprobs"

    def _score(self, pairs: Sequence[Pair]) -> list[Array]:
        return [self._score_one(pair) for pair in pairs]

    def _score_one(self, pair: Pair) -> Array:
        tokens, logprobs = self._ask([*pair.prompt, *pair.answer], echo=True)
        size = len(pair.answer)
        ours = [self.tokenizer.detokenize([token]).strip("\ufffd") for token in pair.answer]
        for start in (len(tokens) - size - 1, len(tokens) - size):  # one more token, or its end
            theirs = tokens[start : start + size] if start >= 0 else []
            if [token.strip("\ufffd") for token in theirs] == ours:
                return _array(logprobs[start : start + size])
        raise ModelError(
            f"{self.server.url} answered for other tokens than it was sent: "
            f"{tokens[-size - 1 :]} instead of {ours}. It reads text, and cannot score words that "
            "hold the model's own markup."
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


class _Forced(_Protocol):
    name = "forced tokens (llama.cpp)"

    def _score(self, pairs: Sequence[Pair]) -> list[Array]:
        return [
            _array(
                self._next([*pair.prompt, *pair.answer[:done]], token)
                for done, token in enumerate(pair.answer)
            )
            for pair in pairs
        ]

    def _next(self, prompt: Sequence[int], token: int) -> float:
        """The model's own log-probability of a token that a large bias makes it write."""
        written = self._complete_one(prompt, logit_bias=[[token, 1000.0]])
        if written["id"] != token:
            raise ValueError(f"token {written['id']} was written instead of {token}")
        return written["logprob"]

    def _likeliest(self, prompt: Sequence[int]) -> tuple[int, float]:
        written = self._complete_one(prompt)
        return int(written["id"]), float(written["logprob"])

    def _complete_one(self, prompt: Sequence[int], **options: Any) -> dict[str, Any]:
        body = {
            "prompt": prompt,
            "n_predict": 1,
            "temperature": 0,
            "n_probs": 1,
            "cache_prompt": True,
        }
        answer = self.server.post("/completion", {**body, **options}, attempts=self.attempts)
        return answer["completion_probabilities"][0]


def _array(values: Iterable[Any]) -> Array:
    """Log-probabilities as an array; what is null becomes NaN, which no caller takes."""
    return np.array([np.nan if value is None else float(value) for value in values])


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


def _context_size(server: Server) -> int:
    """Most tokens of a prompt and its reply, by what servers list of a model."""
    facts = server.facts
    meta: Any = facts.get("meta") or {}
    for size in (facts.get("max_model_len"), facts.get("context_length"), meta.get("n_ctx")):
        if isinstance(size, int) and size > 1:
            return size
    return CONTEXT_SIZE
