"""What a person says of the goals themselves: confirmed, ruled out, in other words."""

import copy
import pickle
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes import LampRoom, WordModel
from goalscope.agent.agent import Agent
from goalscope.base.types import UNSPECIFIED, Goal, GoalChange, InvalidInputError
from goalscope.belief.advice import advice
from goalscope.belief.belief import PINNED, Belief
from goalscope.belief.calibration import DEFAULT, PAPER
from goalscope.belief.likelihood import RolePlay
from goalscope.belief.tracker import GoalTracker
from goalscope.storage.store import round_from_json, round_to_json
from lamps import RANKS, REPLIES

A, B, C = (Goal(each) for each in "abc")
LAMP, SLEEP, TEA = Goal("have lamp light"), Goal("sleep without light"), Goal("drink tea")

nats = st.lists(st.floats(-200, 0), min_size=4, max_size=4)
tables = st.lists(nats, max_size=4)
calibrations = st.sampled_from([PAPER, DEFAULT, replace(DEFAULT, switching=0.3)])


def belief_of(table, calibration=PAPER) -> Belief:
    rows = np.array(table, dtype=np.float64).reshape(-1, 4)
    return replace(Belief.uniform([UNSPECIFIED, A, B, C], calibration), log_likelihood=rows)


def p(belief: Belief, goal: Goal) -> float:
    return dict(belief.top())[goal]


@given(tables, calibrations, st.sampled_from([A, B, C]))
def test_a_confirmed_goal_is_all_but_sure_and_the_others_share_the_rest(
    table, calibration, goal
) -> None:
    before = belief_of(table, calibration)
    after = before.pin(goal)
    assert p(after, goal) == pytest.approx(max(PINNED, p(before, goal)), abs=1e-12)
    assert after.probability.sum() == pytest.approx(1)
    (place,) = (i for i, each in enumerate(before.goals) if each == goal)
    one, other = (np.delete(each.log_posterior, place) for each in (before, after))
    if p(after, goal) < 1 - 1e-9:
        assert np.diff(other) == pytest.approx(np.diff(one), abs=1e-6)
    assert before.pinned == ()


def test_what_was_ruled_out_comes_back_only_by_name() -> None:
    tracker = GoalTracker(WordModel(), goals=["bake a cake", "grow roses"])
    assert tracker.correct("veto", "grow roses")
    before = tracker.belief
    assert tracker.correct("veto", "Grow roses!") == []
    for goals in (["Grow roses."], [Goal("make tea"), Goal("grow  roses")]):
        with pytest.raises(InvalidInputError, match="was ruled out"):
            tracker.add(goals)
    assert tracker.belief is before
    tracker.correct("reword", "bake a cake", "Grow roses")
    assert tracker.belief.top(1)[0][0] == Goal("Grow roses")
    assert tracker.belief.ruled_out == (Goal("bake a cake"),)


@given(tables, nats)
def test_later_words_count_from_there(table, row) -> None:
    pinned = belief_of(table).pin(B)
    after = pinned.observe(row)
    moved = after.log_posterior - pinned.log_posterior
    odds = np.array(row)
    assert moved - moved[0] == pytest.approx(odds - odds[0], abs=1e-6)
    assert (after.log_posteriors[:-1] == pinned.log_posteriors).all()
    assert (pinned.log_posteriors[:-1] == belief_of(table).log_posteriors[:-1]).all()


@given(st.lists(nats, min_size=1, max_size=4), st.integers(0, 3))
def test_words_that_are_left_out_count_as_words_that_say_nothing(table, turn) -> None:
    turn %= len(table)
    pin = len(table) // 2
    less = replace(belief_of(table), pinned=((pin, B),)).without(turn)
    expected = belief_of([])
    for when in range(len(table)):
        expected = expected.pin(B) if when == pin else expected
        expected = expected.observe([0.0] * 4 if when == turn else table[when])
    assert less.pinned == expected.pinned
    assert less.probability == pytest.approx(expected.probability, abs=1e-9)


@given(st.integers(0, 15))
def test_what_was_confirmed_is_not_forgotten(turns) -> None:
    belief = replace(belief_of([[-1.0, -9.0, -2.0, -5.0]]), calibration=DEFAULT).pin(B)
    for _ in range(turns):
        belief = belief.observe([-3.0] * 4)
    assert belief.probability[belief.goals.index(B)] >= PINNED - 1e-9


def test_a_tracker_takes_a_goal_that_is_new_with_all_that_was_said() -> None:
    tracker = GoalTracker(WordModel(), goals=["bake cake"], calibration=PAPER)
    tracker.observe("Yes?", "soup soup")
    early = GoalTracker(WordModel(), goals=["bake cake", "cook soup"], calibration=PAPER)
    belief = tracker.pin("cook soup")
    assert belief is tracker.belief
    assert belief.pinned == ((1, Goal("cook soup")),)
    assert p(belief, Goal("cook soup")) >= PINNED
    assert belief.log_likelihood == pytest.approx(early.observe("Yes?", "soup soup").log_likelihood)
    assert tracker.pin(Goal("bake cake")).goals == belief.goals
    with pytest.raises(InvalidInputError, match="empty"):
        tracker.pin(" ")


def begun(model=None, **options) -> Agent:
    """An agent that knows of light and of sleep."""
    agent = Agent(LampRoom(), model or WordModel(REPLIES), **options)
    agent.step("What?", "lamp light please")
    return agent


@pytest.mark.parametrize(("goal", "new"), [(SLEEP, False), (TEA, True), ("drink tea", True)])
def test_a_confirmed_goal_stands_and_the_next_round_tells_of_it(goal, new) -> None:
    agent = begun()
    belief = agent.correct("pin", goal)
    named = TEA if new else SLEEP
    assert belief is agent.belief
    assert p(belief, named) >= PINNED
    round = agent.step("And?", "light please")
    told = [GoalChange("added", TEA, "you named it", source="person")] * new
    told += [GoalChange("pinned", named, "you confirmed it")]
    assert list(round.changes[: len(told)]) == told
    assert round.belief.pinned == ((1, named),)
    assert "pinned" not in [change.kind for change in agent.step("?", "light").changes]


def test_a_goal_that_is_ruled_out_is_gone_and_never_proposed_again() -> None:
    agent = begun()
    assert agent.correct("veto", LAMP).goals == (UNSPECIFIED, SLEEP)
    rounds = [agent.step("And?", "have lamp light"), agent.step("And?", "have lamp light")]
    assert rounds[0].changes[0] == GoalChange("removed", LAMP, "you ruled it out", final=True)
    other = Agent(LampRoom(), WordModel(REPLIES))
    other.resume([round_from_json(round_to_json(round)) for round in agent.rounds])
    rounds.append(other.step("And?", "have lamp light"))
    for round in rounds:
        assert LAMP not in round.belief.goals
        assert not [c for c in round.changes if c.kind == "added"]
    assert p(agent.correct("pin", LAMP), LAMP) >= PINNED  # unless the person says so


def test_a_goal_in_other_words_takes_the_place_of_the_old_ones() -> None:
    agent = begun()
    belief = agent.correct("reword", SLEEP, " drink tea ")
    assert belief.goals == (UNSPECIFIED, LAMP, TEA)
    assert p(belief, TEA) >= PINNED
    added, pinned, removed = agent.step("And?", "light please").changes[:3]
    assert [(c.kind, c.goal) for c in (added, pinned)] == [("added", TEA), ("pinned", TEA)]
    assert removed == GoalChange("removed", SLEEP, "you said it in other words", final=True)


def test_a_goal_in_the_words_of_another_or_its_own_is_that_one() -> None:
    agent = begun()
    assert agent.correct("reword", SLEEP, SLEEP.text).goals == (UNSPECIFIED, LAMP, SLEEP)
    belief = agent.correct("reword", SLEEP, LAMP.text)
    assert belief.goals == (UNSPECIFIED, LAMP)
    assert belief.pinned == ((1, LAMP),)
    kinds = [change.kind for change in agent.step("And?", "light").changes]
    assert kinds[:3] == ["pinned", "pinned", "removed"]
    assert "added" not in kinds


@pytest.mark.parametrize(
    ("correction", "goal", "text", "cause"),
    [
        ("pin", UNSPECIFIED, "", "no goal 'Unspecified'"),
        ("veto", UNSPECIFIED, "", "no goal 'Unspecified'"),
        ("reword", UNSPECIFIED, "tea", "no goal 'Unspecified'"),
        ("veto", TEA, "", "no goal 'drink tea'"),
        ("reword", TEA, "tea", "no goal 'drink tea'"),
        ("reword", SLEEP, " ", "empty"),
        ("reword", SLEEP, "Unspecified", "There is no goal"),
        ("reword", SLEEP, "\ud83c", "surrogate"),
        ("reword", SLEEP, "word " * 300, "fewer words"),
        ("pin", "", "", "empty"),
        ("pin", " unspecified.", "", "nspecified"),
        ("praise", SLEEP, "", '"pin", "veto" or "reword"'),
    ],
)
def test_what_cannot_be_done_changes_nothing(correction, goal, text, cause) -> None:
    agent = begun()
    before = agent.belief
    with pytest.raises(InvalidInputError, match=cause):
        agent.correct(correction, goal, text)
    assert agent.belief is before
    assert agent.step("And?", "lamp").changes == begun().step("And?", "lamp").changes


@pytest.mark.parametrize("method", ["no-goals", "no-inference"])
def test_a_method_without_probabilities_has_nothing_to_correct(method) -> None:
    model = WordModel({**REPLIES, **RANKS})
    with pytest.raises(InvalidInputError, match="no belief that could be corrected"):
        begun(model, method=method).correct("pin", LAMP)


def test_a_round_that_fails_changes_nothing_and_loses_no_correction() -> None:
    agent = begun()
    agent.correct("veto", LAMP)
    belief = agent.correct("pin", SLEEP)
    before = agent.env.state().text
    with pytest.raises(InvalidInputError):
        agent.step("And?", "word " * 5000)
    assert agent.belief is belief
    assert (agent.env.state().text, len(agent.rounds)) == (before, 1)
    found = [(c.kind, c.goal) for c in agent.step("And?", "please").changes]
    assert found[:2] == [("removed", LAMP), ("pinned", SLEEP)]


class Condemns(WordModel):
    """Finds goals of tea unsafe, and the task a hindrance to those that help."""

    def token_logprobs(self, contexts, continuations):
        rows = super().token_logprobs(contexts, continuations)
        return [
            0 * row if "criminal" in context[0].content and "tea" in text else row
            for context, text, row in zip(contexts, continuations, rows, strict=True)
        ]


@pytest.mark.parametrize("between", [0, 1, 3])
@pytest.mark.parametrize("goals", ["ab", "aba", "abcb"])
def test_the_newest_confirmation_takes_the_place_of_those_before(between, goals) -> None:
    tracker = GoalTracker(WordModel(), goals=["a", "b", "c"])
    for goal in goals:
        tracker.pin(goal)
        for _ in range(between):
            tracker.observe("And?", "well")
    assert [goal.text for _, goal in tracker.belief.pinned] == [goals[-1]]
    alone = GoalTracker(WordModel(), goals=["a", "b", "c"])
    for number, goal in enumerate(goals, 1):
        if number == len(goals):
            alone.pin(goal)
        for _ in range(between):
            alone.observe("And?", "well")
    assert tracker.belief.probability == pytest.approx(alone.belief.probability)
    assert GoalTracker.from_json(tracker.to_json(), WordModel()).belief.pinned == (
        tracker.belief.pinned
    )


def test_a_goal_that_was_confirmed_before_another_is_not_acted_on_once_that_is_ruled_out() -> None:
    tracker = GoalTracker(WordModel(), goals=["cook Italian food", "cook Chinese food"])
    tracker.pin("cook Italian food")
    tracker.pin("cook Chinese food")
    assert advice(tracker) == "act"
    tracker.veto("cook Chinese food")
    assert (advice(tracker), tracker.belief.pinned) == ("ask", ())


def test_a_veto_is_a_correction() -> None:
    one, other = (GoalTracker(WordModel(), goals=["make tea", "eat", "read"]) for _ in range(2))
    assert one.veto("Eat.") is one.belief
    assert one.pin("make tea") is one.belief
    for told in (("veto", "eat"), ("pin", "make tea")):
        other.correct(*told)
    assert one.to_json() == other.to_json()
    with pytest.raises(InvalidInputError, match="no goal 'dance' to correct; known are"):
        one.veto("dance")


def test_a_confirmed_goal_may_seem_irrelevant_but_not_be_unsafe() -> None:
    helps = Goal("helps")
    for confirmed in ((), (helps,), (TEA,)):
        agent = begun(Condemns(REPLIES))
        assert agent.tracker is not None
        agent.tracker.add([helps][: confirmed != (TEA,)])
        for goal in confirmed:
            agent.correct("pin", goal)
        round = agent.step("And?", "light please")
        assert (helps in agent.belief.goals) == (confirmed == (helps,))
    assert TEA not in agent.belief.goals
    (removed,) = (change for change in round.changes if change.kind == "removed")
    assert (removed.goal, removed.final) == (TEA, True)
    assert "unsafe" in removed.reason


def test_a_tracker_that_was_saved_is_the_same_again() -> None:
    tracker = GoalTracker(
        WordModel(), task="Help.", goals=["bake a cake", "eat"], calibration=DEFAULT
    )
    tracker.observe("Yes?", "I bake a cake \N{BIRTHDAY CAKE}.")
    tracker.pin("make tea")
    tracker.correct("veto", "eat")
    tracker.observe("", "No, soup.")
    model = WordModel()
    again = GoalTracker.from_json(tracker.to_json(), model)
    assert model.calls == 0
    assert (again.task, again.turns) == (tracker.task, tracker.turns)
    for field in fields(Belief):
        one, other = (getattr(each.belief, field.name) for each in (tracker, again))
        assert np.array_equal(one, other) if isinstance(one, np.ndarray) else one == other
    later = [each.observe("", "A cake.").probability for each in (tracker, again)]
    assert np.array_equal(*later)


class OneModel:
    """A model of one's own: what the protocol asks for, and no name."""

    context_size = 4096
    count_tokens = WordModel.count_tokens

    def token_logprobs(self, contexts, continuations):
        return WordModel().token_logprobs(contexts, continuations)


@pytest.mark.parametrize(("own", "other"), [(WordModel, OneModel), (OneModel, WordModel)])
def test_a_saved_tracker_belongs_to_its_model(own, other) -> None:
    tracker = GoalTracker(own(), task="Help.", goals=["eat"])
    tracker.observe("", "cake")
    for how in ({"model": own()}, {"likelihood": RolePlay(own())}):
        assert GoalTracker.from_json(tracker.to_json(), **how).turns == tracker.turns
    for how in ({"model": other()}, {"likelihood": RolePlay(other())}):
        with pytest.raises(InvalidInputError, match=r"saved with the model .* Give the one"):
            GoalTracker.from_json(tracker.to_json(), **how)


SAVED = {
    "cut": lambda text: text[:-1],
    "a task that is no text": lambda text: text.replace('"task": "Help."', '"task": 5'),
    "another turn": lambda text: text.replace('"turns": [', '"turns": [["And?", "more"], '),
    "a turn without words": lambda text: text.replace('["Yes?", "cake"]', '["Yes?", ""]'),
    "a prior of text": lambda text: text.replace('"log_prior": [0.0, ', '"log_prior": ["NaN", '),
}


@pytest.mark.parametrize("kind", SAVED)
def test_what_is_no_saved_tracker_is_refused(kind: str) -> None:
    tracker = GoalTracker(WordModel(), task="Help.", goals=["eat"])
    tracker.observe("Yes?", "cake")
    text = tracker.to_json()
    broken = SAVED[kind](text)
    assert broken != text
    with pytest.raises(InvalidInputError):
        GoalTracker.from_json(broken, WordModel())


def test_threads_that_share_a_tracker_lose_no_turn() -> None:
    class Slow(WordModel):
        def token_logprobs(self, *args, **kwargs):
            time.sleep(0.002)
            return super().token_logprobs(*args, **kwargs)

    tracker = GoalTracker(Slow(), goals=["bake cake", "cook soup"])

    def talk(number: int) -> None:
        tracker.observe("What?", f"cake {number}")
        tracker.add([f"bake cake {number}"])

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(talk, range(24)))
    assert sorted(turn.utterance for turn in tracker.turns) == sorted(
        f"cake {number}" for number in range(24)
    )
    assert tracker.belief.log_likelihood.shape == (24, len(tracker.belief.goals)) == (24, 27)
    assert GoalTracker.from_json(tracker.to_json(), WordModel()).turns == tracker.turns


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda t: pickle.loads(pickle.dumps(t))]
)
def test_a_copy_of_a_tracker_goes_its_own_way(copied) -> None:
    tracker = GoalTracker(WordModel(), goals=["bake cake", "cook soup"])
    tracker.observe("What?", "cake")
    other = copied(tracker)
    other.observe("What?", "soup, soup")
    assert len(tracker.turns) == 1
    assert len(other.turns) == 2
    assert other.belief.top(1)[0][0] == Goal("cook soup")
