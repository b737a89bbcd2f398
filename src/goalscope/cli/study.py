"""`goalscope study`: people rate episodes on a page of their own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from goalscope.cli.options import Json, StoreFile
from goalscope.cli.terminal import console
from goalscope.types import InvalidInputError, counted

__all__ = ["study"]

study = typer.Typer(no_args_is_help=True, help="Studies in which people rate episodes.")

Name = Annotated[str, typer.Argument(help="Of the study.")]


@study.command()
def example() -> None:
    """Print a study's file with all that it may say."""
    from importlib.resources import files

    print((files("goalscope.study") / "example.toml").read_text("utf-8"), end="")


@study.command()
def new(
    file: Annotated[Path, typer.Argument(help="What the study is, TOML; see `example`.")],
    anyway: Annotated[
        bool, typer.Option("--anyway", help="Make it though a method or person has no episode.")
    ] = False,
    store: StoreFile = None,
    as_json: Json = False,
) -> None:
    """Make a study of episodes in the store. It never changes afterwards."""
    from goalscope.store import Store
    from goalscope.study.book import Book
    from goalscope.study.items import chosen_episodes
    from goalscope.study.plan import read_plan

    plan = read_plan(file)
    with Store.open(store, new=False) as opened:
        found, left_out = chosen_episodes(opened, plan)
        chosen = plan.episodes
        missing = [
            *(f"method {each}" for each in chosen.methods if each not in {e.method for e in found}),
            *(
                f"person {each}"
                for each in chosen.profiles
                if each not in {e.profile for e in found}
            ),
        ]
        if missing and not anyway:
            raise InvalidInputError(
                f"No episode that has ended fits the {', the '.join(missing)} of [episodes], and a "
                "study never changes. `goalscope run` makes some; --anyway makes it without."
            )
        people_of = {e.method: {o.profile for o in found if o.method == e.method} for e in found}
        shared = set[str | None].intersection(*people_of.values())
        if not shared and not anyway:
            raise InvalidInputError(
                f"The methods {', '.join(people_of)} have no person in common, so that raters "
                "would compare people, and not methods. Run each method for the same people; "
                "--anyway makes it as it is."
            )
        Book(opened).add(plan)
    episodes, real = len(found), sum(info.profile is None for info in found)
    if as_json:
        print(json.dumps({"name": plan.name, "path": f"/study/{plan.name}", "episodes": episodes}))
        return
    people = -(-episodes * plan.ratings_per_item // min(plan.items_per_participant, episodes))
    out = console()
    held = counted(episodes, "episode")
    out.print(
        f"Study {plan.name} has {held} to rate, which takes {_people(people)} or more. "
        f"`goalscope serve` shows it at /study/{plan.name}.",
        soft_wrap=True,
    )
    if any(theirs != shared for theirs in people_of.values()):
        out.print("The methods' episodes are not all of the same people.", soft_wrap=True)
    if cut := sum(info.ended == "truncated" for info in found):
        out.print(
            f"{cut} of them ended as no more rounds were allowed, perhaps before all was done.",
            soft_wrap=True,
        )
    if left_out:
        out.print(
            f"Left out: {left_out} with real people, whose wishes only the conversation tells. "
            "transcript = true takes them in.",
            soft_wrap=True,
        )
    if real:
        out.print(
            f"Raters will read what real people said in {real} of them. Do these know that?",
            soft_wrap=True,
        )
    if plan.completion.url:
        out.print(f"Its link for Prolific ends in /study/{plan.name}?{plan.id_parameter}="
                  "{{%PROLIFIC_PID%}}", soft_wrap=True)  # fmt: skip


@study.command(name="list")
def list_studies(store: StoreFile = None, as_json: Json = False) -> None:
    """List the studies, and how many people have finished."""
    from goalscope.cli.experiments import show_tables
    from goalscope.display import show_studies
    from goalscope.experiment.summary import Table
    from goalscope.store import Store
    from goalscope.study.book import Book

    with Store.open(store, new=False) as opened:
        book = Book(opened)
        rows: list[tuple[str | int | None, ...]] = []
        for each in book.all():
            people = book.participants(each)
            finished = sum(one.finished for one in people)
            items = len(book.items(each))
            rows.append((each.plan.name, each.created, each.closed, items, len(people), finished))
    columns = ("name", "made", "closed", "episodes", "agreed", "finished")
    if as_json:
        show_tables([Table("studies", "Studies", columns, tuple(rows))], as_json)
    elif rows:
        show_studies(console(), columns, rows)
    else:
        print("There is no study yet. `goalscope study new FILE` makes one.")


@study.command()
def show(name: Name, store: StoreFile = None, as_json: Json = False) -> None:
    """Show how far a study is, who does not count and why, how raters agree, and the scores.

    The evaluator's and the state's scores of the same episodes stand beside people's.
    """
    from goalscope.cli.experiments import show_tables
    from goalscope.store import Store
    from goalscope.study.book import Book
    from goalscope.study.summary import study_tables

    with Store.open(store, new=False) as opened:
        show_tables(study_tables(opened, Book(opened).named(name)), as_json)


@study.command()
def close(name: Name, store: StoreFile = None) -> None:
    """Take no new participants; those who have begun may finish."""
    from goalscope.store import Store
    from goalscope.study.book import Book

    with Store.open(store, new=False) as opened:
        book = Book(opened)
        book.close(book.named(name))
    print(f"Study {name} is closed: it takes no new participants. Who has begun may finish.")


@study.command(name="delete")
def delete_study(
    name: Name,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    store: StoreFile = None,
) -> None:
    """Delete a study with all participants and answers. The episodes stay."""
    from goalscope.store import Store
    from goalscope.study.book import Book

    with Store.open(store, new=False) as opened:
        book = Book(opened)
        found = book.named(name)
        people = len(book.participants(found))
        if not yes:
            what = f"Delete study {name} and all that {_people(people)} answered, for good?"
            typer.confirm(what, abort=True)
        book.delete(found)
    print(f"Study {name} is deleted, with all that {_people(people)} answered. Its episodes stay.")


@study.command()
def export(
    name: Name,
    out: Annotated[Path, typer.Option(metavar="FILE.csv", help="Where to.")],
    store: StoreFile = None,
    ids: Annotated[
        bool, typer.Option(help="With the ids by which recruiting services know people.")
    ] = True,
) -> None:
    """Write every answer as CSV, one a line, with the reason where it does not count."""
    from goalscope.store import Store
    from goalscope.study.book import Book
    from goalscope.study.export import as_csv

    with Store.open(store, new=False) as opened:
        text = as_csv(opened, Book(opened).named(name), ids=ids)
    try:
        out.write_text(text, encoding="utf-8", newline="")
    except OSError as error:
        raise InvalidInputError(f"{out} cannot be written: {error.strerror}.") from None


@study.command()
def forget(
    name: Name,
    participant: Annotated[int, typer.Argument(help="Their number, as `export` has it.")],
    store: StoreFile = None,
) -> None:
    """Delete a participant who takes back their consent, with all their answers."""
    from goalscope.store import Store
    from goalscope.study.book import Book

    with Store.open(store, new=False) as opened:
        book = Book(opened)
        book.forget(book.named(name), participant)


def _people(number: int) -> str:
    return "1 person" if number == 1 else f"{number} people"
