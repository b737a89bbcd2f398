"""README.md and the pages of docs/ are true: their code runs, and prints what they say it does.

A page that needs more than the embedded model has a test of its own, `test_docs_NAME.py`. Those of
the command line and of the code are written anew by `GOALSCOPE_DOCS=1 pytest tests/test_docs.py`.
"""

from __future__ import annotations

import ast
import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
import textwrap
import tomllib
from collections.abc import Callable, Iterator
from decimal import ROUND_HALF_UP, Decimal
from importlib import import_module
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import typer.main
from typer.testing import CliRunner

import goalscope
from goalscope.cli.main import app
from goalscope.datasets import read_cases
from goalscope.envs import grocery, house
from goalscope.experiment.reading import read_experiment
from goalscope.infer import read_dialogues
from goalscope.study.plan import read_plan
from test_layers import LAYERS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
COMMANDS = DOCS / "commands.md"
GENERATED = {COMMANDS, DOCS / "results.md"}
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted({*DOCS.glob("*.md")} - GENERATED)]
ALONE = [page for page in PAGES if not (ROOT / "tests" / f"test_docs_{page.stem}.py").exists()]
OF_OTHERS = {"--logits_all"}
"""Options of other programs."""
QUICK = (
    "data list", "episodes", "house scenes", "house show", "infer", "models list", "study example",
    "study list",
)  # fmt: skip
"""Commands that need no more than what a page gives them, and some seconds."""
READERS: dict[str, Callable[[Path], Any]] = {
    "dialogues.jsonl": read_dialogues,
    "experiment.toml": read_experiment,
    "mine.toml": read_experiment,
    "own.jsonl": read_cases,
    "people.toml": grocery.load_profiles,
    "questions.jsonl": lambda file: import_module("goalscope.benchmarks.mcq").read_questions(file),
    "residents.toml": house.load_profiles,
    "shop.csv": lambda file: grocery.Catalogue.load(file, columns={"name": "Title"}),
    "study.toml": read_plan,
}
PARSER = typer.main.get_command(app)
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
each_page_alone = pytest.mark.parametrize("page", ALONE, ids=lambda page: page.name)


class Block(NamedTuple):
    """A fenced block of a page, and the heading of a file in it."""

    language: str
    title: str
    text: str


def blocks(page: Path) -> list[Block]:
    fence = r'^```(\w*)(?: title="([^"]*)")?\n(.*?)^```$'
    text = page.read_text(encoding="utf-8")
    return [Block(*found) for found in re.findall(fence, text, re.DOTALL | re.MULTILINE)]


def shell(block: Block) -> Iterator[tuple[list[str], str]]:
    """The words of each command in a block for the shell, and the file that it writes to."""
    if block.language not in ("sh", "bash", "console"):
        return
    for line in re.sub(r"\\\n\s*", "", block.text).splitlines():
        command, *target = line.removeprefix("$ ").split(" > ")
        words = shlex.split(command, comments=True)
        while words and re.match(r"\w+=", words[0]):
            del words[0]
        yield words, shlex.split(target[0], comments=True)[0] if target else ""


def inline(page: Path) -> Iterator[str]:
    """What stands between single backticks."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.M)
    for paragraph in re.split(r"\n\s*\n|\n\|", text):
        for found in re.findall(r"`([^`]+)`", paragraph):
            yield " ".join(found.replace("\\", "").split())


def commands(command: Any, *path: str) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Each command that is listed, under its names."""
    yield path, command
    for name, each in getattr(command, "commands", {}).items():
        if not each.hidden:
            yield from commands(each, *path, name)


def parse(words: list[str]) -> str:
    """Have the real command line take words, and do nothing but help; what it says."""
    told = io.StringIO()
    with contextlib.redirect_stdout(told):
        PARSER.main(
            words, prog_name="goalscope", standalone_mode=False, terminal_width=80, color=False
        )
    return told.getvalue()


NAMES = dict(commands(PARSER))
for each in NAMES.values():
    each.callback = lambda **_: None


def same(printed: str, shown: str) -> None:
    """Hold two texts to be equal but for what another processor may compute, and for order."""
    number = re.compile(r"-?\d+(?:\.\d+)?")
    for found, expected in zip(
        *(sorted(each.splitlines(), key=lambda line: number.sub("#", line))
          for each in (printed, shown)), strict=True,
    ):  # fmt: skip
        assert number.sub("#", found) == number.sub("#", expected)
        assert [float(each) for each in number.findall(found)] == pytest.approx(
            [float(each) for each in number.findall(expected)], abs=6 if "%" in expected else 0.2
        )


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "episodes.db"))
    monkeypatch.setenv("GOALSCOPE_DATA", str(tmp_path / "datasets"))
    (tmp_path / "datasets").mkdir()
    return tmp_path


@each_page_alone
def test_what_a_page_shows_runs_and_prints_what_it_says(
    page: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names: dict[str, Any] = {"__name__": "__main__"}
    for block, after in pairwise([*blocks(page), Block("", "", "")]):
        if block.language in ("csv", "json", "toml"):
            (folder / block.title).write_text(block.text, encoding="utf-8")
            assert READERS[block.title](folder / block.title)
        capsys.readouterr()
        if block.language == "python":
            exec(compile(block.text, str(page), "exec"), names)
        printed = capsys.readouterr().out
        for words, target in shell(block):
            if not " ".join(words[1:]).startswith(QUICK) or "ID" in words:
                continue
            if words[1] == "infer" and not Path(words[2]).exists():
                continue
            done = CliRunner().invoke(app, words[1:])
            assert done.exit_code == 0, (words, done.output)
            printed += done.stdout
            if target:
                Path(target).write_text(done.stdout, encoding="utf-8")
                assert READERS[target](Path(target))
        if printed and after.language == "text":
            same(printed, after.text)


@each_page
def test_every_command_of_a_page_is_one(page: Path) -> None:
    given = [words for block in blocks(page) for words, _ in shell(block)]
    for text in inline(page):
        named = shlex.split(text) if text.startswith("goalscope ") else []
        given.append([*named, "--help"] if tuple(named[1:]) in NAMES else named)
    targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for words in given:
        if words[:1] == ["goalscope"]:
            parse(words[1:])
        elif words[:1] == ["make"]:
            assert set(words[1:]) <= {*targets}, words
        for extra in re.findall(r"\.\[(\w+)\]|goalscope\[(\w+)\]", " ".join(words)):
            assert "".join(extra) in project["optional-dependencies"]


@each_page
def test_every_option_of_a_page_is_one(page: Path) -> None:
    known = {
        option
        for command in NAMES.values()
        for parameter in command.params
        for option in (*parameter.opts, *parameter.secondary_opts)
    }
    said = {option for text in inline(page) for option in re.findall(r"(?<!\S)--[\w-]+", text)}
    assert said - known - OF_OTHERS - {"--help"} == set()


@pytest.mark.parametrize("words", [["chat", "--speed", "9"], ["chatter"], ["replay"]])
def test_a_command_that_is_none_is_seen(words: list[str]) -> None:
    with pytest.raises(Exception, match=r"(?i)no such|missing"):
        parse(words)


def test_what_is_printed_may_differ_a_little_and_in_nothing_else() -> None:
    same("0.71 tea\n", "0.7 tea\n")
    same("9% tea\n90% cake\n", "91% cake\n8% tea\n")
    for wrong in ("0.3 tea\n", "0.7 cake\n", ""):
        with pytest.raises((AssertionError, ValueError)):
            same(wrong, "0.7 tea\n")


def test_the_page_of_the_command_line_is_what_help_says() -> None:
    parts = [
        "# Command line\n\nWhat `goalscope COMMAND --help` says. Errors of what was given end with "
        "exit code 2; a model or an adapter\nthat cannot be opened, and all others, with 1.\n"
    ]
    for path in NAMES:
        told = parse([*path, "--help"])
        heading = "#" * (len(path) + 1 if path else 2)
        name = " ".join(("goalscope", *path))
        parts.append(f"{heading} {name}\n\n```text\n{told.strip()}\n```\n")
    page = "\n".join(parts)
    if os.environ.get("GOALSCOPE_DOCS"):
        COMMANDS.write_text(page, encoding="utf-8")
    assert COMMANDS.read_text(encoding="utf-8") == page


def test_the_page_of_the_code_tells_of_every_file_what_its_docstring_says() -> None:
    code = DOCS / "code.md"
    before, _, rest = code.read_text(encoding="utf-8").partition("```text\n")
    page = f"{before}```text\n{source_tree()}```{rest.partition('```')[2]}"
    if os.environ.get("GOALSCOPE_DOCS"):
        code.write_text(page, encoding="utf-8")
    assert code.read_text(encoding="utf-8") == page


def source_tree() -> str:
    """The source's files, what is built on others after these, each with its first line."""
    root = ROOT / "src" / "goalscope"
    rank = {name: (i, name) for i, layer in enumerate(LAYERS) for name in layer}
    lines = [told("src/goalscope/", root / "__init__.py")]

    def tell(folder: Path, depth: int) -> None:
        files = [each for each in folder.iterdir() if (each / "__init__.py").exists()]
        files += [each for each in folder.glob("*.py") if each.name != "__init__.py"]
        for file in sorted(files, key=lambda each: rank[each.stem] if depth == 1 else each.name):
            inside = file.is_dir()
            name = f"{'  ' * depth}{file.name}{'/' if inside else ''}"
            lines.append(told(name, file / "__init__.py" if inside else file))
            if inside:
                tell(file, depth + 1)

    tell(root, 1)
    return "\n".join(lines) + "\n"


def told(name: str, file: Path) -> str:
    """A name, and beside it what the module says of itself in the first line."""
    line = (ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or "").partition("\n")[0]
    return textwrap.fill(f"{name:<25} {line}", 90, subsequent_indent=" " * 26)


def test_the_reference_has_every_public_name() -> None:
    pages = (DOCS / "reference.md", DOCS / "extending.md")
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    documented = {
        name
        for module in re.findall(r"^::: (\S+)", text, re.M)
        for name in import_module(module).__all__
    }
    assert set(goalscope.__all__) - documented == set()


def test_the_picture_is_of_the_example_beside_it() -> None:
    drawn = (DOCS / "belief.svg").read_text(encoding="utf-8")
    found = re.findall(r'text-anchor="end" fill="#333">([^<]+)<.*?>(\d+%)<', drawn)
    goals = {goal for goal, _ in found}
    last = "".join(f"{share} {goal}\n" for goal, share in found[-len(goals) :])
    (shown,) = (each.text for each in blocks(ROOT / "README.md") if each.language == "text")
    same(last, shown)
    page = (ROOT / "src/goalscope/web/static/example.js").read_text(encoding="utf-8")
    turns = re.findall(r'\["[^"]+\.", \[([\d, ]+)\]\]', page)
    on_the_page = [f"{each}%" for turn in turns for each in turn.split(", ")]
    assert on_the_page == [share for _, share in found]


def cells(line: str) -> list[str]:
    """Each entry of a table's row, without its interval."""
    return [each.partition(" [")[0].strip() for each in line.strip("|").split("|")]


def rounded(share: str, loss: str = "") -> str:
    places = ((share.removesuffix(" %"), "1", " %"), (loss, "0.01", ""))
    return ", ".join(
        f"{Decimal(value).quantize(Decimal(place), ROUND_HALF_UP)}{unit}"
        for value, place, unit in places
        if value
    )


@pytest.mark.parametrize("dialogues", ["TEACh", "MultiWOZ", "ALFRED", "Taskmaster-4", "CaSiNo"])
def test_the_figures_of_the_readme_are_those_of_the_results(dialogues: str) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (row,) = (line for line in readme.splitlines() if re.match(rf"\| \d+ {dialogues} ", line))
    n, name = row.split()[1], dialogues.lower().replace("-", "")
    beliefs, results = (
        (DOCS / "results" / f"{part}.md").read_text(encoding="utf-8") for part in ("beliefs", name)
    )
    ours = re.findall(rf"^\| {name}, .*\| goalscope \|.*$", beliefs, re.M)
    without, _ = [cells(line)[3:6] for line in ours]
    fitted = (DOCS / "fit.md").read_text(encoding="utf-8")
    adapted = re.search(rf"^\| {dialogues}[^|]* \| {n} \| \d+ \|[^|]*\|[^|]*\|(.*)\|", fitted, re.M)
    assert adapted
    start = rf"^## Goals inferred from dialogues: {name}, [^\n]* {cells(row)[1]} \w+ goals each, "
    *_, table = re.findall(
        rf"{start}SmolLM2-135M-Instruct, {n} dialogues\n\n(.*?)\n\n", results, re.M | re.S
    )
    others = {
        name: (share, loss) for name, _, _, share, _, loss, *_ in map(cells, table.splitlines())
    }
    assert without[0] == n
    assert cells(row)[2:] == [
        re.sub(r" \[[^]]*\]", "", adapted[1].partition("|")[0]).strip(), rounded(*without[1:]),
        rounded(*others["TF-IDF"]), rounded(*others["embedding"]),
    ]  # fmt: skip


def test_the_readme_says_on_which_sets_the_papers_belief_has_the_lower_log_loss() -> None:
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    text = (DOCS / "results/beliefs.md").read_text(encoding="utf-8")
    names = ("TEACh", "ALFRED", "MultiWOZ", "CaSiNo", "Taskmaster-4")
    papers, ours = (
        {
            row[0].partition(",")[0]: row[5]
            for row in map(
                cells,
                re.findall(rf"^\| .*\| \S+ without adapter \| {belief} \|.*$", text, re.M),
            )
        }
        for belief in ("Eq. 1", "goalscope")
    )
    assert len(papers) == len(ours) == len(names)
    keys = {name: name.lower().replace("-", "") for name in names}
    lower = [n for n, key in keys.items() if Decimal(papers[key]) < Decimal(ours[key])]
    without = ", ".join(f"{name} {rounded('', papers[keys[name]])}" for name in lower)
    fitted = " ".join((DOCS / "fit.md").read_text(encoding="utf-8").split())
    by_eq_1 = re.findall(r"(\d\.\d\d) \(([\w-]+)", fitted.partition("By Eq. 1 alone")[2])
    rows = dict(re.findall(r"\| \d+ ([\w-]+) [^|]*\| \d+ \| \d+ %, (\d\.\d\d)", readme))
    lower = [f"{name} {loss}" for loss, name in by_eq_1 if Decimal(loss) < Decimal(rows[name])]
    assert f"without the adapter {without}; with it {', '.join(lower) or 'none'}." in readme


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_links_from_the_root_lead_somewhere(name: str) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)]+)\)", text):
        if not link.startswith("https://"):
            assert (ROOT / link.partition("#")[0]).is_file(), link


@pytest.mark.skipif(not find_spec("mkdocs"), reason="mkdocs is not installed")
def test_the_site_builds_and_asks_other_hosts_for_nothing(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    pages = sorted(tmp_path.rglob("*.html"))
    assert len(pages) > 10
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert not re.findall(r"<(?:script|link|img|iframe)[^>]+(?:src|href)=.?https?:", text), page
        assert not re.findall(
            r"^(?:[-*] |\|).*", re.sub(r"<pre.*?</pre>", "", text, flags=re.S), re.M
        )
