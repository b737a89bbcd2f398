"""A chat's end that nobody can undo: looked at, agreed to, and stored with what was said of it."""

from __future__ import annotations

import pytest
import typer
from typer.testing import CliRunner

from commands import only_episode, run
from goalscope.agent.guards import CONFIRM
from goalscope.agent.round import Round
from goalscope.cli.main import _Commands
from goalscope.storage.store import Store

QUESTION = f'I understood "buy". {CONFIRM}'
COCOA = "add cocoa powder"


@pytest.fixture
def chat(shop, words):
    """What a chat shows, and the rounds of the only episode."""

    def told(*lines: str, resume: str = "") -> tuple[str, list[Round]]:
        options = ("--resume", resume) if resume else shop[:2]
        result = run("chat", *options, input="".join(f"{line}\n" for line in lines))
        assert result.exit_code == 0, result.output
        with Store.open(None) as store:
            (info,) = store.episodes()
            return " ".join(result.stdout.split()), store.rounds(info.id)

    return told


def said(rounds: list[Round]) -> list[str]:
    return [round.turn.utterance for round in rounds]


def bought(rounds: list[Round]) -> bool:
    return any("buy" in result.action.name for round in rounds for result in round.results)


def test_what_was_asked_and_answered_is_stored_and_found_and_shown_again(chat) -> None:
    _, rounds = chat(COCOA, "buy", "no; add milk", "buy", "no", "buy", "yes")
    assert said(rounds) == [COCOA, "buy", "no; add milk", "buy", "no", "buy", "yes"]
    assert [n for n, round in enumerate(rounds) if round.turn.query == QUESTION] == [2, 4, 6]
    assert not bought(rounds[:-1])
    assert [round.number for round in rounds if round.terminated] == [7]
    with Store.open(None) as store:
        (info,) = store.episodes(text="add milk")
    shown = " ".join(run("replay", info.id).stdout.split())
    assert shown.count(CONFIRM) == 3
    assert "no; add milk" in shown


@pytest.mark.parametrize("answer", ["yes, but no milk", "yes?", "Fine.", "buy"])
def test_nothing_but_a_yes_buys_and_nothing_is_guessed_for_it(chat, answer: str) -> None:
    _, rounds = chat(COCOA, "buy", answer)
    assert said(rounds) == [COCOA, "buy", answer]
    assert not rounds[-1].terminated
    assert not bought(rounds)


@pytest.mark.parametrize("leaving", ["quit", "/Exit."])
def test_who_leaves_when_asked_is_asked_again(chat, leaving: str) -> None:
    _, rounds = chat(COCOA, "buy", "/goals", leaving, "yes")
    assert said(rounds) == [COCOA, "buy"]
    info = only_episode()
    shown, rounds = chat("yes", resume=info.id)
    assert CONFIRM in shown
    assert rounds[-1].terminated


def test_nothing_to_buy_needs_no_word(chat) -> None:
    shown, rounds = chat("buy")
    assert CONFIRM not in shown
    assert "The basket is empty." in shown
    assert not rounds[-1].terminated


def test_ctrl_c_within_a_library_that_then_fails_is_ctrl_c() -> None:
    commands = typer.Typer(cls=_Commands)

    @commands.command()
    def stop() -> None:
        try:
            raise KeyboardInterrupt
        finally:
            raise AssertionError("a commit that was cut short")

    @commands.command()
    def fail() -> None:
        raise AssertionError("nobody has stopped it")

    assert CliRunner().invoke(commands, ["stop"]).exit_code == 130
    assert isinstance(CliRunner().invoke(commands, ["fail"]).exception, AssertionError)
