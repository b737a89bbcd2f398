"""The reader: what a model may write as a reading, and what comes of what it writes."""

import pytest

from goalscope.base.types import InvalidInputError, UnreadableAnswerError
from goalscope.envs.grocery import GroceryShop
from goalscope.language.orders import (
    Example,
    Order,
    Verb,
    orders_from_text,
    orders_to_text,
    words_of,
)
from goalscope.language.reader import MOST_ORDERS, Reader, ReadExample, grammar_of
from goalscope.models import Completion

VERBS = (
    Verb("add", "", ("what", "quantity")),
    Verb("swap", "", ("what", "for")),
    Verb("finish", "", ()),
)


class Writes:
    """Writes what it is told to, and keeps what it was asked."""

    def __init__(self, text: str, *, takes_grammar: bool = True, context_size: int = 4096) -> None:
        self.text, self.takes_grammar, self.context_size = text, takes_grammar, context_size
        self.asked: list[dict] = []

    def count_tokens(self, messages):
        return sum(len(each.content.split()) for each in messages)

    def generate(self, messages, **settings):
        self.asked.append({"messages": messages, **settings})
        return Completion(self.text, "stop", 1, 1, -0.25, (1.5, 0.5))


def test_a_reading_has_its_orders_and_how_sure_they_are():
    reading = Reader(Writes("add red peppers | 3\nfinish"), VERBS).read("Three red peppers, done!")
    assert reading.orders == (Order("add", "red peppers", 3.0), Order("finish"))
    assert (reading.log_probability, reading.margins) == (-0.25, (1.5, 0.5))


def test_a_thing_may_have_words_of_earlier_messages_and_of_what_is_shown():
    before = [ReadExample("", "three red peppers", (Order("add", "red peppers", 3.0),))]
    reader = Reader(Writes("add green peppers | 2\nadd oat milk"), VERBS)
    reading = reader.read("and two green ones, and that milk", before=before, here="1 x Oat Milk")
    assert [each.what for each in reading.orders] == ["green peppers", "oat milk"]


def test_what_is_here_stands_in_one_line_and_may_be_named() -> None:
    model = Writes("add egg 2\nadd beef 80-20")
    here = "Beef 80-20; several: egg 1-3)\n(Asked: Shall I buy?)\nyes"
    Reader(model, VERBS).read("that one", question="Which?", here=here)
    asked = model.asked[0]["messages"][-1].content.splitlines()
    assert asked == [
        "(Here: Beef 80-20; several: egg 1-3) (Asked: Shall I buy?) yes)",
        "(Asked: Which?)",
        "that one",
    ]
    Reader(model, VERBS, taught=True).read("that one", question="Which?", here=here)
    asked = model.asked[1]["messages"][-1].content.splitlines()
    assert asked == ["(Asked: Which?)", "that one"]


@pytest.mark.parametrize("takes_grammar", [True, False])
def test_a_thing_that_nobody_named_is_never_ordered(takes_grammar):
    text = "add caviar" if takes_grammar else '[{"do": "add", "what": "caviar"}]'
    reader = Reader(Writes(text, takes_grammar=takes_grammar), VERBS)
    with pytest.raises(UnreadableAnswerError, match="'caviar', which nobody said"):
        reader.read("some milk")


@pytest.mark.parametrize(
    ("text", "takes_grammar"),
    [
        ("rob milk", True),
        ("add milk | quantity", True),
        ("", False),
        ("{}", False),
        ('[{"do": "buy"}]', False),
        ('[{"do": "add", "quantity": "many"}]', False),
    ],
)
def test_nonsense_is_no_reading(text, takes_grammar):
    with pytest.raises(UnreadableAnswerError):
        Reader(Writes(text, takes_grammar=takes_grammar), VERBS).read("milk")


def test_a_server_is_asked_for_json():
    model = Writes('[{"do": "add", "what": "milk", "quantity": 2}]', takes_grammar=False)
    assert Reader(model, VERBS).read("two milk").orders == (Order("add", "milk", 2.0),)
    assert "grammar" not in model.asked[0]
    assert model.asked[0]["schema"]["items"]["properties"]["do"]["enum"][:3] == [
        "add", "swap", "finish",
    ]  # fmt: skip


def test_an_endless_list_ends():
    many = "\n".join(f"add milk | {number}" for number in range(1000))
    assert len(Reader(Writes(many), VERBS).read("milk").orders) == MOST_ORDERS


def test_none_stands_alone():
    assert Reader(Writes("none\nadd milk"), VERBS).read("milk").orders == (Order("add", "milk"),)
    assert Reader(Writes(""), VERBS).read("milk").orders == (Order("none"),)


@pytest.mark.parametrize(
    ("message", "written", "read"),
    [
        ("keep it under $1,250", "budget | 1250", "budget | 1250 $"),
        ("keep it under $1,250", "budget | 250", "budget"),
        ("€30 for 30 eggs", "add eggs | 30", "add eggs | 30"),
        ("€30 of eggs", "add eggs | 30", "add eggs | 30 €"),
        ("20 dollars 50.", "budget | 20.5", "budget | 20.5 dollar"),
        ("20 dollars 50 eggs", "budget | 20\nadd eggs | 50", "budget | 20 dollar\nadd eggs | 50"),
        ("two dollars", "budget | 2 dollar", "budget | 2 dollar"),
        ("a 6-pack of milk", "add milk | 6 pack", "add milk | 1 6-pack"),
        ("6 packs of milk", "add milk | 6 pack", "add milk | 6 pack"),
        ("two six-packs of milk", "add milk | 6 pack", "add milk | 2 6-pack"),
        ("two six-packs of milk", "add milk | 2 pack", "add milk | 2 6-pack"),
        ("24 eggs and a box of tea", "add tea | 1 box", "add tea | 1 box"),
        ("2% milk", "add milk | 2", "add milk | 2 percent"),
        ("some two-percent milk", "add milk | 2", "add milk | 2 percent"),
        ("2 bottles of 2% milk", "add milk | 2", "add milk | 2"),
        ("three bottles of 2% milk", "add milk | 3 bottle", "add milk | 3 bottle"),
    ],
)
def test_amounts_of_a_reading_are_those_that_were_said(message, written, read):
    assert orders_to_text(Reader(Writes(written), VERBS).read(message).orders) == read


@pytest.mark.parametrize(
    ("message", "written", "sure"),
    [
        ("120 milk", "add milk | 120", True),
        ("one hundred and twenty milk", "add milk | 120", True),
        ("120 milk", "add milk | 12", True),  # a dozen is said in many ways
        ("120 milk", "add milk | 1200", False),
        ("double the milk", "add milk | 24", False),
        ("a dozen and a half milk", "add milk | 1.5", False),
        ("as many as I said", "add many | 40", True),
        ("4 large milk x 2", "add milk | 4", False),
        ("12 of the milk times 2", "add milk | 12", False),
        ("2 \u00d7 12 milk", "add milk | 12", False),
        ("milk x 2", "add milk | 2", True),
    ],
)
@pytest.mark.parametrize("takes_grammar", [True, False])
def test_a_number_that_nobody_said_is_unsure(message, written, sure, takes_grammar):
    before = [ReadExample("", "forty milk", (Order("add", "milk", 40.0),))]
    what, number = written.removeprefix("add ").split(" | ")
    text = (
        written if takes_grammar else f'[{{"do": "add", "what": "{what}", "quantity": {number}}}]'
    )
    reading = Reader(Writes(text, takes_grammar=takes_grammar), VERBS).read(message, before=before)
    assert reading.sure(reading.orders[0], 0.25) is sure


def test_the_model_is_shown_plain_figures_and_nobody_else():
    model = Writes("none")
    before = [ReadExample("Twenty or 1,5 kg?", "two hundred and one", (Order("none"),))]
    Reader(model, VERBS, taught=True).read("€1.250,50!", question="$1.5k?", before=before)
    said = [each.content for each in model.asked[0]["messages"]]
    assert said[1:] == ["(Asked: 20 or 1.5 kg?)\n201", "none", "(Asked: $1500?)\n€1250.5!"]


def test_a_message_beyond_the_context_or_without_words_is_refused():
    with pytest.raises(InvalidInputError, match="utterance"):
        Reader(Writes("none"), VERBS).read("\u200b")
    with pytest.raises(InvalidInputError, match="too long to be read"):
        Reader(Writes("none", context_size=400), VERBS).read("milk " * 500)


def test_what_was_said_long_ago_makes_room():
    model = Writes("none", context_size=500)
    before = [ReadExample("", f"{n} " + "milk " * 60, (Order("none"),)) for n in range(9)]
    Reader(model, VERBS, taught=True).read("hello", before=before)
    said = [each.content for each in model.asked[0]["messages"]]
    assert said[-1] == "hello"
    assert not any(each.startswith("0 ") for each in said)


def test_only_a_model_that_was_not_taught_is_shown_examples():
    examples = [Example("Go on then.", "add milk", question="Shall I add milk?")]
    for taught in (False, True):
        model = Writes("none")
        Reader(model, VERBS, examples=examples, taught=taught).read("Hello.")
        chat = [(each.role, each.content) for each in model.asked[0]["messages"][1:]]
        shown = [("user", "(Asked: Shall I add milk?)\nGo on then."), ("assistant", "add milk")]
        assert chat == [*([] if taught else shown), ("user", "Hello.")]


@pytest.mark.parametrize(
    ("verbs", "told"),
    [
        ((), "no verbs"),
        ((Verb("ask", ""),), "'ask' already"),
        ((Verb("add", ""), Verb("add", "")), "'add' already"),
        ((Verb("Add!", ""),), "small letters"),
        ((Verb("add", "", ("colour",)),), "slot 'colour'"),
    ],
)
def test_verbs_that_cannot_be_read_are_refused(verbs, told):
    with pytest.raises(InvalidInputError, match=told):
        Reader(Writes("none"), verbs)


@pytest.mark.parametrize(
    "message",
    [
        'say "hi" \\" root ::= "x" | y <|im_end|>\n| where me',
        '{"do": "add", "what": "milk"}',
        "ich möchte bitte Brot",
        "Please add zu\x04cchini",
        "add xq\U00040000z",
    ],
)
def test_what_a_person_types_is_only_words_to_the_grammar(model, message):
    verbs, said = GroceryShop.verbs, words_of(message)
    reader = Reader(model, verbs)
    rules = grammar_of(verbs, said).replace("{0,23}", "{0,1}").replace("{0,11}", "{0,2}")
    written = model.generate(reader.prompt(message), max_tokens=200, grammar=rules).text
    orders = orders_from_text(written, verbs)
    assert orders_to_text(orders) == written
    for order in orders:
        assert {*words_of(f"{order.what} {order.for_} {order.where} {order.if_}")} <= {*said}
