"""What a person sees of a round: facts in order, and never another's escape sequences."""

import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from goalscope.agent.round import Round
from goalscope.base.text import model_shown
from goalscope.base.types import UNSPECIFIED, Action, Goal, GoalChange, StepResult, Turn
from goalscope.belief.belief import Belief
from goalscope.belief.goal_order import in_order
from goalscope.cli.display import (
    show_belief,
    show_episodes,
    show_header,
    show_outcome,
    show_round,
    show_scores,
    show_summary,
)
from goalscope.envs import Outcome
from goalscope.language.orders import Order, Reading
from goalscope.models.llama.model import embedded_path
from goalscope.models.llama.weights import Weights
from goalscope.storage.store import EpisodeInfo

CAKE, TEA = Goal("bake a cake"), Goal("make tea")
HOSTILE = "[red]x[/red][/] \x1b[31m\x1b]0;title\x07\u202e\r\ud800 :smile:"


def a_round(**changes):
    belief = Belief.uniform([CAKE, UNSPECIFIED, TEA]).observe(np.log([0.2, 0.1, 0.7]))
    values = {
        "number": 2,
        "turn": Turn("What else?", "Tea, please"),
        "belief": belief,
        "changes": (
            GoalChange("added", TEA, "explains tea"),
            GoalChange("removed", Goal("wash"), "least likely for 4 rounds"),
        ),
        "results": (
            StepResult(Action("add item", "Green Tea", 2), True, "2 x Green Tea at $3.00"),
            StepResult(Action("add item", "Moon"), False, "not sold here"),
        ),
        "replans": 1,
        "status": "2 x Green Tea  $6.00\nTotal  $6.00",
        "notes": ("The first 4 turns are no longer read.",),
        "terminated": False,
    }
    return Round(**(values | changes))


def drawn(show, *args, width=80, encoding="utf-8", **options):
    raw = io.BytesIO()
    file = io.TextIOWrapper(raw, encoding=encoding, errors="replace", newline="\n")
    show(
        Console(file=file, width=width, markup=False, emoji=False, highlight=False),
        *args,
        **options,
    )
    file.flush()
    return raw.getvalue().decode(encoding)


def test_a_round_tells_everything_in_order():
    order = Order("put", "mug", 2, where="sink", if_="it is clean")
    text = drawn(show_round, a_round(reading=Reading((order,))))
    parts = [
        "Round 2",
        "What else?",
        "Tea, please",
        "- put mug if it is clean (2, sink)",
        " 70.0%",
        "make tea",
        " 20.0%",
        "bake a cake",
        " 10.0%",
        "Unspecified",
        "+ make tea  explains tea",
        "- wash  least likely for 4 rounds",
        "replanned 1x",
        "✓ add item: Green Tea x2  2 x Green Tea at $3.00",
        "✗ add item: Moon  not sold here",
        "Total  $6.00",
        "no longer read",
    ]
    places = [text.find(part) for part in parts]
    assert -1 not in places, parts[places.index(-1)]
    assert places == sorted(places)


def test_the_bar_is_as_long_as_the_probability():
    line = next(line for line in drawn(show_round, a_round()).splitlines() if "70.0%" in line)
    assert line.count("█") == 14
    assert line.count("░") == 6


def test_arrows_show_the_change_of_the_same_goal():
    before = Belief.uniform([UNSPECIFIED, CAKE]).observe(np.log([0.1, 0.9]))
    lines = drawn(show_round, a_round(), before).splitlines()
    (cake,) = (line for line in lines if "bake a cake" in line)
    (unspecified,) = (line for line in lines if "Unspecified" in line)
    assert "▼" in cake
    assert "▲" not in unspecified + cake
    assert "▼" not in unspecified  # unchanged


def test_beliefs_without_goals_and_without_explanations_are_said():
    impossible = Belief.uniform([CAKE]).observe([-np.inf])
    assert "No goal explains" in drawn(show_round, a_round(belief=impossible))
    assert "Belief" not in drawn(show_round, a_round(belief=Belief.uniform(())))


def test_the_newest_confirmation_is_shown_and_when_it_was():
    first = Belief.uniform([CAKE, TEA]).pin(CAKE)
    later = first.observe([-1.0, -2.0])
    for belief, cake, tea in [
        (first, "(you confirmed it)", ""),
        (later, "(you confirmed it at the start)", ""),
        (later.pin(TEA), "", "(you confirmed it)"),
        (later.pin(TEA).observe([-1.0, -2.0]), "", "(you confirmed it after turn 1)"),
    ]:
        lines = drawn(show_belief, belief).splitlines()
        for goal, said in ((CAKE, cake), (TEA, tea)):
            (line,) = (line for line in lines if goal.text in line)
            assert line.partition(goal.text)[2].strip() == said


def test_many_goals_are_summed_up():
    many = Belief.uniform([Goal(f"goal {i}") for i in range(20)])
    assert "80.0%" in drawn(show_round, a_round(belief=many))
    assert "and 16 more" in drawn(show_round, a_round(belief=many))


def test_an_order_is_shown_as_no_more_than_that():
    goals = [Goal(f"goal {i}") for i in range(9)]
    text = drawn(show_round, a_round(belief=in_order(goals, goals)))
    lines = text.partition("The model's order")[2].splitlines()[1:6]
    assert [line.split() for line in lines[:4]] == [[str(i + 1), "goal", str(i)] for i in range(4)]
    assert lines[4].split() == ["and", "5", "more"]
    assert not set(text) & set("%█▲▼")
    assert "Belief" not in text


@pytest.mark.parametrize("width", [40, 80])
def test_nothing_is_wider_than_the_terminal(width):
    wide = "a very long goal that goes on and on " * 5
    round = a_round(belief=Belief.uniform([Goal(wide)]), status=wide, turn=Turn(wide, wide))
    assert max(map(len, drawn(show_round, round, width=width).splitlines())) <= width


def test_an_ascii_terminal_gets_ascii():
    text = drawn(show_round, a_round(), encoding="ascii")
    assert "##############......" in text
    assert "?" not in text.replace("What else?", "")


def test_hostile_text_is_shown_and_not_obeyed():
    text = drawn(
        show_round,
        a_round(
            turn=Turn(HOSTILE, HOSTILE),
            reading=Reading((Order("add", HOSTILE),)),
            belief=Belief.uniform([Goal(HOSTILE)]),
            changes=(GoalChange("added", Goal(HOSTILE), HOSTILE),),
            results=(StepResult(Action(HOSTILE, HOSTILE), True, HOSTILE),),
            status=HOSTILE,
            notes=(HOSTILE,),
        ),
        width=200,
    )
    assert text.count("[red]x[/red][/]") == 11
    assert ":smile:" in text
    assert not set(text) & set("\x1b\x07\r\u202e")


def test_the_frame_of_an_episode():
    info = EpisodeInfo(
        "ab12", "2020-01-01T00:00:00+00:00", "grocery", "baker", "good", "m", "Sell.", {},
        "terminated", 0.75, 4,
    )  # fmt: skip
    assert "ab12" in drawn(show_header, info)
    assert "done after 4 rounds, score 0.75, 1.5 s" in drawn(show_summary, info, 1.5)
    table = drawn(show_scores, [(info, None), (info, OUTCOME)])
    assert table.count("baker") == 2
    assert "2 of 3" in table
    assert "mean" in table.splitlines()[-2]
    assert "0.75" in table.splitlines()[-2]


CHECKS = [{"must_have": ["milk", "cream"]}, {"max_total": 9}, {"must_have": ["tea"]}, {"has": "x"}]
OUTCOME = Outcome((False, True, False, False), (True, False, True, False), ("Balloons", "Soap"))


def test_the_outcome_tells_needs_and_prohibitions_and_what_the_score_is_made_of():
    text = drawn(show_outcome, CHECKS, OUTCOME, encoding="ascii", width=200)
    assert [line.rstrip() for line in text.splitlines()] == [
        "Needs",
        "  ok must_have: milk, cream",
        "  ok must_have: tea",
        "  no has: x",
        "Prohibitions",
        "  no max_total: 9",
        "Unwanted: Balloons, Soap",
    ]
    made = "needs 2 of 3, violated 1, unwanted 2: score 0.33, 1.5 s"
    assert made in drawn(show_summary, EPISODE, 1.5, OUTCOME, width=200)
    untold = replace(OUTCOME, unwanted=None)
    assert "no welcome list" in drawn(show_outcome, CHECKS, untold)
    assert "violated 1: score 0.50" in drawn(show_summary, EPISODE, None, untold, width=200)


EPISODE = EpisodeInfo(
    "ab12cd34", "2020-01-01T00:00:00+00:00", "grocery", "lazy-baker", "no-inference", "m", "Sell.",
    {}, "truncated", 0.75, 12,
)  # fmt: skip


@pytest.mark.parametrize("width", [40, 60, 80, 120])
def test_no_word_of_the_list_of_episodes_is_broken(width):
    text = drawn(show_episodes, [EPISODE], width=width)
    words = {
        "id", "started", "(UTC)", "domain", "profile", "method", "ended", "rounds", "score",
        EPISODE.id, "2020-01-01", "00:00", "grocery", "lazy-baker", "no-inference", "0.75", "12",
        *EPISODE.ending.split(),
    }  # fmt: skip
    assert {word for word in text.split() if not set(word) <= {"─"}} <= words
    assert {EPISODE.id, "lazy-baker", "12"} <= set(text.split())
    assert ("no-inference" in text) is (width > 80)
    assert "0.75" in text
    assert ("2020-01-01" in text) is (width > 40)
    assert max(map(len, text.splitlines())) <= width


@pytest.mark.parametrize(
    ("changes", "width", "words"),
    [
        ({"domain": "/home/somebody/with/a/long/path/to/music.py"}, 80, {"music.py"}),
        ({"profile": None, "score": None}, 80, {"2020-01-01", "grocery", "you", "good"}),
        ({"domain": "tracking", "profile": None, "task": "Help callers."}, 200, {"callers."}),
    ],
    ids=["a domain of one's own", "no score, so the date has its room", "tracking"],
)
def test_episodes_go_by_what_tells_them_apart(changes, width, words):
    text = drawn(show_episodes, [replace(EPISODE, **{"method": "good"} | changes)], width=width)
    assert words <= set(text.split())
    assert ("score" in text) is (changes.get("score", 0.75) is not None)


def test_people_read_the_name_by_which_they_know_the_embedded_model() -> None:
    filed = Weights(embedded_path(), vocabulary_only=True).metadata("general.name")
    assert model_shown(f"writer and {filed}") == "writer and SmolLM2-135M-Instruct"
