"""The shop as a domain."""

from __future__ import annotations

import os
import random
from collections.abc import Mapping, Sequence
from functools import lru_cache

from goalscope.base.types import Action, Profile
from goalscope.envs import Environment
from goalscope.envs.grocery.catalogue import Catalogue
from goalscope.envs.grocery.profiles import load_profiles
from goalscope.envs.grocery.search import Search
from goalscope.envs.grocery.shop import NAMES, GroceryShop
from goalscope.envs.registry import SHOP, Domain, DomainSettings

_DRAWN = 2_000
"""Most items of a catalogue over which the policy of a random item is averaged."""


def _open(settings: DomainSettings, profile: Profile | None) -> Environment:
    path = settings.catalogue
    changed = os.stat(path).st_mtime_ns if path and os.path.exists(path) else 0
    catalogue, search = _stock(path, tuple(settings.columns.items()), changed)
    return GroceryShop(catalogue, search=search)


@lru_cache(maxsize=4)
def _stock(
    path: str | None, columns: tuple[tuple[str, str], ...], changed: int
) -> tuple[Catalogue, Search]:
    """What all shops of one catalogue share, until the file is `changed`."""
    catalogue = Catalogue.load(path, columns=dict(columns))
    return catalogue, Search(catalogue)


def _notes(env: Environment) -> Sequence[str]:
    return env.catalogue.notes if isinstance(env, GroceryShop) else ()


def _trivial(env: Environment) -> Mapping[str, Sequence[Sequence[Action]]]:
    assert isinstance(env, GroceryShop)
    every = [Action("add item", item.name) for item in env.catalogue.items]
    drawn = random.Random(0).sample(every, _DRAWN) if len(every) > _DRAWN else every
    return {
        "random item": [[each] for each in drawn],
        "bananas": [[each] for each in every if each.target == "Bananas"],
        "everything": [every],
    }


DOMAIN = Domain(
    name=SHOP,
    label="Grocery shopping",
    open=_open,
    load_profiles=load_profiles,
    possible=NAMES,
    about="I fill a basket for you, and buy it once you confirm.",
    view="basket",
    settings=frozenset({"catalogue", "columns"}),
    alias="shop",
    notes=_notes,
    replays=lambda _: True,
    judged=("outcome",),
    trivial=_trivial,
)
