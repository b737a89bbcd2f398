"""`goalscope` in a process of its own, over the small honest model in place of the real one."""

import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
START = """
import sys
from contextlib import nullcontext
import goalscope.cli.terminal
from fakes import WordModel
from goalscope.cli.main import main

class Loud(WordModel):
    def token_logprobs(self, *given, **more):
        print("a stray word")
        return super().token_logprobs(*given, **more)

goalscope.cli.terminal.opened_model = lambda *given, **more: nullcontext(Loud())
main()
"""


def arguments(*words: str) -> list[str]:
    """The command line of `goalscope WORDS`."""
    return [sys.executable, "-c", START, *words]


def environment(**more: str) -> dict[str, str]:
    path = os.pathsep.join(str(each) for each in (HERE.parent / "src", HERE))
    return {**os.environ, "PYTHONPATH": path, **more}


def started(*words: str, **more: str) -> subprocess.Popen[str]:
    pipe = subprocess.PIPE
    return subprocess.Popen(
        arguments(*words), stdin=pipe, stdout=pipe, text=True, env=environment(**more)
    )
