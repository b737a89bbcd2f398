# ruff: noqa: RUF001
"""The list of episodes shows what the person said first, and finds an episode by it."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import expect
from rich.cells import cell_len

from browsers import needs_chromium
from commands import run
from databases import begin
from goalscope.base.types import Turn
from goalscope.cli.display import show_episodes
from goalscope.storage.store import Store
from sites import site
from test_display import EPISODE, drawn
from test_store import a_round

LONG = "I am cooking an Italian dinner for two friends on Friday. "
CHINESE = "我想在星期五为两位朋友做一顿意大利晚餐"
QUOTES = 'He said "utterance": "milk" \\ and {"turn": 1}'
PERSIAN = "می\u200cخواهم"
SAID = {
    "short": ("Tea, please", "Tea, please"),
    "of one letter": ("x", "x"),
    "on two lines": ("Two things:\n\n- tea\n- \tmilk", "Two things: - tea - milk"),
    "long": (LONG * 9, f"{(LONG * 9)[:117]}..."),
    "Chinese": (CHINESE * 9, f"{(CHINESE * 9)[:117]}..."),
    "Persian": (PERSIAN, PERSIAN),
    "emoji": ("🍰" * 200, f"{'🍰' * 117}..."),
    "quotes": (QUOTES, QUOTES),
}


def test_an_episode_has_the_first_words_of_its_person(place) -> None:
    with Store.open(place) as store:
        for said, shown in SAID.values():
            episode = begin(store, domain="grocery", method="good", model="m", task="Sell.")
            assert store.episode(episode).first_words == ""
            store.append(episode, a_round(1, turn=Turn('"utterance": "no"', said)))
            store.append(episode, a_round(2, turn=Turn("What else?", "And milk.")))
            assert store.episode(episode).first_words == shown
            assert len(shown) <= 120
        shown = [shown for _, shown in SAID.values()]
        assert [each.first_words for each in store.episodes()] == shown


@pytest.mark.parametrize("width", [60, 200])
@pytest.mark.parametrize("shown", [shown for _, shown in SAID.values()], ids=SAID.keys())
def test_the_terminal_cuts_them_to_the_room_that_is_left(width: int, shown: str) -> None:
    text = drawn(show_episodes, [replace(EPISODE, first_words=shown)], width=width)
    assert shown[:4] in text
    assert EPISODE.id in text
    lines = text.splitlines()
    assert max(map(cell_len, lines)) <= width
    assert sum(bool(line.strip()) for line in lines) == 3
    assert (shown in text) or "\N{HORIZONTAL ELLIPSIS}" in text


def test_the_terminal_filters_by_words_and_domain(tmp_path: Path) -> None:
    file = tmp_path / "episodes.db"
    with Store.open(file) as store:
        ids: list[str] = []
        for domain, said in (("grocery", "Some tea"), ("house", "Make tea"), ("/a/my.py", "Swim")):
            ids.append(begin(store, domain=domain, method="good", model="m", task="t"))
            store.append(ids[-1], a_round(turn=Turn("What?", said)))

    def found(*options: str) -> list[str]:
        listed = run("episodes", "--store", file, "--json", *options)
        return [each["first_words"] for each in json.loads(listed.stdout)]

    assert found() == ["Some tea", "Make tea", "Swim"]
    assert found("--text", "TEA") == ["Some tea", "Make tea"]
    assert found("--domain", "house") == ["Make tea"]
    assert found("--domain", "my.py") == found("--domain", "/a/my.py") == ["Swim"]
    assert found("--domain", "grocery", "--text", "tea") == ["Some tea"]
    assert found("--text", "coffee") == []
    shown = run("episodes", "--store", file, "--domain", "house")
    assert "Make tea" in shown.stdout
    assert "Swim" not in shown.stdout
    none = run("episodes", "--store", file, "--text", "coffee")
    listing = f"`goalscope episodes --store {file}`"
    assert none.stdout == f"No stored episode fits. {listing} lists them all.\n"


@needs_chromium
def test_the_page_lists_and_filters_by_them(tmp_path: Path, enter) -> None:
    file = tmp_path / "episodes.db"
    hostile = "<img src=x onerror=window.ran=1> to clean"
    with Store.open(file) as store:
        for domain, said in (("grocery", "Some tea"), ("house", "Make tea"), ("house", hostile)):
            episode = begin(store, domain=domain, method="good", model="m", task="t")
            store.append(episode, a_round(turn=Turn("What?", said)))
    with site(file) as address:
        page = enter(address)
        page.get_by_role("link", name="Episodes").click()
        words = page.locator("td[data-name='First words']")
        expect(words).to_have_text([hostile, "Make tea", "Some tea"])
        page.get_by_label("Domain").select_option("grocery")
        expect(words).to_have_text(["Some tea"])
        page.wait_for_url(re.compile("domain=grocery"))
        page.reload()
        expect(words).to_have_text(["Some tea"])
        expect(page.get_by_label("Domain")).to_have_value("grocery")
        page.get_by_label("Domain").select_option("house")
        page.get_by_label("Search").fill("tea")
        expect(words).to_have_text(["Make tea"])
        page.get_by_label("Domain").select_option("")
        expect(words).to_have_text(["Make tea", "Some tea"])
        assert page.evaluate("window.ran") is None
