"""Goal inference over a file of dialogues: JSON Lines in, JSON Lines out, resumable."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any, cast

from goalscope.base.types import UNSPECIFIED, GoalscopeError, InvalidInputError
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import Calibration
from goalscope.belief.likelihood import Likelihood, evidence_of
from goalscope.datasets.case import Case
from goalscope.models.opening import forget


def trim_output(
    out: Path, dialogues: Sequence[Case], settings: Mapping[str, Any]
) -> Sequence[Case]:
    """Cut `out` after the last dialogue that is complete in it; return those still to do.

    Raises:
        InvalidInputError: `out` holds something else, or was made with other settings.
    """
    data = out.read_bytes() if out.is_file() else b""
    *lines, torn = data.split(b"\n")  # a crash can tear the last line
    if torn[:6] != b'{"id":'[: len(torn)]:
        raise InvalidInputError(f"{out} was not written by `goalscope infer`. Name another file.")
    done = kept = position = 0
    for dialogue in dialogues:
        for turn in range(1, len(dialogue.turns) + 1):
            if position == len(lines):
                break
            _check_line(out, position + 1, lines[position], dialogue, turn, settings)
            position += 1
        else:
            done, kept = done + 1, position
            continue
        break
    if position < len(lines):
        raise InvalidInputError(f"{out} has results of other dialogues. Name another file.")
    size = sum(len(line) + 1 for line in lines[:kept])
    if size < len(data):
        _write(out, b"", size)
    return dialogues[done:]


def infer(
    dialogues: Sequence[Case],
    out: Path,
    likelihood: Likelihood,
    settings: Mapping[str, Any],
    calibration: Calibration | None = None,
) -> Iterator[Case]:
    """Append one line per turn to `out`, and yield each dialogue when it is on disk.

    A line holds `id`, `turn` (1 for the first), `words` (a short hash of the task and the turns so
    far), `goals`, and in their order `log_likelihood` (this turn's, nats), `log_posterior` (nats)
    and `probability` after this turn, normalised over these goals; `unspecified_log_likelihood`,
    this turn's under no stated goal; `unspecified_probability`, that the person's goal is none of
    these; `set_90`, the conformal set that holds what is true in 90 % of dialogues, None where the
    calibration has none; and `settings`.

    Args:
        dialogues: The dialogues.
        out: The file.
        likelihood: Scores the words.
        settings: What is to stand in each line.
        calibration: How evidence becomes probabilities; that of the likelihood if None.

    Raises:
        InvalidInputError: A dialogue does not fit the model.
    """
    for dialogue in dialogues:
        forget(getattr(likelihood, "model", None))  # so that a resumed run scores the same
        try:
            goals = [*dialogue.goals, UNSPECIFIED]
            table = evidence_of(likelihood, dialogue.task, goals, dialogue.turns)
        except InvalidInputError as error:
            raise InvalidInputError(f"Dialogue {dialogue.id!r}: {error}") from error
        way = calibration or likelihood.calibration
        belief = Belief.uniform(dialogue.goals, way)
        wider = Belief.uniform([*dialogue.goals, UNSPECIFIED], way)
        lines: list[str] = []
        for turn, row in enumerate(table, 1):
            belief, wider = belief.observe(row[:-1]), wider.observe(row)
            line = {
                **_of(dialogue, turn),
                "log_likelihood": row[:-1].tolist(),
                "log_posterior": belief.log_posterior.tolist(),
                "probability": belief.probability.tolist(),
                "unspecified_log_likelihood": float(row[-1]),
                "unspecified_probability": float(wider.probability[-1]),
                "set_90": [goal.text for goal in wider.conformal_set(0.1)]
                if 0.1 in dict(way.thresholds)
                else None,
                "settings": dict(settings),
            }
            lines.append(json.dumps(line, allow_nan=False) + "\n")
        _write(out, "".join(lines).encode())
        yield dialogue


def _of(dialogue: Case, turn: int) -> dict[str, Any]:
    """What a line says of its turn; one that says it too need not be measured again."""
    read = json.dumps([dialogue.task, *map(asdict, dialogue.turns[:turn])])
    return {
        "id": dialogue.id,
        "turn": turn,
        "words": sha256(read.encode()).hexdigest()[:12],
        "goals": [goal.text for goal in dialogue.goals],
    }


def _check_line(
    out: Path,
    number: int,
    line: bytes,
    dialogue: Case,
    turn: int,
    settings: Mapping[str, Any],
) -> None:
    """Refuse to continue a file that these dialogues and settings did not make."""
    expected = _of(dialogue, turn)
    try:
        row = json.loads(line)
        found = {key: row.get(key) for key in expected}
        made_with = row["settings"]
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        raise InvalidInputError(
            f"{out}, line {number}: not written by `goalscope infer`. Name another file."
        ) from error
    if made_with != settings:
        made = cast("dict[str, Any]", made_with if isinstance(made_with, dict) else {})
        other = "; ".join(
            f"another {key}"
            if isinstance(settings.get(key), dict)
            else f"{key} {made.get(key)!r} and not {settings.get(key)!r}"
            for key in {**settings, **made}
            if made.get(key) != settings.get(key)
        )
        raise InvalidInputError(
            f"{out}, line {number}: written with {other}. Name another file, or delete this one."
        )
    if found != expected:
        raise InvalidInputError(
            f'{out}, line {number}: expected turn {turn} of "{dialogue.id}" with its words '
            "and goals. The file is for other dialogues. Name another file."
        )


def _write(out: Path, data: bytes, size: int | None = None) -> None:
    """Append to the file on disk, after cutting it to `size` bytes where that is given."""
    try:
        with out.open("ab") as file:
            if size is not None:
                file.truncate(size)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise GoalscopeError(
            f"Cannot write {out}: {error.strerror or error}. Free some space or name another "
            "file; complete results in it are kept."
        ) from error
