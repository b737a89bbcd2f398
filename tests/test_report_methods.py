"""Figures and rows that compare methods."""

from pathlib import Path

import pytest

from goalscope.experiment.summary import Estimate, without_shared
from goalscope.report import read_report, write_report
from goalscope.report.methods import OVER_PEOPLE, OVER_SEEDS, OVER_TRIALS
from reports import METHODS, ablation, drawn, episode, fill, in_settings, judged, texts

NAMES = ("GOOD", "No Goals", "No Inference")


def test_every_kind_of_error_bar_is_named_in_the_picture_and_drawn_apart(tmp_path: Path) -> None:
    methods, people = drawn(tmp_path, ablation(["anna", "ben", "cleo"], [3.0, 1.0, 2.0], 2))
    for figure in (methods, people):
        said = texts(figure)
        assert OVER_PEOPLE in said
        assert OVER_TRIALS in said
        assert OVER_SEEDS not in said
        for kind in (OVER_PEOPLE, OVER_TRIALS):
            assert kind in figure.caption
        for title in ("evaluator's score, %", "state-based score, %", "unwanted things, number"):
            assert title in said
        assert "3 by each method" in figure.caption
    assert {*NAMES} <= {*texts(people)}
    assert {"anna", "ben", "cleo", "all 3 people"} <= {*texts(people)}
    assert {"GOOD", "Goals", "Inference"} <= {*texts(methods)}


def test_two_kinds_of_error_bars_stand_side_by_side(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mpl = pytest.importorskip("matplotlib.figure")
    painted = []

    def paint(name: str, title: str, size: tuple[float, float], paint) -> str:
        painted.append(mpl.Figure(size, layout="constrained"))
        paint(painted[-1])
        return "<svg/>"

    monkeypatch.setattr("goalscope.report.drawing.draw", paint)
    drawn(tmp_path, ablation(["anna", "ben", "cleo"], [3.0, 1.0]))
    lines = painted[0].axes[0].collections
    places = {
        width: {
            round(float(line[0][0]), 3)
            for each in lines
            if each.get_linewidth()[0] == width
            for line in each.get_segments()
            if line[0][0] == line[1][0]
        }
        for width in (1.2, 4)
    }
    assert [len(each) for each in places.values()] == [3, 3]
    assert places[1.2].isdisjoint(places[4])


def test_the_bars_are_the_means_of_the_tables(tmp_path: Path) -> None:
    cells = ablation(["anna", "ben"], [3.0, 1.0])
    fill(tmp_path / "r.db", cells)
    (section,) = read_report(tmp_path / "r.db").sections
    (table,) = [each for each in section.tables if each.name.endswith("-methods")]
    said = texts(section.figures[0])
    for row in table.rows:
        for column in ("score", "judge score"):
            value = row[column]
            assert isinstance(value, Estimate)
            assert f"{100 * value.value:.1f}" in said


def test_one_person_and_one_trial_have_no_error_bars_and_the_caption_says_why(
    tmp_path: Path,
) -> None:
    (methods,) = drawn(tmp_path, ablation(["anna"], []))
    assert "There are no error bars" in methods.caption
    assert not {OVER_PEOPLE, OVER_TRIALS, OVER_SEEDS} & {*texts(methods)}
    assert "over 1 person:" in methods.caption


def test_one_person_with_several_trials_has_the_bars_of_the_paper_alone(tmp_path: Path) -> None:
    (methods,) = drawn(tmp_path, ablation(["anna"], [3.0, 1.0]))
    assert OVER_TRIALS in texts(methods)
    assert OVER_PEOPLE not in texts(methods)


def test_trials_that_are_all_equal_have_no_error_bars(tmp_path: Path) -> None:
    runs = [episode(method, "anna", 0.5) for method in METHODS]
    (methods,) = drawn(tmp_path, [*runs, *(judged(spec, [1.5] * 3) for spec, _ in runs)])
    assert OVER_TRIALS not in texts(methods)
    assert "all repetitions are equal" in methods.caption


def test_cells_that_are_missing_are_said_to_be(tmp_path: Path) -> None:
    cells = ablation(["anna", "ben"], [3.0, 1.0])
    left = [c for c in cells if "no-goals" not in str(c[0]) or "anna" in str(c[0])]
    left = [c for c in left if c[0]["kind"] == "episode" or "no-inference" not in str(c[0])]
    methods, people = drawn(tmp_path, left)
    assert "no data" in texts(methods)
    assert "A point is missing where nothing was measured." in people.caption
    for figure in (methods, people):
        assert "Not all means are of the same people." in figure.caption
        assert "evaluator's score 2 by GOOD, 1 by No Goals, 0 by No Inference" in figure.caption


def test_many_people_go_on_several_figures_and_none_is_lost(tmp_path: Path) -> None:
    people = [f"person {n:02d}" for n in range(65)]
    _, *pages = drawn(tmp_path, ablation(people, []))
    assert [figure.name.rpartition("-")[2] for figure in pages] == ["1", "2", "3"]
    shown = [text for figure in pages for text in texts(figure) if text in people]
    assert shown == people
    assert all("all 65 people" in texts(figure) for figure in pages)


def test_long_names_that_differ_at_their_end_can_be_told_apart(tmp_path: Path) -> None:
    names = [f"a person whose name is as long as a description, {n}" for n in (17, 18)]
    _, people = drawn(tmp_path, ablation(names, []))
    shown = [text for text in texts(people) if text.startswith("a person")]
    assert len({*shown}) == 2
    assert all(len(text) <= 31 for text in shown)


def test_seeds_and_trials_are_told_apart(tmp_path: Path) -> None:
    cells = ablation(["anna", "ben"], [3.0, 1.0])
    again = []
    for spec, result in cells:
        if spec["kind"] == "episode":
            other = {**spec, "settings": {**spec["settings"], "seed": 1}}
            again.append((other, {**result, "score": result["score"] / 2}))
    methods, _ = drawn(tmp_path, [*cells, *again])
    assert f"{OVER_TRIALS}; of other scores over seeds" in texts(methods)


def test_other_settings_have_figures_of_their_own_that_name_them(tmp_path: Path) -> None:
    cells = ablation(["anna", "ben"], [])
    other = []
    for spec, result in cells:
        settings = {**spec["settings"], "k": 1}
        other.append(({**spec, "settings": settings}, result))
    fill(tmp_path / "r.db", [*cells, *other])
    (section,) = read_report(tmp_path / "r.db").sections
    first = [figure for figure in section.figures if figure.name.startswith("methods")]
    assert [any("k 3" in f.caption for f in first), len(first)] == [True, 2]
    assert any("k 1" in f.caption for f in first)
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


def test_each_of_several_evaluators_is_named(tmp_path: Path) -> None:
    (one, first), (two, second) = (episode("good", "anna", n) for n in (0.5, 1.0))
    two["settings"] = {**two["settings"], "human": "simulated"}
    judges = [judged(one, [3.0]), judged(two, [1.5])]
    judges[1][0]["model"] = {"model": "other.gguf"}
    every, *_ = drawn(tmp_path, [(one, first), (two, second), *judges])
    said = " ".join(texts(every))
    assert "evaluator's score by other" in said
    assert "evaluator's score by SmolLM2" in said


def test_several_settings_stand_in_one_figure(tmp_path: Path) -> None:
    every, *_ = drawn(tmp_path, in_settings())
    assert every.name == "ablation"
    said = texts(every)
    assert {*NAMES, OVER_PEOPLE, OVER_TRIALS, "unwanted things, number"} <= {*said}
    told = " ".join(said)
    for setting in ("prompted plan", "aims"):
        assert setting in told
    assert "none" not in told
    assert "scripted" not in told  # all are, as the caption says
    assert "scripted" in every.caption
    assert "/somewhere" not in told + every.caption
    assert told.count("3 people") == 3
    assert "A point is missing where nothing was measured." in every.caption  # two have no judge


def test_a_setting_with_one_person_says_so(tmp_path: Path) -> None:
    every, *_ = drawn(tmp_path, [run for run in in_settings() if "anna" in str(run[0])])
    told = " ".join(texts(every))
    assert told.count("1 person") == 3
    assert "1 people" not in told


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
    write_report(found, tmp_path / "out.md")
    text = (tmp_path / "out.md").read_text(encoding="utf-8")
    assert text.count("![") == text.count("](out/figures/r-ablation.svg)") == 1
    assert "make it" in text
