"""Other ways to the same numbers: log P(utterance | goal, transcript) of the same weights.

Every class has a `name` and `score(rows)`, which returns one log-probability in nats for each row.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import Any

import torch
from lm_eval.api.instance import Instance
from lm_eval.models.huggingface import HFLM
from minicons.scorer import IncrementalLMScorer
from transformers import AutoModelForCausalLM, AutoTokenizer

from goalscope.models.llama.model import embedded_path

TOKENS_AT_ONCE = 4096  # of one padded batch without a cache: more is no faster on a processor
CACHED_AT_ONCE = 16_384  # of one padded batch with its cache, which bounds the copies' memory


@dataclass(frozen=True)
class Row:
    """An utterance after a prompt, as tokens and as the text that gives exactly these tokens."""

    prompt: list[int]
    answer: list[int]
    prompt_text: str
    answer_text: str

    @property
    def ids(self) -> list[int]:
        """All tokens but the last, which nothing is predicted from."""
        return [*self.prompt, *self.answer[:-1]]


def load_weights() -> Any:
    """The bundled model for Transformers, float32."""
    path = embedded_path()
    return AutoModelForCausalLM.from_pretrained(
        path.parent, gguf_file=path.name, dtype=torch.float32
    ).eval()


def load_tokenizer() -> Any:
    """The bundled model's tokenizer; padding is a token that no chat holds."""
    path = embedded_path()
    tokenizer = AutoTokenizer.from_pretrained(path.parent, gguf_file=path.name)
    tokenizer.pad_token = tokenizer.convert_ids_to_tokens(0)
    return tokenizer


class OneByOne:
    """The paper's way: one goal after another, each with the whole transcript."""

    def __init__(self, model: Any, dtype: str) -> None:
        self.name = f"Transformers, one goal after another, {dtype}"
        self.model = model

    @torch.inference_mode()
    def score(self, rows: Sequence[Row]) -> list[float]:
        values = []
        for row in rows:
            ids, kept = torch.tensor([row.ids]), len(row.answer)
            logits = self.model(ids, use_cache=False, logits_to_keep=kept).logits[0]
            values.append(_sum(logits, row))
        return values


class PaddedBatch:
    """All goals in one padded batch, cut where the memory is bounded."""

    def __init__(self, model: Any, dtype: str) -> None:
        self.name = f"Transformers, padded batch, {dtype}"
        self.model = model

    @torch.inference_mode()
    def score(self, rows: Sequence[Row]) -> list[float]:
        values: dict[int, float] = {}
        for numbers in _batches(rows, TOKENS_AT_ONCE):
            batch = [rows[number] for number in numbers]
            hidden = self.model.model(_padded(batch, 0), use_cache=False).last_hidden_state
            values.update(zip(numbers, _sums(self.model, hidden, batch, 0), strict=True))
        return [values[number] for number in range(len(rows))]


class SharedPrefix:
    """What all prompts begin with is computed once and kept from round to round."""

    def __init__(self, model: Any, dtype: str) -> None:
        self.name = f"Transformers, shared prefix cache, {dtype}"
        self.model = model
        self.forget()

    def forget(self) -> None:
        """Begin again with nothing held."""
        self.held: list[int] = []
        self.cache: Any = None

    @torch.inference_mode()
    def score(self, rows: Sequence[Row]) -> list[float]:
        prefix = _common([row.prompt for row in rows])
        prefix = prefix[: min(len(row.prompt) for row in rows) - 1]
        self._hold(prefix)
        values: dict[int, float] = {}
        for numbers in _batches(rows, CACHED_AT_ONCE):
            batch = [rows[number] for number in numbers]
            suffixes = _padded(batch, len(prefix))
            output = self.model.model(suffixes, past_key_values=self._repeated(len(batch)))
            sums = _sums(self.model, output.last_hidden_state, batch, len(prefix))
            values.update(zip(numbers, sums, strict=True))
        return [values[number] for number in range(len(rows))]

    def _hold(self, prefix: list[int]) -> None:
        shared = len(_common([self.held, prefix]))
        if not shared:
            self.cache = None
        elif shared < len(self.held):
            self.cache.crop(shared - len(self.held))
        if shared < len(prefix):
            ids = torch.tensor([prefix[shared:]])
            output = self.model.model(ids, past_key_values=self.cache, use_cache=True)
            self.cache = output.past_key_values
        self.held = prefix

    def _repeated(self, count: int) -> Any:
        """The cache for `count` rows, without a copy; the model leaves the original as it is."""
        batch = copy.copy(self.cache)
        batch.layers = [copy.copy(layer) for layer in self.cache.layers]
        for layer in batch.layers:
            layer.keys = layer.keys.expand(count, -1, -1, -1)
            layer.values = layer.values.expand(count, -1, -1, -1)
        return batch


class LmEval:
    """lm-evaluation-harness. It moves the line break before the utterance into what is scored."""

    def __init__(self, model: Any, tokenizer: Any, dtype: str) -> None:
        self.name = f"lm-evaluation-harness, {dtype}"
        self.model = HFLM(pretrained=model, tokenizer=tokenizer, device="cpu", batch_size=1)

    def score(self, rows: Sequence[Row]) -> list[float]:
        requests = [
            Instance("loglikelihood", {}, (row.prompt_text, row.answer_text), index)
            for index, row in enumerate(rows)
        ]
        return [value for value, _ in self.model.loglikelihood(requests, disable_tqdm=True)]


class Minicons:
    """minicons."""

    def __init__(self, model: Any, tokenizer: Any, dtype: str) -> None:
        self.name = f"minicons, {dtype}"
        self.model = IncrementalLMScorer(model, "cpu", tokenizer=tokenizer)

    def score(self, rows: Sequence[Row]) -> list[float]:
        return [
            self.model.conditional_score(
                [row.prompt_text],
                [row.answer_text],
                separator="",
                reduction=lambda values: values.float().sum().item(),
            )[0]
            for row in rows
        ]


def _common(lists: Sequence[list[int]]) -> list[int]:
    """The longest beginning that all lists share."""
    columns = takewhile(lambda column: len(set(column)) == 1, zip(*lists, strict=False))
    return [column[0] for column in columns]


def _batches(rows: Sequence[Row], limit: int) -> Iterator[list[int]]:
    """Numbers of rows of like length, at most `limit` tokens with the padding."""
    batch: list[int] = []
    for number in sorted(range(len(rows)), key=lambda number: len(rows[number].ids)):
        width = len(rows[number].ids)  # the longest so far
        if batch and width * (len(batch) + 1) > limit:
            yield batch
            batch = []
        batch.append(number)
    yield batch


def _padded(rows: Sequence[Row], start: int) -> torch.Tensor:
    """Tokens from `start`; padding stands last, where no token that counts can see it."""
    ids = [torch.tensor(row.ids[start:]) for row in rows]
    return torch.nn.utils.rnn.pad_sequence(ids, batch_first=True)


def _sums(model: Any, hidden: torch.Tensor, rows: Sequence[Row], start: int) -> list[float]:
    """Log-probabilities from the last hidden states of a padded batch that begins at `start`."""
    states = []
    for each, row in zip(hidden, rows, strict=True):
        last = len(row.ids) - start
        states.append(each[last - len(row.answer) : last])
    logits = model.lm_head(torch.cat(states)).split([len(row.answer) for row in rows])
    return [_sum(each, row) for each, row in zip(logits, rows, strict=True)]


def _sum(logits: torch.Tensor, row: Row) -> float:
    places = torch.arange(len(row.answer))
    return logits.float().log_softmax(-1)[places, torch.tensor(row.answer)].sum().item()
