"""llama.cpp's C interface: finding its library, and the functions that goalscope calls."""

from __future__ import annotations

import ctypes
import importlib.metadata
import importlib.util
import os
import platform
import sys
from collections.abc import Mapping
from contextlib import suppress
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

from goalscope.base.types import ModelError

ALL_F32 = 0
"""The type of a file whose weights are all F32."""

CONTROL, USER_DEFINED = 1 << 3, 1 << 4
"""Attributes of tokens that are markup."""

_Settings = tuple[tuple[str, Any, object], ...]


def _fields(settings: _Settings) -> list[tuple[str, Any]]:
    """As a structure declares them, with room for what a newer library may write behind them."""
    return [*((name, kind) for name, kind, _ in settings), ("spare", ctypes.c_byte * 256)]


# Of each setting its name, its type, and what it is when llama.cpp makes it: by that their places
# are known to be these.
_MODEL: _Settings = (
    ("devices", c_void_p, None),
    ("tensor_buft_overrides", c_void_p, None),
    ("n_gpu_layers", c_int32, -1),
    ("split_mode", c_int32, 1),
    ("load_mode", c_int32, -1),
    ("lazy_mode", c_int32, 1),
    ("main_gpu", c_int32, 0),
    ("tensor_split", c_void_p, None),
    ("progress_callback", c_void_p, None),
    ("progress_callback_user_data", c_void_p, None),
    ("kv_overrides", c_void_p, None),
    ("vocab_only", c_bool, False),
    ("check_tensors", c_bool, False),
    ("use_extra_bufts", c_bool, True),
)
_CONTEXT: _Settings = (
    ("n_ctx", c_uint32, 512),
    ("n_batch", c_uint32, 2048),
    ("n_ubatch", c_uint32, 512),
    ("n_seq_max", c_uint32, 1),
    ("n_rs_seq", c_uint32, 0),
    ("n_outputs_max", c_uint32, 0),
    ("n_outputs_max_per_seq", c_uint32, 1),
    ("n_threads", c_int32, 4),
    ("n_threads_batch", c_int32, 4),
    ("ctx_type", c_int32, 0),
    ("rope_scaling_type", c_int32, -1),
    ("pooling_type", c_int32, -1),
    ("attention_type", c_int32, -1),
    ("flash_attn_type", c_int32, -1),
    ("rope_freq_base", c_float, 0.0),
    ("rope_freq_scale", c_float, 0.0),
    ("yarn_ext_factor", c_float, -1.0),
    ("yarn_attn_factor", c_float, -1.0),
    ("yarn_beta_fast", c_float, -1.0),
    ("yarn_beta_slow", c_float, -1.0),
    ("yarn_orig_ctx", c_uint32, 0),
    ("defrag_thold", c_float, -1.0),
    ("cb_eval", c_void_p, None),
    ("cb_eval_user_data", c_void_p, None),
    ("type_k", c_int32, 1),
    ("type_v", c_int32, 1),
    ("moe_cache_size", c_size_t, 0),
    ("abort_callback", c_void_p, None),
    ("abort_callback_data", c_void_p, None),
    ("embeddings", c_bool, False),
    ("offload_kqv", c_bool, True),
    ("no_perf", c_bool, True),
    ("op_offload", c_bool, True),
    ("swa_full", c_bool, True),
    ("kv_unified", c_bool, False),
)


class _ModelParams(Structure):
    _fields_ = _fields(_MODEL)


class _ContextParams(Structure):
    _fields_ = _fields(_CONTEXT)


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


_P, _I, _TEXT = c_void_p, c_int32, c_char_p
_FUNCTIONS: Mapping[str, tuple[Any, tuple[Any, ...]]] = {
    "adapter_lora_init": (_P, (_P, _TEXT)),
    "backend_init": (None, ()),
    "context_default_params": (_ContextParams, ()),
    "decode": (_I, (_P, Batch)),
    "free": (None, (_P,)),
    "ftype_name": (_TEXT, (_I,)),
    "get_logits": (POINTER(c_float), (_P,)),
    "get_memory": (_P, (_P,)),
    "init_from_model": (_P, (_P, _ContextParams)),
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
    "model_meta_val_str": (_I, (_P, _TEXT, _TEXT, c_size_t)),
    "model_n_ctx_train": (_I, (_P,)),
    "model_n_embd": (_I, (_P,)),
    "model_n_head": (_I, (_P,)),
    "model_n_head_kv": (_I, (_P,)),
    "model_n_layer": (_I, (_P,)),
    "model_n_params": (ctypes.c_uint64, (_P,)),
    "n_batch": (c_uint32, (_P,)),
    "n_ctx": (c_uint32, (_P,)),
    "n_ctx_seq": (c_uint32, (_P,)),
    "n_seq_max": (c_uint32, (_P,)),
    "n_threads": (_I, (_P,)),
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
    """A package that contains llama.cpp.

    Attributes:
        name: As pip knows it.
        module: As Python knows it.
        tried: A version that goalscope was tried with.
        file: The library's name in it, as a pattern.
    """

    name: str
    module: str
    tried: str
    file: str

    def load(self) -> Engine:
        """The library, ready to be called.

        Raises:
            ModelError: It is not installed, cannot be loaded, or is not the llama.cpp that is
                declared here.
        """
        found = importlib.util.find_spec(self.module)
        folders = (found and found.submodule_search_locations) or ()
        path = next((file for each in folders for file in Path(each).glob(self.file)), None)
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
                f"{self.name} {version} has an unsupported version of llama.cpp; run `pip "
                f'install "{self.name}=={self.tried}"`'
            )
        # The logger is a C function that does nothing: a Python one could swallow a Ctrl-C.
        lib.llama_log_set(ctypes.cast(lib.llama_supports_mmap, c_void_p), None)
        lib.llama_backend_init()
        return Engine(f"{self.name} {version}", lib)


PACKAGE = (
    Package("llama-cpp-py-sync", "llama_cpp_py_sync", "0.11739", "llama.dll")
    if sys.platform == "win32"
    else Package("xllamacpp", "xllamacpp", "2026.10.11549", "xllamacpp*.so")
)
"""The one for this platform, prebuilt for all its processors."""


@dataclass(frozen=True, slots=True)
class Engine:
    """llama.cpp, loaded.

    Attributes:
        name: The package that it comes from, and its version.
        lib: Its functions, by their names in C.
    """

    name: str
    lib: Any


@lru_cache(maxsize=1)
def engine() -> Engine:
    """The engine of this process.

    Raises:
        ModelError: It cannot be loaded.
    """
    # Busy waiting makes two processes on the same cores lock each other out.
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    try:
        return PACKAGE.load()
    except ModelError as error:
        raise ModelError(
            f"The language model engine is missing: {error}. Run `pip install goalscope` again. "
            "On Linux it needs libgomp (Debian's package libgomp1)."
        ) from None


def processor() -> str:
    """The processor's name, as the system gives it."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _declared(lib: Any) -> bool:
    """Declare the functions' types; return whether the library is supported."""
    for name, (result, arguments) in _FUNCTIONS.items():
        function = getattr(lib, f"llama_{name}")
        function.restype, function.argtypes = result, arguments
    return all(
        getattr(params, name) == value
        for params, settings in (
            (lib.llama_context_default_params(), _CONTEXT),
            (lib.llama_model_default_params(), _MODEL),
        )
        for name, _, value in settings
    )
