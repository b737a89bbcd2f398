"""Models that think before they answer: tell the answer from the thought, and close thoughts."""

from __future__ import annotations

import re
from typing import NamedTuple

from goalscope.base.types import ModelError

__all__ = ["answer_of", "begins_in_thought", "closed", "marks_thought", "only_reasoned"]
__all__ += ["opens_thought"]

_NAME = (
    r"(?:[\w:-]+[:_-])?(?:ant)?"
    r"(?:think(?:ing)?|thoughts?|reason(?:ing)?|reflection|analysis|scratchpad|monologue)(?:[:_-]\w+)?"
)
_KINDS = {
    "tag": (rf"<{_NAME}(?:\s[^<>]{{0,80}})?>", rf"</{_NAME}\s*>"),
    "pipes": (
        rf"<\|(?!end_){_NAME}(?<!_end)\|>|<\|inner_prefix\|>",
        rf"<\|(?:(?:end_|/){_NAME}|{_NAME}(?<=_end))\|>|<\|inner_suffix\|>",
    ),
    "brackets": (
        r"(?-i:\[(?:THINK(?:ING)?|REASONING)\])",
        r"(?-i:\[/(?:THINK(?:ING)?|REASONING)\])",
    ),
    "diamonds": (rf"◁{_NAME}▷", rf"◁/{_NAME}▷"),
    "harmony": (
        r"<\|channel\|>\s*(?:analysis|commentary)\b[^<]*<\|message\|>",
        r"<\|channel\|>\s*final\b[^<]*(?:<\|constrain\|>[^<]*)?<\|message\|>",
    ),
    "plain": (
        r"\A\s*(?-i:analysis)(?:(?=(?-i:[A-Z]))|(?=[^<]{0,20000}?(?-i:assistant\s?final)))",
        r"assistant\s?final",
    ),
    "granite": (
        r"\A\s*Here(?: i|')s my thought process:",
        r"Here(?: i|')s my response:",
    ),
    "gemma": (r"<\|channel>thought\b\n?", r"<channel\|>"),
    "kimi": (r"<\|open\|>think<\|sep\|>", r"<\|close\|>think<\|sep\|>"),
    "answer": (
        r"(?!)",
        r"<\|(?:START_(?:RESPONSE|TEXT)|begin_of_solution|content)\|>|\[BEGIN FINAL RESPONSE\]"
        r"|<\|open\|>response<\|sep\|>",
    ),
}
"""How makers of models mark where a thought begins and ends, or where the answer begins."""

_IN_PROSE = ("plain_end", "granite_end")
"""Ends that are no mark where no thought began."""

_MARK = re.compile(
    "|".join(
        f"(?P<{kind}>{begins})|(?P<{kind}_end>{ends})" for kind, (begins, ends) in _KINDS.items()
    ),
    re.IGNORECASE,
)
_ENDS = re.compile(
    r"(?:<\|(?:end|return|END_RESPONSE|END_TEXT|end_of_solution)\|>|\[END FINAL RESPONSE\]"
    r"|<\|close\|>response<\|sep\|>)\Z"
)
_TAG = re.compile(r"<(answer|response|solution|output|final|final_answer)>\s*", re.IGNORECASE)
_SPACE = re.compile(r"\s*")


def answer_of(text: str, name: str, *, cut_off: bool = False, in_thought: bool = False) -> str:
    """The answer of a finished reply, without its reasoning.

    A thought stands between two marks, such as `<think>` and `</think>`; a template may open it
    itself, so that the reply begins within it and only closes it.

    Args:
        text: The reply.
        name: The model's, for the error.
        cut_off: Whether the reply was ended by its greatest length.
        in_thought: Whether the model's replies begin within a thought, as far as known.

    Raises:
        ModelError: The reply is all reasoning, or was cut off within it.
    """
    found, open_at, ended = _split(text)
    if open_at is not None and found.strip() and not cut_off:
        return found + text[open_at:]  # speaks of a mark, and opens no thought
    cut = cut_off and (open_at is not None or (in_thought and not ended))
    if cut or (text.strip() and not found.strip()):
        raise only_reasoned(name)
    return found


def begins_in_thought(text: str) -> bool:
    """Whether a reply ends a thought that it did not begin: its prompt did."""
    mark = _MARK.search(text)
    return mark is not None and (mark.lastgroup or "") not in (*_KINDS, *_IN_PROSE, "answer_end")


def only_reasoned(name: str) -> ModelError:
    """The error for a reply without an answer."""
    return ModelError(
        f"{name} only reasoned, and gave no answer. Turn its thinking off, as with "
        '{"chat_template_kwargs": {"enable_thinking": false}} at the server, or use another '
        "model."
    )


def opens_thought(markup: str) -> bool:
    """Whether text that follows this markup is part of a thought."""
    return _split(markup).open_at is not None


def marks_thought(markup: str) -> bool:
    """Whether markup begins or ends a thought."""
    return _MARK.search(markup) is not None


def closed(markup: str) -> str:
    """Markup after which an answer begins: a thought that it opens is closed empty."""
    opened = [mark for mark in _MARK.finditer(markup) if mark.lastgroup in _KINDS]
    if not opened or not opens_thought(markup):
        return markup
    mark = opened[-1]
    said, gap = mark.group().strip(), "\n" if markup.endswith("\n") else ""
    return f"{markup}{gap}{_closing(mark.lastgroup or '', said)}{gap * 2}"


def _closing(kind: str, mark: str) -> str:
    """The mark that ends the thought that `mark` begins."""
    if kind == "harmony":
        return "<|end|><|start|>assistant<|channel|>final<|message|>"
    if kind == "gemma":
        return "<channel|>"
    if kind == "kimi":
        return "<|close|>think<|sep|>"
    if kind == "pipes":
        ended = re.sub(r"(?i)start|begin", _like_end, mark)
        return ended if ended != mark else f"<|/{mark[2:]}"
    return f"{mark[0]}/{mark[1:]}"


def _like_end(begin: re.Match[str]) -> str:
    return "END" if begin.group().isupper() else "end"


class _Split(NamedTuple):
    """A reply: its answer, where a thought begins that does not end, and whether one ended."""

    answer: str
    open_at: int | None
    ended: bool


def _split(text: str) -> _Split:
    """The text outside of thoughts."""
    kept: list[str] = []
    start, begun, inside, thoughts = 0, 0, "", False
    for mark in _MARK.finditer(text):
        kind = mark.lastgroup or ""
        if kind in _KINDS:
            if not inside:
                before = text[start : mark.start()]
                kept += [before] if before.strip() else []
                inside, begun = kind, mark.start()
        elif kind in (f"{inside}_end", "answer_end") or (not inside and kind not in _IN_PROSE):
            if not inside:  # the reply began within a thought
                kept.clear()
            inside, thoughts, start = "", True, _after(text, mark.end())
    if not inside:
        kept.append(text[start:])
    answer = _unwrapped("".join(kept)) if thoughts else "".join(kept)
    return _Split(answer, begun if inside else None, thoughts)


def _after(text: str, end: int) -> int:
    """Where the answer begins after a mark."""
    space = _SPACE.match(text, end)
    return space.end() if space else end


def _unwrapped(answer: str) -> str:
    """An answer after a thought, without the marks around it."""
    if end := _ENDS.search(answer.rstrip()):
        answer = answer[: end.start()].rstrip()
    if tag := _TAG.match(answer):
        answer = answer[tag.end() :].rstrip().removesuffix(f"</{tag[1]}>").rstrip()
    return answer
