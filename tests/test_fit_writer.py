"""Teaching a model to write: it learns, and goes on where it was stopped."""

import json
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from fits import OLD_NAME, tiny_folder
from goalscope.base.types import InvalidInputError, Turn
from goalscope.envs.scenarios import Scenario
from goalscope.experiment.reading_scores import Language, Line
from goalscope.fitting.corpus import Talk
from goalscope.fitting.lessons import lessons_of
from goalscope.fitting.writing import WritingSettings, fit_writing
from goalscope.language.orders import Order, Verb
from goalscope.models.adapters import FITTED_TASK, adapter_metadata, read_adapter
from goalscope.models.torch.model import Transformers
from test_cli import invoke

pytestmark = OLD_NAME
LANGUAGES = {"grocery": Language((Verb("add", ""), Verb("clear", "", ())), "You sell food.", ())}
QUICK = WritingSettings(rank=4, learning_rate=0.01, batch_tokens=300, epochs=4)


def line(number: int, *said: str, orders: tuple[Order, ...]) -> Line:
    return Line(f"ann-{number}", "grocery", said[:-1], "", said[-1], orders)


MILK, TEA = (Order("add", "milk"),), (Order("add", "tea"),)
LINES = [
    line(1, "milk", orders=MILK),
    line(2, "milk", "tea", orders=TEA),
    line(3, "empty it", orders=(Order("clear"),)),
    line(4, "tea", orders=TEA),
    Talk("ben-1", "grocery", (Turn("Yes?", "tea"),), "", ("drink tea",), "Green tea?"),
    Scenario("cleo-1", "grocery", "drink tea", ("tea",), ("tea",), ("milk",), ("soap",)),
]


@pytest.fixture
def tiny(tmp_path):
    made = tiny_folder(tmp_path / "tiny")
    return lambda: Transformers(made, context_size=1024, device="cpu")


def fit(model, out, settings=QUICK, taught=LINES, **more):
    lessons = lessons_of(taught, model, LANGUAGES, known=taught)
    corpus = {"files": ["ann"], "rows": [each.id for each in taught]}
    return fit_writing(
        model, lessons, settings, out, base="tiny", corpus=corpus, command="test", **more
    )


def test_a_fit_learns_and_says_what_it_is_for(tiny, tmp_path):
    losses = [loss for _, _, loss in fit(tiny(), tmp_path / "out", replace(QUICK, epochs=30))]
    assert np.mean(losses[-5:]) < 0.8 * np.mean(losses[:5])
    assert adapter_metadata(tmp_path / "out" / "adapter.gguf")[FITTED_TASK] == "writing"
    with pytest.raises(InvalidInputError, match="finished adapter"):
        next(fit(tiny(), tmp_path / "out"))


def test_a_stopped_fit_ends_as_one_that_was_not(tiny, tmp_path, monkeypatch):
    monkeypatch.setattr("goalscope.fitting.writing.KEPT", 1)
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
    monkeypatch.setattr("goalscope.fitting.writing.KEPT", 1)
    list(islice(fit(tiny(), tmp_path / "out"), 1))
    with pytest.raises(InvalidInputError, match="another corpus"):
        next(fit(tiny(), tmp_path / "out", taught=LINES[:2]))


def test_in_the_end_it_tells_how_well_each_kind_is_known(tiny, tmp_path):
    model = tiny()
    validation = lessons_of(LINES, model, LANGUAGES, known=LINES)
    list(fit(model, tmp_path / "out", replace(QUICK, epochs=40), validation=validation))
    facts = json.loads((tmp_path / "out" / "fit.json").read_text())
    known = facts["validation"]
    assert {*known} == {"goals", "judging", "needs", "question", "reading"}
    assert (known["goals"]["answers"], known["reading"]["answers"]) == (1, 4)
    assert all(0 <= each["right"] <= 1 and each["nats"] >= 0 for each in known.values())
    assert facts["losses"][-1] < 0.8 * facts["losses"][0]
    assert facts["corpus"]["files"] == ["ann"]


def test_the_command_teaches_and_measures(tiny, tmp_path):
    tiny()
    corpus = tmp_path / "corpus.jsonl"
    own = {"id": "a-1", "domain": "grocery"}
    turns = [{"query": "?", "utterance": "tea"}]
    rows = [
        own | {"message": "tea", "orders": [{"do": "add", "what": "tea"}]},
        own | {"goals": ["drink tea"], "turns": turns},
    ]
    corpus.write_text("".join(json.dumps(each) + "\n" for each in rows))
    words = ["--model", tmp_path / "tiny", "--device", "cpu", "--epochs", 2, "--rank", 2]
    out = tmp_path / "out"
    done = invoke("fit-writer", corpus, "--out", out, "--validate", corpus, *words)
    assert done.exit_code == 0, done.stderr
    assert f"--adapter {out}" in done.stderr.replace("\n", "")
    facts = json.loads((out / "fit.json").read_text())
    assert facts["corpus"]["counts"] == {"messages, grocery": 1, "points of talks, grocery": 1}
    assert {*facts["validation"]} == {"goals", "question", "reading"}
    corpus.write_text('{"goals": []}\n')
    refused = invoke("fit-writer", corpus, "--out", tmp_path / "other", *words)
    assert refused.exit_code == 2
    assert "corpus.jsonl, line 1: 'turns'" in refused.stderr
