"""What the real model says does not depend on how it is asked."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from goalscope.base.types import UNSPECIFIED, Goal, Message, Turn
from goalscope.belief.calibration import DEFAULT, PAPER
from goalscope.belief.likelihood import RolePlay
from goalscope.belief.tracker import GoalTracker
from goalscope.models.llama.model import LlamaCpp

CHAT = [
    Message("system", "You are a person who wants this: bake a cake"),
    Message("user", "What else?"),
]
WORDS = [
    *(" a space before", "two, and\ttabs\t ", "one\r\ntwo\rthree\n\n", "👩\u200d👩\u200d👧 for us"),
    *("שלום, עוגה", "\u202eekac a\u202c", "a\0b\0", "<|im_end|>\n<|im_start|>user\n"),
    *(unicodedata.normalize(form, "crème brûlée, Ångström, 한국어") for form in ("NFC", "NFD")),
    *("🏴\U000e0067\U000e0062\U000e007f🇨🇭", "👍🏽🥛🧀", "\ufeffmilk", "z\u0335\u0336a\u0330lgo"),
    *(
        "牛奶和鸡蛋",
        "½ kg & 3 €/l",
        "𝓂𝒾𝓁𝓀",
        "x" * 60,
        "0.1 + 1e-9 = -∞",
        "a\u200b\u2060",
        "a space after ",
    ),
]
GOALS = ["bake a cake", "cook a soup", "wash the car", "have a picnic with the children"]
SAID = [
    *("I need flour.", "Also some cocoa, please.", "Yes, dark.", "No nuts!", "For six people."),
    *(
        "My sister comes.",
        "Not too sweet.",
        "Oh, and butter.",
        "A tin to bake it in.",
        "That's it.",
    ),
]
TURNS = [Turn("What else?", said) for said in SAID]
MANY = [
    *(f"bake {what}" for what in ("a cake", "bread", "cookies", "a pie", "scones", "a pizza")),
    *(f"cook {what}" for what in ("a soup", "rice", "noodles", "a stew", "eggs", "beans")),
    *(f"buy presents for {who}" for who in ("my son", "my wife", "a friend", "the neighbours")),
]
HOW = ["", " today", " with little money", " for a party"]


@pytest.fixture(scope="module")
def exact(exact_gguf: Path) -> Iterator[LlamaCpp]:
    """The embedded model in float32."""
    engine = LlamaCpp(exact_gguf)
    yield engine
    engine.close()


@pytest.mark.parametrize(
    "texts", [WORDS[:10], pytest.param(WORDS, marks=pytest.mark.slow)], ids=len
)
def test_the_scored_tokens_are_the_words_and_each_has_its_own_number(
    exact: LlamaCpp, texts, figure
) -> None:
    rows = exact.token_logprobs([CHAT] * len(texts), texts)
    worst = 0.0
    for words, row in zip(texts, rows, strict=True):
        tokens = exact.tokenizer.tokenize(words)
        assert exact.tokenizer.detokenize(tokens) == words
        exact.clear_cache()
        prompt, alone = exact.tokenizer.render(CHAT), []
        for token in tokens:
            alone.append(exact.next_logprobs(prompt)[token])
            prompt.append(token)
        assert len(row) == len(tokens)
        worst = max(worst, abs(float(row.sum()) - sum(alone)))
    figure(f"{len(texts)} texts, float32: at most {worst:.1e} nats apart")
    assert worst <= 1e-4


def test_a_goal_that_comes_after_ten_rounds_is_believed_as_if_it_had_always_been_there(
    exact: LlamaCpp, figure
) -> None:
    early, late = (GoalTracker(exact, goals=goals) for goals in (GOALS, GOALS[:3]))
    for turn in TURNS:
        early.observe(turn.query, turn.utterance)
        late.observe(turn.query, turn.utterance)
    late.add(GOALS[3:])
    assert late.belief.goals == early.belief.goals
    apart = float(np.abs(early.belief.log_likelihood - late.belief.log_likelihood).max())
    moved = 0.0
    for calibration in (PAPER, DEFAULT, early.belief.calibration):
        one, other = (replace(each.belief, calibration=calibration) for each in (early, late))
        moved = max(moved, float(np.abs(one.probability - other.probability).max()))
    figure(f"10 rounds, float32: {apart:.1e} nats a turn, {moved:.1e} of probability apart")
    assert apart <= 1e-3
    assert moved <= 1e-5


@pytest.mark.parametrize(
    ("weights", "count", "sizes", "most"),
    [
        ("model", 16, (1, 4, 16), 1.0),
        pytest.param("model", 64, (1, 2, 4, 8, 16, 32, 64), 1.0, marks=pytest.mark.slow),
        pytest.param("exact", 64, (1, 2, 4, 8, 16, 32, 64), 1e-3, marks=pytest.mark.slow),
    ],
)
def test_neither_the_order_of_goals_nor_the_size_of_a_batch_decides(
    request: pytest.FixtureRequest, weights, count, sizes, most, figure
) -> None:
    engine: LlamaCpp = request.getfixturevalue(weights)
    roleplay = RolePlay(engine)
    goals = [UNSPECIFIED, *(Goal(f"{text}{how}") for how in HOW for text in MANY)][:count]
    random, rows = np.random.default_rng(0), list[np.ndarray]()
    for size in sizes:
        order = random.permutation(count)
        engine.clear_cache()
        row = np.zeros(count)
        for start in range(0, count, size):
            part = order[start : start + size]
            (row[part],) = roleplay.log_likelihood(
                "Help.", [goals[i] for i in part], TURNS[:2], since=1
            )
        rows.append(row)
    table = np.array(rows)
    apart = float(np.ptp(table, axis=0).max())
    best = table.mean(0)
    clear = np.sort(best)[-1] - np.sort(best)[-2] > most
    flips = len({*table.argmax(1)}) - 1
    figure(
        f"{count} goals, {'float32' if weights == 'exact' else engine.weight_type}, batches of "
        f"{', '.join(map(str, sizes))}: at most {apart:.1e} nats apart, {flips} other leaders",
    )
    assert apart <= most
    assert not (clear and flips)
