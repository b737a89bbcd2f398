"""Whatever stops a run, and whenever: nothing that was told is lost, and nothing is doubled."""

from __future__ import annotations

import json
import os
import random
import signal
from collections import Counter
from itertools import chain, count
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy.engine.default import DefaultDialect

import lives as fork
from fakes import LampRoom, WordModel
from goalscope.agent.settings import Settings
from goalscope.base.types import Action, StepResult
from goalscope.envs.grocery import GroceryShop
from goalscope.envs.registry import open_environment
from goalscope.experiment.results import Results
from goalscope.storage.session import Session
from goalscope.storage.store import Store
from lamps import REPLIES
from lives import Lives, anew, episode, experiment, furnish, measured, rounds_of, signalled

lives, whole = fork.lives, fork.whole
DATABASES = ("sqlite", "postgresql")


def kept(life: Any, folder: Path, rounds: tuple[str, ...]) -> set[str]:
    """What is on the disk of all that a life may tell of: keys of cells, or numbers of rounds."""
    file = folder / ("s.db" if life is episode else "tiny.db")
    if not file.exists():
        return set()
    found = rounds_of(file)
    if life is episode:
        assert found == [rounds[: len(each)] for each in found][:1]
        return {str(json.loads(each)["number"]) for each in chain(*found)}
    with Results.open(file) as results:
        return {cell.key for cell in results.cells() if cell.result}


@pytest.mark.parametrize("life", [experiment, episode])
@pytest.mark.parametrize("kills", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_a_killed_run_loses_and_doubles_nothing(
    lives: Lives, whole: Any, life: Any, kills: int, figure: Any
) -> None:
    folder, cells, tables, rounds = whole
    steps = len(rounds if life is episode else cells)
    chance, codes, runs, told = random.Random(kills), Counter[int](), 0, 0
    while codes[-signal.SIGKILL] < kills:
        folder, runs, heard = anew(folder), runs + 1, list[str]()
        for part, how in enumerate((signal.SIGKILL, signal.SIGINT) * 2, 1):
            until = chance.randint(0, max(0, part * steps // 5 - len(heard)))
            begun = lives.begin(life, folder)
            code = signalled(begun, how, until, 0.05 * chance.random())
            assert code in (0, 130, -signal.SIGKILL), (folder / "errors").read_text()
            codes[code] += 1
            heard += begun.said()
            assert len(heard) == len({*heard}), "done twice"
            assert kept(life, folder, rounds) >= {*heard}
        assert lives.live(life, folder) == 0, (folder / "errors").read_text()
        told += len(heard)
        if life is episode:
            assert rounds_of(folder / "s.db") == [rounds]
        else:
            assert measured(folder) == (cells, tables)
            episodes = rounds_of(folder / "tiny.db")
            assert len(episodes) == sum("episode" in found for _, found in cells.values())
    figure(
        f"{runs} runs with {codes[-signal.SIGKILL]} SIGKILLs and {codes[130]} SIGINTs at random "
        f"moments: 0 of {told:,} rounds or cells that were told of lost, 0 doubled, the same end",
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
        super().__init__(("red", "green", "blue", "vase"))
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

    def _keep(self) -> None:
        self.file.write_text(json.dumps([self.on, self.smashed]))


SAID = {
    "shop": [
        "add cocoa powder", "add plain flour | 2 pack", "remove flour",
        "add whole milk; add green tea", "Buy the basket", "yes",
    ],
    "room": ["switch on red; switch on green", "smash vase", "yes", "switch on blue", "Good night"],
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
            read=lambda query: SAID[world][len(session.agent.turns)],
        )  # fmt: skip
        list(session.run())
    print(env.state().fingerprint)


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
    request: pytest.FixtureRequest, figure: Any,
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
    figure(
        f"{world}, {database}: ended at {len(ends) - 2} moments before and after each commit, "
        f"reset and act, and again in what follows ({deaths} deaths): each of {len(acts)} acts "
        "once in the state and once in the store",
    )
