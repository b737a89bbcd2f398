"""Teaching a model to read: it learns, and goes on where it was stopped."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from fits import OLD_NAME, tiny_folder
from goalscope.benchmarks.reading import Line
from goalscope.fitting.reading import ReadingSettings, conversations, fit_reading
from goalscope.models.adapters import FITTED_TASK, adapter_metadata, read_adapter
from goalscope.models.transformers import Transformers
from goalscope.orders import Order, Verb
from goalscope.types import InvalidInputError

pytestmark = OLD_NAME
VERBS = {"grocery": (Verb("add", ""), Verb("clear", "", ()))}
QUICK = ReadingSettings(rank=4, learning_rate=0.01, batch_tokens=300, epochs=4)


def line(number: int, *said: str, orders: tuple[Order, ...]) -> Line:
    return Line(f"ann-{number}", "grocery", said[:-1], "", said[-1], orders)


MILK, TEA = (Order("add", "milk"),), (Order("add", "tea"),)
LINES = [
    line(1, "milk", orders=MILK),
    line(2, "milk", "tea", orders=TEA),
    line(3, "empty it", orders=(Order("clear"),)),
    line(4, "tea", orders=TEA),
]


@pytest.fixture
def tiny(tmp_path):
    made = tiny_folder(tmp_path / "tiny")
    return lambda: Transformers(made, context_size=1024, device="cpu")


def fit(model, out, settings=QUICK, lines=LINES):
    return fit_reading(
        model, VERBS, lines, settings, out, base="tiny", corpus=["ann"], command="test"
    )


def test_lines_that_follow_one_another_are_one_conversation():
    assert [len(each) for each in conversations(LINES)] == [2, 1, 1]


def test_a_fit_learns_and_says_what_it_is_for(tiny, tmp_path):
    losses = [loss for _, _, loss in fit(tiny(), tmp_path / "out", replace(QUICK, epochs=30))]
    assert np.mean(losses[-5:]) < 0.8 * np.mean(losses[:5])
    assert adapter_metadata(tmp_path / "out" / "adapter.gguf")[FITTED_TASK] == "reading"
    with pytest.raises(InvalidInputError, match="finished adapter"):
        next(fit(tiny(), tmp_path / "out"))


def test_a_stopped_fit_ends_as_one_that_was_not(tiny, tmp_path, monkeypatch):
    monkeypatch.setattr("goalscope.fitting.reading.KEPT", 1)
    whole = tiny()
    list(fit(whole, tmp_path / "whole"))
    list(islice(fit(tiny(), tmp_path / "parts"), 2))
    steps = [step for step, _, _ in fit(tiny(), tmp_path / "parts")]
    assert steps[0] <= 3
    config = whole.network.model.config
    one, two = (
        read_adapter(tmp_path / name / "adapter.gguf", config) for name in ("whole", "parts")
    )
    for place, pair in one.layers.items():
        for a, b in zip(pair, two.layers[place], strict=True):
            np.testing.assert_allclose(a, b, atol=1e-3)


def test_another_corpus_does_not_go_on(tiny, tmp_path, monkeypatch):
    monkeypatch.setattr("goalscope.fitting.reading.KEPT", 1)
    list(islice(fit(tiny(), tmp_path / "out"), 1))
    with pytest.raises(InvalidInputError, match="another corpus"):
        next(fit(tiny(), tmp_path / "out", lines=LINES[:2]))
