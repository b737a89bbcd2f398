"""A model that writes, on an OpenAI-compatible server."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from goalscope.base.types import Message, ModelError, UnreadableAnswerError
from goalscope.models import Completion, unfinished_json
from goalscope.models.chat import ChatTokenizer
from goalscope.models.reasoning import answer_of
from goalscope.models.served.client import Refusal, Server, understood

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
        self._length_key = "max_tokens"
        self._takes_json_schema = True

    @property
    def name(self) -> str:
        """The model's name at its server."""
        return self.server.model

    @property
    def context_size(self) -> int:
        """Most tokens of a prompt with what is written after it."""
        self._context_size = self._context_size or self.server.context_size
        return self._context_size

    def count_tokens(self, messages: Sequence[Message]) -> int:
        """How many tokens a chat has; without a tokenizer rather too many, 8 and 1 for 2 bytes."""
        if self.tokenizer:
            return self.tokenizer.count(messages)
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
        if schema is None or not _is_json(text):  # whose strings may hold any marks
            text = answer_of(text, self.name)
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
        """Ask, and again without what the server says that it does not know."""
        while True:
            extra: dict[str, Any] = {self._length_key: max_tokens}
            if schema is not None:
                extra["response_format"] = self._response_format(_object(schema))
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

    def _response_format(self, schema: Mapping[str, Any]) -> dict[str, Any]:
        if not self._takes_json_schema:
            return {"type": "json_object", "schema": schema}
        form = {"name": "reply", "strict": True, "schema": schema}
        return {"type": "json_schema", "json_schema": form}

    def _checked(self, text: str, finish: str, schema: Mapping[str, Any], room: int) -> str:
        if finish == "length":
            raise unfinished_json(room)
        whole = _object(schema)
        try:
            value: Any = json.loads(text)
            missing = [key for key in whole.get("required", ()) if key not in value]
            if missing or not isinstance(value, dict):
                raise ValueError(f"{', '.join(missing) or 'an object'} is missing")
        except (ValueError, TypeError, RecursionError) as error:
            raise UnreadableAnswerError(
                f"{self.name} did not keep to the JSON schema ({str(error)[:200]}): {text[:200]!r}."
                " Use a server with structured outputs (response_format json_schema)."
            ) from None
        return text if whole is schema else json.dumps(value["answer"])


def _is_json(text: str) -> bool:
    try:
        json.loads(text)
    except (ValueError, RecursionError):
        return False
    return True


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
