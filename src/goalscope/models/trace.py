"""Traces: every call of a model as a line of JSON, and answers from a trace instead of a model.

A line has the fields of a model event in the logs of Inspect, and besides the episode, the round
and the module of Algorithm 1 that the call is for.
"""

from __future__ import annotations

import json
import os
import time
from collections import Counter
from collections.abc import Callable, Collection, Generator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime
from functools import wraps
from pathlib import Path
from typing import Any, Literal, TypeVar, cast, get_args

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.types import GoalscopeError, InvalidInputError, Message, UnreadableAnswerError
from goalscope.models import Completion, model_name

TracedModule = Literal[
    "query", "human", "read", "infer", "propose", "remove", "relevant", "plan", "judge"
]
"""The modules whose calls are told apart, in the order of a round."""

TRACED_MODULES: tuple[TracedModule, ...] = get_args(TracedModule)

Line = dict[str, Any]

_Method = TypeVar("_Method", bound=Callable[..., Any])

_place: ContextVar[Line] = ContextVar("place")
"""The episode, round and module that calls are for."""

_scored: ContextVar[Sequence[Line]] = ContextVar("scored", default=())
"""The goal and the turn of each pair that is being scored."""

_NOWHERE: Line = {"episode": "", "round": 0, "module": ""}

_active: Trace | None = None


@contextmanager
def during(**place: Any) -> Generator[None]:
    """Have the calls of the block count for this `episode`, `round` or `module`."""
    token = _place.set({**_place.get(_NOWHERE), **place})
    try:
        yield
    finally:
        _place.reset(token)


@contextmanager
def scoring(pairs: Sequence[Line]) -> Generator[None]:
    """Have the pairs that the block scores in one call stand with their `goal` and `turn`."""
    token = _scored.set(pairs)
    try:
        yield
    finally:
        _scored.reset(token)


def note(event: str, **what: Any) -> None:
    """Add a line that is no call of a model, if there is a trace."""
    if _active:
        _active.write({"event": event, **_place.get(_NOWHERE), **what})


def traced(method: _Method) -> _Method:
    """Have `generate` or `token_logprobs` of a model stand in the trace, if there is one."""

    @wraps(method)
    def call(model: Any, *args: Any, **options: Any) -> Any:
        if _active is None:
            return method(model, *args, **options)
        ask = _active.completion if method.__name__ == "generate" else _active.logprobs
        return ask(method, model, *args, **options)

    return cast("_Method", call)


class Trace:
    """A file to which each call of a model adds a line.

    A recording answers a call of a module that is not `live`: by the line of the same prompt, or
    else, where a text is written, by the same call of the same module in the same round.

    Args:
        file: Where lines are added; None for nowhere.
        recording: Lines of one episode of an earlier trace.
        live: Modules whose calls the models answer all the same.
    """

    def __init__(
        self, file: Path | None, recording: Sequence[Line] = (), live: Collection[str] = ()
    ) -> None:
        self._live = live
        self._counts = Counter[tuple[Any, ...]]()
        self._recorded: dict[tuple[Any, ...], Line] = {}
        for line in recording:
            if line["event"] == "model":
                self._recorded[self._nth(line)] = line
            if line["event"] in ("model", "score"):
                self._recorded[_exact(line)] = line
        self._counts.clear()
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND
        self._file = None if file is None else os.open(file, flags, 0o600)

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            os.close(self._file)

    def write(self, line: Line) -> None:
        """Add a line in one piece, so that processes can share a file."""
        if self._file is not None:
            now = datetime.now(UTC).isoformat(timespec="milliseconds")
            os.write(self._file, (json.dumps({**line, "timestamp": now}) + "\n").encode())

    def completion(
        self,
        method: Callable[..., Completion],
        model: Any,
        messages: Sequence[Message],
        **options: Any,
    ) -> Completion:
        """The reply of a model, or the recorded one."""
        config = {key: value for key, value in options.items() if value not in (None, (), 0)}
        line = _line("model", model, messages, writing=True) | {"config": config}
        nth, found = self._nth(line), None
        if line["module"] not in self._live:
            found = self._recorded.get(_exact(line)) or self._recorded.get(nth)
        start = time.monotonic()
        if found and "error" in found:
            self.write({**line, "error": found["error"], **_cost(start, found, line)})
            raise UnreadableAnswerError(found["error"])
        if found:
            output, usage = found["output"], found["output"]["usage"]
            reply = Completion(
                output["completion"],
                output["stop_reason"],
                usage["input_tokens"],
                usage["output_tokens"],
                output["logprob"],
                output["margins"] and tuple(output["margins"]),
            )
        else:
            try:
                reply = method(model, messages, **options)
            except GoalscopeError as error:
                self.write({**line, "error": str(error), **_cost(start, None, line)})
                raise
        self.write({
            **line,
            "output": {
                "completion": reply.text,
                "stop_reason": reply.finish,
                "usage": {
                    "input_tokens": reply.prompt_tokens,
                    "output_tokens": reply.completion_tokens,
                },
                "logprob": reply.log_probability,
                "margins": reply.margins,
            },
            **_cost(start, found, line),
        })  # fmt: skip
        return reply

    def logprobs(
        self,
        method: Callable[..., list[Array]],
        model: Any,
        contexts: Sequence[Sequence[Message]],
        continuations: Sequence[str],
    ) -> list[Array]:
        """The log-probabilities of a model or, where they are known, the recorded ones."""
        lines = [
            _line("score", model, context, writing=False) | {"words": words}
            for context, words in zip(contexts, continuations, strict=True)
        ]
        for line, about in zip(lines, _scored.get(), strict=False):
            line.update(about)
        known = [self._recorded.get(_exact(line)) for line in lines]
        new = [i for i, found in enumerate(known) if not found]
        start = time.monotonic()
        pairs = [contexts[i] for i in new], [continuations[i] for i in new]
        asked = method(model, *pairs) if new else []
        scored, rows = iter(asked), list[Array]()
        for line, found in zip(lines, known, strict=True):
            if found:
                listed = found["output"]["logprobs"]
                rows.append(np.array([each["logprob"] for each in listed], np.float64))
            else:
                rows.append(next(scored))
                pieces = _pieces(model, line["words"], len(rows[-1]))
                listed = [
                    {"token": token, "logprob": value}
                    for token, value in zip(pieces, rows[-1].tolist(), strict=True)
                ]
            cost = _cost(start, found, line, calls=len(new))
            self.write({**line, "output": {"logprobs": listed}, **cost})
        return rows

    def _nth(self, line: Line) -> tuple[Any, ...]:
        """Where the line stands in its module: it is the nth call of a round."""
        place = line["round"], line["module"]
        self._counts[place] += 1
        return (*place, self._counts[place])


@contextmanager
def tracing(
    file: Path | None, recording: Sequence[Line] = (), live: Collection[str] = ()
) -> Generator[None]:
    """Trace all calls in this process (see `Trace`), if there is a file or a recording."""
    global _active
    if file is None and not recording:
        yield
        return
    before, trace = _active, Trace(file, recording, live)
    _active = trace
    try:
        yield
    finally:
        _active = before
        trace.close()


def read_trace(file: Path) -> list[Line]:
    """The lines of a trace.

    Raises:
        InvalidInputError: The file cannot be read, or holds something else.
    """
    lines: list[Line] = []
    try:
        rows = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidInputError(f"{file} cannot be read: {error}") from None
    for number, row in enumerate(rows, 1):
        try:
            line = json.loads(row)
            _ = line["event"], line["episode"] + "", line["round"] + 0, line["module"] + ""
            if line["event"] in ("model", "score"):
                _ = line["time"] + 0.0, line["input"][0]["content"] + ""
                _ = line.get("error", "") + "" or _output(line)
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
            raise InvalidInputError(
                f"{file}, line {number}, is no line of a trace. `goalscope run --trace FILE` "
                "writes one."
            ) from None
        lines.append(line)
    return lines


def _output(line: Line) -> object:
    """What a call gave, which must be there."""
    given = line["output"]
    if line["event"] == "score":
        return line["words"] + "", [each["logprob"] + 0.0 for each in given["logprobs"]]
    usage = given["usage"]["input_tokens"] + given["usage"]["output_tokens"]
    return usage, given["completion"] + given["stop_reason"], given["logprob"], given["margins"]


def _line(event: str, model: Any, messages: Sequence[Message], *, writing: bool) -> Line:
    """What is known before a call; `prompt` is the text as the model sees it, with its markup."""
    line: Line = {"event": event, **_place.get(_NOWHERE), "model": str(model_name(model))}
    line["input"] = [{"role": each.role, "content": each.content} for each in messages]
    if tokenizer := getattr(model, "tokenizer", None):
        seen = tokenizer.render(messages, writing=writing)
        line["prompt"] = tokenizer.detokenize(seen, markup=True)
    return line


def _cost(start: float, found: Line | None, line: Line, calls: int = 1) -> Line:
    """Seconds that a call took, its share if several were made at once; or who answered it."""
    if found is None:
        return {"time": (time.monotonic() - start) / calls}
    same = found["input"] == line["input"]
    return {"time": 0.0, "answer": "recorded" if same else "recorded for another prompt"}


def _exact(line: Line) -> tuple[Any, ...]:
    asked = [line["input"], line.get("config"), line.get("words")]
    return line["module"], json.dumps(asked, sort_keys=True)


def _pieces(model: Any, words: str, number: int) -> list[str]:
    """The tokens of some words as texts; empty ones for a model without a tokenizer."""
    if tokenizer := getattr(model, "tokenizer", None):
        return [tokenizer.detokenize([token]) for token in tokenizer.tokenize(words)][:number]
    return [""] * number
