"""docs/domain.md shows every line of two examples, and the rest of its code runs."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "domain.md").read_text(encoding="utf-8")
LAMP = (ROOT / "examples" / "lamp.py").read_text(encoding="utf-8")
GARDEN = (ROOT / "examples" / "garden.py").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)


def lines(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.strip()]


def test_the_page_shows_the_whole_examples_in_their_order() -> None:
    lamp, *shown, _, _, _ = blocks("python")
    assert lines(lamp) == lines(LAMP)
    assert lines("".join(shown)) == lines(GARDEN)
    assert f"in {len(lines(LAMP))} lines" in PAGE
    assert f"in {len(lines(GARDEN))} lines" in PAGE
    (people,) = blocks("toml")
    assert lines(people) == lines((ROOT / "examples" / "garden.toml").read_text(encoding="utf-8"))


def test_the_rest_of_its_code_prints_what_the_page_shows(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    exec(compile("".join(blocks("python")[-3:]), "docs/domain.md", "exec"), {})
    assert capsys.readouterr().out == "".join(blocks("text"))
