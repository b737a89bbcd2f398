"""The report: Markdown with figures and tables beside it; nothing in it acts."""

import json
import math
import re
import sqlite3
from pathlib import Path
from urllib.parse import unquote
from xml.dom import minidom

import pytest
from typer import Typer
from typer.testing import CliRunner

from databases import begin
from goalscope.base.types import GoalscopeError, InvalidInputError
from goalscope.cli.report import report
from goalscope.experiment.dialogues import PREDICTORS, SEEN, UNIFORM, read_dialogues
from goalscope.experiment.fitted_baselines import FITTED_METHODS
from goalscope.experiment.results import Results
from goalscope.report import read_report, write_report
from goalscope.report.figures import belief_figures, draw_figure
from goalscope.storage.store import Store
from reports import HOSTILE, IDENTITY, dialogue, episode, fill, judged, mcq, texts
from test_summary_dialogues import SURE
from test_summary_dialogues import dialogue as measured


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    episodes = [episode("good", HOSTILE.replace("\ud800", ""), 1.0), episode("good", "b", 0.5)]
    episodes += [episode("no-goals", "b", 0.25)]
    judges = [judged(spec, [3.0, 2.0, 2.5]) for spec, _ in episodes]
    fill(tmp_path / "people.db", [*episodes, *judges], title=HOSTILE.replace("\ud800", ""))
    fill(tmp_path / "talk.db", [dialogue(n) for n in range(6)], source="Sec. 4.2")
    fill(tmp_path / "mcq.db", [mcq(n) for n in range(3)])
    return tmp_path


def files(out: Path) -> dict[str, bytes]:
    return {
        str(file.relative_to(out)): file.read_bytes() for file in out.rglob("*") if file.is_file()
    }


def test_nothing_in_a_report_acts_or_asks_for_anything(folder: Path, tmp_path: Path) -> None:
    write_report(read_report(folder), tmp_path / "out.md")
    pages = [tmp_path / "out.md", *(tmp_path / "out").glob("*.md")]
    text = "".join(page.read_text(encoding="utf-8") for page in pages)
    assert "&lt;script&gt;alert(1)" in text
    assert not set(text) & set("<\x1b\u202e\ud800")
    for page in pages:
        for target in re.findall(r"(?<!\\)\]\(([^)]*)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / unquote(target)).is_file(), target
    pictures = [*(tmp_path / "out" / "figures").glob("*.svg")]
    assert pictures
    for file in pictures:
        every = minidom.parseString(file.read_bytes()).getElementsByTagName("*")
        assert {"script", "image", "foreignObject", "a"}.isdisjoint(e.nodeName for e in every)
        found = [item for each in every for item in each.attributes.items()]
        assert not [name for name, _ in found if name.startswith("on")]
        assert all(value[0] == "#" for name, value in found if name.endswith("href"))
        assert not re.search(r"url\((?!#)|@import", file.read_text(encoding="utf-8"))


def test_the_same_results_give_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    for out in ("one", "two"):
        write_report(read_report(folder), tmp_path / out / "report.md")
    one, two = files(tmp_path / "one"), files(tmp_path / "two")
    assert one == two
    assert {Path(name).suffix for name in one} == {".md", ".svg", ".csv"}


def test_every_way_to_infer_has_a_line_by_turn(tmp_path: Path) -> None:
    likeness = {name: [[1.0, 0, 0, 0]] for name in ("tfidf", "bm25", "embedding")}
    even = [[math.log(1 / 4)] * 4]
    likeness |= {"fitted": dict.fromkeys(FITTED_METHODS, even), "letters": even}
    answer = {"outright": [{"goal": 0, "sure": 1.0}], **likeness, "role-play": [SURE]}
    (found,) = read_dialogues([measured(n, 0, 1, seen=n % 2 == 0, **answer) for n in range(6)])
    turns, calibration = belief_figures(found)
    assert {*PREDICTORS} - {*SEEN.values(), UNIFORM} <= {*texts(turns)}
    assert not {*SEEN.values()} & {*texts(turns)}
    assert {"chance", "accuracy, %", "log-loss of the true goal, nats"} <= {*texts(turns)}
    assert "last" not in texts(turns)
    assert any("ECE" in text for text in texts(calibration))


def test_the_figures_of_each_kind_are_there(folder: Path) -> None:
    found = {section.name: section for section in read_report(folder).sections}
    kinds = {name: [f.name.split("-")[0] for f in part.figures] for name, part in found.items()}
    assert kinds == {
        "mcq": ["accuracy"],
        "people": ["ablation", "people"],
        "talk": ["turns", "calibration"],
    }
    assert "94.4 %" in found["mcq"].figures[0].caption
    assert "n = 6 dialogues" in found["talk"].figures[0].caption


def test_a_change_of_the_goal_has_a_table(tmp_path: Path) -> None:
    cells = [dialogue(n) for n in range(3)]
    for spec, _ in cells:
        spec["case"]["truths"] = [1 - spec["case"]["truth"], spec["case"]["truth"]]
    (section,) = read_report(fill(tmp_path / "mind.db", cells)).sections
    assert any(table.name.startswith("following-") for table in section.tables)


def test_what_is_missing_failed_or_mixed_is_said(tmp_path: Path) -> None:
    cells = [mcq(n) for n in range(4)]
    with Results.open(tmp_path / "r.db") as results:
        planned = results.plan([spec for spec, _ in cells])
        results.ask_for(planned)
        one, two, three, _ = planned
        results.keep(one.key, cells[0][1], IDENTITY)
        results.fail(two.key, "first")
        results.keep(two.key, cells[1][1], {**IDENTITY, "code": "other"})
        results.fail(three.key, "The server <b>is</b> away.")
    report = read_report(tmp_path / "r.db", draw=False)
    (questions,) = report.summary
    assert {row["cells so far"] for row in questions.rows} == {"2 of 4"}
    (section,) = report.sections
    assert [*section.tables[0].rows[0].values()] == ["mcq", 4, 2, 1, 1, 1]
    text = " ".join(section.warnings)
    assert "1 of 4 cells are not measured yet" in text
    assert "1 of 4 cells failed" in text
    assert "The server <b>is</b> away." in text
    assert "mix cells measured with different code." in text
    values = [fact for fact in section.facts if fact.startswith("measured with")]
    told = "measured with (1 cell): code abc, prompts def, version 1, model small 123"
    assert values[0] == told
    assert "code other" in values[1]


def test_a_store_without_results_or_studies_is_none_to_report(tmp_path: Path) -> None:
    with Store.open(tmp_path / "episodes.db") as store:
        begin(store, domain="grocery", method="good", model="m.gguf", task="t")
    with pytest.raises(InvalidInputError, match="has no results"):
        read_report(tmp_path / "episodes.db")


def test_reading_changes_nothing_while_another_writes(tmp_path: Path) -> None:
    fill(tmp_path / "r.db", [mcq(1)])
    with Results.open(tmp_path / "r.db") as other, other.writing():
        (section,) = read_report(tmp_path / "r.db", draw=False).sections
    assert section.tables[0].rows[0]["done"] == 1
    old = tmp_path / "r.db"
    before = old.read_bytes()
    read_report(old, draw=False)
    assert old.read_bytes() == before


def test_other_files_of_a_folder_are_left_out_and_named(folder: Path) -> None:
    (folder / "broken.db").write_bytes(b"no database" * 100)
    with sqlite3.connect(folder / "foreign.db") as other:
        other.execute("CREATE TABLE t (x)")
    other.close()
    Store.open(folder / "empty.db").close()
    found = read_report(folder, draw=False)
    assert [section.name for section in found.sections] == ["mcq", "people", "talk"]
    assert ["broken.db" in found.skipped[0], "foreign.db" in found.skipped[1]] == [True] * 2
    with pytest.raises(GoalscopeError, match=r"foreign\.db belongs to another program"):
        read_report(folder / "foreign.db")


def test_where_there_are_no_results_it_says_how_to_make_some(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="has no results"):
        read_report(tmp_path)
    with pytest.raises(InvalidInputError, match="There is no"):
        read_report(tmp_path / "nowhere")
    fill(tmp_path / "r.db", [mcq(1)])
    fill(tmp_path / "summary.db", [mcq(1)])
    found = read_report(tmp_path, draw=False)
    assert [each.name for each in found.sections] == ["r", "summary-2"]
    with pytest.raises(NotADirectoryError):
        write_report(found, tmp_path / "r.db" / "sub.md")
    with pytest.raises(InvalidInputError, match=r"must end in \.md"):
        write_report(found, tmp_path / "sub")


def test_a_report_has_a_summary_and_a_page_with_all_tables_of_each_part(
    folder: Path, tmp_path: Path
) -> None:
    found = read_report(folder)
    write_report(found, tmp_path / "docs" / "results.md")
    text = (tmp_path / "docs" / "results.md").read_text(encoding="utf-8")
    assert text.startswith("# Results\n")
    pages = {file.stem: file for file in (tmp_path / "docs" / "results").glob("*.md")}
    assert {*pages} == {section.name for section in found.sections}
    for section in found.sections:
        assert f"](results/{section.name}.md)" in text
        page = pages[section.name].read_text(encoding="utf-8")
        assert "[All results](../results.md)" in page
        assert page.count("Made by: make it") == 1
        assert page.count("\n## ") == len(section.tables)
        assert page.count("![") == len(section.figures)


def test_a_part_that_stands_aside_has_a_page_alone(tmp_path: Path) -> None:
    fill(tmp_path / "r.db", [mcq(1)], aside=True)
    found = read_report(tmp_path / "r.db", draw=False)
    assert not found.summary
    write_report(found, tmp_path / "out.md")
    assert "](out/r.md)" in (tmp_path / "out.md").read_text(encoding="utf-8")


def test_a_part_says_who_spoke(tmp_path: Path) -> None:
    fill(tmp_path / "r.db", [mcq(1)], provenance="Nobody *was* asked.")
    write_report(read_report(tmp_path / "r.db", draw=False), tmp_path / "out.md")
    for page in tmp_path / "out.md", tmp_path / "out" / "r.md":
        assert "Nobody \\*was\\* asked." in page.read_text(encoding="utf-8")


def test_the_summary_has_the_papers_loss_beside_goalscopes_of_each_model(tmp_path: Path) -> None:
    plain, adapted = ({"adapter": name} for name in ("none", "mine"))
    cells = [dialogue(n) for n in range(12)]
    both = [
        ({**spec, "model": model, "outright": bool(number % 2)}, it)
        for model in (plain, adapted)
        for number, (spec, it) in enumerate(cells)
    ]
    fill(tmp_path / "r.db", both)
    found = read_report(tmp_path / "r.db", draw=False)
    beliefs, *_ = found.summary
    assert [row["of"] for row in beliefs.rows] == [
        "own, SmolLM2-135M-Instruct without adapter",
        "own, SmolLM2-135M-Instruct, mine",
    ]
    assert {row["n"] for row in beliefs.rows} == {12}
    (ways,) = (each for each in found.summary if each.name == "summary-baselines")
    assert [row["of"] for row in ways.rows] == ["own, 3 goals each"]
    assert "cells so far" not in beliefs.columns
    tables = [each for each in found.sections[0].tables if each.name.startswith("dialogues-")]
    for row, table in zip(beliefs.rows, tables, strict=True):
        page = {each["predictor"]: each for each in table.rows}
        assert row["log-loss"] == page["goalscope"]["log-loss"]
        assert row["Eq. 1: log-loss"] == page["goalscope, Eq. 1"]["log-loss"]
        assert row["log-loss"] != row["Eq. 1: log-loss"]


def test_the_summary_has_what_fitted_methods_reach(tmp_path: Path) -> None:
    right = dict.fromkeys(FITTED_METHODS, [[math.log(1 / 2), math.log(1 / 3), math.log(1 / 6)]] * 2)
    cells = [dialogue(2 * n) for n in range(3)]
    fit = {"sources": ["own:train"], "folder": None, "sha256": "abc"}
    found = [({**spec, "fit": fit}, {**result, "fitted": right}) for spec, result in cells]
    fill(tmp_path / "r.db", found)
    report = read_report(tmp_path / "r.db", draw=False)
    (table,) = (each for each in report.summary if each.name == "summary-baselines")
    assert {table.rows[0][name] for name in FITTED_METHODS} == {f"100.0 %, {math.log(2):.3f}"}
    text = " ".join(report.sections[0].tables[1].notes)
    assert "kNN, TF-IDF fitted, vectors fitted: fitted on own:train, which" in text


def test_the_command_writes_or_prints(folder: Path, tmp_path: Path) -> None:
    app = Typer()
    app.command()(report)
    printed = CliRunner().invoke(app, [str(folder), "--json"])
    assert [each["name"] for each in json.loads(printed.stdout)] == ["mcq", "people", "talk"]
    assert not (folder / "report.md").exists()
    written = CliRunner().invoke(app, [str(folder / "mcq.db")])
    assert written.exit_code == 0
    assert (folder / "mcq-report" / "figures" / "mcq-accuracy.svg").is_file()
    assert "2 tables, 1 figure." in written.stdout
    place = str(tmp_path / "o.md")
    both = CliRunner().invoke(app, [str(folder / "mcq.db"), "--json", "--out", place])
    assert json.loads(both.stdout)
    assert (tmp_path / "o.md").is_file()


def test_a_picture_has_a_title_and_text_as_text_whatever_the_users_settings() -> None:
    mpl = pytest.importorskip("matplotlib")

    def made() -> str:
        caption = "A & B. More."
        return draw_figure("p", caption, (2, 1), lambda figure: figure.text(0, 0, "x")).svg

    svg = made()
    root = minidom.parseString(svg.encode()).documentElement
    assert root.getElementsByTagName("title")[0].firstChild.data == "A & B"
    assert ">x</text>" in svg
    assert not re.search(r"20\d\d-\d\d", svg)
    with mpl.rc_context({"font.size": 30, "svg.fonttype": "path"}):
        assert made() == svg
        assert mpl.rcParams["font.size"] == 30
