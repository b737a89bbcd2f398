"""The command line: what is said, what is kept, and with which exit code."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from commands import ROW, fails, rows_file, run
from fakes import NamedModel
from goalscope.base.types import UNSPECIFIED, Goal
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import (
    DEFAULT,
    PAPER,
    calibration_from_json,
    keep_calibration,
)
from goalscope.experiment.results import sole

SOURCE = str(Path(__file__).parents[1] / "src")


@pytest.mark.parametrize(
    ("command", "unused"),
    [
        (
            "",
            {
                "numpy",
                "rich",
                "jinja2",
                "wordllama",
                "goalscope.models.llama.engine",
                "goalscope.agent.agent",
            },
        ),
        ("app(['--help'], standalone_mode=False)", {"numpy", "rich", "pydantic", "sqlalchemy"}),
        (
            "app(['episodes'], standalone_mode=False)",
            {"goalscope.models.llama.engine", "goalscope.agent.agent"},
        ),
    ],
    ids=["nothing", "help", "episodes"],
)
def test_a_command_imports_only_what_it_uses(command, unused):
    code = f"import sys; from goalscope.cli.main import app; {command or 'pass'}\n"
    code += f"print([m for m in sys.modules if m in {unused}])"
    env = os.environ | {"PYTHONPATH": SOURCE}
    loaded = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, check=True)
    assert loaded.stdout.splitlines()[-1] == b"[]"


def test_what_cannot_be_found_is_said_in_one_line(shop, tmp_path):
    assert "baker" in fails(2, "run", "--profile", "nobody", *shop)
    missing = tmp_path / "no.gguf"
    assert "no.gguf" in fails(1, "run", "--profile", "baker", *shop, "--model", missing)
    assert "no.csv" in fails(2, "chat", "--catalogue", tmp_path / "no.csv")
    assert "NAME=TITLE" in fails(2, "run", "--profile", "baker", *shop, "--column", "name")
    assert "default" in fails(2, "run", "--profile", "baker", *shop, "--calibration", "papr")
    for given in ("often", "1.5"):
        assert '"paper"' in fails(2, "run", "--profile", "baker", *shop, "--propose", given)
    assert "goalscope episodes" in fails(2, "replay", "nothing")
    assert "goalscope episodes" in fails(2, "chat", "--resume", "nothing")


@pytest.mark.parametrize(
    ("broken", "cause"),
    [
        ("[]", "expected a JSON object, got []. A line is a dialogue: {"),
        ({**ROW, "id": "b", "goals": ["x", " unspecified."]}, "always counts besides"),
    ],
)
def test_a_broken_row_is_named_before_anything_is_written(tmp_path, broken, cause):
    file = rows_file(tmp_path, ROW, broken)
    line = fails(2, "infer", file, "--out", tmp_path / "out.jsonl")
    assert "line 2" in line
    assert cause in line
    assert not (tmp_path / "out.jsonl").exists()


def test_only_near_names_are_suggested():
    assert "Did you mean 'replay'?" in run("replya").stderr
    unlike = run("xyzzy")
    assert (unlike.exit_code, "Did you mean" in unlike.stderr) == (2, False)
    assert "No such command 'xyzzy'" in unlike.stderr


def test_infer_writes_a_belief_per_turn(tmp_path):
    out = tmp_path / "out.jsonl"
    file = rows_file(tmp_path, ROW, "", {**ROW, "id": 2, "goals": ["cook soup", "Cook  soup."]})
    said = run("infer", file, "--out", out)
    assert (said.exit_code, said.stdout) == (0, "")
    assert said.stderr.splitlines() == [f"{out}: 2 dialogues, 4 turns"]  # and no bar
    lines = [json.loads(line) for line in out.read_text().splitlines()]
    assert [(line["id"], line["turn"]) for line in lines] == [
        ("a", 1),
        ("a", 2),
        ("2", 1),
        ("2", 2),
    ]
    assert lines[2]["goals"] == ["cook soup"]
    assert {line["settings"]["model"] for line in lines} == {"SmolLM2-135M-Instruct"}
    first, second = lines[:2]
    way = calibration_from_json(second["settings"]["calibration"])
    belief = Belief.uniform(map(Goal, second["goals"]), way)
    whether = Belief.uniform([*belief.goals, UNSPECIFIED], way)
    for line in (first, second):
        belief = belief.observe(line["log_likelihood"])
        row = [*line["log_likelihood"], line["unspecified_log_likelihood"]]
        whether = whether.observe(row)
        assert line["log_posterior"] == pytest.approx(belief.log_posterior)
        assert line["probability"] == pytest.approx(belief.probability)
        assert line["unspecified_probability"] == pytest.approx(whether.probability[-1])
    assert sum(second["probability"]) == pytest.approx(1)
    assert second["probability"][0] > 0.5
    assert first["unspecified_log_likelihood"] < 0

    whole = out.read_text()
    out.write_text(whole[: whole.index('{"id": "2"') + 3])
    assert run("infer", file, "--out", out).exit_code == 0
    assert out.read_text() == whole


def test_processes_that_start_at_once_in_a_new_home_score_alike(tmp_path):
    """Nothing about the machine is measured at the first use, which two would measure apart."""
    file, home = rows_file(tmp_path, ROW), tmp_path / "home"
    home.mkdir()
    outs = [tmp_path / f"{number}.jsonl" for number in range(2)]
    places = {name: str(home) for name in ("HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME")}
    code = "from goalscope.cli.main import main; main()"
    started = [
        subprocess.Popen(
            [sys.executable, "-c", code, "infer", file, "--out", out],
            env=os.environ | {"PYTHONPATH": SOURCE} | places,
        )
        for out in outs
    ]
    assert [process.wait() for process in started] == [0, 0]
    one, other = (out.read_text() for out in outs)
    assert one == other
    assert not [*home.rglob("*")]


def test_infer_leaves_foreign_files_alone(tmp_path, words):
    file = rows_file(tmp_path, ROW)
    assert "no folder nodir. Create it" in fails(2, "infer", file, "--out", "nodir/b.jsonl")
    for foreign in ("my notes", "my notes\n", '{"id": "other", "turn": 1}\n'):
        (tmp_path / "out.jsonl").write_text(foreign)
        assert "Name another file" in fails(2, "infer", file, "--out", tmp_path / "out.jsonl")
        assert (tmp_path / "out.jsonl").read_text() == foreign


def test_one_process_at_a_time_infers_into_a_file(tmp_path, words):
    file, out = rows_file(tmp_path, ROW), tmp_path / "out.jsonl"
    other = tmp_path / "link.jsonl"
    other.symlink_to(out)
    with sole(out):
        for name in (out, other):
            assert "Another process is writing to" in fails(2, "infer", file, "--out", name)
    assert not out.exists()
    assert run("infer", file, "--out", out).exit_code == 0


@pytest.mark.parametrize("part", ["query", "utterance", "task"])
def test_infer_keeps_no_belief_of_other_words(tmp_path, words, part):
    out = tmp_path / "out.jsonl"
    command = ("infer", rows_file(tmp_path, {**ROW, "id": 2}, ROW), "--out", out)
    assert run(*command).exit_code == 0
    made = out.read_bytes()
    assert run(*command).exit_code == 0
    assert out.read_bytes() == made
    edited = json.loads(json.dumps({**ROW, "id": 2}))
    (edited if part == "task" else edited["turns"][1])[part] += " So it is."
    rows_file(tmp_path, edited, ROW)
    assert "is for other dialogues. Name another file" in fails(2, *command)
    assert out.read_bytes() == made


def test_infer_reads_a_last_dialogue_anew_that_has_gone_on(tmp_path, words):
    out = tmp_path / "out.jsonl"
    for turns in (ROW["turns"][:1], ROW["turns"]):
        file = rows_file(tmp_path, {**ROW, "turns": turns})
        assert run("infer", file, "--out", out).exit_code == 0
        assert len(out.read_text().splitlines()) == len(turns)


def test_infer_does_not_mix_settings(tmp_path):
    out, file = tmp_path / "out.jsonl", rows_file(tmp_path, ROW)
    plain = ("infer", file, "--out", out, "--adapter", "none")
    assert run(*plain).exit_code == 0
    said = fails(2, *plain, "--layout", "goal-first")
    assert "written with layout 'goal-last' and not 'goal-first'; another" in said
    assert "another calibration" in said
    assert "{" not in said
    said = fails(2, *plain[:-2])
    assert "written with adapter None and not 'general'; weights" in said


def test_infer_believes_as_it_is_told(tmp_path, words):
    file = rows_file(tmp_path, ROW)
    keep_calibration(tmp_path / "mine.json", replace(DEFAULT, temperature=7.0), {})
    names = {"paper": PAPER, "default": DEFAULT, str(tmp_path / "mine.json"): None}
    lines = []
    for name, known in names.items():
        out = tmp_path / f"{len(lines)}.jsonl"
        assert run("infer", file, "--out", out, "--calibration", name).exit_code == 0
        lines.append([json.loads(line) for line in out.read_text().splitlines()])
        settings = calibration_from_json(lines[-1][1]["settings"]["calibration"])
        assert settings == (known or replace(DEFAULT, temperature=7.0))
    paper, _, mine = ([line["log_posterior"] for line in each] for each in lines)
    rows = [line["log_likelihood"] for line in lines[0]]
    odds = [row[0] - row[1] for row in rows]
    assert paper[1][0] - paper[1][1] == pytest.approx(sum(odds))
    assert mine[0][0] - mine[0][1] == pytest.approx(odds[0] / 7)
    said = fails(2, "infer", file, "--out", tmp_path / "0.jsonl", "--calibration", "default")
    assert "written with another calibration. Name another file" in said
    assert "no.json" in fails(2, "infer", file, "--out", tmp_path / "x", "--calibration", "no.json")
    assert not (tmp_path / "x").exists()


def test_doctor_calls_the_model_as_people_do_and_tells_its_calibration(words, monkeypatch):
    inner = "Smollm2 135M 8k Lc100K Mix1 Ep2"
    monkeypatch.setattr(NamedModel, "name", inner)
    monkeypatch.setattr("goalscope.models.check.check", lambda engine: ({"model": engine.name}, []))
    shown, told = run("doctor").stdout, json.loads(run("doctor", "--json").stdout)
    assert "SmolLM2-135M-Instruct" in shown
    assert inner not in shown
    assert told["model"] == "SmolLM2-135M-Instruct"
    assert "prior_unspecified 0.5; " in told["calibration"]


def test_doctor_reports_lost_adapters(words, monkeypatch, tmp_path):
    monkeypatch.setattr("goalscope.models.check.check", lambda engine: ({}, []))
    lost = {name: tmp_path / name for name in ("general", "reader", "writer")}
    monkeypatch.setattr("goalscope.models.adapters.SHIPPED", lost)
    result = run("doctor", "--json")
    assert result.exit_code == 1
    problems = json.loads(result.stdout)["problems"]
    assert [each.partition(" ")[0] for each in problems] == [*map(str, lost.values())]


def test_doctor_reports_and_fails_on_a_missing_model(tmp_path):
    result = run("doctor", "--json", "--model", tmp_path / "no.gguf")
    assert result.exit_code == 1
    report = json.loads(result.stdout)
    assert any("no.gguf" in problem for problem in report["problems"])
    assert report["store"].endswith(".db")
