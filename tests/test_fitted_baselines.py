"""Methods that are fitted on dialogues: laws that hold for each, and what no test may leak."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fakes import said
from goalscope.base.types import Goal, InvalidInputError
from goalscope.datasets.case import Case
from goalscope.experiment.fitted_baselines import (
    FITTED_METHODS,
    Fitted,
    check_unseen,
    fit_baselines,
    neighbours,
    unigram,
)

pytest.importorskip("sklearn")
pytest.importorskip("scipy")

SAID = {
    "make coffee": ("I need some caffeine", "a hot mug of espresso", "something to wake me up"),
    "boil potato": ("put the spud in the pot", "dinner needs a hot vegetable", "heat up a tuber"),
    "water plant": ("the fern looks dry", "give the fern some rain", "my flower needs a drink"),
}
GOALS = tuple(map(Goal, SAID))


def case(number: int) -> Case:
    """A person of their own, who says two things that others with the goal say, too."""
    goal = number % len(GOALS)
    told = SAID[GOALS[goal].text]
    words = (told[number % 3], f"{told[number // 2 % 3]}, as number {number} says")
    return Case(f"c{number}", f"g{number}", "Help.", said(*words), GOALS, goal)


CASES = [case(number) for number in range(30)]
NEW = said("Is the fern dry?", "a spud, then")


@cache
def fitted(step: int = 1) -> dict[str, Fitted]:
    """Fitted on the cases in another order, if the step is not 1."""
    return fit_baselines([CASES[step * n % len(CASES)] for n in range(len(CASES))])


every = pytest.mark.parametrize("name", FITTED_METHODS)


@every
def test_probabilities_of_the_goals_sum_to_one_after_each_turn(name: str) -> None:
    found = fitted()[name](GOALS, NEW)
    assert found.shape == (2, 3)
    assert np.exp(found).sum(1) == pytest.approx(1)


@every
def test_what_people_said_with_a_goal_speaks_for_it(name: str) -> None:
    found = fitted()[name](GOALS, NEW)
    assert found[0].argmax() == 2
    assert fitted()[name](GOALS[::-1], NEW)[0].argmax() == 0


@every
def test_the_order_of_the_training_dialogues_does_not_count(name: str) -> None:
    again = fitted(7)[name]
    assert again.temperature == fitted()[name].temperature
    assert (again(GOALS, NEW) == fitted()[name](GOALS, NEW)).all()


@pytest.mark.parametrize("name", [name for name in FITTED_METHODS if name != "vectors fitted"])
def test_words_that_were_never_heard_speak_for_no_goal(name: str) -> None:
    """But for vectors, which know most words."""
    assert fitted()[name](GOALS, said("xyzzy plugh", "...")) == pytest.approx(-math.log(3))
    assert fitted()[name]([Goal("xyzzy"), Goal("plugh")], NEW) == pytest.approx(-math.log(2))


def test_a_word_of_the_goal_draws_the_words_that_were_said_with_it() -> None:
    cases = [
        Case("1", "1", "Help.", said("x x y"), (Goal("tea"), Goal("cake")), 0),
        Case("2", "2", "Help.", said("y"), (Goal("tea"), Goal("cake")), 1),
    ]
    rare = 1e-6
    score = unigram(cases, rare)
    found = score(["tea", "cake", "tea cake", "soup"], ["x", "y y", "z"])
    overall = {"x": 1 / 2, "y": 1 / 2}
    drawn = {"tea": {"x": 2 / 3, "y": 1 / 3}, "cake": {"x": 0, "y": 1}}

    def chance(word: str, *goal: str) -> float:
        own = sum(drawn[each][word] for each in goal) / len(goal)
        return math.log(rare * overall[word] + (1 - rare) * own)

    for text, (word, times) in enumerate((("x", 1), ("y", 2))):
        expected = [chance(word, *goal) for goal in (("tea",), ("cake",), ("tea", "cake"))]
        expected.append(math.log(overall[word]))
        assert found[text] == pytest.approx([times * each for each in expected], rel=1e-4)
    assert found[2].tolist() == [0, 0, 0, 0]


def test_neighbours_lend_their_goals() -> None:
    score = neighbours(CASES, 1)
    assert score(["boil potato", "make coffee"], ["the spud in the pot"]) == pytest.approx(
        np.array([[1, 0]])
    )


def test_a_dialogue_that_judges_cannot_be_fitted_on() -> None:
    other = replace(case(31), id="another", group="another", goals=GOALS[::-1])
    check_unseen([other], CASES)
    with pytest.raises(InvalidInputError, match=r"1 dialogue to be judged.*'another'"):
        check_unseen([replace(other, turns=CASES[4].turns)], CASES)


def test_what_nothing_can_be_fitted_on_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="all of these are in one group"):
        fit_baselines([replace(each, group="all") for each in CASES])
    with pytest.raises(InvalidInputError, match="have no words"):
        fit_baselines([replace(each, turns=said("...")) for each in CASES])
