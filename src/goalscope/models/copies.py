"""A copy of a model's weights with an adapter in them: it writes twice as fast."""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import gguf
import numpy as np
import numpy.typing as npt
from filelock import FileLock

from goalscope.types import ModelError

__all__ = ["merged"]

logging.getLogger("gguf").setLevel(logging.WARNING)

_TYPE = gguf.GGMLQuantizationType.Q8_0
_BLOCK = 32  # numbers of a row that share one scale in it

Floats = npt.NDArray[np.float32]


def merged(source: Path, adapter: Path, folder: Path) -> Path:
    """A file with the adapter's changes in the weights, of 8 bits; made once, and kept.

    Args:
        source: GGUF file of the model, with 16-bit weights.
        adapter: GGUF file of a LoRA adapter for it.
        folder: Where the copy is kept.

    Raises:
        ModelError: The adapter is for another model, or one of the files is broken.
        OSError: The folder cannot be written, or the disk is full.
    """
    digest = hashlib.sha256(source.name.encode() + adapter.read_bytes()).hexdigest()[:12]
    target = folder / f"{source.stem}-with-{digest}.gguf"
    if target.is_file():
        return target
    if shutil.disk_usage(folder).free < 2 * source.stat().st_size:
        raise OSError(f"{folder} has too little room for another copy of {source.name}.")
    with (
        FileLock(folder / ".merge-lock"),
        tempfile.TemporaryDirectory(dir=folder, prefix=".tune-") as work,
    ):
        if not target.is_file():
            part = Path(work, target.name)
            try:
                _write(source, adapter, part)
            except (ValueError, KeyError, IndexError, NotImplementedError) as error:
                raise ModelError(f"{adapter} cannot be merged into {source} ({error}).") from None
            os.replace(part, target)
    return target


def _write(source: Path, adapter: Path, target: Path) -> None:
    changes = _changes(adapter)
    reader = gguf.GGUFReader(source)
    writer = gguf.GGUFWriter(target, str(reader.fields["general.architecture"].contents()))
    for name, each in reader.fields.items():
        if name != "general.architecture" and not name.startswith("GGUF."):
            kind = each.types[0]
            inner = each.types[-1] if kind == gguf.GGUFValueType.ARRAY else None
            writer.add_key_value(name, each.contents(), kind, sub_type=inner)
    for tensor in reader.tensors:
        data: Any = tensor.data
        kind = tensor.tensor_type
        if tensor.data.ndim > 1 and tensor.shape[0] % _BLOCK == 0:
            weights = gguf.dequantize(tensor.data, kind).astype(np.float32)
            if tensor.name in changes:
                weights = weights + changes.pop(tensor.name)
            data, kind = gguf.quantize(np.ascontiguousarray(weights), _TYPE), _TYPE
        writer.add_tensor(tensor.name, data, raw_dtype=kind)
    if changes:
        raise KeyError(f"there is no {next(iter(changes))}")
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()


def _changes(adapter: Path) -> dict[str, Floats]:
    """What the adapter adds to each tensor, by its name."""
    reader = gguf.GGUFReader(adapter)
    factors: dict[str, dict[str, Floats]] = {}
    for tensor in reader.tensors:
        name, _, letter = tensor.name.rpartition(".lora_")
        weights = gguf.dequantize(tensor.data, tensor.tensor_type).astype(np.float32)
        factors.setdefault(name, {})[letter] = weights
    alpha = float(reader.fields["adapter.lora.alpha"].contents())
    return {
        name: (alpha / pair["a"].shape[0]) * (pair["b"] @ pair["a"])
        for name, pair in factors.items()
    }
