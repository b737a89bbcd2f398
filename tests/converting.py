"""Model files in another type of weights, to compare arithmetic."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gguf
import numpy as np

from goalscope.models.adapters import GGUF


def convert(source: Path, target: Path, weights: str) -> None:
    """Write a model file with all its matrices as "F32" or "F16"."""
    kind = gguf.GGMLQuantizationType[weights]
    reader = GGUF(source)
    writer = gguf.GGUFWriter(target, str(reader.fields["general.architecture"].contents()))
    for name, field in reader.fields.items():
        if name not in ("general.architecture", "general.file_type") and "GGUF." not in name:
            array = field.types[0] == gguf.GGUFValueType.ARRAY
            inner = field.types[-1] if array else None
            writer.add_key_value(name, field.contents(), field.types[0], sub_type=inner)
    writer.add_file_type(gguf.LlamaFileType[{"F32": "ALL_F32", "F16": "MOSTLY_F16"}[weights]])
    for tensor in reader.tensors:
        data: Any = tensor.data
        if data.ndim > 1:
            plain = gguf.dequantize(data, tensor.tensor_type).astype(np.float32)
            data = gguf.quantize(np.ascontiguousarray(plain), kind)
        writer.add_tensor(tensor.name, data)
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()
