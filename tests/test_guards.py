"""What is listed and confirmed before it is lost, and what a reading may have missed."""

from __future__ import annotations

from dataclasses import replace

import pytest

import shops
from fakes import LampRoom, Plans, WordModel, plans
from goalscope.agent.agent import Agent
from goalscope.agent.executor import KEPT_IN_FULL
from goalscope.agent.guards import HARM, SAY_YES, by_number, misses_an_exception
from goalscope.agent.round import Guess
from goalscope.base.types import Action
from goalscope.envs import Resolution
from goalscope.envs.grocery import GroceryShop
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.language.orders import Order, Reading, Verb, orders_from_text
from lamps import REPLIES, agent_in

HERE = "on: lamp; several: egg 1-3, stove burner 1-4, mug 1-2"


def shopping(**reads: str) -> tuple[GroceryShop, Agent]:
    """An agent in a shop, with milk, eggs and bread in the basket that were asked for."""
    shop = shops.shop()
    said = {key.replace("_", " "): orders for key, orders in reads.items()}
    agent = agent_in(shop, "no-goals", model=WordModel(REPLIES, reads=said))
    agent.step("", "add milk; add eggs; add bread")
    return shop, agent


def test_to_empty_the_basket_waits_for_a_yes_to_the_list_of_what_is_lost() -> None:
    shop, agent = shopping(rather_not="yes")
    round = agent.step("", "clear")
    assert round.question == (
        f'I understood "clear" (Whole Milk, Large Eggs, White Sandwich Bread). {SAY_YES}'
    )
    assert len(shop.basket) == 3
    agent.step(agent.ask(), "rather not")
    assert len(shop.basket) == 3
    agent.step(agent.ask(), "yes")
    assert shop.basket == {}


def test_an_allergy_that_many_words_hide_is_found_clause_by_clause() -> None:
    whole = "lunch for her, she is coeliac, so no gluten, and a loaf"
    reads = {
        whole: "aim lunch\nadd loaf",
        "lunch for her,": "aim lunch",
        "she is coeliac,": "add rye bread",
        "so no gluten,": "avoid gluten | why allergy",
        "and a loaf": "add loaf",
    }
    shop = shops.shop()
    agent = agent_in(shop, "no-goals", model=WordModel(REPLIES, reads=reads))
    round = agent.step("", whole)
    assert round.reading
    assert [str(each.do) for each in round.reading.orders] == ["avoid", "aim", "add"]
    assert "Gluten-Free White Bread" in shop.basket
    assert round.question == ""


def test_where_no_clause_names_what_harms_the_agent_asks() -> None:
    whole = "he is allergic to work, and two teas"
    reads = {whole: "add tea | 2", "he is allergic to work,": "none", "and two teas": "add tea | 2"}
    shop = shops.shop()
    round = agent_in(shop, "no-goals", model=WordModel(REPLIES, reads=reads)).step("", whole)
    assert round.question == HARM
    assert shop.basket == {}


@pytest.mark.parametrize(
    ("said", "orders", "held"),
    [
        (
            "yes please, and tea",
            "yes; add tea | 1",
            {"Large Eggs", "Bananas", "English Breakfast Tea Bags"},
        ),
        ("yeah the eggs, and tea", "yes; add tea", {"Large Eggs", "English Breakfast Tea Bags"}),
        ("ok, tea", "yes; add tea", {"English Breakfast Tea Bags"}),
        ("and tea", "yes; add tea", {"English Breakfast Tea Bags"}),
        ("yes but no eggs, and tea", "no; add tea", {"English Breakfast Tea Bags"}),
    ],
)
def test_a_yes_that_comes_first_counts_beside_other_orders(said, orders, held) -> None:
    shop = shops.shop()
    model = WordModel(REPLIES, reads={said: orders.replace("; ", "\n")})
    agent = agent_in(shop, "no-goals", model=model)
    model.margins = (0.01, 0.01)
    round = agent.step("", "add eggs; add bananas")
    assert round.question.endswith("Shall I?")
    model.margins = None
    round = agent.step(agent.ask(), said)
    assert {*shop.basket} == held
    assert ("Not done" in " ".join(round.notes)) is (len(held) < 3)


@pytest.mark.parametrize(
    ("said", "orders", "basket"),
    [
        ("another milk", "add milk", 2),
        ("one more carton of milk please", "add milk | 1 carton", 2),
        ("Two more milk", "add milk | 2", 3),
        ("a 2nd milk", "add milk | 2", 2),
        ("milk", "add milk", 1),
        ("make it 2 milk", "set milk | 2", 2),
        ("another bread and milk", "add milk", 1),
    ],
)
def test_another_is_one_more_than_there_is(said: str, orders: str, basket: int) -> None:
    shop, agent = shopping(**{said.replace(" ", "_"): orders})
    agent.step(agent.ask(), said)
    assert shop.basket["Whole Milk"] == basket


@pytest.mark.parametrize(
    ("said", "waits"),
    [
        ("from scratch, no cake mix", True),
        ("No more cake mix please", True),
        ("we have no cake mix", False),
        ("there's no cake mix left", False),
        ("cake mix, no rush", False),
    ],
)
def test_what_is_not_to_come_is_asked_about_if_it_was_read_as_an_order(said, waits) -> None:
    shop = shops.shop()
    model = WordModel(REPLIES, reads={said: "add cake mix"})
    round = agent_in(shop, "no-goals", model=model).step("", said)
    assert round.question.endswith("Shall I?") is waits
    assert (shop.basket == {}) is waits


def test_no_more_of_a_thing_is_none_of_it() -> None:
    shop, agent = shopping(**{"more_milk": "add milk | 2", "no_more_milk": "remove milk"})
    agent.step(agent.ask(), "more milk")
    assert shop.basket["Whole Milk"] == 2
    agent.step(agent.ask(), "no more milk")
    assert "Whole Milk" not in shop.basket


def test_another_is_more_than_was_guessed() -> None:
    shop = shops.shop()
    agent = agent_in(shop, model=WordModel(REPLIES, reads={"another milk": "add milk"}))
    plans(agent, Plans([Action("add item", "Whole Milk")]))
    agent.step(agent.ask(), "have lamp light please")
    assert shop.basket == {"Whole Milk": 1}
    agent.step(agent.ask(), "another milk")
    assert shop.basket == {"Whole Milk": 2}


def test_what_is_excepted_stays_and_is_not_listed() -> None:
    shop, agent = shopping()
    round = agent.step("", "clear | but milk")
    assert "(Large Eggs, White Sandwich Bread)" in round.question
    agent.step(agent.ask(), "yes")
    assert shop.basket == {"Whole Milk": 1}


@pytest.mark.parametrize("order", ["remove food", "avoid food | why taste"])
def test_several_things_that_were_asked_for_go_only_after_a_yes(order: str) -> None:
    class Pantry(LampRoom):
        def resolve(self, order, dialogue, pick):
            if order.what != "food":
                return super().resolve(order, dialogue, pick)
            return Resolution(tuple(Action("switch off", each) for each in self.on))

    env = Pantry(["rice", "beans", "salt"])
    agent = agent_in(env)
    order = order.replace("remove", "switch off")
    agent.step("", "switch on rice; switch on beans")
    round = agent.step("", order)
    assert "(rice, beans)" in round.question
    assert env.on == ["rice", "beans"]
    agent.step(agent.ask(), "yes")
    assert env.on == []
    limits = agent._executor.dialogue_state(agent.rounds).limits
    assert [each.what for each in limits] == ["food"] * order.startswith("avoid")


def test_guesses_and_single_things_go_without_a_question() -> None:
    class Pantry(LampRoom):
        def resolve(self, order, dialogue, pick):
            return Resolution(tuple(Action("switch off", each) for each in self.on))

    class GuessingPlans(Plans):
        def act(self, *args):
            outcome = super().act(*args)
            guesses = (Guess(each.action.target, "supper") for each in outcome.results)
            return replace(outcome, guessed=tuple(guesses))

    env = Pantry(["rice", "beans"])
    agent = agent_in(env)
    plans(agent, GuessingPlans([Action("switch on", each) for each in env.names]))
    agent.step("", "aim supper")
    assert env.on == ["rice", "beans"]
    agent.step("", "switch off food")
    assert env.on == []
    shop, agent = shopping()
    agent.step("", "remove milk; remove eggs")
    agent.step("", "clear")
    assert shop.basket == {}


def test_an_allergy_takes_away_at_once_what_may_harm() -> None:
    shop, agent = shopping()
    agent.step("", "add peanut butter; add peanuts; avoid peanuts | why allergy")
    assert not any("eanut" in name for name in shop.basket)


def test_to_undo_everything_lists_what_goes_and_spares_what_is_excepted() -> None:
    shop, agent = shopping()
    assert agent.step("", "undo everything | but milk").results == ()
    round = agent.step("", "undo everything")
    assert "(Whole Milk, Large Eggs, White Sandwich Bread)" in round.question
    assert agent.step(agent.ask(), "yes").retracts == (1,)
    assert shop.basket == {}


def test_a_yes_to_what_an_allergy_forbids_brings_what_was_listed() -> None:
    shop, agent = shopping()
    agent.step("", "avoid almonds | why allergy")
    round = agent.step("", "add almonds")
    assert len(round.listed) == 1
    agent.step(agent.ask(), "yes")
    assert round.listed[0].target in shop.basket


def test_all_things_are_listed_if_one_of_them_was_not_named() -> None:
    with HomeRobot(HouseController("Kitchen1")) as home:
        agent = agent_in(home, "no-goals")
        round = agent.step("", "break egg | 3")
        assert 'I understood "break egg (3)" (egg 1, egg 2, egg 3).' in round.question
        agent.step("", "no")
        assert 'I understood "break egg 3". ' in agent.step("", "break egg 3").question


@pytest.mark.parametrize(
    ("said", "read", "meant"),
    [
        ("crack egg 3", "break egg | 3", "break egg 3"),
        ("Turn on burner 3.", "turn on burner | where 3", "turn on burner 3"),
        ("turn on burner three", "turn on burner | where three", "turn on burner 3"),
        ("open cupboard 2", "open cupboard | 2", "open cupboard 2"),
        ("put egg 2 on counter 1", "put egg | where counter", "put egg 2 | where counter 1"),
        ("wash mug 1, then mug 2", "clean mug | 1\nclean mug | 2", "clean mug 1\nclean mug 2"),
        ("crack 3 eggs", "break eggs | 3", "break eggs | 3"),
        ("crack eggs 2", "break eggs | 2", "break eggs | 2"),
        ("slice bread 2 times", "slice bread | 2", "slice bread | 2"),
        ("put mug 1 in the box", "put mug | 1 | where box", "put mug 1 | where box"),
    ],
)
def test_a_number_behind_a_thing_is_part_of_its_name(said: str, read: str, meant: str) -> None:
    verbs = HomeRobot.verbs
    reading = by_number(Reading(orders_from_text(read, verbs)), said, HERE)
    assert reading.orders == orders_from_text(meant, verbs)


def test_where_no_things_are_numbered_a_number_is_an_amount() -> None:
    reading = Reading((Order("add", "milk", 2),))
    assert by_number(reading, "milk 2", "1 x Brown Bread") == reading


@pytest.mark.parametrize(
    ("said", "read", "missed"),
    [
        ("close everything except the fridge", "close fridge", True),
        ("close everything except the fridge", "close everything | but fridge", False),
        ("all but the lamp off", "turn off lamp", True),
        ("Add milk and eggs, no wait, not the eggs.", "add eggs", True),
        ("Add milk and eggs, no wait, not the eggs.", "add milk", False),
        ("apples, pears and plums - actually, scratch the pears", "add pears", True),
        ("scratch the pears", "add pears", False),
        ("bread, and don't forget the milk", "add milk", False),
        ("close the lot, but leave the fridge", "close everything\nleave fridge", False),
        ("I accept, close the fridge", "close fridge", False),
        ("not now. close the fridge", "close fridge", False),
    ],
)
def test_an_exception_that_the_reading_lacks_is_noticed(said: str, read: str, missed: bool) -> None:
    verbs = (*HomeRobot.verbs, Verb("add", ""))
    reading = Reading(orders_from_text(read, verbs))
    assert misses_an_exception(said, reading.orders[0], reading) == missed


def test_a_limit_that_may_lack_an_exception_waits_and_binds_after_a_yes() -> None:
    env = LampRoom(["fan", "lamp"])
    model = WordModel(REPLIES, reads={"no light except the lamp": "avoid lamp | why taste"})
    agent = agent_in(env, model=model)
    assert agent.step("", "no light except the lamp").awaits == "word"
    assert agent._executor.dialogue_state(agent.rounds).limits == ()
    agent.step(agent.ask(), "yes")
    (limit,) = agent._executor.dialogue_state(agent.rounds).limits
    assert limit == Order("avoid", "lamp", why="taste")


def test_a_diet_has_no_exception_and_says_so() -> None:
    env = LampRoom(["fan", "lamp"])
    reads = dict.fromkeys(("no light except the lamp", "not any light"), "avoid light | why diet")
    agent = agent_in(env, model=WordModel(REPLIES, reads=reads))
    kept = KEPT_IN_FULL.format("avoid light (diet)")
    assert kept in agent.step("", "no light except the lamp").notes
    assert kept not in agent.step("", "not any light").notes
