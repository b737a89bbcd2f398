"""Evaluate reading: compare a model's orders with those annotated by people."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator

from goalscope.base.inputs import read_table, validated
from goalscope.base.types import InvalidInputError, UnreadableAnswerError
from goalscope.datasets.files import Row, line_rows
from goalscope.language.dialogue_state import acting
from goalscope.language.orders import (
    Example,
    Order,
    Reading,
    Verb,
    order_from_json,
    order_to_json,
    speaks,
    words_of,
)
from goalscope.language.reader import Reader, ReadExample, check_verbs

THRESHOLDS = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)
"""Thresholds in nats for `asking`."""

_TARGET, _AMOUNT = attrgetter("do", "what"), attrgetter("do", "what", "quantity", "unit")
_ARTICLES = frozenset(
    "a an the some any this that these those my our your his her their".split()  # noqa: SIM905
)


@dataclass(frozen=True, slots=True)
class Line:
    """A message of a corpus, and its right orders.

    The agent's `question` and what is `here` are "" if they do not matter. `kind` is what makes the
    message hard; "" for nothing. `before` is the message before it in its conversation.
    """

    id: str
    domain: str
    question: str
    message: str
    orders: tuple[Order, ...]
    here: str = ""
    kind: str = ""
    before: Line | None = None

    @property
    def earlier(self) -> tuple[Line, ...]:
        """The messages before it, oldest first."""
        return (*self.before.earlier, self.before) if self.before else ()


@dataclass(frozen=True, slots=True)
class _Turn:
    message: str
    orders: tuple[Annotated[Order, BeforeValidator(order_from_json)], ...]
    question: str = ""
    here: str = ""
    kind: str = ""


@dataclass(frozen=True, slots=True)
class _Conversation:
    id: str
    domain: str
    turns: tuple[_Turn, ...]


@dataclass(frozen=True, slots=True)
class Score:
    """The accuracy of readings, as shares from 0 to 1; `lines` is the number of messages.

    A message is `exact` if all its orders are right, with quantities and places. Precision, recall
    and F1 are of orders by verb and target; `quantity_f1` counts quantities and units, too.
    `unread` messages have no valid reading. `about` is the share of the questions that are read as
    questions about the same.
    """

    lines: int
    exact: float
    precision: float
    recall: float
    f1: float
    quantity_f1: float
    unread: float
    about: float


@dataclass(frozen=True, slots=True)
class Asking:
    """The cost of asking about orders whose margin is below a threshold.

    Over the read orders with a domain's verb:

    Attributes:
        threshold: Nats.
        asked: Share of orders that the agent asks about.
        wrong_done: Share of wrong orders among those executed at once.
        right_asked: Share of right orders among those asked about.
    """

    threshold: float
    asked: float
    wrong_done: float
    right_asked: float


@dataclass(frozen=True, slots=True)
class Language:
    """The verbs of a domain, its agent's task, and example readings."""

    verbs: tuple[Verb, ...]
    task: str = ""
    examples: tuple[Example, ...] = ()


@dataclass(frozen=True, slots=True)
class _Declared:
    """A table of the file that `read_languages` reads."""

    verbs: Mapping[str, tuple[str, ...]]
    task: str = ""


def read_languages(path: Path) -> dict[str, Language]:
    """Domains that a TOML file declares by their verbs, for a corpus without environments.

    A table of the file is a domain: `[florist]` with `task`, and for each verb its slots, such as
    `verbs = { add = ["what", "quantity"], finish = [] }`.

    Raises:
        InvalidInputError: The file or a domain's verbs are invalid.
    """
    languages: dict[str, Language] = {}
    for name, declared in validated(read_table(path), dict[str, _Declared], path.name).items():
        verbs = tuple(Verb(verb, "", slots) for verb, slots in declared.verbs.items())
        check_verbs(verbs)
        languages[name] = Language(verbs, declared.task)
    return languages


def read_corpus(path: Path) -> list[Line]:
    """Read a file of JSON Lines, or all files of a folder; see corpus/reading/README.md.

    Raises:
        InvalidInputError: There is none, or a line is wrong; says which and why.
    """
    return [line for row in read_rows(path) for line in lines_of(row)]


def read_rows(path: Path) -> Iterator[Row]:
    """The objects of a file of JSON Lines, perhaps gzipped, or of all files of a folder.

    Raises:
        InvalidInputError: There is none, or one cannot be read; says which and why.
    """
    files = sorted(path.glob("*.jsonl")) if path.is_dir() else [path]
    if not files or not files[0].is_file():
        raise InvalidInputError(f"There is no corpus at {path}. Name a JSONL file or a folder.")
    for file in files:
        yield from line_rows(file, "")


def read_lines(lines: Sequence[Line], reader: Reader) -> Iterator[tuple[Line, Reading | None]]:
    """Read each message; None without a valid reading.

    Earlier messages of its conversation are read first, as they would have been.
    """
    known: dict[Line, Reading | None] = {}

    def read(line: Line) -> Reading | None:
        if line not in known:
            nothing = Reading((Order("none"),))
            before = [
                ReadExample(each.question, each.message, (read(each) or nothing).orders)
                for each in line.earlier
            ]
            try:
                known[line] = reader.read(
                    line.message, question=line.question, before=before, here=line.here
                )
            except UnreadableAnswerError:
                known[line] = None
        return known[line]

    for line in lines:
        yield line, read(line)


def score(pairs: Iterable[tuple[Sequence[Order], Sequence[Order] | None]]) -> Score:
    """Compare right orders with read ones; None for messages that could not be read.

    Articles, case and a plural's s do not count, nor do reasons, nor what a question asks for; a
    mere yes, no or aim is no order. One of a thing is as no quantity.
    """
    exact = unread = lines = 0
    hits, read, right = Counter[str](), Counter[str](), Counter[str]()
    for gold, found in pairs:
        lines += 1
        unread += found is None
        exact += _bag(gold) == _bag(found or ()) and found is not None
        for name, key in (("target", _TARGET), ("quantity", _AMOUNT)):
            wanted, given = _bag(gold, key), _bag(found or (), key)
            hits[name] += (wanted & given).total()
            read[name] += given.total()
            right[name] += wanted.total()
        wanted, given = (
            Counter(each.about for each in orders if each.do == "ask")
            for orders in (gold, found or ())
        )
        hits["about"] += (wanted & given).total()
        right["about"] += wanted.total()

    def f1(name: str) -> float:
        both = read[name] + right[name]
        return 2 * hits[name] / both if both else 1.0

    return Score(
        lines,
        exact / max(lines, 1),
        hits["target"] / max(read["target"], 1),
        hits["target"] / max(right["target"], 1),
        f1("target"),
        f1("quantity"),
        unread / max(lines, 1),
        hits["about"] / max(right["about"], 1),
    )


def asking(pairs: Iterable[tuple[Sequence[Order], Reading | None]]) -> list[Asking]:
    """The cost of asking at each of `THRESHOLDS`; empty if the model reports no margins.

    Args:
        pairs: Right orders, and readings.
    """
    told: list[tuple[float, bool]] = []
    for gold, found in pairs:
        right = _bag(gold)
        for order, margin in zip(found.orders, found.margins or (), strict=False) if found else ():
            if acting((order,)):
                told.append((margin, bool(_bag((order,)) & right)))
    rows: list[Asking] = []
    for threshold in THRESHOLDS if told else ():
        asked = [right for margin, right in told if margin < threshold]
        done = [right for margin, right in told if margin >= threshold]
        wrong = 1 - sum(done) / max(len(done), 1)
        rows.append(
            Asking(threshold, len(asked) / len(told), wrong, sum(asked) / max(len(asked), 1))
        )
    return rows


def differs(gold: Sequence[Order], found: Sequence[Order] | None) -> int:
    """How many orders are missing or too many, quantities and places included."""
    wanted, given = _bag(gold), _bag(found or ())
    return ((wanted - given) + (given - wanted)).total()


def lines_of(row: Row) -> list[Line]:
    """The messages of a conversation.

    Raises:
        InvalidInputError: A key is missing, or its value is of another kind.
    """
    talk = validated(row.values, _Conversation, row.label, ignore_extra=True)
    lines: list[Line] = []
    for number, turn in enumerate(talk.turns, 1):
        lines.append(
            Line(
                f"{talk.id}.{number}",
                talk.domain,
                turn.question,
                turn.message,
                turn.orders or (Order("none"),),
                turn.here,
                turn.kind,
                lines[-1] if lines else None,
            )
        )
    return lines


def turn_to_json(line: Line) -> dict[str, Any]:
    """A message as a turn of its conversation's JSON."""
    told = {"here": line.here, "question": line.question, "message": line.message}
    return {
        **{key: text for key, text in told.items() if text},
        **({"kind": line.kind} if line.kind else {}),
        "orders": [order_to_json(each) for each in line.orders],
    }


def _bag(
    orders: Iterable[Order], key: Callable[[Order], object] = lambda order: order
) -> Counter[Any]:
    return Counter(key(_even(each)) for each in orders if speaks(each))


def _even(order: Order) -> Order:
    quantity = None if order.quantity == 1 and not order.unit else order.quantity
    what = "" if order.do == "ask" else _phrase(order.what)
    return replace(
        order,
        what=what,
        quantity=quantity,
        unit=_singular(order.unit.casefold()),
        for_=_phrase(order.for_),
        where="" if order.do == "ask" else _phrase(order.where),
        but=_phrase(order.but),
        if_="if" if order.if_ else "",
        why="",
        about="",
    )


def _phrase(text: str) -> str:
    return " ".join(_singular(word) for word in words_of(text) if word not in _ARTICLES)


def _singular(word: str) -> str:
    return re.sub(r"(?<=\w{2})(?<![su])s$", "", word)
