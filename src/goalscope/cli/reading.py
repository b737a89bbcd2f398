"""`goalscope bench reading`: measure how messages are read."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from goalscope.base.types import InvalidInputError
from goalscope.cli.options import Json, Model, ReadingAdapter, ReadingForm
from goalscope.cli.terminal import loading, model_names, progress, say, show_tables

if TYPE_CHECKING:
    from goalscope.experiment.reading_scores import Language, Line
    from goalscope.language.orders import Reading


Corpus = Annotated[
    Path, typer.Argument(metavar="FILE.jsonl", help="JSONL file of messages, or a folder of them.")
]
Domains = Annotated[
    list[str] | None,
    typer.Option(
        "--domain",
        metavar="DOMAIN|FILE.py|FILE.toml",
        help="Use only the messages of this domain; repeatable. A Python file is your own domain, "
        "and its name selects the messages; a TOML file declares domains by their verbs.",
    ),
]


def bench_reading(
    file: Corpus,
    domain: Domains = None,
    model: Model = None,
    adapter: ReadingAdapter = None,
    form: ReadingForm = "text",
    limit: Annotated[
        int | None, typer.Option(min=1, help="Use only N messages, evenly spread.")
    ] = None,
    worst: Annotated[
        int, typer.Option(min=0, help="Number of messages to list, worst first.")
    ] = 10,
    as_json: Json = False,
) -> None:
    """Read messages with known orders, and report the accuracy.

    A line of the file is a conversation: {"id", "domain", "turns": [{"here", "question",
    "message", "orders": [{"do", "what", "quantity", "unit", "but", "for", "where", "if",
    "about"}]}]}. A message is exact if all its orders are right; F1 compares orders by verb and
    target.
    """
    from goalscope.experiment.reading_scores import (
        asking,
        differs,
        read_corpus,
        read_lines,
        score,
        turn_to_json,
    )
    from goalscope.experiment.summary import Table, percent
    from goalscope.language.orders import order_to_json, orders_to_text
    from goalscope.language.reader import Reader
    from goalscope.models.opening import open_reader

    languages = languages_of(domain)
    lines = chosen_lines(read_corpus(file), languages, bool(domain))
    if limit and limit < len(lines):
        lines = [lines[number * len(lines) // limit] for number in range(limit)]
    with loading():
        opened, taught = open_reader(model_names(model)["model"], adapter=adapter)
    readings: list[tuple[Line, Reading | None]] = []
    seconds: list[float] = []
    try:
        with progress("Messages") as show:
            show(0, len(lines))
            for name in dict.fromkeys(line.domain for line in lines):
                each = languages[name]
                reader = Reader(
                    opened,
                    each.verbs,
                    task=each.task,
                    examples=each.examples,
                    taught=taught,
                    form=form,
                )
                began = time.monotonic()
                for pair in read_lines([line for line in lines if line.domain == name], reader):
                    seconds.append(time.monotonic() - began)
                    readings.append(pair)
                    show(len(readings), len(lines))
                    began = time.monotonic()
    finally:
        opened.close()
    pairs = [(line, read and read.orders) for line, read in readings]
    costs = asking((line.orders, read) for line, read in readings)
    found = {"all": score((line.orders, read) for line, read in pairs)}
    for name in dict.fromkeys(line.domain for line, _ in pairs):
        found[name] = score((line.orders, read) for line, read in pairs if line.domain == name)
    wrong = [pair for pair in pairs if differs(pair[0].orders, pair[1])]
    wrong = sorted(wrong, key=lambda pair: -differs(pair[0].orders, pair[1]))[:worst]
    median = sorted(seconds)[len(seconds) // 2] if seconds else 0.0
    if as_json:
        rows = [
            {
                "id": line.id,
                "domain": line.domain,
                **turn_to_json(line),
                "read": None if read is None else [order_to_json(each) for each in read.orders],
                "margins": read and read.margins,
            }
            for line, read in readings
        ]
        scores = {name: asdict(each) for name, each in found.items()}
        told = {"scores": scores, "asking": [asdict(each) for each in costs], "seconds": median}
        print(json.dumps({**told, "lines": rows}, ensure_ascii=False))
        return
    rows = [
        {
            "domain": name,
            "messages": each.lines,
            "exact": percent(each.exact),
            "precision": each.precision,
            "recall": each.recall,
            "F1": each.f1,
            "F1 with quantities": each.quantity_f1,
            "questions": percent(each.about),
        }
        for name, each in found.items()
    ]
    show_tables([Table("reading", "Messages read", rows)], as_json)
    say(f"Median time per message: {median:.2f} s. Not read: {found['all'].unread:.1%}.")
    for each in costs:
        say(
            f"Asking below {each.threshold:g} nats: {each.asked:.1%} of the orders, "
            f"{each.right_asked:.1%} of that right; {each.wrong_done:.1%} of the rest wrong."
        )
    for line, read in wrong:
        told = "nothing" if read is None else orders_to_text(read)
        say(f"\n{line.id}  {line.message}")
        say(f"  right  {orders_to_text(line.orders)}".replace("\n", "; "))
        say(f"  read   {told}".replace("\n", "; "))


def languages_of(domains: Sequence[str] | None) -> dict[str, Language]:
    """The verbs of each domain, by the domain's name in the corpus."""
    from goalscope.agent.settings import Settings
    from goalscope.envs.registry import BUILT_IN, load_domain, open_environment
    from goalscope.experiment.reading_scores import Language, read_languages
    from goalscope.language.orders import examples_of

    found: dict[str, Language] = {}
    for name in domains or BUILT_IN:
        if name.endswith(".toml"):
            found |= read_languages(Path(name))
            continue
        known = load_domain(name)
        label = known if known in BUILT_IN else Path(known).stem
        env = open_environment(Settings(domain=known))
        found[label] = Language(tuple(env.verbs), env.task, tuple(examples_of(env.verbs)))
    return found


def chosen_lines(lines: Sequence[Line], languages: dict[str, Language], only: bool) -> list[Line]:
    """The lines of the domains, each under its one name.

    Raises:
        InvalidInputError: There is none, one has a verb that its domain lacks, or one is of
            another domain and not only some are meant.
    """
    from goalscope.envs.registry import known_as
    from goalscope.language.orders import DIALOGUE_ACTS

    named = [replace(line, domain=known_as(line.domain)) for line in lines]
    for line in named:
        if not only and line.domain not in languages:
            raise InvalidInputError(
                f"{line.id} is of the domain {line.domain!r}, which is unknown here. Name its "
                "file with --domain FILE.py, and every other domain to use."
            )
    found = [line for line in named if line.domain in languages]
    if not found:
        raise InvalidInputError(
            f"The corpus has no messages of the domain {' or '.join(languages)}."
        )
    known = {
        name: sorted(verb.name for verb in (*each.verbs, *DIALOGUE_ACTS))
        for name, each in languages.items()
    }
    for line in found:
        for order in line.orders:
            if order.do not in known[line.domain]:
                raise InvalidInputError(
                    f"{line.id}: {order.do!r} is not a verb of {line.domain}. The verbs are: "
                    f"{', '.join(known[line.domain])}."
                )
    return found
