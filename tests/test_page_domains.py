"""What the page shows of episodes that it did not begin: of other programs, and of own domains."""

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
from test_run import NamedModel

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


@needs_chromium
def test_the_replay_of_a_session_shows_its_task_and_no_basket(
    page: Page, ids: tuple[str, str]
) -> None:
    page.goto(f"{page.url}#/replay/{ids[1]}")
    expect(page.get_by_role("heading", level=1)).to_have_text("Replay: goal tracking")
    expect(page.get_by_text(TASK)).to_be_visible()
    expect(page.get_by_role("heading", level=2)).to_have_text("What it thought")


@needs_chromium
def test_the_replay_of_an_own_domain_names_what_was_done_and_the_state(
    page: Page, ids: tuple[str, str]
) -> None:
    page.goto(f"{page.url}#/replay/{ids[0]}")
    expect(page.get_by_role("heading", level=1)).to_have_text("Replay: garden.py")
    expect(page.get_by_role("heading", name="The state")).to_be_visible()
    expect(page.get_by_text("basket")).to_have_count(0)
    done = page.get_by_role("log").locator("li.done")
    expect(done.first).to_have_text(
        "\u2713done: add: pond \u2013 In the garden: pond, walnut tree."
    )


@needs_chromium
def test_only_what_can_go_on_here_is_offered(page: Page, ids: tuple[str, str]) -> None:
    page.goto(f"{page.url}#/episodes")
    expect(page.locator(".episodes tbody tr")).to_have_count(2)
    expect(page.get_by_role("link", name="Continue")).to_have_count(0)
    expect(page.get_by_role("cell", name="a program's user")).to_be_visible()
    expect(page.get_by_role("cell", name="garden.py", exact=True)).to_be_visible()
