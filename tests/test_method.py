"""A method of one's own holds a belief like any other."""

from pathlib import Path

import numpy as np
import pytest

from fakes import LampRoom, WordModel
from goalscope.agent.agent import Agent
from goalscope.base.types import UNSPECIFIED, Goal, InvalidInputError
from goalscope.belief.method import Implied, check_method
from goalscope.belief.tracker import GoalTracker
from lamps import REPLIES

METHODS = Path(__file__).parents[1] / "examples" / "methods.py"
TEA, CAKE, SOUP = map(Goal, ("make tea", "bake a cake", "cook soup"))
SAID = ("Put the kettle on.", "I would like tea.", "And a cake.")


class Shares:
    """Jointly: a goal has the share of its words that were said, among all goals'."""

    asked = 0

    def probabilities(self, task, goals, turns):
        self.asked += 1
        said = " ".join(turn.utterance for turn in turns).lower()
        hits = [1 + sum(word in said for word in goal.text.split()) for goal in goals]
        best = max(hits)
        shares = np.array([each + (3.0 if each == best else 0.0) for each in hits])
        return shares / shares.sum()


class Even:
    def probabilities(self, task, goals, turns):
        return np.full(len(goals), 1 / len(goals))


def following(method, goals=(TEA, CAKE)) -> GoalTracker:
    tracker = GoalTracker(likelihood=Implied(method), goals=goals)
    for words in SAID:
        tracker.observe("Yes?", words)
    return tracker


def right(tracker: GoalTracker) -> np.ndarray:
    return Shares().probabilities("", tracker.belief.goals, tracker.turns)


def test_the_posterior_after_each_turn_is_what_the_method_says() -> None:
    tracker = GoalTracker(likelihood=Implied(Shares()), goals=[TEA, CAKE])
    for words in SAID:
        tracker.observe("Yes?", words)
        np.testing.assert_allclose(tracker.belief.probability, right(tracker))


def test_a_late_goal_has_the_posterior_it_would_have_had_from_the_start() -> None:
    late = following(Shares())
    late.add([SOUP])
    early = following(Shares(), [TEA, CAKE, SOUP])
    np.testing.assert_allclose(late.belief.log_posteriors, early.belief.log_posteriors)
    np.testing.assert_allclose(late.belief.probability, right(late))


@pytest.mark.parametrize("out", ["drop", "veto"])
def test_a_belief_is_the_methods_after_a_goal_has_gone_and_at_the_next_turn(out) -> None:
    method = Shares()
    tracker = following(method, [TEA, CAKE, SOUP])
    if out == "drop":
        tracker.drop([SOUP])
    else:
        tracker.correct("veto", SOUP)
    for words in ("", "Make it hot."):
        if words:
            tracker.observe("And?", words)
        goals = tracker.belief.goals
        assert SOUP not in goals
        expected = method.probabilities(tracker.task, goals, tracker.turns)
        np.testing.assert_allclose(tracker.belief.probability, expected)


def test_a_probability_of_zero_can_rise_again() -> None:
    class Sure(Even):
        def probabilities(self, task, goals, turns):
            first = len(turns) % 2
            return np.array([float(i == first) for i in range(len(goals))])

    tracker = following(Sure(), [TEA])
    assert tracker.belief.probability.max() == pytest.approx(1)


def test_nothing_is_asked_twice() -> None:
    method = Shares()
    following(method)
    assert method.asked == len(SAID)


def test_an_agent_acts_on_its_belief_and_keeps_its_name() -> None:
    agent = Agent(LampRoom(), WordModel(REPLIES), method=Shares())
    round = agent.step("What now?", "lamp light please")
    assert round.belief.inferred
    expected = Shares().probabilities("", round.belief.goals, agent.turns)
    np.testing.assert_allclose(round.belief.probability, expected)


def test_the_laws_hold_for_a_method_that_keeps_them_and_what_it_does_not_claim_is_told() -> None:
    assert check_method(Even()) == []
    (note,) = check_method(Shares())
    assert note.startswith("It scores goals jointly")


class Unequal(Even):
    def probabilities(self, task, goals, turns):
        return np.full(len(goals), 0.9 / len(goals))


class Positional(Even):
    def probabilities(self, task, goals, turns):
        weights = np.arange(1.0, len(goals) + 1)
        return weights / weights.sum()


class Moody(Even):
    asked = 0

    def probabilities(self, task, goals, turns):
        self.asked += 1
        weights = np.array(
            [1.0 + (goal == TEA or "cake" in goal.text) * self.asked for goal in goals]
        )
        return weights / weights.sum()


@pytest.mark.parametrize(
    ("method", "why"),
    [
        (Unequal(), "sum is 0.9"),
        (Positional(), "whatever order"),
        (Moody(), "apart"),
        (Even, "it is a class"),
        (object(), "no method probabilities"),
    ],
)
def test_a_method_that_breaks_a_law_is_told_which(method, why: str) -> None:
    with pytest.raises(InvalidInputError, match=why):
        check_method(method)


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ([0.5, 0.5], r"array of \[3\]"),
        (["a", "b", "c"], "must return numbers"),
        ([1.5, -0.5, 0.0], "probabilities that sum to 1"),
        ([float("nan")] * 3, "probabilities that sum to 1"),
    ],
)
def test_what_is_no_distribution_is_refused(given, why: str) -> None:
    class Wrong(Even):
        def probabilities(self, task, goals, turns):
            return given

    with pytest.raises(InvalidInputError, match=why):
        following(Wrong())


def test_the_shipped_examples_keep_the_laws(own_methods) -> None:
    for name in ("Overlap", "Hypotheses"):
        check_method(getattr(own_methods, name)(WordModel()))


@pytest.fixture
def own_methods():
    import runpy
    from types import SimpleNamespace

    return SimpleNamespace(**runpy.run_path(str(METHODS)))


def test_asking_outright_keeps_them_with_the_embedded_model(own_methods, model) -> None:
    notes = check_method(own_methods.Outright(model), goals=(UNSPECIFIED, TEA, CAKE))
    assert all("jointly" in note for note in notes)
