"""What the page shows of other domains: the robot's, one's own, and those of other programs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from browsers import needs_chromium
from fakes import WordModel
from goalscope.agent.settings import Settings
from goalscope.envs.registry import load_domain, open_environment
from goalscope.storage.session import Session
from goalscope.storage.store import Store
from goalscope.storage.tracking import Trackers
from sites import WRITES, site
from test_page import begin, rounds, say
from test_run import NamedModel

pytestmark = needs_chromium

PHONE = {"width": 390, "height": 780}
LAPTOP = {"width": 1280, "height": 800}
GARDEN = Path(__file__).parents[1] / "examples" / "garden.py"
TASK = "Help in the kitchen."


def of_a_garden(store: Store) -> str:
    """The id of an episode in which a pond is made."""
    settings = Settings(domain=load_domain(str(GARDEN)))
    said = iter(["add pond"])
    session = Session(
        store, settings, open_environment(settings), NamedModel(), read=lambda query: next(said)
    )
    next(session.run())
    return session.id


def of_a_program(store: Store) -> str:
    """The id of a session in which a program asked once."""
    trackers = Trackers(store, lambda: WordModel(WRITES))
    id = trackers.open(TASK, ["bake a cake", "cook tomato soup"]).id
    return trackers.observe(id, 1, "Yes?", "I bake a cake.").id


@pytest.fixture
def place(tmp_path: Path) -> Path:
    return tmp_path / "episodes.db"


@pytest.fixture
def ids(place: Path) -> tuple[str, str]:
    with Store.open(place) as store:
        return of_a_garden(store), of_a_program(store)


@pytest.fixture
def page(place: Path, ids: tuple[str, str], enter) -> Iterator[Page]:
    with site(place) as address:
        yield enter(address)


def test_what_was_not_begun_here_is_listed_and_replayed_but_not_continued(
    page: Page, ids: tuple[str, str]
) -> None:
    home = page.url
    page.goto(f"{home}#/replay/{ids[1]}")
    expect(page.get_by_role("heading", level=1)).to_have_text("Replay: goal tracking")
    expect(page.get_by_text(TASK)).to_be_visible()
    expect(page.get_by_role("heading", level=2)).to_have_text(
        "What I thought you want"
    )  # and no basket

    page.goto(f"{home}#/replay/{ids[0]}")
    expect(page.get_by_role("heading", level=1)).to_have_text("Replay: garden.py")
    expect(page.get_by_role("heading", name="The state")).to_be_visible()
    expect(page.get_by_text("basket")).to_have_count(0)
    done = page.get_by_role("log").locator("li.done")
    expect(done.first).to_have_text(
        "\u2713done: add: pond \u2013 In the garden: pond, walnut tree."
    )

    page.goto(f"{home}#/episodes")
    expect(page.locator(".episodes tbody tr")).to_have_count(2)
    expect(page.get_by_role("link", name="Continue")).to_have_count(0)
    expect(page.get_by_role("cell", name="a program's user")).to_be_visible()
    expect(page.get_by_role("cell", name="garden.py", exact=True)).to_be_visible()


def test_a_domain_of_ones_own_is_talked_in_and_an_episode_goes_on(
    place: Path, ids: tuple[str, str], enter
) -> None:
    with site(place, NamedModel(), [load_domain(str(GARDEN))]) as address:
        page = enter(address)
        expect(page.get_by_role("radio")).to_have_count(1)
        expect(page.get_by_text("The agent plans a garden.")).to_be_visible()
        begin(page)
        expect(page.get_by_role("heading", level=1)).to_have_text("garden")
        state = page.locator(".panel").filter(has_text="The state")
        expect(state).to_contain_text("Nothing has been done yet.")
        say(page, "add roses")
        rounds(page, 1)
        expect(state).to_contain_text("In the garden: roses, walnut tree.")
        expect(page.locator("li.done").first).to_contain_text("add: roses")

        say(page, "remove walnut tree")
        rounds(page, 2)
        card = page.get_by_role("region", name="To confirm")
        expect(card.get_by_role("heading")).to_have_text("This cannot be undone.")
        card.get_by_role("button", name="Yes").click()
        rounds(page, 3)
        expect(state).to_contain_text("In the garden: roses.")
        expect(page.get_by_text("cannot be undone", exact=True)).to_be_visible()

        page.goto(f"{address}#/episodes")
        page.get_by_role("link", name="Continue").last.click()
        rounds(page, 1)
        say(page, "add herbs")
        rounds(page, 2)
        expect(state).to_contain_text("In the garden: herbs, pond, walnut tree.")


def begin_at_home(page: Page) -> None:
    page.locator("strong", has_text="A robot in a home").click()
    begin(page)
    if (page.viewport_size or {})["width"] < 896:
        page.locator(".strip").click()


@pytest.mark.parametrize("screen", [PHONE, LAPTOP], ids=["phone", "laptop"])
def test_the_map_fits_the_screen_and_says_what_it_shows(address: str, enter, screen) -> None:
    page = enter(address, viewport=screen)
    begin_at_home(page)
    room = page.get_by_role("img", name="The room at the start. Kitchen 1")
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
    page.route("**/picture.svg**", lambda route: route.abort())
    begin_at_home(page)
    expect(page.get_by_text("The room could not be drawn.")).to_be_visible()
    page.unroute("**/picture.svg**")
    say(page, "open the fridge")
    rounds(page, 1)
    expect(page.locator("img.map")).to_be_visible()
    expect(page.get_by_text("The room could not be drawn.")).to_be_hidden()
