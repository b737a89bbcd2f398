"""Copies of weights: an adapter in one says what it says beside them, and memory stays small."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import gguf
import numpy as np
import pytest

from goalscope.agent.writer import goals_prompt, needs_prompt
from goalscope.base.types import ModelError
from goalscope.models import Message
from goalscope.models.adapters import shipped
from goalscope.models.llama.copies import merged, requantize
from goalscope.models.llama.model import LlamaCpp, embedded_path
from test_model_contract import CONTEXTS, REPLIES
from test_policy import HELLO

WRITER = shipped("writer")
assert WRITER is not None
PROMPTS = (
    needs_prompt("bake a chocolate cake", "I want to bake a chocolate cake.", []),
    goals_prompt("You sell groceries.", HELLO),
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return merged(embedded_path(), WRITER, tmp_path_factory.mktemp("merged"))


def test_a_merged_model_writes_and_scores_as_with_its_adapter_at_run_time(
    whole: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GOALSCOPE_TUNE", "0")
    beside, within = LlamaCpp(embedded_path(), adapter=WRITER), LlamaCpp(whole)
    plain = LlamaCpp(embedded_path())
    one, other, without = (
        np.concatenate(each.token_logprobs(CONTEXTS, REPLIES, end_of_turn=True))
        for each in (beside, within, plain)
    )
    assert np.abs(one - other).mean() < 0.1 * np.abs(one - without).mean()
    for prompt in PROMPTS:
        texts = [each.generate(prompt, max_tokens=24).text for each in (beside, within)]
        assert texts[0].split("\n")[0].split(", ")[:2] == texts[1].split("\n")[0].split(", ")[:2]
    for each in (beside, within, plain):
        each.close()


def test_a_copy_is_made_once_and_nothing_else_is_left(whole: Path) -> None:
    before = whole.stat()
    assert merged(embedded_path(), WRITER, whole.parent) == whole
    assert whole.stat().st_mtime_ns == before.st_mtime_ns
    assert {each.name for each in whole.parent.iterdir()} <= {whole.name, ".merge-lock"}


def written(path: Path, tensors: dict[str, np.ndarray]) -> Path:
    """A GGUF file of these tensors."""
    writer = gguf.GGUFWriter(path, "llama")
    writer.add_float32("adapter.lora.alpha", 1.0)
    for name, tensor in tensors.items():
        writer.add_tensor(name, tensor)
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()
    return path


def test_no_copy_is_in_memory_as_a_whole(tmp_path: Path) -> None:
    weights = np.ones((512, 512), np.float32)
    source = written(tmp_path / "half.gguf", {f"blk.{n}.w": weights for n in range(40)})
    tracemalloc.start()
    requantize(source, tmp_path / "exact.gguf", "F32")
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < source.stat().st_size / 4


def broken(tmp_path: Path) -> dict[str, Path]:
    """Files that are no adapters for the embedded model."""
    content = WRITER.read_bytes()
    found = {
        "words": b"no GGUF file at all",
        "empty": b"",
        "cut": content[:100_000],
        "head": content[:2_000],
        "half": content[: len(content) // 2],
    }
    for name, data in found.items():
        (tmp_path / name).write_bytes(data)
    return {name: tmp_path / name for name in found} | {"model": embedded_path()}


@pytest.mark.parametrize("kind", ["words", "empty", "cut", "head", "half", "model"])
def test_a_broken_adapter_is_refused_and_leaves_nothing(tmp_path: Path, kind: str) -> None:
    folder = tmp_path / "kept"
    folder.mkdir()
    with pytest.raises(ModelError, match="cannot be merged"):
        merged(embedded_path(), broken(tmp_path)[kind], folder)
    assert {each.name for each in folder.iterdir()} <= {".merge-lock"}


@pytest.mark.parametrize("name", ["blk.99.attn_q.weight", "blk.0.attn_norm.weight"])
def test_an_adapter_with_a_part_that_cannot_be_added_is_refused(tmp_path: Path, name: str) -> None:
    parts = {f"{name}.lora_{letter}": np.ones((4, 4), np.float32) for letter in "ab"}
    adapter = written(tmp_path / "adapter.gguf", parts)
    with pytest.raises(ModelError, match=f"nothing can be added to {name}"):
        merged(embedded_path(), adapter, tmp_path)
    assert not [*tmp_path.glob("*-with-*")]


def test_where_there_is_no_room_no_copy_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = type("Usage", (), {"free": 1})
    monkeypatch.setattr("goalscope.models.llama.copies.shutil.disk_usage", lambda _: usage)
    with pytest.raises(OSError, match="Not enough free space"):
        merged(embedded_path(), WRITER, tmp_path)


def test_a_file_that_was_not_tuned_here_runs_with_its_adapter_beside_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("GOALSCOPE_TUNE", "0")
    one, other = (LlamaCpp(adapter=WRITER, merge=merge) for merge in (False, True))
    assert one.path == other.path == embedded_path()
    texts = [each.generate(PROMPTS[0], max_tokens=16).text for each in (one, other)]
    assert texts[0] == texts[1]
    for each in (one, other):
        each.close()


def test_a_merge_that_fails_falls_back_to_the_adapter_at_run_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tuning = LlamaCpp().tuning
    if tuning.path == tuning.source:
        pytest.skip("the embedded model is run as it is here")

    def fails(*_: object) -> Path:
        raise ModelError("no")

    monkeypatch.setattr("goalscope.models.llama.model.merged", fails)
    one, other = (LlamaCpp(adapter=WRITER, merge=merge) for merge in (False, True))
    chat = [Message("user", "Hi")]
    scores = [each.token_logprobs([chat], ["Tea."])[0] for each in (one, other)]
    np.testing.assert_array_equal(*scores)
    for each in (one, other):
        each.close()
    with pytest.raises(ModelError, match="not an adapter for"):
        LlamaCpp(adapter=broken(tmp_path)["words"], merge=True)
