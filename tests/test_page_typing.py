"""Typing on the page: input methods, words for a busy agent, and the scripts of the world."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from browsers import needs_chromium
from fakes import WordModel
from sites import WRITES, site
from test_page import WANTS, begin, rounds, say

pytestmark = needs_chromium

SAFARI = {"key": "Enter", "keyCode": 229, "isComposing": False}
"""Its Enter that ends a composition comes after the composition's end."""
OTHERS = {"key": "Enter", "keyCode": 229, "isComposing": True}
FIREFOX = {"key": "Enter", "keyCode": 13, "isComposing": True}


def press(field: Locator, key: dict[str, object]) -> bool:
    """Press a key as an input method reports it; whether the field may act on it."""
    return field.evaluate(
        """(field, key) => field.dispatchEvent(
            new KeyboardEvent("keydown", { ...key, bubbles: true, cancelable: true }))""",
        key,
    )


@pytest.mark.parametrize(
    ("key", "words"), [(SAFARI, "こんにち"), (OTHERS, "你hao"), (FIREFOX, "안녕하세")]
)
def test_an_enter_that_ends_a_composition_sends_nothing(
    address: str, enter, key: dict[str, object], words: str
) -> None:
    page = enter(address)
    begin(page)
    field = page.get_by_label("Your words", exact=True)
    field.fill(words)
    expect(page.get_by_role("button", name="Send")).to_be_enabled()
    assert not press(field, key)
    expect(field).to_have_value(words)
    expect(page.locator(".bubble.person:visible")).to_have_count(0)
    assert not press(field, {"key": "Enter", "keyCode": 13, "shiftKey": True} | key)
    expect(field).to_have_value(words)
    field.press("Enter")
    expect(page.get_by_role("log").get_by_text(words)).to_be_visible()


def test_a_composed_goal_is_not_added_half_typed(address: str, enter) -> None:
    page = enter(address)
    begin(page)
    goals = page.get_by_role("region", name="Goals")
    goals.get_by_text("Add a goal").click()
    field = goals.get_by_role("textbox").last
    field.fill("ケーキを焼")
    assert not press(field, SAFARI)  # else the browser would submit the form
    press(field, {**SAFARI, "key": "Escape"})
    expect(field).to_have_value("ケーキを焼")
    field.fill("ケーキを焼く")
    field.press("Enter")
    expect(goals.get_by_role("listitem").first).to_contain_text("ケーキを焼く")


class Held(WordModel):
    """Writes only once it may."""

    def __init__(self) -> None:
        super().__init__(WRITES)
        self.may = threading.Event()

    def generate(self, messages, **settings):
        assert self.may.wait(30)
        return super().generate(messages, **settings)


@pytest.fixture
def busy(tmp_path: Path, enter):
    """A page whose agent is thinking, and the agent's model."""
    model = Held()
    with site(tmp_path / "episodes.db", model) as address:
        page: Page = enter(address)
        begin(page)
        say(page, WANTS)
        expect(page.locator(".thinking")).not_to_have_text("")
        yield page, model
        model.may.set()


@pytest.mark.parametrize("how", ["lines", "Send"])
def test_words_for_a_busy_agent_are_kept_and_it_is_said_when_they_can_be_sent(
    busy: tuple[Page, Held], how: str
) -> None:
    page, model = busy
    words, typed = page.get_by_label("Your words", exact=True), "add milk"
    note = page.get_by_role("status").filter(has_text="Not sent yet")
    words.fill("add milk" if how != "lines" else "add milk\nand eggs")
    typed = words.input_value()
    expect(note).to_have_count(0)
    if how == "Send":
        page.get_by_role("button", name="Send").click(force=True)
    else:
        words.press("Enter")
    expect(note).to_contain_text("busy")
    expect(words).to_have_value(typed)
    model.may.set()
    rounds(page, 1)
    expect(note).to_contain_text("Press Enter or Send")
    expect(words).to_have_value(typed)
    expect(page.locator(".bubble.person:visible")).to_have_count(1)
    words.press("Enter")
    expect(page.locator(".bubble.person:visible")).to_have_count(2)
    expect(note).to_have_count(0)
    expect(words).to_have_value("")


def test_what_was_typed_meanwhile_outlives_a_failure_and_the_end(busy, tmp_path: Path) -> None:
    page, model = busy
    words = page.get_by_label("Your words", exact=True)
    words.fill("add milk")
    words.press("Enter")
    page.get_by_role("button", name="Buy the basket").click()
    expect(words).to_have_value("add milk\nBuy the basket")
    page.get_by_role("button", name="Buy the basket").click()
    expect(words).to_have_value("add milk\nBuy the basket")
    model.may.set()
    rounds(page, 1)
    words.fill("")
    expect(page.get_by_role("status").filter(has_text="Not sent yet")).to_have_count(0)
    say(page, "Buy the basket")
    rounds(page, 2)
    words.fill("and some tea")
    page.get_by_role("button", name="Yes").click()
    expect(page.get_by_role("region", name="The end")).to_contain_text("and some tea")


@pytest.mark.parametrize("leaves", ["reload", "other page"])
def test_what_was_typed_meanwhile_outlives_another_page(busy, leaves: str) -> None:
    page, model = busy
    words = page.get_by_label("Your words", exact=True)
    words.fill("add milk, and\ntwo eggs")
    words.press("Enter")
    mine = page.url
    if leaves == "reload":
        page.reload()
    else:
        page.get_by_role("link", name="Episodes").click()
        expect(page.get_by_role("heading", name="Episodes")).to_be_visible()
        page.goto(mine)
    expect(words).to_have_value("add milk, and\ntwo eggs")
    model.may.set()
    rounds(page, 1)
    words.press("Enter")
    rounds(page, 2)
    page.reload()
    expect(page.get_by_role("log").get_by_text("two eggs")).to_be_visible()
    expect(words).to_have_value("")


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
