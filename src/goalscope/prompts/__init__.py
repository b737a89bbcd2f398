"""The prompts, one file per prompt figure of the paper; their exact words are ours.

A file is a sequence of sections, each headed by a line `--- system`, `--- user` or
`--- assistant`, and each section is a Jinja template of one message. The file is cut into
sections before anything is filled in, so text from people or models cannot start a message.
"""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files
from typing import Any, cast

from jinja2 import StrictUndefined, Template
from jinja2.sandbox import SandboxedEnvironment

from goalscope.types import Message

__all__ = ["render"]

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


@cache
def _sections(name: str) -> tuple[tuple[str, Template], ...]:
    source = (files(__name__) / f"{name}.jinja").read_text(encoding="utf-8")
    _, *parts = _HEADING.split(source)
    return tuple(
        (role, _JINJA.from_string(text)) for role, text in zip(parts[::2], parts[1::2], strict=True)
    )
