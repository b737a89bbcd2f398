"""How readings are scored, and what the corpus must be."""

import json
from pathlib import Path

import pytest

from goalscope.base.types import InvalidInputError
from goalscope.envs.grocery import GroceryShop
from goalscope.envs.house import HomeRobot
from goalscope.experiment.reading_scores import (
    Language,
    Line,
    read_corpus,
    read_languages,
    read_lines,
    score,
    turn_to_json,
)
from goalscope.language.orders import Order, orders_from_text, orders_to_text, words_of
from goalscope.language.reader import Reader
from goalscope.models import Completion

CORPUS = Path(__file__).parents[1] / "corpus" / "reading"
LANGUAGES = {
    "grocery": Language(GroceryShop.verbs),
    "house": Language(HomeRobot.verbs),
    **read_languages(CORPUS / "others" / "verbs.toml"),
}
MILK, EGGS = Order("add", "milk", 2.0, "bottle"), Order("add", "eggs")


def test_right_orders_are_exact_in_any_order():
    found = score([((MILK, EGGS), (EGGS, MILK))])
    assert (found.exact, found.f1, found.quantity_f1, found.unread) == (1, 1, 1, 0)


@pytest.mark.parametrize(
    ("right", "read"),
    [
        (Order("add", "the Green Peppers"), Order("add", "green pepper")),
        (Order("add", "egg"), Order("add", "eggs", 1.0)),
        (Order("avoid", "nuts", why="allergy"), Order("avoid", "nuts")),
        (Order("ask", "oat milk"), Order("ask")),
        (Order("add", "tea", 2.0, "packs"), Order("add", "tea", 2.0, "pack")),
        (Order("none"), Order("aim")),
    ],
)
def test_what_does_not_count(right, read):
    assert score([((right,), (read,))]).exact == 1


@pytest.mark.parametrize(
    ("right", "read", "f1"),
    [
        (MILK, Order("add", "milk", 3.0, "bottle"), 1),
        (MILK, Order("remove", "milk", 2.0, "bottle"), 0),
        (Order("put", "mug", where="sink"), Order("put", "mug", where="desk"), 1),
        (Order("swap", "milk", for_="oat milk"), Order("swap", "milk", for_="soy milk"), 1),
        (Order("add", "milk"), Order("none"), 0),
        (Order("none"), Order("add", "milk"), 0),
    ],
)
def test_what_counts(right, read, f1):
    found = score([((right,), (read,))])
    assert (found.exact, found.f1) == (0, f1)


def test_precision_and_recall_are_of_orders():
    found = score([((MILK, EGGS), (MILK,)), ((MILK,), (MILK, EGGS, Order("clear")))])
    assert (found.precision, found.recall) == (2 / 4, 2 / 3)
    assert found.exact == 0


def test_what_was_not_read_is_wrong_even_where_nothing_was_to_be_read():
    found = score([((Order("none"),), None)])
    assert (found.exact, found.unread) == (0, 1)


def test_a_line_reads_back(tmp_path):
    hello = Line("kim-1.1", "grocery", "", "hello", (Order("none"),))
    milk = Line(
        "kim-1.2", "grocery", "What else?", "milk", (MILK, EGGS), "1 x Tea", "each", before=hello
    )
    lines = [hello, milk]
    file = tmp_path / "kim.jsonl"
    turns = [*map(turn_to_json, lines)]
    file.write_text(json.dumps({"id": "kim-1", "domain": "grocery", "turns": turns}) + "\n")
    assert read_corpus(file) == lines


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{", "line 1"),
        ("[]", "expected a JSON object"),
        ('{"id": "a", "domain": "grocery"}', "'turns'"),
        ('{"id": "a", "domain": "grocery", "turns": 3}', "'turns' must be a list"),
        ('{"id": "a", "domain": "grocery", "turns": [[]]}', "turns 1 must be a table"),
        ('{"id": "a", "domain": "grocery", "turns": [{"message": "x"}]}', "'orders'"),
        (
            '{"id": "a", "domain": "grocery", "turns": [{"message": "x", "orders": [{"do": ""}]}]}',
            '"do"',
        ),
    ],
)
def test_a_wrong_line_is_named(tmp_path, text, told):
    file = tmp_path / "kim.jsonl"
    file.write_text(text)
    with pytest.raises(InvalidInputError, match=told):
        read_corpus(file)


def test_earlier_messages_are_read_as_they_would_have_been():
    class Copies:
        takes_grammar, context_size = True, 4096

        def count_tokens(self, messages):
            return 1

        def generate(self, messages, **_):
            asked.append([each.content for each in messages[1:]])
            return Completion(f"add {messages[-1].content}", "stop", 1, 1)

    asked: list[list[str]] = []
    reader = Reader(Copies(), GroceryShop.verbs, taught=True)
    line = None
    for message in ("milk", "eggs", "flour"):
        line = Line("a", "grocery", "", message, (EGGS,), before=line)
    ((_, found),) = read_lines([line], reader)
    assert found is not None
    assert found.orders == (Order("add", "flour"),)
    assert asked[-1] == ["milk", "add milk", "eggs", "add eggs", "flour"]


def splits() -> dict[str, list[Line]]:
    return {
        name: [*read_corpus(CORPUS / name), *read_corpus(CORPUS / "others" / name)]
        for name in ("train", "dev")
    }


def test_domains_are_declared_by_their_verbs(tmp_path):
    file = tmp_path / "verbs.toml"
    file.write_text(
        '[bar]\ntask = "A bar."\nverbs = { pour = ["what", "quantity"], finish = [] }\n'
    )
    bar = read_languages(file)["bar"]
    assert (bar.task, [verb.name for verb in bar.verbs]) == ("A bar.", ["pour", "finish"])
    assert bar.verbs[0].slots == ("what", "quantity")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("bar = 1", "'bar' must be a table of keys, not 1"),
        ("[bar]\nverbs = { pour = [1] }", "bar, verbs, pour 1 must be a text, not 1"),
        ("[bar]\nverbs = {}", "declares no verbs"),
        ('[bar]\nverbs = { pour = ["size"] }', "a slot 'size'"),
        ("[bar]\nverbs = { add = [] }\nspeed = 1", "'speed' is unknown"),
    ],
)
def test_what_declares_no_domain_is_refused(tmp_path, text, told):
    file = tmp_path / "verbs.toml"
    file.write_text(text)
    with pytest.raises(InvalidInputError, match=told):
        read_languages(file)


def test_no_writer_is_in_both_splits():
    writers = {
        name: {line.id.rpartition("-")[0] for line in lines} for name, lines in splits().items()
    }
    assert not writers["train"] & writers["dev"]


def test_no_message_of_some_length_is_in_both_splits():
    said = {
        name: {" ".join(words_of(each.message)) for each in lines}
        for name, lines in splits().items()
    }
    assert [each for each in said["train"] & said["dev"] if len(each.split()) > 3] == []


def test_every_order_of_the_corpus_is_canonical():
    for name, lines in splits().items():
        ids = [line.id for line in lines]
        assert len(ids) == len({*ids}), name
        for line in lines:
            verbs = LANGUAGES[line.domain].verbs
            assert len(orders_from_text(orders_to_text(line.orders), verbs)) == len(line.orders)
