"""What a person types at the terminal in a chat."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from goalscope.safe_text import terminal_safe

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["typed"]


def typed(out: Console, query: str, command: Callable[[str], object]) -> str:
    """The next words for the agent.

    Args:
        out: Where the query is shown.
        query: What the agent asks.
        command: Is told what begins with "/", until there are words for the agent.

    Raises:
        EOFError: The person leaves.
    """
    out.print(terminal_safe("Agent  ", "cyan").append_text(terminal_safe(query)))
    while True:
        words = input("You    ")
        if not sys.stdin.isatty():
            out.print(terminal_safe(words))
        if words.strip(" .!").casefold().removeprefix("/") in ("quit", "exit"):
            raise EOFError
        if not words.lstrip().startswith("/"):
            return words
        command(words)
