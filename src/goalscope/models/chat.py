"""Chats as tokens, by the model's chat template; text can never act as markup."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any, NoReturn, Protocol

from jinja2 import TemplateError
from jinja2.sandbox import ImmutableSandboxedEnvironment

from goalscope.types import InvalidInputError, Message, ModelError

__all__ = ["ChatTemplate", "ChatTokenizer", "Decode", "Encode"]

_SENTINEL = "\ue000{}\ue001"
_SENTINEL_PATTERN = re.compile("\ue000([0-9]+)\ue001")


class Encode(Protocol):
    """A tokenizer that adds nothing at the ends."""

    def __call__(self, text: str, *, markup: bool) -> Sequence[int]:
        """Token ids of `text`; names of special tokens become those only with `markup`."""
        ...


class Decode(Protocol):
    """Converts token ids to text."""

    def __call__(self, tokens: Sequence[int], *, markup: bool) -> str:
        """The text that tokens stand for; special tokens stand for none without `markup`."""
        ...


class ChatTemplate:
    """A model's Jinja chat template, rendered without access to the text of messages.

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
        environment = ImmutableSandboxedEnvironment(
            trim_blocks=True, lstrip_blocks=True, extensions=["jinja2.ext.loopcontrols"]
        )
        known: dict[str, Any] = environment.globals
        known.update(raise_exception=_refuse, bos_token=bos, eos_token=eos)
        try:
            self._template = environment.from_string(source)
        except TemplateError as error:
            raise ModelError(
                f"Cannot read the model's chat template ({error}). Use another model."
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
        """The markup that follows an assistant's message.

        Raises:
            ModelError: The template cannot be used at all.
        """
        try:
            pieces = self._pieces(("user", "assistant"))
        except TemplateError as error:
            raise ModelError(
                f"The model's chat template cannot be used ({error}). Use another model."
            ) from None
        after = pieces[pieces.index(1) + 1]
        assert isinstance(after, str)
        return after

    def _render(self, roles: tuple[str, ...]) -> tuple[str | int, ...]:
        messages = [
            {"role": role, "content": _SENTINEL.format(index)} for index, role in enumerate(roles)
        ]
        try:
            text = self._template.render(messages=messages, add_generation_prompt=True)
        except TemplateError:
            raise
        except Exception as error:  # a template is a program, which may fail in any way
            raise TemplateError(f"{type(error).__name__}: {error}") from None
        parts = _SENTINEL_PATTERN.split(text)
        pieces = tuple(int(part) if i % 2 else part for i, part in enumerate(parts))
        if set(pieces[1::2]) != set(range(len(roles))):
            raise TemplateError("it leaves a message out")
        return pieces


class ChatTokenizer:
    """Turns chats into token ids, and ids back into text.

    Markup and the content of each message are tokenized apart from each other, so a content's
    tokens are the same in every context, and never merge with what stands beside them.

    Attributes:
        end_of_turn: Token that ends the assistant's turn, by the template or else `eos`.
        add_bos: Whether every prompt begins with the `bos` token.
    """

    def __init__(
        self,
        encode: Encode,
        decode: Decode,
        *,
        template: str | None,
        bos: tuple[int, str],
        eos: tuple[int, str],
        add_bos: bool,
        names: Collection[str],
        controls: Collection[int],
    ) -> None:
        """Combine a model's tokenizer and its chat template.

        Args:
            encode: Its tokenizer.
            decode: Converts token ids to text.
            template: Jinja source of its chat template.
            bos: Id and text of the token that begins a sequence.
            eos: Id and text of the token that ends a sequence.
            add_bos: Whether every prompt begins with the `bos` token.
            names: Texts of all tokens that are markup, or that the tokenizer takes for markup.
            controls: Ids of the tokens that are no text: they end what a model writes.

        Raises:
            ModelError: There is no template, or it cannot be read.
        """
        if not template:
            raise ModelError("The model has no chat template. Use an instruct (chat) model.")
        self._decode, self.add_bos = decode, add_bos
        self._bos = [bos[0]] if add_bos else []
        self._template = ChatTemplate(template, bos[1], eos[1])
        self._controls = frozenset(controls)
        marks = "|".join(re.escape(name) for name in names if len(name) > 1 and name.strip())
        self._marks = re.compile(f"(?={marks})" if marks else "(?!)")
        self._encode = encode
        self._markup_ids = lru_cache(maxsize=1024)(self._tokenize_markup)
        self._text_ids = lru_cache(maxsize=8192)(self._tokenize_text)
        after = self._markup_ids(self._template.after_assistant())
        self.end_of_turn: int = next((i for i in after if i in self._controls), eos[0])
        if self.end_of_turn < 0:
            raise ModelError("No token ends the assistant's turn. Use an instruct (chat) model.")

    def render(self, messages: Sequence[Message]) -> list[int]:
        """Token ids of a chat, up to where the assistant's words begin."""
        ids: list[int] = []
        for piece in self._template.layout(messages):
            if isinstance(piece, Message):
                ids += self._text_ids(piece.content)
            else:
                ids += self._markup_ids(piece)
        return ids if ids[:1] == self._bos else self._bos + ids

    def tokenize(self, text: str) -> list[int]:
        """Token ids of plain text, as content of a message."""
        return list(self._text_ids(text))

    def detokenize(self, tokens: Sequence[int], *, markup: bool = False) -> str:
        """The text that tokens stand for; special tokens stand for none without `markup`."""
        return self._decode(tokens, markup=markup)

    def is_control(self, token: int) -> bool:
        """Whether a token is markup rather than text; one that is written ends the reply."""
        return token in self._controls

    def _tokenize_markup(self, text: str) -> tuple[int, ...]:
        return tuple(self._encode(text, markup=True))

    def _tokenize_text(self, text: str) -> tuple[int, ...]:
        """Ids of content; names of special tokens are cut in two, so that they stay plain text."""
        try:
            text.encode()
        except UnicodeEncodeError as error:
            raise InvalidInputError(
                f"The text has an invalid character (a lone surrogate) at position {error.start}."
            ) from None
        cuts = [0, *(match.start() + 1 for match in self._marks.finditer(text)), len(text)]
        pieces = [text[a:b] for a, b in pairwise(cuts) if a < b]
        return tuple(token for piece in pieces for token in self._encode(piece, markup=False))


def _refuse(reason: str) -> NoReturn:
    raise TemplateError(reason)
