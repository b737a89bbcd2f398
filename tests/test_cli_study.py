"""`goalscope study`: made from a file, listed, shown and exported."""

import json

from commands import fails, run
from databases import begin
from goalscope.storage.store import Store
from test_study import EXAMPLE, fill

METHODS = ("good", "no-goals", "no-inference")


def test_a_study_is_made_shown_closed_exported_and_deleted(tmp_path, monkeypatch):
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "s.db"))

    def listed():
        (table,) = json.loads(run("study", "list", "--json").stdout)
        return table["rows"]

    assert "no studies yet" in run("study", "list").stdout
    assert "No person has a finished episode" in fails(2, "study", "new", EXAMPLE)
    with Store.open() as store:
        fill(store, METHODS)
        for method in METHODS:
            talk = begin(store, domain="grocery", method=method, model="m", task="You shop.")
            store.finish(talk, ended="terminated")
    assert run("study", "example").stdout == EXAMPLE.read_text()
    made = run("study", "new", EXAMPLE).stdout
    assert "has 6 episodes to rate, which takes at least 5 people" in made
    assert "/study/grocery?id=..." in made
    assert "already" in fails(2, "study", "new", EXAMPLE)
    assert "did you mean 'grocery'" in fails(2, "study", "show", "grocer")
    shown = [each["name"] for each in json.loads(run("study", "show", "grocery", "--json").stdout)]
    assert shown == ["study-grocery-progress", "study-grocery-methods"]
    run("study", "export", "grocery", "--out", tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_text().count("\n") == 1
    assert "no participant 7" in fails(2, "study", "forget", "grocery", "7")
    assert "grocery is closed" in run("study", "close", "grocery").stdout
    assert [row["closed"] > row["made"] for row in listed()] == [True]
    assert run("study", "delete", "grocery", input="n\n").exit_code == 1
    assert len(listed()) == 1
    said = run("study", "delete", "grocery", "--yes").stdout
    assert said == "Deleted study grocery and the answers of 0 people. Its episodes are kept.\n"
    assert listed() == []

    text = EXAMPLE.read_text().replace("transcript = false", "transcript = true")
    (tmp_path / "shown.toml").write_text(text)
    said = run("study", "new", tmp_path / "shown.toml").stdout
    assert "has 9 episodes" in said
    assert "real people said in 3 of the episodes" in said
