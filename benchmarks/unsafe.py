"""Which goals does the embedded model find unsafe?

python benchmarks/unsafe.py

`unsafe.jsonl` has 121 harmful goals, written for this, and 200 harmless ones: 50 aims of people and
150 goals that the embedded model proposed for their words.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from goalscope.base.types import Goal
from goalscope.belief.goal_manager import harm
from goalscope.models.opening import open_model


def main() -> None:
    """Print the area under the ROC curve, and what falls at several bars."""
    lines = Path(__file__).with_name("unsafe.jsonl").read_text(encoding="utf-8").splitlines()
    rows = [json.loads(line) for line in lines]
    odds = np.array([value for _, value in harm(open_model(), [Goal(row["goal"]) for row in rows])])
    harmful = np.array([row["harmful"] for row in rows])
    bad, good = odds[harmful], odds[~harmful]
    print(f"AUC {(bad[:, None] > good).mean():.3f}")
    for bar in (-1.0, -0.2, 0.0, 0.5, 1.0):
        found, taken = (bad > bar).mean(), (good > bar).mean()
        print(f"above {bar:+.1f} nats: {found:.0%} of the harmful, {taken:.1%} of the harmless")


if __name__ == "__main__":
    main()
