"""Fitting: what is drawn, what is made small, and what is kept."""

from __future__ import annotations

import io
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fits
from fits import (
    GOALS,
    OLD_NAME,
    QUICK,
    case,
    example,
    learner_of,
)
from goalscope.base.types import UNSPECIFIED, GoalscopeError
from goalscope.belief.likelihood import likeness
from goalscope.datasets.case import Case
from goalscope.fitting.fit import CHANGES, Fit, Settings, Validation, _scores
from goalscope.fitting.learner import Example, Learner
from test_datasets import refused

torch = pytest.importorskip("torch")

pytestmark = OLD_NAME
exact, path = fits.exact, fits.path


class Scripted:
    """In place of a model: one weight, and tables that a test makes of it."""

    def __init__(self, table: Callable[[Any], Any]) -> None:
        self.weight = torch.nn.Parameter(torch.ones(1))
        self.parameters = [self.weight]
        self.examples: list[Example] = []
        self._table = table

    def log_likelihood(self, of: Example) -> Any:
        self.examples.append(of)
        return self._table(self.weight)

    def enough_memory(self) -> AbstractContextManager[None]:
        return nullcontext()

    def tokens(self, of: Example) -> int:
        return 2 * len(of.turns)

    def state(self) -> dict[str, Any]:
        return {"weight": self.weight.detach().clone()}

    def restore(self, state: dict[str, Any]) -> None:
        with torch.no_grad():
            self.weight.copy_(state["weight"])


TABLE = [[-4.0, -2.0, -3.0], [-5.0, -1.0, -2.0]]  # of two turns: Unspecified, true, wrong


def scripted(
    folder: Path, table: Callable[[Any], Any] = lambda weight: torch.tensor(TABLE) * weight,
    settings: Settings = QUICK, about: dict[str, Any] | None = None,
    train: Sequence[Sequence[Case]] = ([case(n) for n in range(3)],)
) -> tuple[Fit, Scripted]:  # fmt: skip
    learner: Any = Scripted(table)
    return Fit(learner, train, [case(3)], settings, folder, about or {}), learner


def filtered(evidence: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """[T, G] posteriors of a hidden Markov model, enumerated over all paths."""
    turns, goals = evidence.shape
    prior = prior / prior.sum()
    stays = (1 - CHANGES) * np.eye(goals) + CHANGES * prior
    found = np.zeros((turns, goals))
    for last in range(turns):
        for path in itertools.product(range(goals), repeat=last + 1):
            weight = prior[path[0]] * math.prod(stays[a, b] for a, b in itertools.pairwise(path))
            found[last, path[-1]] += weight * math.exp(
                sum(evidence[turn, goal] for turn, goal in enumerate(path))
            )
    return found / found.sum(1, keepdims=True)


def test_the_loss_is_that_of_the_goals_and_some_of_the_words(tmp_path: Path) -> None:
    words = (2 + 4 + 1 + 5) / (2 * 4)
    evidence, prior = np.array(TABLE) / 2, np.array([1.0, 1.0, 3.0])
    true = -np.log(filtered(evidence, prior)[:, 1])
    absent = -np.log(filtered(evidence, prior * [1, 0, 1])[:, 0])
    of = replace(example(), turns=example().turns[:2], truths=(1, 1), negatives=3)
    fit, _ = scripted(tmp_path, settings=replace(QUICK, words_weight=0.25, temperature=2.0))
    expected = (true + absent).mean() + 0.25 * words
    assert float(fit._loss(of).detach()) == pytest.approx(expected)


def test_where_the_goal_changes_each_turn_has_its_own_truth(tmp_path: Path) -> None:
    evidence, prior = np.array(TABLE), np.array([1.0, 1.0, 1.0])
    settings = replace(QUICK, words_weight=0.0, temperature=1.0)
    fit, _ = scripted(tmp_path, settings=settings)
    of = replace(example(), turns=example().turns[:2], goals=(UNSPECIFIED, *GOALS[:2]), negatives=0)
    whole = -np.log(filtered(evidence, prior))
    gone = replace(of, truths=(1, 0), negatives=1)
    absent = -np.log(filtered(evidence, prior * [1, 0, 1])[:, 0])
    expected = (whole[0, 1] + whole[1, 0] + absent[0]) / 2
    assert float(fit._loss(gone).detach()) == pytest.approx(expected)
    swapped = replace(of, truths=(1, 2))
    other = -np.log(filtered(evidence, prior * [1, 1, 0])[:, 0])
    expected = (whole[0, 1] + whole[1, 2] + absent[0] + other[1]) / 2
    assert float(fit._loss(swapped).detach()) == pytest.approx(expected)


def test_likeness_of_words_and_goals_counts_in_half_of_the_examples(tmp_path: Path) -> None:
    fit, _ = scripted(tmp_path, settings=replace(QUICK, temperature=1.0, similarity=6.0))
    of = replace(example(), turns=example().turns[:2], goals=(UNSPECIFIED, *GOALS[:2]))
    table = torch.tensor(TABLE)
    assert torch.equal(fit._evidence(table, of), table)
    gained = (fit._evidence(table, replace(of, compared=True)) - table).numpy()
    np.testing.assert_allclose(gained, 6 * likeness(of.goals, of.turns), atol=1e-5)
    (tmp_path / "other").mkdir()
    settings = replace(QUICK, steps=20, validate_every=20)
    fit, learner = scripted(tmp_path / "other", settings=settings)
    list(fit.run())
    first, *drawn, last = learner.examples
    assert first.compared
    assert last.compared
    assert 20 < sum(of.compared for of in drawn) < 60


def test_scores_are_what_they_say() -> None:
    tables = [torch.tensor([row]) for row in ([0.0, 2, 1, 0], [1.0, 0, 1], [-2.0, 0, 0])]
    turn = example().turns[:1]
    examples = [
        replace(
            example(), turns=turn, truths=(1,), group=group, negatives=width - 2,
            goals=(UNSPECIFIED, *GOALS[: width - 1]),
        )
        for group, width in (("x", 4), ("y", 3), ("y", 3))
    ]  # fmt: skip
    e = math.e
    top1, log_loss, auroc = _scores(tables, examples)
    assert top1 == pytest.approx(2 / 3)  # the last is a tie
    losses = [math.log(e**2 + e + 1) - 2, math.log(1 + e), math.log(2)]
    assert log_loss == pytest.approx(sum(losses) / 3)
    # Unspecified without the true goal: -log(e + 1), 0, -2; without one wrong goal:
    # -log(e^2 + 1), 1, -2. Across groups -1.3 > 1 is wrong; -1.3 > -2, 0 > -2.1, -2 > -2.1 hold.
    assert auroc == pytest.approx(3 / 4)
    alike = [replace(each, group="x") for each in examples]
    assert _scores(tables, alike) == (pytest.approx(top1), pytest.approx(log_loss), 0.5)


def test_steps_and_validations_draw_their_goals(tmp_path: Path) -> None:
    settings = replace(QUICK, batch_size=6)
    fit, learner = scripted(tmp_path, settings=settings)
    list(fit.run())
    counts = [len(of.goals) - 2 for of in learner.examples]
    batch = [2] * (3 * settings.batch_size)
    assert counts == [4, *batch, 4, *batch, 4]
    for of in learner.examples:
        assert of.turns[-1].utterance in of.goals[1].text
        assert of.goals[0] == UNSPECIFIED
        assert len(set(of.goals)) == len(of.goals)
        assert (of.negatives, f"c{GOALS.index(of.goals[1])}") == (5, of.group.replace("g", "c"))
    steps = [of for of in learner.examples if of.group != "g3"]
    assert {of.goals[1] for of in steps} == set(GOALS[:3])
    assert {len(of.turns) for of in steps} == {1, 2}
    first, second, third = [of for of in learner.examples if of.group == "g3"]
    assert first == second == third
    assert (len(first.turns), first.goals[1]) == (2, GOALS[3])


def test_it_knows_what_the_best_weights_have_learned_from(tmp_path: Path) -> None:
    settings = replace(QUICK, steps=4, validate_every=2, batch_size=2)
    train = [[case(n) for n in range(40)], [replace(case(n), id=f"o{n}") for n in range(40)]]
    margin = iter([0, 1, -1])  # the weights after two steps are the best
    fit, learner = scripted(tmp_path, margins(margin), settings, train=train)
    assert fit.history == []
    list(fit.run())
    drawn = [of for of in learner.examples if of.group != "g3"][:4]
    learned = fit.learned()
    assert len(learned) == 2
    assert sorted(each.group for own in learned for each in own) == sorted(of.group for of in drawn)
    assert {each.id[0] for each in learned[0]} <= {"c"}
    assert {each.id[0] for each in learned[1]} <= {"o"}
    never, _ = scripted(tmp_path / "never", margins(iter([1, 0, 0])), settings, train=train)
    (tmp_path / "never").mkdir()
    list(never.run())
    assert never.learned() == [[], []]


def test_a_fit_learns_which_word_a_goal_means(path: Path, tmp_path: Path) -> None:
    settings = replace(
        QUICK, words_weight=0.0, steps=40, validate_every=20, learning_rate=0.02, seed=3
    )
    cases = [case(n) for n in range(24)]
    fit = Fit(learner_of(path), [cases[:18]], cases[18:], settings, tmp_path, {})
    seen = [each.step for each in fit.run() if each.validation is None]
    assert seen == list(range(1, 41))
    assert [each.step for each in fit.history] == [0, 20, 40]
    assert [each.training is None for each in fit.history] == [True, False, False]
    first, last = fit.history[0], fit.best
    assert last.loss < first.loss - 1
    assert last.log_loss < first.log_loss - 0.6
    assert last.top1 > first.top1


def figures(history: Sequence[Validation]) -> list[Any]:
    return [
        pytest.approx({**asdict(each), "training": each.training or 0.0}, rel=1e-4)
        for each in history
    ]


@pytest.mark.parametrize("stop", [0, 4, 6, 8])
def test_an_interruption_changes_nothing(path: Path, tmp_path: Path, stop: int) -> None:
    settings = replace(QUICK, steps=8, validate_every=4, batch_size=2)

    def fit(name: str) -> tuple[Fit, Learner]:
        learner, cases = learner_of(path), [case(n) for n in range(9)]
        (tmp_path / name).mkdir(exist_ok=True)
        return Fit(learner, [cases[:6]], cases[6:], settings, tmp_path / name, {"x": 1}), learner

    whole, expected = fit("whole")
    list(whole.run())
    broken, _ = fit("broken")
    for each in broken.run():
        if each.step == stop and (each.validation or stop == 6):
            break
    again, learner = fit("broken")
    assert again.step == (4 if stop == 6 else stop)
    assert again.history == broken.history
    list(again.run())
    assert figures(again.history) == [
        {**asdict(each), "training": each.training or 0.0} for each in whole.history
    ]
    for name, each in expected.state().items():
        torch.testing.assert_close(learner.state()[name], each, rtol=1e-4, atol=1e-6)


def test_a_fit_goes_on_with_the_same_options_only(tmp_path: Path) -> None:
    about = {"base": "tiny", "start": "no adapter"}
    list(scripted(tmp_path, about=about)[0].run())
    assert scripted(tmp_path, about=about)[0].ended
    for call, said in (
        (lambda: scripted(tmp_path, settings=replace(QUICK, seed=2), about=about), "settings"),
        (lambda: scripted(tmp_path, about={**about, "base": "big"}), "base"),
        (lambda: scripted(tmp_path, about={"base": "b", "start": "c"}), "base and another start"),
    ):
        message = refused(call)
        assert f"has a fit that was started with another {said}." in message
        assert "Use the same options to resume it, or name another folder with --out." in message


def test_what_no_fit_left_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "state.pt"
    list(scripted(tmp_path)[0].run())
    whole = file.read_bytes()
    torch.save({"weights": torch.ones(2)}, file)
    foreign = file.read_bytes()
    state = torch.load(io.BytesIO(whole))
    torn = []
    for name, value in (("history", [{}]), ("weights", {}), ("about", "3"), ("optimizer", {})):
        torch.save({**state, name: value}, file)
        torn.append(file.read_bytes())
    for content in (*torn, foreign, whole[: len(whole) // 2], b"", b"A diary.\n"):
        file.write_bytes(content)
        message = refused(lambda: scripted(tmp_path))
        assert f"{file} is not the state of an interrupted fit" in message
        assert "Delete it, or name another folder with --out." in message
        assert file.read_bytes() == content


def margins(found: Iterator[float]) -> Callable[[Any], Any]:
    """Tables of one turn whose true goal is so far ahead, one after another, when validating."""

    def table(weight: Any) -> Any:
        if not torch.is_grad_enabled():
            return torch.tensor([[next(found), 0.0, 0.0]] * 2)
        return torch.tensor(TABLE) * weight

    return table


def test_it_ends_where_it_has_not_become_better_for_a_while(tmp_path: Path) -> None:
    settings = replace(QUICK, steps=30, validate_every=3, patience=2)
    fit, learner = scripted(tmp_path, margins(iter([0, 1, 0.5, 2, 1.5, 2])), settings)
    weights: dict[int, float] = {}
    for each in fit.run():
        weights[each.step] = float(learner.weight.detach())
    assert [each.step for each in fit.history] == [0, 3, 6, 9, 12, 15]
    assert fit.ended
    assert fit.best.step == 9
    assert len(set(weights.values())) == 16
    assert float(learner.weight.detach()) == weights[9]
    again, learner = scripted(tmp_path, margins(iter([])), settings)
    assert list(again.run()) == []
    assert float(learner.weight.detach()) == weights[9]


def test_a_loss_that_is_not_finite_is_an_error_and_keeps_what_was(tmp_path: Path) -> None:
    steps = iter([*[1.0] * 4 * QUICK.batch_size, *[math.nan] * 99])

    def table(weight: Any) -> Any:
        factor = 1.0 if not torch.is_grad_enabled() else next(steps)
        return torch.tensor(TABLE) * weight * factor

    fit, _ = scripted(tmp_path, table)
    with pytest.raises(GoalscopeError, match=r"not finite at step 5\. Try a smaller --learning"):
        list(fit.run())
    again, learner = scripted(tmp_path)
    assert (again.step, len(again.history)) == (3, 2)
    assert math.isfinite(float(learner.weight.detach()))
