"""Goals and first words of any kind give a belief, even where nothing tells goals apart."""

from __future__ import annotations

import numpy as np
import pytest

from goalscope.base.types import UNSPECIFIED, InvalidInputError
from goalscope.belief.tracker import GoalTracker

LONG = " ".join(
    ["arrange a dinner for the neighbours who moved in last spring and eat no fish,"] * 20
)
GOALS = {
    "one word": ["refund", "delivery", "warranty"],
    "labels": ["report_lost_card", "OPEN_ACCOUNT", "update-address"],
    "punctuation": ["?", "1", "2."],
    "a word apart": [f"book a table for {n} people" for n in range(2, 22)],
    "other languages": ["ein Konto eröffnen", "カードを止める", "заблокировать карту"],
    "same meaning": ["block a card", "have a card blocked", "close an account"],
    "one goal": ["make tea"],
}
FIRST = [
    "Hi!",
    "42",
    "\N{THUMBS UP SIGN}\N{PILE OF POO}",
    "Guten Tag",
    "x" * 400,
    "?",
    "I lost my card.",
]


@pytest.mark.parametrize("kind", GOALS)
def test_any_goals_and_first_words_give_a_belief(model, kind: str) -> None:
    for words in FIRST:
        tracker = GoalTracker(model, task="Help the customer.", goals=GOALS[kind])
        tracker.observe("How can I help?", words)
        chances = tracker.belief.probability
        assert np.isfinite(chances).all()
        assert chances.min() >= 0
        assert chances.sum() == pytest.approx(1)


def test_a_goal_of_three_hundred_words_is_an_error_and_one_of_a_hundred_a_goal(model) -> None:
    assert len(LONG.split()) == 300
    tracker = GoalTracker(model, goals=["make tea"])
    with pytest.raises(InvalidInputError, match="fewer words"):
        tracker.add([LONG])
    tracker = GoalTracker(model, goals=["make tea", " ".join(LONG.split()[:100])])
    tracker.observe("Yes?", "A dinner for the neighbours, please, and no fish.")
    assert len(tracker.belief.top(1)[0][0].text.split()) == 100


def test_what_nothing_tells_apart_stays_even(model) -> None:
    tracker = GoalTracker(model, goals=[f"ask for parcel {code}" for code in ("AX", "BQ", "CV")])
    tracker.observe("Yes?", "Hello there!")
    chances = [p for goal, p in tracker.belief.top() if goal != UNSPECIFIED]
    assert max(chances) < 2 * min(chances)


def test_unspecified_does_not_lead_because_goals_are_short() -> None:
    said = {
        "refund": "I'd like my money back for these shoes.",
        "delivery": "When will my parcel be delivered?",
        "warranty": "It broke, but it is still under warranty.",
    }
    for goal, words in said.items():
        tracker = GoalTracker(task="Help the customer.", goals=list(said))
        tracker.observe("How can I help?", words)
        assert tracker.belief.top(1)[0][0].text == goal
