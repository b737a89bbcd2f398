"""The paper's modules by prompts: what a model writes is used as far as it makes sense."""

import json
from collections.abc import Sequence
from typing import Any

import jsonschema
import pytest

from fakes import GOALS, NEEDS, QUESTION, LampRoom, WordModel, said, words
from goalscope.agent.agent import Agent
from goalscope.agent.planner import NeedPlanner, Outcome, Want
from goalscope.agent.prompted import PromptedPlanner, PromptedWriter
from goalscope.agent.toolkit import toolkit_of
from goalscope.agent.writer import Writer
from goalscope.base.types import (
    Action,
    Goal,
    StepResult,
    UnreadableAnswerError,
)
from goalscope.language.dialogue_state import DialogueState
from goalscope.language.orders import Order
from goalscope.models import Completion
from goalscope.models.trace import traced

FREE = DialogueState()
TURNS = said("It is dark, and I want to read.")
READ = Want("read", 0.7)
BROKEN = (
    "I'm sorry, but I can't help you with that.",
    "",
    "null",
    "[]",
    "{}",
    '{"goals": ["read", "sle',
    '{"plan": [1, 2',
    "[" * 100_000,
    '{"goals": "read", "relevant": "lamp", "plan": 1, "remove": 1}',
    '{"goals": null, "relevant": null, "plan": null, "remove": null}',
    "\ud800",
)
"""What holds no list: prose, a refusal, nothing, JSON that is cut off, and other forms."""


class Answers(WordModel):
    """Answers by the key that it is asked for, in turn, and keeps the prompts and settings.

    An answer is a text, which is written as it is, or what the key is to hold.
    """

    writer = None

    def __init__(self, **answers: Sequence[Any]) -> None:
        super().__init__()
        self.answers = {key: iter(each) for key, each in answers.items()}
        self.asked: list[tuple[str, str]] = []

    @traced
    def generate(self, messages, **settings) -> Completion:
        if "schema" not in settings:
            return super().generate(messages, **settings)
        assert settings.get("temperature", 0) == 0
        jsonschema.Draft202012Validator.check_schema(settings["schema"])
        (key,) = settings["schema"]["required"]
        self.asked.append((key, messages[-1].content))
        answer = next(self.answers[key])
        text = answer if isinstance(answer, str) else json.dumps({key: answer})
        return Completion(text, "stop", len(words(messages[-1].content)), len(words(text)))

    def prompts(self, key: str) -> list[str]:
        return [prompt for asked, prompt in self.asked if asked == key]


def goals(answer: Any, held: Sequence[str] = ()) -> list[str]:
    return PromptedWriter(Answers(goals=[answer])).goals("t", TURNS, held)


@pytest.mark.parametrize(
    ("answer", "named"),
    [
        (["read", " read. ", "go to  bed.", "", "x", "sleep"], ["read", "go to bed", "sleep"]),
        ([f"goal number {n}" for n in range(100)], [f"goal number {n}" for n in range(5)]),
        (["word " * 5000, "read"], ["read"]),
        ([1, None, ["read"], {"goal": "read"}], []),
        ([], []),
    ],
    ids=["once and clean", "many", "long", "no texts", "none"],
)
def test_goals_are_named_once_and_clean(answer: list[object], named: list[str]) -> None:
    assert goals(answer) == named


def test_goals_that_are_held_are_told_and_not_asked_for_again() -> None:
    model = Answers(goals=[["read"]])
    PromptedWriter(model).goals("t", TURNS, ["sleep well"])
    assert "- sleep well" in model.prompts("goals")[0]


def unfit(answer: Any, *held: str) -> list[str]:
    model = Answers(remove=[answer])
    return [each.goal.text for each in PromptedWriter(model).unfit("t", TURNS, [*map(Goal, held)])]


@pytest.mark.parametrize(
    ("answer", "removed"),
    [
        ([], []),
        ([2], ["b"]),
        ([3, 1, 3], ["c", "a"]),
        ([0, -1, 4, 10**30, 2.5, "1", None, [1]], []),
        ([True], []),
        ([*range(-50, 50)], ["a", "b", "c"]),
    ],
)
def test_goals_are_removed_by_their_numbers(answer: list[object], removed: list[str]) -> None:
    assert unfit(answer, "a", "b", "c") == removed


@pytest.mark.parametrize("ask", [goals, lambda answer: unfit(answer, "a")], ids=["goals", "unfit"])
@pytest.mark.parametrize("answer", BROKEN)
def test_what_holds_no_list_is_told(ask, answer: str) -> None:
    with pytest.raises(UnreadableAnswerError):
        ask(answer)


@pytest.mark.parametrize(
    ("answer", "question"),
    [
        ("What is it?", "What is it?"),
        (" What\nis  it? ", "What is it?"),
        ("", ""),
        (None, ""),
        (["What?"], ""),
        ({"a": "What?"}, ""),
    ],
)
def test_a_question_is_one_line(answer: object, question: str) -> None:
    model = Answers(question=[json.dumps({"question": answer})])
    assert PromptedWriter(model).question("t", TURNS, "lamp", ["read"]) == question


@pytest.mark.parametrize("answer", BROKEN)
def test_without_a_question_there_is_nothing_to_ask(answer: str) -> None:
    assert PromptedWriter(Answers(question=[answer])).question("t", TURNS, "", []) == ""


def act(
    room: LampRoom, plans: Sequence[Any], *, terms: Any = (), dialogue=FREE, history=(), replans=2
) -> tuple[Outcome, Answers]:
    model = Answers(relevant=[list(terms) or room.names] if terms != "" else [""], plan=plans)
    planner = PromptedPlanner(PromptedWriter(model), replans=replans)
    return planner.act(room, [READ], TURNS, history, dialogue), model


def test_the_plan_is_made_of_what_can_be_done_and_what_the_person_may_want() -> None:
    _, model = act(LampRoom(["lamp", "fan", "light"]), [[1]])
    assert "2. switch on: fan" in model.prompts("plan")[0]
    assert "- read (70%)" in model.prompts("plan")[0]


NO_NUMBERS = [[], [0], [-1], [4, 99, 10**30], ["lamp"], [None], [[1]], [1.5], [True], [{"n": 1}]]


@pytest.mark.parametrize(
    ("plan", "on"),
    [
        ([3, 1], ["light", "lamp"]),
        ([2, 2, 1, 2], ["fan", "lamp"]),
        *((numbers, []) for numbers in NO_NUMBERS),
    ],
)
def test_a_plan_is_done_in_its_order_and_each_number_once(plan: list[object], on) -> None:
    room = LampRoom(["lamp", "fan", "light"])
    outcome, _ = act(room, [plan])
    assert room.on == on
    assert [(each.target, each.goal) for each in outcome.guessed] == [(each, "read") for each in on]
    assert (outcome.failed, outcome.replans, len(outcome.results)) == ((), 0, len(on))


@pytest.mark.parametrize(("broken", "replans"), [(1, 1), (2, 2)])
def test_a_plan_is_made_anew_without_what_was_impossible(broken: int, replans: int) -> None:
    class Worn(LampRoom):
        def step(self, action: Action) -> StepResult:
            if action.target.startswith("broken"):
                return StepResult(action, False, "The switch does not move.")
            return super().step(action)

    room = Worn(["lamp", *(f"broken {n}" for n in range(broken)), "fan"])
    history = [room.step(Action("switch on", "candle"))]
    plans = [[1, 2], [1, 2], [1, 2]][: broken + 1]
    outcome, model = act(room, plans, history=history)
    assert room.on == ["candle", "lamp", "fan"]
    assert (outcome.replans, len(outcome.failed)) == (replans, broken)
    assert "broken" not in model.prompts("plan")[-1]


@pytest.mark.parametrize("replans", [0, 1, 3])
def test_plans_are_made_anew_so_often_and_then_nothing_is_left_of_them(replans: int) -> None:
    class Dead(LampRoom):
        def step(self, action: Action) -> StepResult:
            works = action.target in ("lamp", "candle")
            return super().step(action) if works else StepResult(action, False, "No.")

    room = Dead(["lamp", *(f"fan {n}" for n in range(9))])
    history = [room.step(Action("switch on", "candle"))]
    outcome, model = act(room, [[1, 2]] * (replans + 1), history=history, replans=replans)
    assert (room.on, outcome.results, outcome.guessed) == (["candle"], (), ())
    assert len(model.prompts("plan")) == 1 + replans
    assert len(outcome.failed) == 1 + replans
    assert outcome.replans == replans


def test_nothing_lasting_or_ruled_out_can_be_planned() -> None:
    class Fragile(LampRoom):
        def actions(self, name, dialogue):
            return [*super().actions(name, dialogue), Action("smash", name)]

    room = Fragile(["lamp", "fan"])
    dialogue = DialogueState(limits=(Order("avoid", "lamp"),))
    _, model = act(room, [[1, 2, 3, 4]], dialogue=dialogue)
    assert (room.on, room.smashed) == (["fan"], [])
    assert "smash" not in model.prompts("plan")[0]


PLANS = {"goals": [["read in the dark"]] * 2, "relevant": [["lamp"]] * 2, "plan": [[1]] * 2}


def test_an_agent_of_a_model_that_was_taught_nothing_works_by_prompts() -> None:
    room, model = LampRoom(["lamp"]), Answers(**PLANS, question=[["no text"], "What next?"])
    agent = Agent(room, model)
    round = agent.step(agent.ask(), "It is dark, I want to read.")
    assert Goal("read in the dark") in round.belief.goals
    assert room.on == ["lamp"]
    assert "Guessed, not asked for: lamp (to read in the dark)." in round.notes


@pytest.mark.parametrize("key", ["relevant", "plan"])
@pytest.mark.parametrize("answer", BROKEN[:1] + BROKEN[5:7])
def test_a_plan_that_cannot_be_read_is_told_and_the_round_goes_on(key: str, answer: str) -> None:
    room = LampRoom(["lamp"])
    agent = Agent(room, Answers(**{**PLANS, key: [answer]}))
    round = agent.step("", "It is dark, I want to read.")
    assert any(note.startswith("No plan was made. The model") for note in round.notes)
    assert (room.on, len(agent.rounds)) == ([], 1)


def test_who_does_what_depends_on_what_the_model_was_taught_and_what_is_chosen() -> None:
    taught = toolkit_of(WordModel({GOALS: "", NEEDS: "", QUESTION: ""}))
    assert isinstance(taught.proposer, Writer)
    assert isinstance(taught.planner, NeedPlanner)
    assert taught.proposer is taught.asker
    assert taught.remover is None
    model = Answers()
    plain = toolkit_of(model)
    assert isinstance(plain.planner, PromptedPlanner)
    assert isinstance(plain.proposer, PromptedWriter)
    assert (plain.proposer.model, plain.remover) == (model, None)
    chosen = toolkit_of(WordModel(), ["remove", "plan"])
    assert isinstance(chosen.remover, PromptedWriter)
    assert isinstance(chosen.planner, PromptedPlanner)
    assert isinstance(chosen.proposer, Writer)


@pytest.mark.slow
def test_the_embedded_model_answers_in_the_form_that_is_asked_for(model) -> None:
    writer = PromptedWriter(model)
    assert len(writer.goals("The agent looks after a lamp.", TURNS)) <= 5
    room = LampRoom(["lamp", "fan"])
    outcome = PromptedPlanner(writer).act(room, [READ], TURNS, [], FREE)
    assert {each.action.target for each in outcome.results} <= {"lamp", "fan"}
