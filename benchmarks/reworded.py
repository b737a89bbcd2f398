"""TEACh's goals in other words, which no adapter was fitted on.

goalscope data export teach:valid_seen --limit 60 --out teach.jsonl
python benchmarks/reworded.py teach.jsonl reworded.jsonl
goalscope bench dialogues --jsonl reworded.jsonl
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from goalscope.base.types import Goal
from goalscope.datasets.case import read_cases, write_cases


def words(name: str) -> str:
    """A name such as "CoffeeTable" in words."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()


def one(name: str) -> str:
    """The same, of one."""
    found = words(name)
    return found[:-1] if found.endswith("s") and not found.endswith("ss") else found


OTHERS: tuple[tuple[str, Callable[[re.Match[str]], str]], ...] = (
    (r"Prepare coffee in a clean mug\.", lambda m: "have a mug of coffee"),
    (r"Make a salad\.", lambda m: "get a salad ready to eat"),
    (r"Prepare breakfast\.", lambda m: "have something for breakfast"),
    (r"Water the plant\.", lambda m: "give the plant something to drink"),
    (r"Make a sandwich\.", lambda m: "have a sandwich"),
    (r"Boil (\w+)\.", lambda m: f"have a {words(m[1])} boiled"),
    (r"Make a plate of toast\.", lambda m: "eat toast from a plate"),
    (r"Clean all the (\w+)\.", lambda m: f"have every {one(m[1])} washed"),
    (
        r"Serve (\d+) slice\(s\) of (\w+) (?:on|in) a (\w+)\.",
        lambda m: (
            f"eat one slice of {words(m[2])} from a {words(m[3])}"
            if m[1] == "1"
            else f"eat {words(m[2])} in {m[1]} slices from a {words(m[3])}"
        ),
    ),
    (
        r"Cook (\d+) slice\(s\) of (\w+) and serve (on|in) a (\w+)\.",
        lambda m: f"have {m[1]} hot slices of {words(m[2])}, cooked, {m[3]} a {words(m[4])}",
    ),
    (
        r"Put all (\w+) (on|in) any (\w+)\.",
        lambda m: f"find every {one(m[1])} and leave it {m[2]} some {one(m[3])}",
    ),
    (
        r"Put all (\w+) (on|in) one (\w+)\.",
        lambda m: f"gather every {one(m[1])} {m[2]} the same {one(m[3])}",
    ),
)


def reworded(goal: Goal) -> Goal:
    """A goal of TEACh in other words."""
    found = (say(match) for pattern, say in OTHERS if (match := re.fullmatch(pattern, goal.text)))
    return Goal(next(found))


def main() -> None:
    """Write the dialogues with their goals in other words."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dialogues", type=Path)
    parser.add_argument("out", type=Path)
    asked = parser.parse_args()
    cases = read_cases(asked.dialogues)
    write_cases(
        (replace(case, goals=tuple(map(reworded, case.goals))) for case in cases), asked.out
    )


if __name__ == "__main__":
    main()
