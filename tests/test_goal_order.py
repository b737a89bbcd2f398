"""No Inference (Sec. 4.3): the model's own order of the goals, which is no evidence."""

from __future__ import annotations

import pytest

from fakes import LampRoom, WordModel
from goalscope.base.types import UNSPECIFIED, Goal, UnreadableAnswerError
from goalscope.belief.goal_manager import GoalManager
from goalscope.belief.goal_order import GoalOrder, in_order
from goalscope.storage.store import round_from_json, round_to_json
from goalscope.web.views import RoundView
from lamps import RANKS, REPLIES, Speechless, Writes, agent_in

TEA, CAKE, SOUP = Goal("make tea"), Goal("bake a cake"), Goal("cook soup")
GOALS = (UNSPECIFIED, TEA, CAKE, SOUP)


def order(most: int, least: int, goals=GOALS) -> GoalOrder:
    """An order whose model names the goals of these numbers."""
    model = WordModel({"the most likely": f'"{most}"', "the least likely": f'"{least}"'})
    return GoalOrder(model, "Help.", goals)


def ranked(found: GoalOrder) -> list[Goal]:
    return [goal for goal, _ in found.belief.top()]


def test_the_likeliest_goal_is_first_the_least_likely_last_the_others_as_they_came() -> None:
    found = order(3, 1)
    found.observe("What?", "Hot water.")
    assert ranked(found) == [CAKE, TEA, SOUP, UNSPECIFIED]
    assert [goal.text for goal in found.belief.goals] == [goal.text for goal in GOALS]
    assert len(found.turns) == 1


def test_probabilities_are_in_the_ratio_of_the_reciprocal_ranks_and_no_evidence() -> None:
    belief = in_order(GOALS, [CAKE, TEA, SOUP, UNSPECIFIED])
    probabilities = [probability for _, probability in belief.top()]
    assert probabilities == pytest.approx([12 / 25, 6 / 25, 4 / 25, 3 / 25])
    assert belief.log_likelihood.shape == (0, 4)
    assert not belief.inferred


@pytest.mark.parametrize(
    ("gone", "left"),
    [
        ([], [CAKE, UNSPECIFIED, SOUP, TEA]),
        ([CAKE], [UNSPECIFIED, SOUP, TEA]),
        ([Goal("unknown")], [CAKE, UNSPECIFIED, SOUP, TEA]),
    ],
)
def test_what_is_dropped_leaves_the_order_of_the_others(gone, left) -> None:
    found = order(3, 2)
    found.observe("What?", "Hot water.")
    found.drop(gone)
    assert ranked(found) == left


def test_a_goal_named_as_both_is_the_likeliest() -> None:
    found = order(2, 2)
    found.observe("What?", "Hot water.")
    assert ranked(found)[0] == TEA


def test_without_goals_nothing_is_asked() -> None:
    found = GoalOrder(Speechless(), "Help.", ())  # pyright: ignore
    assert found.observe("What?", "Hot water.").goals == ()


def test_goals_are_proposed_where_unspecified_is_the_likeliest_and_ordered_together() -> None:
    found = order(3, 1, (UNSPECIFIED,))
    found.observe("What?", "Hot water.")
    manager = GoalManager(Writes(TEA.text, CAKE.text), WordModel(), "Help.", propose="paper")
    changes, missing = manager.manage(found, [])
    assert [change.goal for change in changes] == [TEA, CAKE]
    assert not missing
    assert ranked(found) == [CAKE, TEA, UNSPECIFIED]
    assert manager.manage(found, [])[0] == []


def test_a_failed_check_leaves_the_goals_as_they_were() -> None:
    found = order(1, 2, (UNSPECIFIED,))
    before = found.observe("What?", "Hot water.")
    manager = GoalManager(
        Writes(TEA.text), WordModel(), "Help.", propose="paper", remover=Speechless()
    )
    with pytest.raises(UnreadableAnswerError):
        manager.manage(found, [])
    assert found.belief is before


def test_a_round_keeps_the_order_and_the_page_shows_it_without_bars() -> None:
    agent = agent_in(LampRoom(), "no-inference", model=WordModel({**REPLIES, **RANKS}))
    round = agent.step("What now?", "lamp light please")
    again = round_from_json(round_to_json(round)).belief
    assert again.top() == round.belief.top()
    assert not again.inferred
    shown = RoundView.of(round)
    assert shown.belief is None
    assert shown.belief_note.startswith("The model's order of the goals: have lamp light; ")
