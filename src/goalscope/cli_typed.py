"""What a person types at the terminal in a chat."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from goalscope.agent import CONFIRM
from goalscope.dialog import FALLBACK
from goalscope.display import show_status
from goalscope.plain import plain
from goalscope.types import Turn

if TYPE_CHECKING:
    from rich.console import Console

    from goalscope.envs import Environment

__all__ = ["typed"]

_YES = frozenset({"y", "yes", "yes please", "yes, please", "yeah", "yep", "sure", "ok", "okay"})
_NO = frozenset({"n", "no", "nope", "not yet", "no, not yet", "no thanks", "no, thanks"})
"""How one agrees, or does not, to what nobody can undo."""


def typed(out: Console, query: str, env: Environment, command: Callable[[str], object]) -> str:
    """The next words for the agent; an end that nobody can undo is looked at and agreed to first.

    Args:
        out: Where the query and the state are shown.
        query: What the agent asks.
        env: How things stand.
        command: Is told what begins with "/", until there are words for the agent.

    Raises:
        EOFError: The person leaves.
    """
    _say(out, query)
    final = ""
    while True:
        words = input("You    ")
        if not sys.stdin.isatty():
            out.print(plain(words))
        said = words.strip(" .!").casefold()
        if said.removeprefix("/") in ("quit", "exit"):
            raise EOFError
        ends = env.is_completion(Turn(query, words)) and bool(env.completion_actions())
        if final and (ends or said in _YES):
            return final
        if ends:
            final = words
            show_status(out, env.status())
            _say(out, CONFIRM)
        elif final and said in _NO:
            final = ""
            _say(out, f"Not done. {FALLBACK}")
        elif words.lstrip().startswith("/"):
            command(words)
        else:
            return words


def _say(out: Console, words: str) -> None:
    out.print(plain("Agent  ", "cyan").append_text(plain(words)))
