"""Teach a model to read: an adapter fitted on conversations whose orders are written down."""

from __future__ import annotations

import hashlib
import json
import random
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from goalscope.benchmarks.reading import Line, line_to_json
from goalscope.fitting.learner import Learner
from goalscope.fitting.recombining import Conversation, Recombining
from goalscope.fitting.training import KEPT, Training, locked, writing_to
from goalscope.likelihood import RolePlay
from goalscope.models.adapters import FITTED_SOURCES, FITTED_TASK, read_adapter, write_adapter
from goalscope.models.transformers import Transformers
from goalscope.models.trie import Trie
from goalscope.orders import Verb
from goalscope.reader import Exchange, Reader
from goalscope.types import InvalidInputError

__all__ = ["ReadingFit", "ReadingSettings", "conversations", "fit_reading"]

Taught = list[tuple[list[int], list[int]]]
"""Prompt and answer, in tokens, of each reading of a conversation."""


@dataclass(frozen=True, slots=True)
class ReadingSettings:
    """How to fit.

    Attributes:
        rank: Of the adapter.
        layers: The share of the model's layers, the last ones, that are adapted.
        learning_rate: Of AdamW at its highest; it falls to nearly 0 at the last step.
        batch_tokens: Tokens of one step, about.
        epochs: How often each conversation is learned from.
        renamed: Share of things that become others, each time anew.
        joined: Share of conversations that begin with another one's first message, likewise.
        seed: Of all that is drawn.
    """

    rank: int = 16
    layers: float = 1.0
    learning_rate: float = 1e-3
    batch_tokens: int = 1200
    epochs: float = 2.0
    renamed: float = 0.4
    joined: float = 0.1
    seed: int = 1


def conversations(lines: Sequence[Line]) -> list[Conversation]:
    """Lines that follow one another in one conversation, together."""
    found: list[Conversation] = []
    for line in lines:
        last = found[-1][-1] if found else None
        if last and line.context and line.context[-1] == last.message:
            found[-1] = [*found[-1], line]
        else:
            found.append([line])
    return found


class ReadingFit:
    """The fitting of one adapter; its state is on disk every ten steps.

    Attributes:
        steps: Steps in all.
        losses: Mean nats a token of the readings, step by step.
    """

    def __init__(
        self,
        learner: Learner,
        verbs: Mapping[str, Sequence[Verb]],
        corpus: Sequence[Conversation],
        settings: ReadingSettings,
        folder: Path,
        about: Mapping[str, Any],
    ) -> None:
        """Begin, or go on where `folder` was left.

        Raises:
            InvalidInputError: The folder holds a fit with other settings or another corpus.
        """
        self._learner = learner
        self._readers = {
            name: Reader(learner.model, each, taught=True) for name, each in verbs.items()
        }
        self._batches = _batches(map(self._example, _drawn(corpus, settings)), settings)
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
            loss = self._training.learn([self._loss(self._batches[self.step])])
            self.losses.append(loss)
            if self.step % KEPT == 0:
                self._training.keep(losses=self.losses)
            yield self.step, loss

    def _resume(self, state: Mapping[str, Any]) -> None:
        self.losses = state["losses"]

    def _example(self, conversation: Conversation) -> Taught:
        tokenizer = self._learner.model.tokenizer
        reader = self._readers[conversation[0].domain]
        before: list[Exchange] = []
        found = Taught()
        for line in conversation:
            exchange = Exchange(line.question, line.message, line.orders)
            prompt = reader.prompt(line.message, question=line.question, before=before)
            answer = tokenizer.tokenize(reader.written(line.orders))
            found.append(([*tokenizer.render(prompt)], [*answer, tokenizer.end_of_turn]))
            before.append(exchange)
        return found

    def _loss(self, batch: Taught) -> Any:
        """Minus the mean log-probability of the tokens of the answers, nats."""
        trie, spots = Trie(), list[tuple[list[int], list[int]]]()
        for prompt, answer in batch:
            path = trie.paths[trie.add([*prompt, *answer[:-1]])]
            spots.append((path[len(prompt) - 1 :], answer))
        tokens = sum(len(answer) for _, answer in spots)
        return -sum(self._learner.answers(trie, spots)) / tokens


def _drawn(corpus: Sequence[Conversation], settings: ReadingSettings) -> Iterator[Conversation]:
    """Conversations in a drawn order, recombined; the last epoch may be a part of one."""
    draw = random.Random(settings.seed)
    recombining = Recombining(corpus, renamed=settings.renamed, joined=settings.joined)
    left = round(settings.epochs * len(corpus))
    while left > 0:
        epoch = [*corpus]
        draw.shuffle(epoch)
        for conversation in epoch[:left]:
            yield recombining.drawn(conversation, draw)
        left -= len(epoch)


def _batches(examples: Iterable[Taught], settings: ReadingSettings) -> list[Taught]:
    """Examples cut into steps."""
    found = list[Taught]()
    batch, size = Taught(), 0
    for example in examples:
        prompt, answer = example[-1]
        if batch and size + len(prompt) + len(answer) > settings.batch_tokens:
            found.append(batch)
            batch, size = [], 0
        batch = [*batch, *example]
        size += len(prompt) + len(answer)
    return [*found, batch] if batch else found


def fit_reading(
    model: Transformers,
    verbs: Mapping[str, Sequence[Verb]],
    lines: Sequence[Line],
    settings: ReadingSettings,
    folder: Path,
    *,
    start: Path | None = None,
    base: str,
    corpus: Sequence[str],
    command: str,
) -> Iterator[tuple[int, int, float]]:
    """Fit an adapter, yielding steps done, steps in all, and the last loss, nats a token.

    In the end the folder holds `adapter.gguf` and `fit.json`. An interrupted fit in it goes on.

    Args:
        model: The model to adapt; it is changed.
        verbs: What can be asked for, by domain.
        lines: What to learn from.
        settings: How.
        folder: Of the adapter.
        start: File of an adapter to begin with, whose rank and layers are then taken.
        base: What others call the model.
        corpus: Where the lines come from.
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
        written = "\n".join(json.dumps(line_to_json(line), sort_keys=True) for line in lines)
        about = {
            "base": base,
            "start": hashlib.sha256(start.read_bytes()).hexdigest() if start else "",
            "corpus": {
                "files": list(corpus),
                "sha256": hashlib.sha256(written.encode()).hexdigest(),
                "messages": dict(Counter(line.domain for line in lines)),
                "writers": len({line.id.rpartition("-")[0] for line in lines}),
            },
        }
        fit = ReadingFit(learner, verbs, conversations(lines), settings, folder, about)
        for step, loss in fit.run():
            yield step, fit.steps, loss
        metadata = {
            "general.name": folder.name,
            "goalscope.base": base,
            FITTED_TASK: "reading",
            FITTED_SOURCES: ", ".join(corpus),
        }
        tens = [fit.losses[i : i + 10] for i in range(0, len(fit.losses), 10)]
        facts = {
            **about,
            "command": command,
            "device": str(model.network.device),
            "settings": asdict(settings),
            "steps": fit.steps,
            "losses": [round(float(np.mean(each)), 4) for each in tens],
        }
        with writing_to(folder):
            write_adapter(folder / "adapter.gguf", learner.adapter(metadata), config)
            text = json.dumps(facts, indent=1) + "\n"
            (folder / "fit.json").write_text(text, encoding="utf-8")
            (folder / "state.pt").unlink(missing_ok=True)
