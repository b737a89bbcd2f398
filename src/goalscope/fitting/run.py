"""From dialogues to an adapter in a folder."""

from __future__ import annotations

import hashlib
import importlib.metadata
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from goalscope.datasets import Case, said_key
from goalscope.datasets.goal_sets import goal_key
from goalscope.fitting.card import write_card
from goalscope.fitting.fit import Fit, Progress, Settings
from goalscope.fitting.learner import Learner
from goalscope.fitting.sources import Source, digest_of, parted
from goalscope.likelihood import GOAL_TOKENS, Layout, RolePlay
from goalscope.models.adapters import (
    FITTED_DIALOGUES,
    FITTED_GOALS,
    FITTED_LAYOUT,
    Adapter,
    read_adapter,
    write_adapter,
)
from goalscope.models.extras import package
from goalscope.models.transformers import Transformers
from goalscope.types import GoalscopeError, InvalidInputError, Message

__all__ = ["fit_adapter"]


def fit_adapter(
    model: Transformers,
    sources: Sequence[Source],
    folder: Path,
    settings: Settings,
    *,
    start: Path | None,
    layout: Layout,
    base: str,
    command: str,
) -> Iterator[Progress]:
    """Fit an adapter, yielding each step and validation; in the end it stands in the folder.

    Args:
        model: The model to adapt; it is changed.
        sources: The dialogues.
        folder: Of the adapter; an interrupted fit in it goes on.
        settings: How to fit.
        start: GGUF file of the adapter to begin with.
        layout: Where the goal stands in the prompt.
        base: What others call the model, such as its name on the hub.
        command: What asked for it, for the card.

    Raises:
        InvalidInputError: The folder holds something else, the dialogues are too few, or one is too
            long for the model.
        ModelError: The model cannot be adapted.
        GoalscopeError: The folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / ".lock")
        lock.acquire(blocking=False)
    except Timeout:
        raise InvalidInputError(f"Another process fits an adapter in {folder}.") from None
    except OSError as error:
        raise GoalscopeError(f"{folder} cannot be written: {error.strerror or error}.") from None
    try:
        _refuse_foreign(folder)
        begun = read_adapter(start, model.network.model.config) if start else None
        known = {
            key: set(begun.metadata.get(key, "").split() if begun else ())
            for key in (FITTED_DIALOGUES, FITTED_GOALS)
        }
        train, validation = parted(
            sources,
            validation=settings.validation,
            seed=settings.seed,
            learned=known[FITTED_DIALOGUES],
        )
        if begun is not None:
            fitted = begun.metadata.get(FITTED_LAYOUT, layout)
            if fitted != layout:
                raise InvalidInputError(
                    f"The adapter to begin with was fitted with the layout {fitted}, not {layout}. "
                    f"Give --layout {fitted}, or begin with --start none."
                )
            count = model.network.model.config.num_hidden_layers
            adapted = len({number for number, _ in begun.layers})
            settings = replace(settings, rank=begun.rank, layers=adapted / count)
        about: dict[str, Any] = {
            "base": base,
            "layout": layout,
            "start": _beginning(start, begun),
            "sources": [
                {
                    "name": source.name,
                    "train": len({case.id for case in own}),
                    "validation": sum(case in validation for case in source.cases),
                    "licence": source.licence,
                    "sha256": source.sha256,
                }
                for source, own in zip(sources, train, strict=True)
            ],
        }
        made_by = {
            "version": importlib.metadata.version("goalscope"),
            "model": hashlib.sha256(model.fingerprint.encode()).hexdigest()[:16],
        }
        roleplay = RolePlay(model, layout=layout)
        _check_lengths(roleplay, sources, settings)
        learner = Learner(
            model,
            roleplay,
            rank=settings.rank,
            layers=settings.layers,
            seed=settings.seed,
            start=begun,
        )
        fit = Fit(learner, train, validation, settings, folder, {**about, **made_by})
        yield from fit.run()

        taught = fit.taught()
        for case in chain.from_iterable(taught):
            known[FITTED_DIALOGUES].add(said_key(case.turns))
            known[FITTED_GOALS].add(goal_key(case.goals[case.truth].text))
        adapter = learner.adapter(
            {
                "general.name": folder.name,
                "goalscope.base": base,
                FITTED_LAYOUT: layout,
                "goalscope.temperature": f"{settings.temperature:g}",
                **{key: " ".join(sorted(keys)) for key, keys in known.items()},
            }
        )
        more = {
            "sources": [
                {**source, "learned": len(own)}
                for source, own in zip(about["sources"], taught, strict=True)
            ],
            "device": str(model.network.device),
            "memory": _memory(model),
            "validated": len(validation),
            "command": command,
        }
        try:
            learner.save_peft(folder, base)
            write_card(folder, fit, {**about, **more})
            write_adapter(folder / "adapter.gguf", adapter, model.network.model.config)
            (folder / "state.pt").unlink()
        except OSError as error:
            raise GoalscopeError(
                f"The adapter cannot be written to {folder}: {error.strerror or error}. Free some "
                "space; the same command goes on from what is kept."
            ) from None
    finally:
        lock.release()
        Path(lock.lock_file).unlink(missing_ok=True)


def _beginning(start: Path | None, adapter: Adapter | None) -> str:
    if start is None or adapter is None:
        return "no adapter"
    text = f"the adapter of SHA-256 `{digest_of(start)[:16]}`"
    if FITTED_DIALOGUES in adapter.metadata:
        return text
    return f"{text}, which does not tell what it learned from: perhaps from some that validate"


def _refuse_foreign(folder: Path) -> None:
    """Go on with an interrupted fit, or begin in an empty folder, and nowhere else."""
    if (folder / "state.pt").exists():
        return
    others = sorted(each.name for each in folder.iterdir() if each.name != ".lock")
    if "adapter.gguf" in others:
        raise InvalidInputError(f"{folder} holds a finished adapter. Name another with --out.")
    if others and others != ["state.part"]:
        raise InvalidInputError(
            f"{folder} holds {others[0]} and no interrupted fit. Name a new folder with --out."
        )


def _check_lengths(roleplay: RolePlay, sources: Sequence[Source], settings: Settings) -> None:
    """Find what does not fit the model before the work begins.

    Raises:
        InvalidInputError: A goal or a turn is too long; names the dialogue.
    """
    model = roleplay.model

    def check(case: Case) -> None:
        for goal in case.goals:
            # A token has at least a byte, so short texts need not be counted.
            if len(goal.text.encode()) <= GOAL_TOKENS:
                continue
            tokens = model.count_tokens([Message("user", goal.text)])
            if tokens > GOAL_TOKENS:
                raise InvalidInputError(
                    f"a goal has {tokens} tokens; it may have {GOAL_TOKENS}: {goal.text[:60]!r}..."
                )
        for t, turn in enumerate(case.turns[: settings.longest]):
            if len(f"{case.task}{turn.query}{turn.utterance}".encode()) > model.context_size // 4:
                roleplay.window(case.task, case.turns[: t + 1])

    for source in sources:
        for case in source.cases:
            try:
                check(case)
            except InvalidInputError as error:
                raise InvalidInputError(f"{source.name}, dialogue {case.id}: {error}") from None


def _memory(model: Transformers) -> str:
    torch = package("torch")
    if model.network.device.type == "cuda":
        return f"at most {torch.cuda.max_memory_allocated() / 1e9:.1f} GB of the GPU's memory"
    try:
        import resource
    except ImportError:  # Windows
        return "an unknown amount of memory"
    unit = 1 if sys.platform == "darwin" else 1024
    bytes_ = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
    return f"at most {bytes_ / 1e9:.1f} GB of memory"
