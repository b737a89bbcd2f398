"""Teaching a model to write: it learns, and goes on where it was stopped."""

import json
from dataclasses import replace

import numpy as np
import pytest

from command import run
from corpus import Talk
from fits import OLD_NAME, tiny_folder
from goalscope.base.types import InvalidInputError, Turn
from goalscope.envs.scenarios import Scenario
from goalscope.experiment.reading_scores import Language, Line
from goalscope.language.orders import Order, Verb
from goalscope.models.adapters import FITTED_TASK, adapter_metadata
from goalscope.models.torch.model import Transformers
from lessons import lessons_of
from writing import WritingSettings, fit_writing

pytestmark = OLD_NAME
LANGUAGES = {"grocery": Language((Verb("add", ""), Verb("clear", "", ())), "You sell food.", ())}
QUICK = WritingSettings(rank=4, learning_rate=0.01, batch_tokens=300, epochs=4)


def line(number: int, said: str, orders: tuple[Order, ...], before: Line | None = None) -> Line:
    return Line(f"ann-{number}", "grocery", "", said, orders, before=before)


MILK, TEA = (Order("add", "milk"),), (Order("add", "tea"),)
LINES = [
    (first := line(1, "milk", MILK)),
    line(2, "tea", TEA, before=first),
    line(3, "empty it", (Order("clear"),)),
    line(4, "tea", TEA),
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


def test_a_script_fits_and_measures(tiny, tmp_path, monkeypatch):
    tiny()
    corpus = tmp_path / "corpus.jsonl"
    own = {"id": "a-1", "domain": "grocery"}
    rows = [
        own | {"turns": [{"message": "tea", "orders": [{"do": "add", "what": "tea"}]}]},
        own | {"goals": ["drink tea"], "turns": [{"query": "?", "utterance": "tea"}]},
    ]
    corpus.write_text("".join(json.dumps(each) + "\n" for each in rows))
    out = tmp_path / "out"
    words = ["fit.py", "--model", tmp_path / "tiny", "--device", "cpu", "--out", out]
    monkeypatch.setattr("sys.argv", [*map(str, words)])
    settings = WritingSettings(rank=2, epochs=2)
    run("reader", [corpus], settings, validate=[corpus], domains=["grocery"])
    facts = json.loads((out / "fit.json").read_text())
    assert facts["corpus"]["counts"] == {"messages, grocery": 1, "points of talks, grocery": 1}
    assert {*facts["validation"]} == {"goals", "question", "reading"}
