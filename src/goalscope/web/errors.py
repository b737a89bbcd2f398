"""Error responses: sentences that say what is wrong and what to do."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from fastapi.routing import APIRoute
from pydantic import BaseModel, ConfigDict
from starlette.exceptions import HTTPException

from goalscope.base.inputs import RepeatedKeyError, parse_json
from goalscope.base.types import ConflictError, InvalidInputError

__all__ = ["ErrorBody", "RequestBody", "Route", "error_response"]

EXPLANATIONS = {
    400: "The body cannot be read. Send a JSON object in UTF-8.",
    404: "There is nothing at this address. /api/openapi.json lists all addresses.",
    405: "This address does not support this method. /api/openapi.json lists the supported ones.",
}
"""Replacements for the terse messages of the libraries below."""


class RequestBody(BaseModel):
    """Base of request bodies. Unknown fields are errors: a typo must not mean the default."""

    model_config = ConfigDict(extra="forbid")


class Route(APIRoute):
    """A route that refuses a body with a key twice, of which one would be lost."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """See `APIRoute`."""
        handle = super().get_route_handler()

        async def handle_once(request: Request) -> Response:
            return await handle(_OnceRequest(request.scope, request.receive))

        return handle_once


class _OnceRequest(Request):
    async def json(self) -> Any:
        try:
            return parse_json(await self.body())
        except RepeatedKeyError as error:
            raise HTTPException(422, f"The body says a thing twice: {error}") from None


class ErrorBody(BaseModel):
    """Why a request failed, in a sentence that says what to do."""

    error: str


async def error_response(request: Request, error: Exception) -> JSONResponse:
    """The response to a request that failed with this error."""
    if isinstance(error, HTTPException):
        detail = error.detail
        if not detail.endswith("."):
            detail = EXPLANATIONS.get(error.status_code, detail)
        return JSONResponse({"error": detail}, error.status_code, error.headers)
    if isinstance(error, RequestValidationError):
        return JSONResponse({"error": _explain(request, error.errors())}, 422)
    conflict = isinstance(error, ConflictError)
    status = 409 if conflict else 400 if isinstance(error, InvalidInputError) else 503
    return JSONResponse({"error": str(error)}, status)


def _explain(request: Request, faults: Any) -> str:
    """The problem with a request, and what is expected; unknown fields come first."""
    fault = next((each for each in faults if each["type"] == "extra_forbidden"), faults[0])
    place, *path = fault["loc"]
    name, kind = ".".join(map(str, path)), fault["type"]
    if place != "body":
        return f"{name} is missing." if kind == "missing" else f"{name}: {fault['msg']}."
    body: type[BaseModel] = request.scope["route"].body_field.field_info.annotation
    takes = f"It takes {', '.join(body.model_fields)}."
    if kind == "json_invalid":
        return f"The body is not JSON: {fault['ctx']['error']} at character {name}. {takes}"
    if not path:
        return f"The body must be a JSON object, sent as application/json. {takes}"
    if kind == "extra_forbidden":
        return f"There is no field {name!r}. {takes}"
    if kind == "missing":
        return f"The field {name!r} is missing. {takes}"
    return f"{name}: {fault['msg']}."
