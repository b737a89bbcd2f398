"""How fast the embedded house is, and beside it AI2-THOR's own Controller with the house behind it.

    python benchmarks/house.py --scenes DIR      # AI2-THOR's scenes; default: $GOALSCOPE_DATA/...
    python benchmarks/house.py --json FILE

In the scene with the most objects (without a folder: our own Kitchen1) random actions are drawn,
and those that succeed are kept. They are taken again from the start; so are the first `REPLAYED`
alone. The Controller takes the first `DRIVEN` of the same actions over a pipe (FIFO) and over HTTP
(WSGI); that part needs `goalscope[thor]` and is left out without it.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import platform
import random
import shlex
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from goalscope.envs.house.simulator.controller import HouseController
from goalscope.envs.house.simulator.scene import Scene
from goalscope.envs.house.simulator.scenes import load_scene, read_scene
from goalscope.models.tune import processor

STEPS = 10_000
REPLAYED = 200
DRIVEN = 1000
NEEDS = {
    "PickupObject": "pickupable", "PutObject": "receptacle", "OpenObject": "openable",
    "CloseObject": "openable", "ToggleObjectOn": "toggleable", "ToggleObjectOff": "toggleable",
    "SliceObject": "sliceable", "CookObject": "cookable", "BreakObject": "breakable",
    "DirtyObject": "dirtyable", "CleanObject": "dirtyable", "PushObject": "moveable",
    "FillObjectWithLiquid": "canFillWithLiquid", "EmptyLiquidFromObject": "canFillWithLiquid",
    "Teleport": "", "MoveAhead": "", "RotateRight": "", "LookDown": "", "LookUp": "",
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
        "ms_per_step": {},
    }
    results["ms_per_step"]["embedded house"] = 1000 / results["steps_per_second"]
    for server in ("FIFO", "WSGI"):
        time_ = drive(server, scene, taken[:DRIVEN])
        if time_ is not None:
            results["ms_per_step"][f"AI2-THOR's Controller, {server}"] = time_
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
        if house.step(action):
            taken.append(action)
    return taken


def replay(controller: Any, actions: Sequence[dict[str, Any]]) -> None:
    """Start anew, and take the actions."""
    controller.reset()
    for action in actions:
        controller.step(action)


def seconds(work: Callable[[], object]) -> float:
    """Time that `work` takes."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def drive(server: str, scene: Scene, actions: Sequence[dict[str, Any]]) -> float | None:
    """Milliseconds of a step with AI2-THOR's Controller; None where it is not installed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            from ai2thor.controller import Controller
            from ai2thor.fifo_server import FifoServer
            from ai2thor.wsgi_server import WsgiServer
        except ImportError:
            return None
    logging.disable(logging.INFO)
    with stand_in(scene) as program:
        controller = Controller(
            local_executable_path=str(program),
            scene="Bench",
            x_display=":0",
            server_class={"FIFO": FifoServer, "WSGI": WsgiServer}[server],
        )
        try:
            replay(controller, actions[:20])
            controller.reset()
            return (
                1000 * seconds(lambda: [controller.step(each) for each in actions]) / len(actions)
            )
        finally:
            controller.stop()


@contextmanager
def stand_in(scene: Scene) -> Iterator[Path]:
    """The program in Unity's place, with this scene; AI2-THOR writes its log beside it."""
    with tempfile.TemporaryDirectory() as folder:
        kept = {"sceneName": "Bench", "agent": scene.agent, "objects": scene.objects}
        Path(folder, "Bench.json").write_text(json.dumps(kept))
        code = "from goalscope.envs.house.simulator import unity; unity.main()"
        program = Path(folder, "program")
        program.write_text(f'#!/bin/sh\nexec {shlex.join([sys.executable, "-c", code])} "$@"\n')
        program.chmod(0o755)
        before = {name: os.environ.get(name) for name in ("HOME", "GOALSCOPE_SCENES")}
        os.environ |= dict.fromkeys(before, folder)
        try:
            yield program
        finally:
            for name, value in before.items():
                os.environ.pop(name)
                os.environ |= {name: value} if value is not None else {}


def show(results: dict[str, Any]) -> None:
    """Print the table."""
    console = Console()
    console.print(
        f"{results['processor']}, Python {results['python']}; {results['scene']} with "
        f"{results['objects']} objects; {results['steps']:,} random actions"
    )
    table = Table("way", "ms a step", "steps a second")
    for way, time_ in results["ms_per_step"].items():
        table.add_row(way, f"{time_:.2f}", f"{1000 / time_:,.0f}")
    console.print(table)
    console.print(f"reset and replay of {REPLAYED} actions: {results['replay_seconds']:.3f} s")


if __name__ == "__main__":
    main()
