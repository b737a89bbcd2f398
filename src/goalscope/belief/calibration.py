"""How log-likelihoods become probabilities: the few numbers that Eq. 1 leaves open."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, cast

from goalscope.base.inputs import validated
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.base.user_dirs import user_data
from goalscope.models import model_name
from goalscope.prompts import render

EPSILONS = (0.01, 0.02, 0.05, 0.1, 0.2)
"""Error rates for which `goalscope calibrate` finds thresholds."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """How much words count as evidence, and the priors of Unspecified and a change of mind.

    Attributes:
        temperature: Divides the log-likelihoods: a power posterior. Above 1 the belief moves more
            slowly, which suits a likelihood that is a wrong model of people. 1 in the paper.
        reference: Weight of the mean over the other goals in the log-likelihood of Unspecified;
            the rest is the prompt without a goal. Any goal in the prompt makes the words of its
            domain likelier, so their mean shows better whether one goal stands out. With G goals
            the weight is multiplied by 1 - 1/G, as a single goal is no reference for itself. 0 in
            the paper.
        prior_unspecified: Prior probability that the person's goal is not among the goals. None
            gives Unspecified the prior of any other goal, as in the paper.
        switching: Probability, before each turn but the first, that the person has changed their
            mind and draws a goal from the prior. It is multiplied by (1 - P(words | belief before)
            / P(words | prior))^4, or by 0 if the words are likelier under the belief before
            (docs/log.md): a discount, as in power posteriors, and no model of how minds change. 0
            in the paper.
        similarity: Nats for a cosine of 1 between words and a goal, beside the log-likelihood and
            before the temperature (see `goalscope.belief.likelihood.RolePlay`). 0 in the paper.
        aside: Weight of words that tell no aim and ask for nothing new: a bare yes or no, "undo
            that" (see `goalscope.language.orders.is_aside`). A tracker that reads nothing gives all
            words the weight 1, as the paper does.
        orders: Weight of words that only give orders: butter for pancakes says little about
            pancakes. 1 in the paper.
        n: Number of dialogues on which the thresholds were measured.
        thresholds: Pairs (eps, p): in all but a share eps of these dialogues the true goal had at
            least the probability p. See `Belief.conformal_set`.

    Raises:
        InvalidInputError: A number is out of its range.
    """

    temperature: float = 1.0
    reference: float = 0.0
    prior_unspecified: float | None = None
    switching: float = 0.0
    similarity: float = 0.0
    aside: float = 1.0
    orders: float = 1.0
    n: int = 0
    thresholds: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not (math.isfinite(self.temperature) and self.temperature > 0):
            raise InvalidInputError(f"temperature must be positive, not {self.temperature}")
        if not (math.isfinite(self.similarity) and self.similarity >= 0):
            raise InvalidInputError(f"similarity must not be negative, not {self.similarity}")
        if self.n < 0:
            raise InvalidInputError(f"n must be a number of dialogues, not {self.n}")
        for name, value in (
            ("reference", self.reference),
            ("switching", self.switching),
            ("aside", self.aside),
            ("orders", self.orders),
            *(("threshold", value) for pair in self.thresholds for value in pair),
        ):
            if not 0 <= value <= 1:
                raise InvalidInputError(f"{name} must lie between 0 and 1, not be {value}")
        if self.prior_unspecified is not None and not 0 < self.prior_unspecified < 1:
            raise InvalidInputError(
                "prior_unspecified must lie strictly between 0 and 1, "
                f"not be {self.prior_unspecified}"
            )


def calibration_from_json(data: object) -> Calibration:
    """The calibration of `dataclasses.asdict`, perhaps from JSON.

    Raises:
        InvalidInputError: A field is missing, unknown, of another type or out of its range.
    """
    calibration = validated(data, Calibration, "calibration")
    given = cast("Mapping[str, object]", data)
    if absent := [each.name for each in fields(Calibration) if each.name not in given]:
        raise InvalidInputError(f"calibration: the key {absent[0]!r} is missing.")
    return calibration


PAPER = Calibration()
"""Bayes' rule as in the paper (Eq. 1)."""

DEFAULT = Calibration(
    temperature=2.0, reference=1 / 3, prior_unspecified=0.5, switching=0.1, aside=0.0, orders=0.5
)
"""For models that were not calibrated (docs/log.md)."""

NAMED = {"paper": PAPER, "default": DEFAULT}
"""The named calibrations."""

YOURS, SHIPPED = "yours", "shipped with goalscope"
"""The origins that `known_calibration` returns."""


def calibration_named(name: str) -> Calibration:
    """The calibration with a name ("paper", "default"), or from a file.

    Raises:
        InvalidInputError: There is no such name or file, or the file is not a calibration.
    """
    if name in NAMED:
        return NAMED[name]
    file = Path(name)
    if not file.is_file():
        raise InvalidInputError(
            f"There is no calibration {name!r}. Name {', '.join(NAMED)}, or a file written by "
            "`goalscope calibrate`."
        )
    return _read(file)


def known_calibration(scorer: Any, layout: str) -> tuple[Calibration, str]:
    """The calibration of a model, and its origin.

    The user's own comes first, then the one that ships with goalscope, then `DEFAULT`.

    Args:
        scorer: The model that scores people's words.
        layout: Where the prompt states the goal.

    Raises:
        InvalidInputError: The file is broken.
    """
    own = calibration_file(scorer, layout)
    shipped = files("goalscope.belief") / "calibrations" / own.name
    for place in (own, shipped):
        if place.is_file():
            return _read(place), YOURS if place is own else SHIPPED
    return DEFAULT, "not calibrated; see `goalscope calibrate`"


def calibration_file(scorer: Any, layout: str) -> Path:
    """The file of the user's calibration of a model with its adapter and prompt.

    Its name depends on the model's name (the format of the weights matters little), and on the
    contents of the prompt and the adapter.
    """
    chat = render(layout.replace("-", "_"), task="T", goal="G", query="Q")
    adapter: Path | None = getattr(scorer, "adapter", None)
    facts = [
        model_name(scorer),
        hashlib.sha256(adapter.read_bytes()).hexdigest() if adapter else None,
        [[each.role, each.content] for each in chat],
    ]
    key = hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:16]
    return user_data() / "calibrations" / f"{key}.json"


def keep_calibration(file: Path, calibration: Calibration, about: Mapping[str, Any]) -> None:
    """Write a calibration, with further JSON entries.

    Raises:
        GoalscopeError: The file cannot be written.
    """
    text = json.dumps({**about, "calibration": asdict(calibration)}, indent=1)
    part = file.with_name(f".{file.name}.part")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text + "\n", encoding="utf-8")
        part.replace(file)
    except OSError as error:
        raise GoalscopeError(f"Cannot write {file}: {error.strerror or error}.") from None


def _read(file: Path | Traversable) -> Calibration:
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        return calibration_from_json(data["calibration"])
    except (OSError, ValueError, LookupError, TypeError, RecursionError) as error:
        missing = isinstance(error, KeyError)
        cause = f"the key {error} is missing" if missing else str(error).rstrip(".")
        cause = cause if cause.isprintable() else ascii(cause)
        raise InvalidInputError(
            f"{file} is not a calibration ({cause}). Delete it, name another file, or write "
            "one with `goalscope calibrate --out FILE`."
        ) from None
