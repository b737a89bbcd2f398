"""The room on the page: names at the things, and numbers that tell theirs, on any screen."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Page, Route, expect

from browsers import needs_chromium
from test_page import rounds, say

pytestmark = needs_chromium

PHONE = {"width": 390, "height": 780}
LAPTOP = {"width": 1280, "height": 800}
WIDE = {"width": 1920, "height": 1080}
TEXTS = """room => [...room.shadowRoot.querySelectorAll("text")].map(text => {
    const box = text.getBoundingClientRect();
    return { text: text.textContent, kind: text.getAttribute("class"), size: box.height,
             left: box.left, right: box.right };
})"""


def enter_kitchen(page: Page) -> None:
    page.get_by_text("A robot in a home", exact=True).click()
    page.get_by_role("button", name="Begin").click()
    expect(page.get_by_text("What can I help you with?")).to_be_visible()
    if (page.viewport_size or {})["width"] < 896:
        page.locator(".strip").click()
    expect(page.locator(".map svg")).to_be_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("screen", [PHONE, LAPTOP, WIDE], ids=["phone", "laptop", "wide"])
def test_names_can_be_read_at_the_things(address: str, enter, screen, scheme: str) -> None:
    page = enter(address, viewport=screen, color_scheme=scheme)
    enter_kitchen(page)
    told = page.locator(".map").evaluate(TEXTS)
    names = {each["text"] for each in told if (each["kind"] or "").split()[:1] == ["label"]}
    assert {"bread", "pan", "toaster", "bowl", "garbage can"} <= names
    assert all(each["size"] >= 11 for each in told if each["kind"] != "number")
    assert all(each["left"] >= 0 and each["right"] <= screen["width"] for each in told)


def test_a_number_tells_its_name_to_the_mouse_the_keyboard_and_a_finger(
    address: str, enter
) -> None:
    page = enter(address, viewport=PHONE, has_touch=True)
    enter_kitchen(page)
    numbers = page.locator(".map .mark")
    tips = page.locator(".map .tip")
    assert numbers.count() > 2
    for place in range(3):
        number, tip = numbers.nth(place), tips.nth(place)
        name = tip.text_content() or ""
        assert name
        assert name in (number.get_attribute("aria-label") or "")
        expect(tip).to_be_hidden()
        number.hover()
        expect(tip).to_be_visible()
        page.mouse.move(0, 0)
        expect(tip).to_be_hidden()
        number.focus()
        expect(tip).to_be_visible()
        number.blur()
        expect(tip).to_be_hidden()
        number.tap()
        expect(tip).to_be_visible()
        page.get_by_role("heading", name="The room").tap()
        expect(tip).to_be_hidden()
    numbers.first.focus()
    page.keyboard.press("Tab")
    expect(tips.nth(1)).to_be_visible()
    expect(page.get_by_role("group", name="The room from above at the start")).to_be_visible()


def test_the_room_is_drawn_anew_after_a_round_and_for_another_width(address: str, enter) -> None:
    page = enter(address, viewport=WIDE)
    enter_kitchen(page)
    say(page, "put the tomato in the fridge")
    rounds(page, 1)
    expect(page.get_by_role("group", name="The room from above after round 1")).to_be_visible()
    label = page.locator(".map text", has_text="tomato")
    box = "svg => Number(svg.getAttribute('viewBox').split(' ')[2])"
    room = page.locator(".map svg")
    wide = room.evaluate(box)
    page.set_viewport_size(LAPTOP)
    expect(room).not_to_have_attribute("viewBox", str(room.get_attribute("viewBox")))
    assert room.evaluate(box) < wide
    shown = room.evaluate("svg => svg.getBoundingClientRect().width")
    assert shown / room.evaluate(box) == pytest.approx(1, abs=0.1)
    assert label.count() <= 1


def test_a_room_that_cannot_be_had_is_said_and_drawn_later(address: str, enter) -> None:
    page = enter(address, viewport=LAPTOP)

    def fail(route: Route) -> None:
        route.abort()

    page.route("**/picture.svg**", fail)
    page.get_by_text("A robot in a home", exact=True).click()
    page.get_by_role("button", name="Begin").click()
    expect(page.get_by_text("The room could not be drawn.")).to_be_visible()
    page.unroute("**/picture.svg**", fail)
    say(page, "open the fridge")
    rounds(page, 1)
    expect(page.locator(".map svg")).to_be_visible()
    expect(page.get_by_text("The room could not be drawn.")).to_be_hidden()


def test_the_picture_in_a_tab_of_its_own_tells_names_too(address: str, enter) -> None:
    page = enter(address, viewport=LAPTOP)
    enter_kitchen(page)
    with page.context.expect_page() as opened:
        page.get_by_role("link", name="Open the picture").click()
    picture = opened.value
    number = picture.locator(".mark").first
    number.hover()
    expect(picture.locator(".tip").first).to_be_visible()


def test_a_saved_page_names_the_things(address: str, enter, tmp_path: Path) -> None:
    page = enter(address, viewport=LAPTOP)
    enter_kitchen(page)
    say(page, "open the fridge")
    rounds(page, 1)
    id = page.url.rpartition("/")[2]
    saved = page.request.get(f"{address}/api/episodes/{id}/export.html").text()
    assert "image/svg+xml;base64" in saved
