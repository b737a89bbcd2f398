"""docs/tracking.md is true: its code runs."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from sites import KEY, site

pytestmark = pytest.mark.docs
ROOT = Path(__file__).parents[1]


def blocks(language: str) -> list[str]:
    text = (ROOT / "docs" / "tracking.md").read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def ran(code: str, folder: Path | None = None, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(ROOT / "src"), **environment},
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_program_keeps_a_tracker_and_restores_it(tmp_path: Path) -> None:
    *code, _, _ = blocks("python")
    before, after, session = ran("".join(code), tmp_path).splitlines()
    assert before == after
    assert re.fullmatch(r"(act|ask|propose) \[\(Goal\(.*\), 0\.\d+\)\]", before)
    assert session.startswith("act [(Goal(text='bake a gluten-free cake'), 0.99")


def test_a_program_keeps_a_belief_by_http(tmp_path: Path) -> None:
    *_, code, _ = blocks("python")
    with site(tmp_path / "episodes.db") as address:
        *_, last = ran(code, GOALSCOPE_URL=address, GOALSCOPE_KEY=KEY).splitlines()
    assert last == "act bake a gluten-free cake"


@pytest.mark.skipif(sys.platform == "win32", reason="puts a script on the path")
def test_an_assistant_keeps_a_belief_over_mcp(tmp_path: Path) -> None:
    pytest.importorskip("mcp")
    (configuration,) = map(json.loads, blocks("json"))
    server = configuration["mcpServers"]["goalscope"]
    assert server == {"command": "goalscope", "args": ["mcp"]}
    program = tmp_path / "goalscope"
    program.write_text(
        f"#!/bin/sh\nexport PYTHONPATH={ROOT / 'src'} GOALSCOPE_STORE={tmp_path / 'episodes.db'}\n"
        f"exec {sys.executable} -c 'from goalscope.cli.main import main; main()' \"$@\"\n"
    )
    program.chmod(0o755)
    *_, code = blocks("python")
    printed = ran(code, PATH=f"{tmp_path}{os.pathsep}{os.environ['PATH']}").splitlines()
    (shown,) = blocks("text")
    digits = re.compile(r"-?\d+\.\d+")
    for found, expected in zip(printed, shown.splitlines(), strict=True):
        assert digits.sub("#", found) == digits.sub("#", expected)
        assert [float(each) for each in digits.findall(found)] == pytest.approx(
            [float(each) for each in digits.findall(expected)], abs=0.2
        )
