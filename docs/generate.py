"""Pages of the site that no file in docs/ holds: an MkDocs hook, run by `make docs`.

The command line's page comes from `--help`, the page of the code from docstrings. Files from
elsewhere in the repository, such as README.md, become pages too. Pages link to files where they
lie in the repository; a link to a file that is a page of the site is turned into one to that page.
"""

from __future__ import annotations

import ast
import contextlib
import io
import posixpath
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer.main

from goalscope.agent.planner import Want
from goalscope.base.types import Turn
from goalscope.cli.main import app
from goalscope.prompts import render

ROOT = Path(__file__).parents[1]
ELSEWHERE = {
    "index.md": "README.md",
    "adapter.md": "src/goalscope/models/general/README.md",
    "changelog.md": "CHANGELOG.md",
    "contributing.md": "CONTRIBUTING.md",
    "security.md": "SECURITY.md",
    "speed.md": "benchmarks/results/speed.md",
    "speed.svg": "benchmarks/results/speed.svg",
}
"""Pages of the site and the files of the repository that they show."""


def on_files(files: Any, config: Any) -> Any:
    """Add the pages to those of docs/."""
    from mkdocs.structure.files import File

    for uri, source in ELSEWHERE.items():
        files.append(File.generated(config, uri, abs_src_path=str(ROOT / source)))
    files.append(File.generated(config, "commands.md", content=commands_page()))
    files.append(File.generated(config, "code.md", content=code_page()))
    files.append(File.generated(config, "prompts.md", content=prompts_page()))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn links to files of the repository into links to their pages; give tables more room.

    The reference gets the docstrings of the modules that it lists.
    """
    if page.file.src_uri.startswith("results"):
        page.meta["hide"] = ["toc"]
    if page.file.src_uri == "reference.md":
        markdown = re.sub(MODULE, documented, markdown)
    return relinked(markdown, page.file.src_uri)


MODULE = r"(?m)^- \[`(goalscope[\w.]*)`\]\((\S+)\): (.*)$"
"""An entry of the reference: a module, its file, and the first line of its docstring."""
MEMBERS = {"goalscope.models.opening": "[open_model, ModelSet]"}
"""Of modules of which the reference shows not all."""


def documented(entry: re.Match[str]) -> str:
    """The docstrings of a module, in place of its entry."""
    members = MEMBERS.get(entry[1])
    return f"::: {entry[1]}\n" + (f"    options: {{members: {members}}}\n" if members else "")


def relinked(markdown: str, uri: str) -> str:
    """The text of a page, with links that work in the site."""
    pages = {source: page for page, source in ELSEWHERE.items()}
    here = posixpath.dirname(ELSEWHERE.get(uri, f"docs/{uri}"))

    def link(found: re.Match[str]) -> str:
        file = posixpath.normpath(posixpath.join(here, found[1]))
        target = pages.get(file) or file.removeprefix("docs/")
        if target == file:
            return found[0]
        near = posixpath.relpath(target, posixpath.dirname(uri) or ".")
        return f"]({near}{found[2] or ''})"

    return re.sub(r"\]\(([^)#\s:]+)(#[^)\s]*)?\)", link, markdown)


PROMPTS = {
    "prompt_query": "Conversation: the query",
    "human": "Conversation: the simulated person",
    "goal_first": "Inference: the words of a person with a goal, which stands first",
    "goal_last": "Inference: the same, with the goal beside the query",
    "rank": "No Inference: the likeliest and the least likely goal",
    "prompt_goals": "Goal management: propose",
    "prompt_remove": "Goal management: remove",
    "prompt_relevant": "Action: what is relevant",
    "prompt_plan": "Action: the plan",
    "judge": "Evaluation: the score",
}
"""The paper's prompts, by the order of Algorithm 1."""


def prompts_page() -> str:
    """Each prompt of the paper's modules as it is sent, after one turn of an example."""
    turns = [Turn("What can I help you with?", "I'd like to eat food that is rich in iron.")]
    wants = [Want("eat more iron", 0.7), Want("cook lentils", 0.2)]
    values: dict[str, Any] = {
        "task": "The agent is a shopping agent. Its task is to fill a basket for the human.",
        "turns": turns, "query": turns[0].query, "status": "The basket is empty.",
        "goal": "eat more iron", "goals": [want.text for want in wants], "which": "most",
        "description": "You have anaemia and want to eat food that is rich in iron.", "habit": "",
        "completion_phrase": "Buy the basket", "things": ["lentils", "spinach", "candles"],
        "actions": ["add item: Canned Lentils", "add item: Baby Spinach", "buy basket"],
        "possible": ["search inventory", "add item", "remove item", "buy basket"],
        "outcome": "The basket holds:\n- 1 x Canned Lentils: $1.19",
    }  # fmt: skip
    parts = ["# Prompts\n\nMade from the templates in `src/goalscope/prompts`, for one turn.\n"]
    for name, title in PROMPTS.items():
        planned = {"goals": wants} if name in ("prompt_relevant", "prompt_plan") else {}
        parts.append(f"## {title}\n\n`{name}.jinja`\n")
        for message in render(name, **{**values, **planned}):
            parts.append(f"**{message.role}**\n\n```text\n{message.content}\n```\n")
    return "\n".join(parts)


def commands_page() -> str:
    """What `--help` says of each command that is listed."""
    parser = typer.main.get_command(app)
    parts = [
        "# Command line\n\n"
        "Wrong arguments and wrong input end a command with exit code 2, everything else that "
        "fails with 1.\n"
    ]
    for path, _ in commands(parser):
        told = io.StringIO()
        with contextlib.redirect_stdout(told):
            parser.main(
                [*path, "--help"],
                prog_name="goalscope",
                standalone_mode=False,
                terminal_width=80,
                color=False,
            )
        heading = "#" * (len(path) + 1 if path else 2)
        name = " ".join(("goalscope", *path))
        parts.append(f"{heading} {name}\n\n```text\n{told.getvalue().strip()}\n```\n")
    return "\n".join(parts)


def commands(command: Any, *path: str) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Each command that is listed, under its names."""
    yield path, command
    for name, each in getattr(command, "commands", {}).items():
        if not each.hidden:
            yield from commands(each, *path, name)


def code_page() -> str:
    """A line for each file of the source: the first of its docstring."""
    root = ROOT / "src" / "goalscope"
    lines: list[str] = []

    def tell(name: str, file: Path) -> None:
        text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
        line = f"{name:<25} {text.partition(chr(10))[0]}"
        lines.append(textwrap.fill(line, 90, subsequent_indent=" " * 26))

    def walk(folder: Path, depth: int) -> None:
        tell(f"{'  ' * depth}{folder.name}/", folder / "__init__.py")
        inside = [each for each in folder.iterdir() if (each / "__init__.py").exists()]
        inside += [each for each in folder.glob("*.py") if each.name != "__init__.py"]
        for each in sorted(inside):
            if each.is_dir():
                walk(each, depth + 1)
            else:
                tell(f"{'  ' * (depth + 1)}{each.name}", each)

    walk(root, 0)
    return (
        "# Files\n\nEvery file of `src/goalscope`, with the first line of its docstring. "
        "[Contributing](contributing.md) says how they build on each other.\n\n"
        "```text\n" + "\n".join(lines) + "\n```\n"
    )
