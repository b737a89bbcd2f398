"""Models behind servers that write: whole, as a stream, by a schema."""

from __future__ import annotations

import json
from typing import Any

import pytest

from goalscope.models import Completion
from goalscope.models.http import Server
from goalscope.models.http_answers import Streamed
from goalscope.models.served_generator import ServedGenerator
from goalscope.types import ModelError
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
    with pytest.raises(ModelError, match=r"an unknown form|wrote no reply") as caught:
        generator.generate(CONTEXTS[0])
    assert "\n" not in str(caught.value)


def streamed(*events: Any, end: bool = True) -> str:
    lines = [f"data: {json.dumps(each)}" for each in events] + ["data: [DONE]"] * end
    return ": ping\r\n\r\n" + "\r\n\r\n".join(lines) + "\r\n\r\n"


def piece(text: str | None, finish: str | None = None) -> dict[str, Any]:
    return {"choices": [{"delta": {"content": text}, "finish_reason": finish}]}


ROLE = {"choices": [{"delta": {"role": "assistant"}, "finish_reason": None}]}
USAGE = {"choices": [], "usage": {"prompt_tokens": 7, "completion_tokens": 2}}


class Streams:
    """A server that streams its texts, one after the other, in chunks of a few bytes."""

    def __init__(self, *texts: str, refuses: str = "") -> None:
        self.texts, self.refuses = list(texts), refuses
        self.bodies: list[dict[str, Any]] = []

    def __call__(self, request: httpx2.Request) -> httpx2.Response:
        body = json.loads(request.content)
        self.bodies.append(body)
        if "stream" not in body:
            return httpx2.Response(200, json=reply("Six eggs."))
        if self.refuses:
            return httpx2.Response(400, json={"error": self.refuses})
        data = self.texts.pop(0).encode()
        chunks = (data[n : n + 5] for n in range(0, len(data), 5))
        return httpx2.Response(200, content=chunks, headers={"content-type": "text/event-stream"})

    def generate(self, **more: Any) -> tuple[Completion, list[str]]:
        told: list[str] = []
        model = ServedGenerator(Server(URL + "#m", transport=httpx2.MockTransport(self)))
        return model.generate(CONTEXTS[0], on_text=told.append, **more), told


GROWS = streamed(ROLE, piece("Six"), piece(" "), piece("eggs \u201c🥚"), piece(None, "stop"), USAGE)


def test_a_streamed_reply_is_heard_as_it_comes() -> None:
    answer, told = Streams(GROWS).generate()
    assert answer == Completion("Six eggs \u201c🥚", "stop", 7, 2)
    assert told == ["Six", "Six ", "Six eggs \u201c🥚", "Six eggs \u201c🥚"]


def test_a_stream_that_breaks_off_is_begun_again() -> None:
    for broken in (streamed(piece("Six"), end=False), streamed(piece("Six"))[:-22]):
        answer, told = Streams(broken, GROWS).generate()
        assert answer.text == told[-1] == "Six eggs \u201c🥚"


@pytest.mark.parametrize(
    "text",
    [
        streamed(piece("Six eggs.")),
        streamed(piece("Six eggs."), piece(None, "stop"), end=False).rstrip(),
        streamed(piece("Six eggs."), piece(None, "stop")).replace("\n", ""),
        streamed(piece("Six eggs."), piece(None, "stop")).replace("\r", ""),
    ],
    ids=["no finish_reason", "no last line end", "CR", "LF"],
)
def test_a_stream_ends_as_servers_end_theirs(text: str) -> None:
    assert Streams(text).generate() == (Completion("Six eggs.", "stop", 0, 0), ["Six eggs."] * 2)


def test_only_what_speaks_of_streams_ends_them() -> None:
    server = Streams(refuses="upstream error")
    with pytest.raises(ModelError, match="upstream error"):
        server.generate()
    assert ["stream" in body for body in server.bodies] == [True]


def test_a_line_without_end_is_refused() -> None:
    parser = Streamed(lambda text: None)
    parser.take(b"x" * (1 << 20))
    parser.take(b"x")
    with pytest.raises(ValueError, match="a line without end"):
        parser.take(b"x")


def test_who_does_not_stream_is_heard_in_the_end() -> None:
    server = Streams(refuses="unknown parameter: stream_options")
    answer, told = server.generate()
    assert told == [answer.text] == ["Six eggs."]
    assert ["stream" in body for body in server.bodies] == [True, False]
    model, _ = writing((200, reply("Six eggs.")))  # as if it had not been asked to
    told.clear()
    answer = model.generate(CONTEXTS[0], on_text=told.append)
    assert answer == Completion("Six eggs.", "stop", 0, 0)  # the server counted nothing
    assert told == ["Six eggs."]


DEEP = "data: " + "[" * 100_000 + "\n"


def test_a_stream_in_another_form_is_one_clear_line() -> None:
    for body in (streamed([1]), streamed({"choices": [{"delta": 3}]}), "data: {\n", DEEP):
        with pytest.raises(ModelError) as error:
            Streams(body).generate()
        assert "\n" not in str(error.value)
    with pytest.raises(ModelError, match="the model fell over"):
        Streams(
            streamed(
                piece("Six"),
                {"error": {"message": "the model fell over", "code": "insufficient_quota"}},
            )
        ).generate()


@pytest.mark.parametrize("text", ['{"item": "tea"}', "{}", "[]", "milk", "", "[" * 10**5])
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
    generator, sent = writing((500, refusal), (200, reply('{"item": "milk"}')))
    assert generator.generate(CONTEXTS[0], schema=SCHEMA).text == '{"item": "milk"}'
    assert [body["response_format"]["type"] for body in sent] == ["json_schema", "json_object"]
