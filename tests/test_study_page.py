"""A study in a real browser: whatever happens on the way, each item has one answer in the end."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Page, Route, expect
from sqlalchemy import func, select

from browsers import needs_chromium
from goalscope.storage.store import Store
from goalscope.storage.tables import ANSWERS, ITEMS
from goalscope.study.store import StudyStore
from sites import site
from test_study import fill
from test_study_web import WEB

pytestmark = needs_chromium

BACK = "HTTPS://panel.example/o'neill/done?cc=A1&x=(b)"
PLAN = replace(WEB, items_per_participant=5, thanks=f"Go back: {BACK}. Not javascript:alert(1)!")
COUNT = 5


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "episodes.db"
    with Store.open(path) as store:
        fill(store, methods=("good",), people=COUNT)
        StudyStore(store).add(PLAN)
    return path


@pytest.fixture
def address(file: Path) -> Iterator[str]:
    with site(file) as running:
        yield f"{running}/study/shop?id=ann"


def question(page: Page, number: int) -> None:
    expect(page.get_by_role("heading", name=f"Question {number} of {COUNT}")).to_be_visible()


def rate(page: Page, number: int, rating: int = 2, why: str = "") -> tuple[int, str]:
    """Fill in what a person would; what then must be saved."""
    question(page, number)
    text = why or f"It fits what they asked for in {number}."
    page.get_by_role("radio", name=str(rating)).check()
    page.get_by_label("Why?").fill(text)
    return rating, text


def shown(page: Page) -> tuple[int, str]:
    """The answer that stands in the page."""
    rating = page.get_by_role("radio", checked=True).get_attribute("value")
    return int(rating or -1), page.get_by_label("Why?").input_value()


def test_from_consent_to_the_end_with_every_mishap(file: Path, address: str, enter) -> None:
    page = enter(address)
    following = page.get_by_role("button", name="Next")
    page.get_by_role("button", name="Take part").click()
    expect(page.get_by_role("heading", name=PLAN.title)).to_be_visible()  # not without consent
    page.get_by_role("checkbox").check()
    page.get_by_role("button", name="Take part").click()
    expect(page.get_by_text(PLAN.instructions)).to_be_visible()
    page.get_by_role("link", name="Go to the questions").click()

    question(page, 1)
    least = f"At least {PLAN.min_explanation} characters, not counting spaces."
    expect(page.get_by_label("Why?")).to_have_accessible_description(least)
    following.click()
    expect(page.get_by_role("status")).to_have_text("Please choose a rating.")
    first = rate(page, 1)
    following.dblclick()
    question(page, 2)

    second = rate(page, 2, 3)
    page.reload()
    question(page, 2)
    assert shown(page) == second
    following.click()
    question(page, 3)
    page.go_back()
    question(page, 2)
    assert shown(page) == second
    page.go_back()
    question(page, 1)
    assert shown(page) == first
    page.goto(address)  # where the next open question is

    third = rate(page, 3)
    page.context.set_offline(True)
    following.click()
    expect(page.get_by_role("status")).to_contain_text("No connection")
    page.context.set_offline(False)
    question(page, 4)

    lost: list[int] = []

    def lose_the_first_receipt(route: Route) -> None:
        if route.request.method != "PUT" or lost:
            route.continue_()
            return
        lost.append(route.fetch().status)
        route.abort()

    page.route("**/items/4?*", lose_the_first_receipt)
    fourth = rate(page, 4, 1)
    following.click()
    question(page, 5)
    assert lost == [200]

    other = page.context.new_page()
    other.goto(page.url)
    rate(other, 5, 1, "It is from the other tab.")
    expect(other.get_by_role("status")).to_have_text("Saved")
    fifth = rate(page, 5, 3)  # which is saved by itself
    expect(page.get_by_role("status")).to_contain_text("Another answer is saved")
    page.get_by_role("button", name="Finish").click()

    expect(page.get_by_role("heading", name="Thank you")).to_be_visible()
    expect(page.get_by_text(PLAN.thanks)).to_be_visible()
    expect(page.locator("p.text a")).to_have_text([BACK])
    expect(page.get_by_role("link", name=BACK)).to_have_attribute("href", BACK)

    with Store.open(file) as store:
        studies = StudyStore(store)
        (ann,) = studies.participants(studies.named("shop"))
        with store.reading() as connection:
            rows = connection.scalar(select(func.count()).select_from(ANSWERS))
    assert (ann.external, ann.finished) == ("ann", True)
    saved = [(each.place, each.rating, each.explanation) for each in ann.answers]
    answers = enumerate((first, second, third, fourth, fifth), 1)
    assert sorted(saved) == [(place, *answer) for place, answer in answers]
    assert rows == len({each.item for each in ann.answers}) == COUNT


def test_by_keyboard_alone(file: Path, address: str, enter) -> None:
    page = enter(address)
    page.get_by_role("checkbox").focus()
    page.keyboard.press("Space")
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name="What to do")).to_be_focused()
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name=re.compile("^Question 1"))).to_be_focused()
    page.get_by_role("radio", name="0").focus()
    page.keyboard.press("Space")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Tab")
    page.keyboard.type("It fits what they want.")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", name=re.compile("^Question 2"))).to_be_focused()


def test_each_rating_has_words_and_each_list_its_own_line(tmp_path: Path, enter) -> None:
    told = "It did this:\n- open: safe\nIn the end:\n- safe: open"
    with Store.open(tmp_path / "listed.db") as store:
        fill(store)
        StudyStore(store).add(PLAN)
        with store.writing() as connection:
            for item in connection.execute(select(ITEMS)).all():
                view = json.dumps({**json.loads(item.view), "outcome": told})
                here = ITEMS.c.number == item.number
                connection.execute(ITEMS.update().where(here).values(view=view))
    with site(tmp_path / "listed.db") as running:
        page = enter(f"{running}/study/shop?id=ann")
        page.get_by_role("checkbox").check()
        page.get_by_role("button", name="Take part").click()
        page.get_by_role("link", name="Go to the questions").click()
        lines = page.locator(".outcome :is(p, li)")
        expect(lines).to_have_text(["It did this:", "open: safe", "In the end:", "safe: open"])
        for rating, words in enumerate(("least", "less", "more", "most")):
            expect(page.get_by_role("radio", name=f"{rating} {words} reasonable")).to_be_visible()


def test_an_address_without_a_study_is_answered_in_a_sentence(address: str, browser) -> None:
    with browser.new_context() as context:
        page = context.new_page()
        assert page.goto(address.replace("/shop", "/shob")).status == 404
        expect(page.get_by_text("There is no such study.")).to_be_visible()
        expect(page.get_by_text("Please check the link")).to_be_visible()
