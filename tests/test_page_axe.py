"""What axe-core finds wrong with the page for people who do not see it, or not well."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from browsers import needs_chromium
from test_page import WANTS, begin, rounds, say

AXE = Path(__file__).parents[1] / "node_modules" / "axe-core" / "axe.min.js"
pytestmark = [
    needs_chromium,
    pytest.mark.skipif(not AXE.exists(), reason="npm install --no-save axe-core"),
]
RUN = """async () => (await axe.run()).violations.map(
    each => `${each.id}: ${each.nodes.map(node => node.html).join(" ")}`)"""


def found(page: Page) -> list[str]:
    page.evaluate(AXE.read_text(encoding="utf-8"))
    return page.evaluate(RUN)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [320, 1280])
def test_axe_finds_nothing(address: str, enter, width: int, scheme: str) -> None:
    options = {"color_scheme": scheme, "reduced_motion": "reduce"}
    page = enter(address, viewport={"width": width, "height": 800}, **options)
    page.get_by_role("button", name="Begin").wait_for()
    assert found(page) == []
    begin(page)
    assert found(page) == []
    for number, words in enumerate((WANTS, "add zyx wvu tsr", "Buy the basket"), 1):
        say(page, words)
        rounds(page, number)
    if width == 320:
        assert found(page) == []
        page.locator(".strip").click()
    page.get_by_role("region", name="Goals").get_by_role("button").first.click()
    page.get_by_text("In numbers").click()
    assert found(page) == []
    for path, heading in (
        ("replay/" + page.url.rpartition("/")[2], "Replay"),
        ("episodes", "Episodes"),
    ):
        page.goto(f"{address}/#/{path}")
        expect(page.get_by_role("heading", level=1)).to_contain_text(heading)
        page.wait_for_load_state("networkidle")
        assert found(page) == []
