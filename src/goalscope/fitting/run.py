"""From dialogues to an adapter in a folder."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from goalscope.datasets.goal_sets import goal_key
from goalscope.fitting.card import write_card
from goalscope.fitting.fit import Fit, Progress, Settings
from goalscope.fitting.learner import Learner
from goalscope.fitting.sources import Source, parted
from goalscope.likelihood import Layout, RolePlay
from goalscope.models.adapters import FITTED_GOALS, read_adapter, write_adapter
from goalscope.models.extras import package
from goalscope.models.transformers import Transformers
from goalscope.types import GoalscopeError

__all__ = ["fit_adapter"]

_SHARE = 0.1  # of the dialogues, that validates


def fit_adapter(
    model: Transformers,
    sources: Sequence[Source],
    folder: Path,
    settings: Settings,
    *,
    start: Path | None,
    layout: Layout,
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
        command: What asked for it, for the card.

    Raises:
        InvalidInputError: The folder holds something else, or the dialogues are too few.
        ModelError: The model cannot be adapted.
        GoalscopeError: The folder cannot be written.
    """
    train, validation = parted(
        sources, share=_SHARE, most=settings.validation, seed=settings.seed
    )  # fmt: skip
    learner = Learner(
        model,
        RolePlay(model, layout=layout),
        rank=settings.rank,
        layers=settings.layers,
        seed=settings.seed,
    )
    config = model.network.model.config
    if start is not None:
        learner.begin(read_adapter(start, config))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GoalscopeError(f"{folder} cannot be made: {error.strerror or error}.") from None
    about: dict[str, Any] = {
        "base": model.name,
        "layout": layout,
        "start": f"the adapter of SHA-256 `{_digest(start)[:16]}`" if start else "no adapter",
        "sources": [
            {
                "name": source.name,
                "train": len(own),
                "validation": sum(case in validation for case in source.cases),
                "licence": source.licence,
                "sha256": source.sha256,
            }
            for source, own in zip(sources, train, strict=True)
        ],
    }
    fit = Fit(learner, train, validation, settings, folder, about)
    yield from fit.run()
    goals = sorted({goal_key(case.goals[case.truth].text) for own in train for case in own})
    adapter = learner.adapter(
        {
            "general.name": folder.name,
            "goalscope.base": model.name,
            "goalscope.layout": layout,
            "goalscope.temperature": f"{settings.temperature:g}",
            FITTED_GOALS: " ".join(goals),
        }
    )
    more = {
        "device": str(model.network.device),
        "memory": _memory(model),
        "validated": len(validation),
        "command": command,
    }
    try:
        learner.save_peft(folder)
        write_adapter(folder / "adapter.gguf", adapter, config)
        write_card(folder, fit, {**about, **more})
        os.unlink(folder / "state.pt")
    except OSError as error:
        raise GoalscopeError(
            f"The adapter cannot be written to {folder}: {error.strerror or error}. Free some "
            "space; the same command goes on from what is kept."
        ) from None


def _digest(file: Path) -> str:
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


def _memory(model: Transformers) -> str:
    torch = package("torch")
    if model.network.device.type == "cuda":
        return f"at most {torch.cuda.max_memory_allocated() / 1e9:.1f} GB of the GPU's memory"
    try:
        import resource
    except ImportError:  # Windows
        return "an unknown amount of memory"
    return f"at most {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.1f} GB of memory"
