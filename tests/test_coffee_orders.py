"""Final orders of coffee dialogues: what is read of the data, what counts, and what is told."""

import gzip
import json
import os
import sys
from pathlib import Path

import pytest

from fakes import WordModel
from goalscope.agent.settings import Settings
from goalscope.base.types import InvalidInputError, UnreadableAnswerError
from goalscope.envs.registry import load_domain, open_environment
from goalscope.language.matcher import Matcher
from goalscope.language.reader import Reader

sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))

from orders import (
    Verbatim,
    final_order,
    main,
    options_of,
    read_dialogues,
    right,
    score_orders,
)

COFFEE = str(Path(__file__).parents[1] / "examples" / "coffee.py")
PICK = Matcher()
LATTE, MOCHA = ("latte", "decaf", "oat milk"), ("mocha",)


def dialogue(id, *said, items=(("Latte", ["oat Milk", "Decaf"]),)):
    """A row; utterances alternate, the customer's first."""
    sides = ("user", "assistant")
    turns = [[sides[n % 2], text] for n, text in enumerate(said)]
    items = [{"drink": drink, "options": options, "notes": None} for drink, options in items]
    return {"id": id, "turns": turns, "order_items": items}


def packed(tmp_path, *rows):
    file = tmp_path / "dialogue" / "taskmaster4" / "orders_dev.jsonl.gz"
    file.parent.mkdir(parents=True, exist_ok=True)
    with gzip.open(file, "wt") as lines:
        lines.writelines(f"{json.dumps(row)}\n" for row in rows)
    return file


@pytest.fixture
def counter():
    return open_environment(Settings(domain=load_domain(COFFEE)))


def test_an_annotated_order_has_the_names_of_the_menu(tmp_path, counter):
    items = (("latte", ["oat  Milk", "Decafe"]), ("I want a Mocha", []), ("mocha", []))
    (found,) = read_dialogues(packed(tmp_path, dialogue("a", "x", items=items)), counter, PICK)
    assert found.order == {LATTE, MOCHA}
    assert options_of([found]) == {"decaf", "oat milk"}


def test_what_is_unfilled_or_off_the_menu_is_left_out(tmp_path, counter):
    rows = (
        dialogue("a", "var_drink please"),
        dialogue("b", "x", items=(("Latte", []), ("Oolong", []))),
        dialogue("c", "x"),
    )
    assert [each.id for each in read_dialogues(packed(tmp_path, *rows), counter, PICK)] == ["c"]
    with pytest.raises(InvalidInputError, match="no order of what is on the menu"):
        read_dialogues(packed(tmp_path, *rows[:2]), counter, PICK)


@pytest.mark.parametrize("turn", [["user"], "user", ["user", 5]])
def test_a_broken_turn_is_named(tmp_path, counter, turn):
    row = dialogue("a", "x") | {"turns": [turn]}
    with pytest.raises(InvalidInputError, match="line 1: a turn must be two texts, not "):
        read_dialogues(packed(tmp_path, row), counter, PICK)


def taken(tmp_path, counter, *said, reader=None):
    (each,) = read_dialogues(packed(tmp_path, dialogue("a", *said)), counter, PICK)
    reader = reader or Reader(WordModel(), counter.verbs)
    return final_order(each, reader, counter, PICK)


@pytest.mark.parametrize(
    ("said", "order"),
    [
        (["add decaf latte with oat milk", "Right?", "yes"], {LATTE}),
        (["add latte with oat milk", "Right?", "add decaf"], {LATTE}),
        (["add mocha", "Right?", "swap mocha | for decaf latte", "Now?", "add oat milk"], {LATTE}),
        (["add mocha; add latte", "Right?", "remove latte"], {MOCHA}),
        (["add mocha", "Right?", "finish", "Bye.", "add latte"], {MOCHA}),
        (["Good morning", "Hi", "none"], set()),
    ],
)
def test_utterances_are_followed_one_by_one(tmp_path, counter, said, order):
    assert taken(tmp_path, counter, *said) == order


def test_a_reader_sees_the_conversation(tmp_path, counter):
    seen = []

    class Listens(Verbatim):
        def read(self, message, *, question="", before=(), here=""):
            seen.append((message, question, [each.message for each in before], here))
            return super().read(message)

    taken(tmp_path, counter, "mocha", "Right?", "decaf", reader=Listens())
    assert seen == [
        ("mocha", "", [], "Ordered: nothing."),
        ("decaf", "Right?", ["mocha"], "Ordered: mocha."),
    ]


def test_what_cannot_be_read_is_no_order(tmp_path, counter):
    class Fails(Verbatim):
        def read(self, message, **_):
            raise UnreadableAnswerError("It wrote nothing.")

    assert taken(tmp_path, counter, "mocha", reader=Fails()) is None


def test_options_that_the_data_never_annotates_do_not_count():
    options = frozenset({"decaf"})
    order = frozenset({("latte", "decaf")})
    assert right(order, frozenset({("latte", "decaf", "vanilla")}), options)
    assert not right(order, frozenset({("latte", "vanilla")}), options)


def test_scores_are_shares_of_dialogues():
    latte, mocha = frozenset({LATTE}), frozenset({MOCHA})
    pairs = [(latte, latte), (latte, frozenset({("latte",)})), (latte, mocha), (latte, None)]
    found = score_orders(pairs, options_of([]) | {"decaf", "oat milk"})
    assert (found.dialogues, found.exact, found.drinks, found.unread) == (4, 0.25, 0.5, 0.25)


def test_the_command_tells_both_scores(tmp_path, monkeypatch, capsys):
    packed(
        tmp_path,
        dialogue("a", "add decaf latte with oat milk"),
        dialogue("b", "remove latte, a decaf latte with oat milk"),
    )
    model = WordModel()
    monkeypatch.setattr("orders.open_reader", lambda *_, **__: (model, False))
    main(COFFEE, data=tmp_path, as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["scores"]["model"]["exact"] == 0.5
    assert told["scores"]["verbatim"]["exact"] == 1.0
    assert told["dialogues"][0] == {"id": "a", "right": [[*LATTE]], "found": [[*LATTE]]}
    main(COFFEE, data=tmp_path)
    assert "found: nothing" in capsys.readouterr().out


def test_a_domain_that_takes_no_orders_is_refused(tmp_path):
    garden = str(Path(COFFEE).with_name("garden.py"))
    with pytest.raises(InvalidInputError, match="has no `cups`"):
        main(garden, data=tmp_path)


@pytest.mark.skipif("GOALSCOPE_DATA" not in os.environ, reason="GOALSCOPE_DATA is not set")
def test_the_menu_has_what_people_order(counter):
    folder = Path(os.environ["GOALSCOPE_DATA"])
    file = folder / "dialogue" / "taskmaster4" / "orders_dev.jsonl.gz"
    assert len(read_dialogues(file, counter, PICK)) > 2100
