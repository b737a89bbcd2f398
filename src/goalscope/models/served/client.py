"""A model server over HTTP: JSON in, JSON out, bounded in retries and in time."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Generator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Thread
from typing import TYPE_CHECKING, Any, cast
from urllib.parse import urlsplit

from goalscope.base.optional_packages import package
from goalscope.base.types import InvalidInputError, ModelError, pluralize
from goalscope.models.served.answers import codes_of, failed, message_of, seconds_asked

if TYPE_CHECKING:
    import httpx2
    import tenacity

__all__ = ["Refusal", "Server", "Usage", "understood"]

ATTEMPTS = 5
_LARGEST = 1 << 28  # bytes of one answer
_BUSY = {408, 409, 425, 429, 500, 502, 503, 504, 529}
_QUOTA = {
    "insufficient_quota",
    "billing_hard_limit_reached",
    "billing_not_active",
    "credit_balance_exhausted",
    "organization_spend_limit_exceeded",
    "organization_usage_limit_exceeded",
    "project_spend_limit_exceeded",
}
_LASTING = ("validation error", "is not supported", "Request too large")  # in HTTP 500 and 429
_REMEDIES = {
    401: "Set GOALSCOPE_API_KEY to a valid key for this server.",
    403: "Set GOALSCOPE_API_KEY to a key with access to this model.",
    404: "Check the address (most end in /v1) and the name of the model.",
}


@dataclass(slots=True)
class Usage:
    """The usage of a server so far.

    Attributes:
        requests: All requests, including failed ones.
        retries: Repeated requests.
        prompt_tokens: Read, as the server counts them.
        completion_tokens: Written.
    """

    requests: int = 0
    retries: int = 0
    prompt_tokens: int = 0
    completion_tokens: int = 0

    def __str__(self) -> str:
        return (
            f"{pluralize(self.requests, 'request')} ({self.retries} of them retries), "
            f"{self.prompt_tokens:,} tokens read, {self.completion_tokens:,} written"
        )


class Refusal(ModelError):
    """The server refused the request; retrying would not help.

    Attributes:
        status: HTTP status.
    """

    def __init__(self, message: str, status: int) -> None:
        super().__init__(message)
        self.status = status


class _Trouble(ModelError):
    """A temporary failure; `wait` is the delay that the server asked for, in seconds."""

    def __init__(self, message: str, wait: float | None = None) -> None:
        super().__init__(message)
        self.wait = wait


class Server:
    """One OpenAI-compatible server and one of its models.

    Temporary failures (no connection, truncated or invalid JSON, 429, 5xx) are retried up to four
    times, after the delay that the server asks for, or 0.5 to 8 s. An exhausted quota is not
    retried.

    Attributes:
        url: Where it is.
        usage: The usage so far.
    """

    def __init__(
        self,
        address: str,
        *,
        timeout: float | None = None,
        patience: float | None = None,
        transport: httpx2.BaseTransport | None = None,
    ) -> None:
        """Prepare a client; nothing is sent yet.

        The key is `GOALSCOPE_API_KEY`; for OpenAI's own address `OPENAI_API_KEY`, if there is one.

        Args:
            address: Such as "http://localhost:8000/v1#model-name"; the name can be left out for a
                server with one model.
            timeout: Maximum seconds of silence; `patience` if None.
            patience: Maximum seconds of a call with all its attempts; `GOALSCOPE_PATIENCE`, or 120,
                if None.
            transport: HTTPX transport in place of the network.

        Raises:
            InvalidInputError: The address is invalid.
            ModelError: A package that it needs is missing.
        """
        for needed in ("httpx2", "jsonschema", "tenacity"):
            package(needed)
        import httpx2

        base, _, self._model = address.partition("#")
        try:
            parts = urlsplit(base)
            wanted = parts.scheme in ("http", "https") and parts.hostname and parts.port != 0
            if not wanted or parts.query:
                raise ValueError("it needs http or https, a host and a path")
            if "@" in parts.netloc:
                raise ValueError("a key belongs in GOALSCOPE_API_KEY, not in the address")
            self._client = httpx2.Client(base_url=base.rstrip("/") + "/", transport=transport)
        except (ValueError, httpx2.InvalidURL) as error:
            raise InvalidInputError(
                f"{base.rpartition('@')[2]} is not the address of a model server ({error}). "
                "Write it like http://localhost:8000/v1#model-name."
            ) from None
        self.url = f"{parts.scheme}://{parts.netloc}{parts.path.rstrip('/')}"
        self.usage = Usage()
        self._origin = f"{parts.scheme}://{parts.netloc}"
        self._facts: dict[str, Any] = {}
        self._patience = patience or _patience()
        self._timeout = timeout or self._patience
        if key := _key(official=base.startswith("https://api.openai.com/")):
            self._client.headers["Authorization"] = f"Bearer {key}"

    @property
    def model(self) -> str:
        """The given name of the model, or that of the server's only model.

        Raises:
            ModelError: The server does not answer, or has several models.
        """
        return self._model or str(self.facts["id"])

    @property
    def facts(self) -> Mapping[str, Any]:
        """What the server lists about the model, such as `max_model_len`; asked for once."""
        if not self._facts:
            models: Any = {}
            try:
                models = self.get("models")
            except Refusal:
                if not self._model:
                    raise
            with understood(self.url):
                listed: list[dict[str, Any]] = models.get("data") or []
                mine = [m for m in listed if m.get("id") and self._model in ("", m["id"])]
            if not self._model and len(mine) != 1:
                names = ", ".join(str(m["id"]) for m in mine[:20]) or "none"
                raise ModelError(
                    f"{self.url} has these models: {names}. Choose one with {self.url}#MODEL."
                )
            self._facts = mine[0] if mine else {"id": self._model}
        return self._facts

    @property
    def fingerprint(self) -> str:
        """Address, name, and what the server lists of the model, but for what changes by itself."""
        lasting = {k: v for k, v in self.facts.items() if k not in ("created", "permission")}
        return f"{self.url} {self.model} {json.dumps(lasting, sort_keys=True)}"

    @property
    def context_size(self) -> int:
        """Most tokens of a prompt and its reply, by what servers list of a model; else 8192."""
        meta: Any = self.facts.get("meta") or {}
        known = (self.facts.get("max_model_len"), self.facts.get("context_length"))
        for size in (*known, meta.get("n_ctx")):
            if isinstance(size, int) and size > 1:
                return size
        return 8192

    def get(self, path: str) -> Any:
        """The JSON at a path.

        Raises:
            ModelError: There is none.
        """
        return self._call("GET", path, None, ATTEMPTS)

    def post(self, path: str, body: Mapping[str, Any], *, attempts: int = ATTEMPTS) -> Any:
        """Send JSON to a path; one that begins with "/" is the server's, not the API's.

        Args:
            path: The path.
            body: The JSON.
            attempts: How often to try.

        Raises:
            Refusal: The server refused it.
            ModelError: There was no usable answer.
        """
        return self._call("POST", path, body, attempts)

    def close(self) -> None:
        """Close the connections."""
        self._client.close()

    def _call(self, method: str, path: str, body: Mapping[str, Any] | None, attempts: int) -> Any:
        import tenacity

        deadline = time.monotonic() + self._patience
        retrying = tenacity.Retrying(
            retry=tenacity.retry_if_exception_type(_Trouble),
            stop=tenacity.stop_after_attempt(attempts) | tenacity.stop_before_delay(self._patience),
            wait=_wait,
            reraise=True,
        )
        tried = 0
        try:
            for attempt in retrying:
                with attempt:
                    self.usage.retries += tried > 0
                    tried += 1
                    return self._once(method, path, body, deadline)
        except _Trouble as trouble:
            wait = f" The server asks to wait {trouble.wait:.0f} s." if trouble.wait else ""
            times = "once" if tried == 1 else f"{tried} times"
            raise ModelError(f"{trouble}{wait} Tried {times}; try again later.") from None
        raise AssertionError("tenacity ends by a return or an error")

    def _once(self, method: str, path: str, body: Mapping[str, Any] | None, deadline: float) -> Any:
        import httpx2

        self.usage.requests += 1
        try:
            return self._read(path, *self._in_time(method, path, body, deadline))
        except (TimeoutError, httpx2.TimeoutException):
            raise _Trouble(
                f"{self.url} did not answer in time ({self._timeout:.0f} s of silence, "
                f"{self._patience:.0f} s in all). Is it overloaded? Try a smaller model."
            ) from None
        except httpx2.ConnectError as error:
            raise _Trouble(
                f"No server answers at {self.url} ({self._excerpt(str(error))}). "
                "Start it, or check the address."
            ) from None
        except httpx2.RequestError as error:
            raise _Trouble(
                f"{self.url} closed the connection in the middle of an answer "
                f"({self._excerpt(str(error))}). Is it still running?"
            ) from None

    def _in_time(
        self, method: str, path: str, body: Mapping[str, Any] | None, deadline: float
    ) -> tuple[httpx2.Response, bytes]:
        """The answer, in a thread that is left alone at the deadline: HTTPX bounds but silences."""
        seconds = max(0.1, deadline - time.monotonic())
        future: Future[tuple[httpx2.Response, bytes]] = Future()

        def work() -> None:
            try:
                future.set_result(self._fetch(method, path, body, seconds))
            except BaseException as error:
                future.set_exception(error)

        Thread(target=work, daemon=True).start()
        return future.result(seconds)

    def _fetch(
        self, method: str, path: str, body: Mapping[str, Any] | None, seconds: float
    ) -> tuple[httpx2.Response, bytes]:
        end = time.monotonic() + seconds
        with self._client.stream(
            method,
            self._origin + path if path.startswith("/") else path,
            json=body,
            timeout=min(self._timeout, seconds),
        ) as response:
            data = bytearray()
            for chunk in response.iter_bytes():
                data += chunk
                if len(data) > _LARGEST:
                    raise ModelError(
                        f"{self.url} sent more than {_LARGEST >> 20} MB. Is it a model server?"
                    )
                if time.monotonic() > end:
                    raise TimeoutError
            return response, bytes(data)

    def _read(self, path: str, response: httpx2.Response, data: bytes) -> Any:
        status = response.status_code
        try:
            answer: Any = json.loads(data)
        except (ValueError, RecursionError):
            answer = None
        said = self._excerpt(message_of(answer) or data)
        if status == 200 and answer is None:
            raise _Trouble(f"{self.url} sent no JSON: {said}. Is it a model server?")
        if status == 200 and not failed(answer):
            self._count(answer)
            return answer
        if codes_of(answer) & _QUOTA:
            raise Refusal(
                f"The quota at {self.url} is used up: {said} Raise it there, or use another model.",
                status,
            )
        if status in _BUSY and not any(mark in said for mark in _LASTING):
            raise _Trouble(f"{self.url} failed (HTTP {status}): {said}", seconds_asked(response))
        if status == 401:  # what is said of a wrong key may quote it
            said = "it needs a valid key."
        if response.has_redirect_location:
            said = f"it points to {self._excerpt(response.headers['location'])} instead."
        other = "Shorten the text." if "context" in said else "Use another address or model."
        remedy = _REMEDIES.get(status, other)
        raise Refusal(f"{self.url} refused {path} (HTTP {status}): {said} {remedy}", status)

    def _count(self, answer: object) -> None:
        usage = cast("dict[str, Any]", answer).get("usage") if isinstance(answer, dict) else None
        if isinstance(usage, dict):
            numbers = cast("dict[str, Any]", usage)
            for key in ("prompt_tokens", "completion_tokens"):
                if isinstance(numbers.get(key), int):
                    setattr(self.usage, key, getattr(self.usage, key) + numbers[key])

    def _excerpt(self, said: str | bytes) -> str:
        """What a server said, as one short line, without the key."""
        text = said[:65536].decode(errors="replace") if isinstance(said, bytes) else said[:65536]
        if key := self._client.headers.get("Authorization", "").removeprefix("Bearer "):
            text = text.replace(key, "[key]")
        text = "".join(letter if letter.isprintable() else " " for letter in text)
        return " ".join(text.split())[:300] or "(nothing)"


def _key(*, official: bool) -> str:
    """The key to send, empty if there is none."""
    names = [*(["OPENAI_API_KEY"] if official else []), "GOALSCOPE_API_KEY"]
    key = next(filter(None, (os.environ.get(name, "").strip() for name in names)), "")
    if not (key.isascii() and key.isprintable()):
        raise InvalidInputError(
            "The key in GOALSCOPE_API_KEY is invalid. Set it again, in plain ASCII."
        )
    return key


def _patience() -> float:
    said = os.environ.get("GOALSCOPE_PATIENCE", "120")
    try:
        if 0 < float(said) < 1e6:
            return float(said)
    except ValueError:
        pass
    raise InvalidInputError(
        f"GOALSCOPE_PATIENCE must be a number of seconds, such as 120, not {said!r}."
    )


_UNREADABLE = AttributeError, LookupError, OverflowError, RecursionError, TypeError, ValueError


@contextmanager
def understood(url: str) -> Generator[None]:
    """Convert errors from parsing an answer of unknown form to a `ModelError`."""
    try:
        yield
    except _UNREADABLE as error:
        what = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise ModelError(
            f"{url} sent an answer of an unknown form ({what}). Is it an OpenAI-compatible server?"
        ) from None


def _wait(state: tenacity.RetryCallState) -> float:
    """Seconds to wait: what the server asked for, or 0.5, 1, 2, 4, ..., up to 8."""
    error = state.outcome.exception() if state.outcome else None
    asked = error.wait if isinstance(error, _Trouble) else None
    return min(8.0, 0.5 * 2 ** (state.attempt_number - 1)) if asked is None else asked
