"""Chats as tokens, by the model's chat template; text can never act as markup.

A thought is what a model writes between `<think>` and `</think>` before it answers.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from datetime import datetime
from functools import lru_cache
from itertools import pairwise
from typing import Any, NoReturn, Protocol

from jinja2 import TemplateError
from jinja2.ext import Extension
from jinja2.nodes import Node, Scope
from jinja2.parser import Parser
from jinja2.sandbox import ImmutableSandboxedEnvironment

from goalscope.base.types import Message, ModelError, readable

_SENTINEL = "\ue000{}\ue001"
_SENTINEL_PATTERN = re.compile("\ue000([0-9]+)\ue001")
_BEGIN, _END = "<think>", "</think>"
_TODAY = datetime(2024, 7, 26)
"""The date that templates are told, so that no answer depends on the day; Llama's own default."""
_THINKING_OFF: dict[str, Any] = {
    "enable_thinking": False,
    "thinking": False,
    "reasoning": False,
    "thinking_budget": 0,
    "thinking_mode": "disabled",
    "thinking_option": "off",
}
"""What templates of various makers are told where the model is not to think aloud."""


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


class _Generation(Extension):
    """The tag `{% generation %}` around the assistant's words, which only trainers look for."""

    tags = {"generation"}  # noqa: RUF012 (as Jinja declares it)

    def parse(self, parser: Parser) -> Node:
        """The statements in the tag, as if it were not there."""
        line = next(parser.stream).lineno
        body = parser.parse_statements(("name:endgeneration",), drop_needle=True)
        return Scope(body).set_lineno(line)


class ChatTemplate:
    """A model's Jinja chat template, rendered without access to the text of messages.

    The template sees a sentinel in place of each content, so the markup between contents depends on
    the roles alone; the caller turns markup and contents into tokens by different rules. Thinking
    is switched off where the template knows how.
    """

    def __init__(self, source: str, bos: str, eos: str) -> None:
        """Compile `source`.

        Args:
            source: Jinja source, as in a GGUF file's `tokenizer.chat_template`.
            bos: Text of the token that begins a sequence.
            eos: Text of the token that ends a sequence.
        """
        environment = ImmutableSandboxedEnvironment(
            trim_blocks=True,
            lstrip_blocks=True,
            extensions=["jinja2.ext.loopcontrols", _Generation],
        )
        known: dict[str, Any] = environment.globals
        known.update(raise_exception=_refuse, bos_token=bos, eos_token=eos)
        known.update(strftime_now=_TODAY.strftime)
        try:
            self._template = environment.from_string(source)
        except (TemplateError, SyntaxError, RecursionError) as error:
            raise ModelError(
                f"Cannot read the model's chat template ({error}). Use another model."
            ) from None
        self._prompt = lru_cache(maxsize=256)(self._find_prompt)

    def layout(self, messages: Sequence[Message], *, writing: bool = False) -> list[str | Message]:
        """Markup (str) and messages (each for its content) in prompt order.

        The last piece is the markup after which the assistant's words begin: that of earlier words
        of the assistant's, or with `writing` that of a reply to be written. Neither leaves a
        thought open.

        Raises:
            ModelError: The template refuses this order of roles, or fails.
        """
        try:
            pieces, before_words, before_reply = self._prompt(tuple(m.role for m in messages))
        except _RefusedError as error:
            if len(messages) < 2 or [m.role for m in messages[:2]] != ["system", "user"]:
                raise ModelError(
                    f"The model's chat template refuses these messages ({error}). "
                    "Use a model whose template takes system messages and any order of roles."
                ) from None
            system, user, *rest = messages
            merged = Message("user", f"{system.content}\n\n{user.content}")
            return self.layout([merged, *rest], writing=writing)
        except TemplateError as error:
            raise _unusable(error) from None
        last = before_reply if writing else before_words
        return [*(messages[each] if isinstance(each, int) else each for each in pieces), last]

    def after_assistant(self) -> str:
        """The markup that follows an assistant's message.

        Raises:
            ModelError: The template cannot be used at all.
        """
        try:
            pieces = self._render(("user", "assistant"))
        except TemplateError as error:
            raise _unusable(error) from None
        after = pieces[pieces.index(1) + 1]
        assert isinstance(after, str)
        return after

    def _find_prompt(self, roles: tuple[str, ...]) -> tuple[tuple[str | int, ...], str, str]:
        """The pieces up to the last content; then the markup before words, and before a reply."""
        *pieces, header = self._render(roles)
        assert isinstance(header, str)
        words = self._before_words(roles)
        if words is None:
            return tuple(pieces), _closed(header), _closed(header)
        return tuple(pieces), _closed(words), _closed(_reply_header(header, words))

    def _before_words(self, roles: tuple[str, ...]) -> str | None:
        """The markup between a chat and earlier words of the assistant's; None if it shows none."""
        if not roles:
            return None
        try:
            pieces = self._render((*roles, "assistant", "user"), reply=False)
        except TemplateError:
            return None
        at = pieces.index(len(roles))
        follows = at >= 2 and pieces[at - 2] == len(roles) - 1
        return str(pieces[at - 1]) if follows else None

    def _render(self, roles: tuple[str, ...], *, reply: bool = True) -> tuple[str | int, ...]:
        messages = [
            {"role": role, "content": _SENTINEL.format(index)} for index, role in enumerate(roles)
        ]
        try:
            text = self._template.render(
                messages=messages, add_generation_prompt=reply, **_THINKING_OFF
            )
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

    def render(self, messages: Sequence[Message], *, writing: bool = False) -> list[int]:
        """Token ids of a chat, up to where the assistant's words begin.

        They are words that are given, or with `writing` a reply that the model is to write.
        """
        ids: list[int] = []
        for piece in self._template.layout(messages, writing=writing):
            if isinstance(piece, Message):
                ids += self._text_ids(piece.content)
            else:
                ids += self._markup_ids(piece)
        return ids if ids[:1] == self._bos else self._bos + ids

    def count(self, messages: Sequence[Message]) -> int:
        """Number of token ids of a chat as `render` gives them, the longer way."""
        return max(len(self.render(messages, writing=writing)) for writing in (False, True))

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
        readable(text, "text")
        cuts = [0, *(match.start() + 1 for match in self._marks.finditer(text)), len(text)]
        pieces = [text[a:b] for a, b in pairwise(cuts) if a < b]
        return tuple(token for piece in pieces for token in self._encode(piece, markup=False))


def answer_of(text: str, name: str) -> str:
    """The answer of a finished reply, without the thought that it begins with.

    A template may open the thought itself, so that the reply only closes it.

    Args:
        text: The reply.
        name: The model's, for the error.

    Raises:
        ModelError: The reply is all thought, or was cut off within it.
    """
    thought, end, answer = text.partition(_END)
    begins = thought.lstrip().startswith(_BEGIN)
    if not begins and (not end or _BEGIN in thought):
        return text  # without a thought, or one that only speaks of the marks
    if not answer.strip():
        raise ModelError(
            f"{name} only reasoned, and gave no answer. Turn its thinking off, as with "
            '{"chat_template_kwargs": {"enable_thinking": false}} at the server, or use another '
            "model."
        )
    return answer.lstrip()


def opens_thought(markup: str) -> bool:
    """Whether text that follows this markup is part of a thought."""
    return markup.rfind(_BEGIN) > markup.rfind(_END)


def _closed(markup: str) -> str:
    """Markup after which an answer begins: a thought that it opens is closed empty."""
    if not opens_thought(markup):
        return markup
    gap = "\n" if markup.endswith("\n") else ""
    return f"{markup}{gap}{_END}{gap * 2}"


class _RefusedError(TemplateError):
    """A template's own refusal of a chat."""


def _refuse(reason: str) -> NoReturn:
    raise _RefusedError(reason)


def _unusable(error: TemplateError) -> ModelError:
    return ModelError(
        f"The model's chat template cannot be used ({error}). Use another model, or another "
        "version of this one."
    )


def _reply_header(header: str, words: str) -> str:
    """The markup before a reply, of the template's own and that before earlier words.

    The template's own may leave the channel to the model, or begin a thought in plain words; then
    that of earlier words leads to the answer.
    """
    if header.rstrip() == words.rstrip():
        return header
    added = header[len(words) :] if header.startswith(words) else ""
    return header if _BEGIN in added or _END in added else words
