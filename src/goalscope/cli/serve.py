"""`goalscope serve` and `goalscope mcp`: the web page, and goal tracking for assistants."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.base.user_dirs import NOWHERE, user_data
from goalscope.cli.options import (
    CalibrationName,
    ModelOptions,
    Seed,
    StoreFile,
    calibration_file,
    expand_options,
)
from goalscope.cli.terminal import console, measured_meanwhile, settings_model

if TYPE_CHECKING:
    from goalscope.models import OpenModel

__all__ = ["kept_key", "mcp", "serve"]

LOOPBACK = ("127.0.0.1", "::1", "localhost")

SHORTEST, SHORTEST_GIVEN = 32, 16
"""Minimum length of a generated key, and of a key or password that the user gives."""


def kept_key() -> tuple[str, Path]:
    """The key of this user's servers, generated at the first start, and its file.

    Raises:
        GoalscopeError: It cannot be written or read, or has changed.
    """
    import secrets
    import tempfile

    file = user_data() / "serve.key"
    if NOWHERE in file.parents:
        raise GoalscopeError("There is no home folder to keep the host key in. Set GOALSCOPE_KEY.")
    remedy = f"Delete {file} for a new one, or set GOALSCOPE_KEY."
    try:
        if not file.exists():
            file.parent.mkdir(parents=True, exist_ok=True)
            handle, whole = tempfile.mkstemp(dir=file.parent)  # for this user alone
            try:
                with os.fdopen(handle, "w") as new:
                    new.write(secrets.token_urlsafe(24))
                    new.flush()
                    os.fsync(handle)
                os.link(whole, file)
            except FileExistsError:  # another server was faster, and its key counts
                pass
            finally:
                os.unlink(whole)
        shared = os.name == "posix" and file.stat().st_mode & 0o077
        key = file.read_text("ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise GoalscopeError(f"Cannot save the host key ({error}). {remedy}") from None
    if shared:
        raise GoalscopeError(f"Other users can read the host key. {remedy}")
    if len(key) < SHORTEST:
        raise GoalscopeError(f"The file of the host key is damaged. {remedy}")
    return key, file


@expand_options
def serve(
    *,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for a free one.")] = 8000,
    name: Annotated[
        list[str] | None,
        typer.Option(
            help="Another HOST[:PORT] under which browsers reach the server, such as a proxy's."
        ),
    ] = None,
    password: Annotated[
        str | None,
        typer.Option(
            envvar="GOALSCOPE_PASSWORD",
            help="Password for visitors; required for access from other machines.",
        ),
    ] = None,
    key: Annotated[
        str | None,
        typer.Option(
            envvar="GOALSCOPE_KEY",
            help="Key to see everybody's episodes.  [default: the saved one]",
        ),
    ] = None,
    models: ModelOptions,
    seed: Seed = 0,
    store: StoreFile = None,
) -> None:
    """Serve the web page: chat, watch the belief, correct it.

    Visitors see only their own episodes; with your key, which is saved, you see everybody's.
    """
    import socket

    from goalscope.agent.settings import Settings
    from goalscope.base.optional_packages import package
    from goalscope.storage.store import Store

    for each in ("fastapi", "uvicorn"):
        package(each, "The web page needs", GoalscopeError)
    import uvicorn

    from goalscope.web.app import create_app
    from goalscope.web.guard import Guard

    if host not in LOOPBACK and not password:
        raise InvalidInputError(
            "Other machines could reach this address. Set a --password (or "
            "GOALSCOPE_PASSWORD) for visitors, or leave out --host."
        )
    if key and len(key) < SHORTEST_GIVEN:
        raise InvalidInputError(
            f"That key is too easy to guess. Use at least {SHORTEST_GIVEN} characters, or "
            "leave out --key (and GOALSCOPE_KEY) to have one generated."
        )
    if password and len(password) < SHORTEST_GIVEN:
        raise InvalidInputError(
            f"That password is too easy to guess. Use at least {SHORTEST_GIVEN} characters "
            "(--password, GOALSCOPE_PASSWORD)."
        )
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
        reached = {"127.0.0.1", "localhost", "[::1]", f"[{host}]" if ":" in host else host}
        names = {f"{each}:{port}" for each in reached}
        if port == 80:
            names |= reached
        key, file = (key, None) if key else kept_key()
        settings = Settings(**models.names(), seed=seed)
        with (
            Store.open(store) as episodes,
            settings_model(settings, measure=False) as engine,
            measured_meanwhile(settings),
        ):
            app = create_app(episodes, engine, settings)
            guarded = Guard(app, hosts=names | {*(name or ())}, key=key, password=password)
            shown = f"[{host}]" if ":" in host else host
            out = console()
            listening.listen()  # so that who reads the address now is not refused
            out.print(f"goalscope is running at http://{shown}:{port}/", soft_wrap=True)
            secret = key if out.is_terminal else "KEY"  # what is no terminal may be a log
            out.print(
                f"For you, with everybody's episodes: http://{shown}:{port}/?key={secret}",
                soft_wrap=True,
            )
            if file:
                out.print(f"The key is saved in {file}.", style="dim", soft_wrap=True)
            out.print("Press Ctrl-C to stop; everything is saved.", style="dim")
            config = uvicorn.Config(
                guarded,
                log_config=None,  # ours, which no text can forge
                log_level="warning",
                access_log=False,
                timeout_graceful_shutdown=2,
                proxy_headers=False,  # the guard reads the one that counts
            )
            uvicorn.Server(config).run(sockets=[listening])


@expand_options
def mcp(
    models: ModelOptions,
    calibration: CalibrationName = None,
    seed: Seed = 0,
    store: StoreFile = None,
) -> None:
    """Serve goal tracking to an assistant over the Model Context Protocol (stdin and stdout).

    The assistant's program starts it; see docs/tracking.md.
    """
    from contextlib import ExitStack
    from functools import cache

    from goalscope.agent.settings import Settings
    from goalscope.base.optional_packages import package
    from goalscope.storage.store import Store
    from goalscope.storage.tracking import Trackers

    package("mcp.server", "The MCP server needs", GoalscopeError)
    from goalscope.web.mcp import create_server

    settings = Settings(**models.names(), calibration=calibration_file(calibration), seed=seed)
    with Store.open(store) as episodes, ExitStack() as later:

        @cache
        def engine() -> OpenModel:
            return later.enter_context(settings_model(settings, measure=False))

        if models != ModelOptions():
            engine()  # a wrong name fails now, not in the middle of a conversation
        later.enter_context(measured_meanwhile(settings))
        create_server(Trackers(episodes, engine, settings), episodes).run()
