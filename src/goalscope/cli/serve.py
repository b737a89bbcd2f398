"""`goalscope serve`: the web page."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from goalscope.cli.options import Adapter, Model, Scorer, Seed, StoreFile, Tokenizer, Writer
from goalscope.cli.settings import engine_of, settings_given
from goalscope.cli.terminal import console
from goalscope.types import GoalscopeError, InvalidInputError

__all__ = ["serve"]

LOOPBACK = ("127.0.0.1", "::1", "localhost")

SHORTEST, SHORTEST_GIVEN = 32, 16
"""Characters of a key that is kept, and of one that is given: nobody may be able to guess it."""


def kept_key() -> tuple[str, Path]:
    """The key of this user's servers, made at the first start, and the file that holds it.

    Raises:
        GoalscopeError: It cannot be kept or read, or is not as it was made.
    """
    import secrets
    import tempfile

    import platformdirs

    file = platformdirs.user_data_path("goalscope", False) / "serve.key"
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
        raise GoalscopeError(f"The key of the host cannot be kept ({error}). {remedy}") from None
    if shared:
        raise GoalscopeError(f"Others may read the key of the host. {remedy}")
    if len(key) < SHORTEST:
        raise GoalscopeError(f"The key of the host is broken. {remedy}")
    return key, file


def serve(
    host: Annotated[str, typer.Option(help="Address to listen at.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for a free one.")] = 8000,
    name: Annotated[
        list[str] | None,
        typer.Option(help="Another HOST[:PORT] under which browsers reach it, such as a proxy's."),
    ] = None,
    password: Annotated[
        str | None,
        typer.Option(
            envvar="GOALSCOPE_PASSWORD", help="What visitors show; needed beyond this machine."
        ),
    ] = None,
    key: Annotated[
        str | None,
        typer.Option(
            envvar="GOALSCOPE_KEY", help="What you show, to see all episodes.  [default: as kept]"
        ),
    ] = None,
    model: Model = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    seed: Seed = 0,
    store: StoreFile = None,
) -> None:
    """Open the web page: chat, watch the belief move, correct it.

    Everybody who opens it has episodes of their own; with your key, which is kept, one sees all.
    """
    import socket

    from goalscope.extras import package
    from goalscope.store import Store

    for each in ("fastapi", "uvicorn"):
        package(each, "The web page needs", GoalscopeError)
    import uvicorn

    from goalscope.web.app import create_app
    from goalscope.web.guard import Guard

    if host not in LOOPBACK and not password:
        raise InvalidInputError(
            "Others could reach this address. Give a --password (or GOALSCOPE_PASSWORD) that they "
            "must show, or leave out --host."
        )
    if key and len(key) < SHORTEST_GIVEN:
        raise InvalidInputError(
            f"That key could be guessed. Give one of at least {SHORTEST_GIVEN} characters, or none "
            "(--key, GOALSCOPE_KEY): then one is made."
        )
    if password and len(password) < SHORTEST_GIVEN:
        raise InvalidInputError(
            f"That password could be guessed. Give one of at least {SHORTEST_GIVEN} characters "
            "(--password, GOALSCOPE_PASSWORD)."
        )
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((host, port))
        except OSError as error:
            raise InvalidInputError(
                f"Nothing can listen at {host} port {port}: {error.strerror}. Name another --port."
            ) from error
        port = listening.getsockname()[1]
        reached = {"127.0.0.1", "localhost", "[::1]", f"[{host}]" if ":" in host else host}
        names = {f"{each}:{port}" for each in reached}
        if port == 80:
            names |= reached
        key, file = (key, None) if key else kept_key()
        settings = settings_given(
            model=model,
            generator=generator,
            scorer=scorer,
            tokenizer=tokenizer,
            adapter=adapter,
            seed=seed,
        )
        with Store.open(store) as episodes, engine_of(settings) as engine:
            app = create_app(episodes, engine, settings)
            guarded = Guard(
                app,
                hosts=names | {*(name or ())},
                key=key,
                password=password,
            )
            shown = f"[{host}]" if ":" in host else host
            out = console()
            listening.listen()  # who reads the address next is not refused
            out.print(f"goalscope is at http://{shown}:{port}/", soft_wrap=True)
            secret = key if out.is_terminal else "KEY"  # what is no terminal may be a log
            out.print(
                f"For you, with everybody's episodes: http://{shown}:{port}/?key={secret}",
                soft_wrap=True,
            )
            if file:
                out.print(f"The key stands in {file}.", style="dim", soft_wrap=True)
            out.print("Ctrl-C ends it; everything is stored.", style="dim")
            config = uvicorn.Config(
                guarded,
                log_config=None,  # ours, which no text can forge
                log_level="warning",
                access_log=False,
                timeout_graceful_shutdown=2,
                proxy_headers=False,  # the guard reads the one that counts
            )
            uvicorn.Server(config).run(sockets=[listening])
