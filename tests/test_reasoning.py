"""What a model thinks before it answers is neither shown nor read."""

from __future__ import annotations

import time
from contextlib import suppress

import pytest

from goalscope.base.types import Message, ModelError
from goalscope.models.chat import answer_of
from test_served_writing import reply, writing


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        ("bake a cake", "bake a cake"),
        ("\n<think>\nThey\nbake.\n</think>\n\nbake a cake\n", "bake a cake\n"),
        ("They bake.</think>\nbake a cake", "bake a cake"),
        ("is 3 < 4 a <think> tag?", "is 3 < 4 a <think> tag?"),
        ("write <think> and </think>", "write <think> and </think>"),
    ],
)
def test_the_answer_is_what_follows_the_thought(text: str, answer: str) -> None:
    assert answer_of(text, "m") == answer


@pytest.mark.parametrize("text", ["<think>They", "<think>They bake.</think>\n", "bake.</think>"])
def test_a_reply_that_is_all_thought_says_what_to_do(text: str) -> None:
    with pytest.raises(ModelError, match="Turn its thinking off"):
        answer_of(text, "m")


def test_long_replies_are_read_in_time_of_their_length() -> None:
    start = time.process_time()
    for mark in ("<think>", "</think>", " "):
        with suppress(ModelError):
            answer_of(mark * 100_000, "m")
    assert time.process_time() - start < 5


def test_a_served_reply_is_read_without_its_thought() -> None:
    model, _ = writing((200, reply("<think>Tea?</think>bake")))
    assert model.generate([Message("user", "Name a goal.")]).text == "bake"
