"""Goal tracking for other programs: one table of operations, which HTTP and MCP offer alike."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from inspect import Parameter, signature
from typing import Annotated, Any, get_type_hints

from pydantic import BaseModel, BeforeValidator, Field, ValidationError, create_model

from goalscope.base.types import InvalidInputError
from goalscope.belief.tracker import Correction
from goalscope.storage.tracking import Tracked, Trackers
from goalscope.web.views import RequestBody, TrackerView, Why, explained

Session = Annotated[str, Field(description="Id that open_session gave.")]
Goals = Annotated[
    list[str],
    Field(description='What the person may want, each in a few words, such as "bake a cake".'),
]


class SessionView(BaseModel, from_attributes=True):
    """A summary of a session; `turns` is their number."""

    id: str
    created: str
    task: str
    turns: int = Field(validation_alias="rounds")
    closed: Annotated[bool, BeforeValidator(bool)] = Field(validation_alias="ended")


class Sessions(BaseModel):
    """Sessions, newest first."""

    sessions: list[SessionView]


class Deleted(BaseModel):
    """The id of the deleted session."""

    deleted: str


@dataclass(frozen=True)
class Operation:
    """An operation as a route of HTTP and a tool of MCP.

    Attributes:
        run: Does it.
        body: Its parameters.
        answer: What it returns.
    """

    run: Callable[..., BaseModel]
    body: type[RequestBody]
    answer: type[BaseModel]

    @classmethod
    def of(cls, run: Callable[..., BaseModel]) -> Operation:
        """The operation that a function with annotated parameters describes."""
        hints = get_type_hints(run, include_extras=True)
        fields: dict[str, Any] = {
            name: (hints[name], ... if each.default is Parameter.empty else each.default)
            for name, each in signature(run).parameters.items()
        }
        return cls(run, create_model(run.__name__, __base__=RequestBody, **fields), hints["return"])

    @property
    def name(self) -> str:
        """Its name."""
        return self.run.__name__

    def __call__(self, given: Mapping[str, Any]) -> BaseModel:
        """Run it with the parameters that a program gives.

        Raises:
            InvalidInputError: A parameter is missing, unknown or of another type.
            GoalscopeError: See `Trackers`.
        """
        try:
            body = self.body.model_validate(given)
        except ValidationError as error:
            raise InvalidInputError(explained(error.errors(), self.body)) from None
        return self.run(**dict(body))


class Tracking:
    """The operations of goal tracking, with answers as JSON.

    Args:
        trackers: The sessions.
        task: The assistant's task in sessions that do not say it.
        top: Largest number of goals in an answer; None for all.
    """

    def __init__(self, trackers: Trackers, *, task: str = "", top: int | None = None) -> None:
        self._trackers, self._task, self._top = trackers, task, top

    @property
    def operations(self) -> list[Operation]:
        """All operations."""
        return [
            Operation.of(each)
            for each in (
                self.open_session,
                self.observe,
                self.belief,
                self.add_goals,
                self.correct,
                self.why,
                self.close_session,
                self.list_sessions,
                self.delete_session,
            )
        ]

    def open_session(
        self,
        task: Annotated[
            str,
            Field(description="The assistant's task, in a sentence; or that of its only domain."),
        ] = "",
        goals: Goals = [],  # noqa: B006 (a schema shows the default; nobody changes it)
        propose: Annotated[
            bool, Field(description="Whether goalscope's own model proposes goals, too.")
        ] = False,
    ) -> TrackerView:
        """Begin to track what a person wants. The session's id is good for later conversations."""
        return self._view(self._trackers.open(task or self._task, goals, propose=propose))

    def observe(
        self,
        session: Session,
        utterance: Annotated[str, Field(description="What the person said, word for word.")],
        query: Annotated[str, Field(description="What the assistant had said before that.")] = "",
        turn: Annotated[
            int | None,
            Field(description="Number of the turn, 1 for the first: sent again, it counts once."),
        ] = None,
    ) -> TrackerView:
        """Take in what the person said, and learn whether to act, ask or propose."""
        return self._view(self._trackers.observe(session, turn, query, utterance))

    def belief(self, session: Session) -> TrackerView:
        """How likely each goal is now, and whether to act, ask or propose."""
        return self._view(self._trackers.read(session))

    def add_goals(self, session: Session, goals: Goals) -> TrackerView:
        """Add goals; they count as if they had been there from the start."""
        return self._view(self._trackers.add(session, goals))

    def correct(
        self,
        session: Session,
        kind: Annotated[
            Correction,
            Field(
                description='"pin": it is this goal. "veto": it is not. '
                '"reword": it is this one, as `text` says.'
            ),
        ],
        goal: Annotated[str, Field(description="The goal's text.")],
        text: Annotated[str, Field(description="The goal in the person's own words.")] = "",
    ) -> TrackerView:
        """Take in what the person says of a goal itself; a pinned goal may be a new one."""
        return self._view(self._trackers.correct(session, kind, goal, text))

    def why(
        self,
        session: Session,
        goal: Annotated[str, Field(description="The goal; the likeliest if left out.")] = "",
    ) -> Why:
        """What each thing that the person said speaks for or against a goal, in nats."""
        named, reasons = self._trackers.why(session, goal)
        return Why(goal=named.text, reasons=reasons)

    def close_session(self, session: Session) -> TrackerView:
        """End a session; it can still be read."""
        return self._view(self._trackers.close(session))

    def list_sessions(
        self,
        limit: Annotated[int, Field(ge=1, le=200, description="At most so many.")] = 20,
        offset: Annotated[int, Field(ge=0, le=10**9, description="After so many others.")] = 0,
    ) -> Sessions:
        """Which sessions there are, newest first, also of other conversations."""
        found = self._trackers.sessions(limit=limit, offset=offset)
        return Sessions(sessions=[*map(SessionView.model_validate, found)])

    def delete_session(self, session: Session) -> Deleted:
        """Delete a session with everything said in it; this cannot be undone."""
        self._trackers.delete(session)
        return Deleted(deleted=session)

    def _view(self, tracked: Tracked) -> TrackerView:
        return TrackerView.of(tracked, top=self._top)
