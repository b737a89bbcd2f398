"""`goalscope bench orders` and `games`: what comes of language that nobody here wrote."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from goalscope.cli.options import Json, Method, Model, ReadingAdapter, ReadingForm
from goalscope.cli.terminal import console, measuring, model_names, opened_model, progress
from goalscope.types import InvalidInputError

if TYPE_CHECKING:
    from goalscope.benchmarks.games_teach import Progress
    from goalscope.benchmarks.orders_taskmaster import Counter, Cups

__all__ = ["bench_games", "bench_orders"]

Data = Annotated[
    Path | None, typer.Option(help="Folder of the datasets.  [default: $GOALSCOPE_DATA]")
]
Split = Annotated[str | None, typer.Option(help="Part of the dataset.")]
Limit = Annotated[int | None, typer.Option(min=1, help="Only so many, the first ones.")]


def bench_orders(
    counter: Annotated[
        str, typer.Argument(metavar="FILE.py", help="A counter, such as examples/coffee.py.")
    ],
    data: Data = None,
    split: Split = None,
    model: Model = None,
    adapter: ReadingAdapter = None,
    form: ReadingForm = "text",
    limit: Limit = None,
    worst: Annotated[int, typer.Option(min=0, help="Wrong orders to list.")] = 10,
    as_json: Json = False,
) -> None:
    """Take the coffee orders of Taskmaster-4, and compare what stands at the counter in the end.

    Exact are orders whose drinks and options are all right. Beside the model stands a baseline that
    reads nothing: every utterance is taken for the name of something to be added.
    """
    from goalscope.benchmarks.orders_taskmaster import (
        Verbatim,
        final_order,
        options_of,
        read_dialogues,
        right,
        score_orders,
    )
    from goalscope.datasets import DATASETS, data_folder
    from goalscope.domains import Settings, load_domain, open_environment
    from goalscope.models.opening import open_reader
    from goalscope.picking import Picker
    from goalscope.reader import Reader
    from goalscope.safe_text import terminal_safe

    env = open_environment(Settings(domain=load_domain(counter)))
    if not hasattr(env, "cups"):
        raise InvalidInputError(f"{counter} takes no orders: its environment has no `cups`.")
    env, pick = cast("Counter", env), Picker()
    every = read_dialogues(DATASETS["taskmaster4"].file(data_folder(data), split), env, pick)
    options, dialogues = options_of(every), every[:limit]
    with measuring("Loading the model"):
        opened, taught = open_reader(model_names(model)["model"], adapter=adapter)
    try:
        reader = Reader(
            opened,
            env.verbs,
            task=env.task,
            examples=env.examples,
            taught=taught,
            form=form,
        )
        found: list[Cups | None] = []
        with progress("Dialogues") as show:
            for number, each in enumerate(dialogues, 1):
                found.append(final_order(each, reader, env, pick))
                show(number, len(dialogues))
    finally:
        opened.close()
    verbatim = [final_order(each, Verbatim(), env, pick) for each in dialogues]
    scores = {
        name: score_orders(
            [(each.order, order) for each, order in zip(dialogues, orders, strict=True)], options
        )
        for name, orders in (("model", found), ("verbatim", verbatim))
    }
    if as_json:
        rows = [
            {
                "id": each.id,
                "right": sorted(each.order),
                "found": None if order is None else sorted(order),
            }
            for each, order in zip(dialogues, found, strict=True)
        ]
        told = {name: asdict(each) for name, each in scores.items()}
        print(json.dumps({"scores": told, "dialogues": rows}))
        return
    columns = ("", "dialogues", "exact", "drinks right", "not read")
    rows = [
        (name, f"{s.dialogues}", f"{s.exact:.1%}", f"{s.drinks:.1%}", f"{s.unread:.1%}")
        for name, s in scores.items()
    ]
    _show(columns, rows)
    out = console()
    pairs = zip(dialogues, found, strict=True)
    wrong = [pair for pair in pairs if not right(pair[0].order, pair[1], options)]
    for each, order in wrong[:worst]:
        out.print(terminal_safe(f"\n{each.id}"), soft_wrap=True)
        for turn in each.turns:
            out.print(terminal_safe(f"  {turn.utterance}"), soft_wrap=True)
        for name, cups in (("right", each.order), ("found", order)):
            told = "not read" if cups is None else "; ".join(map(", ".join, sorted(cups)))
            out.print(terminal_safe(f"  {name}: {told or 'nothing'}"), soft_wrap=True)


def bench_games(
    data: Data = None,
    split: Split = None,
    method: Method = "good",
    model: Model = None,
    limit: Limit = None,
    as_json: Json = False,
) -> None:
    """Play TEACh's games in the embedded house: the commander's words are those that people typed.

    Every utterance is said in its turn, whatever the agent asks, and "Yes." where it asks for
    confirmation. The table shows the share of goal conditions that hold, and of games wholly done:
    at the start, at the end, and when people had played the game.
    """
    from goalscope.agent import Agent
    from goalscope.benchmarks.games_teach import play, read_games
    from goalscope.benchmarks.games_teach import progress as held
    from goalscope.datasets import DATASETS, data_folder
    from goalscope.envs.house import HomeRobot, HouseController

    folder = data_folder(data)
    file = DATASETS["teach"].file(folder, split)
    games = list(read_games(file, folder / "thor" / "scenes"))[:limit]
    played: list[tuple[str, str, list[Progress]]] = []
    with opened_model(model_names(model)) as engine, progress("Games") as show:
        for number, game in enumerate(games, 1):
            env = HomeRobot(HouseController(game.start))
            agent = Agent(env, engine, method=method)
            end = play(agent, game, lambda env=env: env.metadata["objects"])
            start, people = held(game, game.start.objects), held(game, game.end)
            played.append((game.id, game.task, [start, end, people]))
            show(number, len(games))
    if as_json:
        names = ("start", "end", "people")
        rows = [
            {"id": own, "task": task} | dict(zip(names, map(asdict, counts), strict=True))
            for own, task, counts in played
        ]
        print(json.dumps({"games": rows}))
        return
    tasks = sorted({task for _, task, _ in played})
    rows = [
        _summary(name, [counts for _, task, counts in played if task == name or name == "all"])
        for name in ("all", *tasks)
    ]
    _show(("", "games", "start", "end", "people", "done", "done by people"), rows)


def _summary(name: str, games: list[list[Progress]]) -> tuple[str, ...]:
    """A row: games, the share of conditions that hold at each time, games done in the end."""
    times = list(zip(*games, strict=True))
    shares = [sum(p.held for p in at) / max(sum(p.total for p in at), 1) for at in times]
    done = [sum(p.done for p in at) / len(games) for at in times]
    return (name, f"{len(games)}", *(f"{each:.1%}" for each in (*shares, *done[1:])))


def _show(columns: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for heading in columns:
        table.add_column(heading, justify="right" if heading else "left")
    for row in rows:
        table.add_row(*row)
    console().print(table)
