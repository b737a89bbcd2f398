"""From dialogues to an adapter in a folder."""

from __future__ import annotations

import hashlib
import importlib.metadata
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain

from goalscope.datasets import Case, said_key
from goalscope.datasets.goal_sets import goal_key
from goalscope.extras import package
from goalscope.fitting.card import write_card
from goalscope.fitting.fit import Fit, Progress, Settings
from goalscope.fitting.learner import Learner
from goalscope.fitting.plan import Plan
from goalscope.fitting.sources import Source
from goalscope.fitting.training import locked, writing_to
from goalscope.likelihood import GOAL_TOKENS, RolePlay
from goalscope.models.adapters import (
    FITTED_DIALOGUES,
    FITTED_GOALS,
    FITTED_LAYOUT,
    FITTED_SOURCES,
    read_adapter,
    write_adapter,
)
from goalscope.models.transformers import Transformers
from goalscope.types import InvalidInputError, Message

__all__ = ["fit_adapter"]


def fit_adapter(model: Transformers, plan: Plan, *, command: str) -> Iterator[Progress]:
    """Fit an adapter, yielding each step and validation; in the end it stands in the folder.

    Nothing is done where it stands there already.

    Args:
        model: The model to adapt; it is changed.
        plan: What to do.
        command: What asked for it, for the card.

    Raises:
        InvalidInputError: The folder holds something else, or a dialogue is too long for the model.
        ModelError: The model cannot be adapted.
        GoalscopeError: The folder cannot be written.
    """
    folder, settings, start = plan.folder, plan.settings, plan.start
    with locked(folder):
        if plan.finished() is not None:
            return
        begun = read_adapter(start, model.network.model.config) if start else None
        if begun is not None:
            count = model.network.model.config.num_hidden_layers
            adapted = len({number for number, _ in begun.layers})
            settings = replace(settings, rank=begun.rank, layers=adapted / count)
        made_by = {
            "version": importlib.metadata.version("goalscope"),
            "model": hashlib.sha256(model.fingerprint.encode()).hexdigest()[:16],
        }
        roleplay = RolePlay(model, layout=plan.layout)
        _check_lengths(roleplay, plan.sources, settings)
        learner = Learner(
            model,
            roleplay,
            rank=settings.rank,
            layers=settings.layers,
            seed=settings.seed,
            start=begun,
        )
        about = {**plan.about, **made_by}
        fit = Fit(learner, plan.train, plan.validation, settings, folder, about)
        yield from fit.run()

        taught = fit.taught()
        cases = list(chain.from_iterable(taught))
        own = {
            FITTED_DIALOGUES: {said_key(case.turns) for case in cases},
            FITTED_GOALS: {goal_key(case.goals[case.truth].text) for case in cases},
        }
        before = plan.told.get(FITTED_SOURCES, "").split(", ")
        named = [f"{each.name} ({each.licence or 'own'})" for each in plan.sources]
        adapter = learner.adapter(
            {
                "general.name": folder.name,
                "goalscope.base": plan.base,
                FITTED_LAYOUT: plan.layout,
                "goalscope.temperature": f"{settings.temperature:g}",
                **{key: " ".join(sorted(own[key] | plan.known(key))) for key in own},
                FITTED_SOURCES: ", ".join(filter(None, dict.fromkeys([*before, *named]))),
            }
        )
        more = {
            "sources": [
                {**source, "learned": len(own)}
                for source, own in zip(plan.about["sources"], taught, strict=True)
            ],
            "device": str(model.network.device),
            "memory": _memory(model),
            "validated": len(plan.validation),
            "command": command,
        }
        with writing_to(folder):
            learner.save_peft(folder, plan.base)
            write_card(folder, fit, {**plan.about, **more})
            write_adapter(folder / "adapter.gguf", adapter, model.network.model.config)
            (folder / "state.pt").unlink()


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
