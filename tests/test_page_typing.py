"""Typing on the page: input methods that compose words, and words for an agent that is busy."""

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


def test_words_that_are_composed_in_the_browser_itself_are_sent_by_the_next_enter(
    address: str, enter
) -> None:
    page = enter(address)
    begin(page)
    field = page.get_by_label("Your words", exact=True)
    field.focus()
    method = page.context.new_cdp_session(page)
    method.send("Input.imeSetComposition", {"text": "にほ", "selectionStart": 2, "selectionEnd": 2})
    composing = {"type": "rawKeyDown", "key": "Enter", "windowsVirtualKeyCode": 229}
    method.send("Input.dispatchKeyEvent", composing)
    expect(field).to_have_value("にほ")
    expect(page.locator(".bubble.person:visible")).to_have_count(0)
    method.send("Input.insertText", {"text": "日本"})
    method.send("Input.dispatchKeyEvent", composing)
    expect(field).to_have_value("日本")
    expect(page.locator(".bubble.person:visible")).to_have_count(0)
    field.press("Enter")
    expect(page.get_by_role("log").get_by_text("日本")).to_be_visible()


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
    page.get_by_role("button", name="Buy this basket").click()
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
