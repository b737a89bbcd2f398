"""A model server over HTTP: what trouble leads to, what is sent where, and that keys never leak.

Answers come from `httpx2.MockTransport`; waits between attempts take no time.
"""

from __future__ import annotations

import json
import traceback
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from goalscope.base.types import InvalidInputError, ModelError
from goalscope.models.hf_tokenizer import chat_tokenizer
from goalscope.models.hub import pull
from goalscope.models.server import RETRIES, Server, understood

httpx2 = pytest.importorskip("httpx2", reason="models behind a server need goalscope[remote]")

URL = "http://models.test/v1"
KEY = "sk-verysecret0123456789"
SHELL = ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "NO_PROXY", "SSL_CERT_FILE", "SSL_CERT_DIR")
SOCKS, AWAY = f"socks5://user:{KEY}@127.0.0.1:9", "http://127.0.0.1:9"
ERRORS = json.loads(Path(__file__, "../recordings/openai_errors.json").resolve().read_text())


@pytest.fixture(autouse=True)
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """No key, no proxy, no waiting."""
    for name in ("GOALSCOPE_API_KEY", "OPENAI_API_KEY", *SHELL, *map(str.lower, SHELL)):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("time.sleep", lambda _: None)


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
    return httpx2.Response(status, json=body, headers=headers)


def asked(replay: Replay, address: str = URL + "#m") -> Server:
    return Server(address, transport=httpx2.MockTransport(replay))


def failure(server: Server) -> str:
    """The error of a request: one line that names the server and says what to do."""
    with pytest.raises(ModelError) as caught:
        server.post("completions", {"prompt": "x"})
    text = str(caught.value)
    assert "\n" not in text
    assert server.url in text
    assert text.endswith((".", "?"))
    return text


TEMPORARY = [answer(429), answer(500), answer(503), httpx2.ConnectError("refused")]


@pytest.mark.parametrize("trouble", TEMPORARY, ids=str)
def test_temporary_trouble_is_retried(trouble: httpx2.Response | Exception) -> None:
    replay = Replay(trouble, answer(200, {"ok": 1}))
    server = asked(replay)
    assert server.post("completions", {}) == {"ok": 1}
    assert (len(replay.requests), server.usage["requests"]) == (2, 1)


@pytest.mark.parametrize("trouble", TEMPORARY, ids=str)
def test_lasting_trouble_is_told_after_the_last_attempt(
    trouble: httpx2.Response | Exception,
) -> None:
    replay = Replay(trouble)
    failure(asked(replay))
    assert len(replay.requests) == 1 + RETRIES


@pytest.mark.parametrize(
    ("reply", "said"),
    [
        (answer(400, {"error": {"message": "context length"}}), "Shorten the text"),
        (answer(401), "Set GOALSCOPE_API_KEY"),
        (answer(403), "Set GOALSCOPE_API_KEY"),
        (answer(404, {"detail": "Not Found"}), "Check the address"),
        (httpx2.Response(200, text="<html>Welcome</html>"), "Is it a model server"),
        (answer(200, [1]), "Is it a model server"),
        (answer(200, {"error": {"message": "no such model"}}), "no such model"),
        (answer(302, location="http://other.test/"), "it points to http://other.test/ instead"),
        (httpx2.ReadTimeout("late"), "did not answer in time"),
        (httpx2.ConnectError("refused"), "Start it, or check the address"),
        (httpx2.ConnectError("[SSL: CERTIFICATE_VERIFY_FAILED] self-signed"), "in SSL_CERT_FILE"),
    ],
)
def test_an_error_says_what_to_do(reply: httpx2.Response | Exception, said: str) -> None:
    replay = Replay(reply)
    assert said in failure(asked(replay))


@pytest.mark.parametrize("error", ERRORS["errors"], ids=lambda error: error["name"])
def test_what_openai_says_is_told(error: dict[str, Any]) -> None:
    text = failure(asked(Replay(answer(error["status"], error["body"]))))
    assert f"HTTP {error['status']}" in text


@pytest.mark.parametrize(
    "address",
    [
        "host/v1",
        "ftp://host/v1",
        "http://",
        "http://host:0/v1",
        "http://host/v1?a=b",
        "http://[/v1",
    ],
)
def test_what_is_no_address_is_refused(address: str) -> None:
    with pytest.raises(InvalidInputError, match="is not the address of a model server"):
        Server(address)


def test_a_key_in_the_address_is_refused_and_not_shown() -> None:
    with pytest.raises(InvalidInputError, match="a key belongs in GOALSCOPE_API_KEY") as caught:
        Server(f"http://user:{KEY}@host/v1")
    assert KEY not in str(caught.value)


@pytest.mark.parametrize(
    ("address", "sent"),
    [("https://api.openai.com/v1#m", f"Bearer {KEY}"), (f"{URL}#m", "Bearer sk-other")],
)
def test_two_servers_get_a_key_each(
    monkeypatch: pytest.MonkeyPatch, address: str, sent: str
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", f" {KEY}\n")
    monkeypatch.setenv("GOALSCOPE_API_KEY", "sk-other")
    replay = Replay(answer(200, {}))
    asked(replay, address).post("completions", {})
    assert replay.requests[0].headers["Authorization"] == sent


def test_without_a_key_none_is_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    replay = Replay(answer(200, {}))
    asked(replay).post("/completion", {})
    assert "Authorization" not in replay.requests[0].headers
    assert str(replay.requests[0].url) == "http://models.test/completion"


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
    ],
)
def test_the_key_is_never_shown(
    monkeypatch: pytest.MonkeyPatch, reply: httpx2.Response | Exception
) -> None:
    monkeypatch.setenv("GOALSCOPE_API_KEY", KEY)
    replay = Replay(reply)
    server = asked(replay)
    with pytest.raises(ModelError) as caught:
        server.post("completions", {})
    shown = "".join(traceback.format_exception(caught.value)) + repr(caught.value)
    shown += repr(server) + repr(server.usage) + str(vars(server))
    assert KEY not in shown
    assert KEY[:9] not in shown
    assert {request.url.host for request in replay.requests} == {"models.test"}


@pytest.mark.parametrize("said", ["", "soon", "0", "-1", "nan", "inf"])
def test_patience_is_a_number_of_seconds(monkeypatch: pytest.MonkeyPatch, said: str) -> None:
    monkeypatch.setenv("GOALSCOPE_PATIENCE", said)
    with pytest.raises(InvalidInputError, match="GOALSCOPE_PATIENCE must be a number of seconds"):
        Server(URL)


def test_the_only_model_needs_no_name_and_one_of_several_does() -> None:
    one = asked(Replay(answer(200, {"data": [{"id": "a", "max_model_len": 512}]})), URL)
    assert (one.model, one.context_size) == ("a", 512)
    several = asked(Replay(answer(200, {"data": [{"id": "a"}, {"id": "b"}]})), URL)
    with pytest.raises(ModelError, match=rf"has these models: a, b. Choose one with {URL}#MODEL"):
        _ = several.model


def test_a_server_that_lists_no_models_is_asked_for_the_one_named() -> None:
    server = asked(Replay(answer(404, {})))
    assert (server.model, server.context_size) == ("m", 8192)


def test_the_fingerprint_does_not_change_by_itself() -> None:
    rows = [{"id": "m", "created": time, "root": "r"} for time in (1, 2)]
    one, other = (asked(Replay(answer(200, {"data": [row]}))).fingerprint for row in rows)
    assert one == other


def test_the_usage_counts_what_servers_tell() -> None:
    usage = {"prompt_tokens": 7, "completion_tokens": 2}
    server = asked(Replay(answer(200, {"usage": usage}), answer(200, {"usage": None})))
    for _ in range(2):
        server.post("completions", {})
    assert server.describe_usage() == "2 requests, 7 tokens read, 2 written"


def test_an_answer_of_an_unknown_form_is_one_line() -> None:
    with pytest.raises(ModelError, match=r"an unknown form \(KeyError: 'a'\)"), understood(URL):
        _ = {}["a"]


@pytest.fixture(scope="module")
def local_port() -> Iterator[int]:
    """The port of a server on this machine that lists one model."""

    class Lists(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = json.dumps({"data": [{"id": "m", "max_model_len": 512}]}).encode()
            self.send_response(200)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None: ...

    with ThreadingHTTPServer(("127.0.0.1", 0), Lists) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_port
        server.shutdown()


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "LOCALHOST", "0.0.0.0"])
@pytest.mark.parametrize(
    ("name", "proxy"),
    [
        ("ALL_PROXY", SOCKS),
        ("all_proxy", "socks5h://127.0.0.1:9"),
        ("HTTP_PROXY", AWAY),
        ("http_proxy", AWAY),
        ("HTTP_PROXY", "no proxy at all"),
    ],
)
def test_no_proxy_leads_to_this_machine(
    monkeypatch: pytest.MonkeyPatch, local_port: int, host: str, name: str, proxy: str
) -> None:
    monkeypatch.setenv(name, proxy)
    if name == "HTTP_PROXY":
        monkeypatch.setenv("no_proxy", "example.org")
    server = Server(f"http://{host}:{local_port}/v1")
    assert server.context_size == 512
    server.close()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("ALL_PROXY", SOCKS),
        ("https_proxy", f"socks4://user:{KEY}@127.0.0.1:9"),
        ("HTTPS_PROXY", f"http://user:{KEY}@127.0.0.1:x"),
        ("HTTP_PROXY", f"ftp://user:{KEY}@127.0.0.1:9"),
        ("SSL_CERT_FILE", "/none/certificates.pem"),
        ("SSL_CERT_FILE", __file__),
        ("SSL_CERT_FILE", str(Path(__file__).parent)),
    ],
)
@pytest.mark.parametrize(
    "use",
    [
        lambda: Server("https://models.test/v1"),
        lambda: pull("owner/one"),
        lambda: chat_tokenizer("owner/one"),
    ],
    ids=["server", "pull", "tokenizer"],
)
def test_a_variable_of_the_shell_that_cannot_be_followed_is_named(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    use: Callable[[], object],
    name: str,
    value: str,
) -> None:
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path))
    monkeypatch.setenv("SSL_CERT_DIR", str(tmp_path))  # counts for nothing beside a file
    monkeypatch.setenv(name, value)
    with pytest.raises(ModelError, match=rf"^{name} .*Correct it") as caught:
        use()
    text = str(caught.value)
    assert "\n" not in text
    assert KEY not in text


def test_an_unreadable_certificate_is_named_for_a_server_of_this_machine_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("SSL_CERT_FILE", "/none/certificates.pem")
    with pytest.raises(ModelError, match=r"^SSL_CERT_FILE "):
        Server("https://127.0.0.1:9/v1")


def test_who_asks_a_far_server_through_a_proxy_that_is_away_is_told_of_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("HTTP_PROXY", f"http://user:{KEY}@127.0.0.1:9")
    told = failure(Server(f"{URL}#m"))
    assert "HTTP_PROXY" in told
    assert "NO_PROXY" in told
    assert KEY not in told
    monkeypatch.delenv("HTTP_PROXY")
    assert "NO_PROXY" not in failure(Server("http://127.0.0.1:9/v1#m"))
