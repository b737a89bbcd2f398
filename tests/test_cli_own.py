"""`run` and `chat` with other settings of the agent, and with a likelihood of one's own."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from commands import ROW, fails, only_episode, rows_file, run
from test_run import OWN


@pytest.fixture
def mine(tmp_path: Path) -> str:
    (tmp_path / "mine.py").write_text(OWN)
    return f"{tmp_path / 'mine.py'}:Mine"


def test_k_is_stored_with_the_episode_and_resumed(shop, store_file, words):
    given = ("--k", "1", "--rounds", "1")
    ran = run("run", "--profile", "baker", *shop, *given, "--json")
    assert ran.exit_code == 0, ran.output
    info = only_episode(store_file)
    assert info.settings["k"] == 1
    assert "Leave out --k," in fails(2, "chat", "--resume", info.id, "--k", "1")
    again = run("chat", "--resume", info.id, "--rounds", "2")
    assert again.exit_code == 0, again.output
    assert only_episode(store_file).rounds == 2


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (("--likelihood", ""), "not ''"),
        (("--k", "1", "--method", "no-goals"), "--k does not apply to the method 'no-goals'"),
        (("--likelihood", "nothing.py:Mine"), "not 'nothing.py:Mine'"),
        (("--likelihood", "numpy:array"), "not 'numpy:array'"),
        (("--likelihood", "MINE", "--method", "no-inference"), "only applies to the method 'good'"),
        (("--likelihood", "MINE", "--layout", "goal-first"), "only applies to the role-play"),
    ],
)
def test_what_has_no_effect_or_is_none_is_refused(shop, words, mine, given, told):
    given = [mine if each == "MINE" else each for each in given]
    assert told in fails(2, "run", "--profile", "baker", *shop, *given)


def test_a_likelihood_of_ones_own_runs_only_when_it_is_named(
    shop, store_file, words, mine, tmp_path, monkeypatch
):  # fmt: skip
    monkeypatch.setattr("goalscope.envs.registry.OWN.modules", {})
    ran = run("run", "--profile", "baker", *shop, "--likelihood", mine, "--rounds", "1", "--json")
    assert ran.exit_code == 0, ran.output
    info = only_episode(store_file)
    assert info.settings["likelihood"] == mine
    monkeypatch.setattr("goalscope.envs.registry.OWN.modules", {})
    marker = tmp_path / "ran"
    (tmp_path / "mine.py").write_text(f"{OWN}\nopen({json.dumps(str(marker))}, 'w').close()")
    told = fails(2, "chat", "--resume", info.id, "--rounds", "2")
    assert "only runs if you name it on the command line" in told
    assert not marker.exists()
    other = fails(2, "chat", "--resume", info.id, "--likelihood", f"{mine[:-4]}Transposed")
    assert "Leave out --likelihood," in other
    again = run("chat", "--resume", info.id, "--likelihood", mine, "--rounds", "2")
    assert again.exit_code == 0, again.output
    assert marker.exists()


@pytest.mark.parametrize(
    ("made", "told"),
    [
        ("None", "must return a likelihood: it has no method log_likelihood"),
        ("1 / 0", "mine.py, line 3: ZeroDivisionError"),
    ],
)
def test_what_makes_no_likelihood_is_told(shop, words, mine, tmp_path, made, told):
    text = f"\ndef make(model):\n    return {made}\n{OWN}"
    (tmp_path / "mine.py").write_text(text)
    code = 1 if "Error" in told else 2
    made_by = f"{mine[:-4]}make"
    assert told in fails(code, "run", "--profile", "baker", *shop, "--likelihood", made_by)


def test_dialogues_are_inferred_by_a_likelihood_of_ones_own(tmp_path, words, mine):
    rows, out = rows_file(tmp_path, ROW), tmp_path / "out.jsonl"
    infer = ("infer", rows, "--out", out, "--likelihood", mine)
    assert run(*infer).exit_code == 0
    lines = [json.loads(line) for line in out.read_text().splitlines()]
    for turn, line in zip(ROW["turns"], lines, strict=True):
        lengths = [float(len(goal) + len(turn["utterance"])) for goal in line["goals"]]
        assert line["log_likelihood"] == lengths
    assert [*lines[0]["settings"]["likelihood"]] == [mine]
    assert "another" in fails(2, "infer", rows, "--out", out).replace("other", "another")
    assert "only applies to the role-play" in fails(2, *infer, "--layout", "goal-first")
    transposed = fails(
        2, "infer", rows, "--out", tmp_path / "o", "--likelihood", f"{mine[:-4]}Transposed"
    )
    assert "Transposed.log_likelihood must return an array of [2, 3]" in transposed


def test_what_takes_more_than_a_model_is_refused(shop, words, mine, tmp_path):
    (tmp_path / "mine.py").write_text(f"\ndef make(model, heat):\n    return 1\n{OWN}")
    told = fails(2, "run", "--profile", "baker", *shop, "--likelihood", f"{mine[:-4]}make")
    assert "make must take one argument, the model (missing a required argument: 'heat')" in told
