"""How well goals are told apart from what people really said, in two public sets of dialogues.

    python benchmarks/dialogues.py --data DIR [--set teach | multiwoz] [--export FILE]

Each dialogue comes with the goal that its person was given, and with 19 other goals of the same
set: TEACh's commander tells a robot about one household task; MultiWOZ's user looks for trains,
hotels and so on, and the other goals have the very same domains. DIR holds TEACh as
`dialogue/teach/teach_{train,valid_seen}.jsonl.gz` and MultiWOZ 2.1's validation part as
`dialogue/multiwoz/val.json.zip`.

Reported are the share of dialogues whose true goal is the likeliest ("top-1"; goals that tie share
it) and the mean of -log posterior of the true goal ("NLL", in nats; 3.00 is chance), with 95 %
intervals from resampling dialogues. Beside it stands a bag-of-words baseline: TF-IDF of the
20 goals, cosine with all the words of the person so far, softmax. Its temperature is the one with
the lowest NLL on these same dialogues, which favours the baseline; its top-1 has no free parameter.
"""

from __future__ import annotations

import argparse
import gzip
import json
import os
import random
import re
import sys
import zipfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.progress import track
from rich.table import Table

from goalscope.belief import Belief
from goalscope.likelihood import Likelihood, RolePlay
from goalscope.models.llamacpp import LlamaCpp
from goalscope.types import DEFAULT_TEMPERATURE, Goal, Turn

Array = npt.NDArray[np.float64]

GOALS = 20
SEED = 1
OPENING = "Hello, how can I help you?"
TEACH_TASK = "Do a household task in this room for the human."
MULTIWOZ_TASK = "Help the human to find and book places and transport in and around Cambridge."


@dataclass(frozen=True)
class Dialogue:
    """A transcript, the goals in question, and the index of the true one."""

    id: str
    task: str
    turns: tuple[Turn, ...]
    goals: tuple[Goal, ...]
    truth: int

    def record(self) -> dict[str, Any]:
        """A line for `goalscope infer`, with the true goal in a key of its own."""
        return {
            "id": self.id,
            "task": self.task,
            "turns": [asdict(turn) for turn in self.turns],
            "goals": [goal.text for goal in self.goals],
            "goal": self.goals[self.truth].text,
        }


def teach(data: Path, split: str = "valid_seen") -> Iterator[Dialogue]:
    """TEACh games, in the order of the file."""
    with gzip.open(data / f"dialogue/teach/teach_{split}.jsonl.gz", "rt", encoding="utf-8") as file:
        games = [json.loads(line) for line in file]
    every = sorted({game["desc"].strip() for game in games})
    for game in games:
        said = [
            (step["agent"] == "commander", step["utterance"])
            for step in game["interactions"]
            if step.get("utterance", "").strip()
        ]
        turns, desc = turns_of(said), game["desc"].strip()
        if turns:
            others = [other for other in every if other != desc]
            yield _dialogue(game["game_id"], TEACH_TASK, turns, desc, others)


def multiwoz(data: Path) -> Iterator[Dialogue]:
    """MultiWOZ 2.1 validation dialogues whose domains give 19 other goals, in file order."""
    with zipfile.ZipFile(data / "dialogue/multiwoz/val.json.zip") as archive:
        dialogues = json.loads(archive.read("val.json"))
    messages: dict[str, str] = {}
    domains: dict[str, frozenset[str]] = {}
    for name, dialogue in dialogues.items():
        goal = dialogue["goal"]
        message = goal.get("message") or []
        text = ". ".join([message] if isinstance(message, str) else message)
        messages[name] = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", "", text)).strip()
        domains[name] = frozenset(
            key for key, value in goal.items() if value and key not in ("message", "topic")
        )
    for name, dialogue in dialogues.items():
        # the person speaks first, and then the two alternate
        said = [(i % 2 == 0, detokenised(entry["text"])) for i, entry in enumerate(dialogue["log"])]
        alike = {messages[other] for other in dialogues if domains[other] == domains[name]}
        others = sorted(alike - {messages[name], ""})
        if messages[name] and len(others) >= GOALS - 1:
            yield _dialogue(name, MULTIWOZ_TASK, turns_of(said), messages[name], others)


def turns_of(said: Iterable[tuple[bool, str]]) -> tuple[Turn, ...]:
    """Turns from utterances; True marks the person's, and what one side says in a row is joined."""
    turns: list[Turn] = []
    query: list[str] = []
    words: list[str] = []
    for person, text in [*said, (False, "")]:
        if person:
            words.append(text.strip())
            continue
        if words:
            turns.append(Turn("\n".join(query) or OPENING, "\n".join(words)))
            query, words = [], []
        query.append(text.strip())
    return tuple(turns)


def detokenised(text: str) -> str:
    """Text without the spaces that a tokeniser put before punctuation and clitics."""
    text = re.sub(r"\s+([.,?!:;)])", r"\1", text)
    text = re.sub(r"\s+(n't|'(?:s|m|re|ve|ll|d))\b", r"\1", text, flags=re.IGNORECASE)
    return re.sub(r"\s+", " ", text.replace("( ", "(")).strip()


def tfidf(dialogue: Dialogue, *, queries: bool) -> Array:
    """[T, G] cosine of each goal with all words so far; as scikit-learn's TfidfVectorizer."""
    goals = [Counter(_words(goal.text)) for goal in dialogue.goals]
    column = {word: i for i, word in enumerate(sorted(set().union(*goals)))}
    occurs = np.array([sum(word in goal for goal in goals) for word in column])
    idf = np.log((1 + len(goals)) / (1 + occurs)) + 1

    def vector(counts: Counter[str]) -> Array:
        values = np.zeros(len(column))
        for word in counts.keys() & column.keys():
            values[column[word]] = counts[word] * idf[column[word]]
        return values / max(1e-12, float(np.linalg.norm(values)))

    matrix = np.stack([vector(goal) for goal in goals])
    so_far: Counter[str] = Counter()
    rows: list[Array] = []
    for turn in dialogue.turns:
        so_far += Counter(_words(turn.utterance))
        if queries:
            so_far += Counter(_words(turn.query))
        rows.append(matrix @ vector(so_far))
    return np.stack(rows)


def posteriors(
    dialogue: Dialogue, table: Array, *, temperature: float = 1.0, evidence: str = "sum"
) -> Array:
    """[T, G] log-posterior after each turn."""
    belief = Belief.uniform(dialogue.goals, temperature=temperature, evidence=evidence)
    rows: list[Array] = []
    for row in table:
        belief = belief.observe(row)
        rows.append(belief.log_posterior)
    return np.stack(rows)


def scores(dialogue: Dialogue, log_posterior: Array) -> Array:
    """[T, 2] top-1 and NLL after each turn."""
    truth = log_posterior[:, dialogue.truth]
    best = log_posterior.max(axis=1, keepdims=True)
    ties = np.isclose(log_posterior, best, rtol=0, atol=1e-9).sum(axis=1)
    top = np.isclose(truth, best[:, 0], rtol=0, atol=1e-9) / ties
    return np.stack([top, -truth], axis=1)


MOMENTS: dict[str, Callable[[Array], Array | None]] = {
    "turn 1": lambda rows: rows[0],
    "turn 2": lambda rows: rows[1] if len(rows) > 1 else None,
    "turn 3": lambda rows: rows[2] if len(rows) > 2 else None,
    "last": lambda rows: rows[-1],
}


def summary(results: Sequence[Array]) -> dict[str, dict[str, Any]]:
    """Means and 95 % bootstrap intervals of the [T, 2] scores of dialogues, at each moment."""
    rng = np.random.default_rng(SEED)
    report: dict[str, dict[str, Any]] = {}
    for name, at in MOMENTS.items():
        rows = np.array([row for row in map(at, results) if row is not None])
        if not len(rows):
            continue
        means = rows[rng.integers(len(rows), size=(10_000, len(rows)))].mean(axis=1)
        low, high = np.quantile(means, [0.025, 0.975], axis=0)
        report[name] = {"dialogues": len(rows)}
        for i, figure in enumerate(("top1", "nll")):
            report[name][figure] = float(rows[:, i].mean())
            report[name][f"{figure}_interval"] = [float(low[i]), float(high[i])]
    return report


def baseline(dialogues: Sequence[Dialogue], *, queries: bool) -> list[Array]:
    """Scores of TF-IDF at the temperature with the lowest NLL over all turns."""
    tables = [tfidf(dialogue, queries=queries) for dialogue in dialogues]

    def at(temperature: float) -> list[Array]:
        return [
            scores(d, posteriors(d, table, temperature=temperature, evidence="last"))
            for d, table in zip(dialogues, tables, strict=True)
        ]

    return min(
        map(at, np.geomspace(0.01, 1, 41)), key=lambda r: float(np.concatenate(r)[:, 1].mean())
    )


def evaluate(
    dialogues: Sequence[Dialogue],
    likelihood: Likelihood,
    *,
    temperature: float,
    evidence: str,
) -> list[Array]:
    """Scores of goalscope; shows its progress on stderr."""
    results: list[Array] = []
    console = Console(stderr=True)
    for dialogue in track(dialogues, "Scoring dialogues", console=console, transient=True):
        table = likelihood.log_likelihood(dialogue.task, dialogue.goals, dialogue.turns)
        log_posterior = posteriors(dialogue, table, temperature=temperature, evidence=evidence)
        results.append(scores(dialogue, log_posterior))
    return results


def show(title: str, reports: dict[str, dict[str, dict[str, Any]]], console: Console) -> None:
    """Print one table: a row for each method, a column for each moment."""
    first = next(iter(reports.values()))
    table = Table(title=title, title_justify="left")
    table.add_column("")
    for name in first:
        table.add_column(f"{name} (n={first[name]['dialogues']})", justify="right")
    for method, report in reports.items():
        for figure, label, form in (("top1", "top-1", "{:.0%}"), ("nll", "NLL", "{:.2f}")):
            cells = [
                form.format(report[name][figure])
                + " ["
                + ", ".join(map(form.format, report[name][f"{figure}_interval"]))
                + "]"
                for name in report
            ]
            table.add_row(f"{method}, {label}", *cells)
    console.print(table)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--data", type=Path, default=os.environ.get("GOALSCOPE_DATA"), help="or $GOALSCOPE_DATA")
    add("--set", choices=["teach", "multiwoz"], help="default: both")
    add("--split", choices=["train", "valid_seen"], default="valid_seen", help="of TEACh")
    add("--skip", type=int, default=0, help="leave out the first dialogues of each set")
    add("--limit", type=int, default=100, help="dialogues of each set")
    add("--export", type=Path, help="write the dialogues as JSONL for `goalscope infer`, and stop")
    add("--model", type=Path, help="GGUF file; default: the embedded model")
    add("--threads", type=int, help="1 is fastest where other programs keep the cores busy")
    add("--layout", choices=["goal-first", "goal-last"])
    add("--end-of-turn", action=argparse.BooleanOptionalAction)
    add("--temperature", type=float, default=DEFAULT_TEMPERATURE)
    add("--evidence", choices=["sum", "last"], default="sum")
    add("--json", action="store_true", help="print JSON")
    args = parser.parse_args()
    if args.data is None or not Path(args.data).is_dir():
        parser.error("name the folder of the datasets with --data or in GOALSCOPE_DATA")

    sets = {
        "teach": lambda: teach(Path(args.data), args.split),
        "multiwoz": lambda: multiwoz(Path(args.data)),
    }
    chosen = {
        name: list(load())[args.skip : args.skip + args.limit]
        for name, load in sets.items()
        if args.set in (None, name)
    }
    if args.export:
        with args.export.open("w", encoding="utf-8") as file:
            for dialogue in (d for dialogues in chosen.values() for d in dialogues):
                file.write(json.dumps(dialogue.record(), ensure_ascii=False) + "\n")
        return

    options = {"layout": args.layout, "end_of_turn": args.end_of_turn}
    model = LlamaCpp(args.model, threads=args.threads)
    roleplay = RolePlay(model, **{k: v for k, v in options.items() if v is not None})
    reports: dict[str, dict[str, Any]] = {}
    for name, dialogues in chosen.items():
        reports[name] = {
            "goalscope": summary(
                evaluate(dialogues, roleplay, temperature=args.temperature, evidence=args.evidence)
            ),
            "TF-IDF": summary(baseline(dialogues, queries=False)),
            "TF-IDF with queries": summary(baseline(dialogues, queries=True)),
        }
        if not args.json:
            show(f"{name}: {len(dialogues)} dialogues", reports[name], Console(width=130))
    if args.json:
        setup = {
            "model": model.name,
            "layout": roleplay.layout,
            "end_of_turn": roleplay.end_of_turn,
            "temperature": args.temperature,
            "evidence": args.evidence,
        }
        json.dump({"setup": setup, "sets": reports}, sys.stdout, indent=2)
        print()


def _dialogue(
    name: str, task: str, turns: tuple[Turn, ...], goal: str, others: Sequence[str]
) -> Dialogue:
    rng = random.Random(f"{SEED} {name}")
    texts = rng.sample(others, GOALS - 1)
    truth = rng.randrange(GOALS)
    texts.insert(truth, goal)
    return Dialogue(name, task, turns, tuple(map(Goal, texts)), truth)


def _words(text: str) -> list[str]:
    return re.findall(r"\b\w\w+\b", text.lower())


if __name__ == "__main__":
    main()
