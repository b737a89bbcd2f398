"""Who may ask for what: hosts, origins, keys, lengths and rates."""

from __future__ import annotations

import hashlib
import hmac
import json
import secrets
from asyncio import to_thread
from collections import OrderedDict
from collections.abc import Callable, Collection
from typing import Annotated
from urllib.parse import parse_qs, quote, unquote

from fastapi import Depends, Request
from starlette.exceptions import HTTPException
from starlette.requests import cookie_parser
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from goalscope.web.limits import GUESSES, GUESSES_OF_ALL, Limits, Meter, too_much

__all__ = ["Guard", "Guest", "Visitor"]

LARGEST = 64 * 1024
"""Bytes of a request's body."""

OPEN = (
    "/study/", "/api/studies/", "/static/study", "/static/style.css", "/static/dom.js",
    "/static/status.js", "/static/icon.svg",
)  # fmt: skip
"""Paths that need no password: those who take part in a study are strangers."""

KNOWN = 10_000
"""Right and wrong keys that are remembered."""

VISITOR, KEY = "goalscope_visitor", "goalscope_key"
YEAR = 365 * 24 * 3600

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
HEADERS = {
    b"x-content-type-options": b"nosniff",
    b"referrer-policy": b"no-referrer",
    b"cross-origin-opener-policy": b"same-origin",
    b"cross-origin-resource-policy": b"same-origin",
    b"x-frame-options": b"DENY",
}


class Visitor:
    """Who asks.

    Attributes:
        id: Of the visitor, made from a secret that only their browser has.
        is_host: Whether they have the key of the one who runs the server, and see everything.
    """

    def __init__(self, secret: str, *, is_host: bool) -> None:
        self.id = hashlib.sha256(secret.encode()).hexdigest()[:16]
        self.is_host = is_host


def _visitor(request: Request) -> Visitor:
    return request.scope["state"]["visitor"]


Guest = Annotated[Visitor, Depends(_visitor)]
"""The visitor whom the guard has let in."""


class Guard:
    """Refuses what a browser of another site, or a stranger, may not ask for.

    A request names this server as its host. What changes something comes from a page of this
    server, or from a program that shows the key and has no browser's cookies; only the program
    may be as fast as it likes. With a password, nobody comes in without it or the host's key, but
    for the pages of studies.

    Args:
        app: What is guarded.
        hosts: Names with ports under which the server is reached.
        key: Of the host.
        password: Of the visitors; None where everybody who can reach the server may come in.
        moved: Is told the old and the new id of a visitor whose id changes.
    """

    def __init__(
        self,
        app: ASGIApp,
        *,
        hosts: Collection[str],
        key: str,
        password: str | None = None,
        moved: Callable[[str, str], object] | None = None,
    ) -> None:
        self.app = app
        self.hosts, self.key, self.password = frozenset(hosts), key, password
        self._moved = moved
        self._limits = Limits()
        self._guesses, self._guesses_of_all = Meter(GUESSES), Meter(GUESSES_OF_ALL)
        self._wrong: OrderedDict[str, None] = OrderedDict()
        self._right: OrderedDict[str, None] = OrderedDict()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or answer it."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
        elif scope["type"] == "http":
            try:
                await self._http(scope, receive, send)
            except HTTPException as error:
                await _refuse(send, error)
        else:
            await send({"type": "websocket.close", "code": 1008})

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.decode("latin-1"), []).append(value.decode("latin-1"))
        (host,) = headers.get("host", []) if len(headers.get("host", [])) == 1 else ("",)
        if host not in self.hosts:
            raise HTTPException(403, f"This server is not {host or 'that host'}. Use its own name.")
        cookies = _cookies(headers.get("cookie", []))
        kind, _, bearer = headers.get("authorization", [""])[0].partition(" ")
        if kind != "Bearer":  # a proxy's own, such as Basic, which all its visitors may share
            bearer = ""
        given = parse_qs(scope["query_string"].decode("latin-1")).get("key", [""])[0]
        kept = unquote(cookies.get(KEY, ""))
        self._check_guesses({given, bearer, kept} - {""}, cookies.get(VISITOR, ""), _address(scope))
        is_host = any(_same(shown, self.key) for shown in (given, bearer, kept))
        of_study = scope["path"].startswith(OPEN)
        is_open = self.password is None or of_study
        if not (is_open or any(map(self._fits, (given, bearer, kept)))):
            raise HTTPException(401, "This server asks for a key: open it with ?key=... once.")
        if bearer and not self._fits(bearer):
            raise HTTPException(401, "That key is not this server's; `goalscope serve` has it.")
        origins, own = headers.get("origin", []), f"{scope['scheme']}://{host}"
        program = bool(bearer) and is_host and not headers.get("cookie")
        reads = scope["method"] in ("GET", "HEAD", "OPTIONS")
        if not (reads or origins == [own] or (program and not origins)):
            error = "That did not come from this server's own page. A program shows the key: "
            raise HTTPException(403, error + "Authorization: Bearer KEY, without cookies.")
        if not program:
            visitor = cookies.get(VISITOR, "")
            self._limits.check(scope["method"], scope["path"], visitor, _address(scope))
        # Who comes by another site's link has not shown the cookies that they may have.
        by_link = headers.get("sec-fetch-site") == ["cross-site"]
        fresh: list[str] = []
        if self._fits(given) and scope["method"] == "GET" and not of_study:
            if not (by_link or _same(given, kept)):
                renewed = await self._renewed(cookies.get(VISITOR, ""))
                _remember(self._right, _digest(renewed, given))
                fresh.append(_cookie(VISITOR, renewed, scope))
            await _enter(send, scope, given, fresh)
            return
        secret = cookies.get(VISITOR, "") or bearer
        if len(secret) < 32 and not bearer:
            secret = secrets.token_urlsafe(32)
            if not (by_link or scope["path"].startswith("/static/")):
                fresh.append(_cookie(VISITOR, secret, scope))
        scope.setdefault("state", {})["visitor"] = Visitor(secret, is_host=is_host)
        await self.app(scope, _limited(receive), _headed(send, scope, fresh))

    def _fits(self, shown: str) -> bool:
        return _same(shown, self.key) or bool(self.password and _same(shown, self.password))

    def _check_guesses(self, shown: set[str], visitor: str, address: str) -> None:
        """Count wrong keys, each of them once.

        Who guesses too often must wait, and learns nothing meanwhile. Nobody waits for the key that
        their browser has shown before.

        Raises:
            HTTPException: 429.
        """
        new = {
            key
            for key in shown
            if _digest(key) not in self._wrong and _digest(visitor, key) not in self._right
        }
        if new and (wait := self._guesses.wait(address) or self._guesses_of_all.wait("")):
            raise too_much("Too many wrong keys were tried.", wait)
        for key in new:
            if not self._fits(key):
                self._guesses.take(address)
                self._guesses_of_all.take("")
                _remember(self._wrong, _digest(key))
            elif visitor:
                _remember(self._right, _digest(visitor, key))

    async def _renewed(self, secret: str) -> str:
        """Another secret for a visitor, who keeps what is theirs; nobody can have planted it."""
        if not secret:
            return secrets.token_urlsafe(32)
        new = hmac.new(self.key.encode(), secret.encode(), "sha256").hexdigest()
        if self._moved:
            ids = (Visitor(each, is_host=False).id for each in (secret, new))
            await to_thread(self._moved, *ids)
        return new


def _limited(receive: Receive) -> Receive:
    seen = 0

    async def limited() -> Message:
        nonlocal seen
        message = await receive()
        seen += len(message.get("body", b""))
        if seen > LARGEST:
            raise HTTPException(413, f"That is longer than {LARGEST} bytes.")
        return message

    return limited


def _headed(send: Send, scope: Scope, cookies: list[str]) -> Send:
    async def headed(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = message.setdefault("headers", [])
            there = {name.lower() for name, _ in headers}
            headers += [(name, value) for name, value in HEADERS.items() if name not in there]
            if b"content-security-policy" not in there:
                headers.append((b"content-security-policy", POLICY.encode()))
            if b"cache-control" not in there:
                headers.append((b"cache-control", b"no-store"))
            headers += [(b"set-cookie", cookie.encode()) for cookie in cookies]
        await send(message)

    return headed


async def _enter(send: Send, scope: Scope, key: str, cookies: list[str]) -> None:
    """Keep the key that the address holds, and show the page under an address without it."""
    headed = _headed(send, scope, [_cookie(KEY, quote(key, safe=""), scope), *cookies])
    place = "/" + quote(scope["path"].lstrip("/"))  # after two slashes it would be another host
    headers = [(b"location", place.encode()), (b"content-length", b"0")]
    await headed({"type": "http.response.start", "status": 303, "headers": headers})
    await headed({"type": "http.response.body", "body": b""})


async def _refuse(send: Send, refusal: HTTPException) -> None:
    body = json.dumps({"error": refusal.detail}).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", b"%d" % len(body))]
    headers += [(name.lower().encode(), v.encode()) for name, v in (refusal.headers or {}).items()]
    headed = _headed(send, {}, [])
    status = refusal.status_code
    await headed({"type": "http.response.start", "status": status, "headers": headers})
    await headed({"type": "http.response.body", "body": body})


def _cookies(headers: list[str]) -> dict[str, str]:
    """All of them, also where another server at this name has set one that is malformed."""
    return {name: value for each in headers for name, value in cookie_parser(each).items()}


def _cookie(name: str, value: str, scope: Scope) -> str:
    secure = "; Secure" if scope.get("scheme") == "https" else ""
    return f"{name}={value}; Path=/; Max-Age={YEAR}; HttpOnly; SameSite=Strict{secure}"


def _address(scope: Scope) -> str:
    client = scope.get("client")
    return client[0] if client else ""


def _same(given: str, key: str) -> bool:
    return hmac.compare_digest(given.encode(), key.encode())


def _digest(*secrets: str) -> str:
    return hashlib.sha256("\0".join(secrets).encode()).hexdigest()


def _remember(known: OrderedDict[str, None], digest: str) -> None:
    known[digest] = None
    while len(known) > KNOWN:
        known.popitem(last=False)
