"""Models behind servers that write: freely, or by a schema."""

from __future__ import annotations

import json
from typing import Any

import pytest

from goalscope.base.types import ModelError
from goalscope.models import Completion
from goalscope.models.served import ServedGenerator
from goalscope.models.server import Server
from test_served import CONTEXTS, SCHEMA, URL

httpx2 = pytest.importorskip("httpx2", reason="models behind a server need goalscope[remote]")


def writing(*answers: tuple[int, Any]) -> tuple[ServedGenerator, list[dict[str, Any]]]:
    """A generator whose server gives these answers in turn, and what it was sent."""
    rest, sent = list(answers), []

    def answer(request: httpx2.Request) -> httpx2.Response:
        sent.append(json.loads(request.content))
        status, body = rest.pop(0)
        return httpx2.Response(status, json=body)

    server = Server(URL + "#m", transport=httpx2.MockTransport(answer))
    return ServedGenerator(server), sent


def reply(text: Any, **changes: Any) -> dict[str, Any]:
    choice = {"message": {"content": text}, "finish_reason": "stop", **changes}
    return {"choices": [choice], "usage": None}


@pytest.mark.parametrize(
    "body",
    [
        [],
        3,
        {},
        {"choices": []},
        {"choices": [1]},
        {"choices": None},
        {"choices": [{}]},
        {"choices": [{"message": None}]},
        {"choices": [{"message": {}}], "usage": 3},
        reply(None),
        reply([{"type": "text"}]),
        reply("...", finish_reason="content_filter"),
    ],
)
def test_a_reply_in_another_form_is_one_clear_line(body: Any) -> None:
    generator, _ = writing((200, body))
    with pytest.raises(
        ModelError, match=r"an unknown form|wrote no reply|sent no answer"
    ) as caught:
        generator.generate(CONTEXTS[0])
    assert "\n" not in str(caught.value)


def test_a_reply_costs_what_the_server_counts() -> None:
    counted = reply("Six eggs.") | {"usage": {"prompt_tokens": 7, "completion_tokens": 2}}
    generator, _ = writing((200, counted), (200, reply("Six eggs.")))
    assert generator.generate(CONTEXTS[0]) == Completion("Six eggs.", "stop", 7, 2)
    assert generator.generate(CONTEXTS[0]) == Completion("Six eggs.", "stop", 0, 0)


@pytest.mark.parametrize("text", ["{}", "[]", "milk", "", "[" * 10**5])
def test_a_reply_that_does_not_keep_to_the_schema_is_an_error(text: str) -> None:
    generator, _ = writing((200, reply(text)))
    with pytest.raises(ModelError, match="did not keep to the JSON schema") as caught:
        generator.generate(CONTEXTS[0], schema=SCHEMA)
    assert "\n" not in str(caught.value)


def test_a_server_is_asked_in_its_own_dialect_and_once_it_is_known_at_once() -> None:
    error = {"error": {"message": "Use 'max_completion_tokens' instead of 'max_tokens'."}}
    generator, sent = writing((400, error), (200, reply("Hi.")), (200, reply("Hi.")))
    for _ in range(2):
        generator.generate(CONTEXTS[0], max_tokens=9)
    lengths = [{k: v for k, v in body.items() if k.startswith("max_")} for body in sent]
    assert lengths == [{"max_tokens": 9}, *[{"max_completion_tokens": 9}] * 2]


def test_a_server_that_knows_no_json_schema_is_asked_for_a_json_object() -> None:
    said = "{'loc': ('body', 'response_format', 'type'), 'msg': \"Input should be 'json_object'\"}"
    refusal = {"error": {"message": f"1 validation error: {said}"}}
    generator, sent = writing((400, refusal), (200, reply('{"item": "milk"}')))
    assert generator.generate(CONTEXTS[0], schema=SCHEMA).text == '{"item": "milk"}'
    assert [body["response_format"]["type"] for body in sent] == ["json_schema", "json_object"]
