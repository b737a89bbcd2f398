"""LoRA adapters: llama.cpp and Transformers apply them alike, and only scoring is changed."""

from __future__ import annotations

import json
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from commands import run
from goalscope.base.types import Message, ModelError
from goalscope.belief.likelihood import RolePlay
from goalscope.models import opening
from goalscope.models.adapters import (
    ARCHITECTURES,
    MODULES,
    Adapter,
    _interleaved,
    adapter_file,
    read_adapter,
    write_adapter,
)
from goalscope.models.llama.model import LlamaCpp, embedded_path
from goalscope.models.llama.trie import Trie
from goalscope.models.llama.weights import KVCache, Weights
from goalscope.models.opening import open_model
from goalscope.models.torch.model import Transformers
from test_model_contract import CONTEXTS, REPLIES, TOLERANCE, sums
from test_transformers import ARCHITECTURES as KINDS
from test_transformers import SMALL, tiny

gguf = pytest.importorskip("gguf")
torch = pytest.importorskip("torch")
transformers = pytest.importorskip("transformers")

METADATA = {"general.name": "Mine", "goalscope.data": "10 dialogues", "other.key": "x"}
EMBEDDED = {
    "hidden_size": 576,
    "intermediate_size": 1536,
    "num_hidden_layers": 30,
    "num_attention_heads": 9,
    "num_key_value_heads": 3,
}


def config_of(kind: str, **changes: Any) -> Any:
    """The configuration of a small model, or of the one that the changes make of it."""
    settings = {**SMALL, **KINDS[kind][1], **changes}
    return transformers.AutoConfig.for_model(kind, **settings)


def random_adapter(config: Any, size: float, rank: int = 4) -> Adapter:
    """Random weights for all layers that can be adapted; `size` is that of what they add."""
    random = np.random.default_rng(0)
    wide = config.num_attention_heads * config.head_dim
    narrow = config.num_key_value_heads * config.head_dim
    hidden, inner = config.hidden_size, config.intermediate_size
    shapes = {
        "q_proj": (wide, hidden),
        "k_proj": (narrow, hidden),
        "v_proj": (narrow, hidden),
        "o_proj": (hidden, wide),
        "gate_proj": (inner, hidden),
        "up_proj": (inner, hidden),
        "down_proj": (hidden, inner),
    }
    assert set(shapes) == set(MODULES)
    layers = {
        (layer, name): (
            random.normal(0, 1 / many**0.5, (rank, many)).astype(np.float32),
            random.normal(0, size, (out, rank)).astype(np.float32),
        )
        for layer in range(config.num_hidden_layers)
        for name, (out, many) in shapes.items()
    }
    return Adapter(layers, rank, 2.0 * rank, METADATA)


def gguf_file(model: Any, path: Path) -> Path:
    """The weights of a model of Transformers as a GGUF file without a tokenizer."""
    config, kind = model.config, ARCHITECTURES[model.config.model_type]
    writer = gguf.GGUFWriter(path, kind)
    writer.add_context_length(config.max_position_embeddings)
    writer.add_embedding_length(config.hidden_size)
    writer.add_block_count(config.num_hidden_layers)
    writer.add_feed_forward_length(config.intermediate_size)
    writer.add_head_count(config.num_attention_heads)
    writer.add_head_count_kv(config.num_key_value_heads)
    writer.add_key_length(config.head_dim)
    writer.add_value_length(config.head_dim)
    writer.add_rope_dimension_count(config.head_dim)
    writer.add_rope_freq_base(config.rope_parameters["rope_theta"])
    writer.add_layer_norm_rms_eps(config.rms_norm_eps)
    writer.add_vocab_size(config.vocab_size)
    writer.add_tokenizer_model("no_vocab")
    architecture = next(key for key, name in gguf.MODEL_ARCH_NAMES.items() if name == kind)
    names = gguf.get_tensor_name_map(architecture, config.num_hidden_layers)
    heads = {"q_proj": config.num_attention_heads, "k_proj": config.num_key_value_heads}
    for name, weight in model.state_dict().items():
        value = weight.float().numpy()
        turned = next((heads[each] for each in heads if f"{each}.weight" in name), None)
        value = _interleaved(value, turned if kind == "llama" else None)
        own = names.get_name(name, try_suffixes=(".weight", ".bias"))
        writer.add_tensor(own, np.ascontiguousarray(value))
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()
    return path


@pytest.fixture(scope="module")
def mine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an adapter for the embedded model."""
    folder = tmp_path_factory.mktemp("adapters") / "mine"
    folder.mkdir()
    config = transformers.LlamaConfig(**EMBEDDED)
    write_adapter(folder / "adapter.gguf", random_adapter(config, 0.1), config)
    return folder


def test_both_engines_apply_an_adapter_alike(exact_gguf: Path, mine: Path, model: LlamaCpp) -> None:
    file = mine / "adapter.gguf"
    theirs = LlamaCpp(exact_gguf, adapter=file)
    ours = Transformers(exact_gguf, adapter=file, device="cpu", dtype="float32")
    before, found, other = (
        each.token_logprobs(CONTEXTS, REPLIES) for each in (model, theirs, ours)
    )
    np.testing.assert_allclose(np.concatenate(other), np.concatenate(found), atol=0.01)
    assert np.abs(np.concatenate(found) - np.concatenate(before)).mean() > 0.1
    for each in (theirs, ours):
        assert str(file) in each.describe()
        assert each.adapter == file
        assert METADATA.items() <= dict(each.adapter_metadata).items()
        each.close()
    assert (model.adapter, model.adapter_metadata) == (None, {})


@pytest.mark.parametrize("kind", ["llama", "qwen2", "qwen3"])
def test_rows_stand_in_the_order_of_the_architecture(tmp_path: Path, kind: str) -> None:
    folder = tiny(tmp_path / "model", kind)
    plain = Transformers(folder, device="cpu")
    config = plain.network.model.config
    file = tmp_path / "adapter.gguf"
    write_adapter(file, random_adapter(config, 0.5), config)
    adapted = Transformers(folder, adapter=file, device="cpu")
    source = gguf_file(plain.network.model, tmp_path / "model.gguf")
    tokens = np.random.default_rng(1).integers(10, 300, 40).tolist()
    trie = Trie()
    trie.add(tokens)
    results = []
    for model in (plain, adapted):
        weights, rows = Weights(source), np.zeros((len(tokens), config.vocab_size))
        cache = KVCache(weights, 1, file if model is adapted else None)
        cache.load(trie, set(range(len(tokens))), rows.__setitem__)
        cache.free()
        weights.free()
        expected = model.network.read(tokens, range(len(tokens))).numpy()
        assert np.linalg.norm(rows - expected) < 0.02 * np.linalg.norm(expected)
        results.append(rows)
    assert np.linalg.norm(results[1] - results[0]) > 0.2 * np.linalg.norm(results[0])
    assert adapted.fingerprint != plain.fingerprint


@pytest.mark.parametrize("head", [8, 16])
def test_a_cached_token_takes_what_the_files_own_head_size_says(tmp_path: Path, head: int) -> None:
    plain = Transformers(tiny(tmp_path / "model", "qwen3", head_dim=head), device="cpu")
    weights = Weights(gguf_file(plain.network.model, tmp_path / "model.gguf"))
    layers, heads = SMALL["num_hidden_layers"], SMALL["num_key_value_heads"]
    assert weights.kv_bytes == layers * heads * (head + head) * 2  # F16, as the file says no type
    weights.free()


@pytest.mark.parametrize(
    ("kind", "rank", "apart"),
    [*((each, 4, 1e-5) for each in ARCHITECTURES), ("llama", 32, 1 / 250)],
)
def test_what_is_written_is_read(tmp_path: Path, kind: str, rank: int, apart: float) -> None:
    config = config_of(kind)
    adapter = random_adapter(config, 0.1, rank)
    write_adapter(tmp_path / "adapter.gguf", adapter, config)
    found = read_adapter(tmp_path / "adapter.gguf", config)
    assert (found.rank, found.alpha) == (adapter.rank, adapter.alpha)
    assert METADATA.items() <= dict(found.metadata).items()
    assert set(found.layers) == set(adapter.layers)
    for place, pair in adapter.layers.items():
        for one, other in zip(found.layers[place], pair, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-3, atol=apart * np.abs(one).max())


def test_only_what_people_say_is_scored_with_it(mine: Path, model: LlamaCpp) -> None:
    both = open_model(adapter=mine)
    writer, scorer = both.generator, both.speaker
    assert (writer.adapter, scorer.adapter) == (None, mine / "adapter.gguf")
    chat = [Message("user", "Name three things to eat for breakfast.")]
    text = both.generate(chat, max_tokens=20).text
    with closing(open_model(adapter="none")) as plain:  # as cold: what is cached moves a rounding
        assert text == plain.generate(chat, max_tokens=20).text
    usual = sums(model, CONTEXTS, REPLIES)
    assert np.abs(sums(both.speaker, CONTEXTS, REPLIES) - usual).max() > 0.5
    assert RolePlay(both).model is both.speaker
    np.testing.assert_allclose(sums(both, CONTEXTS, REPLIES), usual, atol=TOLERANCE)
    assert both.name == model.name
    assert both.writer is not None
    assert both.fingerprint == " ".join(model.fingerprint for model in both.roles)
    assert f"; proposes, plans and asks: {both.writer.describe()}" in both.describe()
    assert f"; scores what people say: {scorer.describe()}" in both.describe()
    both.close()


def test_transformers_writes_without_it_too(tmp_path: Path) -> None:
    folder = tiny(tmp_path / "model", "llama")
    config = config_of("llama")
    write_adapter(tmp_path / "adapter.gguf", random_adapter(config, 0.5), config)
    plain, both = open_model(folder), open_model(folder, adapter=tmp_path)
    chat = [Message("user", "Hi")]
    assert both.generate(chat, max_tokens=8).text == plain.generate(chat, max_tokens=8).text
    found, before = (each.token_logprobs([chat], ["Tea."])[0] for each in (both.speaker, plain))
    assert np.abs(found - before).max() > 0.1


def test_the_shipped_one_is_for_the_embedded_scorer_alone(
    mine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        opening,
        "shipped",
        lambda name="general": mine / "adapter.gguf" if name == "general" else None,
    )
    for names, adapter in (
        ({}, mine / "adapter.gguf"),
        ({"generator": embedded_path()}, mine / "adapter.gguf"),
        ({"adapter": "none"}, None),
        ({"model": embedded_path()}, None),
        ({"scorer": embedded_path()}, None),
    ):
        opened = open_model(**names)
        writer, scorer = opened.generator, opened.speaker
        assert (writer.adapter, scorer.adapter) == (None, adapter)
        opened.close()


def test_what_is_no_adapter_for_a_model_is_refused(
    mine: Path, tmp_path: Path, model: LlamaCpp, capfd: pytest.CaptureFixture[str]
) -> None:
    other, small = tmp_path / "qwen2.gguf", tmp_path / "small.gguf"
    qwen2, llama = config_of("qwen2"), config_of("llama")
    write_adapter(other, random_adapter(qwen2, 0.1), qwen2)
    write_adapter(small, random_adapter(llama, 0.1), llama)
    words, cut = tmp_path / "words.gguf", tmp_path / "cut.gguf"
    words.write_text("no GGUF file at all")
    cut.write_bytes((mine / "adapter.gguf").read_bytes()[:100_000])
    for file in (other, small, words, cut, model.path):
        with pytest.raises(ModelError, match="not an adapter for") as caught:
            LlamaCpp(adapter=file)
        assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")
    folder = tiny(tmp_path / "model", "llama")
    deep = tmp_path / "deep.gguf"
    adapter = random_adapter(llama, 0.1)
    layers = {(9, "q_proj"): adapter.layers[0, "q_proj"]}
    write_adapter(deep, replace(adapter, layers=layers), llama)
    empty = tmp_path / "empty.gguf"
    write_adapter(empty, replace(adapter, layers={}), llama)
    wide = tmp_path / "wide.gguf"
    config = config_of("llama", intermediate_size=64)
    write_adapter(wide, random_adapter(config, 0.1), config)
    odd = tmp_path / "odd.gguf"
    config = config_of("llama", num_attention_heads=2, num_key_value_heads=1, head_dim=10)
    write_adapter(odd, random_adapter(config, 0.1), config)
    uneven, scaleless = tmp_path / "uneven.gguf", tmp_path / "scaleless.gguf"
    a, b = adapter.layers[0, "o_proj"]
    layers = {**adapter.layers, (0, "o_proj"): (np.vstack([a, a]), np.hstack([b, b]))}
    write_adapter(uneven, replace(adapter, layers=layers), llama)
    write_adapter(scaleless, replace(adapter, alpha=0.0), llama)
    endless, flat = tmp_path / "endless.gguf", tmp_path / "flat.gguf"
    write_adapter(endless, replace(adapter, alpha=float("nan")), llama)
    write_adapter(flat, replace(adapter, layers={(0, "o_proj"): (a[None], b[None])}), llama)
    for file, cause in (
        (uneven, "different ranks, or no scale"),
        (scaleless, "different ranks, or no scale"),
        (endless, "different ranks, or no scale"),
        (flat, "changes blk.0.attn_output.weight.lora_a, which goalscope cannot adapt"),
        (other, "not a LoRA adapter for llama"),
        (words, "not a complete GGUF file"),
        (cut, "not a complete GGUF file"),
        (model.path, "not a LoRA adapter"),
        (deep, "layer 9, where the model has none"),
        (empty, "lacks weights"),
        (mine / "adapter.gguf", "576 x 576 weights in layer 0, where the model has one of 32 x 32"),
        (odd, "of another size"),
        (wide, "64 x 32 weights in layer 0, where the model has one of 48 x 32"),
    ):
        with pytest.raises(ModelError, match=cause):
            Transformers(folder, adapter=file, device="cpu")


def test_a_missing_adapter_is_named(tmp_path: Path) -> None:
    for name in (tmp_path, tmp_path / "no.gguf"):
        for call in (adapter_file, lambda name: open_model(adapter=name)):
            with pytest.raises(ModelError, match=f"no adapter at {name}"):
                call(name)


def test_the_command_line_shows_it(
    mine: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "episodes.db"))
    monkeypatch.chdir(mine.parent)
    shown = [str(mine / "adapter.gguf"), "general.name: Mine", "goalscope.data: 10 dialogues"]
    report = json.loads(run("doctor", "--adapter", "mine", "--json").stdout)
    assert report["adapter"] == shown, report["problems"]
    told = run("models", "check", "--adapter", "mine").stdout.splitlines()
    assert [line[36:] for line in told if line[36:] in shown] == shown
    told = run("models", "check", "--adapter", "none").stdout.splitlines()
    assert [line.split() for line in told if line.startswith("adapter")] == [["adapter", "none"]]
    failed = run("models", "check", "--adapter", "yours")
    assert "There is no adapter at" in failed.stderr
