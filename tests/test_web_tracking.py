"""Goal tracking over HTTP and over the Model Context Protocol: the same operations and answers."""

import asyncio
import json
import re
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from fakes import WordModel
from goalscope.storage.store import Store
from goalscope.storage.tracking import Trackers
from processes import started
from sites import KEY, WRITES, site

LAMP = Path(__file__).parents[1] / "examples" / "lamp.py"
TASK = "Help in the kitchen."
GOALS = ["bake a cake", "cook tomato soup"]
SAID = "I bake a cake, a big cake."

Ask = Callable[..., Any]


class Program(httpx.Client):
    """A program that has the key, and no cookies."""

    def __init__(self, address: str, key: str = KEY) -> None:
        super().__init__(base_url=address, headers={"authorization": f"Bearer {key}"}, timeout=60)

    def ask(self, operation: str, **given: Any) -> Any:
        """The answer, or the sentence of an error."""
        answer = self.post(f"/api/tracking/{operation}", json=given)
        return answer.json() if answer.is_success else answer.json()["error"]


@pytest.fixture
def program(address: str) -> Iterator[Program]:
    with Program(address) as program:
        yield program


def over_mcp(trackers: Trackers) -> Ask:
    """Calls tools in this process."""
    pytest.importorskip("mcp")
    from mcp.server.mcpserver.exceptions import ToolError

    from goalscope.web.mcp import create_server

    server = create_server(trackers)

    def ask(tool: str, **given: Any) -> Any:
        try:
            return asyncio.run(server.call_tool(tool, given)).structured_content
        except ToolError as error:
            return str(error)

    return ask


@pytest.fixture(params=["http", "mcp"])
def ask(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Ask]:
    """Asks for an operation in one of two ways."""
    if request.param == "http":
        yield request.getfixturevalue("program").ask
    else:
        with Store.open(tmp_path / "episodes.db") as store:
            yield over_mcp(Trackers(store, lambda: WordModel(WRITES)))


def test_a_belief_is_kept_corrected_and_explained(ask: Ask) -> None:
    opened = ask("open_session", task=TASK, goals=GOALS)
    assert (opened["turn"], opened["advice"]) == (0, "ask")
    id = opened["id"]
    told = ask("observe", session=id, query="Yes?", utterance=SAID, turn=1)
    assert (told["turn"], told["closed"], told["belief"]["set_90"]) == (1, False, None)
    assert told["belief"]["goals"][0]["text"] == "bake a cake"
    assert ask("observe", session=id, query=" Yes? ", utterance=SAID, turn=1) == told
    assert ask("belief", session=id) == told
    assert len(ask("add_goals", session=id, goals=["make tea"])["belief"]["goals"]) == 4
    pinned = ask("correct", session=id, kind="pin", goal="make tea")
    assert pinned["belief"]["goals"][0]["pinned"]
    assert (pinned["advice"], pinned["because"][:15]) == ("act", '"make tea" has ')
    assert [each["kind"] for each in pinned["changes"]] == ["added", "pinned"]
    why = ask("why", session=id, goal="bake a cake")
    assert [each["utterance"] for each in why["reasons"]] == [SAID]
    closed = ask("close_session", session=id)
    assert (closed["closed"], closed["advice"], closed["because"]) == (True, None, None)
    assert "This session is closed." in ask("observe", session=id, utterance="soup")


def test_one_goal_at_most_is_shown_as_confirmed(ask: Ask) -> None:
    id = ask("open_session", task=TASK, goals=GOALS)["id"]
    for said in ("Well.", "Hm."):
        for goal in (*GOALS, "make tea"):
            told = ask("correct", session=id, kind="pin", goal=goal)
            goals = told["belief"]["goals"]
            assert [each["text"] for each in goals if each["pinned"]] == [goal]
            assert told["in_words"].startswith(f"I think this is what you want: {goal} (99%)")
        ask("observe", session=id, utterance=said)
    told = ask("correct", session=id, kind="veto", goal="make tea")
    assert told["advice"] == "ask"
    assert not any(each["pinned"] for each in told["belief"]["goals"])


def test_a_session_without_goals_says_so_until_it_has_some(ask: Ask) -> None:
    for given in ({}, {"goals": []}):
        told = ask("open_session", task=TASK, **given)
        assert told["notes"] == ["There is no goal yet, so nothing can be inferred. Add some."]
        id = told["id"]
        assert ask("observe", session=id, utterance=SAID)["notes"] == told["notes"]
        assert "Name at least one" in ask("add_goals", session=id, goals=[])
        assert ask("add_goals", session=id, goals=GOALS)["notes"] == []
    assert ask("open_session", task=TASK, goals=[], propose=True)["notes"] == []
    assert ask("close_session", session=ask("open_session", task=TASK)["id"])["notes"] == []


def test_sessions_are_listed_and_deleted(ask: Ask) -> None:
    ids = [ask("open_session", task=TASK)["id"] for _ in range(3)]
    ask("observe", session=ids[1], utterance=SAID)
    ask("close_session", session=ids[1])
    listed = ask("list_sessions", limit=3)["sessions"]
    assert [(each["id"], each["turns"], each["closed"]) for each in listed] == [
        (ids[2], 0, False), (ids[1], 1, True), (ids[0], 0, False),
    ]  # fmt: skip
    assert ask("delete_session", session=ids[1]) == {"deleted": ids[1]}
    (last,) = ask("list_sessions", limit=1, offset=1)["sessions"]
    assert (last["id"], last["task"]) == (ids[0], TASK)
    assert "no tracking session" in ask("belief", session=ids[1])


def test_an_error_is_a_sentence(ask: Ask) -> None:
    id = ask("open_session", task=TASK, goals=GOALS)["id"]
    before = ask("observe", session=id, utterance=SAID)
    for sentence, operation, given in [
        ("There is no tracking session 'x'.", "belief", {"session": "x"}),
        ("The utterance is empty.", "observe", {"session": id, "utterance": " "}),
        ("with different words", "observe", {"session": id, "utterance": "no", "turn": 1}),
        ("The next turn is 2", "observe", {"session": id, "utterance": "no", "turn": 3}),
        ("'tea' stands twice", "open_session", {"task": TASK, "goals": ["tea", "tea"]}),
        ("'Tea.' is the same as 'tea'.", "add_goals", {"session": id, "goals": ["tea", "Tea."]}),
        ("There is no field 'utterence'. It takes ", "observe", {"session": id, "utterence": "no"}),
        ("at most 200", "add_goals", {"session": id, "goals": [str(n) for n in range(199)]}),
        ("The new wording is empty.", "correct",
         {"session": id, "kind": "reword", "goal": GOALS[0]}),
        ("kind: Input should be 'pin', 'veto' or 'reword'. It takes session, kind, goal, text.",
         "correct", {"session": id, "kind": "praise", "goal": GOALS[0]}),
        ("The field 'utterance' is missing. It takes ", "observe", {"session": id}),
        ("There is no field 'text'. It takes session, utterance, query, turn.",
         "observe", {"session": id, "utterance": SAID, "text": SAID}),
        ("limit: Input should be", "list_sessions", {"limit": 0}),
        ("goals.1: Input should be a valid string", "open_session",
         {"task": TASK, "goals": ["tea", 2]}),
    ]:  # fmt: skip
        error = ask(operation, **given)
        assert sentence in error
        assert not re.search("Traceback|pydantic|Error executing", error)
        assert len(error.splitlines()) == 1
    assert ask("belief", session=id) == before


@pytest.mark.parametrize(
    ("operation", "sent", "status", "error"),
    [
        ("open_session", {"json": [TASK]}, 422, "must be a JSON object, sent as application/json"),
        ("open_session", {"data": {"task": TASK}}, 422, "It takes task, goals, propose."),
        ("open_session", {}, 422, "must be a JSON object"),
        ("open_session", {"content": b"\xff{"}, 400, "Send a JSON object in UTF-8."),
        ("open_session", {"content": '{"task": }'}, 422, "must be a JSON object"),
        ("forget", {"json": {}}, 404, "openapi.json"),
    ],
)
def test_another_body_is_refused_with_what_is_taken(
    program: Program, operation: str, sent: dict[str, Any], status: int, error: str
) -> None:
    headers = {"content-type": "application/json"} if "content" in sent else {}
    answer = program.post(f"/api/tracking/{operation}", **sent, headers=headers)
    assert (answer.status_code, error in answer.json()["error"]) == (status, True), answer.text


def test_requests_at_the_same_time_count_once(program: Program) -> None:
    id = program.ask("open_session", task=TASK, goals=GOALS)["id"]
    answers: list[Any] = []
    given = {"session": id, "utterance": SAID, "turn": 1}
    threads = [
        threading.Thread(target=lambda: answers.append(program.ask("observe", **given)))
        for _ in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == [program.ask("belief", session=id)] * 8


class Slow(WordModel):
    """Scores what is slow only when it may."""

    def __init__(self) -> None:
        super().__init__(WRITES)
        self.begun, self.go = threading.Event(), threading.Event()

    def token_logprobs(self, contexts, continuations):
        if "slow" in continuations:
            self.begun.set()
            assert self.go.wait(20)
        return super().token_logprobs(contexts, continuations)


def test_reading_waits_for_nobody(tmp_path: Path) -> None:
    model = Slow()
    with site(tmp_path / "episodes.db", model) as address, Program(address) as program:
        id = program.ask("open_session", task=TASK)["id"]
        given = {"session": id, "utterance": "slow"}
        told = threading.Thread(target=program.ask, args=["observe"], kwargs=given)
        told.start()
        assert model.begun.wait(20)
        assert program.ask("belief", session=id)["turn"] == 0
        model.go.set()
        told.join()
        assert program.ask("belief", session=id)["turn"] == 1


def test_both_interfaces_describe_the_same_operations(program: Program, tmp_path: Path) -> None:
    pytest.importorskip("mcp")
    from goalscope.web.mcp import create_server

    with Store.open(tmp_path / "episodes.db") as store:
        server = create_server(Trackers(store, WordModel))
        tools = {each.name: each for each in asyncio.run(server.list_tools())}
    described = program.get("/api/openapi.json").json()
    schemas = described["components"]["schemas"]
    routes = {
        path.removeprefix("/api/tracking/"): ways["post"]
        for path, ways in described["paths"].items()
        if path.startswith("/api/tracking/")
    }
    assert routes.keys() == tools.keys()
    for name, tool in tools.items():
        assert tool.description == routes[name]["description"]
        assert len(tool.description) < 120
        assert tool.output_schema
        taken = tool.input_schema["properties"]
        assert taken.keys() == schemas[name]["properties"].keys()
        assert all(each["description"] for each in taken.values())
        assert routes[name]["security"] == [{"key": []}]
        answers = routes[name]["responses"]
        for status in ("400", "409", "422", "503"):
            schema = answers[status]["content"]["application/json"]["schema"]["$ref"]
            assert schema.endswith("/ErrorBody")


def test_an_answer_over_mcp_is_short(tmp_path: Path) -> None:
    with Store.open(tmp_path / "episodes.db") as store:
        ask = over_mcp(Trackers(store, WordModel))
        id = ask("open_session", task=TASK, goals=[f"bake {n} cakes" for n in range(40)])["id"]
        told = ask("observe", session=id, utterance=SAID)
        assert len(told["belief"]["goals"]) == 10
        assert told["notes"] == ["Of 41 goals, the 10 likeliest are shown."]
        assert not re.search(r"\d\.\d{5}", json.dumps([told, ask("why", session=id)]))
        assert "There is no tool 'forget', but open_session, observe, " in ask("forget")


class Wire:
    """The protocol by hand: a line of JSON for each message."""

    def __init__(self, store: Path) -> None:
        self.process = started("mcp", str(LAMP), "--store", str(store))
        self.last = 0
        told = {"name": "test", "version": "1"}
        version = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": told}
        self.ask("initialize", version)
        self.send({"method": "notifications/initialized"})

    def send(self, message: dict[str, Any]) -> None:
        assert self.process.stdin
        self.process.stdin.write(json.dumps({"jsonrpc": "2.0", **message}) + "\n")
        self.process.stdin.flush()

    def ask(self, method: str, params: dict[str, Any]) -> Any:
        """Every line that comes must be an answer."""
        assert self.process.stdout
        self.last += 1
        self.send({"id": self.last, "method": method, "params": params})
        answer = json.loads(self.process.stdout.readline())
        assert answer["id"] == self.last, answer
        return answer["result"]

    def call(self, tool: str, **given: Any) -> Any:
        return self.ask("tools/call", {"name": tool, "arguments": given})["structuredContent"]


def test_a_turn_that_was_answered_outlives_the_server(tmp_path: Path) -> None:
    pytest.importorskip("mcp")
    wire = Wire(tmp_path / "episodes.db")
    id = wire.call("open_session", task=TASK, goals=GOALS)["id"]
    told = wire.call("observe", session=id, utterance=SAID, turn=1)
    wire.process.kill()
    wire.process.communicate()
    again = Wire(tmp_path / "episodes.db")
    assert again.call("belief", session=id) == told
    assert again.call("observe", session=id, utterance=SAID, turn=1) == told
    assert again.call("open_session")["task"] == "The agent looks after a lamp."
    rest, _ = again.process.communicate()
    assert (rest, again.process.returncode) == ("", 0)


@pytest.mark.parametrize("option", ["--model", "--generator", "--scorer", "--adapter"])
def test_a_model_that_is_not_there_is_refused_at_the_start(tmp_path: Path, option: str) -> None:
    from commands import fails

    named = tmp_path / "nope.gguf"
    line = fails(1, "mcp", option, named, "--store", tmp_path / "episodes.db")
    assert str(named) in line
