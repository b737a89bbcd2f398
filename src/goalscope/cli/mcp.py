"""`goalscope mcp`: goal tracking for assistants that speak the Model Context Protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING

from goalscope.cli.options import (
    Adapter,
    CalibrationName,
    Model,
    Scorer,
    Seed,
    StoreFile,
    Tokenizer,
    Writer,
)
from goalscope.cli.settings import engine_of, settings_given
from goalscope.types import GoalscopeError

if TYPE_CHECKING:
    from goalscope.models import OpenModel

__all__ = ["mcp"]


def mcp(
    model: Model = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    calibration: CalibrationName = None,
    seed: Seed = 0,
    store: StoreFile = None,
) -> None:
    """Serve goal tracking to an assistant, over the Model Context Protocol on standard input.

    The assistant's program starts it; see docs/tracking.md.
    """
    from contextlib import ExitStack
    from functools import cache

    from goalscope.extras import package
    from goalscope.store import Store
    from goalscope.tracking import Trackers

    package("mcp.server", "The MCP server needs", GoalscopeError)
    from goalscope.mcp_server import create_server

    settings = settings_given(
        model=model,
        generator=generator,
        scorer=scorer,
        tokenizer=tokenizer,
        adapter=adapter,
        calibration=calibration,
        seed=seed,
    )
    with Store.open(store) as episodes, ExitStack() as later:

        @cache
        def engine() -> OpenModel:
            return later.enter_context(engine_of(settings))

        if any((model, generator, scorer, tokenizer, adapter)):
            engine()  # a wrong name is told now, and not in the middle of a conversation
        create_server(Trackers(episodes, engine, settings), episodes).run()
