"""Orders and refusals change the basket; questions, denials and statements change nothing."""

from __future__ import annotations

from unittest.mock import patch

import pytest

from fakes import said
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.grocery.hearing import requests as grammar
from goalscope.envs.grocery.hearing.hear import hear
from goalscope.envs.grocery.hearing.moods import Mood, clauses
from goalscope.envs.grocery.hearing.requests import amount
from goalscope.envs.grocery.search import Search
from goalscope.types import Action

CATALOGUE = Catalogue.load()
SEARCH = Search(CATALOGUE)
HELD = {
    "Large Eggs": 2,
    "Whole Milk": 1,
    "Instant Coffee": 1,
    "Chocolate Brownies": 1,
    "Bread Flour": 1,
    "Spreadable Butter": 1,
    "Whole Wheat Bread": 1,
    "Oat Milk": 1,
}


def after(*utterances: str) -> dict[str, int]:
    """The basket after these words, each of which is acted on in its turn."""
    shop = GroceryShop(CATALOGUE, search=SEARCH)
    for name, number in HELD.items():
        assert shop.step(Action("add item", name, number)).ok
    for number in range(1, len(utterances) + 1):
        turns = said(*utterances[:number])
        assert all(shop.step(action).ok for action in shop.requests(turns))
    return shop.basket


@pytest.mark.parametrize(
    "sentence",
    [
        "Did you remove the eggs?",
        "Why did you remove the eggs?",
        "Did you take the bread out?",
        "Did you add milk and remove the eggs?",
        "Add milk, and did you remove the eggs?",
        "Are you going to remove the eggs?",
        "Will the coffee be removed?",
        "Has the butter been taken out?",
        "Is it cheaper without the coffee?",
        "How much would it be without the coffee?",
        "What would the total be without the coffee?",
        "What if I remove the coffee?",
        "what if I remove the coffee",
        "Can I return the eggs?",
        "Can I cancel the coffee later?",
        "Can I return the coffee if it's bad?",
        "Should we drop the coffee?",
        "Who would return the butter?",
        "Who took the butter out?",
        "Should I start over?",
        "Do you only keep oat milk?",
        "Is there anything without nuts?",
        "Coffee out?",
        "The milk is out?",
        "Are the eggs not needed?",
        "Undo the coffee purchase later?",
        "I thought we put the butter back?",
        "Can you drop it off at my house?",
        "Should I take the coffee off the list?",
        "Do you think we should remove the eggs?",
    ],
)
def test_a_question_changes_nothing(sentence: str) -> None:
    assert after(sentence) == HELD
    assert hear([sentence]).diets == frozenset()


@pytest.mark.parametrize(
    "sentence",
    [
        "I didn't ask you to remove the eggs.",
        "I didn't ask you to take the bread out and remove the eggs.",
        "I never said to drop the coffee.",
        "I said not to remove the butter.",
        "I don't need you to remove the eggs.",
        "It wasn't me who wanted to delete the eggs.",
        "No need to remove the coffee.",
        "There's no reason to take out the coffee.",
        "No reason to delete the coffee.",
        "Under no circumstances remove the coffee.",
        "Don't you dare remove the coffee.",
        "You can't lose the coffee",
        "You didn't add the butter!",
        "You did not add the butter, did you?",
        "I don't want to start over.",
        "I don't want to empty the cart.",
        "Please don't make me start over!",
        "We can't do without coffee.",
        "I can't live without chocolate.",
        "So don't let me leave without coffee.",
        "I would never skip the coffee.",
        "My kids never have enough bread.",
        "We'll never have enough coffee!",
        "If you don't have oat milk, almond milk is fine.",
        "If they don't have oat milk, we wait.",
        "I don't dislike eggs.",
        "I am not avoiding gluten.",
        "I no longer avoid gluten.",
        "My daughter is no longer allergic to eggs.",
        "I'm not lactose intolerant.",
        "Remove 0 eggs.",
        "0 eggs",
    ],
)
def test_a_denial_changes_nothing(sentence: str) -> None:
    assert after(sentence) == HELD
    assert hear([sentence]).diets == frozenset()


@pytest.mark.parametrize(
    "sentence",
    [
        "We only keep butter in the fridge.",
        "I only keep eggs at home",
        "We just keep coffee for guests.",
        "You should only keep fresh bread there.",
        "I'll bake a cake from scratch using butter and flour.",
        "I bake from scratch using butter and flour",
        "I trade coffee for tea with my neighbour",
        "My sister wants to swap coffee for wine every day",
        "I forgot to drop the coffee at work",
        "I need to drop the coffee off at grandma's",
        "I meant to return the coffee to my sister",
        "The coffee must go in the cupboard.",
        "My husband threw the eggs away",
        "Looks good, drop it off tomorrow.",
        "Perfect. I'll pick it up, so don't take it off the shelf",
    ],
)
def test_a_statement_changes_nothing(sentence: str) -> None:
    assert after(sentence) == HELD


@pytest.mark.parametrize(
    ("sentence", "gone"),
    [
        ("Can I remove the eggs?", "Large Eggs"),
        ("Would you remove the eggs, please?", "Large Eggs"),
        ("Would you mind removing the eggs?", "Large Eggs"),
        ("Is it possible to remove the eggs?", "Large Eggs"),
        ("What about removing the eggs?", "Large Eggs"),
        ("Remove the eggs, would you?", "Large Eggs"),
        ("It would be great if you could remove the eggs", "Large Eggs"),
        ("I think we should drop the coffee", "Instant Coffee"),
        ("Please don't forget to remove the coffee", "Instant Coffee"),
        ("Since we have coffee at home, remove the coffee", "Instant Coffee"),
        ("I have coffee at home, so take the coffee out", "Instant Coffee"),
        ("Do you have tofu? If not, remove the coffee.", "Instant Coffee"),
        ("Everything is fine but please remove the coffee.", "Instant Coffee"),
        ("I no longer need coffee", "Instant Coffee"),
        ("Could you do it without coffee?", "Instant Coffee"),
        ("The coffee can go.", "Instant Coffee"),
        ("No, actually, I wanted to take the coffee out", "Instant Coffee"),
        ("Hi there, could I actually drop the coffee?", "Instant Coffee"),
        ("Sure, we will have to take the coffee out", "Instant Coffee"),
        ("Set the eggs to 0", "Large Eggs"),
        ("Change the eggs to zero", "Large Eggs"),
        ("Scratch the coffee", "Instant Coffee"),
        ("Not the whole milk, the oat milk.", "Whole Milk"),
        ("Not the large eggs, I meant the oat milk.", "Large Eggs"),
    ],
)
def test_an_order_however_polite_takes_out_what_it_names(sentence: str, gone: str) -> None:
    assert after(sentence) == {name: n for name, n in HELD.items() if name != gone}


@pytest.mark.parametrize("order", ["Only keep the eggs", "Can you just keep the eggs?"])
def test_an_order_to_keep_one_thing_takes_the_rest_out(order: str) -> None:
    assert after(order) == {"Large Eggs": 2}


@pytest.mark.parametrize(
    ("sentence", "basket"),
    [
        ("Clear the basket and add one large eggs.", {"Large Eggs": 1}),
        ("Clear the basket and add 3 packs of large eggs.", {"Large Eggs": 3}),
        ("Empty the cart, then add whole milk.", {"Whole Milk": 1}),
        ("Clear the basket. I'll go ahead and take garlic, please", {"Garlic": 1}),
        ("Start over: two garlic and 2 oat milk", {"Garlic": 2, "Oat Milk": 2}),
        ("Can we start over? I want garlic.", {"Garlic": 1}),
    ],
)
def test_what_is_asked_for_beside_clearing_is_there_afterwards(
    sentence: str, basket: dict[str, int]
) -> None:
    assert after(sentence) == basket


@pytest.mark.parametrize(
    ("sentence", "eggs"),
    [
        ("Remove one large egg and add 4 packs of large eggs", 4),
        ("Remove the large eggs and add 3 packs of large eggs", 3),
        ("Remove one large egg and add one more large egg", 2),
        ("Remove one large egg. Remove 2 large eggs.", 0),
    ],
)
def test_additions_count_from_what_the_removals_leave(sentence: str, eggs: int) -> None:
    assert after(sentence).get("Large Eggs", 0) == eggs


@pytest.mark.parametrize(
    ("sentence", "diet"),
    [
        ("What can I get for my son, who is allergic to nuts?", "nut-free"),
        ("Can you add a cake? She can't eat gluten.", "gluten-free"),
        ("Don't forget I'm allergic to nuts.", "nut-free"),
        ("I'm not fussy but I'm allergic to eggs", "egg-free"),
        ("If you have cake, remember that I am allergic to eggs", "egg-free"),
    ],
)
def test_an_allergy_counts_in_whatever_is_said(sentence: str, diet: str) -> None:
    assert hear([sentence]).diets == {diet}


def test_each_clause_has_its_own_mood_and_what_is_joined_has_the_same() -> None:
    text = "did you add milk and remove the eggs? i never drop it, so please remove the ham."
    assert [(mood.name, clause) for clause, mood in clauses(text)] == [
        ("QUESTION", "did you add milk."),
        ("QUESTION", "remove the eggs?"),
        ("STATEMENT", "i never drop it."),
        ("ORDER", "remove the ham."),
    ]
    assert list(clauses("")) == []
    assert [mood for _, mood in clauses("ham?")] == [Mood.STATEMENT]


@pytest.mark.parametrize("part", ["a ", "one ", "a few ", "milk , ", "a is milk "])
def test_an_amount_is_sought_in_few_words_at_a_time(
    part: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    lengths: list[int] = []
    counted = vars(grammar)["_counted"]

    def seen(words: str) -> object:
        lengths.append(len(words.split()))
        return counted(words)

    monkeypatch.setattr(grammar, "_counted", seen)
    for thing in ("milk", "ham"):
        amount(thing, f"{part * (2000 // len(part))}, a ham that is not. ")
    assert lengths
    assert max(lengths) <= 12
    assert len(lengths) <= 1200


def test_a_term_that_many_items_serve_is_counted_once() -> None:
    shop = GroceryShop(CATALOGUE, search=SEARCH)
    with patch("goalscope.envs.grocery.shop.amount", wraps=amount) as counting:
        assert len(shop.actions(["milk"], said("A party for 8, with 3 bottles of milk"))) > 1
    assert counting.call_count == 1
