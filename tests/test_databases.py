"""What a store promises over both databases, and what a server's failures say."""

from __future__ import annotations

import re
import sqlite3
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from threading import Barrier, Event

import pytest
from sqlalchemy import Engine, event, text
from sqlalchemy.dialects.sqlite.base import SQLiteDialect

from commands import run
from databases import PASSWORD, begin
from goalscope.base.types import GoalscopeError, InvalidInputError, Turn
from goalscope.storage.store import Store
from goalscope.storage.tables import SCHEMA, SCHEMA_VERSION, STUDIES
from goalscope.study.store import StudyStore, _order
from test_store import EPISODE, a_round, values_of
from test_study import PLAN, fill

ODD = "half \ud800, NUL \x00, 100 % _ ' \" \\ é 🍰"


def test_any_text_is_stored(place):
    said = a_round(turn=Turn(ODD, ODD), status=ODD)
    with Store.open(place) as store:
        id = begin(store, domain=ODD, method=ODD, model=ODD, task=ODD, profile=ODD)
        store.append(id, said)
        (info,) = store.episodes(text=ODD)
        assert info.model == ODD.replace("\ud800", "\\ud800").replace("\0", "\\x00")
        assert values_of(store.rounds(id)[0]) == values_of(said)
        for words in ("one", ODD, "three"):
            store.correct(id, 1, ("pin", words, ""))
        assert [goal for _, goal, _ in store.corrections(id, 1)] == ["one", ODD, "three"]
        assert store.corrections(id, 0) == []
        with pytest.raises(GoalscopeError):
            store.correct("nobody", 1, ("pin", "one", ""))
        for unknown in ("\ud800", "\0", "%", "_"):
            with pytest.raises(InvalidInputError, match="No episode"):
                store.episode(unknown)


def test_episodes_are_found_by_text_and_come_in_pages(place):
    with Store.open(place) as store:
        tasks = ["Sell.", "100 % clean", "100 x clean", "Sell."]
        ids = [begin(store, **EPISODE | {"task": task}) for task in tasks]
        store.append(ids[2], a_round(turn=Turn("What?", 'A "5_6" lamp, belief')))

        def found(**options):
            return [ids.index(info.id) for info in store.episodes(**options)]

        assert found() == [0, 1, 2, 3]
        assert found(newest_first=True, limit=2) == [3, 2]
        assert found(newest_first=True, limit=2, offset=2) == [1, 0]
        assert found(offset=3) == [3]
        assert found(text="100 % c") == [1]
        assert found(text="SELL") == [0, 3]
        assert found(text='"5_6" LAMP') == [2]
        assert found(text="belief") == [2]  # of the words, and not of what they are stored with
        assert found(text="6_6") == found(text="Basket: 2") == []
        assert found(text=ids[1]) == [1]
        assert store.episode(ids[2]).rounds == 1


def test_many_threads_share_a_store(place):
    start = Barrier(12)
    with Store.open(place) as store:

        def talk(n: int) -> str:
            start.wait()
            id = begin(store, **EPISODE)
            for number in range(1, 9):
                store.append(id, a_round(number, status=str(n)))
                assert len(store.rounds(id)) == number
            store.finish(id, ended="terminated", score=1.0)
            return id

        with ThreadPoolExecutor(12) as pool:
            ids = list(pool.map(talk, range(12)))
        assert {info.id: info.rounds for info in store.episodes()} == dict.fromkeys(ids, 8)
        for n, id in enumerate(ids):
            assert {round.status for round in store.rounds(id)} == {str(n)}


def test_of_threads_that_add_the_same_round_one_does(place):
    start = Barrier(6)
    with Store.open(place) as store:
        id = begin(store, **EPISODE)

        def add(n: int) -> bool:
            start.wait()
            try:
                store.append(id, a_round(1, status=str(n)))
            except GoalscopeError:
                return False
            return True

        with ThreadPoolExecutor(6) as pool:
            assert sorted(pool.map(add, range(6))) == [False] * 5 + [True]
        assert len(store.rounds(id)) == 1


def test_a_study_is_deleted_while_somebody_joins(place, monkeypatch):
    begun, waits = Event(), Event()

    def slowly(*given):
        begun.set()
        waits.wait(10)
        return _order(*given)

    with Store.open(place) as store, ThreadPoolExecutor(2) as pool:
        fill(store)
        studies = StudyStore(store)
        study = studies.add(PLAN)
        monkeypatch.setattr("goalscope.study.store._order", slowly)
        joins = pool.submit(studies.join, study, "ann", "ann")
        assert begun.wait(60)
        deletes = pool.submit(studies.delete, study)
        if place.startswith("postgresql"):  # where nobody waits before they have a lock
            with store.reading() as connection:
                waiting = text("SELECT count(*) FROM pg_locks WHERE NOT granted")
                while not connection.scalar(waiting):
                    assert not deletes.done()
        waits.set()
        assert joins.result(60).number == 1
        deletes.result(60)
        assert studies.all() == []


@pytest.mark.parametrize("database", ["sqlite", "postgresql"])
def test_of_threads_that_open_a_new_store_at_once_none_fails(database, request, tmp_path):
    for n in range(8):
        if database == "sqlite":
            place, start = str(tmp_path / f"{n}.db"), Barrier(6)
        else:
            place, start = request.getfixturevalue("server").new(), Barrier(6)

        def make(_: int, place: str = place, start: Barrier = start) -> None:
            start.wait()
            with Store.open(place) as store:
                begin(store, **EPISODE)

        with ThreadPoolExecutor(6) as pool:
            list(pool.map(make, range(6)))
        with Store.open(place) as store:
            assert len(store.episodes()) == 6


def test_tables_that_could_not_be_made_are_made_at_the_next_opening(place):
    def fails(*given, **more):
        raise GoalscopeError("The lights went out.")

    event.listen(STUDIES, "before_create", fails)
    try:
        with pytest.raises(GoalscopeError, match="lights"):
            Store.open(place)
    finally:
        event.remove(STUDIES, "before_create", fails)
    if "://" not in place:
        with closing(sqlite3.connect(place)) as file:
            assert list(file.iterdump()) == ["BEGIN TRANSACTION;", "COMMIT;"]
            assert file.execute("PRAGMA application_id").fetchone() == (0,)
    with Store.open(place) as store:
        id = begin(store, **EPISODE)
        assert [each.id for each in store.episodes()] == [id]


@pytest.mark.parametrize("version", ["0000", "9999"])
def test_tables_of_another_version_are_refused(place, version):
    with Store.open(place) as store, store.writing() as connection:
        connection.execute(SCHEMA.update().values(version_num=version))
    with pytest.raises(GoalscopeError, match=f"of version {version} instead of {SCHEMA_VERSION}"):
        Store.open(place)


def test_no_statement_needs_a_newer_sqlite(tmp_path, monkeypatch, request):
    """RETURNING needs 3.35 and STRICT 3.37, which many distributions lack.

    PRAGMA table_info of 3.32 lacks the tables that another connection has made.
    """
    said = []
    monkeypatch.setattr(SQLiteDialect, "insert_returning", False)

    def note(*given):
        said.append(given[2])

    event.listen(Engine, "before_cursor_execute", note)
    request.addfinalizer(lambda: event.remove(Engine, "before_cursor_execute", note))
    with Store.open(tmp_path / "s.db") as store:
        fill(store)
        studies = StudyStore(store)
        study = studies.add(PLAN)
        assert studies.join(study, "ann", "ann") == studies.participant(study, "ann", "ann")
        with store.reading() as connection:
            said += connection.exec_driver_sql("SELECT sql FROM sqlite_master").scalars()
    assert not [each for each in said if each and re.search("RETURNING|STRICT|table_info", each)]


def test_a_closed_file_has_no_journal(tmp_path):
    with Store.open(tmp_path / "s.db") as store:
        with ThreadPoolExecutor(4) as pool:
            list(pool.map(lambda _: begin(store, **EPISODE), range(8)))
        assert (tmp_path / "s.db-wal").exists()
    assert [each.name for each in tmp_path.iterdir()] == ["s.db"]


def test_a_server_confirms_what_is_on_its_disk(server):
    place = server.new()
    server.run(f"ALTER DATABASE {place.rpartition('/')[2]} SET synchronous_commit = off")
    with Store.open(place) as store, store.writing() as connection:
        assert connection.scalar(text("SHOW synchronous_commit")) == "on"


def test_other_tables_of_a_server_are_left_alone(server):
    place = server.new()
    name = place.rpartition("/")[2]
    server.run("CREATE TABLE rounds (x int); INSERT INTO rounds VALUES (7)", name)
    with pytest.raises(GoalscopeError, match="other tables named rounds"):
        Store.open(place)
    assert server.run("SELECT x FROM rounds", name) == [(7,)]
    server.run("ALTER TABLE rounds RENAME TO theirs", name)
    Store.open(place).close()
    assert server.run("SELECT x FROM theirs", name) == [(7,)]


def refused(place: str) -> str:
    with pytest.raises(GoalscopeError) as caught:
        Store.open(place)
    line = str(caught.value)
    assert "\n" not in line
    assert PASSWORD not in line
    assert "wrong-pw" not in line
    return line


def test_what_a_server_refuses_is_explained(server):
    assert "the user and the password" in refused(server.address("postgres", "wrong-pw"))
    assert "createdb" in refused(server.address("nowhere"))
    server.run("CREATE ROLE reader LOGIN PASSWORD 'wrong-pw'")
    as_reader = server.new().replace(f"someone:{PASSWORD}", "reader:wrong-pw")
    assert "lacks a permission" in refused(as_reader)
    place = server.new()
    server.run(f"ALTER DATABASE {place.rpartition('/')[2]} SET default_transaction_read_only = on")
    assert "is not writable" in refused(place)
    gone = place.replace(str(server.port), "1")
    assert "Check that the server is running" in refused(gone)
    assert "Check that the server is running" in refused(gone + f"?password={PASSWORD}")


def test_a_lost_connection_is_explained_and_the_next_call_has_another(server):
    place = server.new()
    name = place.rpartition("/")[2]
    lose = f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{name}'"

    def read_and_lose() -> None:
        with store.reading() as connection:
            server.run(lose)
            connection.scalar(text("SELECT 1"))

    with Store.open(place) as store:
        id = begin(store, **EPISODE)
        with pytest.raises(GoalscopeError, match="try again"):
            read_and_lose()
        assert store.episode(id).id == id
        server.run(lose)
        store.append(id, a_round())


def test_a_locked_table_is_explained(server, monkeypatch):
    monkeypatch.setattr("goalscope.storage.opening.WAIT", 1)
    with Store.open(server.new()) as store, store.writing() as connection:
        connection.execute(text("LOCK TABLE episodes"))
        with pytest.raises(GoalscopeError, match="Another program is writing"):
            begin(store, **EPISODE)


def test_the_command_line_takes_an_address(server, monkeypatch):
    place = server.new()
    with Store.open(place) as store:
        assert store.place == place.replace(PASSWORD, "***")
        id = begin(store, **EPISODE)
    assert id in run("episodes", "--json", "--store", place).stdout
    monkeypatch.setenv("GOALSCOPE_STORE", place)
    assert id in run("episodes", "--json").stdout


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("mysql://u:wrong-pw@h/d", "not mysql"),
        ("postgresql://u:wrong@pw@h/d", "%40"),
        ("postgresql://u:x@h:wrong-pw/d", "Expected postgresql"),
        ("://wrong-pw", "Expected postgresql"),
    ],
)
def test_other_addresses_are_refused(address, said):
    assert said in refused(address)


def test_the_home_folder_is_found_without_a_shell(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    with Store.open("~/goals.db") as store:
        begin(store, **EPISODE)
    assert (tmp_path / "goals.db").is_file()
    with pytest.raises(GoalscopeError, match="no home folder"):
        Store.open("~nobody-of-this-name/goals.db")
    assert not [each for each in tmp_path.iterdir() if each.is_dir()]
