"""Replies of models that think aloud before they answer."""

from __future__ import annotations

import re

from goalscope.types import ModelError

__all__ = ["answer_of", "answer_so_far"]

_THOUGHT = re.compile(r"\A\s*<think(?:ing)?>.*?(?:</think(?:ing)?>\s*|\Z)", re.DOTALL)
_END = re.compile(r"\A.*</think(?:ing)?>\s*", re.DOTALL)


def answer_so_far(text: str) -> str:
    """A reply without its reasoning: what stands between `<think>` and `</think>`, or before that.

    A template may open the thought itself, so that the reply begins within it.
    """
    return _END.sub("", _THOUGHT.sub("", text, count=1), count=1)


def answer_of(text: str, name: str) -> str:
    """The answer of a finished reply.

    Raises:
        ModelError: The reply is all reasoning.
    """
    found = answer_so_far(text)
    if text.strip() and not found.strip():
        raise ModelError(
            f"{name} only reasoned, and gave no answer. Turn its thinking off, as with "
            '{"chat_template_kwargs": {"enable_thinking": false}} at the server, or use another '
            "model."
        )
    return found
