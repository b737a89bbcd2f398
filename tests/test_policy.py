"""What to do about something, under the whole belief: act, hold back, or do nothing."""

from collections.abc import Sequence

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fakes import LampRoom, WordModel, said
from goalscope.agent import Agent
from goalscope.policy import OTHER_GOALS, Planner, Want, choose, weigh
from goalscope.standing import Standing

HELLO = said("hello")
LIKELY = 3.0
"""Nats."""


@st.composite
def beliefs(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, float]:
    goals, things = draw(st.integers(1, 5)), draw(st.integers(1, 4))
    weights = np.array(draw(st.lists(st.floats(0.01, 1), min_size=goals, max_size=goals)))
    nats = st.lists(st.floats(-9, 9, allow_subnormal=False), min_size=things, max_size=things)
    rows = np.array(draw(st.lists(nats, min_size=goals, max_size=goals)))
    return weights / weights.sum(), rows, draw(st.floats(0.01, 0.9))


@given(beliefs())
def test_the_choice_has_the_greatest_expected_value(case) -> None:
    probability, advantage, cost = case
    choice = choose(probability, advantage, cost)
    for thing, nats in enumerate(advantage.T):
        right = 1 / (1 + np.exp(-nats))
        value = right - (1 - right)
        known_first = sum(p * max(v, 0.0) for p, v in zip(probability, value, strict=True)) - cost
        ways = {"act": probability @ value, "ask": known_first, "wait": 0.0}
        chosen = "act" if choice.act[thing] else "ask" if choice.hold[thing] else "wait"
        assert not (choice.act[thing] and choice.hold[thing])
        assert ways[chosen] >= max(ways.values()) - 1e-9


@given(beliefs())
def test_one_who_is_sure_never_asks(case) -> None:
    _, advantage, cost = case
    choice = choose(np.ones(1), advantage[:1], cost)
    assert not choice.hold.any()
    assert (choice.act == (advantage[0] > 0)).all()


def test_good_for_one_goal_and_wrong_for_another_is_asked_about() -> None:
    advantage = np.array([[4.0, 4.0, 0.5], [-4.0, 4.0, -0.5]])
    choice = choose(np.array([0.6, 0.4]), advantage, 0.2)
    assert choice.hold.tolist() == [True, False, False]
    assert choice.act.tolist() == [False, True, True]


class Tabled(Planner):
    """Knows how likely a term is given a text; everything else is unlikely."""

    def __init__(self, likely: dict[str, tuple[str, ...]], never: dict[str, tuple[str, ...]]):
        super().__init__(WordModel())
        self.likely, self.never = likely, never

    def log_probability(self, texts: Sequence[str], goal: str, *_, **__) -> np.ndarray:
        known = self.likely.get(goal, ()), self.never.get(goal, ())
        return np.array([LIKELY * ((text in known[0]) - (text in known[1])) * 2 for text in texts])


def test_what_is_wrong_for_a_likely_goal_waits_until_the_belief_is_clear() -> None:
    planner = Tabled({"read": ("lamp",)}, {"sleep": ("lamp",)})
    room = LampRoom(["lamp"])
    unsure = planner.act(
        room, [Want("read", 0.55), Want("sleep", 0.45)], said("hello"), [], Standing()
    )
    assert (unsure.results, unsure.held, room.on) == ((), ("lamp",), [])
    sure = planner.act(
        room, [Want("read", 0.97), Want("sleep", 0.03)], said("hello"), [], Standing()
    )
    assert (sure.held, room.on) == ((), ["lamp"])


def test_what_is_held_back_could_be_done_and_takes_no_place_of_what_is_done() -> None:
    room = LampRoom(["candle", "lamp", "torch"])
    planner = Tabled({"read": ("candle", "lamp", "torch")}, {"sleep": ("candle", "lamp")})
    planner.limit = 1
    wants = [Want("read", 0.55), Want("sleep", 0.45)]
    terms, unsure = planner.search_terms(room, wants, ["hello"])
    assert (terms, unsure) == (["torch"], ["candle"])
    room.actions = lambda name, standing: []
    assert planner.act(room, wants, HELLO, [], Standing()).held == ()


def test_what_is_held_back_is_told_when_all_plans_fail_too() -> None:
    room = LampRoom(["lamp", "broken"])
    planner = Tabled({"read": ("lamp", "broken"), "sleep": ("broken",)}, {"sleep": ("lamp",)})
    planner.replans = 0
    outcome = planner.act(
        room, [Want("read", 0.55), Want("sleep", 0.45)], said("hello"), [], Standing()
    )
    assert (outcome.results, outcome.held) == ((), ("lamp",))


def test_the_person_is_told_what_is_held_back() -> None:
    planner = Tabled({"read": ("lamp",)}, {"sleep": ("lamp",)})
    agent = Agent(LampRoom(), WordModel(), planner=planner)
    agent.correct("pin", "read")
    assert agent.tracker is not None
    agent._wants = lambda turns: [Want("read", 0.55), Want("sleep", 0.45)]
    round = agent.step("What?", "more light")
    assert "Held back until it is clear what you want: lamp." in round.notes


def test_what_serves_all_likely_goals_is_done_at_once() -> None:
    planner = Tabled({"read": ("lamp",), "write": ("lamp",)}, {})
    room = LampRoom(["lamp"])
    outcome = planner.act(
        room, [Want("read", 0.5), Want("write", 0.5)], said("hello"), [], Standing()
    )
    assert (outcome.held, room.on) == ((), ["lamp"])


def test_goals_that_are_not_known_speak_by_the_persons_words_alone() -> None:
    scores = {"read": 2.0, "words": 1.0, **dict.fromkeys(OTHER_GOALS, 0.5)}
    probability, gains, without = weigh(
        [Want("read", 0.75)], "words", lambda text: np.array([scores[text]])
    )
    np.testing.assert_allclose(probability, [0.75, 0.25])
    np.testing.assert_allclose(gains, [[1.0], [0.25]])
    np.testing.assert_allclose(without, [0.5])
