"""Studies over HTTP: nothing is lost or doubled, and nobody sees what is not theirs."""

import re
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any
from uuid import uuid4

import httpx
import pytest

from goalscope.storage.store import Store
from goalscope.study.store import StudyStore
from sites import KEY, site
from test_study import PLAN, fill

SAID = "It fits what they asked for."
WEB = replace(
    PLAN, name="shop", min_explanation=5, ratings_per_item=100, thanks="Your code is C0DE."
)
HOME = "/api/studies/shop"


@pytest.fixture
def visit(visit):
    """Lets people visit who have a link of their own each."""

    def enter(address: str) -> Any:
        person = visit(address, cookies={})
        person.http.params = {"id": uuid4().hex}
        return person

    return enter


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("study") / "episodes.db"
    with Store.open(path) as store:
        fill(store)
        StudyStore(store).add(WEB)
    return path


@pytest.fixture(scope="module")
def address(file: Path) -> Iterator[str]:
    with site(file) as running:
        yield running


def put(person: Any, at: int, rating: int, revision: int, text: str = SAID, home: str = HOME):
    body = {"rating": rating, "explanation": text, "revision": revision}
    return person.http.put(f"{home}/items/{at}", json=body)


def test_from_consent_to_the_end(address: str, visit) -> None:
    ann = visit(address)
    assert ann.http.get("/study/shop").headers["content-type"].startswith("text/html")
    before = ann.get(HOME)
    assert before["answered"] is None
    assert ann.http.get(f"{HOME}/items/1").status_code == 403
    assert put(ann, 1, 2, 1).status_code == 403
    assert ann.http.post(f"{HOME}/consent", json={"agreed": False}).status_code == 400
    assert ann.post(f"{HOME}/consent", agreed=True)["answered"] == [False, False]
    assert ann.post(f"{HOME}/consent", agreed=True)["answered"] == [False, False]
    item = ann.get(f"{HOME}/items/1")
    assert item["outcome"].startswith("The basket holds:")
    assert {*item} == {"task", "possible", "profile", "outcome", "transcript", "answer"}
    assert put(ann, 1, 2, 1).json() == {"rating": 2, "explanation": SAID, "revision": 1}
    assert ann.get(HOME)["answered"] == [True, False]
    put(ann, 2, 3, 1)
    after = ann.get(HOME)
    assert (after["answered"], after["thanks"]) == ([True, True], WEB.thanks)
    assert put(ann, 1, 0, 2).json()["rating"] == 0
    assert ann.get(f"{HOME}/items/1")["answer"] == {
        "rating": 0, "explanation": SAID, "revision": 2,
    }  # fmt: skip


@pytest.mark.parametrize(
    "wrong", [{"rating": 4}, {"rating": None}, {"explanation": "x" * 4001}, {"revision": 0}]
)
def test_what_is_no_answer_is_refused_in_a_sentence(address: str, visit, wrong) -> None:
    ann = visit(address)
    ann.post(f"{HOME}/consent", agreed=True)
    body = {"rating": 1, "explanation": SAID, "revision": 1, **wrong}
    answer = ann.http.put(f"{HOME}/items/1", json=body)
    assert answer.status_code in (400, 422)
    assert answer.json()["error"].endswith(".")
    assert ann.get(f"{HOME}/items/1")["answer"]["revision"] == 0


def test_strangers_need_no_key_for_a_study_and_see_nothing_else(address: str, visit) -> None:
    ann = visit(address)
    assert ann.http.get("/").status_code == 401
    assert ann.http.get("/api/episodes").status_code == 401
    page = ann.http.get("/study/shop").text
    assert "<style" not in page
    assert re.findall("<script[^>]*>", page) == ['<script type="module" src="/static/study.js">']
    for name in re.findall(r'="(/static/[^"]+)"', page):
        assert ann.http.get(name).status_code == 200
        for other in re.findall(r'from "\./([^"]+)"', ann.http.get(name).text):
            assert ann.http.get(f"/static/{other}").status_code == 200
    assert ann.http.get("/study/none").status_code == 404
    lacks = httpx.get(f"{address}{HOME}", params={"id": " "})
    assert (lacks.status_code, "id is missing" in lacks.json()["error"]) == (400, True)
    assert ann.http.get("/api/studies/none").json() == {"error": "There is no such study."}
    headers = {"origin": "https://evil.example"}
    assert (
        ann.http.post(f"{HOME}/consent", json={"agreed": True}, headers=headers).status_code == 403
    )


def test_an_id_goes_on_only_in_its_own_browser(address: str, visit) -> None:
    ann, thief, ben = (visit(address) for _ in range(3))
    ann.http.params = thief.http.params = {"id": "5f"}
    ann.get(HOME)
    ann.post(f"{HOME}/consent", agreed=True)
    put(ann, 1, 2, 1)
    assert thief.http.get(HOME).status_code == 409
    assert "another browser" in thief.http.get(f"{HOME}/items/1").json()["error"]
    assert thief.http.post(f"{HOME}/consent", json={"agreed": True}).status_code == 409
    ann.http.params = {"id": "60"}
    other = ann.http.post(f"{HOME}/consent", json={"agreed": True})
    assert (other.status_code, "this browser" in other.json()["error"]) == (409, True)
    ann.http.params = {"id": "5f"}
    assert ben.get(HOME)["answered"] is None
    assert ann.get(HOME)["answered"] == [True, False]


def test_who_follows_a_link_again_is_who_they_were(address: str, visit) -> None:
    ann = visit(address)
    ann.http.get("/study/shop")
    ann.post(f"{HOME}/consent", agreed=True)
    put(ann, 1, 2, 1)
    for key in ("", "wrong", KEY):
        assert "set-cookie" not in ann.http.get("/study/shop", params={"key": key}).headers
    assert ann.get(HOME)["answered"] == [True, False]


def test_many_at_once_get_no_more_ratings_than_are_wanted(place: str, visit) -> None:
    with Store.open(place) as store:
        fill(store)
        StudyStore(store).add(replace(WEB, ratings_per_item=1))
    with site(place) as address:
        people = [visit(address) for _ in range(12)]

        def join(person: Any) -> int:
            person.get(HOME)
            return person.http.post(f"{HOME}/consent", json={"agreed": True}).status_code

        with ThreadPoolExecutor(12) as pool:
            assert Counter(pool.map(join, people)) == {200: 2, 409: 10}


def test_who_comes_too_late_is_told_before_they_agree(tmp_path: Path, visit) -> None:
    with Store.open(tmp_path / "episodes.db") as store:
        fill(store)
        studies = StudyStore(store)
        study = studies.add(replace(WEB, ratings_per_item=1))
        with site(tmp_path / "episodes.db") as address:
            ann, ben, cleo = (visit(address) for _ in range(3))
            for each in (ann, ben):
                assert each.get(HOME)["over"] == ""
                each.post(f"{HOME}/consent", agreed=True)
            assert "all the ratings" in cleo.get(HOME)["over"]
            assert ann.get(HOME)["over"] == ""
            assert put(ann, 1, 2, 1).status_code == 200
            studies.delete(study)
            assert ann.http.get(HOME).status_code == 404
            assert put(ann, 1, 3, 2).status_code == 404
