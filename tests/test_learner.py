"""The model that learns: how likely words are to it, and which of its weights change."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fits
from fits import OLD_NAME, example, learner_of
from goalscope.base.types import GoalscopeError, ModelError
from goalscope.belief.likelihood import Layout
from goalscope.fitting.learner import Example, Learner
from goalscope.models.adapters import read_adapter, write_adapter
from test_transformers import tiny

torch = pytest.importorskip("torch")

pytestmark = OLD_NAME
exact, path = fits.exact, fits.path


def scramble(learner: Learner, size: float = 0.3) -> None:
    """Give the adapters weights that change something."""
    random = torch.Generator().manual_seed(2)
    with torch.no_grad():
        for each in learner.parameters:
            each.copy_(torch.randn(each.shape, generator=random) * size)
    learner.model.clear_cache()


def by_roleplay(learner: Learner, of: Example) -> np.ndarray:
    return learner.roleplay.log_likelihood(of.task, of.goals, of.turns)


def scores(learner: Learner, of: Example) -> np.ndarray:
    return learner.log_likelihood(of).detach().numpy()


@pytest.mark.parametrize("layout", ["goal-first", "goal-last"])
def test_words_are_as_likely_as_to_the_likelihood(path: Path, layout: Layout) -> None:
    learner, of = learner_of(path, layout=layout), example()
    plain = by_roleplay(learner, of)
    tokens = [learner.model.tokenizer.tokenize(turn.utterance) for turn in of.turns]
    assert learner.tokens(of) == sum(map(len, tokens)) > 4
    np.testing.assert_allclose(scores(learner, of), plain, atol=1e-4)
    scramble(learner)
    changed = by_roleplay(learner, of)
    assert np.abs(changed - plain).max() > 0.5
    np.testing.assert_allclose(scores(learner, of), changed, atol=1e-4)
    for turns in (1, 2):
        part = replace(of, turns=of.turns[:turns], truths=of.truths[:turns])
        np.testing.assert_allclose(scores(learner, part), changed[:turns], atol=1e-4)


@pytest.mark.parametrize("tree", [1, 150])
def test_so_they_are_in_several_trees(
    path: Path, tree: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    learner, of = learner_of(path), example()
    scramble(learner)
    whole = learner.log_likelihood(of)
    whole.sum().backward()
    gradients = [each.grad.clone() for each in learner.parameters]
    monkeypatch.setattr("goalscope.fitting.learner._TREE", tree)
    for each in learner.parameters:
        each.grad = None
    parts = learner.log_likelihood(of)
    torch.testing.assert_close(parts, whole, atol=1e-4, rtol=0)
    parts.sum().backward()
    for each, gradient in zip(learner.parameters, gradients, strict=True):
        torch.testing.assert_close(each.grad, gradient, atol=1e-2, rtol=1e-3)


def test_memory_that_is_too_small_is_said(path: Path) -> None:
    learner = learner_of(path)
    for error in (MemoryError(), torch.OutOfMemoryError("CUDA out of memory.")):
        with (
            pytest.raises(GoalscopeError, match=r"Out of memory.*another --out"),
            learner.enough_memory(),
        ):
            raise error
    with pytest.raises(RuntimeError, match="another cause"), learner.enough_memory():
        raise RuntimeError("another cause")


@pytest.mark.parametrize("kind", ["mistral", "qwen3", "gemma3_text"])
def test_so_they_are_where_layers_look_back_a_little(tmp_path: Path, kind: str) -> None:
    learner = learner_of(tiny(tmp_path, kind, max_position_embeddings=1024))
    scramble(learner)
    expected = by_roleplay(learner, example())
    np.testing.assert_allclose(scores(learner, example()), expected, atol=1e-3)


@pytest.mark.parametrize(("share", "adapted"), [(0.01, {3}), (0.5, {2, 3}), (1.0, {0, 1, 2, 3})])
def test_only_adapters_of_the_last_layers_learn(
    tmp_path: Path, share: float, adapted: set[int]
) -> None:
    folder = tiny(tmp_path, "llama", num_hidden_layers=4, max_position_embeddings=1024)
    learner = learner_of(folder, rank=3, layers=share)
    scramble(learner)
    learner.log_likelihood(example()).sum().backward()
    named = dict(learner.model.network.model.named_parameters())
    with_gradients = {name for name, each in named.items() if each.grad is not None}
    assert with_gradients == {name for name, each in named.items() if each.requires_grad}
    assert all("lora_" in name for name in with_gradients)
    assert {int(name.split("layers.")[1].split(".")[0]) for name in with_gradients} == adapted
    assert len(learner.parameters) == len(with_gradients) == 2 * 7 * len(adapted)
    assert all(named[name].grad.abs().max() > 0 for name in with_gradients)
    assert {min(each.shape) for each in learner.parameters} == {3}


def test_it_begins_with_an_adapter_whose_rank_and_layers_it_takes(
    path: Path, tmp_path: Path
) -> None:
    first = learner_of(path, rank=3, layers=0.5)
    scramble(first)
    file, config = tmp_path / "adapter.gguf", first.model.network.model.config
    made = first.adapter({"a": "b"})
    assert (made.rank, made.alpha, made.metadata, len(made.layers)) == (3, 3.0, {"a": "b"}, 7)
    write_adapter(file, made, config)
    second = learner_of(path, start=read_adapter(file, config))  # not of rank 4 in 14 layers
    own = second.adapter({})
    assert (own.rank, own.alpha, own.layers.keys()) == (3, 3.0, made.layers.keys())
    assert len(second.parameters) == 14
    expected = scores(first, example())
    np.testing.assert_allclose(scores(second, example()), expected, atol=0.02)
    halves = {k: (a, b / 2) for k, (a, b) in made.layers.items()}
    third = learner_of(path, start=replace(made, alpha=6.0, layers=halves))
    np.testing.assert_allclose(scores(third, example()), expected, atol=1e-4)


def test_it_begins_with_no_adapter_of_other_layers_or_another_size(path: Path) -> None:
    made = learner_of(path).adapter({})
    lacking = {place: pair for place, pair in made.layers.items() if place != (1, "v_proj")}
    beyond = {(number + 1, name): pair for (number, name), pair in made.layers.items()}
    wider = {k: (np.hstack([a, a]), np.vstack([b, b])) for k, (a, b) in made.layers.items()}
    for layers, said in (
        (lacking, "different layers"), (beyond, "different layers"), (wider, "of another size")
    ):  # fmt: skip
        with pytest.raises(ModelError, match=rf"{said}.*\. Use --start none\."):
            learner_of(path, start=replace(made, layers=layers))


def test_a_model_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"^odd is a gpt2 model.*supported for llama, mistral,"):
        learner_of(tiny(tmp_path / "odd", "gpt2"))
