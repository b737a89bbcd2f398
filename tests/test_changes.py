"""People who change their mind: how they are scripted and planned."""

import random
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from goalscope.base.types import Goal, InvalidInputError, Turn
from goalscope.datasets import data_folder, load
from goalscope.datasets.case import Case
from goalscope.datasets.goal_sets import AFTER, changes_of
from goalscope.experiment.plan import specs_of
from test_datasets import game, packed, real
from test_plan import read, refused

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
    assert [script.id for script in scripts] == able  # each ends one script at most
    for script in scripts:
        own, last = script, by_id[script.id]
        first, second = (own.goals[place].text for place in (own.truths[0], own.truth))
        assert own.truths == (own.truths[0],) * (round - 1) + (own.truth,) * AFTER
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
    assert {script.id: script for script in again} == {script.id: script for script in scripts}


def test_no_two_dialogues_of_a_script_share_people() -> None:
    cases = [dialogue(f"d{n}", n % 2, 3, group=f"pair {n // 2}") for n in range(6)]
    for script in changes_of(cases, round=7, goals=2, seed=1):
        ids = dict.fromkeys(turn.utterance.split()[0] for turn in script.turns)
        assert len({int(id[1:]) // 2 for id in ids}) == len(ids) == 3
    with pytest.raises(InvalidInputError, match="6 dialogues"):
        changes_of(cases, round=8, goals=2, seed=1)


@real
def test_a_hundred_people_of_teach_change_their_mind_at_round_ten() -> None:
    cases = load("teach", data_folder(None), goals=10)
    scripts = changes_of(cases, round=10, goals=10, seed=1)
    assert len(scripts) >= 100
    assert {(len(each.turns), len(each.goals)) for each in scripts} == {(12, 10)}


@pytest.fixture
def teach(tmp_path: Path) -> Path:
    turns = [(who, f"{who} {n}") for n in range(3) for who in ("driver", "commander")]
    packed(tmp_path, "teach", [game(n, "Tidy", f"Tidy the {'ABC'[n % 3]}.", *turns)
                               for n in range(9)])  # fmt: skip
    return tmp_path


PART = "[dialogues]\nset = 'teach'\ngoals = 3\nchange = 6\n"


def test_a_change_makes_cells_of_their_own(tmp_path: Path, teach: Path) -> None:
    specs = specs_of(read(tmp_path, PART + "limit = 4"), teach)
    assert [spec["case"]["id"] for spec in specs] == ["g0", "g1", "g2", "g3"]
    for spec in specs:
        case = spec["case"]
        assert (spec["kind"], spec["goal_set"], spec["change"]) == ("dialogue", "random", 6)
        assert not spec["outright"]
        assert len(case["turns"]) == len(case["truths"]) == 5 + AFTER
        assert case["goals"][case["truth"]] == f"Tidy the {'ABC'[int(case['id'][1:]) % 3]}."
    other = specs_of(read(tmp_path, PART + "limit = 4\nseed = 2\nsplit = 'valid_seen'"), teach)
    assert [spec["case"]["id"] for spec in other] == [spec["case"]["id"] for spec in specs]
    assert other != specs


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        (PART.replace("6", "1"), "'change' must be at least 2"),
        (PART + "turns = 3", "Leave out 'jsonl', 'turns' and 'goal_sets'"),
        (PART.replace("6", "11"), "No change of mind at round 11 can be scripted"),
    ],
)
def test_what_cannot_be_scripted_is_refused(
    tmp_path: Path, teach: Path, text: str, cause: str
) -> None:
    assert cause in refused(tmp_path, text, teach)
