"""Files that an older goalscope wrote are read as it would have read them."""

import json
import sqlite3
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext

from goalscope.calibration import Calibration
from goalscope.database import legacy
from goalscope.database.legacy import MIGRATIONS
from goalscope.database.opening import APPLICATION, LEGACY
from goalscope.database.tables import VERSION_TABLE, Base
from goalscope.experiment.results import Results
from goalscope.experiment.tables import tables_of
from goalscope.session import saved_settings
from goalscope.store import Store
from goalscope.types import Goal, GoalscopeError
from test_store import pragma
from test_summary import row
from test_summary_dialogues import SURE, dialogue

CREATED = "2026-01-01T00:00:00+00:00"
GOALS = ["Unspecified", "make tea \ud800 \x00", "bake"]
PRIOR = [0.0, 0.1 + 0.2, -1.0]
ROWS = [[-1.5, -1 / 3, "-inf"], [-4.0, -5.0, -2.0], [-0.25, -2.0, -1e-300]]
SETTINGS = {
    "domain": "grocery", "human": "you", "method": "good", "model": None, "generator": None,
    "scorer": None, "tokenizer": None, "adapter": None, "profiles": None, "catalogue": None,
    "columns": {"name": "temperature"}, "scene": None, "simulator": "house", "unity": None,
    "layout": "goal-first", "evidence": "sum", "end_of_turn": True, "temperature": 2.0, "seed": 7,
    "rounds": 9,
}  # fmt: skip
REMOVED = {"kind": "removed", "goal": {"text": "wash"}, "reason": "the least likely for 4 rounds"}


def round_2(number, **belief):
    """A round as version 2 wrote it."""
    held = {"goals": GOALS, "log_prior": PRIOR, "log_likelihood": ROWS[:number]}
    return {
        "number": number, "turn": {"query": "Yes?", "utterance": "\ud83c Tea"},
        "belief": {**held, **belief} if belief else None, "changes": [REMOVED],
        "results": [{"action": {"name": "add item", "target": "Milk", "quantity": 2}, "ok": True,
                     "observation": "Added.", "terminated": False, "irreversible": False}],
        "replans": 1, "status": "temperature", "notes": ["evidence"], "terminated": False,
        "question": "", "state": "s",
    }  # fmt: skip


@pytest.fixture
def old(tmp_path):
    """A file of version 2 with nothing in it, and the connection that wrote it."""
    connection = sqlite3.connect(tmp_path / "old.db")
    connection.executescript(";".join(MIGRATIONS[:2]))
    connection.execute(f"PRAGMA application_id = {APPLICATION}")
    connection.execute("PRAGMA user_version = 2")
    connection.execute("PRAGMA journal_mode = WAL")
    yield tmp_path / "old.db", connection
    connection.close()


def write(old, rounds, id="e", settings=SETTINGS):
    path, connection = old
    connection.execute(
        "INSERT INTO episodes (id, created, domain, method, model, task, settings)"
        " VALUES (?, ?, 'grocery', 'good', 'm', 'Sell.', ?)",
        [id, CREATED, json.dumps(settings)],
    )
    connection.executemany(
        "INSERT INTO rounds VALUES (?, ?, ?)",
        [(id, each["number"], json.dumps(each)) for each in rounds],
    )
    connection.commit()
    return path


@pytest.mark.parametrize("evidence", ["sum", "last"])
@pytest.mark.parametrize("temperature", [2.0, 0.3])
def test_beliefs_are_as_they_were(old, evidence, temperature):
    beliefs = [round_2(n, temperature=temperature, evidence=evidence) for n in (1, 2, 3)]
    path = write(old, beliefs)
    for _ in range(2):  # an old file and a new one
        with Store.open(path) as store:
            found = store.rounds("e")
    table = np.array(ROWS, dtype=np.float64)
    for count, each in enumerate(found, 1):
        counted = table[count - 1] if evidence == "last" else table[:count].sum(0)
        joint = np.array(PRIOR) + counted / temperature
        assert each.belief.probability == pytest.approx(
            np.exp(joint) / np.exp(joint).sum(), abs=1e-12
        )
        assert each.belief.goals == tuple(map(Goal, GOALS))
        assert each.belief.log_prior.tolist() == PRIOR
        assert (each.belief.log_likelihood == table[:count]).all()
        assert each.belief.pinned == ()
        assert each.belief.calibration == Calibration(
            temperature=temperature, switching=float(evidence == "last")
        )
    more = found[-1].belief.observe([-1.0, -2.0, -3.0])  # as a resumed episode goes on
    rows = np.array([*table, [-1.0, -2.0, -3.0]])[-1 if evidence == "last" else 0 :]
    joint = np.array(PRIOR) + rows.sum(0) / temperature
    assert more.probability == pytest.approx(np.exp(joint) / np.exp(joint).sum(), abs=1e-12)


def test_what_else_is_in_a_round_stays(old):
    path = write(old, [round_2(1, temperature=2.0, evidence="sum"), round_2(2)])
    with Store.open(path) as store:
        one, other = store.rounds("e")
        with store.reading() as session:
            assert pragma(session, "user_version") == LEGACY + 1
    assert other.belief is None
    for each in (one, other):
        assert each.turn.utterance == "\ud83c Tea"
        assert (each.status, each.notes, each.state) == ("temperature", ("evidence",), "s")
        (change,) = each.changes
        assert (change.kind, change.goal, change.final) == ("removed", Goal("wash"), False)
        assert [str(result.action) for result in each.results] == ["add item: Milk x2"]


def test_an_episode_can_go_on_with_its_settings(old):
    path = write(old, [round_2(1, temperature=2.0, evidence="sum")])
    write(old, [], "bare", {})
    with Store.open(path) as store:
        settings = saved_settings(store.episode("e"))
        assert store.episode("bare").settings == {}
    assert (settings.calibration, settings.questions) == (None, "likeliest")
    assert (settings.layout, settings.end_of_turn, settings.seed) == ("goal-first", True, 7)
    assert (settings.columns, settings.rounds) == ({"name": "temperature"}, 9)


def test_cells_of_dialogues_are_scored_at_the_temperature_that_they_had(old):
    path, connection = old
    spec, result = dialogue(1, 0, 2, **{"role-play": [SURE, SURE]})
    del result["calibration"]
    cells = [
        ("done", spec, result),
        ("other", {"kind": "mcq"}, {"picked": "A"}),
        ("undone", {**spec, "goal_set": "random"}, None),
    ]
    connection.executemany(
        "INSERT INTO cells (key, spec, attempts, result) VALUES (?, ?, 1, ?)",
        [(key, json.dumps(spec), result and json.dumps(result)) for key, spec, result in cells],
    )
    connection.commit()
    with Results.open(path) as results:
        done, other, undone = results.cells()
        tables = tables_of(results, [done])
    assert {**done.result, "calibration": None} == {**result, "calibration": None}
    assert other.result == {"picked": "A"}
    assert undone.result is None
    (table,) = (each for each in tables if "top-1" in each.columns and "predictor" in each.columns)
    for predictor, temperature in (("goalscope", 2.0), ("goalscope, Eq. 1", 1.0)):
        odds = 2 * SURE[0] / temperature
        loss = row(table, predictor, "2")["log-loss"].value
        assert loss == pytest.approx(np.log(1 + 3 * np.exp(-odds)))
    assert any(each.columns[0] == "belief" for each in tables)


@pytest.mark.parametrize("version", [2, 3, 4])
def test_an_older_file_takes_corrections(old, version):
    path, connection = old
    connection.executescript(";".join(MIGRATIONS[2:version]))
    connection.execute(f"PRAGMA user_version = {version}")
    write(old, [], settings={})
    said = [["veto", "bake", ""], ["pin", "wash", "so"]] if version == 4 else []
    for each in said:
        connection.execute("INSERT INTO corrections VALUES ('e', 0, ?)", [json.dumps(each)])
    connection.commit()
    with Store.open(path) as store:
        assert store.corrections("e", 0) == said
        store.correct("e", 1, ("pin", "make tea \ud800", ""))
    with Store.open(path) as store:
        assert store.corrections("e", 1) == [["pin", "make tea \ud800", ""]]
        assert [each.id for each in store.episodes()] == ["e"]


def test_a_damaged_round_harms_no_other(old) -> None:
    path = write(old, [round_2(1, temperature=2.0, evidence="sum")])
    old[1].execute("INSERT INTO rounds VALUES ('e', 2, '{')")
    old[1].commit()
    with Store.open(path) as opened:
        assert [each.rounds for each in opened.episodes()] == [2]


def test_all_rows_come_along_in_their_order_into_the_tables_that_are_mapped(old):
    path, connection = old
    ids = ["z", "a", "m"]  # begun in the same second
    for id in ids:
        write(old, [round_2(n) for n in (1, 2)], id)
    connection.executemany("INSERT INTO cells (key, spec) VALUES (?, '1')", [(id,) for id in ids])
    connection.execute("INSERT INTO about VALUES ('title', '\"T\"')")
    connection.execute("UPDATE episodes SET ended = 'terminated', score = 0.5 WHERE id = 'a'")
    connection.commit()
    with ThreadPoolExecutor(4) as pool:  # of several that open it at once, one migrates
        list(pool.map(lambda _: Results.open(path).close(), range(4)))
    with Results.open(path) as results:
        assert [info.id for info in results.episodes()] == ids
        assert [(i.ended, i.score, i.rounds, i.owner) for i in results.episodes()] == [
            (None, None, 2, None),
            ("terminated", 0.5, 2, None),
            (None, None, 2, None),
        ]
        assert [cell.key for cell in results.cells()] == ids
        assert results.about == {"title": "T"}
        with results.reading() as session:
            context = MigrationContext.configure(
                session.connection(), opts={"version_table": VERSION_TABLE}
            )
            assert compare_metadata(context, Base.metadata) == []
            assert pragma(session, "integrity_check") == "ok"
            assert pragma(session, "foreign_key_check") is None
            tables = session.connection().exec_driver_sql("SELECT name FROM sqlite_master")
            assert not [name for (name,) in tables if "old" in name]


def test_a_file_whose_migration_fails_stays_as_it_was(old, monkeypatch):
    path = write(old, [round_2(1, temperature=2.0, evidence="sum")])
    dump = list(old[1].iterdump())
    monkeypatch.setitem(legacy.CARRIED, "cells", ("key, nothing", "rowid"))
    with pytest.raises(GoalscopeError, match="nothing"):
        Store.open(path)
    assert list(old[1].iterdump()) == dump
    assert old[1].execute("PRAGMA user_version").fetchone() == (2,)
    monkeypatch.undo()
    with Store.open(path) as store:
        assert len(store.rounds("e")) == 1
