"""An experiment does what is missing, and whatever stops it, nothing is lost or done twice."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import pytest

from fakes import NamedModel
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.experiment import measure as measuring
from goalscope.experiment import run as runs
from goalscope.experiment.measure import measure, perform
from goalscope.experiment.plan import (
    DialoguesPart,
    EpisodesPart,
    Experiment,
    Judge,
    QuestionsPart,
    specs_of,
)
from goalscope.experiment.results import Results, cell_key
from goalscope.experiment.tables import tables_of
from goalscope.storage.tables import CELLS

CHOICES = {"A": "a cake with much cocoa", "B": "a clean car"}
REPHRASINGS = {"A": ["bake something with chocolate"], "B": ["wash the car"]}
QUESTIONS = [
    {"id": n, "prompt": prompt, "choices": CHOICES, "answer": "AB"[n % 2],
     "rephrasings": REPHRASINGS}
    for n, prompt in enumerate(("What would you like?", "What is missing?", "And now?"))
]  # fmt: skip
SHOP = "name,category,unit,price\nWhole Milk,dairy,1 L,1.20\nGreen Tea,drinks,20 bags,3.00\n"
PEOPLE = """
[[profile]]
name = "shopper"
description = "You want milk."
replies = ["Please add whole milk."]
checks = [{must_have = ["milk"]}, {must_not_have = ["tea"]}]
welcome = ["sugar"]

[[profile]]
name = "silent"
description = "You want tea."
replies = ["Buy the basket"]
checks = [{must_have = ["tea"]}]
"""


@pytest.fixture
def results(tmp_path):
    with Results.open(tmp_path / "r.db") as opened:
        yield opened


@pytest.fixture
def fake(monkeypatch):
    """Cells of the kind "fake" are measured here; those whose number is in `broken` fail."""
    state = {"broken": set(), "begun": [], "error": GoalscopeError("out of luck")}

    def fake_cell(model, spec):
        state["begun"].append(spec["n"])
        if spec["n"] in state["broken"]:
            raise state["error"]
        return {"value": spec["n"] / 3}

    monkeypatch.setitem(measuring.KINDS, "fake", fake_cell)
    monkeypatch.setattr(measuring, "_fingerprints", {})
    monkeypatch.setattr(measuring, "opened", lambda model: NamedModel())
    return state


def fakes(count):
    return [{"kind": "fake", "n": n, "model": {}} for n in range(count)]


def run(specs, results, experiment=None, **options):
    """All steps, as (number of the cell, error, done, total)."""
    return [
        (step.cell and step.cell.spec.get("n"), step.error, step.done, step.total)
        for step in runs.run(experiment or Experiment("x"), specs, results, **options)
    ]


def shop(tmp_path, *people, **settings):
    (tmp_path / "shop.csv").write_text(SHOP)
    (tmp_path / "people.toml").write_text(PEOPLE)
    files = {"people": str(tmp_path / "people.toml"), "catalogue": str(tmp_path / "shop.csv")}
    part = EpisodesPart("grocery", people, **{"methods": ("no-goals",), **files, **settings})
    return Experiment("x", episodes=(part,))


def test_only_what_is_missing_is_measured(results, fake):
    assert run(fakes(2), results) == [(None, None, 0, 2), (0, None, 1, 2), (1, None, 2, 2)]
    more = [*fakes(3), *fakes(3)]  # the same cell twice is one
    assert run(more, results) == [(None, None, 2, 3), (2, None, 3, 3)]
    assert run(more, results) == [(None, None, 3, 3)]
    assert fake["begun"] == [0, 1, 2]
    assert [cell.attempts for cell in results.cells()] == [1, 1, 1]


@pytest.mark.parametrize("error", [GoalscopeError("out of luck"), ZeroDivisionError("by nought")])
def test_a_cell_that_fails_is_noted_and_tried_again_the_next_time(results, fake, error):
    fake.update(broken={1}, error=error)
    steps = run(fakes(3), results)
    assert [(n, done) for n, _, done, _ in steps] == [(None, 0), (0, 1), (1, 1), (2, 2)]
    said = str(error) if isinstance(error, GoalscopeError) else "ZeroDivisionError: by nought"
    assert steps[2][1] == said
    assert [cell.error for cell in results.cells()] == [None, said, None]
    fake["broken"].clear()
    assert run(fakes(3), results)[1:] == [(1, None, 3, 3)]
    again = results.cells()[1]
    assert (again.attempts, again.error, again.result) == (2, None, {"value": 1 / 3})


def test_five_failures_in_a_row_stop_and_four_do_not(results, fake):
    fake["broken"] = {0, 1, 2, 3, 5, 6, 7, 8, 9}
    with pytest.raises(GoalscopeError, match=r"5 cells failed.*out of luck.*same command"):
        run(fakes(12), results)
    assert fake["begun"] == list(range(10))
    assert [cell.spec["n"] for cell in results.cells() if cell.result] == [4]
    fake["begun"].clear()
    run(fakes(12), results)  # what has failed before comes last, and stops nothing
    assert fake["begun"] == [10, 11, 0, 1, 2, 3, 5, 6, 7, 8, 9]
    assert [cell.spec["n"] for cell in results.cells() if cell.result] == [4, 10, 11]


def test_a_result_that_cannot_be_stored_is_an_error_of_its_cell(results, monkeypatch, fake):
    monkeypatch.setitem(measuring.KINDS, "odd", lambda model, spec: {"value": float("nan")})
    steps = run([{"kind": "odd", "n": 0, "model": {}}, *fakes(2)], results)
    assert "cannot be stored" in steps[1][1]
    assert [cell.result is None for cell in results.cells()] == [True, False, False]


def test_people_who_are_edited_after_the_plan_are_not_measured(results, tmp_path, fake):
    specs = specs_of(shop(tmp_path, "silent"), None)
    (tmp_path / "people.toml").write_text(PEOPLE.replace("You want tea.", "You want milk."))
    ((_, _, _, _), (_, error, done, _)) = run(specs, results)
    assert "have changed since the experiment was planned" in error
    assert done == 0
    assert specs_of(shop(tmp_path, "silent"), None) == specs  # as they were before


def test_a_person_who_is_edited_is_measured_again_and_nobody_else_is(tmp_path):
    before = specs_of(shop(tmp_path, "silent", "shopper"), None)
    plan = shop(tmp_path, "silent", "shopper")
    (tmp_path / "people.toml").write_text(PEOPLE.replace("You want tea.", "You want milk."))
    after = specs_of(plan, None)
    same = [cell_key(a) == cell_key(b) for a, b in zip(before, after, strict=True)]
    assert [(spec["profile"], each) for spec, each in zip(after, same, strict=True)] == [
        ("silent", False),
        ("shopper", True),
    ]


def test_a_worker_refuses_a_cell_that_it_would_measure_with_something_else(fake):
    (spec,) = fakes(1)
    own = measuring.identity_of({})
    assert perform({"spec": spec, "identity": own}) == {"value": 0}
    with pytest.raises(GoalscopeError, match="another prompts"):
        perform({"spec": spec, "identity": {**own, "prompts": "old"}})


def test_the_evaluators_cells_come_after_the_episodes(results, fake, tmp_path, monkeypatch):
    order = []
    episode = dict.fromkeys(("task", "description", "outcome"), "x") | {"actions": []}

    def fake_episode(model, spec):
        order.append(("episode", spec["profile"]))
        if spec["profile"] == "silent":
            raise GoalscopeError("out of luck")
        return {**episode, "empty": False, "score": 1.0}

    def fake_judge(model, spec):
        order.append(("judge", spec["of"]["profile"]))
        return {"trials": []}

    monkeypatch.setitem(measuring.KINDS, "episode", fake_episode)
    monkeypatch.setitem(measuring.KINDS, "judge", fake_judge)
    plan = shop(tmp_path, "silent", "shopper")
    judged = Experiment("x", episodes=plan.episodes, judge=Judge(trials=2))
    specs = specs_of(judged, None)
    steps = run([*specs, specs[1]], results, judged)  # one is asked for twice
    assert order == [("episode", "silent"), ("episode", "shopper"), ("judge", "shopper")]
    assert [(done, total) for *_, done, total in steps] == [(0, 4), (0, 4), (1, 4), (2, 3)]


def test_an_episode_becomes_one_of_the_store(results, tmp_path, model, monkeypatch):
    monkeypatch.setattr(measuring, "opened", lambda spec: model)
    (spec,) = specs_of(shop(tmp_path, "shopper"), None)
    (cell,) = results.plan([spec])
    outcome = measure(spec)
    results.keep(cell.key, outcome, {})
    (info,) = results.episodes()
    kept = results.cells()[0].result
    assert kept == {**outcome, "episode": info.id}
    rounds = results.rounds(info.id)
    assert len(rounds) == kept["rounds"] == 3
    assert rounds[0].turn.utterance == "Please add whole milk."
    assert (info.profile, info.method, info.ended) == ("shopper", "no-goals", "terminated")
    assert (kept["start"], kept["met"], kept["unwanted"]) == ([False, True], [True, True], [])
    assert info.score == 1
    floor = {"score": 0, "needs met": 0, "violated": 0, "unwanted": 0}
    milk = {**floor, "score": 1, "needs met": 1}
    tea = {**floor, "violated": 1, "unwanted": 1}
    either = {key: (milk[key] + tea[key]) / 2 for key in floor}
    both = {"score": 1 / 3, "needs met": 1, "violated": 1, "unwanted": 1}
    trivial = {"nothing": floor, "random item": either, "everything": both}
    assert kept["trivial"] == trivial  # the shop has no bananas
    assert "Whole Milk" in kept["outcome"]
    assert any("Whole Milk" in act for act in kept["actions"])
    assert (kept["terminated"], kept["empty"]) == (True, False)


def test_a_basket_with_nothing_in_it_cannot_be_bought(fake, tmp_path):
    (spec,) = specs_of(shop(tmp_path, "silent"), None)
    found = measure(spec)
    assert (found["terminated"], found["empty"], found["actions"]) == (False, True, [])


GARDEN = Path(__file__).parents[1] / "examples" / "garden.py"


def garden_in(folder):
    for suffix in (".py", ".toml"):
        (folder / "garden").with_suffix(suffix).write_text(GARDEN.with_suffix(suffix).read_text())
    part = EpisodesPart(str(folder / "garden.py"), ("kitchen",), methods=("no-goals",), rounds=3)
    return Experiment("x", episodes=(part,), judge=Judge(trials=2))


def test_a_domain_of_ones_own_is_measured_judged_and_told_apart_by_its_file(
    fake, results, tmp_path
):
    plan = garden_in(tmp_path)
    run(specs_of(plan, None), results, plan)
    cells = results.cells()
    assert [(cell.spec["kind"], cell.error) for cell in cells] == [
        ("episode", None), ("judge", None),
    ]  # fmt: skip
    found, judged = cells[0].result, cells[1].spec
    assert found["possible"] == ["add", "remove", "swap", "finish"]
    assert {key: judged[key] for key in ("outcome", "actions", "possible")} == {
        key: found[key] for key in ("outcome", "actions", "possible")
    }
    titles = [table.title for table in tables_of(cells)]
    assert any(title.startswith("Episodes, methods: garden, scripted human") for title in titles)
    (tmp_path / "garden.py").write_text(f"{GARDEN.read_text()}\n# another one")
    (again,) = specs_of(plan, None)
    assert again["files"] != cells[0].spec["files"]
    with pytest.raises(InvalidInputError, match="have changed since"):
        measure(cells[0].spec)


def test_a_worker_loads_a_domain_of_ones_own(fake, tmp_path, monkeypatch):
    plan = garden_in(tmp_path)
    (spec,) = specs_of(plan, None)
    monkeypatch.setattr("goalscope.envs.registry.OWN.modules", {})
    with pytest.raises(InvalidInputError, match="only runs if you name it"):
        measure(spec)
    assert perform({"spec": spec, "identity": measuring.identity_of({})})["rounds"] == 3


OWN = """
import numpy as np
from goalscope.belief.calibration import PAPER


class Mine:
    calibration = PAPER

    def __init__(self, model):
        self.model = model

    def log_likelihood(self, task, goals, turns, *, since=0):
        rows = [[float(len(g.text) + len(t.utterance)) for g in goals] for t in turns[since:]]
        return np.array(rows).reshape(len(turns) - since, len(goals))


class Transposed(Mine):
    def log_likelihood(self, task, goals, turns, *, since=0):
        return super().log_likelihood(task, goals, turns, since=since).T
"""


def test_a_likelihood_of_ones_own_is_the_evidence_of_episodes_and_dialogues(
    fake, results, tmp_path
):
    (tmp_path / "mine.py").write_text(OWN)
    row = {"id": "a", "task": "t", "goals": ["tea", "coffee"], "true": "tea"}
    row["turns"] = [{"query": "?", "utterance": "hot"}]
    (tmp_path / "d.jsonl").write_text(json.dumps(row))
    own = f"{tmp_path / 'mine.py'}:Mine"
    dialogues = DialoguesPart(jsonl=str(tmp_path / "d.jsonl"), outright=False, likelihood=own)
    people = shop(tmp_path, "shopper", methods=("good",), likelihood=own, rounds=2)
    plan = replace(people, dialogues=(dialogues,))
    run(specs_of(plan, None), results, plan)
    dialogue, episode = results.cells()
    assert (dialogue.error, episode.error) == (None, None)
    assert dialogue.result["role-play"] == [[6.0, 9.0]]
    assert dialogue.result["calibration"]["temperature"] == 1.0
    notes = [note for table in tables_of(results.cells()) for note in table.notes]
    assert any(f"evidence from the likelihood {own}" in note for note in notes)
    rounds = results.rounds(episode.result["episode"])
    for number, each in enumerate(rounds, 1):
        scored = [float(len(g.text) + len(each.turn.utterance)) for g in each.belief.goals]
        assert each.belief.log_likelihood[number - 1].tolist() == scored
    wrong = replace(dialogues, likelihood=f"{tmp_path / 'mine.py'}:Transposed")
    (spec,) = specs_of(Experiment("x", dialogues=(wrong,)), None)
    with pytest.raises(InvalidInputError, match=r"Transposed.* must return an array of \[1, 3\]"):
        measure(spec)


def test_what_is_measured_is_what_was_planned_whatever_the_file_says(results, fake):
    assert run(fakes(1), results, Experiment("x"))
    planned = results.plan(fakes(3))
    with results.writing() as connection:
        values = {"spec": json.dumps({"kind": "fake", "n": 99, "model": {}})}
        connection.execute(CELLS.update().where(CELLS.c.key == planned[1].key).values(values))
    run(fakes(3), results)
    assert fake["begun"] == [0, 1, 2]


def test_an_episode_writes_no_files_that_a_kill_would_leave_behind(fake, tmp_path, monkeypatch):
    (spec,) = specs_of(shop(tmp_path, "silent"), None)
    before = {*tmp_path.rglob("*")}
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    assert measure(spec)["episode"]["ended"] == "truncated"
    assert {*tmp_path.rglob("*")} == before


def test_worker_processes_measure_the_same_to_the_bit(tmp_path):
    rows = "".join(json.dumps(row) + "\n" for row in QUESTIONS)
    (tmp_path / "questions.jsonl").write_text(rows)
    plan = Experiment("x", mcq=(QuestionsPart(str(tmp_path / "questions.jsonl")),))
    found = []
    for workers in (1, 2):
        with Results.open(tmp_path / f"{workers}.db") as results:
            assert run(specs_of(plan, None), results, plan, workers=workers)[-1][2:] == (3, 3)
            found.append([(cell.key, cell.spec, cell.result) for cell in results.cells()])
    assert found[0] == found[1]


def die(task):
    os._exit(1)


def test_a_worker_that_dies_ends_the_run_and_loses_no_result(results, fake, monkeypatch):
    run(fakes(1), results)
    monkeypatch.setattr(runs, "perform", die)
    with pytest.raises(GoalscopeError, match=r"worker process died.*same command"):
        run(fakes(3), results, workers=2)
    assert [cell.attempts for cell in results.cells()] == [1, 0, 0]


def wait(task):
    print("waiting", flush=True)
    time.sleep(300)


def test_workers_end_with_a_run_that_is_killed(tmp_path):
    script = (
        "import test_run as t; t.runs.perform = t.wait\n"
        f"with t.Results.open(t.Path({str(tmp_path / 'r.db')!r})) as results:\n"
        "    t.run(t.fakes(4), results, workers=2)"
    )
    command, here = [sys.executable, "-c", script], Path(__file__).parent
    with subprocess.Popen(command, cwd=here, stdout=subprocess.PIPE, text=True) as begun:
        assert begun.stdout
        assert [begun.stdout.readline() for _ in range(2)] == ["waiting\n"] * 2
        begun.kill()
        assert begun.communicate(timeout=30) == ("", None)  # once nobody can write there
