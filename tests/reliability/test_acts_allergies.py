"""Allergies in the many ways in which people tell of them: nothing harmful stays or is bought."""

from __future__ import annotations

import random
from collections.abc import Callable
from itertools import product

import pytest

from goalscope.envs.grocery.restrictions import violates
from shops import talked

LEADS = (
    "", "oh ", "wait ", "wait, ", "wait no, ", "hold on, ", "no, ", "sorry, ", "actually ", "um, ",
    "please ", "hmm ", "ok but ", "but ", "and ", "also ", "by the way, ", "oh and ", "remember, ",
    "careful, ", "btw ", "one thing: ", "important: ", "note: ", "just ",
)  # fmt: skip
REFUSALS = (
    "no {}", "no {} please", "nothing with {}", "without {}", "{one} free", "{one}-free please",
    "don't add {}", "don't get any {}", "he can't have {}", "my son is allergic to {}",
    "my son's allergic to {}", "{} {be} not allowed", "he's got a {one} allergy", "avoid {}",
    "skip the {}", "leave out the {}", "keep {} out of it", "must be free of {}",
    "it can't contain {}", "there must be no {} in it", "make sure there {be} no {}",
    "{} would kill him", "{} {make} him sick", "he reacts to {}", "he must not eat {}",
)  # fmt: skip
REASONS = (
    ", my son is allergic", ", Jim's allergic", ". Jim is allergic.", " because my son is allergic",
    ", he's allergic",
)  # fmt: skip
HARM = {
    ("nuts", "nut"): ("walnuts", "nut-free"),
    ("peanuts", "peanut"): ("peanut butter", "nut-free"),
    ("eggs", "egg"): ("large eggs", "egg-free"),
    ("dairy", "dairy"): ("cheddar", "dairy-free"),
    ("gluten", "gluten"): ("white bread", "gluten-free"),
    ("shellfish", "shellfish"): ("shrimp", "shellfish-free"),
    ("fish", "fish"): ("salmon", "fish-free"),
    ("soy", "soy"): ("tofu", "soy-free"),
    ("sesame", "sesame"): ("hummus", "sesame-free"),
}
SAYINGS = list(product(LEADS, REFUSALS, REASONS, HARM))


@pytest.mark.parametrize("count", [300, pytest.param(10_000, marks=pytest.mark.slow)])
def test_what_harms_leaves_the_basket_and_does_not_come_back(
    count: int, record_property: Callable[[str, str], None]
) -> None:
    wrong: list[str] = []
    for lead, refusal, reason, (many, one) in random.Random(0).sample(SAYINGS, count):
        thing, diet = HARM[many, one]
        be, make = ("are", "make") if many.endswith("s") else ("is", "makes")
        said = f"{lead}{refusal.format(many, many, one=one, be=be, make=make)}{reason}"
        opened, _ = talked({}, thing, said, f"add {thing}")
        held = (opened.catalogue.get(name) for name in opened.basket)
        if any(item is None or violates(item, diet) for item in held):
            wrong.append(said)
    assert not wrong
    record_property("measured", f"{count:,} ways to tell of an allergy: all heard, nothing harmful")
