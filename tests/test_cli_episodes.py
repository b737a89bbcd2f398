"""Episodes on the command line: chat, run and replay; what is kept, and how one goes on."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from commands import PROFILES, ROW, fails, only_episode, rows_file, run
from databases import begin
from goalscope.agent.agent import Agent
from goalscope.agent.settings import settings_of
from goalscope.belief.calibration import DEFAULT, PAPER, keep_calibration
from goalscope.storage.store import Store, new_episode
from test_store import a_round

TALKER = """
[[profile]]
name = "talker"
description = "You want to bake a chocolate cake."
replies = ["I need cocoa powder to bake a cake.", "It is for Sunday.", "And milk."]
checks = [{must_have = ["cocoa"]}]
"""


def test_a_runs_calibration_and_trigger_are_kept_from_any_folder(
    shop, words, tmp_path, monkeypatch
):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    mine = replace(DEFAULT, temperature=7.0)
    keep_calibration(Path("mine.json"), mine, {})
    said = {"input": "I need cocoa powder for a cake.\n"}
    for name, kept, used, propose in [
        ("mine.json", str(tmp_path / "here" / "mine.json"), mine, 0.7),
        ("paper", "paper", PAPER, "paper"),
    ]:
        file = tmp_path / f"{name}.db"
        options = ["--store", file, "--calibration", name, "--propose", propose]
        assert run("chat", *shop[:2], *options, **said).exit_code == 0
        info = only_episode(file)
        assert (info.settings["calibration"], info.settings["propose"]) == (kept, propose)
        with monkeypatch.context() as elsewhere:
            elsewhere.chdir(tmp_path)
            assert run("chat", "--resume", info.id, *options[:2], **said).exit_code == 0
        with Store.open(file) as store:
            beliefs = [round.belief for round in store.rounds(info.id)]
        assert [belief.calibration for belief in beliefs] == [used] * 2


def test_replay_and_episodes_need_no_model(store_file, monkeypatch):
    monkeypatch.setattr("goalscope.models.opening.open_model", None)
    with Store.open(store_file) as store:
        inner = "Smollm2 135M 8k Lc100K Mix1 Ep2"
        id = begin(store, domain="grocery", method="good", model=inner, task="Sell.")
        store.append(id, a_round(1))
    shown = run("replay", id[:6])
    assert shown.exit_code == 0
    assert "make tea" in shown.stdout
    assert "Milk" in shown.stdout
    listed = run("episodes", "--json")
    (info,) = json.loads(listed.stdout)
    assert (info["id"], info["model"]) == (id, "SmolLM2-135M-Instruct")
    assert id in run("episodes").stdout


def test_run_prints_the_outcomes_as_json_and_replays(shop, store_file):
    result = run("run", "grocery", "--profile", "all", "--json", *shop)
    assert result.exit_code == 0, result.output
    (outcome,) = json.loads(result.stdout)
    assert set(outcome) == {
        *("profile", "method", "model", "seed", "score", "rounds", "terminated", "episode"),
        *("needs", "needs_met", "violated", "unwanted"),
    }
    assert (outcome["profile"], outcome["method"]) == ("baker", "good")
    assert outcome["terminated"] is True
    assert outcome["rounds"] == 4
    assert 0 <= outcome["score"] <= 1
    assert "complete" in fails(2, "chat", "--resume", outcome["episode"])
    shown = run("replay", outcome["episode"]).stdout
    assert "cocoa" in shown
    told = json.loads(run("replay", outcome["episode"], "--json").stdout)
    assert (told["id"], len(told["rounds"])) == (outcome["episode"], 4)
    assert sum(told["rounds"][0]["belief"]["probability"]) == pytest.approx(1)
    assert told["rounds"][0]["turn"]["utterance"] in shown


def test_of_many_people_it_is_said_who_is_done_and_the_json_stays_one_value(shop, words):
    people = Path(shop[3])
    people.write_text(PROFILES + PROFILES.replace('"baker"', '"other"'))
    result = run("run", "--profile", "all", "--rounds", 1, "--json", *shop)
    assert [row["profile"] for row in json.loads(result.stdout)] == ["baker", "other"]
    assert result.stderr.splitlines() == ["1 of 2: baker", "2 of 2: other"]


def test_who_is_to_be_simulated_is_asked_for_by_name(shop):
    assert fails(2, "run", *shop) == (
        "Error: Choose whom to simulate: --profile all, or one of baker."
    )
    assert "an existing Python file" in fails(2, "run", "nofile.py")


def test_a_profile_may_have_any_name(shop, words, tmp_path):
    name = "a [/b] \x1b[31m"
    text = PROFILES.replace('"baker"', json.dumps(name))
    (tmp_path / "people.toml").write_text(text)
    result = run("run", "--profile", name, *shop, "--rounds", "1")
    assert result.exit_code == 0
    checks = result.stdout[result.stdout.index("Needs") : result.stdout.index("Episode")]
    assert "cocoa" in checks
    assert "\x1b" not in fails(2, "run", "--profile", "nobody", *shop)


@pytest.mark.parametrize("lines", ["", "quit\n", "/help\n/goals\nquit\n"])
def test_a_chat_in_which_nothing_was_said_is_not_kept(shop, store_file, words, lines):
    result = run("chat", *shop[:2], input=lines)
    assert result.exit_code == 0, result.output
    assert "no episode was saved" in result.stderr
    with Store.open(store_file) as store:
        assert store.episodes() == []


def test_a_correction_before_the_first_round_is_kept(shop, store_file, words):
    result = run("chat", *shop[:2], input="/pin bake a cake\nquit\n")
    with Store.open(store_file) as store:
        (info,) = store.episodes()
        assert (info.rounds, len(store.corrections(info.id, 0))) == (0, 1)
    assert f"episode {info.id}" in result.stdout
    assert f"--resume {info.id}" in result.stderr
    assert "(you confirmed it" in run("chat", "--resume", info.id, input="Milk.\n").stdout


def test_an_episode_and_its_first_round_are_stored_together_or_not_at_all(store_file):
    with Store.open(store_file) as store:
        new = new_episode(domain="grocery", method="good", model="m", task="Shop.")
        with pytest.raises(ValueError, match="score"):
            store.append(new["id"], a_round(1), new=new, end=("truncated", 2.0))
        assert store.episodes() == []
        store.append(new["id"], a_round(1), new=new, end=("truncated", 1.0))
        (info,) = store.episodes()
        assert (info.id, info.rounds, info.score) == (new["id"], 1, 1.0)


def test_a_chat_that_ends_early_is_kept_and_goes_on(shop, store_file):
    plain = ["--method", "no-goals", *shop[:2]]
    first = run("chat", *plain, input="I need cocoa powder for a cake.\n")
    assert first.exit_code == 0, first.output
    info = only_episode(store_file)
    assert info.rounds == 1
    assert f"--resume {info.id}" in first.stderr
    second = run("chat", "--resume", info.id, "--rounds", "2", input="\nAnd milk.\n")
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
    first = run("chat", *shop[:2], "--seed", "3", input="I need cocoa powder for a cake.\n")
    assert first.exit_code == 0, first.output
    info = only_episode(store_file)
    resume = ("chat", "--resume", info.id)
    for options in (["--seed", 3], ["--method", "good"], ["--propose", "paper"]):
        assert f"Leave out {options[0]}," in fails(2, *resume, *options)
    assert "Leave out domain, --seed," in fails(2, "chat", "house", *resume[1:], "--seed", 0)
    assert "--picture does not apply to" in fails(2, *resume, "--picture", "x.svg")
    free = ["grocery", "--rounds", 9, "--store", store_file]
    assert run(*resume, *free, input="Milk.\n").exit_code == 0
    with Store.open(store_file) as store:
        assert store.episode(info.id).rounds == 2


@pytest.mark.parametrize("method", ["no-goals", "no-inference"])
@pytest.mark.parametrize(
    "options",
    [
        ["--propose", "0.5"],
        ["--calibration", "default"],
        ["--layout", "goal-last"],
    ],
)
def test_options_of_the_likelihood_are_refused_where_there_is_none(shop, words, method, options):
    said = fails(2, "run", "--profile", "baker", *shop, "--method", method, *options)
    assert options[0] in said
    assert method in said
    good = [*shop, "--method", "good", "--rounds", 1, *options]
    assert run("run", "--profile", "baker", *good).exit_code == 0


def test_what_is_done_by_prompts_is_kept_with_an_episode(shop, store_file, words):
    said = {"input": "I need cocoa powder for a cake.\n"}
    options = ["--prompted", "plan", "--prompted", "query"]
    assert run("chat", *shop[:2], *options, **said).exit_code == 0
    with Store.open(store_file) as store:
        (info,) = store.episodes()
        (round,) = store.rounds(info.id)
    assert settings_of(info.settings).prompted == ("plan", "query")
    assert any(note.startswith("No plan was made.") for note in round.notes)  # by no JSON
    assert run("chat", "--resume", info.id, **said).exit_code == 0
    assert "There is no module 'plans'" in fails(2, "chat", *shop[:2], "--prompted", "plans")


def test_an_adapter_is_kept_with_an_episode(shop, store_file, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = {"input": "I need cocoa powder for a cake.\n"}
    assert run("chat", *shop[:2], "--adapter", "mine", **said).exit_code == 0
    info = only_episode(store_file)
    assert info.settings["adapter"] == str(tmp_path / "mine")
    assert run("chat", "--resume", info.id, **said).exit_code == 0
    people = ["--profile", "baker", "--rounds", "1", *shop]
    assert run("run", *people, "--adapter", "none").exit_code == 0
    rows = [rows_file(tmp_path, ROW), "--out", tmp_path / "out.jsonl"]
    assert run("infer", *rows, "--adapter", "mine").exit_code == 0
    assert run("infer", *rows).exit_code == 0
    assert words == [str(tmp_path / "mine")] * 2 + ["none", str(tmp_path / "mine"), None]


def test_an_interrupted_run_says_how_to_go_on(shop, store_file, words, tmp_path, monkeypatch):
    """`reliability/test_kills.py` interrupts real processes."""
    (tmp_path / "people.toml").write_text(PROFILES + TALKER)
    step, count = Agent.step, iter(range(9))

    def interrupted(*given, **more):
        if next(count) == 1:
            raise KeyboardInterrupt
        return step(*given, **more)

    with monkeypatch.context() as patch:
        patch.setattr(Agent, "step", interrupted)
        stopped = run("run", "--profile", "talker", "--method", "no-goals", *shop)
    assert stopped.exit_code == 130
    with Store.open(store_file) as store:
        (info,) = store.episodes()
        assert (info.ended, info.rounds) == (None, 1)
    assert f"goalscope chat --resume {info.id}" in stopped.stderr
    resumed = run("chat", "--resume", info.id)
    assert resumed.exit_code == 0, resumed.output
    with Store.open(store_file) as store:
        assert store.episode(info.id).ended == "terminated"
