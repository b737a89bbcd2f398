"""Nobody comes to what is another's, or to what is not served, by any address of the server."""

from __future__ import annotations

import asyncio
import http.client
import re
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi.routing import APIRoute

from fakes import WordModel
from goalscope.storage.store import Store
from goalscope.web.app import create_app
from goalscope.web.guard import Guard
from sites import ENTERED, KEY, WRITES, Person, site

CANARY = re.compile(r"canary\d{3}x")
CHANGES = {"POST", "PUT", "PATCH", "DELETE"}


class Watching(WordModel):
    """Names in what it writes the people whom it reads of, and keeps which stood side by side."""

    def __init__(self) -> None:
        super().__init__(WRITES)
        self.met: list[set[str]] = []

    def generate(self, messages, **settings):
        named = {*CANARY.findall(str(messages))}
        self.met.append(named)
        names = " ".join(sorted(named))
        self.replies = {
            mark: "\n".join(f"{line} {names}" for line in text.split("\n"))
            for mark, text in WRITES.items()
        }
        return super().generate(messages, **settings)

    def token_logprobs(self, contexts, continuations):
        self.met.append({*CANARY.findall(f"{contexts} {continuations}")})
        return super().token_logprobs(contexts, continuations)


@pytest.mark.parametrize("count", [8, pytest.param(100, marks=pytest.mark.slow)])
def test_nobody_reads_the_words_of_another(
    count: int, tmp_path: Path, figure: Callable[[str], None]
) -> None:
    model, together = Watching(), threading.Barrier(count)

    def chat(number: int) -> tuple[str, str, list[str]]:
        """The person's canary, their episode, and everything that was told to them."""
        canary, told = f"canary{number:03}x", []
        person = Person(address, verify=False)
        person.patience = person.http.timeout = 900
        mine = person.begin()
        together.wait(120)
        for word in "flour", "milk":
            told.append(str(person.say(mine, f"I am {canary} and need {word}.")))
        told.append(str(person.post(f"{mine}/corrections", kind="pin", goal=f"feed {canary}")))
        goal = person.live(mine)["belief"]["goals"][0]["text"]
        told.append(str(person.get(f"{mine}/why", goal=goal)))
        told.append(str(next(person.events(mine))))
        told.append(person.http.get(f"{mine}/export.json").text)
        told.append(str(person.get(mine)))
        assert all(canary in each for each in told)
        person.http.close()
        return canary, mine.rpartition("/")[2], told

    with site(tmp_path / "episodes.db", model) as address, ThreadPoolExecutor(count) as pool:
        people = list(pool.map(chat, range(count)))
    with Store.open(tmp_path / "episodes.db") as store:
        stored = {id: f"{store.episode(id)} {store.rounds(id)}" for _, id, _ in people}
    for canary, id, told in people:
        for text in (*told, stored[id]):
            assert {*CANARY.findall(text)} <= {canary}
    assert len(stored) == count
    assert max(map(len, model.met)) == 1
    assert {*map(frozenset, model.met)} >= {frozenset([canary]) for canary, _, _ in people}
    figure(
        f"{count} chats at once, {sum(len(told) for _, _, told in people):,} answers and exports, "
        f"{len(model.met):,} prompts, {count} stored episodes: 0 words of another",
    )


@pytest.fixture
def app(tmp_path: Path) -> Iterator[Any]:
    with Store.open(tmp_path / "episodes.db") as store:
        yield create_app(store, WordModel(WRITES))


def endpoints(app: Any) -> list[tuple[str, str]]:
    """Every method and path that there is, so that a new one is tried, too."""

    def routes(router: Any) -> Iterator[APIRoute]:
        for route in router.routes:
            if isinstance(route, APIRoute):
                yield route
            elif inner := getattr(route, "original_router", None):
                yield from routes(inner)

    found = [(method, each.path) for each in routes(app.router) for method in each.methods]
    assert {path for _, path in found} >= set(app.openapi()["paths"])
    return sorted(found)


HOST = "goalscope.test:8000"
OWN, EVIL = f"http://{HOST}", "http://evil.example"
BEARER = ("authorization", f"Bearer {KEY}")
COOKIE = ("cookie", "; ".join(f"{name}={value}" for name, value in ENTERED.items()))
FORGED = {
    "foreign": [("host", HOST), ("origin", EVIL), COOKIE],
    "foreign with key": [("host", HOST), ("origin", EVIL), BEARER],
    "null": [("host", HOST), ("origin", "null"), COOKIE],
    "empty": [("host", HOST), ("origin", ""), COOKIE],
    "duplicate": [("host", HOST), ("origin", OWN), ("origin", EVIL), COOKIE],
    "duplicate, foreign first": [("host", HOST), ("origin", EVIL), ("origin", OWN), COOKIE],
    "two in one": [("host", HOST), ("origin", f"{OWN}, {EVIL}"), COOKIE],
    "absent": [("host", HOST), COOKIE],
    "absent at a tunnel": [("host", "localhost:9000"), COOKIE],
    "absent with cookie and key": [("host", HOST), COOKIE, BEARER],
    "referer alone": [("host", HOST), ("referer", OWN + "/"), COOKIE],
    "of another port": [("host", HOST), ("origin", "http://goalscope.test:9000"), COOKIE],
    "of another scheme": [("host", HOST), ("origin", OWN.replace("http", "https")), COOKIE],
    "of a name that begins alike": [("host", HOST), ("origin", OWN + ".evil.example"), COOKIE],
    "rebound host": [("host", "evil.example"), ("origin", EVIL), COOKIE],
    "rebound host with key": [("host", "evil.example:8000"), BEARER],
    "host without port": [("host", "goalscope.test"), ("origin", "http://goalscope.test"), COOKIE],
    "of another local server": [
        ("host", "localhost:8000"),
        ("origin", "http://localhost:1"),
        COOKIE,
    ],
    "of the page of another name": [("host", "localhost:8000"), ("origin", OWN), COOKIE],
    "forwarded of another scheme": [
        ("host", HOST),
        ("x-forwarded-proto", "http, https"),
        ("origin", OWN.replace("http", "https")),
        COOKIE,
    ],
    **{
        f"rebound {each}": [("host", each), ("origin", f"http://{each}"), COOKIE]
        for each in (
            "localhost.evil.example:8000",
            "127.0.0.1.evil.example",
            "evil.localhost",
            "xlocalhost",
            "localhost:8000.evil.example",
            "localhost@evil.example",
            "evil.example@localhost:8000",
            "localhost:8000, evil.example",
            "localhost#.evil.example",
            "localhost:",
            "localhost:8000:1",
            "127.evil.example",
            "127.0.0.evil",
            "127.0.0.1:x",
            "[::1].evil.example",
            "[::1]evil:80",
            "local.host",
            "localhost.",
            "localhost:123456",
            " localhost",
            "128.0.0.1",
            "0.0.0.0:8000",
        )
    },
    "two hosts": [("host", HOST), ("host", "evil.example"), ("origin", OWN), COOKIE],
    "no host": [("origin", OWN), COOKIE],
    "forwarded host": [
        ("host", "evil.example"),
        ("x-forwarded-host", HOST),
        ("origin", OWN),
        COOKIE,
    ],
}


def test_no_change_is_taken_from_elsewhere(app: Any, figure: Callable[[str], None]) -> None:
    guard = Guard(app, hosts=[HOST], key=KEY)
    changes = [each for each in endpoints(app) if each[0] in CHANGES]

    async def asked(method: str, path: str, headers: list[tuple[str, str]]) -> int:
        """The status; the headers are sent as they are, as no browser's library would."""
        scope = {
            "type": "http", "method": method, "path": path, "raw_path": path.encode(),
            "query_string": b"", "scheme": "http", "client": ("192.0.2.1", 1), "server": (HOST, 0),
            "headers": [(name.encode(), value.encode()) for name, value in headers],
            "http_version": "1.1", "root_path": "",
        }  # fmt: skip
        sent: list[Any] = []

        async def receive() -> dict[str, Any]:
            return {"type": "http.request", "body": b"{}"}

        async def send(message: Any) -> None:
            sent.append(message)

        await guard(scope, receive, send)
        return sent[0]["status"]

    refused = 0
    for method, template in changes:
        path = re.sub(r"\{\w+\}", "1", template)
        own = [("host", HOST), ("origin", OWN), COOKIE]
        assert asyncio.run(asked(method, path, own)) not in (401, 403)
        for name, headers in FORGED.items():
            assert asyncio.run(asked(method, path, headers)) == 403, (method, path, name)
            refused += 1
    assert len(changes) >= 11
    told = f"{len(changes)} ways to change something, {len(FORGED)} forgeries of each: {refused} of"
    figure(f"{told} {refused} refused")


def test_no_websocket_is_opened(app: Any) -> None:
    sent: list[Any] = []

    async def send(message: Any) -> None:
        sent.append(message)

    headers = [(b"host", HOST.encode()), (b"origin", OWN.encode())]
    scope = {"type": "websocket", "path": "/", "headers": headers, "query_string": b""}
    asyncio.run(Guard(app, hosts=[HOST], key=KEY)(scope, None, send))  # type: ignore[arg-type]
    assert sent == [{"type": "websocket.close", "code": 1008}]


OUT = ["../" * depth + "etc/passwd" for depth in (1, 2, 3, 5, 8, 13)]
NAMES = [
    *OUT,
    *(each.replace("../", "..%2f") for each in OUT),
    *(each.replace("../", "%2e%2e/") for each in OUT),
    *(each.replace("../", "%2e%2e%2f") for each in OUT),
    *(each.replace("../", "%252e%252e%252f") for each in OUT),
    *(each.replace("../", "..%5c") for each in OUT),
    *(each.replace("../", "..\\") for each in OUT),
    *(each.replace("../", "....//") for each in OUT),
    *(each.replace("../", "..;/") for each in OUT),
    *(each.replace("../", "..%c0%af") for each in OUT),
    *(each.replace("../", "%ef%bc%8e%ef%bc%8e/") for each in OUT),
    "/etc/passwd", "//etc/passwd", "%2fetc%2fpasswd", "%2f%2fetc/passwd", "file:///etc/passwd",
    "C:\\Windows\\win.ini", "C:%5cWindows%5cwin.ini", "%5c%5chost%5cshare%5cx",
    "CON", "app.js::$DATA",    "%00", "app.js%00", "app.js%00.css", "../app.py",
    "..%2fapp.py", "%2e%2e/guard.py", ".", "..",
    "%2e", "%2e%2e", "~root", "%7eroot/.profile", "app.js/../../app.py", "app.js/..%2f..%2fapp.py",
]  # fmt: skip
PLACES = (
    "/static/{}", "/{}", "/study/{}", "/api/studies/{}", "/api/studies/{}/items/1",
    "/api/episodes/{}", "/api/episodes/{}/export.json", "/api/episodes/1/export.{}",
    "/api/episodes/{}/picture.svg?round=0", "/api/episodes?text={}",
)  # fmt: skip


def test_no_address_leads_out_of_what_is_served(
    address: str, visit, figure: Callable[[str], None]
) -> None:
    inside = [visit(address).http.get(path).text for path in ("/static/app.js", "/")]

    def ask(place: str) -> int:
        """Ask for all names at a place, as they are: no browser would send them so."""
        connection = http.client.HTTPConnection(address.removeprefix("http://"), timeout=60)
        for name in NAMES:
            path = place.format(name).replace("\\", "%5C" if "?" in place else "\\")
            connection.putrequest("GET", path, skip_accept_encoding=True)
            connection.putheader("authorization", f"Bearer {KEY}")
            connection.endheaders()
            answer = connection.getresponse()
            text = answer.read().decode(errors="replace")
            if answer.status == 200 and not place.startswith("/api/episodes?"):
                assert text in inside, path  # a name for the page itself
            assert not re.search(r"root:|\[fonts\]|import annotations", text), path
            assert answer.status < 500, path
        connection.close()
        return len(NAMES)

    with ThreadPoolExecutor(len(PLACES)) as pool:
        tried = sum(pool.map(ask, PLACES))
    figure(f"{tried:,} addresses: 0 reads outside of what is served")


def test_no_scene_of_a_request_is_a_file(address: str) -> None:
    program = {"authorization": f"Bearer {KEY}"}
    with httpx.Client(base_url=address, headers=program) as http:
        for name in [
            *NAMES,
            "\0",
            "a\0.json",
            "/proc/self/environ",
            "Kitchen1/../x.json",
            "x" * 9000,
        ]:
            body = {"domain": "house", "scene": name}
            http.cookies.clear()
            answer = http.post("/api/episodes", json=body)
            assert answer.status_code == 400, name
            assert "There is no scene" in answer.json()["error"]
