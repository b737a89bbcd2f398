"""Fits of a tiny model: dialogues that it can learn from, and what their tests share."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from goalscope.base.types import UNSPECIFIED, Goal, Turn
from goalscope.belief.likelihood import Layout, RolePlay
from goalscope.datasets.case import Case
from goalscope.datasets.sources import Source, read_source
from goalscope.fitting.fit import Settings
from goalscope.fitting.learner import Example, Learner
from goalscope.fitting.plan import Plan
from goalscope.models.adapters import Adapter
from goalscope.models.torch.model import Transformers
from test_transformers import SMALL, folder

torch = pytest.importorskip("torch")
transformers = pytest.importorskip("transformers")
tokenizers = pytest.importorskip("tokenizers")
pytest.importorskip("peft")
pytest.importorskip("gguf")

# PEFT asks Transformers for a property by its old name.
OLD_NAME = pytest.mark.filterwarnings("ignore:`is_gradient_checkpointing`:FutureWarning")

TASK = "You sell groceries."
WORDS = ["milk", "tea", "flour", "soap", "rice", "eggs"]
GOALS = tuple(Goal(f"buy {word}") for word in WORDS)
QUICK = Settings(rank=4, layers=1.0, learning_rate=0.01, steps=6, validate_every=3, similarity=0.0)
SETTINGS = replace(QUICK, seed=3)


def case(number: int) -> Case:
    """A person who says nothing but the word of their goal."""
    truth = number % len(WORDS)
    turns = (Turn("What is it?", WORDS[truth]), Turn("Anything else?", WORDS[truth]))
    return Case(f"c{number}", f"g{number}", TASK, turns, GOALS, truth)


def rows_file(file: Path, groups: Sequence[str], **changed: Any) -> Path:
    """A row for each group; all of them as `case` has them, up to what the last one changes."""
    rows: list[dict[str, Any]] = []
    for own, group in zip(map(case, range(len(groups))), groups, strict=True):
        row = {key: value for key, value in asdict(own).items() if not key.startswith("truth")}
        goals = [goal.text for goal in own.goals]
        rows.append({**row, "group": group, "goals": goals, "true": own.truth})
    rows[-1] |= changed
    file.write_text("".join(json.dumps(row) + "\n" for row in rows))
    return file


def example() -> Example:
    turns = (Turn("What is it?", "milk and tea"), Turn("Why?", "soap"), Turn("Else?", "Eggs, 6."))
    goals = (UNSPECIFIED, GOALS[0], GOALS[3], GOALS[5])
    return Example(TASK, goals, turns, (1, 1, 1), negatives=5, compared=False, group="g")


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


@dataclass
class Finished:
    """A finished fit: its folder, the model as it was adapted, what it was fitted on."""

    folder: Path
    model: Transformers
    sources: list[Source]


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rows_file(tmp_path_factory.mktemp("rows") / "own.jsonl", "abcdefgh")


@pytest.fixture(scope="module")
def finished(path: Path, rows: Path, tmp_path_factory: pytest.TempPathFactory) -> Finished:
    own = replace(read_source(str(rows), None), name="own.jsonl")  # by which it is parted
    goals = tuple(replace(goal, text=f"{goal.text.upper()} now.") for goal in GOALS)
    public = [replace(case(n), id=f"p{n}", group=f"p{n}", goals=goals) for n in range(5)]
    sources = [own, Source("multiwoz:val[:5]", public, "ab" * 32, "MIT")]
    out = tmp_path_factory.mktemp("out") / "deep" / "mine"
    model = Transformers(path, device="cpu", dtype="float32")
    plan = Plan(sources, out, SETTINGS, start=None, layout="goal-first", base="tiny")
    for each in plan.run(model, command="goalscope fit X"):
        assert (out / "state.pt").exists(), each
    model.clear_cache()
    return Finished(out, model, sources)


def fit(rows: Path, out: Path, path: Path, *more: Any) -> list[Any]:
    """The words of a quick fit."""
    quick = ["--steps", 4, "--every", 2, "--rank", 2, "--device", "cpu"]
    return ["fit", rows, "--out", out, "--model", path, *quick, *more]


def last_error(result: Any) -> str:
    """What is said after the bar of the steps."""
    assert result.stdout == "", result.stdout
    assert "Traceback" not in result.stderr, result.stderr
    *_, line = result.stderr.strip().splitlines()
    assert line.startswith("Error: "), line
    return line
