"""README.md and the pages of docs/ are true: their code runs, and prints what they say it does.

A page that needs more than the embedded model has a test of its own, `test_docs_NAME.py`.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from decimal import ROUND_HALF_UP, Decimal
from importlib import import_module
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import typer.main

import goalscope
from commands import run
from goalscope.cli.main import app
from goalscope.datasets.case import read_cases
from goalscope.envs import grocery, house
from goalscope.experiment.plan import read_experiment
from goalscope.study.plan import read_plan

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
RESULTS = DOCS / "results.md"
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted({*DOCS.glob("*.md")} - {DOCS / "log.md", RESULTS}),
]
ALONE = [page for page in PAGES if not (ROOT / "tests" / f"test_docs_{page.stem}.py").exists()]
OF_OTHERS = {"--from", "--logits_all"}
"""Options of other programs."""
QUICK = (
    "data list", "episodes", "house scenes", "house show", "infer", "models list", "study example",
    "study list",
)  # fmt: skip
"""Commands that need no more than what a page gives them, and some seconds."""
READERS: dict[str, Callable[[Path], Any]] = {
    "changing.jsonl": read_cases,
    "dialogues.jsonl": lambda file: read_cases(file, labelled=False),
    "experiment.toml": read_experiment,
    "mine.toml": read_experiment,
    "overlap.toml": read_experiment,
    "own.jsonl": read_cases,
    "people.toml": grocery.load_profiles,
    "questions.jsonl": lambda file: import_module(
        "goalscope.experiment.multiple_choice"
    ).read_questions(file),
    "residents.toml": house.load_profiles,
    "shop.csv": lambda file: grocery.Catalogue.load(file, columns={"name": "Title"}),
    "study.toml": read_plan,
}
PARSER = typer.main.get_command(app)
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
each_page_alone = pytest.mark.parametrize("page", ALONE, ids=lambda page: page.name)


def hook() -> Any:
    """docs/generate.py, which makes the pages that no file holds."""
    spec = spec_from_file_location("generate", DOCS / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


GENERATE = hook()


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


def parse(words: list[str]) -> str:
    """Have the real command line take words, and do nothing but help; what it says."""
    told = io.StringIO()
    with contextlib.redirect_stdout(told):
        PARSER.main(
            words, prog_name="goalscope", standalone_mode=False, terminal_width=80, color=False
        )
    return told.getvalue()


NAMES = dict(GENERATE.commands(PARSER))
for each in NAMES.values():
    each.callback = lambda **_: None


def same(printed: str, shown: str) -> None:
    """Hold two texts to be equal but for order and the last digits of numbers."""
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
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("GOALSCOPE_DATA", str(tmp_path / "datasets"))
    (tmp_path / "datasets").mkdir()
    return tmp_path


@pytest.mark.docs
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
            if block.title:
                (folder / block.title).write_text(block.text, encoding="utf-8")
            exec(compile(block.text, str(page), "exec"), names)
        printed = capsys.readouterr().out
        for words, target in shell(block):
            if not " ".join(words[1:]).startswith(QUICK) or "ID" in words:
                continue
            if words[1] == "infer" and not Path(words[2]).exists():
                continue
            done = run(*words[1:])
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


def test_the_page_of_the_command_line_has_every_command_and_option() -> None:
    page = GENERATE.commands_page()
    sections = dict(re.findall(r"^##+ (goalscope[^\n]*)\n\n```text\n(.*?)^```$", page, re.M | re.S))
    assert len(sections) == len(NAMES)
    for path, command in NAMES.items():
        section = sections[" ".join(("goalscope", *path))]
        assert section.startswith("Usage: ")
        for option in {each for parameter in command.params for each in parameter.opts}:
            assert not option.startswith("--") or option in section


@pytest.mark.parametrize(
    ("uri", "text", "expected"),
    [
        ("index.md", "[a](docs/fit.md#x) ![b](docs/a.svg)", "[a](fit.md#x) ![b](a.svg)"),
        ("index.md", "[a](SECURITY.md) [b](https://host/)", "[a](security.md) [b](https://host/)"),
        ("fit.md", "[a](../CHANGELOG.md) [b](models.md#c)", "[a](changelog.md) [b](models.md#c)"),
        ("results/teach.md", "[a](../results.md)", "[a](../results.md)"),
        ("speed.md", "![a](speed.svg)", "![a](speed.svg)"),
    ],
)
def test_links_of_the_repository_become_links_of_the_site(
    uri: str, text: str, expected: str
) -> None:
    assert GENERATE.relinked(text, uri) == expected


def test_the_reference_has_every_public_name() -> None:
    text = (DOCS / "reference.md").read_text(encoding="utf-8")
    listed = re.findall(GENERATE.MODULE, text)
    documented = {name for module, _, _ in listed for name in vars(import_module(module))}
    assert set(goalscope.__all__) - documented == set()
    for module, file, told in listed:  # as the repository shows it
        assert (DOCS / file).resolve() == Path(import_module(module).__file__ or "")
        assert told == (import_module(module).__doc__ or "").splitlines()[0]
    shown = re.sub(GENERATE.MODULE, GENERATE.documented, text)  # as the site does
    assert [f"::: {module}" for module, _, _ in listed] == re.findall("(?m)^::: .*$", shown)
    assert ":::" not in text


def test_the_picture_is_of_the_example_beside_it() -> None:
    drawn = (DOCS / "belief.svg").read_text(encoding="utf-8")
    found = re.findall(r'text-anchor="end" fill="#333">([^<]+)<.*?>(\d+%)<', drawn)
    goals = {goal for goal, _ in found}
    last = "".join(f"{share} {goal}\n" for goal, share in found[-len(goals) :])
    (shown,) = (each.text for each in blocks(ROOT / "README.md") if each.language == "text")
    same(last, shown.partition("Advice:")[0])
    page = (ROOT / "src/goalscope/web/static/example.js").read_text(encoding="utf-8")
    turns = re.findall(r'\["[^"]+\.", \[([\d, ]+)\]\]', page)
    on_the_page = [f"{each}%" for turn in turns for each in turn.split(", ")]
    assert on_the_page == [share for _, share in found]


def cells(line: str) -> list[str]:
    """Each entry of a table's row, without its interval."""
    return [each.partition(" [")[0].strip() for each in line.strip("|").split("|")]


def rounded(share: str, loss: str = "") -> str:
    places = ((share.removesuffix(" %"), "0.1", " %"), (loss, "0.01", ""))
    return ", ".join(
        f"{Decimal(value).quantize(Decimal(place), ROUND_HALF_UP)}{unit}"
        for value, place, unit in places
        if value
    )


def plain_rows(title: str) -> list[list[str]]:
    """The rows of the table under a heading of docs/results.md, without intervals."""
    found = re.search(
        rf"^## {re.escape(title)}\n\n(.*?)\n\n", RESULTS.read_text("utf-8"), re.M | re.S
    )
    assert found, title
    return [cells(row) for row in found[1].splitlines()]


DIALOGUES = {
    "40 SGD talks, similar goals": "sgd, train, 20 hard goals",
    "40 SGD talks, terse goals": "sgd, train, 20 terse goals",
    "40 airline customers (MultiDoGO)": "multidogo, airline, 20 full goals",
    "40 fast-food customers (MultiDoGO)": "multidogo, fastfood, 20 full goals",
    "100 TEACh games": "teach, valid\\_seen, 20 random goals",
    "60 Taskmaster-4 orders": "taskmaster4, dev, 20 hard goals",
}
"""What the rows of README's table are called in the results."""


@pytest.mark.parametrize("told", DIALOGUES)
def test_the_figures_of_the_readme_are_those_of_the_results(told: str) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (row,) = re.findall(rf"^\| {re.escape(told)} \|.*", readme, re.M)
    n = told.partition(" ")[0]
    belief, ways = (
        next(
            found
            for found in plain_rows(table)
            if found[1].startswith(DIALOGUES[told]) and "without adapter" not in found[1]
            if found[2] == n
        )
        for table in (
            "Beliefs about what people wanted",
            "Simpler ways to infer goals, on the same dialogues",
        )
    )
    fitted = max((way.split(", ") for way in ways[6:]), key=lambda way: float(way[0].rstrip(" %")))
    measured = [rounded(*each) for each in (belief[3:5], fitted, ways[5].split(", "))]
    assert cells(row)[2:] == measured


def test_differences_in_the_readme_are_those_of_the_results() -> None:
    """In the order of README, which tells GOOD minus No Goals for four groups of people."""
    settings = [
        ("aims", "grocery, people\\_shop"),
        ("aims", "grocery, aims\\_test"),
        ("aims", "house, people\\_house"),
        ("paper-small", "grocery, scripted human"),
    ]
    header, _, *rows = plain_rows("Episodes: is what was wanted done in the end?")
    difference = header.index("good minus no-goals")
    measured = [
        next(row[difference] for row in rows if row[0] == part and row[1].startswith(setting))
        for part, setting in settings
    ]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"(\S+)\s+points", readme) == [each.removesuffix(" %") for each in measured]


@pytest.mark.parametrize(
    "page", [*PAGES, ROOT / "CHANGELOG.md", ROOT / "SECURITY.md"], ids=lambda page: page.name
)
def test_links_work_in_the_repository(page: Path) -> None:
    for link in re.findall(r"\]\(([^)#\s:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert (page.parent / link).is_file(), link


@pytest.mark.docs
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
