"""Packages that only some parts need: what is missing is named with what to install."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from commands import fails
from goalscope.base.optional_packages import EXTRAS
from goalscope.base.stats import bootstrap_mean
from goalscope.base.types import Goal, GoalscopeError, ModelError, Turn
from goalscope.experiment.baselines import bm25
from goalscope.models.server import Server
from goalscope.storage.store import Store

PROJECT = Path(__file__).parents[1] / "pyproject.toml"


def test_a_server_needs_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "openai", None)
    with pytest.raises(ModelError, match=r"openai.*goalscope\[remote\]"):
        Server("http://models.test/v1")


def said(use: Callable[[], object]) -> str:
    with pytest.raises(GoalscopeError) as caught:
        use()
    return str(caught.value)


@pytest.mark.parametrize(
    ("module", "extra", "use"),
    [
        ("uvicorn", "web", lambda: fails(1, "serve")),
        ("mcp.server", "mcp", lambda: fails(1, "mcp")),
        ("bm25s", "experiments", lambda: said(lambda: bm25([Goal("tea")], [Turn("", "tea")]))),
        ("scipy.stats", "experiments", lambda: said(lambda: bootstrap_mean([0.0, 1.0]))),
        ("psycopg", "postgres", lambda: said(lambda: Store.open("postgresql://u:x@h/d"))),
    ],
)
def test_what_is_missing_is_named_with_a_remedy_for_a_clone_and_for_a_release(
    monkeypatch: pytest.MonkeyPatch, module: str, extra: str, use: Callable[[], str]
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.delitem(sys.modules, "goalscope.web.mcp", raising=False)
    told = use()
    assert f'pip install ".[{extra}]"` in a clone' in told
    assert f'pip install "goalscope[{extra}]"' in told


def test_each_package_is_in_its_extra() -> None:
    extras = tomllib.loads(PROJECT.read_text())["project"]["optional-dependencies"]
    for name, extra in EXTRAS.items():
        assert any(each.startswith(name) for each in extras[extra]), (name, extra)
