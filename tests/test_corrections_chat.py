"""Lines of a chat that speak of the goals: they correct, and are stored at once."""

import io

import pytest
from rich.console import Console

from commands import only_episode, run
from fakes import LampRoom, WordModel
from goalscope.agent.settings import Settings
from goalscope.base.types import Goal
from goalscope.cli.chat import correct
from goalscope.storage.session import Session
from goalscope.storage.store import Store
from lamps import RANKS, REPLIES

LAMP, SLEEP, TEA = Goal("have lamp light"), Goal("sleep without light"), Goal("drink tea")


def session(tmp_path, lines, more=0, **settings):
    """What is shown of lines of a person, and the rounds that are stored."""
    out = io.StringIO()
    left = iter(lines)

    def read(query):
        while (line := next(left)).startswith("/"):
            out.write(f"\n> {line}\n")
            correct(console, opened, line)
        return line

    console = Console(file=out, width=100, markup=False, emoji=False, highlight=False)
    spoken = sum(not line.startswith("/") for line in lines) + more
    with Store.open(tmp_path / "s.db") as store:
        chosen = Settings(calibration="default", rounds=spoken, **settings)
        opened = Session(store, chosen, LampRoom(), WordModel({**REPLIES, **RANKS}), read=read)
        list(opened.run())
        return out.getvalue().split("\n> ")[1:], store.rounds(opened.id)


def test_lines_of_a_chat_correct_the_goals_and_are_stored_with_the_round(tmp_path) -> None:
    lines = ["lamp light please", "/goals", "/pin  drink tea", "/veto 2", "/reword 1 a cup of tea"]
    shown, (first, second) = session(tmp_path, [*lines, "please"])
    goals, pin, veto, reword = shown
    ranked = [goal for goal, _ in first.belief.top()]
    numbers = [line.split()[0] for line in goals.splitlines() if "%" in line]
    assert numbers == ["1", "2", "3"]
    (line,) = (line for line in pin.splitlines() if "drink tea" in line and "%" in line)
    assert line.split()[0] == "1"
    assert "(you confirmed it)" in line
    assert "99.0%" in line
    assert (ranked[0].text in goals, ranked[0].text in veto) == (True, False)
    assert "a cup of tea" in reword
    assert "drink tea" not in reword.partition("Belief")[2]
    cup = Goal("a cup of tea")
    assert [(c.kind, c.goal) for c in second.changes[:6]] == [
        ("added", TEA), ("pinned", TEA), ("removed", ranked[0]),
        ("added", cup), ("pinned", cup), ("removed", TEA),
    ]  # fmt: skip
    assert second.belief.pinned == ((1, cup),)
    assert not first.belief.pinned


def test_a_correction_that_was_shown_is_stored_before_the_next_round(tmp_path) -> None:
    lines = ["lamp light please", "/veto 1", "/pin drink tea", "/reword 1 a cup of tea"]
    with pytest.raises(RuntimeError, match="StopIteration"):  # the person says no more
        session(tmp_path, lines, more=1)
    cup = Goal("a cup of tea")
    for _ in range(2):  # before the next round has it, and after
        with Store.open(tmp_path / "s.db") as store:
            (info,) = store.episodes()
            settings = Settings(rounds=info.rounds + 1)
            model = WordModel(REPLIES)
            again = Session(store, settings, LampRoom(), model, read=str, resume=info)
            assert again.agent.belief.pinned == ((1, cup),)
            assert LAMP not in again.agent.belief.goals
            list(again.run())
    with Store.open(tmp_path / "s.db") as store:
        _, second, third = store.rounds(info.id)
    told = [(c.kind, c.goal) for c in second.changes[:6]]
    assert told == [("removed", LAMP), ("added", TEA), ("pinned", TEA),
                    ("added", cup), ("pinned", cup), ("removed", TEA)]  # fmt: skip
    assert "pinned" not in [change.kind for change in third.changes]


def test_what_is_corrected_before_a_chat_is_left_is_there_when_it_goes_on(
    shop,
    words,
    store_file,
) -> None:
    first = run("chat", *shop[:2], input="I need cocoa powder.\n/pin bake a cake\nquit\n")
    assert first.exit_code == 0, first.output
    info = only_episode(store_file)
    said = (
        f'Corrected since the last round: it is "bake a cake". `goalscope chat --resume {info.id}`'
    )
    assert said in run("replay", info.id).stdout
    assert said in run("why", info.id).stderr
    assert said in run("why", info.id, "--goal", "bake a").stderr.splitlines()[-1]
    second = run("chat", "--resume", info.id, input="And flour.\n")
    assert second.exit_code == 0, second.output
    assert "(you confirmed it)" in second.stdout
    with Store.open(store_file) as store:
        last = store.rounds(info.id)[-1]
    assert last.belief.pinned == ((1, Goal("bake a cake")),)
    for command in ("replay", "why"):
        assert "Corrected since" not in run(command, info.id).output


def test_a_number_names_the_goal_that_has_it_in_the_list(tmp_path) -> None:
    lines = ["lamp light please", "/pin drink tea", "/pin 2", "/why 1", "/why"]
    shown, (_, second) = session(tmp_path, [*lines, "please"])
    (line,) = (line for line in shown[0].splitlines() if line.split()[:1] == ["2"])
    _, tea, pinned = second.changes[:3]
    assert tea.goal == TEA
    assert pinned.goal.text in line
    assert f"Why {pinned.goal.text}" in shown[2]
    assert "lamp light please" in shown[2]
    assert "You confirmed it after turn 1." in shown[2]
    assert "by its number (1 to 4)" in shown[3]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("/help", "/reword NUMBER TEXT"),
        ("/pinn 1", "Unknown command /pinn. /help lists"),
        ("/veto 0", "1 to 3"),
        ("/pin 4", "1 to 3"),
        ("/pin", "(1 to 3), or in your own words. /goals"),
        ("/why lamp", "1 to 3"),
        ("/reword 1", "empty"),
        ("/pin \ud83c", "surrogate"),
        ("/veto 1\x1b[31m", "1 to 3"),
    ],
)
def test_a_line_that_cannot_be_done_is_answered_and_changes_nothing(tmp_path, line, said) -> None:
    (shown,), (_, second) = session(tmp_path, ["lamp light please", line, "please"])
    assert said in shown.partition("\n")[2]
    assert "\x1b" not in shown.partition("\n")[2]
    assert not second.belief.pinned
    assert not [c for c in second.changes if c.reason.startswith("you ")]


def test_a_chat_without_a_belief_says_so(tmp_path) -> None:
    shown, _ = session(tmp_path, ["lamp", "/goals", "/help", "please"], method="no-goals")
    assert ["keeps no belief" in each for each in shown] == [True, True]


def test_a_chat_with_an_order_offers_only_what_it_can_do(tmp_path) -> None:
    lines = ["lamp light please", "/help", "/pin 1", "/goals"]
    (*refused, goals), (_, second) = session(tmp_path, [*lines, "please"], method="no-inference")
    for shown in refused:
        assert "computes no evidence" in shown
        assert "/pin NUMBER" not in shown
    assert "The model's order" in goals
    assert not second.belief.pinned


@pytest.mark.parametrize("method", ["good", "no-goals", "no-inference"])
def test_a_chat_says_how_to_correct_goals_where_that_is_possible(shop, words, method) -> None:
    shown = run("chat", *shop[:2], "--method", method, input="/quit\n").stdout
    assert ("/help" in shown) == (method == "good")
    assert "ends the task" in shown
