"""Hugging Face models: tokenizers, trees of tokens for any architecture, too little memory."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from goalscope.base.types import Message, ModelError
from goalscope.models.hf_tokenizer import chat_tokenizer
from goalscope.models.llama.model import LlamaCpp, embedded_path
from goalscope.models.llama.trie import Trie
from goalscope.models.scoring import Pair
from goalscope.models.torch.model import Transformers
from goalscope.models.torch.packing import batches, pack

torch = pytest.importorskip("torch")
transformers = pytest.importorskip("transformers")
tokenizers = pytest.importorskip("tokenizers")

CHATML = (
    "{% for m in messages %}<|im_start|>{{ m.role }}\n{{ m.content }}<|im_end|>\n{% endfor %}"
    "{% if add_generation_prompt %}<|im_start|>assistant\n{% endif %}"
)
GEMMA = (
    "{{ bos_token }}{% if messages[0].role == 'system' %}{{ raise_exception('no system') }}"
    "{% endif %}{% for m in messages %}{% if (m.role == 'user') != (loop.index0 % 2 == 0) %}"
    "{{ raise_exception('roles must alternate') }}{% endif %}"
    "<|im_start|>{{ 'model' if m.role == 'assistant' else m.role }}\n{{ m.content | trim }}"
    "<|im_end|>\n{% endfor %}{% if add_generation_prompt %}<|im_start|>model\n{% endif %}"
)
MISTRAL = (
    "{{ bos_token }}{% for m in messages %}{% if m.role == 'user' %}[INST] {{ m.content }} [/INST]"
    "{% elif m.role == 'assistant' %} {{ m.content }}{{ eos_token }}"
    "{% else %}{{ raise_exception('Only user and assistant roles') }}{% endif %}{% endfor %}"
)
SMALL = {
    "vocab_size": 320,
    "hidden_size": 32,
    "intermediate_size": 48,
    "num_hidden_layers": 2,
    "num_attention_heads": 4,
    "num_key_value_heads": 2,
    "head_dim": 8,
    "max_position_embeddings": 256,
    "initializer_range": 0.3,  # so that a token's context matters
    "bos_token_id": 0,
    "eos_token_id": 1,
    "pad_token_id": 1,
}
ARCHITECTURES: dict[str, tuple[bool, dict[str, Any]]] = {
    "llama": (True, {}),
    "qwen2": (True, {}),
    "qwen3": (True, {}),
    "mistral": (True, {"sliding_window": 8}),
    "gemma2": (True, {"sliding_window": 8, "query_pre_attn_scalar": 8}),
    "gemma3_text": (True, {"sliding_window": 8, "query_pre_attn_scalar": 8}),
    "granite": (True, {"logits_scaling": 4.0, "attention_multiplier": 0.2}),
    "cohere": (True, {}),
    "gpt_neox": (True, {"num_key_value_heads": None}),
    "gpt2": (True, {"n_embd": 32, "n_layer": 2, "n_head": 4, "n_positions": 256}),
    "bloom": (False, {"n_layer": 2, "n_head": 4}),
    "lfm2": (False, {"layer_types": ["conv", "full_attention"]}),
}  # the first says whether trees are expected to be followed


def family(seed: int, branches: int = 6, shared: int = 40, own: int = 20) -> list[Pair]:
    """Prompts with one beginning, some with a second one, answers that overlap."""
    random = np.random.default_rng(seed)

    def some(size: int) -> list[int]:
        return random.integers(10, 300, size).tolist()

    start, second, answer = some(shared), some(5), some(7)
    pairs = [
        Pair([*start, *(second if i % 2 else []), *some(own + i)], answer[: 3 + i % 5])
        for i in range(branches)
    ]
    return [*pairs, Pair(start, answer), Pair(start, [*answer, 11])]


def folder(path: Path, template: str | None = CHATML, **config: Any) -> Path:
    """A folder with a byte-level tokenizer, as models have."""
    path.mkdir(parents=True, exist_ok=True)
    alphabet = sorted(tokenizers.pre_tokenizers.ByteLevel.alphabet())
    vocabulary = {token: i for i, token in enumerate(["<s>", "<|im_end|>", *alphabet])}
    tokenizer = tokenizers.Tokenizer(tokenizers.models.BPE(vocabulary, []))
    tokenizer.pre_tokenizer = tokenizers.pre_tokenizers.ByteLevel(add_prefix_space=False)
    tokenizer.decoder = tokenizers.decoders.ByteLevel()
    tokenizer.add_special_tokens(["<s>", "<|im_start|>"])
    tokenizer.add_tokens(["<|im_end|>", "<think>"])  # an end of turn that is not called special
    tokenizer.post_processor = tokenizers.processors.TemplateProcessing(
        single="<s> $A", special_tokens=[("<s>", 0)]
    )
    tokenizer.enable_padding(length=8)
    tokenizer.enable_truncation(4)
    tokenizer.save(str(path / "tokenizer.json"))
    settings = {"bos_token": "<s>", "eos_token": {"content": "<|im_end|>"}, **config}
    if template is not None:
        settings["chat_template"] = template
    (path / "tokenizer_config.json").write_text(json.dumps(settings))
    return path


def tiny(path: Path, kind: str, **changes: Any) -> Path:
    """A folder of a model with random weights."""
    torch.manual_seed(0)
    settings = {**SMALL, **ARCHITECTURES[kind][1], **changes}
    config = transformers.AutoConfig.for_model(kind, **settings)
    transformers.AutoModelForCausalLM.from_config(config).save_pretrained(folder(path))
    return path


def reference(model: Transformers, pairs: list[Pair]) -> list[np.ndarray]:
    """The same by nothing but the model itself, one text at a time."""
    results = []
    for prompt, answer, _ in pairs:
        ids = torch.tensor([[*prompt, *answer]])
        with torch.inference_mode():
            logits = model.network.model(input_ids=ids, use_cache=False).logits[0].double()
        rows = logits.log_softmax(-1)[len(prompt) - 1 : -1]
        results.append(rows[range(len(answer)), answer].numpy())
    return results


def assert_equal(found: list[np.ndarray], expected: list[np.ndarray], atol: float = 1e-3) -> None:
    assert len(found) == len(expected)
    for row, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(row, other, atol=atol)


@pytest.fixture(scope="module")
def llama(tmp_path_factory: pytest.TempPathFactory) -> Transformers:
    return Transformers(tiny(tmp_path_factory.mktemp("llama"), "llama"), device="cpu")


@pytest.mark.parametrize("kind", ARCHITECTURES)
def test_any_architecture_scores_as_it_does_one_text_at_a_time(tmp_path: Path, kind: str) -> None:
    model = Transformers(tiny(tmp_path, kind), device="cpu")
    pairs = family(1)
    expected = reference(model, pairs)
    assert np.ptp([row.sum() for row in expected]) > 1  # so a mix-up could not pass
    for _ in range(2):
        assert_equal(model.score(pairs), expected)
    assert set(model._follows_mask.values()) == {ARCHITECTURES[kind][0]}
    prompt, answer, _ = pairs[0]
    rows = [model.read(prompt, 8), *(model.push(token) for token in answer[:-1])]
    written = [row[t] - np.logaddexp.reduce(row) for row, t in zip(rows, answer, strict=True)]
    np.testing.assert_allclose(written, expected[0], atol=1e-3)


def test_each_distinct_token_is_computed_once(llama: Transformers) -> None:
    pairs = family(2)
    llama.score(pairs)
    llama.clear_cache()
    start = llama.tokens_decoded
    llama.score(pairs)
    paths = {(*p.prompt, *p.answer[:-1]) for p in pairs}
    assert llama.tokens_decoded - start == len({p[:n] for p in paths for n in range(1, len(p) + 1)})


def test_what_a_call_shares_with_recent_ones_is_not_computed_again(llama: Transformers) -> None:
    llama.clear_cache()
    pairs = family(3, own=30)
    first = llama.score(pairs)
    start = llama.tokens_decoded
    assert_equal(llama.score(pairs), first)
    again = llama.tokens_decoded - start
    assert again <= sum(len(p.answer) for p in pairs)
    longer = [Pair([*p.prompt, *p.answer, 17, 18], [19, 20]) for p in pairs]
    start = llama.tokens_decoded
    assert_equal(llama.score(longer), reference(llama, longer))
    assert llama.tokens_decoded - start <= sum(len(p.answer) + 3 for p in pairs)


@pytest.mark.parametrize(("batch", "width"), [(8, 4), (64, 16), (512, 512)])
@pytest.mark.parametrize("cache_bytes", [0, 40_000, 1 << 30])
def test_neither_batches_nor_the_caches_size_change_the_result(
    llama: Transformers, batch: int, width: int, cache_bytes: int
) -> None:
    model = Transformers(llama._model, device="cpu", cache_bytes=cache_bytes)
    model._batch, model._width = batch, width
    for seed in (1, 2, 1):
        pairs = family(seed, branches=9, shared=30)
        assert_equal(model.score(pairs), reference(model, pairs))
        assert model._store.bytes <= cache_bytes / 2


@pytest.mark.parametrize(
    "error",
    [torch.OutOfMemoryError("CUDA out of memory"), RuntimeError("can't allocate memory: 9 bytes")],
)
def test_too_little_memory_means_smaller_batches(
    llama: Transformers, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    model = Transformers(llama._model, device="cpu")
    pairs, forward = family(4), model.network.model.forward
    expected = reference(model, pairs)
    sizes = []

    def limited(*args: Any, input_ids: Any, **rest: Any) -> Any:
        sizes.append(input_ids.numel())
        if input_ids.numel() > 70:
            raise error
        return forward(*args, input_ids=input_ids, **rest)

    monkeypatch.setattr(model.network.model, "forward", limited)
    assert_equal(model.score(pairs), expected)
    assert max(sizes) > 70 >= sizes[-1]
    monkeypatch.setattr(model.network.model, "forward", lambda **_: (_ for _ in ()).throw(error))
    with pytest.raises(ModelError, match="smaller model"):
        model.score(pairs)


def test_other_errors_are_not_taken_for_too_little_memory(
    llama: Transformers, monkeypatch: pytest.MonkeyPatch
) -> None:
    llama.score(family(5))
    monkeypatch.setattr(llama.network, "run", lambda *_: (_ for _ in ()).throw(RuntimeError("x")))
    with pytest.raises(RuntimeError, match="x"):
        llama.score(family(6))


def test_an_interrupted_call_leaves_a_sound_cache(
    llama: Transformers, monkeypatch: pytest.MonkeyPatch
) -> None:
    pairs = family(7)
    expected = llama.score(pairs)
    llama.clear_cache()
    put, calls = llama._store.put, iter(range(1000))

    def interrupted(*args: Any) -> int:
        if next(calls) == 30:
            raise KeyboardInterrupt
        return put(*args)

    with monkeypatch.context() as patch:
        patch.setattr(llama._store, "put", interrupted)
        with pytest.raises(KeyboardInterrupt):
            llama.score(pairs)
    assert_equal(llama.score(pairs), expected)


@pytest.mark.parametrize(("temperature", "seed"), [(0.0, 0), (1.5, 1), (1.5, 2)])
def test_json_follows_its_schema(llama: Transformers, temperature: float, seed: int) -> None:
    schema = {
        "type": "object",
        "properties": {"n": {"enum": ["milk", "é", "🥛"]}, "ok": {"type": "boolean"}},
        "required": ["n", "ok"],
        "additionalProperties": False,
    }
    reply = llama.generate(
        [Message("user", "Hi")], schema=schema, temperature=temperature, seed=seed
    )
    answer = json.loads(reply.text)
    assert answer["n"] in {"milk", "é", "🥛"}
    assert answer["ok"] in {True, False}
    assert reply.finish == "stop"
    with pytest.raises(ModelError, match="cannot be compiled"):
        llama.grammar({"type": "nonsense"})


def test_the_fingerprint_tells_weights_and_types_apart(llama: Transformers, tmp_path: Path) -> None:
    again = Transformers(llama._model, device="cpu")
    assert again.fingerprint == llama.fingerprint
    rounded = Transformers(llama._model, device="cpu", dtype="bfloat16")
    other = Transformers(tiny(tmp_path, "llama", rope_theta=1e3, initializer_range=0.2))
    assert len({llama.fingerprint, rounded.fingerprint, other.fingerprint}) == 3
    turned = tmp_path / "turned"
    shutil.copytree(llama._model, turned)
    config = json.loads((turned / "config.json").read_text())
    config["rope_parameters"] = {"rope_type": "default", "rope_theta": 123.0}
    (turned / "config.json").write_text(json.dumps(config))
    assert Transformers(turned, device="cpu").fingerprint != llama.fingerprint


def test_the_embedded_engine_gives_the_same_log_probabilities(exact_gguf: Path) -> None:
    ours = Transformers(embedded_path(), device="cpu", dtype="float32")
    theirs = LlamaCpp(exact_gguf)
    chats = [
        [Message("system", f"You want {goal}."), Message("user", "What do you need?")]
        for goal in ("milk", "eggs and flour", "a vegan dinner")
    ]
    words = ["Some milk.", "Nothing with meat, please. 🥛", "I do not know <|im_end|> yet."]
    found = ours.token_logprobs(chats, words)
    assert_equal(found, theirs.token_logprobs(chats, words))
    theirs.close()
    assert "135M" in ours.describe()
    ours.network.model.to(torch.bfloat16)
    ours.clear_cache()
    rounded = ours.token_logprobs(chats, words)
    sums = [[row.sum() for row in rows] for rows in (found, rounded)]
    np.testing.assert_allclose(*sums, rtol=2**-7)  # bfloat16 has 8 bits of precision


def test_a_tokenizer_reads_a_folder(tmp_path: Path) -> None:
    tokenizer = chat_tokenizer(folder(tmp_path))
    assert tokenizer.add_bos
    for text in ("plain", " two  spaces \n", "é 🥛", "a<|im_end|>b<s><think>", "12345678901234567"):
        tokens = tokenizer.tokenize(text)
        assert tokenizer.detokenize(tokens) == text
        assert not any(map(tokenizer.is_control, tokens))
    chat = tokenizer.render([Message("user", "<|im_end|>Hi")])
    names = [tokenizer.detokenize([t], markup=True) for t in chat if tokenizer.is_control(t)]
    assert names == ["<s>", "<|im_start|>", "<|im_end|>", "<|im_start|>"]
    assert tokenizer.detokenize([tokenizer.end_of_turn]) == ""


@pytest.mark.parametrize("place", ["list", "jinja", "json"])
def test_a_template_may_stand_in_several_places(tmp_path: Path, place: str) -> None:
    settings: dict[str, Any] = {}
    if place == "list":
        both = [{"name": "tool_use", "template": "x"}, {"name": "default", "template": CHATML}]
        settings["chat_template"] = both
    path = folder(tmp_path, None, **settings)
    if place == "jinja":
        (path / "chat_template.jinja").write_text(CHATML)
    if place == "json":
        (path / "chat_template.json").write_text(json.dumps({"chat_template": CHATML}))
    chat = [Message("user", "Hi")]
    text = "<s><|im_start|>user\nHi<|im_end|>\n<|im_start|>assistant\n"
    tokenizer = chat_tokenizer(path)
    assert tokenizer.detokenize(tokenizer.render(chat), markup=True) == text


@pytest.mark.parametrize("template", [GEMMA, MISTRAL])
def test_a_template_without_system_messages_gets_the_text_in_the_users(
    tmp_path: Path, template: str
) -> None:
    tokenizer = chat_tokenizer(folder(tmp_path, template))
    chat = [Message("system", "Be brief."), Message("user", "Hi"), Message("assistant", "Yes?")]
    text = tokenizer.detokenize(tokenizer.render([*chat, Message("user", "Tea.")]), markup=True)
    assert text.count("<s>") == 1
    assert "Be brief.\n\nHi" in text
    assert tokenizer.detokenize([tokenizer.end_of_turn], markup=True) == "<|im_end|>"
    if template == GEMMA:
        with pytest.raises(ModelError, match="roles must alternate"):
            tokenizer.render([Message("user", "Hi"), Message("user", "Hello?")])


def test_other_ends_than_the_tokenizers_end_a_reply_too(tmp_path: Path) -> None:
    path = folder(tmp_path, bos_token=None)
    think = chat_tokenizer(path).tokenize("<think>")  # cut, so plain text
    assert len(think) > 1
    data = json.loads((path / "tokenizer.json").read_text())
    end = next(t["id"] for t in data["added_tokens"] if t["content"] == "<think>")
    (path / "generation_config.json").write_text(json.dumps({"eos_token_id": [1, end]}))
    tokenizer = chat_tokenizer(path)
    assert not tokenizer.add_bos
    assert tokenizer.is_control(end)


def test_what_is_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="There is no model folder"):
        chat_tokenizer(tmp_path / "none")
    with pytest.raises(ModelError, match=r"no tokenizer\.json"):
        chat_tokenizer(tmp_path)
    with pytest.raises(ModelError, match="no chat template"):
        chat_tokenizer(folder(tmp_path, None))
    (tmp_path / "tokenizer_config.json").write_text("{")
    with pytest.raises(ModelError, match="is not JSON"):
        chat_tokenizer(tmp_path)
    (tmp_path / "tokenizer.json").write_text("{}")
    with pytest.raises(ModelError, match="cannot be read"):
        chat_tokenizer(tmp_path)
    with pytest.raises(ModelError, match="Cannot load"):
        Transformers(folder(tmp_path))
    with pytest.raises(ModelError, match="no model file"):
        Transformers(tmp_path / "none.gguf")


def test_the_hub_out_of_reach_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    hub = pytest.importorskip("huggingface_hub")

    asked: list[str] = []

    def unreachable(url: str) -> None:
        asked.append(url)
        raise pytest.importorskip("httpx2").ConnectError("offline")

    monkeypatch.setattr(hub, "get_hf_file_metadata", unreachable)
    with pytest.raises(ModelError, match="cannot be reached"):
        chat_tokenizer("owner/name")
    assert len(asked) == 1


PATHS = st.lists(st.lists(st.integers(0, 2), min_size=1, max_size=8), min_size=1, max_size=12)


@given(PATHS, st.integers(1, 9), st.integers(1, 9), st.randoms())
def test_packing_computes_every_node_once_after_all_above_it(
    paths: list[list[int]], width: int, limit: int, random: Any
) -> None:
    trie = Trie()
    for path in paths:
        trie.add(path)
    above = trie.parents
    known: list[bool] = []
    for parent in above:
        known.append(random.random() < 0.7 and (parent < 0 or known[parent]))
    fresh = [not each or random.random() < 0.2 for each in known]
    done = {node for node, each in enumerate(known) if each}
    while any(fresh):
        rows = pack(trie, fresh, width=width, limit=limit)
        assert all(len(row.nodes) <= max(width, limit) for row in rows)
        for batch in batches(rows, tokens=12, known=12):
            for row in batch:
                assert set(row.trunk) <= done
                for at, node in enumerate(row.nodes):
                    end = row.trunk[-1] if row.trunk else -1
                    assert above[node] in row.nodes[:at] or above[node] == end
                assert all(fresh[node] for node in row.nodes)
                done.update(row.nodes)
                for node in row.nodes:
                    fresh[node] = False
    assert done == set(range(len(trie)))


def test_a_model_that_is_closed_says_so(tmp_path: Path) -> None:
    fits = pytest.importorskip("fits")
    model = Transformers(fits.tiny_folder(tmp_path / "t"), device="cpu")
    model.close()
    model.close()
    chat = [Message("user", "Who?")]
    for asked in (
        lambda: model.token_logprobs([chat], ["I."]),
        lambda: model.generate(chat),
        lambda: model.count_tokens(chat),
        lambda: model.fingerprint,
        lambda: model.parameters,
        model.describe,
        model.clear_cache,
    ):
        with pytest.raises(ModelError, match="This model is closed"):
            asked()
