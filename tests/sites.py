"""A real server of the page on a free port, over a small honest model."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
import uvicorn

from fakes import GOALS, NEEDS, QUESTION, WordModel
from goalscope.agent.settings import Settings
from goalscope.base.types import ModelError
from goalscope.envs.registry import BUILT_IN
from goalscope.models import Model
from goalscope.storage.store import Store
from goalscope.web.app import create_app
from goalscope.web.guard import KEY_COOKIE, Guard

KEY = "the-key-of-the-host-in-tests"
ENTERED = {KEY_COOKIE: Guard(None, hosts=(), key=KEY)._proof}
"""The cookie of a browser in which the address with the key was opened."""
WRITES = {
    "Person: zyx wvu tsr": "none",
    GOALS: "bake a cake\nbake bread with flour",
    NEEDS: "needed: flour, sugar",
    QUESTION: "What do you like?",
}


class FailsOnce(WordModel):
    """Fails in the next call after `fails` was set."""

    fails = False

    def __init__(self) -> None:
        super().__init__(WRITES)

    def token_logprobs(self, contexts, continuations):
        if self.fails:
            self.fails = False
            raise ModelError("The model is away. Try again.")
        return super().token_logprobs(contexts, continuations)


class Person:
    """A browser without a screen; it has entered, keeps its cookies and names its origin."""

    patience = 60
    """Seconds that they wait for the agent."""

    def __init__(self, address: str, **options: Any) -> None:
        options = {"cookies": ENTERED, "timeout": 60, **options}
        self.http = httpx.Client(base_url=address, headers={"origin": address}, **options)

    def get(self, path: str, **query: Any) -> Any:
        answer = self.http.get(path, params=query)
        assert answer.status_code == 200, answer.text
        return answer.json()

    def post(self, path: str, status: int = 200, **body: Any) -> Any:
        answer = self.http.post(path, json=body)
        assert answer.status_code == status, answer.text
        return answer.json()

    def begin(self, **body: Any) -> str:
        return "/api/episodes/" + self.post("/api/episodes", 201, **body)["id"]

    def live(self, episode: str) -> Mapping[str, Any]:
        """How the episode stands once the agent is at rest."""
        end, pause = time.monotonic() + self.patience, 0.01
        while (live := self.get(episode)["live"]) and live["phase"] != "idle":
            assert time.monotonic() < end, live
            time.sleep(pause)
            pause = min(1.5 * pause, 2.0)  # a hundred who ask all the time keep the agent from work
        return live

    def say(self, episode: str, text: str, **more: Any) -> Mapping[str, Any]:
        """Say something, and wait for how it then stands."""
        self.post(
            f"{episode}/utterances", 202, text=text, round=self.live(episode)["round"], **more
        )
        return self.live(episode)

    def events(self, episode: str) -> Iterator[tuple[str, Any]]:
        with self.http.stream("GET", f"{episode}/events") as answer:
            kind = ""
            for line in answer.iter_lines():
                if line.startswith("event: "):
                    kind = line.removeprefix("event: ")
                elif line.startswith("data: "):
                    yield kind, json.loads(line.removeprefix("data: "))


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A page of a test file's own."""
    with site(tmp_path_factory.mktemp("site") / "episodes.db") as running:
        yield running


@pytest.fixture
def visit() -> Iterator[Callable[..., Person]]:
    """Lets people visit a server; they leave when the test ends."""
    people: list[Person] = []

    def enter(address: str, **options: Any) -> Person:
        people.append(Person(address, **options))
        return people[-1]

    yield enter
    for person in people:
        person.http.close()


@contextmanager
def site(
    store: Path | str,
    model: Model | None = None,
    domains: Sequence[str] = BUILT_IN,
    **guard: Any,
) -> Iterator[str]:
    """The address of a running server."""
    with socket.create_server(("127.0.0.1", 0)) as listening, Store.open(store) as opened:
        host = f"127.0.0.1:{listening.getsockname()[1]}"
        app = create_app(opened, model or WordModel(WRITES), Settings(), domains)
        guarded = Guard(app, **{"hosts": [host], "key": KEY, **guard})
        config = uvicorn.Config(
            guarded, log_level="critical", timeout_graceful_shutdown=1, proxy_headers=False
        )
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        try:
            while not server.started:
                time.sleep(0.01)
            yield f"http://{host}"
        finally:
            server.should_exit = True
            thread.join()
