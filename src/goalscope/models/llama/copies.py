"""Copies of a model's weights: converted to another type, or merged with an adapter."""

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

from goalscope.base.types import ModelError

__all__ = ["GGUF", "merged", "requantize"]

logging.getLogger("gguf").setLevel(logging.WARNING)

_BLOCK = 32  # numbers of a row that share one scale in 8 bits
_OWN = ("general.architecture", "general.file_type")  # what a copy says for itself
_FILE_TYPES = {
    gguf.GGMLQuantizationType.F32: gguf.LlamaFileType.ALL_F32,
    gguf.GGMLQuantizationType.F16: gguf.LlamaFileType.MOSTLY_F16,
    gguf.GGMLQuantizationType.BF16: gguf.LlamaFileType.MOSTLY_BF16,
    gguf.GGMLQuantizationType.Q8_0: gguf.LlamaFileType.MOSTLY_Q8_0,
}

Floats = npt.NDArray[np.float32]


class GGUF(gguf.GGUFReader):
    """A GGUF file; one that ends too early is refused."""

    def _get(
        self, offset: int, dtype: Any, count: int = 1, override_order: Any = None
    ) -> npt.NDArray[Any]:
        self.data: Any = np.asarray(self.data)  # a plain view: a memmap's own slices are slow
        found = super()._get(offset, dtype, count, override_order)
        if len(found) < count:  # a list would be read without end
            raise ValueError("it ends too early")
        return found


def merged(source: Path, adapter: Path, folder: Path) -> Path:
    """The model merged with an adapter, as a cached 8-bit file.

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
        raise OSError(f"Not enough free space in {folder} for another copy of {source.name}.")
    with (
        FileLock(folder / ".merge-lock"),
        tempfile.TemporaryDirectory(dir=folder, prefix=".merge-") as work,
    ):
        for left in set(folder.glob(".merge-*")) - {Path(work)}:  # by a killed process
            shutil.rmtree(left, ignore_errors=True)
        if not target.is_file():
            part = Path(work, target.name)
            try:
                _write(source, part, gguf.GGMLQuantizationType.Q8_0, adapter)
            except (ValueError, KeyError, IndexError, NotImplementedError) as error:
                raise ModelError(f"{adapter} cannot be merged into {source} ({error}).") from None
            os.replace(part, target)
    return target


def requantize(source: Path, target: Path, weights: str) -> None:
    """Write `source` to `target` with all its matrices of one type.

    Args:
        source: A GGUF file.
        target: The GGUF file to write.
        weights: The type: "F32", "F16", "BF16" or "Q8_0".

    Raises:
        OSError: The file cannot be written, or the disk has no room for it.
        ModelError: The file cannot be converted.
    """
    if shutil.disk_usage(target.parent).free < 8 * source.stat().st_size:
        raise OSError(f"Not enough free space in {target.parent} to convert {source.name}.")
    try:
        _write(source, target, gguf.GGMLQuantizationType[weights])
    except (ValueError, KeyError, IndexError, NotImplementedError) as error:
        raise ModelError(f"{source} could not be converted ({error}).") from None


def _write(
    source: Path,
    target: Path,
    weights: gguf.GGMLQuantizationType,
    adapter: Path | None = None,
) -> None:
    """Copy a file with its matrices of one type, and what an adapter adds to some of them.

    One tensor after another is in memory.
    """
    reader = GGUF(source)
    changes = _Changes(adapter) if adapter else None
    writer = gguf.GGUFWriter(target, str(reader.fields["general.architecture"].contents()))
    for name, each in reader.fields.items():
        if name not in _OWN and not name.startswith("GGUF."):
            kind = each.types[0]
            inner = each.types[-1] if kind == gguf.GGUFValueType.ARRAY else None
            writer.add_key_value(name, each.contents(), kind, sub_type=inner)
    writer.add_file_type(_FILE_TYPES[weights])
    converted = {
        each.name: each.data.ndim > 1 and each.shape[0] % _BLOCK == 0 for each in reader.tensors
    }
    if changes and (lost := changes.names - {name for name, each in converted.items() if each}):
        raise KeyError(f"nothing can be added to {min(lost)}")
    block, size = gguf.GGML_QUANT_SIZES[weights]
    for tensor in reader.tensors:
        if converted[tensor.name]:
            shape = [int(each) for each in reversed(tensor.shape)]
            count = int(tensor.n_elements) // block * size
            writer.add_tensor_info(tensor.name, shape, np.dtype(np.float32), count, weights)
        else:
            data: Any = tensor.data
            writer.add_tensor_info(
                tensor.name, data.shape, data.dtype, data.nbytes, tensor.tensor_type
            )
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_ti_data_to_file()
    for tensor in reader.tensors:
        data = tensor.data
        if converted[tensor.name]:
            with np.errstate(all="ignore"):  # of weights that are damaged
                plain = gguf.dequantize(data, tensor.tensor_type).astype(np.float32)
                if changes and tensor.name in changes.names:
                    plain = plain + changes.of(tensor.name)
                data = gguf.quantize(np.ascontiguousarray(plain), weights)
        writer.write_tensor_data(data)
    writer.close()


class _Changes:
    """What an adapter adds to the tensors of a model.

    Attributes:
        names: Of the tensors.
    """

    def __init__(self, adapter: Path) -> None:
        reader = GGUF(adapter)
        self._factors: dict[str, dict[str, Floats]] = {}
        for tensor in reader.tensors:
            name, _, letter = tensor.name.rpartition(".lora_")
            weights = gguf.dequantize(tensor.data, tensor.tensor_type).astype(np.float32)
            self._factors.setdefault(name, {})[letter] = weights
        self._alpha = float(reader.fields["adapter.lora.alpha"].contents())
        self.names = self._factors.keys()

    def of(self, name: str) -> Floats:
        """What is added to a tensor, scale * B A."""
        pair = self._factors[name]
        return (self._alpha / pair["a"].shape[0]) * (pair["b"] @ pair["a"])
