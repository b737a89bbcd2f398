"""Fit an adapter of the likelihood: its loss, and validation for early stopping."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from goalscope.base.optional_packages import package
from goalscope.base.stats import auroc
from goalscope.base.types import UNSPECIFIED, GoalscopeError
from goalscope.belief.calibration import DEFAULT
from goalscope.belief.likelihood import likeness
from goalscope.datasets.case import Case
from goalscope.datasets.goal_sets import chance
from goalscope.fitting.learner import Example, Learner
from goalscope.fitting.train import KEPT, Training, diverged

CHANGES = 0.05
"""Probability, before each turn but the first, that the person has changed their mind."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How to fit.

    The loss of a dialogue is the negative log-posterior of what is true after each turn, with
    Unspecified among the wrong ones, plus that of Unspecified with the true goal left out, averaged
    over turns; plus `words_weight` times the negative log-probability of the person's words under
    the true goal and under none, in nats per token. Minds change as in a hidden Markov model (see
    `CHANGES`). In half of the training dialogues, and in validation, the similarity of words and
    goals counts as evidence, too, so that the words are learned both with it and without it.

    Attributes:
        words_weight: Weight of the words' log-probability in the loss.
        rank: Rank of the adapter.
        layers: Share of the model's layers to adapt, counted from the last.
        learning_rate: Peak learning rate of AdamW; it decays to nearly 0.
        batch_size: Dialogues per step.
        steps: Maximum number of steps.
        validate_every: Steps between validations.
        patience: Number of validations without improvement after which fitting stops.
        negatives: Number of wrong goals drawn besides the true one and Unspecified, twice as many
            for validation. The loss weights them to represent all wrong goals.
        longest: Maximum number of turns of an example, which ends after any of the first turns.
        validation: Maximum number of validation dialogues.
        temperature: Divides the evidence, as at inference.
        similarity: Nats for a cosine of 1 between the words and a goal, after the temperature.
        seed: Seed of all random draws.
    """

    words_weight: float = 0.3
    rank: int = 8
    layers: float = 0.5
    learning_rate: float = 1e-3
    batch_size: int = 4
    steps: int = 400
    validate_every: int = 50
    patience: int = 6
    negatives: int = 2
    longest: int = 5
    validation: int = 60
    temperature: float = DEFAULT.temperature
    similarity: float = 8.0
    seed: int = 1


@dataclass(frozen=True, slots=True)
class Validation:
    """The adapter's figures on validation dialogues.

    Attributes:
        step: Steps done.
        training: Mean loss of the steps since the last validation; None before the first step.
        loss: The loss of `Settings` without its second part; the best weights minimise it.
        top1: Share of dialogues whose true goal leads after the last turn.
        log_loss: Minus the log-probability of the true goal then, among the goals alone, nats.
        auroc: How well the posterior of Unspecified then separates dialogues without their true
            goal from those without a wrong one; 0.5 is chance.
    """

    step: int
    training: float | None
    loss: float
    top1: float
    log_loss: float
    auroc: float


@dataclass(frozen=True, slots=True)
class Progress:
    """The number of steps done, and the validation after them if there was one."""

    step: int
    validation: Validation | None = None


class Fit:
    """The fitting of one adapter.

    Attributes:
        settings: How to fit.
        history: The validations so far.
        ended: Whether fitting has ended.
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
        """Start a fit, or resume the one in the folder.

        Args:
            learner: The model.
            train: Training dialogues by source; all sources are sampled equally.
            validation: Validation dialogues.
            settings: How to fit.
            folder: Folder of the state.
            about: What else must be equal to resume an interrupted fit, as JSON.

        Raises:
            InvalidInputError: The folder holds another fit.
        """
        self.settings = settings
        self.history: list[Validation] = []
        self.ended = False
        self._learner = learner
        self._train = [_by_truth(cases) for cases in train]
        self._validation = [
            _example(case, settings, f"validation {case.id}", validates=True) for case in validation
        ]
        self._training = Training(
            learner,
            learning_rate=settings.learning_rate,
            steps=settings.steps,
            folder=folder,
            about={"settings": asdict(settings), **about},
        )
        self._losses: list[float] = []  # since the last validation
        self._best: dict[str, Any] = learner.state()
        self._training.resume(self._resume)

    @property
    def step(self) -> int:
        """Steps done."""
        return self._training.step

    @property
    def best(self) -> Validation:
        """The validation with the lowest loss."""
        return min(self.history, key=lambda each: each.loss)

    def learned(self) -> list[list[Case]]:
        """The dialogues that the best weights were trained on, without duplicates, by source."""
        found: list[dict[str, Case]] = [{} for _ in self._train]
        for step in range(self.best.step):
            for source, case, _ in self._draw(step):
                found[source][case.id] = case
        return [[*each.values()] for each in found]

    def run(self) -> Iterator[Progress]:
        """Run the remaining steps; at the end the learner has the best weights.

        A resumed fit first yields the step from which it continues.
        """
        if not self.history:
            yield self._validate(None)
        elif not self.ended:
            yield Progress(self.step)
        while not self.ended:
            self._losses.append(self._learn())
            yield Progress(self.step)
            if self.step % self.settings.validate_every == 0 or self.step == self.settings.steps:
                training, self._losses = float(np.mean(self._losses)), []
                yield self._validate(training)
            elif self.step % KEPT == 0:
                self._keep()
        self._learner.restore(self._best)

    def _learn(self) -> float:
        examples = (_example(case, self.settings, name) for _, case, name in self._draw(self.step))
        return self._training.learn(
            self._loss(example) / self.settings.batch_size for example in examples
        )

    def _draw(self, step: int) -> Iterator[tuple[int, Case, str]]:
        """The dialogues of a step: index of the source, dialogue, name of the draw."""
        for number in range(self.settings.batch_size):
            name = f"step {step}, {number}"
            random = chance(self.settings.seed, name)
            source = random.randrange(len(self._train))
            yield source, random.choice(random.choice(self._train[source])), name

    def _loss(self, example: Example) -> Any:
        table = self._learner.log_likelihood(example)
        goals = _goals_loss(self._evidence(table, example), example)
        own = table[range(len(example.truths)), example.truths]
        words = -(own + table[:, 0]).sum() / (2 * self._learner.tokens(example))
        return goals + self.settings.words_weight * words

    def _evidence(self, table: Any, example: Example) -> Any:
        """[T, G] in nats, from log-likelihoods."""
        evidence = table / self.settings.temperature
        if not (example.compared and self.settings.similarity):
            return evidence
        alike = evidence.new_tensor(likeness(example.goals, example.turns))
        return evidence + self.settings.similarity * alike

    def _validate(self, training: float | None) -> Progress:
        with package("torch").no_grad(), self._learner.enough_memory():
            tables = [
                self._evidence(self._learner.log_likelihood(each), each)
                for each in self._validation
            ]
        losses = [
            float(_goals_loss(table, each))
            for table, each in zip(tables, self._validation, strict=True)
        ]
        if not np.isfinite(losses).all():
            if self.step:
                raise diverged(self.step)
            raise GoalscopeError(
                "The model's log-probabilities are not finite. Test the model with "
                "`goalscope models check MODEL`."
            )
        scores = _scores([table.double().cpu() for table in tables], self._validation)
        found = Validation(self.step, training, float(np.mean(losses)), *scores)
        if not self.history or found.loss < self.best.loss:
            self._best = self._learner.state()
        self.history.append(found)
        waited = len(self.history) - 1 - self.history.index(self.best)
        self.ended = self.step >= self.settings.steps or waited >= self.settings.patience
        self._keep()
        return Progress(self.step, found)

    def _keep(self) -> None:
        self._training.keep(
            history=[asdict(each) for each in self.history],
            losses=self._losses,
            ended=self.ended,
            best=self._best,
        )

    def _resume(self, state: Mapping[str, Any]) -> None:
        self.history = [Validation(**each) for each in state["history"]]
        self.ended, self._best, self._losses = state["ended"], state["best"], state["losses"]


def _by_truth(cases: Sequence[Case]) -> list[list[Case]]:
    """Dialogues grouped by their true goal, so that frequent and rare goals are sampled equally.

    Otherwise the text of a goal alone would reveal how likely it is to be true. Where the goal
    changes, or is none of the list, each dialogue is by itself.
    """
    found: dict[str, list[Case]] = {}
    for case in cases:
        found.setdefault(case.id if case.truths else case.true_goal.text, []).append(case)
    return list(found.values())


def _example(case: Case, settings: Settings, name: str, *, validates: bool = False) -> Example:
    """The beginning of a dialogue, and some of its wrong goals."""
    random = chance(settings.seed, f"{name} parts")
    most = min(len(case.turns), settings.longest)
    end = most if validates else random.randint(1, most)
    true = dict.fromkeys(place for place in case.each_truth[:end] if place is not None)
    wrong = [goal for place, goal in enumerate(case.goals) if place not in true]
    negatives = settings.negatives * (2 if validates else 1)
    drawn = random.sample(wrong, min(len(wrong), negatives))
    goals = (UNSPECIFIED, *(case.goals[place] for place in true), *drawn)
    place_of = {None: 0} | {place: n for n, place in enumerate(true, 1)}
    truths = [place_of[place] for place in case.each_truth[:end]]
    compared = validates or random.random() < 0.5
    return Example(case.task, goals, case.turns[:end], truths, len(wrong), compared, case.group)


def _beliefs(evidence: Any, example: Example, without: int | None = None) -> Any:
    """[T, G] log-posteriors turn by turn, with a goal left out or not; 0 stays.

    Before each turn but the first, the person may have changed their mind (see `CHANGES`).
    """
    torch = package("torch")
    width, first = evidence.shape[1], 1 + len(example.true - {0})
    prior = torch.zeros(width, dtype=evidence.dtype, device=evidence.device)
    if width > first:
        prior[first:] = math.log(example.negatives / (width - first))
    if without is not None:
        prior[without] = -1e9
    prior = prior.log_softmax(-1)
    row, rows = prior, list[Any]()
    for turn, words in enumerate(evidence):
        if turn:
            row = torch.logaddexp(row + math.log1p(-CHANGES), prior + math.log(CHANGES))
        row = (row + words).log_softmax(-1)
        rows.append(row)
    return torch.stack(rows)


def _goals_loss(evidence: Any, example: Example) -> Any:
    """The negative log-posteriors of what is true, from log-likelihoods [T, G]."""
    turns = range(len(example.truths))
    loss = -_beliefs(evidence, example)[turns, example.truths].sum()
    for goal in sorted(example.true - {0}):
        absent = _beliefs(evidence, example, without=goal)[:, 0]
        loss -= sum(absent[turn] for turn in turns if example.truths[turn] == goal)
    return loss / len(turns)


def _scores(tables: Sequence[Any], examples: Sequence[Example]) -> tuple[float, float, float]:
    """Top-1, log-loss and AUROC after the last turn, where a listed goal is true."""
    right: list[bool] = []
    losses: list[float] = []
    absent: list[float] = []
    present: list[float] = []
    groups: list[str] = []
    for table, example in zip(tables, examples, strict=True):
        if not (truth := example.truths[-1]):
            continue
        belief = _beliefs(table, example)[-1, 1:].log_softmax(-1)
        right.append(bool(belief.argmax() == truth - 1))
        losses.append(-float(belief[truth - 1]))
        if len(example.goals) > 2:
            wrong = next(n for n in range(1, len(example.goals)) if n != truth)
            absent.append(float(_beliefs(table, example, truth)[-1, 0]))
            present.append(float(_beliefs(table, example, wrong)[-1, 0]))
            groups.append(example.group)
    area = auroc(absent, present, groups)[0] if len(set(groups)) > 1 else 0.5
    return float(np.mean(right)), float(np.mean(losses)), area
