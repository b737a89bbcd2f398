"""Many people on the page at once, over the small model of the tests: errors, mixing and latency.

PYTHONPATH=tests python benchmarks/load.py [PEOPLE] [ROUNDS] [THINKING]

Everybody thinks before each round, up to so many seconds (5); with `50 19 60` it takes ten minutes.
"""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import random
import sys
import threading
import time
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryDirectory

import httpx
import numpy as np
import uvicorn

from sites import Person, site

PAGE = 4096
"""Bytes of a page of memory."""


def serve(store: Path, pipe: Connection) -> None:
    """Run the server until something is sent; then tell how late its event loop ever was."""
    ticks: list[float] = []

    class Watched(uvicorn.Server):
        async def on_tick(self, counter: int) -> bool:  # by itself every 0.1 s
            ticks.append(time.monotonic())
            return await super().on_tick(counter)

    uvicorn.Server = Watched  # type: ignore[misc]
    with site(store) as address:
        pipe.send(address)
        pipe.recv()
    pipe.send(np.diff(ticks) - 0.1)


def memory_of(process: int, readings: list[int], end: threading.Event) -> None:
    """Read its resident memory every second, in bytes."""
    while not end.wait(1):
        readings.append(int(Path(f"/proc/{process}/statm").read_text().split()[1]) * PAGE)


def listen(person: Person, episode: str, heard: SimpleQueue[dict]) -> None:
    """Pass on how the episode stands, as long as the person is there."""
    with contextlib.suppress(httpx.HTTPError, RuntimeError):
        for kind, data in person.events(episode):
            if kind == "live":
                heard.put(data)


def chat(
    person: Person, number: int, rounds: int, pause: float, took: list[float], wrong: list[str]
) -> None:
    """One person's episode: each request is timed, and at the end nobody else's words are there."""
    thinking = random.Random(number)

    def timed(ask, *given, **named):
        start = time.perf_counter()
        answer = ask(*given, **named)
        took.append(time.perf_counter() - start)
        return answer

    try:
        timed(person.http.get, "/").raise_for_status()
        mine = timed(person.begin)
        heard: SimpleQueue[dict] = SimpleQueue()
        threading.Thread(target=listen, args=(person, mine, heard), daemon=True).start()
        for round in range(1, rounds + 1):
            time.sleep(thinking.uniform(min(1, pause), pause))
            text = f"I am person canary{number:03} and need flour for round {round}."
            timed(person.post, f"{mine}/utterances", 202, text=text, round=round)
            live = heard.get(timeout=60)
            while live["phase"] != "idle" or live["round"] <= round:
                if live["error"]:
                    wrong.append(f"person {number}: {live['error']}")
                live = heard.get(timeout=60)
        timed(person.get, mine)
        text = person.http.get(f"{mine}/export.json").text
        others = [n for n in range(1000) if n != number and f"canary{n:03}" in text]
        if others or text.count(f"canary{number:03}") < rounds:
            wrong.append(f"person {number} reads the words of {others}, or misses their own")
    except Exception as error:
        wrong.append(f"person {number}: {error!r}")
    finally:
        person.http.close()


def main() -> None:
    """Print what was measured."""
    logging.getLogger().setLevel(logging.WARNING)  # a library's own setting tells of each request
    given = (*sys.argv[1:], *("50", "3", "5")[len(sys.argv) - 1 :])
    people, rounds, pause = int(given[0]), int(given[1]), float(given[2])
    took: list[float] = []
    wrong: list[str] = []
    with TemporaryDirectory() as folder:
        here, there = multiprocessing.Pipe()
        server = multiprocessing.Process(target=serve, args=(Path(folder) / "episodes.db", there))
        server.start()
        address = here.recv()
        memory, over = list[int](), threading.Event()
        watching = threading.Thread(target=memory_of, args=(server.pid, memory, over))
        watching.start()
        browsers = [Person(address) for _ in range(people)]  # slow to make, which is not timed
        start = time.perf_counter()
        threads = [
            threading.Thread(target=chat, args=(person, number, rounds, pause, took, wrong))
            for number, person in enumerate(browsers)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        seconds = time.perf_counter() - start
        over.set()
        watching.join()
        here.send("end")
        late = here.recv()
        server.join()
    half, most, longest = np.quantile(took, [0.5, 0.95, 1.0]) * 1000
    print(f"{people} people, {rounds} rounds each, {len(took)} requests in {seconds:.1f} s")
    print(f"latency: median {half:.0f} ms, 95 % within {most:.0f} ms, longest {longest:.0f} ms")
    third = max(1, len(memory) // 3)
    before, after = (
        np.median(part) / 2**20 for part in (memory[third : 2 * third], memory[-third:])
    )
    print(f"memory: {before:.0f} MiB in the second third, {after:.0f} MiB in the last one")
    print(f"event loop: {len(late)} readings, {(late > 0.25).sum()} over 250 ms late, the latest "
          f"{1000 * late.max():.0f} ms")  # fmt: skip
    print(f"errors and mixing: {len(wrong)}", *wrong[:5], sep="\n  ")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
