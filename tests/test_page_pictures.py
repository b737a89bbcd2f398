"""Pictures of the page with the embedded model, as the README shows them, and how they look.

`GOALSCOPE_PICTURES=docs` keeps them there; `make pictures` does that.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from browsers import let_in, needs_chromium
from goalscope.models.opening import open_model
from goalscope.storage.store import Store
from goalscope.study.plan import Plan
from goalscope.study.store import StudyStore
from sites import KEY, site

pytestmark = [needs_chromium, pytest.mark.slow]

LOOKS = Path(__file__).with_name("looks.js").read_text(encoding="utf-8")
SLOW = 180_000
DESKTOP = {"width": 1280, "height": 860}
TALL = {"width": 1280, "height": 1360}
PAPER = {"width": 800, "height": 860}
PHONE = {"width": 390, "height": 780}
SHOPPING = (
    "I'm making pancakes for my niece on Sunday.",
    "She can't have dairy.",
    "Please add some blueberries, and a bottle of apple juice.",
)
TIDYING = (
    "I have friends coming for coffee soon. Please put the tomato into the fridge, and wash the "
    "dirty mug.",
    "Could you slice the bread for us?",
)
STUDY = Plan(
    "pictures",
    consent="You will read a conversation, and say how well the assistant did.",
    instructions="Read what the person wanted, and what came of it. Then rate it.",
    transcript=True,
    min_explanation=5,
)


@dataclass(frozen=True)
class Tour:
    """A site where two conversations were had, and where the pictures go."""

    page: Page
    address: str
    file: Path
    grocery: str
    house: str
    folder: Path

    def picture(self, name: str, *, whole: bool = False) -> None:
        """Take one of the screen, or the whole page, once nothing is wrong with what it shows."""
        self.page.mouse.move(0, 0)
        looks = self.page.evaluate(LOOKS)
        assert looks["faults"] == []
        assert looks["lines"] > 10
        self.page.screenshot(path=self.folder / f"{name}.png", full_page=whole)

    def show(self, path: str, size: dict[str, int], scheme: str = "light") -> None:
        """Open a page anew, as somebody with such a screen would."""
        self.page.set_viewport_size(size)
        self.page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
        self.page.goto("about:blank")
        self.page.goto(f"{self.address}{path}")


@pytest.fixture(scope="module")
def tour(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tour]:
    folder = tmp_path_factory.mktemp("pictures")
    file = folder / "episodes.db"
    with (
        closing(open_model()) as model,
        site(file, model) as address,
        browser.new_context() as context,
    ):
        let_in(context, address)
        page = context.new_page()
        page.set_default_timeout(SLOW)
        page.goto(f"{address}/?key={KEY}")
        grocery = talked(page, address, "Grocery shopping", SHOPPING)
        house = talked(page, address, "A robot in a home", TIDYING)
        kept = Path(os.environ.get("GOALSCOPE_PICTURES") or folder)
        yield Tour(page, address, file, grocery, house, kept)


def talked(page: Page, address: str, domain: str, said: tuple[str, ...]) -> str:
    """Have a conversation; its id."""
    page.goto(f"{address}/")
    page.get_by_text(domain, exact=True).click()
    page.get_by_role("button", name="Begin").click()
    for number, words in enumerate(said, 1):
        say(page, words, number)
    return page.url.rpartition("/")[2]


def say(page: Page, words: str, number: int) -> None:
    page.get_by_label("Your words", exact=True).fill(words)
    page.get_by_label("Your words", exact=True).press("Enter")
    queries = page.get_by_role("log").locator(".bubble.agent:visible")
    expect(queries).to_have_count(number + 1, timeout=SLOW)
    expect(page.locator(".thinking")).to_have_text("", timeout=SLOW)


def settled(tour: Tour, words: str) -> None:
    expect(tour.page.get_by_role("log")).to_contain_text(words)


@pytest.mark.parametrize(
    ("fault", "body"),
    [
        ("px wide", "<div style='width: 900px'>wide</div>"),
        ("into nothing", "<p style='position: absolute; top: 3000px'>far</p>"),
        ("has a contrast of 1", "<p style='color: #ddd'>pale</p>"),
        ("has a contrast of 2", "<p style='opacity: 0.4; color: #222'>thin</p>"),
        ("is not there", "<img src='data:image/png;base64,'>"),
        (
            "is cut off",
            "<p style='width: 3rem; overflow: hidden; white-space: nowrap'>too long</p>",
        ),
        ("is covered", "<button>a</button><p style='position: fixed; inset: 0; background: #fff'>"),
        ("overlap", "<p style='margin: 0'>one</p><p style='margin: -0.9em 0'>two</p>"),
        ("has too little contrast", "<input placeholder='hint' style='color: #ccc'>"),
    ],
)
def test_a_fault_is_seen(browser: Browser, fault: str, body: str) -> None:
    with browser.new_context(viewport=PHONE) as context:
        page = context.new_page()
        style = "<style>::placeholder { color: inherit }</style>"
        page.set_content(f"<!doctype html>{style}<body>{body}")
        assert fault in " ".join(page.evaluate(LOOKS)["faults"])
        page.set_content(f"<!doctype html>{style}<body><p>well</p><button>a</button>")
        assert page.evaluate(LOOKS)["faults"] == []


@pytest.mark.parametrize(("name", "size"), [("page", DESKTOP), ("page-phone", PHONE)])
def test_a_conversation(tour: Tour, name: str, size: dict[str, int]) -> None:
    tour.show(f"/#/talk/{tour.grocery}", size)
    settled(tour, SHOPPING[-1])
    tour.picture(name)


def test_a_conversation_on_a_phone_with_the_belief_open(tour: Tour) -> None:
    tour.show(f"/#/talk/{tour.grocery}", PHONE, "dark")
    settled(tour, SHOPPING[-1])
    tour.page.locator(".strip").click()
    assert tour.page.evaluate(LOOKS)["faults"] == []


def test_reasons_in_the_dark(tour: Tour) -> None:
    tour.show(f"/#/talk/{tour.grocery}", DESKTOP, "dark")
    settled(tour, SHOPPING[-1])
    goals = tour.page.get_by_role("region", name="Goals")
    goals.get_by_role("button").first.click()
    expect(goals.get_by_text("Speaks").first).to_be_visible()
    tour.picture("page-dark")


def test_a_robot_asks_for_leave(tour: Tour) -> None:
    tour.show(f"/#/talk/{tour.house}", TALL)
    settled(tour, TIDYING[-1])
    expect(tour.page.get_by_role("region", name="To confirm")).to_be_visible()
    expect(tour.page.get_by_role("img", name="The room")).to_be_visible()
    tour.picture("page-house")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_the_other_pages(tour: Tour, size: dict[str, int], scheme: str) -> None:
    both = f"{tour.grocery}/{tour.house}"
    for path, heading in (
        ("/", "Say what you want"), ("/#/episodes", "Episodes"),
        (f"/#/replay/{tour.grocery}", "Replay"), (f"/#/compare/{both}", "Compare"),
    ):  # fmt: skip
        tour.show(path, size, scheme)
        expect(tour.page.get_by_role("heading", level=1, name=heading)).to_be_visible()
        tour.page.wait_for_load_state("networkidle")
        assert tour.page.evaluate(LOOKS)["faults"] == []


def test_a_study_of_what_came_of_it(tour: Tour) -> None:
    page = tour.page
    tour.show(f"/#/talk/{tour.grocery}", DESKTOP)
    say(page, "Buy the basket", len(SHOPPING) + 1)
    card = page.get_by_role("region", name="To confirm")
    assert page.evaluate(LOOKS)["faults"] == []
    card.get_by_role("button", name="Yes").click()
    expect(page.get_by_role("region", name="The end")).to_contain_text("Bought, total $")
    assert page.evaluate(LOOKS)["faults"] == []
    with Store.open(tour.file) as store:
        StudyStore(store).add(STUDY)
    tour.show("/study/pictures?id=ann", DESKTOP)
    page.get_by_role("checkbox").check()
    page.get_by_role("button", name="Take part").click()
    page.get_by_role("link", name="Go to the questions").click()
    page.get_by_role("radio", name="2").check()
    page.get_by_label("Why?").fill(
        "All of it fits the pancakes, but nobody asked for gluten-free flour."
    )
    expect(page.get_by_role("status")).to_have_text("Saved")
    page.set_viewport_size(PHONE)
    assert page.evaluate(LOOKS)["faults"] == []
    page.set_viewport_size(PAPER)
    tour.picture("page-study", whole=True)
