"""Fixtures that tests share."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from functools import partial
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import settings

from browsers import browser, enter  # noqa: F401
from commands import PROFILES
from databases import place, server  # noqa: F401
from fakes import NamedModel
from goalscope.models.llama.model import LlamaCpp
from lives import CATALOGUE
from servers import (  # noqa: F401
    exact_gguf,
    llama_server,
    llama_server_address,
)
from sites import address, visit  # noqa: F401

settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

if workers := int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "0")):
    # Threads of one process that wait for those of another waste the processors.
    os.environ["OMP_NUM_THREADS"] = str(max(1, (os.cpu_count() or 1) // workers))

_numbers = count()
_data = TemporaryDirectory(prefix="goalscope-tests-")
os.environ["XDG_DATA_HOME"] = _data.name  # of the processes that tests start


GROUPS = {
    "browser": {"browser"},
    "postgresql": {"server"},
    "server": {"llama_server", "llama_server_address"},
}
"""Fixtures that need more than Python, by the mark of the tests that use them."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests by what they need, so that a machine can run the groups apart."""
    for item in items:
        call = getattr(item, "callspec", None)
        values = [*call.params.values()] if call else []
        for name, fixtures in GROUPS.items():
            if fixtures & set(getattr(item, "fixturenames", ())) or name in values:
                item.add_marker(name)
        if {"torch", "transformers"} & vars(getattr(item, "module", None) or object).keys():
            item.add_marker("torch")


@pytest.fixture(autouse=True, scope="session")
def data_folder() -> Iterator[Path]:
    """Stands for the user's own, whose calibrations and episodes are none of the tests'."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("platformdirs.user_data_path", lambda *_: Path(_data.name))
        yield Path(_data.name)


@pytest.fixture(autouse=True)
def store_file(monkeypatch: pytest.MonkeyPatch) -> Path:
    """The store of the commands in a test; nobody has made it yet."""
    file = Path(_data.name, f"{next(_numbers)}.db")
    monkeypatch.setenv("GOALSCOPE_STORE", str(file))
    return file


@pytest.fixture
def words(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Commands use the small honest model; the list gets the adapter of each call for one."""
    asked = []

    def opened(*_: object, adapter: object = None, **__: object) -> NamedModel:
        asked.append(adapter)
        return NamedModel()

    monkeypatch.setattr("goalscope.models.opening.open_model", opened)
    return asked


@pytest.fixture
def shop(tmp_path: Path) -> list[str]:
    """The options for a tiny shop, and for a baker who comes to it."""
    (tmp_path / "shop.csv").write_text(CATALOGUE)
    (tmp_path / "people.toml").write_text(PROFILES)
    return ["--catalogue", str(tmp_path / "shop.csv"), "--profiles", str(tmp_path / "people.toml")]


@pytest.fixture
def figure(record_property: Callable[[str, object], None]) -> Callable[[str], None]:
    """Keeps what a test has measured, to be printed at the end."""
    return partial(record_property, "measured")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what tests gave to `figure`."""
    passed = terminalreporter.getreports("passed")
    figures = [
        (each.nodeid, value)
        for each in passed
        for name, value in each.user_properties
        if name == "measured"
    ]
    if figures:
        terminalreporter.section("measured")
    for test, figure in figures:
        terminalreporter.write_line(f"{test}: {figure}")


@pytest.fixture(scope="session")
def model() -> LlamaCpp:
    """The embedded model."""
    return LlamaCpp()
