"""The fair queue before the model."""

import threading

import pytest
from fastapi import HTTPException

from goalscope.web.desk import Desk
from goalscope.web.limits import WAITING


def test_people_are_served_in_rotation_and_told_their_place() -> None:
    desk, order, places = Desk(), [], []
    gate = threading.Event()
    began = threading.Event()
    first = desk.submit("Ann", lambda: began.set() or gate.wait(), lambda place: None)
    assert began.wait(5)

    def work(name: str):
        return lambda: order.append(name)

    jobs = [
        desk.submit("Ann", work("Ann 2"), lambda place: None),
        desk.submit("Ann", work("Ann 3"), lambda place: None),
        desk.submit("Ben", work("Ben"), places.append),
    ]
    gate.set()
    for job in [first, *jobs]:
        job.result(5)
    assert order == ["Ann 2", "Ben", "Ann 3"]
    assert places == [2, 1, 0]
    desk.close()


def test_who_waits_is_told_their_place_only_where_it_changes() -> None:
    desk, gate, began, places = Desk(), threading.Event(), threading.Event(), []
    desk.submit("Ann", lambda: began.set() or gate.wait(), lambda place: None)
    assert began.wait(5)
    ben = desk.submit("Ben", lambda: None, places.append)
    for name in "Cleo", "Dan", "Eve":
        last = desk.submit(name, lambda: None, lambda place: None)
    assert places == [1]
    gate.set()
    ben.result(5)
    last.result(5)
    assert places == [1, 0]
    desk.close()


def test_nobody_has_too_much_waiting() -> None:
    desk, gate, began = Desk(), threading.Event(), threading.Event()
    desk.submit("Ann", lambda: began.set() or gate.wait(), lambda place: None)
    assert began.wait(5)
    for _ in range(WAITING):
        desk.admit("Ann")
        last = desk.submit("Ann", lambda: None, lambda place: None)
    with pytest.raises(HTTPException) as refused:
        desk.admit("Ann")
    assert (refused.value.status_code, refused.value.headers) == (429, {"Retry-After": "5"})
    desk.admit("Ben")
    gate.set()
    last.result(5)
    desk.admit("Ann")
    desk.close()


def test_what_fails_is_the_callers_and_the_next_is_served() -> None:
    desk = Desk()
    failed = desk.submit("Ann", lambda: 1 / 0, lambda place: None)
    with pytest.raises(ZeroDivisionError):
        failed.result(5)
    assert desk.submit("Ben", lambda: "served", lambda place: None).result(5) == "served"
    desk.close()


def test_what_waits_when_the_desk_closes_is_cancelled_and_what_runs_is_finished() -> None:
    desk, gate = Desk(), threading.Event()
    began = threading.Event()
    running = desk.submit(
        "Ann", lambda: began.set() or (gate.wait() and "done"), lambda place: None
    )
    assert began.wait(5)
    waiting = desk.submit("Ben", lambda: None, lambda place: None)
    threading.Timer(0.05, gate.set).start()
    desk.close()
    assert running.result(5) == "done"
    assert waiting.cancelled()
    with pytest.raises(RuntimeError, match="closed"):
        desk.submit("Cleo", lambda: None, lambda place: None)


def test_who_cannot_be_told_their_place_is_served_all_the_same() -> None:
    def fails(place: int) -> None:
        raise OSError("nobody listens")

    desk = Desk()
    assert desk.submit("Ann", lambda: "served", fails).result(5) == "served"
    assert desk.submit("Ben", lambda: "served", lambda place: None).result(5) == "served"
    desk.close()
