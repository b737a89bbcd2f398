"""A profile file is understood as documented, or refused with the place and the remedy."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest

from goalscope.base.types import InvalidInputError, Profile
from goalscope.envs.grocery import Item, load_profiles
from goalscope.envs.grocery.profiles import checks_met, unwanted

GOOD = """[[profile]]
name = "a"
description = "d"
replies = ["r"]
checks = [{must_have = ["eggs"]}]
"""
EGGS = Item(1, "Large Brown Eggs", price=Decimal("3.50"), tags=frozenset({"organic"}))
FLOUR = Item(2, "Wheat Flour", price=None)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (GOOD.replace("replies", "replys"), "'a': the key 'replys' .* 'replies'"),
        (GOOD.replace("must_have", "must_hav"), "check 1: .* did you mean 'must_have'"),
        (GOOD.replace('["eggs"]', '"eggs"'), "'must_have' must be a list"),
        (GOOD.replace('{must_have = ["eggs"]}', "{}"), "exactly one of the keys"),
        (
            GOOD.replace('must_have = ["eggs"]', "max_total = true"),
            "'max_total' must be a number",
        ),
        (
            GOOD.replace('["eggs"]', '["eggs"], min_quantity = 0'),
            "must be at least 1",
        ),
        (
            GOOD.replace('must_have = ["eggs"]', "bought = false, tag = 'x'"),
            "only goes with 'must_have'",
        ),
        (
            GOOD.replace('must_have = ["eggs"]', "bought = true"),
            "check 1: a purchase scores nothing. Leave out",
        ),
    ],
)
def test_a_wrong_file_is_refused_with_place_and_remedy(
    tmp_path: Path, text: str, told: str
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(InvalidInputError, match=told) as refusal:
        load_profiles(path)
    assert "mine.toml" in str(refusal.value)


def test_a_right_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("\ufeff" + GOOD, encoding="utf-8")
    (profile,) = load_profiles(tmp_path / "mine.toml")
    assert (profile.name, profile.replies) == ("a", ("r",))


@pytest.mark.parametrize(
    ("check", "met"),
    [
        ({"must_have": ["egg"]}, True),
        ({"must_have": ["milk", "brown egg"]}, True),
        ({"must_have": ["brown milk"]}, False),
        ({"must_have": ["gg"]}, False),
        ({"must_have": ["egg"], "tag": "organic"}, True),
        ({"must_have": ["flour"], "tag": "organic"}, False),
        ({"must_have": ["egg"], "min_quantity": 3}, False),
        ({"must_have": ["egg"], "max_quantity": 1}, False),
        ({"must_have": ["egg"], "min_quantity": 2, "max_quantity": 2}, True),
        ({"must_not_have": ["wheat"]}, False),
        ({"must_not_have": ["nut"]}, True),
        ({"must_not_have_tag": "organic"}, False),
        ({"all_have_tag": "organic"}, False),
        ({"max_total": 7}, True),
        ({"max_total": 6.99}, False),
        ({"bought": False}, True),
    ],
)
def test_checks_mean_what_the_documentation_says(check: dict[str, object], *, met: bool) -> None:
    assert checks_met([check], [(EGGS, 2), (FLOUR, 1)], bought=False) == [met]


def test_what_no_check_asks_for_and_is_not_welcome_is_unwanted() -> None:
    checks = ({"must_have": ["egg"]}, {"must_not_have": ["flour"]})
    basket = [(EGGS, 2), (FLOUR, 1)]
    assert unwanted(Profile("p", "d", ("r",), checks), basket) is None  # nobody can tell
    assert unwanted(Profile("p", "d", ("r",), checks, welcome=("salt",)), basket) == (FLOUR.name,)
    assert unwanted(Profile("p", "d", ("r",), checks, welcome=("flours",)), basket) == ()


def test_of_an_empty_basket_all_holds_but_the_needs() -> None:
    checks = [
        {"must_have": ["nut"]}, {"must_not_have": ["nut"]}, {"must_not_have_tag": "frozen"},
        {"all_have_tag": "organic"}, {"max_total": 9}, {"bought": False},
    ]  # fmt: skip
    assert checks_met(checks, [], bought=False) == [False, *[True] * 5]
