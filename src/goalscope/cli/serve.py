"""`goalscope serve` and `goalscope mcp`: the web page, and goal tracking for assistants."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from goalscope.base.optional_packages import package
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.base.user_dirs import NOWHERE, user_data
from goalscope.cli.options import (
    Adapter,
    CalibrationName,
    Model,
    Scorer,
    StoreFile,
    Tokenizer,
    TraceFile,
    Writer,
    calibration_file,
)
from goalscope.cli.terminal import console, model_names, say, settings_model

if TYPE_CHECKING:
    from goalscope.models.opening import ModelSet

SHORTEST = 16
"""Minimum length of the key."""


def kept_key() -> tuple[str, Path]:
    """The key of this user's servers, generated at the first start, and its file.

    Raises:
        GoalscopeError: It cannot be written or read, or other users can read it.
    """
    import secrets
    import tempfile

    file = user_data() / "serve.key"
    if NOWHERE in file.parents:
        raise GoalscopeError("There is no home folder to keep the key in. Set GOALSCOPE_KEY.")
    remedy = f"Delete {file} for a new one, or set GOALSCOPE_KEY."
    try:
        if not file.exists():
            file.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=file.parent) as folder:
                whole = Path(folder) / file.name
                with open(os.open(whole, os.O_CREAT | os.O_WRONLY, 0o600), "w") as new:
                    new.write(secrets.token_urlsafe(24))
                    new.flush()
                    os.fsync(new.fileno())
                with suppress(FileExistsError):  # another server was faster, and its key counts
                    os.link(whole, file)
        shared = os.name == "posix" and file.stat().st_mode & 0o077
        key = file.read_text("ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise GoalscopeError(f"Cannot save or read the key ({error}). {remedy}") from None
    if shared or len(key) < SHORTEST:
        wrong = "Other users can read the key." if shared else "The file of the key is damaged."
        raise GoalscopeError(f"{wrong} {remedy}")
    return key, file


def serve(
    domains: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[DOMAIN|FILE.py]...",
            help="Domains to talk in, or Python files of your own.  [default: grocery house]",
        ),
    ] = None,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for a free one.")] = 8000,
    name: Annotated[
        list[str] | None,
        typer.Option(
            help="Another HOST[:PORT] under which browsers reach the server, such as a proxy's."
        ),
    ] = None,
    key: Annotated[
        str | None,
        typer.Option(
            envvar="GOALSCOPE_KEY", help="Key that opens the page.  [default: the saved one]"
        ),
    ] = None,
    model: Model = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    trace: TraceFile = None,
    store: StoreFile = None,
) -> None:
    """Serve the web page: chat, watch the belief, correct it.

    The address that is printed contains a key, which is saved. Only studies are open without it.
    """
    import socket

    from goalscope.agent.settings import Settings
    from goalscope.envs.registry import BUILT_IN, load_domain
    from goalscope.models.trace import tracing
    from goalscope.storage.store import Store

    package("fastapi", "The web page needs", GoalscopeError)
    uvicorn = package("uvicorn", "The web page needs", GoalscopeError)

    from goalscope.web.app import create_app
    from goalscope.web.guard import Guard, host_name

    if key and len(key) < SHORTEST:
        raise InvalidInputError(
            f"That key is too easy to guess. Use at least {SHORTEST} characters, or leave out "
            "--key (and GOALSCOPE_KEY) to have one generated."
        )
    names = [*map(host_name, name or ())]
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((host, port))
        except OSError as error:
            raise InvalidInputError(
                f"Cannot listen on {host} port {port}: {error.strerror}. Choose another --port."
            ) from error
        port = listening.getsockname()[1]
        shown = f"[{host}]" if ":" in host else host
        key, file = (key, None) if key else kept_key()
        settings = Settings(**model_names(model, generator, scorer, tokenizer, adapter))
        with (
            Store.open(store) as episodes,
            settings_model(settings) as engine,
            tracing(trace),
        ):
            named = [*map(load_domain, domains or BUILT_IN)]
            app = create_app(episodes, engine, settings, named)
            guarded = Guard(app, hosts=[*names, f"{shown}:{port}".lower()], key=key)
            listening.listen()  # so that who reads the address now is not refused
            secret = key if console().is_terminal else "KEY"  # what is no terminal may be a log
            say(f"goalscope is running at http://{shown}:{port}/?key={secret}")
            if file:
                say(f"The key is saved in {file}.", "dim")
            say("Press Ctrl-C to stop; everything is saved.", "dim")
            config = uvicorn.Config(
                guarded,
                log_config=None,  # ours, which no text can forge
                log_level="warning",
                access_log=False,
                timeout_graceful_shutdown=2,
                proxy_headers=False,  # the guard reads the one that counts
            )
            uvicorn.Server(config).run(sockets=[listening])


def mcp(
    domain: Annotated[
        str | None,
        typer.Argument(
            metavar="[DOMAIN|FILE.py]",
            help="Domain, or a Python file of your own, whose task sessions have by default.",
        ),
    ] = None,
    model: Model = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    calibration: CalibrationName = None,
    store: StoreFile = None,
) -> None:
    """Serve goal tracking to an assistant over the Model Context Protocol (stdin and stdout).

    The assistant's program starts it; see docs/tracking.md.
    """
    from contextlib import ExitStack
    from functools import cache

    from goalscope.agent.settings import Settings
    from goalscope.envs.registry import load_domain, task_of
    from goalscope.storage.store import Store
    from goalscope.storage.tracking import Trackers

    package("mcp.server", "The MCP server needs", GoalscopeError)
    from goalscope.web.mcp import create_server

    names = model_names(model, generator, scorer, tokenizer, adapter)
    settings = Settings(**names, calibration=calibration_file(calibration))
    task = task_of(Settings(domain=load_domain(domain))) if domain else ""
    with Store.open(store) as episodes, ExitStack() as later:

        @cache
        def engine() -> ModelSet:
            return later.enter_context(settings_model(settings))

        if any(names.values()):
            engine()  # a wrong name fails now, not in the middle of a conversation
        create_server(Trackers(episodes, engine, settings), task=task).run()
