"""A model server's address and its key: what is sent where, and what nobody is shown."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest

from goalscope.base.types import InvalidInputError, ModelError
from goalscope.models.served.client import Server
from test_http import KEY, URL, Replay, answer, asked, failure, naps, no_key  # noqa: F401

httpx2 = pytest.importorskip("httpx2", reason="models behind a server need goalscope[remote]")


@pytest.mark.parametrize(
    "address",
    [
        "",
        "ftp://a/v1",
        "http://",
        "http:///v1",
        "http://[::1/v1",
        "http://a:b/v1",
        "http://a:99999/v1",
        "http://a/v1?key=1",
        "http://me:hunter2@a/v1",
        "https://api.openai.com@evil.test/v1",
    ],
)
def test_what_is_no_address_is_refused(address: str) -> None:
    with pytest.raises(InvalidInputError, match="not the address of a model server") as caught:
        Server(address)
    assert "hunter2" not in str(caught.value)


@pytest.mark.parametrize("name", ["GOALSCOPE_API_KEY", "OPENAI_API_KEY"])
@pytest.mark.parametrize(
    "address",
    [
        URL,
        "https://api.openai.com/v1",
        "http://api.openai.com/v1",
        "https://api.openai.com.evil.test/v1",
        "https://evil.test/api.openai.com/v1",
        "https://api.openai.com:444/v1",
    ],
)
def test_openais_key_goes_to_openai_alone(
    monkeypatch: pytest.MonkeyPatch, name: str, address: str
) -> None:
    monkeypatch.setenv(name, KEY)
    replay = Replay(answer(200, {}))
    server = asked(replay, address + "#m")
    for path in ("completions", "/generate"):
        server.post(path, {})
    sent = [KEY in str(request.headers.raw) for request in replay.requests]
    own = name == "GOALSCOPE_API_KEY"
    assert sent == [own or address == "https://api.openai.com/v1"] * 2


@pytest.mark.parametrize(
    ("address", "key"), [("https://api.openai.com/v1#m", KEY), (f"{URL}#m", "sk-other")]
)
def test_two_servers_get_a_key_each(
    monkeypatch: pytest.MonkeyPatch, address: str, key: str
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", f" {KEY}\n")
    monkeypatch.setenv("GOALSCOPE_API_KEY", "sk-other")
    replay = Replay(answer(200, {}))
    asked(replay, address).post("completions", {})
    assert replay.requests[0].headers["Authorization"] == f"Bearer {key}"


@pytest.mark.parametrize("said", ["", "soon", "0", "-1", "nan", "inf"])
def test_patience_is_a_number_of_seconds(monkeypatch: pytest.MonkeyPatch, said: str) -> None:
    monkeypatch.setenv("GOALSCOPE_PATIENCE", said)
    with pytest.raises(InvalidInputError, match="GOALSCOPE_PATIENCE must be a number of seconds"):
        Server(URL)


@pytest.mark.parametrize("key", [KEY + "\nX-Other: 1", KEY + "\u00e9"])
def test_a_broken_key_is_refused_and_not_shown(monkeypatch: pytest.MonkeyPatch, key: str) -> None:
    monkeypatch.setenv("GOALSCOPE_API_KEY", key)
    with pytest.raises(InvalidInputError, match="GOALSCOPE_API_KEY") as caught:
        Server(URL)
    assert KEY not in "".join(traceback.format_exception(caught.value))


@pytest.mark.parametrize(
    "reply",
    [
        answer(401, {"error": {"message": f"Incorrect API key provided: {KEY[:9]}. {KEY}"}}),
        answer(400, {"error": {"message": f"What is {KEY}?"}}),
        httpx2.Response(200, text=KEY),
        answer(503, {"error": KEY}),
        answer(302, {}, location=f"http://other.test/?key={KEY}"),
        httpx2.ConnectError(f"no {KEY}"),
        httpx2.RemoteProtocolError(f"no {KEY}"),
    ],
)
def test_the_key_is_never_shown(
    naps: list[float],  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
    reply: httpx2.Response | Exception,
) -> None:
    monkeypatch.setenv("GOALSCOPE_API_KEY", KEY)
    server = asked(Replay(reply))
    with pytest.raises(ModelError) as caught:
        server.post("completions", {})
    shown = "".join(traceback.format_exception(caught.value)) + repr(caught.value)
    shown += repr(server) + repr(server.usage) + str(vars(server))
    assert KEY not in shown
    assert KEY[:9] not in shown


def test_a_wrong_key_says_what_to_set() -> None:
    replay = Replay(answer(401, {"error": "Unauthorized"}))
    assert "Set GOALSCOPE_API_KEY" in failure(asked(replay))
    assert len(replay.requests) == 1


class Quiet(BaseHTTPRequestHandler):
    """HTTP/1.1 with kept connections; remembers who asked for what."""

    protocol_version = "HTTP/1.1"

    def do_POST(self) -> None:
        self.server.seen.append((self.client_address, self.headers.get("Authorization")))  # type: ignore[attr-defined]
        self.rfile.read(int(self.headers["Content-Length"]))
        target = self.server.target  # type: ignore[attr-defined]
        self.send_response(307 if target else 200)
        if target:
            self.send_header("Location", target)
        self.send_header("Content-Length", "2")
        self.end_headers()
        self.wfile.write(b"{}")

    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def serving(target: str = "") -> Iterator[tuple[str, list[tuple[Any, str | None]]]]:
    with ThreadingHTTPServer(("127.0.0.1", 0), Quiet) as http:
        http.target, http.seen = target, []  # type: ignore[attr-defined]
        http.daemon_threads = True
        thread = threading.Thread(target=http.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield f"http://127.0.0.1:{http.server_port}/v1", http.seen  # type: ignore[attr-defined]
        finally:
            http.shutdown()
            thread.join()


def test_a_redirect_is_told_and_the_key_goes_nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GOALSCOPE_API_KEY", KEY)
    with serving() as (elsewhere, reached), serving(elsewhere) as (address, asked_here):
        server = Server(address + "#m")
        text = failure(server)
        assert "307" in text
        assert elsewhere in text
        assert asked_here[0][1] == f"Bearer {KEY}"
        assert reached == []
        server.close()


def test_one_connection_serves_all_requests() -> None:
    with serving() as (address, seen):
        server = Server(address + "#m")
        for path in ("completions", "/generate", "completions"):
            server.post(path, {})
        server.close()
    assert len(seen) == 3
    assert len({client for client, _ in seen}) == 1
