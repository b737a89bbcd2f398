"""Command lines that are printed to be pasted: they open what was open, from any folder."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from commands import fails, only_episode, run
from goalscope.storage.store import Store
from test_study import EXAMPLE, fill


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A store whose name a shell would take apart, in a folder that commands start from."""
    folder = tmp_path / "it's  $HOME"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder / "my  episodes;.db"


def pasted(text: str, command: str) -> list[str]:
    """The words after `goalscope` of the one command line of a kind in a text."""
    (line,) = re.findall(rf"goalscope {command}.*?(?=`|$)", text, re.M)
    return shlex.split(line)[1:]


def test_an_episode_is_resumed_from_any_folder_by_the_line_that_is_printed(
    place: Path, shop: list[str], words: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ["--store", place.name, "--rounds", "1", "--trace", "calls.jsonl", *shop[:2]]
    told = run("chat", *options, input="add cocoa\n")
    again = pasted(told.stdout, "chat")
    info = only_episode(place)
    assert again == [
        "chat", "--resume", info.id, "--rounds", "2",
        "--trace", str(place.with_name("calls.jsonl")), "--store", str(place),
    ]  # fmt: skip
    monkeypatch.chdir("/")
    assert pasted(fails(2, "chat", "--resume", info.id, "--store", place), "chat")[:5] == again[:5]
    more = ["--rounds", "5", *again[5:]]
    told = run(*again[:3], *more, input="add milk\nquit\n")
    assert pasted(told.stderr, "chat") == [*again[:3], *more]  # not as many as at the start
    assert run(*pasted(told.stderr, "chat"), input="buy the basket\n").exit_code == 0
    assert only_episode(place).rounds == 3
    assert not Store.open().episodes()


def test_the_line_names_a_store_that_a_variable_names_from_this_folder(
    place: Path, shop: list[str], words: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GOALSCOPE_STORE", place.name)
    told = run("chat", *shop[:2], input="add cocoa\nquit\n")
    assert pasted(told.stderr, "chat")[-2:] == ["--store", str(place)]
    monkeypatch.setenv("GOALSCOPE_STORE", str(place))
    told = run("chat", *shop[:2], input="add cocoa\nquit\n")
    assert "--store" not in pasted(told.stderr, "chat")


def test_a_simulated_episode_that_is_interrupted_goes_on_by_the_line(
    place: Path, shop: list[str], words: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("goalscope.storage.session.Session._keep", interrupted_after_one())
        told = run("run", *shop, "--profile", "baker", "--store", place.name)
    assert told.exit_code == 130
    monkeypatch.chdir("/")
    assert run(*pasted(told.stderr, "chat")).exit_code == 0
    assert only_episode(place).rounds > 1


def interrupted_after_one():
    from goalscope.storage.session import Session

    keep = Session._keep

    def kept(session, round):
        if round.number > 1:
            raise KeyboardInterrupt
        keep(session, round)

    return kept


def test_what_else_is_to_be_pasted_names_the_store_too(
    place: Path, shop: list[str], words: list[object]
) -> None:
    named = ["--store", str(place)]
    Store.open(place).close()
    listed = run("episodes", "--store", place.name).stdout
    assert pasted(listed, "chat") == ["chat", *named]
    listed = run("episodes", "--text", "x", "--store", place.name).stdout
    assert pasted(listed, "episodes") == ["episodes", *named]
    said = fails(2, "replay", "x", "--store", place.name)
    assert pasted(said, "episodes") == ["episodes", *named]
    listed = run("study", "list", "--store", place.name).stdout
    assert pasted(listed, "study") == ["study", "new", "FILE", *named]
    said = fails(2, "study", "show", "x", "--store", place.name)
    assert pasted(said, "study") == ["study", "new", "FILE", *named]
    said = fails(2, "study", "new", EXAMPLE, "--store", place.name)
    assert pasted(said, "episodes") == ["episodes", *named]
    with Store.open(place) as store:
        fill(store, ("good", "no-goals", "no-inference"))
    made = run("study", "new", EXAMPLE, "--store", place.name).stdout
    assert pasted(made, "serve") == ["serve", *named]
    run("chat", "--store", place, *shop[:2], input="add cocoa\n/pin bake a cake\nquit\n")
    with Store.open(place) as store:
        info = store.episodes()[-1]
    assert pasted(run("why", info.id, *named).stderr, "chat")[1:3] == ["--resume", info.id]
    run("chat", "--resume", info.id, *named, input="buy the basket\nyes\n")
    said = fails(2, "chat", "--resume", info.id, *named)
    assert pasted(said, "replay") == ["replay", info.id, *named]


def test_a_store_that_nobody_named_is_not_named(shop: list[str], words: list[object]) -> None:
    told = run("chat", *shop[:2], input="add cocoa\nquit\n").stderr
    assert pasted(told, "chat") == ["chat", "--resume", only_episode().id]


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ("postgresql://u:secret-1@h/d?sslmode=require", "postgresql://u:PASSWORD@h/d?sslmode=require"),
        ("postgresql://u@h:1/d?password=secret-1", "postgresql://u@h:1/d"),
        ("postgresql://h/d", "postgresql://h/d"),
    ],
)  # fmt: skip
def test_no_password_stands_in_a_command_line(given: str, named: str) -> None:
    from goalscope.storage.opening import pasted as as_pasted

    assert as_pasted(given) == named


def test_data_models_and_adapters_are_named_as_a_shell_takes_them(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = place.with_name("my data")
    data.mkdir()
    said = fails(2, "data", "export", "teach", "--out", "x.jsonl", "--data", data)
    assert pasted(said, "data") == ["data", "list", "--data", str(data)]
    file = place.with_name("my model.gguf")
    monkeypatch.setattr("goalscope.models.hub.pull", lambda *_: file)
    assert pasted(run("models", "pull", "a/b").stderr, "chat") == ["chat", "--model", str(file)]
