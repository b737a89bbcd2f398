"""Access to the page: hosts, origins, keys and cookies.

`reliability/test_attacks.py` tries forged origins, and what belongs to others, at every address.
"""

import http.client
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from sites import KEY, site

PASSWORD = "what-visitors-show"


@pytest.fixture(scope="module")
def locked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A page with a password."""
    file = tmp_path_factory.mktemp("locked") / "episodes.db"
    with site(file, password=PASSWORD) as running:
        yield running


@pytest.mark.parametrize(
    ("authorization", "status"),
    [
        (f"bearer {KEY}", 200),
        (f"BEARER {KEY}", 200),
        (f"Bearer   {KEY}", 200),
        ("Bearer wrong", 401),
        (f"Bearer {PASSWORD}", 401),
        (f"Basic {KEY}", 401),
    ],
)
def test_a_program_shows_the_hosts_key(locked: str, authorization: str, status: int) -> None:
    headers = {"authorization": authorization}
    options = httpx.get(f"{locked}/api/options", headers=headers)
    assert options.status_code == status
    assert options.json().get("host") is (True if status == 200 else None)
    begun = httpx.post(f"{locked}/api/episodes", json={}, headers=headers)  # without an origin
    assert begun.status_code == (201 if status == 200 else 401)


def test_a_page_of_another_site_is_told_that_no_key_helps(address: str) -> None:
    headers = {"authorization": f"Bearer {KEY}", "origin": "http://evil.example"}
    error = httpx.post(f"{address}/api/trackers", json={}, headers=headers).json()["error"]
    assert "Pages of other sites cannot change anything here, with or without a key" in error
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


def test_the_key_leaves_the_address_and_is_not_kept_itself(address: str) -> None:
    answer = httpx.get(address, params={"key": KEY})
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    assert KEY not in answer.headers["set-cookie"]
    assert "HttpOnly; SameSite=Lax" in answer.headers["set-cookie"]


def test_what_the_host_begins_is_not_told_to_who_planted_a_secret(locked: str, visit) -> None:
    planted = {"goalscope_visitor": "a-secret-that-somebody-else-planted-here"}
    host, thief = visit(locked, cookies=planted), visit(locked, cookies=planted)
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
        assert (answer.status_code, answer.json()["error"][:16]) == (413, "The request is l")


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


def test_a_visitor_keeps_their_episodes_whatever_links_they_open_again(
    tmp_path: Path, visit
) -> None:
    password = 'ü; Domain=x, "50%"'
    with site(tmp_path / "episodes.db", password=password) as address:
        ann = visit(address)
        ann.http.get("/", params={"key": password})
        mine = ann.begin()
        for key in (password, KEY, password, KEY, password):
            ann.http.get("/", params={"key": key})
            assert ann.get(mine)["episode"]["mine"] is True
            ann.live(mine)
        assert ann.get("/api/options")["host"] is True  # the guests' link does not undo it
        assert ann.say(mine, "I want to bake a cake.")["round"] == 2


def test_cookies_of_other_servers_hide_none(address: str, visit) -> None:
    ann = visit(address)
    mine = ann.begin()
    secret = ann.http.cookies["goalscope_visitor"]
    cookies = f'other={{"a": 1}}; path=x; goalscope_visitor={secret}'
    answer = httpx.get(address + mine, headers={"cookie": cookies})
    assert answer.json()["episode"]["mine"] is True


def test_visitors_behind_one_proxy_are_several(locked: str, visit) -> None:
    people = [visit(locked, auth=("proxy", "shared")) for _ in range(2)]
    for person in people:
        person.http.get("/", params={"key": PASSWORD})
    mine = people[0].begin()
    assert people[1].http.get(mine).status_code == 404


def test_numbers_that_no_database_holds_are_refused(address: str, visit) -> None:
    for path in ("/api/episodes?offset={}", "/api/studies/none/items/{}?id=ann"):
        assert visit(address).http.get(path.format(10**30)).status_code == 422


@pytest.mark.parametrize("path", ["/", "/study/none", "/api/options"])
def test_a_link_of_another_site_changes_no_identity(address: str, path: str) -> None:
    first = httpx.get(address + path)
    assert "SameSite=Lax" in first.headers["set-cookie"]  # so links of other sites send it
    assert "set-cookie" not in httpx.get(address + path, cookies=first.cookies).headers
    assert "set-cookie" not in httpx.post(address + path).headers  # a form of theirs does not


def test_a_proxy_that_speaks_tls_has_pages_of_its_own(address: str) -> None:
    own = address.replace("http://", "https://")
    headers = {"origin": own, "x-forwarded-proto": "https"}
    answer = httpx.post(f"{address}/api/episodes", json={}, headers=headers)
    assert answer.status_code == 201
    assert "SameSite=Lax; Secure" in answer.headers["set-cookie"]
