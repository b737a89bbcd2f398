"""Access control: hosts, origins, keys, body sizes, and the owners of episodes."""

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

from goalscope.base.types import InvalidInputError
from goalscope.storage.store import EpisodeInfo, Store
from goalscope.web.errors import error_response

__all__ = ["CurrentVisitor", "Guard", "Visitor", "not_found", "visible_episode"]

MAX_BODY = 64 * 1024
"""Bytes."""

PUBLIC = (
    "/study/", "/api/studies/", "/static/study", "/static/style.css", "/static/dom.js",
    "/static/drafts.js", "/static/keys.js", "/static/status.js", "/static/icon.svg",
)  # fmt: skip
"""Paths without a password: participants of a study come with their own link."""

NO_ORIGIN = (
    "This request did not come from this server's own page. Programs must send the key as "
    "Authorization: Bearer KEY, without cookies."
)
FOREIGN_ORIGIN = (
    "Pages of other sites cannot change anything here, with or without a key (CORS is not "
    "supported). Send the request from that site's server, or from a program without an "
    "Origin header. If this is the server's own page, behind a proxy with TLS, the proxy "
    "must send X-Forwarded-Proto: https."
)

VISITOR_COOKIE, HOST_COOKIE, GUEST_COOKIE = "goalscope_visitor", "goalscope_host", "goalscope_guest"
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
"""Headers of every response that does not set them itself."""


class Visitor:
    """The sender of a request.

    Args:
        secret: The cookie of their browser, or the key that their program sends.
        key: The host's key, if they have it.

    Attributes:
        browser: Identifies the browser.
        id: Owner of the episodes that they start: the browser, or the host if they have the key.
        is_host: Whether they have the host's key, which shows everything.
    """

    def __init__(self, secret: str, key: str | None = None) -> None:
        self.browser = _digest(secret)[:16]
        self.id = _digest("host", key)[:16] if key else self.browser
        self.is_host = key is not None

    def owns(self, owner: str | None) -> bool:
        """Whether this owner is them; the host also owns what their browser started before."""
        return owner in (self.id, self.browser)


def _visitor(
    request: Request,
    _: Annotated[
        object,
        Security(
            HTTPBearer(
                scheme_name="key",
                auto_error=False,
                description="The key of the host; browsers keep a cookie instead.",
            )
        ),
    ],
) -> Visitor:
    return request.scope["state"]["visitor"]


CurrentVisitor = Annotated[Visitor, Depends(_visitor)]
"""The visitor whom the guard let in."""


def visible_episode(visitor: Visitor, store: Store, id: str, what: str = "episode") -> EpisodeInfo:
    """The episode with this full id, if the visitor may see it.

    Raises:
        HTTPException: 404, both for what does not exist and for what belongs to others.
    """
    try:
        info = store.episode(id)
    except InvalidInputError:
        info = None
    if info is None or info.id != id or not (visitor.is_host or visitor.owns(info.owner)):
        raise not_found(what)
    return info


def not_found(what: str) -> HTTPException:
    """The error for what does not exist or belongs to others."""
    return HTTPException(404, f"There is no such {what}, or it belongs to somebody else.")


class Guard:
    """Refuses requests from other sites and from strangers.

    A request must name this server as its host. A request that changes something must come from
    this server's own page, or from a program that sends the key and no cookies. With a password,
    every request needs a proof of it or of the key, except for the pages of studies.

    Args:
        app: The application.
        hosts: Names and ports of the server.
        key: The host's; it must be impossible to guess.
        password: The visitors' password, likewise; None admits everybody who can reach the server.
    """

    def __init__(
        self, app: ASGIApp, *, hosts: Collection[str], key: str, password: str | None = None
    ) -> None:
        self.app, self.hosts = app, frozenset(hosts)
        self._key = key
        self._keys = {HOST_COOKIE: key} | ({GUEST_COOKIE: password} if password else {})
        self._proofs = {
            name: hmac.new(key.encode(), f"{name} {shown}".encode(), "sha256").hexdigest()
            for name, shown in self._keys.items()
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
        elif scope["type"] == "http":
            request, cookies = Request(scope), list[str]()
            try:
                answer = self._admit(request, cookies)
            except HTTPException as error:
                answer = await error_response(request, error)
            await answer(scope, _limited(receive), _headed(send, cookies))
        else:
            await send({"type": "websocket.close", "code": 1008})

    def _admit(self, request: Request, cookies: list[str]) -> ASGIApp:
        """What answers a request; adds the cookies to set.

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
            raise HTTPException(401, "This is not the server's key. `goalscope serve` shows it.")
        reads, is_public = request.method in ("GET", "HEAD"), scope["path"].startswith(PUBLIC)
        shown = request.query_params.get("key", "") if reads and not is_public else ""
        enters = [name for name, key in self._keys.items() if _same(shown, key)]
        proven = [
            name
            for name, proof in self._proofs.items()
            if _same(request.cookies.get(name, ""), proof)
        ]
        if GUEST_COOKIE in self._keys and not (is_public or bearer or enters or proven):
            raise HTTPException(401, "This server needs a key. Open it once with ?key=...")
        origins, is_program = headers.getlist("origin"), bool(bearer) and "cookie" not in headers
        own = [f"{scope['scheme']}://{host}"]
        if not (reads or origins == own or (is_program and not origins)):
            raise HTTPException(403, FOREIGN_ORIGIN if origins else NO_ORIGIN)
        if enters:  # one proof does not replace the other
            cookies.append(_cookie(enters[0], self._proofs[enters[0]], scope))
            # The key leaves the address; after two slashes that would be another host's.
            return RedirectResponse("/" + scope["path"].lstrip("/"), 303)
        known = request.cookies.get(VISITOR_COOKIE, "")
        secret = known if len(known) >= 32 else bearer or secrets.token_urlsafe(32)
        if secret not in (known, bearer):
            cookies.append(_cookie(VISITOR_COOKIE, secret, scope))
        is_host = bool(bearer) or HOST_COOKIE in proven
        scope.setdefault("state", {})["visitor"] = Visitor(secret, self._key if is_host else None)
        return self.app


def _limited(receive: Receive) -> Receive:
    size = 0

    async def limited() -> Message:
        nonlocal size
        message = await receive()
        size += len(message.get("body", b""))
        if size > MAX_BODY:
            raise HTTPException(413, f"The request is longer than {MAX_BODY} bytes.")
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
    """SameSite=Lax, so that links of other sites send it, and no other cookie replaces it."""
    secure = "; Secure" if scope["scheme"] == "https" else ""
    return f"{name}={value}; Path=/; Max-Age={YEAR}; HttpOnly; SameSite=Lax{secure}"


def _same(given: str, key: str) -> bool:
    return hmac.compare_digest(given.encode(), key.encode())


def _digest(*secrets: str) -> str:
    return hashlib.sha256("\0".join(secrets).encode()).hexdigest()
