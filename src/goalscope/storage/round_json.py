"""Rounds as JSON; reading returns every value exactly."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, TypeVar

from goalscope.agent.round import Round
from goalscope.base.types import Action, Goal, GoalChange, GoalscopeError, StepResult, Turn
from goalscope.belief.belief import belief_from_json, belief_to_json
from goalscope.language.orders import Order, Reading, order_from_json, order_to_json

T = TypeVar("T")


def round_to_json(round: Round) -> str:
    """Write a round as strict JSON in ASCII; see `belief_to_json`.

    Raises:
        GoalscopeError: A number is NaN or +inf.
    """
    return dumps({**_object_of(round), "belief": belief_to_json(round.belief)})


def round_from_json(text: str) -> Round:
    """Read what `round_to_json` wrote; the round is equal in every value."""
    values: dict[str, Any] = json.loads(text)
    belief, reading = values["belief"], values["reading"]
    values["turn"] = Turn(**values["turn"])
    values["belief"] = belief_from_json(belief)
    values["reading"] = reading and _reading(reading)
    values["changes"] = tuple(_with(GoalChange, each, goal=Goal) for each in values["changes"])
    values["results"] = tuple(_with(StepResult, each, action=Action) for each in values["results"])
    for name in ("pending", "released"):
        values[name] = _orders(values[name])
    for name in ("notes", "retracts"):
        values[name] = tuple(values[name])
    return Round(**values)


def _with(kind: type[T], values: dict[str, Any], **inner: type[Any]) -> T:
    """The dataclass of these values, some of which are dataclasses themselves."""
    return kind(**values | {name: one(**values[name]) for name, one in inner.items()})


def _reading(data: Mapping[str, Any]) -> Reading:
    margins = None if data["margins"] is None else tuple(data["margins"])
    return Reading(_orders(data["orders"]), data["log_probability"], margins)


def _orders(data: Sequence[object]) -> tuple[Order, ...]:
    return tuple(order_from_json(each) for each in data)


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
