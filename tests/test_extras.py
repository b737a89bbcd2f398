"""Packages that only some parts need: what is missing is named with what to install."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import pytest

from goalscope.extras import EXTRAS
from goalscope.models.http import Server
from goalscope.types import ModelError

PROJECT = Path(__file__).parents[1] / "pyproject.toml"


@pytest.mark.parametrize("missing", ["httpx2", "tenacity", "jsonschema"])
def test_a_server_needs_all_of_its_extra(monkeypatch: pytest.MonkeyPatch, missing: str) -> None:
    for module in ("httpx2", "tenacity", "jsonschema"):
        monkeypatch.setitem(sys.modules, module, None if module == missing else sys)
    with pytest.raises(ModelError, match=rf"{missing}.*goalscope\[remote\]"):
        Server("http://models.test/v1")


def test_each_package_is_in_its_extra() -> None:
    extras = tomllib.loads(PROJECT.read_text())["project"]["optional-dependencies"]
    for name, extra in EXTRAS.items():
        assert any(each.startswith(name) for each in extras[extra]), (name, extra)
