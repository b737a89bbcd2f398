"""Fit the adapter that reads: python training/fit_reader.py [--out DIR] [--device cuda]."""

from pathlib import Path

from command import run
from writing import WritingSettings

CORPUS = Path("corpus/reading")
OTHERS = CORPUS / "others"

if __name__ == "__main__":
    run(
        "reader",
        [CORPUS / "train", OTHERS / "train"],
        WritingSettings(rank=16, epochs=3),
        validate=[CORPUS / "dev"],
        domains=["grocery", "house", str(OTHERS / "verbs.toml")],
    )
