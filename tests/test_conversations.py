"""A conversation whose work is refused or cancelled can go on."""

import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from fastapi import HTTPException

from fakes import WordModel
from goalscope.domains import Settings
from goalscope.store import Store
from goalscope.web.conversations import Conversation, Conversations
from goalscope.web.limits import WAITING
from sites import WRITES


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store.open(tmp_path / "episodes.db") as opened:
        yield opened


@pytest.fixture
def open_ones(store: Store) -> Iterator[Conversations]:
    opened = Conversations(store, WordModel(WRITES))
    yield opened
    opened.close()


@pytest.fixture
def ann(open_ones: Conversations) -> Conversation:
    return open_ones.begin("ann", Settings())


@pytest.fixture
def gate(open_ones: Conversations) -> Iterator[threading.Event]:
    """Opens the way to the model, which is busy until then."""
    gate, busy = threading.Event(), threading.Event()
    open_ones.desk.submit("ben", lambda: busy.set() or gate.wait(60), lambda place: None)
    assert busy.wait(60)
    yield gate
    gate.set()


def test_who_may_not_catch_up_now_keeps_the_conversation_as_it_was(
    open_ones: Conversations, store: Store, ann: Conversation, gate: threading.Event
) -> None:
    before = ann.live()
    for _ in range(WAITING):
        open_ones.desk.submit("ann", lambda: None, lambda place: None)
    with pytest.raises(HTTPException, match="429"):
        open_ones.resume(replace(store.episode(ann.id), rounds=1))
    assert ann.live() == before


def test_after_cancelled_work_it_is_the_persons_turn(
    open_ones: Conversations, ann: Conversation, gate: threading.Event
) -> None:
    open_ones.desk.submit("cleo", lambda: None, lambda place: None)
    change = ann.correct("pin", "bake a cake")
    assert ann.live().phase == "waiting"
    assert change.cancel()
    assert ann.live().phase == "idle"
    gate.set()
    open_ones.desk.submit("dan", lambda: None, lambda place: None).result(60)
    assert ann.live().phase == "idle"
