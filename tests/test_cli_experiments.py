"""`goalscope bench`, `experiment` and `data`: tables from tiny files, and errors in one line."""

from __future__ import annotations

import json
import sys

import pytest

from commands import fails, run
from goalscope.base.stats import Interval
from goalscope.base.types import InvalidInputError, ModelError
from goalscope.cli.terminal import show_tables
from goalscope.experiment import measure as measuring
from goalscope.experiment.fitted_baselines import FITTED_METHODS
from goalscope.experiment.results import Results
from goalscope.experiment.summary import Estimate, Table
from test_run import QUESTIONS, SHOP, NamedModel

pytest.importorskip("sklearn")
pytest.importorskip("bm25s")

DIALOGUE = {
    "id": "a",
    "task": "You sell groceries.",
    "turns": [
        {"query": "What can I do?", "utterance": "I need cocoa for the cake."},
        {"query": "And?", "utterance": "Flour."},
    ],
    "goals": ["bake a cake", "wash the car"],
    "true": "bake a cake",
}
PERSON = """
[[profile]]
name = "shopper"
description = "You want milk."
replies = ["Please add whole milk."]
checks = [{must_have = ["milk"]}]
"""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """A folder with tiny files, and a model that needs no loading."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("GOALSCOPE_DATA", raising=False)
    monkeypatch.delenv("GOALSCOPE_RESULTS", raising=False)
    monkeypatch.setattr(measuring, "opened", lambda model, *_: NamedModel())
    monkeypatch.setattr(measuring, "_fingerprints", {})
    (tmp_path / "q.jsonl").write_text("".join(json.dumps(row) + "\n" for row in QUESTIONS))
    rows = (DIALOGUE, {**DIALOGUE, "id": 2, "true": "wash the car"})
    (tmp_path / "d.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    (tmp_path / "shop.csv").write_text(SHOP)
    (tmp_path / "people.toml").write_text(PERSON)
    (tmp_path / "all.toml").write_text("""
        title = "Everything [/b]"
        mcq = {file = "q.jsonl"}
        dialogues = {jsonl = "d.jsonl", turns = 1}
        [episodes]
        domain = "grocery"
        people = "people.toml"
        catalogue = "shop.csv"
        methods = ["no-goals", "good"]
        rounds = 2
        [judge]
        trials = 2
    """)
    return tmp_path


def tables(*args):
    """The tables of a command that must succeed, by name."""
    result = run(*args, "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    return {each["name"]: each for each in found}


def cells(name):
    with Results.open(f"results/{name}.db") as results:
        return results.cells()


def test_questions_are_measured_once_and_printed(here):
    found = tables("bench", "mcq", "q.jsonl", "--limit", "2")["mcq"]
    assert {"model", "accuracy"} <= {*found["rows"][0]}
    prompts = {row["prompt"] for row in found["rows"]}
    assert {"question", "question and choices", "no question"} <= prompts
    assert [cell.attempts for cell in cells("mcq-q")] == [1, 1]
    again = run("bench", "mcq", "q.jsonl")
    assert again.exit_code == 0
    assert again.stderr.splitlines() == [
        "Missing: 1 of 3 cells. Results are saved in results/mcq-q.db as they come, and the "
        "same command continues.",
        "Figures: goalscope report results/mcq-q.db draws them.",
    ]
    assert "Isolated inference" in again.stdout
    assert [cell.attempts for cell in cells("mcq-q")] == [1, 1, 1]


def test_long_work_without_a_terminal_says_how_far_it_is(here, monkeypatch):
    monkeypatch.setattr("goalscope.cli.terminal.LINES", 0.0)
    said = run("bench", "mcq", "q.jsonl", "--json")
    assert json.loads(said.stdout)
    assert said.stderr.splitlines()[1:] == [
        f"Isolated inference: q.jsonl: {n} of 3" for n in (1, 2, 3)
    ]


@pytest.mark.parametrize("width", [50, 80, 200])
def test_no_figure_of_a_table_is_broken_and_no_line_too_long(width, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(width))
    figures = [Estimate(0.111 * (n + 1), Interval(0.05, 0.9), "percent") for n in range(7)]
    columns = ("way", "turn", "n", "top-1", "log-loss in nats", "the Brier score", "size")
    lines = [
        dict(zip(columns, ("goal [/b] last", "last", 9, each, each, 0.5, each), strict=True))
        for each in figures
    ]
    show_tables([Table("t", "A title", lines, ("A note. " * 20,))], False)
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= width
    for each in figures:
        assert text.count(str(each)) == 3
    assert text.count("A title") == 1
    heads = [line for line in text.splitlines() if line.split()[:1] == ["way"]]
    assert len(heads) == {200: 1, 80: 2, 50: 3}[width]


@pytest.mark.parametrize(("turns", "shown"), [("1 2 last", "last"), ("1", "1"), ("1 2", "1 2")])
def test_of_turns_the_last_is_printed(capsys, monkeypatch, turns, shown):
    monkeypatch.setenv("COLUMNS", "80")
    table = Table("t", "A title", [{"way": "x", "turn": t, "n": 1} for t in turns.split()])
    show_tables([table], False)
    text = capsys.readouterr().out
    lines = [line.split() for line in text.splitlines() if line.startswith(" x")]
    assert [turn for _, turn, _ in lines] == shown.split()
    show_tables([table], True)
    assert len(json.loads(capsys.readouterr().out)[0]["rows"]) == len(turns.split())


def test_a_note_stands_once_beneath_the_first_table_that_it_is_of(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    notes = [("of both", "of one"), ("of both",), ("of both", "of three")]
    found = [Table("t", f"Title {n}", [{"a heading": n}], own) for n, own in enumerate(notes)]
    show_tables(found, False)
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    shown = [line for line in lines if line.startswith(("of", "Title"))]
    assert shown == ["Title 0", "of both", "of one", "Title 1", "Title 2", "of three"]


def test_dialogues_of_ones_own_are_measured_beside_the_baselines(here):
    found = tables("bench", "dialogues", "--jsonl", "d.jsonl")
    text = json.dumps(list(found.values()))
    for way in ("TF-IDF", "BM25"):
        assert way in text
    (first, second) = cells("dialogues-d")
    assert (first.spec["case"]["id"], second.spec["case"]["id"]) == ("a", "2")
    assert [len(first.result[way]) for way in ("role-play", "tfidf", "outright")] == [2, 2, 2]
    tables("bench", "dialogues", "--jsonl", "d.jsonl", "--no-outright", "--turns", "1")
    assert "outright" not in cells("dialogues-d")[2].result


def test_methods_are_fitted_on_other_dialogues_and_stand_beside_the_others(here):
    pytest.importorskip("scipy")
    rows = [
        {**DIALOGUE, "id": n, "turns": [{"query": "?", "utterance": f"{words}, please, {n}"}]}
        | {"true": DIALOGUE["goals"][n % 2]}
        for n in range(12)
        for words in [("some flour and cocoa", "a sponge and soap")[n % 2]]
    ]
    (here / "others.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    args = ("bench", "dialogues", "--jsonl", "d.jsonl", "--no-outright", "--fit")
    found, pairs = tables(*args, "others.jsonl[2:]").values()
    assert {*FITTED_METHODS} <= {row["predictor"] for row in found["rows"]}
    assert any(f"fitted on {here}/others.jsonl[2:]," in note for note in found["notes"])
    cell = cells("dialogues-d")[0]
    assert measuring.measure(cell.spec)["fitted"] == cell.result["fitted"]
    (here / "mine").mkdir()
    (here / "mine/all.toml").write_text(
        'dialogues = {jsonl = "d.jsonl", outright = false, fit = "others.jsonl[2:]"}'
    )
    again = tables("experiment", "run", "mine/all.toml")
    assert [table["rows"] for table in again.values()] == [found["rows"], pairs["rows"]]
    refusal = fails(2, *args, "d.jsonl")
    assert "2 dialogues to be judged would also fit the baselines, for example 'a'" in refusal
    changed = {**cell.spec, "fit": {**cell.spec["fit"], "sha256": "other"}}
    with pytest.raises(InvalidInputError, match="have changed since"):
        measuring.measure(changed)


def test_the_adapter_of_a_bench_is_part_of_its_cells(here):
    adapters = ("mine", "none")
    for adapter in adapters:
        tables("bench", "mcq", "q.jsonl", "--limit", "1", "--adapter", adapter)
        tables("bench", "dialogues", "--jsonl", "d.jsonl", "--limit", "1", "--adapter", adapter)
    for name in ("mcq-q", "dialogues-d"):
        models = [cell.spec["model"] for cell in cells(name)]
        assert models == [{"adapter": str(here / "mine")}, {"adapter": "none"}]


def test_an_experiment_runs_every_kind_of_cell_and_then_has_nothing_left_to_do(here):
    found = tables("experiment", "run", "all.toml")
    assert len(found) >= 3
    done = cells("all")
    kinds = [cell.spec["kind"] for cell in done]
    assert kinds == ["mcq"] * 3 + ["dialogue"] * 2 + ["episode"] * 2 + ["judge"] * 2
    assert all(cell.result is not None and cell.attempts == 1 for cell in done)
    again = run("experiment", "run", "all.toml", "--json")
    assert json.loads(again.stdout) == [*found.values()]
    assert again.stderr == "Nothing is missing: results/all.db has all 9 cells.\n"
    assert [cell.attempts for cell in cells("all")] == [1] * 9
    with Results.open("results/all.db") as results:
        ids = {cell.result["episode"] for cell in done if cell.spec["kind"] == "episode"}
        assert {info.id for info in results.episodes()} == ids
        assert results.about["title"] == "Everything [/b]"
        assert results.commands(results.asked_for()) == ["goalscope experiment run all.toml --json"]
    shown = run("replay", ids.pop(), "--store", "results/all.db")
    assert "whole milk" in shown.stdout


def test_another_folder_of_results_is_named_by_option_or_environment(here, monkeypatch):
    tables("bench", "mcq", "q.jsonl", "--results", "mine/deep")
    assert (here / "mine/deep/mcq-q.db").exists()
    monkeypatch.setenv("GOALSCOPE_RESULTS", "theirs")
    tables("bench", "mcq", "q.jsonl")
    assert (here / "theirs/mcq-q.db").exists()
    assert not (here / "results").exists()


def test_what_cannot_be_used_is_said_in_one_line_and_leaves_nothing_behind(here):
    (here / "broken.jsonl").write_text("{}\n")
    (here / "odd.toml").write_text("[mqc]\n")
    for args, cause in [
        (("bench", "mcq", "no.csv"), "no.csv"),
        (("bench", "dialogues"), "either"),
        (("bench", "dialogues", "teach"), "--data"),
        (("bench", "dialogues", "--jsonl", "broken.jsonl"), "line 1"),
        (("experiment", "run", "odd.toml"), "'mcq'"),
        (("data", "list", "--data", "nowhere"), "nowhere"),
    ]:
        assert cause in fails(2, *args)
    assert "File exists: q.jsonl" in fails(1, "bench", "mcq", "q.jsonl", "--results", "q.jsonl")
    assert not (here / "results").exists()


def test_nothing_is_left_behind_where_a_package_or_the_model_is_missing(here, monkeypatch):
    def broken(*_):
        raise ModelError("no such weights")

    monkeypatch.setattr(measuring, "opened", broken)
    assert "no such weights" in fails(1, "bench", "mcq", "q.jsonl")
    monkeypatch.setitem(sys.modules, "bm25s", None)
    assert "goalscope[experiments]" in fails(1, "bench", "mcq", "q.jsonl")
    assert not [*here.rglob("*.db*")]


def test_results_of_another_code_are_refused_until_told_otherwise(here, monkeypatch):
    tables("bench", "mcq", "q.jsonl", "--limit", "1")
    monkeypatch.setattr(NamedModel, "fingerprint", "another")
    monkeypatch.setattr(measuring, "_fingerprints", {})
    refused = run("bench", "mcq", "q.jsonl")
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "another model" in refused.stderr.splitlines()[-1]
    assert "keeps" not in refused.stderr
    tables("bench", "mcq", "q.jsonl", "--anyway")
    assert len(cells("mcq-q")) == 3


def test_cells_that_fail_are_told_after_the_tables(here, monkeypatch):
    rows = [QUESTIONS[0], {**QUESTIONS[1], "rephrasings": {"A": ["word " * 300], "B": ["x"]}}]
    (here / "q.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    result = run("bench", "mcq", "q.jsonl", "--json")
    assert result.exit_code == 1
    assert json.loads(result.stdout)[0]["name"] == "mcq"
    line = result.stderr.splitlines()[-1]
    assert line.startswith("Error: 1 of 2 cells failed")
    assert "fewer words" in line


def test_ctrl_c_says_what_is_kept(here, monkeypatch):
    measure, measured = measuring.KINDS["mcq"], []

    def stopped(model, spec):
        if measured:
            raise KeyboardInterrupt
        measured.append(spec)
        return measure(model, spec)

    monkeypatch.setitem(measuring.KINDS, "mcq", stopped)
    result = run("bench", "mcq", "q.jsonl", "--json")
    assert result.exit_code == 130
    first, last = result.stderr.strip().splitlines()
    assert first.startswith("Missing: 3 of 3 cells. Results are saved in results/mcq-q.db")
    assert last == "results/mcq-q.db has 1 of 3 results. The same command continues."
    reported = run("report", "results/mcq-q.db", "--json")
    assert reported.stderr == "mcq-q: 1 of 3 cells measured.\n"
    assert json.loads(reported.stdout)
    monkeypatch.setitem(measuring.KINDS, "mcq", measure)
    assert [*tables("bench", "mcq", "q.jsonl")] == ["mcq"]  # and no second time, as if retried
    assert [cell.attempts for cell in cells("mcq-q")] == [1, 1, 1]
    assert run("report", "results/mcq-q.db", "--json").stderr == ""
