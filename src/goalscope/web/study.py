"""The HTTP interface of studies: consent, rate one item after the other, finish."""

from __future__ import annotations

import pathlib
from dataclasses import asdict
from typing import Annotated

from fastapi import APIRouter, Depends, HTTPException, Path, Query
from fastapi.responses import FileResponse
from pydantic import BaseModel, Field

from goalscope.base.text import without_invisible
from goalscope.base.types import InvalidInputError, Turn
from goalscope.storage.store import Store
from goalscope.study.plan import BEST
from goalscope.study.store import Participant, Study, StudyStore
from goalscope.web.guard import Rater
from goalscope.web.views import RequestBody

PAGE = pathlib.Path(__file__).parent / "static" / "study.html"
MAX_LENGTH = 4000
"""Characters of an explanation, and of an id."""

Place = Annotated[int, Path(ge=1, le=10**9)]


class Consent(RequestBody):
    """Whether somebody agrees to take part."""

    agreed: bool


class NewAnswer(RequestBody):
    """An answer; `revision` is one more than that of the answer that it replaces, or 1."""

    rating: int = Field(ge=0, le=BEST)
    explanation: str = Field(min_length=1, max_length=MAX_LENGTH)
    revision: int = Field(ge=1, le=1_000_000)


class Participation(BaseModel):
    """What a participant sees of a study's plan, and their progress.

    Attributes:
        over: Why the study takes no new participants, in a sentence; empty if it does.
        answered: Whether each item has a rating; None before consent.
        thanks: The text after all items are rated.
    """

    title: str
    consent: str
    instructions: str
    question: str
    scale: list[str]
    min_explanation: int
    over: str
    answered: list[bool] | None
    thanks: str


class AnswerView(BaseModel, from_attributes=True):
    """The answer that is saved; revision 0 means none yet."""

    rating: int | None
    explanation: str
    revision: int


class ItemView(BaseModel):
    """The item to rate, and its answer so far."""

    task: str
    possible: list[str]
    profile: str
    outcome: str
    transcript: list[Turn]
    answer: AnswerView


def _id(id: Annotated[str, Query(max_length=MAX_LENGTH)] = "") -> str:
    """The participant's id, from their link."""
    id = without_invisible(id).strip()
    if not id:
        raise InvalidInputError(
            "Your id is missing from the address. Please open the link that you were given."
        )
    return id


Id = Annotated[str, Depends(_id)]


def study_router(store: Store) -> APIRouter:
    """The pages of the studies in a store."""
    router = APIRouter()
    studies = StudyStore(store)

    def named(name: str) -> Study:
        try:
            return studies.named(name)
        except InvalidInputError:
            raise HTTPException(404, "There is no such study.") from None

    def joined(study: Study, id: str, rater: Rater) -> Participant:
        participant = studies.participant(study, rater, id)
        if participant is None:
            raise HTTPException(403, "Agree to take part first.")
        return participant

    @router.get("/study/{name}", include_in_schema=False)
    def page(name: str) -> FileResponse:
        """The page itself says so where a study is unknown."""
        try:
            named(name)
        except HTTPException as unknown:
            return FileResponse(PAGE, unknown.status_code)
        return FileResponse(PAGE)

    @router.get("/api/studies/{name}")
    def participation(name: str, id: Id, rater: Rater) -> Participation:
        study = named(name)
        participant = studies.participant(study, rater, id)
        return _view(study, participant, over="" if participant else studies.over(study))

    @router.post("/api/studies/{name}/consent")
    def consent(name: str, body: Consent, id: Id, rater: Rater) -> Participation:
        study = named(name)
        if not body.agreed:
            raise InvalidInputError("You must agree to take part.")
        return _view(study, studies.join(study, rater, id))

    @router.get("/api/studies/{name}/items/{place}")
    def item(name: str, place: Place, id: Id, rater: Rater) -> ItemView:
        found, answer = studies.open(joined(named(name), id, rater), place)
        return ItemView(**asdict(found), answer=AnswerView.model_validate(answer))

    @router.put("/api/studies/{name}/items/{place}")
    def answer(name: str, place: Place, body: NewAnswer, id: Id, rater: Rater) -> AnswerView:
        participant = joined(named(name), id, rater)
        text = body.explanation.strip()
        saved = studies.answer(participant, place, body.rating, text, body.revision)
        return AnswerView.model_validate(saved)

    return router


def _view(study: Study, participant: Participant | None, *, over: str = "") -> Participation:
    answered = participant and [each.rating is not None for each in participant.answers]
    return Participation(**asdict(study.plan), over=over, answered=answered)
