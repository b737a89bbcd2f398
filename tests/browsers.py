"""A real browser for tests of the page."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Dialog,
    Page,
    expect,
    sync_playwright,
)

from sites import ENTERED

expect.set_options(timeout=20_000)
CHROMIUM = shutil.which("chromium")
"""Where it is; None where there is none, and the tests are skipped."""

needs_chromium = pytest.mark.skipif(
    CHROMIUM is None, reason="install Debian's chromium: `make servers` does"
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    options = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=options)
        yield started
        started.close()


def is_fault(message: ConsoleMessage) -> bool:
    """Whether it is more than a network that is lost, or an answer that came too late."""
    expected = ("net::ERR", "status of 409")
    return message.type == "error" and not any(each in message.text for each in expected)


def let_in(context: BrowserContext, address: str) -> None:
    """Give a browser the cookie of who has opened the address with the key."""
    context.add_cookies(
        [{"name": name, "value": value, "url": address} for name, value in ENTERED.items()]
    )


@pytest.fixture
def enter(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Opens pages, each for a person of their own; none may say anything in its console."""
    said: list[str] = []
    contexts = []

    def told(dialog: Dialog) -> None:
        if dialog.type == "beforeunload":
            dialog.accept()
        else:
            said.append(dialog.message)
            dialog.dismiss()

    def opened(address: str, **options) -> Page:
        contexts.append(browser.new_context(**options))
        let_in(contexts[-1], address)
        contexts[-1].on("console", lambda each: said.append(each.text) if is_fault(each) else None)
        contexts[-1].on("weberror", lambda each: said.append(str(each.error)))
        contexts[-1].on("dialog", told)
        page = contexts[-1].new_page()
        page.set_default_timeout(15_000)
        page.goto(address)
        return page

    yield opened
    for context in contexts:
        context.close()
    assert said == []
