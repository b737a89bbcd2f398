"""A fuzzer guided by what it reaches in the readers of `entries.py`; needs atheris.

PYTHONPATH=tests:tests/reliability python tests/reliability/fuzz.py [SECONDS] [NAME...]

Each reader is fuzzed for so many seconds (60), in a process of its own. What raises anything but
an error of goalscope's is printed with its traceback, and kept as `crash-...` in this folder.
"""

from __future__ import annotations

import multiprocessing
import sys
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import atheris

WORDS = (
    *'{}[]:,"=;',
    "\n",
    "\t",
    "\0",
    "null",
    "true",
    "1e999",
    "NaN",
    "-1",
    "\\ud800",
    "[[",
    "- ",
)
"""What text of all these forms is made of."""


def fuzz(name: str, seconds: int) -> None:
    """Fuzz one reader, and end the process."""
    with atheris.instrument_imports(include=["goalscope"]):
        from entries import ENTRIES

        from goalscope.base.types import GoalscopeError
    read, samples = ENTRIES[name]

    def one(data: bytes) -> None:
        with suppress(GoalscopeError):
            read(data)

    with TemporaryDirectory() as folder:
        corpus, words = Path(folder, "corpus"), Path(folder, "words")
        corpus.mkdir()
        for number, sample in enumerate(samples):
            (corpus / str(number)).write_bytes(sample)
        coded = ("".join(f"\\x{byte:02x}" for byte in each.encode()) for each in WORDS)
        words.write_text("".join(f'"{each}"\n' for each in coded))
        options = (f"-max_total_time={seconds}", f"-dict={words}", "-max_len=4096", "-timeout=20",
                   "-rss_limit_mb=0", "-print_final_stats=1", "-verbosity=0")  # fmt: skip
        atheris.Setup([sys.argv[0], *options, str(corpus)], one)
        atheris.Fuzz()


def main() -> None:
    """Fuzz each reader; the exit code tells whether any failed."""
    seconds = int(sys.argv[1]) if sys.argv[1:] else 60
    failed = []
    spawn = multiprocessing.get_context("spawn")
    for name in sys.argv[2:] or names():
        print(f"--- {name}", flush=True)
        process = spawn.Process(target=fuzz, args=(name, seconds))
        process.start()
        process.join()
        failed += [name] if process.exitcode else []
    print("failed:", ", ".join(failed) or "none")
    sys.exit(bool(failed))


def names() -> list[str]:
    """All readers."""
    from entries import ENTRIES

    return list(ENTRIES)


if __name__ == "__main__":
    main()
