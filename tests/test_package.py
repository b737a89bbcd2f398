"""What is released: the wheel holds all that the program needs, and its papers name one version."""

import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path
from zipfile import ZipFile

import pytest
from hatchling.build import build_wheel

import goalscope

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "goalscope"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the content of the wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        name = build_wheel(str(folder))
    with ZipFile(folder / name) as wheel:
        wheel.extractall(folder / "unpacked")
    return folder / "unpacked"


def files_in(folder: Path) -> set[str]:
    every = (each.relative_to(folder) for each in folder.rglob("*") if each.is_file())
    return {each.as_posix() for each in every if "__pycache__" not in each.parts}


def test_the_wheel_holds_every_file_of_the_source(unpacked: Path) -> None:
    assert files_in(unpacked / "goalscope") == files_in(SOURCE)
    weights = ROOT / "weights" / "src" / "goalscope_smollm2"
    assert files_in(unpacked / "goalscope_smollm2") == files_in(weights)
    assert "py.typed" in files_in(SOURCE)  # without it no type checker reads the annotations


@pytest.mark.parametrize("command", [["house", "scenes"], ["data", "list"], ["run", "--help"]])
def test_what_the_wheel_holds_runs(unpacked: Path, command: list[str]) -> None:
    code = "from goalscope.cli import main as cli; print(cli.__file__); cli.main()"
    done = subprocess.run(
        [sys.executable, "-c", code, *command],
        env={**os.environ, "PYTHONPATH": str(unpacked)},
        cwd=unpacked,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(str(unpacked))


def test_the_papers_name_the_version_of_the_package() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"\nversion: {PROJECT['version']}\n" in citation
    assert goalscope.__version__ == version("goalscope")
    released = re.findall(r"^## (\d\S*)$", changes, re.MULTILINE)
    assert released[0] == PROJECT["version"]


def test_importing_the_package_imports_none_of_its_dependencies() -> None:
    names = ("numpy", "llguidance", "sqlalchemy", "typer", "rich", "jinja2", "wordllama", "torch")
    code = f"import sys, goalscope; print([each for each in {names} if each in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.strip() == "[]"
