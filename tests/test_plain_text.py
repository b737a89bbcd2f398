"""What people's keyboards make of a sentence changes nothing of what is understood."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fakes import WordModel
from goalscope.agent.guards import is_yes, speaks_of_harm
from goalscope.base.text import plain
from goalscope.base.types import UNSPECIFIED, Goal, InvalidInputError, canonical
from goalscope.belief.tracker import GoalTracker
from goalscope.language.cues import doubt
from goalscope.language.orders import Reading

APOSTROPHES = "\u2018\u2019\u00b4\u2032\u02bc\uff07`\u02b9\u02bb\u055a\u2035\u275c\u0092"
HYPHENS = "\u2010\u2011\u2012\u2013\u2212\u02d7\u2043\ufe58\ufe63\uff0d"
PERSIAN = "\u0645\u06cc\u200c\u062e\u0648\u0627\u0647\u0645"  # its joiner is a letter
UNSEEN = "\u00ad\u200b\u2060\ufeff\u202e\u2066\u200c\u200d\u034f\u180e\ufe0f\u2063\U000e0061"


@pytest.mark.parametrize(
    ("marks", "typed", "read"),
    [
        (APOSTROPHES, "Please don{}t transfer my money", "Please don't transfer my money"),
        (HYPHENS, "It has to be nut{}free.", "It has to be nut-free."),
        (UNSEEN, "al{}monds", "almonds"),
    ],
)
def test_each_kind_of_mark_is_read_as_one(marks: str, typed: str, read: str) -> None:
    assert {plain(typed.format(mark)) for mark in marks} == {read}


@pytest.mark.parametrize(
    ("typed", "read"),
    [
        ("Please don&#39;t transfer my money", "Please don't transfer my money"),
        ("Please don&amp;#39;t transfer it", "Please don't transfer it"),
        ("Please don&rsquo;t transfer&nbsp;it", "Please don't transfer it"),
        ("Please don\u00e2\u20ac\u2122t, caf\u00c3\u00a9", "Please don't, caf\u00e9"),
        (r"Please don\'t, or don\u2019t", "Please don't, or don't"),
        ("do \x1b[1mnot\x1b[0m n\u0332o\u0332t\u0332", "do not not"),
        ("fish &amp; chips", "fish & chips"),
        ("do <b>not</b> transfer it, <i>please</i>", "do not transfer it, please"),
        ("if 3 < 4 and <name> is b", "if 3 < 4 and <name> is b"),
        ("\uff44\uff4f \uff4e\uff4f\uff54\u3000\uff42\uff55\uff59", "do not buy"),
        ("do \U0001d5fb\U0001d5fc\U0001d601 \ufb01nish", "do not finish"),
        ("Please don;t, or don''t", "Please don't, or don't"),
        ("AT&T; sells it", "AT&T; sells it"),
        ("do _not_ transfer it", "do not transfer it"),
        ("do **not** transfer it", "do not transfer it"),
        ("do ***not*** transfer ~~any~~ it", "do not transfer any it"),
        ("2*3*4 and snake_case_names", "2*3*4 and snake_case_names"),
        ("Please don t transfer it", "Please don't transfer it"),
        ("WON T do", "WON't do"),
        ("a ton t shirts", "a ton t shirts"),
        ("cre\u0300me frai\u0302che", "cr\u00e8me fra\u00eeche"),
        (
            "\u0645\u06cc\u200c\u062e\u0648\u0627\u0647\u0645",
            "\u0645\u06cc\u200c\u062e\u0648\u0627\u0647\u0645",
        ),
    ],
)
def test_markup_and_broken_words_are_read_as_meant(typed: str, read: str) -> None:
    assert plain(typed) == read


@given(st.text())
@example("\u00c3\u0082\u0080")  # misread twice
def test_plain_text_is_plain_already(text: str) -> None:
    once = plain(text)
    if not set("&*_~\\") & set(text):
        assert plain(once) == once
        assert unicodedata.is_normalized("NFC", once)


def test_the_belief_is_that_of_the_plain_sentence() -> None:
    goals = ["bake a nut-free cake", "bake an almond cake"]

    def believed(said: str) -> list[float]:
        tracker = GoalTracker(WordModel(), goals=goals)
        return tracker.observe("What else?", said).probability.tolist()

    assert believed("It has to be nut\u2011free.") == believed("It has to be nut-free.")


def test_a_goal_has_one_identity_in_every_form() -> None:
    composed = "make cr\u00e8me br\u00fbl\u00e9e"
    apart = unicodedata.normalize("NFD", composed)
    assert canonical(composed) == canonical(apart)
    tracker = GoalTracker(WordModel(), goals=[composed])
    assert tracker.add([apart]).goals == (UNSPECIFIED, Goal(composed))
    tracker.correct("veto", apart)
    with pytest.raises(InvalidInputError, match="ruled out"):
        tracker.add([composed])


@pytest.mark.parametrize(
    "typed",
    [
        *(f"Please don{mark}t transfer my money" for mark in APOSTROPHES),
        "Please don&#39;t transfer my money",
        "Please don t transfer my money",
        "Please do _not_ transfer my money",
        "Please do\u00adn't transfer my money",
    ],
)
def test_a_denial_is_one_however_it_is_typed(typed: str) -> None:
    goal = Goal("transfer my money")
    assert doubt(typed, goal)
    assert not doubt("Please transfer my money", goal)


def test_guards_see_through_marks() -> None:
    nothing = Reading(())
    assert speaks_of_harm("He is al\u00adlergic, I think", nothing)
    assert speaks_of_harm("It gives her \u200bhi\u200bves", nothing)
    assert is_yes("**Yes**!")
    assert not is_yes("yes _not_")
