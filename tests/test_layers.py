"""Who may import whom: a room imports only from itself and the rooms below it, none in a circle."""

import ast
import re
from pathlib import Path

import goalscope

ROOT = Path(goalscope.__file__).parent
ROOMS = [
    *("base", "models", "prompts", "language", "envs", "belief", "agent", "datasets"),
    *("storage", "experiment", "fitting", "study", "report", "web", "cli"),
]
DOMAINS = r"goalscope\.envs\.(?:grocery|house)[\w.]*"


def imports(file: Path) -> set[str]:
    """Modules of goalscope that a file imports, when it is imported or later."""
    found: set[str] = set()
    tree = ast.parse(file.read_text(encoding="utf-8"))
    typing = {id(n) for f in ast.walk(tree) if isinstance(f, ast.If) for n in ast.walk(f)}
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom) or id(node) in typing:
            continue
        if node.module == "goalscope":
            found |= {f"goalscope.{each.name}" for each in node.names}
        elif node.module and node.module.startswith("goalscope."):
            found.add(node.module)
    return found


def modules() -> dict[str, Path]:
    """Every module by its dotted name; a package by that of its folder."""
    names = {
        file: ".".join(("goalscope", *file.relative_to(ROOT).with_suffix("").parts))
        for file in ROOT.rglob("*.py")
    }
    return {name.removesuffix(".__init__"): file for file, name in names.items()}


def room(module: str) -> str:
    return module.split(".")[1]


def test_every_module_is_in_a_room() -> None:
    here = {room(module) for module in modules() if module != "goalscope"}
    assert here == set(ROOMS)


def test_imports_point_down() -> None:
    assert [
        f"{module} imports {other}"
        for module, file in modules().items()
        if module != "goalscope"
        for other in imports(file)
        if "." in other and ROOMS.index(room(other)) > ROOMS.index(room(module))
    ] == []


def test_no_module_imports_itself_by_way_of_others() -> None:
    graph = {module: imports(file) for module, file in modules().items()}

    def reach(name: str, seen: set[str]) -> set[str]:
        for other in graph.get(name, set()) - seen:
            seen.add(other)
            reach(other, seen)
        return seen

    assert [name for name in graph if name in reach(name, set())] == []


def test_nothing_but_the_registry_knows_a_domain() -> None:
    """But for the command `goalscope house`, which is of the one domain."""
    named = re.compile(rf"{DOMAINS}|\"(?:grocery|house)\"")
    assert [
        f"{file.relative_to(ROOT)} names {module}"
        for file in ROOT.rglob("*.py")
        if "envs" not in file.relative_to(ROOT).parts[:1]
        if file.relative_to(ROOT).parts != ("cli", "house.py")
        for module in named.findall(file.read_text(encoding="utf-8"))
        if (file.name, module) != ("main.py", '"house"')
    ] == []
