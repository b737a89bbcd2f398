"""Who may ask for what: hosts, origins, keys, lengths and rates."""

from __future__ import annotations

import hashlib
import hmac
import json
import secrets
from collections import OrderedDict
from collections.abc import Collection, Mapping, Sequence
from ipaddress import IPv6Address, ip_address
from typing import Annotated
from urllib.parse import parse_qs, quote

from fastapi import Depends, Request, Security
from fastapi.security import HTTPBearer
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
"""Wrong keys that are remembered."""

SHOW = "A program shows the key: Authorization: Bearer KEY"
CHANGES = f"That did not come from this server's own page. {SHOW}, without cookies."
FOREIGN = (
    "Pages of other sites change nothing here, whatever key they show (there is no CORS). Ask from "
    "that site's own server, or from a program that sends no Origin. If this is the server's own "
    "page, behind a proxy with TLS, the proxy must send X-Forwarded-Proto: https."
)

VISITOR, HOST, GUEST = "goalscope_visitor", "goalscope_host", "goalscope_guest"
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
    description="The key of the host or the visitors' password; browsers keep a cookie instead.",
)  # fmt: skip


def _visitor(request: Request, _: Annotated[object, Security(_SHOWN)]) -> Visitor:
    return request.scope["state"]["visitor"]


Guest = Annotated[Visitor, Depends(_visitor)]
"""The visitor whom the guard has let in."""


class Guard:
    """Refuses what a browser of another site, or a stranger, may not ask for.

    A request names this server as its host. What changes something comes from a page of this
    server, or from a program that shows the key and has no browser's cookies; only the program
    may be as fast as it likes. With a password, nobody comes in without it or the host's key, but
    for the pages of studies.

    A key cannot be guessed, but a password could be: who guesses too often must wait. Nobody waits
    who shows the host's key, or has a cookie that says that they have shown the password.

    Args:
        app: What is guarded.
        hosts: Names with ports under which the server is reached.
        key: Of the host; nobody may be able to guess it.
        password: Of the visitors; None where everybody who can reach the server may come in.
    """

    def __init__(
        self,
        app: ASGIApp,
        *,
        hosts: Collection[str],
        key: str,
        password: str | None = None,
    ) -> None:
        self.app = app
        self.hosts, self.key, self.password = frozenset(hosts), key, password
        self._proofs = {HOST: self._proof("host")}
        if password:
            self._proofs[GUEST] = self._proof(f"guest {password}")
        self._limits = Limits()
        self._guesses, self._guesses_of_all = Meter(GUESSES), Meter(GUESSES_OF_ALL)
        self._wrong: OrderedDict[str, None] = OrderedDict()

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
        if headers.get("x-forwarded-proto") == ["https"]:  # no page can make a browser say so
            scope["scheme"] = "https"
        cookies, address = _cookies(headers.get("cookie", [])), _address(scope)
        bearer = _bearer(headers)
        given = parse_qs(scope["query_string"].decode("latin-1")).get("key", [""])[0]
        kept = {name for name, is_so in self._proofs.items() if _same(cookies.get(name, ""), is_so)}
        if not kept:
            self._check_guesses({given, bearer} - {""}, address)
        is_host = HOST in kept or _same(given, self.key) or _same(bearer, self.key)
        of_study = scope["path"].startswith(OPEN)
        is_open = self.password is None or of_study
        if not (is_open or kept or self._fits(given) or self._fits(bearer)):
            raise HTTPException(401, "This server asks for a key: open it with ?key=... once.")
        if bearer and not self._fits(bearer):
            raise HTTPException(401, "That key is not this server's; `goalscope serve` has it.")
        origins, own = headers.get("origin", []), f"{scope['scheme']}://{host}"
        program = bool(bearer) and is_host and not headers.get("cookie")
        reads = scope["method"] in ("GET", "HEAD", "OPTIONS")
        if not (reads or origins == [own] or (program and not origins)):
            raise HTTPException(403, FOREIGN if origins else CHANGES)
        known = cookies.get(VISITOR, "")
        secret = known if len(known) >= 32 else bearer or secrets.token_urlsafe(32)
        visitor = Visitor(secret, self.key if is_host else None)
        if not program:
            self._limits.check(scope["method"], scope["path"], visitor.id, address)
        if self._fits(given) and scope["method"] == "GET" and not of_study:
            name = HOST if _same(given, self.key) else GUEST  # one does not replace the other
            await _enter(send, scope, _cookie(name, self._proofs[name], scope))
            return
        # Whoever comes by another site's link has not shown the cookies that they may have, and
        # must keep them; the page that they come to shows them when it asks for more.
        opens = not scope["path"].startswith("/api/") or "text/html" in str(headers.get("accept"))
        fresh = (
            [_cookie(VISITOR, secret, scope)] if not opens and secret not in (known, bearer) else []
        )
        scope.setdefault("state", {})["visitor"] = visitor
        await self.app(scope, _limited(receive), _headed(send, scope, fresh))

    def _fits(self, shown: str) -> bool:
        return _same(shown, self.key) or bool(self.password and _same(shown, self.password))

    def _proof(self, of: str) -> str:
        return hmac.new(self.key.encode(), of.encode(), "sha256").hexdigest()

    def _check_guesses(self, shown: set[str], address: str) -> None:
        """Count wrong keys, each of them once; who must wait learns nothing of passwords.

        Raises:
            HTTPException: 429.
        """
        for key in shown:
            if _same(key, self.key) or (digest := _digest(key)) in self._wrong:
                continue
            if wait := self._guesses.wait(address) or self._guesses_of_all.wait(""):
                raise too_much("Too many wrong keys were tried.", wait)
            if not self._fits(key):
                self._guesses.take(address)
                self._guesses_of_all.take("")
                self._wrong[digest] = None
                while len(self._wrong) > KNOWN:
                    self._wrong.popitem(last=False)


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


async def _enter(send: Send, scope: Scope, cookie: str) -> None:
    """Keep who showed the key that the address holds, and show the page without it."""
    headed = _headed(send, scope, [cookie])
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


def _bearer(headers: Mapping[str, Sequence[str]]) -> str:
    """The key that a program shows; "" for none.

    What a browser sends of another kind is a proxy's own, which all its visitors may share.

    Raises:
        HTTPException: 401: a program shows something else.
    """
    (given,) = headers.get("authorization", [""])[:1]
    kind, _, key = given.strip().partition(" ")
    if kind.lower() == "bearer":
        return key.strip()
    agent = "".join(headers.get("user-agent", ()))
    if kind and "Mozilla" not in agent and not headers.keys() & {"cookie", "origin"}:
        raise HTTPException(401, f"{SHOW}.")
    return ""


def _cookies(headers: list[str]) -> dict[str, str]:
    """All of them, also where another server at this name has set one that is malformed."""
    return {name: value for each in headers for name, value in cookie_parser(each).items()}


def _cookie(name: str, value: str, scope: Scope) -> str:
    secure = "; Secure" if scope.get("scheme") == "https" else ""
    # A link of another site opens the page for who has been let in; it comes with no visitor.
    same = "Strict" if name == VISITOR else "Lax"
    return f"{name}={value}; Path=/; Max-Age={YEAR}; HttpOnly; SameSite={same}{secure}"


def _address(scope: Scope) -> str:
    """Of who connects, which may be a proxy; of a home or a machine with IPv6, its network."""
    client = scope.get("client")
    try:
        address = ip_address(client[0] if client else "")
    except ValueError:
        return ""
    if isinstance(address, IPv6Address):
        return str(address.ipv4_mapped or int(address) >> 64)
    return str(address)


def _same(given: str, key: str) -> bool:
    return hmac.compare_digest(given.encode(), key.encode())


def _digest(*secrets: str) -> str:
    return hashlib.sha256("\0".join(secrets).encode()).hexdigest()
