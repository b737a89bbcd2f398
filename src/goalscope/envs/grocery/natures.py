"""What an item is: food, another mixture such as a soap, or a thing such as a cake pan."""

from __future__ import annotations

from functools import cache, lru_cache
from importlib.resources import files
from typing import Literal

import numpy as np
import numpy.typing as npt

from goalscope.base.arrays import Array, Floats
from goalscope.base.inputs import read_table
from goalscope.base.nouns import head_words, singular, singulars
from goalscope.envs.grocery.catalogue import Catalogue
from goalscope.models.embedding import embedded

Nature = Literal["food", "mixture", "thing"]
"""What people eat, drink or take; other mixtures, such as cosmetics and pet food; and all else."""


_AISLES = {
    key: [" ".join(name.split()) for name in names.split(",")]
    for key, names in read_table(files("goalscope.envs.grocery") / "data" / "aisles.toml").items()
}
_NAMED: dict[tuple[str, ...], Nature] = {
    **{tuple(singulars(name)): "mixture" for name in _AISLES["mixtures"]},
    **{tuple(singulars(name)): "thing" for name in _AISLES["things"]},
}
_OWN_THINGS = frozenset(("household", "cleaning", "cups & napkins", "pet"))
_OWN_MIXED = frozenset(("cake decorations", "baby", "coffee & tea"))
"""Categories of the built-in catalogue that hold no food, and those that hold both."""

_AISLE_WEIGHT = 4.0  # of the category's nearness to usual ones, beside the name
_LEAST = 0.6  # evidence above which an item is no food; docs/log.md has how often a food reaches it
_LEAST_ALONE = 0.9  # the same for an item without a category


@lru_cache(maxsize=65536)
def nature(name: str, category: str) -> Nature:
    """What an item of this name and category is; food where they do not clearly say otherwise.

    The category counts by the usual aisles that are nearest to it, and the name by a linear
    classifier of the built-in catalogue's names. A name that ends as a kitchen tool does, such as
    "Round Cake Pan", is a thing in any category.
    """
    head = [singular(word) for word in head_words(name)]
    for size in (3, 2, 1):
        if named := _NAMED.get((*head[-size:],)):
            return named
    of_name, of_aisle = embedded([name, category])
    near = _nearness(of_aisle if category else of_name)
    food = max(near["plain"], near["made"])
    evidence = float(of_name @ _weights()[:-1] + _weights()[-1])
    if category:
        evidence += _AISLE_WEIGHT * (max(near["mixture"], near["thing"]) - food)
    if evidence <= (_LEAST if category else _LEAST_ALONE):
        return "food"
    return "mixture" if near["mixture"] > near["thing"] else "thing"


@lru_cache(maxsize=4096)
def is_made(category: str) -> bool:
    """Whether an aisle holds food that is made of several things: "Raspberry", among the cakes."""
    near = _nearness(embedded([category])[0])
    return bool(category) and near["made"] > near["plain"]


def _nearness(vector: Floats) -> dict[str, float]:
    """The nearness of the nearest usual aisle of each kind."""
    return {kind: float((vectors @ vector).max()) for kind, vectors in _aisles().items()}


@cache
def _aisles() -> dict[str, Floats]:
    return {kind: embedded(_AISLES[kind]) for kind in ("plain", "made", "mixture", "thing")}


@cache
def _weights() -> npt.NDArray[np.floating]:
    """[257] weights of a name's vector, and the intercept: ridge regression, balanced classes."""
    items = [item for item in Catalogue.load().items if item.category not in _OWN_MIXED]
    others = [*_AISLES["mixture"], *_AISLES["thing"]]
    foods = [*_AISLES["plain"], *_AISLES["made"]]
    names = embedded([*(item.name for item in items), *others, *foods]).astype(np.float64)
    is_other = np.array(
        [*(item.category in _OWN_THINGS for item in items), *[True] * len(others)]
        + [False] * len(foods)
    )
    share = float(is_other.mean())
    weight: Array = np.where(is_other, 1 - share, share)
    inputs: Array = np.hstack([names, np.ones((len(names), 1))])
    scaled: Array = inputs * weight[:, None]
    ridge: Array = float(weight.mean()) * np.eye(inputs.shape[1])
    return np.linalg.solve(scaled.T @ inputs + ridge, scaled.T @ np.where(is_other, 1.0, -1.0))
