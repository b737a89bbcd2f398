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
    """What a fit is to do, as far as it is known without the model; made by `plan_fit`.

    Attributes:
        sources: The dialogues.
        folder: Of the adapter; an interrupted fit in it goes on.
        settings: How to fit; rank and layers are those of the adapter to begin with, if there is
            one.
        start: GGUF file of the adapter to begin with.
        layout: Where the goal stands in the prompt.
        base: What others call the model, such as its name on the hub.
        told: What the adapter to begin with says of itself.
        train: Dialogues to learn from, by source.
        validation: Dialogues that validate.
        about: What a fit that goes on must have in common with it, as JSON.
    """

    sources: Sequence[Source]
    folder: Path
    settings: Settings
    start: Path | None
    layout: Layout
    base: str
    told: Mapping[str, str]
    train: Sequence[Sequence[Case]]
    validation: Sequence[Case]
    about: Mapping[str, Any]

    def known(self, key: str) -> set[str]:
        """What the adapter to begin with lists under a key."""
        return set(self.told.get(key, "").split())

    def finished(self) -> Mapping[str, Any] | None:
        """What `fit.json` says if the folder holds the adapter of this very plan, else None.

        Raises:
            InvalidInputError: The folder holds something else than that, or a fit to go on with.
        """
        folder = self.folder
        if folder.exists() and not folder.is_dir():
            raise InvalidInputError(f"{folder} is a file. Name a new folder with --out.")
        held = sorted(each.name for each in folder.iterdir()) if folder.exists() else []
        if "state.pt" in held:
            return None
        if "adapter.gguf" in held:
            return self._same()
        if others := [name for name in held if name not in (".lock", "state.part")]:
            raise InvalidInputError(
                f"{folder} holds {others[0]} and no interrupted fit. Name a new folder with --out."
            )
        return None

    def _same(self) -> Mapping[str, Any]:
        skipped = ("rank", "layers") if self.start else ()  # those of the adapter to begin with
        wanted = {**self.about, **asdict(self.settings)}
        facts: dict[str, Any] = {}
        found: dict[str, Any] = {}
        try:
            facts = json.loads((self.folder / "fit.json").read_text(encoding="utf-8"))
            sources = [{**each} for each in facts["sources"]]
            for each in sources:
                each.pop("learned", None)  # which the plan does not know
            found = {**facts, **facts["settings"], "sources": sources}
        except (OSError, ValueError, LookupError, TypeError):
            pass  # another one's, or of an older version
        other = [key for key in wanted if key not in skipped and found.get(key) != wanted[key]]
        if other:
            raise InvalidInputError(
                f"{self.folder} holds a finished adapter with another {' and another '.join(other)}"
                ". Name another folder with --out."
            )
        return facts


def plan_fit(
    sources: Sequence[Source],
    folder: Path,
    settings: Settings,
    *,
    start: Path | None,
    layout: Layout,
    base: str,
) -> Plan:
    """Part the dialogues, and refuse what needs no model to be refused; see `Plan`.

    Raises:
        InvalidInputError: The dialogues are too few, or the adapter to begin with has another
            layout.
        ModelError: It is none.
    """
    told = adapter_metadata(start) if start else {}
    fitted = told.get(FITTED_LAYOUT, layout)
    if fitted != layout:
        raise InvalidInputError(
            f"The adapter to begin with was fitted with the layout {fitted}, not {layout}. "
            f"Give --layout {fitted}, or begin with --start none."
        )
    train, validation = parted(
        sources,
        validation=settings.validation,
        seed=settings.seed,
        learned=told.get(FITTED_DIALOGUES, "").split(),
    )
    about: dict[str, Any] = {
        "base": base,
        "layout": layout,
        "start": _beginning(start, told),
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
    return Plan(sources, folder, settings, start, layout, base, told, train, validation, about)


def _beginning(start: Path | None, told: Mapping[str, str]) -> str:
    if start is None:
        return "no adapter"
    name = f"the adapter {told.get('general.name', start.stem)} (SHA-256 `{digest_of(start)[:16]}`)"
    learned = told.get(FITTED_SOURCES)
    if learned and FITTED_DIALOGUES in told:
        return f"{name}, which was fitted on {learned}"
    return f"{name}, which does not tell what it learned from: perhaps from some that validate"
