"""`goalscope study`: made from a file, listed, shown and exported."""

import json

from goalscope.store import Store
from test_cli import fails, invoke
from test_study import EXAMPLE, PEOPLE, fill


def test_on_the_command_line(tmp_path, monkeypatch):
    place = str(tmp_path / "s.db")
    monkeypatch.setenv("GOALSCOPE_STORE", place)
    assert "no study yet" in invoke("study", "list").stdout
    assert "No episode that has ended" in fails(2, "study", "new", str(EXAMPLE))
    with Store.open(place) as store:
        fill(store)
    assert "/study/grocery" in invoke("study", "new", str(EXAMPLE), "--anyway").stdout
    assert invoke("study", "example").stdout == EXAMPLE.read_text()
    assert "already" in fails(2, "study", "new", str(EXAMPLE), "--anyway")
    (table,) = json.loads(invoke("study", "list", "--json").stdout)
    assert table["rows"][0][0] == "grocery"
    assert "did you mean 'grocery'" in fails(2, "study", "show", "grocer")
    names = [
        each["name"] for each in json.loads(invoke("study", "show", "grocery", "--json").stdout)
    ]
    assert names == [f"study-grocery-{kind}" for kind in ("progress", "methods", "episodes")]
    invoke("study", "export", "grocery", "--out", str(tmp_path / "out.csv"))
    assert (tmp_path / "out.csv").read_text().count("\n") == 1
    assert "no participant 7" in fails(2, "study", "forget", "grocery", "7")


def test_what_is_named_and_has_no_episode_is_told_before_the_study_is_made(tmp_path, monkeypatch):
    place = str(tmp_path / "s.db")
    monkeypatch.setenv("GOALSCOPE_STORE", place)
    with Store.open(place) as store:
        fill(store)
        profiles = sorted({info.profile for info in store.episodes() if info.profile})
    named = f'profiles = {json.dumps([*profiles, "Nobody"])}\nmethods = ["good", "no-inference"]\n'
    methods = 'methods = ["good", "no-goals", "no-inference"]\n'
    file = tmp_path / "study.toml"
    file.write_text(EXAMPLE.read_text().replace(methods, named))
    with Store.open(place) as store:
        lacking = "no-inference" not in {info.method for info in store.episodes()}
    said = fails(2, "study", "new", file)
    assert "the person Nobody of [episodes]" in said
    assert ("method no-inference" in said) == lacking
    assert "method good" not in said
    assert json.loads(invoke("study", "list", "--json").stdout)[0]["rows"] == []
    assert invoke("study", "new", file, "--anyway").exit_code == 0
    monkeypatch.setattr("goalscope.plain.SHOWN", {"m": "Known"})
    assert "Known" in invoke("study", "show", "grocery", "--json").stdout


def test_methods_that_have_no_person_in_common_are_not_compared(tmp_path, monkeypatch):
    file = tmp_path / "study.toml"
    file.write_text(EXAMPLE.read_text().replace(', "no-inference"]', "]"))
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "s.db"))
    with Store.open(tmp_path / "s.db") as store:
        fill(store, ("good",), people=1)
        fill(store, ("no-goals",), people=2)
    assert "not all of the same people" in invoke("study", "new", file).stdout
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "t.db"))
    monkeypatch.setattr("test_study.PEOPLE", PEOPLE[::-1])
    with Store.open(tmp_path / "t.db") as store:
        fill(store, ("no-goals",), people=1)
        monkeypatch.setattr("test_study.PEOPLE", PEOPLE)
        fill(store, ("good",), people=1)
    said = fails(2, "study", "new", file)
    assert "The methods" in said
    assert "have no person in common" in said
    assert invoke("study", "new", file, "--anyway").exit_code == 0


def test_a_study_is_closed_and_deleted(tmp_path, monkeypatch):
    place = str(tmp_path / "s.db")
    monkeypatch.setenv("GOALSCOPE_STORE", place)
    with Store.open(place) as store:
        fill(store)
        talk = store.begin(domain="grocery", method="good", model="m", task="You shop.")
        store.finish(talk, ended="terminated")
    said = invoke("study", "new", str(EXAMPLE), "--anyway").stdout
    assert "has 4 episodes" in said
    assert "Left out: 1 with real people" in said
    assert "no study" in fails(2, "study", "close", "grocer")
    assert "grocery is closed" in invoke("study", "close", "grocery").stdout
    (table,) = json.loads(invoke("study", "list", "--json").stdout)
    row = dict(zip(table["columns"], table["rows"][0], strict=True))
    assert row["closed"] > row["made"]
    assert invoke("study", "delete", "grocery", input="n\n").exit_code == 1
    assert json.loads(invoke("study", "list", "--json").stdout)[0]["rows"]
    said = invoke("study", "delete", "grocery", "--yes").stdout
    assert said == "Study grocery is deleted, with all that 0 people answered. Its episodes stay.\n"
    assert json.loads(invoke("study", "list", "--json").stdout)[0]["rows"] == []
    assert "no study" in fails(2, "study", "delete", "grocery", "--yes")
