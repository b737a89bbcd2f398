"""Puts the embedded model's weights beside the package where it is built from a checkout.

A release has them as a distribution of its own (`weights/`), so that each file stays below the
100 MB that the package index takes; its source has no `weights/`, and it depends on that one.
"""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class BundledWeights(BuildHookInterface[Any]):
    """Adds the package `goalscope_smollm2` to a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Before a wheel is built, or the source is installed as it lies."""
        folder = Path(self.root, "weights")
        if folder.is_dir():
            fetched = runpy.run_path(str(folder / "hatch_build.py"))["fetched"]
            build_data["force_include"][str(fetched(folder))] = "goalscope_smollm2"
