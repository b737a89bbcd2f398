"""Makers of results for the tests of reports."""

import re
from dataclasses import asdict
from html import unescape
from pathlib import Path

import pytest

from goalscope.agent.round import Round
from goalscope.base.types import Goal, Turn
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import DEFAULT
from goalscope.experiment.results import Results, cell_key
from goalscope.report import read_report
from goalscope.report.figures import Figure
from goalscope.storage.store import round_to_json
from test_summary import made_of

pytest.importorskip("matplotlib")
pytest.importorskip("scipy.stats")


HOSTILE = (
    "<script>alert(1)</script> $\\frac{x}$ --> ]]> \u202egoal\x1b[31m \uffff\ud800 _x {{ 7*7 }}"
)

IDENTITY = {"version": "1", "code": "abc", "prompts": "def", "model small": "123"}


def round_of(number: int, goals: list[str], row: list[float]) -> Round:
    belief = Belief.uniform([Goal(goal) for goal in goals]).observe(row)
    return Round(number, Turn("?", "!"), belief, (), (), 0, "", (), number == 3)


def rounds() -> list[Round]:
    return [
        round_of(1, ["Unspecified", HOSTILE], [0.0, 1.0]),
        round_of(2, ["Unspecified", HOSTILE, "soup"], [0.0, 1.0, 2.0]),
        round_of(3, ["Unspecified", "soup"], [0.0, 3.0]),
    ]


def mcq(n: int) -> tuple[dict, dict]:
    choices = {"A": "tea", "B": "soup"}
    row = {"id": str(n), "prompt": HOSTILE, "choices": choices, "answer": "A", "rephrasings": {}}
    goals = [{"choice": "A", "text": "tea"}, {"choice": "B", "text": "soup"}]
    values = {"log_likelihood": [-1.0, -2.0], "unspecified": -1.5}
    result = {"tokens": 2, "goals": goals, "conditions": {"question": values}, "overlap": [1, 0]}
    return {"kind": "mcq", "row": row, "model": {}, "layout": "goal-last"}, result


def dialogue(n: int) -> tuple[dict, dict]:
    case = {"id": str(n), "group": str(n), "task": "Help.", "truth": n % 2}
    case |= {"turns": [{"query": "?", "utterance": "!"}] * 2, "goals": ["a", "b", "c"]}
    spec = {"kind": "dialogue", "set": "own", "split": None, "goal_set": "own", "case": case}
    result = {
        "role-play": [[0.0, 1.0, 0.5]] * 2,
        "unspecified": [0.5] * 2,
        "calibration": asdict(DEFAULT),
        "outright": [{"goal": 0, "sure": 0.9}] * 2,
        "tfidf": [[0.0, 1.0, 0.0]] * 2,
    }
    return {**spec, "model": {}, "layout": "goal-last"}, result


def episode(method: str, profile: str, score: float) -> tuple[dict, dict]:
    settings = {"domain": "grocery", "human": "scripted", "method": method, "seed": 0}
    spec = {"kind": "episode", "settings": settings, "profile": profile, "model": {}}
    begin = {"domain": "grocery", "profile": profile, "method": method, "model": "", "task": "t"}
    own = rounds() if method == "good" else []
    made = {"begin": begin, "rounds": [round_to_json(r) for r in own], "ended": "terminated"}
    result = {"episode": {**made, "score": score}, **made_of(score), "rounds": 3, "replans": 0}
    return spec, {**result, "terminated": True, "empty": False, "outcome": "", "actions": []}


def judged(spec: dict, scores: list[float]) -> tuple[dict, dict]:
    of = {**spec, "key": cell_key(spec)}
    made = {"kind": "judge", "of": of, "model": {}, "trials": 3, "seed": 0, "empty": False}
    return made, {"trials": [{"score": s, "explanation": "", "answer": ""} for s in scores]}


def fill(file: Path, cells: list[tuple[dict, dict]], **about: str | bool) -> Path:
    with Results.open(file) as results:
        results.describe({"name": file.stem, "title": file.stem, **about})
        planned = results.plan([s for s, _ in cells])
        results.ask_for(planned, "make it")
        for cell, (_, result) in zip(planned, cells, strict=True):
            results.keep(cell.key, result, IDENTITY)
    return file


METHODS = ("good", "no-goals", "no-inference")


def ablation(
    people: list[str], trials: list[float], unwanted: int | None = None
) -> list[tuple[dict, dict]]:
    """Each method with each person, whose scores differ, and the evaluator's trials of each."""
    runs = [
        episode(method, person, (i + 1) / (len(people) + j))
        for i, person in enumerate(people)
        for j, method in enumerate(METHODS)
    ]
    for _, result in runs:
        result |= {} if unwanted is None else {"unwanted": ["x"] * unwanted}
    judges = (
        [judged(s, [*trials, float(i // 3 % 4)]) for i, (s, _) in enumerate(runs)] if trials else []
    )
    return [*runs, *judges]


def in_settings() -> list[tuple[dict, dict]]:
    """The ablation with two planners, the first also with a file of people."""
    plain = ablation(["anna", "ben", "cleo"], [3.0, 1.0], 1)
    settings = ({"prompted": ["plan"]}, {"profiles": "/somewhere/else/aims.toml"})
    runs = [run for run in plain if run[0]["kind"] == "episode"]
    others = [
        (
            {**spec, "settings": {**spec["settings"], **own}},
            {**result, "start": result["start"] * 2, "met": result["met"] + result["start"]},
        )
        for own in settings
        for spec, result in runs
    ]
    return [*plain, *others]


def drawn(tmp_path: Path, cells: list[tuple[dict, dict]]) -> list[Figure]:
    fill(tmp_path / "r.db", cells)
    (section,) = read_report(tmp_path / "r.db").sections
    return [*section.figures]


def texts(figure: Figure) -> list[str]:
    return [unescape(each) for each in re.findall(r">([^<>]*)</text>", figure.svg)]
