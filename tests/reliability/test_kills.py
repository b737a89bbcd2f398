"""Whatever stops a run and at whatever moment: nothing that was told is lost, nothing is doubled."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
from collections.abc import Sequence
from itertools import chain, count
from pathlib import Path
from typing import Any

import lives as fork
import pytest
from lives import Lives, episode, experiment, furnish, rounds_of, signalled
from sqlalchemy.engine.default import DefaultDialect

from fakes import LampRoom, WordModel, words
from goalscope.domains import Settings, open_environment
from goalscope.envs.grocery import GroceryShop
from goalscope.experiment.results import Results
from goalscope.experiment.tables import tables_of
from goalscope.rounds_json import round_to_json
from goalscope.session import Session
from goalscope.store import Store
from goalscope.types import Action, StepResult, Turn
from test_agent import REPLIES

lives = fork.lives
DATABASES = ("sqlite", "postgresql")
KILLS = [12, pytest.param(200, marks=pytest.mark.slow)]


def measured(folder: Path) -> tuple[dict[str, Any], list[Any]]:
    """Cells by key, each with its episode in it, and the tables less what counts the attempts."""
    with Results.open(folder / "tiny.db") as results:
        cells = {}
        for cell in results.cells():
            found = dict(cell.result or {})
            if "episode" in found:
                found["episode"] = [
                    round_to_json(each) for each in results.rounds(found["episode"])
                ]
            cells[cell.key] = (cell.spec, {k: v for k, v in found.items() if k != "seconds"})
        tables = [table.to_dict() for table in tables_of(results)]
    for table in tables:
        drop = {n for n, name in enumerate(table["columns"]) if name == "retries"}
        table["rows"] = [[e for n, e in enumerate(row) if n not in drop] for row in table["rows"]]
        table["command"] = ""
    return cells, tables


@pytest.fixture(scope="module")
def whole(lives: Lives, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any, Any, Any]:
    """A folder, and what an experiment and an episode come to there without an interruption."""
    folder = furnish(tmp_path_factory.mktemp("whole") / "run")
    for life in (experiment, episode):
        assert lives.live(life, folder) == 0, (folder / "errors").read_text()
    (rounds,) = rounds_of(folder / "s.db")
    return folder, *measured(folder), rounds


def anew(folder: Path) -> Path:
    shutil.rmtree(folder)
    return furnish(folder)


@pytest.mark.parametrize("kills", KILLS)
def test_a_killed_experiment_loses_and_doubles_nothing(
    lives: Lives, whole: Any, kills: int, record_property: Any
) -> None:
    folder, cells, tables, _ = whole
    chance, killed, interrupted, runs, told = random.Random(kills), 0, 0, 0, 0
    while killed < kills:
        folder, runs, heard = anew(folder), runs + 1, set[str]()
        for part, how in enumerate((signal.SIGKILL, signal.SIGINT) * 2, 1):
            until = chance.randint(0, max(0, part * len(cells) // 5 - len(heard)))
            life = lives.begin(experiment, folder)
            code = signalled(life, how, until, 0.05 * chance.random())
            killed += code == -signal.SIGKILL
            interrupted += code == 130
            assert code in (0, 130, -signal.SIGKILL), (folder / "errors").read_text()
            assert heard.isdisjoint(life.said()), "measured twice"
            heard |= {*life.said()}
            told += len(life.said())
            if (folder / "tiny.db").exists():
                with Results.open(folder / "tiny.db") as results:
                    kept = {cell.key for cell in results.cells() if cell.result}
                assert heard <= kept
                rounds_of(folder / "tiny.db")
        assert lives.live(experiment, folder) == 0
        again, same = measured(folder)
        assert again == cells
        assert same == tables
        assert len(rounds_of(folder / "tiny.db")) == sum("episode" in c for _, c in cells.values())
    record_property(
        "measured",
        f"{runs} experiments with {killed} SIGKILLs and {interrupted} SIGINTs at random moments: "
        f"0 of {told:,} cells that were told of lost, 0 doubled, the same tables",
    )


@pytest.mark.parametrize("kills", KILLS)
def test_a_killed_episode_loses_and_doubles_no_round(
    lives: Lives, whole: Any, kills: int, record_property: Any
) -> None:
    folder, *_, rounds = whole
    chance, killed, interrupted, runs, told = random.Random(kills), 0, 0, 0, 0
    while killed < kills:
        folder, runs, heard = anew(folder), runs + 1, list[int]()
        for part, how in enumerate((signal.SIGKILL, signal.SIGINT) * 2, 1):
            until = chance.randint(0, max(0, part * len(rounds) // 5 - len(heard)))
            life = lives.begin(episode, folder)
            code = signalled(life, how, until, 0.05 * chance.random())
            killed += code == -signal.SIGKILL
            interrupted += code == 130
            assert code in (0, 130, -signal.SIGKILL), (folder / "errors").read_text()
            fresh_ones = [int(line) for line in life.said()]
            told += len(fresh_ones)
            heard += fresh_ones
            if not (folder / "s.db").exists():
                continue
            found = rounds_of(folder / "s.db")
            assert len(found) <= 1
            kept = found[0] if found else ()
            assert kept == rounds[: len(kept)]
            assert len(set(heard)) == len(heard) <= len(kept)
            if code == 0:
                break
        if code:
            assert lives.live(episode, folder) == 0, (folder / "errors").read_text()
        assert rounds_of(folder / "s.db") == [rounds]
    record_property(
        "measured",
        f"{runs} episodes with {killed} SIGKILLs and {interrupted} SIGINTs at random moments: "
        f"0 of {told:,} rounds that were shown lost, 0 acts doubled, each episode as if it had "
        "never been stopped",
    )


def dying(at: int, *worlds: type) -> None:
    """Have this process end at a moment: the n-th before or after a commit, a reset, or an act."""
    moments = count()

    def around(owner: type, name: str) -> None:
        do = getattr(owner, name)

        def done(*given: Any) -> Any:
            for step in (lambda: None, lambda: do(*given)):
                found = step()
                if next(moments) == at:
                    os._exit(9)
            return found

        setattr(owner, name, done)

    around(DefaultDialect, "do_commit")
    for world in worlds:
        around(world, "reset")
        around(world, "step")


class LastingRoom(LampRoom):
    """A room that outlives the process: what was done stays done until it is reset."""

    def __init__(self, file: Path) -> None:
        super().__init__(())
        self.file = file
        if file.exists():
            self.on, self.smashed = json.loads(file.read_text())

    def reset(self) -> None:
        super().reset()
        self._keep()

    def step(self, action: Action) -> StepResult:
        found = super().step(action)
        self._keep()
        return found

    def requests(self, turns: Sequence[Turn]) -> list[Action]:
        asked = turns[-2 if turns[-1].utterance == "yes" else -1].utterance.lower()
        kinds = {"vase": "smash", "red": "switch on", "green": "switch on", "blue": "switch on"}
        done = {*self.on, *self.smashed}
        return [Action(kinds[w], w) for w in words(asked) if w in kinds and w not in done]

    def _keep(self) -> None:
        self.file.write_text(json.dumps([self.on, self.smashed]))


SAID = {
    "shop": [
        "Please add cocoa powder.", "2 packs of plain flour, please.", "Please remove the flour.",
        "Add whole milk and green tea.", "Buy the basket",
    ],
    "room": ["The red and the green.", "Smash the vase.", "yes", "Now the blue.", "Good night"],
}  # fmt: skip


def conversation(folder: str, world: str, place: str, at: str) -> None:
    """An episode that begins or goes on, and dies at a moment; says the state at its end."""
    dying(int(at), GroceryShop, LastingRoom)
    settings = Settings(method="no-goals", catalogue=f"{folder}/shop.csv")
    env: Any = LastingRoom(Path(folder, "room"))
    if world == "shop":
        env = open_environment(settings)
    with Store.open(place) as store:
        infos = store.episodes()
        session = Session(
            store, settings, env, WordModel(REPLIES), resume=infos[0] if infos else None,
            read=lambda query: SAID[world][len(session.turns)],
        )  # fmt: skip
        list(session.run())
    print(env.fingerprint())


def acts_of(place: str) -> list[str]:
    with Store.open(place) as store:
        (info,) = store.episodes()
        assert info.ended == "terminated"
        return [str(r.action) for round in store.rounds(info.id) for r in round.results if r.ok]


@pytest.mark.parametrize("world", list(SAID))
@pytest.mark.parametrize(
    ("database", "stride"),
    [("sqlite", 5), *(pytest.param(d, 1, marks=pytest.mark.slow) for d in DATABASES)],
)
def test_each_act_is_done_once_whenever_the_process_ends(
    lives: Lives, tmp_path: Path, world: str, database: str, stride: int,
    request: pytest.FixtureRequest, record_property: Any,
) -> None:  # fmt: skip
    folder, ends, deaths = furnish(tmp_path), list[Any](), 0
    for at in chain([-1], count(0, stride)):
        (folder / "room").unlink(missing_ok=True)
        place = str(folder / f"{at}.db")
        if database == "postgresql":
            place = request.getfixturevalue("server").new()
        codes = [lives.live(conversation, folder, world, place, str(at)) for _ in range(2)]
        life = lives.begin(conversation, folder, world, place, "-1")
        assert life.ends() == 0, (folder / "errors").read_text()
        ends.append((acts_of(place), life.said(), rounds_of(place)))
        assert ends[-1] == ends[0]
        deaths += codes.count(9)
        if at >= 0 and codes == [0, 0]:
            break
    acts = ends[0][0]
    assert len(acts) == len(set(acts)) >= 4
    assert deaths > len(ends) > 4
    record_property(
        "measured",
        f"{world}, {database}: ended at {len(ends) - 2} moments before and after each commit, "
        f"reset and act, and again in what follows ({deaths} deaths): each of {len(acts)} acts "
        "once in the state and once in the store",
    )


def dying_experiment(folder: str, at: str) -> None:
    dying(int(at))
    experiment(folder)


@pytest.mark.parametrize("stride", [40, pytest.param(1, marks=pytest.mark.slow)])
def test_an_experiment_may_end_before_and_after_each_commit(
    lives: Lives, whole: Any, stride: int, record_property: Any
) -> None:
    folder, cells, tables, _ = whole
    for deaths, at in enumerate(count(0, stride)):
        anew(folder)
        code = lives.live(dying_experiment, folder, str(at))
        if code == 0:
            break
        assert code == 9, (folder / "errors").read_text()
        assert lives.live(experiment, folder) == 0, (folder / "errors").read_text()
        assert measured(folder) == (cells, tables)
        episodes = rounds_of(folder / "tiny.db")
        assert len(episodes) == sum("episode" in found for _, found in cells.values())
    assert deaths > 2
    record_property("measured", f"ended at {deaths} of {at} moments: the same cells and tables")
