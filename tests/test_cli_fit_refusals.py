"""`goalscope fit`: what is refused, and what is left as it was."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

import fits
from commands import fails, run
from fits import OLD_NAME, SETTINGS, Finished, case, fit, last_error, rows_file
from goalscope.base.types import InvalidInputError, Turn
from goalscope.datasets.case import said_key
from goalscope.datasets.sources import Source, read_source
from goalscope.fitting.plan import Plan
from goalscope.models.adapters import FITTED_DIALOGUES, read_adapter
from goalscope.models.torch.model import Transformers

torch = pytest.importorskip("torch")
transformers = pytest.importorskip("transformers")

pytestmark = OLD_NAME
path, rows, finished = fits.path, fits.rows, fits.finished


@pytest.mark.parametrize("width", [64, 32])
def test_another_model_of_the_same_name_does_not_go_on(
    path: Path, rows: Path, tmp_path: Path, width: int
) -> None:
    other = shutil.copytree(path, tmp_path / "tiny")
    config = transformers.LlamaConfig.from_pretrained(other, hidden_size=width)
    torch.manual_seed(1)
    transformers.LlamaForCausalLM(config).save_pretrained(other)
    source = [read_source(str(rows), None)]

    def steps(model: Path) -> Any:
        options: Any = {"start": None, "layout": "goal-last", "base": "tiny"}
        loaded = Transformers(model, device="cpu", dtype="float32")
        return Plan(source, tmp_path / "out", SETTINGS, **options).run(loaded, command="")

    assert next(steps(path)).validation
    with pytest.raises(InvalidInputError, match="started with another model"):
        next(steps(other))
    assert [next(going).step for going in [steps(path)] for _ in range(2)] == [0, 1]


def test_what_it_began_with_neither_validates_nor_has_another_layout(
    finished: Finished, path: Path, tmp_path: Path
) -> None:
    start = finished.folder / "adapter.gguf"
    model = Transformers(path, device="cpu", dtype="float32")
    learned = read_adapter(start, model.network.model.config).metadata[FITTED_DIALOGUES].split()
    known = [case(n) for n in range(6) if said_key(case(n).turns) in learned]
    others = [
        replace(case(n), group=f"o{n}", turns=(Turn("What?", f"soap {n}"),)) for n in range(6)
    ]
    for sources, layout, said in (
        ([Source("known", known, "1")], "goal-first", "was fitted on all these dialogues"),
        ([Source("both", [*known, *others], "2")], "goal-last", "with the layout goal-first, not"),
    ):
        with pytest.raises(InvalidInputError, match=said):
            Plan(sources, tmp_path, SETTINGS, start=start, layout=layout, base="tiny")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("code", "more", "said"),
    [
        (2, ["--model", "http://host/v1#name"], "A model on a server cannot be fitted."),
        (2, ["--learning-rate", 2], "--learning-rate must be between 0 and 1, not 2.0."),
        (2, ["nowhere.jsonl"], "nowhere.jsonl cannot be read"),
        (1, ["--start", "nowhere"], "There is no adapter at nowhere."),
        (1, ["--model", "nowhere"], "There is no model folder"),
    ],
)
def test_what_cannot_be_fitted_is_refused_in_a_line(
    path: Path, rows: Path, tmp_path: Path, code: int, more: list[Any], said: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert said in fails(code, *fit(rows, tmp_path / "out", path, *more))
    assert not (tmp_path / "out").exists()


def test_folders_that_cannot_be_taken_are_left_as_they_are(
    path: Path, rows: Path, tmp_path: Path
) -> None:
    notes, file, busy = (tmp_path / name for name in ("notes", "file", "busy"))
    notes.mkdir()
    busy.mkdir()
    (notes / "notes.txt").write_text("Milk.")
    file.write_text("")
    new = "Name a new folder with --out."
    other = "Check the path and who may use it, or name another one."
    with FileLock(busy / ".lock"):
        for code, out, said in (
            (2, notes, f"{notes} contains notes.txt but no interrupted fit. {new}"),
            (2, file, f"{file} is a file. {new}"),
            (1, file / "out", f"Not a directory: {file / 'out'}. {other}"),
            (2, busy, f"Another process is fitting an adapter in {busy}."),
        ):
            result = run(*fit(rows, out, path))
            assert (result.exit_code, last_error(result)) == (code, f"Error: {said}")
        assert [each.name for each in busy.iterdir()] == [".lock"]
    assert [each.name for each in notes.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"goals": ["buy milk", "buy " + "tea " * 300], "true": 0}, "a goal has"),
        ({"turns": [{"query": "What?", "utterance": "milk " * 3000}]}, "utterance is too long"),
        ({"task": "milk " * 3000}, "task is too long"),
    ],
)
def test_what_is_too_long_is_refused_before_the_work_begins(
    path: Path, tmp_path: Path, changed: dict[str, Any], said: str
) -> None:
    rows, out = rows_file(tmp_path / "own.jsonl", "abcdefgh", **changed), tmp_path / "out"
    result = run(*fit(rows, out, path))
    assert result.exit_code == 2
    error = " ".join(result.stderr.split())
    assert "own.jsonl, dialogue c7: " in error
    assert said in error
    assert "step " not in error
    assert list(out.iterdir()) == []
