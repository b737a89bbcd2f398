"""What both fits share: read the corpora, fit the embedded model, and tell how far it is."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from corpus import Entry, corpus_facts, read_entries
from goalscope.cli.fit import base_of, engine_of
from goalscope.cli.reading import chosen_lines, languages_of
from goalscope.experiment.reading_scores import Line
from goalscope.fitting.train import check_folder
from goalscope.models.adapters import read_adapter
from lessons import lessons_of
from writing import WritingSettings, fit_writing


def run(
    name: str,
    corpus: Sequence[Path],
    settings: WritingSettings,
    *,
    validate: Sequence[Path],
    domains: Sequence[str],
) -> None:
    """Fit an adapter; the same command resumes an interrupted fit.

    Args:
        name: Its name, also of its folder in adapters/.
        corpus: Files and folders; what is named twice is drawn twice as often.
        settings: How to fit.
        validate: Files and folders for the final evaluation.
        domains: Domains of the messages, or TOML files that declare some by their verbs.
    """
    parser = argparse.ArgumentParser(description=f"Fit the {name}.")
    parser.add_argument("--out", type=Path, default=Path("adapters", name))
    parser.add_argument("--model", help="Model to adapt.  [default: the embedded one]")
    parser.add_argument("--device", help="Such as cpu or cuda:1.  [default: a GPU if there is one]")
    parser.add_argument(
        "--corpus", type=Path, action="append", default=[], help="Another file; repeatable."
    )
    parser.add_argument(
        "--domain", action="append", default=[], help="FILE.py or FILE.toml of its messages."
    )
    parser.add_argument("--start", type=Path, help="Adapter to start from.  [default: none]")
    parser.add_argument("--epochs", type=float, default=settings.epochs)
    given = parser.parse_args()
    settings = replace(settings, epochs=given.epochs)
    corpus = [*corpus, *given.corpus]
    languages = languages_of([*domains, *given.domain])

    def entries(paths: Sequence[Path]) -> list[Entry]:
        every = [entry for path in paths for entry in read_entries(path)]
        lines = [entry for entry in every if isinstance(entry, Line)]
        rest = [entry for entry in every if not isinstance(entry, Line)]
        return [*(chosen_lines(lines, languages, True) if lines else ()), *rest]

    taught, tried = entries(corpus), entries(validate)
    check_folder(given.out)
    engine = engine_of(given.model, given.device)
    lessons, validation = (
        lessons_of(each, engine, languages, known=taught) for each in (taught, tried)
    )
    fit = fit_writing(
        engine,
        lessons,
        settings,
        given.out,
        validation=validation,
        base=base_of(given.model),
        corpus=corpus_facts(taught, [str(path) for path in corpus]),
        command=shlex.join(["python", *sys.argv]),
        start=read_adapter(given.start, engine.network.model.config) if given.start else None,
    )
    for step, steps, loss in fit:
        if step % 20 == 0 or step == steps:
            print(f"step {step:4} of {steps}  loss {loss:.3f}", file=sys.stderr)
    engine.close()
