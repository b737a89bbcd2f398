"""Teach a model to write: fit an adapter on prompts followed by the right answers."""

from __future__ import annotations

import json
import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from goalscope.base.optional_packages import package
from goalscope.belief.likelihood import RolePlay
from goalscope.fitting.learner import Learner
from goalscope.fitting.train import KEPT, Training, locked, writing_to
from goalscope.models.adapters import FITTED_SOURCES, FITTED_TASK, Adapter, write_adapter
from goalscope.models.llama.trie import Trie
from goalscope.models.torch.model import Transformers
from lessons import Draw, Lesson

Tokens = list[tuple[list[int], list[int]]]
"""Prompts and answers of lessons with shared prefixes."""


@dataclass(frozen=True, slots=True)
class WritingSettings:
    """How to fit.

    Attributes:
        rank: Of the adapter.
        learning_rate: Peak learning rate of AdamW; it decays to nearly 0.
        batch_tokens: Approximate number of tokens per step.
        epochs: Passes over the corpus.
        seed: Seed of all random draws.
    """

    rank: int = 32
    learning_rate: float = 1e-3
    batch_tokens: int = 1200
    epochs: float = 2.0
    seed: int = 1


def fit_writing(
    model: Transformers,
    lessons: Sequence[Draw],
    settings: WritingSettings,
    folder: Path,
    *,
    validation: Sequence[Draw] = (),
    base: str,
    corpus: Mapping[str, Any],
    command: str,
    start: Adapter | None = None,
) -> Iterator[tuple[int, int, float]]:
    """Fit an adapter, yielding steps done, total steps, and the last loss in nats per token.

    At the end the folder has `adapter.gguf` and `fit.json`. An interrupted fit in it is resumed.

    Args:
        model: The model to adapt, which is modified.
        lessons: The training lessons.
        settings: How to fit.
        folder: Of the adapter.
        validation: The lessons for the final evaluation.
        base: Public name of the model.
        corpus: The sources of the lessons, for `fit.json`; with "files", a list.
        command: The command line.
        start: The adapter to start from, whose rank is kept.

    Raises:
        InvalidInputError: The folder contains something else, or another fit.
        GoalscopeError: The folder cannot be written.
    """
    config = model.network.model.config
    with locked(folder):
        learner = Learner(
            model,
            RolePlay(model),
            rank=settings.rank,
            layers=1.0,
            seed=settings.seed,
            start=start,
        )
        about = {"base": base, "corpus": dict(corpus)}
        batches = _batches((_tokens(learner, each) for each in _drawn(lessons, settings)), settings)
        training = Training(
            learner,
            learning_rate=settings.learning_rate,
            steps=len(batches),
            folder=folder,
            about={"settings": asdict(settings), **about},
        )
        losses: list[float] = []
        training.resume(lambda state: losses.extend(state["losses"]))
        for batch in batches[training.step :]:
            logprobs, _ = _answers(learner, batch)
            losses.append(training.learn([-logprobs.mean()]))
            if training.step % KEPT == 0:
                training.keep(losses=losses)
            yield training.step, len(batches), losses[-1]
        metadata = {
            "general.name": folder.name,
            "goalscope.base": base,
            FITTED_TASK: "writing",
            FITTED_SOURCES: ", ".join(corpus["files"]),
        }
        tens = [losses[i : i + 10] for i in range(0, len(losses), 10)]
        facts = {
            **about,
            "command": command,
            "device": str(model.network.device),
            "settings": asdict(settings),
            "steps": len(batches),
            "losses": [round(float(np.mean(each)), 4) for each in tens],
            "validation": _validated(learner, validation, settings),
        }
        with writing_to(folder):
            write_adapter(folder / "adapter.gguf", learner.adapter(metadata), config)
            text = json.dumps(facts, indent=1) + "\n"
            (folder / "fit.json").write_text(text, encoding="utf-8")


def _validated(
    learner: Learner, lessons: Sequence[Draw], settings: WritingSettings
) -> dict[str, dict[str, float]]:
    """Accuracy on lessons by kind: `answers`, `nats` per token, and the share `right`.

    An answer is right if each of its tokens is the likeliest after those before it, so that the
    model would write it.
    """
    found: dict[str, list[tuple[float, int, bool]]] = {}
    draw = random.Random(settings.seed)
    with package("torch").no_grad():
        for lesson in lessons:
            drawn = lesson(draw)
            for kind in {each.kind for each in drawn}:
                batch = _tokens(learner, [each for each in drawn if each.kind == kind])
                logprobs, likeliest = _answers(learner, batch)
                at = 0
                for _, answer in batch:
                    part = slice(at, at + len(answer))
                    at += len(answer)
                    row = float(logprobs[part].sum()), len(answer), bool(likeliest[part].all())
                    found.setdefault(kind, []).append(row)
    return {
        kind: {
            "answers": len(rows),
            "nats": round(-sum(row[0] for row in rows) / sum(row[1] for row in rows), 4),
            "right": round(sum(row[2] for row in rows) / len(rows), 4),
        }
        for kind, rows in sorted(found.items())
    }


def _tokens(learner: Learner, lessons: Sequence[Lesson]) -> Tokens:
    tokenizer = learner.model.tokenizer
    return [
        (
            [*tokenizer.render(each.prompt, writing=True)],
            [*tokenizer.tokenize(each.answer), tokenizer.end_of_turn],
        )
        for each in lessons
    ]


def _answers(learner: Learner, batch: Tokens) -> tuple[Any, Any]:
    """[N] log-probabilities of the answers' tokens, nats, and whether each is the likeliest."""
    trie = Trie()
    nodes: list[int] = []
    for prompt, answer in batch:
        nodes += trie.paths[trie.add([*prompt, *answer[:-1]])][len(prompt) - 1 :]
    return learner.at(trie, nodes, [token for _, answer in batch for token in answer])


def _drawn(lessons: Sequence[Draw], settings: WritingSettings) -> Iterator[list[Lesson]]:
    """Lessons in random order; the last epoch may be partial."""
    draw = random.Random(settings.seed)
    order = list(lessons)
    left = round(settings.epochs * len(order))
    while left > 0:
        draw.shuffle(order)
        for lesson in order[:left]:
            yield lesson(draw)
        left -= len(order)


def _batches(examples: Iterable[Tokens], settings: WritingSettings) -> list[Tokens]:
    """Examples grouped into steps."""
    found = list[Tokens]()
    batch, size = Tokens(), 0
    for example in examples:
        trie = Trie()
        for prompt, answer in example:
            trie.add([*prompt, *answer])
        if batch and size + len(trie) > settings.batch_tokens:
            found.append(batch)
            batch, size = [], 0
        batch = [*batch, *example]
        size += len(trie)
    return [*found, batch] if batch else found
