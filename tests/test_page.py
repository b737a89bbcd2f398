"""The page in a real browser."""

from __future__ import annotations

import json
import re
import time
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from browsers import needs_chromium
from fakes import WordModel
from sites import KEY, WRITES, site

pytestmark = needs_chromium

WANTS = "I want to bake a cake. Please add flour."


def begin(page: Page) -> None:
    page.get_by_role("button", name="Begin").click()
    expect(page.get_by_text("What can I help you with?")).to_be_visible()


def say(page: Page, text: str) -> None:
    page.get_by_label("Your words", exact=True).fill(text)
    page.get_by_label("Your words", exact=True).press("Enter")


def prices(basket: Locator) -> list[str]:
    return re.findall(r"\$[\d.]+", basket.inner_text())


def rounds(page: Page, number: int) -> None:
    """Wait until so many rounds are done, and the agent listens again."""
    expect(page.get_by_role("log").locator(".bubble.agent:visible")).to_have_count(number + 1)
    expect(page.locator(".thinking")).to_have_text("")


@pytest.fixture
def page(address: str, enter) -> Page:
    """Where an episode has begun."""
    opened = enter(address)
    begin(opened)
    return opened


def test_an_episode_from_the_first_word_to_the_purchase(page: Page, address: str) -> None:
    goals = page.get_by_role("region", name="Goals")
    expect(goals.get_by_text("Nothing has been said yet.")).to_be_visible()
    expect(goals.get_by_text("I am")).to_have_count(0)
    say(page, WANTS)
    rounds(page, 1)
    expect(goals.get_by_text("Nothing has been said yet.")).to_have_count(0)
    expect(goals.locator(".sureness")).to_contain_text("I am")
    episode = page.url.rpartition("/")[2]
    (told,) = page.request.get(f"{address}/api/episodes/{episode}").json()["rounds"]
    read = page.get_by_role("log").locator(".read").first  # the next one has nothing to show yet
    expect(read).to_have_text(f"Understood: {'; '.join(told['understood'])}")
    expect(goals.get_by_text("bake a cake", exact=True)).to_be_visible()
    expect(page.get_by_role("table").filter(has_text="Total")).to_be_visible()

    say(page, "Buy the basket")
    rounds(page, 2)
    card = page.get_by_role("region", name="To confirm")
    expect(card).to_contain_text("Large Eggs")
    card.get_by_role("button", name="No, not yet").click()
    rounds(page, 3)
    expect(page.get_by_role("log").get_by_text("No, not yet.")).to_be_visible()
    expect(card).to_be_hidden()
    say(page, "add bananas")
    rounds(page, 4)
    expect(card).to_be_hidden()

    say(page, "Buy the basket")
    rounds(page, 5)
    expect(card).to_contain_text("Banana")
    expect(page.get_by_text("If that is all right").last).to_be_in_viewport()
    expect(card.get_by_text("If that is all right")).to_have_count(0)
    shown = prices(card.get_by_role("table"))
    card.get_by_role("button", name="Yes").click()
    expect(page.get_by_role("region", name="The end")).to_contain_text("Done")
    bought = page.get_by_role("table").filter(has_text="Bought, total")
    assert shown == prices(bought)
    expect(bought.get_by_role("button")).to_have_count(0)
    expect(page.get_by_role("log")).to_contain_text(f"is now purchased for {shown[-1]}")


def test_a_belief_is_corrected_by_hand(page: Page) -> None:
    say(page, WANTS)
    rounds(page, 1)
    goals = page.get_by_role("region", name="Goals")
    goals.get_by_role("button", name=re.compile("^bake bread with flour")).click()
    reasons = goals.locator(".evidence")
    expect(reasons).to_contain_text(f"{WANTS}Says little about it.")
    expect(reasons).not_to_contain_text("nats", use_inner_text=True)
    goals.get_by_role("button", name=re.compile("rule", re.I)).click()
    expect(goals.get_by_role("button", name=re.compile("^bake bread with flour"))).to_have_count(0)
    # The panel may be drawn anew between a press and a release.
    page.get_by_role("button", name="Undo").dispatch_event("click")
    expect(goals.get_by_role("button", name=re.compile("^bake bread with flour"))).to_be_visible()
    goals.get_by_role("button", name=re.compile("^bake a cake")).click()
    goals.get_by_text("In numbers").click()
    meanings = goals.locator(".meanings")
    expect(meanings).to_contain_text("nats", use_inner_text=True)
    for column in goals.get_by_role("columnheader").all_inner_texts()[1:]:
        expect(meanings).to_contain_text(f"{column}: ")
    goals.get_by_role("button", name="Reword it").click()
    expect(goals.get_by_text("take them as confirmed").first).to_be_visible()
    goals.get_by_role("textbox").first.fill("bake a tart")
    goals.get_by_role("button", name="Save").click()
    tart = goals.get_by_role("button", name=re.compile("^bake a tart"))
    expect(tart).to_contain_text("confirmed")
    goals.get_by_text("Add a goal").click()
    goals.get_by_role("textbox").last.fill("feed the birds")
    goals.get_by_role("textbox").last.press("Enter")
    first = goals.get_by_role("listitem").first
    expect(first).to_contain_text("feed the birds")
    expect(first).to_contain_text("confirmed")


class Slow(WordModel):
    """Takes its time to write."""

    def generate(self, messages, **settings):
        time.sleep(0.2)
        return super().generate(messages, **settings)


def test_a_reload_in_mid_answer_loses_nothing(tmp_path: Path, enter) -> None:
    with site(tmp_path / "episodes.db", Slow(WRITES)) as address:
        page = enter(address)
        begin(page)
        say(page, WANTS)
        expect(page.locator(".thinking")).not_to_have_text("")
        page.reload()
        expect(page.get_by_text(WANTS)).to_be_visible()
        rounds(page, 1)
        other = page.context.new_page()
        other.goto(page.url)
        rounds(other, 1)
        say(other, "And milk.")
        rounds(other, 2)
        rounds(page, 2)
        expect(page.get_by_text("And milk.")).to_have_count(1)


def test_a_link_of_another_site_opens_the_page_of_who_has_entered(address: str, browser) -> None:
    with browser.new_context() as context:
        page = context.new_page()
        for link, opens in (("/", False), (f"/?key={KEY}", True), ("/", True)):
            page.goto("data:text/html,<p>mail</p>")
            page.set_content(f"<a href='{address}{link}'>go</a>")
            page.get_by_text("go").click()
            expect(page.get_by_role("main")).to_have_count(1 if opens else 0)
            assert KEY not in page.url


def test_by_keyboard_alone(address: str, enter) -> None:
    page = enter(address)
    page.get_by_role("button", name="Begin").wait_for()
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Skip to the content")).to_be_focused()
    page.keyboard.press("Enter")
    for _ in range(12):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.textContent") == "Begin":
            break
    page.keyboard.press("Enter")
    expect(page.get_by_label("Your words", exact=True)).to_be_focused()
    page.keyboard.type(WANTS)
    page.keyboard.press("Enter")
    rounds(page, 1)


def test_a_replay_moves_round_by_round_and_is_exported(page: Page, address: str) -> None:
    for number, text in enumerate((WANTS, "And milk.", "And eggs."), 1):
        say(page, text)
        rounds(page, number)
    episode = page.url.rpartition("/")[2]
    page.goto(f"{address}/#/replay/{episode}")
    slider = page.get_by_role("slider")
    expect(slider).to_have_value("3")
    slider.press("ArrowLeft")
    slider.press("ArrowLeft")
    expect(slider).to_have_value("1")
    expect(page.get_by_text("And eggs.")).to_be_hidden()
    with page.expect_download() as download:
        page.get_by_role("link", name="Save as JSON").click()
    saved = json.loads(Path(download.value.path()).read_text(encoding="utf-8"))
    assert [each["utterance"] for each in saved["rounds"]] == [WANTS, "And milk.", "And eggs."]


def test_where_no_goal_leads_the_agent_is_not_sure(tmp_path: Path, enter) -> None:
    with site(tmp_path / "episodes.db", WordModel({})) as address:
        page = enter(address)
        begin(page)
        say(page, WANTS)
        rounds(page, 1)
        goals = page.get_by_role("region", name="Goals")
        expect(goals.get_by_role("listitem").first).to_contain_text("None of these yet")
        expect(goals).to_contain_text("I am not sure yet what you want")
        expect(goals.get_by_text("nearly certain")).to_have_count(0)
        expect(goals.get_by_text("In nine talks")).to_be_hidden()


def test_every_note_is_shown(page: Page, address: str) -> None:
    say(page, WANTS)
    rounds(page, 1)
    say(page, "zyx wvu tsr")
    rounds(page, 2)
    episode = page.url.rpartition("/")[2]
    told = page.request.get(f"{address}/api/episodes/{episode}").json()["rounds"]
    notes = [note for each in told for note in each["notes"]]
    shown = page.get_by_role("log").locator(".note")
    expect(shown).to_have_count(len(notes))
    unexplained = "The goals do not explain the newest words, and no better ones were found."
    assert [each["belief_note"] for each in told] == ["", unexplained]
    expect(page.get_by_role("region", name="Goals").get_by_text(unexplained)).to_be_visible()
    expect(page.get_by_role("log").get_by_text(unexplained)).to_have_count(0)


def test_done_guessed_asked_and_refused_are_told_apart_without_colour(page: Page) -> None:
    log = page.get_by_role("log")
    say(page, WANTS)
    rounds(page, 1)
    guessed = log.locator(".message.guessed")
    expect(guessed).to_contain_text("Guessed, not asked for: ")
    added = log.locator(".message.added")
    expect(added).to_have_count(0)  # a guess is told once
    say(page, "add flour")
    rounds(page, 2)
    expect(added).to_contain_text("Flour")
    say(page, "remove the flour; add zyx wvu tsr")
    rounds(page, 3)
    removed, refused = log.locator(".message.removed"), log.locator(".message.refused")
    expect(removed).to_contain_text("Flour removed")
    expect(refused).to_contain_text("nothing called")
    asked = log.locator(".message.asked:visible").last
    signs = [
        each.locator(".sign").inner_text() for each in (added, removed, guessed, refused, asked)
    ]
    assert signs == ["+", "\u2212", "\u2248", "!", "?"]


def test_what_one_could_say_first_is_said_by_a_click(page: Page) -> None:
    examples = page.get_by_role("group", name="Examples")
    first = examples.get_by_role("button").first
    words = first.inner_text()
    first.click()
    rounds(page, 1)
    expect(page.get_by_role("log").locator(".bubble.person").first).to_have_text(f"You: {words}")
    expect(examples).to_be_hidden()


@pytest.mark.parametrize("width", [320, 390, 1280])
def test_the_screen_is_filled_and_not_exceeded(address: str, enter, width: int) -> None:
    page = enter(address, viewport={"width": width, "height": 640})
    begin(page)
    for number, words in enumerate((WANTS, "add milk; add eggs; add tea", "Buy the basket"), 1):
        say(page, words)
        rounds(page, number)
    high = "[document.scrollingElement.scrollHeight, document.scrollingElement.scrollWidth]"
    assert page.evaluate(high) == [640, width]


def test_the_font_comes_from_the_page_itself(address: str, enter) -> None:
    page = enter(address)
    page.evaluate("document.fonts.ready")
    fonts = "[...document.fonts].map(font => [font.family, font.status])"
    assert page.evaluate(fonts) == [["Inter", "loaded"]]


def test_evidence_is_told_in_words(address: str, enter) -> None:
    page = enter(address)
    told = """async nats => {
        const { verdict } = await import("/static/why.js");
        return nats.map(verdict);
    }"""
    assert page.evaluate(told, [5.0, 1.5, 0.9, -0.9, -1.5, -9.97]) == [
        "Speaks strongly for it.", "Speaks for it.", "Says little about it.",
        "Says little about it.", "Speaks against it.", "Speaks strongly against it.",
    ]  # fmt: skip
