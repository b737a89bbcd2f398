"""Which llama.cpp runs, and how one that goalscope does not know is refused."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from goalscope.models import engine as engines
from goalscope.models.engine import NATIVE, READY, Package
from goalscope.models.llamacpp import LlamaCpp
from goalscope.models.native import Weights
from goalscope.types import ModelError
from test_model_contract import CONTEXTS, REPLIES, sums

NAME = "from goalscope.models.engine import engine; print(engine().package.name)"


def chosen(**environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", NAME],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip()


@pytest.mark.skipif(NATIVE.library is None, reason="no engine was compiled here")
def test_the_compiled_engine_is_preferred_where_it_is_installed() -> None:
    assert chosen() == NATIVE.name
    assert chosen(GOALSCOPE_ENGINE="ready") == READY.name


@pytest.mark.skipif(NATIVE.library is None, reason="no engine was compiled here")
def test_both_engines_give_the_same_log_probabilities(exact_gguf: Path) -> None:
    found = []
    for package in (NATIVE, READY):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("goalscope.models.native.engine", package.load)
            patch.setenv("GOALSCOPE_TUNE", "0")
            model = LlamaCpp(exact_gguf)
            assert model.engine.package is package
            found.append(sums(model, CONTEXTS, REPLIES))
            model.close()
    assert abs(found[0] - found[1]).max() < 1e-3


def test_a_package_that_is_not_there_is_named() -> None:
    with pytest.raises(ModelError, match="llama-cpp-nowhere is not installed"):
        Package("llama-cpp-nowhere", "llama_cpp_nowhere", ("*.so",)).load()


def test_a_file_that_is_no_library_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "broken_engine"
    folder.mkdir()
    (folder / "libllama.so").write_text("This is no library.")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModelError, match=f"{READY.name} .* cannot be loaded"):
        replace(READY, module="broken_engine", places=("libllama.so",)).load()


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
@pytest.mark.parametrize("n_batch", [512, 2048])
def test_another_layout_of_its_settings_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, n_batch: int
) -> None:
    """As a llama.cpp that puts a new setting before those that goalscope sets."""
    folder = tmp_path / "other_engine"
    folder.mkdir()
    functions = "".join(
        f"int llama_{name}(void) {{ return 0; }}\n"
        for name in engines._FUNCTIONS  # pyright: ignore[reportPrivateUsage]
        if name != "model_default_params"
    )
    source = folder / "llama.c"
    source.write_text(
        "#include <string.h>\n"
        "typedef struct { unsigned added, n_ctx, n_batch; char rest[400]; } params;\n"
        f"{functions}"
        "params llama_model_default_params(void) { params p; memset(&p, 0, sizeof p); return p; }\n"
        "params llama_context_default_params(void) {\n"
        f"  params p; memset(&p, 0, sizeof p); p.n_ctx = 512; p.n_batch = {n_batch}; return p;\n"
        "}\nint llama_init_from_model(void) { return 0; }\n"
    )
    command = ["cc", "-shared", "-fPIC", "-w", "-o", str(folder / "libllama.so"), str(source)]
    subprocess.run(command, check=True)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModelError, match=r"holds a llama\.cpp that is not known here"):
        replace(READY, module="other_engine", places=("libllama.so",)).load()


def test_weights_may_be_loaded_by_another_engine_than_this_processes(ready_built: LlamaCpp) -> None:
    weights = Weights(ready_built.path, vocabulary_only=True, by=ready_built.engine)
    assert weights.tokenize("Pancakes.", markup=False) == list(
        ready_built.tokenizer.tokenize("Pancakes.")
    )
    weights.free()
