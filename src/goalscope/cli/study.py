"""`goalscope study`: people rate episodes on a page of their own."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from goalscope.cli.options import Json, StoreFile
from goalscope.cli.terminal import console
from goalscope.types import InvalidInputError, pluralize

if TYPE_CHECKING:
    from goalscope.store import Store
    from goalscope.study.store import StudyStore

__all__ = ["study"]

study = typer.Typer(no_args_is_help=True, help="Studies in which people rate episodes.")

Name = Annotated[str, typer.Argument(help="Of the study.")]


@contextmanager
def _opened(place: str | None) -> Generator[tuple[Store, StudyStore]]:
    from goalscope.store import Store
    from goalscope.study.store import StudyStore

    with Store.open(place, new=False) as store:
        yield store, StudyStore(store)


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
    from goalscope.study.items import chosen_episodes
    from goalscope.study.plan import read_plan

    plan = read_plan(file)
    with _opened(store) as (opened, studies):
        found = chosen_episodes(opened, plan)
        studies.add(plan)
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

    rows: list[Row] = []
    with _opened(store) as (_, studies):
        for each in studies.all():
            people = studies.participants(each)
            rows.append({
                "name": each.plan.name, "made": each.created, "closed": each.closed,
                "episodes": len(studies.items(each)), "agreed": len(people),
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
    from goalscope.study.summary import study_tables

    with _opened(store) as (opened, studies):
        show_tables(study_tables(opened, studies.named(name)), as_json)


@study.command()
def close(name: Name, store: StoreFile = None) -> None:
    """Take no new participants; those who have begun may finish."""
    with _opened(store) as (_, studies):
        studies.close(studies.named(name))
    print(f"Study {name} is closed: it takes no new participants. Who has begun may finish.")


@study.command(name="delete")
def delete_study(
    name: Name,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    store: StoreFile = None,
) -> None:
    """Delete a study with all participants and answers. The episodes stay."""
    with _opened(store) as (_, studies):
        found = studies.named(name)
        people = _people(len(studies.participants(found)))
        if not yes:
            typer.confirm(f"Delete study {name} and all that {people} answered?", abort=True)
        studies.delete(found)
    print(f"Study {name} is deleted, with all that {people} answered. Its episodes stay.")


@study.command()
def export(
    name: Name,
    out: Annotated[Path, typer.Option(metavar="FILE.csv", help="Where to.")],
    store: StoreFile = None,
    ids: Annotated[bool, typer.Option(help="With the ids in people's links.")] = True,
) -> None:
    """Write every answer as CSV, one a line."""
    from goalscope.study.summary import as_csv

    with _opened(store) as (opened, studies):
        text = as_csv(opened, studies.named(name), ids=ids)
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
    """Delete a participant who withdraws their consent, with all their answers."""
    with _opened(store) as (_, studies):
        studies.forget(studies.named(name), participant)


def _people(number: int) -> str:
    return "1 person" if number == 1 else f"{number} people"
