"""Whatever stands in a store, a page that shows it runs none of it."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from playwright.sync_api import expect
from sqlalchemy import select

import databases
from browsers import needs_chromium
from fakes import WordModel
from goalscope.agent.round import Round
from goalscope.agent.settings import Settings
from goalscope.base.types import UNSPECIFIED, Action, Goal, GoalChange, StepResult, Turn
from goalscope.belief.belief import Belief
from goalscope.report import read_report, write_report
from goalscope.storage.store import Store
from goalscope.storage.tables import ITEMS
from goalscope.study.store import StudyStore
from sites import KEY, WRITES, site
from test_page import begin, rounds, say
from test_study import PEOPLE, PLAN

pytestmark = needs_chromium

TAGS = ("img", "svg", "iframe", "body", "video", "audio", "details", "input", "object", "marquee")
HANDLERS = ("onerror", "onload", "onfocus", "ontoggle", "onstart", "onbegin", "onmouseover")
RUN = "window.ran=1"
PAYLOADS = [
    *(f"<{tag} src=x {on}={RUN} autofocus open>" for tag, on in itertools.product(TAGS, HANDLERS)),
    *(f"<script{mark}>{RUN}</script>" for mark in ("", " src=//x", " type=module", "/x", "\t")),
    *(f'{close}<script>{RUN}</script>' for close in ('">', "'>", "-->", "]]>", "</textarea>")),
    *(f"<a href={way}:{RUN}>x</a>" for way in ("javascript", "JaVaScRiPt", "data:text/html,")),
    *(f"<svg><{tag} {way}=javascript:{RUN}>" for tag in ("a", "use", "animate", "set")
      for way in ("href", "xlink:href", "values", "to")),
    f"{{{{constructor.constructor('{RUN}')()}}}}", f"${{{RUN}}}", f"<%= {RUN} %>",
    f"<math><mtext><script>{RUN}</script>", f"<template><script>{RUN}</script></template>",
    f"<meta http-equiv=refresh content='0;javascript:{RUN}'>", f"<base href=javascript:{RUN}//>",
    f"<form action=javascript:{RUN}><button autofocus>", f"<style>*{{x:expression({RUN})}}</style>",
    *(f"<{tag} {on}={RUN} tabindex=1 autofocus>x</{tag}>" for tag in ("a", "p", "select", "keygen")
      for on in ("onfocus", "onanimationstart", "onpointerenter", "onwheel", "oncut")),
    *(f"<iframe srcdoc='{inner}'></iframe>" for inner in (f"<script>parent.{RUN}</script>", "x")),
    *(f"<img/src=x/{gap}onerror={RUN}>" for gap in ("\t", "\n", "\r", "\x0c", "/")),
    *(f"{start}script>{RUN}{start}/script>" for start in
      ("\uff1c", "\u2039", "%3C", "&lt;", "\\x3c", "\\u003c")),
    f"<svg onload\u00a0={RUN}>", f"<svg/onload={RUN}//", f"<!--><img src=x onerror={RUN}>-->",
    f"<noscript><p title='</noscript><img src=x onerror={RUN}>'>", f"<xss id=x onfocus={RUN}>#x",
    f"<object data='data:text/html,<script>{RUN}</script>'>", f"<embed src=javascript:{RUN}>",
    f"<link rel=import href='data:text/html,<script>{RUN}</script>'>",
    f"');{RUN};//", f'";{RUN};//', f"javascript:{RUN}",
    f"[x](javascript:{RUN})", f"`${{{RUN}}}`", f"\u2028{RUN}\u2029", f"#{{{RUN}}}",
]  # fmt: skip
SIZE = 20


def fill(store: Store, profile: str) -> str:
    """An episode whose every field holds the payloads."""
    settings = asdict(Settings(human="scripted"))
    id = databases.begin(store,
        domain="grocery", method="good", model=PAYLOADS[0], task=PAYLOADS[1], profile=profile,
        settings=settings,
    )  # fmt: skip
    for number, at in enumerate(range(0, len(PAYLOADS), SIZE), 1):
        some = PAYLOADS[at : at + SIZE]
        goals = [UNSPECIFIED, *map(Goal, some)]
        belief = Belief.uniform(goals).observe(np.linspace(-1, 0, len(goals)))
        turn, lines = Turn(" ".join(some), " ".join(reversed(some))), "\n- 1 x ".join(some)
        results = tuple(StepResult(Action("add item", each), True, each) for each in some)
        changes = tuple(GoalChange("added", Goal(each), each) for each in some)
        status = f"The basket holds:\n- 1 x {lines}\nTotal: $1.00"
        round = Round(number, turn, belief, changes, results, 0, status, tuple(some), False)
        store.append(id, round)
    store.finish(id, ended="terminated", score=1.0)
    return id


def test_nothing_that_is_said_or_stored_is_run(
    tmp_path: Path, enter: Callable, figure: Callable[[str], None]
) -> None:
    assert len({*PAYLOADS}) >= 150
    file = tmp_path / "episodes.db"
    with Store.open(file) as store:
        episode = fill(store, PEOPLE[0])
        StudyStore(store).add(
            replace(
                PLAN,
                name="shop",
                title=PAYLOADS[2],
                consent=" ".join(PAYLOADS[:40]),
                instructions=" ".join(PAYLOADS[40:]),
                question=PAYLOADS[3],
                transcript=True,
                scale=tuple(PAYLOADS[4:8]),
                thanks=PAYLOADS[8],
            )
        )
        with store.writing() as connection:
            for item in connection.execute(select(ITEMS)).all():
                own = {"profile": " ".join(PAYLOADS), "outcome": "\n".join(PAYLOADS)}
                view = json.dumps({**json.loads(item.view), **own})
                here = ITEMS.c.number == item.number
                connection.execute(ITEMS.update().where(here).values(view=view))
    write_report(read_report(file, draw=False), tmp_path / "report.md")
    written = (tmp_path / "report" / "episodes.md").read_text(encoding="utf-8")
    assert not set(written) & set("<\x1b\u202e")
    assert written.count("](") - written.count("\\](") == 1  # the link to the summary
    hostile = {mark: "\n".join(f"- {each}" for each in PAYLOADS[::12]) for mark in WRITES}
    with site(file, WordModel(hostile)) as address:
        page = enter(f"{address}/?key={KEY}")
        begin(page)
        for number, at in enumerate(range(0, len(PAYLOADS), SIZE), 1):
            say(page, " ".join(PAYLOADS[at : at + SIZE])[:2000])
            rounds(page, number)
        goals = page.get_by_role("region", name="Goals")
        goals.get_by_text("Add a goal").click()
        goals.get_by_role("textbox").last.fill(PAYLOADS[0])
        goals.get_by_role("textbox").last.press("Enter")
        expect(goals.locator("details.add[open]")).to_have_count(0)  # it was taken
        goals.get_by_role("button", name=re.compile("^<")).first.click()
        expect(goals.get_by_role("button", name="No, rule it out")).to_be_visible()
        assert page.evaluate("window.ran") is None
        places = ["/#/episodes", f"/#/compare/{episode}/{episode}", f"/#/replay/{episode}"]
        for place in places:
            page.goto(f"{address}{place}")
            expect(page.get_by_role("main")).to_be_visible()
            page.wait_for_load_state("networkidle")
            assert page.evaluate("window.ran") is None
        for _ in range(0, len(PAYLOADS), SIZE):
            page.get_by_role("slider").press("ArrowLeft")
            assert page.evaluate("window.ran") is None
        expect(page.get_by_text(PAYLOADS[0]).first).to_be_visible()
        page.goto(f"{address}/study/shop?id=ann")
        expect(page.get_by_role("checkbox")).to_be_visible()
        page.get_by_role("checkbox").check()
        page.get_by_role("button", name="Take part").click()
        page.get_by_role("link", name="Go to the questions").click()
        expect(page.get_by_role("heading", name="Question 1 of 1")).to_be_visible()
        assert page.evaluate("window.ran") is None
        page.get_by_role("radio").first.check()
        page.get_by_label("Why?").fill("".join(PAYLOADS)[:3000])
        page.get_by_role("button", name="Finish").click()
        expect(page.get_by_role("heading", name="Thank you")).to_be_visible()
        page.wait_for_load_state("networkidle")
        assert page.evaluate("window.ran") is None
    figure(
        f"{len({*PAYLOADS})} payloads in every field, 6 pages: 0 executions, 0 complaints",
    )
