"""Models behind an OpenAI-compatible server: one that writes, and one that scores."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from textwrap import shorten
from threading import RLock
from typing import Any

from goalscope.models import Array, Completion, OnText, unfinished_json
from goalscope.models.chat import ChatTokenizer
from goalscope.models.http import ATTEMPTS, Refusal, Server, understood
from goalscope.models.protocols import PROTOCOLS, Protocol
from goalscope.models.scoring import Pair, TokenScorer
from goalscope.types import Message, ModelError, UnreadableAnswerError

__all__ = ["ServedGenerator", "ServedScorer"]

CONTEXT_SIZE = 8192
"""Tokens that a served model is taken to read, where the server does not tell."""

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

    The server turns the chat into tokens: whether text that looks like its markup acts as markup is
    up to the server.

    Attributes:
        takes_grammar: Whether `generate` takes a `grammar`.
        server: Where it is.
        name: Its name there.
    """

    takes_grammar = False

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
        self._streams = True

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
        grammar: str | None = None,
        heard: OnText | None = None,
    ) -> Completion:
        """Write the assistant's next message; see `Generator.generate`.

        A seed is passed on, but few servers promise the same text for it.

        Raises:
            ModelError: No usable answer came, or it does not satisfy the schema, or a grammar is
                asked for: servers agree on none.
        """
        if grammar is not None:
            raise ModelError(f"The server at {self.server.url} takes a schema, but no grammar.")
        body: dict[str, Any] = {
            "model": self.server.model,
            "messages": [{"role": m.role, "content": m.content} for m in messages],
            "temperature": temperature,
            "seed": seed,
        }
        if stop:
            body["stop"] = list(stop)
        answer = self._post(body, max_tokens, schema, heard)
        with understood(self.server.url):
            choice: dict[str, Any] = answer["choices"][0]
            usage: dict[str, Any] = answer.get("usage") or {}
            message: dict[str, Any] = choice["message"]
            reason = choice.get("finish_reason")
            text, refusal = message.get("content"), message.get("refusal")
            read, written = usage.get("prompt_tokens") or 0, usage.get("completion_tokens") or 0
        if not isinstance(text, str) or reason == "content_filter":
            raise ModelError(
                f"{self.name} wrote no reply ({reason}: {refusal or 'no content'}). "
                "Use another model."
            )
        finish = "length" if reason == "length" else "stop"
        if schema is not None:
            text = self._checked(text, finish, schema, max_tokens)
        if heard:
            heard(text)
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
        self,
        body: Mapping[str, Any],
        max_tokens: int,
        schema: Mapping[str, Any] | None,
        heard: OnText | None,
    ) -> Any:
        """Ask, in the next dialect where the server does not know a key of this one."""
        while True:
            length, form = self._dialect
            extra: dict[str, Any] = {length: max_tokens}
            if schema is not None:
                extra["response_format"] = form(_object(schema))
            if heard and schema is None and self._streams:
                extra |= {"stream": True, "stream_options": {"include_usage": True}}
            try:
                return self.server.post("chat/completions", {**body, **extra}, heard=heard)
            except Refusal as refusal:
                said = str(refusal)
                if "stream" in extra and re.search(r"\bstream", said):
                    self._streams = False
                elif self._dialect is _OPENAI and "max_completion_tokens" in said:
                    self._dialect = ("max_completion_tokens", form)
                elif self._dialect is _OPENAI and "response_format" in said:
                    self._dialect = (length, _loose)
                else:
                    raise

    def _checked(self, text: str, finish: str, schema: Mapping[str, Any], room: int) -> str:
        import jsonschema

        if finish == "length":
            raise unfinished_json(room)
        try:
            value: Any = json.loads(text)
            jsonschema.validate(value, _object(schema))
        except (ValueError, RecursionError, jsonschema.ValidationError) as error:
            why = getattr(error, "message", str(error))
            raise UnreadableAnswerError(
                f"{self.name} did not keep to the JSON schema ({why[:200]}): {text[:200]!r}. "
                "Use a server with structured outputs (response_format json_schema)."
            ) from None
        return text if _object(schema) is schema else json.dumps(value["answer"])


class ServedScorer(TokenScorer):
    """A model behind a server that tells the log-probabilities of given tokens.

    At the first use each of `PROTOCOLS` is put to the self-test, and the first that passes is kept.

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
                    f"{self.server.url} cannot tell how likely given words are. "
                    + " ".join(complaints)
                    + " Use vLLM, SGLang or a server of llama.cpp; or score with a model in this "
                    "process, and let the server only write (--generator)."
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
        protocol.attempts = ATTEMPTS
        return complaint


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
