"""What people type in haste is made even, and slips of the pen are seen."""

from __future__ import annotations

import pytest

from goalscope.envs.speech import evened, lowered, misspelt


@pytest.mark.parametrize(
    ("typed", "even"),
    [
        ("cld u grab  me some Milk pls", "could you grab me some milk please"),
        ("I dont need it, thx", "i don't need it, thanks"),
        ("uh, gimme bread n butter", "give me bread and butter"),
        ("I think the pan should go. I think so.", "the pan should go. i think so."),
        ("im out of rum, um, and lets see", "i'm out of rum, and let's see"),
        ("Milk as well as oil\u2026 it\u2019s all", "milk and oil\u2026 it's all"),
        ("I guess we need oil. I think about it.", "we need oil. i think about it."),
        ("I think put it in. I believe in fish", "put it in. i believe in fish"),
        ("I suppose that the pans must go", "the pans must go"),
        ("hide the umbrella lol", "hide the umbrella"),
    ],
)
def test_words_typed_in_haste_are_written_out(typed: str, even: str) -> None:
    assert evened(typed) == even
    assert evened(even) == even


def test_lowered_is_one_short_line() -> None:
    assert lowered(" A\n\u2019B ") == "a 'b"
    assert len(lowered("x" * 9999)) == 2000


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("appel", "apple"),
        ("lettcue", "lettuce"),
        ("letuce", "lettuce"),
        ("tommato", "tomato"),
        ("plane", ""),
        ("pan", ""),
        ("slat", ""),
        ("", ""),
    ],
)
def test_only_turned_and_doubled_letters_are_slips(word: str, meant: str) -> None:
    known = frozenset(("apple", "lettuce", "tomato", "plate", "pen", "pan", "salt"))
    assert misspelt(word, known) == meant
