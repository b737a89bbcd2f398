"""A conversation whose work is cancelled can go on."""

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from fakes import WordModel
from goalscope.domains import Settings
from goalscope.store import Store
from goalscope.web.conversations import Conversation, Conversations
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
    open_ones.queue.submit(lambda: busy.set() or gate.wait(60))
    assert busy.wait(60)
    yield gate
    gate.set()


def test_after_cancelled_work_it_is_the_persons_turn(
    open_ones: Conversations, ann: Conversation, gate: threading.Event
) -> None:
    open_ones.queue.submit(lambda: None)
    change = ann.correct("pin", "bake a cake")
    assert ann.live().phase == "waiting"
    assert change.cancel()
    assert ann.live().phase == "idle"
    gate.set()
    open_ones.queue.submit(lambda: None).result(60)
    assert ann.live().phase == "idle"
