"""`goalscope fit`: what it says, what it leaves, and how it goes on."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fits
from commands import fails, run
from fits import GOALS, OLD_NAME, SETTINGS, TASK, Finished, fit, last_error
from goalscope.base.types import Turn
from goalscope.belief.likelihood import RolePlay
from goalscope.datasets.case import said_key
from goalscope.datasets.goal_sets import chance, goal_key
from goalscope.fitting import plan
from goalscope.fitting.fit import _by_truth
from goalscope.fitting.plan import Plan, parted
from goalscope.models.adapters import (
    FITTED_DIALOGUES,
    FITTED_GOALS,
    read_adapter,
    write_adapter,
)
from goalscope.models.torch.model import Transformers

torch = pytest.importorskip("torch")
transformers = pytest.importorskip("transformers")
peft = pytest.importorskip("peft")
safetensors = pytest.importorskip("safetensors")

pytestmark = OLD_NAME
path, rows, finished = fits.path, fits.rows, fits.finished

TURNS = [Turn("What is it?", "tea"), Turn("Why?", "soap and milk")]
LEFT = {"adapter.gguf", "adapter_config.json", "adapter_model.safetensors", "README.md", "fit.json"}


def likelihood(model: Transformers) -> np.ndarray:
    return RolePlay(model, layout="goal-first").log_likelihood(TASK, GOALS, TURNS)


def test_the_folder_holds_the_adapter_and_no_state(finished: Finished) -> None:
    assert {each.name for each in finished.folder.iterdir()} == LEFT
    for each in finished.folder.iterdir():
        if each.suffix != ".gguf" and each.suffix != ".safetensors":
            assert str(finished.model._source.parent) not in each.read_text()
    config = json.loads((finished.folder / "adapter_config.json").read_text())
    assert config["base_model_name_or_path"] == "tiny"
    assert (config["r"], config["lora_alpha"], config["peft_type"]) == (4, 4, "LORA")


def test_peft_reads_it(finished: Finished, path: Path) -> None:
    base = transformers.AutoModelForCausalLM.from_pretrained(path, dtype=torch.float32)
    model = peft.PeftModel.from_pretrained(base, finished.folder).eval()
    tokens = np.random.default_rng(1).integers(10, 300, 40).tolist()
    with torch.inference_mode():
        logits = model(input_ids=torch.tensor([tokens])).logits[0]
    expected = finished.model.network.read(tokens, range(40))
    torch.testing.assert_close(logits, expected, atol=1e-4, rtol=1e-4)
    plain = Transformers(path, device="cpu", dtype="float32").network.read(tokens, range(40))
    assert (plain - expected).abs().max() > 0.1


def test_the_file_says_what_it_was_fitted_on(finished: Finished) -> None:
    adapter = read_adapter(finished.folder / "adapter.gguf", finished.model.network.model.config)
    train, validation = parted(finished.sources, validation=SETTINGS.validation, seed=SETTINGS.seed)
    best = json.loads((finished.folder / "fit.json").read_text())["best"]["step"]
    assert best > 0
    taught: dict[int, set[str]] = {0: set(), 1: set()}
    goals, words = set[str](), set[str]()
    for step in range(best):
        for number in range(SETTINGS.batch_size):
            random = chance(SETTINGS.seed, f"step {step}, {number}")
            source = random.randrange(2)
            drawn = random.choice(random.choice(_by_truth(train[source])))
            taught[source].add(drawn.id)
            goals.add(goal_key(drawn.goals[drawn.truth].text))
            words.add(said_key(drawn.turns))
    assert adapter.metadata[FITTED_GOALS] == " ".join(sorted(goals))
    assert adapter.metadata[FITTED_DIALOGUES] == " ".join(sorted(words))
    facts = json.loads((finished.folder / "fit.json").read_text())
    assert [each["learned"] for each in facts["sources"]] == [len(taught[0]), len(taught[1])]
    keys = ("goalscope.base", "goalscope.layout", "goalscope.temperature", "general.name")
    assert [adapter.metadata[key] for key in keys] == ["tiny", "goal-first", "2", "mine"]
    assert (adapter.rank, adapter.alpha, len(adapter.layers)) == (4, 4.0, 14)
    assert len(validation) == 3


def test_the_card_and_its_figures_tell_how_it_was_made(finished: Finished) -> None:
    card = (finished.folder / "README.md").read_text()
    facts = json.loads((finished.folder / "fit.json").read_text())
    own, _ = finished.sources
    read = [each["learned"] for each in facts["sources"]]
    for line in (
        f"| {own.name} | 6 | {read[0]} | 2 | your own | `{own.sha256[:16]}` |",
        f"| multiwoz:val[:5] | 4 | {read[1]} | 1 | MIT | `{'ab' * 8}` |",
        *(f"| {key} | {value} |" for key, value in asdict(SETTINGS).items()),
    ):
        assert line in map(str.strip, card.splitlines())
    assert "`goalscope fit X`" in card
    assert "None" not in card
    assert facts["settings"] == asdict(SETTINGS)
    assert [each["step"] for each in facts["history"]] == [0, 3, 6]
    assert facts["best"] == min(facts["history"], key=lambda each: each["loss"])


def test_a_fit_may_begin_with_another(finished: Finished, path: Path, tmp_path: Path) -> None:
    model = Transformers(path, device="cpu", dtype="float32")
    config = model.network.model.config
    made = read_adapter(finished.folder / "adapter.gguf", config)
    silent = {key: text for key, text in made.metadata.items() if key != FITTED_DIALOGUES}
    start = tmp_path.parent / "silent.gguf"
    write_adapter(start, replace(made, metadata=silent), config)
    settings = replace(SETTINGS, steps=1, validate_every=1, learning_rate=1e-6)
    options: Any = {"start": start, "layout": "goal-first", "base": "tiny"}
    list(Plan(finished.sources, tmp_path, settings, **options).run(model, command=""))
    before, after = (json.loads((f / "fit.json").read_text()) for f in (finished.folder, tmp_path))
    assert after["history"][0]["loss"] == pytest.approx(before["best"]["loss"], abs=0.02)
    assert re.fullmatch(
        r"the adapter mine \(SHA-256 `[0-9a-f]{16}`\), which does not say what it was "
        r"fitted on, perhaps including the validation dialogues",
        after["start"],
    )
    model.clear_cache()
    np.testing.assert_allclose(likelihood(model), likelihood(finished.model), atol=0.05)


def test_the_command_fits_and_finished_folders_are_kept(
    path: Path, rows: Path, tmp_path: Path
) -> None:
    out = tmp_path / "mine"
    result = run(*fit(rows, out, path, "--validation", 1, "--json"))
    assert result.exit_code == 0, result.output
    facts = json.loads((out / "fit.json").read_text())
    assert json.loads(result.stdout) == facts
    assert "log-loss" not in result.stderr
    assert facts["command"].startswith("goalscope fit ")
    assert facts["validated"] == 1
    assert facts["base"] == "tiny"
    assert str(path.parent) not in (out / "adapter_config.json").read_text()
    assert facts["layout"] == "goal-last"
    kept = {each.name: each.read_bytes() for each in out.iterdir()}
    assert kept.keys() == LEFT
    again = run(*fit(rows, out, path, "--validation", 1, "--json"))
    assert again.exit_code == 2
    said = f"Error: {out} contains a finished adapter but no interrupted fit. Name a new folder"
    assert last_error(again) == f"{said} with --out."
    assert len({each.stat().st_mode for each in out.iterdir()}) == 1
    assert {each.name: each.read_bytes() for each in out.iterdir()} == kept


class Broken(Exception):
    """What a test stops a fit with."""


def broken_by(error: Exception) -> Callable[..., Any]:
    def call(*_: Any, **__: Any) -> Any:
        raise error

    return call


def test_the_command_goes_on_where_it_was_stopped(
    path: Path, rows: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert run(*fit(rows, whole, path)).exit_code == 0
    validate, count = plan.Fit._validate, iter(range(9))

    def stopped(*args: Any) -> Any:
        if next(count) == 2:
            raise Broken
        return validate(*args)

    with monkeypatch.context() as patch:
        patch.setattr(plan.Fit, "_validate", stopped)
        with pytest.raises(Broken):
            run(*fit(rows, out, path))
    assert [each.name for each in out.iterdir()] == ["state.pt"]
    said = run(*fit(rows, out, path, "--seed", 2))
    assert said.exit_code == 2
    assert "started with another settings" in " ".join(said.stderr.split())
    with monkeypatch.context() as patch:
        patch.setattr(plan.Fit, "_learn", broken_by(KeyboardInterrupt()))
        result = run(*fit(rows, out, path))
    assert result.exit_code == 130
    assert "Interrupted. The same command resumes, and repeats at most ten steps." in result.stderr
    result = run(*fit(rows, out, path))
    assert result.exit_code == 0, result.output
    assert "Resumed after step 2." in result.stderr
    assert re.findall(r"^step +(\d) ", result.stderr, re.MULTILINE) == ["4"]
    found, expected = (json.loads((f / "fit.json").read_text()) for f in (out, whole))
    for one, other in zip(found["history"], expected["history"], strict=True):
        assert one["loss"] == pytest.approx(other["loss"], rel=1e-3)


@pytest.mark.parametrize(
    ("what", "error"),
    [
        ("goalscope.fitting.plan.write_adapter", OSError(28, "No space left on device")),
        ("goalscope.fitting.plan.Plan._write_card", OSError(28, "No space left on device")),
        ("peft.PeftModel.save_pretrained", safetensors.SafetensorError("No space left on device")),
    ],
)
def test_where_the_end_cannot_be_written_the_same_command_goes_on(
    path: Path, rows: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str,
    error: Exception,
) -> None:  # fmt: skip
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(what, broken_by(error))
        failed = run(*fit(rows, out, path))
    assert failed.exit_code == 1
    said = " ".join(failed.stderr.split())
    assert "No space left on device" in said
    assert "the same command resumes from the saved state" in said
    left = {each.name for each in out.iterdir()}
    assert "state.pt" in left
    assert "adapter.gguf" not in left
    again = run(*fit(rows, out, path))
    assert again.exit_code == 0, again.stderr
    assert "log-loss" not in again.stderr  # nothing is fitted again
    assert {each.name for each in out.iterdir()} == LEFT


def test_the_adapter_is_used_by_name(
    finished: Finished, path: Path, rows: Path, tmp_path: Path
) -> None:
    """The folder does what the last line of the command says, with any model by that name."""
    model = shutil.copytree(path, tmp_path / "tiny")
    tables: list[list[Any]] = []
    for name, adapter in (("with", finished.folder), ("without", "none")):
        out = tmp_path / f"{name}.jsonl"
        options = ["--out", out, "--model", model, "--adapter", adapter, "--layout", "goal-first"]
        result = run("infer", rows, *options)
        assert result.exit_code == 0, result.output
        lines = map(json.loads, out.read_text().splitlines())
        tables.append([line["log_likelihood"] for line in lines])
    said = fails(
        2, "infer", rows, "--out", tmp_path / "x", *options[2:4], "--adapter", finished.folder
    )
    assert "fitted with the layout goal-first, not goal-last. Give --layout goal-first" in said
    expected = [
        list(row)
        for each in finished.sources[0].cases
        for row in RolePlay(finished.model, layout="goal-first").log_likelihood(
            each.task, each.goals, each.turns
        )
    ]
    np.testing.assert_allclose(tables[0], expected, atol=0.03)
    assert np.abs(np.array(tables[1]) - expected).max() > 0.5
