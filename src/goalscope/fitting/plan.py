"""Fit an adapter from dialogues, and write it with its figures and model card."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from importlib.resources import files
from itertools import chain, zip_longest
from pathlib import Path
from typing import Any

from jinja2 import StrictUndefined
from jinja2.sandbox import SandboxedEnvironment

from goalscope.base.types import InvalidInputError, Message
from goalscope.belief.likelihood import GOAL_TOKENS, Layout, RolePlay
from goalscope.datasets.case import Case, said_key
from goalscope.datasets.goal_sets import chance, goal_key
from goalscope.datasets.sources import Source, digest_of
from goalscope.fitting.fit import Fit, Progress, Settings
from goalscope.fitting.learner import Learner
from goalscope.fitting.train import check_folder, locked, writing_to
from goalscope.models.adapters import (
    FITTED_DIALOGUES,
    FITTED_GOALS,
    FITTED_LAYOUT,
    FITTED_SOURCES,
    adapter_metadata,
    read_adapter,
    write_adapter,
)
from goalscope.models.torch.model import Transformers


class Plan:
    """The plan of a fit, checked as far as possible without the model."""

    def __init__(
        self,
        sources: Sequence[Source],
        folder: Path,
        settings: Settings,
        *,
        start: Path | None,
        layout: Layout,
        base: str,
    ) -> None:
        """Split the dialogues into training and validation.

        Args:
            sources: The dialogues.
            folder: Folder of the adapter; an interrupted fit in it is resumed.
            settings: The hyperparameters; rank and layers are those of `start`, if given.
            start: GGUF file of the adapter to start from.
            layout: Where the prompt states the goal.
            base: Public name of the model, such as its name on the hub.

        Raises:
            InvalidInputError: The folder holds something else, the dialogues are too few, or
                `start` has another layout.
            ModelError: `start` is not an adapter.
        """
        check_folder(folder)
        known = adapter_metadata(start) if start else {}
        fitted = known.get(FITTED_LAYOUT, layout)
        if fitted != layout:
            raise InvalidInputError(
                f"The adapter to start from was fitted with the layout {fitted}, not "
                f"{layout}. Use --layout {fitted} or --start none."
            )
        self._sources, self._folder, self._settings = sources, folder, settings
        self._start, self._known, self._base = start, known, base
        self._layout: Layout = layout
        self._train, self._validation = parted(
            sources,
            validation=settings.validation,
            seed=settings.seed,
            learned={*known.get(FITTED_DIALOGUES, "").split()},
        )
        validation = {id(case) for case in self._validation}
        self._about: dict[str, Any] = {
            "base": base,
            "layout": layout,
            "start": _beginning(start, known),
            "sources": [
                {
                    "name": source.name,
                    "train": len({case.id for case in own}),
                    "validation": sum(id(case) in validation for case in source.cases),
                    "licence": source.licence,
                    "sha256": source.sha256,
                }
                for source, own in zip(sources, self._train, strict=True)
            ],
        }

    def run(self, model: Transformers, *, command: str) -> Iterator[Progress]:
        """Fit, yielding each step and validation; at the end the folder holds the adapter.

        It has the adapter in two formats, `fit.json` and a model card.

        Args:
            model: The model to adapt, which is modified.
            command: The command line, for the card.

        Raises:
            InvalidInputError: The folder holds something else, or a dialogue is too long for the
                model.
            ModelError: The model cannot be adapted.
            GoalscopeError: The folder cannot be written.
        """
        folder, settings, config = self._folder, self._settings, model.network.model.config
        with locked(folder):
            start = read_adapter(self._start, config) if self._start else None
            if start is not None:
                adapted = len({number for number, _ in start.layers})
                share = adapted / config.num_hidden_layers
                settings = replace(settings, rank=start.rank, layers=share)
            roleplay = RolePlay(model, layout=self._layout, similarity=0.0)
            _check_lengths(roleplay, self._sources, settings.longest)
            learner = Learner(
                model,
                roleplay,
                rank=settings.rank,
                layers=settings.layers,
                seed=settings.seed,
                start=start,
            )
            made_by = {
                "version": importlib.metadata.version("goalscope"),
                "model": hashlib.sha256(model.fingerprint.encode()).hexdigest()[:16],
            }
            about = {**self._about, **made_by}
            fit = Fit(learner, self._train, self._validation, settings, folder, about)
            yield from fit.run()
            learned = fit.learned()
            adapter = learner.adapter(self._metadata(learned, settings))
            with writing_to(folder):
                learner.save_peft(folder, self._base)
                self._write_card(fit, learned, device=str(model.network.device), command=command)
                write_adapter(folder / "adapter.gguf", adapter, config)

    def _metadata(self, learned: Sequence[Sequence[Case]], settings: Settings) -> dict[str, str]:
        """The metadata of the adapter's file, including that of the adapter it started from."""
        cases = list(chain.from_iterable(learned))
        own = {
            FITTED_DIALOGUES: {said_key(case.turns) for case in cases},
            FITTED_GOALS: {
                goal_key(case.goals[place].text)
                for case in cases
                for place in case.each_truth
                if place is not None
            },
        }
        before = self._known.get(FITTED_SOURCES, "").split(", ")
        named = [f"{each.name} ({each.licence or 'own'})" for each in self._sources]
        return {
            "general.name": self._folder.name,
            "goalscope.base": self._base,
            FITTED_LAYOUT: self._layout,
            "goalscope.temperature": f"{settings.temperature:g}",
            **{
                key: " ".join(sorted(keys | set(self._known.get(key, "").split())))
                for key, keys in own.items()
            },
            FITTED_SOURCES: ", ".join(filter(None, dict.fromkeys([*before, *named]))),
        }

    def _write_card(
        self, fit: Fit, learned: Sequence[Sequence[Case]], *, device: str, command: str
    ) -> None:
        facts = {
            **self._about,
            "sources": [
                {**source, "learned": len(own)}
                for source, own in zip(self._about["sources"], learned, strict=True)
            ],
            "device": device,
            "validated": len(self._validation),
            "command": command,
            "version": importlib.metadata.version("goalscope"),
            "settings": asdict(fit.settings),
            "step": fit.step,
            "best": asdict(fit.best),
            "history": [asdict(each) for each in fit.history],
        }
        text = json.dumps(facts, indent=1) + "\n"
        (self._folder / "fit.json").write_text(text, encoding="utf-8")
        jinja = SandboxedEnvironment(
            undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
        )
        template = files("goalscope.fitting").joinpath("card.md").read_text(encoding="utf-8")
        card = jinja.from_string(template).render(facts, name=self._folder.name)
        (self._folder / "README.md").write_text(card + "\n", encoding="utf-8")


def parted(
    sources: Sequence[Source], *, validation: int, seed: int, learned: Collection[str] = ()
) -> tuple[list[list[Case]], list[Case]]:
    """Split groups of dialogues into training, by source, and validation.

    Args:
        sources: At least one.
        validation: Maximum number of validation dialogues: the same number from each source, from
            at most a third of its groups.
        seed: Seed of the split.
        learned: Keys (`said_key`) of dialogues used for training before; their groups are not used
            for validation.

    Raises:
        InvalidInputError: A source has a single group, all its groups are validation for another
            source, or none is left for validation.
    """
    each = -(-validation // len(sources))
    held: set[tuple[str, str]] = set()
    lists: list[list[Case]] = []
    for source in sources:
        groups = sorted({case.group for case in source.cases})
        if len(groups) < 2:
            raise InvalidInputError(
                f"All dialogues of {source.name} are in one group, but training and "
                "validation need different groups. Add dialogues of another group."
                if len(source.cases) > 1
                else f"{source.name} has a single dialogue, but training and validation need one "
                "each. Add another one."
            )
        known = {case.group for case in source.cases if said_key(case.turns) in learned}
        chance(seed, source.name).shuffle(groups)
        most = max(1, len(groups) // 3)
        fresh = [group for group in groups if group not in known][:most]
        own = [case for case in source.cases if case.group in fresh]
        chance(seed, f"validation {source.name}").shuffle(own)
        new = {case.id: case for case in own if (source.sha256, case.group) not in held}
        lists.append([*new.values()][:each])
        held |= {(source.sha256, case.group) for case in lists[-1]}
    if not any(lists):
        raise InvalidInputError(
            "The adapter to start from was fitted on all these dialogues, so none is left "
            "for validation. Use other dialogues, or --start none."
        )
    train = [
        [case for case in source.cases if (source.sha256, case.group) not in held]
        for source in sources
    ]
    for source, own in zip(sources, train, strict=True):
        if not own:
            raise InvalidInputError(
                f"All dialogues of {source.name} are already validation for another part of "
                "the same file. Use each dialogue only once."
            )
    turns = chain.from_iterable(zip_longest(*lists))
    return train, [case for case in turns if case is not None][:validation]


def _beginning(start: Path | None, known: Mapping[str, str]) -> str:
    """What a fit starts from, as text."""
    if start is None:
        return "no adapter"
    digest = digest_of(start)[:16]
    name = f"the adapter {known.get('general.name', start.stem)} (SHA-256 `{digest}`)"
    learned = known.get(FITTED_SOURCES)
    if learned and FITTED_DIALOGUES in known:
        return f"{name}, which was fitted on {learned}"
    return (
        f"{name}, which does not say what it was fitted on, perhaps including the validation "
        "dialogues"
    )


def _check_lengths(roleplay: RolePlay, sources: Sequence[Source], longest: int) -> None:
    """Check before the work begins that everything fits into the model's context.

    Raises:
        InvalidInputError: A goal or a turn is too long; the message names the dialogue.
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
                    f"a goal has {tokens} tokens, and at most {GOAL_TOKENS} are allowed: "
                    f"{goal.text[:60]!r}..."
                )
        for t, turn in enumerate(case.turns[:longest]):
            if len(f"{case.task}{turn.query}{turn.utterance}".encode()) > model.context_size // 4:
                roleplay.window(case.task, case.turns[: t + 1])

    for source in {source.name: source for source in sources}.values():
        for case in source.cases:
            try:
                check(case)
            except InvalidInputError as error:
                raise InvalidInputError(f"{source.name}, dialogue {case.id}: {error}") from None
