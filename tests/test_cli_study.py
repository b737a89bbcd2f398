"""`goalscope study`: made from a file, listed, shown and exported."""

import json

from commands import fails, run
from goalscope.storage.store import Store
from test_study import EXAMPLE, fill

METHODS = ("good", "no-goals", "no-inference")


def test_on_the_command_line(tmp_path, monkeypatch):
    place = str(tmp_path / "s.db")
    monkeypatch.setenv("GOALSCOPE_STORE", place)
    assert "no studies yet" in run("study", "list").stdout
    assert "No person has a finished episode" in fails(2, "study", "new", str(EXAMPLE))
    with Store.open(place) as store:
        fill(store, METHODS)
    assert "/study/grocery?id=..." in run("study", "new", str(EXAMPLE)).stdout
    assert run("study", "example").stdout == EXAMPLE.read_text()
    assert "already" in fails(2, "study", "new", str(EXAMPLE))
    (table,) = json.loads(run("study", "list", "--json").stdout)
    assert table["rows"][0]["name"] == "grocery"
    assert "did you mean 'grocery'" in fails(2, "study", "show", "grocer")
    names = [each["name"] for each in json.loads(run("study", "show", "grocery", "--json").stdout)]
    assert names == [f"study-grocery-{kind}" for kind in ("progress", "methods")]
    run("study", "export", "grocery", "--out", str(tmp_path / "out.csv"))
    assert (tmp_path / "out.csv").read_text().count("\n") == 1
    assert "no participant 7" in fails(2, "study", "forget", "grocery", "7")


def test_a_study_is_closed_and_deleted(tmp_path, monkeypatch):
    place = str(tmp_path / "s.db")
    monkeypatch.setenv("GOALSCOPE_STORE", place)
    with Store.open(place) as store:
        fill(store, METHODS)
        for method in METHODS:
            talk = store.begin(
                domain="grocery", method=method, model="m", task="You shop.", settings={}
            )
            store.finish(talk, ended="terminated")
    assert (
        "has 6 episodes to rate, which takes at least 5 people"
        in run("study", "new", EXAMPLE).stdout
    )
    shown = tmp_path / "shown.toml"
    text = EXAMPLE.read_text().replace("transcript = false", "transcript = true")
    shown.write_text(text.replace('"grocery"\ntitle', '"shown"\ntitle'))
    said = run("study", "new", shown).stdout
    assert "has 9 episodes" in said
    assert "real people said in 3 of the episodes" in said
    run("study", "delete", "shown", "--yes")
    assert "no study" in fails(2, "study", "close", "grocer")
    assert "grocery is closed" in run("study", "close", "grocery").stdout
    (table,) = json.loads(run("study", "list", "--json").stdout)
    (row,) = table["rows"]
    assert row["closed"] > row["made"]
    assert run("study", "delete", "grocery", input="n\n").exit_code == 1
    assert json.loads(run("study", "list", "--json").stdout)[0]["rows"]
    said = run("study", "delete", "grocery", "--yes").stdout
    assert said == "Deleted study grocery and the answers of 0 people. Its episodes are kept.\n"
    assert json.loads(run("study", "list", "--json").stdout)[0]["rows"] == []
    assert "no study" in fails(2, "study", "delete", "grocery", "--yes")
