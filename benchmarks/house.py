"""How fast the embedded house is.

    python benchmarks/house.py --scenes DIR      # AI2-THOR's scenes; default: $GOALSCOPE_DATA/...
    python benchmarks/house.py --json FILE

In the scene with the most objects (without a folder: our own Kitchen1) random actions are drawn,
and those that succeed are kept. They are taken again from the start; so are the first `REPLAYED`
alone.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import random
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from goalscope.envs.house.simulator.scenes import load_scene, read_scene
from goalscope.envs.house.simulator.state import Scene
from goalscope.envs.house.simulator.world import HouseController
from goalscope.models.llama.engine import processor

STEPS = 10_000
REPLAYED = 200
NEEDS = {
    "PickupObject": "pickupable", "PutObject": "receptacle", "OpenObject": "openable",
    "CloseObject": "openable", "ToggleObjectOn": "toggleable", "ToggleObjectOff": "toggleable",
    "SliceObject": "sliceable", "CookObject": "cookable", "BreakObject": "breakable",
    "DirtyObject": "dirtyable", "CleanObject": "dirtyable", "PushObject": "moveable",
    "FillObjectWithLiquid": "canFillWithLiquid", "EmptyLiquidFromObject": "canFillWithLiquid",
    "Teleport": "", "MoveAhead": "", "RotateRight": "",
}  # fmt: skip
"""Actions, and what their object must be."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--scenes", type=Path, default=default_folder(), metavar="DIR")
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    scene = largest(options.scenes)
    house = HouseController(scene)
    taken = play(house, options.steps)
    replayed = seconds(lambda: replay(house, taken[:REPLAYED]))
    results: dict[str, Any] = {
        "processor": processor(),
        "python": platform.python_version(),
        "scene": scene.name,
        "objects": len(scene.objects),
        "steps": options.steps,
        "steps_per_second": options.steps / seconds(lambda: replay(house, taken)),
        "replay_seconds": replayed,
    }
    show(results)
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")


def default_folder() -> Path | None:
    """The real scenes, where they are."""
    data = os.environ.get("GOALSCOPE_DATA")
    return Path(data) / "thor" / "scenes" if data else None


def largest(folder: Path | None) -> Scene:
    """The scene with the most objects."""
    paths = sorted(folder.glob("*.json*")) if folder else []
    if folder and not paths:
        sys.exit(f"{folder} holds no scene: give a folder of AI2-THOR's metadata with --scenes.")
    if not paths:
        return load_scene("Kitchen1")
    return max(map(read_scene, paths), key=lambda scene: len(scene.objects))


def play(house: HouseController, steps: int) -> list[dict[str, Any]]:
    """Random actions that succeed one after another; those that fail change nothing."""
    chance = random.Random(0)
    house.reset()
    taken: list[dict[str, Any]] = []
    places = house.step("GetReachablePositions").metadata["actionReturn"]
    while len(taken) < steps:
        name = chance.choice(list(NEEDS))
        action: dict[str, Any] = {"action": name, "forceAction": bool(NEEDS[name])}
        if need := NEEDS[name]:
            things = house.last_event.metadata["objects"]
            action["objectId"] = chance.choice([e["objectId"] for e in things if e[need]] or ["-"])
        if name == "FillObjectWithLiquid":
            action["fillLiquid"] = "water"
        if name == "Teleport":
            action["position"] = chance.choice(places)
        if house.step(**action):
            taken.append(action)
    return taken


def replay(controller: HouseController, actions: Sequence[dict[str, Any]]) -> None:
    """Start anew, and take the actions."""
    controller.reset()
    for action in actions:
        controller.step(**action)


def seconds(work: Callable[[], object]) -> float:
    """Time that `work` takes."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def show(results: dict[str, Any]) -> None:
    """Print the table."""
    console = Console()
    console.print(
        f"{results['processor']}, Python {results['python']}; {results['scene']} with "
        f"{results['objects']} objects; {results['steps']:,} random actions"
    )
    console.print(f"{results['steps_per_second']:,.0f} steps a second")
    console.print(f"reset and replay of {REPLAYED} actions: {results['replay_seconds']:.3f} s")


if __name__ == "__main__":
    main()
