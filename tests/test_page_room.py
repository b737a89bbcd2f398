"""The map of the room on the page."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page, Route, expect

from browsers import needs_chromium
from test_page import rounds, say

pytestmark = needs_chromium

PHONE = {"width": 390, "height": 780}
LAPTOP = {"width": 1280, "height": 800}


def begin(page: Page) -> None:
    page.get_by_text("A robot in a home", exact=True).click()
    page.get_by_role("button", name="Begin").click()
    expect(page.get_by_text("What can I help you with?")).to_be_visible()
    if (page.viewport_size or {})["width"] < 896:
        page.locator(".strip").click()


@pytest.mark.parametrize("screen", [PHONE, LAPTOP], ids=["phone", "laptop"])
def test_the_map_fits_the_screen_and_says_what_it_shows(address: str, enter, screen) -> None:
    page = enter(address, viewport=screen)
    begin(page)
    room = page.get_by_role("img", name="The room at the start. Kitchen1")
    expect(room).to_be_visible()
    assert "fridge: " in (room.get_attribute("alt") or "")
    shown, drawn = room.evaluate("map => [map.clientWidth, map.naturalWidth]")
    assert 0 < shown <= screen["width"]
    assert drawn > 0
    say(page, "put the tomato in the fridge")
    rounds(page, 1)
    expect(page.get_by_role("img", name="The room after round 1")).to_be_visible()


def test_a_room_that_cannot_be_had_is_said_and_drawn_later(address: str, enter) -> None:
    page = enter(address, viewport=LAPTOP)

    def fail(route: Route) -> None:
        route.abort()

    page.route("**/picture.svg**", fail)
    begin(page)
    expect(page.get_by_text("The room could not be drawn.")).to_be_visible()
    page.unroute("**/picture.svg**", fail)
    say(page, "open the fridge")
    rounds(page, 1)
    expect(page.locator("img.map")).to_be_visible()
    expect(page.get_by_text("The room could not be drawn.")).to_be_hidden()
