"""The cache of model calls: nothing is asked twice, and nothing is taken from another model."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fakes import WordModel
from goalscope.base.types import GoalscopeError, InvalidInputError, Message
from goalscope.models.cache import CachedModel
from goalscope.models.opening import ModelSet

CHAT = [Message("user", "milk or eggs")]


class Weighed(WordModel):
    """A word model with a fingerprint, which counts the pairs and the prompts that it is asked."""

    def __init__(self, fingerprint: str = "a") -> None:
        super().__init__({"milk": "eggs"})
        self.fingerprint = fingerprint
        self.pairs = self.prompts = 0

    def token_logprobs(self, contexts, continuations, *, end_of_turn=False):
        self.pairs += len(contexts)
        return super().token_logprobs(contexts, continuations, end_of_turn=end_of_turn)

    def generate(self, messages, **settings):
        self.prompts += 1
        return super().generate(messages, **settings)

    def describe(self) -> str:
        return "words"

    def close(self) -> None: ...


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "calls.db"


def test_an_answer_is_given_again_to_the_last_bit(file: Path) -> None:
    first = CachedModel(Weighed(), file)
    rows = first.token_logprobs([CHAT, CHAT], ["milk, please", "none"])
    reply = first.generate(CHAT, temperature=0.5, seed=3, stop=["."], schema={"type": "string"})
    first.close()
    model = Weighed()
    second = CachedModel(model, file)
    for row, again in zip(rows, second.token_logprobs([CHAT] * 2, ["milk, please", "none"])):  # noqa: B905
        np.testing.assert_array_equal(row, again)
    again = second.generate(CHAT, temperature=0.5, seed=3, stop=["."], schema={"type": "string"})
    assert again == reply
    assert (model.pairs, model.prompts, second.hits, second.misses) == (0, 0, 3, 0)


def test_other_weights_are_never_answered_for(file: Path) -> None:
    CachedModel(Weighed("a"), file).token_logprobs([CHAT], ["milk"])
    other = Weighed("b")
    CachedModel(other, file).token_logprobs([CHAT], ["milk"])
    assert other.pairs == 1


@pytest.mark.parametrize(
    "changed",
    [
        {"max_tokens": 9},
        {"temperature": 0.1},
        {"seed": 1},
        {"stop": ["x"]},
        {"schema": {"type": "object"}},
    ],
)
def test_every_setting_counts(file: Path, changed: dict) -> None:
    model = Weighed()
    cached = CachedModel(model, file)
    cached.generate(CHAT)
    cached.generate(CHAT, **changed)
    cached.generate([Message("system", CHAT[0].content)])
    assert model.prompts == 3


def test_only_new_pairs_are_asked_and_each_once(file: Path) -> None:
    model = Weighed()
    cached = CachedModel(model, file)
    cached.token_logprobs([CHAT], ["milk"])
    rows = cached.token_logprobs([CHAT] * 4, ["eggs", "milk", "eggs", "none at all"])
    assert model.pairs == 3
    assert [len(row) for row in rows] == [1, 1, 1, 3]
    cached.token_logprobs([CHAT], ["milk"], end_of_turn=True)
    assert model.pairs == 4


def test_a_writer_and_a_scorer_share_one_file(file: Path) -> None:
    writer, scorer = Weighed("w"), Weighed("s")
    for _ in range(2):
        both = ModelSet(CachedModel(writer, file), CachedModel(scorer, file))
        both.generate(CHAT)
        both.token_logprobs([CHAT], ["milk"])
    assert (writer.prompts, writer.pairs, scorer.prompts, scorer.pairs) == (1, 0, 0, 1)


def test_a_killed_sweep_repeats_no_call(file: Path) -> None:
    script = """
import os, sys
sys.path[:0] = sys.argv[1:3]
from test_cache import CHAT, Weighed
from goalscope.models.cache import CachedModel
model = Weighed()
cached = CachedModel(model, sys.argv[3])
for number in range(10):
    if number == int(sys.argv[4]):
        os._exit(9)
    cached.token_logprobs([CHAT], [f"milk {number}"])
print(model.pairs)
"""
    tests = str(Path(__file__).parent)
    source = str(Path(__file__).parents[1] / "src")

    def sweep(dies_at: int) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", script, tests, source, str(file), str(dies_at)],
            capture_output=True,
            text=True,
        )

    assert sweep(6).returncode == 9
    assert sweep(-1).stdout.strip() == "4"


def test_an_interrupted_answer_leaves_the_file_usable(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cached = CachedModel(Weighed(), file)
    with monkeypatch.context() as patch:
        patch.setattr(cached, "_db", Interrupted(cached._db))
        with pytest.raises(KeyboardInterrupt):
            cached.generate(CHAT)
    CachedModel(Weighed(), file).token_logprobs([CHAT], ["milk"])
    cached.generate(CHAT)


class Interrupted:
    """A database whose writer is interrupted."""

    def __init__(self, database: sqlite3.Connection) -> None:
        self.execute = database.execute
        self.database = database

    def __enter__(self) -> object:
        return self.database.__enter__()

    def __exit__(self, *error: Any) -> object:
        return self.database.__exit__(*error)

    def executemany(self, *_: object) -> None:
        raise KeyboardInterrupt


def test_something_else_is_left_alone(file: Path, tmp_path: Path) -> None:
    with sqlite3.connect(file) as other:
        other.execute("CREATE TABLE notes (text)")
    other.close()
    before = file.read_bytes()
    with pytest.raises(InvalidInputError, match="Name another"):
        CachedModel(Weighed(), file)
    assert file.read_bytes() == before
    file.write_text("my notes, which are no database at all")
    for other in (file, tmp_path):
        with pytest.raises(GoalscopeError, match="Cannot use"):
            CachedModel(Weighed(), other)


def test_threads_share_a_cache(file: Path) -> None:
    cached = CachedModel(Weighed(), file)

    def scored(number: int) -> list[float]:
        (row,) = cached.token_logprobs([CHAT], [f"milk {number % 5}"])
        return row.tolist()

    alone = [scored(number) for number in range(5)]
    with ThreadPoolExecutor(8) as threads:
        assert [*threads.map(scored, range(100, 200))] == alone * 20
