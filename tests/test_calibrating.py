"""Calibrations fitted to dialogues whose true one is known: people who move about their goals."""

import math
import sys
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from goalscope.base.types import UNSPECIFIED, Goal, GoalscopeError, InvalidInputError
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import DEFAULT, PAPER, Calibration
from goalscope.experiment import fit_calibration as calibrating
from goalscope.experiment.fit_calibration import (
    EPSILONS,
    FOLDS,
    LISTED,
    Observed,
    Tables,
    fit_calibration,
    observed_in,
    quality,
)

pytest.importorskip("scipy.optimize")

SPREAD = 1.5  # of the goals, which lie on a plane


def drawn(
    rng: np.random.Generator, id: str, *, factor: float = 1.0, origin: str = "s", goals: int = 5,
    turns: int = 4, group: str | None = None,
) -> Observed:  # fmt: skip
    """A dialogue to which `Calibration(factor, prior_unspecified=1 - LISTED)` is exact.

    Each turn is a place about that of the true goal, and without a goal each is expected where the
    ones before it lie. Where it is left out, the others say nothing.
    """
    places = rng.normal(0, SPREAD, (goals, 2))
    truth = int(rng.integers(goals))
    said = places[truth] + rng.normal(0, 1, (turns, 2))
    known = -((said[:, None] - places) ** 2).sum(-1) / 2 - math.log(2 * math.pi)
    before = np.arange(turns)
    variance = 1 / (1 / SPREAD**2 + before)
    centre = (np.cumsum(said, 0) - said) * variance[:, None]
    wide = 1 + variance
    unknown = -((said - centre) ** 2).sum(-1) / 2 / wide - np.log(2 * math.pi * wide)
    return Observed(id, group or id, origin, factor * known, factor * unknown, (truth,) * turns)


def some(n: int, seed: int = 0, **more) -> list[Observed]:
    rng = np.random.default_rng(seed)
    return [drawn(rng, f"{seed} {i}", **more) for i in range(n)]


def believed(dialogue: Observed, left_out: int, calibration: Calibration) -> Belief:
    names = [Goal(f"goal {i}") for i in range(dialogue.goals.shape[1])]
    belief = Belief.uniform([*names, UNSPECIFIED], calibration)
    table = np.column_stack([dialogue.goals, dialogue.unspecified])
    return replace(belief, log_likelihood=table).drop([names[left_out]])


CALIBRATIONS = [PAPER, DEFAULT, Calibration(3.0, 0.7, 0.2, 0.3)]


@pytest.mark.parametrize("calibration", CALIBRATIONS)
def test_tables_hold_each_dialogue_with_its_true_goal_and_without(calibration) -> None:
    found = [drawn(np.random.default_rng(i), str(i), goals=4 + i, turns=3 + i) for i in range(3)]
    tables = Tables(found)
    beliefs = tables.believe(calibration)
    for i, dialogue in enumerate(found):
        turns, goals = dialogue.goals.shape
        true = Goal(f"goal {dialogue.truths[0]}")
        rests = {
            out: believed(dialogue, out, calibration)
            for out in range(goals)
            if out != dialogue.truths[0]
        }
        same = [
            rest
            for rest in rests.values()
            if beliefs[0, i, :turns, 1]
            == pytest.approx(rest.log_posteriors[1:, rest.goals.index(true)])
        ]
        assert len(same) == 1  # one of the wrong goals was left out
        gone = believed(dialogue, dialogue.truths[0], calibration)
        place = gone.goals.index(UNSPECIFIED)
        assert beliefs[1, i, :turns, 0] == pytest.approx(gone.log_posteriors[1:, place])
        for rest, held in zip((*same, gone), beliefs[:, i], strict=True):
            for turn in range(turns):
                row = rest.log_posteriors[turn + 1]
                assert sorted(held[turn, :goals]) == pytest.approx(sorted(row))
                assert np.isneginf(held[turn, goals:]).all()
        own = LISTED * beliefs[0, i, :turns, 1] + (1 - LISTED) * beliefs[1, i, :turns, 0]
        assert tables.losses(beliefs)[i] == pytest.approx(-own.mean())
        odds = [p - math.log1p(-math.exp(p)) for p in beliefs[:, i, turns - 1, 0]]
        assert tables.last_odds(beliefs)[:, i] == pytest.approx(odds)
        named, true_one = tables.drawn_turn(beliefs)
        assert 0 <= tables.drawn[i] < turns
        assert named[:, i] == pytest.approx(np.exp(beliefs[:, i, tables.drawn[i]]))
        assert true_one[:, i].tolist() == [named[0, i, 1], named[1, i, 0]]


def test_the_turn_that_is_drawn_is_any_turn() -> None:
    assert set(Tables(some(60)).drawn) == {0, 1, 2, 3}


def test_dialogues_beside_it_change_nothing_for_a_dialogue() -> None:
    rng = np.random.default_rng(1)
    found = [drawn(rng, str(i), goals=3 + i, turns=1 + 2 * i) for i in range(3)]
    for calibration in CALIBRATIONS:
        together = Tables(found)
        losses = together.losses(together.believe(calibration))
        alone = [Tables([each]).log_loss(calibration) for each in found]
        assert losses == pytest.approx(alone)


@pytest.mark.parametrize("calibration", CALIBRATIONS)
def test_all_sets_count_the_same_whatever_their_size(calibration) -> None:
    one, other = some(3, origin="one"), some(20, seed=1, origin="other")
    mean = np.mean([Tables(each).log_loss(calibration) for each in (one, other)])
    assert Tables([*one, *other]).log_loss(calibration) == pytest.approx(mean)
    losses = [Tables([each]).log_loss(calibration) for each in one]
    assert Tables(one).log_loss(calibration) == pytest.approx(np.mean(losses))


@pytest.mark.parametrize("factor", [0.7, 3.0, 6.0])
def test_the_temperature_is_found_that_the_evidence_was_multiplied_by(factor: float) -> None:
    found = some(300, factor=factor)
    made = fit_calibration(found)
    assert made.temperature == pytest.approx(factor, rel=0.12)
    assert made.reference < 0.1
    assert made.switching == DEFAULT.switching > 0
    assert (made.n, made.prior_unspecified, made.similarity) == (300, pytest.approx(0.2), 0)
    true = Calibration(factor, prior_unspecified=0.2, switching=DEFAULT.switching)
    assert Tables(found).log_loss(made) == pytest.approx(Tables(found).log_loss(true), abs=0.005)


def test_the_share_of_the_other_goals_is_found_that_was_taken_from_unspecified(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Observed, "with_fewer_goals", lambda each: each)  # it is the mean of all
    share = 0.4
    counted = share * (1 - 1 / 12)
    taken = [
        replace(each, unspecified=(each.unspecified - counted * each.goals.mean(1)) / (1 - counted))
        for each in some(200, goals=12)
    ]
    made = fit_calibration(taken)
    assert made.reference == pytest.approx(share, abs=0.08)
    assert made.temperature == pytest.approx(1, abs=0.12)


def test_lists_of_all_lengths_calibrate_and_keep_what_is_true() -> None:
    found = [each.with_fewer_goals() for each in some(200, goals=12)]
    assert {each.goals.shape[1] for each in found} == {*range(3, 13)}
    for fewer, whole in zip(found, some(200, goals=12), strict=True):
        (place,), (before,) = fewer.true, whole.true
        assert fewer.goals[:, place].tolist() == whole.goals[:, before].tolist()
        assert fewer.unspecified.tolist() == whole.unspecified.tolist()


def test_the_similarity_is_found_that_was_taken_from_the_evidence() -> None:
    rng, taken = np.random.default_rng(3), []
    for each in some(300, factor=2.0):
        likeness = rng.normal(0, 0.2, each.goals.shape)
        taken.append(replace(each, goals=each.goals - 15 * likeness, likeness=likeness))
    made = fit_calibration(taken)
    assert made.similarity == pytest.approx(15, rel=0.12)
    assert made.temperature == pytest.approx(2, rel=0.12)


def test_where_goals_change_or_are_not_listed_each_turn_has_its_truth() -> None:
    rng = np.random.default_rng(4)
    goals, unspecified = rng.normal(size=(3, 4)), rng.normal(size=3)
    found = Observed("a", "a", "s", goals, unspecified, (2, None, 0))
    tables = Tables([found, *some(3)])
    beliefs = tables.believe(PAPER)
    for kind, width in enumerate((4, 3)):  # Unspecified, the true ones, and the wrong ones
        assert np.isfinite(beliefs[kind, 0, 0, :width]).all()
        assert np.isneginf(beliefs[kind, 0, 0, width:]).all()
    assert tables.truth[:, 0, :3].tolist() == [[1, 0, 2], [0, 0, 0]]
    assert tables.listed[0]
    nothing = Observed("b", "b", "s", goals, unspecified, (None,) * 3)
    assert not Tables([nothing, *some(3)]).listed[0]
    assert not Tables([nothing, found]).listed[0]  # as many goals as any, and all of them wrong
    assert quality([nothing, *some(9)], PAPER).n == 10


def test_conformal_sets_hold_the_truth_in_as_many_new_dialogues_as_they_say() -> None:
    made = fit_calibration(some(600, factor=2.0, turns=3))
    assert [eps for eps, _ in made.thresholds] == list(EPSILONS)
    values = [p for _, p in made.thresholds]
    assert values == sorted(values)
    new, rng = some(400, seed=9, factor=2.0, turns=3), np.random.default_rng(5)
    for eps in (0.05, 0.1, 0.2):
        held = {True: 0, False: 0}
        for each, present in product(new, held):
            wrong = [i for i in range(each.goals.shape[1]) if i != each.truths[0]]
            belief = believed(each, int(rng.choice(wrong)) if present else each.truths[0], made)
            turn = rng.integers(len(each.goals))
            then = replace(belief, log_likelihood=belief.log_likelihood[: turn + 1])
            true = Goal(f"goal {each.truths[0]}") if present else UNSPECIFIED
            held[present] += true in then.conformal_set(eps)
        band = 2.576 * math.sqrt(eps * (1 - eps) * (1 / len(new) + 1 / 600))  # 99 %
        least = min(held.values()) / len(new)
        assert least == pytest.approx(1 - eps, abs=band)


def test_too_few_dialogues_for_a_threshold_name_every_goal() -> None:
    thresholds = dict(fit_calibration(some(18)).thresholds)
    assert [thresholds[eps] for eps in (0.01, 0.02, 0.05)] == [0, 0, 0]
    assert 0 < thresholds[0.1] < thresholds[0.2]


def test_one_group_is_too_few() -> None:
    found = some(8, group="a")
    with pytest.raises(InvalidInputError, match="at least three"):
        fit_calibration(found)
    with pytest.raises(InvalidInputError, match="at least three"):
        quality(found, PAPER)


def test_quality_is_that_of_all_dialogues_and_sets() -> None:
    found = [*some(30, origin="one"), *some(10, seed=1, origin="other")]
    for calibration in CALIBRATIONS:
        made = quality(found, calibration)
        assert (made.n, made.coverage, made.size) == (40, None, None)
        tables = Tables(found)
        assert made.log_loss == pytest.approx(tables.log_loss(calibration))
        present, absent = tables.last_odds(tables.believe(calibration))
        wins = [a > p for i, a in enumerate(absent) for j, p in enumerate(present) if i != j]
        assert made.auroc == pytest.approx(np.mean(wins))


def test_sets_of_quality_hold_what_is_at_the_threshold_or_one_goal() -> None:
    found = some(20)
    tables, calibration = Tables(found), replace(DEFAULT, prior_unspecified=0.3)
    named, true = tables.drawn_turn(tables.believe(calibration))
    for threshold in (0.0, 0.2, 0.7):
        made = quality(found, replace(calibration, thresholds=((0.1, threshold),)))
        inside = (true >= threshold) | (true >= named.max(-1))
        assert made.coverage == pytest.approx(inside.mean(1))
        assert made.size == pytest.approx((named >= threshold).sum(-1).clip(1).mean())


@pytest.mark.parametrize("count", [7, 3])
def test_what_is_held_out_is_judged_by_dialogues_of_other_groups(count: int, monkeypatch) -> None:
    found = [replace(each, group=f"g{i % count}") for i, each in enumerate(some(28))]
    trained = []

    def recorded(dialogues):
        trained.append({each.id for each in dialogues})
        return replace(DEFAULT, temperature=1.0 + len(trained))

    monkeypatch.setattr(calibrating, "fit_calibration", recorded)
    made = quality(found)
    assert len(trained) == min(FOLDS, count)
    groups = {each.id: each.group for each in found}
    out = [groups.keys() - ids for ids in trained]
    assert sorted(id for ids in out for id in ids) == sorted(groups)
    for ids, rest in zip(trained, out, strict=True):
        assert not {groups[id] for id in ids} & {groups[id] for id in rest}
    loss = sum(
        Tables([each for each in found if each.id in ids]).log_loss(
            replace(DEFAULT, temperature=2.0 + i)
        )
        * len(ids)
        for i, ids in enumerate(out)
    )
    assert made.log_loss == pytest.approx(loss / len(found))


def cell(id: str, *, goals: int = 3, kind: str = "dialogue", **result):
    case = {"id": id, "group": "g", "truth": 1, "goals": ["x"] * goals, "turns": [{}] * 2}
    table = [[-1.0 * i - t for i in range(goals)] for t in range(2)]
    spec = {"kind": kind, "set": "teach", "split": "valid", "goal_set": "hard", "case": case}
    return spec, {"role-play": table, "unspecified": [-1.0, -2.0], **result}


def test_dialogues_are_read_from_cells_and_others_are_passed_over() -> None:
    (found,) = observed_in([
        cell("a"),
        cell("two", goals=2),
        cell("not run", **{"role-play": None}),
        cell("of another kind", kind="mcq"),
    ])  # fmt: skip
    assert (found.id, found.group, found.origin, found.truths) == (
        "a",
        "teach g",
        "teach hard",
        [1, 1],
    )
    assert found.goals.tolist() == [[0, -1, -2], [-1, -2, -3]]
    assert found.unspecified.tolist() == [-1, -2]


def test_without_scipy_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy.optimize", None)
    with pytest.raises(GoalscopeError, match=r"goalscope\[experiments\]"):
        fit_calibration(some(4))
