# ruff: noqa: RUF001
"""Joiners stay where a script needs them; nothing else that is invisible is shown."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from rich.console import Console

from databases import begin
from fakes import WordModel
from goalscope.agent.round import Round
from goalscope.base.nouns import words
from goalscope.base.text import FORMAT, JOINERS, plain, terminal_safe, without_invisible
from goalscope.base.types import InvalidInputError, Turn, canonical, checked_text
from goalscope.belief.belief import Belief
from goalscope.belief.tracker import GoalTracker
from goalscope.cli.display import show_round
from goalscope.storage.store import Store
from test_catalogue import load

NJ, J = JOINERS
WORDS = {
    "Persian": f"می{NJ}خواهم",
    "Persian after a letter that joins nothing": f"کار{NJ}ها",
    "Persian after Latin letters": f"USB{NJ}ها",
    "Persian after digits": f"۳۰{NJ}ساله، 5{NJ}ام",
    "Persian at the end of a word": f"سال ۱۴۰۰ ه{J}.",
    "Urdu": f"دل{NJ}چسپ",
    "Kurdish": f"ب{NJ}ه",
    "Pashto with a mark": f"خبرَ{NJ}رسان",
    "Hindi": f"श्री रक्{J}षा, रक्{NJ}षा",
    "Marathi": f"दर्{J}या",
    "Bengali": f"র{J}্যাব",
    "Malayalam at the end": f"അവന്{J}",
    "Kannada": f"ರ{J}್ಕ",
    "Sinhala": f"ශ්{J}රී ලංකා",
    "Tamil": f"க்{NJ}ஷ",
    "a family": f"👨{J}👩{J}👧{J}👦",
    "a profession with a colour of skin": f"👩🏽{J}🚀",
    "a heart on fire": f"❤️{J}🔥",
    "a nod": f"🙂{J}↔️",
    "a flag": f"🏳️{J}🌈",
    "a word and a cook": f"Soup 👩{J}🍳",
}
PERSIAN = WORDS["Persian"]
OVERRIDES = {
    "override": "\u202e", "embedding": "\u202a", "pop": "\u202c", "isolate": "\u2066",
    "end of isolate": "\u2069", "mark": "\u200f", "zero-width space": "\u200b",
    "soft hyphen": "\u00ad", "byte order": "\ufeff", "word joiner": "\u2060",
    "invisible times": "\u2062", "tag": "\U000e0041", "annotation": "\ufff9",
}  # fmt: skip


def goods(folder: Path, *names: str) -> list[str]:
    rows = "".join(f'"{name}"\n' for name in names)
    return [item.name for item in load(folder, f"name\n{rows}").items]


@pytest.mark.parametrize("word", WORDS.values(), ids=WORDS.keys())
def test_a_word_keeps_its_joiners(word: str) -> None:
    assert without_invisible(word) == without_invisible(word, kinds=FORMAT) == word
    assert terminal_safe(word).plain == plain(word) == checked_text(word, "goal") == word
    bare = word.translate(dict.fromkeys(map(ord, JOINERS)))
    assert canonical(word) == canonical(bare)  # the same goal


def test_joiners_are_kept_wherever_a_word_is_shown_or_stored(tmp_path: Path) -> None:
    assert goods(tmp_path, PERSIAN, "tea") == [PERSIAN, "tea"]
    out = Console(file=io.StringIO(), width=120)
    turn = Turn("What else?", PERSIAN)
    show_round(out, Round(1, turn, Belief.uniform(()), (), status=PERSIAN, notes=(PERSIAN,)), None)
    assert out.file.getvalue().count(PERSIAN) >= 3
    with Store.open(tmp_path / "episodes.db") as store:
        episode = begin(
            store, domain=PERSIAN, method="good", model="m", task=PERSIAN, profile=PERSIAN
        )
        store.append(episode, Round(1, turn, Belief.uniform(()), ()))
        assert store.rounds(episode)[0].turn == turn
        assert store.episode(episode).profile == PERSIAN
        assert [info.id for info in store.episodes(text=PERSIAN)] == [episode]


@pytest.mark.parametrize("mark", OVERRIDES.values(), ids=OVERRIDES.keys())
def test_what_reorders_or_hides_goes_beside_any_script(mark: str, tmp_path: Path) -> None:
    for word in WORDS.values():
        for hostile in (mark + word, word + mark, word[:1] + mark + word[1:], f"a{mark}b {word}"):
            assert mark not in plain(hostile)
            assert mark not in terminal_safe(hostile).plain
            assert "\N{REPLACEMENT CHARACTER}" in terminal_safe(hostile).plain
    assert mark not in goods(tmp_path, f"a{mark}b")[0]


@pytest.mark.parametrize("joiner", JOINERS)
@pytest.mark.parametrize("shape", ["nut{}s", "{}nuts", "nuts{}", "n{0}u{0}t{0}s", "{0}{0}nuts"])
def test_a_joiner_where_no_script_needs_it_makes_no_second_identity(
    joiner: str, shape: str, tmp_path: Path
) -> None:
    typed = shape.format(joiner)
    assert canonical(typed) == canonical("nuts")
    assert plain(typed) == terminal_safe(typed).plain == "nuts"
    assert goods(tmp_path, "nuts", typed) == ["nuts", "nuts (2)"]
    with pytest.raises(InvalidInputError, match="is the same as 'nuts'"):
        GoalTracker(WordModel(), goals=["nuts", typed])


@pytest.mark.parametrize("text", [NJ, J, f" {NJ}{J} ", "\u202e\u2066"])
def test_joiners_alone_are_no_text(text: str) -> None:
    with pytest.raises(InvalidInputError, match="is empty"):
        checked_text(text, "goal")


@given(st.text(st.sampled_from(f"{JOINERS}یک aé۵क्👩🏽❤\ufe0f\u202e\u00ad\n\t.☠"), max_size=12))
@example(f"ی{NJ * 5}")
@example(f"{NJ * 5}ی")
@example(f"👩{J}{J}👩")
def test_the_rule_is_stable_and_touches_only_what_is_invisible(text: str) -> None:
    once = without_invisible(text)
    assert without_invisible(once) == once
    visible = [each for each in text if each not in f"{JOINERS}\u202e\u00ad\n\t"]
    assert [each for each in once if each not in JOINERS] == visible
    shown = terminal_safe(text).plain
    assert terminal_safe(shown).plain == shown


def test_millions_of_joiners_take_no_time() -> None:
    assert without_invisible(NJ * 1_000_000) == ""
    assert len(without_invisible(f"ی{NJ}" * 100_000)) == 200_000


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("\u091a\u093e\u0935\u0932 \u0914\u0930 \u0926\u093e\u0932", 3),  # Hindi
        ("\u0d05\u0d35\u0d28\u0d4d\u200d \u0d35\u0d28\u0d4d\u0d28\u0d41\u0964", 2),  # Malayalam
        ("\u0645\u06cc\u200c\u062e\u0648\u0627\u0647\u0645\u060c \u0646\u0627\u0646", 2),  # Persian
        ("\u0e02\u0e49\u0e32\u0e27 2", 2),  # Thai
        ("cre\u0300me fra\u00eeche", 2),
        ("Anna's o'clock", 2),
    ],
)
def test_no_word_of_any_script_is_torn(text: str, found: int) -> None:
    assert len(words(text)) == found
