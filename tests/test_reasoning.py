"""What a model thinks before it answers is neither shown nor read."""

from __future__ import annotations

import json
import time
from contextlib import suppress

import pytest

from goalscope.models.http import Server
from goalscope.models.reasoning import answer_of, answer_so_far
from goalscope.models.served_generator import ServedGenerator
from goalscope.types import Message, ModelError
from test_served import URL
from test_served_writing import Streams, httpx2, piece, reply, streamed, writing

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
        ("<|channel>thought\nThey bake.<channel|>bake a cake", "bake a cake"),
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
    assert answer_so_far(text) == ""
    with pytest.raises(ModelError, match="Turn its thinking off"):
        answer_of(text, "m")


def test_a_reply_cut_off_in_a_later_thought_is_an_error() -> None:
    with pytest.raises(ModelError, match="Turn its thinking off"):
        answer_of("Sure. <think>They bake", "m", cut_off=True)
    assert answer_of("Sure, a <think> tag", "m") == "Sure, a <think> tag"


@pytest.mark.parametrize(
    "text",
    [
        "<think>Secret.</think>bake a cake",
        "<|channel|>analysis<|message|>Secret.<|end|><|start|>assistant<|channel|>final<|message|>"
        "bake a cake",
        "[THINK]Secret.[/THINK]bake a cake",
        "◁think▷Secret.◁/think▷bake a cake",
        "<|START_THINKING|>Secret.<|END_THINKING|><|START_RESPONSE|>bake a cake<|END_RESPONSE|>",
        "<|channel>thought\nSecret.<channel|>bake a cake",
        "<|open|>think<|sep|>Secret.<|close|>think<|sep|><|open|>response<|sep|>bake a cake",
        "analysisSecret.assistantfinalbake a cake",
        "bake <reasoning>Secret.</reasoning>a cake",
        '<think time="2 s">Secret.</think>bake a cake',
        "<thought>Secret.</thought><answer>bake a cake</answer>",
    ],
)
def test_a_draft_shows_the_answer_alone_and_only_grows(text: str) -> None:
    drafts = [answer_so_far(text[:end]) for end in range(len(text) + 1)]
    assert drafts[-1] == answer_of(text, "m") == "bake a cake"
    assert all("bake a cake".startswith(draft) for draft in drafts)


def test_a_draft_is_shown_up_to_half_a_mark() -> None:
    assert answer_so_far("is 3 < 4") == "is 3 < 4"
    assert answer_so_far("bake a cake <thi") == "bake a cake "
    assert answer_so_far("an") == ""  # may be "analysis", without the marks of its channel
    assert answer_so_far("an apple") == "an apple"


def test_long_replies_are_read_in_time_of_their_length() -> None:
    for mark in ("<think>", "</think>", "<a", "[THINK", " ", "<|channel|>analysis", "<think> "):
        start = time.process_time()
        answer_so_far("x" + mark * 100_000)
        with suppress(ModelError):
            answer_of(mark * 100_000, "m")
        assert time.process_time() - start < 5


def test_a_streamed_thought_is_not_shown() -> None:
    thought = {"choices": [{"delta": {"reasoning_content": "Cake?"}, "finish_reason": None}]}
    parts = [piece(each) for each in ("<th", "ink>Tea", "?</thi", "nk>\nbake", " a cake")]
    answer, told = Streams(streamed(thought, *parts, piece(None, "stop"))).generate()
    assert answer.text == "bake a cake"
    assert told == ["bake", "bake a cake", "bake a cake"]


def test_drafts_of_a_server_whose_replies_begin_in_a_thought_wait_for_its_end() -> None:
    def text(*parts: str) -> str:
        return streamed(*map(piece, parts), piece(None, "stop"))

    server = Streams(text("Tea? </think>bake"), text("Cake", " or tea?", "</think>", "bake"))
    model = ServedGenerator(Server(URL + "#m", transport=httpx2.MockTransport(server)))
    model.generate(ASKED)
    told: list[str] = []
    assert model.generate(ASKED, on_text=told.append).text == "bake"
    assert told == ["bake", "bake"]


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
    delta = {"choices": [{"delta": message, "finish_reason": "length"}]}
    with pytest.raises(ModelError, match="Turn its thinking off"):
        Streams(streamed(delta)).generate()


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
    delta = {"choices": [{"delta": message, "finish_reason": "stop"}]}
    answer, told = Streams(streamed(delta)).generate()
    assert (answer.text, told) == ("bake", ["bake", "bake"])


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
