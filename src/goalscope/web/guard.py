"""Who may ask for what: hosts, origins, keys and lengths."""

from __future__ import annotations

import hashlib
import hmac
import secrets
from collections.abc import Collection
from typing import Annotated

from fastapi import Depends, Request, Security
from fastapi.security import HTTPBearer
from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from goalscope.web.refusals import refused

__all__ = ["Guard", "Guest", "Visitor"]

LARGEST = 64 * 1024
"""Bytes of a request's body."""

OPEN = (
    "/study/", "/api/studies/", "/static/study", "/static/style.css", "/static/dom.js",
    "/static/status.js", "/static/icon.svg",
)  # fmt: skip
"""Paths that need no password: who takes part in a study comes by a link of their own."""

CHANGES = (
    "That did not come from this server's own page. A program shows the key: Authorization: "
    "Bearer KEY, without cookies."
)
FOREIGN = (
    "Pages of other sites change nothing here, whatever key they show (there is no CORS). Ask from "
    "that site's own server, or from a program that sends no Origin. If this is the server's own "
    "page, behind a proxy with TLS, the proxy must send X-Forwarded-Proto: https."
)

VISITOR, HOST, GUEST = "goalscope_visitor", "goalscope_host", "goalscope_guest"
YEAR = 365 * 24 * 3600

HEADERS = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' data:; connect-src 'self'; form-action 'self'; base-uri 'none'; "
    "frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "x-frame-options": "DENY",
    "cache-control": "no-store",
}
"""Of every answer that does not set them itself."""


class Visitor:
    """Who asks.

    Args:
        secret: That their browser keeps, or that their program shows.
        key: Of the one who runs the server, if they have it.

    Attributes:
        browser: Theirs.
        id: Whose is what they begin: the browser's, or, from wherever they have the key, the
            host's.
        is_host: Whether they have the key, and see everything.
    """

    def __init__(self, secret: str, key: str | None = None) -> None:
        self.browser = _digest(secret)[:16]
        self.id = _digest("host", key)[:16] if key else self.browser
        self.is_host = key is not None

    def owns(self, owner: str | None) -> bool:
        """Whether what this owner has is theirs; the host goes on with what the browser began."""
        return owner in (self.id, self.browser)


_SHOWN = HTTPBearer(
    scheme_name="key", auto_error=False,
    description="The key of the host; browsers keep a cookie instead.",
)  # fmt: skip


def _visitor(request: Request, _: Annotated[object, Security(_SHOWN)]) -> Visitor:
    return request.scope["state"]["visitor"]


Guest = Annotated[Visitor, Depends(_visitor)]
"""The visitor whom the guard has let in."""


class Guard:
    """Refuses what a browser of another site, or a stranger, may not ask for.

    A request names this server as its host. What changes something comes from a page of this
    server, or from a program that shows the key and has no browser's cookies. With a password,
    nobody comes in without it or the host's key, but for the pages of studies.

    Args:
        app: What is guarded.
        hosts: Names with ports under which the server is reached.
        key: Of the host; nobody may be able to guess it.
        password: Of the visitors, likewise; None where everybody who can reach the server may come
            in.
    """

    def __init__(
        self, app: ASGIApp, *, hosts: Collection[str], key: str, password: str | None = None
    ) -> None:
        self.app, self.hosts = app, frozenset(hosts)
        self._key = key
        self._keys = {HOST: key} | ({GUEST: password} if password else {})
        self._proofs = {
            name: hmac.new(key.encode(), f"{name} {shown}".encode(), "sha256").hexdigest()
            for name, shown in self._keys.items()
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or answer it."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
        elif scope["type"] == "http":
            request, cookies = Request(scope), list[str]()
            try:
                answer = self._let_in(request, cookies)
            except HTTPException as error:
                answer = await refused(request, error)
            await answer(scope, _limited(receive), _headed(send, cookies))
        else:
            await send({"type": "websocket.close", "code": 1008})

    def _let_in(self, request: Request, cookies: list[str]) -> ASGIApp:
        """What answers a request; adds the cookies that come with the answer.

        Raises:
            HTTPException: 401, 403.
        """
        scope, headers = request.scope, request.headers
        host = ", ".join(headers.getlist("host"))
        if host not in self.hosts:
            raise HTTPException(403, f"This server is not {host or 'that host'}. Use its own name.")
        if headers.getlist("x-forwarded-proto") == ["https"]:  # no page can make a browser say so
            scope["scheme"] = "https"
        kind, _, bearer = headers.get("authorization", "").strip().partition(" ")
        bearer = bearer.strip() if kind.lower() == "bearer" else ""
        if bearer and not _same(bearer, self._key):
            raise HTTPException(401, "That key is not this server's; `goalscope serve` has it.")
        reads, of_study = request.method in ("GET", "HEAD"), scope["path"].startswith(OPEN)
        shown = request.query_params.get("key", "") if reads and not of_study else ""
        enters = [name for name, key in self._keys.items() if _same(shown, key)]
        kept = [
            name
            for name, proof in self._proofs.items()
            if _same(request.cookies.get(name, ""), proof)
        ]
        if GUEST in self._keys and not (of_study or bearer or enters or kept):
            raise HTTPException(401, "This server asks for a key: open it with ?key=... once.")
        origins, program = headers.getlist("origin"), bool(bearer) and "cookie" not in headers
        own = [f"{scope['scheme']}://{host}"]
        if not (reads or origins == own or (program and not origins)):
            raise HTTPException(403, FOREIGN if origins else CHANGES)
        if enters:  # one proof does not replace the other
            cookies.append(_cookie(enters[0], self._proofs[enters[0]], scope))
            # The key leaves the address; after two slashes that would be another host's.
            return RedirectResponse("/" + scope["path"].lstrip("/"), 303)
        known = request.cookies.get(VISITOR, "")
        secret = known if len(known) >= 32 else bearer or secrets.token_urlsafe(32)
        if secret not in (known, bearer):
            cookies.append(_cookie(VISITOR, secret, scope))
        is_host = bool(bearer) or HOST in kept
        scope.setdefault("state", {})["visitor"] = Visitor(secret, self._key if is_host else None)
        return self.app


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


def _headed(send: Send, cookies: list[str]) -> Send:
    async def headed(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers.setdefault(name, value)
            for cookie in cookies:
                headers.append("set-cookie", cookie)
        await send(message)

    return headed


def _cookie(name: str, value: str, scope: Scope) -> str:
    """Lax: who follows a link of another site shows who they are, and is sent no other cookie."""
    secure = "; Secure" if scope["scheme"] == "https" else ""
    return f"{name}={value}; Path=/; Max-Age={YEAR}; HttpOnly; SameSite=Lax{secure}"


def _same(given: str, key: str) -> bool:
    return hmac.compare_digest(given.encode(), key.encode())


def _digest(*secrets: str) -> str:
    return hashlib.sha256("\0".join(secrets).encode()).hexdigest()
