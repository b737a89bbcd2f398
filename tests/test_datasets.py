"""Public datasets as cases: what the person said, and the goals in question."""

import gzip
import json
import os
import re
import zipfile
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from goalscope.base.types import InvalidInputError, Turn, canonical
from goalscope.cli.data import data
from goalscope.datasets import DATASETS, READERS, data_folder, load
from goalscope.datasets.case import Case, read_cases, turns_of
from goalscope.datasets.loaders import detokenised

DATA = os.environ.get("GOALSCOPE_DATA")
real = pytest.mark.skipif(not DATA, reason="GOALSCOPE_DATA names no folder of the datasets")
ROOMS = ["shelf", "table", "sofa", "desk", "bed"]
RANKS = ("High", "Medium", "Low")


def packed(folder: Path, name: str, rows: Sequence[object], split: str | None = None) -> Path:
    file = folder / DATASETS[name].files[split or DATASETS[name].split]
    file.parent.mkdir(parents=True, exist_ok=True)
    if name == "multiwoz":
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr(
                file.name.removesuffix(".zip"), json.dumps({f"D{n}": r for n, r in enumerate(rows)})
            )
    elif name == "casino":
        file.write_text(json.dumps(rows))
    else:
        with gzip.open(file, "wt", encoding="utf-8") as lines:
            lines.writelines(json.dumps(row) + "\n" for row in rows)
    return file


def game(n: int, task: str, goal: str, *said: tuple[str, str]) -> dict[str, Any]:
    moves: list[dict[str, Any]] = [{"agent": "driver", "action": "Forward", "success": 1}]
    moves += [{"agent": who, "action": "Text", "utterance": words} for who, words in said]
    return {"game_id": f"g{n}", "task_name": task, "desc": goal, "interactions": moves}


def games() -> list[dict[str, Any]]:
    rows = [
        game(n, "Tidy", f"Put the {what} on the shelf.", ("commander", f"take the {what}"))
        for n, what in enumerate(["book", "cup", "pen"])
    ]
    rows += [
        game(n, "Wash", f"Wash the {what}.", ("driver", "What now?"), ("commander", f"wash {what}"))
        for n, what in enumerate(["book", "pan", "pot"], 3)
    ]
    return [*rows, game(6, "Wash", "Wash the pot.", ("driver", "Anyone there?"))]


def looking(domains: Sequence[str], n: int, *, message: bool = True) -> dict[str, Any]:
    wanted = [f"Find a <span class='emphasis'>{each}</span> for {n}" for each in domains]
    return {
        "goal": {
            "message": wanted if message else [],
            "topic": {"taxi": False},
            "taxi": {},
            **{each: {"info": {"people": str(n)}} for each in domains},
        },
        "log": [{"text": f"I do n't have a {domains[0]} ."}, {"text": "For how many ?"}] * 2,
    }


def looks() -> list[dict[str, Any]]:
    rows = [looking(["hotel"], n) for n in range(4)]
    rows += [looking(["train", "hotel"], n) for n in range(3)]
    return [*rows, looking(["police"], 1), looking(["hotel"], 9, message=False)]


def deal(n: int) -> dict[str, Any]:
    people = {
        "mturk_agent_1": ["Food", "Water", "Firewood"],
        "mturk_agent_2": ["Firewood", "Food", "Water"],
    }
    said = [(1, "Hi! I could eat a bear."), (2, "We are cold."), (2, "Very."), (1, "Deal?"),
            (1, "Submit-Deal"), (2, "Reject-Deal"), (2, "Not yet."), (1, "Walk-Away")]  # fmt: skip
    return {
        "dialogue_id": n,
        "chat_logs": [
            {"id": f"mturk_agent_{who}", "text": text, "task_data": {}} for who, text in said
        ],
        "participant_info": {
            who: {"value2issue": dict(zip(RANKS, order, strict=True))}
            for who, order in people.items()
        },
    }


def trajectory(n: int, kind: str, what: str, where: str, *said: str) -> dict[str, Any]:
    parameters = {
        "object_target": what,
        "object_sliced": False,
        "mrecep_target": "",
        "parent_target": where,
        "toggle_target": "DeskLamp" if n % 2 else "FloorLamp",
    }
    return {
        "task_id": f"t{n}",
        "task_type": kind,
        "pddl_params": parameters,
        "anns": [{"task_desc": each} for each in said],
    }


def trajectories() -> list[dict[str, Any]]:
    rows = [
        trajectory(n, "place", "Cup", where, f"Put the cup on the {where}.", f"cup to {where}",
                   f"PUT the cup  on the {where}", "Tidy up.")
        for n, where in enumerate(ROOMS)
    ]  # fmt: skip
    rows += [trajectory(5, "heat", "Pie", "desk", "Heat a pie.", "Warm the pie up.", "Tidy up!")]
    rows += [trajectory(6, "place", "Cup", "desk", "Set a cup down on the desk.", "cup, desk")]
    return [*rows, trajectory(7, "place", "Pie", "bed", "One sentence.", "one  sentence")]


def item(drink: str, *options: str, notes: str | None = None) -> dict[str, Any]:
    return {"drink": drink, "options": list(options), "notes": notes}


def order(n: int, *items: dict[str, Any], words: str = "A drink, please.") -> dict[str, Any]:
    turns = [["user", words], ["assistant", "This one?"], ["user", "Yes."], ["assistant", "OK."]]
    return {"id": f"o{n}", "turns": turns, "order_items": list(items), "order_options": ["here"]}


def orders() -> list[dict[str, Any]]:
    rows = [order(n, item("Mocha", "Oat Milk")) for n in range(4)]
    rows += [order(n, item("latte ", "oat  Milk", "Triple ")) for n in range(4, 8)]
    rows += [
        order(8, item("I would like a Mocha, please.", "Oatt Milk", "Decaf")),
        order(9, item("Latte (12oz) (milk + foam)", "Iced", notes="Extra foam")),
        order(10, item("Mocha"), item("Latte", "Whole Milk")),
        order(11, item("Steamer", notes="no foam")),
        order(12, item("Mocha"), words="Bring me a var_drink"),
    ]
    return rows


MAKE: dict[str, Callable[[], list[dict[str, Any]]]] = {
    "teach": games,
    "multiwoz": looks,
    "casino": lambda: [deal(n) for n in range(3)],
    "alfred": trajectories,
    "taskmaster4": orders,
}
EVERY = [(name, goal_set) for name in MAKE for goal_set in DATASETS[name].goal_sets]


def made(folder: Path, name: str, goal_set: str, goals: int = 3, **options: Any) -> list[Case]:
    return load(name, folder, goal_set=goal_set, goals=goals, **options)


def left_out(name: str, file: Path, goal_set: str = "random", goals: int = 3) -> dict[str, int]:
    """How many rows are no case, by the reason."""
    found = READERS[name](file, goal_set, goals, 1)
    return Counter(each for each in found if isinstance(each, str))


def true(case: Case) -> str:
    return case.goals[case.truth].text


def texts(case: Case) -> list[str]:
    return [goal.text for goal in case.goals]


def refused(call: Callable[[], object]) -> str:
    with pytest.raises(InvalidInputError) as caught:
        call()
    return str(caught.value)


@pytest.mark.parametrize(("name", "goal_set"), EVERY)
def test_cases_have_distinct_goals_and_depend_on_no_order_and_no_limit(
    name: str, goal_set: str, tmp_path: Path
) -> None:
    rows = MAKE[name]()
    packed(tmp_path, name, rows)
    cases = made(tmp_path, name, goal_set)
    assert cases
    for case in cases:
        assert len({canonical(text) for text in texts(case)}) == len(case.goals)
        assert len(case.goals) == (6 if name == "casino" else 3)
        assert 0 <= case.truth < len(case.goals)
        assert case.turns
    assert len({case.id for case in cases}) == len(cases)
    assert made(tmp_path, name, goal_set, limit=2) == cases[:2]
    if name != "multiwoz":  # its names follow the order
        packed(tmp_path, name, rows[::-1])
        assert {case.id: case for case in made(tmp_path, name, goal_set)} == {
            case.id: case for case in cases
        }


def test_turns_join_what_one_side_says_in_a_row() -> None:
    said = [(True, "a"), (True, " b "), (False, "c"), (True, " "), (False, "d"), (True, "e"),
            (False, "f")]  # fmt: skip
    assert turns_of(said, "Hi") == (Turn("Hi", "a\nb"), Turn("c\nd", "e"))
    assert turns_of([(False, "c")]) == ()


def test_teach_takes_the_commander_and_counts_games_without_one(tmp_path: Path) -> None:
    file = packed(tmp_path, "teach", games())
    cases = load("teach", tmp_path, goals=3)
    assert [case.id for case in cases] == [f"g{n}" for n in range(6)]
    assert cases[4].turns == (Turn("What now?", "wash pan"),)
    assert true(cases[4]) == "Wash the pan."
    assert left_out("teach", file) == {"the commander says nothing": 1}
    hard = made(tmp_path, "teach", "hard", goals=4)[3]  # the same task first, then shared words
    assert true(hard) == "Wash the book."
    assert {"Wash the pan.", "Wash the pot.", "Put the book on the shelf."} < set(texts(hard))


def test_multiwoz_is_read_without_markup_and_tokens(tmp_path: Path) -> None:
    file = packed(tmp_path, "multiwoz", looks())
    cases = load("multiwoz", tmp_path, goals=3)
    assert true(cases[4]) == "Find a train for 0. Find a hotel for 0"
    assert cases[0].turns[1] == Turn("For how many?", "I don't have a hotel.")
    assert left_out("multiwoz", file) == {"no goal, or no words of the person": 1}
    assert detokenised("( it 's here ; `` no '' )") == "(it's here; `` no '')"


def test_hard_multiwoz_has_the_very_same_domains(tmp_path: Path) -> None:
    file = packed(tmp_path, "multiwoz", looks())
    for case in made(tmp_path, "multiwoz", "hard"):
        assert len({"train" in text for text in texts(case)}) == 1
    assert left_out("multiwoz", file, "hard")["fewer than 3 goals to choose from"] == 1


def test_casino_gives_both_campers_all_six_rankings(tmp_path: Path) -> None:
    packed(tmp_path, "casino", [deal(5)])
    first, second = load("casino", tmp_path)
    assert first.group == second.group == "5"
    assert true(first).startswith("Get packages of food above all, then water; firewood")
    assert first.turns == (
        Turn("Hello!", "Hi! I could eat a bear."),
        Turn("We are cold.\nVery.", "Deal?"),
    )
    assert second.turns == (
        Turn("Hi! I could eat a bear.", "We are cold.\nVery."),
        Turn("Deal?", "Not yet."),
    )


@pytest.mark.parametrize("goal_set", ["random", "hard"])
def test_no_wrong_goal_of_alfred_means_the_true_one(goal_set: str, tmp_path: Path) -> None:
    file = packed(tmp_path, "alfred", trajectories())
    for case in made(tmp_path, "alfred", goal_set, goals=5):
        assert case.turns[0].utterance != true(case)
        assert canonical(case.turns[0].utterance) not in map(canonical, texts(case))
        assert len([text for text in texts(case) if canonical(text) == "tidy up"]) <= (
            canonical(true(case)) == "tidy up"
        )
        if case.id in ("t3", "t6"):  # they differ in the lamp alone
            assert not [
                text for text in texts(case) if "desk" in text.lower() and text != true(case)
            ]
    assert left_out("alfred", file) == {"fewer than two different sentences": 1}


def test_orders_are_told_in_the_usual_spelling(tmp_path: Path) -> None:
    file = packed(tmp_path, "taskmaster4", orders())
    told = {case.id: true(case) for case in load("taskmaster4", tmp_path, goals=3)}
    assert told["o0"] == "Order mocha with oat milk."
    assert told["o4"] == "Order triple latte with oat milk."
    assert told["o8"] == "Order decaf mocha with oat milk."
    assert told["o9"] == "Order iced latte (note: extra foam)."
    assert told["o10"] == "Order mocha, and latte with whole milk."
    assert left_out("taskmaster4", file) == {"a blank in the template was never filled (var_)": 1}


def attributes(text: str) -> list[list[str]]:
    """The attributes of each item of an order, read back from its sentence."""
    found: list[list[str]] = []
    for each in re.split(r"(?<!\bnote: ), and ", text.removeprefix("Order ").removesuffix(".")):
        words, _, note = each.partition(" (note: ")
        words, _, milk = words.partition(" with ")
        read = [note, milk]
        for kind in (r"iced", r"decaf", r"single|double|triple|quadruple"):
            read.append("".join(re.findall(rf"\b(?:{kind})\b", words)))
            words = re.sub(rf"\b(?:{kind})\b ", "", words)
        found.append([*read, words])
    return found


def changes(a: str, b: str) -> int:
    pairs = zip(attributes(a), attributes(b), strict=True)
    return sum(x != y for one, other in pairs for x, y in zip(one, other, strict=True))


def test_hard_orders_change_exactly_one_attribute(tmp_path: Path) -> None:
    packed(tmp_path, "taskmaster4", orders())
    for case in made(tmp_path, "taskmaster4", "hard", goals=6):
        assert [changes(true(case), t) for t in texts(case) if t != true(case)] == [1] * 5


def test_orders_with_a_note_have_no_hard_goals(tmp_path: Path) -> None:
    shot = order(13, item("Latte", "Triple", notes="Double shot"))
    syrup = order(14, item("Latte"), item("Mocha", "Vanilla Syrup"))
    file = packed(tmp_path, "taskmaster4", [*orders(), shot, syrup])
    cases = load("taskmaster4", tmp_path, goal_set="hard", goals=6)
    assert not {"o9", "o11", "o13", "o14"} & {case.id for case in cases}
    assert sorted(left_out("taskmaster4", file, "hard", 6).values()) == [1, 4]
    said = " ".join(text for case in cases for text in texts(case))
    assert "note" not in said
    assert "syrup" not in said


def test_the_list_needs_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("GOALSCOPE_DATA", raising=False)
    shown = CliRunner().invoke(data, ["list"]).stdout
    for each in DATASETS.values():
        assert each.title in shown
        assert each.source in shown
    assert " there " not in shown
    packed(tmp_path, "casino", [deal(1)])
    told = CliRunner().invoke(data, ["list", "--data", str(tmp_path), "--json"]).stdout
    rows = {row["name"]: row for row in json.loads(told)}
    assert rows.keys() == DATASETS.keys()
    there = {name: [split for split, f in row["files"].items() if f["there"]]
             for name, row in rows.items()}  # fmt: skip
    assert there == {name: ["valid"] if name == "casino" else [] for name in DATASETS}
    monkeypatch.setenv("GOALSCOPE_DATA", str(tmp_path))
    assert " there " in CliRunner().invoke(data, ["list"]).stdout


@real
def test_real_sets_have_the_cases_that_their_rows_give() -> None:
    folder = data_folder(None)
    counts = {
        ("teach", "valid_seen", "hard"): (181, 0),
        ("multiwoz", "val", "random"): (999, 0),
        ("casino", "valid", "complete"): (60, 0),
        ("alfred", "train", "random"): (6573, 1),
        ("taskmaster4", "dev", "random"): (2108, 85),
    }
    for (name, split, goal_set), (count, none) in counts.items():
        cases = load(name, folder, split=split, goal_set=goal_set)
        file = DATASETS[name].file(folder, split)
        missing = sum(left_out(name, file, goal_set, 20).values())
        assert (len(cases), missing) == (count, none), name
        for case in cases:
            assert len({canonical(text) for text in texts(case)}) == (6 if name == "casino" else 20)


@real
def test_a_limited_real_alfred_is_a_fair_sample() -> None:
    cases = load("alfred", data_folder(None), limit=100)
    assert len({case.group.split("|")[0] for case in cases}) == 7


def test_what_is_exported_is_what_is_read(tmp_path: Path) -> None:
    packed(tmp_path, "teach", games())
    out = tmp_path / "teach.jsonl"
    call = ["export", "teach", "--data", str(tmp_path), "--goals", "3", "--out", str(out)]
    told = CliRunner().invoke(data, call)
    assert (told.exit_code, told.stdout) == (0, "")
    assert read_cases(out) == load("teach", tmp_path, goals=3)
    assert "already exists" in str(CliRunner().invoke(data, call).exception)
