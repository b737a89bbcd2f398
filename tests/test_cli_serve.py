"""`goalscope serve`: the key of the host, which is kept and never told to a log."""

import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx
import pytest

from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.cli.serve import kept_key, serve
from processes import started

LAMP = str(Path(__file__).parents[1] / "examples" / "lamp.py")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    home = tmp_path / "home" / "goalscope"
    monkeypatch.setattr("platformdirs.user_data_path", lambda *_: home)
    return home


def test_the_key_is_kept_for_this_user_alone(folder: Path) -> None:
    key, file = kept_key()
    assert kept_key() == (key, file)
    assert [*folder.iterdir()] == [file]
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert len(key) >= 32
    file.unlink()
    assert kept_key()[0] != key


def test_of_servers_that_start_at_once_all_have_the_same_key(folder: Path) -> None:
    with ThreadPoolExecutor(16) as pool:
        keys = {key for key, _ in pool.map(lambda _: kept_key(), range(64))}
    assert len(keys) == 1
    assert len([*folder.iterdir()]) == 1


def test_a_key_that_is_not_as_it_was_made_is_refused_with_the_remedy(folder: Path) -> None:
    _, file = kept_key()
    file.write_text("short")
    with pytest.raises(GoalscopeError, match=r"damaged. Delete .*serve.key"):
        kept_key()
    file.write_text("k" * 32)
    file.chmod(0o640)
    with pytest.raises(GoalscopeError, match="Other users can read the key"):
        kept_key()
    file.unlink()
    file.mkdir()
    with pytest.raises(GoalscopeError, match="Cannot save or read the key") as error:
        kept_key()
    assert "GOALSCOPE_KEY" in str(error.value)


def test_what_may_be_a_log_holds_no_key_and_a_restart_keeps_it(tmp_path: Path) -> None:
    told: list[str] = []
    for _ in range(2):
        data = str(tmp_path)
        process = started(
            "serve", LAMP, "--port", "0", "--store", f"{data}/e.db", XDG_DATA_HOME=data
        )
        assert process.stdout
        address, _, secret = process.stdout.readline().split()[-1].partition("?key=")
        place = process.stdout.readline()
        key = Path(place.removeprefix("The key is saved in ").strip().rstrip(".")).read_text()
        assert secret == "KEY"
        bearer = {"authorization": f"Bearer {key}"}
        options = httpx.get(f"{address}api/options", headers=bearer)
        assert [each["title"] for each in options.json()["domains"]] == ["lamp"]
        told.append(key)
        process.kill()
        process.communicate()
    assert told[0] == told[1]
    assert os.path.commonpath([tmp_path, place.split()[-1]]) == str(tmp_path)


def test_a_key_that_could_be_guessed_is_refused() -> None:
    with pytest.raises(InvalidInputError, match=r"too easy to guess.* at least 16 char"):
        serve(key="k" * 15)


def test_a_name_with_a_scheme_is_refused_before_anything_is_opened(store_file: Path) -> None:
    with pytest.raises(InvalidInputError, match=r"https://x.*HOST\[:PORT\]"):
        serve(name=["goals.example.org", "https://x"])
    assert not store_file.exists()
