"""What goes on is what was begun: another model, prompt, code or configuration is refused."""

from __future__ import annotations

import importlib.metadata
import json
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import goalscope
from commands import ROW, rows_file
from commands import run as invoke
from goalscope.base.types import InvalidInputError
from goalscope.experiment import measure as measuring
from goalscope.experiment.plan import read_experiment, specs_of
from goalscope.experiment.results import Results
from goalscope.experiment.run import run
from goalscope.experiment.tables import tables_of
from lives import REPLIES, furnish
from test_run import QUESTIONS, NamedModel


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of goalscope that stands for the one that runs, over a model without loading."""
    copy = tmp_path / "goalscope"
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(goalscope.__file__).parent, copy, ignore=ignored)
    monkeypatch.setattr(goalscope, "__file__", str(copy / "__init__.py"))
    monkeypatch.setattr(measuring, "opened", lambda model, *_: NamedModel(REPLIES))
    monkeypatch.setattr("goalscope.models.opening.open_model", lambda *_, **__: NamedModel(REPLIES))
    _forget()
    yield copy
    _forget()


def _forget() -> None:
    """As a new process would."""
    measuring.own_identity.cache_clear()
    measuring._fingerprints.clear()


def append(path: str) -> Callable[[Path, pytest.MonkeyPatch], None]:
    """Another byte at the end of a file."""

    def change(package: Path, _: pytest.MonkeyPatch) -> None:
        with (package / path).open("r+") as file:  # an existing one
            file.seek(0, os.SEEK_END)
            file.write("\n")

    return change


def other_weights(_: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setattr(NamedModel, "fingerprint", "words 2")


def other_version(_: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setattr(importlib.metadata, "version", lambda name: "99.0")


CHANGES = {
    "model": other_weights,
    "prompts": append("prompts/goal_last.jinja"),
    "code": append("belief/belief.py"),
    "code of the domains": append("envs/house/simulator/world.py"),
    "code that is data": append("envs/grocery/data/profiles.toml"),
    "version": other_version,
}


def questions(folder: Path) -> Path:
    """The files of a tiny experiment with nothing but questions."""
    file = furnish(folder) / "tiny.toml"
    file.write_text(file.read_text().partition("[episodes]")[0])
    return folder


def steps(folder: Path, **options: Any) -> tuple[list[str], list[str]]:
    """The keys of the cells that a run of the experiment measures, and of those planned."""
    plan = read_experiment(folder / "tiny.toml")
    specs = specs_of(plan, None)
    with Results.open(folder / "tiny.db") as results:
        done = [step for step in run(plan, specs, results, **options) if step.cell]
        assert not any(step.error for step in done)
        return [step.cell.key for step in done if step.cell], [
            cell.key for cell in results.planned(specs)
        ]


def contents(folder: Path) -> list[Any]:
    with Results.open(folder / "tiny.db") as results:
        return results.cells()


@pytest.mark.parametrize("what", list(CHANGES))
def test_an_experiment_goes_on_with_what_it_was_begun_with_or_not_at_all(
    tmp_path: Path, package: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    folder = questions(tmp_path / "run")
    steps(folder)
    before = contents(folder)
    with (folder / "questions.jsonl").open("a") as file:
        file.write(json.dumps({**QUESTIONS[0], "id": 9, "prompt": "More?"}) + "\n")
    CHANGES[what](package, monkeypatch)
    _forget()
    with pytest.raises(InvalidInputError, match=f"another {what.split()[0]}.*use --anyway"):
        steps(folder)
    assert contents(folder) == before
    assert len(steps(folder, anyway=True)[0]) == 1
    assert contents(folder)[: len(before)] == before
    with pytest.raises(InvalidInputError, match="use --anyway"):
        steps(folder)  # to be told once is not to be told for ever


def test_code_that_measures_nothing_may_change(tmp_path: Path, package: Path) -> None:
    folder = questions(tmp_path / "run")
    steps(folder)
    for path in ("cli/display.py", "report/figures.py", "study/store.py"):
        append(path)(package, pytest.MonkeyPatch())
    _forget()
    assert steps(folder)[0] == []


@pytest.mark.parametrize(
    ("file", "old", "new", "kept"),
    [
        ("tiny.toml", "trials = 1", "trials = 2", {"mcq", "episode"}),
        ("tiny.toml", 'domain = "grocery"', 'domain = "grocery"\nrounds = 3', {"mcq"}),
        ("shop.csv", "1.20", "1.30", {"mcq"}),
        ("questions.jsonl", "What is missing?", "What else?", {"episode", "judge"}),
    ],
)
def test_another_configuration_takes_nothing_over_from_the_old_one(
    tmp_path: Path, package: Path, file: str, old: str, new: str, kept: set[str]
) -> None:
    """What is measured is part of what a result is found by, so that none is taken for another."""
    folder = furnish(tmp_path / "run")
    steps(folder)
    before = {cell.key: cell for cell in contents(folder)}
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    measured, _ = steps(folder)
    assert measured
    assert before.keys().isdisjoint(measured)
    after = {cell.key: cell for cell in contents(folder)}
    assert {key: after[key] for key in before} == before
    assert kept.isdisjoint(after[key].spec["kind"] for key in measured)
    with Results.open(folder / "tiny.db") as results:
        asked = {cell.key for cell in results.asked_for()}
        assert {*measured} <= asked
        assert tables_of(results.asked_for())


@pytest.mark.parametrize("what", list(CHANGES))
def test_a_file_of_beliefs_goes_on_with_what_it_was_begun_with_or_not_at_all(
    tmp_path: Path, package: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    file, out = rows_file(tmp_path, ROW, {**ROW, "id": "b"}), tmp_path / "out.jsonl"
    assert invoke("infer", file, "--out", out).exit_code == 0
    begun = b"".join(out.read_bytes().splitlines(keepends=True)[:2])
    out.write_bytes(begun)
    CHANGES[what](package, monkeypatch)
    _forget()
    refused = invoke("infer", file, "--out", out)
    assert refused.exit_code == 2
    changed = "weights" if what == "model" else what.split()[0]
    assert f"written with {changed} " in refused.stderr
    assert out.read_bytes() == begun
