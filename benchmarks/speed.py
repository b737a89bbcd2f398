"""How fast one belief update is, beside other ways to the same numbers, in one run.

    python benchmarks/speed.py            # 5 to 500 goals at rounds 1 to 20
    python benchmarks/speed.py --quick    # 20 goals at round 10
    python benchmarks/speed.py --full     # no figure scaled up from some of the goals: hours

Every update scores the newest utterance under each goal and under "no stated goal". What keeps a
cache begins with what the round before left in it. Ways that take one goal after another, or one
batch, cost the same for each goal, so some goals are measured and the time is scaled up, which "~"
marks; it is scaled from the fastest goal, in favour of the other way. The floor is one plain prompt
of as many tokens as the update decodes, with as many of them scored; above `LONGEST_FLOOR` tokens
several of that length, since a longer one would be slowed down by its own attention.
"""

from __future__ import annotations

import argparse
import copy
import os
import resource
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_WAIT_POLICY", "passive")  # for all alike: see docs/log.md

import numpy as np
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

import speed_report
from goalscope.base.types import Message
from goalscope.belief.likelihood import RolePlay
from goalscope.models.llama.model import LlamaCpp
from speed_dialogue import TASK, TURNS, goals

THREADS = 2
GOALS = (5, 20, 100, 500)
ROUNDS = (1, 5, 10, 20)
HEADLINE = (20, 10)
LONGEST_FLOOR = 1024  # tokens
WARM_GOALS = 100  # at most, in the round before: more leave the same in the cache
MOST_SHARED = 100  # goals that the shared prefix cache is measured with; more are scaled up
REFERENCE_ROWS = 6  # that agreement is judged on


@dataclass
class Way:
    """One of the other ways, and how much of it is measured unless everything is.

    Attributes:
        peer: Scores rows.
        calls: Timed calls.
        rows: Rows of one call; the time grows with the number of rows.
    """

    peer: Any
    calls: int
    rows: int


class Recorder:
    """A model that notes what `RolePlay` asks of it."""

    def __init__(self, model: LlamaCpp) -> None:
        self.context_size = model.context_size
        self.count_tokens = model.count_tokens
        self.pairs: list[tuple[Sequence[Message], str]] = []

    def token_logprobs(
        self, contexts: Sequence[Sequence[Message]], words: Sequence[str]
    ) -> list[Any]:
        self.pairs = list(zip(contexts, words, strict=True))
        return [np.zeros(1)] * len(words)


class Bench:
    """The engine, the other ways on the same weights, and the results."""

    def __init__(self, *, full: bool, progress: Progress) -> None:
        import torch

        from speed_peers import (
            LmEval,
            Minicons,
            OneByOne,
            PaddedBatch,
            SharedPrefix,
            load_tokenizer,
            load_weights,
        )

        torch.set_num_threads(THREADS)
        self.progress = progress
        self.results = speed_report.Results()
        self.engine = LlamaCpp(threads=THREADS)
        self.tokens = self.engine.tokenizer
        self.tokenizer = load_tokenizer()
        exact = load_weights()
        half = copy.deepcopy(exact).to(torch.bfloat16)
        self.reference = Way(OneByOne(exact, "float32"), REFERENCE_ROWS, 1)
        self.ways = [self.reference, Way(OneByOne(half, "bfloat16"), 2, 1)]
        self.sharing = []
        for model, dtype in ((exact, "float32"), (half, "bfloat16")):
            self.ways += [
                Way(PaddedBatch(model, dtype), 1, REFERENCE_ROWS),
                Way(LmEval(model, self.tokenizer, dtype), 2, 1),
                Way(Minicons(model, self.tokenizer, dtype), 2, 1),
            ]
            self.sharing.append(SharedPrefix(model, dtype))
        self.full = full
        self.results.engine = f"{self.engine.weight_type} weights, {self.engine.threads} threads"

    def rows(self, goal_count: int, round_number: int) -> list[Any]:
        """What the other ways are given: the tokens and the text of our own prompts."""
        from speed_peers import Row

        recorder = Recorder(self.engine)
        RolePlay(recorder).log_likelihood(
            TASK, goals(goal_count), TURNS[:round_number], since=round_number - 1
        )
        rows = []
        for chat, words in recorder.pairs:
            prompt, answer = self.tokens.render(chat), self.tokens.tokenize(words)
            row = Row(prompt, answer, self.tokenizer.decode(prompt), words)
            if self.tokenizer(row.prompt_text + words)["input_ids"] != prompt + answer:
                raise SystemExit("The tokenizers disagree; nothing can be compared.")
            rows.append(row)
        return rows

    def one_round(self, round_number: int, goal_counts: Sequence[int]) -> None:
        """Measure all cells of a round."""
        reference = self.separate(round_number, goal_counts)
        for count in goal_counts:
            self.together(count, round_number, reference)

    def separate(self, round_number: int, goal_counts: Sequence[int]) -> list[float]:
        """The ways whose time grows with the goals; returns the reference log-probabilities."""
        rows = self.rows(max(goal_counts), round_number)
        if self.full:
            for count in goal_counts:
                for way in self.ways:
                    with self.step(f"round {round_number}, {count} goals: {way.peer.name}"):
                        seconds, _ = timed(way.peer.score, rows[: count + 1])
                    self.results.add(count, round_number, way.peer.name, seconds=seconds)
        best: dict[str, float] = {}
        values: dict[str, list[float]] = {}
        for call in range(REFERENCE_ROWS):
            for way in self.ways:
                name = way.peer.name
                if call >= way.calls:
                    continue
                start = call * way.rows % REFERENCE_ROWS
                batch = rows[start : start + way.rows]
                with self.step(f"round {round_number}: {name}"):
                    seconds, scores = timed(way.peer.score, batch)
                best[name] = min(best.get(name, np.inf), seconds / len(batch))
                values[name] = [*values.get(name, []), *scores][:REFERENCE_ROWS]
        reference = values[self.reference.peer.name]
        for name, seconds in best.items():
            self.results.compare(name, values[name], reference)
            for count in () if self.full else goal_counts:
                self.results.add(
                    count, round_number, name, seconds=seconds * (count + 1), scaled=True
                )
        return reference

    def together(self, count: int, round_number: int, reference: Sequence[float]) -> None:
        """This project, its floor, and the shared prefix cache, in turns."""
        best: dict[str, float] = {}
        where = f"round {round_number}, {count} goals"
        shares = self.full or count <= MOST_SHARED
        rows = self.rows(count if shares else 1, round_number)
        before = self.rows(1, round_number - 1) if round_number > 1 else []
        for repeat in range(2 if count <= HEADLINE[0] else 1):
            with self.step(f"{where}: goalscope"):
                tokens, seconds, scores = self.update(count, round_number)
            best["goalscope"] = min(best.get("goalscope", np.inf), seconds)
            if repeat == 0:
                with self.step(f"{where}: floor"):
                    best["floor"] = self.floor(tokens, 0)
                    scored = (count + 1) * len(rows[0].answer)
                    best["floor, scored"] = self.floor(tokens, scored)
            for sharing in self.sharing if shares else ():
                with self.step(f"{where}: {sharing.name}"):
                    sharing.forget()
                    if before:
                        sharing.score(before)
                    seconds, others = timed(sharing.score, rows)
                best[sharing.name] = min(best.get(sharing.name, np.inf), seconds)
                self.results.compare(sharing.name, others, reference)
        self.results.compare("goalscope", scores, reference)
        names = {sharing.name for sharing in self.sharing}
        for name, seconds in best.items():
            self.results.add(count, round_number, name, seconds=seconds, tokens=tokens)
            if name in names and count == MOST_SHARED:
                for more in (more for more in GOALS if more > count and not self.full):
                    scaled = seconds * (more + 1) / (count + 1)
                    self.results.add(more, round_number, name, seconds=scaled, scaled=True)

    def update(self, count: int, round_number: int) -> tuple[int, float, list[float]]:
        """Tokens decoded, seconds and log-probabilities of our update after the round before."""
        self.engine.clear_cache()
        if round_number > 1:
            self.evidence(min(count, WARM_GOALS), round_number - 1)
        decoded = self.engine.tokens_decoded
        seconds, table = timed(self.evidence, count, round_number)
        return self.engine.tokens_decoded - decoded, seconds, table[0].tolist()

    def evidence(self, count: int, round_number: int) -> Any:
        """What a `GoalTracker` computes in a round."""
        return RolePlay(self.engine).log_likelihood(
            TASK, goals(count), TURNS[:round_number], since=round_number - 1
        )

    def floor(self, tokens: int, scored: int) -> float:
        """Seconds of plain prompts of so many tokens, with so many scored."""
        prompts = -(-tokens // LONGEST_FLOOR)
        return prompts * self.engine.prompt_seconds(tokens // prompts, scored=scored // prompts)

    def grow(self, count: int) -> None:
        """Cumulative time over an episode."""
        self.engine.clear_cache()
        times: dict[str, list[float]] = {}
        for sharing in self.sharing:
            sharing.forget()
        for number in range(1, len(TURNS) + 1):
            rows = self.rows(count, number)
            part = rows if self.full else rows[1:2]
            works = [("goalscope", self.evidence, (count, number), 1.0)]
            works += [(sharing.name, sharing.score, (rows,), 1.0) for sharing in self.sharing]
            paper = self.reference.peer
            works.append((paper.name, paper.score, (part,), len(rows) / len(part)))
            with self.step(f"episode, round {number} of {len(TURNS)}"):
                for name, work, values, factor in works:
                    seconds, _ = timed(work, *values)
                    times.setdefault(name, []).append(seconds * factor)
        self.results.growth = {name: np.cumsum(row).tolist() for name, row in times.items()}

    @contextmanager
    def step(self, text: str) -> Iterator[None]:
        """Show what is being measured."""
        task = self.progress.add_task(text)
        yield
        self.progress.remove_task(task)


def timed(work: Callable[..., Any], *values: Any) -> tuple[float, Any]:
    """Seconds that `work` takes, and its result."""
    start = time.perf_counter()
    result = work(*values)
    return time.perf_counter() - start, result


def print_memory() -> None:
    """Peak resident memory in MB of one update with the most goals, with nothing else loaded."""
    model = LlamaCpp(threads=THREADS)
    RolePlay(model).log_likelihood(TASK, goals(max(GOALS)), TURNS, since=len(TURNS) - 1)
    status = Path("/proc/self/status")
    if status.exists():  # Linux counts the parent's memory in `ru_maxrss` of a child
        (line,) = (line for line in status.read_text().splitlines() if line.startswith("VmHWM:"))
        print(int(line.split()[1]) * 1.024e-3)
    else:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        print(peak * (1e-6 if sys.platform == "darwin" else 1.024e-3))


def measured_memory() -> float:
    """What `print_memory` prints in a process of its own."""
    command = [sys.executable, __file__, "--memory"]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def main(arguments: Iterable[str] | None = None) -> None:
    """Measure, then show and write the results."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="20 goals at round 10 only")
    parser.add_argument("--full", action="store_true", help="scale nothing: hours")
    parser.add_argument("--memory", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments and list(arguments))
    if options.memory:
        print_memory()
        return
    warnings.filterwarnings("ignore")
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, transient=True) as progress:
        bench = Bench(full=options.full, progress=progress)
        if options.quick:
            bench.one_round(HEADLINE[1], [HEADLINE[0]])
        else:
            for number in ROUNDS:
                bench.one_round(number, GOALS)
            bench.grow(HEADLINE[0])
            with bench.step(f"memory with {max(GOALS)} goals"):
                bench.results.megabytes = measured_memory()
    speed_report.show(bench.results, HEADLINE)
    if not options.quick:
        speed_report.write(bench.results, HEADLINE)


if __name__ == "__main__":
    main()
