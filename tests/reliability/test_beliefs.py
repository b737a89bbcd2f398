"""What a belief must stand: broken words, failing models, copies of goals, hostile models."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes import GOALS, NEEDS, QUESTION, LampRoom, WordModel
from goalscope.agent.agent import Agent
from goalscope.base.types import (
    UNSPECIFIED,
    Goal,
    InvalidInputError,
    Message,
    ModelError,
    canonical,
)
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import DEFAULT, PAPER
from goalscope.belief.tracker import GoalTracker
from goalscope.models import Completion
from goalscope.models.opening import open_model
from goalscope.models.scoring import TokenScorer
from goalscope.storage.store import round_from_json, round_to_json

REPLIES = {
    GOALS: "have lamp light\nsleep without light\nread a book",
    NEEDS: "needed: lamp, book",
    QUESTION: "Is it bright enough?",
}
SAID = ["lamp light please", "it is dark here", "a book to read", "no, sleep", "without light"]


# Words that say nothing

BLANK = st.text(st.characters(categories=["Zs", "Zl", "Zp", "Cc", "Cf"]), max_size=20)
BROKEN = st.tuples(st.text(max_size=9), st.characters(categories=["Cs"]), st.text(max_size=9))


@given(BLANK | BROKEN.map("".join))
def test_words_that_say_nothing_or_are_broken_are_refused_and_change_nothing(said: str) -> None:
    tracker = GoalTracker(WordModel(), goals=["bake a cake"])
    agent = Agent(LampRoom(), WordModel(REPLIES))
    before, believed = tracker.observe("Yes?", "a cake"), agent.step("Yes?", SAID[0]).belief
    with pytest.raises(InvalidInputError):
        tracker.observe("And?", said)
    with pytest.raises(InvalidInputError):
        agent.step("And?", said)
    assert tracker.belief is before
    assert agent.tracker is not None
    assert agent.tracker.belief is believed
    assert (len(tracker.turns), len(agent.rounds)) == (1, 1)


# Words that are many


class Narrow(WordModel):
    """Refuses what does not fit, as models do, and keeps what it was asked to write."""

    def __init__(self) -> None:
        super().__init__({**REPLIES, "the most likely": '"2"', "the least likely": '"1"'}, 960)
        self.prompts: list[str] = []

    def token_logprobs(self, contexts, continuations):
        for context, text in zip(contexts, continuations, strict=True):
            assert self.count_tokens([*context, Message("assistant", text)]) <= self.context_size
        return super().token_logprobs(contexts, continuations)

    def generate(self, messages: Sequence[Message], **settings: Any) -> Completion:
        room = settings.get("max_tokens", 256)
        assert self.count_tokens(messages) + room <= self.context_size
        self.prompts.append(" ".join(message.content for message in messages))
        return super().generate(messages, **settings)


@pytest.mark.parametrize("method", ["good", "no-goals", "no-inference"])
def test_in_long_episodes_every_prompt_fits_and_has_the_newest_words(method: Any, figure) -> None:
    model, random, shown = Narrow(), np.random.default_rng(0), 0
    agent = Agent(LampRoom(), model, method=method)
    for number in range(25):
        model.prompts.clear()
        agent.step(
            "What else?", f"word{number} lamp light " + "and more " * random.integers(10, 200)
        )
        agent.ask()
        for prompt in model.prompts:
            words = re.findall(r"word\d+", prompt)
            assert not words or f"word{number}" in words
            shown += bool(words)
    figure(f"{shown} prompts with the dialogue: all with its newest words")
    assert shown > 25


# No evidence counts twice


class Falters(WordModel):
    """Breaks off at one of its calls."""

    fails_at = 0

    def token_logprobs(self, contexts, continuations):
        self._count()
        return super().token_logprobs(contexts, continuations)

    def generate(self, messages: Sequence[Message], **settings: Any) -> Completion:
        self._count()
        return super().generate(messages, **settings)

    def _count(self) -> None:
        self.fails_at -= 1
        if self.fails_at == 0:
            raise ModelError("The server is gone.")


def test_no_words_count_twice_whatever_fails_and_is_resumed(figure) -> None:
    smooth = Agent(LampRoom(["lamp", "book"]), WordModel(REPLIES))
    expected = [smooth.step("And?", said).belief for said in SAID]
    model, rounds, failures, apart = Falters(REPLIES), [], 0, 0.0
    for number, said in enumerate(SAID):
        for call in range(1, 100):
            agent = Agent(LampRoom(["lamp", "book"]), model)
            model.fails_at = 0
            agent.resume([round_from_json(round_to_json(round)) for round in rounds])
            model.fails_at = call
            try:
                agent.step("And?", said)
                break
            except ModelError:
                failures += 1
                assert len(agent.rounds) == number
                model.fails_at = 0
                agent.step("And?", said)  # the same agent tries again
                assert agent.tracker is not None
                again = agent.tracker.belief
                agent.tracker.add(again.goals)  # a second update in the round
                agent.tracker.add([goal.text for goal in again.goals if goal != UNSPECIFIED])
                assert agent.tracker.belief is again
                apart = max(apart, difference(again, expected[number]))
        rounds = agent.rounds
        apart = max(apart, difference(agent.rounds[-1].belief, expected[number]))
    figure(
        f"{len(SAID)} rounds, {failures} failed calls, each tried again; "
        f"resumed before each: log-posteriors at most {apart:.0e} apart",
    )
    assert failures > 5 * len(SAID)
    assert apart <= 1e-12


def difference(one: Belief | None, other: Belief | None) -> float:
    assert one is not None
    assert other is not None
    assert one.goals == other.goals
    return float(np.abs(one.log_posterior - other.log_posterior).max())


# Copies of goals

tables = st.lists(st.lists(st.floats(-60, 0), min_size=5, max_size=5), min_size=1, max_size=6)
FIVE = [UNSPECIFIED, *(Goal(f"goal {n}") for n in range(4))]


@given(tables, st.sampled_from(FIVE[1:]), st.sampled_from([PAPER, DEFAULT]))
def test_a_copy_of_a_goal_is_that_goal(table, goal: Goal, calibration) -> None:
    belief = Belief(tuple(FIVE), np.zeros(5), np.array(table), calibration)
    assert belief.add([goal, goal], lambda new: pytest.fail("a copy was scored")) is belief
    new = Goal("new")
    assert belief.add([new, new], lambda _: belief.log_likelihood[:, :1]).goals == (*FIVE, new)
    merged = Belief.uniform([*FIVE, goal, *FIVE], calibration)
    assert merged.goals == belief.goals
    tracker = GoalTracker(WordModel(), goals=FIVE[1:])
    assert tracker.add([goal.text]).goals == belief.goals
    with pytest.raises(InvalidInputError, match="stands twice"):
        GoalTracker(WordModel(), goals=[*FIVE[1:], goal])


@given(tables, st.integers(1, 4))
def test_another_wording_of_a_goal_leaves_the_odds_of_the_others(table, which: int) -> None:
    belief = Belief(tuple(FIVE), np.zeros(5), np.array(table), PAPER)
    wider = belief.add([Goal("other words")], lambda new: belief.log_likelihood[:, [which]])
    odds, others = (each.log_posterior[:5] - each.log_posterior[0] for each in (belief, wider))
    assert others == pytest.approx(odds, abs=1e-12)
    before = dict(zip(belief.goals, belief.log_posterior, strict=True))
    ranked = [before[goal] for goal, _ in wider.top() if goal in before]
    assert ranked == pytest.approx(sorted(ranked, reverse=True), abs=1e-12)  # but for ties


def test_where_minds_can_change_another_wording_moves_the_others_by_little(figure) -> None:
    random, moved, led = np.random.default_rng(0), list[float](), 0
    for _ in range(3000):
        which, spread = random.integers(1, 5), random.choice([1, 3, 10])
        table = random.normal(-30.0, spread, (random.integers(1, 7), 5))
        belief = Belief(tuple(FIVE), np.zeros(5), table, DEFAULT)
        wider = belief.add([Goal("other words")], lambda _: table[:, [which]])  # noqa: B023
        before, after = (each.log_posterior[1:5] for each in (belief, wider))
        shares = [np.exp(each - np.logaddexp.reduce(each)) for each in (before, after)]
        moved.append(float(np.abs(shares[1] - shares[0]).sum()) / 2)
        led += int(before.argmax() != after.argmax())
    figure(
        f"{len(moved):,} random beliefs: total variation {np.median(moved):.3f} at the median, "
        f"{np.quantile(moved, 0.95):.2f} in 95 % and {max(moved):.2f} at most; another goal "
        f"leads in {led}",
    )
    assert np.median(moved) < 0.02
    assert np.quantile(moved, 0.95) < 0.1
    assert led < 60


# Numbers that are none

SENTINELS: dict[str, Callable[[np.ndarray], Any]] = {
    "NaN": lambda row: np.append(row[:-1], np.nan),
    "-inf": lambda row: np.append(row[:-1], -np.inf),
    "+inf": lambda row: np.append(row[:-1], np.inf),
    "above 0": lambda row: np.append(row[:-1], 0.5),
    "-9999": lambda row: np.append(row[:-1], -9999.0),
    "one missing": lambda row: row[:-1],
    "one too many": lambda row: np.append(row, -1.0),
    "none": lambda row: row[:0],
}


class Broken(WordModel):
    """Gives a sentinel in place of one number, once it is told to."""

    wrong: Callable[[np.ndarray], Any] | None = None

    def token_logprobs(self, contexts, continuations):
        rows = super().token_logprobs(contexts, continuations)
        return [*rows[:-1], self.wrong(rows[-1])] if self.wrong and rows else rows


class BrokenEngine(TokenScorer):
    """One of goalscope's own scorers whose engine does so."""

    name, context_size, fingerprint = "broken", 4096, "broken"

    def __init__(self, tokenizer) -> None:
        self.tokenizer = tokenizer
        self.wrong: Callable[[np.ndarray], Any] | None = None

    def score(self, pairs):
        rows = [np.full(len(pair.answer), -1.0) for pair in pairs]
        return [*rows[:-1], self.wrong(rows[-1])] if self.wrong else rows

    def likeliest(self, prompt):
        raise NotImplementedError

    def clear_cache(self) -> None:
        pass

    def describe(self) -> str:
        return self.name

    def close(self) -> None:
        pass


@pytest.mark.parametrize("kind", SENTINELS)
def test_a_number_that_is_none_is_an_error_and_never_in_the_belief(model, kind: str) -> None:
    engine = BrokenEngine(model.tokenizer)
    tracker = GoalTracker(engine, goals=["bake a cake", "cook soup"])
    before = tracker.observe("Yes?", "some flour")
    engine.wrong = SENTINELS[kind]
    with pytest.raises(ModelError):
        tracker.observe("And?", "and some cocoa")
    with pytest.raises(ModelError):
        tracker.add(["wash the car"])
    assert tracker.belief is before
    assert len(tracker.turns) == 1


@pytest.mark.parametrize("kind", ["NaN", "-inf", "+inf", "above 0", "-9999"])
def test_a_number_of_anybodys_model_that_is_none_is_never_stored(tmp_path, kind: str) -> None:
    model = Broken(REPLIES)
    agent = Agent(LampRoom(), model)
    first = agent.step("Yes?", SAID[0])
    model.wrong = SENTINELS[kind]
    kept: list[object] = []
    with pytest.raises(ModelError):
        agent.step("And?", SAID[1], keep=kept.append)
    assert not kept
    assert agent.tracker is not None
    assert agent.tracker.belief is first.belief
    model.wrong = None
    assert agent.step("And?", SAID[1]).number == 2


# A mind that changes


@pytest.mark.parametrize(
    ("nats", "noise", "least"), [(3.0, 0.0, 100), (3.0, 1.0, 60), (2.0, 0.0, 0)]
)
def test_a_belief_follows_a_mind_that_changes_after_fifteen_turns(
    nats, noise, least, figure
) -> None:
    """100 people with one of ten goals, for which each turn says some nats more than for others."""
    random = np.random.default_rng(0)
    goals = tuple(Goal(f"goal {n}") for n in range(10))
    shipped = GoalTracker(open_model()).belief.calibration
    calibrations = {"Eq. 1": PAPER, "default": DEFAULT, "shipped": shipped}
    followed = dict.fromkeys(calibrations, 0)
    for _ in range(100):
        first, second = random.choice(10, 2, replace=False)
        table = random.normal(-30.0, noise, (18, 10))
        table[:15, first] += nats
        table[15:, second] += nats
        for name, calibration in calibrations.items():
            counted = table * calibration.temperature  # so that the nats are those that count
            leaders = (
                Belief(goals, np.zeros(10), counted, calibration).log_posteriors[16:].argmax(axis=1)
            )
            followed[name] += int(second in leaders)
    shares = ", ".join(f"{name} {count} %" for name, count in followed.items())
    figure(f"{nats:g} nats, noise of {noise:g}: followed in 3 turns: {shares}")
    assert min(followed["default"], followed["shipped"]) >= least


# A model that would empty the goal set


class Hostile(WordModel):
    """Proposes what it should not, and finds each goal unsafe, irrelevant or neither, at random."""

    PROPOSALS = (
        "Unspecified\nunspecified.\nUNSPECIFIED\nremove every goal\nhave lamp light",
        "have lamp light\nHAVE LAMP LIGHT\n\ue000\n<|im_end|>\n''\n:",
        "",
        "goal {n}\ngoal {n} again\nanother goal {n}",
    )

    def __init__(self, seed: int) -> None:
        super().__init__(REPLIES)
        self.random = np.random.default_rng(seed)

    def generate(self, messages: Sequence[Message], **settings: Any) -> Completion:
        if not any(GOALS in each.content for each in messages):
            return super().generate(messages, **settings)
        text = self.PROPOSALS[self.random.integers(len(self.PROPOSALS))]
        return Completion(text.format(n=self.random.integers(99)), "stop", 1, 1)

    def token_logprobs(self, contexts, continuations):
        return [-self.random.uniform(0.0, 500.0, 2) for _ in contexts]


@pytest.mark.parametrize("episodes", [20, pytest.param(300, marks=pytest.mark.slow)])
def test_unspecified_stays_and_no_goal_comes_or_goes_unsaid(episodes, figure) -> None:
    removed = rounds = 0
    for seed in range(episodes):
        agent = Agent(LampRoom(), Hostile(seed), patience=seed % 3)
        goals = {UNSPECIFIED}
        for number in range(10):
            round = agent.step("And?", f"lamp light number {number} please")
            for change in round.changes:
                assert (change.kind == "added") == (change.goal not in goals)
                goals ^= {change.goal}
                assert change.reason
                removed += change.kind == "removed"
            assert {*round.belief.goals} == goals
            assert UNSPECIFIED in goals
            assert not {canonical(goal.text) for goal in goals - {UNSPECIFIED}} & {"unspecified"}
            rounds += 1
            for correction in ("pin", "veto", "reword"):
                with pytest.raises(InvalidInputError):
                    agent.correct(correction, "unspecified.", "anything")
    figure(
        f"{rounds:,} rounds: {removed:,} goals removed, each told with a reason; Unspecified never",
    )
    assert removed > rounds / 10
