"""One OpenAI-compatible server and one of its models, asked by the `openai` client."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from ipaddress import ip_address
from typing import Any, cast
from urllib.parse import urlsplit

from goalscope.base.optional_packages import package
from goalscope.base.types import GoalscopeError, InvalidInputError, ModelError, pluralize

RETRIES = 3
_NO_KEY = "none"
_COUNTS = "prompt_tokens", "completion_tokens"
_REMEDIES = {
    401: "Set GOALSCOPE_API_KEY to a valid key for this server.",
    403: "Set GOALSCOPE_API_KEY to a key with access to this model.",
    404: "Check the address (most end in /v1) and the name of the model.",
    429: "Wait, raise the quota there, or use another model.",
}
_CERTIFICATES, _PROXIES = "SSL_CERT_FILE", "(ALL|HTTPS?)_PROXY"  # variables of the shell
_UNREADABLE = AttributeError, LookupError, OverflowError, RecursionError, TypeError, ValueError


class Refusal(ModelError):
    """The server refused the request."""


class Server:
    """One OpenAI-compatible server and one of its models.

    Temporary failures (no connection, 429, 5xx) are retried up to three times, after the delay that
    the server asks for.

    Attributes:
        url: Where it is.
        usage: Numbers of requests (retries do not count), and of prompt_tokens and
            completion_tokens as the server counts them.
    """

    def __init__(self, address: str, *, transport: Any = None) -> None:
        """Prepare a client; nothing is sent yet.

        The key is `GOALSCOPE_API_KEY`; for OpenAI's own address `OPENAI_API_KEY`, if there is one.
        `GOALSCOPE_PATIENCE` is the maximum of seconds of silence.

        Args:
            address: Such as "http://localhost:8000/v1#model-name"; the name can be left out for a
                server with one model.
            transport: HTTPX transport in place of the network.

        Raises:
            InvalidInputError: The address is invalid.
            ModelError: A package that it needs is missing, or as by `http_client`.
        """
        openai = self._openai = package("openai")
        base, _, self._model = address.partition("#")
        try:
            parts = urlsplit(base)
            if parts.scheme not in ("http", "https") or not parts.hostname or parts.port == 0:
                raise ValueError("it needs http or https, a host and a path")
            if parts.query:
                raise ValueError("it has a query")
            if "@" in parts.netloc:
                raise ValueError("a key belongs in GOALSCOPE_API_KEY, not in the address")
            self.url = f"{parts.scheme}://{parts.netloc}{parts.path.rstrip('/')}"
            key = _key(official=base.startswith("https://api.openai.com/"))
            self._client = openai.OpenAI(
                api_key=key or _NO_KEY,
                base_url=self.url,
                timeout=_patience(),
                max_retries=RETRIES,
                http_client=http_client(parts.hostname, transport),
            )
        except GoalscopeError:
            raise
        except Exception as error:  # a URL that the client refuses
            raise InvalidInputError(
                f"{base.rpartition('@')[2]} is not the address of a model server ({error}). "
                "Write it like http://localhost:8000/v1#model-name."
            ) from None
        self._options = {} if key else {"headers": {"Authorization": openai.Omit()}}
        self.usage = Counter[str]()
        self._origin = f"{parts.scheme}://{parts.netloc}"
        proxies = "" if _is_here(parts.hostname) else _set_variables(_PROXIES)
        self._proxies = proxies and f" If it needs no proxy ({proxies}), add its host to NO_PROXY."
        self._facts: dict[str, Any] = {}

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
                models = self._call("models", None)
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
        for size in (self.facts.get("max_model_len"), meta.get("n_ctx")):
            if isinstance(size, int) and size > 1:
                return size
        return 8192

    def post(self, path: str, body: Mapping[str, Any]) -> Any:
        """Send JSON to a path; one that begins with "/" is the server's, not the API's.

        Raises:
            Refusal: The server refused it.
            ModelError: There was no usable answer.
        """
        return self._call(self._origin + path if path.startswith("/") else path, body)

    def describe_usage(self) -> str:
        """The usage so far, in words."""
        asked, read, written = (self.usage[key] for key in ("requests", *_COUNTS))
        return f"{pluralize(asked, 'request')}, {read:,} tokens read, {written:,} written"

    def close(self) -> None:
        """Close the connections."""
        self._client.close()

    def _call(self, path: str, body: Mapping[str, Any] | None) -> Any:
        self.usage["requests"] += 1
        client, openai = self._client, self._openai
        try:
            ask = client.get if body is None else partial(client.post, body=body)
            answer: Any = ask(path, cast_to=object, options=self._options)
        except openai.APITimeoutError:
            raise ModelError(
                f"{self.url} did not answer in time. Is it overloaded? Try a smaller model, or set "
                "GOALSCOPE_PATIENCE to more seconds."
            ) from None
        except openai.APIConnectionError as error:
            reason = self._excerpt(str(error.__cause__ or error))
            if "CERTIFICATE_VERIFY_FAILED" in reason:
                raise ModelError(
                    f"The certificate of {self.url} is not trusted ({reason}). Name the file of "
                    "whoever issued it in SSL_CERT_FILE."
                ) from None
            raise ModelError(
                f"No server answers at {self.url} ({reason}). Start it, or check the address."
                + self._proxies
            ) from None
        except openai.APIStatusError as error:
            raise self._refusal(path, error.response) from None
        rows = cast("dict[str, Any]", answer) if isinstance(answer, dict) else {"error": answer}
        if rows.get("error"):
            said = self._excerpt(str(rows["error"]))
            raise ModelError(f"{self.url} sent no answer: {said}. Is it a model server?")
        with suppress(*_UNREADABLE):  # not all servers count
            self.usage.update({key: rows["usage"][key] + 0 for key in _COUNTS})
        return rows

    def _refusal(self, path: str, response: Any) -> Refusal:
        status: int = response.status_code
        said = self._excerpt(response.text)
        if status == 401:  # what is said of a wrong key may quote it
            said = "it needs a valid key."
        if response.has_redirect_location:
            said = f"it points to {self._excerpt(response.headers['location'])} instead."
        other = "Shorten the text." if "context" in said else "Use another address or model."
        if status >= 500:
            other = "Try again later." + self._proxies
        where = path.removeprefix(self._origin)
        return Refusal(
            f"{self.url} refused {where} (HTTP {status}): {said} {_REMEDIES.get(status, other)}"
        )

    def _excerpt(self, said: str) -> str:
        """What a server said, as one short line, without the key."""
        text = said[:65536]
        if (key := self._client.api_key) != _NO_KEY:
            text = text.replace(key, "[key]")
        text = "".join(letter if letter.isprintable() else " " for letter in text)
        return " ".join(text.split())[:300] or "(nothing)"


def http_client(host: str = "", transport: Any = None) -> Any:
    """An HTTPX client that obeys the shell's variables, but asks this machine without a proxy.

    Args:
        host: The only one that it will ask, if there is only one.
        transport: HTTPX transport in place of the network.

    Raises:
        ModelError: A variable of the shell cannot be obeyed, which is named, or HTTPX is missing.
    """
    httpx2 = package("httpx2")
    try:
        if transport is None and _is_here(host):
            transport = httpx2.HTTPTransport()
        # A redirect could take words, and the key, where nobody meant them to go.
        return httpx2.Client(transport=transport, follow_redirects=False)
    except (ImportError, OSError, ValueError, httpx2.InvalidURL) as error:
        names = _set_variables(_CERTIFICATES if isinstance(error, OSError) else _PROXIES)
        reason = str(error).partition(". ")[0]  # what HTTPX advises then is for another version
        raise ModelError(
            f"{names or 'A network setting'} cannot be used ({reason}). Correct it or unset it."
        ) from None


def _is_here(host: str) -> bool:
    """Whether a host is this machine, whatever a name server says."""
    with suppress(ValueError):
        address = ip_address(host)
        return address.is_loopback or address.is_unspecified
    return host == "localhost" or host.endswith(".localhost")


def _set_variables(pattern: str) -> str:
    names = (name for name, value in os.environ.items() if value)
    return " or ".join(name for name in names if re.fullmatch(pattern, name, re.IGNORECASE))


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
