"""llama.cpp's C interface: where its library is found, and what goalscope calls of it."""

from __future__ import annotations

import ctypes
import importlib
import importlib.metadata
import importlib.util
import logging
import os
import sys
from collections.abc import Mapping
from ctypes import (
    POINTER,
    Structure,
    c_bool,
    c_char_p,
    c_float,
    c_int8,
    c_int32,
    c_size_t,
    c_uint32,
    c_void_p,
)
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from goalscope.types import InvalidInputError, ModelError

__all__ = ["ALL_F32", "CONTROL", "USER_DEFINED", "Batch", "Candidate", "Candidates", "Engine"]
__all__ += ["NATIVE", "READY", "Package", "engine"]

log = logging.getLogger(__name__)

ALL_F32 = 0
"""The type of a file whose weights are all F32."""

CONTROL, USER_DEFINED = 1 << 3, 1 << 4
"""Attributes of tokens that are markup."""

_SPARE = ("spare", ctypes.c_byte * 256)  # a newer library may write more than is declared here


class _ModelParams(Structure):
    _fields_ = (
        ("devices", c_void_p),
        ("tensor_buft_overrides", c_void_p),
        ("n_gpu_layers", c_int32),
        ("split_mode", c_int32),
        ("load_mode", c_int32),
        ("lazy_mode", c_int32),
        ("main_gpu", c_int32),
        ("tensor_split", c_void_p),
        ("progress_callback", c_void_p),
        ("progress_callback_user_data", c_void_p),
        ("kv_overrides", c_void_p),
        ("vocab_only", c_bool),
        ("check_tensors", c_bool),
        ("use_extra_bufts", c_bool),
        _SPARE,
    )


_BEFORE_CALLBACK = (
    ("n_ctx", c_uint32),
    ("n_batch", c_uint32),
    ("n_ubatch", c_uint32),
    ("n_seq_max", c_uint32),
    ("n_rs_seq", c_uint32),
    ("n_outputs_max", c_uint32),
    ("n_outputs_max_per_seq", c_uint32),
    ("n_threads", c_int32),
    ("n_threads_batch", c_int32),
    ("ctx_type", c_int32),
    ("rope_scaling_type", c_int32),
    ("pooling_type", c_int32),
    ("attention_type", c_int32),
    ("flash_attn_type", c_int32),
    ("rope_freq_base", c_float),
    ("rope_freq_scale", c_float),
    ("yarn_ext_factor", c_float),
    ("yarn_attn_factor", c_float),
    ("yarn_beta_fast", c_float),
    ("yarn_beta_slow", c_float),
    ("yarn_orig_ctx", c_uint32),
    ("defrag_thold", c_float),
    ("cb_eval", c_void_p),
    ("cb_eval_user_data", c_void_p),
    ("type_k", c_int32),
    ("type_v", c_int32),
)
_FROM_CALLBACK = (
    ("abort_callback", c_void_p),
    ("abort_callback_data", c_void_p),
    ("embeddings", c_bool),
    ("offload_kqv", c_bool),
    ("no_perf", c_bool),
    ("op_offload", c_bool),
    ("swa_full", c_bool),
    ("kv_unified", c_bool),
    _SPARE,
)


class _ContextParams(Structure):
    _fields_ = (*_BEFORE_CALLBACK, *_FROM_CALLBACK)


class _LaterContextParams(Structure):
    _fields_ = (*_BEFORE_CALLBACK, ("moe_cache_size", c_size_t), *_FROM_CALLBACK)


class Batch(Structure):
    """Tokens to decode, as llama.cpp's `llama_batch` says."""

    _fields_ = (
        ("n_tokens", c_int32),
        ("token", POINTER(c_int32)),
        ("embd", POINTER(c_float)),
        ("pos", POINTER(c_int32)),
        ("n_seq_id", POINTER(c_int32)),
        ("seq_id", POINTER(POINTER(c_int32))),
        ("logits", POINTER(c_int8)),
    )


class Candidate(Structure):
    """A token that may come next, as `llama_token_data` says."""

    _fields_ = (("id", c_int32), ("logit", c_float), ("p", c_float))


class Candidates(Structure):
    """Tokens that may come next, as `llama_token_data_array` says."""

    _fields_ = (
        ("data", POINTER(Candidate)),
        ("size", c_size_t),
        ("selected", ctypes.c_ssize_t),
        ("sorted", c_bool),
    )


_NEW: Mapping[str, object] = {  # what they are when llama.cpp makes them: so their places are known
    "n_ctx": 512,
    "n_batch": 2048,
    "n_ubatch": 512,
    "n_seq_max": 1,
    "n_rs_seq": 0,
    "n_outputs_max": 0,
    "n_outputs_max_per_seq": 1,
    "n_threads": 4,
    "n_threads_batch": 4,
    "ctx_type": 0,
    "rope_scaling_type": -1,
    "pooling_type": -1,
    "attention_type": -1,
    "flash_attn_type": -1,
    "rope_freq_base": 0.0,
    "rope_freq_scale": 0.0,
    "yarn_ext_factor": -1.0,
    "yarn_attn_factor": -1.0,
    "yarn_beta_fast": -1.0,
    "yarn_beta_slow": -1.0,
    "yarn_orig_ctx": 0,
    "defrag_thold": -1.0,
    "cb_eval": None,
    "cb_eval_user_data": None,
    "type_k": 1,
    "type_v": 1,
    "moe_cache_size": 0,
    "abort_callback": None,
    "abort_callback_data": None,
    "embeddings": False,
    "offload_kqv": True,
    "no_perf": True,
    "op_offload": True,
    "swa_full": True,
    "kv_unified": False,
}
_NEW_MODEL: Mapping[str, object] = {
    "devices": None,
    "tensor_buft_overrides": None,
    "n_gpu_layers": -1,
    "split_mode": 1,
    "load_mode": -1,
    "lazy_mode": 1,
    "main_gpu": 0,
    "tensor_split": None,
    "progress_callback": None,
    "progress_callback_user_data": None,
    "kv_overrides": None,
    "vocab_only": False,
    "check_tensors": False,
    "use_extra_bufts": True,
}

_P, _I, _TEXT = c_void_p, c_int32, c_char_p
_FUNCTIONS: Mapping[str, tuple[Any, tuple[Any, ...]]] = {
    "adapter_lora_init": (_P, (_P, _TEXT)),
    "backend_init": (None, ()),
    "decode": (_I, (_P, Batch)),
    "free": (None, (_P,)),
    "ftype_name": (_TEXT, (_I,)),
    "get_logits": (POINTER(c_float), (_P,)),
    "get_memory": (_P, (_P,)),
    "log_set": (None, (_P, _P)),
    "memory_clear": (None, (_P, c_bool)),
    "memory_seq_cp": (None, (_P, _I, _I, _I, _I)),
    "memory_seq_rm": (c_bool, (_P, _I, _I, _I)),
    "model_free": (None, (_P,)),
    "model_ftype": (_I, (_P,)),
    "model_get_vocab": (_P, (_P,)),
    "model_is_hybrid": (c_bool, (_P,)),
    "model_is_recurrent": (c_bool, (_P,)),
    "model_load_from_file": (_P, (_TEXT, _ModelParams)),
    "model_default_params": (_ModelParams, ()),
    "n_batch": (c_uint32, (_P,)),
    "n_ctx": (c_uint32, (_P,)),
    "n_ctx_seq": (c_uint32, (_P,)),
    "n_seq_max": (c_uint32, (_P,)),
    "n_threads": (_I, (_P,)),
    "model_meta_val_str": (_I, (_P, _TEXT, _TEXT, c_size_t)),
    "model_n_ctx_train": (_I, (_P,)),
    "model_n_embd": (_I, (_P,)),
    "model_n_head": (_I, (_P,)),
    "model_n_head_kv": (_I, (_P,)),
    "model_n_layer": (_I, (_P,)),
    "model_n_params": (ctypes.c_uint64, (_P,)),
    "print_system_info": (_TEXT, ()),
    "sampler_accept": (None, (_P, _I)),
    "sampler_apply": (None, (_P, POINTER(Candidates))),
    "sampler_free": (None, (_P,)),
    "sampler_init_grammar": (_P, (_P, _TEXT, _TEXT)),
    "set_adapters_lora": (_I, (_P, POINTER(_P), c_size_t, POINTER(c_float))),
    "supports_mmap": (c_bool, ()),
    "token_to_piece": (_I, (_P, _I, _TEXT, _I, _I, c_bool)),
    "tokenize": (_I, (_P, _TEXT, _I, POINTER(_I), _I, c_bool, c_bool)),
    "vocab_bos": (_I, (_P,)),
    "vocab_eos": (_I, (_P,)),
    "vocab_get_add_bos": (c_bool, (_P,)),
    "vocab_get_attr": (_I, (_P, _I)),
    "vocab_get_text": (_TEXT, (_P, _I)),
    "vocab_is_eog": (c_bool, (_P, _I)),
    "vocab_n_tokens": (_I, (_P,)),
}


@dataclass(frozen=True, slots=True)
class Package:
    """A package that brings llama.cpp.

    Attributes:
        name: As pip knows it.
        module: As Python knows it.
        tried: A version that goalscope was tried with.
        places: Where in it the library may lie, as patterns.
    """

    name: str
    module: str
    tried: str
    places: tuple[str, ...]

    @property
    def library(self) -> Path | None:
        """The library's file; None where the package is not installed, or brings none."""
        found = importlib.util.find_spec(self.module)
        folders = (found and found.submodule_search_locations) or ()
        files = (
            file for folder in folders for each in self.places for file in Path(folder).glob(each)
        )
        return next(files, None)

    def load(self) -> Engine:
        """The library, ready to be called.

        Raises:
            ModelError: It is not installed, cannot be loaded, or is not the llama.cpp that is
                declared here.
        """
        path = self.library
        if path is None:
            raise ModelError(f"{self.name} is not installed")
        try:
            version = importlib.metadata.version(self.name)
            lib = ctypes.CDLL(str(path))
            known = _declared(lib)
        except (OSError, AttributeError, ImportError) as error:
            raise ModelError(f"{self.name} cannot be loaded ({error})") from None
        if not known:
            raise ModelError(
                f"{self.name} {version} holds a llama.cpp that is not known here; "
                f'`pip install "{self.name}=={self.tried}"` brings one that is'
            )
        # The logger is a C function that does nothing: a Python one could swallow a Ctrl-C.
        lib.llama_log_set(ctypes.cast(lib.llama_supports_mmap, c_void_p), None)
        lib.llama_backend_init()
        return Engine(self, version, lib)


_FILES = ("libllama.so", "libllama.dylib", "llama.dll")

NATIVE = Package("llama-cpp-python", "llama_cpp", "0.3.36", tuple(f"lib/{name}" for name in _FILES))
"""Compiled for this processor when it was installed."""

READY = (
    Package("llama-cpp-py-sync", "llama_cpp_py_sync", "0.11739", _FILES)
    if sys.platform == "win32"
    else Package("xllamacpp", "xllamacpp", "2026.10.11549", ("xllamacpp*.so",))
)
"""Compiled by its authors for most processors."""


@dataclass(frozen=True, slots=True)
class Engine:
    """llama.cpp, loaded.

    Attributes:
        package: What brought it.
        version: Of the package.
        lib: Its functions, by their names in C.
    """

    package: Package
    version: str
    lib: Any

    @property
    def name(self) -> str:
        """Package and version."""
        return f"{self.package.name} {self.version}"


@lru_cache(maxsize=1)
def engine() -> Engine:
    """The engine of this process: the one compiled here where it is installed.

    `GOALSCOPE_ENGINE` "ready" takes the one that came ready-built all the same, "native" no other.

    Raises:
        InvalidInputError: `GOALSCOPE_ENGINE` is something else.
        ModelError: There is none that can be loaded.
    """
    # Busy waiting makes two processes on the same cores lock each other out.
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    choices = {"": (NATIVE, READY), "native": (NATIVE,), "ready": (READY,)}
    choice = os.environ.get("GOALSCOPE_ENGINE", "")
    if choice not in choices:
        raise InvalidInputError(f"GOALSCOPE_ENGINE is native or ready, or not set; not {choice!r}.")
    troubles: list[str] = []
    for package in choices[choice]:
        try:
            return package.load()
        except ModelError as error:
            troubles.append(str(error))
            if package.library:
                log.warning("%s; `goalscope doctor` says which engine runs instead.", error)
    raise ModelError(
        f"There is no language model engine: {'; '.join(troubles)}. Run `pip install goalscope` "
        "again; `[native]` behind it compiles one. On Linux the ready-built one needs libgomp "
        "(Debian's package libgomp1)."
    )


def _declared(lib: Any) -> bool:
    """Tell Python what the functions take and give; whether the library is one that is known."""
    for name, (result, arguments) in _FUNCTIONS.items():
        function = getattr(lib, f"llama_{name}")
        function.restype, function.argtypes = result, arguments
    for layout in (_ContextParams, _LaterContextParams):
        lib.llama_context_default_params.restype = layout
        if _is_new(lib.llama_context_default_params(), _NEW):
            lib.llama_init_from_model.restype = c_void_p
            lib.llama_init_from_model.argtypes = (c_void_p, layout)
            return _is_new(lib.llama_model_default_params(), _NEW_MODEL)
    return False


def _is_new(params: Structure, defaults: Mapping[str, object]) -> bool:
    return all(getattr(params, name, value) == value for name, value in defaults.items())
