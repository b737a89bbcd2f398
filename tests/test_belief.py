"""Laws of the belief: what Bayes' rule promises, whatever the numbers."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from goalscope.base.types import UNSPECIFIED, Goal, InvalidInputError
from goalscope.belief.belief import Belief

nats = st.one_of(st.floats(-1e6, 0), st.just(-math.inf))
finite = st.floats(-1e4, 0)


def goals(n: int) -> list[Goal]:
    return [Goal(f"goal {i}") for i in range(n)]


@st.composite
def beliefs(draw: st.DrawFn, values: st.SearchStrategy[float] = nats) -> Belief:
    g = draw(st.integers(1, 6))
    t = draw(st.integers(0, 5))
    row = st.lists(values, min_size=g, max_size=g)
    belief = Belief(tuple(goals(g)), np.array(draw(row)), np.zeros((0, g)))
    for _ in range(t):
        belief = belief.observe(draw(row))
    return belief


@given(beliefs(finite), st.integers(0, 5))
def test_drop_is_conditioning(belief: Belief, which: int) -> None:
    gone = belief.goals[which % len(belief.goals)]
    rest = belief.drop([gone])
    assert gone not in rest.goals
    p = np.array([belief.probability[belief.goals.index(goal)] for goal in rest.goals])
    if p.sum() > 1e-9:
        assert rest.probability == pytest.approx(p / p.sum(), abs=1e-6)


@pytest.mark.parametrize("k", [0, -1])
def test_the_likeliest_none_are_refused(k: int) -> None:
    with pytest.raises(InvalidInputError, match="k must be a whole number, 1 or more"):
        Belief.uniform([UNSPECIFIED]).top(k)


@pytest.mark.parametrize("weights", [((2, 0.5),), ((0, 0.5), (0, 0.1)), ((1, 1.5),)])
def test_weights_are_one_from_0_to_1_of_turns_that_there_are(weights) -> None:
    belief = Belief.uniform(goals(2)).observe([0.0, -1.0]).observe([-1.0, 0.0])
    with pytest.raises(ValueError, match="weights must be one from 0 to 1"):
        replace(belief, weights=weights)


def test_a_goal_that_is_not_there_cannot_be_pinned() -> None:
    with pytest.raises(ValueError, match="'bake a cake', pinned after 0 turns"):
        Belief.uniform([UNSPECIFIED]).pin(Goal("bake a cake"))


def test_the_first_goal_of_a_belief_has_all_of_it() -> None:
    belief = Belief.uniform([]).add([Goal("a")], lambda new: np.zeros((0, len(new))))
    assert (belief.log_prior.tolist(), belief.probability.tolist()) == ([0.0], [1.0])


def test_impossible_everywhere_is_a_state_and_no_nan() -> None:
    belief = Belief.uniform(goals(3)).observe([-math.inf] * 3)
    assert belief.is_degenerate
    assert belief.probability.tolist() == [0, 0, 0]
    assert belief.entropy == 0


@pytest.mark.parametrize(
    ("row", "cause"),
    [
        ([0.0, math.nan], r"NaN or \+inf"),
        ([0.0, math.inf], r"NaN or \+inf"),
        ([0.0], "expected 2"),
    ],
)
def test_broken_numbers_and_a_wrong_shape_are_refused(row: list[float], cause: str) -> None:
    with pytest.raises(ValueError, match=cause):
        Belief.uniform(goals(2)).observe(row)
