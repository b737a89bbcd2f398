"""No Inference (Sec. 4.3): the model's own order of the goals, which has no probabilities."""

from __future__ import annotations

import json

import pytest

from fakes import LampRoom, WordModel
from goalscope.base.types import UNSPECIFIED, Goal, Turn, UnreadableAnswerError
from goalscope.belief.goal_manager import GoalManager
from goalscope.belief.goal_order import Ranking
from goalscope.belief.ranker import Ranker
from goalscope.storage.round_json import round_from_json, round_to_json
from goalscope.web.views import RoundView
from lamps import RANKS, REPLIES, Speechless, Writes, agent_in

TEA, CAKE, SOUP = Goal("make tea"), Goal("bake a cake"), Goal("cook soup")
TURN = Turn("What?", "Hot water.")


def asked(most: int, least: int) -> WordModel:
    return WordModel({"the most likely": f'"{most}"', "the least likely": f'"{least}"'})


def test_the_likeliest_goal_is_first_the_least_likely_last_the_others_as_they_came() -> None:
    ranking = Ranking((UNSPECIFIED, TEA, CAKE, SOUP), most=CAKE, least=UNSPECIFIED)
    assert [goal for goal, _ in ranking.top()] == [CAKE, TEA, SOUP, UNSPECIFIED]
    assert [weight for _, weight in ranking.top()] == pytest.approx(
        [12 / 25, 6 / 25, 4 / 25, 3 / 25]
    )
    assert [goal for goal, _ in ranking.top(1)] == [CAKE]


@pytest.mark.parametrize(
    ("gone", "left"),
    [
        ([], [CAKE, UNSPECIFIED, SOUP, TEA]),
        ([CAKE], [UNSPECIFIED, SOUP, TEA]),
        ([TEA], [CAKE, UNSPECIFIED, SOUP]),
        ([Goal("unknown")], [CAKE, UNSPECIFIED, SOUP, TEA]),
    ],
)
def test_what_is_dropped_leaves_the_order_of_the_others(gone, left) -> None:
    ranking = Ranking((UNSPECIFIED, TEA, CAKE, SOUP), most=CAKE, least=TEA)
    assert [goal for goal, _ in ranking.drop(gone).top()] == left


def test_a_goal_named_as_both_is_the_likeliest() -> None:
    assert Ranking((TEA, CAKE), most=CAKE, least=CAKE).top(1)[0][0] == CAKE


def test_the_ranking_is_what_the_model_answers_and_each_turn_is_ranked_anew() -> None:
    ranker = Ranker(asked(2, 1), "Help.")
    ranker.belief = Ranking((UNSPECIFIED, TEA, CAKE))
    ranker.observe(TURN.query, TURN.utterance)
    first = ranker.belief
    assert (first.most, first.least) == (TEA, UNSPECIFIED)
    ranker.observe(TURN.query, TURN.utterance)
    assert ranker.belief == first
    assert len(ranker.turns) == 2


def test_goals_are_proposed_where_unspecified_is_the_likeliest_and_ranked_together() -> None:
    model = asked(1, 1)
    ranker = Ranker(model, "Help.")
    ranker.observe(TURN.query, TURN.utterance)
    model.replies |= {"the most likely": '"3"', "the least likely": '"1"'}
    manager = GoalManager(Writes(TEA.text, CAKE.text), WordModel(), "Help.", propose="paper")
    said = []
    changes, missing = manager.manage(ranker, [], progress=said.append)
    assert [change.goal for change in changes] == [TEA, CAKE]
    assert not missing
    assert [goal for goal, _ in ranker.belief.top()] == [CAKE, TEA, UNSPECIFIED]
    assert said == ["proposing goals", "checking goals"]
    assert manager.manage(ranker, [], progress=said.append)[0] == []


def test_a_failed_check_leaves_the_goals_as_they_were() -> None:
    ranker = Ranker(asked(1, 2), "Help.")
    ranker.observe(TURN.query, TURN.utterance)
    before = ranker.belief
    manager = GoalManager(
        Writes(TEA.text), WordModel(), "Help.", propose="paper", remover=Speechless()
    )
    with pytest.raises(UnreadableAnswerError):
        manager.manage(ranker, [], progress=lambda _: None)
    assert ranker.belief is before


def test_a_round_keeps_the_ranking_and_no_number_that_could_be_taken_for_evidence() -> None:
    agent = agent_in(LampRoom(), "no-inference", model=WordModel({**REPLIES, **RANKS}))
    round = agent.step("What now?", "lamp light please")
    assert isinstance(round.belief, Ranking)
    text = round_to_json(round)
    assert round_from_json(text).belief == round.belief
    assert json.loads(text)["belief"].keys() == {"goals", "most", "least"}


def test_the_page_shows_the_order_and_no_bars() -> None:
    agent = agent_in(LampRoom(), "no-inference", model=WordModel({**REPLIES, **RANKS}))
    shown = RoundView.of(agent.step("What now?", "lamp light please"))
    assert shown.belief is None
    assert shown.belief_note.startswith("The model's order of the goals: have lamp light; ")
