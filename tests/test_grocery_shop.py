"""The shop keeps its promises: the basket, the purchase, the search and the answers."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fakes import said
from goalscope.envs import Environment
from goalscope.envs.grocery import Catalogue, GroceryShop, Item, load_profiles
from goalscope.envs.grocery.search import Search
from goalscope.types import Action, Profile, Turn

CATALOGUE = Catalogue.load()
SEARCH = Search(CATALOGUE)
NAMES = [item.name for item in CATALOGUE.items[:40]]
additions = st.lists(st.tuples(st.sampled_from(NAMES), st.integers(1, 3)), max_size=12)


def shop(*bought: tuple[str, int]) -> GroceryShop:
    opened = GroceryShop(CATALOGUE, search=SEARCH)
    for name, number in bought:
        assert opened.step(Action("add item", name, number)).ok
    return opened


def test_the_shop_is_an_environment() -> None:
    environment: Environment = shop()
    assert environment.is_completion(Turn("", environment.completion_phrase))


@settings(max_examples=60)
@given(additions)
def test_the_total_is_the_sum_of_prices(added: list[tuple[str, int]]) -> None:
    prices = ((CATALOGUE.get(name), number) for name, number in added)
    assert shop(*added).total == sum((i.price * n for i, n in prices if i and i.price), Decimal(0))


@settings(max_examples=60)
@given(additions, st.sampled_from(NAMES), st.integers(1, 9))
def test_adding_then_removing_changes_nothing(
    added: list[tuple[str, int]], name: str, number: int
) -> None:
    opened = shop(*added)
    before = opened.status()
    assert opened.step(Action("add item", name, number)).ok
    assert opened.status() != before
    assert opened.step(Action("remove item", name, number)).ok
    assert opened.status() == before


@pytest.mark.parametrize("quantity", [0, -1, 10**9, 100, float("nan"), 1.5, 1.0, True, "2", None])
@pytest.mark.parametrize("act", ["add item", "remove item"])
def test_an_impossible_quantity_changes_nothing(act: str, quantity: object) -> None:
    opened = shop(("Large Eggs", 2))
    before = opened.status()
    result = opened.step(Action(act, "Large Eggs", quantity))  # type: ignore[arg-type]
    assert not result.ok
    assert "quantity" in result.observation
    assert opened.status() == before


@pytest.mark.parametrize(
    ("action", "told"),
    [
        (Action("add item", "Unicorn Steak"), "no item of the name"),
        (Action("add item", "large eggs"), "no item of the name"),
        (Action("add item", "Large Eggs", 98), "may hold 99"),
        (Action("remove item", "Large Eggs", 3), "holds 2"),
        (Action("remove item", "Whole Milk"), "holds 0"),
        (Action("pay", "Large Eggs"), "no action 'pay'"),
        (Action("search inventory", "?!"), "Nothing is found"),
    ],
)
def test_an_impossible_action_changes_nothing_and_says_why(action: Action, told: str) -> None:
    opened = shop(("Large Eggs", 2))
    before = opened.status()
    result = opened.step(action)
    assert (result.ok, result.terminated) == (False, False)
    assert told in result.observation
    assert opened.status() == before


def test_the_purchase_ends_the_task_once_and_prints_the_total() -> None:
    opened = shop()
    assert not opened.step(Action("buy basket")).ok
    opened.step(Action("add item", "Large Eggs", 2))
    result = opened.step(Action("buy basket"))
    assert result.ok
    assert result.terminated
    assert CATALOGUE.money(opened.total) in result.observation
    assert "the basket is now purchased" in result.observation.lower()
    for late in (Action("buy basket"), Action("add item", "Whole Milk")):
        assert not opened.step(late).ok
    opened.reset()
    assert opened.status() == "The basket is empty."
    assert opened.status() == shop().status()


def test_things_are_offered_in_the_amount_that_was_said() -> None:
    offers = shop().actions(["orange juice"], said("I'd say 3 bottles of orange juice, and ice."))
    assert {action.quantity for action in offers} == {3}


def test_what_left_the_basket_comes_back_only_if_it_is_asked_for() -> None:
    opened = shop(("Gala Apples", 2))
    assert "Gala Apples" in [each.target for each in shop().actions(["gala apples"])]
    assert opened.step(Action("remove item", "Gala Apples", 2)).ok
    assert opened.actions(["gala apples"]) == []
    assert [each.target for each in opened.requests(said("Add the Gala Apples."))] == [
        "Gala Apples"
    ]
    opened.reset()
    assert opened.actions(["gala apples"]) != []


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("Remove the butter.", False),
        ("Remove everything except the butter.", False),
        ("Remove the butter, and add some flour.", False),
        ("I need flour and eggs, thanks a bunch.", False),
        ("I need flour and eggs for a cake.", True),
        ("sushi rolls", False),
        ("get stuff for tacos", True),
        ("weekly shop please", True),
        ("I'd like to bake.", True),
    ],
)
def test_nothing_is_offered_where_the_words_order_something_and_state_no_aim(
    words: str, offered: bool
) -> None:
    opened = shop()
    assert bool(opened.actions(["sugar"], said(words))) == offered


def test_emptied_basket_stays_empty() -> None:
    opened = shop(("Large Eggs", 2), ("Whole Milk", 1))
    turns = said("I need eggs and milk.", "Forget it, take everything out.")
    for action in opened.requests(turns):
        assert opened.step(action).ok
    assert not opened.basket
    assert opened.actions(["eggs"], turns) == []
    assert opened.requests([*turns, *said("Hm.")]) == []


def test_buy_it_means_the_basket_only_where_it_can_mean_nothing_else() -> None:
    opened = shop(("Whole Milk", 1))
    assert opened.is_completion(Turn("Anything else?", "Great, buy it."))
    assert not opened.is_completion(Turn("The shop has Large Eggs, $3. Any?", "Great, buy it."))
    assert opened.is_completion(Turn("Which eggs do you like?", "That's all, buy it."))
    assert opened.is_completion(Turn("Which eggs do you like?", "Buy the basket."))


def test_every_offered_action_is_possible() -> None:
    opened = shop(("Large Eggs", 2))
    offered = opened.actions(["flour", "milk"]) + opened.requests(said("no eggs, but add butter"))
    offered += opened.completion_actions()
    assert {action.name for action in offered} == {"add item", "remove item", "buy basket"}
    for action in offered:
        assert shop(("Large Eggs", 2)).step(action).ok


@pytest.mark.parametrize(
    ("query", "word"),
    [
        (query, query.split()[-1].rstrip("s"))
        for query in (
            "flour", "eggs", "milk", "baking powder", "gluten-free flour", "birthday candles",
            "ground beef", "tortilla chips", "ice", "cocoa powder", "sugar", "butter", "beer",
            "pasta", "napkins", "coffee", "oat milk", "bread", "salsa", "guacamole",
            "chicken wings", "spinach", "lentils", "olive oil", "dog food", "cake topper", "wine",
            "garlic", "liver", "cereal", "taco shells", "beans", "salt", "yogurt", "dish soap",
            "rice", "lids", "limes", "cilantro", "vanilla extract",
        )
    ],
)  # fmt: skip
def test_search_finds_the_thing_itself_first(query: str, word: str) -> None:
    assert SEARCH.search(query, 1)[0].name.lower().split()[-1].startswith(word[:6])


def test_a_towel_is_no_flour_and_dog_food_is_no_egg(tmp_path: Path) -> None:
    names = ["Flour Sack Towels", "Bread Flour", "Chicken & Egg Dog Food", "Brown Eggs"]
    small = Search(Catalogue(Item(i, name) for i, name in enumerate(names, 1)), cache_dir=tmp_path)
    assert small.search("flour", 1)[0].name == "Bread Flour"
    assert small.search("egg", 1)[0].name == "Brown Eggs"


def test_a_broken_index_is_built_again(tmp_path: Path) -> None:
    small = Catalogue([Item(1, "Bread Flour"), Item(2, "Whole Milk")])
    assert Search(small, cache_dir=tmp_path).search("milk", 1)[0].name == "Whole Milk"
    (kept,) = tmp_path.iterdir()
    kept.write_bytes(b"no database")
    assert Search(small, cache_dir=tmp_path).search("milk", 1)[0].name == "Whole Milk"


@pytest.mark.parametrize("query", ["", " ", '"', "a OR", "name:x*", "\ud800", "x" * 100_000])
def test_no_query_breaks_the_search(query: str) -> None:
    assert len(SEARCH.search(query, 3)) <= 3


def test_kinds_lead_to_items_and_the_nearest_fit_the_goal() -> None:
    kinds = SEARCH.kinds("bake a chocolate cake", 25)
    assert len(set(kinds)) == 25
    assert {"cocoa powder", "baking powder"} <= set(kinds)
    assert all(SEARCH.search(kind, 1) for kind in kinds)


@pytest.mark.parametrize(
    ("question", "part"),
    [
        ("what dark chocolate do you have?", "Dark Chocolate"),
        ("what is in my basket?", "2 x Large Eggs"),
        ("What's in the cart?", "2 x Large Eggs"),
        ("how much is the oat milk?", "Oat Milk, $"),
        ("what is the total?", "total is $"),
        ("Is the basket under $20?", "total is $"),
        ("are we still below 20 in total?", "total is $"),
        ("how much money is left?", "total is $"),
        ("What does it all come to?", "total is $"),
        ("what have you put in so far?", "The basket"),
        ("What do I have?", "The basket"),
        ("do you have gluten-free pasta?", "Gluten-Free"),
        ("are there eggs in my basket?", "Yes: 2 x Large Eggs"),
    ],
)
def test_questions_are_answered_from_stock_and_basket(question: str, part: str) -> None:
    assert part in (shop(("Large Eggs", 2)).answer(question) or "")


@pytest.mark.parametrize(
    "said",
    ["I want eggs", "can you add eggs?", "no nuts please", "", "Buy the basket", "eggs and milk"],
)
def test_what_is_no_question_is_not_answered(said: str) -> None:
    assert shop().answer(said) is None


SHOPPERS = load_profiles()


def test_the_ten_shoppers_are_told_apart() -> None:
    assert len({profile.name for profile in SHOPPERS}) == 10


@pytest.mark.parametrize("profile", SHOPPERS, ids=lambda p: p.name)
def test_each_shopper_can_be_satisfied_from_the_shipped_catalogue(profile: Profile) -> None:
    opened = shop()
    forbidden = [c for c in profile.checks if "must_have" not in c]
    for check in profile.checks:
        if "must_have" not in check:
            continue
        for item in CATALOGUE.items:
            trial = shop((item.name, check.get("min_quantity", 1)))
            wish = Profile("", "", (), (check, *forbidden))
            if all(trial.checks_met(wish)) and item.name not in opened.basket:
                opened.step(Action("add item", item.name, check.get("min_quantity", 1)))
                break
    assert all(opened.checks_met(profile))
    assert not any(shop().checks_met(profile))


def test_a_wrong_basket_scores_less_than_a_right_one() -> None:
    profile = next(p for p in SHOPPERS if p.name == "gluten-allergy-cake")
    right, wrong = shop(("Almond Flour", 1)), shop(("Bread Flour", 1))
    assert sum(right.checks_met(profile)) > sum(wrong.checks_met(profile))
