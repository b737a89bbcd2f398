"""`goalscope house`, and episodes of the home robot on the command line."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from commands import fails, run
from goalscope.agent.people import AGREES
from goalscope.base.types import Turn
from goalscope.envs.house import HouseController, load_profiles
from goalscope.storage.store import Store

ORDERS = """
[[profile]]
name = "tidy"
scene = "Kitchen1"
description = "You want the tomato and the apple in the fridge."
replies = ["Put the tomato in the fridge, please.", "Slice the bread, please."]
checks = [
    { object = "Tomato", in = "Fridge" },
    { object = "Bread", isSliced = true },
    { no = "Fridge", isOpen = true },
]
"""


@pytest.fixture(autouse=True)
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "episodes.db"))
    monkeypatch.setenv("GOALSCOPE_SCENES", str(tmp_path / "scenes"))


def refused(*args: object) -> str:
    result = run(*args)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    return result.stderr.splitlines()[-1]


def metadata() -> dict[str, Any]:
    return HouseController("Bathroom1").last_event.metadata


def test_scenes_are_listed_and_every_profile_has_one() -> None:
    listed = {row["name"] for row in json.loads(run("house", "scenes", "--json").stdout)}
    assert len(listed) >= 4
    assert {profile.scene for profile in load_profiles()} <= listed


def test_a_broken_scene_is_listed_with_its_error_among_the_others(tmp_path: Path) -> None:
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "Broken.json").write_text("{")
    (tmp_path / "scenes" / "Mine.json").write_text(json.dumps(metadata()))
    result = run("house", "scenes")
    assert result.exit_code == 0, result.output
    text = " ".join(result.stdout.split())
    assert "Broken cannot be used: The scene Broken.json is not valid JSON" in text
    assert re.search(r"Mine \d+ objects", text)
    rows = json.loads(run("house", "scenes", "--json").stdout)
    listed = {row["name"]: row for row in rows}
    assert "Broken.json" in listed["Broken"]["error"]
    assert listed["Mine"]["objects"] == listed["Bathroom1"]["objects"]


def test_a_picture_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "no" / "room.svg", tmp_path):
        assert "or name another one" in fails(1, "house", "show", "Bedroom1", "--svg", path)


def test_run_asks_before_it_slices_and_scores_the_final_state(tmp_path: Path) -> None:
    (tmp_path / "people.toml").write_text(ORDERS)
    args = ["run", "house", "--profile", "tidy", "--profiles", tmp_path / "people.toml"]
    args += ["--method", "no-goals", "--picture", tmp_path / "room.svg"]
    result = run(*args)
    assert result.exit_code == 0, result.output
    assert 'I understood "slice bread". That cannot be undone.' in " ".join(result.stdout.split())
    assert "score 1.00" in result.stdout
    assert "fridge" in result.stdout
    assert "slice" in (tmp_path / "room.svg").read_text()
    with Store.open(None) as store:
        (info,) = store.episodes()
        rounds = store.rounds(info.id)
    assert info.domain == "house"
    asked = next(n for n, round in enumerate(rounds) if round.question)
    assert rounds[asked + 1].turn == Turn(rounds[asked].question, AGREES)
    assert any(result.irreversible for round in rounds for result in round.results)
    shown = run("replay", info.id).stdout
    assert re.search("slice: bread", shown)


def test_chat_in_the_house_goes_on_where_it_stopped() -> None:
    first = run("chat", "house", "--method", "no-goals", "--scene", "Kitchen1",
                   input="Put the tomato in the fridge.\nquit\n")  # fmt: skip
    assert first.exit_code == 0, first.output
    id = re.search(r"--resume (\w+)", first.output)
    assert id
    second = run("chat", "house", "--resume", id[1], input="where is the tomato?\nTask completed\n")
    assert second.exit_code == 0, second.output
    assert "tomato: now in the fridge" in second.stdout
