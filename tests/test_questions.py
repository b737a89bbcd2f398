"""What the agent answers from what it did and what holds."""

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
from goalscope.language.orders import Order, orders_from_text
from goalscope.language.questions import about_of, told_about
from lamps import REPLIES
from shops import PICK
from test_dietary import stocked


@pytest.mark.parametrize(
    ("said", "thing", "about"),
    [
        ("So what exactly have you done?", "", "done"),
        ("Have you touched the knife?", "knife", "done"),
        ("what did you add", "", "added"),
        ("Did you add the milk?", "milk", "added"),
        ("did you take the cake away?", "cake", "removed"),
        ("what did you add that I didn't ask for?", "", "guessed"),
        ("Which of these were your own idea?", "", "guessed"),
        ("what's the flour for?", "flour", "why"),
        ("why is there bacon in my basket?", "bacon", "why"),
        ("since when is the bread in there?", "bread", "why"),
        ("what did I ask you for?", "", "asked"),
        ("is there any pork in the basket?", "pork", "any"),
        ("does any of this contain gluten?", "", "any"),
        ("how much is that now?", "", "total"),
        ("how many eggs are there?", "eggs", "count"),
        ("is that enough for ten?", "", "enough"),
        ("What can I say?", "", "abilities"),
        ("what would undo take back?", "", "undo"),
        ("why do you still think it's bolognese?", "bolognese", "goal"),
        ("do you have oat milk?", "oat milk", ""),
        ("Where is the mug?", "mug", ""),
        ("What is the meaning of life?", "", ""),
        ("Brr \U0001f976", "", ""),
    ],
)
def test_a_question_is_about_what_its_nearest_phrasings_are_about(said, thing, about) -> None:
    assert about_of(said, [thing]) == about


def test_an_adapter_that_was_not_taught_it_is_told_what_a_question_is_about() -> None:
    asked = [Order("ask", "oat milk"), Order("add", "milk")]
    assert told_about(asked, "How much is it?") == (*asked,)
    assert told_about(asked, "What did you add?")[0] == Order("ask", about="added")
    undone = [Order("undo")]
    assert told_about(undone, "What would undo take back?") == (Order("ask", about="undo"),)
    assert told_about(undone, "Could you undo that?") == (*undone,)
    assert told_about(undone, "What would undo take back") == (*undone,)


SAID = {
    "Lamp and book": "aim lamp", "Please switch on the fan": "switch on fan",
    "Fan off again": "switch off fan", "No moon!": "avoid moon",
}  # fmt: skip
ANSWERS = [
    (
        "What did you do?",
        "ask | about done",
        "So far: switch on: book, lamp, fan; switch off: fan.",
    ),
    (
        "Did you touch the cup?",
        "ask cup | about done",
        'I did nothing with "cup", and know of no order',
    ),
    ("What did you add?", "ask | about added", "I guessed book, lamp."),
    (
        "What did you remove?",
        "ask | about removed",
        'Taken out: switch off: fan (you said "Fan off again")',
    ),
    (
        "Did you remove the lamp?",
        "ask lamp | about removed",
        "Not taken out: switch on: lamp (my guess",
    ),
    (
        "What was your own idea?",
        "ask | about guessed",
        'book, lamp (my guess, since you said "Lamp and book").',
    ),
    ("Why is the lamp there?", "ask lamp | about why", "switch on: lamp (my guess, since you"),
    (
        "Why is there no moon?",
        "ask moon | about why",
        'I did nothing with "moon"; you said "No moon!".',
    ),
    (
        "Did you touch a moon?",
        "ask moon | about done",
        'I did nothing with "moon"; you said "No moon!".',
    ),
    ("Why did you do that?", "ask | about why", 'switch off: fan (you said "Fan off again").'),
    (
        "What did I ask you for?",
        "ask | about asked",
        "I understood: switch on fan; switch off fan; avoid moon.",
    ),
    (
        "What can I say?",
        "ask | about abilities",
        "I know these orders: switch on, switch off, smash, finish, undo. Say",
    ),
    ("What would undo take back?", "ask | about undo", 'Undo takes back what came of "No moon!".'),
    (
        "What do you think I want?",
        "ask | about goal",
        "I go by your words alone, and make out no goal behind",
    ),
    ("Is the lamp on?", "ask lamp", "On: book, lamp."),
    ("Is the moon on?", "ask moon", UNKNOWN),
]


@pytest.mark.parametrize(("question", "read", "told"), ANSWERS)
def test_every_domain_answers_from_what_was_done_and_said(question, read, told) -> None:
    reads = {**SAID, question: read}
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
    reads = {"Why is the lamp on?": "ask lamp | about why"}
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
    ("said", "read", "told"),
    [
        (
            "is there any pork in the basket?",
            "ask pork | about any",
            "Yes: 2 x Smoked Bacon. Not known: Tomato",
        ),
        (
            "does any of this contain pork?",
            "ask | about any",
            "Yes: 2 x Smoked Bacon. Not known: Tomato Soup.",
        ),
        ("are there any carrots in there?", "ask carrots | about any", "Yes: 1 x Carrots."),
        (
            "is there any egg in it?",
            "ask egg | about any",
            f"{NO_EGG} Not known: Smoked Bacon, Tomato Soup.",
        ),
        (
            "is there any spaghetti in the basket?",
            "ask spaghetti | about any",
            f"{NO_SPAGHETTI} The shop has Sp",
        ),
        (
            "how much are the carrots?",
            "ask carrots",
            "The shop has Carrots, $4.00, 1 in the basket.",
        ),
        ("how many carrots are there?", "ask carrots | about count", "1 in all: 1 x Carrots."),
        ("how many things are there in all?", "ask | about count", f"4 in all: {HELD}."),
        (
            "is that enough for ten?",
            "ask | about enough",
            "No label tells for how many Smoked Bacon, Tomato Soup, C",
        ),
        ("what does it all come to?", "ask | about total", "It comes to $9.00."),
        ("what is in the basket?", "ask", f"The basket holds {HELD}. It comes to $9.00."),
        ("is it all vegetarian?", "ask", "Known to be vegetarian: Carrots. Not known"),
    ],
)
def test_the_shop_answers_for_the_basket_by_names_and_labels(said, read, told) -> None:
    opened = stocked(*ROWS)
    for name, number in (("Smoked Bacon", 2), ("Tomato Soup", 1), ("Carrots", 1)):
        opened.step(Action("add item", name, number))
    (question,) = orders_from_text(read, opened.verbs)
    assert opened.answer(question, said, DialogueState(), PICK).startswith(told)


def test_labels_may_tell_for_how_many_a_thing_will_do() -> None:
    soup = Item(1, "Soup", price=Decimal(2), tags=frozenset({"serves 4"}))
    opened = GroceryShop(Catalogue((soup, Item(2, "Rice", unit="10 servings"), Item(3, "Jam"))))
    for item in ("Soup", "Rice", "Jam"):
        opened.step(Action("add item", item))
    told = opened.answer(Order("ask", about="enough"), "", DialogueState(), PICK)
    assert told == "Soup serves 4; Rice serves 10; No label tells for how many Jam will do."
