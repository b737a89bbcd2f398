"""Goal tracking as tools of an assistant that speaks the Model Context Protocol."""

from __future__ import annotations

from importlib.metadata import version
from typing import Annotated, Any

from mcp.server import MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from pydantic import Field, ValidationError

from goalscope.tracker import Correction
from goalscope.tracking import Trackers
from goalscope.types import GoalscopeError
from goalscope.web.views import TrackerView, Why

__all__ = ["create_server"]

INSTRUCTIONS = """\
Keeps a belief over what your user wants. Open a session for a conversation, with the goals that \
they may have, and observe each of their messages. The answer's `advice` is what to do next: \
"act" on the likeliest goal; "ask" what tells the likely ones apart; or "propose": none of the \
goals explains the words, so think of some that do, and add them. When the user says outright what \
they want or do not want, correct."""

Session = Annotated[str, Field(description="Id that open_session gave.")]
Goal = Annotated[str, Field(description="The goal's text.")]
Goals = Annotated[
    list[str],
    Field(description='What the user may want, each in a few words, such as "bake a cake".'),
]


def create_server(trackers: Trackers) -> MCPServer[Any]:
    """The server, which is yet to be run."""
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
        return TrackerView.of(trackers.open(task, goals, propose=propose))

    @server.tool()
    def observe(
        session: Session,
        utterance: Annotated[str, Field(description="What the user said, word for word.")],
        query: Annotated[str, Field(description="What you had said before that.")] = "",
        turn: Annotated[
            int | None,
            Field(description="Number of the turn, 1 for the first: told again, it counts once."),
        ] = None,
    ) -> TrackerView:
        """Take in what the user said, and learn whether to act, ask or propose."""
        return TrackerView.of(trackers.observe(session, turn, query, utterance))

    @server.tool()
    def belief(session: Session) -> TrackerView:
        """How likely each goal is now, and whether to act, ask or propose."""
        return TrackerView.of(trackers.read(session))

    @server.tool()
    def add_goals(session: Session, goals: Goals) -> TrackerView:
        """Add goals; they count as if they had been there from the start."""
        return TrackerView.of(trackers.add(session, goals))

    @server.tool()
    def correct(
        session: Session,
        kind: Annotated[
            Correction,
            Field(description='"pin": it is this goal. "veto": it is not. "reword": as in text.'),
        ],
        goal: Goal,
        text: Annotated[str, Field(description="The goal in the user's own words.")] = "",
    ) -> TrackerView:
        """Take in what the user says of a goal itself; a pinned goal may be a new one."""
        return TrackerView.of(trackers.correct(session, kind, goal, text))

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
        return TrackerView.of(trackers.close(session))

    return server


class _Server(MCPServer[Any]):
    """A server whose errors are sentences that the assistant can act on."""

    async def call_tool(self, name: str, arguments: dict[str, Any], context: Any = None) -> Any:
        try:
            return await super().call_tool(name, arguments, context)
        except ToolError as error:
            cause = error.__cause__
            if isinstance(cause, GoalscopeError):
                raise ToolError(str(cause)) from None
            known = {each.name: each for each in await self.list_tools()}
            if name not in known:
                raise ToolError(f"There is no tool {name!r}, but {', '.join(known)}.") from None
            if not isinstance(cause, ValidationError):
                raise
            wrong = [f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in cause.errors()]
            takes = known[name].input_schema["properties"]
            raise ToolError(
                f"{name} cannot be called so. {'; '.join(wrong)}. It takes {', '.join(takes)}."
            ) from None
