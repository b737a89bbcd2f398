"""LoRA adapters as GGUF files: finding, reading and writing them."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gguf
import numpy as np
import numpy.typing as npt

from goalscope.base.arrays import Floats
from goalscope.base.types import ModelError

logging.getLogger("gguf").setLevel(logging.WARNING)

_BLOCK = 32
"""Numbers of a row that share one scale in Q8_0."""

SHIPPED: Mapping[str, Path] = {
    name: Path(__file__).parent / name / "adapter.gguf" for name in ("general", "reader", "writer")
}
"""The files of the adapters that ship with goalscope for the embedded model, by their names."""

NO_ADAPTER = "none"
"""The value in place of an adapter's name for "no adapter"."""

FITTED_DIALOGUES = "fitted.dialogues"
"""Metadata key of the hashes of the training dialogues, separated by spaces."""

FITTED_GOALS = "fitted.goals"
"""Metadata key of the hashes of their true goals."""

FITTED_LAYOUT = "goalscope.layout"
"""Metadata key of the prompt layout (see `RolePlay`)."""

FITTED_SOURCES = "fitted.sources"
"""Metadata key of the training data, for people."""

FITTED_TASK = "fitted.task"
"""Metadata key that is "writing" for adapters of models that write."""

MODULES: Mapping[str, str] = {
    "q_proj": "attn_q",
    "k_proj": "attn_k",
    "v_proj": "attn_v",
    "o_proj": "attn_output",
    "gate_proj": "ffn_gate",
    "up_proj": "ffn_up",
    "down_proj": "ffn_down",
}
"""The layers that an adapter changes, by their names in Transformers and GGUF."""

ARCHITECTURES: Mapping[str, str] = {
    "llama": "llama",
    "mistral": "llama",
    "qwen2": "qwen2",
    "qwen3": "qwen3",
    "gemma2": "gemma2",
    "gemma3_text": "gemma3",
}
"""The architectures that can be adapted, by their names in Transformers and GGUF."""


@dataclass(frozen=True, slots=True)
class Adapter:
    """What a LoRA adapter adds to a model: to the weights W of a layer, scale * B A.

    Attributes:
        layers: A [rank, in] and B [out, rank] by the layer's number and its name in `MODULES`, with
            the rows of B in the order of Transformers.
        rank: Of all layers.
        alpha: The scale is alpha / rank.
        metadata: Text metadata of the file, by key.
    """

    layers: Mapping[tuple[int, str], tuple[Floats, Floats]]
    rank: int
    alpha: float
    metadata: Mapping[str, str] = field(default_factory=dict[str, str])


class GGUF(gguf.GGUFReader):
    """A GGUF file; one that ends too early is refused."""

    def _get(
        self, offset: int, dtype: Any, count: int = 1, override_order: Any = None
    ) -> npt.NDArray[Any]:
        self.data: Any = np.asarray(self.data)  # a plain view: a memmap's own slices are slow
        values = super()._get(offset, dtype, count, override_order)
        if len(values) < count:  # a list would be read without end
            raise ValueError("it ends too early")
        return values


def shipped(name: str = "general") -> Path | None:
    """The file of an adapter that ships with goalscope for the embedded model.

    Args:
        name: "general" for the likelihood of people's words, "reader" for reading, "writer" for
            goals, needs and questions.
    """
    path = SHIPPED[name]
    return path if path.is_file() else None


def lost_adapters() -> list[Path]:
    """Files of shipped adapters that are missing."""
    return [path for path in SHIPPED.values() if not path.is_file()]


def adapter_file(name: str | Path) -> Path:
    """The GGUF file of an adapter: the one named, or the one in the folder named.

    Raises:
        ModelError: There is none.
    """
    path = Path(os.path.expanduser(name))
    file = path / "adapter.gguf" if os.path.isdir(path) else path
    if not os.path.isfile(file):
        raise ModelError(
            f"There is no adapter at {path}. Name a GGUF file, or a folder with a finished "
            "`goalscope fit`."
        )
    return file


def write_adapter(path: Path, adapter: Adapter, config: Any) -> None:
    """Write an adapter for a model with this configuration of Transformers.

    Weights are Q8_0 if the rank is a multiple of 32, otherwise 16-bit.

    Raises:
        ModelError: The architecture is not supported.
        OSError: The file cannot be written.
    """
    if config.model_type not in ARCHITECTURES:
        raise ModelError(
            f"Adapters for {config.model_type} models cannot be written as GGUF files. "
            f"Supported are {', '.join(ARCHITECTURES)} models."
        )
    architecture = ARCHITECTURES[config.model_type]
    part = path.with_suffix(".part")
    writer = gguf.GGUFWriter(part, architecture)
    writer.add_type("adapter")
    writer.add_string("adapter.type", "lora")
    writer.add_float32("adapter.lora.alpha", adapter.alpha)
    for key, value in adapter.metadata.items():
        writer.add_string(key, value)
    for (layer, name), (a, b) in adapter.layers.items():
        heads = _heads(architecture, name, config)
        kind = gguf.GGMLQuantizationType
        kind = kind.F16 if a.shape[0] % _BLOCK or a.shape[1] % _BLOCK else kind.Q8_0
        for letter, weights in (("a", a), ("b", _interleaved(b, heads))):
            data = gguf.quantize(np.ascontiguousarray(weights, np.float32), kind)
            tensor = f"blk.{layer}.{MODULES[name]}.weight.lora_{letter}"
            writer.add_tensor(tensor, data, raw_dtype=kind)
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()
    os.replace(part, path)


def adapter_metadata(path: Path) -> dict[str, str]:
    """The text metadata of an adapter's file, by key.

    Raises:
        ModelError: It is not a GGUF file.
    """
    _, fields = _opened(path)
    return {name: value for name, value in fields.items() if isinstance(value, str)}


def read_adapter(path: Path, config: Any) -> Adapter:
    """Read an adapter for a model with this configuration of Transformers.

    Raises:
        ModelError: The file is not a LoRA adapter, or is for another kind of model.
    """
    reader, fields = _opened(path)
    architecture = fields.get("general.architecture")
    if fields.get("adapter.type") != "lora" or architecture != ARCHITECTURES.get(config.model_type):
        raise ModelError(
            f"{path} is not a LoRA adapter for {config.model_type} models. Use the model that "
            "it was fitted on, or fit an adapter for this model with `goalscope fit`."
        )
    names = {gguf_name: name for name, gguf_name in MODULES.items()}
    found: dict[tuple[int, str], dict[str, Floats]] = {}
    for tensor in reader.tensors:
        match = re.fullmatch(r"blk\.(\d+)\.(\w+)\.weight\.lora_([ab])", tensor.name)
        if match is None or match[2] not in names or len(tensor.shape) != 2:
            raise ModelError(f"{path} changes {tensor.name}, which goalscope cannot adapt.")
        try:
            value = np.array(gguf.dequantize(tensor.data, tensor.tensor_type), np.float32)
        except NotImplementedError as error:
            raise ModelError(f"{path} has weights of an unknown type ({error}).") from None
        found.setdefault((int(match[1]), names[match[2]]), {})[match[3]] = value
    try:
        layers = {
            place: (pair["a"], _parted(pair["b"], _heads(str(architecture), place[1], config)))
            for place, pair in found.items()
        }
        rank = next(iter(layers.values()))[0].shape[0]
        alpha = float(fields["adapter.lora.alpha"])
    except (KeyError, StopIteration, ValueError, TypeError):
        raise ModelError(
            f"{path} lacks weights, or was fitted on a model of another size. Use that model, "
            "or fit an adapter for this one with `goalscope fit`."
        ) from None
    ranks = {size for a, b in layers.values() for size in (a.shape[0], b.shape[1])}
    if ranks != {rank} or rank == 0 or not 0 < alpha < float("inf"):
        raise ModelError(
            f"{path} has layers of different ranks, or no scale. Only adapters with one rank "
            "for all layers are supported, such as those of `goalscope fit`."
        )
    texts = {name: value for name, value in fields.items() if isinstance(value, str)}
    return Adapter(layers, rank, alpha, texts)


def _opened(path: Path) -> tuple[Any, dict[str, Any]]:
    """The reader of a GGUF file, and its fields."""
    try:
        reader: Any = GGUF(path)
        return reader, {name: each.contents() for name, each in reader.fields.items()}
    except (OSError, ValueError, IndexError) as error:
        raise ModelError(f"{path} is not a complete GGUF file ({error}).") from None


def _heads(architecture: str, name: str, config: Any) -> int | None:
    """Heads whose rows llama.cpp has in another order than Transformers; None if in the same."""
    if architecture != "llama" or name not in ("q_proj", "k_proj"):
        return None
    return config.num_attention_heads if name == "q_proj" else config.num_key_value_heads


def _interleaved(rows: Floats, heads: int | None) -> Floats:
    """Rows with the halves of each head, which rotary embedding pairs, taken in turns."""
    if heads is None:
        return rows
    return rows.reshape(heads, 2, -1, rows.shape[1]).swapaxes(1, 2).reshape(rows.shape)


def _parted(rows: Floats, heads: int | None) -> Floats:
    """The inverse of `_interleaved`."""
    if heads is None:
        return rows
    return rows.reshape(heads, -1, 2, rows.shape[1]).swapaxes(1, 2).reshape(rows.shape)
