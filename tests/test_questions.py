"""What a question is after, and what the agent answers from what it did and what holds."""

from __future__ import annotations

from decimal import Decimal

import pytest

from fakes import GOALS, NEEDS, LampRoom, WordModel
from goalscope.agent.agent import Agent
from goalscope.agent.answers import UNKNOWN
from goalscope.base.types import Action
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.grocery.catalogue import Item
from goalscope.language.dialogue_state import DialogueState
from goalscope.language.orders import Order
from goalscope.language.questions import Question, asks_of_undo, kind_of, questions_in
from lamps import REPLIES
from shops import PICK
from test_dietary import stocked


@pytest.mark.parametrize(
    ("said", "thing", "kind"),
    [
        ("So what exactly have you done?", "", "done"),
        ("Have you touched the knife?", "knife", "done"),
        ("what did you add", "", "added"),
        ("Did you add the milk?", "milk", "added"),
        ("did you take the cake away?", "cake", "removed"),
        ("what did you add that I didn't ask for?", "", "guessed"),
        ("Which of these were your own idea?", "", "guessed"),
        ("what's the flour for?", "flour", "origin"),
        ("why is there bacon in my basket?", "bacon", "origin"),
        ("since when is the bread in there?", "bread", "origin"),
        ("what did I ask you for?", "", "asked"),
        ("is there any pork in the basket?", "pork", "any"),
        ("does any of this contain gluten?", "", "any"),
        ("how much is that now?", "", "total"),
        ("how many eggs are there?", "eggs", "count"),
        ("is that enough for ten?", "", "enough"),
        ("What can I say?", "", "abilities"),
        ("what would undo take back?", "", "undoing"),
        ("why do you still think it's bolognese?", "bolognese", "belief"),
        ("do you have oat milk?", "oat milk", "facts"),
        ("Where is the mug?", "mug", "facts"),
        ("What is the meaning of life?", "", "facts"),
        ("Brr \U0001f976", "", "facts"),
    ],
)
def test_a_question_is_of_the_kind_of_the_nearest_phrasings(said, thing, kind) -> None:
    assert kind_of(said, [thing]) == kind


def test_a_thing_of_earlier_words_counts_only_where_facts_are_asked_for() -> None:
    asked = [Order("ask", "oat milk"), Order("add", "milk")]
    assert questions_in("How much is it?", asked) == [Question("oat milk", "", "How much is it?")]
    assert questions_in("What did you add?", asked)[0].what == ""


def test_words_that_only_ask_what_an_undo_does_undo_nothing() -> None:
    assert asks_of_undo("What would undo take back?")
    assert not asks_of_undo("Could you undo that?")
    assert not asks_of_undo("What would undo take back")
    env = LampRoom(["lamp"])
    reads = {"What would undo take back?": "undo"}
    agent = Agent(env, WordModel(REPLIES, reads=reads), method="no-goals")
    agent.step("", "switch on lamp")
    agent.step("", "What would undo take back?")
    assert env.on == ["lamp"]
    told = 'Undo takes back what came of "switch on lamp": switch on: lamp.'
    assert agent.ask().splitlines()[0] == told


SAID = {
    "Lamp and book": "aim lamp", "Please switch on the fan": "switch on fan",
    "Fan off again": "switch off fan", "No moon!": "avoid moon",
}  # fmt: skip
ANSWERS = [
    ("What did you do?", "", "So far: switch on: book, lamp, fan; switch off: fan."),
    ("Did you touch the cup?", "cup", 'I did nothing with "cup", and know of no order'),
    ("What did you add?", "", "I guessed book, lamp."),
    ("What did you remove?", "", 'Taken out: switch off: fan (you said "Fan off again")'),
    ("Did you remove the lamp?", "lamp", "Not taken out: switch on: lamp (my guess"),
    ("What was your own idea?", "", 'book, lamp (my guess, since you said "Lamp and book").'),
    ("Why is the lamp there?", "lamp", 'switch on: lamp (my guess, since you'),
    ("Why is there no moon?", "moon", 'I did nothing with "moon"; you said "No moon!".'),
    ("Did you touch a moon?", "moon", 'I did nothing with "moon"; you said "No moon!".'),
    ("Why did you do that?", "", 'switch off: fan (you said "Fan off again").'),
    ("What did I ask you for?", "", "I understood: switch on fan; switch off fan; avoid moon."),
    ("What can I say?", "", "I know these orders: switch on, switch off, smash, finish, undo. Say"),
    ("What would undo take back?", "", 'Undo takes back what came of "No moon!".'),
    ("What do you think I want?", "", "I go by your words alone, and make out no goal behind"),
    ("Is the lamp on?", "lamp", "On: book, lamp."),
    ("Is the moon on?", "moon", UNKNOWN),
]  # fmt: skip


@pytest.mark.parametrize(("question", "thing", "told"), ANSWERS)
def test_every_domain_answers_from_what_was_done_and_said(question, thing, told) -> None:
    reads = {**SAID, question: f"ask {thing}".strip()}
    model = WordModel({GOALS: "", NEEDS: "needed: lamp, book"}, reads=reads)
    env = LampRoom(["lamp", "fan", "book"])
    agent = Agent(env, model, method="no-goals")
    assert agent.ask()
    for words in SAID:
        agent.step("", words)
    assert env.on == ["book", "lamp"]
    agent.step("", question)
    assert env.on == ["book", "lamp"]
    assert agent.ask().startswith(told)


def test_a_goal_is_told_with_the_guess_that_it_led_to_and_why_it_is_believed() -> None:
    reads = {"Why is the lamp on?": "ask lamp", "Why light?": "ask light"}
    agent = Agent(LampRoom(["lamp"]), WordModel(REPLIES, reads=reads))
    agent.step("", "lamp light please")
    agent.step("", "Why is the lamp on?")
    told = 'switch on: lamp (my guess to have lamp light, since you said "lamp light please").'
    assert agent.ask().splitlines()[0] == told


HELD = "2 x Smoked Bacon, 1 x Tomato Soup, 1 x Carrots"
NO_EGG, NO_SPAGHETTI = (
    f'There is no "{name}" in the basket, as far as names and labels tell.'
    for name in ("egg", "spaghetti")
)
ROWS = (
    ("Smoked Bacon", "meat"), ("Italian Sausages", "meat"), ("Tomato Soup", "soup"),
    ("Carrots", "produce"), ("Spaghetti", "pasta"), ("Ground Pork", "meat"),
)  # fmt: skip


@pytest.mark.parametrize(
    ("said", "what", "told"),
    [
        ("is there any pork in the basket?", "pork", "Yes: 2 x Smoked Bacon. Not known: Tomato"),
        ("does any of this contain pork?", "", "Yes: 2 x Smoked Bacon. Not known: Tomato Soup."),
        ("are there any carrots in there?", "carrots", "Yes: 1 x Carrots."),
        ("is there any egg in it?", "egg", f"{NO_EGG} Not known: Smoked Bacon, Tomato Soup."),
        ("is there any spaghetti in the basket?", "spaghetti", f"{NO_SPAGHETTI} The shop has Sp"),
        ("how much are the carrots?", "carrots", "The shop has Carrots, $4.00, 1 in the basket."),
        ("how many carrots are there?", "carrots", "1 in all: 1 x Carrots."),
        ("how many things are there in all?", "", f"4 in all: {HELD}."),
        ("is that enough for ten?", "", "No label tells for how many Smoked Bacon, Tomato Soup, C"),
        ("what does it all come to?", "", "It comes to $9.00."),
        ("what is in the basket?", "", f"The basket holds {HELD}. It comes to $9.00."),
        ("is it all vegetarian?", "", "Known to be vegetarian: Carrots. Not known"),
    ],
)  # fmt: skip
def test_the_shop_answers_for_the_basket_by_names_and_labels(said, what, told) -> None:
    opened = stocked(*ROWS)
    for name, number in (("Smoked Bacon", 2), ("Tomato Soup", 1), ("Carrots", 1)):
        opened.step(Action("add item", name, number))
    (question,) = questions_in(said, [Order("ask", what)])
    assert opened.answer(question, DialogueState(), PICK).startswith(told)


def test_labels_may_tell_for_how_many_a_thing_will_do() -> None:
    soup = Item(1, "Soup", price=Decimal(2), tags=frozenset({"serves 4"}))
    opened = GroceryShop(Catalogue((soup, Item(2, "Rice", unit="10 servings"), Item(3, "Jam"))))
    for item in ("Soup", "Rice", "Jam"):
        opened.step(Action("add item", item))
    told = opened.answer(Question(kind="enough"), DialogueState(), PICK)
    assert told == "Soup serves 4; Rice serves 10; No label tells for how many Jam will do."
