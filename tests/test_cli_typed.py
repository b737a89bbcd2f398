"""What a person types in a chat: what nobody can undo is looked at and agreed to first."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from rich.console import Console

from goalscope.agent import CONFIRM
from goalscope.cli_typed import typed
from shops import shop

QUERY = "What else would you like?"


def answered(
    monkeypatch: pytest.MonkeyPatch, *lines: str, basket: dict[str, int] | None = None
) -> tuple[str, list[str], str, list[str]]:
    """What reaches the agent, what was a command, what was shown, and what is left to read."""
    waiting: Iterator[str] = iter(lines)
    monkeypatch.setattr("builtins.input", lambda prompt: next(waiting))
    commands: list[str] = []
    out = Console(record=True, width=80)
    words = typed(out, QUERY, shop(basket), commands.append)
    return words, commands, out.export_text(), [*waiting]


@pytest.mark.parametrize("yes", ["yes", "Y", "Yes, please!", "ok", "Buy the basket", "yes, buy it"])
def test_a_purchase_is_looked_at_and_agreed_to(monkeypatch: pytest.MonkeyPatch, yes: str) -> None:
    words, _, shown, left = answered(
        monkeypatch, "Buy the basket", yes, "left", basket={"Whole Milk": 2}
    )
    assert (words, left) == ("Buy the basket", ["left"])
    assert CONFIRM in shown
    assert "2 x Whole Milk" in shown.split("Buy the basket")[1]


@pytest.mark.parametrize("no", ["no", "Not yet.", "NO, thanks"])
def test_who_does_not_agree_is_asked_on(monkeypatch: pytest.MonkeyPatch, no: str) -> None:
    words, commands, shown, _ = answered(
        monkeypatch, "Buy the basket", no, "/goals", "yes", basket={"Whole Milk": 2}
    )
    assert (words, commands) == ("yes", ["/goals"])
    assert "Not done." in shown


@pytest.mark.parametrize(
    "words", ["remove the milk", "yes, but remove the milk", "no, add eggs", "yes?"]
)
def test_anything_else_is_heard_instead(monkeypatch: pytest.MonkeyPatch, words: str) -> None:
    said, *_ = answered(monkeypatch, "Buy it", words, basket={"Whole Milk": 2})
    assert said == words


def test_nothing_to_buy_needs_no_word(monkeypatch: pytest.MonkeyPatch) -> None:
    words, _, shown, left = answered(monkeypatch, "Buy the basket", "yes")
    assert (words, left) == ("Buy the basket", ["yes"])
    assert CONFIRM not in shown


@pytest.mark.parametrize("leaving", ["quit", "/quit", "Exit."])
def test_one_can_leave_when_asked(monkeypatch: pytest.MonkeyPatch, leaving: str) -> None:
    with pytest.raises(EOFError):
        answered(monkeypatch, "Buy the basket", leaving, basket={"Whole Milk": 2})
