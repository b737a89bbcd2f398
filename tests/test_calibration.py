"""Laws of the belief under a calibration; and which calibration goes with which model."""

import itertools
import json
import math
import re
from dataclasses import asdict, fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from goalscope.base.types import UNSPECIFIED, Goal, GoalscopeError, InvalidInputError
from goalscope.belief.belief import Belief, log_posteriors
from goalscope.belief.calibration import (
    DEFAULT,
    PAPER,
    SHIPPED,
    YOURS,
    Calibration,
    calibration_file,
    calibration_from_json,
    calibration_named,
    keep_calibration,
    known_calibration,
)
from goalscope.belief.likelihood import DEFAULT_LAYOUT
from goalscope.models.opening import ModelSet, open_model

share = st.floats(0, 1)
inside = st.floats(0.01, 0.99)
nats = st.floats(-50, 0)
anything = st.builds(
    Calibration,
    st.floats(0.1, 20),
    share,
    st.none() | inside,
    share | st.just(0.0) | st.just(1.0),
    share,
)


def goals(n: int) -> list[Goal]:
    return [Goal(f"goal {i}") for i in range(n)]


@st.composite
def beliefs(
    draw: st.DrawFn,
    calibrations: st.SearchStrategy[Calibration] = anything,
    values: st.SearchStrategy[float] = nats,
    least: int = 0,
    most: int = 5,
) -> Belief:
    """With Unspecified at any place."""
    g = draw(st.integers(1, most))
    support = draw(st.permutations([UNSPECIFIED, *goals(g)]))
    row = st.lists(values, min_size=g + 1, max_size=g + 1)
    belief = Belief(tuple(support), np.array(draw(row)), np.zeros((0, g + 1)), draw(calibrations))
    for _ in range(draw(st.integers(least, 4))):
        belief = belief.observe(draw(row))
    return belief


def softmax(values: np.ndarray) -> np.ndarray:
    weights = np.exp(values - values.max())
    return weights / weights.sum()


@given(beliefs(least=1, values=st.floats(-5, 0), most=2))
def test_switching_agrees_with_all_sequences_of_goals(belief: Belief) -> None:
    way = replace(belief.calibration, temperature=1.0, reference=0.0, prior_unspecified=None)
    prior, g = softmax(belief.log_prior), len(belief.goals)
    words, chances = np.exp(belief.log_likelihood), [0.0]
    now = prior
    for turn, row in enumerate(words):
        if turn:
            speaks = 1 - (now @ row) / (prior @ row)
            speaks *= speaks >= 0.01
            chances.append(way.switching * speaks**4)
        found = np.zeros(g)
        for path in itertools.product(range(g), repeat=turn + 1):
            weight = prior[path[0]] * words[range(turn + 1), path].prod()
            for s, (before, after) in zip(chances[1:], itertools.pairwise(path), strict=True):
                weight *= (1 - s) * (before == after) + s * prior[after]
            found[path[-1]] += weight
        now = found / found.sum()
    exact = replace(belief, calibration=way).probability
    assert exact == pytest.approx(now, abs=1e-9)


@given(beliefs(), nats)
def test_words_that_say_nothing_change_nothing(belief: Belief, value: float) -> None:
    way = replace(belief.calibration, switching=min(belief.calibration.switching, 0.99))
    belief = replace(belief, calibration=way)
    for said in (
        belief.observe(np.full(len(belief.goals), value)),
        belief.observe(np.arange(len(belief.goals)), weight=0.0),
    ):
        assert said.probability == pytest.approx(belief.probability, abs=1e-9)


@given(st.floats(0.001, 0.4), st.integers(2, 5), st.integers(1, 40), st.floats(1, 1e5))
def test_after_a_change_of_mind_a_goal_leads_as_soon_however_far_it_trailed(
    switching: float, g: int, turns: int, behind: float
) -> None:
    each = 2.0  # nats for the new goal, a turn
    trails = math.exp(-each)
    chance = switching * (1 - trails / (1 / g + (1 - 1 / g) * trails)) ** 4
    enough = math.floor(math.log(g / chance) / each) + 1
    rows = [[0.0] + [-behind] * (g - 1)] * turns
    rows += [[-each, 0.0] + [-each] * (g - 2)] * enough
    tables = [
        Belief(tuple(goals(g)), np.zeros(g), np.array(rows), way)
        for way in (Calibration(switching=switching), PAPER)
    ]
    moved, stuck = (table.log_posterior for table in tables)
    assert moved.argmax() == 1
    if turns * behind > enough * each:
        assert stuck.argmax() == 0


@given(anything, st.integers(1, 3), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_many_dialogues_at_once_are_as_each_by_itself(
    calibration: Calibration, turns: int, g: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    prior, table = -rng.exponential(2, (2, 3, g + 1)), -rng.exponential(9, (2, 3, turns, g + 1))
    stated = np.arange(g + 1) != rng.integers(g + 1)
    found = log_posteriors(prior, table, stated, calibration)
    assert found.shape == (2, 3, turns + 1, g + 1)
    for i, j in np.ndindex(2, 3):
        support = [goal if is_stated else UNSPECIFIED
                   for goal, is_stated in zip(goals(g + 1), stated, strict=True)]  # fmt: skip
        alone = Belief(tuple(support), prior[i, j], table[i, j], calibration)
        assert found[i, j] == pytest.approx(alone.log_posteriors)


@given(beliefs(), st.data())
def test_a_goal_that_comes_late_stands_where_it_would_from_the_start(belief: Belief, data) -> None:
    flat = replace(belief, log_prior=np.zeros(len(belief.goals)))
    late = data.draw(st.sampled_from(flat.goals))
    place = flat.goals.index(late)
    back = flat.drop([late]).add([late], lambda new: flat.log_likelihood[:, [place]])
    assert dict(back.top()) == pytest.approx(dict(flat.top()))


@given(beliefs(), share)
def test_a_conformal_set_holds_the_top_goal_and_all_above_the_threshold(
    belief: Belief, threshold: float
) -> None:
    known = replace(belief.calibration, thresholds=((0.05, 0.0), (0.1, threshold)))
    belief = replace(belief, calibration=known)
    ranked = [goal for goal, _ in belief.top()]
    named = belief.conformal_set()
    assert named == belief.conformal_set(0.1) == tuple(ranked[: len(named)])
    over = {goal for goal, p in belief.top() if p >= threshold}
    tied = {goal for goal, p in belief.top() if p == belief.top(1)[0][1]}
    assert set(named) == (set(ranked) if belief.is_degenerate else over | tied)
    assert belief.conformal_set(0.05) == tuple(ranked)


def test_a_conformal_set_takes_the_threshold_of_eps_or_the_next_smaller_one() -> None:
    way = Calibration(thresholds=((0.1, 0.0), (0.2, 0.6)))
    belief = Belief.uniform(goals(2), way).observe([0.0, -1.0])
    assert belief.conformal_set(1 - 0.9) == belief.conformal_set(0.19) == tuple(goals(2))
    assert belief.conformal_set(0.2) == belief.conformal_set(0.5) == (goals(2)[0],)
    with pytest.raises(ValueError, match=r"eps = 0\.05; `goalscope calibrate`"):
        belief.conformal_set(0.05)
    with pytest.raises(InvalidInputError, match=r"eps = 0\.1; `goalscope calibrate`"):
        Belief.uniform(goals(2)).conformal_set()
    for bad in (2, 0, math.nan):
        with pytest.raises(InvalidInputError, match="eps must be a number between 0 and 1"):
            belief.conformal_set(bad)


@pytest.mark.parametrize(
    ("field", "values"),
    [
        ("temperature", [0.0, -1.0, math.nan, math.inf]),
        *[
            (name, [-0.01, 1.01, math.nan])
            for name in ("reference", "switching", "aside", "orders")
        ],
        ("prior_unspecified", [0.0, 1.0, -0.5, math.nan]),
        ("thresholds", [((0.1, 1.5),), ((-0.1, 0.5),), ((0.1, math.nan),)]),
    ],
)
def test_numbers_out_of_their_range_are_refused(field: str, values: list) -> None:
    for value in values:
        with pytest.raises(InvalidInputError, match=field.removesuffix("s")):
            Calibration(**{field: value})


@given(anything, st.integers(0, 999), st.lists(st.tuples(share, share), max_size=3).map(tuple))
def test_json_gives_it_back(calibration: Calibration, n: int, thresholds) -> None:
    calibration = replace(calibration, n=n, thresholds=thresholds)
    assert calibration_from_json(json.loads(json.dumps(asdict(calibration)))) == calibration


FIELDS = [each.name for each in fields(Calibration)]


@pytest.mark.parametrize(
    ("changed", "cause"),
    [
        *[({name: ...}, f"the key '{name}' is missing") for name in FIELDS],
        *[({name: "2"}, f"'{name}' must be") for name in FIELDS],
        *[({name: True}, f"'{name}' must be") for name in FIELDS],
        *[({name: None}, f"'{name}' must be") for name in FIELDS if name != "prior_unspecified"],
        *[({name: -1}, "must") for name in FIELDS],
        ({"n": 1.5}, "'n' must be a whole number"),
        ({"thresholds": [0.1]}, "thresholds 1 must be a list, not 0.1"),
        ({"thresholds": [[0.1, "0.5"]]}, "must be a number, not '0.5'"),
        ({"thresholds": [[0.1, 1.5]]}, "threshold must lie between 0 and 1, not be 1.5"),
        ({"warmth": 2}, "warmth"),
    ],
)
def test_what_is_wrong_with_a_calibration_file_is_named(tmp_path: Path, changed, cause) -> None:
    file = tmp_path / "mine.json"
    values = {**asdict(DEFAULT), **changed}
    data = {key: value for key, value in values.items() if value is not ...}
    file.write_text(json.dumps({"calibration": data}))
    with pytest.raises(InvalidInputError, match=re.escape(cause)) as caught:
        calibration_named(str(file))
    assert str(file) in str(caught.value)
    assert "write one with `goalscope calibrate" in str(caught.value)


def test_names_and_files_name_calibrations(tmp_path: Path) -> None:
    names = {"paper": PAPER, "default": DEFAULT}
    assert {name: calibration_named(name) for name in names} == names
    assert Calibration(1.0, 0.0, None, 0.0, 0.0, 1.0) == PAPER
    mine = Calibration(3.0, 0.2, 0.4, 0.01, 12.0, 0.1, 0.3, 7, ((0.1, 0.2),))
    keep_calibration(tmp_path / "new" / "mine.json", mine, {"model": "m"})
    assert calibration_named(str(tmp_path / "new" / "mine.json")) == mine
    assert json.loads((tmp_path / "new" / "mine.json").read_text())["model"] == "m"
    with pytest.raises(InvalidInputError, match="paper, default"):
        calibration_named("papr")
    with pytest.raises(GoalscopeError, match="Cannot write"):
        keep_calibration(tmp_path, mine, {})


@pytest.mark.parametrize(
    "text",
    [
        "no JSON",
        "[]",
        "{}",
        '{"calibration": 7}',
        '{"calibration": [1, 2]}',
        b"\xff\xfe",
        json.dumps({"calibration": asdict(DEFAULT) | {"odd\n\u2028\x7fkey": 1}}),
    ],
)
def test_a_file_that_holds_no_calibration_is_named_in_one_line(tmp_path: Path, text) -> None:
    file = tmp_path / "broken.json"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InvalidInputError, match=r"broken\.json is not a calibration") as caught:
        calibration_named(str(file))
    assert str(caught.value).isprintable()


SCORER = SimpleNamespace(name="nobody's", adapter=None)


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's data folder."""
    monkeypatch.setattr("platformdirs.user_data_path", lambda *_: tmp_path / "data")
    return tmp_path / "data"


def known(scorer=SCORER, layout: str = "goal-last") -> Calibration:
    return known_calibration(scorer, layout)[0]


def test_a_model_has_the_users_calibration_or_the_shipped_one_or_the_usual(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, origin = known_calibration(SCORER, "goal-last")
    assert found == DEFAULT
    assert "goalscope calibrate" in origin
    file = calibration_file(SCORER, "goal-last")
    assert file.is_relative_to(own)
    monkeypatch.setattr("goalscope.belief.calibration.files", lambda _: tmp_path / "shipped")
    keep_calibration(
        tmp_path / "shipped/calibrations" / file.name, replace(DEFAULT, temperature=3.0), {}
    )
    assert known() == replace(DEFAULT, temperature=3.0)
    keep_calibration(file, replace(DEFAULT, temperature=4.0), {})
    found, origin = known_calibration(SCORER, "goal-last")
    assert (found.temperature, origin) == (4.0, YOURS)
    file.write_text("{}")
    with pytest.raises(InvalidInputError, match="Delete it"):
        known()


def test_a_calibration_is_of_one_model_with_its_adapter_and_prompt(
    own: Path, tmp_path: Path
) -> None:
    one, same, other = (tmp_path / name for name in ("one.gguf", "same.gguf", "other.gguf"))
    one.write_bytes(b"a")
    same.write_bytes(b"a")
    other.write_bytes(b"b")
    adapted = SimpleNamespace(name=SCORER.name, adapter=one)
    forgets = Calibration(switching=0.9)
    keep_calibration(calibration_file(adapted, "goal-last"), forgets, {})
    assert known(adapted) == forgets
    assert known(SimpleNamespace(name=SCORER.name, adapter=same)) == forgets
    for unlike in (SCORER, SimpleNamespace(name=SCORER.name, adapter=other),
                   SimpleNamespace(name="another", adapter=one)):  # fmt: skip
        assert known(unlike) == DEFAULT
    assert known(adapted, "goal-first") == DEFAULT
    keep_calibration(calibration_file(SCORER, "goal-last"), PAPER, {})
    assert known(SimpleNamespace(name=SCORER.name)) == PAPER  # served models have no adapter


@pytest.mark.parametrize("adapter", ["none", None])
def test_the_embedded_model_is_calibrated_with_its_adapter_and_without(adapter) -> None:
    opened = open_model(adapter=adapter)
    scorer = opened.speaker if isinstance(opened, ModelSet) else opened
    found, where = known_calibration(scorer, DEFAULT_LAYOUT)
    assert where == SHIPPED
    assert found.thresholds
    assert found.n > 0


def test_tests_see_none_of_the_calibrations_of_this_machine(data_folder: Path) -> None:
    file = calibration_file(SCORER, "goal-last")
    assert file.is_relative_to(data_folder)
    assert not file.parent.exists()
