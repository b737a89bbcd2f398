"""Likelihoods, readers and verbs of a user's own keep the promises of the built-in ones."""

from __future__ import annotations

import numpy as np
import pytest

from fakes import LampRoom, WordModel
from goalscope.base.types import (
    UNSPECIFIED,
    Action,
    Goal,
    InvalidInputError,
    StepResult,
    UnreadableAnswerError,
)
from goalscope.belief.calibration import PAPER
from goalscope.belief.goal_manager import GoalManager
from goalscope.belief.likelihood import RolePlay
from goalscope.belief.tracker import GoalTracker
from goalscope.envs import Resolution
from goalscope.language.orders import Order, Reading
from lamps import Speechless, Writes, agent_in

TEA, CAKE = Goal("make tea"), Goal("bake a cake")


class Fixed:
    """Log-likelihoods from a function of the number of turns and goals."""

    calibration = PAPER

    def __init__(self, table) -> None:
        self.table = table

    def log_likelihood(self, task, goals, turns, *, since=0):
        return self.table(len(turns) - since, len(goals))


@pytest.mark.parametrize(
    ("table", "shape"),
    [
        (lambda turns, goals: np.zeros((turns + 1, goals)), r"\(2, 3\)"),
        (lambda turns, goals: np.zeros((goals, turns)), r"\(3, 1\)"),
        (lambda turns, goals: None, "NoneType"),
        (lambda turns, goals: [[0.0] * goals] * turns, "list"),
    ],
    ids=["all turns", "transposed", "nothing", "no array"],
)
def test_a_table_of_another_shape_is_refused_and_nothing_changes(table, shape: str) -> None:
    tracker = GoalTracker(goals=[TEA, CAKE], likelihood=Fixed(table))
    with pytest.raises(InvalidInputError, match=rf"must return an array of \[1, 3\].*not {shape}"):
        tracker.observe("What?", "Tea.")
    assert (tracker.turns, len(tracker.belief.log_likelihood)) == ([], 0)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_table_of_no_numbers_is_refused_with_the_goal_and_nothing_changes(value: float) -> None:
    def table(turns: int, goals: int):
        found = np.zeros((turns, goals))
        found[-1, 1] = value
        return found

    tracker = GoalTracker(goals=[TEA, CAKE], likelihood=Fixed(table))
    with pytest.raises(InvalidInputError, match=rf"not {value} for 'make tea'"):
        tracker.observe("What?", "Tea.")
    assert (tracker.turns, len(tracker.belief.log_likelihood)) == ([], 0)


def test_a_table_of_words_is_refused() -> None:
    tracker = GoalTracker(
        goals=[TEA], likelihood=Fixed(lambda turns, goals: np.full((turns, goals), "a"))
    )
    with pytest.raises(InvalidInputError, match="must return numbers in nats"):
        tracker.observe("What?", "Tea.")


def test_whole_numbers_and_the_impossible_are_evidence() -> None:
    likelihood = Fixed(lambda turns, goals: np.zeros((turns, goals), dtype=int))
    assert GoalTracker(goals=[TEA], likelihood=likelihood).observe("", "Tea.").top()
    likelihood = Fixed(lambda turns, goals: np.full((turns, goals), [0.0, 0.0, -np.inf]))
    belief = GoalTracker(goals=[TEA, CAKE], likelihood=likelihood).observe("", "Tea.")
    assert dict(belief.top())[CAKE] == 0


class Uncalibrated:
    def log_likelihood(self, task, goals, turns, *, since=0):
        raise AssertionError


class Named(Uncalibrated):
    calibration = "paper"


class Old:
    calibration = PAPER

    def log_likelihood(self, task):
        raise AssertionError


@pytest.mark.parametrize(
    ("likelihood", "why"),
    [
        (Old(), "is what it needs"),
        (Fixed, r"give an instance, Fixed\(...\)"),
        ("words", "no method log_likelihood"),
        (
            Uncalibrated(),
            "calibration of Uncalibrated must be a Calibration, such as PAPER, not None",
        ),
        (Named(), "not 'paper'"),
    ],
)
def test_what_is_no_likelihood_is_refused_with_the_reason(likelihood, why: str) -> None:
    with pytest.raises(InvalidInputError, match=why):
        GoalTracker(likelihood=likelihood)


def test_an_agent_believes_by_a_likelihood_of_ones_own() -> None:
    own = Fixed(lambda turns, goals: np.zeros((turns, goals)))
    agent = agent_in(LampRoom(["lamp"]), likelihood=own)
    agent.step("", "switch on lamp")
    agent.correct("pin", "read")
    assert agent.belief.log_likelihood.tolist() == [[0.0, 0.0]]


def test_trackers_without_a_model_share_one() -> None:
    one, two = GoalTracker(), GoalTracker()
    assert isinstance(one.likelihood, RolePlay)
    assert isinstance(two.likelihood, RolePlay)
    assert one.likelihood.model is two.likelihood.model


def test_goals_that_cannot_be_checked_are_not_added() -> None:
    tracker = GoalTracker(WordModel(), calibration=PAPER)
    tracker.observe("What?", "Read a book.")
    before = tracker.belief
    manager = GoalManager(Writes("read a book"), WordModel(), tracker.task, remover=Speechless())
    with pytest.raises(UnreadableAnswerError):
        manager.manage(tracker, [])
    assert tracker.belief is before


def test_pinning_again_changes_nothing() -> None:
    tracker = GoalTracker(WordModel(), goals=[TEA])
    assert [change.kind for change in tracker.correct("pin", TEA)] == ["pinned"]
    before = tracker.belief
    assert tracker.correct("pin", TEA) == []
    assert tracker.belief is before


@pytest.mark.parametrize("name", ["Unspecified", " unspecified."])
def test_a_tracker_without_unspecified_cannot_be_given_it(name: str) -> None:
    tracker = GoalTracker(WordModel(), goals=[TEA], include_unspecified=False)
    with pytest.raises(InvalidInputError, match="include_unspecified=True"):
        tracker.add([name])
    assert UNSPECIFIED not in tracker.belief.goals


def test_an_agent_that_resumes_no_rounds_starts_anew() -> None:
    agent = agent_in(LampRoom(["lamp"]))
    fresh = agent.belief
    agent.step("", "have lamp light")
    agent.correct("pin", "read")
    agent.resume([])
    assert (agent.rounds, agent.turns, agent.corrections, agent.belief) == ([], [], [], fresh)
    assert not agent.can_undo_correction


class Hammer(LampRoom):
    """Its verb that cannot be undone comes to an action of another name."""

    def resolve(self, order, dialogue, pick):
        if order.do == "smash":
            return Resolution((Action("destroy", order.what),))
        return super().resolve(order, dialogue, pick)

    def step(self, action):
        if action.name == "destroy":
            self.smashed.append(action.target)
            return StepResult(action, True, "Destroyed.", irreversible=True)
        return super().step(action)


def test_a_verb_that_cannot_be_undone_waits_whatever_its_actions_are_called() -> None:
    env = Hammer(["vase"])
    agent = agent_in(env)
    round = agent.step("", "smash vase")
    assert (env.smashed, round.pending) == ([], (Order("smash", "vase"),))
    agent.step(agent.ask(), "yes")
    assert env.smashed == ["vase"]


class Silent:
    """A reader that reads nothing, not even that."""

    def read(self, message, **_):
        return Reading(())


def test_a_reading_without_orders_is_no_yes() -> None:
    env = LampRoom(["lamp"])
    agent = agent_in(env, model=unsure(WordModel()))
    agent.step("", "switch on lamp")
    assert agent.rounds[-1].pending == (Order("switch on", "lamp"),)
    agent.reader = Silent()
    agent.step(agent.ask(), "hmm")
    assert env.on == []


def unsure(model: WordModel) -> WordModel:
    """The model, unsure of what it reads."""
    model.margins = (0.01,)
    return model


def test_a_reading_has_a_margin_for_each_order() -> None:
    with pytest.raises(InvalidInputError, match="2 orders needs as many margins"):
        Reading((Order("yes"), Order("aim")), None, (0.1,))
