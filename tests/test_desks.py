"""Desks and services, whose goals are intents and change on the way; goals known turn by turn."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from goalscope.base.types import UNSPECIFIED, InvalidInputError, Turn
from goalscope.datasets import data_folder, load
from goalscope.datasets.case import OPENING, case_from_json, case_to_json, read_cases, write_cases
from test_datasets import DATA, packed, refused

real = pytest.mark.skipif(not DATA, reason="GOALSCOPE_DATA names no folder of the datasets")


def frame(service: str, intent: str, **slots: str) -> dict[str, Any]:
    return {"service": service, "intent": intent, "does": f"{intent} it", "slots": slots}


def served(n: int) -> dict[str, Any]:
    find, play = "FindMovies", "PlayMovie"
    turns = [
        ("", "A film?", [frame("Media", find)]),
        ("Which?", "A drama.", [frame("Media", find, genre="drama")]),
        ("This one?", "No, comedy.", [frame("Media", find, genre="comedy")]),
        ("Ok.", f"By {n}, please.", [frame("Media", find, genre="a comedy", by=str(n))]),
        ("This?", "Play it.", [frame("Media", find, by=str(n)), frame("Media2", play, by=str(n))]),
        ("Done.", "Bye.", []),
    ]
    rows = [{"query": query, "utterance": said, "state": state} for query, said, state in turns]
    return {"id": f"{n}", "services": [], "turns": rows}


def test_goals_of_services_change_with_intents_and_values(tmp_path: Path) -> None:
    packed(tmp_path, "sgd", [served(n) for n in range(3)])
    case, *_ = load("sgd", tmp_path, goals=4)
    texts = [
        UNSPECIFIED.text if each is None else case.goals[each].text for each in case.each_truth
    ]
    comedy = "FindMovies it (genre: a comedy; by: 0)"
    played = "PlayMovie it (by: 0)"
    assert texts == ["FindMovies it (genre: drama)"] * 2 + [comedy] * 2 + [played] * 2
    assert case.true_goal.text == played
    assert case.turns[0] == Turn(OPENING, "A film?")
    terse, *_ = load("sgd", tmp_path, goals=2, goal_set="terse")
    assert terse.truths == (*[terse.truths[0]] * 4, *[terse.truth] * 2)
    assert {goal.text for goal in terse.goals} == {"find movies", "play movie"}
    assert "more in the dialogue" in refused(lambda: load("sgd", tmp_path, goals=2))


def typed(id: str, *turns: tuple[str, str]) -> dict[str, Any]:
    rows = [{"turn": n, "utterance": said, "slots": [], "intents": [intent] if intent else []}
            for n, (said, intent) in enumerate(turns)]  # fmt: skip
    return {"id": id, "domain": "finance", "turns": rows}


def test_what_is_typed_to_a_desk_ends_before_a_second_intent(tmp_path: Path) -> None:
    lost = [("hi", "openinggreeting"), ("card gone", "reportlostcard"), ("and 2", "contentonly")]
    packed(
        tmp_path,
        "multidogo",
        [typed("1", *lost, ("also a new one", "replacecard")), typed("2", ("hi", "thankyou"))],
    )
    (case,) = load("multidogo", tmp_path, goals=12)
    assert case.turns == (Turn(OPENING, "hi"), Turn("", "card gone"), Turn("", "and 2"))
    assert case.true_goal.text == "Report that a bank card was lost or stolen"
    (terse,) = load("multidogo", tmp_path, goals=12, goal_set="terse")
    labels = [goal.text for goal in terse.goals]
    assert terse.true_goal.text == "report lost card"
    assert {"replace card", "check balance", "close account"} < {*labels}


def test_customers_ask_bots_for_what_is_not_listed(tmp_path: Path) -> None:
    rows = [{"utterance": f"refund {n}", "intent": None if n % 2 else "cancel order"}
            for n in range(6)]  # fmt: skip
    packed(tmp_path, "hint3", rows)
    cases = load("hint3", tmp_path, goals=5)
    assert Counter(case.true_goal.text for case in cases) == {
        "Cancel an order": 3, UNSPECIFIED.text: 3,
    }  # fmt: skip
    for case in cases:
        assert len(case.goals) == 5
        assert (case.truth is None) == (case.truths == (None,))


@real
@pytest.mark.parametrize(
    ("name", "split", "number"),
    [("sgd", "train", 2500), ("multidogo", "airline", 1631), ("multidogo", "fastfood", 1422),
     ("multidogo", "finance", 1518), ("multidogo", "software", 1164), ("hint3", "curekart", 1590),
     ("hint3", "sofmattress", 725)],
)  # fmt: skip
def test_real_desks_have_cases(name: str, split: str, number: int) -> None:
    cases = load(name, data_folder(None), split=split)
    assert len(cases) == number
    assert all(len(case.each_truth) == len(case.turns) for case in cases)


def line(true: object, turns: int = 2) -> str:
    said = [{"query": "", "utterance": f"words {n}"} for n in range(turns)]
    return json.dumps({"id": 1, "task": "t", "turns": said, "goals": ["a", "b"], "true": true})


def test_a_goal_for_each_turn_is_read_and_written(tmp_path: Path) -> None:
    file = tmp_path / "own.jsonl"
    file.write_text(line([1, None]) + "\n")
    (case,) = read_cases(file)
    assert (case.truth, case.truths, case.true_goal) == (None, (1, None), UNSPECIFIED)
    assert case_from_json(json.loads(json.dumps(case_to_json(case)))) == case
    write_cases([case], tmp_path / "again.jsonl")
    assert read_cases(tmp_path / "again.jsonl") == [case]
    file.write_text(line(["b", "B."]) + "\n")
    (same,) = read_cases(file)
    assert (same.truth, same.truths, same.each_truth) == (1, (), (1, 1))


@pytest.mark.parametrize(
    ("true", "told"),
    [([0], "a list of 1 for 2 turns"), ([0, 2], "got 2"), ([0, "c"], "none of the goals"),
     ([0, True], "true"), (None, '"true"'), ([], "a list of 0")],
)  # fmt: skip
def test_goals_that_do_not_fit_the_turns_are_refused(
    true: object, told: str, tmp_path: Path
) -> None:
    file = tmp_path / "own.jsonl"
    file.write_text(line(true) + "\n")
    with pytest.raises(InvalidInputError, match=told):
        read_cases(file)


def test_fewer_goals_keep_the_true_ones(tmp_path: Path) -> None:
    packed(tmp_path, "sgd", [served(n) for n in range(3)])
    case, *_ = load("sgd", tmp_path, goals=6)
    assert len({*case.truths}) == 3
    true = [case.goals[place] for place in dict.fromkeys(case.each_truth) if place is not None]
    fewer = case.among(true)
    assert [fewer.goals[place] for place in fewer.each_truth if place is not None] == [
        case.goals[place] for place in case.each_truth if place is not None
    ]
