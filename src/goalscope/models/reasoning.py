"""Models that think before they answer, between `<think>` and `</think>`."""

from __future__ import annotations

from goalscope.base.types import ModelError

_BEGIN, _END = "<think>", "</think>"


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


def marks_thought(markup: str) -> bool:
    """Whether markup begins or ends a thought."""
    return _BEGIN in markup or _END in markup


def closed(markup: str) -> str:
    """Markup after which an answer begins: a thought that it opens is closed empty."""
    if not opens_thought(markup):
        return markup
    gap = "\n" if markup.endswith("\n") else ""
    return f"{markup}{gap}{_END}{gap * 2}"
