"""Who may ask for what."""

import http.client
from pathlib import Path

import httpx
import pytest

from sites import KEY, site

PASSWORD = "what-visitors-show"


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


def test_with_a_password_nobody_comes_in_without_it(tmp_path: Path, visit) -> None:
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        for path in ("/", "/static/app.js", "/api/options", "/api/episodes"):
            assert httpx.get(address + path).status_code == 401
        visitor = visit(address)
        assert visitor.http.get("/", params={"key": "wrong"}).status_code == 401
        visitor.http.get("/", params={"key": PASSWORD})
        assert visitor.get("/api/options")["host"] is False
        visitor.begin()
        cookies = visitor.http.cookies
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        assert visit(address, cookies=cookies).get("/api/episodes")["total"] == 1
    with site(tmp_path / "episodes.db", password="another-that-counts-now") as address:
        assert visit(address, cookies=cookies).http.get("/").status_code == 401


def test_the_password_is_no_key_of_a_program(tmp_path: Path) -> None:
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        headers = {"authorization": f"Bearer {PASSWORD}"}
        assert httpx.get(f"{address}/api/options", headers=headers).status_code == 401
        headers["authorization"] = f"Basic {KEY}"
        assert httpx.get(f"{address}/api/options", headers=headers).status_code == 401


def test_every_answer_forbids_scripts_of_others(address: str) -> None:
    for path in ("/", "/static/index.html", "/api/options", "/api/episodes/none", "/nowhere"):
        answer = httpx.get(address + path)
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert answer.headers["x-content-type-options"] == "nosniff"


def test_a_long_body_is_refused(address: str, visit) -> None:
    body = b'{"domain": "' + b"x" * 70_000 + b'"}'
    for content in (body, iter([body[:40_000], body[40_000:]])):
        answer = visit(address).http.post("/api/episodes", content=content)
        assert (answer.status_code, answer.json()["error"][:16]) == (413, "That is longer t")


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


def test_numbers_that_no_database_holds_are_refused(address: str, visit) -> None:
    for path in ("/api/episodes?offset={}", "/api/studies/none/items/{}?id=ann"):
        assert visit(address).http.get(path.format(10**30)).status_code == 422


@pytest.mark.parametrize("path", ["/", "/study/none", "/api/options"])
def test_who_comes_by_a_link_of_another_site_stays_who_they_were(address: str, path: str) -> None:
    first = httpx.get(address + path)
    assert "SameSite=Lax" in first.headers["set-cookie"]  # so links of other sites show it
    assert "set-cookie" not in httpx.get(address + path, cookies=first.cookies).headers
    assert "set-cookie" not in httpx.post(address + path).headers  # a form of theirs does not


def test_the_guests_link_makes_no_guest_of_the_host(tmp_path: Path, visit) -> None:
    with site(tmp_path / "episodes.db", password=PASSWORD) as address:
        ann = visit(address)
        ann.http.get("/", params={"key": KEY})
        link = httpx.get(address, params={"key": PASSWORD})
        ann.http.cookies.update(link.cookies)
        assert ann.get("/api/options")["host"] is True


def test_a_proxy_that_speaks_tls_has_pages_of_its_own(address: str) -> None:
    own = address.replace("http://", "https://")
    headers = {"origin": own, "x-forwarded-proto": "https"}
    answer = httpx.post(f"{address}/api/episodes", json={}, headers=headers)
    assert answer.status_code == 201
    assert "SameSite=Lax; Secure" in answer.headers["set-cookie"]
