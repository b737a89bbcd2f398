"""The paper's preset is Algorithm 1, line by line, with a model whose answers are known."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from fakes import LampRoom, said
from goalscope.agent.agent import Agent, run_episode
from goalscope.agent.people import ConsoleHuman, SimulatedHuman
from goalscope.base.types import UNSPECIFIED, Action, Goal, InvalidInputError, Profile
from goalscope.belief.likelihood import RolePlay
from goalscope.envs.grocery.catalogue import Catalogue
from goalscope.envs.grocery.shop import GroceryShop
from goalscope.envs.house.robot import HomeRobot
from goalscope.envs.house.simulator.scenes import load_scene
from goalscope.envs.house.simulator.world import HouseController
from goalscope.models import Completion
from goalscope.models.trace import read_trace, tracing
from test_prompted import Answers

READ, SLEEP = Goal("read a book"), Goal("sleep")
ROOM = ["lamp", "broken"]


def paper(model: Answers, room: LampRoom | None = None, **options) -> Agent:
    return Agent(room or LampRoom(ROOM), model, preset="paper", **options)


def answers(**more) -> Answers:
    told = {
        "question": [
            json.dumps({"question": each}) for each in ("What is it?", "And now?", "Yes?")
        ],
        "goals": [["The human wants to read a book", "sleep"]] * 3,
        "remove": [[]] * 3,
        "relevant": [["lamp"]] * 3,
        "plan": [[1]] * 3,
    }
    return Answers(**{**told, **more})


def asked(model: Answers) -> list[str]:
    return [key for key, _ in model.asked]


def spoken(agent: Agent, words: str):
    return agent.step(agent.ask(), words)


def test_a_round_has_the_papers_modules_in_the_papers_order_and_nothing_else(
    tmp_path: Path,
) -> None:
    model, file = answers(), tmp_path / "trace.jsonl"
    agent = paper(model)
    with tracing(file):
        spoken(agent, "It is dark, I read a book.")
    calls = [line["module"] for line in read_trace(file) if line["event"] != "round"]
    order = [one for one, other in pairwise([*calls, ""]) if one != other]
    assert order == ["query", "infer", "propose", "infer", "remove", "relevant", "plan"]
    assert asked(model) == ["question", "goals", "remove", "relevant", "plan"]


def test_line_1_the_belief_begins_with_unspecified_alone() -> None:
    assert paper(answers()).belief.goals == (UNSPECIFIED,)


def test_line_3_the_query_is_the_models_from_the_transcript_and_the_status() -> None:
    model = answers()
    agent = paper(model)
    assert agent.ask() == "What is it?"
    agent.step("What is it?", "I read a book.")
    assert agent.ask() == "And now?"
    prompt = model.prompts("question")[1]
    assert "Human: I read a book." in prompt
    assert "Done so far: On: lamp." in prompt


def test_line_4_the_belief_is_that_of_eq_1_with_the_goal_first_and_no_adapter() -> None:
    model = answers()
    agent = paper(model)
    round = spoken(agent, "I read a book.")
    likelihood = RolePlay(model, layout="goal-first")
    (nats,) = likelihood.log_likelihood(agent.env.task, round.belief.goals, agent.turns)
    expected = np.exp(nats - nats.max())
    np.testing.assert_allclose(round.belief.probability, expected / expected.sum())


def test_line_5_goals_are_proposed_while_unspecified_leads_and_all_are_added() -> None:
    many = ["read a book", "sleep", "sit", "stand", "think"]
    model = answers(goals=[many])
    agent = paper(model)
    spoken(agent, "I read a book.")
    assert [goal.text for goal in agent.belief.goals[1:]] == many
    spoken(agent, "I read a book.")  # a goal leads: nothing is proposed
    assert asked(model).count("goals") == 1


@pytest.mark.parametrize("written", ["The human wants to sleep", "the person wants sleep", "sleep"])
def test_a_goal_is_said_without_what_the_prompt_puts_before_it(written: str) -> None:
    agent = paper(answers(goals=[[written]]))
    spoken(agent, "Good evening.")
    assert SLEEP in agent.belief.goals


def test_line_6_goals_are_removed_by_the_prompt_and_may_be_proposed_again() -> None:
    model = answers(goals=[["read a book"], ["sleep", "read a book"]], remove=[[1], []])
    agent = paper(model)
    first = spoken(agent, "I read a book.")
    assert first.belief.goals == (UNSPECIFIED,)
    assert spoken(agent, "I read a book.").belief.goals == (UNSPECIFIED, SLEEP, READ)


def test_line_6_the_goal_that_is_least_likely_for_more_than_n_rounds_is_removed() -> None:
    agent = paper(answers(question=["Yes?"] * 5, remove=[[]] * 5, relevant=[[]] * 5), patience=2)
    kept = [SLEEP in spoken(agent, "I read a book.").belief.goals for _ in range(3)]
    assert kept == [True, True, False]


def test_line_8_the_k_likeliest_goals_are_told_with_their_probabilities() -> None:
    model = answers()
    agent = paper(model, k=1)
    spoken(agent, "I read a book.")
    (goal, probability), *_ = agent.belief.top()
    assert f"- {goal.text} ({probability:.0%})" in model.prompts("plan")[0]
    assert "sleep" not in model.prompts("plan")[0]


def test_line_9_there_is_no_action_while_unspecified_leads() -> None:
    model = answers(goals=[[]])
    round = spoken(paper(model), "I read a book.")
    assert round.results == ()
    assert not {"relevant", "plan"} & {*asked(model)}


def test_line_9_an_impossible_plan_is_undone_and_made_again() -> None:
    room = LampRoom(["lamp", "broken"])
    model = answers(relevant=[["lamp", "broken"]], plan=[[1, 2], [1]])
    round = spoken(paper(model, room), "I read a book.")
    assert [str(each.action) for each in round.results] == ["switch on: lamp"]
    assert round.replans == 1


def test_nothing_that_people_say_is_carried_out_as_an_order() -> None:
    model = answers(goals=[[]] * 2)
    room = LampRoom(ROOM)
    agent = paper(model, room)
    spoken(agent, "switch on lamp")
    assert room.on == []
    assert agent.rounds[0].reading is None


def test_line_10_the_phrase_of_the_person_ends_the_task() -> None:
    said = iter(["I read a book.", "Good night"])
    rounds = list(run_episode(paper(answers()), ConsoleHuman(lambda query: next(said))))
    assert [round.terminated for round in rounds] == [False, True]


def test_line_10_an_action_that_ends_the_task_does_so() -> None:
    class Done(LampRoom):
        def possible(self, terms):
            return [Action("finish")]

    assert spoken(paper(answers(), Done()), "I read a book.").terminated


def test_no_goals_sees_the_transcript_and_no_goal() -> None:
    model = answers()
    agent = paper(model, method="no-goals")
    spoken(agent, "I read a book.")
    assert asked(model) == ["question", "relevant", "plan"]
    assert "Human: I read a book." in model.prompts("plan")[0]
    assert "may want" not in model.prompts("plan")[0]


def test_no_inference_acts_on_the_goal_that_the_model_names() -> None:
    class Names(Answers):
        def generate(self, messages, **settings):
            if "enum" in settings.get("schema", {}):
                most = "most likely" in messages[-1].content
                return Completion("3" if most else "1", "stop", 1, 1)
            return super().generate(messages, **settings)

    model = Names(
        question=["Yes?"], goals=[["sleep", "read a book"]], remove=[[]], relevant=[["lamp"]],
        plan=[[1]],
    )  # fmt: skip
    agent = paper(model, method="no-inference")
    spoken(agent, "I read a book.")
    assert "- read a book\n" in model.prompts("plan")[0]
    assert "sleep" not in model.prompts("plan")[0]


def test_the_simulated_person_is_told_profile_task_status_and_phrase() -> None:
    told: list[str] = []

    class Hears(Answers):
        def generate(self, messages, **settings):
            told.append(messages[-1].content)
            return super().generate(messages, **settings)

    room = LampRoom()
    person = SimulatedHuman(Hears(), Profile("ann", "You cannot sleep.", (), ()), room)
    person.reply("Yes?", said("Hello.", "Tea.", "Now."), room.state().text)
    for each in ("You cannot sleep.", room.task, "On: nothing.", '"Good night"', "Yes?"):
        assert each in told[0]


def test_the_shop_offers_search_add_remove_and_buy() -> None:
    shop = GroceryShop(Catalogue.load())
    assert {each.name for each in shop.possible(["milk"])} == {"add item", "search inventory"}
    shop.step(next(each for each in shop.possible(["milk"]) if each.name == "add item"))
    names = {each.name for each in shop.possible(["milk"])}
    assert names == {"add item", "remove item", "search inventory", "buy basket"}


def test_the_robot_offers_all_that_the_affordances_of_things_allow() -> None:
    with HomeRobot(HouseController(load_scene("Kitchen1"))) as robot:
        things = robot.offers("", 100)
        names = {each.name for each in robot.possible([*things, "fridge", "cabinet", "drawer"])}
    assert {
        "open", "pick up", "put", "push", "pull", "turn on", "fill", "slice", "cook", "break",
        "dirty", "finish",
    } <= names  # fmt: skip


@pytest.mark.parametrize("preset", ["papers", "", 1])
def test_another_preset_is_refused(preset) -> None:
    with pytest.raises(InvalidInputError, match='preset must be "paper"'):
        Agent(LampRoom(), answers(), preset=preset)
