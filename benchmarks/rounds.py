"""Where does the time of a round go?

python benchmarks/rounds.py [DOMAIN ...]

Scripted people (the profiles that come with a domain) talk with the agent by the embedded model.
For each part of a round it tells seconds: the median of the rounds that have it, the mean of all
rounds, and the longest.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import defaultdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from goalscope.agent.settings import Settings
from goalscope.envs.registry import BUILT_IN, open_environment, profiles_of
from goalscope.models.opening import open_model
from goalscope.storage.session import Session
from goalscope.storage.store import Store

STORE = "storing"


class Clock:
    """Seconds of each part of the present round."""

    def __init__(self) -> None:
        self.parts: defaultdict[str, float] = defaultdict(float)
        self._part, self._since = "", time.perf_counter()

    def __call__(self, part: str) -> None:
        """A part begins."""
        now = time.perf_counter()
        if self._part:
            self.parts[self._part] += now - self._since
        self._part, self._since = "scoring" if part.startswith("scoring") else part, now

    def round(self) -> dict[str, float]:
        """The round is over."""
        self("")
        parts, self.parts = dict(self.parts), defaultdict(float)
        return parts


class Timed(Store):
    """A store that tells when it begins to write."""

    clock: Clock

    def append(self, *args: Any, **options: Any) -> None:
        """See `Store.append`."""
        self.clock(STORE)
        super().append(*args, **options)


def main() -> None:
    """Print a table for each domain."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("domains", nargs="*", default=BUILT_IN)
    model = open_model()
    print(f"embedded model, {model.speaker.describe()}")
    for domain in parser.parse_args().domains:
        if domain not in BUILT_IN:
            parser.error(f"there is no domain {domain}")
        rounds: list[dict[str, float]] = []
        with TemporaryDirectory() as folder, Timed.open(Path(folder, "store.db")) as store:
            settings = Settings(domain=domain, human="scripted", seed=1)
            for person in profiles_of(settings):
                store.clock = clock = Clock()
                env = open_environment(settings, person)
                session = Session(store, settings, env, model, profile=person.name, progress=clock)
                rounds += [clock.round() for _ in session.run()]
        print(f"\n{domain}: {len(rounds)} rounds\n")
        print("| part | rounds with it | median | mean of all | longest |\n|---|---|---|---|---|")
        for part in dict.fromkeys(name for each in rounds for name in each):
            _tell(part, [each[part] for each in rounds if part in each], len(rounds))
        _tell("whole round", [sum(each.values()) for each in rounds], len(rounds))


def _tell(part: str, seconds: list[float], rounds: int) -> None:
    median, mean = statistics.median(seconds), sum(seconds) / rounds
    print(f"| {part} | {len(seconds)} | {median:.2f} | {mean:.2f} | {max(seconds):.2f} |")


if __name__ == "__main__":
    main()
