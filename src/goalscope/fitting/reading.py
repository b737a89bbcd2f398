"""Teach a model to read: an adapter fitted on conversations whose orders are written down."""

from __future__ import annotations

import hashlib
import json
import math
import os
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from goalscope.benchmarks.reading import Line, line_to_json
from goalscope.domains import Language
from goalscope.extras import package
from goalscope.fitting.learner import Learner, ancestors
from goalscope.likelihood import RolePlay
from goalscope.models.adapters import FITTED_SOURCES, FITTED_TASK, read_adapter, write_adapter
from goalscope.models.transformers import Transformers
from goalscope.models.trie import Trie
from goalscope.reader import Exchange, Reader
from goalscope.types import GoalscopeError, InvalidInputError

__all__ = ["Conversation", "ReadingFit", "ReadingSettings", "conversations", "fit_reading"]

_WARM_UP = 0.03  # of the steps, in which the learning rate rises
_CLIP = 1.0  # largest norm of a gradient
_KEPT = 20  # steps after which the state is kept

Conversation = Sequence[Line]
"""Lines of one person, each of which has those before it as its context."""


@dataclass(frozen=True, slots=True)
class ReadingSettings:
    """How to fit.

    Attributes:
        rank: Of the adapter.
        layers: The share of the model's layers, the last ones, that are adapted.
        learning_rate: Of AdamW at its highest; it falls to nearly 0 at the last step.
        batch_tokens: Tokens of one step, about.
        epochs: How often each conversation is learned from.
        seed: Of the order.
    """

    rank: int = 16
    layers: float = 1.0
    learning_rate: float = 1e-3
    batch_tokens: int = 1200
    epochs: float = 2.0
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
    """The fitting of one adapter; its state is on disk every twenty steps.

    Attributes:
        step: Steps done.
        steps: Steps in all.
        losses: Mean nats a token of the readings, step by step.
    """

    def __init__(
        self,
        learner: Learner,
        languages: Mapping[str, Language],
        corpus: Sequence[Conversation],
        settings: ReadingSettings,
        folder: Path,
        about: Mapping[str, Any],
    ) -> None:
        """Begin, or go on where `folder` was left.

        Raises:
            InvalidInputError: The folder holds a fit with other settings or another corpus.
        """
        torch = package("torch")
        self.settings, self._learner = settings, learner
        self._readers = {
            name: Reader(learner.model, each.verbs, taught=True) for name, each in languages.items()
        }
        examples = [self._example(each) for each in corpus]
        self._batches = _batches(examples, settings)
        self.steps = len(self._batches)
        self.step, self.losses = 0, list[float]()
        self._optimizer = torch.optim.AdamW(
            learner.parameters, lr=settings.learning_rate, betas=(0.9, 0.98), weight_decay=0.01
        )
        self._file = folder / "state.pt"
        self._about = json.dumps({**about, **asdict(settings), "steps": self.steps})
        if self._file.exists():
            self._resume()

    def run(self) -> Iterator[tuple[int, float]]:
        """Do what is left, step by step: the number of steps done, and the loss of the last one."""
        torch = package("torch")
        while self.step < self.steps:
            share = (self.step + 1) / self.steps
            rate = self.settings.learning_rate * min(
                share / _WARM_UP, (1 - share) / (1 - _WARM_UP) + 0.01
            )
            for group in self._optimizer.param_groups:
                group["lr"] = rate
            self._optimizer.zero_grad()
            with self._learner.enough_memory():
                loss = self._loss(self._batches[self.step])
                loss.backward()
            norm = float(torch.nn.utils.clip_grad_norm_(self._learner.parameters, _CLIP))
            if not math.isfinite(float(loss.detach()) + norm):
                raise GoalscopeError(
                    f"The loss is not finite at step {self.step + 1}. Try a smaller "
                    "--learning-rate, and another --out."
                )
            self._optimizer.step()
            self.step += 1
            self.losses.append(float(loss.detach()))
            if self.step % _KEPT == 0:
                self._keep()
            yield self.step, self.losses[-1]

    def _example(self, conversation: Conversation) -> list[tuple[list[int], list[int]]]:
        """Prompt and answer, in tokens, of each reading of a conversation."""
        tokenizer = self._learner.model.tokenizer
        reader = self._readers[conversation[0].domain]
        before: list[Exchange] = []
        found: list[tuple[list[int], list[int]]] = []
        for line in conversation:
            exchange = Exchange(line.question, line.message, line.orders)
            prompt = reader.prompt(line.message, question=line.question, before=before[-9:])
            answer = tokenizer.tokenize(reader.written(line.orders))
            found.append(([*tokenizer.render(prompt)], [*answer, tokenizer.end_of_turn]))
            before.append(exchange)
        return found

    def _loss(self, batch: Sequence[tuple[list[int], list[int]]]) -> Any:
        """Minus the mean log-probability of the tokens of the answers, nats."""
        torch = package("torch")
        trie, spots = Trie(), list[tuple[list[int], list[int]]]()
        for prompt, answer in batch:
            path = trie.paths[trie.add([*prompt, *answer[:-1]])]
            spots.append((path[len(prompt) - 1 :], answer))
        places = sorted({node for nodes, _ in spots for node in nodes})
        row_of = {node: row for row, node in enumerate(places)}
        logits = self._learner.model.network.learn(
            np.array([trie.tokens]), np.array([trie.depths]), ancestors(trie)[None], places
        )
        rows = [row_of[node] for nodes, _ in spots for node in nodes]
        tokens = [token for _, answer in spots for token in answer]
        logprobs = torch.log_softmax(logits.float(), -1)
        return -logprobs[rows, tokens].mean()

    def _keep(self) -> None:
        torch = package("torch")
        part = self._file.with_suffix(".part")
        state = {
            "about": self._about,
            "step": self.step,
            "losses": self.losses,
            "weights": self._learner.state(),
            "optimizer": self._optimizer.state_dict(),
        }
        try:
            with part.open("wb") as file:
                torch.save(state, file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, self._file)
        except (OSError, RuntimeError) as error:
            raise GoalscopeError(
                f"{self._file} cannot be written ({error}). Free some space; what was kept before "
                "is still there, and the same command goes on from it."
            ) from None

    def _resume(self) -> None:
        torch = package("torch")
        try:
            state = torch.load(self._file, map_location="cpu", weights_only=True)
            same = state["about"] == self._about
            if same:
                self.step, self.losses = state["step"], state["losses"]
                self._learner.restore(state["weights"])
                self._optimizer.load_state_dict(state["optimizer"])
        except Exception as error:  # whatever unpickling, unzipping and a foreign content raise
            raise InvalidInputError(
                f"{self._file} is not what an interrupted fit leaves ({error}). Delete it, or name "
                "another folder with --out."
            ) from None
        if not same:
            raise InvalidInputError(
                f"{self._file.parent} holds a fit with other settings or another corpus. Give the "
                "same ones to go on, or name another folder with --out."
            )


def _batches(
    examples: Sequence[list[tuple[list[int], list[int]]]], settings: ReadingSettings
) -> list[list[tuple[list[int], list[int]]]]:
    """Conversations in a drawn order, cut into steps; the last epoch may be a part of one."""
    drawn = random.Random(settings.seed)
    order: list[int] = []
    for _ in range(math.ceil(settings.epochs)):
        epoch = list(range(len(examples)))
        drawn.shuffle(epoch)
        order += epoch
    order = order[: round(settings.epochs * len(examples))]
    found: list[list[tuple[list[int], list[int]]]] = []
    batch, size = list[tuple[list[int], list[int]]](), 0
    for number in order:
        prompt, answer = examples[number][-1]
        if batch and size + len(prompt) + len(answer) > settings.batch_tokens:
            found.append(batch)
            batch, size = [], 0
        batch = [*batch, *examples[number]]
        size += len(prompt) + len(answer)
    return [*found, batch] if batch else found


def fit_reading(
    model: Transformers,
    languages: Mapping[str, Language],
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

    In the end the folder holds `adapter.gguf`, `fit.json` and a model card. An interrupted fit in
    it goes on.

    Args:
        model: The model to adapt; it is changed.
        languages: What can be asked for, by domain.
        lines: What to learn from.
        settings: How.
        folder: Of the adapter.
        start: File of an adapter to begin with, whose rank and layers are then taken.
        base: What others call the model.
        corpus: Where the lines come from, for the card.
        command: What asked for it, for the card.

    Raises:
        InvalidInputError: The folder holds something else, or another fit.
        GoalscopeError: The folder cannot be written.
    """
    if (folder / "adapter.gguf").exists():
        raise InvalidInputError(f"{folder} holds a finished adapter. Name another folder.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GoalscopeError(f"{folder} cannot be written: {error.strerror or error}.") from None
    begun = read_adapter(start, model.network.model.config) if start else None
    learner = Learner(
        model,
        RolePlay(model),
        rank=settings.rank,
        layers=settings.layers,
        seed=settings.seed,
        start=begun,
    )
    written = "\n".join(json.dumps(line_to_json(line), sort_keys=True) for line in lines)
    about = {
        "base": base,
        "start": hashlib.sha256(start.read_bytes()).hexdigest() if start else "",
        "corpus": list(corpus),
        "messages": len(lines),
        "writers": len({line.id.rpartition("-")[0] for line in lines}),
        "sha256": hashlib.sha256(written.encode()).hexdigest(),
        "domains": {name: sum(each.domain == name for each in lines) for name in languages},
    }
    fit = ReadingFit(learner, languages, conversations(lines), settings, folder, about)
    for step, loss in fit.run():
        yield step, fit.steps, loss
    metadata = {
        "general.name": folder.name,
        "goalscope.base": base,
        FITTED_TASK: "reading",
        FITTED_SOURCES: ", ".join(corpus),
    }
    facts = {
        **about,
        "command": command,
        "device": str(model.network.device),
        "settings": asdict(settings),
        "steps": fit.steps,
        "losses": [
            round(float(np.mean(fit.losses[i : i + 20])), 4) for i in range(0, len(fit.losses), 20)
        ],
    }
    try:
        write_adapter(
            folder / "adapter.gguf", learner.adapter(metadata), model.network.model.config
        )
        (folder / "fit.json").write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
        (folder / "state.pt").unlink(missing_ok=True)
    except OSError as error:
        raise GoalscopeError(
            f"The adapter cannot be written to {folder}: {error.strerror or error}. Free some "
            "space; the same command goes on from what is kept."
        ) from None
