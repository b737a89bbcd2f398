"""Who may ask for what."""

import http.client
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest

from goalscope.web import limits
from goalscope.web.limits import Meter, Rate
from sites import KEY, site

PASSWORD = "what-visitors-show"


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """What the limits take for the time, which does not pass by itself."""
    now = [1000.0]
    monkeypatch.setattr(limits, "monotonic", lambda: now[0])
    return now


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


def test_a_wrong_key_of_a_program_is_told(address: str) -> None:
    headers = {"authorization": "Bearer wrong"}
    assert httpx.get(f"{address}/api/options", headers=headers).status_code == 401
    assert httpx.post(f"{address}/api/episodes", json={}, headers=headers).status_code == 401


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


def test_too_much_is_refused(tmp_path: Path, visit, clock) -> None:
    with site(tmp_path / "episodes.db") as address:
        person = visit(address)
        body = b'{"domain": "' + b"x" * 70_000 + b'"}'
        assert person.http.post("/api/episodes", content=body).status_code == 413
        person = visit(address)
        person.get("/api/options")
        many = [person.http.delete("/api/episodes/none/corrections") for _ in range(70)]
        assert {each.status_code for each in many} == {404, 429}
        assert many[-1].json() == {"error": "That was too much at once. Wait a second."}
        assert many[-1].headers["retry-after"] == "1"


def test_a_wrong_or_hostile_key_in_an_address_changes_nobodys_cookies(address: str) -> None:
    for path in ("/?key=of-an-earlier-start", "//evil.example/?key=x", "/?key=x%0d%0aset-cookie:a"):
        answer = httpx.get(address + path, cookies={"goalscope_visitor": "v" * 43})
        assert answer.status_code != 303
        assert "set-cookie" not in answer.headers


@pytest.mark.parametrize("path", ["//evil.example/", "/%0d%0aset-cookie:a=b", "/\\evil.example"])
def test_the_key_leads_to_no_other_server(address: str, path: str) -> None:
    port = int(address.rpartition(":")[2])
    connection = http.client.HTTPConnection("127.0.0.1", port)
    connection.request("GET", f"{path}?key={KEY}")
    answer = connection.getresponse()
    connection.close()
    place = answer.headers["location"]
    assert answer.status == 303
    assert place.startswith("/")
    assert place[1] not in "/\\"
    assert len(answer.headers.get_all("set-cookie", [])) == 2


def test_who_opens_the_address_with_the_key_again_keeps_their_episodes(
    tmp_path: Path, visit
) -> None:
    password = 'ü; Domain=x, "50%"'
    with site(tmp_path / "episodes.db", password=password) as address:
        ann = visit(address)
        ann.http.get("/", params={"key": password})
        mine = ann.begin()
        ann.http.get("/", params={"key": password})
        assert ann.get(mine)["episode"]["mine"] is True
        planted, kept = (ann.http.cookies[f"goalscope_{name}"] for name in ("visitor", "key"))
        ann.http.get("/", params={"key": KEY})
        assert ann.get(mine)["episode"]["mine"] is True
        assert ann.http.cookies["goalscope_visitor"] != planted
        thief = visit(address, cookies={"goalscope_visitor": planted, "goalscope_key": kept})
        assert thief.http.get(mine).status_code == 404
        assert ann.get("/api/options")["host"] is True


def test_cookies_of_other_servers_hide_none(address: str, visit) -> None:
    ann = visit(address)
    mine = ann.begin()
    secret = ann.http.cookies["goalscope_visitor"]
    cookies = f'other={{"a": 1}}; path=x; goalscope_visitor={secret}'
    answer = httpx.get(address + mine, headers={"cookie": cookies})
    assert answer.json()["episode"]["mine"] is True


def test_who_comes_through_one_proxy_is_not_one_visitor(tmp_path: Path, visit) -> None:
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        people = [visit(address, auth=("proxy", "shared")) for _ in range(2)]
        for person in people:
            person.http.get("/", params={"key": PASSWORD})
        mine = people[0].begin()
        assert people[1].http.get(mine).status_code == 404


def test_a_new_cookie_is_no_new_allowance(tmp_path: Path, clock) -> None:
    with site(tmp_path / "episodes.db") as address, httpx.Client(base_url=address) as http:
        sent = [
            http.delete(
                "/api/episodes/none/corrections",
                headers={"origin": address, "cookie": f"goalscope_visitor={number:040}"},
            ).status_code
            for number in range(70)
        ]
        assert set(sent) == {404, 429}


def test_numbers_that_no_database_holds_are_refused(address: str, visit) -> None:
    for path in ("/api/episodes?offset=", "/api/studies/none/items/"):
        assert visit(address).http.get(f"{path}{10**30}").status_code == 422


def test_a_link_of_another_site_takes_nothing_from_who_has_come_before(address: str, visit) -> None:
    """Browsers withhold their cookies from it, and keep those that it does not replace."""
    link = {"sec-fetch-site": "cross-site"}
    answer = httpx.get(address, params={"key": KEY}, headers=link)
    (cookie,) = answer.headers.get_list("set-cookie")
    assert cookie.startswith("goalscope_key=")


def test_keys_are_not_guessed_and_who_has_one_is_not_kept_out(tmp_path: Path, visit, clock) -> None:
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        ann = visit(address)
        ann.http.get("/", params={"key": PASSWORD})
        ann.get("/api/options")
        same = [httpx.get(address, params={"key": "as before"}) for _ in range(20)]
        assert {each.status_code for each in same} == {401}
        many = [httpx.get(address, params={"key": f"guess {n}"}) for n in range(15)]
        assert [each.status_code for each in many] == [401] * 9 + [429] * 6
        assert "Wait" in many[-1].json()["error"]
        assert 1 <= int(many[-1].headers["retry-after"]) <= 6
        for right in (KEY, PASSWORD):  # nothing is learnt now
            assert httpx.get(address, params={"key": right}).status_code == 429
            bearer = {"authorization": f"Bearer {right}"}
            assert httpx.get(f"{address}/api/options", headers=bearer).status_code == 429
            assert ann.http.get("/", params={"key": right}).status_code == (
                429 if right == KEY else 303
            )
        assert ann.get("/api/options")["host"] is False
        ann.begin()
        clock[0] += 6
        assert httpx.get(address, params={"key": KEY}).status_code == 303


def test_guesses_from_many_addresses_are_counted_together(
    tmp_path: Path, monkeypatch, clock
) -> None:
    monkeypatch.setattr("goalscope.web.guard.GUESSES_OF_ALL", Rate(3, 60.0))
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        sent = [
            httpx.get(
                address, params={"key": f"guess {n}"}, headers={"x-forwarded-for": f"192.0.2.{n}"}
            ).status_code
            for n in range(5)
        ]
    assert sent == [401, 401, 401, 429, 429]


def test_so_many_episodes_are_begun_in_an_hour(tmp_path: Path, visit, clock) -> None:
    with site(tmp_path / "episodes.db") as address:
        ann = visit(address)
        ann.get("/api/options")
        for _ in range(30):
            ann.begin()
        refused = ann.http.post("/api/episodes", json={})
        assert refused.status_code == 429
        assert refused.json() == {
            "error": "You have begun many conversations in this hour. Wait 2 minutes."
        }
        assert refused.headers["retry-after"] == "120"
        visit(address).begin()
        clock[0] += 120
        ann.begin()


@pytest.mark.parametrize("path", ["why?goal=x", "words?goal=x&turn=1", "export.html"])
def test_what_costs_much_is_not_asked_for_without_end(
    tmp_path: Path, path: str, visit, clock
) -> None:
    with site(tmp_path / "episodes.db") as address:
        ann = visit(address)
        ann.get("/api/options")
        many = [ann.http.get(f"/api/episodes/none/{path}").status_code for _ in range(75)]
        assert set(many) == {404, 429}
        assert ann.get("/api/episodes")["total"] == 0
        program = {"authorization": f"Bearer {KEY}"}
        many = [
            httpx.get(f"{address}/api/episodes/none/{path}", headers=program) for _ in range(75)
        ]
        assert {each.status_code for each in many} <= {403, 404}


def test_so_many_streams_are_open_at_once(address: str, visit, monkeypatch) -> None:
    monkeypatch.setattr("goalscope.web.app.STREAMS", 3)
    ann, ben = visit(address), visit(address)
    mine, other = ann.begin(), ben.begin()
    with ExitStack() as opened:
        streams = [
            opened.enter_context(ann.http.stream("GET", f"{mine}/events")).iter_lines()
            for _ in range(3)
        ]
        assert [next(lines) for lines in streams] == ["event: live"] * 3
        refused = ann.http.get(f"{mine}/events")
        assert (refused.status_code, refused.headers["retry-after"]) == (429, "5")
        assert opened.enter_context(ben.http.stream("GET", f"{other}/events")).status_code == 200
    gone = threading.Event()
    for _ in range(200):
        with ann.http.stream("GET", f"{mine}/events") as answer:
            if answer.status_code == 200:
                return
        gone.wait(0.05)
    pytest.fail("streams that were closed still count")


def test_a_meter_gives_back_with_time(clock) -> None:
    meter = Meter(Rate(2, 10.0))
    assert [meter.take("ann") for _ in range(3)] == [0, 0, 10]
    assert meter.take("ben") == 0
    clock[0] += 9.5
    assert meter.take("ann") == 1.0
    clock[0] += 0.5
    assert [meter.take("ann"), meter.take("ann")] == [0, 10]
    clock[0] += 1000
    assert [meter.take("ann") for _ in range(3)] == [0, 0, 10]
