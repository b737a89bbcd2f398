"""What is refused, in sentences that say why and what to do."""

from __future__ import annotations

from typing import Any

from fastapi import Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict
from starlette.exceptions import HTTPException

from goalscope.types import ConflictError, InvalidInputError

__all__ = ["Given", "Refusal", "refused"]

BARE = {
    400: "The body cannot be read. Send a JSON object in UTF-8.",
    404: "There is nothing at this address. /api/openapi.json lists what there is.",
    405: "This address does not take that method. /api/openapi.json lists those that it takes.",
}
"""For what the libraries below refuse in a word or two."""


class Given(BaseModel):
    """What is sent. A field that there is not is refused: a slip must not pass for a default."""

    model_config = ConfigDict(extra="forbid")


class Refusal(BaseModel):
    """Why not, in a sentence that says what to do."""

    error: str


async def refused(request: Request, error: Exception) -> JSONResponse:
    """The answer to what could not be done."""
    if isinstance(error, HTTPException):
        told = error.detail if error.detail.endswith(".") else BARE.get(error.status_code)
        return JSONResponse({"error": told or error.detail}, error.status_code, error.headers)
    if isinstance(error, RequestValidationError):
        faults = error.errors()
        unknown = [each for each in faults if each["type"] == "extra_forbidden"]
        return JSONResponse({"error": _told(request, [*unknown, *faults][0])}, 422)
    conflict = isinstance(error, ConflictError)
    status = 409 if conflict else 400 if isinstance(error, InvalidInputError) else 503
    return JSONResponse({"error": str(error)}, status)


def _told(request: Request, fault: Any) -> str:
    """What is wrong with a request, and what it takes instead."""
    place, *path = fault["loc"]
    name = ".".join(map(str, path))
    if place != "body":
        return f"{name} is missing." if fault["type"] == "missing" else f"{name}: {fault['msg']}."
    body: type[BaseModel] = request.scope["route"].body_field.field_info.annotation
    takes = f"It takes {', '.join(body.model_fields)}."
    if fault["type"] == "json_invalid":
        return f"The body is no JSON: {fault['ctx']['error']} at character {name}. {takes}"
    if not path:
        return f"The body must be a JSON object, sent as application/json. {takes}"
    if fault["type"] == "extra_forbidden":
        return f"There is no field {name!r}. {takes}"
    if fault["type"] == "missing":
        return f"The field {name!r} is missing. {takes}"
    return f"{name}: {fault['msg']}."
