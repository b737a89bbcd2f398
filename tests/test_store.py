"""What the store promises: exact rounds, kept rounds, and one-line errors."""

import json
import os
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from databases import begin
from goalscope.agent.round import Guess, Round
from goalscope.base.types import (
    Action,
    Goal,
    GoalChange,
    GoalscopeError,
    InvalidInputError,
    StepResult,
    Turn,
)
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import Calibration
from goalscope.language.orders import Order, Reading
from goalscope.storage.opening import default_place
from goalscope.storage.store import Store, round_from_json, round_to_json

EPISODE = {"domain": "grocery", "method": "good", "model": "m", "task": "Sell."}
# Any text a program can hold: control characters, NUL, and lone low surrogates.
texts = st.text(st.characters() | st.sampled_from("\udc80\udfff\x00\x1b\n"), max_size=20)
nats = st.floats(max_value=0, allow_nan=False) | st.just(-np.inf)
goals = st.builds(Goal, texts)
guesses = st.builds(Guess, texts, texts)
actions = st.builds(Action, texts, texts, st.integers(-9, 99))

quantities = st.none() | st.floats(-99, 99)
orders = st.builds(
    Order, st.sampled_from(["add", "avoid"]), texts, quantities, texts, texts, texts, texts, texts
)
several_orders = st.lists(orders, max_size=2).map(tuple)


@st.composite
def readings(draw):
    read = draw(several_orders)
    margins = st.lists(st.floats(0, 9), min_size=len(read), max_size=len(read)).map(tuple)
    return Reading(read, draw(st.none() | st.floats(-99, 0)), draw(st.none() | margins))


shares = st.floats(0, 1)
calibrations = st.builds(
    Calibration,
    st.floats(1e-3, 1e3),
    shares,
    st.none() | st.floats(0.01, 0.99),
    shares,
    st.floats(0, 99),
    shares,
    shares,
    st.integers(0, 9),
    st.lists(st.tuples(shares, shares), max_size=2).map(tuple),
)


@st.composite
def beliefs(draw):
    support = tuple(draw(st.lists(goals, unique=True, max_size=4)))
    t = draw(st.integers(0, 3))
    prior = draw(hnp.arrays(np.float64, len(support), elements=nats))
    table = draw(hnp.arrays(np.float64, (t, len(support)), elements=nats))
    pinned = ()
    if support:
        one = st.tuples(st.integers(0, t), st.sampled_from(support))
        pinned = draw(st.lists(one, max_size=2).map(tuple))
    weights = tuple((turn, draw(shares)) for turn in range(t) if draw(st.booleans()))
    return Belief(
        support,
        prior,
        table,
        draw(calibrations),
        pinned,
        weights=weights,
        inferred=draw(st.booleans()),
    )


rounds = st.builds(
    Round,
    number=st.integers(1, 99),
    turn=st.builds(Turn, texts, texts),
    belief=beliefs(),
    changes=st.lists(
        st.builds(
            GoalChange, st.sampled_from(["added", "removed", "pinned"]), goals, texts, st.booleans()
        ),
        max_size=3,
    ).map(tuple),
    results=st.lists(
        st.builds(StepResult, actions, st.booleans(), texts, st.booleans()), max_size=3
    ).map(tuple),
    replans=st.integers(0, 3),
    status=texts,
    notes=st.lists(texts, max_size=2).map(tuple),
    terminated=st.booleans(),
    question=texts,
    reading=st.none() | readings(),
    pending=several_orders,
    released=several_orders,
    state=texts,
    retracts=st.lists(st.integers(1, 9), max_size=2).map(tuple),
    reversals=st.integers(0, 3),
    guessed=st.lists(guesses, max_size=2).map(tuple),
    given_up=st.lists(guesses, max_size=2).map(tuple),
)


def a_round(number=1, **changes):
    belief = Belief.uniform([Goal("make tea"), Goal("bake")]).observe([-1.5, -np.inf])
    values = {
        "number": number,
        "turn": Turn("What else?", "Milk"),
        "belief": belief,
        "changes": (GoalChange("added", Goal("bake"), "asked for flour"),),
        "results": (StepResult(Action("add item", "Milk", 2), True, "Added."),),
        "replans": 0,
        "status": "Basket: 2 x Milk",
        "notes": (),
        "terminated": False,
    }
    return Round(**(values | changes))


def values_of(round):
    """Everything in a round as plain values that `==` compares exactly."""
    belief = (
        round.belief.goals,
        round.belief.log_prior.tobytes(),
        round.belief.log_likelihood.shape,
        round.belief.log_likelihood.tobytes(),
        round.belief.calibration,
        round.belief.pinned,
        round.belief.ruled_out,
        round.belief.weights,
        round.belief.inferred,
    )
    return [
        belief if name == "belief" else getattr(round, name) for name in Round.__dataclass_fields__
    ]


@given(rounds)
def test_a_round_survives_the_json_exactly(round):
    assert values_of(round_from_json(round_to_json(round))) == values_of(round)


def test_the_json_is_strict():
    def refuse(constant):
        raise AssertionError(constant)

    json.loads(round_to_json(a_round()), parse_constant=refuse)


def test_a_mistyped_file_is_no_new_store(tmp_path):
    with pytest.raises(InvalidInputError, match="There is no store at"):
        Store.open(tmp_path / "typo.db", new=False)
    assert not [*tmp_path.iterdir()]


@pytest.mark.skipif(os.name == "nt", reason="files there have no such rights")
def test_what_people_said_is_for_the_owner_alone_until_they_open_it(tmp_path):
    file = tmp_path / "e.db"
    with Store.open(file) as store:
        begin(store, **EPISODE)
        assert {each.stat().st_mode & 0o777 for each in tmp_path.iterdir()} == {0o600}
    file.chmod(0o640)
    Store.open(file).close()
    assert file.stat().st_mode & 0o777 == 0o640


def test_nan_is_refused(place):
    with Store.open(place) as store:
        with pytest.raises(GoalscopeError, match="cannot be stored"):
            begin(store, **EPISODE, settings={"temperature": float("nan")})
        id = begin(store, **EPISODE)
        with pytest.raises(ValueError, match="score"):
            store.finish(id, ended="terminated", score=float("nan"))


def test_what_was_stored_is_read_back_by_another_process(place):
    with Store.open(place) as store:
        id = begin(store, **EPISODE, profile="baker", settings={"k": 3})
        store.append(id, a_round(1))
        store.append(id, a_round(2, belief=Belief.uniform(())))
        store.finish(id, ended="terminated", score=0.5)
    with Store.open(place) as store:
        (info,) = store.episodes()
        assert (info.id, info.profile, info.settings) == (id, "baker", {"k": 3})
        assert (info.ended, info.score, info.rounds) == ("terminated", 0.5, 2)
        stored = store.rounds(id)
    assert [values_of(r) for r in stored] == [
        values_of(a_round(1)),
        values_of(a_round(2, belief=Belief.uniform(()))),
    ]


def test_a_unique_prefix_finds_an_episode_and_an_unknown_id_names_the_nearest(place):
    with Store.open(place) as store:
        id = begin(store, **EPISODE)
        assert store.episode(id[:3]).id == id
        wrong = id[:-1] + "x"
        with pytest.raises(InvalidInputError, match=f"(?s){id}.*goalscope episodes"):
            store.rounds(wrong)
        with pytest.raises(InvalidInputError, match="No episode"):
            store.rounds("")
        ids = [begin(store, **EPISODE) for _ in range(17)]  # 16 first letters
        twice = next(id[0] for id in ids if sum(i[0] == id[0] for i in ids) > 1)
        with pytest.raises(InvalidInputError, match="More than one"):
            store.episode(twice)


def test_a_round_is_never_overwritten(place):
    with Store.open(place) as store:
        id = begin(store, **EPISODE)
        store.append(id, a_round(1))
        with pytest.raises(GoalscopeError, match="another window"):
            store.append(id, a_round(1, status="other"))
        with pytest.raises(GoalscopeError, match="unknown"):
            store.append("nobody", a_round(1))
        assert store.rounds(id)[0].status == "Basket: 2 x Milk"


def test_another_programs_file_is_left_alone(tmp_path):
    with_connection(tmp_path / "s.db", "CREATE TABLE theirs (x)")
    before = (tmp_path / "s.db").read_bytes()
    with pytest.raises(GoalscopeError, match="another program"):
        Store.open(tmp_path / "s.db")
    assert (tmp_path / "s.db").read_bytes() == before


def test_a_full_disk_keeps_the_earlier_rounds(tmp_path):
    with Store.open(tmp_path / "s.db") as store:
        id = begin(store, **EPISODE)
        store.append(id, a_round(1))
        with store.reading() as connection:  # the pool has but this connection
            pragma(connection, f"max_page_count = {pragma(connection, 'page_count')}")
        with pytest.raises(GoalscopeError, match="disk is full"):
            store.append(id, a_round(2, status="x" * 100_000))
        assert [r.number for r in store.rounds(id)] == [1]


def test_a_damaged_file_is_explained(tmp_path):
    (tmp_path / "text.db").write_text("no database at all, only words " * 99)
    with pytest.raises(GoalscopeError, match="not a SQLite file"):
        Store.open(tmp_path / "text.db")


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE sqlite_master SET sql = sql || ' FANCY'",
        "UPDATE sqlite_master SET rootpage = 99999",
        "DELETE FROM sqlite_master",  # but the table's index
    ],
)
def test_a_damaged_schema_is_called_damaged_and_no_comfort_is_given(tmp_path, change):
    file = tmp_path / "s.db"
    Store.open(file).close()
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("PRAGMA writable_schema = ON")
        connection.execute(f"{change} WHERE name = 'about'")
        connection.commit()
    with pytest.raises(GoalscopeError, match=r"It is damaged: move it away.*created.$"):
        Store.open(file)


def test_a_path_that_cannot_be_used_is_explained(tmp_path):
    with pytest.raises(GoalscopeError, match="name another file"):
        Store.open(tmp_path)  # a folder
    (tmp_path / "file").touch()
    with pytest.raises(GoalscopeError, match="--store"):
        Store.open(tmp_path / "file" / "s.db")


@pytest.mark.parametrize("json", ["{}", "{", "[]"])
def test_a_damaged_round_is_explained_and_harms_no_other_episode(tmp_path, json):
    with Store.open(tmp_path / "s.db") as store:
        damaged, whole = (begin(store, **EPISODE) for _ in range(2))
        for id in (damaged, whole):
            store.append(id, a_round(1))
    with_connection(
        tmp_path / "s.db", f"UPDATE rounds SET json = '{json}' WHERE episode = '{damaged}'"
    )
    with Store.open(tmp_path / "s.db") as store:
        assert [each.rounds for each in store.episodes()] == [1, 1]
        assert values_of(store.rounds(whole)[0]) == values_of(a_round(1))
        with pytest.raises(GoalscopeError, match=damaged):
            store.rounds(damaged)


def test_the_environment_variable_names_the_file(tmp_path, monkeypatch):
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "mine.db"))
    assert default_place() == str(tmp_path / "mine.db")
    monkeypatch.delenv("GOALSCOPE_STORE")
    assert Path(default_place()).name == "episodes.db"


def pragma(connection, name):
    return connection.exec_driver_sql(f"PRAGMA {name}").scalar()


def with_connection(path, statement):
    connection = sqlite3.connect(path)
    connection.execute(statement)
    connection.commit()
    connection.close()
