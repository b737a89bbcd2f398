"""How far the embedded house does what real AI2-THOR did.

    python benchmarks/conformance.py RECORDINGS...       # files or folders: .jsonl, .jsonl.gz
    python benchmarks/conformance.py --teach FILE --scenes DIR

A recording of AI2-THOR 5 has one step a line: {"action": {...}, "metadata": what AI2-THOR said
after it}. The house is set to each real state, given the next action, and compared with the next
state.

TEACh's games (AI2-THOR 3.1) are replayed from their start by what people did with success:
"success agrees" is then the share that the house accepts, and F1 is that of the final object
states.
"""

from __future__ import annotations

import argparse
import gzip
import json
import os
import sys
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from rich.console import Console
from rich.progress import track
from rich.table import Table

from goalscope.base.types import InvalidInputError, pluralize
from goalscope.envs.house.simulator.object_types import PREDICATES
from goalscope.envs.house.simulator.scenes import scene_from_metadata
from goalscope.envs.house.simulator.state import Scene, by_id
from goalscope.envs.house.simulator.world import House
from teach_rooms import predicates, room_at_start, worlds

LONGEST_LINE = 64 * 2**20
_NEW_STARTS = ("Initialize", "Reset")
"""Rows of a recording that begin a scene anew."""

_ACTIONS = {
    "Pickup": "PickupObject",
    "Place": "PutObject",
    "Open": "OpenObject",
    "Close": "CloseObject",
    "ToggleOn": "ToggleObjectOn",
    "ToggleOff": "ToggleObjectOff",
    "Slice": "SliceObject",
}
"""TEACh's names of what AI2-THOR has an action for; "Pour" is two."""

Triple = tuple[str, str, object]
"""An object's id, a predicate, and the value that it changed to."""


@dataclass
class Agreement:
    """Counts over the steps that were compared.

    Attributes:
        steps: Actions that were applied.
        agreed: Those on whose success the house and the recording agree.
        hits: Changes that both show: (object, predicate, new value).
        missed: Changes of the recording that the house does not show, by (action, predicate).
        extra: Changes of the house that the recording does not show, by (action, predicate).
        refused: Messages of the house for actions that succeeded in the recording, with counts.
        examples: Differences in full, the first ones.
    """

    steps: int = 0
    agreed: int = 0
    hits: int = 0
    missed: Counter[tuple[str, str]] = field(default_factory=Counter[tuple[str, str]])
    extra: Counter[tuple[str, str]] = field(default_factory=Counter[tuple[str, str]])
    refused: Counter[tuple[str, str]] = field(default_factory=Counter[tuple[str, str]])
    examples: list[str] = field(default_factory=list[str])

    @property
    def success_agreement(self) -> float:
        """Share of the steps whose success agrees."""
        return self.agreed / self.steps if self.steps else 1.0

    @property
    def precision(self) -> float:
        """Share of the house's changes that the recording shows, too."""
        total = self.hits + self.extra.total()
        return self.hits / total if total else 1.0

    @property
    def recall(self) -> float:
        """Share of the recording's changes that the house shows, too."""
        total = self.hits + self.missed.total()
        return self.hits / total if total else 1.0

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall."""
        total = 2 * self.hits + self.extra.total() + self.missed.total()
        return 2 * self.hits / total if total else 1.0

    def count(self, action: str, real: set[Triple], ours: set[Triple], most: int = 50) -> None:
        """Add the changes of one action (or of a whole game)."""
        self.hits += len(real & ours)
        for each in real - ours:
            self.missed[action, each[1]] += 1
        for each in ours - real:
            self.extra[action, each[1]] += 1
        for sign, odd in (("missed", real - ours), ("extra", ours - real)):
            for own, predicate, value in sorted(odd, key=str)[: max(most - len(self.examples), 0)]:
                self.examples.append(f"{sign}: {action}: {own} {predicate} -> {value}")

    def as_json(self) -> dict[str, Any]:
        """For machines: the figures, and the differences by action and predicate."""
        return {
            "steps": self.steps,
            "success_agreement": self.success_agreement,
            "precision": self.precision,
            "recall": self.recall,
            "f1": self.f1,
            "differences": [
                {"kind": kind, "action": action, "predicate": predicate, "count": count}
                for kind, counts in (("missed", self.missed), ("extra", self.extra))
                for (action, predicate), count in counts.most_common()
            ],
            "refused": [
                {"action": action, "message": message, "count": count}
                for (action, message), count in self.refused.most_common()
            ],
            "examples": self.examples,
        }


def type_of(object_id: str) -> str:
    """The type in an AI2-THOR id: "Egg" of "Egg|+00.50|+00.80|+00.78", "SinkBasin" of a basin's."""
    first, *rest = object_id.split("|")
    last = rest[-1] if len(rest) > 3 else first
    return last.rstrip("0123456789").rstrip("_") or first


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    data = os.environ.get("GOALSCOPE_DATA")
    folder = Path(data) / "thor" / "scenes" if data else None
    parser.add_argument("recordings", type=Path, nargs="*")
    parser.add_argument("--teach", type=Path, metavar="FILE", help="games of TEACh")
    parser.add_argument(
        "--scenes", type=Path, default=folder, metavar="DIR",
        help="AI2-THOR's scenes (default: $GOALSCOPE_DATA/thor/scenes, or imported ones)",
    )  # fmt: skip
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    if not options.recordings and options.teach is None:
        parser.error("Name recordings, or a file of TEACh games with --teach.")
    results: dict[str, Agreement] = {}
    try:
        if options.recordings:
            results["recordings"] = Agreement()
            for file in track(recordings(options.recordings), "Recordings"):
                compare_episode(file, results["recordings"])
        if options.teach:
            results["teach"] = Agreement()
            replay_games(options.teach, options.scenes, results["teach"])
    except InvalidInputError as error:
        sys.exit(str(error))
    for name, each in results.items():
        show(name, each)
    if options.json:
        told = {name: each.as_json() for name, each in results.items()}
        options.json.write_text(json.dumps(told, indent=1) + "\n")


def replay_games(path: Path, scenes: Path | None, agreement: Agreement) -> None:
    """Replay every game of a file.

    Args:
        path: Games, JSON Lines: "world", "interactions", "initial_objects", "final_objects".
        scenes: Folder of AI2-THOR's scenes, named as "world" names them, with `.json.gz`; None
            looks among those that were imported.
        agreement: Takes the counts.

    Raises:
        InvalidInputError: A file is missing, or is not of this form.
    """
    world = worlds(scenes)
    for number, game in enumerate(track([*rows(path)], "Games"), 1):
        try:
            replay_game(game, world(str(game["world"])), agreement)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            if isinstance(error, InvalidInputError):
                raise
            raise InvalidInputError(
                f"{path.name}, line {number}: not a TEACh game ({type(error).__name__}: {error})."
            ) from None


def recordings(paths: Sequence[Path]) -> list[Path]:
    """The files among `paths`, with those in their folders.

    Raises:
        InvalidInputError: A path does not exist, or a folder holds no recordings.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(
                each for each in path.iterdir() if each.name.endswith((".jsonl", ".jsonl.gz"))
            )
            if not inside:
                raise InvalidInputError(f"{path} holds no .jsonl or .jsonl.gz file.")
            found += inside
        elif path.exists():
            found.append(path)
        else:
            raise InvalidInputError(f"There is no file {path}.")
    return found


def rows(path: Path) -> Iterator[dict[str, Any]]:
    """The rows of a JSON Lines file, packed or not.

    Raises:
        InvalidInputError: It cannot be read, or a line is no JSON object.
    """
    opener = gzip.open if path.suffix == ".gz" else open
    try:
        with opener(path, "rt", encoding="utf-8") as file:
            number = 0
            while line := file.readline(LONGEST_LINE):
                number += 1
                if len(line) == LONGEST_LINE:
                    raise InvalidInputError(f"{path.name}, line {number}: longer than 64 MiB.")
                try:
                    row = json.loads(line)
                except (ValueError, RecursionError):
                    row = None
                if not isinstance(row, dict):
                    raise InvalidInputError(f"{path.name}, line {number}: not a JSON object.")
                yield cast("dict[str, Any]", row)
    except (OSError, EOFError, UnicodeDecodeError, zlib.error) as error:
        raise InvalidInputError(f"{path.name} cannot be read: {error}.") from None


def compare_episode(path: Path, agreement: Agreement) -> None:
    """Set the house to each state of a recorded episode, act, and compare with the next state.

    Args:
        path: JSON Lines: {"action": {...}, "metadata": the metadata after it}.
        agreement: Takes the counts.

    Raises:
        InvalidInputError: The file is no such recording.
    """
    before: Scene | None = None
    for number, row in enumerate(rows(path), 1):
        label = f"{path.name}, line {number}"
        action, metadata = row.get("action"), row.get("metadata")
        if not isinstance(action, dict) or not isinstance(metadata, dict):
            raise InvalidInputError(f"{label}: expected the keys 'action' and 'metadata'.")
        after = scene_from_metadata(metadata, label=label)
        given = cast("dict[str, Any]", action)
        name = str(given.get("action"))
        if before is not None and name not in _NEW_STARTS:
            house = House(before)
            start = by_id(house.metadata()["objects"])
            ours = house.step(given)
            succeeded = bool(cast("dict[str, Any]", metadata).get("lastActionSuccess"))
            agreement.steps += 1
            if ours["lastActionSuccess"] == succeeded:
                agreement.agreed += 1
            else:
                agreement.refused[name, ours["errorMessage"] or "succeeded"] += 1
            agreement.count(
                name,
                triples(start, by_id(after.objects)),
                triples(start, by_id(ours["objects"])),
            )
        before = after


def triples(
    before: Mapping[str, Mapping[str, Any]], after: Mapping[str, Mapping[str, Any]]
) -> set[Triple]:
    """What changed, as (object, predicate, new value); receptacles count as one set.

    A new object counts with all that is true of it.
    """
    found: set[Triple] = set()
    for own, thing in after.items():
        old = before.get(own, {})
        for predicate in PREDICATES:
            value = _value(thing, predicate)
            if value != _value(old, predicate):
                found.add((own, predicate, value))
    return found


def _value(thing: Mapping[str, Any], predicate: str) -> object:
    value = thing.get(predicate)
    if predicate == "parentReceptacles":
        return tuple(sorted(value or ()))
    if predicate == "temperature":
        return value or "RoomTemp"
    return bool(value)


def replay_game(game: Mapping[str, Any], scene: Scene, agreement: Agreement) -> None:
    """Do again what the person who drove the robot did with success, and compare the end."""
    house = House(room_at_start(game["initial_objects"], scene))
    began = by_id(house.metadata()["objects"])
    clock = 0.0
    for act in _acts(game["interactions"]):
        seconds = float(act["t"]) - clock
        house.advance(max(seconds, 0.0))
        clock = float(act["t"])
        agreement.steps += 1
        error = _do(house, act)
        if error is None:
            agreement.agreed += 1
        else:
            agreement.refused[str(act["action"]), _general(error)] += 1
    real = {each["objectId"]: predicates(each) for each in game["final_objects"]}
    first = {each["objectId"]: predicates(each) for each in game["initial_objects"]}
    agreement.count(
        "game", triples(first, real), triples(began, by_id(house.metadata()["objects"]))
    )


def _acts(interactions: Any) -> Iterator[Mapping[str, Any]]:
    for each in interactions:
        if each["agent"] == "driver" and each["success"] and "oid" in each:
            yield each


def _do(house: House, act: Mapping[str, Any]) -> str | None:
    """The house's error, or None where it accepted the act."""
    own, name = act["oid"], act["action"]
    if name != "Pour":
        step = {"action": _ACTIONS[name], "objectId": own, "forceAction": True}
        return house.step(step)["errorMessage"] or None
    held = house.state.held
    if held is None:
        return "Nothing to pour from."
    liquid = house.state.objects[held]["fillLiquid"] or "water"
    error = house.step({"action": "EmptyLiquidFromObject", "objectId": held, "forceAction": True})[
        "errorMessage"
    ]
    target = house.state.objects.get(own)
    if not error and target and target["canFillWithLiquid"] and not target["isFilledWithLiquid"]:
        fill = {"action": "FillObjectWithLiquid", "objectId": own, "fillLiquid": liquid}
        error = house.step({**fill, "forceAction": True})["errorMessage"]
    return error or None


def _general(error: str) -> str:
    """The message with types in place of ids."""
    return " ".join(type_of(word) if "|" in word else word for word in error.split())


def show(name: str, agreement: Agreement) -> None:
    """Print the figures, and the commonest differences."""
    out = Console(markup=False, highlight=False)
    out.print(
        f"{name}: {pluralize(agreement.steps, 'action')}, success agrees in "
        f"{agreement.success_agreement:.1%}; changed states: precision {agreement.precision:.3f}, "
        f"recall {agreement.recall:.3f}, F1 {agreement.f1:.3f}"
    )
    table = Table("difference", "action", "predicate", "count")
    for kind, counts in (("missed", agreement.missed), ("extra", agreement.extra)):
        for (action, predicate), count in counts.most_common(12):
            table.add_row(kind, action, predicate, str(count))
    for (action, message), count in agreement.refused.most_common(12):
        table.add_row("success", action, message, str(count))
    if table.row_count:
        out.print(table)


if __name__ == "__main__":
    main()
