"""What the advice leads to at desks that nobody fitted on: who is helped, and who is wronged.

python benchmarks/desks.py

desks.jsonl has three desks with five goals and eight people each, written by a language model in
invented voices, without sight of the code or a corpus. A person says one to four things; "from" is
the first after which a careful clerk would act, and null for never.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

from goalscope import GoalTracker, open_model
from goalscope.belief.advice import advice
from goalscope.models.opening import ModelSet

DESKS = [json.loads(line) for line in Path(__file__).with_suffix(".jsonl").open(encoding="utf-8")]


def outcome(model: ModelSet, desk: dict[str, Any], dialogue: dict[str, Any]) -> str:
    """What the first advice to act comes to; "" where none is given."""
    tracker = GoalTracker(model, task=desk["task"], goals=desk["goals"])
    for number, words in enumerate(dialogue["turns"], 1):
        tracker.observe("How can I help you?" if number == 1 else "Go on.", words)
        if advice(tracker) == "act":
            goal = desk["goals"].index(tracker.belief.top(1)[0][0].text)
            if goal != dialogue["goal"]:
                return "wrong"
            return "right" if number >= (dialogue["from"] or 99) else "right, early"
    return "not needed" if dialogue["goal"] is None else "asked on"


def main() -> None:
    """Print a line for each desk."""
    model = open_model()
    names = ("right", "right, early", "wrong", "asked on", "not needed")
    print(f"{'desk':28}" + "".join(f"{name:>14}" for name in names))
    for desk in DESKS:
        counts = Counter(outcome(model, desk, each) for each in desk["dialogues"])
        print(f"{desk['desk']:28}" + "".join(f"{counts[name]:14}" for name in names))


if __name__ == "__main__":
    main()
