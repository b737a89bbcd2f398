"""The speed benchmark's table, files and plot."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from goalscope.models.llama.engine import processor

FOLDER = Path(__file__).parent / "results"
PACKAGES = ("goalscope", "xllamacpp", "numpy", "torch", "transformers", "lm-eval", "minicons")
FLAGS = ("avx2", "avx512f", "avx512_vnni", "avx512_bf16", "amx_bf16", "neon", "bf16")
OURS = "goalscope"
PAPER = "Transformers, one goal after another, float32"
SHARED = "shared prefix cache"
FLOORS = ("floor", "floor, scored")
COLUMNS = {
    "paper's way": "one goal after another",
    "padded batch": "padded batch",
    "lm-eval": "lm-evaluation-harness",
    "minicons": "minicons",
    "shared prefix": SHARED,
}

Cells = dict[str, dict[str, Any]]


@dataclass
class Results:
    """What was measured.

    Attributes:
        engine: How this project's engine runs.
        cells: One for each number of goals, round and way, with its seconds.
        errors: For each way, the largest difference to the paper's way, in nats.
        megabytes: Peak resident memory of this project alone with the most goals.
        growth: For each way, the cumulative seconds of rounds 1, 2, ....
    """

    engine: str = ""
    cells: list[dict[str, Any]] = field(default_factory=list)
    errors: dict[str, float] = field(default_factory=dict)
    megabytes: float | None = None
    growth: dict[str, list[float]] = field(default_factory=dict)

    def add(self, goal_count: int, round_number: int, way: str, **values: Any) -> None:
        """Add a cell."""
        self.cells.append({"goals": goal_count, "round": round_number, "way": way, **values})

    def compare(self, way: str, values: Sequence[float], reference: Sequence[float]) -> None:
        """Note how far values are from those of the paper's way."""
        gap = max(abs(a - b) for a, b in zip(values, reference, strict=False))
        self.errors[way] = max(gap, self.errors.get(way, 0.0))


def show(results: Results, headline: tuple[int, int]) -> None:
    """Print the table, the agreement, and how the aims are met."""
    console = Console(width=max(120, Console().width))
    console.print(f"this project: {results.engine}")
    head, *lines = _ratio_lines(results)
    table = Table(*head, title="Time of an update: this project = 1 (floor: update / floor)")
    for line in lines:
        table.add_row(*line)
    console.print(table)
    table = Table("way", "largest difference, nats", title="Agreement with the paper's way")
    for name, gap in results.errors.items():
        table.add_row(name, f"{gap:.1g}")
    console.print(table)
    for line in _aim_lines(results, headline):
        console.print(line)


def write(results: Results, headline: tuple[int, int]) -> None:
    """Write `speed.json`, `speed.md` and the plot."""
    FOLDER.mkdir(exist_ok=True)
    machine = describe_machine()
    data = {"machine": machine, **vars(results)}
    (FOLDER / "speed.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    head, *lines = _ratio_lines(results)
    parts = [
        "# Speed of a belief update",
        "Written by `python benchmarks/speed.py`; its first lines say what is measured. Seconds "
        "are this project's; every other column is the time of that way as a multiple of them, "
        "and the floor's is the update as a multiple of the floor. ~ is scaled up from some of "
        "the goals. Ways with two number types show the faster one.",
        "\n".join(f"- {name}: {value}" for name, value in machine.items()),
        f"This project's engine: {results.engine}.",
        _markdown(head, lines),
        "## Agreement with the paper's way in float32",
        _markdown(
            ["way", "largest difference, nats"],
            [[name, f"{gap:.2g}"] for name, gap in results.errors.items()],
        ),
        f"## Aims, at {headline[0]} goals and round {headline[1]}",
        "\n".join(f"- {line}" for line in _aim_lines(results, headline)),
        "![Cumulative time over an episode](speed.svg)",
    ]
    (FOLDER / "speed.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    plot(results)


def plot(results: Results) -> None:
    """Draw the cumulative time over an episode."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, panels = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for name, seconds in results.growth.items():
        for axes in panels if name != PAPER else panels[:1]:
            axes.plot(range(1, len(seconds) + 1), seconds, marker=".", label=name)
    panels[0].set_title("Updates of a whole episode, 20 goals")
    panels[1].set_title("without the paper's way")
    for axes in panels:
        axes.set(xlabel="rounds", ylabel="cumulative seconds", xlim=(0, None), ylim=(0, None))
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.grid(alpha=0.3)
    panels[0].legend(fontsize=8)
    for ending in ("png", "svg"):
        figure.savefig(FOLDER / f"speed.{ending}", dpi=150)
    plt.close(figure)


def describe_machine() -> dict[str, str]:
    """The processor and the versions."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    info = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    present = info.get("flags", info.get("Features", "")).split()
    return {
        "processor": processor(),
        "flags": ", ".join(flag for flag in FLAGS if flag in present) or "unknown",
        "processors": f"{os.cpu_count()}; at most two threads used by each way",
        "system": f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
        "packages": ", ".join(f"{name} {version(name)}" for name in PACKAGES),
    }


def _by_cell(results: Results) -> dict[tuple[int, int], Cells]:
    table: dict[tuple[int, int], Cells] = {}
    for cell in results.cells:
        table.setdefault((cell["goals"], cell["round"]), {})[cell["way"]] = cell
    return dict(sorted(table.items()))


def _ratio_lines(results: Results) -> list[list[str]]:
    lines = [["goals", "round", "tokens", "seconds", "/ floor", "/ scored floor", *COLUMNS]]
    for (goals, number), cells in _by_cell(results).items():
        ours = cells[OURS]
        line = [str(goals), str(number), str(ours["tokens"]), f"{ours['seconds']:.2f}"]
        line += [f"{ours['seconds'] / cells[name]['seconds']:.2f}" for name in FLOORS]
        for part in COLUMNS.values():
            best = _fastest(cells, part)
            mark = "~" if best.get("scaled") else ""
            line.append(f"{mark}{best['seconds'] / ours['seconds']:.1f}")
        lines.append(line)
    return lines


def _fastest(cells: Cells, part: str) -> dict[str, Any]:
    return min((cell for name, cell in cells.items() if part in name), key=_seconds)


def _seconds(cell: dict[str, Any]) -> float:
    return cell["seconds"]


def _aim_lines(results: Results, headline: tuple[int, int]) -> list[str]:
    cells = _by_cell(results)[headline]
    ours = cells[OURS]["seconds"]
    parts = [part for part in COLUMNS.values() if part != SHARED]
    best = min((_fastest(cells, part) for part in parts), key=_seconds)
    shared = _fastest(cells, SHARED)
    lines = [
        f"the paper's way in float32: {cells[PAPER]['seconds'] / ours:.1f} times the update "
        "(aim: 40)",
        f"best without a shared prefix, {best['way']}: {best['seconds'] / ours:.1f} (aim: 8)",
        f"{shared['way']}: {shared['seconds'] / ours:.1f} (aim: 2)",
        f"update / floor: {ours / cells[FLOORS[0]]['seconds']:.2f}, with as many tokens scored "
        f"{ours / cells[FLOORS[1]]['seconds']:.2f} (aim: 1.15)",
    ]
    if results.megabytes is not None:
        lines.append(f"peak memory with 500 goals: {results.megabytes:.0f} MB (aim: 1500)")
    return lines


def _markdown(head: list[str], lines: list[list[str]]) -> str:
    rows = [head, ["---"] * len(head), *lines]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)
