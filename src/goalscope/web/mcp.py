"""Goal tracking as tools of an assistant that speaks the Model Context Protocol."""

from __future__ import annotations

import json
from importlib.metadata import version
from typing import Any

from anyio.to_thread import run_sync
from mcp.server import MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from mcp.types import CallToolResult, TextContent

from goalscope.base.types import GoalscopeError
from goalscope.storage.tracking import Trackers
from goalscope.web.tracking import Tracking

INSTRUCTIONS = """\
Keeps a belief over what your user wants. Open a session for a conversation, with the goals that \
they may have, and observe each of their messages. The answer's `advice` is what to do next: \
"act" on the likeliest goal; "ask" what tells the likely ones apart; or "propose": none of the \
goals explains the words, so ask whether it is the likeliest one, and after a no add some that do. \
After a yes to a question that names a goal, and whenever the user says outright what they want or \
do not want, correct: such an answer hardly moves the belief by itself. Act once: the belief does \
not know what you did, so close the session then, and open another for what comes next."""

TOP = 10
"""Goals shown in an answer, which a model reads turn after turn."""


def create_server(trackers: Trackers, *, task: str = "") -> MCPServer[Any]:
    """The server of these sessions, not yet running; see `Tracking`."""
    return _Server(trackers, task)


class _Server(MCPServer[Any]):
    """A server whose answers are short, and whose errors are sentences to act on."""

    def __init__(self, trackers: Trackers, task: str) -> None:
        super().__init__(
            "goalscope",
            version=version("goalscope"),
            instructions=INSTRUCTIONS,
            log_level="WARNING",
        )
        tracking = Tracking(trackers, task=task, top=TOP)
        self._operations = {each.name: each for each in tracking.operations}
        for each in self._operations.values():
            self.add_tool(each.run)

    async def call_tool(self, name: str, arguments: dict[str, Any], context: Any = None) -> Any:
        """See `MCPServer`."""
        if name not in self._operations:
            raise ToolError(f"There is no tool {name!r}, but {', '.join(self._operations)}.")
        try:
            answer = await run_sync(self._operations[name], arguments)
        except GoalscopeError as error:
            raise ToolError(str(error)) from None
        rounded = json.loads(
            answer.model_dump_json(), parse_float=lambda number: round(float(number), 4)
        )
        text = TextContent(type="text", text=json.dumps(rounded, ensure_ascii=False))
        return CallToolResult(content=[text], structured_content=rounded)
