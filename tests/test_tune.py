"""Tuning: what is measured is kept, used, and never loses more than the file itself does."""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from filelock import FileLock

from goalscope.base.types import ModelError
from goalscope.models.llama import tune as tuning
from goalscope.models.llama.engine import NATIVE
from goalscope.models.llama.model import LlamaCpp, embedded_path
from goalscope.models.llama.native import Running
from goalscope.models.llama.tune import Trial, Tuning, kept_tunings, split_files, tune, tuned


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache folder, in which tuning is on."""
    monkeypatch.setattr("platformdirs.user_cache_path", lambda _: tmp_path)
    monkeypatch.delenv("GOALSCOPE_TUNE", raising=False)
    return tmp_path / "tuned"


BF16 = [Trial("Q4_1", 400, 0.06), Trial("BF16", 800, 0.01)]


def never(*_: object) -> None:
    raise AssertionError("it measured again")


def measured_again(file: Path, threads: int = 2) -> bool:
    """Whether a file is measured, as if nothing were kept of it."""
    try:
        tuned(file, threads, never)
    except AssertionError:
        return True
    return False


def keep(
    monkeypatch: pytest.MonkeyPatch,
    running: Running,
    trials: list[Trial],
    file: Path | None = None,
    report: tuning.Report | None = None,
) -> Tuning:
    """Tune a file, else the embedded one, with the outcome of the measurements given."""

    def types(source: Path, into: Path, *_: object) -> tuple[dict[str, Path], list[Trial]]:
        files = {trials[0].weights: source}
        for trial in trials[1:]:
            files[trial.weights] = into / f"{trial.weights}.gguf"
            files[trial.weights].write_bytes(b"GGUF")
        return files, trials

    with monkeypatch.context() as patch:
        patch.setattr(tuning, "_try_types", types)
        patch.setattr(tuning, "_try_threads", lambda *_: running)
        return tune(file or embedded_path(), 2, report)


@pytest.mark.slow
def test_a_real_tuning_is_as_exact_as_the_file_and_is_kept(folder: Path) -> None:
    steps: list[float] = []
    first = tuned(embedded_path(), 1, lambda _, share: steps.append(share))
    assert steps == sorted(steps)
    assert (steps[0], steps[-1]) == (0.0, 1.0)
    assert {trial.weights for trial in first.trials} == {"Q4_1", "BF16", "F16", "Q8_0"}
    assert first.chosen in first.trials
    assert all(trial.error < 0.2 for trial in first.trials)
    assert tuned(embedded_path(), 1, never) == first
    assert kept_tunings() == [first]
    assert {file.suffix for file in folder.iterdir()} <= {".json", ".gguf", ""}  # and the lock
    model = LlamaCpp(threads=1)
    assert model.path == first.path
    assert model.self_test().passed
    assert "tuned" in model.describe()
    model.close()


def test_a_faster_type_that_loses_too_much_is_left_out(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trials = [Trial("Q4_1", 400, 0.06), Trial("BF16", 700, 0.01), Trial("Q8_0", 900, 0.08)]
    result = keep(monkeypatch, Running(2), trials)
    assert result.chosen == trials[1]
    assert result.path.name.endswith("-BF16.gguf")


def test_the_file_itself_is_used_where_nothing_is_faster(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = keep(monkeypatch, Running(2), [Trial("Q4_1", 400, 0.06), Trial("BF16", 300, 0.01)])
    assert result.path == embedded_path()
    assert [file.suffix for file in folder.glob("[!.]*")] == [".json"]


def test_other_threads_are_measured_by_themselves(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep(monkeypatch, Running(2, 256), [Trial("Q4_1", 400, 0.06)])
    assert measured_again(embedded_path(), 1)


def test_a_lost_copy_or_a_broken_record_is_measured_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = keep(monkeypatch, Running(2), [Trial("Q4_1", 400, 0.06), Trial("BF16", 700, 0.01)])
    kept.path.unlink()
    assert measured_again(embedded_path())
    keep(monkeypatch, Running(2), [Trial("Q4_1", 400, 0.06)])
    (record,) = folder.glob("*.json")
    for text in ("", "[]", "{}", json.dumps({"source": 1})):
        record.write_text(text)
        assert measured_again(embedded_path())


def test_another_processor_or_a_changed_file_is_measured_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = folder.parent / "model.gguf"
    shutil.copy(embedded_path(), copy)
    keep(monkeypatch, Running(2), [Trial("Q4_1", 400, 0.06)], copy)
    assert tuned(copy, 2, never).trials
    with monkeypatch.context() as patch:
        patch.setattr(tuning, "processor", lambda: "another one")
        assert measured_again(copy)
    with copy.open("r+b") as file:
        file.seek(-1, os.SEEK_END)
        file.write(b"x")
    os.utime(copy, ns=(1, 1))
    assert kept_tunings() == []
    assert measured_again(copy)


def test_a_file_of_the_same_content_is_tuned_already(
    folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    first = keep(monkeypatch, Running(2), BF16)
    copy = tmp_path / "copy.gguf"
    shutil.copy(embedded_path(), copy)
    assert tuned(copy, 2, never) == replace(first, source=copy)
    monkeypatch.setattr(tuning, "_digest", never)  # which reads it all
    assert tuned(copy, 2, never).path == first.path
    assert {each.source for each in kept_tunings()} == {embedded_path().resolve(), copy}
    assert [*folder.glob("*.gguf")] == [first.path]


def test_what_was_kept_for_a_file_goes_once_the_file_is_gone(
    folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    other = tmp_path / "other-with-more.gguf"
    other.write_bytes(embedded_path().read_bytes() + b"more")
    for file in (other, None):
        kept = keep(monkeypatch, Running(2), BF16, file)
        kept.path.with_name(f"{kept.path.stem}-with-0123.gguf").touch()
    assert names(folder) == {("other", 3), ("SmolLM2", 3)}
    other.unlink()
    kept = keep(monkeypatch, Running(2), BF16)
    assert names(folder) == {("SmolLM2", 3)}
    assert kept.path.is_file()


def test_what_was_kept_for_another_version_of_the_engine_goes(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    this = tuning.engine()
    q8 = [Trial("Q4_1", 400, 0.06), Trial("Q8_0", 900, 0.06)]
    old, other = (
        replace(this, version="0.0.1"),
        replace(this, package=replace(NATIVE, name="other")),
    )
    for each, trials in ((old, q8), (other, [q8[0], Trial("F16", 900, 0.0)]), (this, BF16)):
        monkeypatch.setattr(tuning, "engine", lambda each=each: each)
        keep(monkeypatch, Running(2), trials)
    assert len([*folder.glob("*.json")]) == 2  # of the other engine, and of this version
    assert {each.stem.rpartition("-")[2] for each in folder.glob("*.gguf")} == {"F16", "BF16"}


def names(folder: Path) -> set[tuple[str, int]]:
    """How many files there are for each model."""
    found = [each.name.partition("-")[0] for each in folder.iterdir() if each.suffix]
    return {(name, found.count(name)) for name in found}


def test_only_what_nobody_reports_is_logged(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    trials = [Trial("Q4_1", 400, 0.06)]
    keep(monkeypatch, Running(2), trials, report=lambda *_: None)
    assert not caplog.records
    keep(monkeypatch, Running(2), trials)
    (record,) = caplog.records
    assert embedded_path().name in record.getMessage()
    assert "up to a minute" in record.getMessage()
    tuned(embedded_path(), 2)
    assert len(caplog.records) == 1


def test_a_file_is_known_by_its_real_place(
    folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    link = tmp_path / "current.gguf"
    link.symlink_to(embedded_path())
    keep(monkeypatch, Running(2), [Trial("Q4_1", 400, 0.06)], link)
    link.unlink()
    other = tmp_path / "other.gguf"
    other.write_bytes(embedded_path().read_bytes() + b"more")
    link.symlink_to(other)
    assert measured_again(link)


def test_two_first_uses_do_not_measure_at_once(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.mkdir()
    left = folder / ".tune-of-a-killed-process"
    left.mkdir()
    with FileLock(folder / ".lock"):
        assert tuned(embedded_path(), 2, never).trials == ()
    keep(monkeypatch, Running(2), [Trial("Q4_1", 400, 0.06)])
    assert not left.exists()


def test_a_file_that_cannot_be_tuned_is_run_as_it_is(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ModelError("could not be converted")

    monkeypatch.setattr(tuning, "requantize", fail)
    assert tuned(embedded_path(), 2).trials == ()


@pytest.mark.parametrize("content", [b"", b"GGU", b"GGUF", b"import sys", 100_000, 10_000_000])
def test_a_broken_file_is_one_clear_line_and_no_minute_of_work_is_announced(
    folder: Path,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    capfd: pytest.CaptureFixture[str],
    content: bytes | int,
) -> None:
    file = tmp_path / "broken.gguf"
    with embedded_path().open("rb") as whole:
        file.write_bytes(whole.read(content) if isinstance(content, int) else content)
    with pytest.raises(ModelError, match="not a complete GGUF model") as caught:
        LlamaCpp(file)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")
    assert not caplog.records


def test_a_split_model_is_all_its_files() -> None:
    names = [f"m-0000{i}-of-00003.gguf" for i in (1, 2, 3)]
    assert split_files(Path(names[0])) == [Path(name) for name in names]
    assert split_files(Path("m-of-3.gguf")) == [Path("m-of-3.gguf")]


def test_tuning_can_be_turned_off(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GOALSCOPE_TUNE", "0")
    plain = Tuning(embedded_path(), embedded_path(), 2, Running(2))
    assert tuned(embedded_path(), 2, never) == plain
    assert not folder.exists()


def test_a_folder_that_cannot_be_written_is_no_hindrance(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.parent.joinpath("tuned").write_text("a file in the way")
    assert tuned(embedded_path(), 2).trials == ()
