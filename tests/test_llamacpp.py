"""The embedded engine beyond the contract: its cache, its files, exact weights."""

from __future__ import annotations

import gc
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from goalscope.base.types import Message, ModelError, UnreadableAnswerError
from goalscope.models.adapters import shipped
from goalscope.models.check import check
from goalscope.models.llama.engine import engine
from goalscope.models.llama.model import LlamaCpp, embedded_path
from goalscope.models.llama.sampling import LlamaGrammar
from goalscope.models.llama.weights import MAX_PATHS, Weights
from test_model_contract import CONTEXTS, HISTORY, REPLIES, TOLERANCE, one_at_a_time, sums


def test_the_transcript_stays_cached_while_other_calls_come_between(model: LlamaCpp) -> None:
    model.clear_cache()
    sums(model, CONTEXTS, REPLIES)
    model.generate([Message("user", "Name a colour.")], max_tokens=3)
    sums(model, [[Message("user", "Pick an item.")]] * 2, ["Bread", "Butter"])
    longer = [
        [*context, Message("assistant", reply), Message("user", "How much?")]
        for context, reply in zip(CONTEXTS, REPLIES, strict=True)
    ]
    start = model.tokens_decoded
    warm = sums(model, longer, ["A lot."] * 4)
    new = model.tokens_decoded - start
    assert new < sum(map(model.count_tokens, longer)) / 2
    model.clear_cache()
    np.testing.assert_allclose(warm, sums(model, longer, ["A lot."] * 4), atol=TOLERANCE)


def test_what_was_forgotten_moves_no_number_by_a_bit(model: LlamaCpp) -> None:
    model.clear_cache()
    first = model.token_logprobs(CONTEXTS, REPLIES)
    long = [[*context, Message("user", "milk " * 300)] for context in CONTEXTS]
    sums(model, long, REPLIES[::-1])
    model.generate(HISTORY, max_tokens=5)
    model.clear_cache()
    for row, again in zip(first, model.token_logprobs(CONTEXTS, REPLIES), strict=True):
        np.testing.assert_array_equal(row, again)


def test_more_pairs_than_one_tree_can_hold(model: LlamaCpp) -> None:
    replies = [f"{number} eggs" for number in range(MAX_PATHS + 5)]
    results = sums(model, [HISTORY] * len(replies), replies)
    assert np.isfinite(results).all()
    np.testing.assert_allclose(results[-1], sums(model, [HISTORY], replies[-1:])[0], atol=TOLERANCE)


def test_an_interrupted_call_leaves_a_sound_cache(
    model: LlamaCpp, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = sums(model, CONTEXTS, REPLIES)

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("goalscope.models.llama.model.log_prob", interrupt)
        with pytest.raises(KeyboardInterrupt):
            sums(model, CONTEXTS, REPLIES)
    np.testing.assert_allclose(sums(model, CONTEXTS, REPLIES), expected, atol=TOLERANCE)


@pytest.fixture(scope="module")
def damaged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The embedded model with a sixth of its weights overwritten."""
    file = tmp_path_factory.mktemp("damaged") / "damaged.gguf"
    content = bytearray(embedded_path().read_bytes())
    size = len(content)
    content[size // 3 : size // 2] = b"\xff" * (size // 2 - size // 3)
    file.write_bytes(content)
    return file


def test_damaged_weights_are_named_with_what_to_do(damaged: Path, recwarn: Any) -> None:
    engine = LlamaCpp(damaged)
    said = rf"{damaged}.* Download it again, or choose another file\."
    for asked in (
        lambda: engine.token_logprobs(CONTEXTS, REPLIES),
        lambda: engine.generate(HISTORY),
        lambda: engine.generate(HISTORY, schema={"enum": ["tea"]}),
    ):
        with pytest.raises(ModelError, match=said):
            asked()
    (problem, *_) = check(engine)[1]
    assert re.search(said, problem)
    engine.close()
    assert not recwarn.list


def test_a_damaged_embedded_model_is_to_be_installed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine().lib, "llama_model_load_from_file", lambda *_: None)
    with pytest.raises(ModelError, match=rf"{embedded_path()} is not a complete.*Reinstall"):
        LlamaCpp()


def test_models_with_several_adapters_share_weights_and_answer_as_alone() -> None:
    plain, files = LlamaCpp(), [shipped("reader"), shipped("writer")]
    sharing = [LlamaCpp(adapter=file, sharing=plain) for file in files]
    expected = plain.token_logprobs(CONTEXTS, REPLIES)
    together = [model.token_logprobs(CONTEXTS, REPLIES) for model in sharing]
    plain.clear_cache()
    for row, again in zip(expected, plain.token_logprobs(CONTEXTS, REPLIES), strict=True):
        np.testing.assert_array_equal(row, again)
    plain.close()
    for file, model, rows in zip(files, sharing, together, strict=True):
        alone = LlamaCpp(adapter=file)
        for row, again in zip(rows, alone.token_logprobs(CONTEXTS, REPLIES), strict=True):
            np.testing.assert_array_equal(row, again)
        assert alone.fingerprint == model.fingerprint != plain.fingerprint
        alone.close()
        model.close()


def test_models_that_share_weights_share_the_bound_on_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("goalscope.models.llama.model._CACHE_BYTES", 100 << 20)
    plain = LlamaCpp()
    models = [plain, *(LlamaCpp(adapter=shipped(a), sharing=plain) for a in ("reader", "writer"))]
    weights = plain.vocabulary
    assert weights
    for text in ("tea", "cake", "soup"):
        for model in models:
            prompt = [Message("user", f"{text} " * 40)]
            before = model.token_logprobs([prompt], ["Yes, please."])
            assert sum(cache.bytes for cache in weights.used) < 150 << 20
            assert sum(cache.bytes > 0 for cache in weights.used) > 1 or model is plain
            (again,) = model.token_logprobs([prompt], ["Yes, please."])
            np.testing.assert_allclose(again, before[0], atol=TOLERANCE)
    models.pop().close()
    assert len(weights.used) <= 6
    for model in models:
        model.close()
    assert weights.used == []


def test_writing_goes_on_where_the_cache_has_to_grow(model: LlamaCpp) -> None:
    text = {"type": "string", "minLength": 60, "maxLength": 80}
    prompt = [Message("user", "banana " * 990)]
    assert model.count_tokens(prompt) < 1024
    reply = model.generate(prompt, max_tokens=120, schema=text)
    assert reply.prompt_tokens + reply.completion_tokens > 1024


def test_exact_weights_give_exact_log_probabilities(exact_gguf: Path) -> None:
    engine = LlamaCpp(exact_gguf)
    together = sums(engine, CONTEXTS, REPLIES)
    np.testing.assert_allclose(together, one_at_a_time(engine), atol=1e-3)
    engine.close()


def test_next_token_probabilities_sum_to_one(model: LlamaCpp) -> None:
    total = np.exp(model.next_logprobs(model.tokenizer.render(HISTORY))).sum()
    assert math.isclose(total, 1.0, abs_tol=1e-6)


def test_a_sentence_is_the_product_of_its_tokens(model: LlamaCpp) -> None:
    context, reply = CONTEXTS[0], "Nuts."
    (scores,) = model.token_logprobs([context], [reply])
    prompt, steps = model.tokenizer.render(context), []
    for token in model.tokenizer.tokenize(reply):
        steps.append(model.next_logprobs(prompt)[token])
        prompt.append(token)
    np.testing.assert_allclose(scores, steps, atol=TOLERANCE / 2)


def test_a_prompt_takes_time(model: LlamaCpp) -> None:
    assert model.prompt_seconds(64, scored=8) > 0


def test_a_model_that_is_closed_says_so_whatever_it_is_asked() -> None:
    model = LlamaCpp()
    tokenizer = model.tokenizer
    model.close()
    model.close()
    for asked in (
        lambda: model.token_logprobs([HISTORY], ["Nuts."]),
        lambda: model.generate(HISTORY),
        lambda: model.count_tokens(HISTORY),
        lambda: model.next_logprobs([1]),
        lambda: model.likeliest([1]),
        lambda: model.read([1], 0),
        lambda: model.push(1),
        lambda: model.grammar({"enum": ["a"]}),
        lambda: model.prompt_seconds(),
        lambda: model.parameters,
        lambda: model.weight_type,
        model.self_test,
        model.describe,
        model.clear_cache,
        lambda: tokenizer.tokenize("never seen before"),
        lambda: tokenizer.detokenize([1]),
    ):
        with pytest.raises(ModelError, match="This model is closed; open it again with open_model"):
            asked()


@pytest.mark.parametrize("temperature", [0.0, 0.8])
def test_rules_for_which_the_model_has_no_token_end_in_an_error_and_not_the_process(
    model: LlamaCpp, temperature: float
) -> None:
    for rules in ('root ::= "tea\\x04"', 'root ::= "\U00040000"'):
        with pytest.raises(UnreadableAnswerError, match="no token that fits the grammar"):
            model.generate(HISTORY, grammar=rules, temperature=temperature)
    with pytest.raises(ModelError, match="NUL"):
        model.generate(HISTORY, grammar='root ::= "a\0b"')
    assert model.generate(HISTORY, grammar='root ::= "tea"').text == "tea"


def test_a_grammar_keeps_its_vocabulary_alive() -> None:
    weights = Weights(embedded_path(), vocabulary_only=True)
    size, tea = weights.vocab_size, weights.tokenize("tea", markup=False)
    grammar = LlamaGrammar(weights, 'root ::= "tea"')
    del weights
    gc.collect()
    allowed = grammar.filter(np.zeros(size, np.float32), np.array(tea, np.int32))
    assert allowed[0] == 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="only POSIX forks")
def test_a_fork_is_refused_and_does_not_wait_for_ever() -> None:
    code = """
import os
from goalscope import GoalTracker
from goalscope.base.types import ModelError

def refused():
    for tracker in (old, lambda: GoalTracker(goals=["make tea"])):
        try:
            tracker().observe("?", "Tea.")
            return "not refused"
        except ModelError as error:
            if "forked" not in str(error):
                return str(error)
    return "refused"

tracker = GoalTracker(goals=["make tea", "bake a cake"])
old = lambda: tracker
tracker.observe("?", "Put the kettle on.")
if (child := os.fork()) == 0:
    os.write(1, refused().encode())
    os._exit(0)
os.waitpid(child, 0)
tracker.observe("?", "Tea.")
os.write(1, b", parent goes on")
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout == "refused, parent goes on"
