"""Questions are asked for what their answers tell, in a world that can be computed by hand."""

import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes import LampRoom, WordModel, words
from goalscope.agent import Agent
from goalscope.asking import expected_gain, information_gain, informative, narrowed, unasked
from goalscope.belief import Belief
from goalscope.calibration import PAPER, USUAL
from goalscope.dialog import FALLBACK, OPENING
from goalscope.likelihood import RolePlay
from goalscope.models import Completion
from goalscope.types import UNSPECIFIED, Goal, InvalidInputError, Message, Turn

READ, SLEEP, DANCE = Goal("read novels"), Goal("sleep deeply"), Goal("dance tango")
TELLING, IDLE = "Which thing do you love?", "Which shoes do you like to wear?"
DARK = [Turn(OPENING, "it is dark")]


class People(WordModel):
    """People who say their goal if they are asked the telling question, and else the same.

    The questions that it writes are given.
    """

    def __init__(self, *questions: str, context_size: int = 4096) -> None:
        super().__init__(context_size=context_size)
        self.questions = list(questions)
        self.asked: list[str] = []

    def generate(self, messages: Sequence[Message], *, seed: int = 0, **settings) -> Completion:
        if "grammar" in settings:
            return super().generate(messages, **settings)
        if "You play a human" not in messages[0].content:
            text = self.questions[seed % len(self.questions)]
        else:
            self.asked.append(messages[-1].content)
            _, _, wish = messages[-1].content.partition("You want this: ")
            text = wish.partition(".)")[0] if TELLING in wish else "nothing"
        return Completion(text, "stop", 0, len(words(text)))


def flat(*goals: Goal, calibration=PAPER) -> Belief:
    return Belief.uniform(goals, calibration)


def asked(model: People, belief: Belief, turns: Sequence[Turn] = DARK, **options) -> str:
    query, gain = informative(model, RolePlay(model), LampRoom(), belief, turns, **options)
    assert (gain is None) == query.endswith((OPENING, FALLBACK))
    return query


def test_gain_by_hand() -> None:
    answers = np.log([[0.8, 0.2, 0.1], [0.1, 0.5, 0.2], [0.3, 0.3, 0.3]])
    p = np.array([0.5, 0.3, 0.2])
    belief = replace(flat(READ, SLEEP, DANCE), log_prior=np.log(p))
    likelihood = np.exp(answers)
    by_hand = sum(
        p[i] * (answers[i, i] - math.log(sum(p[j] * likelihood[i, j] for j in range(3))))
        for i in range(3)
    )
    assert information_gain(belief, answers) == pytest.approx(by_hand)


def test_gain_counts_evidence_as_the_belief_does() -> None:
    answers = np.array([[0.0, -4.0], [-4.0, 0.0]])
    sure, unsure = (
        information_gain(flat(READ, SLEEP, calibration=replace(PAPER, temperature=t)), answers)
        for t in (1.0, 4.0)
    )
    assert sure == pytest.approx(math.log(2 / (1 + math.exp(-4))))
    assert unsure == pytest.approx(math.log(2 / (1 + math.exp(-1))))


@given(st.integers(2, 3).flatmap(lambda g: st.tuples(tables(g), weights(g))))
def test_gain_over_all_answers_is_mutual_information(drawn) -> None:
    """Each of `A` answers, weighed by how often each person gives it: no less than 0."""
    table, p = drawn
    goals = [Goal(str(i)) for i in range(len(p))]
    belief = replace(flat(*goals), log_prior=np.log(p))
    scores = np.log(table)
    total = 0.0
    for choice in np.ndindex(*[table.shape[1]] * len(p)):  # which answer each person gives
        chance = math.prod(table[i, a] for i, a in enumerate(choice))
        rows = np.array([scores[:, a] for a in choice])
        gain = information_gain(belief, rows)
        assert gain <= belief.entropy + 1e-9
        total += chance * gain
    mixture = p @ table
    mutual = float(sum(p[i] * table[i] @ (scores[i] - np.log(mixture)) for i in range(len(p))))
    assert total == pytest.approx(mutual, abs=1e-9)
    assert total >= -1e-9


def tables(g: int) -> st.SearchStrategy[np.ndarray]:
    """[g, 3] how likely each person gives each of three answers."""
    row = st.lists(st.floats(0.05, 1), min_size=3, max_size=3).map(lambda x: np.array(x) / sum(x))
    return st.lists(row, min_size=g, max_size=g).map(np.array)


def weights(g: int) -> st.SearchStrategy[np.ndarray]:
    return st.lists(st.floats(0.05, 1), min_size=g, max_size=g).map(lambda x: np.array(x) / sum(x))


def test_answers_that_differ_by_goal_tell_and_others_do_not() -> None:
    model = People()
    belief = flat(READ, SLEEP, DANCE)

    def gain(question: str) -> float:
        return expected_gain(question, model, RolePlay(model), "Help.", belief, DARK)

    assert gain(IDLE) == pytest.approx(0, abs=1e-9)
    boost = model.boost**2  # two words, each likelier by `boost` if the prompt holds them
    assert gain(TELLING) == pytest.approx(math.log(3 / (1 + 2 / boost)), rel=1e-6)


def test_what_a_question_is_expected_to_tell_comes_with_it() -> None:
    model = People(IDLE, TELLING)
    belief = flat(READ, SLEEP)
    expected = expected_gain(TELLING, model, RolePlay(model), LampRoom.task, belief, DARK)
    _, gain = informative(model, RolePlay(model), LampRoom(), belief, DARK)
    assert gain == pytest.approx(expected)


@pytest.mark.parametrize("order", [(IDLE, TELLING), (TELLING, IDLE)])
def test_the_question_that_tells_most_is_asked(order) -> None:
    assert asked(People(*order), flat(READ, SLEEP)) == TELLING


def test_open_question_where_no_answer_is_worth_the_cost() -> None:
    assert asked(People(IDLE), flat(READ, SLEEP)) == FALLBACK
    assert asked(People(TELLING), flat(READ, SLEEP), cost=0.5) == TELLING
    assert asked(People(TELLING), flat(READ, SLEEP), cost=0.693) == FALLBACK


@pytest.mark.parametrize(
    "belief",
    [
        flat(UNSPECIFIED),
        flat(),
        flat(READ, SLEEP).observe([0.0, -20.0]),
        flat(READ, SLEEP).pin(READ),
        flat(READ, SLEEP).observe([-np.inf, -np.inf]),
    ],
    ids=["one goal", "no goal", "sure", "confirmed", "no goal explains the words"],
)
def test_nobody_is_simulated_where_no_answer_could_tell_anything(belief) -> None:
    model = People(TELLING)
    assert asked(model, belief, cost=0.1) == FALLBACK
    assert (model.asked, model.calls) == ([], 0)


def test_a_person_without_a_goal_is_simulated_too() -> None:
    model = People(TELLING)
    assert asked(model, flat(UNSPECIFIED, READ)) == TELLING
    assert [READ.text in query for query in model.asked] == [False, True]


def test_questions_are_written_to_tell_the_stated_goals_apart() -> None:
    prompts: list[str] = []

    class Listening(People):
        def generate(self, messages: Sequence[Message], **settings) -> Completion:
            prompts.append(messages[-1].content)
            return super().generate(messages, **settings)

    asked(Listening(TELLING), flat(UNSPECIFIED, READ, SLEEP))
    assert prompts[0].endswith("The human may want: read novels; sleep deeply")


def test_only_the_likeliest_goals_are_simulated() -> None:
    belief = flat(*(Goal(f"goal {n}") for n in range(9))).observe(-np.arange(9.0))
    model = People(TELLING)
    assert asked(model, belief, most=3) == TELLING
    assert [f"goal {n}" in query for n, query in enumerate(model.asked)] == [True] * 3


def test_narrowed_belief_stands_where_it_stood() -> None:
    belief = flat(UNSPECIFIED, READ, SLEEP, DANCE, calibration=USUAL).observe([-3, -1, -2, -9])
    two = narrowed(belief, 2)
    whole = dict(belief.top())
    assert dict(two.top()) == pytest.approx(
        {goal: whole[goal] / (whole[two.goals[0]] + whole[two.goals[1]]) for goal in two.goals}
    )


@pytest.mark.parametrize("query", [TELLING, "Fine. What thing do you love?"])
def test_a_question_is_not_asked_again_in_other_words(query) -> None:
    turns = [*DARK, Turn(query, "nothing")]
    assert asked(People(TELLING), flat(READ, SLEEP), turns) == FALLBACK


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("What is your budget?", "What's your budget?", True),
        ("How many people is it for?", "How many people are coming?", True),
        ("What kind of food do you enjoy?", "Which type of food do you like?", True),
        ("Do you eat meat?", "Do you eat fish?", False),
        ("Do you need flour?", "Do you need sugar?", False),
        ("What is the occasion?", "What is your budget?", False),
    ],
)
def test_which_questions_mean_the_same(one, other, same) -> None:
    assert (unasked([one], [Turn(f"I see. {other}", "no")]) == []) is same


def test_first_comes_the_opening() -> None:
    model = People(TELLING)
    assert asked(model, flat(READ, SLEEP), []) == OPENING


def test_long_conversations_leave_room_for_answers() -> None:
    turns = [Turn(f"What about item {n}?", f"thing {n} " * 10) for n in range(30)]
    model = People(TELLING, context_size=500)
    assert asked(model, flat(READ, SLEEP), turns) == TELLING


def test_silent_people_tell_nothing() -> None:
    class Silent(People):
        def generate(self, messages: Sequence[Message], **settings) -> Completion:
            written = super().generate(messages, **settings)
            return replace(written, text="" if self.asked else written.text)

    assert asked(Silent(TELLING), flat(READ, SLEEP)) == FALLBACK


def test_an_agent_asks_what_tells_its_goals_apart() -> None:
    goals = f"- {READ.text}\n- {SLEEP.text}"

    class Proposing(People):
        def generate(self, messages: Sequence[Message], **settings) -> Completion:
            if "grammar" in settings:
                return super().generate(messages, **settings)
            proposes = "name what the human may want" in messages[0].content
            written = super().generate(messages, **settings)
            return replace(written, text=goals) if proposes else written

    answers = {}
    for questions in ("likeliest", "informative"):
        model = Proposing(IDLE, TELLING)
        agent = Agent(LampRoom(), model, questions=questions)
        assert agent.ask() == OPENING
        agent.step(OPENING, "novels deeply please")
        answers[questions] = agent.ask()
        resumed = Agent(LampRoom(), Proposing(IDLE, TELLING), questions=questions)
        resumed.resume(agent.rounds)
        assert resumed.ask() == answers[questions]
    assert answers == {"likeliest": IDLE, "informative": TELLING}
    told = [note for note in agent.step(TELLING, "novels").notes if "expected to tell" in note]
    assert re.fullmatch(r"The answer to .* to tell 0\.\d\d nats\.", *told)
    assert not any("expected to tell" in note for note in agent.step(OPENING, "novels").notes)
    frugal = Agent(LampRoom(), Proposing(TELLING), questions="informative", cost=2.0)
    frugal.resume(agent.rounds[:1])
    assert frugal.ask() == FALLBACK


@pytest.mark.parametrize("method", ["no-goals", "no-inference"])
def test_without_a_belief_no_question_is_informative(method) -> None:
    with pytest.raises(InvalidInputError, match=method):
        Agent(LampRoom(), WordModel(), method=method, questions="informative")
    with pytest.raises(InvalidInputError, match="'best'"):
        Agent(LampRoom(), WordModel(), questions="best")
