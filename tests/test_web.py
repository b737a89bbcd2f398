"""Episodes by the page's HTTP interface."""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from xml.etree import ElementTree

import pytest

from databases import begin
from fakes import WordModel
from goalscope.agent.round import Round
from goalscope.agent.settings import Settings
from goalscope.base.types import TRACKING, Action, GoalscopeError, StepResult, Turn
from goalscope.belief.belief import Belief
from goalscope.envs.registry import load_domain
from goalscope.storage.store import Store
from goalscope.web.app import room_picture
from sites import WRITES, FailsOnce, Person, site

LAMP = Path(__file__).parents[1] / "examples" / "lamp.py"
CAKE = "I want to bake a cake. Please add flour."


@pytest.fixture
def ann(address: str, visit) -> Person:
    return visit(address)


@pytest.fixture
def mine(ann: Person) -> str:
    """The address of an episode that Ann has begun."""
    return ann.begin()


def test_a_purchase_waits_for_the_confirmation_of_the_basket_as_shown(
    ann: Person, mine: str
) -> None:
    before = ann.say(mine, CAKE)
    assert before["confirm"] is None
    waits = ann.say(mine, "Buy the basket")["confirm"]
    assert "Large Eggs" in waits["status"]
    assert ann.get(mine)["episode"]["ended"] is None

    changed = ann.say(mine, "add bananas")
    assert changed["confirm"] is None
    stale = ann.say(mine, "Buy the basket", confirmed=waits["state"])
    assert "no longer" in stale["error"]
    assert (stale["round"], stale["utterance"]) == (changed["round"], None)
    again = ann.say(mine, "Buy the basket")["confirm"]
    assert again["state"] != waits["state"]
    assert "banana" in again["status"].lower()

    assert ann.say(mine, "Buy the basket", confirmed=again["state"]) is None
    ended = ann.get(mine)
    assert ended["episode"]["ended"] == "terminated"
    bought = ended["rounds"][-1]
    assert [each["irreversible"] for each in bought["actions"]] == [True]
    assert bought["status"].splitlines()[1:] == again["status"].splitlines()[1:]
    assert not any(each["irreversible"] for r in ended["rounds"][:-1] for each in r["actions"])


@contextmanager
def heard(ann: Person, mine: str) -> Iterator[list[tuple[str, dict]]]:
    """The events that are told while the block runs, up to the end of the episode."""
    events: list[tuple[str, dict]] = []
    ready, done = threading.Event(), threading.Event()

    def listen() -> None:
        for kind, data in ann.events(mine):
            events.append((kind, data))
            ready.set()
        done.set()

    threading.Thread(target=listen, daemon=True).start()
    assert ready.wait(10)
    yield events
    assert done.wait(10)


def test_listeners_hear_each_step_the_round_and_the_end(ann: Person, mine: str) -> None:
    with heard(ann, mine) as events:
        ann.say(mine, CAKE)
        waits = ann.say(mine, "Buy the basket")["confirm"]
        ann.say(mine, "Buy the basket", confirmed=waits["state"])
    kinds = [kind for kind, _ in events]
    assert kinds[0] == "live"
    assert kinds[-1] == "ended"
    assert kinds.count("round") == 3
    steps = list(dict.fromkeys(data["step"] for kind, data in events if kind == "live"))
    assert {"scoring 1 goal", "proposing goals", "checking goals", "planning", "asking"} <= {*steps}


def test_a_goal_is_confirmed_ruled_out_reworded_and_each_taken_back(ann: Person, mine: str) -> None:
    ann.say(mine, CAKE)
    first = ann.live(mine)["belief"]["goals"]
    goals = {each["text"] for each in first}

    pinned = ann.post(f"{mine}/corrections", kind="pin", goal="feed the birds")
    assert pinned["belief"]["goals"][0] == {
        "text": "feed the birds", "probability": pytest.approx(0.99, abs=0.01),
        "unspecified": False, "pinned": True,
    }  # fmt: skip
    assert [each["kind"] for each in pinned["changes"]] == ["added", "pinned"]
    vetoed = ann.post(f"{mine}/corrections", kind="veto", goal="feed the birds")
    assert "feed the birds" not in {each["text"] for each in vetoed["belief"]["goals"]}
    assert ann.http.delete(f"{mine}/corrections").json()["belief"] == pinned["belief"]
    back = ann.http.delete(f"{mine}/corrections").json()
    assert back["belief"]["goals"] == first
    assert back["can_undo"] is False
    assert ann.http.delete(f"{mine}/corrections").status_code == 400
    assert (
        ann.http.post(f"{mine}/corrections", json={"kind": "veto", "goal": "x"}).status_code == 400
    )
    assert {each["text"] for each in ann.live(mine)["belief"]["goals"]} == goals


def test_the_evidence_of_a_goal_by_utterance_and_by_word(ann: Person, mine: str) -> None:
    ann.say(mine, CAKE)
    goal = ann.live(mine)["belief"]["goals"][0]["text"]
    (reason,) = ann.get(f"{mine}/why", goal=goal)["reasons"]
    assert reason["utterance"] == CAKE
    assert reason["probability"] == ann.live(mine)["belief"]["goals"][0]["probability"]
    assert ann.http.get(f"{mine}/why", params={"goal": "none"}).status_code == 400
    assert ann.http.get(f"{mine}/words", params={"goal": "none", "turn": 1}).status_code == 400


def test_a_round_is_answered_once(ann: Person, mine: str) -> None:
    assert ann.http.post(f"{mine}/utterances", json={"text": CAKE, "round": 2}).status_code == 409
    said = [
        ann.http.post(f"{mine}/utterances", json={"text": CAKE, "round": 1}).status_code
        for _ in range(3)
    ]
    assert said == [202, 409, 409]
    assert ann.live(mine)["round"] == 2
    assert len(ann.get(mine)["rounds"]) == 1


@pytest.mark.parametrize("text", ["", "  ", "\ud800", "x" * 2001])
def test_words_that_no_model_can_read_are_refused(ann: Person, mine: str, text: str) -> None:
    body = json.dumps({"text": text, "round": 1})
    assert ann.http.post(f"{mine}/utterances", content=body).status_code in (400, 422)
    assert ann.live(mine)["round"] == 1


def test_what_a_failing_model_could_not_read_is_kept_to_be_said_again(
    tmp_path: Path, visit
) -> None:
    model = FailsOnce()
    with site(tmp_path / "episodes.db", model) as address:
        ann = visit(address)
        mine = ann.begin()
        model.fails = True
        failed = ann.say(mine, CAKE)
        assert failed["error"] == "The model is away. Try again."
        assert failed["utterance"] == CAKE
        again = ann.say(mine, CAKE)
        assert (again["error"], again["utterance"], again["round"]) == (None, None, 2)


def test_an_episode_goes_on_after_the_server_was_started_again(tmp_path: Path, visit) -> None:
    with site(tmp_path / "episodes.db") as address:
        ann = visit(address)
        mine = ann.begin()
        before = ann.say(mine, CAKE)
    with site(tmp_path / "episodes.db") as address:
        back = visit(address)
        after = back.live(mine)
        assert after["version"] > before["version"]
        assert {**after, "version": 0} == {**before, "version": 0}
        assert back.say(mine, "And milk.")["round"] == 3


def test_a_domain_of_ones_own_is_served_and_no_file_that_a_request_names_is_run(
    tmp_path: Path, visit
) -> None:
    mine, other = tmp_path / "lamp.py", tmp_path / "other.py"
    mine.write_text(LAMP.read_text())
    other.write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()\n{LAMP.read_text()}")
    stored = {"method": "good", "model": "words", "task": "t"}
    with Store.open(tmp_path / "episodes.db") as store:
        id = begin(store, **stored, domain=str(other), settings=asdict(Settings(domain=str(other))))
    with site(tmp_path / "episodes.db", domains=[load_domain(str(mine))]) as address:
        ann = visit(address)
        (served,) = ann.get("/api/options")["domains"]
        assert served == {
            "name": str(mine), "title": "lamp", "about": "The agent looks after a lamp.",
            "view": "text", "scenes": [],
        }  # fmt: skip
        episode = ann.begin()
        ann.say(episode, "turn on lamp")
        shown = ann.get(episode)
        assert (shown["episode"]["domain"], shown["episode"]["view"]) == (str(mine), "text")
        assert shown["rounds"][0]["status"] == "The lamp is on."
        assert ann.say(episode, "Good night") is None
        for name in (str(other), "grocery", "numpy"):
            refused = ann.post("/api/episodes", 400, domain=name)["error"]
            assert refused == f"There is no domain '{name}' here, but {mine}."
        assert ann.get(f"/api/episodes/{id}")["live"] is None
        assert ann.post("/api/tracking/open_session")["task"] == "The agent looks after a lamp."
    assert not (tmp_path / "ran").exists()


def test_the_room_is_drawn_as_it_was_after_a_round(address: str, visit) -> None:
    ann = visit(address)
    mine = ann.begin(domain="house", scene="Kitchen1")
    ann.say(mine, "Please put the apple in the fridge.")
    start, after = (
        ann.http.get(f"{mine}/picture.svg", params={"round": number}).text for number in (0, 1)
    )
    assert ElementTree.fromstring(start).tag.endswith("svg")
    assert ElementTree.fromstring(after).tag.endswith("svg")
    done = ann.get(mine)["rounds"][0]["actions"]
    assert (start != after) == any(each["ok"] for each in done)


def test_the_room_of_a_simulated_person_is_their_own(tmp_path: Path) -> None:
    settings = asdict(Settings(domain="house", human="scripted"))
    opened = StepResult(Action("open", "safe"), True, "The safe is open.")
    rounds = [Round(1, Turn("", "Hi."), Belief.uniform(()), (), (opened,), 0, "", (), True)]
    with Store.open(tmp_path / "episodes.db") as store:
        id = begin(
        store,
            domain="house", method="good", model="m", task="t", profile="valuables-in-safe",
            settings=settings,
        )  # fmt: skip
        pictures = [room_picture(store.episode(id), each) for each in ([], rounds)]
    assert pictures[0] != pictures[1]


def test_what_cannot_go_on_here_is_only_shown(tmp_path: Path, visit) -> None:
    begun = {"domain": "grocery", "method": "good", "model": "words", "task": "t"}
    with Store.open(tmp_path / "episodes.db") as store:
        ids = [
            begin(store, **begun | changes, settings=asdict(Settings()))
            for changes in (
                {},
                {"profile": "baker"},
                {"model": "other"},
                {"domain": "/my.py"},
                {"domain": TRACKING},
            )
        ]
    with site(tmp_path / "episodes.db") as address:
        ann = visit(address)
        shown = [ann.get(f"/api/episodes/{id}")["live"] for id in ids]
        assert [bool(live) for live in shown] == [True, False, False, False, False]
        for id in ids[1:]:
            said = {"text": "hi", "round": 1}
            answer = ann.http.post(f"/api/episodes/{id}/utterances", json=said)
            assert answer.status_code == 409


class FullDisk(Store):
    """Fails to write when it is told to, at the last moment."""

    full = False

    @contextmanager
    def writing(self):
        with super().writing() as connection:
            yield connection
            if self.full:
                raise GoalscopeError("The disk is full: free some space.")


def test_what_could_not_be_stored_has_not_been(tmp_path: Path, visit, monkeypatch) -> None:
    monkeypatch.setattr("sites.Store", FullDisk)
    with site(tmp_path / "episodes.db") as address:
        ann = visit(address)
        mine = ann.begin()
        ann.say(mine, CAKE)
        pinned = ann.post(f"{mine}/corrections", kind="pin", goal="feed the birds")
        waits = ann.say(mine, "Buy the basket")["confirm"]
        vetoed = ann.post(f"{mine}/corrections", kind="veto", goal="feed the birds")
        before = ann.live(mine)
        monkeypatch.setattr(FullDisk, "full", True)

        failed = ann.say(mine, "Buy the basket", confirmed=waits["state"])
        assert "The disk is full" in failed["error"]
        assert (failed["round"], failed["belief"]) == (before["round"], vetoed["belief"])
        refused = ann.http.post(f"{mine}/corrections", json={"kind": "pin", "goal": "sleep"})
        assert refused.status_code == 503
        assert ann.http.delete(f"{mine}/corrections").status_code == 503
        assert ann.live(mine)["belief"] == vetoed["belief"] != pinned["belief"]
        assert ann.get(mine)["episode"]["ended"] is None

        monkeypatch.setattr(FullDisk, "full", False)
        assert failed["confirm"] == waits
        assert ann.say(mine, "Buy the basket", confirmed=waits["state"]) is None
        rounds = ann.get(mine)["rounds"]
        assert [each["number"] for each in rounds] == [1, 2, 3]
        assert sum(a["irreversible"] for each in rounds for a in each["actions"]) == 1


def test_an_end_is_stored_with_its_round(tmp_path: Path, visit, monkeypatch) -> None:
    """Between the two, the machine may stop; what was bought could then be bought again."""

    def killed(*args, **given) -> None:
        raise SystemExit

    monkeypatch.setattr(Store, "finish", killed)
    with site(tmp_path / "episodes.db") as address:
        ann = visit(address)
        mine = ann.begin()
        ann.say(mine, CAKE)
        waits = ann.say(mine, "Buy the basket")["confirm"]
        assert ann.say(mine, "Buy the basket", confirmed=waits["state"]) is None
        assert ann.get(mine)["episode"]["ended"] == "terminated"


def test_an_episode_that_has_gone_on_elsewhere_is_read_anew(tmp_path: Path, visit) -> None:
    with site(tmp_path / "a.db") as one, site(tmp_path / "a.db") as other:
        ann = visit(one)
        mine = ann.begin()
        ann.say(mine, CAKE)
        there = visit(other)
        there.say(mine, "And milk.")
        assert ann.live(mine)["round"] == 3
        assert ann.say(mine, "And eggs.")["round"] == 4
        assert there.live(mine)["round"] == 4


def test_what_could_not_be_opened_is_tried_again(tmp_path: Path, visit) -> None:
    with site(tmp_path / "episodes.db") as address:
        ann = visit(address)
        mine = ann.begin()
        ann.say(mine, CAKE)
        ann.post(f"{mine}/corrections", kind="pin", goal="feed the birds")
    model = FailsOnce()
    with site(tmp_path / "episodes.db", model) as address:
        back = visit(address)
        model.fails = True
        assert back.live(mine)["error"] == "The model is away. Try again."
        for kind, live in back.events(mine):
            if kind == "live" and live["phase"] == "idle":
                break
        assert (live["error"], live["round"]) == (None, 2)


class Slow(WordModel):
    gate = threading.Event()
    at_work = threading.Event()

    def generate(self, *args, **given):
        self.at_work.set()
        self.gate.wait(10)
        return super().generate(*args, **given)


def test_reasons_can_be_read_while_a_round_runs(tmp_path: Path, visit) -> None:
    Slow.gate.set()
    with site(tmp_path / "episodes.db", Slow(WRITES)) as address:
        ann = visit(address)
        mine = ann.begin()
        goal = ann.say(mine, CAKE)["belief"]["goals"][0]["text"]
        Slow.gate.clear()
        Slow.at_work.clear()
        said = "Perhaps my aunt will cycle to us through the woods."
        ann.post(f"{mine}/utterances", 202, text=said, round=2)
        assert Slow.at_work.wait(10)
        try:
            assert len(ann.get(f"{mine}/why", goal=goal)["reasons"]) == 1
        finally:
            Slow.gate.set()
