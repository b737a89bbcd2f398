"""What stands after several utterances, and what the shop does about it."""

import time

import pytest

from fakes import said
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.grocery.hearing.hear import hear
from goalscope.types import Action


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    return Catalogue.load(None)


@pytest.fixture
def shop(catalogue: Catalogue) -> GroceryShop:
    return GroceryShop(catalogue)


def test_later_words_count_more_than_earlier_ones() -> None:
    assert [r.phrase for r in hear(["I need butter and eggs", "no butter"]).wanted] == ["eggs"]
    back = hear(["no butter", "Oh, I do need butter"])
    assert [r.phrase for r in back.wanted] == ["butter"]
    assert back.refused == ()


def test_request_takes_back_a_refusal_but_no_allergy() -> None:
    assert hear(["no eggs", "Oh, I do need eggs"]).diets == set()
    assert hear(["I'm allergic to eggs", "I need eggs"]).diets == {"egg-free"}
    for words in (
        "She gets ill from wheat.",
        "Wheat makes my sister sick",
        "sick if he eats wheat",
    ):
        assert hear([words]).diets == {"gluten-free"}
    for words in ("wheat doesn't make her ill", "I'm sick of bread", "I feel sick, get me wheat"):
        assert hear([words]).diets == frozenset()


@pytest.mark.parametrize(
    "words",
    [
        "No milk, please, my son gets ill from it.",
        "No milk please, he's allergic to it",
        "No milk, my son can't digest it.",
        "Leave out the milk. It gives me a rash.",
    ],
)
def test_what_harms_a_person_is_a_diet_also_where_it_is_called_it(words: str) -> None:
    assert hear([words]).diets == {"dairy-free"}


@pytest.mark.parametrize(
    "words", ["No milk, I don't like it.", "No milk; he is not allergic to it but hates it."]
)
def test_what_is_only_not_liked_is_none(words: str) -> None:
    assert hear([words]).diets == frozenset()


def test_diet_is_neither_asked_for_nor_refused() -> None:
    heard = hear(["Everything organic, please. Organic pears."])
    assert [request.phrase for request in heard.wanted] == ["organic pears"]
    later = hear(["Everything organic, please. Organic pears.", "Forget organic."])
    assert (later.diets, later.refused, later.wanted) == (set(), (), heard.wanted)


@pytest.mark.parametrize(
    ("said", "thing", "makes"),
    [
        ("We bake a carrot cake with walnuts and butter", "carrot cake", True),
        ("We bake a carrot cake with walnuts and butter", "cake", True),
        ("We bake a carrot cake with walnuts and butter", "carrot", False),
        ("We bake a carrot cake with walnuts and butter", "butter", False),
        ("I'm making soup from lentils tonight", "soup", True),
        ("I'm making soup from lentils tonight", "lentils", False),
        ("Please make sure there is enough rice", "rice", False),
        ("I need baking powder and cooking oil", "oil", False),
    ],
)
def test_what_is_made_is_the_head_of_its_phrase(said: str, thing: str, *, makes: bool) -> None:
    assert hear([said]).makes(thing) is makes


@pytest.mark.parametrize(
    "part",
    ["a ", "no ", "?", "1.", "vegan ", "gluten-free and ", "all ", "no a or ", "non-", "make a ",
     "allergic to nuts, ", "I have ", "there is no ", "not everything has to be ", "\n", "'",
     "half the ", "twice as many ", "a bit less ", "I didn't ask for ", "remove everything "],
)  # fmt: skip
def test_no_long_input_takes_ages(part: str) -> None:
    start = time.process_time()
    hear([part * (10_000 // len(part))]).makes("cake")
    assert time.process_time() - start < 20  # a pattern that backtracks takes hours


def test_request_is_met_once_with_its_quantity(shop: GroceryShop) -> None:
    turns = said("Please add 3 bags of tortilla chips.")
    (action,) = shop.requests(turns)
    assert action.quantity == 3
    assert shop.step(action).ok
    assert shop.requests([*turns, *said("Thanks.")]) == []


def test_what_is_ruled_out_later_leaves_the_basket(shop: GroceryShop) -> None:
    wheat = shop.actions(["wheat flour"])[0].target
    assert shop.step(Action("add item", wheat, 2)).ok
    (action,) = shop.requests(said("My sister can't eat gluten."))
    assert action == Action("remove item", wheat, 2)


def test_ruled_out_items_are_never_offered(shop: GroceryShop, catalogue: Catalogue) -> None:
    offers = shop.actions(["flour"], said("It has to be gluten-free."))
    assert offers
    for action in offers:
        item = catalogue.get(action.target)
        assert item is not None
        assert "gluten-free" in item.tags


def test_what_the_person_makes_is_not_bought(shop: GroceryShop) -> None:
    assert shop.actions(["chocolate cake"], said("I want to bake a chocolate cake.")) == []
    assert shop.actions(["chocolate cake"], said("Just a chocolate cake, please."))


def test_refused_term_is_not_served_by_something_like_it(shop: GroceryShop) -> None:
    assert shop.actions(["cake mix"])
    assert shop.actions(["cake mix"], said("From scratch, please, no cake mix.")) == []


def test_term_that_the_basket_serves_offers_nothing(shop: GroceryShop) -> None:
    first = shop.actions(["eggs"])[0]
    shop.step(first)
    assert shop.actions(["eggs"]) == []


def test_mentions_are_things_of_the_shop_and_not_refused(shop: GroceryShop) -> None:
    found = shop.mentioned(["Spaghetti with tomato sauce, but no basil."])
    assert "spaghetti" in found
    assert "basil" not in found


def test_purchase_follows_from_the_persons_word_alone(shop: GroceryShop) -> None:
    assert shop.completion_actions() == []
    shop.step(shop.actions(["eggs"])[0])
    assert shop.completion_actions() == [Action("buy basket")]
    assert all(a.name != "buy basket" for a in shop.actions(["eggs", "milk", "bread"]))


@pytest.mark.parametrize("between", ["", "."])
@pytest.mark.parametrize(
    ("said", "diets"),
    [
        ("I am vegan. Add cheese.", {"vegan"}),
        ("My son is allergic to nuts.", {"nut-free"}),
        ("No milk, it makes me ill.", {"dairy-free"}),
    ],
)
def test_a_diet_at_the_end_of_a_long_line_counts(said: str, diets: set[str], between: str) -> None:
    for words in range(380, 420):
        assert hear([f"{'word ' * words}{between} {said}"]).diets == diets
    assert hear([f"{'We chat on and on. ' * 500}{said}"]).diets == diets


@pytest.mark.parametrize(
    "words", ["She likes fish.", "They love bananas.", "We like cheese", "He prefers tea"]
)
def test_what_people_like_is_no_order(words: str) -> None:
    assert hear([words]).wanted == ()


def test_what_people_would_like_is_one() -> None:
    heard = hear(["She would like some fish, and I'd love bananas."])
    assert [request.phrase for request in heard.wanted] == ["fish", "bananas"]
