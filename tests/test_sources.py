"""Which dialogues a name stands for, which teach and which validate, and what judges alone."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from fits import GOALS, case, rows_file
from goalscope.base.types import Goal, InvalidInputError, Turn
from goalscope.datasets import DATASETS
from goalscope.datasets.case import Case, read_cases, said_key
from goalscope.datasets.sources import Source, read_source
from goalscope.fitting.plan import parted
from test_datasets import deal, games, packed, refused


def ids(source: Source) -> list[str]:
    return [each.id for each in source.cases]


def digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def test_a_file_is_a_source(tmp_path: Path) -> None:
    file = rows_file(tmp_path / "own.jsonl", "abc")
    source = read_source(str(file), None)
    assert source == Source(str(file), read_cases(file), digest(file))
    assert source.cases[1] == replace(case(1), group="b")


def test_a_dataset_is_a_source_with_all_its_ways_to_draw_goals(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    train = packed(tmp_path, "teach", games(), "train")
    valid = packed(tmp_path, "teach", games()[:4])
    packed(tmp_path, "casino", [deal(n) for n in range(3)])
    source = read_source("teach", tmp_path, goals=3)
    assert source.name == "teach"
    assert ids(source) == [f"g{n}" for n in range(6)] * 2
    assert {len(each.goals) for each in source.cases} == {3}
    assert source.cases[:6] != source.cases[6:]
    assert (source.sha256, source.licence) == (digest(train), DATASETS["teach"].licence)
    assert read_source("teach", tmp_path, goals=3, seed=2) != source
    monkeypatch.setenv("GOALSCOPE_DATA", str(tmp_path))
    other = read_source("teach:valid_seen", None, goals=3)
    assert ids(other) == [f"g{n}" for n in range(4)] * 2
    assert other.sha256 == digest(valid)
    assert len(read_source("casino:valid", None).cases) == 6


@pytest.mark.parametrize(
    ("places", "taken"),
    [("[:2]", "01"), ("[2:]", "2345"), ("[:]", "012345"), ("[1:3]", "2"), ("[3:]", "45")],
)
def test_what_shares_a_group_with_what_stands_before_is_left_out(
    tmp_path: Path, places: str, taken: str
) -> None:
    file = rows_file(tmp_path / "own.jsonl", "aabbcc")
    source = read_source(f"{file}{places}", None)
    assert ids(source) == [f"c{number}" for number in taken]
    assert source.name == f"{file}{places}"


def test_true_goals_of_what_stands_before_are_no_wrong_goals(tmp_path: Path) -> None:
    file = rows_file(tmp_path / "own.jsonl", "abcdefgh", goals=["Buy  MILK!", "buy tea"], true=1)
    source = read_source(f"{file}[2:]", None)
    # Milk and tea are true before [2:]; of the taken ones, c6 has milk and c7 tea, too.
    assert [each.goals for each in source.cases[:5]] == [GOALS] * 5
    some = read_source(f"{file}[2:6]", None)
    assert [each.goals for each in some.cases] == [GOALS[2:]] * 4
    assert [each.goals[each.truth] for each in some.cases] == list(GOALS[2:])
    one = read_source(f"{file}[1:]", None).cases
    assert [each.goals for each in one] == [*[GOALS] * 6, (Goal("Buy  MILK!"), GOALS[1])]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("", "is not a file or dataset"),
        ("teech:train", "did you mean 'teach'?"),
        ("own.jsonl[2]", "expected a slice [FROM:TO], counted from 0"),
        ("teach:night", "no split 'night'"),
        ("none.jsonl", "cannot be read"),
        ("own.jsonl[3:]", "leaves no dialogues"),
    ],
)
def test_what_names_no_dialogue_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    rows_file(Path("own.jsonl"), "aab")
    message = refused(lambda: read_source(name, tmp_path))
    assert said in message
    assert "\n" not in message


def sources() -> list[Source]:
    """30 groups of two dialogues, and 5 of one."""
    pairs = [replace(case(n), group=f"p{n // 2}") for n in range(60)]
    return [Source("pairs", pairs, "1"), Source("singles", [case(n) for n in range(60, 65)], "2")]


def groups_of(cases: Sequence[Case]) -> set[str]:
    return {each.group for each in cases}


def test_no_group_is_on_both_sides_and_at_most_a_third_validates() -> None:
    train, validation = parted(sources(), validation=99, seed=1)
    assert not groups_of([*train[0], *train[1]]) & groups_of(validation)
    assert [len(own) for own in train] == [40, 4]
    assert len(validation) == 20 + 1  # of the smaller source one at least
    everything = [each.id for own in [*train, validation] for each in own]
    assert sorted(everything) == sorted(each.id for own in sources() for each in own.cases)


def test_the_seed_alone_parts_them() -> None:
    first = parted(sources(), validation=4, seed=1)
    assert parted(sources(), validation=4, seed=1) == first
    assert parted(sources(), validation=4, seed=2) != first
    assert parted(sources()[::-1], validation=4, seed=1)[0] == first[0][::-1]
    lone = Source("lone.jsonl", [replace(case(n), group="a") for n in range(9)], "3")
    message = refused(lambda: parted([*sources(), lone], validation=9, seed=1))
    assert "All dialogues of lone.jsonl are in one group" in message


def test_a_dialogue_validates_once_with_either_of_its_goal_sets() -> None:
    cases = [case(n) for n in range(30)]
    others = [replace(each, goals=GOALS[:3], truth=0) for each in cases]
    train, validation = parted([Source("both", [*cases, *others], "1")], validation=99, seed=1)
    assert len(validation) == len({each.id for each in validation}) == 10
    assert {len(each.goals) for each in validation} == {3, 6}
    assert len(train[0]) == 40
    assert not groups_of(train[0]) & groups_of(validation)


def test_overlapping_parts_of_a_file_do_not_validate_what_the_other_teaches() -> None:
    cases = [case(n) for n in range(20)]
    parts = [Source("x", cases, "1"), Source("x[:18]", cases[:18], "1")]
    other = replace(parts[1], sha256="2")  # whose groups are others, though of the same names
    for seed in range(1, 6):
        train, validation = parted(parts, validation=9, seed=seed)
        assert not groups_of([*train[0], *train[1]]) & groups_of(validation)
        train, _ = parted([parts[0], other], validation=2, seed=seed)
        assert [len(own) for own in train] == [19, 17]


def test_what_was_learned_from_does_not_validate() -> None:
    whole = parted(sources(), validation=12, seed=1)[1]
    learned = {said_key(each.turns) for each in whole}
    mine = [replace(case(n), turns=(Turn("What?", f"no. {n}"),)) for n in range(30)]
    source = Source("mine", mine, "3")
    first = parted([source], validation=10, seed=1)[1]
    keys = {said_key(each.turns) for each in first[:4]}
    train, second = parted([source], validation=10, seed=1, learned=keys)
    assert len(second) == 10
    assert not keys & {said_key(each.turns) for each in second}
    assert {each.id for each in first[4:]} < {each.id for each in second}
    assert {each.id for each in first[:4]} < {each.id for each in train[0]}
    every = {said_key(each.turns) for each in mine}
    with pytest.raises(InvalidInputError, match="fitted on all these dialogues"):
        parted([source], validation=10, seed=1, learned=every)
    assert parted([source], validation=10, seed=1, learned=learned)[1] == first
