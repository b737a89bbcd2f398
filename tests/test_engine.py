"""A llama.cpp that goalscope does not know is refused."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from goalscope.base.types import ModelError
from goalscope.models.llama import engine as engines
from goalscope.models.llama.engine import PACKAGE


def test_a_missing_engine_says_what_to_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "PACKAGE", replace(PACKAGE, module="not_installed"))
    with pytest.raises(ModelError, match=r"is not installed\. Run `pip install goalscope` again"):
        engines.engine.__wrapped__()


def test_a_file_that_is_no_library_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "broken_engine"
    folder.mkdir()
    (folder / "libllama.so").write_text("This is no library.")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModelError, match=f"{PACKAGE.name} cannot be loaded"):
        replace(PACKAGE, module="broken_engine", file="libllama.so").load()


LAYOUT = (
    "unsigned n_ctx, n_batch, n_ubatch, n_seq_max, n_rs_seq, n_outputs_max, n_per_seq;"
    "int threads[2], ctx_type, rope, pooling, attention, flash; float base, scale, yarn[4];"
    "unsigned orig; float defrag; void *eval[2]; int type_k, type_v; size_t moe;"
    "void *abort[2]; _Bool embeddings, offload, no_perf, op, swa, unified; char rest[200];"
)
VALUES = (
    "p.n_ctx = 512; p.n_batch = 2048; p.n_ubatch = 512; p.n_seq_max = p.n_per_seq = 1;"
    "p.threads[0] = p.threads[1] = 4; p.rope = p.pooling = p.attention = p.flash = -1;"
    "p.yarn[0] = p.yarn[1] = p.yarn[2] = p.yarn[3] = p.defrag = -1; p.type_k = p.type_v = 1;"
    "p.offload = p.no_perf = p.op = p.swa = 1;"
)


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("unsigned n_ctx,", "unsigned added, n_ctx,"),
        ("int threads[2],", "int added, threads[2],"),
        ("rope, pooling", "rope, added, pooling"),
        ("float defrag; void *eval[2];", "void *eval[2];"),
        ("size_t moe;", ""),
        ("embeddings, offload", "added, embeddings, offload"),
        ("", ""),
    ],
)
def test_another_layout_of_its_settings_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str
) -> None:
    """As a llama.cpp that has one setting more or less than goalscope knows."""
    folder = tmp_path / "other_engine"
    folder.mkdir()
    made = {"model_default_params", "context_default_params", "init_from_model"}
    names = engines._FUNCTIONS.keys() - made  # pyright: ignore[reportPrivateUsage]
    values = VALUES if "defrag" in LAYOUT.replace(old, new) else VALUES.replace("= p.defrag", "")
    source = folder / "llama.c"
    source.write_text(
        "#include <stddef.h>\n#include <string.h>\n"
        + "".join(f"int llama_{name}(void) {{ return 0; }}\n" for name in sorted(names))
        + "int llama_init_from_model(void) { return 0; }\n"
        + "typedef struct { void *devices[2]; int gpu, split, load, lazy, main; void *rest[4];\n"
        + "  _Bool vocab, check, extra; char more[200]; } model;\n"
        + "model llama_model_default_params(void) { model p; memset(&p, 0, sizeof p);\n"
        + "  p.gpu = p.load = -1; p.split = p.lazy = 1; p.extra = 1; return p; }\n"
        + f"typedef struct {{ {LAYOUT.replace(old, new, 1) if old else LAYOUT} }} params;\n"
        + "params llama_context_default_params(void) { params p; memset(&p, 0, sizeof p);\n"
        + f"  {values} return p; }}\n"
    )
    command = ["cc", "-shared", "-fPIC", "-w", "-o", str(folder / "libllama.so"), str(source)]
    subprocess.run(command, check=True)
    monkeypatch.syspath_prepend(tmp_path)
    package = replace(PACKAGE, module="other_engine", file="libllama.so")
    if not old:
        package.load()
        return
    with pytest.raises(ModelError, match=r"unsupported version of llama.cpp; run `pip install"):
        package.load()
