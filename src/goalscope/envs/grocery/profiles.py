"""Simulated shoppers: reading profiles, and checking baskets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Ge, Gt, Lt, MinLen, Predicate

from goalscope.base.inputs import read_profiles
from goalscope.base.nouns import contains, singulars
from goalscope.base.types import InvalidInputError, Profile
from goalscope.envs.grocery.catalogue import Item

_FORMS = (
    "must_have", "must_not_have", "must_not_have_tag", "all_have_tag", "max_total", "bought",
)  # fmt: skip
_BESIDE = ("tag", "without", "min_quantity", "max_quantity")


Term = Annotated[str, Predicate(lambda text: bool(singulars(text)))]
Terms = Annotated[tuple[Term, ...], MinLen(1)]
Tag = Annotated[str, MinLen(1)]
Quantity = Annotated[int, Ge(1)]


@dataclass(frozen=True, slots=True)
class _Check:
    """The keys of a check: one of `_FORMS`, and `_BESIDE` it those that go with `must_have`."""

    must_have: Terms | None = None
    must_not_have: Terms | None = None
    must_not_have_tag: Tag | None = None
    all_have_tag: Tag | None = None
    max_total: Annotated[float, Gt(0), Lt(1e9)] | None = None
    bought: bool | None = None
    tag: Tag | None = None
    without: Terms | None = None
    min_quantity: Quantity | None = None
    max_quantity: Quantity | None = None

    def __post_init__(self) -> None:
        if sum(getattr(self, key) is not None for key in _FORMS) != 1:
            raise ValueError(f"expected exactly one of the keys {', '.join(_FORMS)}.")
        for key in _BESIDE:
            if getattr(self, key) is not None and self.must_have is None:
                raise ValueError(f"the key {key!r} only goes with 'must_have'.")
        if self.bought:
            raise ValueError("a purchase scores nothing. Leave out 'bought = true'.")


def load_profiles(path: Path | str | None = None) -> tuple[Profile, ...]:
    """Read profiles from a TOML file; None reads the ten built-in ones.

    Each is a table `[[profile]]` with `name`, `description` (given to a simulated human),
    `replies` (what the scripted human says, in order) and `checks`, a list of these forms:

    * `{must_have = ["limes", "lemons"]}`: some item matches one of the terms. Beside it may stand
      `without = ["soda"]` (terms that this item must not match), `tag = "gluten-free"` (a tag
      that it must carry), `min_quantity` and `max_quantity` (of all such items together).
    * `{must_not_have = ["peanut"]}`: no item matches any of the terms.
    * `{must_not_have_tag = "frozen"}` and `{all_have_tag = "organic"}`: no item, or every one.
    * `{max_total = 60}`: the priced items cost at most so much.
    * `{bought = false}`: the basket was not purchased.

    Beside them may stand `welcome`, a list of terms: what the person would not mind in the basket.

    An item matches a term if all words of the term occur in the item's name, in singular or
    plural. An empty basket meets all checks but those with `must_have`, which are the needs (see
    `goalscope.envs.Outcome`).

    Raises:
        InvalidInputError: The file cannot be read, or a profile is not of this form; the message
            names the file, the profile, the key, and the nearest key that is known.
    """
    source = (
        files("goalscope.envs.grocery") / "data" / "profiles.toml" if path is None else Path(path)
    )
    return read_profiles(source, _Check)


def checks_met(
    checks: Sequence[Mapping[str, Any]], basket: Sequence[tuple[Item, int]], *, bought: bool
) -> list[bool]:
    """Whether the basket meets each of the `checks`."""
    return [_is_met(check, basket, bought) for check in checks]


def unwanted(profile: Profile, basket: Sequence[tuple[Item, int]]) -> tuple[str, ...] | None:
    """Names of the items that match no term of a `must_have`, and none that is welcome.

    None if the profile does not say what is welcome.
    """
    if not profile.welcome:
        return None
    wanted = [check for check in profile.checks if "must_have" in check]
    return tuple(
        item.name
        for item, _ in basket
        if not any(_fits(item, {**check, "tag": None}) for check in wanted)
        and not _matches(item, profile.welcome)
    )


def _is_met(check: Mapping[str, Any], basket: Sequence[tuple[Item, int]], bought: bool) -> bool:
    match check:
        case {"must_have": terms, **limits}:
            fitting = [n for item, n in basket if _fits(item, check)]
            least, most = limits.get("min_quantity", 1), limits.get("max_quantity")
            return sum(fitting) >= least and (most is None or sum(fitting) <= most)
        case {"must_not_have": terms}:
            return not any(_matches(item, terms) for item, _ in basket)
        case {"must_not_have_tag": tag}:
            return not any(tag in item.tags for item, _ in basket)
        case {"all_have_tag": tag}:
            return all(tag in item.tags for item, _ in basket)
        case {"max_total": most}:
            total = sum((i.price * n for i, n in basket if i.price is not None), Decimal(0))
            return total <= Decimal(str(most))
        case {"bought": wanted}:
            return bought == wanted
        case _:
            raise InvalidInputError(f"The check {dict(check)!r} has no known form.")


def _fits(item: Item, check: Mapping[str, Any]) -> bool:
    """Whether an item is one of those that a check with `must_have` asks for."""
    is_named = _matches(item, check["must_have"]) and not _matches(item, check.get("without", ()))
    return is_named and (not check.get("tag") or check["tag"] in item.tags)


def _matches(item: Item, terms: Iterable[str]) -> bool:
    name = set(singulars(item.name))
    return any(contains(name, singulars(term)) for term in terms)
