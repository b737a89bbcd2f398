"""Open a model by a file, a folder, a name on the hub, or a server's address."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import cache, partial
from pathlib import Path
from typing import Any, cast

from goalscope.base.types import InvalidInputError, Message, ModelError
from goalscope.models import Array, Completion, OpenGenerator, OpenModel, OpenScorer
from goalscope.models.adapters import FITTED_TASK, NO_ADAPTER, adapter_file, shipped
from goalscope.models.cache import CachedModel
from goalscope.models.chat import ChatTokenizer

__all__ = ["MODEL_KEYS", "ModelSet"]
__all__ += ["forget", "model_label", "open_model", "open_reader", "parts", "unmeasured"]

MODEL_KEYS = ("model", "generator", "scorer", "tokenizer", "adapter")
"""The arguments of `open_model` that identify the model."""

_ADAPTER_FILE = r"[/\\]adapter\.gguf$"  # says less than the folder's name


class ModelSet:
    """A model that writes combined with one that scores (the paper's GPT-4o-mini and Llama 3).

    A text fits if it fits both.

    Attributes:
        generator: Writes.
        scorer: Scores.
        speaker: Scores utterances: the scorer, optionally with an adapter.
        reader: Reads utterances: the generator, optionally with an adapter.
        taught: Whether the reader has an adapter.
        writer: Proposes goals, needs and questions with an adapter; None without one.
    """

    def __init__(
        self,
        generator: OpenGenerator,
        scorer: OpenScorer,
        *,
        speaker: OpenScorer | None = None,
        reader: OpenGenerator | None = None,
        writer: OpenModel | None = None,
        one_tokenizer: bool = False,
    ) -> None:
        """Take them; `one_tokenizer` says that they count a text's tokens alike."""
        self.generator, self.scorer, self.speaker = generator, scorer, speaker or scorer
        self.reader, self.taught = reader or generator, reader is not None
        self.writer = writer
        self._one_tokenizer = one_tokenizer

    @property
    def name(self) -> str:
        """Both names, or the one of both."""
        names = dict.fromkeys((self.generator.name, self.scorer.name))
        return " and ".join(names)

    @property
    def context_size(self) -> int:
        """The smaller of both; an adapter changes none."""
        return min(self.generator.context_size, self.scorer.context_size)

    @property
    def fingerprint(self) -> str:
        """Of all."""
        used = [self.generator.fingerprint, self.scorer.fingerprint]
        used += [] if self.speaker is self.scorer else [self.speaker.fingerprint]
        used += [self.reader.fingerprint] if self.taught else []
        return " ".join([*used, *([self.writer.fingerprint] if self.writer else [])])

    @property
    def takes_grammar(self) -> bool:
        """Whether the one that writes takes a grammar."""
        return self.generator.takes_grammar

    def count_tokens(self, messages: Sequence[Message]) -> int:
        """The larger of both counts."""
        count = self.scorer.count_tokens(messages)
        return count if self._one_tokenizer else max(self.generator.count_tokens(messages), count)

    def generate(
        self,
        messages: Sequence[Message],
        *,
        max_tokens: int = 256,
        temperature: float = 0.0,
        seed: int = 0,
        stop: Sequence[str] = (),
        schema: Mapping[str, Any] | None = None,
        grammar: str | None = None,
    ) -> Completion:
        """See `Generator.generate`."""
        return self.generator.generate(
            messages,
            max_tokens=max_tokens,
            temperature=temperature,
            seed=seed,
            stop=stop,
            schema=schema,
            grammar=grammar,
        )

    def token_logprobs(
        self,
        contexts: Sequence[Sequence[Message]],
        continuations: Sequence[str],
        *,
        end_of_turn: bool = False,
    ) -> list[Array]:
        """See `LikelihoodModel.token_logprobs`."""
        return self.scorer.token_logprobs(contexts, continuations, end_of_turn=end_of_turn)

    def describe(self) -> str:
        """One line on all."""
        both = f"writes: {self.generator.describe()}; scores: {self.scorer.describe()}"
        if self.speaker is not self.scorer:
            both += f"; scores what people say: {self.speaker.describe()}"
        both += f"; reads: {self.reader.describe()}" if self.taught else ""
        return (
            f"{both}; proposes, plans and asks: {self.writer.describe()}" if self.writer else both
        )

    @property
    def parts(self) -> list[OpenGenerator | OpenScorer]:
        """All different models that it is made of."""
        used = [self.generator, self.scorer, self.speaker, self.reader, self.writer]
        return list({id(each): each for each in used if each is not None}.values())

    def close(self) -> None:
        """Close all."""
        for part in self.parts:
            part.close()


def unmeasured(names: Mapping[str, str | None]) -> bool:
    """Whether `open_model` with these `MODEL_KEYS` would first measure a file for a minute."""
    from goalscope.models.llama.model import embedded_path, processors
    from goalscope.models.llama.tune import waits

    used = {names.get(key) or names.get("model") for key in ("generator", "scorer")}
    files = (Path(name) if name else embedded_path() for name in used)
    return any(waits(file, processors()) for file in files if file.suffix == ".gguf")


def parts(model: OpenModel) -> tuple[OpenGenerator, OpenScorer]:
    """What writes and what scores the words of people, without any cache around them."""
    writer, scorer = (
        (model.generator, model.speaker) if isinstance(model, ModelSet) else (model, model)
    )
    return (
        writer.model if isinstance(writer, CachedModel) else writer,
        scorer.model if isinstance(scorer, CachedModel) else scorer,
    )


def forget(model: object) -> None:
    """Clear the caches of all parts of a model.

    The state of the cache decides which tokens are computed together, and so how sums are rounded:
    with 8-bit and 16-bit weights, log-probabilities vary by up to 0.1 nat.
    """
    if isinstance(model, ModelSet):
        for part in model.parts:
            forget(part)
    elif isinstance(model, CachedModel):
        forget(model.model)
    elif clear := getattr(model, "clear_cache", None):
        clear()


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
    calls: str | Path | None = None,
    report: Callable[[str, float], object] | None = None,
    measure: bool = True,
) -> OpenModel:
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
        calls: Cache file for all calls and answers; see `CachedModel`.
        report: Called with the progress of a first use; see `LlamaCpp`.
        measure: Whether a first use measures how a file runs fastest on this machine, which takes
            up to a minute; else it runs as it is, about half as fast.

    Raises:
        ModelError: A model, an adapter or a package is missing, or a file is damaged.
        InvalidInputError: A name is neither a text nor a path, or an adapter is named for a server.
    """
    given: dict[str, object] = dict(
        zip(MODEL_KEYS, (model, generator, scorer, tokenizer, adapter), strict=True), calls=calls
    )
    for key, name in given.items():
        if not isinstance(name, str | Path | None):
            raise InvalidInputError(f"{key} must be a text or a Path, not {name!r}.")
    writes, scores = generator or model, scorer or model
    adapted = _adapter(adapter, scores)
    local = partial(_local, report=report, measure=measure)
    with ExitStack() as opened:

        def kept(part: OpenGenerator | OpenScorer) -> OpenModel:
            """With its calls kept, where they are; it then still has only its own methods."""
            opened.callback(part.close)
            return cast("OpenModel", CachedModel(part, calls) if calls else part)

        one_file = writes == scores and not _is_address(writes)
        writing = kept(
            _served_generator(str(writes), tokenizer) if _is_address(writes) else local(writes)
        )
        scoring = writing
        if not one_file:
            scoring = kept(
                _served_scorer(str(scores), tokenizer) if _is_address(scores) else local(scores)
            )
        speaking = kept(local(scores, adapter=adapted)) if adapted else scoring
        taught = shipped("reader") if writes is None else None
        reading = kept(local(writes, adapter=taught, merge=True)) if taught else None
        planning = kept(local(writes, adapter=shipped("writer"), merge=True)) if taught else None
        result = (
            writing
            if speaking is writing and not reading
            else ModelSet(
                writing,
                scoring,
                speaker=speaking,
                reader=reading,
                writer=planning,
                one_tokenizer=one_file,
            )
        )
        opened.pop_all()
    return result


@cache
def embedded_scorer() -> OpenScorer:
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
    report: Callable[[str, float], object] | None = None,
) -> tuple[OpenGenerator, bool]:
    """Open the model that reads, and return whether it was fitted for it (see `Reader`).

    Args:
        model: As of `open_model`.
        adapter: GGUF file or folder of an adapter fitted for reading; "none" for none; by default,
            the one that ships with goalscope, for the embedded model.
        report: See `open_model`.

    Raises:
        ModelError: The model or the adapter is missing or broken.
        InvalidInputError: The adapter is named for a server, or was fitted on something else.
    """
    if _is_address(model):
        _adapter(adapter or NO_ADAPTER, model)
        return _served_generator(str(model), None), False
    given = None if adapter in (None, NO_ADAPTER) else _adapter(adapter, model)
    file = given or (shipped("reader") if model is None and adapter is None else None)
    opened = _local(model, report=report, adapter=file, merge=True)
    taught = getattr(opened, "adapter_metadata", {}).get(FITTED_TASK) == "writing"
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


def _local(
    name: str | Path | None,
    *,
    adapter: Path | None = None,
    merge: bool = False,
    report: Callable[[str, float], object] | None = None,
    measure: bool = True,
) -> OpenModel:
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

    return LlamaCpp(name, adapter=adapter, merge=merge, report=report, measure=measure)


def _served_generator(address: str, tokenizer: str | Path | None) -> OpenGenerator:
    from goalscope.models.served.client import Server
    from goalscope.models.served.generator import ServedGenerator

    return ServedGenerator(Server(address), _tokenizer(str(tokenizer)) if tokenizer else None)


def _served_scorer(address: str, tokenizer: str | Path | None) -> OpenScorer:
    from goalscope.models.served.client import Server
    from goalscope.models.served.scorer import ServedScorer

    server = Server(address)
    try:
        home = str(tokenizer or server.facts.get("root") or server.model)
    except ModelError:
        server.close()
        raise
    try:
        if not tokenizer and "/" not in home and not os.path.exists(home):
            raise ModelError(
                f"{home} is not a name on the Hugging Face hub of the form owner/name."
            )
        return ServedScorer(server, _tokenizer(home))
    except ModelError as error:
        server.close()
        if tokenizer:
            raise
        raise ModelError(
            f"Scoring needs the tokenizer of the model at {server.url}, which was not found "
            f"at {home!r} ({error}) Name it with --tokenizer, or open_model(tokenizer=...): a "
            "folder, a name on the hub or a GGUF file."
        ) from None


def _tokenizer(name: str) -> ChatTokenizer:
    if name.endswith(".gguf"):
        from goalscope.models.llama.native import Weights

        return Weights(Path(name), vocabulary_only=True).chat_tokenizer()
    from goalscope.models.hf_tokenizer import chat_tokenizer

    return chat_tokenizer(name.removeprefix("hf:"))
