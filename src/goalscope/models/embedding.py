"""Vectors of what texts mean, from the static word embeddings that come with WordLlama."""

from __future__ import annotations

import hashlib
import logging
import os
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from goalscope.base.user_dirs import user_cache

__all__ = ["embedded", "embedded_once"]

Vectors = npt.NDArray[np.float32]


def embedded(texts: Sequence[str]) -> Vectors:
    """[N, 256] vectors of length one, zero for no known word; case does not count."""
    embed: Callable[[list[str]], Vectors] = _model().embed
    whole = (text.encode(errors="replace").decode() for text in texts)  # no lone surrogates
    vectors = embed([text.lower() or "?" for text in whole]).astype(np.float32)
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return (vectors / np.where(lengths > 0, lengths, 1)).astype(np.float32)


def embedded_once(texts: Sequence[str]) -> Vectors:
    """The same, to 16 bits; kept in the user's cache folder, so that it is worked out only once."""
    named = "\0".join((version("wordllama"), *texts)).encode(errors="replace")
    folder = user_cache()
    file = folder / f"vectors-{hashlib.sha256(named).hexdigest()[:16]}.npy"
    with suppress(OSError, ValueError, EOFError):
        kept: Vectors = np.load(file).astype(np.float32)
        if len(kept) == len(texts):
            return kept
    vectors = embedded(texts).astype(np.float16)
    with suppress(OSError):  # a folder that cannot be written costs only time
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".vectors-") as work:
            part = Path(work, file.name)
            np.save(part, vectors)
            os.replace(part, file)
    return vectors.astype(np.float32)


@cache
def _model() -> Any:
    root = logging.getLogger()
    level, handlers = root.level, list(root.handlers)
    import wordllama  # pyright: ignore[reportMissingTypeStubs]

    root.setLevel(level)  # importing it sets up logging for the whole program
    root.handlers[:] = handlers
    return wordllama.WordLlama.load(
        cache_dir=Path(wordllama.__file__).parent, disable_download=True
    )
