"""Teach a model to write: an adapter fitted on lessons, prompts with what is right after them."""

from __future__ import annotations

import hashlib
import json
import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from goalscope.extras import package
from goalscope.fitting.learner import Learner
from goalscope.fitting.lessons import Lesson, Lessons
from goalscope.fitting.training import KEPT, Training, locked, writing_to
from goalscope.likelihood import RolePlay
from goalscope.models.adapters import FITTED_SOURCES, FITTED_TASK, read_adapter, write_adapter
from goalscope.models.transformers import Transformers
from goalscope.models.trie import Trie
from goalscope.types import InvalidInputError

__all__ = ["WritingFit", "WritingSettings", "fit_writing", "validated"]

Taught = list[tuple[list[int], list[int]]]
"""Prompt and answer, in tokens, of lessons that share beginnings."""


@dataclass(frozen=True, slots=True)
class WritingSettings:
    """How to fit.

    Attributes:
        rank: Of the adapter.
        layers: The share of the model's layers, the last ones, that are adapted.
        learning_rate: Of AdamW at its highest; it falls to nearly 0 at the last step.
        batch_tokens: Tokens of one step, about.
        epochs: How often each conversation, talk and occasion is learned from.
        renamed: Share of ordered things that become others, each time anew.
        joined: Share of conversations that begin with another one's first message, likewise.
        seed: Of all that is drawn.
    """

    rank: int = 32
    layers: float = 1.0
    learning_rate: float = 1e-3
    batch_tokens: int = 1200
    epochs: float = 2.0
    renamed: float = 0.4
    joined: float = 0.1
    seed: int = 1


class WritingFit:
    """The fitting of one adapter; its state is on disk every ten steps.

    Attributes:
        steps: Steps in all.
        losses: Mean nats a token of the answers, step by step.
    """

    def __init__(
        self,
        learner: Learner,
        lessons: Sequence[Lessons],
        settings: WritingSettings,
        folder: Path,
        about: Mapping[str, Any],
    ) -> None:
        """Begin, or go on where `folder` was left.

        Raises:
            InvalidInputError: The folder holds a fit with other settings or another corpus.
        """
        self._learner = learner
        self._batches = _batches(
            (_taught(learner, each) for each in _drawn(lessons, settings)), settings
        )
        self.steps = len(self._batches)
        self.losses: list[float] = []
        self._training = Training(
            learner,
            learning_rate=settings.learning_rate,
            steps=self.steps,
            folder=folder,
            about={"settings": asdict(settings), **about},
        )
        self._training.resume(self._resume)

    @property
    def step(self) -> int:
        """Steps done."""
        return self._training.step

    def run(self) -> Iterator[tuple[int, float]]:
        """Do what is left, step by step: the number of steps done, and the loss of the last one."""
        while self.step < self.steps:
            logprobs, _ = _answers(self._learner, self._batches[self.step])
            loss = self._training.learn([-logprobs.mean()])
            self.losses.append(loss)
            if self.step % KEPT == 0:
                self._training.keep(losses=self.losses)
            yield self.step, loss

    def _resume(self, state: Mapping[str, Any]) -> None:
        self.losses = state["losses"]


def validated(
    learner: Learner, lessons: Sequence[Lessons], settings: WritingSettings
) -> dict[str, dict[str, float]]:
    """How well lessons are known, by kind: `answers`, `nats` a token, and the share `right`.

    An answer is right where each of its tokens is the likeliest after those before it: it is what
    the model would write.
    """
    found: dict[str, list[tuple[float, int, bool]]] = {}
    draw = random.Random(settings.seed)
    with package("torch").no_grad():
        for each in lessons:
            for index in range(each.size):
                drawn = each.drawn(index, draw)
                for kind in {lesson.kind for lesson in drawn}:
                    batch = _taught(learner, [one for one in drawn if one.kind == kind])
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


def _taught(learner: Learner, lessons: Sequence[Lesson]) -> Taught:
    tokenizer = learner.model.tokenizer
    return [
        (
            [*tokenizer.render(each.prompt)],
            [*tokenizer.tokenize(each.answer), tokenizer.end_of_turn],
        )
        for each in lessons
    ]


def _answers(learner: Learner, batch: Taught) -> tuple[Any, Any]:
    """[tokens] log-probabilities of the answers, in nats, and whether each token is likeliest."""
    trie = Trie()
    nodes: list[int] = []
    for prompt, answer in batch:
        nodes += trie.paths[trie.add([*prompt, *answer[:-1]])][len(prompt) - 1 :]
    return learner.at(trie, nodes, [token for _, answer in batch for token in answer])


def _drawn(lessons: Sequence[Lessons], settings: WritingSettings) -> Iterator[list[Lesson]]:
    """Lessons in a drawn order; the last epoch may be a part of one."""
    draw = random.Random(settings.seed)
    places = [(each, index) for each in lessons for index in range(each.size)]
    left = round(settings.epochs * len(places))
    while left > 0:
        draw.shuffle(places)
        for each, index in places[:left]:
            yield each.drawn(index, draw)
        left -= len(places)


def _batches(examples: Iterable[Taught], settings: WritingSettings) -> list[Taught]:
    """Examples cut into steps."""
    found = list[Taught]()
    batch, size = Taught(), 0
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


def fit_writing(
    model: Transformers,
    lessons: Sequence[Lessons],
    settings: WritingSettings,
    folder: Path,
    *,
    validation: Sequence[Lessons] = (),
    start: Path | None = None,
    base: str,
    corpus: Mapping[str, Any],
    command: str,
) -> Iterator[tuple[int, int, float]]:
    """Fit an adapter, yielding steps done, steps in all, and the last loss, nats a token.

    In the end the folder holds `adapter.gguf` and `fit.json`. An interrupted fit in it goes on.

    Args:
        model: The model to adapt; it is changed.
        lessons: What to learn from.
        settings: How.
        folder: Of the adapter.
        validation: What it is tried on in the end.
        start: File of an adapter to begin with, whose rank and layers are then taken.
        base: What others call the model.
        corpus: Where the lessons come from, for `fit.json`; with "files", a list.
        command: What asked for it.

    Raises:
        InvalidInputError: The folder holds something else, or another fit.
        GoalscopeError: The folder cannot be written.
    """
    with locked(folder):
        if (folder / "adapter.gguf").exists():
            raise InvalidInputError(f"{folder} holds a finished adapter. Name another folder.")
        config = model.network.model.config
        learner = Learner(
            model,
            RolePlay(model),
            rank=settings.rank,
            layers=settings.layers,
            seed=settings.seed,
            start=read_adapter(start, config) if start else None,
        )
        about = {
            "base": base,
            "start": hashlib.sha256(start.read_bytes()).hexdigest() if start else "",
            "corpus": dict(corpus),
        }
        fit = WritingFit(learner, lessons, settings, folder, about)
        for step, loss in fit.run():
            yield step, fit.steps, loss
        metadata = {
            "general.name": folder.name,
            "goalscope.base": base,
            FITTED_TASK: "writing",
            FITTED_SOURCES: ", ".join(corpus["files"]),
        }
        tens = [fit.losses[i : i + 10] for i in range(0, len(fit.losses), 10)]
        facts = {
            **about,
            "command": command,
            "device": str(model.network.device),
            "settings": asdict(settings),
            "steps": fit.steps,
            "losses": [round(float(np.mean(each)), 4) for each in tens],
            "validation": validated(learner, validation, settings),
        }
        with writing_to(folder):
            write_adapter(folder / "adapter.gguf", learner.adapter(metadata), config)
            text = json.dumps(facts, indent=1) + "\n"
            (folder / "fit.json").write_text(text, encoding="utf-8")
            (folder / "state.pt").unlink(missing_ok=True)
