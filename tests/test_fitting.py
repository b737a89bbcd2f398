"""Fitting: which dialogues teach and which validate, what a model learns, and what is kept."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from goalscope.datasets import Case
from goalscope.fitting.fit import Fit, Settings, Validation, _by_truth, _goals_loss, _scores
from goalscope.fitting.learner import Example, Learner
from goalscope.fitting.sources import Source, parted
from goalscope.likelihood import Layout, RolePlay
from goalscope.models.adapters import Adapter, read_adapter, write_adapter
from goalscope.models.transformers import Transformers
from goalscope.types import UNSPECIFIED, Goal, GoalscopeError, ModelError, Turn
from test_datasets import refused
from test_transformers import SMALL, folder, tiny

torch = pytest.importorskip("torch")
transformers = pytest.importorskip("transformers")
tokenizers = pytest.importorskip("tokenizers")
pytest.importorskip("peft")
pytest.importorskip("gguf")

# PEFT asks Transformers for a property by its old name.
pytestmark = pytest.mark.filterwarnings("ignore:`is_gradient_checkpointing`:FutureWarning")

TASK = "You sell groceries."
WORDS = ["milk", "tea", "flour", "soap", "rice", "eggs"]
GOALS = tuple(Goal(f"buy {word}") for word in WORDS)
QUICK = Settings(rank=4, layers=1.0, learning_rate=0.01, steps=6, validate_every=3)


def case(number: int) -> Case:
    """A person who says nothing but the word of their goal."""
    truth = number % len(WORDS)
    turns = (Turn("What is it?", WORDS[truth]), Turn("Anything else?", WORDS[truth]))
    return Case(f"c{number}", f"g{number}", TASK, turns, GOALS, truth)


def rows_file(file: Path, groups: Sequence[str], **changed: Any) -> Path:
    """A row for each group; all of them as `case` has them, up to what the last one changes."""
    rows: list[dict[str, Any]] = []
    for own, group in zip(map(case, range(len(groups))), groups, strict=True):
        row = {key: value for key, value in asdict(own).items() if key != "truth"}
        goals = [goal.text for goal in own.goals]
        rows.append({**row, "group": group, "goals": goals, "true": own.truth})
    rows[-1] |= changed
    file.write_text("".join(json.dumps(row) + "\n" for row in rows))
    return file


def tiny_folder(path: Path) -> Path:
    """A Llama with random weights, whose tokenizer has the words of the prompts."""
    file = folder(path) / "tokenizer.json"
    tokenizer = tokenizers.Tokenizer.from_file(str(file))
    prompts = RolePlay.__new__(RolePlay)
    said: list[str] = []
    for layout in ("goal-first", "goal-last"):
        prompts.layout = layout
        said += [m.content for goal in GOALS for m in prompts.context(TASK, goal, case(0).turns)]
    trainer = tokenizers.trainers.BpeTrainer(
        vocab_size=500,
        special_tokens=["<s>", "<|im_end|>", "<|im_start|>"],
        initial_alphabet=tokenizers.pre_tokenizers.ByteLevel.alphabet(),
        show_progress=False,
    )
    tokenizer.train_from_iterator([*said, *WORDS], trainer)
    tokenizer.save(str(file))
    torch.manual_seed(0)
    sizes = {"vocab_size": 512, "hidden_size": 64, "head_dim": 16, "initializer_range": 0.15}
    config = transformers.LlamaConfig(**{**SMALL, **sizes, "max_position_embeddings": 1024})
    transformers.LlamaForCausalLM(config).save_pretrained(path)
    return path


@pytest.fixture(autouse=True)
def exact(monkeypatch: pytest.MonkeyPatch) -> None:
    """All products are of 32-bit numbers."""
    monkeypatch.setattr(torch.cpu, "get_capabilities", dict, raising=False)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tiny_folder(tmp_path_factory.mktemp("models") / "tiny")


def learner_of(
    path: Path, *, layout: Layout = "goal-last", rank: int = 4, layers: float = 1.0,
    start: Adapter | None = None, **options: Any
) -> Learner:  # fmt: skip
    model = Transformers(path, **{"device": "cpu", "dtype": "float32", **options})
    roleplay = RolePlay(model, layout=layout)
    return Learner(model, roleplay, rank=rank, layers=layers, seed=1, start=start)


def scramble(learner: Learner, size: float = 0.3) -> None:
    """Give the adapters weights that change something."""
    random = torch.Generator().manual_seed(2)
    with torch.no_grad():
        for each in learner.parameters:
            each.copy_(torch.randn(each.shape, generator=random) * size)
    learner.model.clear_cache()


def example() -> Example:
    turns = (Turn("What is it?", "milk and tea"), Turn("Why?", "soap"), Turn("Else?", "Eggs, 6."))
    return Example(TASK, (GOALS[0], UNSPECIFIED, GOALS[3], GOALS[5]), turns, 5, "g")


def by_roleplay(learner: Learner, of: Example) -> np.ndarray:
    return learner.roleplay.log_likelihood(of.task, of.goals, of.turns)


def scores(learner: Learner, of: Example) -> np.ndarray:
    return learner.log_likelihood(of).detach().numpy()


# Sources


def sources() -> list[Source]:
    """30 groups of two dialogues, and 5 of one."""
    pairs = [replace(case(n), group=f"p{n // 2}") for n in range(60)]
    return [Source("pairs", pairs, "1"), Source("singles", [case(n) for n in range(60, 65)], "2")]


def groups_of(cases: Sequence[Case]) -> set[str]:
    return {each.group for each in cases}


def test_no_group_is_on_both_sides_and_at_most_a_third_validates() -> None:
    train, validation = parted(sources(), validation=99, seed=1)
    assert not groups_of([*train[0], *train[1]]) & groups_of(validation)
    assert [len(own) for own in train] == [40, 4]
    assert len(validation) == 20 + 1  # of the smaller source one at least
    everything = [each.id for own in [*train, validation] for each in own]
    assert sorted(everything) == sorted(each.id for own in sources() for each in own.cases)


def test_the_seed_alone_parts_them() -> None:
    first = parted(sources(), validation=4, seed=1)
    assert parted(sources(), validation=4, seed=1) == first
    assert parted(sources(), validation=4, seed=2) != first
    assert parted(sources()[::-1], validation=4, seed=1)[0] == first[0][::-1]


@pytest.mark.parametrize(("most", "kinds"), [(1, "p"), (2, "pg"), (3, "pgp"), (6, "pgpp")])
def test_sources_take_turns_among_those_that_validate(most: int, kinds: str) -> None:
    train, validation = parted(sources(), validation=most, seed=1)
    assert [each.group[0] for each in validation] == list(kinds)
    assert len(train[1]) == 4
    assert len(train[0]) == 60 - 2 * len(groups_of(validation) - groups_of(sources()[1].cases))


def test_a_dialogue_validates_once_with_either_of_its_goal_sets() -> None:
    cases = [case(n) for n in range(30)]
    others = [replace(each, goals=GOALS[:3], truth=0) for each in cases]
    train, validation = parted([Source("both", [*cases, *others], "1")], validation=99, seed=1)
    assert len(validation) == len({each.id for each in validation}) == 10
    assert {len(each.goals) for each in validation} == {3, 6}
    assert len(train[0]) == 40
    assert not groups_of(train[0]) & groups_of(validation)


def test_a_single_group_is_refused() -> None:
    lone = Source("lone.jsonl", [replace(case(n), group="a") for n in range(9)], "3")
    message = refused(lambda: parted([*sources(), lone], validation=9, seed=1))
    assert "lone.jsonl holds a single group" in message


def test_overlapping_parts_of_a_file_do_not_validate_what_the_other_teaches() -> None:
    cases = [case(n) for n in range(20)]
    parts = [Source("x", cases, "1"), Source("x[:18]", cases[:18], "1")]
    other = replace(parts[1], sha256="2")  # whose groups are others, though of the same names
    for seed in range(1, 6):
        train, validation = parted(parts, validation=9, seed=seed)
        assert not groups_of([*train[0], *train[1]]) & groups_of(validation)
        train, _ = parted([parts[0], other], validation=2, seed=seed)
        assert [len(own) for own in train] == [19, 17]


def test_a_source_that_validates_for_another_with_all_it_has_is_refused() -> None:
    parts = [Source(name, [case(0), case(1)], "1") for name in ("x", "x[:2]")]
    assert len(parted(parts, validation=9, seed=0)[0][1]) == 1
    said = refused(lambda: parted(parts, validation=9, seed=2))
    assert said.startswith("All dialogues of x validate for another part of the same file. ")


# The model that learns


@pytest.mark.parametrize("layout", ["goal-first", "goal-last"])
def test_words_are_as_likely_as_to_the_likelihood(path: Path, layout: Layout) -> None:
    learner, of = learner_of(path, layout=layout), example()
    plain = by_roleplay(learner, of)
    tokens = [learner.model.tokenizer.tokenize(turn.utterance) for turn in of.turns]
    assert learner.tokens(of) == sum(map(len, tokens)) > 4
    np.testing.assert_allclose(scores(learner, of), plain, atol=1e-4)
    scramble(learner)
    changed = by_roleplay(learner, of)
    assert np.abs(changed - plain).max() > 0.5
    np.testing.assert_allclose(scores(learner, of), changed, atol=1e-4)
    for turns in (1, 2):
        part = replace(of, turns=of.turns[:turns])
        np.testing.assert_allclose(scores(learner, part), changed[:turns], atol=1e-4)


@pytest.mark.parametrize("tree", [1, 150])
def test_so_they_are_in_several_trees(
    path: Path, tree: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    learner, of = learner_of(path), example()
    scramble(learner)
    whole = learner.log_likelihood(of)
    whole.sum().backward()
    gradients = [each.grad.clone() for each in learner.parameters]
    monkeypatch.setattr("goalscope.fitting.learner._TREE", tree)
    for each in learner.parameters:
        each.grad = None
    parts = learner.log_likelihood(of)
    torch.testing.assert_close(parts, whole, atol=1e-4, rtol=0)
    parts.sum().backward()
    for each, gradient in zip(learner.parameters, gradients, strict=True):
        torch.testing.assert_close(each.grad, gradient, atol=1e-2, rtol=1e-3)


def test_products_of_16_bits_change_little(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    learner, of = learner_of(path), example()
    scramble(learner)
    exact = by_roleplay(learner, of)
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: {"avx512_bf16": True}, raising=False)
    rounded = scores(learner, of)
    assert 0 < np.abs(rounded - exact).max() < 0.05 * np.abs(exact).max()


@pytest.mark.parametrize("kind", ["mistral", "qwen3", "gemma3_text"])
def test_so_they_are_where_layers_look_back_a_little(tmp_path: Path, kind: str) -> None:
    learner = learner_of(tiny(tmp_path, kind, max_position_embeddings=1024))
    scramble(learner)
    expected = by_roleplay(learner, example())
    np.testing.assert_allclose(scores(learner, example()), expected, atol=1e-3)


def test_so_they_are_where_the_oldest_turns_do_not_fit(path: Path) -> None:
    learner = learner_of(path, context_size=420)
    turns = [Turn("What is it?", f"{word} and tea") for word in WORDS * 2]
    of = Example(TASK, (GOALS[1], UNSPECIFIED), turns, 1, "g")
    assert learner.roleplay.window(TASK, turns) == 8
    np.testing.assert_allclose(scores(learner, of), by_roleplay(learner, of), atol=1e-4)


def test_each_turn_teaches(path: Path) -> None:
    learner = learner_of(path)
    scramble(learner)
    for row in learner.log_likelihood(example()):
        wanted = row.sum()
        parts = torch.autograd.grad(wanted, learner.parameters, retain_graph=True)
        assert all(part.abs().max() > 0.001 for part in parts)


def test_half_as_many_bits_learn_too(path: Path, tmp_path: Path) -> None:
    learner, exact = learner_of(path, dtype="bfloat16"), learner_of(path)
    scramble(learner, 0.1)
    scramble(exact, 0.1)
    np.testing.assert_allclose(scores(learner, example()), scores(exact, example()), atol=1)
    cases = [case(n) for n in range(4)]
    fit = Fit(learner, [cases[:3]], cases[3:], QUICK, tmp_path, {})
    before = learner.state()
    list(fit.run())
    assert fit.history[-1].step == QUICK.steps
    kept = torch.load(tmp_path / "state.pt", weights_only=True)["weights"]
    assert any(not torch.equal(each, before[name]) for name, each in kept.items())


@pytest.mark.parametrize(("share", "adapted"), [(0.01, {3}), (0.5, {2, 3}), (1.0, {0, 1, 2, 3})])
def test_only_adapters_of_the_last_layers_learn(
    tmp_path: Path, share: float, adapted: set[int]
) -> None:
    folder = tiny(tmp_path, "llama", num_hidden_layers=4, max_position_embeddings=1024)
    learner = learner_of(folder, rank=3, layers=share)
    scramble(learner)
    learner.log_likelihood(example()).sum().backward()
    named = dict(learner.model.network.model.named_parameters())
    with_gradients = {name for name, each in named.items() if each.grad is not None}
    assert with_gradients == {name for name, each in named.items() if each.requires_grad}
    assert all("lora_" in name for name in with_gradients)
    assert {int(name.split("layers.")[1].split(".")[0]) for name in with_gradients} == adapted
    assert len(learner.parameters) == len(with_gradients) == 2 * 7 * len(adapted)
    assert all(named[name].grad.abs().max() > 0 for name in with_gradients)
    assert {min(each.shape) for each in learner.parameters} == {3}


def test_it_begins_with_an_adapter_whose_rank_and_layers_it_takes(
    path: Path, tmp_path: Path
) -> None:
    first = learner_of(path, rank=3, layers=0.5)
    scramble(first)
    file, config = tmp_path / "adapter.gguf", first.model.network.model.config
    made = first.adapter({"a": "b"})
    assert (made.rank, made.alpha, made.metadata, len(made.layers)) == (3, 3.0, {"a": "b"}, 7)
    write_adapter(file, made, config)
    second = learner_of(path, start=read_adapter(file, config))  # not of rank 4 in 14 layers
    own = second.adapter({})
    assert (own.rank, own.alpha, own.layers.keys()) == (3, 3.0, made.layers.keys())
    assert len(second.parameters) == 14
    expected = scores(first, example())
    np.testing.assert_allclose(scores(second, example()), expected, atol=0.02)
    halves = {k: (a, b / 2) for k, (a, b) in made.layers.items()}
    third = learner_of(path, start=replace(made, alpha=6.0, layers=halves))
    np.testing.assert_allclose(scores(third, example()), expected, atol=1e-4)


def test_it_begins_with_no_adapter_of_other_layers_or_another_size(path: Path) -> None:
    made = learner_of(path).adapter({})
    lacking = {place: pair for place, pair in made.layers.items() if place != (1, "v_proj")}
    beyond = {(number + 1, name): pair for (number, name), pair in made.layers.items()}
    wider = {k: (np.hstack([a, a]), np.vstack([b, b])) for k, (a, b) in made.layers.items()}
    for layers, said in (
        (lacking, "different layers"), (beyond, "different layers"), (wider, "of another size")
    ):  # fmt: skip
        with pytest.raises(ModelError, match=rf"{said}.*\. Begin with --start none\."):
            learner_of(path, start=replace(made, layers=layers))


def test_a_model_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"^odd is a gpt2 model.*of the kinds llama, mistral,"):
        learner_of(tiny(tmp_path / "odd", "gpt2"))


def test_adapters_are_added_without_a_warning_that_no_user_can_heed(path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert learner_of(path).parameters


# The fit


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

    def tokens(self, of: Example) -> int:
        return 2 * len(of.turns)

    def state(self) -> dict[str, Any]:
        return {"weight": self.weight.detach().clone()}

    def restore(self, state: dict[str, Any]) -> None:
        with torch.no_grad():
            self.weight.copy_(state["weight"])


TABLE = [[-2.0, -4.0, -3.0], [-1.0, -5.0, -2.0]]  # of two turns: true, Unspecified, wrong


def scripted(
    folder: Path, table: Callable[[Any], Any] = lambda weight: torch.tensor(TABLE) * weight,
    settings: Settings = QUICK, about: dict[str, Any] | None = None,
    train: Sequence[Sequence[Case]] = ([case(n) for n in range(3)],)
) -> tuple[Fit, Scripted]:  # fmt: skip
    learner: Any = Scripted(table)
    return Fit(learner, train, [case(3)], settings, folder, about or {}), learner


def test_the_objectives_are_what_they_say(tmp_path: Path) -> None:
    words = (2 + 4 + 1 + 5) / (2 * 4)
    # Divided by 2 and summed over turns: [-1, -2, -1.5], then [-1.5, -4.5, -2.5]; the wrong goal
    # that was drawn stands for three.
    exp, log = math.exp, math.log
    true = log(1 + exp(-1) + 3 * exp(-0.5)) + log(1 + exp(-3) + 3 * exp(-1))
    absent = log(1 + 3 * exp(0.5)) + log(1 + 3 * exp(2))
    goals = (true + absent) / 2
    of = replace(example(), turns=example().turns[:2], negatives=3)
    both = goals + 0.25 * words
    for objective, expected in (("words", words), ("goals", goals), ("both", both)):
        settings = replace(QUICK, objective=objective, words_weight=0.25, temperature=2.0)
        fit, _ = scripted(tmp_path, settings=settings)
        assert float(fit._loss(of).detach()) == pytest.approx(expected)


def test_the_loss_counts_the_drawn_goals_for_all() -> None:
    of, rows = replace(example(), negatives=6), torch.zeros(1, 4)
    for drawn, expected in ((2, math.log(8 * 7)), (1, math.log(8 * 7)), (0, math.log(2))):
        assert float(_goals_loss(rows[:, : 2 + drawn], of)) == pytest.approx(expected)


def test_scores_are_what_they_say() -> None:
    beliefs = [
        np.array([2.0, 0.0, 1.0, 0.0]), np.array([0.0, 1.0, 1.0]), np.array([0.0, -2.0, 0.0])
    ]  # fmt: skip
    e = math.e
    top1, log_loss, auroc = _scores(beliefs, ["x", "y", "y"])
    assert top1 == pytest.approx(2 / 3)  # the last is a tie
    losses = [math.log(e**2 + e + 1) - 2, math.log(1 + e), math.log(2)]
    assert log_loss == pytest.approx(sum(losses) / 3)
    # Unspecified without the true goal: -log(e + 1), 0, -2; without one wrong goal:
    # -log(e^2 + 1), 1, -2. Across groups -1.3 > 1 is wrong; -1.3 > -2, 0 > -2.1, -2 > -2.1 hold.
    assert auroc == pytest.approx(3 / 4)
    assert _scores(beliefs, ["x"] * 3) == (top1, log_loss, 0.5)


@pytest.mark.parametrize(("objective", "wrong"), [("words", 0), ("goals", 2), ("both", 2)])
def test_steps_and_validations_draw_their_goals(tmp_path: Path, objective: Any, wrong: int) -> None:
    settings = replace(QUICK, objective=objective, batch_size=6)
    fit, learner = scripted(tmp_path, settings=settings)
    list(fit.run())
    counts = [len(of.goals) - 2 for of in learner.examples]
    batch = [wrong] * (3 * settings.batch_size)
    assert counts == [4, *batch, 4, *batch, 4]
    for of in learner.examples:
        assert of.turns[-1].utterance in of.goals[0].text
        assert of.goals[1] == UNSPECIFIED
        assert len(set(of.goals)) == len(of.goals)
        assert (of.negatives, f"c{GOALS.index(of.goals[0])}") == (5, of.group.replace("g", "c"))
    steps = [of for of in learner.examples if of.group != "g3"]
    assert {of.goals[0] for of in steps} == set(GOALS[:3])
    assert {len(of.turns) for of in steps} == {1, 2}
    first, second, third = [of for of in learner.examples if of.group == "g3"]
    assert first == second == third
    assert (len(first.turns), first.goals[0]) == (2, GOALS[3])


def test_a_dialogue_ends_after_its_first_turns(tmp_path: Path) -> None:
    long = [replace(case(0), turns=tuple(Turn("Else?", word) for word in WORDS))]
    settings, table = (
        replace(QUICK, longest=3, batch_size=8),
        lambda weight: torch.ones(3, 3) * weight,
    )
    fit, learner = scripted(tmp_path, table, settings, train=[long])
    list(fit.run())
    steps = [of for of in learner.examples if of.group == "g0"]
    assert all(of.turns == long[0].turns[: len(of.turns)] for of in steps)
    assert {len(of.turns) for of in steps} == {1, 2, 3}


def test_seldom_and_often_goals_and_sources_are_drawn_alike(tmp_path: Path) -> None:
    often, seldom, other = [replace(case(0), id=f"o{n}") for n in range(19)], case(1), case(2)
    assert _by_truth([*often, seldom]) == [often, [seldom]]
    settings = replace(QUICK, steps=50, validate_every=50, batch_size=8)
    fit, learner = scripted(tmp_path, settings=settings, train=[[seldom, *often], [other]])
    list(fit.run())
    truths = [of.goals[0] for of in learner.examples if of.group != "g3"]
    shares = [truths.count(goal) / 400 for goal in GOALS[:3]]
    assert shares == pytest.approx([0.25, 0.25, 0.5], abs=0.08)


def test_a_fit_learns_which_word_a_goal_means(path: Path, tmp_path: Path) -> None:
    settings = replace(
        QUICK, objective="goals", steps=40, validate_every=20, learning_rate=0.02, seed=3
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


def without_time(history: Sequence[Validation]) -> list[Any]:
    return [
        pytest.approx({**asdict(each), "seconds": 0.0, "training": each.training or 0.0}, rel=1e-4)
        for each in history
    ]


@pytest.mark.parametrize("stop", [0, 4, 6, 8])
def test_an_interruption_changes_nothing(path: Path, tmp_path: Path, stop: int) -> None:
    settings = replace(QUICK, objective="both", steps=8, validate_every=4, batch_size=2)

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
    assert without_time(again.history) == [
        {**asdict(each), "seconds": 0.0, "training": each.training or 0.0} for each in whole.history
    ]
    assert again.history[-1].seconds > broken.history[-1].seconds or stop == 8
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
        assert f"holds a fit that was begun with another {said}." in message
        assert "Give the same options to go on, or name another folder with --out." in message


def test_what_no_fit_left_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "state.pt"
    list(scripted(tmp_path)[0].run())
    whole = file.read_bytes()
    torch.save({"weights": torch.ones(2)}, file)
    foreign = file.read_bytes()
    for content in (foreign, whole[: len(whole) // 2], b"", b"A diary.\n"):
        file.write_bytes(content)
        message = refused(lambda: scripted(tmp_path))
        assert f"{file} is not what an interrupted fit leaves" in message
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


def test_a_state_that_cannot_be_kept_is_an_error(tmp_path: Path) -> None:
    fit, _ = scripted(tmp_path / "gone")
    with pytest.raises(GoalscopeError, match=r"state\.pt cannot be written.*goes on from it"):
        list(fit.run())
