"""What a fit is to do, as far as it can be known, and refused, before a model is loaded."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from goalscope.datasets import Case
from goalscope.fitting.fit import Settings
from goalscope.fitting.sources import Source, digest_of, parted
from goalscope.likelihood import Layout
from goalscope.models.adapters import (
    FITTED_DIALOGUES,
    FITTED_LAYOUT,
    FITTED_SOURCES,
    adapter_metadata,
)
from goalscope.types import InvalidInputError

__all__ = ["Plan", "plan_fit"]


@dataclass(frozen=True, slots=True)
class Plan:
    """What a fit is to do, as far as it is known without the model.

    Attributes:
        train: Dialogues to learn from, by source.
        validation: Dialogues that validate.
        start: What the adapter to begin with says of itself.
        about: What a fit that goes on must have in common with it, as JSON.
        done: What `fit.json` says, if the folder holds the adapter of this very plan.
    """

    train: Sequence[Sequence[Case]]
    validation: Sequence[Case]
    start: Mapping[str, str]
    about: Mapping[str, Any]
    done: Mapping[str, Any] | None

    def known(self, key: str) -> set[str]:
        """What the adapter to begin with lists under a key."""
        return set(self.start.get(key, "").split())


def plan_fit(
    sources: Sequence[Source],
    folder: Path,
    settings: Settings,
    *,
    start: Path | None,
    layout: Layout,
    base: str,
) -> Plan:
    """Refuse what needs no model to be refused; see `fit_adapter` for the arguments.

    Raises:
        InvalidInputError: The folder holds something else, the dialogues are too few, or the
            adapter to begin with has another layout.
        ModelError: It is none.
    """
    said = adapter_metadata(start) if start else {}
    fitted = said.get(FITTED_LAYOUT, layout)
    if fitted != layout:
        raise InvalidInputError(
            f"The adapter to begin with was fitted with the layout {fitted}, not {layout}. "
            f"Give --layout {fitted}, or begin with --start none."
        )
    train, validation = parted(
        sources,
        validation=settings.validation,
        seed=settings.seed,
        learned=said.get(FITTED_DIALOGUES, "").split(),
    )
    about: dict[str, Any] = {
        "base": base,
        "layout": layout,
        "start": _beginning(start, said),
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
    return Plan(train, validation, said, about, _done(folder, settings, about, begins=bool(start)))


def _beginning(start: Path | None, said: Mapping[str, str]) -> str:
    if start is None:
        return "no adapter"
    name = f"the adapter {said.get('general.name', start.stem)} (SHA-256 `{digest_of(start)[:16]}`)"
    learned = said.get(FITTED_SOURCES)
    if learned and FITTED_DIALOGUES in said:
        return f"{name}, which was fitted on {learned}"
    return f"{name}, which does not tell what it learned from: perhaps from some that validate"


def _done(
    folder: Path, settings: Settings, about: Mapping[str, Any], *, begins: bool
) -> Mapping[str, Any] | None:
    """What `fit.json` says of a finished fit; None before it, or where one goes on.

    Raises:
        InvalidInputError: The folder holds something else.
    """
    if folder.exists() and not folder.is_dir():
        raise InvalidInputError(f"{folder} is a file. Name a new folder with --out.")
    held = sorted(each.name for each in folder.iterdir()) if folder.exists() else []
    if "state.pt" in held:
        return None
    if "adapter.gguf" in held:
        return _same(folder, settings, about, begins=begins)
    if others := [name for name in held if name not in (".lock", "state.part")]:
        raise InvalidInputError(
            f"{folder} holds {others[0]} and no interrupted fit. Name a new folder with --out."
        )
    return None


def _same(
    folder: Path, settings: Settings, about: Mapping[str, Any], *, begins: bool
) -> Mapping[str, Any]:
    skipped = ("rank", "layers") if begins else ()  # those of the adapter to begin with
    wanted = {**about, **asdict(settings)}
    facts: dict[str, Any] = {}
    found: dict[str, Any] = {}
    try:
        facts = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
        sources = [{**each} for each in facts["sources"]]
        for each in sources:
            each.pop("learned", None)  # which the plan does not know
        found = {**facts, **facts["settings"], "sources": sources}
    except (OSError, ValueError, LookupError, TypeError):
        pass  # another one's, or of an older version
    other = [key for key in wanted if key not in skipped and found.get(key) != wanted[key]]
    if other:
        raise InvalidInputError(
            f"{folder} holds a finished adapter with another {' and another '.join(other)}. Name "
            "another folder with --out."
        )
    return facts
