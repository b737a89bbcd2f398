"""Words of every script on the page: as they were typed, and in their own direction."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page, expect

from browsers import needs_chromium
from test_page import begin, rounds, say

pytestmark = needs_chromium

PERSIAN = (
    "\u0645\u06cc\u200c\u062e\u0648\u0627\u0647\u0645 \u06a9\u06cc\u06a9 \u0628\u067e\u0632\u0645!"
)
HEBREW = "\u05d0\u05e0\u05d9 \u05e8\u05d5\u05e6\u05d4 \u05e2\u05d5\u05d2\u05d4!"
MARK = """element => {
    const text = element.lastChild.lastChild ?? element.lastChild;
    const range = document.createRange();
    const last = text.data.trimEnd().length;
    range.setStart(text, last - 1);
    range.setEnd(text, last);
    const mark = range.getBoundingClientRect();
    range.setStart(text, 0);
    range.setEnd(text, 1);
    return mark.left - range.getBoundingClientRect().left;
}"""


def side_of_the_end(page: Page, selector: str) -> float:
    """How far the last character stands to the right of the first, in px."""
    return page.locator(selector).first.evaluate(MARK)


@pytest.mark.parametrize(
    ("said", "rightwards"),
    [(PERSIAN, False), (HEBREW, False), ("I want to bake a cake!", True)],
    ids=["Persian", "Hebrew", "English"],
)
def test_what_a_person_says_runs_in_its_own_direction(
    address: str, enter, said: str, rightwards: bool
) -> None:
    page = enter(address)
    begin(page)
    say(page, said)
    rounds(page, 1)
    expect(page.locator(".bubble.person").first).to_have_text(f"You: {said}")
    assert (side_of_the_end(page, ".bubble.person") > 0) is rightwards
    goals = page.get_by_role("region", name="Goals")
    goals.get_by_text("Add a goal").click()
    goals.get_by_role("textbox").last.fill(said)
    goals.get_by_role("textbox").last.press("Enter")
    expect(goals.get_by_role("listitem").first).to_contain_text(said)
    assert (side_of_the_end(page, ".goal-name") > 0) is rightwards


@pytest.mark.parametrize(
    "mark", ["\u202e", "\u202a", "\u2066", "\u2069", "\u200b", "\u00ad", "\ufeff", "\U000e0041"]
)
def test_marks_that_nobody_sees_are_stored_but_not_shown(address: str, enter, mark: str) -> None:
    page = enter(address)
    begin(page)
    said = f"add {mark}flour for {PERSIAN} and \U0001f468\u200d\U0001f467"
    say(page, said)
    rounds(page, 1)
    episode = f"{address}/api/episodes/{page.url.rpartition('/')[2]}"
    assert page.request.get(episode).json()["rounds"][0]["utterance"] == said
    shown = page.locator(".bubble.person").first
    expect(shown).to_have_text(f"You: {said.replace(mark, '')}")
    page.get_by_role("link", name="Episodes").click()
    expect(page.locator("td[data-name='First words']").first).to_have_text(said.replace(mark, ""))
