"""`goalscope infer`: beliefs over given goals for given dialogues, turn by turn."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from goalscope.base.text import model_shown
from goalscope.base.types import InvalidInputError, pluralize
from goalscope.cli.options import (
    Adapter,
    CalibrationName,
    Layout,
    Model,
    OwnLikelihood,
    Tokenizer,
    check_likelihood,
)
from goalscope.cli.terminal import model_names, opened_model, progress, say


def infer(
    file: Annotated[
        Path, typer.Argument(help="JSON Lines file of dialogues with their possible goals.")
    ],
    out: Annotated[
        Path, typer.Option(help="JSON Lines file of beliefs, turn by turn; continued if it exists.")
    ],
    model: Model = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    likelihood: OwnLikelihood = None,
    layout: Layout = None,
    calibration: CalibrationName = None,
) -> None:
    """Infer goals in a file of dialogues.

    A row is {"id", "task", "turns": [{"query", "utterance"}, ...], "goals": [...]}; goals that
    differ only in case, spaces or final punctuation are merged. One line is written for each turn:
    id, turn (from 1), words (a hash of the input), goals, log_likelihood (this turn's),
    log_posterior, probability, unspecified_log_likelihood, unspecified_probability, set_90 (a set
    of goals that contains the true one in 90 % of dialogues, or null), settings. Running it again
    continues where it stopped; a file with other words, goals or settings is refused.
    """
    from dataclasses import asdict
    from hashlib import sha256

    from goalscope.agent.settings import Settings, likelihood_for, load_own
    from goalscope.belief.calibration import calibration_named
    from goalscope.belief.likelihood import RolePlay
    from goalscope.datasets.case import read_cases
    from goalscope.experiment.infer import infer as infer_dialogues
    from goalscope.experiment.infer import trim_output
    from goalscope.experiment.measure import hashes_of, own_identity
    from goalscope.experiment.results import sole
    from goalscope.models.opening import adapter_metadata

    if not out.absolute().parent.is_dir():
        raise InvalidInputError(
            f"There is no folder {out.parent}. Create it, or name another file."
        )
    check_likelihood(likelihood, layout)
    given = calibration_named(calibration) if calibration else None
    own = None if likelihood is None else load_own(likelihood)
    chosen = Settings(likelihood=own, layout=layout, calibration=calibration)
    dialogues = read_cases(file, labelled=False)
    cut: list[str] = []
    names = model_names(model, tokenizer=tokenizer, adapter=adapter)
    with opened_model(names) as engine:
        evidence = likelihood_for(chosen, engine)
        settings = {
            "model": model_shown(engine.name),
            "adapter": adapter_metadata(engine).get("general.name"),
            "weights": sha256(engine.speaker.fingerprint.encode()).hexdigest()[:12],
            **own_identity(),
            "layout": evidence.layout if isinstance(evidence, RolePlay) else None,
            "calibration": json.loads(json.dumps(asdict(given or evidence.calibration))),
            **({"likelihood": {own: hashes_of(chosen)["likelihood"]}} if own else {}),
        }
        with sole(out):
            left = trim_output(out, dialogues, settings)
            done = len(dialogues) - len(left)
            with progress("Dialogues") as show:
                show(done, len(dialogues))
                for dialogue in infer_dialogues(left, out, evidence, settings, given):
                    done += 1
                    show(done, len(dialogues))
                    if isinstance(evidence, RolePlay) and evidence.window(
                        dialogue.task, dialogue.turns
                    ):
                        cut.append(dialogue.id)
    if cut:
        say(f"Too long for the model, so the oldest turns were left out: {cut}", stderr=True)
    turns = sum(len(dialogue.turns) for dialogue in dialogues)
    held = f"{pluralize(len(dialogues), 'dialogue')}, {pluralize(turns, 'turn')}"
    say(f"{out}: {held}", stderr=True)
