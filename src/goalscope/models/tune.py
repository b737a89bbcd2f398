"""Faster weights for this machine: small quantised models often run faster requantised to BF16."""

from __future__ import annotations

import hashlib
import os
import tempfile
import time
from pathlib import Path

import platformdirs

from goalscope.models.native import KVCache, Weights, bindings
from goalscope.models.sampling import log_prob
from goalscope.models.trie import Trie
from goalscope.types import ModelError

__all__ = ["faster_weights", "prompt_seconds", "requantize"]

_LARGEST = 500_000_000  # bytes of the file: beyond, the copy's size outweighs its speed


def faster_weights(source: Path, threads: int) -> Weights:
    """Load `source`, or a BF16 copy of it if that reads prompts faster on this machine.

    The first call for a file below 0.5 GB makes the copy in the user's cache folder and times both;
    later calls remember the choice. `GOALSCOPE_TUNE=0` turns this off.

    Raises:
        ModelError: `source` is missing or is no complete GGUF model.
    """
    if os.environ.get("GOALSCOPE_TUNE") == "0" or not _is_small(source):
        return Weights(source)
    status = source.stat()
    identity = f"{source.resolve()} {status.st_size} {status.st_mtime_ns}"
    key = f"{source.stem}-{hashlib.sha256(identity.encode()).hexdigest()[:12]}"
    folder = platformdirs.user_cache_path("goalscope")
    copy, kept = folder / f"{key}-BF16.gguf", folder / f"{key}-original"
    if copy.exists():
        try:
            return Weights(copy)
        except ModelError:
            copy.unlink(missing_ok=True)
    original = Weights(source)
    if kept.exists() or original.type_name in {"BF16", "F16", "all F32"}:
        return original
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return _try_copy(original, copy, kept, threads)
    except (OSError, ModelError):
        return original


def requantize(source: Path, target: Path, ftype: int) -> None:
    """Write `source` to `target` with all its matrices of one type.

    Args:
        source: A GGUF file.
        target: The GGUF file to write.
        ftype: A `LLAMA_FTYPE_...` number of llama.cpp.

    Raises:
        OSError: The file cannot be written.
        ModelError: llama.cpp could not convert the file.
    """
    lib = bindings()
    params = lib.llama_model_quantize_default_params()
    params.ftype = ftype
    params.allow_requantize = True
    params.pure = True
    if lib.llama_model_quantize(os.fsencode(source), os.fsencode(target), params) != 0:
        raise ModelError(f"{source} could not be converted.")


def _try_copy(original: Weights, copy: Path, kept: Path, threads: int) -> Weights:
    """The copy only gets its name once it has proved faster."""
    with tempfile.TemporaryDirectory(dir=copy.parent, prefix=".requantize-") as folder:
        part = Path(folder, "model.gguf")
        requantize(original.path, part, bindings().LLAMA_FTYPE_MOSTLY_BF16)
        trial = Weights(part)
        is_faster = prompt_seconds(trial, threads) < prompt_seconds(original, threads)
        trial.free()
        if not is_faster:
            kept.touch()
            return original
        os.replace(part, copy)
    original.free()
    return Weights(copy)


def prompt_seconds(weights: Weights, threads: int, tokens: int = 256, *, scored: int = 0) -> float:
    """Shortest of two times to read a prompt of so many tokens, after one to warm up.

    The next-token logits of the last `scored` tokens are computed, and looked at.
    """
    cache, trie = KVCache(weights, threads), Trie()
    times: list[float] = []
    trie.add([1000 + i % 1000 for i in range(tokens)])
    try:
        for _ in range(3):
            cache.clear()
            start = time.perf_counter()
            cache.load(
                trie, set(range(tokens - scored, tokens)), lambda node, row: log_prob(row, 0)
            )
            times.append(time.perf_counter() - start)
    finally:
        cache.free()
    return min(times[1:])


def _is_small(source: Path) -> bool:
    return source.is_file() and source.stat().st_size < _LARGEST
