"""`goalscope bench` and `experiment`: measure, and print tables of the results."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from goalscope.base.text import command_line
from goalscope.base.types import GoalscopeError, InvalidInputError, pluralize
from goalscope.cli.options import (
    Adapter,
    Data,
    Goals,
    Json,
    Layout,
    Limit,
    Model,
    Scorer,
    Seed,
    Tokenizer,
    TraceFile,
    Writer,
)
from goalscope.cli.terminal import loading, model_names, progress, show_tables

if TYPE_CHECKING:
    from goalscope.experiment.plan import Experiment
    from goalscope.models.opening import ModelKey

bench = typer.Typer(
    no_args_is_help=True, help="Infer known goals, and compare with simpler methods."
)
experiment = typer.Typer(no_args_is_help=True, help="Run experiments described by TOML files.")

Folder = Annotated[
    Path | None,
    typer.Option("--results", metavar="DIR", help="Folder of results.  [default: results]"),
]
Workers = Annotated[
    int, typer.Option(min=1, help="Number of processes, each of which opens the model.")
]
Anyway = Annotated[
    bool,
    typer.Option("--anyway", help="Continue even if code, prompts or a model have changed."),
]


@bench.command()
def mcq(
    file: Annotated[
        str,
        typer.Argument(
            help="File of questions (JSON Lines or CSV), or a split of the dataset mcq."
        ),
    ] = "dev",
    model: Model = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    data: Data = None,
    limit: Limit = None,
    layout: Layout = None,
    results: Folder = None,
    workers: Workers = 1,
    anyway: Anyway = False,
    as_json: Json = False,
) -> None:
    """Infer which choice a person took from a paraphrase of their answer (Sec. 4.1).

    The goals are four paraphrases of each choice. The model writes those that the file lacks.
    Running it again measures only what is missing.
    """
    from goalscope.belief.likelihood import DEFAULT_LAYOUT
    from goalscope.datasets import DATASETS
    from goalscope.experiment.plan import Experiment, QuestionsPart

    name = DATASETS["mcq"].files.get(file, file)
    part = QuestionsPart(name, limit, (layout or DEFAULT_LAYOUT,))
    plan = Experiment(
        f"mcq-{Path(name).stem}",
        f"Isolated inference: {Path(name).name}",
        "Sec. 4.1",
        (_model(model, generator, scorer, tokenizer, adapter),),
        mcq=(part,),
    )
    _run(plan, data, results, workers, anyway, as_json)


@bench.command()
def dialogues(
    set: Annotated[
        str | None, typer.Argument(help="teach, multiwoz, casino, alfred or taskmaster4.")
    ] = None,
    jsonl: Annotated[
        Path | None,
        typer.Option(
            help='Your own dialogues: rows as for `infer`, with the true goal under "true".'
        ),
    ] = None,
    data: Data = None,
    split: Annotated[str | None, typer.Option(help="Split of the dataset.")] = None,
    goal_set: Annotated[
        list[str] | None,
        typer.Option(
            help="How wrong goals are drawn: random, hard or complete.  [default: all that the "
            "set has]"
        ),
    ] = None,
    goals: Goals = 20,
    seed: Seed = 1,
    limit: Limit = None,
    turns: Annotated[
        int | None, typer.Option(min=1, help="Use only the first N turns of each dialogue.")
    ] = None,
    model: Model = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    layout: Layout = None,
    fit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="DIALOGUES",
            help="Also fit simple methods on FILE.jsonl or SET:SPLIT, as `goalscope fit` takes "
            "them; repeatable.",
        ),
    ] = None,
    outright: Annotated[
        bool, typer.Option(help="Also ask the model directly for the goal.")
    ] = True,
    results: Folder = None,
    workers: Workers = 1,
    anyway: Anyway = False,
    as_json: Json = False,
) -> None:
    """Infer people's goals in real dialogues, turn by turn.

    The baselines are word similarity (TF-IDF, BM25), sentence embeddings, the model asked
    directly, and with --fit methods that are fitted on other dialogues. Running it again measures
    only what is missing.
    """
    if bool(set) == bool(jsonl):
        raise InvalidInputError(
            "Expected either a dataset, such as teach, or your own file with --jsonl FILE. "
            "`goalscope data list` shows the datasets."
        )
    from goalscope.belief.likelihood import DEFAULT_LAYOUT
    from goalscope.experiment.plan import DialoguesPart, Experiment

    part = DialoguesPart(
        set or "",
        str(jsonl) if jsonl else "",
        split,
        tuple(goal_set or ()),
        goals,
        seed,
        limit,
        turns,
        (layout or DEFAULT_LAYOUT,),
        outright=outright,
        fit=tuple(fit or ()),
    )
    name = set or (jsonl.stem if jsonl else "dialogues")
    plan = Experiment(
        f"dialogues-{name}",
        f"Real dialogues: {name}",
        models=(_model(model, generator, scorer, tokenizer, adapter),),
        dialogues=(part,),
    )
    _run(plan, data, results, workers, anyway, as_json)


@bench.command()
def people(
    results: Annotated[
        Path, typer.Argument(help="Results of an experiment with episodes: results/NAME.db.")
    ],
    set: Annotated[
        str, typer.Option(help="Real people: teach, multiwoz, casino or taskmaster4.")
    ] = "teach",
    data: Data = None,
    limit: Limit = 40,
    model: Model = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    as_json: Json = False,
) -> None:
    """Compare how simulated people talk with how real people do.

    Shows the lengths of turns, questions, how much of the goal is recited, and how likely real
    words are by the prompts that play people.
    """
    from goalscope.datasets import data_folder, load
    from goalscope.experiment.measure import opened
    from goalscope.experiment.realism import prompt_table, realism_table, simulated_talks
    from goalscope.experiment.results import Results

    cases = load(set, data_folder(data))[:limit]
    with Results.in_memory(results) as kept:
        talks = simulated_talks(kept)
    if not talks:
        raise InvalidInputError(
            f"{results} has no episodes. `goalscope experiment run FILE` makes some, from a file "
            'with [[episodes]] and humans = "simulated".'
        )
    with loading():
        playing = opened(_model(model, generator, scorer, tokenizer))
    tables = [realism_table(talks, set, cases), prompt_table(set, cases, playing)]
    show_tables(tables, as_json)


@experiment.command(name="run")
def run_experiment(
    file: Annotated[
        Path, typer.Argument(help="TOML file that describes the experiment; see plans/.")
    ],
    data: Data = None,
    model: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MODEL",
            help="Model to use in place of all in the file but the judge's; repeatable.",
        ),
    ] = None,
    generator: Writer = None,
    results: Folder = None,
    workers: Workers = 1,
    anyway: Anyway = False,
    trace: TraceFile = None,
    as_json: Json = False,
) -> None:
    """Run the missing cells of an experiment, and print its tables.

    Results are saved as they come; after an interruption, the same command continues.
    """
    from goalscope.experiment.plan import read_experiment

    plan = read_experiment(file)
    if model or generator:
        plan = plan.with_models(tuple(_model(each, generator) for each in model or (None,)))
    _run(plan, data, results, workers, anyway, as_json, trace)


def _run(
    plan: Experiment,
    data: Path | None,
    results: Path | None,
    workers: int,
    anyway: bool,
    as_json: bool,
    trace: Path | None = None,
) -> None:
    from goalscope.datasets import named_folder
    from goalscope.experiment.measure import opened
    from goalscope.experiment.plan import judging, specs_of
    from goalscope.experiment.results import Results, sole
    from goalscope.experiment.run import check_packages, run
    from goalscope.experiment.tables import tables_of

    check_packages()
    specs = specs_of(plan, named_folder(data))
    folder = results or Path(os.environ.get("GOALSCOPE_RESULTS") or "results")
    path = folder / f"{plan.name}.db"
    path.parent.mkdir(parents=True, exist_ok=True)
    command = command_line(*sys.argv[1:])
    failed: list[str] = []
    done = total = 0
    with loading():
        for spec in specs[:1]:
            opened(spec["model"])
    with sole(path), Results.open(path) as kept:
        try:
            with progress(plan.title or plan.name) as show:
                for step in run(
                    plan, specs, kept, workers=workers, anyway=anyway, command=command, trace=trace
                ):
                    done, total = step.done, step.total
                    show(done, total)
                    if step.cell is None:
                        left = f"Missing: {total - done:,} of {pluralize(total, 'cell')}. Results "
                        left += f"are saved in {path} as they come, and the same command continues."
                        whole = f"Nothing is missing: {path} has all {pluralize(total, 'cell')}."
                        print(left if done < total else whole, file=sys.stderr, flush=True)
                        facts = ("name", "title", "source", "provenance", "aside")
                        kept.describe({fact: getattr(plan, fact) for fact in facts})
                    elif step.error:
                        failed.append(step.error)
        except (KeyboardInterrupt, GoalscopeError):
            if total:
                held = f"{done:,} of {pluralize(total, 'result')}"
                typer.echo(f"{path} has {held}. The same command continues.", err=True)
            raise
        planned = kept.planned(specs)
        cells = kept.planned([*specs, *judging(plan, planned)])
        show_tables(tables_of(cells), as_json)
    if done and not as_json:
        typer.echo(f"Figures: {command_line('report', path)} draws them.", err=True)
    if failed:
        raise GoalscopeError(
            f"{len(failed)} of {pluralize(total, 'cell')} failed, for example: {failed[0]} "
            "The same command tries them again."
        )


def _model(
    model: str | None,
    generator: str | None = None,
    scorer: str | None = None,
    tokenizer: str | None = None,
    adapter: str | None = None,
) -> dict[ModelKey, str]:
    """The model settings of a cell."""
    model, generator, scorer = (
        None if name == "embedded" else name for name in (model, generator, scorer)
    )
    given = model_names(model, generator, scorer, tokenizer, adapter)
    return {key: value for key, value in given.items() if value}
