"""A model server over HTTP: what trouble leads to, what is sent where, and how long it may take.

Answers come from `httpx2.MockTransport`, or from sockets of 127.0.0.1 where a real one matters.
Waits between attempts pass on a clock that the tests set, except where time itself is tested.
"""

from __future__ import annotations

import email.utils
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from goalscope.base.types import ModelError
from goalscope.models.served.client import ATTEMPTS, Refusal, Server, understood

httpx2 = pytest.importorskip("httpx2", reason="models behind a server need goalscope[remote]")

URL = "http://models.test/v1"
KEY = "sk-verysecret0123456789"
ERRORS = json.loads(Path(__file__, "../recordings/openai_errors.json").resolve().read_text())
Behaviour = Callable[[socket.socket, threading.Event], None]


@pytest.fixture(autouse=True)
def no_key(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("GOALSCOPE_API_KEY", "OPENAI_API_KEY", "HTTP_PROXY", "http_proxy", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def naps(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The waits between attempts; they pass on the clock alone."""
    slept: list[float] = []
    clock = time.monotonic
    monkeypatch.setattr(time, "sleep", slept.append)
    monkeypatch.setattr(time, "monotonic", lambda: clock() + sum(slept))
    return slept


class Replay:
    """Answers in turn, the last one again and again, and keeps the requests."""

    def __init__(self, *answers: httpx2.Response | Exception) -> None:
        self.answers = list(answers)
        self.requests: list[httpx2.Request] = []

    def __call__(self, request: httpx2.Request) -> httpx2.Response:
        self.requests.append(request)
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if isinstance(answer, Exception):
            raise answer
        return httpx2.Response(answer.status_code, headers=answer.headers, content=answer.content)


def answer(status: int = 200, body: Any = None, **headers: str) -> httpx2.Response:
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    return httpx2.Response(status, json=body, headers=named)


def asked(replay: Replay, address: str = URL + "#m", **settings: float) -> Server:
    return Server(address, transport=httpx2.MockTransport(replay), **settings)


def failure(server: Server) -> str:
    """The error of a request: one line that names the server and says what to do."""
    with pytest.raises(ModelError) as caught:
        server.post("completions", {"prompt": "x"})
    text = str(caught.value)
    assert "\n" not in text
    assert server.url in text
    assert text.endswith((".", "?"))
    return text


@contextmanager
def listening(behave: Behaviour) -> Iterator[str]:
    """The address of a socket that does as it is told with each connection."""
    stop = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as door:

        def serve() -> None:
            while not stop.is_set():
                try:
                    connection, _ = door.accept()
                except OSError:
                    return
                with connection:
                    connection.settimeout(5)
                    connection.recv(65536)
                    with suppress(OSError):
                        behave(connection, stop)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield f"http://127.0.0.1:{door.getsockname()[1]}/v1#m"
        finally:
            stop.set()
            door.shutdown(socket.SHUT_RDWR)
            thread.join()


# Trouble that may pass


@pytest.mark.parametrize("status", [408, 429, 500, 502, 503, 504, 529])
def test_trouble_that_passes_is_only_counted(naps: list[float], status: int) -> None:
    replay = Replay(answer(status, {"error": {"message": "busy"}}), answer(200, {"ok": 1}))
    server = asked(replay)
    assert server.post("completions", {}) == {"ok": 1}
    assert (server.usage.requests, server.usage.retries) == (2, 1)
    assert naps == [0.5]


def test_trouble_that_stays_is_met_five_times_and_waits_grow(naps: list[float]) -> None:
    replay = Replay(answer(503, {"error": {"message": "The engine is overloaded"}}))
    server = asked(replay)
    text = failure(server)
    assert "503" in text
    assert "The engine is overloaded" in text
    assert "5 times" in text
    assert len(replay.requests) == server.usage.requests == ATTEMPTS == 5
    assert server.usage.retries == 4
    assert naps == [0.5, 1, 2, 4]


@pytest.mark.parametrize(
    ("headers", "wait"),
    [
        ({"retry_after": "3"}, 3.0),
        ({"retry_after": "0.25"}, 0.25),
        ({"retry_after_ms": "644", "retry_after": "1"}, 0.644),
        ({"retry_after_ms": "soon", "retry_after": "2"}, 2.0),
        ({"retry_after": "0"}, 0.0),
        ({"retry_after": "-7"}, 0.0),
        ({"retry_after": "nan"}, 0.0),
        ({"retry_after": "Thu, 01 Jan 1970 00:00:00 GMT"}, 0.0),
        ({"retry_after": "soon"}, 0.5),
        ({"retry_after": "Fri, 31 Dec 99999999999999999999 23:59:59 GMT"}, 0.5),
        ({}, 0.5),
    ],
)
def test_the_server_says_how_long_to_wait(
    naps: list[float], headers: dict[str, str], wait: float
) -> None:
    limit = ERRORS["errors"][0]["body"]
    server = asked(Replay(answer(429, limit, **headers), answer(200, {})))
    assert server.post("completions", {}) == {}
    assert naps == [wait]


def test_the_server_may_say_until_when_to_wait(naps: list[float]) -> None:
    date = email.utils.formatdate(time.time() + 20, usegmt=True)
    server = asked(Replay(answer(429, {}, retry_after=date), answer(200, {})))
    server.post("completions", {})
    assert naps == [pytest.approx(20, abs=2)]


@pytest.mark.parametrize("wait", ["86400", "inf", "1e300", "Fri, 31 Dec 2100 23:59:59 GMT"])
def test_nobody_waits_longer_than_patience(naps: list[float], wait: str) -> None:
    replay = Replay(answer(429, {"error": {"message": "slow down"}}, retry_after=wait))
    text = failure(asked(replay))
    assert "asks to wait" in text
    assert "slow down" in text
    assert naps == []
    assert len(replay.requests) == 1


def test_all_waits_together_stay_within_patience(naps: list[float]) -> None:
    replay = Replay(answer(429, {}, retry_after="50"))
    failure(asked(replay, patience=120))
    assert naps == [50, 50]
    assert len(replay.requests) == 3


@pytest.mark.parametrize("code", ERRORS["billing_codes"])
@pytest.mark.parametrize("place", ["code", "type"])
def test_a_spent_quota_is_asked_once(naps: list[float], code: str, place: str) -> None:
    body = {"error": {"message": "You exceeded your current quota.", place: code}}
    replay = Replay(answer(429, body, retry_after="1"))
    text = failure(asked(replay))
    assert "quota" in text
    assert "You exceeded" in text
    assert len(replay.requests) == 1
    assert naps == []


@pytest.mark.parametrize("error", ERRORS["errors"], ids=lambda error: error["name"])
def test_openais_errors_are_clear_and_final_ones_asked_once(
    naps: list[float], error: dict[str, Any]
) -> None:
    passing = {"rate-limit-tokens", "rate-limit-requests", "overloaded"}
    replay = Replay(answer(error["status"], error["body"], **error.get("headers", {})))
    text = failure(asked(replay))
    assert (len(replay.requests) > 1) == (error["name"] in passing)
    if error["status"] != 401:
        assert error["body"]["error"]["message"][:60] in text


def test_no_server_is_a_clear_error(naps: list[float]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as door:
        port = door.getsockname()[1]
    server = Server(f"http://127.0.0.1:{port}/v1#m")
    assert "No server answers" in failure(server)
    assert server.usage.requests == ATTEMPTS
    server.close()


def trickle(start: bytes) -> Behaviour:
    """A byte now and then after a start; without one, nothing at all."""

    def behave(connection: socket.socket, stop: threading.Event) -> None:
        connection.sendall(start)
        while not stop.wait(0.02):
            connection.sendall(b"1" if start else b"")

    return behave


@pytest.mark.parametrize(
    "start",
    [
        pytest.param(b"HTTP/1.1 200 OK\r\nContent-Length: 99999\r\n\r\n", id="body"),
        pytest.param(b"HTTP/1.1 200 OK\r\nX-Long: ", id="headers"),
        pytest.param(b"", id="silence"),
    ],
)
def test_neither_silence_nor_a_byte_now_and_then_holds_anyone_for_ever(start: bytes) -> None:
    with listening(trickle(start)) as address:
        server = Server(address, timeout=0.3, patience=0.5)
        begun = time.monotonic()
        assert "did not answer in time" in failure(server)
        assert 0.3 <= time.monotonic() - begun < 5
        server.close()


def test_the_connection_of_an_answer_that_is_left_alone_is_closed() -> None:
    closed = threading.Event()

    def behave(connection: socket.socket, stop: threading.Event) -> None:
        try:
            trickle(b"HTTP/1.1 200 OK\r\nContent-Length: 99999\r\n\r\n")(connection, stop)
        except OSError:
            closed.set()

    with listening(behave) as address:
        server = Server(address, patience=0.5)
        assert "did not answer in time" in failure(server)
        assert closed.wait(5)
        server.close()


@pytest.mark.parametrize(
    "sent",
    [
        b"",
        b'HTTP/1.1 200 OK\r\nContent-Length: 500\r\n\r\n{"choices": [',
        b'HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n5\r\n{"a":\r\n',
        b"HTTP/1.1 200 OK\r\nContent-Encoding: gzip\r\nContent-Length: 3\r\n\r\nabc",
        b"SSH-2.0-OpenSSH_9.2\r\n",
    ],
    ids=["nothing", "length", "chunked", "no gzip", "no HTTP"],
)
def test_a_cut_answer_is_asked_for_again(naps: list[float], sent: bytes) -> None:
    with listening(lambda connection, _: connection.sendall(sent)) as address:
        server = Server(address)
        assert "closed the connection" in failure(server)
        assert server.usage.requests == ATTEMPTS
        server.close()


# Answers that are not what was asked for


@pytest.mark.parametrize("content", [b"", b"<html>", b"{", b"null", b"\xff", b"[" * 10**6])
def test_no_json_is_asked_for_again(naps: list[float], content: bytes) -> None:
    replay = Replay(httpx2.Response(200, content=content))
    assert "sent no JSON" in failure(asked(replay))
    assert len(replay.requests) == ATTEMPTS


def test_a_huge_answer_is_cut_short(naps: list[float], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("goalscope.models.served.client._LARGEST", 1 << 20)
    sent = []

    def endless() -> Iterator[bytes]:
        while True:
            sent.append(1)
            yield b" " * 65536

    transport = httpx2.MockTransport(lambda _: httpx2.Response(200, content=endless()))
    assert "more than 1 MB" in failure(Server(URL + "#m", transport=transport))
    assert len(sent) <= 17


@pytest.mark.parametrize("error", ["quota is spent", {"message": "quota is spent"}])
def test_an_error_that_comes_as_a_success_is_an_error(error: object) -> None:
    replay = Replay(answer(200, {"error": error}))
    assert "quota is spent" in failure(asked(replay))
    assert len(replay.requests) == 1


@pytest.mark.parametrize(
    "body",
    [
        {"error": "Unauthorized thing"},
        {"error": {"message": "Unauthorized thing", "code": 400}},
        {"detail": "Unauthorized thing"},
        {"message": "Unauthorized thing"},
        "Unauthorized thing",
        [{"a": "Unauthorized thing"}],
        {"error": {"message": "Unauthorized\n\x1b[31mthing"}},
        {"error": "Unauthorized thing" + " long" * 10**6},
    ],
    ids=range(8),
)
def test_what_a_server_said_is_told_in_one_short_line(body: object) -> None:
    text = failure(asked(Replay(answer(400, body))))
    assert len(text) < 600
    assert "Unauthorized" in text
    assert "thing" in text
    assert text.isprintable()


def test_a_text_beyond_the_context_is_refused_once() -> None:
    body = {"error": {"message": "This model's maximum context length is 9 tokens", "code": 400}}
    replay = Replay(answer(400, body))
    text = failure(asked(replay))
    assert "maximum context length is 9" in text
    assert "Shorten" in text
    assert len(replay.requests) == 1


def test_a_wrong_path_says_what_to_check() -> None:
    text = failure(asked(Replay(answer(404, {"detail": "Not Found"}))))
    assert "Not Found" in text
    assert "/v1" in text


def test_refusals_keep_their_status() -> None:
    with pytest.raises(Refusal) as caught:
        asked(Replay(answer(418, {}))).post("completions", {})
    assert caught.value.status == 418


@pytest.mark.parametrize(
    "read",
    [
        lambda: {}["choices"],
        lambda: [][0],
        lambda: float("x\ny"),
        lambda: int(float("inf")),
        lambda: {"a": None}["a"][0],
        lambda: (1).get,  # type: ignore[attr-defined]
    ],
)
def test_a_form_that_is_not_known_is_one_line(read: Callable[[], object]) -> None:
    with pytest.raises(ModelError, match="an unknown form") as caught, understood(URL):
        read()
    assert URL in str(caught.value)
    assert "\n" not in str(caught.value)


def test_usage_adds_up_and_ignores_what_is_no_number() -> None:
    usage = {"prompt_tokens": 7, "completion_tokens": 2}
    odd = {"prompt_tokens": "x", "completion_tokens": None}
    server = asked(Replay(*(answer(200, {"usage": each}) for each in (usage, odd, 3, usage))))
    for _ in range(4):
        server.post("completions", {})
    assert (server.usage.prompt_tokens, server.usage.completion_tokens) == (14, 4)
    assert str(server.usage).startswith("4 requests (0 of them retries), 14 tokens read")


# Models


@pytest.mark.parametrize(
    ("data", "said"),
    [([], "none"), ([{"id": "a"}, {"id": "b"}], "a, b"), ([{}], "none"), (None, "none")],
)
def test_several_models_or_none_ask_for_a_name(data: object, said: str) -> None:
    server = asked(Replay(answer(200, {"data": data})), URL)
    with pytest.raises(ModelError, match=f"these models: {said}.*#MODEL"):
        _ = server.model


@pytest.mark.parametrize("body", [[], 3, "x", {"data": 3}, {"data": [1]}, {"data": {"id": "m"}}])
def test_a_list_of_models_in_another_form_is_an_error(body: object) -> None:
    server = asked(Replay(answer(200, body)), URL)
    with pytest.raises(ModelError, match="an unknown form"):
        _ = server.model


def test_the_only_model_needs_no_name_and_is_asked_for_once() -> None:
    replay = Replay(answer(200, {"data": [{"id": "m", "max_model_len": 9}]}))
    server = asked(replay, URL)
    assert (server.model, server.model, server.facts["max_model_len"]) == ("m", "m", 9)
    assert [str(request.url) for request in replay.requests] == [URL + "/models"]


def test_a_server_without_a_list_is_asked_by_the_given_name() -> None:
    assert dict(asked(Replay(answer(404, {}))).facts) == {"id": "m"}
