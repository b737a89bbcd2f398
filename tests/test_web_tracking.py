"""Goal tracking by HTTP."""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from fakes import WordModel
from processes import started
from sites import KEY, WRITES, FailsOnce, site

TASK = "Help in the kitchen."
GOALS = ["bake a cake", "cook tomato soup"]
CAKE = {"query": "Yes?", "utterance": "I bake a cake, a big cake."}


class Program(httpx.Client):
    """A program that has the key, and no cookies."""

    def __init__(self, address: str, key: str = KEY) -> None:
        super().__init__(base_url=address, headers={"authorization": f"Bearer {key}"}, timeout=60)

    def opened(self, **more: Any) -> str:
        answer = self.post("/api/trackers", json={"task": TASK, "goals": GOALS, **more})
        assert answer.status_code == 201, answer.text
        return f"/api/trackers/{answer.json()['id']}"


@pytest.fixture
def program(address: str) -> Iterator[Program]:
    with Program(address) as program:
        yield program


@pytest.fixture
def mine(program: Program) -> str:
    """The address of a session that was opened."""
    return program.opened()


def test_a_belief_is_kept_corrected_and_explained(mine: str, program: Program) -> None:
    told = program.put(f"{mine}/turns/1", json=CAKE).json()
    assert (told["turn"], told["closed"]) == (1, False)
    assert told["belief"]["goals"][0]["text"] == "bake a cake"
    assert program.get(mine).json() == told
    more = program.post(f"{mine}/goals", json={"goals": ["make tea"]}).json()
    assert len(more["belief"]["goals"]) == 4
    pinned = program.post(f"{mine}/corrections", json={"kind": "pin", "goal": "make tea"}).json()
    assert pinned["belief"]["goals"][0]["text"] == "make tea"
    assert pinned["advice"] == "act"
    assert pinned["because"].startswith("It has ")
    assert [each["kind"] for each in pinned["changes"]] == ["added", "pinned"]
    why = program.get(f"{mine}/why", params={"goal": "bake a cake"}).json()
    assert [each["utterance"] for each in why["reasons"]] == [CAKE["utterance"]]
    assert program.get(mine).json()["belief"]["set_90"] is None
    closed = program.post(f"{mine}/close").json()
    assert (closed["closed"], closed["advice"], closed["because"]) == (True, None, None)
    assert program.put(f"{mine}/turns/2", json=CAKE).status_code == 409


def test_a_request_that_is_sent_again_counts_once(mine: str, program: Program) -> None:
    told = [program.put(f"{mine}/turns/1", json=CAKE) for _ in range(3)]
    assert {each.status_code for each in told} == {200}
    assert told[0].json() == told[1].json() == told[2].json()
    other = program.put(f"{mine}/turns/1", json={**CAKE, "utterance": "soup"})
    assert (other.status_code, other.json()) == (
        409, {"error": "Turn 1 was sent before with different words."},
    )  # fmt: skip
    assert program.put(f"{mine}/turns/3", json=CAKE).status_code == 409
    program.put(f"{mine}/turns/2", json={"utterance": "soup"})
    spaced = {name: f" {text} " for name, text in CAKE.items()}
    assert program.put(f"{mine}/turns/1", json=spaced).json() == told[0].json()
    assert program.get(mine).json()["turn"] == 2


def test_requests_at_the_same_time_count_once(mine: str, program: Program) -> None:
    found: list[int] = []

    def tell() -> None:
        found.append(program.put(f"{mine}/turns/1", json=CAKE).status_code)

    threads = [threading.Thread(target=tell) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [200] * 8
    assert program.get(mine).json()["turn"] == 1


@pytest.mark.parametrize(
    ("method", "path", "body", "status"),
    [
        ("PUT", "/turns/1", {"utterance": " "}, 400),
        ("PUT", "/turns/1", {"utterance": "x" * 4001}, 400),
        ("PUT", "/turns/1", {"query": "x" * 4001, "utterance": "a"}, 400),
        ("PUT", "/turns/1", {"utterance": "x" * 70_000}, 413),
        ("PUT", "/turns/1", {}, 422),
        ("PUT", "/turns/1", {**CAKE, "turn": 1}, 422),
        ("PUT", "/turns/0", CAKE, 422),
        ("PUT", "/turns/one", CAKE, 422),
        ("POST", "/goals", {"goals": ["x" * 501]}, 400),
        ("POST", "/goals", {"goals": [str(n) for n in range(199)]}, 400),
        ("POST", "/goals", {"goals": "bake"}, 422),
        ("POST", "/corrections", {"kind": "veto", "goal": "x"}, 400),
        ("POST", "/corrections", {"kind": "praise", "goal": "x"}, 422),
        ("POST", "/corrections", {"kind": "reword", "goal": GOALS[0]}, 400),
        ("POST", "/no", {}, 404),
        ("PUT", "", {}, 405),
        ("GET", "/why?goal=x", None, 400),
    ],
)
def test_what_cannot_be_used_is_refused_in_a_sentence(
    mine: str, program: Program, method: str, path: str, body: dict[str, Any] | None, status: int
) -> None:
    before = program.get(mine).json()
    answer = program.request(method, mine + path, json=body)
    assert answer.status_code == status
    assert answer.json()["error"].endswith((".", "a cake; cook tomato soup"))
    assert program.get(mine).json() == before


JSON = {"content-type": "application/json"}
TAKES = "It takes task, goals, propose."


@pytest.mark.parametrize(
    ("sent", "status", "error"),
    [
        ({"json": {"task": TASK, "propse": True}}, 422, f"There is no field 'propse'. {TAKES}"),
        ({"json": {"tsk": TASK}}, 422, f"There is no field 'tsk'. {TAKES}"),
        ({"json": {}}, 422, f"The field 'task' is missing. {TAKES}"),
        ({"json": [TASK]}, 422, "The body must be a JSON object, sent as application/json."),
        ({"data": {"task": TASK}}, 422, "The body must be a JSON object"),
        ({"content": '{"task": "x"}', "headers": {"content-type": "text/plain"}}, 422, "JSON obj"),
        ({}, 422, "The body must be a JSON object"),
        ({"content": '{"task": }', "headers": JSON}, 422, "not JSON: Expecting value at character"),
        (
            {"content": '{"task": "a", "task": "b"}', "headers": JSON},
            422,
            "'task' stands there twice",
        ),
        ({"content": b"\xff{", "headers": JSON}, 400, "Send a JSON object in UTF-8."),
    ],
)
def test_a_body_that_is_another_is_refused_with_what_is_taken(
    program: Program, sent: dict[str, Any], status: int, error: str
) -> None:
    before = program.get("/api/trackers").json()
    answer = program.post("/api/trackers", **sent)
    assert (answer.status_code, error in answer.json()["error"]) == (status, True), answer.text
    assert program.get("/api/trackers").json() == before


def test_what_a_request_gets_wrong_is_named(mine: str, program: Program) -> None:
    reword = program.post(f"{mine}/corrections", json={"kind": "reword", "goal": GOALS[0]})
    assert reword.json() == {"error": "The new wording is empty. Give at least one word."}
    gone = {"error": "There is no such session, or it belongs to somebody else."}
    assert program.get("/api/trackers/none").json() == gone
    assert "openapi.json" in program.get("/api/nowhere").json()["error"]
    assert "openapi.json" in program.delete("/api/trackers").json()["error"]


def test_no_session_but_of_a_tracker_is_reached(mine: str, program: Program, address: str) -> None:
    shop = program.post("/api/episodes", json={}).json()["id"]
    for method, path, body in [
        ("GET", "", None),
        ("GET", "/why", None),
        ("PUT", "/turns/1", CAKE),
        ("POST", "/goals", {"goals": ["x"]}),
        ("POST", "/corrections", {"kind": "pin", "goal": "x"}),
        ("POST", "/close", None),
        ("DELETE", "", None),
    ]:
        for unknown in ("none", shop):
            answer = program.request(method, f"/api/trackers/{unknown}{path}", json=body)
            assert answer.status_code == 404, path
    assert httpx.put(f"{address}{mine}/turns/1", json=CAKE).status_code == 403
    with Program(address, "wrong") as stranger:
        assert stranger.put(f"{mine}/turns/1", json=CAKE).status_code == 401
        assert stranger.get(mine).status_code == 401


def test_who_began_a_session_lists_and_deletes_it(address: str, visit) -> None:
    ann, ben = visit(address), visit(address)
    ann.post("/api/episodes", 201)
    ids = [ann.post("/api/trackers", 201, task=TASK, goals=GOALS)["id"] for _ in range(3)]
    ann.http.put(f"/api/trackers/{ids[1]}/turns/1", json=CAKE)
    ben.post("/api/trackers", 201, task="Ben's")
    listed = ann.get("/api/trackers")["trackers"]
    assert [(each["id"], each["rounds"]) for each in listed] == [
        (ids[2], 0), (ids[1], 1), (ids[0], 0),
    ]  # fmt: skip
    assert [each["task"] for each in ben.get("/api/trackers")["trackers"]] == ["Ben's"]
    one = ann.http.get("/api/trackers", params={"limit": 1, "offset": 1}).json()
    assert [each["id"] for each in one["trackers"]] == [ids[1]]
    gone = f"/api/trackers/{ids[1]}"
    assert ben.http.delete(gone).status_code == 404
    assert ann.get(gone)["turn"] == 1
    deleted = ann.http.delete(gone)
    assert (deleted.status_code, deleted.content) == (204, b"")
    assert [each["id"] for each in ann.get("/api/trackers")["trackers"]] == [ids[2], ids[0]]
    assert ann.http.get("/api/episodes", params={"text": "big cake"}).json()["total"] == 0
    for method in ("GET", "DELETE"):
        assert ann.http.request(method, gone).status_code == 404
    assert ann.http.put(f"{gone}/turns/2", json=CAKE).status_code == 404


def test_the_page_lists_and_shows_a_session_and_does_not_go_on_with_it(program: Program) -> None:
    id = program.opened().rpartition("/")[2]
    program.put(f"/api/trackers/{id}/turns/1", json=CAKE)
    listed = program.get("/api/episodes", params={"text": "big cake"}).json()["episodes"]
    assert id in {each["id"] for each in listed if each["domain"] == "tracking"}
    shown = program.get(f"/api/episodes/{id}").json()
    assert shown["live"] is None
    assert shown["rounds"][0]["belief"]["goals"][0]["text"] == "bake a cake"
    assert program.get(f"/api/episodes/{id}/export.html").status_code == 200
    assert program.get(f"/api/episodes/{id}/picture.svg?round=1").status_code == 400
    answer = program.post(f"/api/episodes/{id}/utterances", json={"text": "hi", "round": 2})
    assert answer.status_code == 400


class Slow(WordModel):
    """Scores what is slow only when it may."""

    def __init__(self) -> None:
        super().__init__(WRITES)
        self.begun, self.go = threading.Event(), threading.Event()

    def token_logprobs(self, contexts, continuations, *, end_of_turn=False):
        if "slow" in continuations:
            self.begun.set()
            assert self.go.wait(20)
        return super().token_logprobs(contexts, continuations, end_of_turn=end_of_turn)


def test_reading_waits_for_nobody(tmp_path: Path) -> None:
    model = Slow()
    with site(tmp_path / "episodes.db", model) as address, Program(address) as program:
        mine = program.opened()
        told = threading.Thread(
            target=program.put, args=[f"{mine}/turns/1"], kwargs={"json": {"utterance": "slow"}}
        )
        told.start()
        assert model.begun.wait(20)
        assert program.get(mine).json()["turn"] == 0
        model.go.set()
        told.join()
        assert program.get(mine).json()["turn"] == 1


def test_a_turn_that_a_failing_model_could_not_read_can_be_told_again(tmp_path: Path) -> None:
    model = FailsOnce()
    with site(tmp_path / "episodes.db", model) as address, Program(address) as program:
        mine = program.opened()
        model.fails = True
        failed = program.put(f"{mine}/turns/1", json=CAKE)
        assert (failed.status_code, failed.json()) == (
            503, {"error": "The model is away. Try again."},
        )  # fmt: skip
        assert program.get(mine).json()["turn"] == 0
        assert program.put(f"{mine}/turns/1", json=CAKE).status_code == 200


def test_a_turn_that_was_answered_outlives_the_server(tmp_path: Path) -> None:
    store = str(tmp_path / "episodes.db")

    def serve():
        process = started("serve", "--port", "0", "--store", store, GOALSCOPE_KEY=KEY)
        assert process.stdout
        return process, process.stdout.readline().split()[-1]

    process, address = serve()
    with Program(address) as program:
        mine = program.opened()
        told = program.put(f"{mine}/turns/1", json=CAKE).json()
        process.kill()
    process.communicate()
    process, address = serve()
    with Program(address) as program:
        assert program.get(mine).json() == told
        assert program.put(f"{mine}/turns/1", json=CAKE).json() == told
        assert program.put(f"{mine}/turns/2", json=CAKE).json()["turn"] == 2
    process.terminate()
    process.communicate()


def test_the_interface_describes_itself(program: Program) -> None:
    described = program.get("/api/openapi.json").json()
    observe = described["paths"]["/api/trackers/{id}/turns/{turn}"]["put"]
    answer = observe["responses"]["200"]["content"]["application/json"]["schema"]["$ref"]
    view = described["components"]["schemas"][answer.rpartition("/")[2]]
    assert view["properties"]["advice"]["anyOf"] == [
        {"type": "string", "enum": ["act", "ask", "propose"]}, {"type": "null"},
    ]  # fmt: skip
    schemes = described["components"]["securitySchemes"]
    assert [each for way in observe["security"] for each in way] == [*schemes]
    assert [(each["type"], each["scheme"]) for each in schemes.values()] == [("http", "bearer")]
    assert observe["description"]
    mine = program.opened()
    program.delete(mine)
    told = [
        program.get(mine),
        program.put(f"{mine}/turns/0", json=CAKE),
        program.post("/api/trackers", json={"task": " "}),
    ]
    for answer, path, method in (
        (told[0], "/api/trackers/{id}", "get"),
        (told[1], "/api/trackers/{id}/turns/{turn}", "put"),
        (told[2], "/api/trackers", "post"),
    ):
        ways = described["paths"][path][method]["responses"]
        refused = ways[str(answer.status_code)]["content"]["application/json"]["schema"]["$ref"]
        schema = described["components"]["schemas"][refused.rpartition("/")[2]]
        assert set(schema["properties"]) == set(answer.json()) == {"error"}
