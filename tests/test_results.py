"""Results on disk: each cell once, with its episode or not at all, and never of two codes mixed."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from goalscope.base.types import GoalscopeError
from goalscope.experiment.results import Results, cell_key
from goalscope.storage.store import round_to_json
from test_store import EPISODE, a_round, values_of

CODE = {"code": "aaa", "prompts": "bbb", "model tiny": "ccc"}
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=8,
)


@pytest.fixture
def results(tmp_path):
    with Results.open(tmp_path / "r.db") as opened:
        yield opened


def shuffled(value, chance):
    """The same JSON with its entries in another order."""
    if isinstance(value, list):
        return [shuffled(each, chance) for each in value]
    if isinstance(value, dict):
        keys = list(value)
        chance.shuffle(keys)
        return {key: shuffled(value[key], chance) for key in keys}
    return value


def an_episode(rounds=2, **changes):
    """What an episode's cell yields."""
    lines = [round_to_json(a_round(number)) for number in range(1, rounds + 1)]
    episode = {"begin": EPISODE, "rounds": lines, "ended": "terminated", "score": 0.5, **changes}
    return {"episode": episode, "score": 0.5}


@given(json_values, st.randoms(use_true_random=False))
def test_equal_specs_have_equal_keys_whatever_their_order(value, chance):
    spec = {"kind": "mcq", "row": value, "model": {}}
    assert cell_key(shuffled(spec, chance)) == cell_key(spec)
    assert cell_key({**spec, "model": {"model": "x"}}) != cell_key(spec)


def test_a_cell_is_planned_and_kept_exactly_once(results):
    first, second = results.plan([{"a": 1}, {"a": 2}])
    assert [cell.key for cell in results.plan([{"a": 2}, {"a": 2}, {"a": 1}])] == [
        second.key,
        first.key,
    ]
    results.keep(first.key, {"value": 1}, CODE)
    results.keep(first.key, {"value": 2}, {**CODE, "code": "zzz"})
    kept, empty = results.cells()
    assert (kept.result, kept.identity, kept.spec) == ({"value": 1}, CODE, {"a": 1})
    assert (empty.result, empty.identity, empty.error) == (None, None, None)


def test_an_episode_is_adopted_exactly_once_and_read_as_any_other(results):
    (cell,) = results.plan([{"kind": "episode"}])
    for _ in range(2):
        results.keep(cell.key, an_episode(), CODE)
    (info,) = results.episodes()
    assert results.cells()[0].result == {"episode": info.id, "score": 0.5}
    assert (info.ended, info.score, info.rounds) == ("terminated", 0.5, 2)
    assert [values_of(each) for each in results.rounds(info.id)] == [
        values_of(a_round(1)),
        values_of(a_round(2)),
    ]


@pytest.mark.parametrize(
    "broken",
    [
        an_episode() | {"score": float("nan")},  # found after the episode was written
        an_episode(ended="never"),
        an_episode(score=7),
        an_episode() | {"episode": {**an_episode()["episode"], "rounds": ["{}"]}},
    ],
)
def test_a_result_and_its_episode_come_together_or_not_at_all(results, broken):
    (cell,) = results.plan([{"kind": "episode"}])
    with pytest.raises((GoalscopeError, ValueError, KeyError)):
        results.keep(cell.key, broken, CODE)
    assert results.episodes() == []
    assert results.cells()[0].result is None
    results.keep(cell.key, an_episode(), CODE)
    assert len(results.episodes()) == 1


def test_attempts_count_and_a_result_takes_the_errors_place(results):
    (cell,) = results.plan([{"a": 1}])
    results.fail(cell.key, "luck")
    results.fail(cell.key, "no luck \ud800")
    (failed,) = results.cells()
    assert (failed.attempts, failed.error, failed.result) == (2, "no luck \\ud800", None)
    results.keep(cell.key, {"value": 1}, CODE)
    (kept,) = results.cells()
    assert (kept.attempts, kept.error) == (3, None)
    results.keep(cell.key, {"value": 2}, CODE)
    assert results.cells() == [kept]


def test_facts_are_kept_each_in_the_place_of_an_earlier_one(results):
    results.describe({"title": "One", "command": "a"})
    results.describe({"title": "Two \ud800"})
    assert results.about == {"title": "Two \ud800", "command": "a"}


def test_a_later_plan_with_the_same_settings_takes_the_place_of_the_earlier(results):
    def spec(row, seed):
        return {"kind": "mcq", "row": row, "model": {}, "seed": seed}

    results.ask_for(results.plan([spec(1, 0), spec(2, 0)]))
    results.ask_for(results.plan([spec(1, 7)]))  # other settings stand beside them
    results.ask_for(results.plan([spec(2, 0), spec(3, 0)]))
    asked = [(cell.spec["row"], cell.spec["seed"]) for cell in results.asked_for()]
    assert asked == [(2, 0), (1, 7), (3, 0)]
