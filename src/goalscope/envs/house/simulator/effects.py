"""What happens by itself: cold, heat, water, coffee (AI2-THOR's contextual interactions)."""

from __future__ import annotations

import math
from typing import Any

from goalscope.envs.house.simulator.geometry import vec
from goalscope.envs.house.simulator.state import State

__all__ = ["ROOM_TEMPERATURE_AFTER", "settle"]

ROOM_TEMPERATURE_AFTER = 10.0
"""Seconds after which what is away from heat and cold has the temperature of the room."""

_BASINS = ("SinkBasin", "BathtubBasin")
_SINKS = ("Sink", "Bathtub")


def settle(state: State, seconds: float) -> None:
    """Let `seconds` pass, and every fridge, fire and tap do its work."""
    state.clock += seconds
    kept: set[str] = set()
    for thing in list(state.objects.values()):
        match thing["objectType"]:
            case "Fridge":
                _reach(state, thing, "Cold", kept)
            case "StoveBurner" | "Microwave" | "Toaster" if thing["isToggled"]:
                _reach(state, thing, "Hot", kept)
                for each in state.carried(thing["objectId"]):
                    if each["cookable"]:
                        each["isCooked"] = True
            case "StoveBurner":
                kept.update(each["objectId"] for each in state.carried(thing["objectId"]))
            case "CoffeeMachine" if thing["isToggled"]:
                _brew(state, thing, kept)
            case "Faucet" | "ShowerHead" if thing["isToggled"]:
                _rinse(state, thing)
            case _:
                pass
    _cool(state, kept)


def _reach(state: State, source: dict[str, Any], temperature: str, kept: set[str]) -> None:
    for each in state.carried(source["objectId"]):
        each["temperature"] = temperature
        kept.add(each["objectId"])


def _brew(state: State, machine: dict[str, Any], kept: set[str]) -> None:
    for each in state.contents(machine["objectId"]):
        if each["objectType"] == "Mug":
            kept.add(each["objectId"])
            if not each["isFilledWithLiquid"]:
                each["isFilledWithLiquid"], each["fillLiquid"] = True, "coffee"
                each["temperature"] = "Hot"


def _rinse(state: State, tap: dict[str, Any]) -> None:
    """Clean and fill what stands in the basin under the tap."""
    here = vec(tap["position"])
    basins = [each for each in state.objects.values() if each["objectType"] in _BASINS]
    if not basins:
        return
    nearest = min(basins, key=lambda each: math.dist(vec(each["position"]), here))
    sinks = [each for each in state.parents(nearest) if each["objectType"] in _SINKS]
    sink = state.objects.get(nearest["objectId"].rpartition("|")[0], *sinks[:1])
    for basin in filter(None, (nearest, sink)):
        for each in state.contents(basin["objectId"]):
            if each["dirtyable"]:
                each["isDirty"] = False
            if each["canFillWithLiquid"] and not each["isFilledWithLiquid"]:
                if each["openable"] and not each["isOpen"]:
                    continue
                each["isFilledWithLiquid"], each["fillLiquid"] = True, "water"


def _cool(state: State, kept: set[str]) -> None:
    """Take what has been away from heat and cold for long enough to the room's temperature."""
    for own, thing in state.objects.items():
        if thing["temperature"] == "RoomTemp" or own in kept or not thing["pickupable"]:
            state.cooling.pop(own, None)
        elif state.clock - state.cooling.setdefault(own, state.clock) >= ROOM_TEMPERATURE_AFTER:
            thing["temperature"] = "RoomTemp"
            del state.cooling[own]
