"""Fit the adapter that writes: python training/fit_writer.py [--out DIR] [--device cuda].

It proposes goals, names what they need, and asks. Recipes are used if GOALSCOPE_DATA has them.
"""

import os
from pathlib import Path

from command import run
from writing import WritingSettings

RECIPES = Path(os.environ.get("GOALSCOPE_DATA", "."), "grocery", "recipes_dev.jsonl.gz")

if __name__ == "__main__":
    run(
        "writer",
        [
            Path("src/goalscope/envs/scenarios"),
            Path("corpus/talks/train"),
            *([RECIPES] if RECIPES.exists() else []),
        ],
        WritingSettings(epochs=4),
        validate=[Path("corpus/needs/dev"), Path("corpus/talks/dev")],
        domains=["grocery", "house"],
    )
