"""`goalscope study`: people rate episodes on a web page."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from goalscope.base.types import pluralize
from goalscope.cli.options import Json, StoreFile
from goalscope.cli.terminal import say, show_tables

if TYPE_CHECKING:
    from goalscope.storage.store import Store
    from goalscope.study.store import StudyStore

study = typer.Typer(no_args_is_help=True, help="Studies in which people rate episodes.")

Name = Annotated[str, typer.Argument(help="Name of the study.")]


@contextmanager
def _opened(place: str | None) -> Generator[tuple[Store, StudyStore]]:
    from goalscope.storage.store import Store
    from goalscope.study.store import StudyStore

    with Store.open(place, new=False) as store:
        yield store, StudyStore(store)


@study.command()
def example() -> None:
    """Print an example of a study file with all its keys."""
    from importlib.resources import files

    print((files("goalscope.study") / "example.toml").read_text("utf-8"), end="")


@study.command()
def new(
    file: Annotated[
        Path, typer.Argument(help="TOML file that describes the study; see `example`.")
    ],
    store: StoreFile = None,
) -> None:
    """Create a study of the episodes in the store. It never changes afterwards."""
    from goalscope.study.plan import chosen_episodes, read_plan

    plan = read_plan(file)
    with _opened(store) as (opened, studies):
        found = chosen_episodes(opened, plan)
        studies.add(plan)
    people = -(-len(found) * plan.ratings_per_item // min(plan.items_per_participant, len(found)))
    told = (
        f"Study {plan.name} has {pluralize(len(found), 'episode')} to rate, which takes at "
        f"least {_people(people)}. `{opened.command('serve')}` serves it. Give each participant a "
        f"link with their own id: /study/{plan.name}?id=..."
    )
    if real := sum(info.profile is None for info in found):
        told += (
            f" Participants will read what real people said in {real} of the episodes. Make sure "
            "that these people agree."
        )
    say(told)


@study.command(name="list")
def list_studies(store: StoreFile = None, as_json: Json = False) -> None:
    """List the studies and how many people have finished."""
    from goalscope.experiment.summary import Row, Table

    rows: list[Row] = []
    with _opened(store) as (opened, studies):
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
        say(f"There are no studies yet. `{opened.command('study', 'new', 'FILE')}` creates one.")


@study.command()
def show(name: Name, store: StoreFile = None, as_json: Json = False) -> None:
    """Show the progress of a study, the agreement of raters, and the scores.

    Human scores are shown next to those of the evaluator and of the final state.
    """
    from goalscope.study.summary import study_tables

    with _opened(store) as (opened, studies):
        show_tables(study_tables(opened, studies.named(name)), as_json)


@study.command()
def close(name: Name, store: StoreFile = None) -> None:
    """Close a study to new participants; those who have begun may finish."""
    with _opened(store) as (_, studies):
        studies.close(studies.named(name))
    print(f"Study {name} is closed to new participants. Those who have begun may finish.")


@study.command(name="delete")
def delete_study(
    name: Name,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask for confirmation.")] = False,
    store: StoreFile = None,
) -> None:
    """Delete a study with all its participants and answers, but not its episodes."""
    with _opened(store) as (_, studies):
        found = studies.named(name)
        people = _people(len(studies.participants(found)))
        if not yes:
            typer.confirm(f"Delete study {name} and the answers of {people}?", abort=True)
        studies.delete(found)
    print(f"Deleted study {name} and the answers of {people}. Its episodes are kept.")


@study.command()
def export(
    name: Name,
    out: Annotated[Path, typer.Option(metavar="FILE.csv", help="CSV file to write.")],
    store: StoreFile = None,
    ids: Annotated[bool, typer.Option(help="Include the ids from participants' links.")] = True,
) -> None:
    """Write all answers as CSV, one per line."""
    from goalscope.study.summary import as_csv

    with _opened(store) as (opened, studies):
        text = as_csv(opened, studies.named(name), ids=ids)
    out.write_text(text, encoding="utf-8", newline="")


@study.command()
def forget(
    name: Name,
    participant: Annotated[int, typer.Argument(help="Number of the participant, as in `export`.")],
    store: StoreFile = None,
) -> None:
    """Delete a participant who withdraws consent, with all their answers."""
    with _opened(store) as (_, studies):
        studies.forget(studies.named(name), participant)


def _people(number: int) -> str:
    return "1 person" if number == 1 else f"{number} people"
