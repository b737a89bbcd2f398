"""Access to the page: hosts, origins, the key and cookies.

`reliability/test_attacks.py` tries forged origins at every address.
"""

import http.client
from pathlib import Path

import httpx
import pytest

from goalscope.base.types import InvalidInputError
from goalscope.web.guard import host_name
from sites import ENTERED, KEY, site


@pytest.mark.parametrize(
    ("authorization", "status"),
    [
        (f"bearer {KEY}", 201),
        (f"BEARER   {KEY}", 201),
        ("Bearer wrong", 401),
        (f"Basic {KEY}", 401),
    ],
)
def test_a_program_shows_the_key(address: str, authorization: str, status: int) -> None:
    headers = {"authorization": authorization}
    begun = httpx.post(f"{address}/api/episodes", json={}, headers=headers)  # without an origin
    assert begun.status_code == status


def test_nobody_comes_in_without_the_key(address: str, visit) -> None:
    for path in ("/", "/static/app.js", "/api/options", "/api/episodes", "/api/openapi.json"):
        answer = httpx.get(address + path)
        assert answer.status_code == 401
        assert "`goalscope serve` prints" in answer.json()["error"]
    visitor = visit(address, cookies={})
    assert visitor.http.get("/", params={"key": "wrong"}).status_code == 401
    visitor.http.get("/", params={"key": KEY})
    mine = visitor.begin()
    forged = httpx.get(address + mine, cookies={"goalscope_key": KEY})
    assert forged.status_code == 401
    assert visit(address).get(mine)["live"]["round"] == 1  # in another browser with the key


def test_a_page_of_another_site_is_told_that_no_key_helps(address: str) -> None:
    headers = {"authorization": f"Bearer {KEY}", "origin": "http://evil.example"}
    error = httpx.post(f"{address}/api/episodes", json={}, headers=headers).json()["error"]
    assert "Pages of other sites cannot change anything here, with or without a key" in error


def test_the_key_leaves_the_address_and_is_not_kept_itself(address: str) -> None:
    answer = httpx.get(address, params={"key": KEY})
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    assert KEY not in answer.headers["set-cookie"]
    assert "HttpOnly; SameSite=Lax" in answer.headers["set-cookie"]


def test_every_answer_forbids_scripts_of_others(address: str, visit) -> None:
    for path in ("/", "/static/index.html", "/api/options", "/api/episodes/none", "/nowhere"):
        answer = visit(address).http.get(path)
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert answer.headers["x-content-type-options"] == "nosniff"


def test_a_long_body_is_refused(address: str, visit) -> None:
    body = b'{"domain": "' + b"x" * 70_000 + b'"}'
    for content in (body, iter([body[:40_000], body[40_000:]])):
        answer = visit(address).http.post("/api/episodes", content=content)
        assert (answer.status_code, answer.json()["error"][:16]) == (413, "The request is l")


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


def test_numbers_that_no_database_holds_are_refused(address: str, visit) -> None:
    for path in ("/api/episodes?offset={}", "/api/studies/none/items/{}?id=ann"):
        assert visit(address).http.get(path.format(10**30)).status_code == 422


def test_a_link_of_another_site_changes_no_rater(address: str) -> None:
    first = httpx.get(f"{address}/study/none")
    assert "SameSite=Lax" in first.headers["set-cookie"]  # so links of other sites send it
    again = httpx.get(f"{address}/study/none", cookies=first.cookies)
    assert "set-cookie" not in again.headers
    posted = httpx.post(f"{address}/api/studies/none/consent")  # a form of theirs
    assert (posted.status_code, "set-cookie" in posted.headers) == (403, False)


def begun(address: str, host: str, origin: str, *protocols: str) -> int:
    """The status when a page of this origin begins an episode at a host."""
    forwarded = [("x-forwarded-proto", each) for each in protocols]
    headers = [("host", host), ("origin", origin), *forwarded]
    began = httpx.post(f"{address}/api/episodes", json={}, headers=headers, cookies=ENTERED)
    assert began.status_code == 201 or "--name" in began.text or "X-Forwarded-Proto" in began.text
    return began.status_code


@pytest.mark.parametrize(
    "host",
    ["localhost:9000", "127.0.0.1:1", "[::1]:65535", "127.0.1.1:9000", "localhost", "LocalHost:80"],
)
def test_a_tunnel_may_end_at_any_port_of_the_visitors_machine(address: str, host: str) -> None:
    """As with `ssh -L 9000:localhost:8123`, or a container whose port is another one outside."""
    origin = "http://" + host.lower().removesuffix(":80")
    assert begun(address, host, origin) == 201
    assert begun(address, host, "http://localhost:9001") == 403


@pytest.mark.parametrize(
    ("protocols", "scheme"),
    [
        (["https"], "https"),
        (["https, http"], "https"),
        (["https,http,http"], "https"),
        (["HTTPS"], "https"),
        (["https", "http"], "https"),
        (["https ,http"], "https"),
        (["http, https"], "http"),
        (["http"], "http"),
        (["ftp"], "http"),
    ],
)
def test_the_first_of_several_proxies_says_what_the_browser_speaks(
    address: str, protocols: list[str], scheme: str
) -> None:
    other = {"https": "http", "http": "https"}[scheme]
    assert begun(address, "localhost:9", f"{scheme}://localhost:9", *protocols) == 201
    assert begun(address, "localhost:9", f"{other}://localhost:9", *protocols) == 403


@pytest.mark.parametrize("name", ["goals.example.org", "goals.example.org:443"])
@pytest.mark.parametrize("host", ["goals.example.org", "Goals.Example.org:443"])
def test_a_proxy_may_tell_the_default_port(tmp_path: Path, name: str, host: str) -> None:
    """nginx does, with `proxy_set_header Host $host:$server_port`; a browser does not."""
    with site(tmp_path / "e.db", hosts=[name]) as address:
        assert begun(address, host, "https://goals.example.org", "https") == 201
        assert begun(address, "goals.example.org:8443", "https://goals.example.org:8443") == 403


@pytest.mark.parametrize(
    ("name", "sent"),
    [
        ("goals.example.org", "goals.example.org"),
        ("Goals.Example.ORG:8443", "goals.example.org:8443"),
        ("192.168.1.5:8000", "192.168.1.5:8000"),
        ("[2001:DB8::0001]", "[2001:db8::1]"),
        ("my_box", "my_box"),
    ],
)
def test_a_name_is_as_browsers_send_it(name: str, sent: str) -> None:
    assert host_name(name) == sent


@pytest.mark.parametrize(
    "name",
    [
        *("https://x", "http://x:8000", "//x", "x/", "x/goals", "x?", "user@x", "", " ", "a b"),
        *("*", "*.example.org", ".x", "x.", "x:", "x:0", "x:08", "x:99999", "x:http", "x,y"),
        *("::1", "2001:db8::1", "[::1", "[1:2]", "[fe80::1%eth0]", "m\u00fcnchen.example", "x\n"),
    ],
)
def test_a_name_of_another_form_is_refused_with_the_form(name: str) -> None:
    with pytest.raises(InvalidInputError, match=r"--name.*HOST\[:PORT\].*goals\.example\.org"):
        host_name(name)


def test_a_proxy_that_speaks_tls_has_pages_of_its_own(address: str, visit) -> None:
    own = address.replace("http://", "https://")
    visitor = visit(address)
    headers = {"origin": own, "x-forwarded-proto": "https"}
    assert visitor.http.post("/api/episodes", json={}, headers=headers).status_code == 201
    entered = visitor.http.get("/", params={"key": KEY}, headers=headers)
    assert "SameSite=Lax; Secure" in entered.headers["set-cookie"]
