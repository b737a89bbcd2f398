"""Cells on a cluster: each is performed once, whatever dies."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.experiment.cluster import on_cluster

pytest.importorskip("distributed")
pytest.importorskip("cryptography")
psutil = pytest.importorskip("psutil")


def perform(spec: Mapping[str, Any]) -> dict[str, Any]:
    """What a cell asks for; each time it begins, its journal gets a line."""
    if "journal" in spec:
        journal = Path(spec["journal"])
        with journal.open("a") as file:
            file.write(f"{os.getpid()}\n")
        if len(journal.read_text().split()) <= spec.get("deaths", 0):
            os.kill(os.getpid(), signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)
    if "error" in spec:
        raise InvalidInputError(spec["error"])
    time.sleep(spec.get("seconds", 0))
    return {"square": spec.get("number", 0) ** 2, "third": spec.get("number", 0) / 3}


Workers = Callable[[], list[int]]


@pytest.fixture
def workers() -> Workers:
    """The processes that the test has started; what other tests share stands beside them."""
    others = ("resource_tracker", "lives.py")
    this = psutil.Process()
    shared = set(this.children())

    def started() -> list[int]:
        direct = [each for each in this.children() if each not in shared]
        below = {each: " ".join(each.cmdline()) for top in direct for each in family(top)}
        return [each.pid for each, line in below.items() if not any(o in line for o in others)]

    return started


def family(process: Any) -> list[Any]:
    return [process, *process.children(True)]


def test_every_cell_has_one_outcome_whatever_dies(tmp_path: Path, workers: Workers) -> None:
    cells = {f"plain {n}": {"number": n, "journal": str(tmp_path / str(n))} for n in range(8)}
    expected = {key: perform({"number": n}) for n, key in enumerate(cells)}
    cells["error"] = {"error": "this cell is wrong", "journal": str(tmp_path / "error")}
    cells["once"] = {"number": 9, "journal": str(tmp_path / "once"), "deaths": 1}
    cells["always"] = {"journal": str(tmp_path / "always"), "deaths": 9}
    found = list(on_cluster(list(cells.items()), perform))
    outcomes = {key: (outcome, tries) for key, outcome, tries in found}
    assert len(found) == len(outcomes) == len(cells)
    assert {key: outcomes[key] for key in expected} == {
        key: (result, 1) for key, result in expected.items()
    }
    error, tries = outcomes["error"]
    assert (type(error), str(error), tries) == (InvalidInputError, "this cell is wrong", 1)
    assert outcomes["once"] == (perform({"number": 9}), 2)
    error, tries = outcomes["always"]
    assert type(error) is GoalscopeError
    assert tries == 3
    begun = {file.name: len(file.read_text().split()) for file in tmp_path.iterdir()}
    assert begun == {**{str(n): 1 for n in range(8)}, "error": 1, "once": 2, "always": 3}
    assert workers() == []


def test_to_close_the_generator_ends_the_workers_in_mid_cell(
    tmp_path: Path, workers: Workers
) -> None:
    journal = tmp_path / "long"
    cells = [("long", {"seconds": 600, "journal": str(journal)}), ("short", {"number": 2})]
    outcomes = on_cluster(cells, perform)
    assert next(outcomes) == ("short", perform({"number": 2}), 1)
    while not journal.exists():
        time.sleep(0.01)
    assert len(workers()) == 2
    listening = [each for each in psutil.net_connections() if each.status == psutil.CONN_LISTEN]
    ours = [each for each in listening if each.pid in (os.getpid(), *workers())]
    assert {each.laddr.ip for each in ours} == {"127.0.0.1"}
    outcomes.close()
    assert workers() == []


def test_an_existing_cluster_is_used_and_left_running(tmp_path: Path) -> None:
    import distributed

    with (
        distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
            scheduler_kwargs={"dashboard": False},
            silence_logs=50,
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        cells = [
            ("plain", {"number": 4, "journal": str(tmp_path / "plain")}),
            ("once", {"number": 3, "journal": str(tmp_path / "once"), "deaths": 1}),
            ("error", {"error": "wrong"}),
        ]
        found = {
            key: (outcome, tries)
            for key, outcome, tries in on_cluster(cells, perform, address=cluster.scheduler_address)
        }
        assert found["once"] == (perform({"number": 3}), 2)
        assert str(found["error"][0]) == "wrong"
        assert found["plain"] == (perform({"number": 4}), 1)
        assert len((tmp_path / "plain").read_text().split()) == 1  # not again with its worker dead
        assert len(client.nthreads()) == 1


def test_what_cannot_be_used_is_refused_before_anything_starts(
    monkeypatch: pytest.MonkeyPatch, workers: Workers
) -> None:
    with pytest.raises(InvalidInputError, match="No Dask scheduler answers"):
        list(on_cluster([("a", {})], perform, address="no-such-scheme://127.0.0.1:1"))
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(GoalscopeError, match=r"goalscope\[cluster\]"):
        list(on_cluster([("a", {})], perform))
    assert workers() == []
