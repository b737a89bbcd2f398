"""docs/reliability.md and the tests of what it says name each other."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "reliability.md").read_text(encoding="utf-8")
NAMED = set(re.findall(r"tests/[\w/]+\.py::\w+", PAGE))


def laws_of(file: Path) -> set[str]:
    found = ast.parse(file.read_text(encoding="utf-8")).body
    return {
        f"{file.relative_to(ROOT).as_posix()}::{each.name}"
        for each in found
        if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef)
        and each.name.startswith("test_")
    }


def test_every_test_that_the_page_names_exists() -> None:
    there = {test for file in (ROOT / "tests").rglob("test_*.py") for test in laws_of(file)}
    assert not NAMED - there


def test_the_page_names_every_test_of_reliability() -> None:
    files = (ROOT / "tests" / "reliability").glob("test_*.py")
    there = {test for file in files for test in laws_of(file)}
    assert not there - NAMED


def test_every_line_has_its_figure_and_a_test_or_a_reason() -> None:
    _, *entries = re.split(r"^\*\*(\d+)\.\*\* ", PAGE, flags=re.MULTILINE)
    assert [int(each) for each in entries[::2]] == list(range(1, len(entries) // 2 + 1))
    for entry in entries[1::2]:
        assert re.search(r"^\*Measured:\* \S", entry, re.MULTILINE), entry
        assert "\ntests/" in entry or re.search(r"^\*By:\* \S", entry, re.MULTILINE), entry
