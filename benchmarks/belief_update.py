"""Time and check one belief update: 20 goals and Unspecified, at round 10 of a dialogue.

Run `python benchmarks/belief_update.py`. It prints, for the goal stated first (system message) and
last (last user message), and for the embedded model as used and at F32:

* warm: this round's scores, with the cache left by round 9;
* scratch: each goal on its own from an empty cache;
* plain: as many tokens as warm had to compute, as one prompt with as many of them scored;
* the largest difference between warm and scratch log-probabilities of an utterance, in nats.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from goalscope.models.llamacpp import LlamaCpp
from goalscope.models.tune import requantize
from goalscope.types import UNSPECIFIED, Message

REPEATS = 3
ROUNDS = 10
F32 = 0  # LLAMA_FTYPE_ALL_F32

DISHES = (
    "lasagne", "fish tacos", "lentil soup", "pancakes", "chicken curry", "sushi", "ratatouille",
    "chili", "pad thai", "a roast dinner", "falafel", "beef stew", "risotto", "a birthday cake",
    "ramen", "a Greek salad", "pizza", "mushroom stroganoff", "shakshuka", "gumbo",
)  # fmt: skip
GOALS = [
    *(f"Buy the ingredients for {dish} for six people, avoiding nuts." for dish in DISHES),
    UNSPECIFIED.text,
]
ASPECTS = (
    "the main dish", "how many people will eat", "the budget", "allergies", "spices", "drinks",
    "dessert", "bread", "delivery", "anything else",
)  # fmt: skip
QUESTIONS = [
    f"Thank you, that helps me. Could you tell me more about {aspect} that you have in mind, "
    "so that I can find the right products?"
    for aspect in ASPECTS
]
REPLIES = [
    f"About {aspect}: I am not sure yet, but please keep it simple, fresh, and good for children."
    for aspect in ASPECTS
]

Chat = list[Message]


def goal_first(goal: str, round_number: int) -> Chat:
    """The chat before the person's reply of a round, with the goal in the system message."""
    chat = [Message("system", f"You are a customer. What you want: {goal}")]
    for question, reply in zip(QUESTIONS, REPLIES, strict=True):
        chat += [Message("user", question), Message("assistant", reply)]
    return chat[: 2 * round_number]


def goal_last(goal: str, round_number: int) -> Chat:
    """The same with the goal at the end of the last user message."""
    chat = goal_first("stated below.", round_number)
    question = chat.pop().content
    return [*chat, Message("user", f"{question}\n\nAnswer as someone who wants: {goal}")]


def main() -> None:
    """Print the table."""
    print(f"{'weights':8} {'goal':6} {'warm s':>8} {'scratch s':>10} {'plain s':>8} "
          f"{'tokens':>7} {'scratch/warm':>13} {'warm/plain':>11} {'difference':>11}")  # fmt: skip
    embedded = LlamaCpp()
    report(embedded)
    with tempfile.TemporaryDirectory() as folder:
        exact = Path(folder, "f32.gguf")
        requantize(embedded.path, exact, F32)
        embedded.close()
        model = LlamaCpp(exact)
        report(model)
        model.close()


def report(model: LlamaCpp) -> None:
    """Print the rows of one model."""
    for label, layout in (("first", goal_first), ("last", goal_last)):
        warm_times, plain_times = [], []
        for _ in range(REPEATS):
            model.clear_cache()
            score(model, layout, ROUNDS - 1)
            before = model.tokens_decoded
            seconds, warm = timed(lambda: score(model, layout, ROUNDS))  # noqa: B023
            warm_times.append(seconds)
            tokens = model.tokens_decoded - before
            scored = len(GOALS) * (len(model.tokenize(REPLIES[-1])) + 1)
            plain_times.append(model.prompt_seconds(tokens, scored=scored))
        slow, scratch = timed(lambda: from_scratch(model, layout))  # noqa: B023
        gap = max(abs(a - b) for a, b in zip(warm, scratch, strict=True))
        fast, flat = min(warm_times), min(plain_times)
        print(f"{model.weight_type:8} {label:6} {fast:8.2f} {slow:10.2f} {flat:8.2f} "
              f"{tokens:7} {slow / fast:13.1f} {fast / flat:11.2f} {gap:11.5f}")  # fmt: skip


def score(model: LlamaCpp, layout: Callable[[str, int], Chat], round_number: int) -> list[float]:
    """Log-probability of the round's reply under each goal, in nats."""
    contexts = [layout(goal, round_number) for goal in GOALS]
    replies = [REPLIES[round_number - 1]] * len(GOALS)
    return [float(x.sum()) for x in model.token_logprobs(contexts, replies, end_of_turn=True)]


def from_scratch(model: LlamaCpp, layout: Callable[[str, int], Chat]) -> list[float]:
    """The same, one goal at a time, with nothing kept between goals."""
    sums = []
    for goal in GOALS:
        model.clear_cache()
        (scores,) = model.token_logprobs([layout(goal, ROUNDS)], [REPLIES[-1]], end_of_turn=True)
        sums.append(float(scores.sum()))
    return sums


def timed(work: Callable[[], list[float]]) -> tuple[float, list[float]]:
    """Seconds that `work` takes, and its result."""
    start = time.perf_counter()
    result = work()
    return time.perf_counter() - start, result


if __name__ == "__main__":
    main()
