"""TEACh's games, played in the embedded house: the commander's words are those that people typed.

python benchmarks/games.py --data FOLDER --method no-goals --limit 40

Every utterance is said in its turn, whatever the agent asks, and "Yes." where it asks for
confirmation. The table shows the share of goal conditions that hold, and of games wholly done: at
the start, at the end, and when people had played the game.

The conditions are TEACh's own (`components` and `relations` of a game), counted as its progress
check counts them (`Task_THOR.check_episode_progress`):

* A component asks for things: one, a number, or all of a kind. Each property that one of them must
  have is a condition, its type among them; where too few have all, those nearest to it count.
* A relation asks that things of components stand in or on one of another ("a": any, "the": all in
  the same one). That is a condition for each thing.
* A component that is a task of its own has that task's conditions, for each of its number.

What holds at the start already counts, too: measure a game's start beside its end. Properties that
the embedded house lacks follow from those that it has: coffee is in what is filled with coffee, and
boiled is what was seen cooked in something filled. "Sink" and "SinkBasin" are one. What was cut
up is no longer there; its pieces are. A thing stands on what its plate stands on.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

import typer

from goalscope import Agent
from goalscope.base.types import InvalidInputError
from goalscope.cli.options import Json, Method, Model
from goalscope.cli.terminal import model_names, opened_model, show_tables
from goalscope.cli.terminal import progress as shown_progress
from goalscope.datasets import DATASETS, data_folder
from goalscope.datasets.files import Row, line_rows
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.envs.house.simulator.object_types import object_type
from goalscope.envs.house.simulator.state import Scene
from goalscope.experiment.summary import Row as TableRow
from goalscope.experiment.summary import Table, percent
from teach_rooms import room_at_start, worlds

Thing = Mapping[str, Any]

_ALL, _NONE = "all", "0"
"""Determiners of a component: all of a kind, and none."""


@dataclass(frozen=True, slots=True)
class Game:
    """A game that people played.

    Attributes:
        id: Its name in the data.
        task: The kind of task, such as "Clean All X".
        aim: What the commander was told to have done, in a sentence.
        said: What the commander said, oldest first.
        goal: Its goal conditions: `components` and `relations`.
        classes: The classes of each object type, such as "Tableware" of "Mug".
        start: The room at the start.
        end: TEACh's record of each object when it was over.
    """

    id: str
    task: str
    aim: str
    said: tuple[str, ...]
    goal: Mapping[str, Any]
    classes: Mapping[str, frozenset[str]]
    start: Scene
    end: tuple[Thing, ...]


@dataclass(frozen=True, slots=True)
class Progress:
    """How many of a game's goal conditions hold.

    Attributes:
        held: Those that hold.
        total: All of them.
    """

    held: int
    total: int

    @property
    def done(self) -> bool:
        """Whether all hold."""
        return self.held == self.total


class Asks(Protocol):
    """What one utterance led to, such as a `goalscope.agent.round.Round`."""

    @property
    def question(self) -> str:
        """What has to be confirmed, or ""."""
        ...

    @property
    def terminated(self) -> bool:
        """Whether the task is done."""
        ...


class Talks(Protocol):
    """Who is commanded, such as a `goalscope.agent.agent.Agent`."""

    def ask(self) -> str:
        """The next question."""
        ...

    def step(self, query: str, utterance: str) -> Asks:
        """Take in one utterance, and act."""
        ...


def read_games(file: Path, scenes: Path | None = None) -> Iterator[Game]:
    """Read the games of a file.

    Args:
        file: JSON Lines, packed with gzip.
        scenes: Folder of AI2-THOR's scenes, named as a game's "world" with `.json.gz`; None looks
            among those that were imported.

    Raises:
        InvalidInputError: A file is missing or broken, or a game is not of this form.
    """
    world = worlds(scenes)
    for row in line_rows(file):
        scene = world(row.text("world"))
        try:
            game = _game(row, scene)
            progress(game, game.end)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            if isinstance(error, InvalidInputError):
                raise
            raise InvalidInputError(
                f"{row.label}: not a TEACh game ({type(error).__name__}: {error})."
            ) from None
        yield game


def play(agent: Talks, game: Game, objects: Callable[[], Iterable[Thing]]) -> Progress:
    """Have the commander say what they said, and "Yes." to each question that asks for it.

    Args:
        agent: At the game's start.
        game: The game.
        objects: Gives AI2-THOR's metadata of each object, as it is now.
    """
    boiled: set[str] = set()
    for utterance in game.said:
        round = agent.step(agent.ask(), utterance)
        boiled |= boiling(objects())
        if round.question and not round.terminated:
            round = agent.step(agent.ask(), "Yes.")
            boiled |= boiling(objects())
        if round.terminated:
            break
    return progress(game, objects(), boiled)


def boiling(objects: Iterable[Thing]) -> set[str]:
    """Ids of what is cooked in something filled: AI2-THOR's metadata does not tell it later."""
    table = {each["objectId"]: each for each in objects}
    return {
        own
        for own, thing in table.items()
        if thing.get("isCooked")
        and any(table[holder].get("isFilledWithLiquid") for holder in _holders(own, table))
    }


def progress(game: Game, objects: Iterable[Thing], boiled: Collection[str] = ()) -> Progress:
    """How many of a game's goal conditions hold.

    Args:
        game: The game.
        objects: Each object, as AI2-THOR's metadata or TEACh's record.
        boiled: Ids of what was boiled; see `boiling`.
    """
    table = {each["objectId"]: each for each in objects}
    things = [_known(own, table, game, boiled) for own in table if not table[own].get("isSliced")]
    part = _task(game.goal, things, 1)
    return Progress(part.held, part.total)


@dataclass(frozen=True, slots=True)
class _Part:
    """Conditions of a part of a goal; the things that have all, and those that lack some."""

    held: int
    total: int
    found: Sequence[Thing] = ()
    near: Sequence[Thing] = ()


def _task(task: Mapping[str, Any], things: Sequence[Thing], times: int) -> _Part:
    """A task that is to be done `times` times; it stands for the things of its anchor."""
    parts = {
        name: _component(component, things, times)
        for name, component in task["components"].items()
        if component["determiner"] != _NONE
    }
    every = [*parts.values(), *(_relation(each, parts, times) for each in task["relations"])]
    anchor = parts.get(task.get("task_anchor_object") or "")
    return _Part(
        sum(each.held for each in every),
        sum(each.total for each in every),
        anchor.found if anchor else (),
    )


def _component(component: Mapping[str, Any], things: Sequence[Thing], times: int) -> _Part:
    """Things with some properties: all of a kind, or so many; where all may share it, one."""
    determiner = component["determiner"]
    if "task" in component:
        return _task(component["task"], things, times * _number(determiner))
    wanted, kind = component["conditions"], component["primary_condition"]
    counted = [
        (sum(_has(thing, key, value) for key, value in wanted.items()), thing)
        for thing in things
        if _has(thing, kind, wanted[kind])
    ]
    found = [thing for count, thing in counted if count == len(wanted)]
    near = [thing for count, thing in counted if count < len(wanted)]
    if determiner == _ALL and len(wanted) == 1:
        return _Part(0, 0, found)
    number = times * _number(determiner) if determiner != _ALL else len(counted)
    number = 1 if component["instance_shareable"] and determiner != _ALL else number
    best = sorted((count for count, _ in counted), reverse=True)[:number]
    return _Part(sum(best), number * len(wanted), found, near)


def _relation(relation: Mapping[str, Any], parts: Mapping[str, _Part], times: int) -> _Part:
    """Things of some components in or on a thing of another; each time in another one, if so."""
    (tail,) = relation["tail_entity_list"]
    places = [{thing["objectId"]} for thing in _things(parts, tail)]
    per_place = 1
    if relation["tail_determiner_list"] == ["a"]:
        places, times, per_place = [set[str]().union(*places)], 1, times
    heads: list[tuple[list[Thing], int]] = []
    for name, determiner in zip(
        relation["head_entity_list"], relation["head_determiner_list"], strict=True
    ):
        things = _things(parts, name)
        number = len(things) if determiner == _ALL else per_place * _number(determiner)
        heads.append((things, number))

    def held(place: set[str]) -> int:
        return sum(min(number, _inside(things, place)) for things, number in heads)

    best = sorted(map(held, places), reverse=True)[:times]
    return _Part(sum(best), times * sum(number for _, number in heads))


def _inside(things: Sequence[Thing], place: set[str]) -> int:
    return sum(not place.isdisjoint(thing["parentReceptacles"]) for thing in things)


def _things(parts: Mapping[str, _Part], name: str) -> list[Thing]:
    part = parts.get(name)
    return [*part.found, *part.near] if part else []


def _number(determiner: str) -> int:
    return 1 if determiner in ("a", "the") else int(determiner)


def _has(thing: Thing, key: str, value: object) -> bool:
    """Whether a condition holds of a thing: its type, one of its classes, or a flag."""
    if key == "objectType":
        return _type(thing[key]) == _type(str(value))
    if key == "simbotObjectClass":
        return value in thing[key]
    return bool(thing.get(key)) == bool(value)


def _type(kind: str) -> str:
    """The object type, a basin's as what it is the basin of."""
    return kind.removesuffix("Basin")


def _known(own: str, table: Mapping[str, Thing], game: Game, boiled: Collection[str]) -> Thing:
    """A thing with TEACh's properties beside those of AI2-THOR."""
    thing = table[own]
    kind: str = thing["objectType"]
    whole = kind.removesuffix("Sliced")
    classes = game.classes.get(kind) or game.classes.get(whole, frozenset[str]()) - {whole}
    coffee = thing.get("simbotIsFilledWithCoffee") or thing.get("fillLiquid") == "coffee"
    return {
        **thing,
        "receptacle": "receptacle" in object_type(kind).flags,
        "simbotObjectClass": {kind, _type(kind), *classes},
        "simbotIsCooked": thing.get("isCooked"),
        "simbotIsBoiled": thing.get("simbotIsBoiled") or own in boiled,
        "simbotIsFilledWithCoffee": coffee,
        "parentReceptacles": _holders(own, table),
    }


def _holders(own: str, table: Mapping[str, Thing]) -> set[str]:
    """What the thing is in or on, with what that is in or on."""
    waiting = list(table[own].get("parentReceptacles") or ())
    found: set[str] = set()
    while waiting:
        holder = waiting.pop()
        if holder in table and holder not in found:
            found.add(holder)
            waiting += table[holder].get("parentReceptacles") or ()
    return found


def _game(row: Row, scene: Scene) -> Game:
    classes: dict[str, set[str]] = {}
    for each in row.values["initial_objects"]:
        classes.setdefault(each["objectType"], set()).update(each.get("simbotObjectClass", ()))
    return Game(
        row.text("game_id"),
        row.text("task_name"),
        row.text("desc"),
        tuple(
            each.text("utterance")
            for each in row.rows("interactions")
            if each.values["agent"] == "commander" and each.values.get("utterance", "").strip()
        ),
        {key: row.values[key] for key in ("components", "relations")},
        {kind: frozenset(names) for kind, names in classes.items()},
        room_at_start(row.values["initial_objects"], scene),
        tuple(row.values["final_objects"]),
    )


def main(
    data: Path | None = None,
    split: str | None = None,
    method: Method = "good",
    model: Model = None,
    limit: int | None = None,
    as_json: Json = False,
) -> None:
    """Play TEACh's games in the embedded house."""
    folder = data_folder(data)
    file = DATASETS["teach"].file(folder, split)
    games = list(read_games(file, folder / "thor" / "scenes"))[:limit]
    played: list[tuple[Game, list[Progress]]] = []
    with opened_model(model_names(model)) as engine, shown_progress("Games") as show:
        for number, game in enumerate(games, 1):
            env = HomeRobot(HouseController(game.start))
            agent = Agent(env, engine, method=method)
            end = play(agent, game, lambda env=env: env.metadata["objects"])
            start, people = progress(game, game.start.objects), progress(game, game.end)
            played.append((game, [start, end, people]))
            show(number, len(games))
    if as_json:
        names = ("start", "end", "people")
        rows = [
            {"id": game.id, "task": game.task} | dict(zip(names, map(asdict, counts), strict=True))
            for game, counts in played
        ]
        print(json.dumps({"games": rows}))
        return
    tasks = dict.fromkeys(["all", *sorted({game.task for game, _ in played})])
    rows = [
        summary(name, [counts for game, counts in played if name in ("all", game.task)])
        for name in tasks
    ]
    show_tables([Table("games", "Games of TEACh", rows)], as_json)


def summary(name: str, games: Sequence[Sequence[Progress]]) -> TableRow:
    """Games, the share of conditions that hold at each time, and of games done in the end."""
    times = [*zip(*games, strict=True)]
    shares = [sum(p.held for p in at) / max(sum(p.total for p in at), 1) for at in times]
    done = [sum(p.done for p in at) / len(games) for at in times]
    heads = ("start", "end", "people", "done", "done by people")
    found = zip(heads, map(percent, (*shares, *done[1:])), strict=True)
    return {"task": name, "games": len(games), **dict(found)}


if __name__ == "__main__":
    typer.run(main)
