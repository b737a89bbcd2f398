"""Floats of what texts mean, from the static word embeddings that come with WordLlama."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from goalscope.base.arrays import Floats


def embedded(texts: Sequence[str]) -> Floats:
    """[N, 256] vectors of length one, zero for no known word; case does not count."""
    return unit(summed(texts))


def unit(vectors: Floats) -> Floats:
    """The same directions, of length one; zero stays zero."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return (vectors / np.where(lengths > 0, lengths, 1)).astype(np.float32)


def summed(texts: Sequence[str]) -> Floats:
    """[N, 256] sums of the vectors of each text's tokens; no token holds parts of two words."""
    tokenizer, table = _embeddings()
    whole = (text.encode(errors="replace").decode() for text in texts)  # no lone surrogates
    rows = [text.lower().split() or ["?"] for text in whole]
    words = {word: number for number, word in enumerate(dict.fromkeys(chain(*rows)))}
    encoded = tokenizer.encode_batch_fast([*words], add_special_tokens=False)
    ids = [each.ids for each in encoded]
    return group_sums(group_sums(table, ids), [[words[word] for word in row] for row in rows])


def group_sums(vectors: Floats, groups: Sequence[Sequence[int]]) -> Floats:
    """The sum of each group of rows, named by their numbers."""
    sums = np.zeros((len(groups), vectors.shape[1]), np.float32)
    for total, group in zip(sums, groups, strict=True):
        if group:
            vectors[group].sum(axis=0, out=total)
    return sums


@cache
def _embeddings() -> tuple[Any, Floats]:
    """WordLlama's tokenizer and table; importing it would set up logging for the whole program."""
    import safetensors.numpy
    from tokenizers import Tokenizer

    package = find_spec("wordllama")
    folder = Path(package.origin or "").parent if package else Path()
    tokenizer = Tokenizer.from_file(str(folder / "tokenizers/l2_supercat_tokenizer_config.json"))
    weights = (folder / "weights/l2_supercat_256.safetensors").read_bytes()
    return tokenizer, safetensors.numpy.load(weights)["embedding.weight"].astype(np.float32)
