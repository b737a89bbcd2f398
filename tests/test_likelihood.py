"""The role-play likelihood, against a model whose probabilities can be written down."""

import math
import re
from typing import Any

import numpy as np
import pytest

from fakes import WordModel
from goalscope.base.types import UNSPECIFIED, Goal, InvalidInputError, ModelError, Turn
from goalscope.belief.calibration import PAPER, Calibration
from goalscope.belief.goal_manager import irrelevant
from goalscope.belief.likelihood import GOAL_TOKENS, UNRELATED, RolePlay, likeness
from goalscope.belief.tracker import GoalTracker
from goalscope.models.embedding import embedded

CAKE, SOUP = Goal("bake cake"), Goal("cook soup")
TURNS = [Turn("What now?", "cake cake"), Turn("And then?", "soup")]
LAYOUTS = ("goal-first", "goal-last")


@pytest.mark.parametrize("layout", LAYOUTS)
def test_word_of_the_goal_gains_what_the_model_says(layout) -> None:
    (row,) = RolePlay(WordModel(), layout=layout).log_likelihood("t", [CAKE, SOUP], TURNS[:1])
    assert row[0] - row[1] == pytest.approx(2 * math.log(WordModel.boost))


@pytest.mark.parametrize("layout", LAYOUTS)
def test_rows_since_are_the_last_rows_of_the_table(layout) -> None:
    roleplay = RolePlay(WordModel(), layout=layout)
    whole = roleplay.log_likelihood("t", [CAKE, SOUP, UNSPECIFIED], TURNS)
    assert whole.shape == (2, 3)
    assert roleplay.log_likelihood("t", [CAKE, SOUP, UNSPECIFIED], TURNS, since=1) == (
        pytest.approx(whole[1:])
    )


def test_a_talk_is_as_like_a_goal_as_its_most_similar_turn() -> None:
    goals, said = [CAKE, UNSPECIFIED, SOUP], ["some cake", "yes", "bake me a cake", "cake", "soup!"]
    turns = [Turn("Yes?", words) for words in said]
    cosines = embedded(said) @ embedded([CAKE.text, SOUP.text]).T - UNRELATED
    sums = likeness(goals, turns).cumsum(0)
    assert sums[:, [0, 2]] == pytest.approx(np.maximum.accumulate(cosines), abs=1e-6)
    assert not sums[:, 1].any()
    plain, both = (
        RolePlay(WordModel(), similarity=each).log_likelihood("t", goals, turns, since=2)
        for each in (0.0, 5.0)
    )
    assert both - plain == pytest.approx(5 * likeness(goals, turns)[2:])


def test_normalising_over_goals_cancels() -> None:
    """Eq. 2 divides by a sum over goals; Eq. 1 gives the same posterior without it."""
    row = RolePlay(WordModel()).log_likelihood("t", [CAKE, SOUP], TURNS[:1])[0]
    divided = row - np.log(np.exp(row).sum())
    tracker = GoalTracker(WordModel(), task="t", goals=["bake cake", "cook soup"])
    plain = tracker.belief.drop([UNSPECIFIED])
    assert plain.observe(divided).probability == pytest.approx(plain.observe(row).probability)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_full_context_drops_old_turns_for_all_goals_alike(layout) -> None:
    model = WordModel(context_size=GOAL_TOKENS + 200)
    roleplay = RolePlay(model, layout=layout)
    turns = [Turn("what else", f"word{i} " * 20) for i in range(25)]
    assert 0 < roleplay.window("t", turns) < 25
    few = roleplay.log_likelihood("t", [CAKE], turns)
    many = roleplay.log_likelihood("t", [CAKE, Goal("a much longer goal " * 10)], turns)
    assert many[:, 0] == pytest.approx(few[:, 0])


def test_too_long_goal_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="goal"):
        RolePlay(WordModel()).log_likelihood("t", [Goal("x " * 300)], TURNS)


@pytest.mark.parametrize(
    ("query", "words", "task", "what"),
    [
        ("blah " * 1000, "cake", "t", "query is too long for the model (5,000"),
        ("Yes?", "blah " * 1000, "t", "utterance is too long for the model (4,999"),
        ("Yes?", "cake", "blah " * 1000, "task is too long for the model (4,999"),
    ],
)
def test_what_is_too_long_is_named_and_changes_nothing(
    query: str, words: str, task: str, what: str
) -> None:
    tracker = GoalTracker(WordModel(context_size=500), task=task, goals=["bake cake"])
    before = tracker.belief
    with pytest.raises(InvalidInputError, match=rf"{re.escape(what)}.*fewer words"):
        tracker.observe(query, words)
    assert tracker.belief is before
    assert tracker.turns == []


def test_a_broken_text_is_refused_and_changes_nothing() -> None:
    bad = "half \ud83c of"
    tracker = GoalTracker(WordModel(), goals=["bake cake"])
    belief = tracker.observe("", "cake")
    for change in (
        lambda: tracker.observe(bad, "cake"),
        lambda: tracker.observe("Yes?", bad),
        lambda: tracker.add([bad]),
        lambda: tracker.add([Goal(bad)]),
        lambda: tracker.drop([bad]),
        lambda: tracker.pin(bad),
        lambda: tracker.correct("pin", bad),
        lambda: tracker.correct("reword", "bake cake", bad),
        lambda: GoalTracker(WordModel(), goals=[bad]),
        lambda: GoalTracker(WordModel(), task=bad),
    ):
        with pytest.raises(InvalidInputError, match=r"text|broken"):
            change()
    assert tracker.belief is belief
    assert tracker.turns == [Turn("", "cake")]
    tracker.observe("And?", "cake")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"model": "qwen.gguf"}, r"open_model\(.*goals=\["),
        ({"model": WordModel}, r"open_model\("),
        ({"goals": "bake cake"}, "goals must be a list"),
        ({"likelihood": "goal-last"}, "likelihood"),
        ({"calibration": "papr"}, "Name paper, default, or a file"),
    ],
)
def test_wrong_arguments_of_a_tracker_are_refused(given: Any, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        GoalTracker(**{"model": WordModel(), **given})


def test_goals_that_mean_the_same_are_one() -> None:
    tracker = GoalTracker(WordModel(), goals=["bake cake"])
    belief = tracker.observe("Yes?", "soup")
    assert tracker.add([" BAKE cake!", "unspecified"]) is belief
    assert tracker.add(["Cook soup"]).goals == (UNSPECIFIED, CAKE, Goal("Cook soup"))
    assert tracker.drop(["COOK SOUP"]).goals == (UNSPECIFIED, CAKE)
    assert tracker.pin("Bake cake").pinned == ((1, CAKE),)
    other = GoalTracker(WordModel(), goals=["unspecified", "tea"], include_unspecified=False)
    assert other.belief.goals == (UNSPECIFIED, Goal("tea"))


@pytest.mark.parametrize(
    ("goals", "cause"),
    [
        ([], r"goals is empty. Name at least one, or leave goals out"),
        ((), "goals is empty"),
        (iter(()), "goals is empty"),
        (["a", "a"], "'a' stands twice among the goals. Leave one out."),
        ([CAKE, SOUP, CAKE], "'bake cake' stands twice"),
        (["bake cake", "soup", " Bake  cake."], "'Bake  cake.' is the same as 'bake cake'"),
        (["don't eat", "don\u2019t eat"], "is the same as"),
    ],
)
def test_no_goals_and_the_same_goal_twice_are_refused(goals, cause) -> None:
    with pytest.raises(InvalidInputError, match=cause):
        GoalTracker(WordModel(), goals=goals)


def test_a_tracker_can_begin_without_goals_and_get_them_later() -> None:
    tracker = GoalTracker(WordModel())
    assert tracker.observe("", "cake").goals == (UNSPECIFIED,)
    assert tracker.add([]) is tracker.belief
    before = tracker.belief
    for change in (tracker.add, tracker.drop):
        with pytest.raises(InvalidInputError, match="is the same as"):
            change(["tea", "Tea!"])
    assert tracker.belief is before


@pytest.mark.parametrize(
    ("gone", "cause"),
    [
        (["cook soup"], "no goal 'cook soup' to drop; known are bake cake"),
        ([" unspecified."], "stands for goals that are missing"),
        (["Bake cake", "wash"], "no goal 'wash'"),
    ],
)
def test_what_cannot_be_dropped_is_told_and_changes_nothing(gone, cause) -> None:
    tracker = GoalTracker(WordModel(), goals=["bake cake"])
    before = tracker.belief
    with pytest.raises(InvalidInputError, match=cause):
        tracker.drop(gone)
    assert tracker.belief is before


def test_a_tracker_shows_its_goals_and_the_number_of_turns() -> None:
    tracker = GoalTracker(WordModel(), task="Bake", goals=["bake cake"], calibration=PAPER)
    assert (
        repr(tracker)
        == "GoalTracker('Bake', Belief('Unspecified': 0.50, 'bake cake': 0.50; 0 turns))"
    )
    tracker.observe("Yes?", "cake")
    assert repr(tracker.belief).startswith("Belief('bake cake': 0.")
    assert repr(tracker.belief).endswith("; 1 turn)")
    assert len(repr(tracker.add(f"goal {n}" for n in range(100)))) < 200


def test_a_tracker_believes_as_its_likelihood_is_calibrated_unless_told_otherwise(
    monkeypatch,
) -> None:
    asked = []

    def known(scorer, layout):
        asked.append((scorer.name, layout))
        return Calibration(temperature=7.0), "known"

    monkeypatch.setattr("goalscope.belief.likelihood.known_calibration", known)
    roleplay = RolePlay(WordModel(), layout="goal-first")
    tracker = GoalTracker(likelihood=roleplay, goals=["bake cake", "cook soup"])
    assert tracker.observe("Yes?", "cake").calibration == Calibration(temperature=7.0)
    assert asked == [("words", "goal-first")]
    tracker.add(["wash"])
    tracker.drop(["wash"])
    assert tracker.belief.calibration == Calibration(temperature=7.0)
    told = GoalTracker(likelihood=roleplay, goals=["bake cake"], calibration=PAPER)
    assert told.add(["cook soup"]).calibration is PAPER


@pytest.mark.parametrize(
    ("returned", "cause"),
    [
        (lambda rows: [row.tolist() for row in rows], r"'cake cake' has \[-.*\(list\)"),
        (lambda rows: rows[:-1], "2 pairs have"),
        (lambda rows: [rows[0], rows[1][:1]], "'cake cake' has 2 after one chat and 1 after"),
        (lambda rows: [row * np.nan for row in rows], "nan.*no log-probabilities can be"),
        (lambda rows: [-row for row in rows], "no log-probabilities can be"),
    ],
)
def test_what_a_model_returns_wrongly_is_said(returned, cause: str) -> None:
    class Own(WordModel):
        def token_logprobs(self, *given, **more):
            return returned(super().token_logprobs(*given, **more))

    tracker = GoalTracker(Own(), goals=["bake cake"])
    with pytest.raises(ModelError, match=rf"(?s)model words must return a list.* But .*{cause}"):
        tracker.observe("", "cake cake")
    assert tracker.turns == []
    with pytest.raises(ModelError, match="model words must return a list"):
        irrelevant(Own(), "t", [CAKE])
