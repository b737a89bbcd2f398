"""What a model thinks before it answers is neither shown nor read."""

from __future__ import annotations

import json
import time
from contextlib import suppress

import pytest

from goalscope.base.types import Message, ModelError
from goalscope.models.reasoning import answer_of
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
        ("[think] of a [reason]", "[think] of a [reason]"),
        ("analysis of the budget", "analysis of the budget"),
        ("Sure. <think>Cake?</think>bake a cake", "Sure. bake a cake"),
        ("bake <reasoning>They bake.</reasoning>a cake", "bake a cake"),
        ("<think>One.</think>\n<think>Two.</think>bake a cake", "bake a cake"),
        ("<think>The <think> tag</think> again</think>bake a cake", "bake a cake"),
        ("<reasoning>They bake.</reasoning>bake a cake", "bake a cake"),
        ("<thought>They bake.</thought>\n<answer>bake a cake</answer>", "bake a cake"),
        ("<seed:think>They bake.</seed:think>bake a cake", "bake a cake"),
        ('<think time="2">They bake.</think>bake a cake', "bake a cake"),
        ("They bake.</mm:think>bake a cake", "bake a cake"),
        ("[THINK]They bake.[/THINK]bake a cake", "bake a cake"),
        ("◁think▷They bake.◁/think▷bake a cake", "bake a cake"),
        (
            "<|START_THINKING|>They bake.<|END_THINKING|><|START_RESPONSE|>bake a cake"
            "<|END_RESPONSE|>",
            "bake a cake",
        ),
        (
            "<|begin_of_thought|>They.<|end_of_thought|><|begin_of_solution|>bake a cake"
            "<|end_of_solution|>",
            "bake a cake",
        ),
        (
            "<|channel|>analysis<|message|>They bake.<|end|><|start|>assistant<|channel|>final"
            "<|message|>bake a cake<|return|>",
            "bake a cake",
        ),
        ("<|channel|>final<|message|>bake a cake", "bake a cake"),
        ("analysisThey bake.assistantfinalbake a cake", "bake a cake"),
        ("analysis of cakes. They bake.assistantfinalbake a cake", "bake a cake"),
        (
            "Here is my thought process:\nThey bake.\n\nHere is my response:\nbake a cake",
            "bake a cake",
        ),
        ("Fine. Here is my response: bake", "Fine. Here is my response: bake"),
        ("<|channel>thought\nThey bake.<channel|>bake a cake", "bake a cake"),
        (
            "<|open|>think<|sep|>They bake.<|close|>think<|sep|><|open|>response<|sep|>bake a cake",
            "bake a cake",
        ),
        ("Here are my reasoning steps:\nThey.\n[BEGIN FINAL RESPONSE]\nbake a cake", "bake a cake"),
    ],
)
def test_the_answer_is_what_follows_the_thought(text: str, answer: str) -> None:
    assert answer_of(text, "m") == answer


@pytest.mark.parametrize(
    "text",
    [
        "<think>They",
        "<think>They bake.</think>\n",
        "bake.</think>",
        "[THINK]They",
        "◁think▷They",
        "<|channel|>analysis<|message|>They",
        "<|START_THINKING|>They bake.<|END_THINKING|>",
        "analysisThe user bakes.",
        "<think>One.</think><think>Two",
    ],
)
def test_a_reply_that_is_all_thought_says_what_to_do(text: str) -> None:
    with pytest.raises(ModelError, match="Turn its thinking off"):
        answer_of(text, "m")


def test_a_reply_cut_off_in_a_later_thought_is_an_error() -> None:
    with pytest.raises(ModelError, match="Turn its thinking off"):
        answer_of("Sure. <think>They bake", "m", cut_off=True)
    assert answer_of("Sure, a <think> tag", "m") == "Sure, a <think> tag"


def test_long_replies_are_read_in_time_of_their_length() -> None:
    for mark in ("<think>", "</think>", "<a", "[THINK", " ", "<|channel|>analysis", "<think> "):
        start = time.process_time()
        for text in "x" + mark * 100_000, mark * 100_000:
            with suppress(ModelError):
                answer_of(text, "m")
        assert time.process_time() - start < 5


def test_a_reply_cut_off_in_a_thought_that_the_prompt_began_is_an_error() -> None:
    cut = reply("Cake or tea?", finish_reason="length")
    model, _ = writing((200, cut), (200, reply("Tea? </think>bake")), (200, cut))
    assert model.generate(ASKED).text == "Cake or tea?"  # nothing tells that it is a thought
    assert model.generate(ASKED).text == "bake"
    with pytest.raises(ModelError, match="Turn its thinking off"):
        model.generate(ASKED)


THOUGHT = "Cake or tea?"


@pytest.mark.parametrize(
    "message",
    [
        {"content": "", "reasoning_content": THOUGHT},
        {"content": None, "reasoning_content": THOUGHT},
        {"reasoning": THOUGHT},
        {"content": "\n", "reasoning": THOUGHT},
        {"content": [{"type": "thinking", "thinking": [{"type": "text", "text": THOUGHT}]}]},
    ],
)
def test_a_reply_with_its_thought_in_a_field_of_its_own_alone_is_an_error(message) -> None:
    answer = {"choices": [{"message": message, "finish_reason": "length"}], "usage": None}
    model, _ = writing((200, answer))
    with pytest.raises(ModelError, match="Turn its thinking off"):
        model.generate(ASKED)


def test_hidden_reasoning_that_took_all_tokens_is_an_error() -> None:
    usage = {"completion_tokens": 9, "completion_tokens_details": {"reasoning_tokens": 9}}
    model, _ = writing((200, reply("", finish_reason="length") | {"usage": usage}))
    with pytest.raises(ModelError, match="Turn its thinking off"):
        model.generate(ASKED)


@pytest.mark.parametrize(
    "message",
    [
        {"content": "bake", "reasoning_content": THOUGHT},
        {"content": [{"type": "thinking", "thinking": THOUGHT}, {"type": "text", "text": "bake"}]},
    ],
)
def test_the_answer_beside_a_thought_is_the_reply(message) -> None:
    model, _ = writing((200, {"choices": [{"message": message, "finish_reason": "stop"}]}))
    assert model.generate(ASKED).text == "bake"


ITEM = {"type": "object", "properties": {"item": {"type": "string"}}, "required": ["item"]}


def test_json_after_a_thought_is_read_and_marks_in_its_texts_stay() -> None:
    for text, found in (
        ('<think>Tea? {"item": "milk"}</think>{"item": "tea"}', "tea"),
        ('Tea?</think>\n{"item": "tea"}', "tea"),
        ('{"item": "the </think> tag"}', "the </think> tag"),
        ('{"item": "<think>x</think>"}', "<think>x</think>"),
    ):
        model, _ = writing((200, reply(text)))
        assert json.loads(model.generate(ASKED, schema=ITEM).text) == {"item": found}


def test_a_served_reply_is_its_answer_alone() -> None:
    model, _ = writing((200, reply("<think>Cake or tea?</think>\nbake a cake")))
    assert model.generate(ASKED).text == "bake a cake"


def test_a_served_reply_of_thought_alone_is_an_error() -> None:
    model, _ = writing((200, reply("<think>Cake or tea?", finish_reason="length")))
    with pytest.raises(ModelError, match="only reasoned"):
        model.generate(ASKED)
