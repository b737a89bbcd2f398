"""Who may import whom: a module imports only from its own layer's left, and none in a circle."""

import ast
import re
from pathlib import Path

import goalscope

ROOT = Path(goalscope.__file__).parent
LAYERS = [
    {
        "types",
        "amounts",
        "invisible",
        "plain_text",
        "safe_text",
        "calibration",
        "extras",
        "places",
        "words",
    },
    {
        "belief",
        "models",
        "guards",
        "inputs",
        "orders",
        "picking",
        "prompts",
        "reader",
        "standing",
        "envs",
        "stats",
        "calibrations",
        "cues",
        "occasions",
        "ranking",
    },
    {
        "likelihood",
        "goals",
        "dialog",
        "habits",
        "policy",
        "writer",
        "prompted",
        "modules",
        "why",
    },
    {"advice", "agent", "episode", "executor", "judge", "ranker", "tracker"},
    {"database", "rounds_json", "store", "infer", "domains", "datasets"},
    {"session", "tracking", "display", "benchmarks", "calibrating"},
    {"experiment"},
    {"study"},
    {"report"},
    {"fitting", "web", "mcp_server"},
    {"cli"},
]
RANK = {name: rank for rank, layer in enumerate(LAYERS) for name in layer}


def imports(file: Path) -> set[str]:
    """Modules of goalscope that a file imports when it is imported itself."""
    found: set[str] = set()
    tree = ast.parse(file.read_text(encoding="utf-8"))
    lazy = {id(n) for f in ast.walk(tree) if isinstance(f, ast.FunctionDef) for n in ast.walk(f)}
    typing = {id(n) for f in ast.walk(tree) if isinstance(f, ast.If) for n in ast.walk(f)}
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom) or id(node) in lazy | typing:
            continue
        if node.module == "goalscope":
            found |= {f"goalscope.{each.name}" for each in node.names}
        elif node.module and node.module.startswith("goalscope."):
            found.add(node.module)
    return found


def test_every_module_has_a_layer() -> None:
    here = {each.stem for each in ROOT.iterdir() if each.suffix == ".py" or any(each.glob("*.py"))}
    assert here - {"__init__", "__pycache__"} == set(RANK)


def test_imports_point_down() -> None:
    wrong: list[str] = []
    for file in ROOT.rglob("*.py"):
        own = file.relative_to(ROOT).parts[0].removesuffix(".py")
        for module in imports(file) if own != "__init__" else ():
            if RANK[module.split(".")[1]] > RANK[own]:
                wrong.append(f"{own} imports {module}")
    assert wrong == []


def test_no_module_imports_itself_by_way_of_others() -> None:
    graph = {
        ".".join(("goalscope", *file.relative_to(ROOT).with_suffix("").parts)): imports(file)
        for file in ROOT.rglob("*.py")
    }

    def reach(name: str, seen: set[str]) -> set[str]:
        for other in graph.get(name, set()) - seen:
            seen.add(other)
            reach(other, seen)
        return seen

    assert [name for name in graph if name in reach(name, set())] == []


def test_the_core_knows_no_domain() -> None:
    core = set[str]().union(*LAYERS[:4])
    named = [
        f"{file.relative_to(ROOT)} imports {module}"
        for file in ROOT.rglob("*.py")
        if file.relative_to(ROOT).parts[0].removesuffix(".py") in core
        and "envs" not in file.relative_to(ROOT).parts[:1]
        for module in re.findall(
            r"goalscope\.envs\.(?:grocery|house)[\w.]*", file.read_text(encoding="utf-8")
        )
    ]
    assert named == []
