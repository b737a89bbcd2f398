"""Any Hugging Face model with PyTorch, on a CPU or GPU."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import Any, Literal

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.optional_packages import package
from goalscope.base.types import Message, ModelError
from goalscope.models.adapters import read_adapter
from goalscope.models.hf_tokenizer import chat_tokenizer, tokenizer_file
from goalscope.models.llama.sampling import Logits, gguf_vocabulary
from goalscope.models.llama.trie import Trie, plant
from goalscope.models.llama.weights import Weights
from goalscope.models.local import LocalModel, synchronized
from goalscope.models.scoring import Pair
from goalscope.models.torch.network import Network
from goalscope.models.torch.packing import ROOT, PrefixStore, Row, batches, pack

Read = Callable[[list[int], Any], object]
"""Takes nodes of a tree and their next-token logits, a tensor [nodes, vocabulary]."""

_BATCH = {"cpu": 512, "mps": 1024, "cuda": 4096}  # tokens computed at once
_WIDTH = {"cpu": 512, "mps": 512, "cuda": 1024}  # of a row; attention looks over all of it
_LEAST_BATCH = 32
_KNOWN = 8  # tokens of trunks in a batch, for each token that is computed
_CACHE_BYTES = 3 << 29  # on a processor
_CACHE_SHARE = 0.5  # of a GPU's free memory
_LOGITS = 64  # rows turned into probabilities at once
_PROBE = 24  # tokens of a text that shows whether a model follows its mask
_ENGINE = ("torch", "transformers")
_MISMATCH = {"float32": 0.005}  # of the probe's logits, as a share of their spread
_MISMATCH_ROUNDED = 0.1


class Transformers(LocalModel):
    """A Hugging Face causal language model that writes and scores.

    All texts of a call form a tree of tokens. Each node is computed once, many side by side in a
    row, by an attention mask that lets it see its own ancestors alone; what was computed is kept
    for the next call. A model that does not follow such a mask (with recurrent layers, or ALiBi)
    is found out, and reads one whole text after another instead. See also `LocalModel`.

    Attributes:
        network: The model itself.
        tokens_decoded: Tokens run through the model so far.
    """

    def __init__(
        self,
        model: str | Path,
        *,
        adapter: str | Path | None = None,
        context_size: int = 4096,
        device: str | None = None,
        dtype: Literal["bfloat16", "float16", "float32"] | None = None,
        cache_bytes: int | None = None,
    ) -> None:
        """Load a model.

        Args:
            model: Its folder, its name on the Hugging Face hub, or a GGUF file.
            adapter: GGUF file of a LoRA adapter for it, as `goalscope fit` makes them.
            context_size: Most tokens of one prompt with its answer; at most what the model was
                trained on.
            device: Such as "cpu" or "cuda:1"; if None, a GPU if there is one.
            dtype: Type of the weights; if None, "float32" on a CPU and "bfloat16" on a GPU.
            cache_bytes: Maximum memory for keys and values; if None, 1.6 GB on a CPU and half of
                the free memory on a GPU.

        Raises:
            ModelError: The model is missing, damaged or not a chat model, the adapter does not fit
                it, or PyTorch is missing.
        """
        super().__init__()
        package("torch")
        self._source = Path(os.path.expanduser(model))
        self.vocabulary = None
        if self._source.suffix == ".gguf":
            self.vocabulary = Weights(self._source, vocabulary_only=True)
            self.tokenizer = self.vocabulary.chat_tokenizer
        else:
            self.tokenizer = chat_tokenizer(model)
        self._model = model
        self.network = Network(model, device, dtype)
        self.adapter = Path(adapter) if adapter is not None else None
        self.adapter_metadata: Mapping[str, str] = {}
        if self.adapter is not None:
            read = read_adapter(self.adapter, self.network.model.config)
            self.network.adapt(read)
            self.adapter_metadata = read.metadata
        self.name = self._source.stem if self.vocabulary else self._source.name
        self.context_size = min(context_size, self.network.trained_on or context_size)
        kind = self.network.device.type
        self._batch, self._width = _BATCH.get(kind, 512), _WIDTH.get(kind, 512)
        if cache_bytes is None:
            cache_bytes = _CACHE_BYTES
            if kind == "cuda":
                free, _ = package("torch").cuda.mem_get_info(self.network.device)
                cache_bytes = int(free * _CACHE_SHARE)
        # One half is for what is kept, the other for the tree at work.
        self._store = PrefixStore(cache_bytes // 2)
        self._follows_mask: dict[int, bool] = {}
        self._written: list[int] = []
        self._past: Any = None
        self.tokens_decoded = 0

    @property
    @synchronized
    def parameters(self) -> int:
        """Number of the model's weights."""
        return sum(weight.numel() for weight in self.network.model.parameters())

    @property
    @synchronized
    def fingerprint(self) -> str:
        """The weights and adapter, how they are computed with, and how a chat becomes tokens."""
        torch, digest = package("torch"), hashlib.sha256()
        for name, weight in self.network.model.state_dict().items():
            digest.update(name.encode())
            digest.update(weight.detach().cpu().contiguous().view(-1).view(torch.uint8).numpy())
        config = self.network.model.config.to_dict()
        config.pop("_name_or_path", None)
        digest.update(json.dumps(config, sort_keys=True, default=str).encode())
        if self.vocabulary is None:
            digest.update(tokenizer_file(self._model).read_bytes())
        if self.adapter is not None:
            digest.update(self.adapter.read_bytes())
        chat = self.tokenizer.render([Message("system", "A"), Message("user", "B")])
        versions = [f"{name} {importlib.metadata.version(name)}" for name in _ENGINE]
        how = f"{self._dtype} {self.network.device.type}"
        return f"{digest.hexdigest()} {how} {' '.join(versions)} {chat}"

    @synchronized
    def describe(self) -> str:
        """One line on what is loaded."""
        size = f"{self.parameters / 1e6:.0f}M weights, {self._dtype}, on {self.network.device}"
        adapted = f" with {self.adapter}" if self.adapter else ""
        return f"{self.name} ({size}) from {self._model}{adapted}"

    @synchronized
    def clear_cache(self) -> None:
        """Clear the cached prompts; results stay the same, but the next calls take longer."""
        self._store.clear()
        self._past = None

    def with_adapter(self, adapter: Path) -> Transformers:
        """See `LocalModel.with_adapter`."""
        return Transformers(self._model, adapter=adapter)

    def free(self) -> None:
        """See `LocalModel.free`."""
        self._store.clear()
        self._past = None
        self.network.model = None
        self.network.free_unused()

    def guide(self) -> Any:
        """See `LocalModel.guide`."""
        if self.vocabulary is not None:
            return gguf_vocabulary(self.vocabulary)
        import llguidance

        size = self.network.vocab_size
        ends = [token for token in range(size) if self.tokenizer.is_control(token)]
        text = tokenizer_file(self._model).read_text(encoding="utf-8")
        return llguidance.LLTokenizer(text, n_vocab=size, eos_token=ends)

    @synchronized
    def read(self, prompt: Sequence[int], room: int) -> Logits:
        """See `LocalModel.read`."""
        trie = Trie()
        last = trie.paths[trie.add(prompt)][-1]
        found: list[Logits] = []
        self._store.tick()
        self._compute(trie, {last}, lambda _, logits: found.append(_to_numpy(logits[0])))
        keys = self._store.path(prompt)
        self._written, self._past = list(prompt), None
        if len(keys) == len(prompt):
            with self._enough_memory():
                known = self._store.gather(keys)
                self._past = known.new_empty(len(keys) + room, known.shape[1])
                self._past[: len(keys)] = known
        self._store.trim()
        return found[0]

    @synchronized
    def push(self, token: int) -> Logits:
        """See `LocalModel.push`."""
        at = len(self._written)
        self._written.append(token)
        self.tokens_decoded += 1
        if self._past is None:
            return _to_numpy(self.network.read(self._written, [at])[0])
        sees = np.ones((1, 1, at + 1), np.bool_)
        past = self._past[None, :at] if at else None
        with self._enough_memory():
            logits, values = self.network.run(
                np.array([[token]]), np.array([[at]]), sees, past, [0]
            )
        self._past[at] = values[0, 0]
        return _to_numpy(logits[0])

    @synchronized
    def score(self, pairs: Sequence[Pair]) -> list[Array]:
        """See `TokenScorer.score`. Beginnings that pairs share, also with recent calls, are cached.

        A tree holds as many pairs as the memory for it.
        """
        self._store.tick()
        results: list[Array] = []
        while len(results) < len(pairs):
            size = self.network.token_numbers * self.network.dtype.itemsize
            most = self._store.limit // size if size else self._batch
            trie, spots = plant(pairs[len(results) :], nodes=most)
            if len(spots) < len(pairs) and not results:
                for pair in pairs:
                    self._store.path(pair.prompt)  # used now, so not forgotten for one another
            logprobs = self._logprobs(trie, set(chain.from_iterable(spots)))
            results += [np.array([logprobs[spot] for spot in spots_]) for spots_ in spots]
            self._store.trim()
        return results

    @contextmanager
    def _enough_memory(self) -> Generator[None]:
        """Say so where the memory is too small for what cannot be done in smaller batches."""
        try:
            yield
        except Exception as error:
            self.clear_cache()
            if not self.network.is_out_of_memory(error):
                raise
            raise self._too_large() from None

    def _too_large(self) -> ModelError:
        return ModelError(
            f"{self.network.device} has too little memory to run {self.name}. Close other "
            "programs, or use a smaller model, dtype or context size."
        )

    def _logprobs(self, trie: Trie, spots: set[tuple[int, int]]) -> dict[tuple[int, int], float]:
        """Log-probability in nats of each token after its node."""
        tokens: dict[int, list[int]] = {}
        for node, token in spots:
            tokens.setdefault(node, []).append(token)
        order: list[tuple[int, int]] = []
        found: list[Any] = []

        def read(nodes: list[int], logits: Any) -> None:
            for at in range(0, len(nodes), _LOGITS):
                some = nodes[at : at + _LOGITS]
                rows = [row for row, node in enumerate(some) for _ in tokens[node]]
                asked = [(node, token) for node in some for token in tokens[node]]
                logprobs = logits[at : at + _LOGITS].float().log_softmax(-1)
                found.append(logprobs[rows, [token for _, token in asked]])
                order.extend(asked)

        self._compute(trie, set(tokens), read)
        return dict(zip(order, package("torch").cat(found).tolist(), strict=True))

    def _compute(self, trie: Trie, wanted: set[int], read: Read) -> None:
        """Read the wanted nodes' logits; where the memory is too small, in smaller batches.

        What is read is taken out of `wanted`.
        """
        while wanted:
            try:
                if self._reads_trees(max(trie.depths) + 1):
                    self._compute_tree(trie, wanted, read)
                else:
                    self._compute_texts(trie, wanted, read)
                return
            except BaseException as error:
                self.clear_cache()
                if not self.network.is_out_of_memory(error):
                    raise
            self.network.free_unused()
            if self._batch <= _LEAST_BATCH:
                raise self._too_large()
            self._batch //= 2
            self._width = min(self._width, self._batch)

    def _compute_tree(self, trie: Trie, wanted: set[int], read: Read) -> None:
        keys: list[int | None] = []
        fresh: list[bool] = []
        for node, (token, parent) in enumerate(zip(trie.tokens, trie.parents, strict=True)):
            before = keys[parent] if parent >= 0 else ROOT
            keys.append(None if before is None else self._store.find(before, token))
            fresh.append(keys[node] is None or node in wanted)
        while any(fresh):
            rows = pack(trie, fresh, width=self._width, limit=self._batch)
            for batch in batches(rows, tokens=self._batch, known=_KNOWN * self._batch):
                self._compute_rows(trie, keys, batch, wanted, read)
                for node in chain.from_iterable(row.nodes for row in batch):
                    fresh[node] = False

    def _compute_rows(
        self,
        trie: Trie,
        keys: list[int | None],
        rows: Sequence[Row],
        wanted: set[int],
        read: Read,
    ) -> None:
        """Compute a batch of rows; `keys` holds each node's key in the store, if it is there."""
        width = max(len(row.nodes) for row in rows)
        known = max(len(row.trunk) for row in rows)
        ids, depths = np.zeros((2, len(rows), width), np.int64)
        sees = np.zeros((len(rows), width, known + width), np.bool_)
        sees[:, range(width), range(known, known + width)] = True
        places: dict[int, int] = {}
        for number, row in enumerate(rows):
            column = {node: at for at, node in enumerate(row.nodes)}
            ids[number, : len(column)] = [trie.tokens[node] for node in row.nodes]
            depths[number, : len(column)] = [trie.depths[node] for node in row.nodes]
            for node, at in column.items():
                places[node] = number * width + at
                if trie.parents[node] in column:
                    sees[number, at] |= sees[number, column[trie.parents[node]]]
                else:
                    sees[number, at, : len(row.trunk)] = True
        nodes = [node for node in places if node in wanted]
        trunks = self._trunks(keys, rows, known) if known else None
        logits, values = self.network.run(
            ids, depths, sees, trunks, [places[node] for node in nodes]
        )
        self.tokens_decoded += len(places)
        new = [node for node in places if keys[node] is None]
        if new:
            block = self._store.add(values.flatten(0, 1)[[places[node] for node in new]])
            for row, node in enumerate(new):
                before = keys[trie.parents[node]] if trie.parents[node] >= 0 else ROOT
                assert before is not None
                keys[node] = self._store.put(block, row, before, trie.tokens[node])
        if nodes:
            read(nodes, logits)
            wanted.difference_update(nodes)

    def _trunks(self, keys: Sequence[int | None], rows: Sequence[Row], known: int) -> Any:
        """Keys and values [rows, known, numbers] of the rows' trunks, which may end before."""
        paths = [[key for node in row.trunk if (key := keys[node])] for row in rows]
        if all(path == paths[0] for path in paths):
            return self._store.gather(paths[0]).expand(len(rows), -1, -1)
        network = self.network
        shape = (len(rows), known, network.token_numbers)
        trunks = package("torch").zeros(shape, dtype=network.dtype, device=network.device)
        for trunk, path in zip(trunks, paths, strict=True):
            if path:
                trunk[: len(path)] = self._store.gather(path)
        return trunks

    def _compute_texts(self, trie: Trie, wanted: set[int], read: Read) -> None:
        for path in trie.paths:
            nodes = [node for node in path if node in wanted]
            if nodes:
                tokens = [trie.tokens[node] for node in path]
                read(nodes, self.network.read(tokens, [trie.depths[node] for node in nodes]))
                self.tokens_decoded += len(path)
                wanted.difference_update(nodes)

    def _reads_trees(self, length: int) -> bool:
        """Whether the model computes trees of such a depth as it would each text alone."""
        window = self.network.window
        probe = _PROBE if window is None or length <= window else window + _PROBE
        if probe not in self._follows_mask:
            self._follows_mask[probe] = self.network.takes_trees and self._probe(probe)
        return self._follows_mask[probe]

    def _probe(self, length: int) -> bool:
        """Whether two random texts, most of which they share, get the same logits either way."""
        random, trie = np.random.default_rng(0), Trie()
        start, *ends = (
            random.integers(0, self.network.vocab_size, size).tolist()
            for size in (length - _PROBE // 2, _PROBE // 2, _PROBE // 2)
        )
        for end in ends:
            trie.add([*start, *end])
        wanted = {node for node, depth in enumerate(trie.depths) if depth >= len(start)}

        def logits(compute: Callable[[Trie, set[int], Read], None]) -> Any:
            found: dict[int, Any] = {}

            def read(nodes: list[int], logits: Any) -> None:
                found.update(zip(nodes, logits, strict=True))

            compute(trie, set(wanted), read)
            return package("torch").stack([found[node] for node in sorted(wanted)]).float()

        plain = logits(self._compute_texts)
        try:  # first all at once, then with the shared part known
            trees = [logits(self._compute_tree) for _ in range(2)]
        except Exception as error:
            if self.network.is_out_of_memory(error):
                raise
            return False
        mismatch = max(float((tree - plain).norm()) for tree in trees)
        spread = float((plain - plain.mean(0)).norm())
        return mismatch < _MISMATCH.get(self._dtype, _MISMATCH_ROUNDED) * spread

    @property
    def _dtype(self) -> str:
        return str(self.network.dtype).removeprefix("torch.")


def _to_numpy(logits: Any) -> Logits:
    return logits.float().cpu().numpy()
