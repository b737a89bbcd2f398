"""`goalscope mcp`: goal tracking for assistants that speak the Model Context Protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING

from goalscope.cli_options import (
    Adapter,
    CalibrationName,
    Model,
    Scorer,
    Seed,
    StoreFile,
    Tokenizer,
    Writer,
)
from goalscope.terminal import adapter_named, named, opened_model, tokenizer_named
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

    from goalscope.domains import Settings
    from goalscope.store import Store
    from goalscope.tracking import Trackers

    try:
        from goalscope.mcp_server import create_server
    except ModuleNotFoundError as error:
        raise GoalscopeError(
            f'The MCP server needs {error.name}. Say: pip install "goalscope[mcp]"'
        ) from error
    settings = Settings(
        model=named(model),
        generator=named(generator),
        scorer=named(scorer),
        tokenizer=tokenizer_named(tokenizer),
        adapter=adapter_named(adapter),
        calibration=calibration,
        seed=seed,
    )
    with Store.open(store) as episodes, ExitStack() as later:

        @cache
        def engine() -> OpenModel:
            return later.enter_context(
                opened_model(
                    settings.model,
                    settings.generator,
                    settings.scorer,
                    settings.tokenizer,
                    settings.adapter,
                )
            )

        create_server(Trackers(episodes, engine, settings)).run()
