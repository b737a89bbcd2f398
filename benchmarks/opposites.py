"""How often a sentence that asks for the opposite of a goal would be acted on as the goal.

python benchmarks/opposites.py

Each of the 120 goals in opposites.jsonl stands beside four of its neighbours there; the sentences
are first words. Half "a" was looked at when the lists of `cues` were made, half "b"
was not.
"""

from __future__ import annotations

import json
from pathlib import Path
from unittest.mock import patch

from goalscope import GoalTracker, open_model
from goalscope.belief.advice import SURE, advice

ROWS = [json.loads(line) for line in Path(__file__).with_suffix(".jsonl").open(encoding="utf-8")]


def main() -> None:
    """Print, for each half and kind of sentence, how many are sure, and how many are acted on."""
    model = open_model()
    print("half  asks for      n  sure  acted on  without the lists")
    for half in ("a", "b"):
        for kind in ("opposite", "same"):
            sure = acted = bare = 0
            for place, row in enumerate(ROWS):
                if row["half"] != half:
                    continue
                near = [ROWS[n]["goal"] for n in range(place - 3, place + 4) if 0 <= n < len(ROWS)]
                goals = [row["goal"], *(each for each in near if each != row["goal"])][:5]
                tracker = GoalTracker(model, task="Help the user.", goals=goals)
                tracker.observe("How can I help you?", row[kind])
                (goal, probability), *_ = tracker.belief.top(1)
                if goal.text != row["goal"] or probability < SURE:
                    continue
                sure += 1
                acted += advice(tracker) == "act"
                with patch("goalscope.language.cues.opposes", return_value=False):
                    bare += advice(tracker) == "act"
            n = sum(row["half"] == half for row in ROWS)
            print(f"{half:4}  {kind:9} {n:5} {sure:5} {acted:9} {bare:18}")


if __name__ == "__main__":
    main()
