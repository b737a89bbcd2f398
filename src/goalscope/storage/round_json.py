"""Rounds as JSON; reading returns every value exactly."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any, TypeVar

from goalscope.agent.round import Round
from goalscope.base.types import Action, Goal, GoalChange, GoalscopeError, StepResult, Turn
from goalscope.belief.calibration import calibration_from_json
from goalscope.belief.goal_order import Ranking
from goalscope.language.orders import Order, Reading, order_from_json, order_to_json

if TYPE_CHECKING:
    from goalscope.belief.belief import Belief

T = TypeVar("T")


def round_to_json(round: Round) -> str:
    """Write a round as strict JSON in ASCII; -inf, which JSON lacks, as the string "-inf".

    Raises:
        GoalscopeError: A number is NaN or +inf.
    """
    belief = round.belief and _held_to_json(round.belief)
    return dumps({**_object_of(round), "belief": belief})


def round_from_json(text: str) -> Round:
    """Read what `round_to_json` wrote; the round is equal in every value."""
    values: dict[str, Any] = json.loads(text)
    belief, reading = values["belief"], values["reading"]
    values["turn"] = Turn(**values["turn"])
    values["belief"] = belief and _held_from_json(belief)
    values["reading"] = reading and _reading(reading)
    values["changes"] = tuple(_with(GoalChange, each, goal=Goal) for each in values["changes"])
    values["results"] = tuple(_with(StepResult, each, action=Action) for each in values["results"])
    for name in ("pending", "released"):
        values[name] = _orders(values[name])
    for name in ("notes", "retracts"):
        values[name] = tuple(values[name])
    return Round(**values)


def _held_to_json(held: Belief | Ranking) -> dict[str, Any]:
    if not isinstance(held, Ranking):
        return belief_to_json(held)
    goals = [goal.text for goal in held.goals]
    most, least = (goal and goal.text for goal in (held.most, held.least))
    return {"goals": goals, "most": most, "least": least}


def _held_from_json(data: Mapping[str, Any]) -> Belief | Ranking:
    if "most" not in data:
        return belief_from_json(data)
    most, least = (data[name] and Goal(data[name]) for name in ("most", "least"))
    return Ranking(tuple(map(Goal, data["goals"])), most, least)


def belief_to_json(belief: Belief) -> dict[str, Any]:
    """A belief as what `dumps` takes."""
    return {
        "goals": [goal.text for goal in belief.goals],
        "log_prior": _numbers(belief.log_prior.tolist()),
        "log_likelihood": [_numbers(row) for row in belief.log_likelihood.tolist()],
        "calibration": asdict(belief.calibration),
        "pinned": [[turns, goal.text] for turns, goal in belief.pinned],
        "ruled_out": [goal.text for goal in belief.ruled_out],
        "weights": [list(each) for each in belief.weights],
    }


def belief_from_json(data: Mapping[str, Any]) -> Belief:
    """Read what `belief_to_json` wrote."""
    import numpy as np

    from goalscope.belief.belief import Belief

    goals = tuple(map(Goal, data["goals"]))
    table = np.array(data["log_likelihood"], dtype=np.float64)
    return Belief(
        goals,
        np.array(data["log_prior"], dtype=np.float64),
        table.reshape(len(data["log_likelihood"]), len(goals)),
        calibration_from_json(data["calibration"]),
        tuple((turns, Goal(text)) for turns, text in data["pinned"]),
        tuple(map(Goal, data["ruled_out"])),
        tuple((turn, weight) for turn, weight in data["weights"]),
    )


def _with(kind: type[T], values: dict[str, Any], **inner: type[Any]) -> T:
    """The dataclass of these values, some of which are dataclasses themselves."""
    return kind(**values | {name: one(**values[name]) for name, one in inner.items()})


def _reading(data: Mapping[str, Any]) -> Reading:
    margins = None if data["margins"] is None else tuple(data["margins"])
    return Reading(_orders(data["orders"]), data["log_probability"], margins)


def _orders(data: Sequence[object]) -> tuple[Order, ...]:
    return tuple(order_from_json(each) for each in data)


def _numbers(values: list[float]) -> list[float | str]:
    """Write -inf as a string, which numpy reads as the number."""
    return ["-inf" if value == -math.inf else value for value in values]


def _object_of(value: Any) -> dict[str, Any]:
    """A dataclass as a JSON object."""
    if isinstance(value, Order):
        return order_to_json(value)
    return {field.name: getattr(value, field.name) for field in fields(value)}


def dumps(value: object, *, sort_keys: bool = False) -> str:
    """Strict JSON in ASCII; lone surrogates survive as escapes, dataclasses become objects.

    Raises:
        GoalscopeError: A number is NaN or infinite.
    """
    try:
        return json.dumps(value, allow_nan=False, sort_keys=sort_keys, default=_object_of)
    except ValueError as error:
        raise GoalscopeError(f"This cannot be stored: {error}") from error
