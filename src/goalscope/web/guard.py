"""Access control: hosts, origins, the key, body sizes, and error responses."""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from collections.abc import Collection
from contextlib import suppress
from ipaddress import IPv6Address
from typing import Annotated

from fastapi import Depends, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel
from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from goalscope.base.types import ConflictError, InvalidInputError
from goalscope.web.views import explained

MAX_BODY = 64 * 1024
"""Bytes."""

PUBLIC = (
    "/study/", "/api/studies/", "/static/study", "/static/style.css", "/static/inter",
    "/static/dom.js", "/static/drafts.js", "/static/keys.js", "/static/status.js", "/static/icon",
)  # fmt: skip
"""Paths without a key: participants of a study come with their own link."""

NO_KEY = (
    "This server needs its key. Open the address that `goalscope serve` prints; programs send "
    "Authorization: Bearer KEY."
)
NO_ORIGIN = (
    "This request did not come from this server's own page. Programs must send the key as "
    "Authorization: Bearer KEY, without cookies."
)
FOREIGN_ORIGIN = (
    "Pages of other sites cannot change anything here, with or without a key (CORS is not "
    "supported). Send the request from that site's server, or from a program without an "
    "Origin header. If this is the server's own page, behind a proxy with TLS, the proxy "
    "must pass on the header Host and send X-Forwarded-Proto: https."
)
FOREIGN_HOST = (
    "The server has another name. Use the address it printed, or start it with --name HOST[:PORT]."
)
EXPLANATIONS = {
    400: "The body cannot be read. Send a JSON object in UTF-8.",
    404: "There is nothing at this address. /api/openapi.json lists all addresses.",
    405: "This address does not support this method. /api/openapi.json lists the supported ones.",
}
"""Replacements for the terse messages of the libraries below."""

_LOOPBACK = re.compile(r"(localhost|127(\.[0-9]{1,3}){3}|\[::1\])(:[0-9]{1,5})?")
_HOST = re.compile(r"((?:[a-z0-9_-]+\.)*[a-z0-9_-]+|\[([0-9a-f:.]+)\])(:[1-9][0-9]{0,4})?")

KEY_COOKIE, RATER_COOKIE = "goalscope_key", "goalscope_rater"
YEAR = 365 * 24 * 3600

HEADERS = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "font-src 'self'; img-src 'self' data:; connect-src 'self'; form-action 'self'; "
    "base-uri 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "x-frame-options": "DENY",
    "cache-control": "no-store",
}
"""Headers of every response that does not set them itself."""


def _rater(request: Request) -> str:
    return request.scope["state"]["rater"]


Rater = Annotated[str, Depends(_rater)]
"""Identifies the browser of a study's participant."""


def host_name(name: str) -> str:
    """HOST[:PORT] as browsers send it: in small letters, and a number of IPv6 in its short form.

    Raises:
        InvalidInputError: It has another form, in which no browser sends it.
    """
    with suppress(ValueError):
        if (found := _HOST.fullmatch(name.lower())) and int((found[3] or ":1")[1:]) < 1 << 16:
            host = f"[{IPv6Address(found[2])}]" if found[2] else found[1]
            return host + (found[3] or "")
    raise InvalidInputError(
        f"--name {name!r} does not have the form HOST[:PORT], such as goals.example.org or "
        "[2001:db8::1]:8000. Leave out https:// and what follows the host."
    )


class Guard:
    """Refuses requests from other sites and from strangers.

    A request must name this server as its host, and prove that its sender has the key, except for
    the pages of studies. A request that changes something must come from this server's own page,
    or from a program that sends the key and no cookies.

    The host keeps DNS rebinding out: a page of evil.example whose name is made to lead here comes
    as evil.example, since browsers take Host from the address of the page. So only names that no
    stranger can make lead here count: the given ones, and `localhost` and loopback numbers, which
    no DNS server is asked for; "localhost" within a longer name does not. Their port is free, for
    a tunnel or a container may have another one outside. A page of another local port gains
    nothing by that: its Origin has its own port, and must equal the scheme and Host of the request.

    The scheme is what the first proxy of X-Forwarded-Proto says. A page of another origin cannot
    send that header (its browser asks for leave first, which is refused), and whoever can send it
    still needs the key.

    Args:
        app: The application.
        hosts: Other names of the server, each with its port, as by `host_name`.
        key: It must be impossible to guess.
    """

    def __init__(self, app: ASGIApp, *, hosts: Collection[str], key: str) -> None:
        self.app, self.hosts = app, frozenset(hosts)
        self._key = key
        self._proof = hmac.new(key.encode(), KEY_COOKIE.encode(), "sha256").hexdigest()

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
        outermost = ",".join(headers.getlist("x-forwarded-proto")).lower().partition(",")[0].strip()
        if outermost in ("http", "https"):
            scope["scheme"] = outermost
        default = ":443" if scope["scheme"] == "https" else ":80"  # which browsers leave out
        host = ", ".join(headers.getlist("host")).lower().removesuffix(default)
        if not (_LOOPBACK.fullmatch(host) or self.hosts & {host, host + default}):
            raise HTTPException(403, FOREIGN_HOST)
        kind, _, bearer = headers.get("authorization", "").strip().partition(" ")
        bearer = bearer.strip() if kind.lower() == "bearer" else ""
        if bearer and not _same(bearer, self._key):
            raise HTTPException(401, "This is not the server's key. `goalscope serve` shows it.")
        reads, is_public = request.method in ("GET", "HEAD"), scope["path"].startswith(PUBLIC)
        shown = request.query_params.get("key", "") if reads and not is_public else ""
        enters = _same(shown, self._key)
        known = _same(request.cookies.get(KEY_COOKIE, ""), self._proof)
        if not (is_public or bearer or enters or known):
            raise HTTPException(401, NO_KEY)
        origins, is_program = headers.getlist("origin"), bool(bearer) and "cookie" not in headers
        own = [f"{scope['scheme']}://{host}"]
        if not (reads or origins == own or (is_program and not origins)):
            raise HTTPException(403, FOREIGN_ORIGIN if origins else NO_ORIGIN)
        if enters:
            cookies.append(_cookie(KEY_COOKIE, self._proof, scope))
            # The key leaves the address; after two slashes that would be another host's.
            return RedirectResponse("/" + scope["path"].lstrip("/"), 303)
        if is_public:
            rater = request.cookies.get(RATER_COOKIE, "")
            if len(rater) < 32:
                rater = secrets.token_urlsafe(32)
                cookies.append(_cookie(RATER_COOKIE, rater, scope))
            digest = hashlib.sha256(rater.encode()).hexdigest()
            scope.setdefault("state", {})["rater"] = digest[:16]
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


class ErrorBody(BaseModel):
    """Why a request failed, in a sentence that says what to do."""

    error: str


async def error_response(request: Request, error: Exception) -> JSONResponse:
    """The response to a request that failed with this error."""
    headers = None
    if isinstance(error, HTTPException):
        status, detail, headers = error.status_code, error.detail, error.headers
        if not detail.endswith("."):
            detail = EXPLANATIONS.get(status, detail)
    elif isinstance(error, RequestValidationError):
        status, detail = 422, _explained(request, error)
    else:
        bad = 400 if isinstance(error, InvalidInputError) else 503
        status, detail = 409 if isinstance(error, ConflictError) else bad, str(error)
    return JSONResponse({"error": detail}, status, headers)


def _explained(request: Request, error: RequestValidationError) -> str:
    fault = error.errors()[0]
    place, *path = fault["loc"]
    if place != "body":
        return f"{'.'.join(map(str, path))}: {fault['msg']}."
    body: type[BaseModel] = request.scope["route"].body_field.field_info.annotation
    if fault["type"] == "json_invalid" or not path:
        takes = ", ".join(body.model_fields)
        return f"The body must be a JSON object, sent as application/json. It takes {takes}."
    return explained(error.errors(), body)
