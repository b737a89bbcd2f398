"""`goalscope study`: people rate episodes on a page of their own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from goalscope.cli.options import Json, StoreFile
from goalscope.cli.terminal import console
from goalscope.types import InvalidInputError, pluralize

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
    store: StoreFile = None,
) -> None:
    """Make a study of episodes in the store. It never changes afterwards."""
    from goalscope.store import Store
    from goalscope.study.items import chosen_episodes
    from goalscope.study.plan import read_plan
    from goalscope.study.store import StudyStore

    plan = read_plan(file)
    with Store.open(store, new=False) as opened:
        found = chosen_episodes(opened, plan)
        StudyStore(opened).add(plan)
    people = -(-len(found) * plan.ratings_per_item // min(plan.items_per_participant, len(found)))
    told = (
        f"Study {plan.name} has {pluralize(len(found), 'episode')} to rate, which takes "
        f"{_people(people)} or more. `goalscope serve` shows it. Give each of them a link with an "
        f"id of their own: /study/{plan.name}?id=..."
    )
    if real := sum(info.profile is None for info in found):
        told += f" They will read what real people said in {real} of them. Do these know that?"
    console().print(told, soft_wrap=True)


@study.command(name="list")
def list_studies(store: StoreFile = None, as_json: Json = False) -> None:
    """List the studies, and how many people have finished."""
    from goalscope.cli.tables import show_tables
    from goalscope.experiment.summary import Row, Table
    from goalscope.store import Store
    from goalscope.study.store import StudyStore

    rows: list[Row] = []
    with Store.open(store, new=False) as opened:
        book = StudyStore(opened)
        for each in book.all():
            people = book.participants(each)
            rows.append({
                "name": each.plan.name, "made": each.created, "closed": each.closed,
                "episodes": len(book.items(each)), "agreed": len(people),
                "finished": sum(one.finished for one in people),
            })  # fmt: skip
    if rows or as_json:
        show_tables([Table("studies", "Studies", rows)], as_json)
    else:
        print("There is no study yet. `goalscope study new FILE` makes one.")


@study.command()
def show(name: Name, store: StoreFile = None, as_json: Json = False) -> None:
    """Show how far a study is, how raters agree, and the scores.

    The evaluator's and the state's scores of the same episodes stand beside people's.
    """
    from goalscope.cli.tables import show_tables
    from goalscope.store import Store
    from goalscope.study.store import StudyStore
    from goalscope.study.summary import study_tables

    with Store.open(store, new=False) as opened:
        show_tables(study_tables(opened, StudyStore(opened).named(name)), as_json)


@study.command()
def close(name: Name, store: StoreFile = None) -> None:
    """Take no new participants; those who have begun may finish."""
    from goalscope.store import Store
    from goalscope.study.store import StudyStore

    with Store.open(store, new=False) as opened:
        book = StudyStore(opened)
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
    from goalscope.study.store import StudyStore

    with Store.open(store, new=False) as opened:
        book = StudyStore(opened)
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
    ids: Annotated[bool, typer.Option(help="With the ids in people's links.")] = True,
) -> None:
    """Write every answer as CSV, one a line."""
    from goalscope.store import Store
    from goalscope.study.store import StudyStore
    from goalscope.study.summary import as_csv

    with Store.open(store, new=False) as opened:
        text = as_csv(opened, StudyStore(opened).named(name), ids=ids)
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
    from goalscope.study.store import StudyStore

    with Store.open(store, new=False) as opened:
        book = StudyStore(opened)
        book.forget(book.named(name), participant)


def _people(number: int) -> str:
    return "1 person" if number == 1 else f"{number} people"
