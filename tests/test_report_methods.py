"""Figures and tables that compare methods."""

from pathlib import Path

import pytest

from goalscope.base.stats import Interval
from goalscope.experiment.summary import Estimate, without_shared
from goalscope.report import read_report, write_report
from goalscope.report.figures import Figure, errors
from reports import METHODS, ablation, drawn, episode, fill, in_settings, texts

NAMES = {"GOOD", "No Goals", "No Inference"}


def test_each_measure_has_a_panel_and_each_person_a_row(tmp_path: Path) -> None:
    every, people = drawn(tmp_path, ablation(["anna", "ben", "cleo"], [3.0, 1.0, 2.0], 2))
    for figure in (every, people):
        panels = {"evaluator's score, %", "score, %", "unwanted things, number"}
        assert panels | NAMES <= {*texts(figure)}
    assert (every.name, "n = 3" in " ".join(texts(every))) == ("ablation", True)
    assert {"anna", "ben", "cleo"} <= {*texts(people)}


def test_bars_end_at_the_ends_of_the_intervals() -> None:
    found = errors([Estimate(0.5, Interval(0.4, 0.7)), Estimate(0.5)], 100)
    assert found.tolist() == [pytest.approx([10, 0]), pytest.approx([20, 0])]


def test_the_points_are_the_means_of_the_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mpl = pytest.importorskip("matplotlib.figure")
    painted = []

    def draw(name: str, caption: str, size: tuple[float, float], paint) -> Figure:
        painted.append(mpl.Figure(size))
        paint(painted[-1])
        return Figure(name, caption, "<svg/>")

    monkeypatch.setattr("goalscope.report.figures.draw_figure", draw)
    fill(tmp_path / "r.db", ablation(["anna", "ben", "cleo"], [3.0, 1.0]))
    (section,) = read_report(tmp_path / "r.db").sections
    (table,) = [each for each in section.tables if each.name.endswith("-methods")]
    judge, score = painted[0].axes
    for axis, column in ((judge, "judge score"), (score, "score")):
        for row, bar in zip(table.rows, axis.containers, strict=True):
            value = row[column]
            assert isinstance(value, Estimate)
            assert value.interval
            point, _, (line,) = bar
            assert point.get_xdata()[0] == pytest.approx(100 * value.value)
            (low, _), (high, _) = line.get_segments()[0]
            expected = (100 * value.interval.low, 100 * value.interval.high)
            assert (low, high) == pytest.approx(expected)


def test_settings_of_their_own_have_tables_of_their_own_that_name_them(tmp_path: Path) -> None:
    cells = ablation(["anna", "ben"], [])
    other = []
    for spec, result in cells:
        settings = {**spec["settings"], "k": 1}
        other.append(({**spec, "settings": settings}, result))
    fill(tmp_path / "r.db", [*cells, *other])
    (section,) = read_report(tmp_path / "r.db").sections
    assert [figure.name.partition("-")[0] for figure in section.figures] == [
        "ablation", "people", "people",
    ]  # fmt: skip
    assert {"k 3", "k 1"} <= {
        part for text in texts(section.figures[0]) for part in text.split(", ")
    }
    assert "k: 3, 1" in section.facts


def test_settings_that_differ_never_share_a_label(tmp_path: Path) -> None:
    runs: list[tuple[dict, dict]] = []
    for folder, score in (("/one", 0.0), ("/two", 1.0)):
        for own in ({"profiles": f"{folder}/aims.toml"}, {"catalogue": f"{folder}/goods.csv"}):
            spec, result = episode("good", "anna", score)
            runs.append(({**spec, "settings": {**spec["settings"], **own}}, result))
    fill(tmp_path / "r.db", runs)
    (section,) = read_report(tmp_path / "r.db", draw=False).sections
    found = [each for each in section.tables if each.name.endswith("-methods")]
    assert sorted(each.rows[0]["score"].value for each in found) == [0, 0, 1, 1]
    assert [each for each in found if each.rows[0]["runs"] != 1] == []


def test_settings_that_are_not_the_usual_ones_are_told_of_a_model_that_has_no_others(
    tmp_path: Path,
) -> None:
    spec, result = episode("good", "anna", 1.0)
    own = {**spec["settings"], "k": 1, "prompted": ["propose", "remove", "plan", "query"]}
    fill(tmp_path / "r.db", [({**spec, "settings": own}, result)])
    (section,) = read_report(tmp_path / "r.db", draw=False).sections
    assert section.tables[1].title.endswith("Instruct, k 1, prompted all")


def test_titles_without_what_they_share_can_be_told_apart() -> None:
    titles = ["shop, told, A", "shop, told, B + A", "shop, told, A, other plan"]
    assert without_shared(titles) == ["shop", "shop, B", "shop, other plan"]
    assert without_shared(["shop, A"]) == ["shop, A"]
    assert without_shared(["shop, A + B", "shop, A, B"]) == ["shop, A + B", "shop, A, B"]


def test_the_summary_has_the_methods_side_by_side_and_shows_the_figure(tmp_path: Path) -> None:
    fill(tmp_path / "r.db", in_settings())
    found = read_report(tmp_path / "r.db")
    rows = found.summary[0].rows
    assert [row["people"] for row in rows] == [3, 3, 3]
    of = [str(row["of"]) for row in rows]
    assert len({*of}) == 3
    assert not any("scripted" in each for each in of)  # all are
    tables = [each for each in found.sections[0].tables if each.name.endswith("-methods")]
    for row, table in zip(rows, tables, strict=True):
        for each in table.rows:
            assert row[f"{each['method']}, score"] == each["score"]
            assert row[f"{each['method']}, unwanted"] == each["unwanted"] == 1
        assert [name for name in row if " minus " in name] == [
            f"{METHODS[0]} minus {other}" for other in METHODS[1:]
        ]
    write_report(found, tmp_path / "out.md")
    text = (tmp_path / "out.md").read_text(encoding="utf-8")
    assert text.count("![") == text.count("](out/figures/r-ablation.svg)") == 1
    assert "make it" in text
