"""Final orders of Taskmaster-4: what a customer said, read and resolved, beside what was written.

python benchmarks/orders.py examples/coffee.py --data FOLDER

Exact are orders whose drinks and options are all right. Beside the model stands a baseline that
reads nothing: every utterance is taken for the name of something to be added.

The environment is a counter such as `examples/coffee.py`: verbs and a menu. Compared is what the
data annotates: each drink with its options. What it does not annotate does not count: notes in free
words, how many cups of a kind there are, and options that no order of the file has, such as syrups.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import cast

import typer

from goalscope.agent.settings import Settings
from goalscope.base.inputs import shown
from goalscope.base.text import terminal_safe
from goalscope.base.types import InvalidInputError, Turn, UnreadableAnswerError
from goalscope.cli.options import Json, Model, ReadingAdapter, ReadingForm
from goalscope.cli.terminal import console, loading, model_names, progress, show_tables
from goalscope.datasets import DATASETS, data_folder
from goalscope.datasets.case import OPENING, turns_of
from goalscope.datasets.files import Row, line_rows
from goalscope.envs import Environment, Pick, execute
from goalscope.envs.registry import load_domain, open_environment
from goalscope.experiment.summary import Table, percent
from goalscope.language.dialogue_state import DialogueState, fold
from goalscope.language.matcher import Matcher
from goalscope.language.orders import Order, Reading, examples_of
from goalscope.language.reader import Reader, ReadExample
from goalscope.models.opening import open_reader

Cups = frozenset[tuple[str, ...]]
"""An order: of each kind of cup the drink, and its options in the order of the menu."""


class Verbatim:
    """The baseline that reads nothing: whatever is said is the name of a thing to be added.

    A counter that knows its menu's words takes most orders of the data right by that alone.
    """

    def read(
        self,
        message: str,
        *,
        question: str = "",
        before: Sequence[ReadExample] = (),
        here: str = "",
    ) -> Reading:
        """The words as one order."""
        return Reading((Order("add", message),))


class Counter(Environment):
    """An environment that takes orders.

    Attributes:
        cups: What was ordered, each as "latte, decaf, oat milk".
    """

    cups: Sequence[str]


@dataclass(frozen=True, slots=True)
class Dialogue:
    """A customer's words, and the order that they came to.

    Attributes:
        id: Its name in the data.
        turns: What the assistant asked, and what the customer said.
        order: The final order, in the counter's names.
    """

    id: str
    turns: tuple[Turn, ...]
    order: Cups


@dataclass(frozen=True, slots=True)
class OrdersScore:
    """How many final orders are right, shares from 0 to 1.

    Attributes:
        dialogues: How many were scored.
        exact: Those whose drinks and options are all right.
        drinks: Those whose drinks are all right.
        unread: Those in which the model wrote no reading for an utterance.
    """

    dialogues: int
    exact: float
    drinks: float
    unread: float


def read_dialogues(file: Path, counter: Counter, pick: Pick) -> list[Dialogue]:
    """Read a file; each annotated item is ordered at the counter, which gives it its name there.

    Dialogues are left out in which a template was never filled (var_), and those with an item that
    is not on the menu.

    Raises:
        InvalidInputError: The file is broken, or holds no dialogue that can be used.
    """
    found: list[Dialogue] = []
    for row in line_rows(file):
        if "var_" in json.dumps(row.values):
            continue
        counter.reset()
        for item in row.rows("order_items"):
            phrase = " ".join([*item.texts("options"), item.text("drink")])
            held = len(counter.cups)
            _follow(counter, [Order("add", phrase)], DialogueState(), pick)
            if len(counter.cups) == held:
                break
        else:
            found.append(Dialogue(row.text("id"), turns_of(_said(row)), _cups(counter)))
    if not found:
        raise InvalidInputError(f"{file} holds no order of what is on the menu.")
    return found


def options_of(dialogues: Iterable[Dialogue]) -> frozenset[str]:
    """The options that the data annotates."""
    return frozenset(option for each in dialogues for cup in each.order for option in cup[1:])


def final_order(
    dialogue: Dialogue, reader: Reader | Verbatim, counter: Counter, pick: Pick
) -> Cups | None:
    """What stands at the counter after a dialogue; None where an utterance could not be read.

    Each utterance is read in its conversation and followed at once, until one ends the task.
    """
    counter.reset()
    before: list[ReadExample] = []
    readings: list[Reading] = []
    for turn in dialogue.turns:
        question = "" if turn.query == OPENING else turn.query
        here = counter.state().here
        try:
            reading = reader.read(turn.utterance, question=question, before=before, here=here)
        except UnreadableAnswerError:
            return None
        before.append(ReadExample(question, turn.utterance, reading.orders))
        readings.append(reading)
        if _follow(counter, reading.orders, fold(readings), pick):
            break
    return _cups(counter)


def right(order: Cups, found: Cups | None, options: frozenset[str]) -> bool:
    """Whether an order has the drinks and the annotated options of the right one."""
    return found is not None and order == _only(found, options)


def score_orders(pairs: Sequence[tuple[Cups, Cups | None]], options: frozenset[str]) -> OrdersScore:
    """Compare orders.

    Args:
        pairs: The right order, and the one that was taken; None where it was not read.
        options: Those that count: see `options_of`.
    """
    total = max(len(pairs), 1)
    drinks = [found is not None and _drinks(order) == _drinks(found) for order, found in pairs]
    return OrdersScore(
        len(pairs),
        sum(right(order, found, options) for order, found in pairs) / total,
        sum(drinks) / total,
        sum(found is None for _, found in pairs) / total,
    )


def _follow(counter: Counter, orders: Iterable[Order], dialogue: DialogueState, pick: Pick) -> bool:
    """Do what is ordered; whether that ended the task."""
    verbs = {verb.name for verb in counter.verbs} | {"avoid", "only"}
    for order in orders:
        found = counter.resolve(order, dialogue, pick) if order.do in verbs else None
        for action in found.actions if found else ():
            if execute(counter, action).terminated:
                return True
    return False


def _said(row: Row) -> Iterator[tuple[bool, str]]:
    for turn in row.entries("turns"):
        match turn:
            case [str(speaker), str(text)]:
                yield speaker == "user", text
            case _:
                raise InvalidInputError(
                    f"{row.label}: a turn must be two texts, not {shown(turn)}."
                )


def _cups(counter: Counter) -> Cups:
    return frozenset(tuple(cup.split(", ")) for cup in counter.cups)


def _drinks(order: Cups) -> frozenset[str]:
    return frozenset(drink for drink, *_ in order)


def _only(order: Cups, options: frozenset[str]) -> Cups:
    return frozenset((drink, *(each for each in rest if each in options)) for drink, *rest in order)


def main(
    counter: str,
    data: Path | None = None,
    split: str | None = None,
    model: Model = None,
    adapter: ReadingAdapter = None,
    form: ReadingForm = "text",
    limit: int | None = None,
    worst: int = 10,
    as_json: Json = False,
) -> None:
    """Take the coffee orders of Taskmaster-4, and compare what stands at the counter in the end."""
    env = open_environment(Settings(domain=load_domain(counter)))
    if not hasattr(env, "cups"):
        raise InvalidInputError(f"{counter} takes no orders: its environment has no `cups`.")
    env, pick = cast("Counter", env), Matcher()
    every = read_dialogues(DATASETS["taskmaster4"].file(data_folder(data), split), env, pick)
    options, dialogues = options_of(every), every[:limit]
    with loading():
        opened, taught = open_reader(model_names(model)["model"], adapter=adapter)
    found: list[Cups | None] = []
    try:
        language = {
            "task": env.task,
            "examples": examples_of(env.verbs),
            "taught": taught,
            "form": form,
        }
        reader = Reader(opened, env.verbs, **language)
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
    pairs = [*zip(dialogues, found, strict=True)]
    if as_json:
        rows = [
            {
                "id": each.id,
                "right": sorted(each.order),
                "found": None if order is None else sorted(order),
            }
            for each, order in pairs
        ]
        told = {name: asdict(each) for name, each in scores.items()}
        print(json.dumps({"scores": told, "dialogues": rows}))
        return
    rows = [
        {
            "by": name, "dialogues": s.dialogues, "exact": percent(s.exact),
            "drinks right": percent(s.drinks), "not read": percent(s.unread),
        }
        for name, s in scores.items()
    ]  # fmt: skip
    show_tables([Table("orders", "Orders of Taskmaster-4", rows)], as_json)
    for each, order in [p for p in pairs if not right(p[0].order, p[1], options)][:worst]:
        lines = [f"\n{each.id}", *(f"  {turn.utterance}" for turn in each.turns)]
        for name, cups in (("right", each.order), ("found", order)):
            told = "not read" if cups is None else "; ".join(map(", ".join, sorted(cups)))
            lines.append(f"  {name}: {told or 'nothing'}")
        for line in lines:
            console().print(terminal_safe(line), soft_wrap=True)


if __name__ == "__main__":
    typer.run(main)
