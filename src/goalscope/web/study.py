"""The HTTP interface of studies: agree, rate one item after the other, finish."""

from __future__ import annotations

import pathlib
from dataclasses import asdict
from typing import Annotated

from fastapi import APIRouter, Depends, HTTPException, Path, Query
from fastapi.responses import FileResponse
from pydantic import BaseModel, Field

from goalscope.store import Store
from goalscope.study.people import Answer, Participant
from goalscope.study.plan import BEST
from goalscope.study.store import Study, StudyStore
from goalscope.types import InvalidInputError, Turn
from goalscope.web.guard import Guest
from goalscope.web.refusals import Given as Body

__all__ = ["study_router"]

PAGE = pathlib.Path(__file__).parent / "static" / "study.html"
LONGEST = 4000
"""Characters of an explanation, and of an id."""

Place = Annotated[int, Path(ge=1, le=10**9)]


class Consent(Body):
    """That somebody agrees to take part."""

    agreed: bool


class Given(Body):
    """An answer; `revision` is one more than that of the answer that it replaces, or 1."""

    rating: int = Field(ge=0, le=BEST)
    explanation: str = Field(max_length=LONGEST)
    revision: int = Field(ge=1, le=1_000_000)


class Participation(BaseModel):
    """A study, and how far one has come in it.

    Attributes:
        over: Why nobody new can take part, in a sentence; empty where they can.
        answered: Whether each item has a rating; None for who has not agreed.
        thanks: What the page says once all items have one.
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


class AnswerView(BaseModel):
    """An answer that is saved; revision 0 is none yet."""

    rating: int | None
    explanation: str
    revision: int

    @classmethod
    def of(cls, answer: Answer) -> AnswerView:
        """The view of an answer."""
        return cls(rating=answer.rating, explanation=answer.explanation, revision=answer.revision)


class ItemView(BaseModel):
    """What is to be rated, and the answer to it so far."""

    task: str
    possible: list[str]
    profile: str
    outcome: str
    transcript: list[Turn]
    answer: AnswerView


def _id(id: Annotated[str, Query(max_length=LONGEST)] = "") -> str:
    """How a participant's link names them."""
    if not id.strip():
        raise InvalidInputError(
            "This address lacks your id. Please open the link that you were given."
        )
    return id.strip()


Id = Annotated[str, Depends(_id)]


def study_router(store: Store) -> APIRouter:
    """The pages of the studies in a store."""
    router = APIRouter()
    book = StudyStore(store)

    def named(name: str) -> Study:
        try:
            return book.named(name)
        except InvalidInputError:
            raise HTTPException(404, "There is no such study.") from None

    def joined(study: Study, id: str, visitor: Guest) -> Participant:
        there = book.participant(study, visitor.browser, id)
        if there is None:
            raise HTTPException(403, "Agree to take part first.")
        return there

    @router.get("/study/{name}", include_in_schema=False)
    def page(name: str) -> FileResponse:
        """For an unknown study, too: the page then says so."""
        try:
            named(name)
        except HTTPException as unknown:
            return FileResponse(PAGE, unknown.status_code)
        return FileResponse(PAGE)

    @router.get("/api/studies/{name}")
    def participation(name: str, id: Id, visitor: Guest) -> Participation:
        study = named(name)
        there = book.participant(study, visitor.browser, id)
        return _view(study, there, over="" if there else book.over(study))

    @router.post("/api/studies/{name}/consent")
    def consent(name: str, given: Consent, id: Id, visitor: Guest) -> Participation:
        study = named(name)
        if not given.agreed:
            raise InvalidInputError("Only who agrees can take part.")
        return _view(study, book.join(study, visitor.browser, id))

    @router.get("/api/studies/{name}/items/{place}")
    def item(name: str, place: Place, id: Id, visitor: Guest) -> ItemView:
        found, answer = book.open(joined(named(name), id, visitor), place)
        return ItemView(**asdict(found), answer=AnswerView.of(answer))

    @router.put("/api/studies/{name}/items/{place}")
    def answer(name: str, place: Place, given: Given, id: Id, visitor: Guest) -> AnswerView:
        study = named(name)
        participant = joined(study, id, visitor)
        text = given.explanation.encode("utf-8", "replace").decode().replace("\0", "").strip()
        if len("".join(text.split())) < study.plan.min_explanation:
            raise InvalidInputError(
                f"Please explain your rating in at least {study.plan.min_explanation} characters."
            )
        kept = book.answer(participant, place, given.rating, text, given.revision)
        return AnswerView.of(kept)

    return router


def _view(study: Study, participant: Participant | None, *, over: str = "") -> Participation:
    plan = study.plan
    return Participation(
        title=plan.title,
        consent=plan.consent,
        instructions=plan.instructions,
        question=plan.question,
        scale=list(plan.scale),
        min_explanation=plan.min_explanation,
        over=over,
        answered=participant and [each.rating is not None for each in participant.answers],
        thanks=plan.thanks,
    )
