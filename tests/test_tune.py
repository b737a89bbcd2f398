"""Tuning: what is measured is kept, used, and never loses more than the file itself does."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from goalscope.models import tune as tuning
from goalscope.models.llamacpp import LlamaCpp, embedded_path
from goalscope.models.native import Running
from goalscope.models.tune import Trial, Tuning, kept_tunings, tune, tuned


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache folder, in which tuning is on."""
    monkeypatch.setattr("platformdirs.user_cache_path", lambda _: tmp_path)
    monkeypatch.delenv("GOALSCOPE_TUNE", raising=False)
    return tmp_path / "tuned"


def never(*_: object) -> None:
    raise AssertionError("it measured again")


def keep(monkeypatch: pytest.MonkeyPatch, running: Running, trials: list[Trial]) -> Tuning:
    """Tune the embedded file with the outcome of the measurements given beforehand."""

    def types(source: Path, into: Path, *_: object) -> tuple[dict[str, Path], list[Trial]]:
        files = {trials[0].weights: source}
        for trial in trials[1:]:
            files[trial.weights] = into / f"{trial.weights}.gguf"
            files[trial.weights].write_bytes(b"GGUF")
        return files, trials

    with monkeypatch.context() as patch:
        patch.setattr(tuning, "_try_types", types)
        patch.setattr(tuning, "_try_settings", lambda *_: running)
        return tune(embedded_path(), 2)


def test_a_real_tuning_is_as_exact_as_the_file_and_is_kept(folder: Path) -> None:
    steps: list[float] = []
    first = tuned(embedded_path(), 1, lambda _, share: steps.append(share))
    assert steps == sorted(steps)
    assert (steps[0], steps[-1]) == (0.0, 1.0)
    own, chosen = first.trials[0], first.chosen
    assert {trial.weights for trial in first.trials} == {"Q4_1", "BF16", "F16", "Q8_0"}
    assert chosen is not None
    assert chosen.error <= own.error + 0.002
    assert chosen.speed >= own.speed
    assert all(trial.error < 0.2 for trial in first.trials)
    assert tuned(embedded_path(), 1, never) == first
    assert kept_tunings() == [first]
    assert sorted(folder.iterdir()) == sorted(
        {*folder.glob("*.json"), *([first.path] if first.path != embedded_path() else [])}
    )
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
    assert [file.suffix for file in folder.iterdir()] == [".json"]


def test_no_more_threads_are_used_than_now_allowed(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep(monkeypatch, Running(2, 256), [Trial("Q4_1", 400, 0.06)])
    assert tuned(embedded_path(), 1, never).running == Running(1, 256)


def test_a_lost_copy_or_a_broken_record_is_measured_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = keep(monkeypatch, Running(2), [Trial("Q4_1", 400, 0.06), Trial("BF16", 700, 0.01)])
    kept.path.unlink()
    with pytest.raises(AssertionError, match="measured again"):
        tuned(embedded_path(), 2, never)
    keep(monkeypatch, Running(2), [Trial("Q4_1", 400, 0.06)])
    (record,) = folder.glob("*.json")
    for text in ("", "[]", "{}", json.dumps({"source": 1})):
        record.write_text(text)
        with pytest.raises(AssertionError, match="measured again"):
            tuned(embedded_path(), 2, never)


def test_another_processor_or_a_changed_file_is_measured_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep(monkeypatch, Running(2), [Trial("Q4_1", 400, 0.06)])
    monkeypatch.setattr(tuning, "processor", lambda: "another one")
    with pytest.raises(AssertionError, match="measured again"):
        tuned(embedded_path(), 2, never)


def test_tuning_can_be_turned_off(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GOALSCOPE_TUNE", "0")
    assert tuned(embedded_path(), 2, never) == Tuning(embedded_path(), embedded_path(), Running(2))
    assert not folder.exists()


def test_a_folder_that_cannot_be_written_is_no_hindrance(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.parent.joinpath("tuned").write_text("a file in the way")
    assert tuned(embedded_path(), 2).path == embedded_path()
