"""Datasets that are missing or broken, and dialogues of one's own."""

import gzip
import json
import re
from pathlib import Path
from typing import Any

import pytest

from goalscope.base.types import Turn
from goalscope.datasets import DATASETS, data_folder, load
from goalscope.datasets.case import read_cases
from test_datasets import (
    MAKE,
    game,
    games,
    made,
    packed,
    refused,
)


def test_what_is_missing_is_named_with_its_source(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = refused(lambda: load("casino", tmp_path))
    assert "CaSiNo (valid)" in said
    assert "casino_valid.json" in said
    assert "goalscope data list" in said
    monkeypatch.delenv("GOALSCOPE_DATA", raising=False)
    assert "--data" in refused(lambda: data_folder(None))
    assert "nowhere" in refused(lambda: data_folder(tmp_path / "nowhere"))
    monkeypatch.setenv("GOALSCOPE_DATA", str(tmp_path))
    assert data_folder(None) == tmp_path


def test_unknown_options_name_the_nearest(tmp_path: Path) -> None:
    packed(tmp_path, "teach", games())
    assert "'casino'" in refused(lambda: load("cassino", tmp_path))
    assert "'valid_seen'" in refused(lambda: load("teach", tmp_path, split="valid_sen"))
    assert "'hard'" in refused(lambda: load("teach", tmp_path, goal_set="hart"))
    assert "at least 2" in refused(lambda: load("teach", tmp_path, goals=1))
    assert "at least 1" in refused(lambda: load("teach", tmp_path, limit=0))
    assert "fewer than 20 goals" in refused(lambda: load("teach", tmp_path))


BROKEN: list[tuple[str, list[str], str]] = [
    ("teach", ["desc"], "'desc'"),
    ("multiwoz", ["log"], "'log'"),
    ("casino", ["participant_info", "mturk_agent_1", "value2issue", "Low"], "'Low'"),
    ("alfred", ["pddl_params", "parent_target"], "'parent_target'"),
    ("taskmaster4", ["order_items"], "'order_items'"),
]


@pytest.mark.parametrize(("name", "path", "named"), BROKEN)
@pytest.mark.parametrize("value", ["absent", 7])
def test_a_broken_row_is_refused_with_its_place(
    name: str, path: list[str], named: str, value: object, tmp_path: Path
) -> None:
    rows = MAKE[name]()
    inner: Any = rows[1]
    for key in path[:-1]:
        inner = inner[key]
    if value == "absent":
        del inner[path[-1]]
    else:
        inner[path[-1]] = value
    file = packed(tmp_path, name, rows)
    said = refused(lambda: made(tmp_path, name, DATASETS[name].goal_sets[0]))
    assert named in said
    assert str(file) in said
    assert re.search(r"line 2|dialogue ('D1'|2)", said)


def test_broken_files_are_refused_with_their_cause(tmp_path: Path) -> None:
    for name in MAKE:
        file = packed(tmp_path, name, MAKE[name]())
        whole = file.read_bytes()
        for broken in (b"{", b"", whole[: len(whole) // 2], b"\xff" * 50):
            file.write_bytes(broken)
            said = refused(lambda name=name: load(name, tmp_path, goals=3))
            assert str(file) in said
    file = packed(tmp_path, "teach", games())
    with gzip.open(file, "at") as lines:
        lines.write('{"game_id": \n')
    assert "line 8: not JSON" in refused(lambda: load("teach", tmp_path, goals=3))
    broken = game(9, "Wash", "Wash \ud800.", ("commander", "so"))
    packed(tmp_path, "teach", [*games(), broken])
    assert "lone surrogate" in refused(lambda: load("teach", tmp_path, goals=3))
    packed(tmp_path, "teach", [*games(), games()[0]])
    assert "'g0'" in refused(lambda: load("teach", tmp_path, goals=3))


def own(**changed: object) -> dict[str, Any]:
    return {
        "id": 1,
        "task": "Help in the kitchen.",
        "turns": [{"query": "", "utterance": "Put the kettle on."}],
        "goals": ["bake a cake", "make tea"],
        "true": "make tea",
        **changed,
    }


def written(folder: Path, *rows: object) -> Path:
    file = folder / "own.jsonl"
    file.write_text("\n\n".join(json.dumps(row) for row in rows))
    return file


def test_own_dialogues_are_cases(tmp_path: Path) -> None:
    first, second = read_cases(written(tmp_path, own(), own(id="b", group="kin", true=0)))
    assert (first.id, first.group, first.truth) == ("1", "1", 1)
    assert (second.id, second.group, second.truth) == ("b", "kin", 0)
    assert first.turns == (Turn("", "Put the kettle on."),)
    (same,) = read_cases(written(tmp_path, own(true="Make  tea.")))
    assert same.truth == 1


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"true": "make a tea"}, "did you mean 'make tea'"),
        ({"goals": ["make tea"]}, "there is one goal; expected at least two"),
        ({"goals": ["make tea", "Make tea."]}, "'Make tea.' is the same as 'make tea'. Leave one"),
        ({"group": []}, "'group'"),
        ({"id": "1"}, "'1'"),
        ({"turns": []}, "'turns'"),
        ({"turns": [{"utterence": "Tea."}]}, "turns 1: the key 'utterence' is unknown; did you"),
        ({"groop": "kin"}, "the key 'groop' is unknown; did you mean 'group'?"),
    ],
)
def test_own_rows_that_are_no_case_are_refused(
    changed: dict[str, Any], said: str, tmp_path: Path
) -> None:
    message = refused(lambda: read_cases(written(tmp_path, own(), own(**{"id": 2, **changed}))))
    assert "line 3" in message
    assert said in message


def test_keys_that_are_nothing_like_ours_are_passed_over(tmp_path: Path) -> None:
    more = own(split="dev", trace=[1], source={"file": "x"}, truth=1)
    assert read_cases(written(tmp_path, more)) == read_cases(written(tmp_path, own()))
    wrong = {("trew" if key == "true" else key): value for key, value in own().items()}
    assert "did you mean 'true'?" in refused(lambda: read_cases(written(tmp_path, wrong)))
