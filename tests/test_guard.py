"""Who may ask for what."""

import asyncio
import http.client
import threading
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import httpx
import pytest
from fastapi import FastAPI

from goalscope.web import limits
from goalscope.web.conversations import Conversations
from goalscope.web.guard import Guard
from goalscope.web.limits import Limits, Meter, Rate
from sites import KEY, site

PASSWORD = "what-visitors-show"


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """What the limits take for the time, which does not pass by itself."""
    now = [1000.0]
    monkeypatch.setattr(limits, "monotonic", lambda: now[0])
    return now


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


@pytest.mark.parametrize("scheme", ["bearer", "BEARER", "Bearer "])
def test_the_scheme_of_a_key_may_be_written_in_any_case(address: str, scheme: str) -> None:
    headers = {"authorization": f"{scheme} {KEY}"}
    assert httpx.get(f"{address}/api/options", headers=headers).json()["host"] is True


@pytest.mark.parametrize("shown", ["Basic aG9zdDprZXk=", f"Token {KEY}", KEY])
def test_a_program_that_shows_its_key_otherwise_is_told_how(address: str, shown: str) -> None:
    answer = httpx.get(f"{address}/api/options", headers={"authorization": shown})
    assert answer.status_code == 401
    assert answer.json() == {"error": "A program shows the key: Authorization: Bearer KEY."}
    browser = {"authorization": shown, "user-agent": "Mozilla/5.0 (X11; Linux x86_64)"}
    assert httpx.get(f"{address}/api/options", headers=browser).json()["host"] is False


def test_a_page_of_another_site_is_told_that_no_key_helps(address: str) -> None:
    headers = {"authorization": f"Bearer {KEY}", "origin": "http://evil.example"}
    error = httpx.post(f"{address}/api/trackers", json={}, headers=headers).json()["error"]
    assert "Pages of other sites change nothing here, whatever key they show" in error
    assert "Authorization" not in error


def test_what_the_host_began_goes_on_wherever_they_have_the_key(address: str, visit) -> None:
    one, other = visit(address), visit(address)
    for each in (one, other):
        each.http.get("/", params={"key": KEY})
    mine = one.begin()
    one.say(mine, "I want to bake a cake.")
    assert other.get(mine)["episode"]["mine"] is True
    assert other.say(mine, "And milk.")["round"] == 3
    program = httpx.get(address + mine, headers={"authorization": f"Bearer {KEY}"})
    assert program.json()["live"]["round"] == 3
    assert visit(address).http.get(mine).status_code == 404


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


def test_the_key_leaves_the_address_and_is_not_kept_itself(address: str) -> None:
    answer = httpx.get(address, params={"key": KEY})
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    assert KEY not in answer.headers["set-cookie"]
    assert "HttpOnly; SameSite=Lax" in answer.headers["set-cookie"]


def test_what_the_host_begins_is_not_told_to_who_planted_a_secret(tmp_path: Path, visit) -> None:
    planted = {"goalscope_visitor": "a-secret-that-somebody-else-planted-here"}
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        host, thief = visit(address, cookies=planted), visit(address, cookies=planted)
        host.http.get("/", params={"key": KEY})
        mine = host.begin()
        thief.http.get("/", params={"key": PASSWORD})
        assert thief.http.get(mine).status_code == 404
        assert thief.get("/api/episodes")["total"] == 0
        assert host.get(mine)["episode"]["mine"] is True


def test_a_program_keeps_what_is_its_own(tmp_path: Path, visit) -> None:
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        program = {"authorization": f"Bearer {PASSWORD}", "origin": address}
        id = httpx.post(f"{address}/api/episodes", json={}, headers=program).json()["id"]
        thief = visit(address, cookies={"goalscope_visitor": PASSWORD})
        thief.http.get("/", params={"key": PASSWORD})
        answer = httpx.get(f"{address}/api/episodes/{id}", headers=program)
        assert answer.json()["episode"]["mine"] is True


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
    assert len(answer.headers.get_all("set-cookie", [])) == 1


def test_who_opens_the_address_with_the_key_again_keeps_their_episodes(
    tmp_path: Path, visit
) -> None:
    password = 'ü; Domain=x, "50%"'
    with site(tmp_path / "episodes.db", password=password) as address:
        ann = visit(address)
        ann.http.get("/", params={"key": password})
        mine = ann.begin()
        for key in (password, KEY, password, KEY):
            ann.http.get("/", params={"key": key})
            assert ann.get(mine)["episode"]["mine"] is True
            ann.live(mine)
        assert ann.get("/api/options")["host"] is True
        assert ann.say(mine, "I want to bake a cake.")["round"] == 2


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


def test_a_new_cookie_is_no_new_allowance(tmp_path: Path, monkeypatch, clock) -> None:
    monkeypatch.setattr(Conversations, "begin", lambda *_: SimpleNamespace(id="one"))
    with site(tmp_path / "episodes.db") as address, httpx.Client(base_url=address) as http:
        sent = [
            http.post(
                "/api/episodes",
                json={},
                headers={"origin": address, "cookie": f"goalscope_visitor={number % 20:040}"},
            ).status_code
            for number in range(200)
        ]
        assert sent == [201] * 150 + [429] * 50


def test_numbers_that_no_database_holds_are_refused(address: str, visit) -> None:
    for path in ("/api/episodes?offset=", "/api/studies/none/items/"):
        assert visit(address).http.get(f"{path}{10**30}").status_code == 422


@pytest.mark.parametrize("path", ["/", "/study/none", "/api/episodes/none/export.html"])
@pytest.mark.parametrize("key", ["", PASSWORD, KEY])
def test_who_comes_by_a_link_stays_who_they_were(address: str, path: str, key: str) -> None:
    """Browsers withhold their cookies then, and take those that they are sent for theirs."""
    link = {"accept": "text/html,application/xhtml+xml,*/*;q=0.8"}
    answer = httpx.get(address + path, params={"key": key}, headers=link)
    cookies = answer.headers.get_list("set-cookie")
    assert [each.partition("=")[0] for each in cookies] in ([], ["goalscope_host"])


def test_the_guests_link_makes_no_guest_of_the_host(tmp_path: Path, visit) -> None:
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        ann = visit(address)
        ann.http.get("/", params={"key": KEY})
        link = httpx.get(address, params={"key": PASSWORD})
        ann.http.cookies.update(link.cookies)
        assert ann.get("/api/options")["host"] is True


def test_passwords_are_not_guessed_and_who_has_come_in_is_not_kept_out(
    tmp_path: Path, visit, clock
) -> None:
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        ann = visit(address)
        ann.http.get("/", params={"key": PASSWORD})
        cookies = ann.http.cookies
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        same = [httpx.get(address, params={"key": "as before"}) for _ in range(20)]
        assert {each.status_code for each in same} == {401}
        many = [httpx.get(address, params={"key": f"guess {n}"}) for n in range(15)]
        assert [each.status_code for each in many] == [401] * 9 + [429] * 6
        assert "Wait" in many[-1].json()["error"]
        assert 1 <= int(many[-1].headers["retry-after"]) <= 6
        for right, status in ((KEY, 200), (PASSWORD, 429)):  # nothing is learnt of it now
            opened = httpx.get(address, params={"key": right}, follow_redirects=False)
            assert opened.status_code == (303 if status == 200 else 429)
            bearer = {"authorization": f"Bearer {right}"}
            assert httpx.get(f"{address}/api/options", headers=bearer).status_code == status
        back = visit(address, cookies=cookies)
        assert back.http.get("/", params={"key": PASSWORD}).status_code == 303
        assert back.get("/api/options")["host"] is False
        back.begin()
        clock[0] += 6
        assert httpx.get(address, params={"key": PASSWORD}).status_code == 303


def test_guesses_from_many_addresses_are_counted_together(monkeypatch, clock) -> None:
    monkeypatch.setattr("goalscope.web.guard.GUESSES_OF_ALL", Rate(3, 60.0))
    assert guesses(f"192.0.2.{n}" for n in range(5)) == [401, 401, 401, 429, 429]


@pytest.mark.parametrize("address", ["2001:db8::{:x}", "::ffff:192.0.2.1"])
def test_a_network_of_ipv6_is_one_address(address: str, clock) -> None:
    assert guesses(address.format(n + 1) for n in range(12)) == [401] * 10 + [429] * 2
    other = guesses(["2001:db8::1"] * 10 + ["2001:db8:0:1::1", "::ffff:192.0.2.9"])
    assert other == [401] * 12


def guesses(addresses: Iterable[str]) -> list[int]:
    """The answers to wrong passwords from these addresses, one from each."""
    guard = Guard(FastAPI(), hosts=["here"], key=KEY, password=PASSWORD)

    async def sent(number: int, address: str) -> int:
        transport = httpx.ASGITransport(guard, client=(address, 1))
        async with httpx.AsyncClient(transport=transport, base_url="http://here") as http:
            return (await http.get("/", params={"key": f"guess {number}"})).status_code

    return [asyncio.run(sent(*each)) for each in enumerate(addresses)]


def test_a_proxy_that_speaks_tls_has_pages_of_its_own(address: str) -> None:
    own = address.replace("http://", "https://")
    headers = {"origin": own, "x-forwarded-proto": "https"}
    answer = httpx.post(f"{address}/api/episodes", json={}, headers=headers)
    assert answer.status_code == 201
    assert "SameSite=Strict; Secure" in answer.headers["set-cookie"]


def test_what_a_visitor_sends_is_not_kept_whole(address: str, monkeypatch) -> None:
    seen: list[str] = []
    monkeypatch.setattr(Limits, "check", lambda _, *what: seen.append(what[2]))
    httpx.get(address, cookies={"goalscope_visitor": "z" * 50_000})
    assert [len(each) for each in seen] == [16]


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
