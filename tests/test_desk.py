"""The queue before the model."""

import threading

import pytest

from goalscope.web.queue import ModelQueue


def test_who_comes_first_is_served_first_and_all_are_told_their_place() -> None:
    desk, order, places = ModelQueue(), [], []
    gate, began = threading.Event(), threading.Event()
    first = desk.submit(lambda: began.set() or gate.wait())
    assert began.wait(5)
    jobs = [
        desk.submit(lambda: order.append("Ann")),
        desk.submit(lambda: order.append("Ben"), places.append),
    ]
    gate.set()
    for job in [first, *jobs]:
        job.result(5)
    assert order == ["Ann", "Ben"]
    assert places == [2, 1, 0]
    desk.close()


def test_who_waits_is_told_their_place_only_where_it_changes() -> None:
    desk, gate, began, places = ModelQueue(), threading.Event(), threading.Event(), []
    desk.submit(lambda: began.set() or gate.wait())
    assert began.wait(5)
    ben = desk.submit(lambda: None, places.append)
    cleo = desk.submit(lambda: None)
    last = desk.submit(lambda: None)
    assert cleo.cancel()
    assert places == [1]
    gate.set()
    ben.result(5)
    last.result(5)
    assert places == [1, 0]
    desk.close()


def test_who_stands_behind_what_is_cancelled_moves_up() -> None:
    desk, gate, began, places = ModelQueue(), threading.Event(), threading.Event(), []
    desk.submit(lambda: began.set() or gate.wait())
    assert began.wait(5)
    ann = desk.submit(lambda: None)
    ben = desk.submit(lambda: None, places.append)
    ann.cancel()
    gate.set()
    ben.result(5)
    assert places == [2, 1, 0]
    desk.close()


def test_what_fails_is_the_callers_and_the_next_is_served() -> None:
    desk = ModelQueue()
    failed = desk.submit(lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        failed.result(5)
    assert desk.submit(lambda: "served").result(5) == "served"
    desk.close()


def test_what_waits_when_the_desk_closes_is_cancelled_and_what_runs_is_finished() -> None:
    desk, gate, began = ModelQueue(), threading.Event(), threading.Event()
    running = desk.submit(lambda: began.set() or (gate.wait() and "done"))
    assert began.wait(5)
    waiting = desk.submit(lambda: None)
    threading.Timer(0.05, gate.set).start()
    desk.close()
    assert running.result(5) == "done"
    assert waiting.cancelled()
    with pytest.raises(RuntimeError, match="after shutdown"):
        desk.submit(lambda: None)


def test_who_cannot_be_told_their_place_is_served_all_the_same() -> None:
    def fails(place: int) -> None:
        raise OSError("nobody listens")

    desk = ModelQueue()
    assert desk.submit(lambda: "served", fails).result(5) == "served"
    assert desk.submit(lambda: "served").result(5) == "served"
    desk.close()
