"""Fitting: which dialogues teach and which validate, what a model learns, and what is kept."""

from __future__ import annotations

import hashlib
import json
import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from goalscope.datasets import DATASETS, Case, read_cases
from goalscope.fitting.fit import Fit, Settings, Validation, _scores
from goalscope.fitting.learner import Example, Learner
from goalscope.fitting.sources import Source, parted, read_source
from goalscope.likelihood import Layout, RolePlay
from goalscope.models.adapters import read_adapter, write_adapter
from goalscope.models.transformers import Transformers
from goalscope.types import UNSPECIFIED, Goal, GoalscopeError, ModelError, Turn
from test_datasets import deal, games, packed, refused
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
QUICK = Settings(rank=4, layers=1.0, learning_rate=0.01, steps=6, every=3)


def case(number: int) -> Case:
    """A person who says nothing but the word of their goal."""
    truth = number % len(WORDS)
    turns = (Turn("What is it?", WORDS[truth]), Turn("Anything else?", WORDS[truth]))
    return Case(f"c{number}", f"g{number}", TASK, turns, GOALS, truth)


def rows_file(file: Path, groups: Sequence[str], **changed: Any) -> Path:
    """A row for each group; all of them as `case` has them, up to what the last one changes."""
    rows: list[dict[str, Any]] = []
    for number, group in enumerate(groups):
        own = case(number)
        rows.append(
            {
                "id": own.id,
                "group": group,
                "task": TASK,
                "turns": [asdict(turn) for turn in own.turns],
                "goals": [goal.text for goal in GOALS],
                "true": own.truth,
            }
        )
    last = {**rows.pop(), **changed}
    rows.append({key: value for key, value in last.items() if value is not None})
    file.write_text("".join(json.dumps(row) + "\n" for row in rows))
    return file


def ids(source: Source) -> list[str]:
    return [each.id for each in source.cases]


def digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


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


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tiny_folder(tmp_path_factory.mktemp("models") / "tiny")


def learner_of(
    path: Path, *, layout: Layout = "goal-last", rank: int = 4, layers: float = 1.0, **options: Any
) -> Learner:
    model = Transformers(path, device="cpu", dtype="float32", **options)
    return Learner(model, RolePlay(model, layout=layout), rank=rank, layers=layers, seed=1)


def scramble(learner: Learner, size: float = 0.3) -> None:
    """Give the adapters weights that change something."""
    random = torch.Generator().manual_seed(2)
    with torch.no_grad():
        for each in learner.parameters:
            each.copy_(torch.randn(each.shape, generator=random) * size)
    learner.model.clear_cache()


def example(scored: Sequence[int] = (0, 2)) -> Example:
    turns = (Turn("What is it?", "milk and tea"), Turn("Why?", "soap"), Turn("Else?", "Eggs, 6."))
    return Example(TASK, (GOALS[0], UNSPECIFIED, GOALS[3], GOALS[5]), turns, scored)


def by_roleplay(learner: Learner, of: Example, likelihood: RolePlay | None = None) -> np.ndarray:
    table = (likelihood or learner.roleplay).log_likelihood(of.task, of.goals, of.turns)
    return table[list(of.scored)]


def learned(learner: Learner, of: Example) -> np.ndarray:
    return learner.log_likelihood(of)[0].detach().numpy()


# Sources


def test_a_file_is_a_source(tmp_path: Path) -> None:
    file = rows_file(tmp_path / "own.jsonl", "abc")
    source = read_source(str(file), None)
    assert source == Source(str(file), read_cases(file), digest(file))
    assert source.cases[1] == replace(case(1), group="b")


def test_a_dataset_is_a_source_with_all_its_ways_to_draw_goals(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    train = packed(tmp_path, "teach", games(), "train")
    valid = packed(tmp_path, "teach", games()[:4])
    packed(tmp_path, "casino", [deal(n) for n in range(3)])
    source = read_source("teach", tmp_path, goals=3)
    assert source.name == "teach"
    assert ids(source) == [f"g{n}" for n in range(6)] * 2
    assert {len(each.goals) for each in source.cases} == {3}
    assert source.cases[:6] != source.cases[6:]
    assert (source.sha256, source.licence) == (digest(train), DATASETS["teach"].licence)
    assert read_source("teach", tmp_path, goals=3, seed=2) != source
    monkeypatch.setenv("GOALSCOPE_DATA", str(tmp_path))
    other = read_source("teach:valid_seen", None, goals=3)
    assert ids(other) == [f"g{n}" for n in range(4)] * 2
    assert other.sha256 == digest(valid)
    assert len(read_source("casino:valid", None).cases) == 6


@pytest.mark.parametrize(
    ("places", "taken"),
    [("[:2]", "01"), ("[2:]", "2345"), ("[:]", "012345"), ("[1:3]", "2"), ("[3:]", "45")],
)
def test_what_shares_a_group_with_what_stands_before_is_left_out(
    tmp_path: Path, places: str, taken: str
) -> None:
    file = rows_file(tmp_path / "own.jsonl", "aabbcc")
    source = read_source(f"{file}{places}", None)
    assert ids(source) == [f"c{number}" for number in taken]
    assert source.name == f"{file}{places}"


def test_places_count_in_each_of_a_datasets_lists(tmp_path: Path) -> None:
    packed(tmp_path, "teach", games())
    packed(tmp_path, "casino", [deal(n) for n in range(3)])
    assert ids(read_source("teach:valid_seen[:2]", tmp_path, goals=3)) == ["g0", "g1"] * 2
    assert ids(read_source("teach:valid_seen[4:]", tmp_path, goals=3)) == ["g4", "g5"] * 2
    groups = [each.group for each in read_source("casino:valid[1:]", tmp_path).cases]
    assert groups == ["1", "1", "2", "2"]  # both campers of the first deal are left out


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("", "empty"),
        ("nowhere", "'nowhere' is neither a file FILE.jsonl nor one of the datasets teach"),
        ("mcq", "neither"),
        ("own.json", "neither"),
        ("teach:night", "no split 'night'"),
        ("teach:train", "there is no file"),
        ("none.jsonl", "cannot be read"),
        ("own.jsonl[3:]", "holds no dialogue"),
        ("own.jsonl[1:1]", "holds no dialogue"),
        ("own.jsonl[1:2]", "holds no dialogue"),
    ],
)
def test_what_names_no_dialogue_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    rows_file(Path("own.jsonl"), "aab")
    message = refused(lambda: read_source(name, tmp_path))
    assert said in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"true": None}, '"true"'),
        ({"goals": ["buy milk"], "true": 0}, "at least two goals"),
        ({"turns": []}, '"turns"'),
    ],
)
def test_rows_that_cannot_teach_are_refused(
    tmp_path: Path, changed: dict[str, Any], said: str
) -> None:
    file = rows_file(tmp_path / "own.jsonl", "ab", **changed)
    message = refused(lambda: read_source(str(file), None))
    assert said in message
    assert "line 2" in message
    assert "\n" not in message


def sources() -> list[Source]:
    """30 groups of two dialogues, and 5 of one."""
    pairs = [replace(case(n), group=f"p{n // 2}") for n in range(60)]
    return [Source("pairs", pairs, "1"), Source("singles", [case(n) for n in range(60, 65)], "2")]


def test_no_group_is_on_both_sides() -> None:
    train, validation = parted(sources(), share=0.1, most=99, seed=1)
    sides = [{each.group for own in train for each in own}, {each.group for each in validation}]
    assert not sides[0] & sides[1]
    assert [len(own) for own in train] == [54, 4]
    assert len(validation) == 6 + 1  # of the smaller source one at least
    everything = [each.id for own in [*train, validation] for each in own]
    assert sorted(everything) == sorted(each.id for own in sources() for each in own.cases)


def test_the_seed_alone_parts_them() -> None:
    first = parted(sources(), share=0.1, most=4, seed=1)
    assert parted(sources(), share=0.1, most=4, seed=1) == first
    assert parted(sources(), share=0.1, most=4, seed=2) != first
    assert parted(sources()[::-1], share=0.1, most=99, seed=1)[0] == first[0][::-1]


def test_sources_take_turns_among_those_that_validate() -> None:
    train, validation = parted(sources(), share=0.4, most=5, seed=1)
    assert ["pairs" if each.group[0] == "p" else "singles" for each in validation] == [
        "pairs", "singles", "pairs", "singles", "pairs"
    ]  # fmt: skip
    assert [len(own) for own in train] == [36, 3]


def test_a_single_group_is_refused() -> None:
    lone = Source("lone.jsonl", [replace(case(n), group="a") for n in range(9)], "3")
    message = refused(lambda: parted([*sources(), lone], share=0.1, most=9, seed=1))
    assert "lone.jsonl holds a single group" in message


def test_parts_of_one_file_that_overlap_do_not_validate_what_the_other_teaches(
    tmp_path: Path,
) -> None:
    file = rows_file(tmp_path / "own.jsonl", [f"g{n}" for n in range(20)])
    overlapping = [read_source(f"{file}{places}", None) for places in ("", "[:18]")]
    for seed in range(1, 6):
        train, validation = parted(overlapping, share=0.1, most=9, seed=seed)
        taught = {each.group for own in train for each in own}
        assert not taught & {each.group for each in validation}


# The model that learns


@pytest.mark.parametrize("layout", ["goal-first", "goal-last"])
def test_words_are_as_likely_as_to_the_likelihood(path: Path, layout: Layout) -> None:
    learner, of = learner_of(path, layout=layout), example()
    plain = by_roleplay(learner, of)
    table, words = learner.log_likelihood(of)
    tokens = [learner.model.tokenizer.tokenize(of.turns[t].utterance) for t in of.scored]
    assert words == sum(map(len, tokens)) > 4
    np.testing.assert_allclose(table.detach(), plain, atol=1e-4)
    scramble(learner)
    changed = by_roleplay(learner, of)
    assert np.abs(changed - plain).max() > 0.5
    np.testing.assert_allclose(learned(learner, of), changed, atol=1e-4)
    some = replace(of, turns=of.turns[:2], scored=[1])
    np.testing.assert_allclose(learned(learner, some), by_roleplay(learner, some), atol=1e-4)


@pytest.mark.parametrize("kind", ["mistral", "qwen3", "gemma3_text"])
def test_so_they_are_where_layers_look_back_a_little(tmp_path: Path, kind: str) -> None:
    learner = learner_of(tiny(tmp_path, kind, max_position_embeddings=1024))
    scramble(learner)
    expected = by_roleplay(learner, example())
    np.testing.assert_allclose(learned(learner, example()), expected, atol=1e-3)


def test_so_they_are_where_the_oldest_turns_do_not_fit(path: Path) -> None:
    learner = learner_of(path, context_size=420)
    turns = [Turn("What is it?", f"{word} and tea") for word in WORDS * 2]
    of = Example(TASK, (GOALS[1], UNSPECIFIED), turns, [2, 11])
    assert learner.roleplay.window(TASK, turns) == 8
    np.testing.assert_allclose(learned(learner, of), by_roleplay(learner, of), atol=1e-4)


def test_half_as_many_bits_learn_too(path: Path, tmp_path: Path) -> None:
    model = Transformers(path, device="cpu", dtype="bfloat16")
    learner = Learner(model, RolePlay(model), rank=4, layers=1.0, seed=1)
    exact = learner_of(path)
    scramble(learner, 0.1)
    scramble(exact, 0.1)
    np.testing.assert_allclose(learned(learner, example()), learned(exact, example()), atol=1)
    cases = [case(n) for n in range(4)]
    fit = Fit(learner, [cases[:3]], cases[3:], QUICK, tmp_path, {})
    before = learner.state()
    list(fit.run())
    assert fit.history[-1].step == QUICK.steps
    assert any(not torch.equal(each, before[name]) for name, each in fit._learner.state().items())


@pytest.mark.parametrize(("share", "adapted"), [(0.01, {3}), (0.5, {2, 3}), (1.0, {0, 1, 2, 3})])
def test_only_adapters_of_the_last_layers_learn(
    tmp_path: Path, share: float, adapted: set[int]
) -> None:
    folder = tiny(tmp_path, "llama", num_hidden_layers=4, max_position_embeddings=1024)
    learner = learner_of(folder, rank=3, layers=share)
    scramble(learner)
    learner.log_likelihood(example())[0].sum().backward()
    named = dict(learner.model.network.model.named_parameters())
    with_gradients = {name for name, each in named.items() if each.grad is not None}
    assert with_gradients == {name for name, each in named.items() if each.requires_grad}
    assert all("lora_" in name for name in with_gradients)
    assert {int(name.split("layers.")[1].split(".")[0]) for name in with_gradients} == adapted
    assert len(learner.parameters) == len(with_gradients) == 2 * 7 * len(adapted)
    assert all(named[name].grad.abs().max() > 0 for name in with_gradients)
    assert {min(each.shape) for each in learner.parameters} == {3}


def test_a_state_is_taken_again(path: Path) -> None:
    learner = learner_of(path)
    scramble(learner)
    state, before = learner.state(), learned(learner, example())
    kept = {name: each.clone() for name, each in state.items()}
    scramble(learner, 0.5)
    assert np.abs(learned(learner, example()) - before).max() > 0.1
    assert all(torch.equal(state[name], each) for name, each in kept.items())
    learner.restore(state)
    np.testing.assert_array_equal(learned(learner, example()), before)


def test_it_begins_with_an_adapter_of_its_own_kind(path: Path, tmp_path: Path) -> None:
    first, second = learner_of(path), learner_of(path)
    scramble(first)
    file, config = tmp_path / "adapter.gguf", first.model.network.model.config
    made = first.adapter({"a": "b"})
    assert (made.rank, made.alpha, made.metadata, len(made.layers)) == (4, 4.0, {"a": "b"}, 14)
    write_adapter(file, made, config)
    second.begin(read_adapter(file, config))
    expected = learned(first, example())
    np.testing.assert_allclose(learned(second, example()), expected, atol=0.02)
    second.begin(
        replace(made, alpha=8.0, layers={k: (a, b / 2) for k, (a, b) in made.layers.items()})
    )
    np.testing.assert_allclose(learned(second, example()), expected, atol=1e-4)


def test_it_begins_with_no_other_adapter(path: Path) -> None:
    other = learner_of(path, rank=2).adapter({})
    last = learner_of(path, layers=0.5).adapter({})
    for adapter, said in ((other, "rank 2 and 14 layers"), (last, "rank 4 and 7 layers")):
        with pytest.raises(ModelError, match=f"{said}.*--rank.*--start none"):
            learner_of(path).begin(adapter)


def test_an_adapter_of_more_layers_is_not_begun_with_in_part(path: Path) -> None:
    whole = learner_of(path).adapter({})
    with pytest.raises(ModelError, match="rank 4 and 14 layers"):
        learner_of(path, layers=0.5).begin(whole)


def test_a_model_without_the_layers_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="lacks some of the layers q_proj, k_proj") as caught:
        learner_of(tiny(tmp_path / "odd", "gpt2"))
    assert str(caught.value).startswith("odd ")


def test_adapters_are_added_without_a_warning_that_no_user_can_heed(path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert learner_of(path).parameters


# The fit


class Scripted:
    """In place of a model: one weight, and tables that a test makes of it."""

    def __init__(self, table: Callable[[Any], Any], tokens: int = 4) -> None:
        self.weight = torch.nn.Parameter(torch.ones(1))
        self.parameters = [self.weight]
        self.examples: list[Example] = []
        self._table, self._tokens = table, tokens

    def log_likelihood(self, of: Example) -> tuple[Any, int]:
        self.examples.append(of)
        return self._table(self.weight), self._tokens

    def state(self) -> dict[str, Any]:
        return {"weight": self.weight.detach().clone()}

    def restore(self, state: dict[str, Any]) -> None:
        with torch.no_grad():
            self.weight.copy_(state["weight"])


TABLE = [[-2.0, -4.0, -3.0], [-1.0, -5.0, -2.0]]  # of two turns: true, Unspecified, wrong


def scripted(
    folder: Path, table: Callable[[Any], Any] = lambda weight: torch.tensor(TABLE) * weight,
    settings: Settings = QUICK, about: dict[str, Any] | None = None,
) -> tuple[Fit, Scripted]:  # fmt: skip
    learner: Any = Scripted(table)
    cases = [case(n) for n in range(4)]
    return Fit(learner, [cases[:3]], cases[3:], settings, folder, about or {}), learner


def test_the_objectives_are_what_they_say(tmp_path: Path) -> None:
    words = (2 + 1 + 4 + 5) / (2 * 4)
    # Summed over turns and divided by 2: [-1, -2, -1.5], then [-1.5, -4.5, -2.5].
    true = math.log(1 + math.exp(-1) + math.exp(-0.5)) + math.log(1 + math.exp(-3) + math.exp(-1))
    absent = math.log(1 + math.exp(0.5)) + math.log(1 + math.exp(2))
    goals = (true + absent) / 2
    for objective, expected in (
        ("words", words),
        ("goals", goals),
        ("both", goals + 0.25 * words),
    ):
        settings = replace(QUICK, objective=objective, words=0.25, temperature=2.0)
        fit, _ = scripted(tmp_path, settings=settings)
        assert float(fit._objective(torch.tensor(TABLE), 4)) == pytest.approx(expected)


def test_scores_are_what_they_say() -> None:
    beliefs = [
        np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]),
        np.array([[0.0, 0.0, -1000.0]]),
        np.array([[-1.0, 0.0, 0.0]]),
    ]
    e, two = math.e, math.log(2)
    losses = [
        (math.log(3) + two + math.log(e + 2) - 1 + two) / 2,
        two + 0,
        math.log(1 / e + 2) + 1 + two,
    ]
    loss, top1, log_loss, auroc = _scores(beliefs)
    assert loss == pytest.approx(sum(losses) / 3)
    assert top1 == pytest.approx(2 / 3)
    assert log_loss == pytest.approx((math.log(1 + 1 / e) + 0 + math.log(1 + e)) / 3)
    # Unspecified without the true goal: 1/2, 1, 1/2; with it: 1 / (e + 2), 1/2, 1 / (1/e + 2).
    assert auroc == pytest.approx((2.5 + 3 + 2.5) / 9)


@pytest.mark.parametrize(("objective", "wrong"), [("words", 0), ("goals", 2), ("both", 2)])
def test_steps_and_validations_draw_their_goals(tmp_path: Path, objective: Any, wrong: int) -> None:
    fit, learner = scripted(tmp_path, settings=replace(QUICK, objective=objective, turns=1))
    list(fit.run())
    counts = [len(of.goals) - 2 for of in learner.examples]
    batch = [wrong] * (3 * QUICK.batch)
    assert counts == [4, *batch, 4, *batch, 4]
    for of in learner.examples:
        assert of.turns[-1].utterance in of.goals[0].text
        assert of.goals[1] == UNSPECIFIED
        assert len(set(of.goals)) == len(of.goals)
        assert of.scored == [len(of.turns) - 1]
    assert {of.goals[0] for of in learner.examples[1:13]} <= set(GOALS[:3])
    assert len({len(of.turns) for of in learner.examples}) == 2
    assert learner.examples[0] == learner.examples[13]


def test_a_fit_learns_which_word_a_goal_means(path: Path, tmp_path: Path) -> None:
    settings = replace(QUICK, objective="goals", steps=40, every=20, learning_rate=0.02, seed=3)
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
    settings = replace(QUICK, objective="both", steps=8, every=4, batch=2)

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
        if torch.is_inference_mode_enabled():
            return torch.tensor([[next(found), 0.0, 0.0]])
        return torch.tensor(TABLE) * weight

    return table


def test_it_ends_where_it_has_not_become_better_for_a_while(tmp_path: Path) -> None:
    settings = replace(QUICK, steps=30, every=3, patience=2)
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
    steps = iter([*[1.0] * 4 * QUICK.batch, *[math.nan] * 99])

    def table(weight: Any) -> Any:
        factor = 1.0 if torch.is_inference_mode_enabled() else next(steps)
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
