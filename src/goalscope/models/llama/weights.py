"""A thin layer over llama.cpp's C interface: weights, tokens, and a KV cache for token trees."""

from __future__ import annotations

import ctypes
import hashlib
import os
import re
import weakref
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from goalscope.base.types import ModelError
from goalscope.models import CLOSED
from goalscope.models.chat import ChatTokenizer
from goalscope.models.llama.engine import ALL_F32, CONTROL, PACKAGE, USER_DEFINED, Batch, engine
from goalscope.models.llama.trie import Trie

MAX_PATHS = 64
"""Most paths of one tree; its memory grows with it, and llama.cpp allows no more than 128."""

DOWNLOAD_AGAIN = "Download it again, or choose another file."
"""What to do with a damaged model file."""

_CONTEXT_BYTES = 32 << 20  # of a llama.cpp context besides keys, values and logits
_BATCH = 512  # most tokens that are decoded at once
_OUTPUTS = 256  # most logits rows of one batch; at least 2 * MAX_PATHS, as llama.cpp demands
_F32, _F16 = 0, 1  # ggml types
_FLASH_AUTO, _FLASH_OFF = -1, 0
_SEQUENCE = ctypes.POINTER(ctypes.c_int32)


class Weights:
    """A GGUF file in memory, which several models with different adapters can share.

    Attributes:
        path: The file.
        lib: llama.cpp's functions.
        vocab_size: Number of tokens.
        used: The caches of all models that share them, the last used last.
    """

    def __init__(
        self, path: Path, *, vocabulary_only: bool = False, remedy: str = DOWNLOAD_AGAIN
    ) -> None:
        """Load a file.

        Args:
            path: The file.
            vocabulary_only: Whether only its tokenizer is needed.
            remedy: What to do where the file is damaged.

        Raises:
            ModelError: The file is missing, or is not a complete GGUF model.
        """
        self.lib = engine().lib
        self.path = path
        if not os.path.isfile(path):
            raise ModelError(f"There is no model file at {path}. Check the path.")
        with path.open("rb") as file:
            is_gguf = file.read(4) == b"GGUF"
        params = self.lib.llama_model_default_params()
        params.vocab_only = vocabulary_only
        model: Any = (
            self.lib.llama_model_load_from_file(os.fsencode(path), params) if is_gguf else None
        )
        if not model:
            raise ModelError(f"{path} is not a complete GGUF model. {remedy}")
        self.free = weakref.finalize(self, self.lib.llama_model_free, model)
        self._model, self._vocab = model, self.lib.llama_model_get_vocab(model)
        self._adapters: dict[Path, Any] = {}
        self._users = 0
        self.used = list[KVCache]()
        self.guide: Any = None
        self.vocab_size: int = self.lib.llama_vocab_n_tokens(self.vocab)

    @property
    def model(self) -> Any:
        """llama.cpp's model.

        Raises:
            ModelError: It was freed.
        """
        if not self.free.alive:
            raise ModelError(CLOSED)
        return self._model

    @property
    def vocab(self) -> Any:
        """llama.cpp's vocabulary; as for `model`."""
        return self.model and self._vocab

    def adapter(self, path: Path) -> Any:
        """A LoRA adapter that contexts can apply; it is loaded once, and goes with the weights.

        Raises:
            ModelError: The file is missing, or is no adapter for these weights.
        """
        if not os.path.isfile(path):
            raise ModelError(f"There is no adapter at {path}. Check the path.")
        if path not in self._adapters:
            adapter = self.lib.llama_adapter_lora_init(self.model, os.fsencode(path))
            if not adapter:
                raise ModelError(
                    f"{path} is not an adapter for {self.metadata('general.name') or self.path}. "
                    "Use the model that it was fitted on, or fit an adapter for this model with "
                    "`goalscope fit`."
                )
            self._adapters[path] = adapter
        return self._adapters[path]

    def share(self) -> Weights:
        """These weights for one more user, who calls `release` at the end."""
        self._users += 1
        return self

    def release(self) -> None:
        """Free the memory when the last user has released them."""
        self._users -= 1
        if self._users <= 0:
            self.free()

    @cached_property
    def digest(self) -> str:
        """Hashes of the file and, if it is one of several parts, of all of them."""
        digests: list[str] = []
        for part in split_files(self.path):
            with part.open("rb") as file:
                digests.append(hashlib.file_digest(file, "sha256").hexdigest())
        return " ".join(digests)

    @property
    def exact(self) -> bool:
        """Whether the weights are F32, so that the rest is to be computed in F32 too."""
        return bool(self.lib.llama_model_ftype(self.model) == ALL_F32)

    @cached_property
    def kv_bytes(self) -> int:
        """Bytes of keys and values that one cached token takes."""
        lib, model = self.lib, self.model
        usual = lib.llama_model_n_embd(model) // lib.llama_model_n_head(model)
        own = f"{self.metadata('general.architecture')}.attention"
        lengths = (self.metadata(f"{own}.{each}_length") for each in ("key", "value"))
        heads = lib.llama_model_n_layer(model) * lib.llama_model_n_head_kv(model)
        size = 4 if self.exact else 2
        return heads * size * sum(int(each or usual) for each in lengths)

    def metadata(self, key: str) -> str | None:
        """Value of a key of the GGUF file, as text; None if it has no such key."""
        return _text(partial(self.lib.llama_model_meta_val_str, self.model, key.encode()))

    def tokenize(self, text: str, *, markup: bool) -> list[int]:
        """Token ids of `text`; names of control tokens become those only with `markup`."""
        data = text.encode()
        size = len(data) + 8
        ids = (ctypes.c_int32 * size)()
        count = self.lib.llama_tokenize(self.vocab, data, len(data), ids, size, False, markup)
        if count < 0:
            raise ModelError("The model's tokenizer failed. Choose another GGUF file.")
        return ids[:count]

    @cached_property
    def chat_tokenizer(self) -> ChatTokenizer:
        """The file's tokenizer and chat template.

        Raises:
            ModelError: It holds no chat template.
        """
        lib, vocab = self.lib, self.vocab
        bos, eos = lib.llama_vocab_bos(vocab), lib.llama_vocab_eos(vocab)
        attributes = [lib.llama_vocab_get_attr(vocab, i) for i in range(self.vocab_size)]
        markup = CONTROL | USER_DEFINED
        return ChatTokenizer(
            self.tokenize,
            self.detokenize,
            template=self.metadata("tokenizer.chat_template"),
            bos=(bos, self._text(bos)),
            eos=(eos, self._text(eos)),
            add_bos=lib.llama_vocab_get_add_bos(vocab),
            names=[self._text(i) for i, each in enumerate(attributes) if each & markup],
            controls=[
                token
                for token, attribute in enumerate(attributes)
                if attribute & CONTROL or lib.llama_vocab_is_eog(vocab, token)
            ],
        )

    def _text(self, token: int) -> str:
        if token < 0:
            return ""
        return self.lib.llama_vocab_get_text(self.vocab, token).decode(errors="replace")

    def detokenize(self, tokens: Sequence[int], *, markup: bool) -> str:
        """The text of tokens; those that are markup have none without `markup`."""
        pieces = [self.piece(token, markup=markup) for token in tokens]
        return b"".join(pieces).decode(errors="replace")

    def piece(self, token: int, *, markup: bool) -> bytes:
        """The bytes of a token, as for `detokenize`."""
        size = 64
        while True:
            buffer = ctypes.create_string_buffer(size)
            length = self.lib.llama_token_to_piece(self.vocab, token, buffer, size, 0, markup)
            if length >= 0:
                return buffer.raw[:length]
            size = -length


class KVCache:
    """Keys and values of one token tree, kept to start the next tree from what both share.

    Every path of the tree is a llama.cpp sequence, and a node is decoded once, as a member of all
    the sequences through it, so each path sees itself and nothing else. The tree before uses the
    other half of the sequence ids: taking over a shared prefix only relabels its cells.

    Attributes:
        trie: The paths whose keys and values are held.
        tokens_decoded: Tokens run through the model so far.
    """

    def __init__(self, weights: Weights, threads: int, adapter: Path | None = None) -> None:
        """Begin with nothing; memory is taken when the first tree comes.

        Args:
            weights: The model.
            threads: Processor threads that read a prompt; single tokens are decoded on one thread,
                which is as fast when nothing else runs, and faster when something does.
            adapter: LoRA adapter to apply.
        """
        self.trie = Trie()
        self.tokens_decoded = 0
        self._weights = weights
        self._lib = weights.lib
        self._threads = threads
        self._adapter: Any = weights.adapter(adapter) if adapter else None
        self._context: Any = None
        self._cells = 0
        self._most_outputs = 0
        self._bank = 0

    @property
    def bytes(self) -> int:
        """Memory taken: keys and values, the logits as far as they were used, and the rest."""
        logits = self._most_outputs * self._weights.vocab_size * 4
        taken = self._cells * self._weights.kv_bytes + logits + _CONTEXT_BYTES
        return taken if self._cells else 0

    def free(self) -> None:
        """Give the memory back; the cache is then empty."""
        context, self._context = self._context, None
        self._cells, self._most_outputs, self.trie = 0, 0, Trie()
        if context:
            self._lib.llama_free(context)

    def clear(self) -> None:
        """Forget everything held."""
        self.trie = Trie()
        if self._context:
            self._lib.llama_memory_clear(self._memory, False)

    def overlap(self, paths: Sequence[Sequence[int]]) -> float:
        """Mean share, from 0 to 1, of a path that the cache holds."""
        shares = [len(self.trie.match(path)) / len(path) for path in paths]
        return sum(shares) / len(shares)

    def load(
        self, trie: Trie, wanted: set[int], read: Callable[[int, Any], object], *, room: int = 0
    ) -> None:
        """Make the cache hold `trie`, decoding what it does not share with the tree held before.

        Args:
            trie: At most `MAX_PATHS` paths.
            wanted: Nodes whose next-token logits are to be read; these are decoded in any case.
            read: Called with each wanted node and its logits, float32 [vocabulary], which are valid
                during the call only.
            room: How many tokens will be pushed afterwards.

        Raises:
            ModelError: llama.cpp could not decode.
        """
        self._reserve(len(trie) + room)
        old, self.trie = self.trie, trie
        old_bank, self._bank = self._bank, MAX_PATHS - self._bank
        try:
            held: set[int] = set()
            for path, nodes in enumerate(trie.paths):
                shared = old.match([trie.tokens[node] for node in nodes])
                fresh = next((i for i, node in enumerate(nodes) if node in wanted), len(nodes))
                length = min(len(shared), fresh)
                if length:
                    source = old_bank + old.through[shared[length - 1]][0]
                    self._lib.llama_memory_seq_cp(
                        self._memory, source, self._bank + path, 0, length
                    )
                    held.update(nodes[:length])
            for path in range(len(old.paths)):
                self._lib.llama_memory_seq_rm(self._memory, old_bank + path, -1, -1)
            missing = [node for node in range(len(trie)) if node not in held]
            for nodes in _batches(missing, wanted):
                self._decode(nodes, wanted, read)
        except BaseException:
            self.clear()
            raise

    def push(self, token: int, read: Callable[[int, Any], object]) -> None:
        """Lengthen the only path held by one token and read its next-token logits, as in `load`.

        `load` must have been given the room.
        """
        try:
            node = self.trie.extend(0, token)
            self._decode([node], {node}, read)
        except BaseException:
            self.clear()
            raise

    @property
    def _memory(self) -> Any:
        return self._lib.llama_get_memory(self._context)

    def _reserve(self, cells: int) -> None:
        if cells <= self._cells:
            return
        self.free()
        params = self._lib.llama_context_default_params()
        params.n_ctx = max(256, 1 << (cells - 1).bit_length())
        params.n_batch = params.n_ubatch = _BATCH
        params.n_outputs_max = _OUTPUTS
        params.n_seq_max = 2 * MAX_PATHS
        params.kv_unified = True
        # llama.cpp's flash attention rounds keys and values to F16 whatever their type.
        params.flash_attn_type = _FLASH_OFF if self._weights.exact else _FLASH_AUTO
        params.type_k = params.type_v = _F32 if self._weights.exact else _F16
        params.n_threads, params.n_threads_batch = 1, self._threads
        self._context = self._lib.llama_init_from_model(self._weights.model, params)
        if not self._context:
            size = params.n_ctx * self._weights.kv_bytes / 1e9
            raise ModelError(
                f"Cannot allocate the model's working memory ({size:.1f} GB). Close other "
                "programs, or use a smaller model or context size."
            )
        told = [
            getattr(self._lib, f"llama_{each}")(self._context)
            for each in ("n_ctx", "n_ctx_seq", "n_batch", "n_seq_max", "n_threads")
        ]
        batch = min(params.n_batch, params.n_ctx)
        asked = [params.n_ctx, params.n_ctx, batch, params.n_seq_max, params.n_threads]
        if told != asked:
            self.free()
            raise ModelError(
                f"{engine().name} misreads its settings ({told} for {asked}). "
                f"Install the version {PACKAGE.tried}."
            )
        self._cells = params.n_ctx
        if self._adapter:
            adapters = (ctypes.c_void_p * 1)(self._adapter)
            scales = (ctypes.c_float * 1)(1.0)
            if self._lib.llama_set_adapters_lora(self._context, adapters, 1, scales) != 0:
                self.free()
                raise ModelError("llama.cpp could not apply the adapter.")

    def _decode(
        self, nodes: list[int], wanted: set[int], read: Callable[[int, Any], object]
    ) -> None:
        trie = self.trie
        tokens = np.array([trie.tokens[node] for node in nodes], np.int32)
        positions = np.array([trie.depths[node] for node in nodes], np.int32)
        counts = np.array([len(trie.through[node]) for node in nodes], np.int32)
        sequences = np.array([path for node in nodes for path in trie.through[node]], np.int32)
        sequences += self._bank
        starts = np.cumsum(counts, dtype=np.uintp) - counts.astype(np.uintp)
        pointers = (sequences.ctypes.data + starts * sequences.itemsize).astype(np.uintp)
        flags = np.array([node in wanted for node in nodes], np.int8)

        batch = Batch(
            n_tokens=len(nodes),
            token=_pointer(tokens, ctypes.c_int32),
            pos=_pointer(positions, ctypes.c_int32),
            n_seq_id=_pointer(counts, ctypes.c_int32),
            seq_id=_pointer(pointers, _SEQUENCE),
            logits=_pointer(flags, ctypes.c_int8),
        )
        status = self._lib.llama_decode(self._context, batch)
        if status != 0:
            raise ModelError(f"llama.cpp could not run the model (status {status}).")
        self.tokens_decoded += len(nodes)
        outputs = np.flatnonzero(flags)
        if not len(outputs):
            return
        self._most_outputs = max(self._most_outputs, len(outputs))
        shape = (len(outputs), self._weights.vocab_size)
        logits = np.ctypeslib.as_array(self._lib.llama_get_logits(self._context), shape)
        for row, index in zip(logits, outputs, strict=True):
            read(nodes[index], row)


def split_files(path: Path) -> list[Path]:
    """The files of a model: one, or all of NAME-00001-of-00009.gguf and so on."""
    match = re.fullmatch(r"(.*)-\d{5}-of-(\d{5})\.gguf", path.name)
    if not match:
        return [path]
    name, count = match.groups()
    return [path.with_name(f"{name}-{i:05}-of-{count}.gguf") for i in range(1, int(count) + 1)]


def _text(read: Callable[[Any, int], int]) -> str | None:
    """The text that a function of llama.cpp writes into a buffer of a size; None if it has none."""
    size = 1 << 12
    while True:
        buffer = ctypes.create_string_buffer(size)
        length = read(buffer, size)
        if length < size:
            return None if length < 0 else buffer.value.decode(errors="replace")
        size = length + 1


def _batches(nodes: Sequence[int], wanted: set[int]) -> Iterator[list[int]]:
    """Cut nodes into batches, in order."""
    batch: list[int] = []
    outputs = 0
    for node in nodes:
        if len(batch) == _BATCH or outputs == _OUTPUTS:
            yield batch
            batch, outputs = [], 0
        batch.append(node)
        outputs += node in wanted
    if batch:
        yield batch


def _pointer(array: npt.NDArray[Any], kind: Any) -> Any:
    return ctypes.cast(array.ctypes.data, cast("Any", ctypes.POINTER(kind)))
