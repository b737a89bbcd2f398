"""The corpus of goals that change: whole, and balanced."""

import json
from collections import Counter
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "corpus" / "changes"
FILES = sorted(FOLDER.glob("*/*.jsonl"))
KINDS = {"denied", "opposite", "postponed", "delegated", "done", "asked", "others", "withdrawn",
         "exchanged", "elsewhere", "problem"}  # fmt: skip


def rows(file: Path):
    return [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_each_desk_is_whole(file: Path) -> None:
    desks = rows(file)
    assert len(desks) == len({desk["id"] for desk in desks}) == 14
    for desk in desks:
        assert desk["id"].startswith(f"{file.stem}-")
        assert len(desk["goals"]) == 6
        assert all(len(way) == 3 and all(map(str.strip, way)) for way in desk["goals"])
        assert {each["true"] for each in desk["said"]} == {*range(6)}
        for each in desk["dialogues"]:
            assert each["kind"] in KINDS
            assert len(each["true"]) == len(each["turns"]) > 0
            assert {*each["true"]} <= {None, *range(6)}
            assert all(turn["utterance"].strip() for turn in each["turns"])


def test_there_are_as_many_controls_as_changes_and_the_readme_counts_them() -> None:
    dialogues = [each for file in FILES for desk in rows(file) for each in desk["dialogues"]]
    controls = Counter(each["control"] for each in dialogues)
    assert controls[True] == controls[False] == 4064
    readme = (FOLDER / "README.md").read_text(encoding="utf-8")
    for number in (len(dialogues), controls[False], sum(len(rows(file)) for file in FILES)):
        assert f"{number:,}" in readme


def test_most_controls_end_with_a_listed_goal_and_most_changes_do_not() -> None:
    dialogues = [each for file in FILES for desk in rows(file) for each in desk["dialogues"]]
    listed = {
        control: sum(each["true"][-1] is not None for each in dialogues
                     if each["control"] == control) / 4064
        for control in (True, False)
    }  # fmt: skip
    assert listed[True] > 0.9
    assert listed[False] < 0.5


def test_no_two_people_say_the_same() -> None:
    said = [
        each["utterance"].casefold()
        for file in FILES for desk in rows(file) for each in desk["said"]
    ]  # fmt: skip
    assert len({*said}) > 0.995 * len(said)
