"""What a model thinks before it answers is neither shown nor read."""

from __future__ import annotations

import pytest

from goalscope.models.reasoning import answer_of, answer_so_far
from goalscope.types import Message, ModelError
from test_served_writing import reply, writing

ASKED = [Message("user", "Name a goal.")]


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        ("bake a cake", "bake a cake"),
        ("<think>They bake.</think>bake a cake", "bake a cake"),
        ("\n<think>\nThey\nbake.\n</think>\n\nbake a cake\n", "bake a cake\n"),
        ("They bake.</think>\nbake a cake", "bake a cake"),
        ("<thinking>They bake.</thinking> bake a cake", "bake a cake"),
        ("is 3 < 4 a <think> tag?", "is 3 < 4 a <think> tag?"),
    ],
)
def test_the_answer_is_what_follows_the_thought(text: str, answer: str) -> None:
    assert answer_of(text, "m") == answer


@pytest.mark.parametrize("text", ["<think>They", "<think>They bake.</think>\n", "bake.</think>"])
def test_a_reply_that_is_all_thought_says_what_to_do(text: str) -> None:
    assert answer_so_far(text) == ""
    with pytest.raises(ModelError, match="Turn its thinking off"):
        answer_of(text, "m")


def test_a_served_reply_is_its_answer_alone() -> None:
    model, _ = writing((200, reply("<think>Cake or tea?</think>\nbake a cake")))
    assert model.generate(ASKED).text == "bake a cake"


def test_a_served_reply_of_thought_alone_is_an_error() -> None:
    model, _ = writing((200, reply("<think>Cake or tea?", finish_reason="length")))
    with pytest.raises(ModelError, match="only reasoned"):
        model.generate(ASKED)
