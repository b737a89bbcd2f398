"""What a person takes back is undone from the record, also after a restart, guesses among it."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

import pytest

from fakes import LampRoom, WordModel
from goalscope.agent import Agent
from goalscope.envs.undoing import ALL, undoes
from goalscope.rounds_json import round_from_json, round_to_json
from goalscope.taking_back import IDLE, NOT_HERE, NOTHING, heard
from goalscope.types import Action, GoalscopeError, StepResult, TakenBack, Turn
from heard import robot_in
from shops import shop
from talks import Talk

CAKE = [Action("add item", "Walnuts"), Action("add item", "Leeks")]


@pytest.mark.parametrize(
    ("said", "number", "rest"),
    [
        ("Undo that.", 1, ""),
        ("No, that's wrong. Undo it please!", 1, ""),
        ("can you take that back", 1, ""),
        ("scratch that, add kale", 1, "add kale"),
        ("undo the last two things", 2, ""),
        ("undo the last 3", 3, ""),
        ("undo that twice", 2, ""),
        ("undo last two", 2, ""),
        ("undo two steps", 2, ""),
        ("undo that and then undo that", 2, ""),
        ("I changed my mind, undo that", 1, ""),
        ("my bad, undo that because it looks odd", 1, ""),
        ("I don't like it. Just undo them right now", 1, ""),
        ("take my last order back", 1, ""),
        ("undo that & add milk", 1, "add milk"),
        ("undo that but leave the mug", 1, "leave the mug"),
        ("undo that, but not the mug", 1, "leave the mug"),
        ("is the mug in the sink? undo that", 1, "is the mug in the sink?"),
        ("undo that, yes", 1, ""),
        ("undo that. I don't want nuts", 1, "i don't want nuts"),
        ("undo that because he is allergic to nuts", 1, "because he is allergic to nuts"),
        ("undo that, but only if it is dear", None, "but only if it is dear"),
        ("undo that if it is dear", None, ""),
        ("can you undo that last bit with the mug", None, ""),
        ("undo that right away", 1, ""),
        ("Please take back what you did with my last order.", 1, ""),
        ("no pancakes then. Undo everything from the last message", 1, "no pancakes then."),
        ("undo both", 2, ""),
        ("undo everything", ALL, ""),
        ("put everything back how it was", ALL, ""),
        ("Undo that, thanks!", 1, ""),
        ("add milk, then undo that", 0, ""),
        ("two kale, scratch that, one kale", 0, "one kale"),
    ],
)
def test_what_asks_to_take_back(said: str, number: int | None, rest: str) -> None:
    undoing = undoes(said)
    assert undoing is not None
    assert (undoing.number, undoing.rest.rstrip(", ")) == (number, rest)


@pytest.mark.parametrize(
    "said",
    [
        "",
        "don't undo that",
        "undo the knot",
        "take it back",
        "put it back",
        "never mind",
        "undo the last 0 things",
    ],
)
def test_what_does_not(said: str) -> None:
    assert undoes(said) is None


def test_a_restart_forgets_nothing() -> None:
    talk = Talk(shop())
    talk.say("Add eggs")
    talk.say("I'm baking a cake", guesses=CAKE)
    stored = [round_from_json(round_to_json(replace(r, state=""))) for r in talk.rounds]
    again = Agent(shop(), WordModel(), method="no-goals")
    again.resume(stored)
    back = again.step("Anything else?", "Undo that.")
    assert back.takes_back == (2,)
    assert back.reversals == len(back.results) == len(CAKE)
    assert round_from_json(round_to_json(back)).takes_back == (2,)
    assert "Walnuts" not in again.env.status()
    assert again.step("Anything else?", "Undo that, add kale").takes_back == (1,)
    assert again.step("Anything else?", "undo that").takes_back == (4,)
    assert again.env.status() == "The basket is empty."
    assert again.step("Anything else?", "undo that").notes == (NOTHING,)


def test_remarks_questions_answers_and_attempts_to_buy_are_passed_over() -> None:
    talk = Talk(shop())
    talk.say("Add eggs")
    for said in ("thanks", "do you have milk?", "Why eggs?", "yes", "Buy the basket", "no, wait"):
        talk.say(said)
    assert talk.say("undo that").takes_back == (1,)


def test_what_had_led_to_nothing_is_told() -> None:
    talk = Talk(robot_in("Kitchen1"))
    talk.env.reset()
    talk.say("I'm hungry")
    assert talk.say("undo that").notes == ('Taken back: "I\'m hungry".', IDLE)


def test_what_is_taken_back_is_heard_no_more_but_known() -> None:
    talk = Talk(robot_in("Kitchen1"))
    talk.env.reset()
    for said in ("Put the apple in the fridge", "undo that", "open the fridge"):
        talk.say(said)
    turns = heard(talk.rounds)
    assert [isinstance(turn, TakenBack) for turn in turns] == [True, False]
    assert talk.env.status().splitlines()[2:] == ["- fridge: open"]


def test_it_may_mean_what_was_just_taken_back() -> None:
    talk = Talk(robot_in("Kitchen1"))
    talk.env.reset()
    talk.say("Put the apple in the fridge")
    talk.say("undo that. Put it in the sink")
    assert talk.env.status().splitlines()[2:] == ["- apple: now in the sink basin"]


def test_a_failed_round_takes_nothing_back() -> None:
    agent = Agent(shop(), WordModel(), method="no-goals")
    agent.step("What would you like?", "Add eggs")
    held = agent.env.fingerprint()

    def full(_: object) -> None:
        raise OSError("The disk is full.")

    with pytest.raises(OSError, match="full"):
        agent.step("What else?", "undo that", keep=full)
    assert agent.env.fingerprint() == held
    assert agent.step("What else?", "undo that").takes_back == (1,)


def test_a_domain_that_undoes_nothing_says_so_and_guesses_nothing() -> None:
    agent = Agent(LampRoom(), WordModel(), method="no-goals")
    agent.step("What would you like?", "the red lamp")
    before = agent.env.fingerprint()
    back = agent.step("What else?", "undo that")
    assert back.notes == (NOT_HERE,)
    assert agent.env.fingerprint() == before


def test_no_model_is_asked_what_to_ask_after_it() -> None:
    model = WordModel()
    agent = Agent(shop(), model, method="no-goals")
    agent.step("What would you like?", "Add eggs")
    agent.step("What else?", "undo that")
    calls = model.calls
    assert agent.ask() == "What else would you like?"
    assert model.calls == calls
    assert agent.turns[-1] == Turn("What else?", "undo that")


def in_kitchen(*said: str) -> Talk:
    talk = Talk(robot_in("Kitchen1"))
    talk.env.reset()
    for each in said:
        talk.query = talk.rounds[-1].question if talk.rounds else ""
        talk.say(each)
    return talk


def test_a_request_that_waits_for_leave_is_taken_back() -> None:
    talk = in_kitchen("put the bread in the fridge", "can you slice the bread?", "undo that")
    assert talk.rounds[1].question
    assert talk.rounds[2].takes_back == (2,)
    talk.query = talk.rounds[-1].question
    assert not talk.say("yes").results
    assert talk.env.status().splitlines()[2:] == ["- bread: now in the fridge"]


def test_what_was_ordered_is_no_guess_once_it_is_taken_back() -> None:
    talk = in_kitchen("slice the bread", "undo that", "what did you guess?")
    assert talk.told == ["Guessed, not asked for: nothing."]


def test_what_is_ruled_out_along_with_it_is_brought_back_before() -> None:
    talk = in_kitchen("put the apple in the fridge", "undo that, and never touch the apple")
    assert talk.told == []
    assert "Nothing has been changed" in talk.env.status()


def test_what_is_spared_stays_also_later() -> None:
    said = ("put the apple in the fridge, the mug in the sink", "undo that and leave the mug")
    talk = in_kitchen(*said, "thanks", "I'm hungry")
    assert talk.env.status().splitlines()[2:] == ["- mug 2: now in the sink basin"]
    other = in_kitchen(said[0], "undo that but not the mug", "I'm hungry")
    assert other.env.status().splitlines()[2:] == ["- mug 2: now in the sink basin"]
    shopping = Talk(shop())
    shopping.say("Add milk and eggs")
    shopping.say("undo that but keep the milk")
    assert shopping.env.basket == {"Whole Milk": 1}


def test_what_makes_room_for_another_thing_is_brought_back_after_it() -> None:
    talk = in_kitchen("put the pan on the counter, put the pot on stove burner 1", "undo that")
    assert "Nothing has been changed" in talk.env.status()


def test_undoing_brings_back_what_was_once_refused() -> None:
    talk = in_kitchen("don't move the apple", "put the apple in the fridge", "undo that")
    assert "Nothing has been changed" in talk.env.status()


def test_what_was_made_dirty_is_cleaned_and_a_push_is_told_to_stay() -> None:
    assert "Nothing has been changed" in in_kitchen("dirty plate 1", "undo that").env.status()
    told = in_kitchen("push the chair", "undo that").told
    assert told == ["I cannot undo that: push the chair."]


def test_a_purchase_is_told_to_stay() -> None:
    agent = Agent(shop(), WordModel(), method="no-goals")
    agent.step("What would you like?", "Add eggs")
    assert agent.step("What else?", "Buy the basket").terminated
    back = agent.step("What else?", "undo that")
    assert back.notes == ("The purchase cannot be undone.",)
    assert back.results == ()


def test_a_reversal_that_fails_is_told_and_one_that_breaks_leaves_all_as_it_was() -> None:
    agent = Agent(shop(), WordModel(), method="no-goals")
    agent.step("What would you like?", "Add eggs")
    held = agent.env.fingerprint()
    step = agent.env.step

    def stuck(action: Action) -> StepResult:
        if action.name == "remove item" and agent.env.fingerprint() == held:
            return StepResult(action, False, "The eggs are stuck.")
        return step(action)

    def broken(action: Action) -> StepResult:
        if action.name == "remove item":
            raise GoalscopeError("The shop is on fire.")
        return step(action)

    with patch.object(agent.env, "step", broken), pytest.raises(GoalscopeError, match="fire"):
        agent.step("What else?", "undo that")
    assert agent.env.fingerprint() == held
    assert len(agent.rounds) == 1
    with patch.object(agent.env, "step", stuck):
        back = agent.step("What else?", "undo that")
    assert back.results == ()
    assert "Not done: remove item: Large Eggs. The eggs are stuck." in back.notes
