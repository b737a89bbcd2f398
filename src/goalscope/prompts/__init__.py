"""The prompts, one file per prompt figure of the paper; their exact words are ours.

A file is a sequence of sections, each headed by a line `--- system`, `--- user` or
`--- assistant`, and each section is a Jinja template of one message. The file is cut into
sections before anything is filled in, so text from people or models cannot start a message.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any, cast

from jinja2 import StrictUndefined, Template
from jinja2.sandbox import SandboxedEnvironment

from goalscope.base.types import Message, Turn
from goalscope.models import LanguageModel

_JINJA = SandboxedEnvironment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
_HEADING = re.compile(r"^--- (system|user|assistant)\n", re.MULTILINE)


def render(name: str, **values: Any) -> list[Message]:
    """Fill in a prompt.

    Args:
        name: File name without its ending, such as "propose".
        **values: Every variable that the prompt uses.

    Raises:
        jinja2.UndefinedError: A variable is missing.
    """
    return [
        Message(cast(Any, role), template.render(values).strip())
        for role, template in _sections(name)
    ]


def recent(model: LanguageModel, turns: Sequence[Turn], most: int) -> list[Turn]:
    """The newest turns, up to `most`, that together fill at most half of the model's context.

    The newest is always there; one that is too long by itself is cut short.
    """
    room = model.context_size // 2

    def size(turn: Turn) -> int:
        return model.count_tokens([Message("user", turn.query), Message("user", turn.utterance)])

    kept: list[Turn] = []
    for turn in reversed([turn.plain() for turn in turns[-most:]]):
        if kept and size(turn) > room:
            break
        while size(turn) > room:
            turn = Turn(*(text[: len(text) * 3 // 4] for text in (turn.query, turn.utterance)))
        room -= size(turn)
        kept.insert(0, turn)
    return kept


def transcript(turns: Sequence[Turn]) -> list[Message]:
    """The turns as a chat in which the model is the person: agent as user, person as assistant."""
    return [
        message
        for turn in turns
        for message in (Message("user", turn.query), Message("assistant", turn.utterance))
    ]


@cache
def _sections(name: str) -> tuple[tuple[str, Template], ...]:
    source = (files(__name__) / f"{name}.jinja").read_text(encoding="utf-8")
    _, *parts = _HEADING.split(source)
    return tuple(
        (role, _JINJA.from_string(text)) for role, text in zip(parts[::2], parts[1::2], strict=True)
    )
