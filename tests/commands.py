"""The command line of `goalscope`, run in this process.

`result = run("infer", file, "--out", out, input="")` has `exit_code`, `stdout` and `stderr`, and
`fails(2, "replay", "x")` returns the one line of a refusal. See also the fixtures in conftest.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from unittest.mock import patch

from click.testing import Result
from typer.testing import CliRunner

from goalscope.cli.main import app
from goalscope.storage.store import EpisodeInfo, Store

PROFILES = """
[[profile]]
name = "baker"
description = "You want to bake a chocolate cake."
replies = ["I need cocoa powder to bake a cake.", "And milk."]
checks = [{must_have = ["cocoa"]}]
"""
ROW = {
    "id": "a",
    "task": "You sell groceries.",
    "turns": [
        {"query": "What can I do?", "utterance": "I need flour and cocoa."},
        {"query": "", "utterance": "And candles for the cake."},
    ],
    "goals": ["bake a chocolate cake", "wash the car"],
    "ignored": 1,
}


def run(*args: object, input: str = "", env: Mapping[str, str] | None = None) -> Result:
    """Run a command; an error that is not one of goalscope's fails the test."""
    words = [os.path.expanduser(str(arg)) for arg in args]
    with (
        patch.object(sys, "argv", ["goalscope", *words]),
        patch.dict(os.environ, env or {}),
    ):
        return CliRunner().invoke(app, words, input=input, catch_exceptions=False)


def fails(code: int, *args: object) -> str:
    """The one line that a command which must fail prints to standard error."""
    result = run(*args)
    assert result.exit_code == code, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    (line,) = result.stderr.strip().splitlines()
    return line


def only_episode(file: Path | None = None) -> EpisodeInfo:
    """The one episode of a store."""
    with Store.open(file) as store:
        (info,) = store.episodes()
        return info


def rows_file(tmp_path: Path, *rows: object) -> Path:
    """A file of dialogues, one a line; texts are written as they are."""
    file = tmp_path / "rows.jsonl"
    file.write_text("".join((r if isinstance(r, str) else json.dumps(r)) + "\n" for r in rows))
    return file
