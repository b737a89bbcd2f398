"""Open a model by a file, a folder, a name on the hub, or a server's address."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, closing
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args

from goalscope.base.arrays import Array
from goalscope.base.types import InvalidInputError, Message, ModelError
from goalscope.models import Completion, OpenGenerator
from goalscope.models.adapters import FITTED_TASK, NO_ADAPTER, adapter_file, shipped
from goalscope.models.chat import ChatTokenizer
from goalscope.models.local import LocalModel
from goalscope.models.scoring import TokenScorer

ModelKey = Literal["model", "generator", "scorer", "tokenizer", "adapter"]
"""An argument of `open_model`."""

MODEL_KEYS: tuple[ModelKey, ...] = get_args(ModelKey)

_ADAPTER_FILE = r"[/\\]adapter\.gguf$"  # says less than the folder's name


class ModelSet:
    """The models of an agent by their roles (the paper's are GPT-4o-mini and Llama 3).

    A text fits if it fits both the one that writes and the one that scores.

    Attributes:
        generator: Writes.
        scorer: Scores.
        speaker: Scores utterances: the scorer, optionally with an adapter.
        reader: Reads utterances: the generator, optionally with an adapter.
        taught: Whether the reader has an adapter.
        writer: Proposes goals, needs and questions with an adapter; None without one.
        roles: The models without repetition.
    """

    def __init__(
        self,
        generator: OpenGenerator,
        scorer: TokenScorer,
        *,
        speaker: TokenScorer | None = None,
        reader: OpenGenerator | None = None,
        writer: LocalModel | None = None,
    ) -> None:
        """Take them."""
        self.generator, self.scorer, self.speaker = generator, scorer, speaker or scorer
        self.reader, self.taught = reader or generator, reader is not None
        self.writer = writer
        self._is_one_model = id(generator) == id(scorer)
        used = [generator, scorer, self.speaker, self.reader, *([writer] if writer else [])]
        self.roles: list[OpenGenerator | TokenScorer] = list({id(m): m for m in used}.values())

    @property
    def name(self) -> str:
        """The names of the one that writes and the one that scores."""
        return " and ".join(dict.fromkeys((self.generator.name, self.scorer.name)))

    @property
    def context_size(self) -> int:
        """The smaller of both; an adapter changes none."""
        return min(self.generator.context_size, self.scorer.context_size)

    @property
    def fingerprint(self) -> str:
        """Of all."""
        return " ".join(model.fingerprint for model in self.roles)

    @property
    def takes_grammar(self) -> bool:
        """Whether the one that writes takes a grammar."""
        return self.generator.takes_grammar

    def count_tokens(self, messages: Sequence[Message]) -> int:
        """The larger of both counts."""
        count = self.scorer.count_tokens(messages)
        if self._is_one_model:
            return count
        return max(self.generator.count_tokens(messages), count)

    def generate(self, messages: Sequence[Message], **options: Any) -> Completion:
        """See `Generator.generate`."""
        return self.generator.generate(messages, **options)

    def token_logprobs(
        self,
        contexts: Sequence[Sequence[Message]],
        continuations: Sequence[str],
    ) -> list[Array]:
        """See `LikelihoodModel.token_logprobs`."""
        return self.scorer.token_logprobs(contexts, continuations)

    def describe(self) -> str:
        """One line on all."""
        parts = [f"writes: {self.generator.describe()}", f"scores: {self.scorer.describe()}"]
        if self._is_one_model:
            parts = [self.scorer.describe()]
        if self.speaker is not self.scorer:
            parts.append(f"scores what people say: {self.speaker.describe()}")
        if self.taught:
            parts.append(f"reads: {self.reader.describe()}")
        if self.writer:
            parts.append(f"proposes, plans and asks: {self.writer.describe()}")
        return "; ".join(parts)

    def close(self) -> None:
        """Close all."""
        for model in self.roles:
            model.close()


def adapter_metadata(model: object) -> Mapping[str, str]:
    """The text metadata of the adapter with which a model scores utterances; empty without one."""
    scorer = model.speaker if isinstance(model, ModelSet) else model
    return scorer.adapter_metadata if isinstance(scorer, LocalModel) else {}


def forget(model: object) -> None:
    """Clear the caches of all parts of a model.

    The state of the cache decides which tokens are computed together, and so how sums are rounded:
    with 8-bit and 16-bit weights, log-probabilities vary by up to 0.1 nat.
    """
    for part in _parts(model):
        if isinstance(part, TokenScorer):
            part.clear_cache()


def is_local(model: object) -> bool:
    """Whether all parts of a model are in this process, and keep what they have read."""
    return all(isinstance(part, TokenScorer) for part in _parts(model))


def _parts(model: object) -> Sequence[object]:
    return model.roles if isinstance(model, ModelSet) else [model]


def model_label(names: Mapping[str, Any]) -> str:
    """The label in tables for a model with these `MODEL_KEYS`; paths are cut to their last part."""
    writer, scorer = (names.get(key) or names.get("model") for key in ("generator", "scorer"))
    label = " + ".join(dict.fromkeys(_short(name) for name in (writer, scorer)))
    adapter = names.get("adapter")
    if adapter == NO_ADAPTER:
        return label if scorer else f"{label} without adapter"
    return f"{label} + {_short(re.sub(_ADAPTER_FILE, '', adapter))}" if adapter else label


def open_model(
    model: str | Path | None = None,
    *,
    generator: str | Path | None = None,
    scorer: str | Path | None = None,
    tokenizer: str | Path | None = None,
    adapter: str | Path | None = None,
) -> ModelSet:
    """Open one model that writes and scores, or one for each.

    A model is named by

    * nothing: the embedded SmolLM2-135M-Instruct;
    * a GGUF file, run by llama.cpp;
    * a folder, or `hf:NAME` from the Hugging Face hub, run by Transformers;
    * an address such as `http://localhost:8000/v1#MODEL`, of an OpenAI-compatible server.

    Args:
        model: Writes and scores.
        generator: Writes, if not `model`.
        scorer: Scores, if not `model`.
        tokenizer: GGUF file, folder or hub name of a served model's tokenizer; by default, that of
            the model path that the server reports.
        adapter: GGUF file or folder of a LoRA adapter for scoring utterances (`ModelSet.speaker`).
            "none" for none; by default, the one that ships with goalscope if the embedded model
            scores. (For reading, the embedded model always uses its own adapter.)

    Raises:
        ModelError: A model, an adapter or a package is missing, or a file is damaged.
        InvalidInputError: An adapter is named for a server.
    """
    writes, scores = generator or model, scorer or model
    adapted = _adapter(adapter, scores)
    with ExitStack() as opened:
        writing: OpenGenerator
        scoring: TokenScorer
        if writes == scores and not _is_address(writes):
            both = opened.enter_context(closing(_local(writes)))
            writing, scoring = both, both
        else:
            writing = opened.enter_context(closing(_generator(writes, tokenizer)))
            scoring = opened.enter_context(closing(_scorer(scores, tokenizer)))

        def with_adapter(model: object, file: Path) -> LocalModel:
            assert isinstance(model, LocalModel)  # `_adapter` refuses servers
            return opened.enter_context(closing(model.with_adapter(file)))

        files = [shipped(name) if writes is None else None for name in ("reader", "writer")]
        reading, proposing = (file and with_adapter(writing, file) for file in files)
        speaking = with_adapter(scoring, adapted) if adapted else None
        result = ModelSet(writing, scoring, speaker=speaking, reader=reading, writer=proposing)
        opened.pop_all()
    return result


@cache
def embedded_scorer() -> TokenScorer:
    """The embedded model with its adapter, for trackers without a model of their own.

    It is opened once, and stays open.

    Raises:
        ModelError: The model or the adapter is missing or broken.
    """
    return _local(None, adapter=_adapter(None, None))


def open_reader(
    model: str | Path | None = None,
    *,
    adapter: str | Path | None = None,
) -> tuple[OpenGenerator, bool]:
    """Open the model that reads, and return whether it was fitted for it (see `Reader`).

    Args:
        model: As of `open_model`.
        adapter: GGUF file or folder of an adapter fitted for reading; "none" for none; by default,
            the one that ships with goalscope, for the embedded model.

    Raises:
        ModelError: The model or the adapter is missing or broken.
        InvalidInputError: The adapter is named for a server, or was fitted on something else.
    """
    if _is_address(model):
        _adapter(adapter or NO_ADAPTER, model)
        return _generator(model, None), False
    given = None if adapter in (None, NO_ADAPTER) else _adapter(adapter, model)
    file = given or (shipped("reader") if model is None and adapter is None else None)
    opened = _local(model, adapter=file)
    taught = adapter_metadata(opened).get(FITTED_TASK) == "writing"
    if given and not taught:
        opened.close()
        raise InvalidInputError(
            f"The adapter {adapter} was not fitted for reading. Name one made by "
            "training/fit_reader.py, or none."
        )
    return opened, taught


def _short(name: str | None) -> str:
    if name is None:
        return "SmolLM2-135M-Instruct"
    if _is_address(name):
        return name.partition("#")[2] or name
    return re.split(r"[/\\]", name.removeprefix("hf:"))[-1].removesuffix(".gguf") or name


def _is_address(name: str | Path | None) -> bool:
    return str(name).startswith(("http://", "https://"))


def _adapter(adapter: str | Path | None, scores: str | Path | None) -> Path | None:
    """The file of the adapter for the model that scores, if it is to have one."""
    if adapter is None:
        return shipped() if scores is None else None
    if adapter == NO_ADAPTER:
        return None
    if _is_address(scores):
        address = str(scores).partition("#")[0]
        raise InvalidInputError(
            f"The server at {address} applies adapters itself (vLLM: --lora-modules "
            "NAME=FOLDER). Leave out --adapter, and use the adapter's name as the model's "
            f"name: {address}#NAME."
        )
    return adapter_file(adapter)


def _local(name: str | Path | None, *, adapter: Path | None = None) -> LocalModel:
    text = str(name or "")
    if text.startswith("hf:") or os.path.isfile(Path(text, "config.json")):
        from goalscope.models.torch.model import Transformers

        return Transformers(text.removeprefix("hf:"), adapter=adapter)
    if text and os.path.isdir(text):
        files = ", ".join(sorted(each.name for each in Path(text).glob("*.gguf")))
        raise ModelError(
            f"The folder {text} has no config.json, so it is not a Transformers model. Name a "
            f"GGUF file instead; {f'it contains {files}' if files else 'it contains none'}."
        )
    from goalscope.models.llama.model import LlamaCpp

    return LlamaCpp(name, adapter=adapter)


def _generator(name: str | Path | None, tokenizer: str | Path | None) -> OpenGenerator:
    if not _is_address(name):
        return _local(name)
    from goalscope.models.served import ServedGenerator
    from goalscope.models.server import Server

    return ServedGenerator(Server(str(name)), _tokenizer(str(tokenizer)) if tokenizer else None)


def _scorer(name: str | Path | None, tokenizer: str | Path | None) -> TokenScorer:
    if not _is_address(name):
        return _local(name)
    from goalscope.models.served import ServedScorer
    from goalscope.models.server import Server

    server, home = Server(str(name)), str(tokenizer or "")
    try:
        home = home or str(server.facts.get("root") or server.model)
        if not tokenizer and "/" not in home and not os.path.exists(home):
            raise ModelError(
                f"{home} is not a name on the Hugging Face hub of the form owner/name."
            )
        return ServedScorer(server, _tokenizer(home))
    except ModelError as error:
        server.close()
        if tokenizer or not home:
            raise
        raise ModelError(
            f"Scoring needs the tokenizer of the model at {server.url}, which was not found "
            f"at {home!r} ({error}) Name it with --tokenizer, or open_model(tokenizer=...): a "
            "folder, a name on the hub or a GGUF file."
        ) from None


def _tokenizer(name: str) -> ChatTokenizer:
    if name.endswith(".gguf"):
        from goalscope.models.llama.weights import Weights

        return Weights(Path(name), vocabulary_only=True).chat_tokenizer
    from goalscope.models.hf_tokenizer import chat_tokenizer

    return chat_tokenizer(name.removeprefix("hf:"))
