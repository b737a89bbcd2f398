"""The command line: what is said, what is kept, and with which exit code."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import pytest
from typer.testing import CliRunner

from goalscope.belief import Belief
from goalscope.calibration import LAST_TURN, PAPER, USUAL, calibration_from_json
from goalscope.calibrations import keep_calibration
from goalscope.cli.main import app
from goalscope.store import Store
from goalscope.types import UNSPECIFIED, Goal
from lives import CATALOGUE
from test_run import NamedModel
from test_store import a_round

SOURCE = str(Path(__file__).parents[1] / "src")
MAIN = [sys.executable, "-c", "from goalscope.cli.main import main; main()"]

PROFILES = """
[[profile]]
name = "baker"
description = "You want to bake a chocolate cake."
replies = ["I need cocoa powder to bake a cake.", "And milk."]
checks = [{must_have = ["cocoa"]}, {bought = true}]
"""
TALKER = """
[[profile]]
name = "talker"
description = "You want to bake a chocolate cake."
replies = ["I need cocoa powder to bake a cake.", "It is for Sunday.", "And milk."]
checks = [{must_have = ["cocoa"]}]
"""
ROW = {
    "id": "a",
    "task": "You sell groceries.",
    "turns": [
        {"query": "What can I do?", "utterance": "I need flour and cocoa."},
        {"query": "", "utterance": "And candles for the cake."},
    ],
    "goals": ["bake a chocolate cake", "wash the car"],
    "ignored": 1,
}


@pytest.fixture(autouse=True)
def store_file(tmp_path, monkeypatch):
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "episodes.db"))
    return tmp_path / "episodes.db"


@pytest.fixture
def words(monkeypatch):
    """Models that need no loading; the list of the adapters that were asked for."""
    asked = []

    class Closable(NamedModel):
        def close(self):
            pass

    def opened(model=None, *, adapter=None, **_):
        asked.append(adapter)
        return Closable()

    monkeypatch.setattr("goalscope.models.opening.open_model", opened)
    return asked


@pytest.fixture
def shop(tmp_path):
    (tmp_path / "shop.csv").write_text(CATALOGUE)
    (tmp_path / "people.toml").write_text(PROFILES)
    return ["--catalogue", str(tmp_path / "shop.csv"), "--profiles", str(tmp_path / "people.toml")]


def invoke(*args, **options):
    words = [str(arg) for arg in args]
    with patch.object(sys, "argv", ["goalscope", *words]):
        return CliRunner().invoke(app, words, **options)


def fails(code, *args):
    """The one line that a command which must fail says on standard error."""
    result = invoke(*args)
    assert result.exit_code == code, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    (line,) = result.stderr.strip().splitlines()
    return line


def rows_file(tmp_path, *rows):
    file = tmp_path / "rows.jsonl"
    file.write_text("".join((r if isinstance(r, str) else json.dumps(r)) + "\n" for r in rows))
    return file


@pytest.mark.parametrize(
    "command",
    [(), *[(c,) for c in ["chat", "run", "infer", "calibrate", "replay", "episodes", "doctor"]]],
)
def test_help_of_every_command(command):
    result = invoke(*command, "--help")
    assert result.exit_code == 0
    assert "Usage" in result.stdout


def test_the_command_loads_nothing_heavy_before_it_is_needed():
    heavy = {"numpy", "rich", "llama_cpp", "jinja2", "wordllama"}
    code = f"import sys, goalscope.cli.main; print([m for m in sys.modules if m in {heavy}])"
    env = os.environ | {"PYTHONPATH": SOURCE}
    loaded = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, check=True)
    assert loaded.stdout.strip() == b"[]"


def test_listing_episodes_loads_no_numerics_and_no_prompts(tmp_path):
    code = (
        "import sys\n"
        "from goalscope.cli.main import app\n"
        f"app(['episodes', '--store', {str(tmp_path / 'e.db')!r}], standalone_mode=False)\n"
        "print([m for m in sys.modules if m in {'numpy', 'jinja2', 'llama_cpp'}])"
    )
    env = os.environ | {"PYTHONPATH": SOURCE}
    loaded = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, check=True)
    assert loaded.stdout.splitlines()[-1] == b"[]"


def test_what_cannot_be_found_is_said_in_one_line(shop, tmp_path):
    assert "baker" in fails(2, "run", "--profile", "nobody", *shop)
    missing = tmp_path / "no.gguf"
    assert "no.gguf" in fails(1, "run", "--profile", "baker", *shop, "--model", missing)
    assert "no.csv" in fails(2, "chat", "--catalogue", tmp_path / "no.csv")
    assert "NAME=TITLE" in fails(2, "run", "--profile", "baker", *shop, "--column", "name")
    assert "last-turn" in fails(2, "run", "--profile", "baker", *shop, "--calibration", "papr")
    for given in ("often", "1.5"):
        assert '"paper"' in fails(2, "run", "--profile", "baker", *shop, "--propose", given)
    assert "goalscope episodes" in fails(2, "replay", "nothing")
    assert "goalscope episodes" in fails(2, "chat", "--resume", "nothing")


def test_an_unknown_option_is_a_usage_error():
    assert invoke("run", "--profile", "x", "--speed", "9").exit_code == 2


@pytest.mark.parametrize(
    ("broken", "cause"),
    [
        ("{not json", "line 2"),
        ("[]", "JSON object. A line is a dialogue: {"),
        ("hello", "no JSON (Expecting value at character 1). A line is a dialogue: {"),
        ({**ROW, "id": "a"}, "line 1"),
        ({**ROW, "id": True}, '"id"'),
        ({k: v for k, v in ROW.items() if k != "task"}, '"task" is missing'),
        ({**ROW, "id": "b", "turns": []}, '"turns"'),
        ({**ROW, "id": "b", "turns": [{"query": "Hi"}]}, '"utterance" is missing'),
        ({**ROW, "id": "b", "turns": [{"query": "Hi", "utterance": " "}]}, "empty"),
        ({**ROW, "id": "b", "goals": []}, '"goals"'),
        ({**ROW, "id": "b", "goals": ["x", 7]}, "goal 2"),
        ({**ROW, "id": "b", "goals": ["\ud800"]}, "surrogate"),
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
    assert "Did you mean replay?" in invoke("replya").stderr
    bogus = invoke("bogus")
    assert (bogus.exit_code, "Did you mean" in bogus.stderr) == (2, False)
    assert "No such command 'bogus'" in bogus.stderr


def test_a_file_without_dialogues_is_told_before_anything_is_written(tmp_path):
    assert "holds no row" in fails(2, "infer", rows_file(tmp_path, ""), "--out", tmp_path / "o")
    assert not (tmp_path / "o").exists()


def test_infer_writes_a_belief_per_turn_and_continues_after_a_crash(tmp_path):
    out = tmp_path / "out.jsonl"
    file = rows_file(tmp_path, ROW, "", {**ROW, "id": 2, "goals": ["cook soup", "Cook  soup."]})
    said = invoke("infer", file, "--out", out)
    assert (said.exit_code, said.stdout) == (0, "")
    assert said.stderr.splitlines() == [f"{out}: 2 dialogues, 4 turns"]  # and no bar
    whole = out.read_text()
    lines = [json.loads(line) for line in whole.splitlines()]
    assert [(line["id"], line["turn"]) for line in lines] == [("a", 1), ("a", 2), (2, 1), (2, 2)]
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

    for cut in (len(whole) - 9, whole.index('{"id": 2') + 3, whole.index('{"id": "a", "turn": 2')):
        out.write_text(whole[:cut])
        assert invoke("infer", file, "--out", out).exit_code == 0
        again = [json.loads(line) for line in out.read_text().splitlines()]
        assert [(line["id"], line["turn"]) for line in again] == [
            (line["id"], line["turn"]) for line in lines
        ]
        for new, old in zip(again, lines, strict=True):
            assert new["log_likelihood"] == pytest.approx(old["log_likelihood"], abs=0.15)


def test_infer_leaves_foreign_files_alone(tmp_path):
    file = rows_file(tmp_path, ROW)
    assert "no folder nodir. Make it" in fails(2, "infer", file, "--out", "nodir/b.jsonl")
    for foreign in ("my notes", "my notes\n", '{"id": "other", "turn": 1}\n'):
        (tmp_path / "out.jsonl").write_text(foreign)
        assert "Name another file" in fails(2, "infer", file, "--out", tmp_path / "out.jsonl")
        assert (tmp_path / "out.jsonl").read_text() == foreign


@pytest.mark.parametrize("turn", [0, 1])
@pytest.mark.parametrize("part", ["query", "utterance", "task"])
def test_infer_keeps_no_belief_of_other_words(tmp_path, words, turn, part):
    out = tmp_path / "out.jsonl"
    command = ("infer", rows_file(tmp_path, {**ROW, "id": 2}, ROW), "--out", out)
    assert invoke(*command).exit_code == 0
    made = out.read_bytes()
    assert invoke(*command).exit_code == 0
    assert out.read_bytes() == made
    edited = json.loads(json.dumps({**ROW, "id": 2}))
    (edited if part == "task" else edited["turns"][turn])[part] += " So it is."
    rows_file(tmp_path, edited, ROW)
    assert "belongs to other dialogues; name another one" in fails(2, *command)
    assert out.read_bytes() == made


def test_infer_reads_a_last_dialogue_anew_that_has_gone_on(tmp_path, words):
    out = tmp_path / "out.jsonl"
    for turns in (ROW["turns"][:1], ROW["turns"]):
        file = rows_file(tmp_path, {**ROW, "turns": turns})
        assert invoke("infer", file, "--out", out).exit_code == 0
        assert len(out.read_text().splitlines()) == len(turns)


def test_infer_does_not_mix_settings(tmp_path):
    out, file = tmp_path / "out.jsonl", rows_file(tmp_path, ROW)
    plain = ("infer", file, "--out", out, "--adapter", "none")
    assert invoke(*plain).exit_code == 0
    said = fails(2, *plain, "--layout", "goal-first")
    assert "made with layout 'goal-last' and not 'goal-first'; another" in said
    assert "another calibration (" in said
    assert "{" not in said
    said = fails(2, *plain[:-2])
    assert "made with adapter None and not 'general'; weights" in said


def test_infer_believes_as_it_is_told(tmp_path, words):
    file = rows_file(tmp_path, ROW)
    keep_calibration(tmp_path / "mine.json", replace(USUAL, temperature=7.0), {})
    names = {"paper": PAPER, "last-turn": LAST_TURN, str(tmp_path / "mine.json"): None}
    lines = []
    for name, known in names.items():
        out = tmp_path / f"{len(lines)}.jsonl"
        assert invoke("infer", file, "--out", out, "--calibration", name).exit_code == 0
        lines.append([json.loads(line) for line in out.read_text().splitlines()])
        settings = calibration_from_json(lines[-1][1]["settings"]["calibration"])
        assert settings == (known or replace(USUAL, temperature=7.0))
    paper, last, mine = ([line["log_posterior"] for line in each] for each in lines)
    rows = [line["log_likelihood"] for line in lines[0]]
    odds = [row[0] - row[1] for row in rows]
    assert paper[1][0] - paper[1][1] == pytest.approx(sum(odds))
    assert last[1][0] - last[1][1] == pytest.approx(odds[1])
    assert mine[0][0] - mine[0][1] == pytest.approx(odds[0] / 7)
    said = fails(2, "infer", file, "--out", tmp_path / "0.jsonl", "--calibration", "usual")
    assert "made with another calibration (temperature 1.0 and not 2.0, reference 0.0" in said
    assert "no.json" in fails(2, "infer", file, "--out", tmp_path / "x", "--calibration", "no.json")
    assert not (tmp_path / "x").exists()


def test_a_runs_calibration_and_trigger_are_kept_from_any_folder(
    shop, words, tmp_path, monkeypatch
):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    mine = replace(USUAL, temperature=7.0)
    keep_calibration(Path("mine.json"), mine, {})
    said = {"input": "I need cocoa powder for a cake.\n"}
    for name, kept, used, propose in [
        ("mine.json", str(tmp_path / "here" / "mine.json"), mine, 0.7),
        ("paper", "paper", PAPER, "paper"),
    ]:
        file = tmp_path / f"{name}.db"
        options = ["--store", file, "--calibration", name, "--propose", propose]
        assert invoke("chat", *shop[:2], *options, **said).exit_code == 0
        with Store.open(file) as store:
            (info,) = store.episodes()
        assert (info.settings["calibration"], info.settings["propose"]) == (kept, propose)
        with monkeypatch.context() as elsewhere:
            elsewhere.chdir(tmp_path)
            assert invoke("chat", "--resume", info.id, *options[:2], **said).exit_code == 0
        with Store.open(file) as store:
            beliefs = [round.belief for round in store.rounds(info.id)]
        assert [belief.calibration for belief in beliefs] == [used] * 2


def test_replay_and_episodes_need_no_model(store_file, monkeypatch):
    monkeypatch.setattr("goalscope.models.opening.open_model", None)
    with Store.open(store_file) as store:
        inner = "Smollm2 135M 8k Lc100K Mix1 Ep2"
        id = store.begin(domain="grocery", method="good", model=inner, task="Sell.")
        store.append(id, a_round(1))
    shown = invoke("replay", id[:6])
    assert shown.exit_code == 0
    assert "make tea" in shown.stdout
    assert "Milk" in shown.stdout
    listed = invoke("episodes", "--json")
    (info,) = json.loads(listed.stdout)
    assert (info["id"], info["model"]) == (id, "SmolLM2-135M-Instruct")
    assert id in invoke("episodes").stdout


def test_run_prints_the_outcomes_as_json_and_replays(shop, store_file):
    result = invoke("run", "grocery", "--profile", "all", "--json", *shop)
    assert result.exit_code == 0, result.output
    (outcome,) = json.loads(result.stdout)
    assert set(outcome) == {
        *("profile", "method", "model", "seed", "score", "rounds", "terminated", "episode"),
        "unwanted",
    }
    assert (outcome["profile"], outcome["method"]) == ("baker", "good")
    assert outcome["terminated"] is True
    assert outcome["rounds"] == 4
    assert 0 <= outcome["score"] <= 1
    assert "complete" in fails(2, "chat", "--resume", outcome["episode"])
    shown = invoke("replay", outcome["episode"]).stdout
    assert "cocoa" in shown
    told = json.loads(invoke("replay", outcome["episode"], "--json").stdout)
    assert (told["id"], len(told["rounds"])) == (outcome["episode"], 4)
    assert sum(told["rounds"][0]["belief"]["probability"]) == pytest.approx(1)
    assert told["rounds"][0]["turn"]["utterance"] in shown
    end_again(store_file, outcome)
    Path(shop[3]).write_text("")
    assert "checks were met cannot be shown" in invoke("replay", outcome["episode"]).stdout


def end_again(store_file, outcome):
    """Resume an episode whose process ended between its last round and the note of its end."""
    with closing(sqlite3.connect(store_file)) as file, file:
        file.execute("UPDATE episodes SET ended = NULL, score = NULL")
    assert invoke("chat", "--resume", outcome["episode"]).exit_code == 0
    with Store.open(store_file) as store:
        info = store.episode(outcome["episode"])
    assert (info.ended, info.rounds) == ("terminated", outcome["rounds"])
    assert info.score == outcome["score"]


def test_of_many_people_it_is_said_who_is_done_and_the_json_stays_one_value(shop, words):
    people = Path(shop[3])
    people.write_text(PROFILES + PROFILES.replace('"baker"', '"other"'))
    result = invoke("run", "--profile", "all", "--rounds", 1, "--json", *shop)
    assert [row["profile"] for row in json.loads(result.stdout)] == ["baker", "other"]
    assert result.stderr.splitlines() == ["1 of 2: baker", "2 of 2: other"]


def test_who_is_to_be_simulated_is_asked_for_by_name(shop):
    assert fails(2, "run", *shop) == (
        "Error: Say who is to be simulated: --profile all, or one of baker."
    )
    assert "Is there such a file" in fails(2, "run", "nofile.py")


def test_a_profile_may_have_any_name(shop, store_file, words, tmp_path):
    name = "a [/b] \x1b[31m"
    text = PROFILES.replace('"baker"', json.dumps(name))
    (tmp_path / "people.toml").write_text(text)
    result = invoke("run", "--profile", name, *shop, "--rounds", "1")
    assert result.exit_code == 0
    checks = result.stdout[result.stdout.index("Checks") : result.stdout.index("Episode")]
    assert "cocoa" in checks
    with Store.open(store_file) as store:
        (info,) = store.episodes()
    assert checks in invoke("replay", info.id).stdout
    assert "\x1b" not in fails(2, "run", "--profile", "nobody", *shop)


def test_a_chat_that_ends_early_is_kept_and_goes_on(shop, store_file):
    plain = ["--method", "no-goals", *shop[:2]]
    first = invoke("chat", *plain, input="I need cocoa powder for a cake.\n")
    assert first.exit_code == 0, first.output
    with Store.open(store_file) as store:
        (info,) = store.episodes()
    assert info.rounds == 1
    assert f"--resume {info.id}" in first.stderr
    second = invoke("chat", "--resume", info.id, "--rounds", "2", input="\nAnd milk.\n")
    assert second.exit_code == 0, second.output
    assert "empty" in second.stdout  # the blank line was asked again
    with Store.open(store_file) as store:
        assert store.episode(info.id).ended == "truncated"
        assert [round.turn.utterance for round in store.rounds(info.id)] == [
            "I need cocoa powder for a cake.",
            "And milk.",
        ]
    assert "--rounds 4" in fails(2, "chat", "--resume", info.id, "--rounds", "2")


def test_a_resumed_episode_takes_no_options_that_it_would_not_heed(shop, store_file, words):
    first = invoke("chat", *shop[:2], "--seed", "3", input="I need cocoa powder for a cake.\n")
    assert first.exit_code == 0, first.output
    with Store.open(store_file) as store:
        (info,) = store.episodes()
    resume = ("chat", "--resume", info.id)
    for options in (["--seed", 3], ["--method", "good"], ["--end-of-turn"], ["--propose", "paper"]):
        assert f"leave out {options[0]}," in fails(2, *resume, *options)
    assert "leave out domain, --seed," in fails(2, "chat", "house", *resume[1:], "--seed", 0)
    assert "--picture is not for" in fails(2, *resume, "--picture", "x.svg")
    free = ["grocery", "--rounds", 9, "--store", store_file]
    assert invoke(*resume, *free, input="Milk.\n").exit_code == 0
    with Store.open(store_file) as store:
        assert store.episode(info.id).rounds == 2


@pytest.mark.parametrize("method", ["no-goals", "no-inference"])
@pytest.mark.parametrize(
    "options",
    [
        ["--propose", "0.5"],
        ["--calibration", "usual"],
        ["--layout", "goal-last"],
        ["--end-of-turn"],
    ],
)
def test_options_of_the_likelihood_are_refused_where_there_is_none(shop, words, method, options):
    said = fails(2, "run", "--profile", "baker", *shop, "--method", method, *options)
    assert options[0] in said
    assert method in said
    good = [*shop, "--method", "good", "--rounds", 1, *options]
    assert invoke("run", "--profile", "baker", *good).exit_code == 0


def test_an_adapter_is_kept_with_an_episode(shop, store_file, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = {"input": "I need cocoa powder for a cake.\n"}
    assert invoke("chat", *shop[:2], "--adapter", "mine", **said).exit_code == 0
    with Store.open(store_file) as store:
        (info,) = store.episodes()
    assert info.settings["adapter"] == str(tmp_path / "mine")
    assert invoke("chat", "--resume", info.id, **said).exit_code == 0
    people = ["--profile", "baker", "--rounds", "1", *shop]
    assert invoke("run", *people, "--adapter", "none").exit_code == 0
    rows = [rows_file(tmp_path, ROW), "--out", tmp_path / "out.jsonl"]
    assert invoke("infer", *rows, "--adapter", "mine").exit_code == 0
    assert invoke("infer", *rows).exit_code == 0
    assert words == [str(tmp_path / "mine")] * 2 + ["none", str(tmp_path / "mine"), None]


@pytest.mark.skipif(os.name == "nt", reason="the system has no POSIX signals")
def test_an_interrupted_run_says_how_to_go_on(shop, store_file, tmp_path):
    (tmp_path / "people.toml").write_text(PROFILES + TALKER)
    env = os.environ | {"PYTHONPATH": SOURCE}
    with subprocess.Popen(
        [*MAIN, "run", "--profile", "talker", "--method", "no-goals", *shop],
        env=env,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        # A test run in the background may have SIGINT ignored, and a child inherits that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        seen = 0
        deadline = time.monotonic() + 300
        while seen == 0 and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.02)
            if store_file.exists():
                with Store.open(store_file) as store:
                    seen = sum(info.rounds for info in store.episodes())
        process.send_signal(signal.SIGINT)
        _, said = process.communicate()
    with Store.open(store_file) as store:
        (info,) = store.episodes()
        assert seen >= 1
        assert info.ended is None, "the run was over before the signal"
        assert len(store.rounds(info.id)) == info.rounds >= seen
    assert process.returncode == 130
    assert f"goalscope chat --resume {info.id}" in said
    assert "Traceback" not in said
    resumed = invoke("chat", "--resume", info.id)
    assert resumed.exit_code == 0, resumed.output
    with Store.open(store_file) as store:
        assert store.episode(info.id).ended == "terminated"


def test_doctor_calls_the_model_as_people_do_and_tells_its_calibration(words, monkeypatch):
    inner = "Smollm2 135M 8k Lc100K Mix1 Ep2"
    monkeypatch.setattr(NamedModel, "name", inner)
    monkeypatch.setattr("goalscope.models.check.check", lambda engine: ({"model": engine.name}, []))
    shown, told = invoke("doctor").stdout, json.loads(invoke("doctor", "--json").stdout)
    assert "SmolLM2-135M-Instruct" in shown
    assert inner not in shown
    assert told["model"] == "SmolLM2-135M-Instruct"
    assert "unstated 0.5; " in told["calibration"]


def test_doctor_reports_and_fails_on_a_missing_model(tmp_path):
    result = invoke("doctor", "--json", "--model", tmp_path / "no.gguf")
    assert result.exit_code == 1
    report = json.loads(result.stdout)
    assert any("no.gguf" in problem for problem in report["problems"])
    assert report["store"].endswith("episodes.db")
