"""Fit an adapter: steps that survive an interruption, and a validation that says when to stop."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from goalscope.datasets import Case
from goalscope.datasets.goal_sets import chance
from goalscope.fitting.learner import Example, Learner
from goalscope.models.extras import package
from goalscope.types import DEFAULT_TEMPERATURE, UNSPECIFIED, GoalscopeError, InvalidInputError

__all__ = ["Fit", "Objective", "Progress", "Settings", "Validation"]

Array = npt.NDArray[np.float64]
Objective = Literal["words", "goals", "both"]

_WARM_UP = 0.05  # of the steps, in which the learning rate rises
_CLIP = 1.0  # largest norm of a gradient
_FIRST = 8  # turns of a dialogue, from which those to score are drawn


@dataclass(frozen=True, slots=True)
class Settings:
    """How to fit.

    Attributes:
        objective: What is made small. "words": minus the log-probability of the person's words
            under the true goal, and under none, nats a token. "goals": minus the log-posterior of
            the true goal, Unspecified among the wrong ones, and that of Unspecified where the true
            goal is left out; the mean over turns. "both": the sum.
        words: Weight of "words" in "both".
        rank: Of the adapter.
        layers: The share of the model's layers, the last ones, that are adapted.
        learning_rate: Of AdamW at its highest; it falls to 0 at the last step.
        batch: Dialogues of one step.
        steps: Most steps.
        every: Steps between two validations.
        patience: Validations in a row without an improvement, after which it ends.
        others: Wrong goals beside the true one and Unspecified in a step; twice as many validate.
        turns: Most turns of a dialogue that are scored in a step.
        validation: Most dialogues that validate.
        temperature: Divides the evidence, as at inference.
        seed: Of all that is drawn.
    """

    objective: Objective = "both"
    words: float = 0.3
    rank: int = 8
    layers: float = 0.5
    learning_rate: float = 1e-3
    batch: int = 4
    steps: int = 400
    every: int = 20
    patience: int = 6
    others: int = 2
    turns: int = 2
    validation: int = 40
    temperature: float = DEFAULT_TEMPERATURE
    seed: int = 1


@dataclass(frozen=True, slots=True)
class Validation:
    """How good the adapter is on dialogues that it does not learn from.

    Attributes:
        step: After so many steps.
        seconds: Since the beginning, without interruptions.
        training: Mean of what was made small since the last validation; None before the first step.
        loss: The objective "goals", which decides.
        top1: Share of dialogues whose true goal leads after the last scored turn.
        log_loss: Minus the log-probability of the true goal then, among the goals alone, nats.
        auroc: How well the posterior of Unspecified then tells dialogues without their true goal
            from those with it; 0.5 is chance.
    """

    step: int
    seconds: float
    training: float | None
    loss: float
    top1: float
    log_loss: float
    auroc: float


@dataclass(frozen=True, slots=True)
class Progress:
    """A step was done, or a validation, if there is one."""

    step: int
    validation: Validation | None = None


class Fit:
    """The fitting of one adapter.

    Attributes:
        settings: How.
        history: The validations so far.
        step: Steps done.
        ended: Whether it is over.
    """

    def __init__(
        self,
        learner: Learner,
        train: Sequence[Sequence[Case]],
        validation: Sequence[Case],
        settings: Settings,
        folder: Path,
        about: Mapping[str, Any],
    ) -> None:
        """Begin, or go on where `folder` was left.

        Args:
            learner: The model.
            train: Dialogues to learn from, by source; each source is drawn as often.
            validation: Dialogues to validate with.
            settings: How.
            folder: Where the state is kept.
            about: What else a resumed run must have in common, as JSON: model, data, beginning.

        Raises:
            InvalidInputError: The folder holds a run with other settings, or of other software.
        """
        torch = package("torch")
        self.settings = settings
        self.history: list[Validation] = []
        self.step = 0
        self.ended = False
        self._learner, self._train = learner, train
        self._others = 0 if settings.objective == "words" else settings.others
        self._validation = [
            _drawn(case, settings, 2 * settings.others, f"validation {case.id}")
            for case in validation
        ]
        self._optimizer = torch.optim.AdamW(
            learner.parameters, lr=settings.learning_rate, betas=(0.9, 0.98), weight_decay=0.01
        )
        self._file = folder / "state.pt"
        self._about = json.loads(json.dumps({"settings": asdict(settings), **about}))
        self._seconds = 0.0
        self._best: dict[str, Any] = learner.state()
        if self._file.exists():
            self._resume()

    @property
    def best(self) -> Validation:
        """The validation with the smallest loss."""
        return min(self.history, key=lambda each: each.loss)

    def run(self) -> Iterator[Progress]:
        """Do what is left, step by step; the state is on disk at each validation.

        In the end the learner has the best weights.
        """
        settings, began = self.settings, time.monotonic() - self._seconds
        losses: list[float] = []
        if not self.history:
            yield self._validate(None, began)
        while not self.ended:
            losses.append(self._learn())
            yield Progress(self.step)
            if self.step % settings.every == 0 or self.step == settings.steps:
                yield self._validate(float(np.mean(losses)), began)
                losses = []
        self._learner.restore(self._best)

    def _learn(self) -> float:
        torch, settings = package("torch"), self.settings
        share = (self.step + 1) / settings.steps
        rate = settings.learning_rate * min(share / _WARM_UP, (1 - share) / (1 - _WARM_UP) + 0.01)
        for group in self._optimizer.param_groups:
            group["lr"] = rate
        self._optimizer.zero_grad()
        total = 0.0
        for number in range(settings.batch):
            name = f"step {self.step}, {number}"
            random = chance(settings.seed, name)
            case = random.choice(random.choice(self._train))
            example = _drawn(case, settings, self._others, name)
            table, tokens = self._learner.log_likelihood(example)
            loss = self._objective(table, tokens) / settings.batch
            loss.backward()
            total += float(loss.detach())
        torch.nn.utils.clip_grad_norm_(self._learner.parameters, _CLIP)
        self._optimizer.step()
        self.step += 1
        if not np.isfinite(total):
            raise GoalscopeError(
                f"The loss is not finite at step {self.step}. Try a smaller --learning-rate."
            )
        return total

    def _objective(self, table: Any, tokens: int) -> Any:
        settings = self.settings
        words = -(table[:, 0].sum() + table[:, 1].sum()) / (2 * tokens)
        if settings.objective == "words":
            return words
        belief = table.cumsum(0) / settings.temperature
        goals = -(belief.log_softmax(-1)[:, 0].mean() + belief[:, 1:].log_softmax(-1)[:, 0].mean())
        return goals if settings.objective == "goals" else goals + settings.words * words

    def _validate(self, training: float | None, began: float) -> Progress:
        with package("torch").inference_mode():
            tables = [self._learner.log_likelihood(each)[0] for each in self._validation]
        scored = [
            table.cumsum(0).double().cpu().numpy() / self.settings.temperature for table in tables
        ]
        self._seconds = time.monotonic() - began
        found = Validation(self.step, self._seconds, training, *_scores(scored))
        if not self.history or found.loss < self.best.loss:
            self._best = self._learner.state()
        self.history.append(found)
        waited = len(self.history) - 1 - self.history.index(self.best)
        self.ended = self.step >= self.settings.steps or waited >= self.settings.patience
        self._keep()
        return Progress(self.step, found)

    def _keep(self) -> None:
        torch = package("torch")
        part = self._file.with_suffix(".part")
        state = {
            "about": json.dumps(self._about),
            "history": [asdict(each) for each in self.history],
            "step": self.step,
            "ended": self.ended,
            "weights": self._learner.state(),
            "best": self._best,
            "optimizer": self._optimizer.state_dict(),
        }
        try:
            torch.save(state, part)
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
            about = json.loads(state["about"])
        except Exception as error:  # whatever unpickling and unzipping raise
            raise InvalidInputError(
                f"{self._file} is not what an interrupted fit leaves ({error}). Delete it, or name "
                "another folder with --out."
            ) from None
        if about != self._about:
            other = [key for key in self._about if about.get(key) != self._about[key]]
            raise InvalidInputError(
                f"{self._file.parent} holds a fit that was begun with another "
                f"{' and another '.join(other)}. Give the same options to go on, or name another "
                "folder with --out."
            )
        self.history = [Validation(**each) for each in state["history"]]
        self.step, self.ended, self._best = state["step"], state["ended"], state["best"]
        self._seconds = self.history[-1].seconds
        self._learner.restore(state["weights"])
        self._optimizer.load_state_dict(state["optimizer"])


def _drawn(case: Case, settings: Settings, others: int, name: str) -> Example:
    """A part of a dialogue, with so many wrong goals."""
    random = chance(settings.seed, f"{name} parts")
    wrong = [goal for place, goal in enumerate(case.goals) if place != case.truth]
    drawn = random.sample(wrong, min(len(wrong), others))
    turns = case.turns[:_FIRST]
    scored = sorted(random.sample(range(len(turns)), min(len(turns), settings.turns)))
    goals = (case.goals[case.truth], UNSPECIFIED, *drawn)
    return Example(case.task, goals, turns[: scored[-1] + 1], scored)


def _scores(beliefs: Sequence[Array]) -> tuple[float, float, float, float]:
    """Loss, top-1, log-loss and AUROC of unnormalised log-posteriors [turns, goals]."""
    loss = np.mean([-_log_softmax(b)[:, 0].mean() - _log_softmax(b[:, 1:])[:, 0].mean()
                    for b in beliefs])  # fmt: skip
    last = [belief[-1] for belief in beliefs]
    closed = [_log_softmax(np.delete(belief, 1)) for belief in last]
    top1 = np.mean([each[0] >= each[1:].max() for each in closed])
    log_loss = -np.mean([each[0] for each in closed])
    without = np.array([_log_softmax(belief[1:])[0] for belief in last])
    present = np.array([_log_softmax(belief)[1] for belief in last])
    apart: Array = without[:, None] - present
    auroc = float(((apart > 0) + 0.5 * (apart == 0)).mean())
    return float(loss), float(top1), float(log_loss), auroc


def _log_softmax(values: Array) -> Array:
    top = values - values.max(-1, keepdims=True)
    return top - np.log(np.exp(top).sum(-1, keepdims=True))
