"""Goal tracking as tools of an assistant that speaks the Model Context Protocol."""

from __future__ import annotations

import json
from importlib.metadata import version
from typing import Annotated, Any

from mcp.server import MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from mcp.types import CallToolResult, TextContent
from pydantic import BaseModel, Field, ValidationError

from goalscope.base.types import TRACKING, GoalscopeError, pluralize
from goalscope.belief.tracker import Correction
from goalscope.storage.store import Store
from goalscope.storage.tracking import Tracked, Trackers
from goalscope.web.views import TrackerView, Why

__all__ = ["create_server"]

INSTRUCTIONS = """\
Keeps a belief over what your user wants. Open a session for a conversation, with the goals that \
they may have, and observe each of their messages. The answer's `advice` is what to do next: \
"act" on the likeliest goal; "ask" what tells the likely ones apart; or "propose": none of the \
goals explains the words, so ask whether it is the likeliest one, and after a no add some that do. \
After a yes to a question that names a goal, and whenever the user says outright what they want or \
do not want, correct: such an answer hardly moves the belief by itself. Act once: the belief does \
not know what you did, so close the session then, and open another for what comes next."""

Session = Annotated[str, Field(description="Id that open_session gave.")]
Goal = Annotated[str, Field(description="The goal's text.")]
Goals = Annotated[
    list[str],
    Field(description='What the user may want, each in a few words, such as "bake a cake".'),
]

TOP = 10
"""Goals shown in an answer, which a model reads turn after turn."""


class SessionView(BaseModel):
    """A summary of a session; `turns` is their number."""

    id: str
    created: str
    task: str
    turns: int
    closed: bool


class Sessions(BaseModel):
    """Sessions, newest first."""

    sessions: list[SessionView]


class Deleted(BaseModel):
    """The id of the deleted session."""

    deleted: str


def create_server(trackers: Trackers, store: Store) -> MCPServer[Any]:
    """The server, not yet running.

    Args:
        trackers: The sessions.
        store: Keeps the sessions.
    """
    server = _Server(
        "goalscope",
        version=version("goalscope"),
        instructions=INSTRUCTIONS,
        log_level="WARNING",
    )

    @server.tool()
    def open_session(
        task: Annotated[str, Field(description="Your task, in a sentence.")],
        goals: Goals = [],  # noqa: B006 (a schema shows the default; nobody changes it)
        propose: Annotated[
            bool, Field(description="Whether goalscope's own small model proposes goals, too.")
        ] = False,
    ) -> TrackerView:
        """Begin to track what the user wants. The session's id is good for later conversations."""
        return _shortened(trackers.open(task, goals, propose=propose))

    @server.tool()
    def observe(
        session: Session,
        utterance: Annotated[str, Field(description="What the user said, word for word.")],
        query: Annotated[str, Field(description="What you had said before that.")] = "",
        turn: Annotated[
            int | None,
            Field(description="Number of the turn, 1 for the first: sent again, it counts once."),
        ] = None,
    ) -> TrackerView:
        """Take in what the user said, and learn whether to act, ask or propose."""
        return _shortened(trackers.observe(session, turn, query, utterance))

    @server.tool()
    def belief(session: Session) -> TrackerView:
        """How likely each goal is now, and whether to act, ask or propose."""
        return _shortened(trackers.read(session))

    @server.tool()
    def add_goals(session: Session, goals: Goals) -> TrackerView:
        """Add goals; they count as if they had been there from the start."""
        return _shortened(trackers.add(session, goals))

    @server.tool()
    def correct(
        session: Session,
        kind: Annotated[
            Correction,
            Field(
                description='"pin": it is this goal. "veto": it is not. '
                '"reword": it is this one, as `text` says.'
            ),
        ],
        goal: Goal,
        text: Annotated[str, Field(description="The goal in the user's own words.")] = "",
    ) -> TrackerView:
        """Take in what the user says of a goal itself; a pinned goal may be a new one."""
        return _shortened(trackers.correct(session, kind, goal, text))

    @server.tool()
    def why(
        session: Session,
        goal: Annotated[str, Field(description="The goal; the likeliest if left out.")] = "",
    ) -> Why:
        """What each thing that the user said speaks for or against a goal, in nats."""
        return Why.of(*trackers.why(session, goal))

    @server.tool()
    def close_session(session: Session) -> TrackerView:
        """End a session; it can still be read."""
        return _shortened(trackers.close(session))

    @server.tool()
    def list_sessions(
        limit: Annotated[int, Field(ge=1, le=200, description="At most so many.")] = 20,
        offset: Annotated[int, Field(ge=0, le=10**9, description="After so many others.")] = 0,
    ) -> Sessions:
        """Which sessions there are, newest first, also of other conversations."""
        found = store.episodes(domain=TRACKING, newest_first=True, limit=limit, offset=offset)
        views = [
            SessionView(
                id=each.id,
                created=each.created,
                task=each.task,
                turns=each.rounds,
                closed=each.ended is not None,
            )
            for each in found
        ]
        return Sessions(sessions=views)

    @server.tool()
    def delete_session(session: Session) -> Deleted:
        """Delete a session with everything said in it; this cannot be undone."""
        trackers.delete(session)
        return Deleted(deleted=session)

    return server


def _shortened(tracked: Tracked) -> TrackerView:
    """The view of a session with only the likeliest goals."""
    view = TrackerView.of(tracked)
    belief, count = view.belief, len(view.belief.goals)
    if count > TOP:
        view.notes.append(f"Of {count} goals, the {TOP} likeliest are shown.")
        belief.goals = belief.goals[:TOP]
    if len(belief.set_90 or ()) > TOP:
        view.notes.append(f"The set of 90 % holds {pluralize(len(belief.set_90 or ()), 'goal')}.")
        belief.set_90 = None
    return view


class _Server(MCPServer[Any]):
    """A server whose answers are short, and whose errors are sentences to act on."""

    async def call_tool(self, name: str, arguments: dict[str, Any], context: Any = None) -> Any:
        known = {each.name: each for each in await self.list_tools()}
        if name not in known:
            raise ToolError(f"There is no tool {name!r}, but {', '.join(known)}.")
        takes = known[name].input_schema["properties"]
        if other := [each for each in arguments if each not in takes]:
            raise ToolError(
                f"{name} takes {', '.join(takes)}, and no {', '.join(map(repr, other))}."
            )
        try:
            answer = await super().call_tool(name, arguments, context)
        except ToolError as error:
            cause = error.__cause__
            if isinstance(cause, GoalscopeError):
                raise ToolError(str(cause)) from None
            if not isinstance(cause, ValidationError):
                raise
            wrong = [f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in cause.errors()]
            raise ToolError(
                f"{name} cannot be called so. {'; '.join(wrong)}. It takes {', '.join(takes)}."
            ) from None
        assert isinstance(answer, CallToolResult)
        exact = json.dumps(answer.structured_content)
        rounded = json.loads(exact, parse_float=lambda number: round(float(number), 4))
        text = TextContent(type="text", text=json.dumps(rounded, ensure_ascii=False))
        return CallToolResult(content=[text], structured_content=rounded)
