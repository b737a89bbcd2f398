"""Goal tracking over the Model Context Protocol, spoken with a real process."""

import asyncio
import json
import re
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from processes import arguments, environment, started

pytest.importorskip("mcp")

from mcp import Client, StdioServerParameters

TASK = "Help in the kitchen."
GOALS = ["bake a cake", "cook tomato soup"]
CAKE = "I bake a cake, a big cake."

Ask = Callable[..., Awaitable[Any]]


@pytest.fixture
def speak(tmp_path: Path) -> Callable[[Callable[[Ask], Awaitable[None]]], None]:
    """Runs a conversation with a server that starts for it; the store stays."""

    async def session(conversation: Callable[[Ask], Awaitable[None]]) -> None:
        command, *rest = arguments("mcp", "--store", str(tmp_path / "episodes.db"))
        parameters = StdioServerParameters(command=command, args=rest, env=environment())
        async with Client(parameters) as client:

            async def ask(tool: str, **given: Any) -> Any:
                answer = await client.call_tool(tool, given)
                if answer.is_error:
                    return "".join(each.text for each in answer.content)
                return answer.structured_content

            ask.client = client
            await conversation(ask)

    return lambda conversation: asyncio.run(session(conversation))


def test_the_tools_say_what_they_take_and_give(speak) -> None:
    async def conversation(ask) -> None:
        tools = {each.name: each for each in (await ask.client.list_tools()).tools}
        assert {"open_session", "observe", "belief", "correct", "why"} <= tools.keys()
        for tool in tools.values():
            assert tool.description
            assert len(tool.description) < 120
            assert tool.output_schema
            assert all(each.get("description") for each in tool.input_schema["properties"].values())
        assert tools["correct"].input_schema["properties"]["kind"]["enum"] == [
            "pin", "veto", "reword",
        ]  # fmt: skip

    speak(conversation)


def test_a_belief_is_kept_corrected_explained_and_goes_on_after_a_restart(speak) -> None:
    kept: list[Any] = []

    async def first(ask) -> None:
        opened = await ask("open_session", task=TASK, goals=GOALS)
        assert (opened["turn"], opened["advice"]) == (0, "ask")
        id = opened["id"]
        told = await ask("observe", session=id, utterance=CAKE, query="Yes?", turn=1)
        assert await ask("observe", session=id, utterance=CAKE, query="Yes?", turn=1) == told
        assert (await ask("belief", session=id)) == told
        assert told["belief"]["goals"][0]["text"] == "bake a cake"
        assert told["advice"] in ("act", "ask")
        why = await ask("why", session=id)
        assert (why["goal"], why["reasons"][0]["utterance"]) == ("bake a cake", CAKE)
        pinned = await ask("correct", session=id, kind="pin", goal="make tea")
        assert pinned["belief"]["goals"][0]["pinned"]
        assert pinned["advice"] == "act"
        added = await ask("add_goals", session=id, goals=["wash the car"])
        assert len(added["belief"]["goals"]) == 5
        kept.append(added)

    async def second(ask) -> None:
        (before,) = kept
        id = before["id"]
        assert await ask("belief", session=id) == before
        assert (await ask("observe", session=id, utterance="soup"))["turn"] == 2
        closed = await ask("close_session", session=id)
        assert (closed["closed"], closed["advice"]) == (True, None)
        assert "This session is closed." in await ask("observe", session=id, utterance="soup")

    speak(first)
    speak(second)


def test_sessions_are_listed_and_deleted(speak) -> None:
    async def conversation(ask) -> None:
        ids = [(await ask("open_session", task=TASK))["id"] for _ in range(3)]
        await ask("observe", session=ids[1], utterance=CAKE)
        await ask("close_session", session=ids[1])
        listed = (await ask("list_sessions"))["sessions"]
        assert [(each["id"], each["turns"], each["closed"]) for each in listed] == [
            (ids[2], 0, False), (ids[1], 1, True), (ids[0], 0, False),
        ]  # fmt: skip
        assert await ask("delete_session", session=ids[1]) == {"deleted": ids[1]}
        (last,) = (await ask("list_sessions", limit=1, offset=1))["sessions"]
        assert (last["id"], last["task"]) == (ids[0], TASK)
        assert "no tracking session" in await ask("belief", session=ids[1])

    speak(conversation)


def test_an_answer_is_short(speak) -> None:
    async def conversation(ask) -> None:
        goals = [f"bake {number} cakes" for number in range(40)]
        id = (await ask("open_session", task=TASK, goals=goals))["id"]
        given = {"session": id, "utterance": CAKE}
        for answer in (
            await ask.client.call_tool("observe", given),
            await ask.client.call_tool("why", {"session": id}),
        ):
            (content,) = answer.content
            assert json.loads(content.text) == answer.structured_content
            assert len(content.text.splitlines()) == 1
            assert not re.search(r"\d\.\d{5}", content.text)
        told = await ask("belief", session=id)
        assert len(told["belief"]["goals"]) == 10
        assert told["notes"] == ["Of 41 goals, the 10 likeliest are shown."]
        assert told["belief"]["set_90"] is None

    speak(conversation)


def test_an_error_is_a_sentence(speak) -> None:
    async def conversation(ask) -> None:
        id = (await ask("open_session", task=TASK, goals=GOALS))["id"]
        await ask("observe", session=id, utterance=CAKE)
        for sentence, tool, given in [
            ("There is no tracking session 'x'.", "belief", {"session": "x"}),
            ("The utterance is empty.", "observe", {"session": id, "utterance": " "}),
            ("longer than 4000", "observe", {"session": id, "utterance": "x" * 4001}),
            ("with different words", "observe", {"session": id, "utterance": "no", "turn": 1}),
            ("The next turn is 2", "observe", {"session": id, "utterance": "no", "turn": 3}),
            ("There is no goal 'x'", "correct", {"session": id, "kind": "veto", "goal": "x"}),
            ("at most 200", "add_goals", {"session": id, "goals": [str(n) for n in range(199)]}),
            (
                "correct cannot be called so. kind: Input should be 'pin', 'veto' or 'reword'. "
                "It takes session, kind, goal, text.",
                "correct", {"session": id, "kind": "praise", "goal": GOALS[0]},
            ),
            ("utterance: Field required", "observe", {"session": id}),
            (
                "observe takes session, utterance, query, turn, and no 'text'.",
                "observe", {"session": id, "utterance": CAKE, "text": CAKE},
            ),
            ("limit: Input should be", "list_sessions", {"limit": 0}),
            ("There is no tracking session 'x'.", "delete_session", {"session": "x"}),
            ("The new wording is empty.", "correct",
             {"session": id, "kind": "reword", "goal": GOALS[0]}),
            ("goals.1: Input should be a valid string", "open_session",
             {"task": TASK, "goals": ["tea", 2]}),
            ("There is no tool 'forget', but open_session, observe, ", "forget", {}),
        ]:  # fmt: skip
            found = await ask(tool, **given)
            assert sentence in found
            assert not re.search("Traceback|pydantic|Error executing", found)
            assert len(found.splitlines()) == 1
        assert (await ask("belief", session=id))["turn"] == 1

    speak(conversation)


class Wire:
    """The protocol by hand: a line of JSON for each message."""

    def __init__(self, store: Path) -> None:
        self.process = started("mcp", "--store", str(store))
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
    wire = Wire(tmp_path / "episodes.db")
    id = wire.call("open_session", task=TASK, goals=GOALS)["id"]
    told = wire.call("observe", session=id, utterance=CAKE, turn=1)
    wire.process.kill()
    wire.process.communicate()
    again = Wire(tmp_path / "episodes.db")
    assert again.call("belief", session=id) == told
    assert again.call("observe", session=id, utterance=CAKE, turn=1) == told
    rest, _ = again.process.communicate()
    assert (rest, again.process.returncode) == ("", 0)


@pytest.mark.parametrize("option", ["--model", "--generator", "--scorer", "--adapter"])
def test_a_model_that_is_not_there_is_refused_at_the_start(tmp_path: Path, option: str) -> None:
    from test_cli import fails

    named = tmp_path / "nope.gguf"
    line = fails(1, "mcp", option, named, "--store", tmp_path / "episodes.db")
    assert str(named) in line
