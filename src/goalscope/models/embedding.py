"""Vectors of what texts mean, from the static word embeddings that come with WordLlama."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import cast

import numpy as np
import numpy.typing as npt

# WordLlama tells no types.
import wordllama  # pyright: ignore[reportMissingTypeStubs]
from wordllama.inference import WordLlamaInference  # pyright: ignore[reportMissingTypeStubs]

__all__ = ["embedded"]

Vectors = npt.NDArray[np.float32]


def embedded(texts: Sequence[str]) -> Vectors:
    """[N, 256] vectors of length one, zero for no known word; case does not count."""
    embed = cast("Callable[[list[str]], Vectors]", _model().embed)  # pyright: ignore[reportUnknownMemberType]
    whole = (text.encode(errors="replace").decode() for text in texts)  # no lone surrogates
    vectors = embed([text.lower() or "?" for text in whole]).astype(np.float32)
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return (vectors / np.where(lengths > 0, lengths, 1)).astype(np.float32)


@cache
def _model() -> WordLlamaInference:
    return wordllama.WordLlama.load(
        cache_dir=Path(wordllama.__file__).parent, disable_download=True
    )
