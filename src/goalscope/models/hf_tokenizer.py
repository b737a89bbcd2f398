"""Chats as tokens for Hugging Face models, without loading one: `tokenizers` does the work."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from pathlib import Path
from threading import Lock
from typing import Any, cast

from goalscope.base.optional_packages import package
from goalscope.base.types import ModelError
from goalscope.models.chat import ChatTokenizer
from goalscope.models.server import http_client

_REPOSITORY = re.compile(r"\w[\w.-]*(/\w[\w.-]*)?")


def chat_tokenizer(model: str | Path) -> ChatTokenizer:
    """The tokenizer and chat template of a Hugging Face model.

    A text's tokens are those that the model's own tokenizer gives to it alone. Two kinds of
    tokenizers do not give every text back: some normalise it first (NFC in Qwen's), and those that
    put a space before a text (Llama 2's) do so again where the name of a special token is cut.

    Args:
        model: Folder of a model, or its name on the Hugging Face hub (only small files are read).

    Raises:
        ModelError: It is missing or cannot be fetched, or has no fast tokenizer or chat template.
    """
    from tokenizers import Tokenizer

    path = tokenizer_file(model)
    try:
        tokenizer: Any = Tokenizer.from_file(str(path))
    except Exception as error:  # `tokenizers` raises no narrower one
        raise ModelError(
            f"The tokenizer {path} cannot be read ({error}). Download it again, or install a newer "
            "`tokenizers`."
        ) from None
    tokenizer.no_padding()
    tokenizer.no_truncation()
    config = _json(model, "tokenizer_config.json")
    further = _json(model, "special_tokens_map.json")
    bos, eos = (_token_text(config, further, name) for name in ("bos_token", "eos_token"))
    ends = _json(model, "generation_config.json").get("eos_token_id")
    ends = [] if ends is None else [ends] if isinstance(ends, int) else ends
    ends = [*filter(None, [tokenizer.token_to_id(eos)]), *ends]
    # What ends a turn is markup, also where the tokenizer does not call it special.
    tokenizer.add_special_tokens([*filter(None, map(tokenizer.id_to_token, ends))])

    encoding = Lock()

    def encode(text: str, *, markup: bool) -> Sequence[int]:
        with encoding:
            tokenizer.encode_special_tokens = not markup
            return tokenizer.encode(text, add_special_tokens=False).ids

    def decode(tokens: Sequence[int], *, markup: bool) -> str:
        return tokenizer.decode(list(tokens), skip_special_tokens=not markup)

    added: dict[int, Any] = tokenizer.get_added_tokens_decoder()
    bos_id = tokenizer.token_to_id(bos)
    return ChatTokenizer(
        encode,
        decode,
        template=_template(model, config),
        bos=(-1 if bos_id is None else bos_id, bos),
        eos=(ends[0] if ends else -1, eos),
        add_bos=bos_id is not None and tokenizer.encode("x").ids[:1] == [bos_id],
        names=[token.content for token in added.values()],
        controls=[*ends, *(i for i, token in added.items() if token.special)],
    )


def tokenizer_file(model: str | Path) -> Path:
    """The `tokenizer.json` of a model's folder, or of a model on the hub.

    Raises:
        ModelError: There is no such model, or it has no such file.
    """
    path = _file(model, "tokenizer.json")
    if path is None:
        raise ModelError(
            f"{model} has no tokenizer.json. Create one with transformers: "
            "`AutoTokenizer.from_pretrained(...).save_pretrained(FOLDER)`, or use another "
            "model."
        )
    return path


def _file(model: str | Path, name: str) -> Path | None:
    """A file of a model, None if the model has none of this name; the hub's are downloaded once."""
    folder = Path(os.path.expanduser(model))
    if folder.is_dir():
        return folder / name if (folder / name).is_file() else None
    if isinstance(model, Path) or not _REPOSITORY.fullmatch(model):
        raise ModelError(f"There is no model folder {model}. Check the path.")
    errors = package("huggingface_hub.errors")
    try:
        return Path(_fetched(model, name))
    except errors.LocalEntryNotFoundError:
        if name != "tokenizer.json":  # the first to be asked for
            return None
        raise ModelError(
            f"There is no folder {model}, and the Hugging Face hub cannot be reached. Check "
            "the path, or connect to the internet to download the model."
        ) from None
    except errors.EntryNotFoundError:
        return None
    except (errors.GatedRepoError, errors.RepositoryNotFoundError):
        raise ModelError(
            f"There is no folder {model}, and no accessible model of this name on the Hugging "
            "Face hub. Check the name; for a gated model, run `hf auth login` first."
        ) from None
    except (OSError, ValueError, package("httpx2").HTTPError) as error:
        reason = str(error).partition("\n")[0]
        raise ModelError(
            f"Cannot download {name} of {model} ({reason}). Try again, or name a local folder."
        ) from None


def _fetched(model: str, name: str) -> str:
    """The local path of a hub file. A hub that cannot be reached is tried only once."""
    hub, errors = package("huggingface_hub"), package("huggingface_hub.errors")
    try:
        return hub.hf_hub_download(model, name, local_files_only=True)
    except errors.LocalEntryNotFoundError:
        http_client().close()  # the hub's own would not name a variable that cannot be obeyed
    try:
        hub.get_hf_file_metadata(hub.hf_hub_url(model, name))
    except (package("httpx2").TransportError, errors.OfflineModeIsEnabled) as error:
        raise errors.LocalEntryNotFoundError(str(error)) from None
    return hub.hf_hub_download(model, name)


def _json(model: str | Path, name: str) -> dict[str, Any]:
    path = _file(model, name)
    if path is None:
        return {}
    try:
        data: Any = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ModelError(f"{path} is not JSON ({error}). Download the model again.") from None
    return cast("dict[str, Any]", data) if isinstance(data, dict) else {}


def _template(model: str | Path, config: dict[str, Any]) -> str | None:
    path = _file(model, "chat_template.jinja")
    if path is not None:
        return path.read_text(encoding="utf-8")
    template: Any = _json(model, "chat_template.json").get("chat_template")
    template = template or config.get("chat_template")
    if isinstance(template, list):
        named = {each["name"]: each["template"] for each in cast("list[dict[str, str]]", template)}
        return named.get("default")
    return template


def _token_text(config: dict[str, Any], further: dict[str, Any], name: str) -> str:
    """Text of a token that may be given as text, as an object, or not at all."""
    token: Any = config.get(name) or further.get(name) or ""
    return cast("dict[str, str]", token)["content"] if isinstance(token, dict) else token
