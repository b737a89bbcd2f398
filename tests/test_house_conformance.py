"""How far the house agrees with recordings: of itself, altered by known amounts, and real ones."""

from __future__ import annotations

import gzip
import json
import os
import sys
from collections import Counter
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

from goalscope.envs.house.simulator.object_types import PREDICATES
from goalscope.envs.house.simulator.scenes import load_scene
from houses import facts, house, named, run

sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))

from conformance import (
    Agreement,
    compare_episode,
    main,
    recordings,
    replay_game,
    replay_games,
    rows,
)

STEPS = ["OpenObject Fridge", "PickupObject Egg", "OpenObject Apple", "PutObject CounterTop"]
"""Their changes: isOpen; isPickedUp and parentReceptacles; none, it fails; both again, and Cold
stays. So there are 5 changes, in 4 steps."""

Row = dict[str, Any]


def record(*steps: str) -> list[Row]:
    """What AI2-THOR would write down of the steps, were it this house."""
    home = house()
    found = [
        {"action": {"action": "Initialize"}, "metadata": json.loads(json.dumps(home.metadata()))}
    ]
    for step in steps:
        metadata = json.loads(json.dumps(run(home, step)))
        name, words = step.split()
        action = {"action": name, "objectId": named(home, words), "forceAction": True}
        found.append({"action": action, "metadata": metadata})
    return found


def thing(row: Row, kind: str) -> dict[str, Any]:
    return next(each for each in row["metadata"]["objects"] if each["objectType"] == kind)


def write(path: Path, lines: list[Any]) -> Path:
    text = "".join(f"{json.dumps(line)}\n" for line in lines)
    path.write_bytes(gzip.compress(text.encode()) if path.suffix == ".gz" else text.encode())
    return path


def alter(episode: list[Row]) -> None:
    """A wrong outcome, a tap that was toggled, a place that differs, and a new thing."""
    episode[1]["metadata"]["lastActionSuccess"] = False
    thing(episode[-1], "Faucet")["isToggled"] = True
    thing(episode[-1], "Egg")["parentReceptacles"] = ["Elsewhere"]
    thing(episode[-1], "Egg")["position"]["x"] += 0.3
    new = {"objectId": "New|+1|+1|+1", "parentReceptacles": None, "isCooked": True}
    episode[-1]["metadata"]["objects"].append(thing(episode[-1], "Apple") | new)


def compare(path: Path, lines: list[Any]) -> Agreement:
    agreement = Agreement()
    compare_episode(write(path, lines), agreement)
    return agreement


def test_each_difference_to_a_recording_is_counted_once(tmp_path: Path) -> None:
    episode = record(*STEPS)
    same = compare(tmp_path / "same.jsonl.gz", episode)
    assert (same.steps, same.agreed, same.hits, same.f1) == (4, 4, 5, 1.0)
    alter(episode)
    agreement = compare(tmp_path / "altered.jsonl.gz", episode)
    assert (agreement.steps, agreement.agreed, agreement.hits) == (4, 3, 4)
    missed = {("PutObject", key): 1 for key in ("isToggled", "isCooked", "parentReceptacles")}
    assert dict(agreement.missed) == missed
    assert dict(agreement.extra) == {("PutObject", "parentReceptacles"): 1}
    assert (agreement.precision, agreement.recall) == (4 / 5, 4 / 7)
    assert len(agreement.examples) == 4


ACTS = ["Open Fridge", "Pickup Egg", "Place CounterTop", "Slice Apple", "ToggleOn StoveKnob"]


def teach(each: dict[str, Any]) -> dict[str, Any]:
    """An object as TEACh writes it down: what is false is left out."""
    known = {key: each[key] for key in PREDICATES if each.get(key) and key != "temperature"}
    same = {key: each[key] for key in ("objectId", "objectType")}
    place = [each["position"][axis] for axis in "xyz"]
    return {**same, "p": place, "ObjectTemperature": each["temperature"], **known}


def game(*acts: str) -> Row:
    """TEACh's record of what a person did, were AI2-THOR this house."""
    home = house()
    before = [teach(each) for each in facts(home)["objects"]]
    names = {"Place": "PutObject", "ToggleOn": "ToggleObjectOn"}
    interactions: list[dict[str, Any]] = []
    for second, act in enumerate(acts):
        name, words = act.split()
        own = named(home, words)
        run(home, f"{names.get(name, f'{name}Object')} {words}")
        done = {"agent": "driver", "success": True, "action": name, "oid": own, "t": second}
        interactions.append(done)
    after = [teach(each) for each in facts(home)["objects"]]
    lists = {"initial_objects": before, "final_objects": after}
    return {"world": "Kitchen1", "interactions": interactions, **lists}


def replay(row: Row) -> Agreement:
    agreement = Agreement()
    replay_game(row, load_scene("Kitchen1"), agreement)
    return agreement


def test_a_game_is_judged_by_its_end() -> None:
    row = game(*ACTS)
    agreement = replay(row)
    assert (agreement.steps, agreement.agreed, agreement.f1) == (5, 5, 1.0)
    whole = agreement.hits
    end = {each["objectType"]: each for each in row["final_objects"]}
    del end["Fridge"]["isOpen"]
    end["Plate"]["isDirty"] = True
    agreement = replay(row)
    assert agreement.hits == whole - 1
    assert agreement.extra == Counter({("game", "isOpen"): 1})
    assert agreement.missed == Counter({("game", "isDirty"): 1})


def test_what_is_hot_cools_while_the_person_waits() -> None:
    row = game("Pickup Egg", "Place CounterTop")
    agreement = replay(row)
    assert not agreement.extra
    row["interactions"][1]["t"] = 30
    assert replay(row).extra == Counter({("game", "temperature"): 1})


def test_the_script_tells_and_writes_the_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def called(*arguments: object) -> None:
        monkeypatch.setattr(sys, "argv", ["conformance.py", *map(str, arguments)])
        main()

    folder, told = tmp_path / "recordings", tmp_path / "told.json"
    folder.mkdir()
    episode = record(*STEPS)
    alter(episode)
    write(folder / "episode.jsonl", episode)
    called(folder, "--json", told)
    assert json.loads(told.read_text())["recordings"]["success_agreement"] == 0.75
    assert "4 actions, success agrees in 75.0%" in " ".join(capsys.readouterr().out.split())
    with pytest.raises(SystemExit, match="There is no file"):
        called(tmp_path / "none.jsonl")
    with pytest.raises(SystemExit):
        called()
    assert "Name recordings" in capsys.readouterr().err


@pytest.fixture
def data() -> Path:
    folder = os.environ.get("GOALSCOPE_DATA")
    if not folder:
        pytest.skip("GOALSCOPE_DATA is unset: it names the folder with the real recordings")
    return Path(folder)


def test_the_house_does_what_real_ai2_thor_did(data: Path) -> None:
    agreement = Agreement()
    for path in recordings([data / "thor" / "traces"]):
        compare_episode(path, agreement)
    assert agreement.steps >= 60
    assert agreement.success_agreement == 1.0
    assert agreement.f1 >= 0.95


def test_the_house_ends_as_real_games_ended(data: Path, tmp_path: Path) -> None:
    games = data / "dialogue" / "teach" / "teach_valid_seen.jsonl.gz"
    first = write(tmp_path / "games.jsonl", list(islice(rows(games), 20)))
    agreement = Agreement()
    replay_games(first, data / "thor" / "scenes", agreement)
    assert agreement.steps > 200
    assert agreement.success_agreement >= 0.97
    assert agreement.f1 >= 0.85
