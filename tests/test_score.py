"""The score pays for needs alone: laws of the formula, and what looking at nobody earns."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes import NamedModel
from goalscope.agent.settings import Settings
from goalscope.base.types import Action, InvalidInputError, Profile
from goalscope.envs import Environment, Outcome
from goalscope.envs.registry import HOUSE, SHOP, domain_named, open_environment, profiles_of
from goalscope.experiment.measure import trivial_figures
from goalscope.storage.session import Session
from goalscope.storage.store import Store

CORPUS = Path(__file__).parents[1] / "corpus"
FILES = [
    (SHOP, None),
    (HOUSE, None),
    *((SHOP, CORPUS / "conversations" / f"{name}.toml") for name in ("grocery", "aims_grocery")),
    (SHOP, CORPUS / "conversations" / "aims_test.toml"),
    *((HOUSE, CORPUS / "conversations" / f"{name}.toml") for name in ("house", "aims_house")),
    (SHOP, CORPUS / "people" / "people_shop.toml"),
    (HOUSE, CORPUS / "people" / "people_house.toml"),
]
NOISE = 0.03

outcomes = (
    st.lists(st.tuples(st.booleans(), st.booleans()), max_size=9)
    .map(lambda pairs: [(False, False), *pairs])
    .map(lambda pairs: Outcome(*zip(*pairs, strict=True), ("a", "b")))
)


def people_of(domain: str, file: Path | None) -> list[tuple[Environment, Profile]]:
    settings = Settings(domain=domain, profiles=file and str(file))
    return [(open_environment(settings, each), each) for each in profiles_of(settings)]


@given(outcomes)
def test_the_score_is_the_share_of_needs_among_all_that_was_needed_or_done(made: Outcome) -> None:
    assert made.score == made.needs_met / (made.needs + 2 + made.violated)
    assert replace(made, met=made.start).score == 0
    assert replace(made, met=(True,) * len(made.start), unwanted=()).score == 1
    assert replace(made, unwanted=None).score == replace(made, unwanted=()).score


@given(outcomes, st.randoms(use_true_random=False))
def test_the_order_of_the_checks_does_not_matter(made: Outcome, chance: random.Random) -> None:
    pairs = [*zip(made.start, made.met, strict=True)]
    chance.shuffle(pairs)
    assert Outcome(*zip(*pairs, strict=True), made.unwanted).score == made.score


@given(outcomes)
def test_each_need_raises_the_score_and_all_that_is_unwanted_or_violated_lowers_it(
    made: Outcome,
) -> None:
    more = replace(made, start=(*made.start, False), met=(*made.met, True))
    missing = replace(made, start=(*made.start, False), met=(*made.met, False))
    broken = replace(made, start=(*made.start, True), met=(*made.met, False))
    kept = replace(made, start=(*made.start, True), met=(*made.met, True))
    worse = (missing, broken, replace(made, unwanted=("a", "b", "c")))
    assert more.score > made.score == kept.score
    assert all(each.score <= made.score for each in worse)
    assert not made.score or all(each.score < made.score for each in worse)


@pytest.mark.parametrize(("domain", "file"), FILES, ids=lambda each: getattr(each, "stem", each))
def test_who_looks_at_nobody_scores_next_to_nothing(domain: str, file: Path | None) -> None:
    found = [
        trivial_figures(domain_named(domain), env, profile)
        for env, profile in people_of(domain, file)
    ]
    floor = {"score": 0, "needs met": 0, "violated": 0}
    assert all(floor.items() <= each["nothing"].items() for each in found)
    assert not any(each["nothing"].get("unwanted") for each in found)
    if domain == SHOP:
        drawn = [each["random item"]["score"] for each in found]
        assert sum(drawn) / len(drawn) < NOISE
        for each in found:  # a single thing never pays more than the needs that it meets
            assert each["bananas"]["score"] <= each["bananas"]["needs met"] <= 0.5
        told = [each["everything"] for each in found if "unwanted" in each["everything"]]
        assert all(each["score"] < NOISE for each in told)
        assert (file is None or file.stem.startswith("aims")) == bool(told)


@pytest.mark.parametrize(("domain", "file"), FILES, ids=lambda each: getattr(each, "stem", each))
def test_everybody_needs_something(domain: str, file: Path | None) -> None:
    for env, profile in people_of(domain, file):
        start = env.checks_met(profile)
        assert not all(start.met), profile.name
        if domain == SHOP:
            assert start.met == tuple("must_have" not in check for check in profile.checks)


BREAKS = Profile(
    "p",
    "d",
    ("r",),
    (
        {"must_have": ["whole milk"]},
        {"must_have": ["large eggs"], "min_quantity": 2},
        {"must_not_have": ["bananas"]},
        {"max_total": 20},
        {"bought": False},
    ),
    welcome=("salt",),
)


@pytest.mark.parametrize(
    ("acts", "score"),
    [
        ((), 0),
        ((("Whole Milk", 1),), 1 / 2),
        ((("Whole Milk", 1), ("Large Eggs", 1)), 1 / 2),
        ((("Whole Milk", 1), ("Large Eggs", 2)), 1),
        ((("Whole Milk", 1), ("Large Eggs", 2), ("Table Salt", 1)), 1),
        ((("Whole Milk", 1), ("Large Eggs", 2), ("Dish Soap", 1)), 2 / 3),
        ((("Whole Milk", 1), ("Large Eggs", 2), ("Bananas", 1)), 2 / 4),
        ((("Whole Milk", 9), ("Large Eggs", 2)), 2 / 3),
        ((("Whole Milk", 1), ("Large Eggs", 2), ("", 1)), 2 / 3),
    ],
)
def test_a_basket_by_hand(acts: Sequence[tuple[str, int]], score: float) -> None:
    env = open_environment(Settings(domain=SHOP))
    start = env.checks_met(BREAKS).met
    for name, number in acts:
        result = env.step(Action("add item", name, number) if name else Action("buy basket"))
        assert result.ok, result
    now = env.checks_met(BREAKS)
    assert Outcome(start, now.met, now.unwanted).score == score


def test_at_home_what_holds_at_the_start_earns_nothing_and_costs_when_it_is_broken() -> None:
    checks = (
        {"object": "Tomato", "in": "Fridge"},
        {"no": "Fridge", "isOpen": True},
        {"every": "Lettuce", "in": "Fridge"},
    )
    settings = Settings(domain=HOUSE, scene="Kitchen1")
    profile = Profile("p", "d", ("r",), checks)
    with open_environment(settings, profile) as env:
        start = env.checks_met(profile).met
        acts = [
            Action("put", "tomato", destination="fridge"), Action("open", "fridge"),
            Action("put", "lettuce", destination="dining table"),
        ]  # fmt: skip
        scores: list[float] = []
        for act in acts:
            assert env.step(act).ok
            scores.append(Outcome(start, env.checks_met(profile).met).score)
    assert start == (False, True, True)
    assert scores == [1, 1 / 2, 1 / 3]


def test_a_profile_that_needs_nothing_is_refused(tmp_path: Path) -> None:
    text = '[[profile]]\nname = "idle"\ndescription = "d"\nreplies = ["r"]\n'
    (tmp_path / "idle.toml").write_text(f"{text}checks = [{{ max_total = 9 }}]\n")
    settings = Settings(profiles=str(tmp_path / "idle.toml"), human="scripted", method="no-goals")
    env = open_environment(settings)
    with Store.in_memory() as store, pytest.raises(InvalidInputError, match="idle needs nothing"):
        Session(store, settings, env, NamedModel(), profile="idle")
