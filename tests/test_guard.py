"""Who may ask for what."""

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from sites import KEY, site

PASSWORD = "what-visitors-show"


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with site(tmp_path_factory.mktemp("guard") / "episodes.db") as running:
        yield running


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": ""},
        {},
        {"origin": "https://{host}"},
        {"origin": "http://{host}.evil.example"},
        {"origin": "http://localhost:{port}"},
        {"origin": "http://{host}", "host": "evil.example"},
        {"origin": "http://evil.example", "host": "evil.example"},
        {"authorization": "Bearer wrong"},
        {"authorization": f"Bearer {KEY}", "origin": "http://evil.example"},
        {"authorization": f"Bearer {KEY}", "cookie": "goalscope_visitor=somebody"},
    ],
)
@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("POST", "/api/episodes"),
        ("POST", "/api/episodes/0/utterances"),
        ("POST", "/api/episodes/0/corrections"),
        ("DELETE", "/api/episodes/0/corrections"),
    ],
)
def test_a_change_comes_from_the_servers_own_page(
    address: str, method: str, path: str, headers: dict[str, str]
) -> None:
    host = address.removeprefix("http://")
    port = host.partition(":")[2]
    sent = {name: value.format(host=host, port=port) for name, value in headers.items()}
    assert httpx.request(method, address + path, json={}, headers=sent).status_code == 403


def test_two_origins_are_none(address: str) -> None:
    headers = [("origin", address), ("origin", "http://evil.example")]
    assert httpx.post(f"{address}/api/episodes", json={}, headers=headers).status_code == 403


def test_a_program_with_the_key_needs_no_origin(address: str) -> None:
    headers = {"authorization": f"Bearer {KEY}"}
    assert httpx.post(f"{address}/api/episodes", json={}, headers=headers).status_code == 201


def test_what_another_has_does_not_exist(address: str, visit) -> None:
    ann, ben, host = visit(address), visit(address), visit(address)
    mine = ann.begin()
    host.http.get("/", params={"key": KEY})
    assert host.get("/api/episodes")["total"] >= 1
    assert host.get(mine)["live"] is None
    for method, path in [
        ("GET", ""), ("GET", "/events"), ("GET", "/why?goal=x"), ("GET", "/words?goal=x&turn=1"),
        ("GET", "/picture.svg?round=0"), ("GET", "/export.json"), ("GET", "/export.html"),
        ("DELETE", "/corrections"),
    ]:  # fmt: skip
        assert ben.http.request(method, mine + path).status_code == 404, path
    for path, body in [
        ("/utterances", {"text": "hello", "round": 1}),
        ("/corrections", {"kind": "pin", "goal": "x"}),
    ]:
        assert ben.http.post(mine + path, json=body).status_code == 404
        assert host.http.post(mine + path, json=body).status_code == 403
    assert ben.get("/api/episodes")["total"] == 0
    assert ann.get(mine)["rounds"] == []


def test_the_key_leaves_the_address_and_the_visitor_is_a_new_one(address: str) -> None:
    planted = {"goalscope_visitor": "a-secret-that-somebody-else-planted-here"}
    answer = httpx.get(address, params={"key": KEY}, cookies=planted)
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    assert planted["goalscope_visitor"] not in answer.headers["set-cookie"]
    assert "HttpOnly; SameSite=Strict" in answer.headers["set-cookie"]


def test_with_a_password_nobody_comes_in_without_it(tmp_path: Path, visit) -> None:
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        for path in ("/", "/static/app.js", "/api/options", "/api/episodes"):
            assert httpx.get(address + path).status_code == 401
        visitor = visit(address)
        assert visitor.http.get("/", params={"key": "wrong"}).status_code == 401
        visitor.http.get("/", params={"key": PASSWORD})
        assert visitor.get("/api/options")["host"] is False
        visitor.begin()


def test_every_answer_forbids_scripts_of_others(address: str) -> None:
    for path in ("/", "/static/index.html", "/api/options", "/api/episodes/none", "/nowhere"):
        answer = httpx.get(address + path)
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert answer.headers["x-content-type-options"] == "nosniff"


def test_too_much_is_refused(address: str, visit) -> None:
    person = visit(address)
    body = b'{"domain": "' + b"x" * 70_000 + b'"}'
    assert person.http.post("/api/episodes", content=body).status_code == 413
    person = visit(address)
    person.get("/api/options")
    many = [person.http.delete("/api/episodes/none/corrections").status_code for _ in range(70)]
    assert set(many) == {404, 429}
