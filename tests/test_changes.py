"""People who change their mind: how they are scripted, planned, measured, and followed."""

import math
import random
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes import WordModel
from goalscope.base.types import Goal, InvalidInputError, Turn
from goalscope.belief.calibration import Calibration
from goalscope.datasets import data_folder, load
from goalscope.datasets.case import Case
from goalscope.datasets.goal_sets import AFTER, changes_of
from goalscope.experiment.dialogues import read_dialogues
from goalscope.experiment.measure import KINDS
from goalscope.experiment.plan import specs_of
from goalscope.experiment.summary import Table
from goalscope.experiment.tables import change_table, read_changes
from test_datasets import game, packed, real
from test_plan import read, refused
from test_summary import MODEL, column, row

pytest.importorskip("scipy.stats")

GOALS = 4


def said(id: str, turns: int) -> tuple[Turn, ...]:
    return tuple(Turn("?", f"{id} {n}") for n in range(turns))


def dialogue(id: str, goal: int, turns: int, group: str | None = None) -> Case:
    support = (Goal("the wrong one"), Goal(f"goal {goal}"))
    return Case(id, group or id, "Help.", said(id, turns), support, 1)


@st.composite
def sets(draw: st.DrawFn) -> list[Case]:
    shapes = draw(
        st.lists(st.tuples(st.integers(0, 5), st.integers(1, 5)), min_size=1, max_size=20)
    )
    return [dialogue(f"d{n}", goal, turns) for n, (goal, turns) in enumerate(shapes)]


def total(cases: Sequence[Case], goal: str) -> int:
    return sum(len(case.turns) for case in cases if case.goals[1].text == goal)


@given(sets(), st.integers(2, 8), st.integers(0, 3))
def test_a_script_is_of_whole_dialogues_with_one_goal_and_then_of_another(
    cases: list[Case], round: int, seed: int
) -> None:
    by_id = {case.id: case for case in cases}
    every = {case.goals[1].text for case in cases}
    able = [
        case.id
        for case in cases
        if len(case.turns) >= AFTER
        and any(total(cases, goal) >= round - 1 for goal in every - {case.goals[1].text})
    ]
    if len(every) < GOALS or not able:
        with pytest.raises(InvalidInputError, match=f"at round {round} can"):
            changes_of(cases, round=round, goals=GOALS, seed=seed)
        return
    scripts = changes_of(cases, round=round, goals=GOALS, seed=seed)
    assert [script.case.id for script in scripts] == able  # each ends one script at most
    for script in scripts:
        own, last = script.case, by_id[script.case.id]
        first, second = (own.goals[place].text for place in (own.truth, script.second))
        assert (second, own.group) == (last.goals[1].text, first)
        assert first != second
        assert len({*own.goals}) == len(own.goals) == GOALS
        before, after = own.turns[: round - 1], own.turns[round - 1 :]
        assert after == last.turns[:AFTER]
        ids = list(dict.fromkeys(turn.utterance.split()[0] for turn in before))
        whole = [turn for id in ids for turn in by_id[id].turns]
        assert list(before) == whole[: round - 1]
        assert len(whole) - len(by_id[ids[-1]].turns) < round - 1
        assert {by_id[id].goals[1].text for id in ids} == {first}
    mixed = random.Random(seed).sample(cases, len(cases))
    again = changes_of(mixed, round=round, goals=GOALS, seed=seed)
    assert {script.case.id: script for script in again} == {
        script.case.id: script for script in scripts
    }


def test_no_two_dialogues_of_a_script_share_people() -> None:
    cases = [dialogue(f"d{n}", n % 2, 3, group=f"pair {n // 2}") for n in range(6)]
    for script in changes_of(cases, round=7, goals=2, seed=1):
        ids = dict.fromkeys(turn.utterance.split()[0] for turn in script.case.turns)
        assert len({int(id[1:]) // 2 for id in ids}) == len(ids) == 3
    with pytest.raises(InvalidInputError, match="6 dialogues"):
        changes_of(cases, round=8, goals=2, seed=1)


@real
def test_a_hundred_people_of_teach_change_their_mind_at_round_ten() -> None:
    cases = load("teach", data_folder(None), goals=10)
    scripts = changes_of(cases, round=10, goals=10, seed=1)
    assert len(scripts) >= 100
    assert {(len(each.case.turns), len(each.case.goals)) for each in scripts} == {(12, 10)}


@pytest.fixture
def teach(tmp_path: Path) -> Path:
    turns = [(who, f"{who} {n}") for n in range(3) for who in ("driver", "commander")]
    packed(tmp_path, "teach", [game(n, "Tidy", f"Tidy the {'ABC'[n % 3]}.", *turns)
                               for n in range(9)])  # fmt: skip
    return tmp_path


PART = "[dialogues]\nset = 'teach'\ngoals = 3\nchange = 6\n"


def test_a_change_makes_cells_of_its_own_kind(tmp_path: Path, teach: Path) -> None:
    specs = specs_of(read(tmp_path, PART + "limit = 4"), teach)
    assert [spec["case"]["id"] for spec in specs] == ["g0", "g1", "g2", "g3"]
    for spec in specs:
        case = spec["case"]
        assert (spec["kind"], spec["goal_set"], spec["change"]) == ("change", "random", 6)
        assert len(case["turns"]) == 5 + AFTER
        assert case["goals"][case["second"]] == f"Tidy the {'ABC'[int(case['id'][1:]) % 3]}."
    other = specs_of(read(tmp_path, PART + "limit = 4\nseed = 2\nsplit = 'valid_seen'"), teach)
    assert [spec["case"]["id"] for spec in other] == [spec["case"]["id"] for spec in specs]
    assert other != specs


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        (PART.replace("6", "1"), "'change' must be at least 2"),
        (PART + "turns = 3", "Leave out 'jsonl', 'turns', 'fit', 'methods' and 'goal_sets'"),
        (PART.replace("6", "11"), "No change of mind at round 11 can be scripted"),
    ],
)
def test_what_cannot_be_scripted_is_refused(
    tmp_path: Path, teach: Path, text: str, cause: str
) -> None:
    assert cause in refused(tmp_path, text, teach)


def test_a_cell_is_the_evidence_of_each_turn_for_each_goal(tmp_path: Path, teach: Path) -> None:
    (spec, *_) = specs_of(read(tmp_path, PART), teach)
    result = KINDS["change"](WordModel(), spec)
    assert set(result) == {"role-play", "unspecified", "calibration", "window"}
    assert [len(row) for row in result["role-play"]] == [3] * (5 + AFTER)
    assert len(result["unspecified"]) == 5 + AFTER


def cell(id: str, group: str, evidence: str):
    """A change at round 3 from `b` to `c`; a turn says one nat for a goal, in capitals three."""
    case = {"id": id, "group": group, "task": "Help.", "goals": [*"abc"], "truth": 1, "second": 2}
    case |= {"turns": [{"query": "?", "utterance": "!"}] * len(evidence)}
    spec = {"kind": "change", "set": "teach", "split": "valid", "goal_set": "random", "case": case}
    calibration = asdict(Calibration(0.5, switching=0.02))
    nats = [[(goal == said) + 3.0 * (goal == said.lower() != said) for goal in "abc"]
            for said in evidence]  # fmt: skip
    result = {"role-play": nats, "calibration": calibration}
    return {**spec, "change": 3, "model": MODEL, "seed": 1}, result


def changes_table(*cells: tuple[dict, dict]) -> Table:
    (found,) = read_changes(cells)
    return change_table(found)


FIRST = "first goal leads, rounds 1-2"
LAST = "round 2"


def shares(table: Table, belief: str) -> list[float]:
    found = row(table, belief)
    names = [f"followed within {k}" for k in (1, 2, 3)] + [FIRST, LAST]
    return [found[name] and found[name].value for name in names]


def test_followed_is_that_the_second_goal_has_led_by_then() -> None:
    table = changes_table(cell("1", "b", "bbcCc"), cell("2", "a", "bAAca"))
    # Of the first, b leads by 2 nats, then by 1, then c by 2. Of the second, a leads from its
    # second turn on, with or without the turns before the change.
    assert shares(table, "goalscope, Eq. 1") == [0, 0.5, 0.5, 0.75, 0.5]
    assert shares(table, "goalscope, without switching") == [0, 0.5, 0.5, 0.75, 0.5]
    assert shares(table, "goalscope, told of the change") == [0.5, 0.5, 0.5, None, None]
    assert column(table, "n") == [2] * len(table.rows)
    assert table.name == "changes-teach-valid-small"
    title = "A change of mind at round 3: teach, valid, 3 random goals each, small, 2 dialogues"
    assert table.title == title


def test_who_expects_a_change_follows_sooner() -> None:
    cells = [cell(str(n), str(n), "BBCca") for n in range(2)]
    assert read_dialogues(cells) == ()  # scripts are no real dialogues
    (found,) = read_changes(cells)
    table = change_table(found)
    assert shares(table, "goalscope, without switching")[2] == 0
    assert shares(table, "goalscope")[0] == 1
    kept, lost = (
        found.where(belief=belief)[0]["probabilities"][1, 0]
        for belief in ("goalscope, without switching", "goalscope")
    )
    # Each of two turns has six nats for one of three goals; between them the person may change.
    assert kept == pytest.approx(math.exp(12) / (math.exp(12) + 2), rel=1e-9)
    assert row(table, "goalscope, without switching")["log-loss, round 2"].value == pytest.approx(
        math.log1p(2 * math.exp(-12)), rel=1e-6
    )
    assert lost == pytest.approx(kept, rel=1e-9)  # the words between them speak for no change
