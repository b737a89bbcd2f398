"""What happens to guesses and orders when the person's goal is another one."""

from __future__ import annotations

import numpy as np
import pytest

from fakes import LampRoom, WordModel, plans
from goalscope.agent.agent import Agent
from goalscope.agent.planner import Outcome, attempted
from goalscope.agent.round import Guess
from goalscope.base.text import plain
from goalscope.base.types import UNSPECIFIED, Action, Turn
from goalscope.belief.calibration import PAPER
from goalscope.language.orders import Order, Reading
from goalscope.storage.store import round_from_json, round_to_json

READ, COOL, SWEEP = "read a book", "cool the room", "sweep the floor"
CALLED_FOR = {READ: ("lamp", "desk lamp"), COOL: ("fan", "lamp")}


class Told:
    """Words speak for the goal whose first word is in them, by many nats."""

    calibration = PAPER

    def log_likelihood(self, task, goals, turns, *, since=0):
        def nats(goal, words):
            return -6.0 if goal == UNSPECIFIED else -24.0 * (goal.text.split()[0] not in words)

        rows = [[nats(goal, turn.utterance) for goal in goals] for turn in turns[since:]]
        return np.reshape(rows, (len(rows), len(goals)))


class Guesses:
    """Switches on, unasked, what the leading goal calls for and is not on."""

    def act(self, env, wants, turns, history, dialogue):
        goal = wants[0].text if wants and wants[0].probability > 0.5 else ""
        used = {r.action.target for r in history if r.action.target not in dialogue.given_up}
        acts = [Action("switch on", name) for name in CALLED_FOR.get(goal, ()) if name not in used]
        results, _ = attempted(env, acts, history)
        return Outcome(tuple(results), guessed=tuple(Guess(a.target, goal) for a in acts))


def agent_of(**reads: str) -> tuple[Agent, LampRoom]:
    room = LampRoom(["lamp", "desk lamp", "fan", "heater"])
    said = {plain(words.replace("_", " ")): orders for words, orders in reads.items()}
    agent = plans(Agent(room, WordModel(reads=said), likelihood=Told()), Guesses())
    agent.tracker.add([READ, COOL, SWEEP])
    return agent, room


def test_what_was_guessed_for_a_goal_that_fell_is_taken_back_and_told() -> None:
    agent, room = agent_of(read_now="aim", forget_it_sweep="aim", sweep_more="aim")
    first = agent.step("", "read now")
    assert room.on == ["lamp", "desk lamp"]
    assert first.guessed == (Guess("lamp", READ), Guess("desk lamp", READ))
    second = agent.step("", "forget it sweep")
    assert room.on == []
    assert second.given_up == first.guessed
    assert "Taken back, as it was a guess for another goal: lamp, desk lamp." in second.notes
    third = agent.step("", "sweep more")
    assert third.given_up == ()
    assert third.results == ()


def test_who_takes_nothing_back_gives_up_nothing() -> None:
    agent, room = agent_of(read_now="aim", sweep_now="aim")
    agent.step("", "read now")
    assert agent.step("", "sweep now").given_up == ()
    assert room.on == ["lamp", "desk lamp"]


def test_what_another_goal_calls_for_too_is_guessed_anew() -> None:
    agent, room = agent_of(read_now="aim", forget_it_cool="aim")
    agent.step("", "read now")
    second = agent.step("", "forget it cool")
    assert room.on == ["fan", "lamp"]
    assert second.guessed == (Guess("fan", COOL), Guess("lamp", COOL))


def test_what_the_newest_words_name_stays() -> None:
    agent, room = agent_of(read_now="aim", forget_it_sweep_but_keep_the_desk_lamp="leave desk lamp")
    agent.step("", "read now")
    second = agent.step("", "forget it sweep but keep the desk lamp")
    assert second.given_up == ()  # each lamp is called so
    assert room.on == ["lamp", "desk lamp"]


def test_what_was_asked_for_stays_and_is_asked_about_once() -> None:
    agent, room = agent_of(
        read_with_the_heater="aim\nswitch on heater",
        forget_it_sweep="aim",
        yes="yes",
        sweep_on="aim",
    )
    agent.step("", "read with the heater")
    assert room.on == ["heater", "lamp", "desk lamp"]
    second = agent.step("", "forget it sweep")
    assert room.on == ["heater"]
    assert second.pending == (Order("switch off", "heater"),)
    assert second.question == "You had asked for heater, too. Shall I switch off that?"
    third = agent.step(second.question, "yes")
    assert room.on == []
    assert third.released == second.pending
    assert not agent.step("", "sweep on").question


def test_goals_that_mean_the_same_keep_each_others_guesses(monkeypatch: pytest.MonkeyPatch) -> None:
    agent, room = agent_of(read_now="aim", forget_it_sweep="aim")
    agent.step("", "read now")
    agent.tracker.correct("reword", READ, "read the book")
    agent._uncorrected.clear()
    assert agent._given_up(Turn("", "forget it"), Reading((Order("aim"),))) == []
    assert room.on == ["lamp", "desk lamp"]


def test_who_only_gives_orders_gives_up_nothing() -> None:
    agent, room = agent_of(read_now="aim", sweep_by_the_fan="switch on fan")
    agent.step("", "read now")
    second = agent.step("", "sweep by the fan")
    assert second.given_up == ()
    assert room.on == ["lamp", "desk lamp", "fan"]


def test_an_undo_takes_back_guesses_of_its_round_and_nothing_twice() -> None:
    agent, room = agent_of(read_now="aim", undo="undo", forget_it_sweep="aim")
    agent.step("", "read now")
    agent.step("", "undo")
    assert room.on == []
    assert agent.step("", "forget it sweep").given_up == ()


def test_guesses_are_stored() -> None:
    agent, _ = agent_of(read_now="aim", forget_it_sweep="aim")
    for words in ("read now", "forget it sweep"):
        round = agent.step("", words)
        again = round_from_json(round_to_json(round))
        assert (again.guessed, again.given_up) == (round.guessed, round.given_up)
