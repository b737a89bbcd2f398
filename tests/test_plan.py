"""What a TOML file may say, what is refused and how, and which cells come of it."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import pytest

from goalscope.agent.toolkit import MODULES
from goalscope.base.types import InvalidInputError
from goalscope.belief.calibration import Calibration, keep_calibration
from goalscope.datasets import data_folder
from goalscope.experiment.plan import (
    DialoguesPart,
    EpisodesPart,
    Experiment,
    Judge,
    QuestionsPart,
    judging,
    read_experiment,
    specs_of,
)
from goalscope.experiment.results import Cell, cell_key

SHIPPED = sorted((Path(__file__).parents[1] / "plans").glob("*.toml"))
ROW = {
    "id": "a",
    "task": "Sell.",
    "turns": [{"query": "Yes?", "utterance": "Tea."}, {"query": "And?", "utterance": "Milk."}],
    "goals": ["make tea", "bake"],
    "true": "make tea",
}
QUESTION = {"id": "q", "prompt": "Which?", "choices": {"A": "one", "B": "two"}, "answer": "A"}


def read(tmp_path, text):
    (tmp_path / "x.toml").write_text(text)
    return read_experiment(tmp_path / "x.toml")


def refused(tmp_path, text, folder=None):
    """Why it cannot be read or planned."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("GOALSCOPE_DATA", raising=False)
        with pytest.raises(InvalidInputError) as caught:
            specs_of(read(tmp_path, text), folder)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def lines(tmp_path, name, *rows):
    (tmp_path / name).write_text("".join(json.dumps(row) + "\n" for row in rows))
    return tmp_path / name


REFUSED = [
    # what `validated` refuses, once for each form of this file
    ("[mqc]\nfile = 'x'", "x.toml: the key 'mqc' is unknown; did you mean 'mcq'?"),
    ("[mcq]\nfiles = 'x'", "x.toml, mcq 1: the key 'files' is unknown; did you mean 'file'?"),
    ("name = 'x'\n[mcq]\nfile = 'x'", "leave out 'name'"),
    ("models = [{scorr = 'x'}]", "x.toml, models 1: the key 'scorr'", "did you mean 'scorer'?"),
    ("episodes = {domain = 'grocery', propose = 'often'}", "must be a number or 'paper', not"),
    ("models = [7]", "models 1 must be a table of keys, not 7."),
    ("models = [{model = 7}]", "'model' must be a text, not 7"),
    # what is there, but not enough or not to be combined
    ("title = 'x'", "nothing to measure. Add a table"),
    ("episodes = {domain = 'mine.py'}", "has nobody to simulate: no profiles"),
    ("episodes = {domain = 'mine.py', scene = 'Kitchen1'}", "'scene' does not apply"),
    (
        "episodes = {domain = 'grocery', likelihood = 'mine.py:Mine', layouts = 'goal-first'}",
        "'layouts' only applies to the role-play likelihood",
    ),
    # a name that is unknown, and the nearest or all that are known
    ("episodes = {domain = 'gardn.py'}", "not 'gardn.py'", "existing Python file"),
    ("episodes = {domain = 'grocery', profiles = 'souup'}", "'souup'", "'soup'"),
    ("episodes = {domain = 'grocery', profiles = 'people.toml'}", "named by 'people'"),
    ("episodes = {domain = 'grocery', prompted = 'plans'}", "no module 'plans'"),
    ("episodes = {domain = 'grocery', likelihood = 'no.py:Mine'}", "not 'no.py:Mine'"),
    ("dialogues = {jsonl = 'd.jsonl', likelihood = 'mine.py:Nine'}", "Nine is missing"),
    ("dialogues = {set = 'mcq'}", "'mcq'", "teach"),
    ("dialogues = {set = 'teach', goal_sets = 'rndom'}", "'rndom'", "'random'"),
]

MINE = '''
import numpy as np
from goalscope.belief.calibration import PAPER


class Mine:
    """Words that a goal shares with the utterance."""

    calibration = PAPER

    def __init__(self, model):
        self.model = model

    def log_likelihood(self, task, goals, turns, *, since=0):
        said = [{*turn.utterance.lower().split()} for turn in turns[since:]]
        found = [[len(one & {*goal.text.lower().split()}) for goal in goals] for one in said]
        return np.array(found, dtype=float).reshape(len(said), len(goals))


def open_environment(profile):
    raise AssertionError


def load_profiles(path):
    return ()
'''


@pytest.mark.parametrize("text_and_said", REFUSED, ids=lambda row: row[0])
def test_what_cannot_be_used_is_refused_with_its_place_and_cause(tmp_path, text_and_said):
    text, *said = text_and_said
    (tmp_path / "people.toml").write_text(
        "[[profile]]\nname='soup'\ndescription='Soup.'\nreplies=['Soup.']\n"
        "checks=[{must_have=['soup']}]\n"
    )
    (tmp_path / "mine.py").write_text(MINE)
    lines(tmp_path, "d.jsonl", ROW)
    if "souup" in text:
        people = json.dumps(str(tmp_path / "people.toml"))
        text = text.replace("}", f", people = {people}}}")
    found = refused(tmp_path, text, tmp_path)
    assert [each for each in said if each not in found] == []


def test_files_that_are_missing_or_broken_are_named(tmp_path):
    assert "--data" in refused(tmp_path, "dialogues = {set = 'teach'}")
    assert "--data" in refused(tmp_path, "mcq = {file = 'mcq/no.jsonl'}")
    assert "file 'no.jsonl' or '/" in refused(tmp_path, "mcq = {file='no.jsonl'}", tmp_path)
    assert "no file" in refused(tmp_path, 'mcq = {file = "a\\u0000b"}', tmp_path)
    with pytest.raises(InvalidInputError, match="not readable"):
        read_experiment(tmp_path / "no.toml")


def test_dialogues_are_a_dataset_or_a_file_of_ones_own_and_not_both(tmp_path):
    lines(tmp_path, "d.jsonl", ROW)
    for text in ("goals = 3", "set = 'teach', jsonl = 'd.jsonl'"):
        assert "either 'set'" in refused(tmp_path, f"dialogues = {{{text}}}", tmp_path)
    for text in ("goal_sets = 'random'", "split = 'valid_seen'"):
        said = refused(tmp_path, f"dialogues = {{jsonl = 'd.jsonl', {text}}}", tmp_path)
        assert "has its own goals" in said


def test_a_scalar_stands_for_a_list_of_one(tmp_path):
    text = """
    dialogues = {set = "teach", goal_sets = "random"}
    episodes = {domain = "house", seeds = 3, humans = "terse"}
    mcq = [{file = "a", layouts = "goal-first"}, {file = "b"}]
    judge = {model = "http://host/v1#big", seed = 2}
    """
    found = read(tmp_path, text)
    assert found.dialogues == (DialoguesPart(set="teach", goal_sets=("random",)),)
    assert found.episodes == (EpisodesPart("house", seeds=(3,), humans=("terse",)),)
    assert found.mcq == (QuestionsPart("a", layouts=("goal-first",)), QuestionsPart("b"))
    assert found.judge == Judge(20, 2, model={"model": "http://host/v1#big"})
    assert (found.name, found.title) == ("x", "x")
    with pytest.raises(InvalidInputError, match=r"\[judge\] scores episodes"):
        read(tmp_path, "mcq = {file = 'x'}\njudge = {}")


@pytest.mark.parametrize(
    ("given", "models"),
    [
        ("", [{}]),
        ("models = 'tiny.gguf'", [{"model": "tiny.gguf"}]),
        ("models = ['embedded', {generator = 'w', scorer = 'embedded'}]", [{}, {"generator": "w"}]),
        ("models = [{model = 'm', adapter = 'none'}]", [{"model": "m", "adapter": "none"}]),
        ("models = [{adapter = 'mine'}]", [{"adapter": "MINE"}]),
    ],
)
def test_models_are_names_or_tables_and_adapters_stand_beside_the_file(tmp_path, given, models):
    for name in ("mine", "none"):
        (tmp_path / name).mkdir()
    found = read(tmp_path, f"{given}\nmcq = {{file = 'x'}}").models
    mine = {"MINE": str(tmp_path / "mine")}
    assert [*found] == [{key: mine.get(v, v) for key, v in each.items()} for each in models]


def test_a_part_may_have_models_of_its_own_and_the_command_line_takes_the_place_of_all(tmp_path):
    lines(tmp_path, "d.jsonl", ROW)
    text = """
    models = ["a.gguf", "b.gguf"]
    dialogues = [{jsonl = "d.jsonl", models = [{adapter = "none"}]}, {jsonl = "d.jsonl"}]
    episodes = {domain = "grocery", methods = "good", profiles = "cafe"}
    judge = {model = "b.gguf"}
    """
    plan = read(tmp_path, text)
    a, b = ({"model": f"{name}.gguf"} for name in "ab")
    assert [(spec["kind"], spec["model"]) for spec in specs_of(plan, tmp_path)] == [
        ("dialogue", {"adapter": "none"}), ("dialogue", a), ("dialogue", b),
        ("episode", a), ("episode", b),
    ]  # fmt: skip
    own = plan.with_models(({"model": "own.gguf"},))
    assert [spec["model"]["model"] for spec in specs_of(own, tmp_path)] == ["own.gguf"] * 2
    assert own.judge.model == b
    assert "at least 1" in refused(tmp_path, "[dialogues]\njsonl = 'd.jsonl'\nmodels = []")


def test_there_are_as_many_cells_as_the_product_of_the_axes(tmp_path):
    questions = lines(tmp_path, "q.jsonl", QUESTION, {**QUESTION, "id": "r"})
    own = lines(tmp_path, "d.jsonl", ROW, {**ROW, "id": "b"}, {**ROW, "id": "c"})
    both = ("goal-first", "goal-last")
    experiment = Experiment(
        "x",
        models=({}, {"model": "m"}),
        mcq=(QuestionsPart(str(questions), layouts=both),),
        dialogues=(DialoguesPart(jsonl=str(own), limit=2, turns=1, layouts=both),),
        episodes=(
            EpisodesPart(
                "grocery",
                methods=("good", "no-goals", "no-inference"),
                humans=("scripted", "terse"),
                calibrations=("default", "paper"),
                layouts=both,
                seeds=(0, 1),
            ),
        ),
    )
    specs = specs_of(experiment, None)
    kinds = [spec["kind"] for spec in specs]
    assert kinds.count("mcq") == 2 * 2 * 2
    assert kinds.count("dialogue") == 2 * 2 * 2
    assert kinds.count("episode") == 2 * 10 * 3 * 2 * 2 * 2 * 2
    assert len({cell_key(spec) for spec in specs}) == len(specs)
    assert [spec["model"] for spec in (specs[0], specs[-1])] == [{}, {"model": "m"}]
    (dialogue, *_) = (spec for spec in specs if spec["kind"] == "dialogue")
    assert dialogue["case"]["turns"] == ROW["turns"][:1]
    assert (dialogue["goal_set"], dialogue["case"]["truth"]) == ("own", 0)


def test_episodes_may_propose_and_be_prompted_as_in_the_paper(tmp_path):
    found = []
    for more in ("", ", propose = 'paper', prompted = ['remove', 'plan']", ", prompted = 'all'"):
        part = f"episodes = {{domain = 'grocery', methods = 'good', profiles = 'cafe'{more}}}"
        found += specs_of(read(tmp_path, part), None)
    plain, paper, every = (spec["settings"] for spec in found)
    assert plain["calibration"] is None  # that of the model
    assert not {"propose", "prompted"} & set(plain)
    assert (paper["propose"], paper["prompted"]) == ("paper", ["remove", "plan"])
    assert every["prompted"] == [*MODULES]
    assert len({*map(cell_key, found)}) == 3


def test_a_calibration_is_a_name_or_a_file_beside_the_toml_whose_content_counts(tmp_path):
    part = "episodes = {{domain = 'grocery', profiles = 'cafe', calibrations = {}}}"
    assert "paper, default" in refused(tmp_path, part.format("['paper', 'no.json']"))
    specs = []
    for temperature in (2.0, 2.0, 3.0):
        keep_calibration(tmp_path / "mine.json", Calibration(temperature), {})
        found = specs_of(read(tmp_path, part.format("['mine.json', 'paper']")), None)
        specs.append([each for each in found if each["settings"]["method"] == "good"])
    one, same, other = specs
    named, paper = one
    assert named["settings"]["calibration"] == str(tmp_path / "mine.json")
    assert list(named["files"]) == ["calibration"]
    assert (paper["settings"]["calibration"], paper["files"]) == ("paper", {})
    keys = [[cell_key(spec) for spec in each] for each in specs]
    assert one == same
    assert (keys[0][0] == keys[2][0], keys[0][1] == keys[2][1]) == (False, True)
    assert other[0]["settings"] == named["settings"]


def test_the_evaluator_judges_each_run_that_is_done():
    part = EpisodesPart("grocery", ("cafe",), methods=("good", "no-goals"))
    experiment = Experiment("x", episodes=(part,), judge=Judge(3, 2, model={"model": "big"}))
    specs = specs_of(experiment, None)
    result = {"task": "t", "description": "d", "empty": False, "outcome": "o", "actions": ["a"]}
    cells = [Cell(cell_key(spec), spec, result=result) for spec in specs]
    found = judging(experiment, cells)
    assert [spec["kind"] for spec in found] == ["judge"] * 2
    assert [spec["of"]["key"] for spec in found] == [cell.key for cell in cells]
    assert {spec["model"]["model"] for spec in found} == {"big"}
    assert found[0]["actions"] == []  # of the shop, the basket alone is shown
    assert len(judging(experiment, [Cell(cells[0].key, specs[0]), cells[1]])) == 1
    assert judging(Experiment("x", episodes=(part,)), cells) == []


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_the_experiments_of_the_repository_can_be_planned(file):
    assert len(SHIPPED) >= 8
    experiment = read_experiment(file)
    assert experiment.title
    if not os.environ.get("GOALSCOPE_DATA"):
        pytest.skip("GOALSCOPE_DATA is not set")
    one = tuple(replace(each, goal_sets=each.goal_sets[:1]) for each in experiment.dialogues)
    specs = specs_of(replace(experiment, dialogues=one), data_folder(None))
    assert len({cell_key(spec) for spec in specs}) == len(specs) > 0


def test_settings_spelt_out_as_they_are_anyway_make_the_same_cells(tmp_path):
    usual = specs_of(read(tmp_path, "episodes = {domain = 'grocery'}"), None)
    same = read(tmp_path, "episodes = {domain = 'grocery', k = 3}")
    other = read(tmp_path, "episodes = {domain = 'grocery', k = 1}")
    assert specs_of(same, None) == usual
    found = specs_of(other, None)
    assert len(found) == len(usual)
    assert {cell_key(spec) for spec in usual}.isdisjoint(map(cell_key, found))


def test_the_judges_temperature_is_part_of_its_cells_unless_it_is_the_usual_one(tmp_path):
    result = {"task": "t", "description": "d", "empty": False, "outcome": "tea", "actions": []}

    def judged(text):
        plan = read(tmp_path, f"episodes = {{domain = 'grocery'}}\n[judge]\n{text}")
        spec = specs_of(plan, None)[0]
        (found,) = judging(plan, [Cell(cell_key(spec), spec, result=result)])
        return found

    assert judged("temperature = 0.7") == judged("")
    assert judged("temperature = 0") == {**judged(""), "temperature": 0.0}


def test_files_of_ones_own_are_found_beside_the_experiment_and_are_part_of_its_cells(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path.parent)
    (tmp_path / "mine.py").write_text(MINE)
    lines(tmp_path, "d.jsonl", ROW)
    text = f"dialogues = {{jsonl = '{tmp_path}/d.jsonl', likelihood = 'mine.py:Mine'}}"
    (one,) = specs_of(read(tmp_path, text), None)
    assert one["likelihood"] == f"{tmp_path / 'mine.py'}:Mine"
    (tmp_path / "mine.py").write_text(f"{MINE}\n# another one")
    (other,) = specs_of(read(tmp_path, text), None)
    assert (one["files"] != other["files"], cell_key(one) != cell_key(other)) == (True, True)
    usual = read(tmp_path, "episodes = {domain = 'grocery', profiles = 'cafe'}")
    own = read(
        tmp_path,
        "episodes = {domain = 'grocery', profiles = 'cafe', likelihood = 'mine.py:Mine'}",
    )
    pairs = [*zip(specs_of(usual, None), specs_of(own, None), strict=True)]
    assert [before == after for before, after in pairs] == [False, True, True]  # only GOOD has it
    for before, after in pairs[:1]:
        assert after["settings"] == {**before["settings"], "likelihood": one["likelihood"]}
        assert {*after["files"]} == {"likelihood"}
