"""The queue before the model."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fakes import WordModel
from goalscope.agent.settings import Settings
from goalscope.storage.store import Store
from goalscope.web.conversations import Conversations
from goalscope.web.queue import ModelQueue
from sites import WRITES


@pytest.fixture
def queue() -> Iterator[ModelQueue]:
    opened = ModelQueue()
    yield opened
    opened.close()


@pytest.fixture
def block() -> Iterator[Callable[[ModelQueue], threading.Event]]:
    """Keeps a queue busy until the event that it returns is set, or the test ends."""
    gates: list[threading.Event] = []

    def begin(queue: ModelQueue) -> threading.Event:
        gate, began = threading.Event(), threading.Event()
        gates.append(gate)
        queue.submit(lambda: began.set() or gate.wait(60))
        assert began.wait(60)
        return gate

    yield begin
    for gate in gates:
        gate.set()


def test_who_comes_first_is_served_first_and_all_are_told_their_place(queue, block) -> None:
    order, places = [], []
    gate = block(queue)
    jobs = [
        queue.submit(lambda: order.append("Ann")),
        queue.submit(lambda: order.append("Ben"), places.append),
    ]
    gate.set()
    for job in jobs:
        job.result(5)
    assert order == ["Ann", "Ben"]
    assert places == [2, 1, 0]


def test_places_are_told_only_where_they_change_and_move_up_where_others_cancel(
    queue, block
) -> None:
    gate, ben_sees, cleo_sees = block(queue), [], []
    ben = queue.submit(lambda: None, ben_sees.append)
    dan = queue.submit(lambda: None)
    cleo = queue.submit(lambda: None, cleo_sees.append)
    assert dan.cancel()
    assert (ben_sees, cleo_sees) == ([1], [3, 2])
    gate.set()
    ben.result(5)
    cleo.result(5)
    assert (ben_sees, cleo_sees) == ([1, 0], [3, 2, 1, 0])


def test_what_fails_is_the_callers_and_the_next_is_served(queue) -> None:
    failed = queue.submit(lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        failed.result(5)
    assert queue.submit(lambda: "served").result(5) == "served"


def test_what_waits_when_the_queue_closes_is_cancelled_and_what_runs_is_finished() -> None:
    queue, gate, began = ModelQueue(), threading.Event(), threading.Event()
    running = queue.submit(lambda: began.set() or (gate.wait() and "done"))
    assert began.wait(5)
    waiting = queue.submit(lambda: None)
    threading.Timer(0.05, gate.set).start()
    queue.close()
    assert running.result(5) == "done"
    assert waiting.cancelled()
    with pytest.raises(RuntimeError, match="after shutdown"):
        queue.submit(lambda: None)


def test_who_cannot_be_told_their_place_is_served_all_the_same(queue) -> None:
    def fails(place: int) -> None:
        raise OSError("nobody listens")

    assert queue.submit(lambda: "served", fails).result(5) == "served"
    assert queue.submit(lambda: "served").result(5) == "served"


def test_after_cancelled_work_it_is_the_persons_turn(tmp_path: Path, block) -> None:
    with Store.open(tmp_path / "episodes.db") as store:
        conversations = Conversations(store, WordModel(WRITES))
        ann = conversations.begin("ann", Settings())
        gate = block(conversations.queue)
        conversations.queue.submit(lambda: None)
        change = ann.correct("pin", "bake a cake")
        assert ann.live().phase == "waiting"
        assert change.cancel()
        assert ann.live().phase == "idle"
        gate.set()
        conversations.queue.submit(lambda: None).result(60)
        assert ann.live().phase == "idle"
        conversations.close()
