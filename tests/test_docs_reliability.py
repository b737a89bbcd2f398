"""docs/reliability.md and the tests of what it says name each other."""

import re
from pathlib import Path

TESTS = Path(__file__).parent
PAGE = (TESTS.parent / "docs" / "reliability.md").read_text(encoding="utf-8")
NAMED = set(re.findall(r"`((?:reliability/)?test_\w+\.py)`", PAGE))


def test_the_page_names_tests_that_exist_and_every_one_of_reliability() -> None:
    assert [name for name in NAMED if not (TESTS / name).exists()] == []
    assert {f"reliability/{file.name}" for file in TESTS.glob("reliability/test_*.py")} <= NAMED


def test_every_promise_has_its_figure_and_a_test_or_a_reason() -> None:
    _, *entries = re.split(r"^\*\*(\d+)\.\*\* ", PAGE, flags=re.MULTILINE)
    assert [int(number) for number in entries[::2]] == list(range(1, len(entries) // 2 + 1))
    for entry in entries[1::2]:
        assert re.search(r"\*Measured:\* \S.*\*Tests:\*\s(`|none, as)", entry, re.DOTALL), entry
