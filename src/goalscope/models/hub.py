"""GGUF files from the Hugging Face hub, in its shared cache."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from goalscope.base.optional_packages import package
from goalscope.base.types import InvalidInputError, ModelError
from goalscope.models.server import http_client


def pull(repository: str, file: str | None = None) -> Path:
    """Fetch a GGUF file, or find it in the cache; an interrupted download continues.

    Args:
        repository: Such as "owner/name".
        file: Its name there; not needed if it is the only one.

    Raises:
        InvalidInputError: There is no such repository or file, or there are several files.
        ModelError: The hub cannot be reached, or a package is missing, or as by `http_client`.
    """
    hub = package("huggingface_hub")
    from httpx2 import HTTPError
    from huggingface_hub.errors import HFValidationError, RemoteEntryNotFoundError

    http_client().close()  # the hub's own would not name a variable that cannot be obeyed
    try:
        if file is None:
            names: list[str] = hub.list_repo_files(repository)
            found = [name for name in names if name.endswith(".gguf")]
            if len(found) != 1:
                shown = ", ".join(found[:40]) or "none"
                raise InvalidInputError(f"{repository} has these GGUF files: {shown}. Name one.")
            file = found[0]
        return Path(hub.hf_hub_download(repository, file))
    except RemoteEntryNotFoundError:
        raise InvalidInputError(f"{repository} has no file {file}.") from None
    except HFValidationError as error:
        raise InvalidInputError(
            f"{repository} is not the name of a repository ({error})."
        ) from None
    except (HTTPError, OSError) as error:
        status = getattr(getattr(error, "response", None), "status_code", None)
        if status in (401, 403, 404):
            raise InvalidInputError(
                f"The hub gives no access to {repository} (HTTP {status}). Check the name; a "
                "gated model needs `hf auth login` first."
            ) from None
        raise ModelError(
            f"Cannot fetch {repository} ({error}). Check the connection and the free space, and "
            "run it again to continue."
        ) from None


def pulled_files() -> list[Path]:
    """All GGUF files of the hub's cache; none without the package."""
    try:
        hub = package("huggingface_hub")
    except ModelError:
        return []
    try:
        cached: Any = hub.scan_cache_dir()
    except hub.errors.CacheNotFound:
        return []
    return [
        Path(file.file_path)
        for repo in cached.repos
        for revision in repo.revisions
        for file in revision.files
        if file.file_name.endswith(".gguf")
    ]
