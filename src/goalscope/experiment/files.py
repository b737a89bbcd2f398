"""What of an episode stands in files: part of the cell, so that an edited file makes another."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

from goalscope.domains import Settings
from goalscope.types import Profile

__all__ = ["hashes_of", "person_of"]


def person_of(profile: Profile) -> dict[str, Any]:
    """The whole profile as JSON."""
    return json.loads(json.dumps(asdict(profile)))


def hashes_of(settings: Settings) -> dict[str, str]:
    """Hashes of the files that the settings name: people, catalogue, scene, calibration."""
    named = {
        "profiles": settings.profiles,
        "catalogue": settings.catalogue,
        "scene": settings.scene,
        "calibration": settings.calibration,
    }
    return {
        key: hashlib.sha256(Path(file).read_bytes()).hexdigest()[:12]
        for key, file in named.items()
        if file and os.path.isfile(file)
    }
