"""Tuning: measure once how a model file runs fastest on this machine, and cache the result."""

from __future__ import annotations

import hashlib
import json
import logging
import math
import os
import platform
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock

from goalscope.base.types import ModelError
from goalscope.base.user_dirs import user_cache
from goalscope.models import Array
from goalscope.models.llama.copies import requantize
from goalscope.models.llama.engine import engine
from goalscope.models.llama.native import DOWNLOAD_AGAIN, KVCache, Running, Weights
from goalscope.models.llama.sampling import log_prob
from goalscope.models.llama.trie import Trie

__all__ = [
    "Trial",
    "Tuning",
    "kept_tunings",
    "processor",
    "prompt_seconds",
    "split_files",
    "tune",
    "tuned",
    "waits",
]

Report = Callable[[str, float], object]
"""Called with the current step and the share of the work done, from 0 to 1."""

log = logging.getLogger(__name__)

_LARGEST = 500_000_000  # bytes: larger files are tuned only when asked, since it takes minutes
_TOKENS = 128  # of the prompt that is timed
_TYPES = ("BF16", "F16", "Q8_0")
_LOSS = 0.002  # nats a token by which a faster type may be farther from exact than the file itself
_TEXT = (
    "Good morning! I'd like to bake a cake for Sunday, but my sister can't eat gluten, and the "
    "children want chocolate. What flour could I use, and how much sugar do I need for twelve "
    "people? We have 6 eggs, some butter and a litre of milk at home. Could you also look for "
    "candles? The red ones were sold out last week (about £2.50 a box). Thank you very much."
)


@dataclass(frozen=True, slots=True)
class Trial:
    """One type of weights, tried on this machine.

    Attributes:
        weights: The type, such as "BF16".
        speed: Prompt tokens a second.
        error: Mean distance in nats of a token's log-probability from exact arithmetic on the
            file's weights.
    """

    weights: str
    speed: float
    error: float


@dataclass(frozen=True, slots=True)
class Tuning:
    """How to run one model file on this machine.

    Attributes:
        source: The model file.
        path: The file to load: `source`, or a copy with its weights in another type.
        threads: Most threads that were allowed.
        running: How it runs fastest.
        trials: What was measured; empty if nothing was.
    """

    source: Path
    path: Path
    threads: int
    running: Running
    trials: tuple[Trial, ...] = ()

    @property
    def chosen(self) -> Trial | None:
        """The trial of the weights that are loaded; None if nothing was measured."""
        kept = [trial for trial in self.trials if self.path.stem.endswith(f"-{trial.weights}")]
        return (*kept, *self.trials, None)[0]


def tuned(source: Path, threads: int, report: Report | None = None, measure: bool = True) -> Tuning:
    """The cached tuning of a file, a new one for files below 0.5 GB, or the default.

    `GOALSCOPE_TUNE=0` turns all of it off.

    A file that cannot be tuned, or that another process is tuning, is used as it is; without
    `measure`, so is one that was not tuned yet.
    """
    plain = Tuning(source, source, threads, Running(threads))
    if not _tunable(source):
        return plain
    kept = _kept(source, threads)
    if kept is not None:
        return kept
    if not measure or source.stat().st_size >= _LARGEST:
        return plain
    try:
        return tune(source, threads, report)
    except (OSError, ModelError):
        return plain


def waits(source: Path, threads: int) -> bool:
    """Whether `tuned` would take a minute to measure this file."""
    small = _tunable(source) and source.stat().st_size < _LARGEST
    return small and _kept(source, threads) is None


def _tunable(source: Path) -> bool:
    off = os.environ.get("GOALSCOPE_TUNE") == "0"
    return not off and os.path.isfile(source) and len(split_files(source)) == 1


def tune(source: Path, threads: int, report: Report | None = None) -> Tuning:
    """Measure how `source` runs fastest, and save the result in the user's cache folder.

    The weights are tried as they are and as BF16, F16 and Q8_0; a type that is farther from exact
    arithmetic (F32) than the file itself is left out. Then half of the threads are tried, and kept
    where that is faster. (The KV cache is always F16: llama.cpp computes F32 keys and values as
    F16, and smaller types are slower and less exact, see docs/log.md.) Without a `report`, a
    warning is logged that this takes a while.

    The answer holds for every file of the same content, and a copy of its weights serves all; what
    was kept for older versions of the engine is deleted.

    Raises:
        ModelError: `source` is no complete GGUF model, or damaged, or cannot be converted.
        OSError: The cache folder cannot be written, the disk is full, or another process tunes.
    """
    folder = _folder()
    if len(split_files(source)) > 1:
        raise ModelError(f"{source} has several parts, and only single files can be tuned.")
    Weights(source).free()  # what is no model is refused before a minute of work is announced
    source = source.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    with (
        FileLock(folder / ".lock", blocking=False),
        tempfile.TemporaryDirectory(dir=folder, prefix=".tune-") as work,
    ):
        for left in set(folder.glob(".tune-*")) - {Path(work)}:  # by a killed process
            shutil.rmtree(left, ignore_errors=True)
        if report is None:
            log.warning(
                "Measuring how %s runs fastest on this machine, once; this takes up to a "
                "minute. GOALSCOPE_TUNE=0 turns it off.",
                source.name,
            )
            report = _ignored
        files, trials = _try_types(source, Path(work), Running(threads), report)
        if not math.isfinite(trials[0].error):
            raise ModelError(
                f"{source} is damaged: its weights do not produce log-probabilities. "
                f"{DOWNLOAD_AGAIN}"
            )
        bound = trials[0].error + _LOSS
        best = max((t for t in trials if t.error <= bound), key=lambda trial: trial.speed)
        running = _try_threads(files[best.weights], Running(threads), report)
        digest = _digest(source)
        path = source
        if files[best.weights] != source:
            path = folder / f"{source.stem}-{digest[:12]}-{best.weights}.gguf"
            try:
                os.replace(files[best.weights], path)
            except PermissionError:  # on some systems, where the same copy is in use
                if not path.is_file():
                    raise
        result = Tuning(source, path, threads, running, tuple(trials))
        _keep(result, digest)
        _forget_others()
    return result


def kept_tunings() -> list[Tuning]:
    """All that were kept for files that are here, with this processor and engine."""
    return [
        tuning
        for record in _records().values()
        if (record.engine, record.processor) == (engine().name, processor())
        for source, stamp in record.seen.items()
        if _stamp(Path(source)) == stamp and (tuning := record.tuning(Path(source)))
    ]


def split_files(path: Path) -> list[Path]:
    """The files of a model: one, or all of NAME-00001-of-00009.gguf and so on."""
    match = re.fullmatch(r"(.*)-\d{5}-of-(\d{5})\.gguf", path.name)
    if not match:
        return [path]
    name, count = match.groups()
    return [path.with_name(f"{name}-{i:05}-of-{count}.gguf") for i in range(1, int(count) + 1)]


def prompt_seconds(
    weights: Weights,
    running: Running,
    tokens: int = 256,
    *,
    scored: int = 0,
    hopeless: float = math.inf,
) -> float:
    """Shortest of two times to read a prompt of so many tokens, after one to warm up.

    The next-token logits of the last `scored` tokens are computed and read. A first time above
    `hopeless` seconds is returned at once.
    """
    cache, trie = KVCache(weights, running), Trie()
    times: list[float] = []
    trie.add([(1000 + i % 1000) % weights.vocab_size for i in range(tokens)])
    wanted = set(range(tokens - scored, tokens))
    try:
        while len(times) < 3 and (not times or times[0] < hopeless):
            cache.clear()
            start = time.perf_counter()
            cache.load(trie, wanted, lambda node, row: log_prob(row, 0))
            times.append(time.perf_counter() - start)
    finally:
        cache.free()
    return min(times[1:] or times)


def _ignored(step: str, share: float) -> None: ...


def _try_types(
    source: Path, folder: Path, running: Running, report: Report
) -> tuple[dict[str, Path], list[Trial]]:
    """A file for each type of weights, and its trial; the source's own comes first."""
    with _loaded(source) as weights:
        own = weights.type_name
    report("exact arithmetic", 0.0)
    exact = folder / "exact.gguf"
    requantize(source, exact, "F32")
    with _loaded(exact) as weights:
        reference = _token_logprobs(weights, running)
    exact.unlink()
    files, trials = {own: source}, list[Trial]()
    files |= {name: folder / f"{name}.gguf" for name in _TYPES if name != own}
    for number, (name, file) in enumerate(files.items(), 1):
        report(f"{name} weights", 0.1 + 0.15 * number)
        if file != source:
            requantize(source, file, name)
        with _loaded(file) as weights:
            error = float(np.abs(_token_logprobs(weights, running) - reference).mean())
            hopeless = 2 * _TOKENS / max((trial.speed for trial in trials), default=1)
            seconds = prompt_seconds(weights, running, _TOKENS, scored=16, hopeless=hopeless)
            trials.append(Trial(name, _TOKENS / seconds, error))
    return files, trials


def _try_threads(file: Path, running: Running, report: Report) -> Running:
    """Half of the threads: only if clearly faster, twice."""
    half = replace(running, threads=max(1, running.threads // 2))
    report(f"{half.threads} threads", 0.8)
    with _loaded(file) as weights:
        better = half != running and all(_is_faster(weights, half, running) for _ in range(2))
    report("done", 1.0)
    return half if better else running


def _is_faster(weights: Weights, other: Running, running: Running) -> bool:
    """Whether `other` takes at least 5 % less time to read and score 512 tokens."""
    seconds = prompt_seconds(weights, running, 512, scored=64)
    limit = 0.95 * seconds
    return prompt_seconds(weights, other, 512, scored=64, hopeless=1.2 * seconds) < limit


@contextmanager
def _loaded(path: Path) -> Generator[Weights]:
    """Weights for the length of a `with` block."""
    weights = Weights(path)
    try:
        yield weights
    finally:
        weights.free()


def _token_logprobs(weights: Weights, running: Running) -> Array:
    """Log-probability of each token of a text after the first, [N - 1] in nats."""
    tokens = weights.tokenize(_TEXT, markup=False)
    cache, trie, found = KVCache(weights, running), Trie(), dict[int, float]()
    trie.add(tokens[:-1])

    def read(node: int, row: Any) -> None:
        found[node] = log_prob(row, tokens[node + 1])

    try:
        cache.load(trie, set(range(len(trie))), read)
    finally:
        cache.free()
    return np.array([found[node] for node in sorted(found)])


@dataclass(frozen=True, slots=True)
class _Record:
    """What is kept of a tuning, for all files of one content.

    Attributes:
        digest: Of the content.
        engine: The engine that it was found with, and its version.
        processor: The processor that it was found on.
        threads: See `Tuning`.
        seen: Where files of this content are, and their stamps.
        copy: Name of the copy to load, if any.
        running: See `Tuning`.
        trials: See `Tuning`.
    """

    digest: str
    engine: str
    processor: str
    threads: int
    seen: dict[str, str]
    copy: str | None
    running: Running
    trials: tuple[Trial, ...]

    def tuning(self, source: Path) -> Tuning | None:
        """What it says of a source; None if the copy is lost."""
        path = _folder() / self.copy if self.copy else source
        if not path.is_file():
            return None
        return Tuning(source, path, self.threads, self.running, self.trials)

    def write(self, file: Path) -> None:
        """Write it to a file of the cache folder."""
        with tempfile.TemporaryDirectory(dir=file.parent, prefix=".tune-") as work:
            part = Path(work, file.name)
            part.write_text(json.dumps(asdict(self)), encoding="utf-8")
            os.replace(part, file)


def _folder() -> Path:
    return user_cache() / "tuned"


def _records() -> dict[Path, _Record]:
    """All records that can be read, by their files."""
    found: dict[Path, _Record] = {}
    try:
        files = sorted(_folder().glob("*.json"))
    except OSError:  # nobody may look there
        return found
    for file in files:
        with suppress(OSError, ValueError, LookupError, TypeError):
            row: Any = json.loads(file.read_text(encoding="utf-8"))
            parts: dict[str, Any] = {
                "seen": {**row["seen"]},
                "running": Running(**row["running"]),
                "trials": tuple(Trial(**trial) for trial in row["trials"]),
            }
            found[file] = _Record(**{**row, **parts})
    return found


def _digest(source: Path) -> str:
    with source.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _stamp(source: Path) -> str:
    """What changes when a file is written again; empty if there is none."""
    if not source.is_file():
        return ""
    status = source.stat()
    return f"{status.st_size} {status.st_mtime_ns}"


def _keep(tuning: Tuning, digest: str) -> None:
    record = _Record(
        digest,
        engine().name,
        processor(),
        tuning.threads,
        {str(tuning.source): _stamp(tuning.source)},
        None if tuning.path == tuning.source else tuning.path.name,
        tuning.running,
        tuning.trials,
    )
    identity = f"{record.engine}\n{record.processor}\n{record.threads}"
    machine = hashlib.sha256(identity.encode()).hexdigest()[:8]
    record.write(_folder() / f"{tuning.source.stem}-{digest[:12]}-{machine}.json")


def _kept(source: Path, threads: int) -> Tuning | None:
    """The kept tuning of a file, which is read as a whole only where another of its size was."""
    source = source.resolve()
    place, stamp = str(source), _stamp(source)
    digest = ""
    for file, record in _records().items():
        if (record.engine, record.processor, record.threads) != (
            engine().name,
            processor(),
            threads,
        ):
            continue
        if record.seen.get(place) != stamp:
            size = stamp.partition(" ")[0]
            if size not in {each.partition(" ")[0] for each in record.seen.values()}:
                continue
            digest = digest or _digest(source)
            if record.digest != digest:
                continue
            with suppress(OSError):
                replace(record, seen={**record.seen, place: stamp}).write(file)
        if tuning := record.tuning(source):
            return tuning
    return None


def _forget_others() -> None:
    """Delete records of other versions of the engine, or of no file, and copies of no record."""
    used: set[str] = set()
    known = _records()
    for file in _folder().glob("*.json"):
        record = known.get(file)
        if record and _is_current(record):
            used |= {Path(record.copy).stem} if record.copy else set()
        else:
            _delete(file)
    for copy in _folder().glob("*.gguf"):
        if not {copy.stem, copy.stem.rpartition("-with-")[0]} & used:  # perhaps with an adapter
            _delete(copy)


def _is_current(record: _Record) -> bool:
    package = engine().package.name
    outdated = record.engine != engine().name and record.engine.startswith(f"{package} ")
    return not outdated and any(os.path.isfile(source) for source in record.seen)


def _delete(file: Path) -> None:
    with suppress(OSError):  # one that is in use stays on some systems
        file.unlink()


def processor() -> str:
    """The processor's name, as the system gives it."""
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
