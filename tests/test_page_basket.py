"""The basket on the page: what is crossed out, what was guessed, and what is shown to be bought."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from browsers import needs_chromium
from sites import WRITES, site
from test_page import Slow, begin, rounds, say

pytestmark = needs_chromium


def test_what_is_crossed_out_is_taken_out_at_once_and_together(tmp_path: Path, enter) -> None:
    with site(tmp_path / "episodes.db", Slow(WRITES)) as address:
        page = enter(address)
        begin(page)
        say(page, "add flour; add bananas; add milk; add eggs; add butter")
        rounds(page, 1)
        basket = page.locator(".side").get_by_role("table").filter(has_text="Total")
        lines = basket.get_by_role("button", name=re.compile("^Remove "))
        names = [str(line.get_attribute("value")) for line in lines.all()]
        words = page.get_by_label("Your words", exact=True)
        words.fill("Buy the basket")
        expect(page.get_by_role("button", name="Send")).to_be_enabled()
        crossed = """all => [
            ...[0, 1, 2, 1].map(place => all[place].click()),
            ...all.map(each => each.getAttribute("aria-pressed")),
            document.querySelector(".composer button").ariaDisabled,
        ].slice(4)"""  # the second stays after all
        pressed = ["true", "false", "true", "false", "false"]
        assert lines.evaluate_all(crossed) == [*pressed, "true"]
        sentences = f"Remove the {names[0]}. Remove the {names[2]}."
        expect(page.get_by_role("log").get_by_text(sentences)).to_be_visible()
        basket.get_by_role("button", name=f"Remove {names[3]}", exact=True).click()
        rounds(page, 3)
        expect(page.get_by_role("log").get_by_text(f"Remove the {names[3]}.")).to_be_visible()
        for name in (names[0], names[2], names[3]):
            expect(basket.get_by_role("button", name=f"Remove {name}", exact=True)).to_have_count(0)
            expect(page.get_by_role("log")).to_contain_text(f"{name} removed from the basket.")
        expect(basket.locator("tr.marked")).to_have_count(0)
        expect(words).to_have_value("Buy the basket")
        words.press("Enter")
        rounds(page, 4)
        card = page.get_by_role("region", name="To confirm").get_by_role("table")
        assert card.locator("tbody tr").count() == 2


def test_nothing_can_be_bought_while_something_is_crossed_out(address: str, enter) -> None:
    page = enter(address)
    begin(page)
    say(page, "add flour; add milk")
    rounds(page, 1)
    say(page, "Buy the basket")
    rounds(page, 2)
    card = page.get_by_role("region", name="To confirm")
    cross = page.get_by_role("button", name=re.compile("^Remove ")).first
    gone = str(cross.get_attribute("value"))
    shown = """cross => [1, 2, 3].map(() => {
        cross.click();
        return Boolean(document.querySelector(".card.confirm"));
    })"""
    assert cross.evaluate(shown) == [False, True, False]
    rounds(page, 3)
    expect(card).to_have_count(0)
    say(page, "Buy the basket")
    rounds(page, 4)
    expect(card).to_be_visible()
    expect(card).not_to_contain_text(gone)


def test_what_could_not_be_taken_out_is_no_longer_crossed_out(address: str, enter) -> None:
    page = enter(address)
    begin(page)
    say(page, "add flour")
    rounds(page, 1)
    page.route("**/utterances", lambda route: route.abort())
    page.get_by_role("button", name=re.compile("^Remove ")).click()
    expect(page.get_by_role("alert").filter(has_text="cannot be reached")).to_be_visible()
    expect(page.locator("tr.marked")).to_have_count(0)
    page.unroute("**/utterances")
    page.get_by_role("button", name="Try again").click()
    rounds(page, 2)
    expect(page.get_by_role("button", name=re.compile("^Remove "))).to_have_count(0)


FEW = "; ".join(
    f"add {each}"
    for each in ["flour", "bananas", "milk", "eggs", "butter", "rice", "apples", "sugar", "tea"]
)
MORE = "; ".join(
    f"add {each}"
    for each in ["coffee", "pasta", "tomatoes", "onions", "carrots", "pears", "honey", "bread"]
)


SCROLLING = """card => [card, ...card.querySelectorAll(":not(.unseen)")].filter(
    each => each.clientHeight && each.scrollHeight > each.clientHeight + 1).length"""


@pytest.mark.parametrize(("width", "height"), [(360, 640), (1280, 760)])
def test_the_whole_basket_is_shown_before_it_is_bought(
    address: str, enter, width: int, height: int
) -> None:
    page = enter(address, viewport={"width": width, "height": height})
    begin(page)
    for number, words in enumerate((FEW, "Buy the basket", MORE, "Buy the basket"), 1):
        say(page, words)
        rounds(page, number)
        if words in (FEW, MORE):
            continue
        card = page.get_by_role("region", name="To confirm")
        question = page.get_by_text("If that is all right").last
        expect(question).to_be_in_viewport(ratio=1)
        expect(card.get_by_role("row").nth(1)).to_be_in_viewport(ratio=1)
        expect(page.get_by_label("Your words", exact=True)).to_be_in_viewport(ratio=1)
        assert card.evaluate(SCROLLING) == 0
        buy = card.get_by_role("button", name="Yes")
        if (width, number) == (1280, 2):
            expect(buy).to_be_in_viewport(ratio=1)
            continue
        expect(buy).not_to_be_in_viewport()
        log = page.get_by_role("log")
        height = log.evaluate("log => log.scrollHeight")
        page.get_by_role("button", name="More below").click()
        expect(buy).to_be_in_viewport(ratio=1)
        expect(card.get_by_text(re.compile("^Total"))).to_be_in_viewport(ratio=1)
        expect(page.get_by_role("button", name="More below")).to_be_hidden()
        # Nothing moves under a pointer that is about to buy.
        assert log.evaluate("log => log.scrollHeight") == height


def test_what_was_guessed_is_marked_until_it_is_asked_for(address: str, enter) -> None:
    page = enter(address)

    def round(note: str, *actions: str, ok: bool = True) -> dict[str, object]:
        return {"notes": [note], "actions": [{"text": each, "ok": ok} for each in actions]}

    told = [
        round("Guessed, not asked for: Bread Flour (to bake bread); Towels, 6 rolls, Rye (to eat).",
              "add item: Bread Flour x2", "add item: Towels, 6 rolls", "add item: Rye",
              "add item: Flour", "search: Nuts"),
        round("The basket holds 2 x Rye already."),
        round("", "add item: Jam", ok=False),
        round("", "remove item: Bread Flour"),
    ]  # fmt: skip
    marks = (
        "async rounds => Object.fromEntries((await import('/static/status.js')).itemsOf(rounds))"
    )
    first = {"Bread Flour": True, "Towels, 6 rolls": True, "Rye": True, "Flour": False}
    assert page.evaluate(marks, told[:1]) == first
    assert page.evaluate(marks, told) == first | {"Bread Flour": False, "Rye": False}


def test_what_a_note_tells_is_not_told_again(address: str, enter) -> None:
    page = enter(address)
    told = """async ([notes, actions]) => {
        const { kindOf, namedIn } = await import("/static/status.js");
        return [notes.map(kindOf), actions.map(text => namedIn(notes, { text }))];
    }"""
    notes = [
        "Guessed, not asked for: Rye (to eat).",
        "Because you mentioned it: Jam.",
        "Taken back, as it was a guess for another goal: Beef, Garlic.",
        'Taken back: "add milk".',
        "As you confirmed: buy basket. The basket is now purchased for $1.79: 1 x Whole Milk.",
        "Not done.",
    ]
    actions = ["add item: Rye x2", "add item: Jam", "remove item: Garlic", "add item: Garlic",
               "remove item: Rye", "search inventory: Rye"]  # fmt: skip
    assert page.evaluate(told, [notes, actions]) == [
        ["guessed", "guessed", "removed", "done", "done", "refused"],
        [True, True, True, False, False, False],
    ]


def test_a_unit_behind_a_name_is_no_part_of_it(address: str, enter) -> None:
    page = enter(address)
    shown = """async ([status, names]) => {
        const { statusView } = await import("/static/status.js");
        const items = new Map(names.map((name) => [name, true]));
        const view = statusView(status, items, () => {});
        return [...view.querySelectorAll("tbody tr")].map((row) => [
            row.querySelector("button").value, row.cells[1].innerText, row.cells[2].innerText]);
    }"""
    status = "The basket holds:\n- 2 x Milk (1 L): $3.58\n- 1 x Nuts (raw): $2.00\n- 1 x Tea: $1.00"
    assert page.evaluate(shown, [status, ["Nuts (raw)"]]) == [
        ["Milk", "Milk (1 L)", "$3.58"],
        ["Nuts (raw)", "Nuts (raw) guessed", "$2.00"],
        ["Tea", "Tea", "$1.00"],
    ]
