"""Takes the pictures of the page that the README shows: `python docs/page_pictures.py`.

It needs the extra `web`, Playwright, and Chromium.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Page, expect, sync_playwright

HERE = Path(__file__).parent
SAID = (
    "We are having a picnic in the park on Saturday, with our two children.",
    "Sandwiches with cheese, and something sweet. We eat no meat.",
    "Some fruit that is easy to carry, and juice.",
)
OPTIONS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
SERVE = "from goalscope.cli import main; main()"


def talk(page: Page) -> None:
    """Have the conversation, and open the reasons of the likeliest goal."""
    page.get_by_role("button", name="Begin").click()
    for number, words in enumerate(SAID, 1):
        page.get_by_label("Your words", exact=True).fill(words)
        page.get_by_label("Your words", exact=True).press("Enter")
        bubbles = page.get_by_role("log").locator(".bubble.agent:visible")
        expect(bubbles).to_have_count(number + 1, timeout=120_000)
        expect(page.locator(".thinking")).to_have_text("", timeout=120_000)


def main() -> None:
    """Take them."""
    with TemporaryDirectory() as folder, sync_playwright() as playwright:
        command = [sys.executable, "-c", SERVE, "serve", "--port", "0", "--store", f"{folder}/e.db"]
        environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, text=True, env=environment
        ) as server:
            assert server.stdout is not None
            address = server.stdout.readline().split()[-1]
            chromium = shutil.which("chromium")
            browser = playwright.chromium.launch(executable_path=chromium, args=OPTIONS)
            context = browser.new_context(viewport={"width": 1280, "height": 860})
            page = context.new_page()
            page.goto(address)
            talk(page)
            page.screenshot(path=HERE / "page.png")
            page.emulate_media(color_scheme="dark")
            goals = page.get_by_role("region", name="Goals")
            goals.get_by_role("button").first.click()
            expect(goals.get_by_role("table")).to_be_visible()
            page.screenshot(path=HERE / "page-dark.png")
            page.emulate_media(color_scheme="light")
            page.set_viewport_size({"width": 390, "height": 780})
            page.reload()
            expect(page.get_by_role("log")).to_contain_text(SAID[-1])
            page.screenshot(path=HERE / "page-phone.png")
            browser.close()
            server.terminate()


if __name__ == "__main__":
    main()
