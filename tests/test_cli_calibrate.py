"""`goalscope calibrate`: from a file of results to a calibration that is used from then on."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from commands import fails, run
from goalscope import models
from goalscope.belief.calibration import (
    SHIPPED,
    YOURS,
    calibration_file,
    calibration_from_json,
    calibration_named,
    known_calibration,
)
from goalscope.cli.calibrate import OWN
from goalscope.experiment import measure as measuring
from goalscope.experiment.results import Results
from goalscope.storage.store import Store
from test_calibrating import some

pytest.importorskip("scipy.optimize")

MODEL = {"model": "/m/small.gguf"}
SCORER = SimpleNamespace(name="small", adapter=None)


@pytest.fixture(autouse=True)
def data(tmp_path, monkeypatch):
    """A data folder of one's own; a model that needs no loading."""
    monkeypatch.setattr("platformdirs.user_data_path", lambda *_: tmp_path / "data")
    monkeypatch.setattr(
        measuring, "opened", lambda model: SimpleNamespace(speaker=scorer_of(model))
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path / "data"


def scorer_of(model):
    return SCORER if model == MODEL else SimpleNamespace(name=str(model), adapter=None)


def cells(n, seed=0, *, model=MODEL, layout="goal-last", set="teach", goals=5, groups=99):
    """Specs with results, of people to whom a temperature of 3 is right."""
    for i, each in enumerate(some(n, seed, factor=3.0, goals=goals)):
        case = {"id": each.id, "group": f"g{i % groups}", "task": "t", "truth": each.truths[-1]}
        case |= {"goals": [f"g{k}" for k in range(goals)], "turns": [{}] * len(each.goals)}
        spec = {"kind": "dialogue", "set": set, "split": "valid", "goal_set": "hard", "case": case}
        spec |= {"model": model, "layout": layout}
        yield spec, {"role-play": each.goals.tolist(), "unspecified": each.unspecified.tolist()}


def fill(name, *rows):
    with Results.open(name) as results:
        planned = results.plan([spec for spec, _ in rows])
        results.ask_for(planned)
        for cell, (_, result) in zip(planned, rows, strict=True):
            if result is not None:
                results.keep(cell.key, result, {})
    return name


def calibrated(*args):
    """What the command says, which must succeed."""
    result = run("calibrate", *args, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_a_model_is_calibrated_from_then_on(data):
    fill("r.db", *cells(60))
    before = known_calibration(SCORER, "goal-last")
    assert "not calibrated" in before[1]
    told = calibrated("r.db", "--save")
    found, origin = known_calibration(SCORER, "goal-last")
    assert origin == YOURS
    assert found == calibration_from_json(told["calibration"])
    assert found.temperature == pytest.approx(3, rel=0.3)
    assert (found.n, len(found.thresholds)) == (60, 5)
    file = calibration_file(SCORER, "goal-last")
    assert told["files"] == [str(file)]
    assert [each for each in data.rglob("*") if each.is_file()] == [file]
    kept = json.loads(file.read_text())
    assert kept | {"files": [str(file)], "better": None} == told
    assert (told["model"], told["layout"]) == ("small", "goal-last")
    assert told["dialogues"] == {"teach hard": 60}
    quality = told["quality"]
    assert list(quality) == ["Eq. 1", "default", "held out"]
    assert {row["n"] for row in quality.values()} == {60}
    assert quality["held out"]["log_loss"] < quality["Eq. 1"]["log_loss"]
    assert all(0.7 < share <= 1 for share in quality["held out"]["coverage"])
    assert quality["Eq. 1"]["coverage"] is None
    again = calibrated("r.db")
    assert [*again["quality"]] == ["Eq. 1", "default", "the model's own", "held out"]
    own, held_out = (again["quality"][name]["log_loss"] for name in ("the model's own", "held out"))
    assert own < held_out  # since it was fitted on these, and so it says nothing against the new
    assert again["better"] is None


def test_what_is_better_than_what_was_fitted_is_told(data):
    rows = [(spec, sure(spec, result)) for spec, result in cells(4, goals=3)]
    case = rows[-1][0]["case"]
    case["truth"] = (case["truth"] + 1) % 3  # of the last the words mislead, and nobody expects it
    fill("r.db", *rows)
    told = calibrated("r.db", "--out", "mine.json")
    losses = {name: row["log_loss"] for name, row in told["quality"].items()}
    best = min(losses, key=lambda name: losses[name])
    assert told["better"] == best != "held out"
    shown = " ".join(run("calibrate", "r.db", "--out", "mine.json").stdout.split())
    assert (
        f'By log-loss, "{best}" ({losses[best]:.3f}) is better than the calibration fitted' in shown
    )
    assert f"({losses['held out']:.3f})" in shown


def test_without_out_or_save_it_is_shown_and_nothing_is_written(data):
    fill("r.db", *cells(12), *cells(6, 1, set="[/b]"))
    shown = run("calibrate", "r.db")
    assert shown.exit_code == 0, shown.output
    made = calibration_from_json(calibrated("r.db")["calibration"])
    text = " ".join(shown.stdout.split())
    for words in ("small, goal-last", "12 of teach hard", "6 of [/b] hard", "held out", " %",
                  f"temperature {made.temperature:g}", "not saved", "--save makes it"):  # fmt: skip
        assert words in text
    assert not data.exists()


def test_of_several_models_and_layouts_one_is_named_from_all_files(data):
    fill("one.db", *cells(8), *cells(7, 2, layout="goal-first"), *cells(8, 4, model={}))
    fill("two.db", *cells(8, 1, set="casino"))
    said = fails(2, "calibrate", "one.db", "two.db")
    assert "3 ways: small, goal-last; small, goal-first; SmolLM2-135M-Instruct, goal-last." in said
    told = calibrated("one.db", "two.db", "--only", "small, goal-last", "--out", "mine.json")
    assert told["dialogues"] == {"teach hard": 8, "casino hard": 8}
    assert calibration_named("mine.json").n == 16
    assert calibrated("one.db", "--only", "small, goal-first")["calibration"]["n"] == 7
    said = fails(2, "calibrate", "one.db", "--only", "large, goal-last")
    assert "no results of 'large, goal-last'. They have: small, goal-last; small, goal" in said


def test_what_was_not_measured_or_asked_for_is_passed_over(data):
    rows = list(cells(10))
    fill("r.db", *rows[:2])
    later = [(spec, None if i < 3 else result) for i, (spec, result) in enumerate(rows[2:])]
    mcq = {"kind": "mcq", "row": {}, "model": MODEL, "layout": "goal-last"}
    fill("r.db", *later, (mcq, {"tokens": 2}))
    told = calibrated("r.db")
    assert told["dialogues"] == {"teach hard": 5}


def test_what_cannot_be_used_is_said_in_one_line(data, tmp_path):
    (tmp_path / "text.db").write_text("no database at all, only words " * 99)
    Store.open(tmp_path / "episodes.db").close()
    fill("mcq.db", ({"kind": "mcq", "row": {}, "model": {}, "layout": "goal-last"}, {"tokens": 2}))
    fill("undone.db", *[(spec, None) for spec, _ in cells(4)])
    fill("lone.db", *cells(6, groups=1))
    for code, file, cause in [
        (2, "no.db", "There is no file no.db"),
        (2, "text.db", "text.db is not a SQLite file"),
        (2, "episodes.db", "no dialogues"),
        (2, "mcq.db", "no dialogues"),
        (2, "undone.db", "no dialogues"),
        (2, "lone.db", "at least three people"),
    ]:
        assert cause in fails(code, "calibrate", file)
    assert "Expected a file of results" in fails(2, "calibrate")
    assert not data.exists()


def test_with_out_it_is_written_there_only_of_as_few_as_three_people(data):
    fill("r.db", *((spec, sure(spec, result)) for spec, result in cells(3, goals=3)))
    made = run("calibrate", "r.db", "--out", "new/mine.json", "--json")
    assert made.exit_code == 0, made.output
    told = json.loads(made.stdout)
    found = calibration_named("new/mine.json")
    assert found == calibration_from_json(told["calibration"])
    assert 0 < found.temperature < 1  # however sure the evidence
    assert told["files"] == [str(Path("new/mine.json"))]
    assert not data.exists()


def sure(spec, result):
    """The true goal is always the likeliest, and without it none is."""
    goals = [[0.0 if i == spec["case"]["truth"] else -1.0 for i in range(3)]] * 4
    return {"role-play": goals, "unspecified": [-0.5] * 4}


def test_of_few_people_nothing_becomes_the_models_own(data):
    fill("few.db", *cells(60, groups=49))
    said = fails(2, "calibrate", "few.db", "--save")
    assert "small, goal-last has dialogues of 49 people, and --save needs 50" in said
    assert not data.exists()
    fill("enough.db", *cells(50))
    assert run("calibrate", "enough.db", "--save").exit_code == 0
    assert known_calibration(SCORER, "goal-last")[1] == YOURS


def test_without_its_file_a_model_has_the_calibration_of_before(data, monkeypatch):
    adapter = Path(models.__file__).parent / "general" / "adapter.gguf"
    shipped = SimpleNamespace(name="Smollm2 135M 8k Lc100K Mix1 Ep2", adapter=adapter)
    known = {False: SimpleNamespace(speaker=shipped), True: SimpleNamespace(speaker=SCORER)}
    monkeypatch.setattr(measuring, "opened", lambda model: known[model == MODEL])
    before = known_calibration(shipped, "goal-last")
    assert before[1] == SHIPPED
    fill("one.db", *cells(50, model={}))
    fill("two.db", *cells(50, 1))
    for file, own in (("one.db", [OWN]), ("one.db", [OWN]), ("two.db", [])):
        result = run("calibrate", file, "--save")
        assert result.exit_code == 0, result.output
        assert re.findall(rf"{OWN}(?= +\d)", result.stdout) == own
    calibration_file(SCORER, "goal-last").unlink()
    assert known_calibration(SCORER, "goal-last")[1] != YOURS
    assert known_calibration(shipped, "goal-last")[1] == YOURS
    calibration_file(shipped, "goal-last").unlink()
    assert known_calibration(shipped, "goal-last") == before
