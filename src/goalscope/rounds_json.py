"""Rounds as JSON; reading returns every value exactly."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from goalscope.calibration import calibration_from_json
from goalscope.episode import Round
from goalscope.orders import Order, Reading, order_from_json, order_to_json
from goalscope.types import Action, Goal, GoalChange, GoalscopeError, StepResult, Turn

if TYPE_CHECKING:
    from goalscope.belief import Belief

__all__ = [
    "belief_from_json",
    "belief_to_json",
    "dumps",
    "round_from_json",
    "round_to_json",
    "turn_like",
]


def round_to_json(round: Round) -> str:
    """Write a round as strict JSON in ASCII; -inf, which JSON lacks, as the string "-inf".

    Raises:
        GoalscopeError: A number is NaN or +inf.
    """
    belief = round.belief
    return dumps(
        {
            "number": round.number,
            "turn": asdict(round.turn),
            "belief": belief and belief_to_json(belief),
            "reading": round.reading and _reading(round.reading),
            "changes": [asdict(change) for change in round.changes],
            "results": [asdict(result) for result in round.results],
            "replans": round.replans,
            "status": round.status,
            "notes": list(round.notes),
            "terminated": round.terminated,
            "question": round.question,
            "pending": _orders(round.pending),
            "released": _orders(round.released),
            "state": round.state,
            "retracts": list(round.retracts),
            "reversals": round.reversals,
        }
    )


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

    from goalscope.belief import Belief

    goals = tuple(Goal(goal) for goal in data["goals"])
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


def round_from_json(text: str) -> Round:
    """Read what `round_to_json` wrote; the round is equal in every value."""
    data = json.loads(text)
    belief = data["belief"]
    if belief is not None:
        belief = belief_from_json(belief)
    return Round(
        number=data["number"],
        turn=Turn(**data["turn"]),
        belief=belief,
        reading=_reading_from(reading) if (reading := data["reading"]) else None,
        changes=tuple(
            GoalChange(
                change["kind"],
                Goal(**change["goal"]),
                change["reason"],
                change["final"],
            )
            for change in data["changes"]
        ),
        results=tuple(
            StepResult(
                Action(**result["action"]),
                result["ok"],
                result["observation"],
                result["terminated"],
                result["irreversible"],
            )
            for result in data["results"]
        ),
        replans=data["replans"],
        status=data["status"],
        notes=tuple(data["notes"]),
        terminated=data["terminated"],
        question=data["question"],
        pending=_orders_from(data["pending"]),
        released=_orders_from(data["released"]),
        state=data["state"],
        retracts=tuple(data["retracts"]),
        reversals=data["reversals"],
    )


def _reading(reading: Reading) -> dict[str, Any]:
    return {
        "orders": _orders(reading.orders),
        "log_probability": reading.log_probability,
        "margins": reading.margins,
    }


def _reading_from(data: Mapping[str, Any]) -> Reading:
    margins = data["margins"]
    return Reading(
        _orders_from(data["orders"]), data["log_probability"], margins and tuple(margins)
    )


def _orders(orders: Sequence[Order]) -> list[dict[str, Any]]:
    return [order_to_json(each) for each in orders]


def _orders_from(data: Sequence[object]) -> tuple[Order, ...]:
    return tuple(order_from_json(each) for each in data)


def _numbers(values: list[float]) -> list[float | str]:
    """Write -inf as a string, which numpy reads as the number."""
    return ["-inf" if value == -math.inf else value for value in values]


def dumps(value: object, *, sort_keys: bool = False) -> str:
    """Strict JSON in ASCII; lone surrogates survive as escapes.

    Raises:
        GoalscopeError: A number is NaN or infinite.
    """
    try:
        return json.dumps(value, allow_nan=False, sort_keys=sort_keys)
    except ValueError as error:
        raise GoalscopeError(f"This cannot be stored: {error}") from error


def turn_like(text: str) -> str:
    """The LIKE pattern, escaped by "/", of a round whose turn contains a text.

    Quotes within a value are escaped, so the pattern cannot match beyond the turn.
    """
    inner = dumps(text)[1:-1]
    for each in "/%_":
        inner = inner.replace(each, f"/{each}")
    return f'%"turn": {{%{inner}%}}, "belief": %'
