"""A cache of model calls on disk, so that an interrupted sweep repeats none."""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from threading import Lock
from typing import Any, cast

import numpy as np

from goalscope.base.types import GoalscopeError, InvalidInputError, Message
from goalscope.models import Array, Completion, OpenGenerator, OpenModel, OpenScorer

__all__ = ["CachedModel"]

_APPLICATION_ID = 0x474F4143  # "GOAC"


class CachedModel:
    """A model whose answers are cached in a file, shared with later processes.

    The key is the model's `fingerprint` (which includes its weights where possible), the messages
    and every setting. Processes can share a file, and threads this object.

    Attributes:
        hits: Answers found in the cache.
        misses: Answers computed by the model.
    """

    def __init__(self, model: OpenGenerator | OpenScorer, file: str | Path) -> None:
        """Open or create the cache file.

        Raises:
            InvalidInputError: It is something else, or cannot be opened.
        """
        self.model = cast("OpenModel", model)
        self.file = Path(os.path.expanduser(file))
        self.hits = self.misses = 0
        self._fingerprint = ""
        self._using = Lock()
        with self._guarded():
            self.file.parent.mkdir(parents=True, exist_ok=True)
            self._db = sqlite3.connect(
                self.file, timeout=30, isolation_level=None, check_same_thread=False
            )
            (found,) = self._db.execute("PRAGMA application_id").fetchone()
            (tables,) = self._db.execute("SELECT count(*) FROM sqlite_master").fetchone()
            if found != _APPLICATION_ID and tables:
                self._db.close()
                raise InvalidInputError(
                    f"{self.file} is not a cache of model calls. Name another file."
                )
            self._db.execute("PRAGMA journal_mode = WAL")
            self._db.execute(f"PRAGMA application_id = {_APPLICATION_ID}")
            self._db.execute(
                "CREATE TABLE IF NOT EXISTS calls (key TEXT PRIMARY KEY, answer TEXT NOT NULL) "
                "WITHOUT ROWID"
            )

    @property
    def name(self) -> str:
        """The model's name."""
        return self.model.name

    @property
    def fingerprint(self) -> str:
        """The model's, computed once."""
        self._fingerprint = self._fingerprint or self.model.fingerprint
        return self._fingerprint

    @property
    def context_size(self) -> int:
        """See `LanguageModel.context_size`."""
        return self.model.context_size

    @property
    def takes_grammar(self) -> bool:
        """See `Generator.takes_grammar`."""
        return self.model.takes_grammar

    def count_tokens(self, messages: Sequence[Message]) -> int:
        """See `LanguageModel.count_tokens`."""
        return self.model.count_tokens(messages)

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
        settings: dict[str, Any] = {
            "max_tokens": max_tokens,
            "temperature": temperature,
            "seed": seed,
            "stop": list(stop),
            "schema": schema,
        } | ({"grammar": grammar} if grammar is not None else {})
        key = self._key("generate", messages, settings)
        answer = self._find(key)
        if answer is None:
            answer = asdict(self.model.generate(messages, **settings))
            self._keep({key: answer})
        written = Completion(**answer)
        return replace(written, margins=written.margins and tuple(written.margins))

    def token_logprobs(
        self,
        contexts: Sequence[Sequence[Message]],
        continuations: Sequence[str],
        *,
        end_of_turn: bool = False,
    ) -> list[Array]:
        """See `LikelihoodModel.token_logprobs`; only pairs that are new go to the model."""
        settings = {"end_of_turn": end_of_turn}
        pairs = list(zip(contexts, continuations, strict=True))
        keys = [self._key("score", context, {**settings, "text": text}) for context, text in pairs]
        answers = {key: self._find(key) for key in dict.fromkeys(keys)}
        new = {key: pair for key, pair in zip(keys, pairs, strict=True) if answers[key] is None}
        if new:
            rows = self.model.token_logprobs(
                [context for context, _ in new.values()],
                [text for _, text in new.values()],
                end_of_turn=end_of_turn,
            )
            fresh = {key: row.tolist() for key, row in zip(new, rows, strict=True)}
            self._keep(fresh)
            answers |= fresh
        return [np.array(answers[key], np.float64) for key in keys]

    def describe(self) -> str:
        """One line on the model and the file."""
        return f"{self.model.describe()}, calls kept in {self.file}"

    def close(self) -> None:
        """Close the model and the file."""
        with self._using:
            self._db.close()
        self.model.close()

    def _key(self, kind: str, messages: Sequence[Message], settings: Mapping[str, Any]) -> str:
        chat = [[message.role, message.content] for message in messages]
        call = [self.fingerprint, kind, chat, settings]
        return hashlib.sha256(json.dumps(call, sort_keys=True).encode()).hexdigest()

    def _find(self, key: str) -> Any:
        with self._guarded():
            row = self._db.execute("SELECT answer FROM calls WHERE key = ?", (key,)).fetchone()
        self.hits += row is not None
        return json.loads(row[0]) if row else None

    def _keep(self, answers: Mapping[str, Any]) -> None:
        self.misses += len(answers)
        rows = [(key, json.dumps(answer, allow_nan=False)) for key, answer in answers.items()]
        with self._guarded(), self._db:
            self._db.execute("BEGIN IMMEDIATE")
            self._db.executemany("INSERT OR REPLACE INTO calls VALUES (?, ?)", rows)

    @contextmanager
    def _guarded(self) -> Generator[None]:
        try:
            with self._using:
                yield
        except (sqlite3.Error, OSError) as error:
            raise GoalscopeError(
                f"Cannot use the cache of model calls {self.file} ({error}). Free some space, "
                "delete the file, or continue without it."
            ) from error
