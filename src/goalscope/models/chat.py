"""Chats as tokens, by a model's own chat template, with no way for text to act as markup."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NoReturn

from jinja2 import TemplateError
from jinja2.sandbox import ImmutableSandboxedEnvironment

from goalscope.types import Message, ModelError

__all__ = ["ChatTemplate"]

_SENTINEL = "\ue000{}\ue001"
_SENTINEL_PATTERN = re.compile("\ue000([0-9]+)\ue001")


class ChatTemplate:
    """A model's Jinja chat template, rendered without ever showing it the messages' text.

    The template sees a sentinel in place of each content, so the markup between contents depends on
    the roles alone; the caller turns markup and contents into tokens by different rules.
    """

    def __init__(self, source: str, bos: str, eos: str) -> None:
        """Compile `source`.

        Args:
            source: Jinja source, as in a GGUF file's `tokenizer.chat_template`.
            bos: Text of the token that begins a sequence.
            eos: Text of the token that ends a sequence.
        """
        environment = ImmutableSandboxedEnvironment(trim_blocks=True, lstrip_blocks=True)
        known: dict[str, Any] = environment.globals
        known.update(raise_exception=_refuse, bos_token=bos, eos_token=eos)
        try:
            self._template = environment.from_string(source)
        except TemplateError as error:
            raise ModelError(
                f"The model's chat template cannot be read ({error}). Use another GGUF file."
            ) from None
        self._pieces = lru_cache(maxsize=256)(self._render)

    def layout(self, messages: Sequence[Message]) -> list[str | Message]:
        """Markup (str) and messages (each for its content) in prompt order.

        The last piece is the markup after which the assistant's words begin.

        Raises:
            ModelError: The template refuses this order of roles.
        """
        try:
            pieces = self._pieces(tuple(message.role for message in messages))
        except TemplateError as error:
            if len(messages) < 2 or [m.role for m in messages[:2]] != ["system", "user"]:
                raise ModelError(
                    f"The model's chat template refuses these messages ({error}). "
                    "Use a model whose template takes system messages and any order of roles."
                ) from None
            system, user, *rest = messages
            merged = Message("user", f"{system.content}\n\n{user.content}")
            return self.layout([merged, *rest])
        return [messages[piece] if isinstance(piece, int) else piece for piece in pieces]

    def after_assistant(self) -> str:
        """The markup that follows an assistant's message."""
        pieces = self._pieces(("user", "assistant"))
        after = pieces[pieces.index(1) + 1]
        assert isinstance(after, str)
        return after

    def _render(self, roles: tuple[str, ...]) -> tuple[str | int, ...]:
        messages = [
            {"role": role, "content": _SENTINEL.format(index)} for index, role in enumerate(roles)
        ]
        text = self._template.render(messages=messages, add_generation_prompt=True)
        parts = _SENTINEL_PATTERN.split(text)
        pieces = tuple(int(part) if i % 2 else part for i, part in enumerate(parts))
        if set(pieces[1::2]) != set(range(len(roles))):
            raise TemplateError("it leaves a message out")
        return pieces


def _refuse(reason: str) -> NoReturn:
    raise TemplateError(reason)
