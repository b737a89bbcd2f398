"""Orders as canonical English and as JSON; what a reading may hold."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from goalscope.base.types import InvalidInputError
from goalscope.envs.grocery import GroceryShop
from goalscope.envs.house import HomeRobot
from goalscope.language.orders import (
    Order,
    Reading,
    Verb,
    is_aside,
    order_from_json,
    order_to_json,
    orders_from_text,
    orders_to_text,
    with_examples,
    words_of,
)

VERBS = (
    Verb("add", "", ("what", "quantity", "for", "where")),
    Verb("turn on", ""),
    Verb("turn", "", ()),
)
PHRASES = st.lists(st.from_regex(r"[a-zé'%-]{1,8}", fullmatch=True), min_size=1, max_size=4).map(
    " ".join
)
ADDED = st.builds(
    Order,
    st.just("add"),
    PHRASES,
    st.one_of(st.none(), st.integers(0, 999999).map(float), st.sampled_from([0.5, 12345.678])),
    for_=PHRASES | st.just(""),
    where=PHRASES | st.just(""),
    if_=PHRASES | st.just(""),
)


@given(st.lists(ADDED, max_size=5))
def test_canonical_english_reads_back(orders):
    assert orders_from_text(orders_to_text(orders), VERBS) == tuple(orders)


@given(ADDED)
def test_json_reads_back(order):
    assert order_from_json(order_to_json(order)) == order


def test_the_longest_verb_is_taken():
    assert orders_from_text("turn on lamp\nturn", VERBS) == (
        Order("turn on", "lamp"),
        Order("turn"),
    )


def test_a_quantity_has_a_unit():
    (order,) = orders_from_text("add potatoes | 2.5 kg | if cheap", VERBS)
    assert order == Order("add", "potatoes", 2.5, "kg", if_="cheap")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("steal milk", "no verb"),
        ("turn on lamp | where desk", "takes no where"),
        ("add milk | colour red", "no slot"),
        ("turn left", "takes no thing"),
        ("avoid nuts | why spite", "allergy, diet, taste"),
        ("add milk | NaN", "no slot"),
        ("add milk | 1e9", "no slot"),
        ("add milk | -1", "no slot"),
    ],
)
def test_what_is_no_order_is_refused(text, told):
    with pytest.raises(InvalidInputError, match=told):
        orders_from_text(text, VERBS)


@pytest.mark.parametrize(
    "data",
    [[], {"what": "milk"}, {"do": "add", "who": "me"}, {"do": "add", "quantity": "2"},
     {"do": "add", "what": 3}, {"do": "add", "quantity": True}, {"do": "add", "what": ["milk"]}],
)  # fmt: skip
def test_what_is_no_json_order_is_refused(data):
    with pytest.raises(InvalidInputError):
        order_from_json(data)


def test_a_broken_character_reads_back():
    order = Order("add", "milk", why="\ud800")
    assert order_from_json(order_to_json(order)) == order


def test_null_is_absent():
    assert order_from_json({"do": "add", "what": "milk", "unit": None}) == Order("add", "milk")


@pytest.mark.parametrize(
    ("acts", "aside"),
    [
        ("yes", True),
        ("yes\nbuy", True),
        ("undo", True),
        ("ask", True),
        ("ask milk", False),
        ("no\nadd milk", False),
        ("undo eggs", False),
        ("budget | 20 dollars", False),
        ("buy | if it is under twenty", False),
        ("aim", False),
        ("none", False),
    ],
)
def test_an_aside_names_nothing_and_tells_no_aim(acts, aside):
    assert is_aside(orders_from_text(acts, GroceryShop.verbs)) is aside


def test_words_have_no_marks_around_them():
    assert words_of('Two "Fairtrade" coffees, 1.5 l o\'milk (70%)!') == [
        "two", "fairtrade", "coffees", "1.5", "l", "o'milk", "70%",
    ]  # fmt: skip


@pytest.mark.parametrize("domain", [GroceryShop, HomeRobot])
def test_examples_are_in_the_domains_own_verbs(domain):
    for each in with_examples(domain.verbs, domain.__module__.rpartition(".")[0])[0].examples:
        assert orders_to_text(orders_from_text(each.orders, domain.verbs)) == each.orders


def test_each_order_of_a_reading_has_its_margin():
    with pytest.raises(InvalidInputError, match="A reading of 1 orders needs as many margins"):
        Reading((Order("add", "milk"),), margins=())
