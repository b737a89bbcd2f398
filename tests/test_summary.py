"""Tables from what was measured, each computed by hand from a few cells; and how they read."""

import csv
import io
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from goalscope.experiment.results import cell_key
from goalscope.experiment.summary import NO_INTERVAL, Estimate, Labels, Table, slug
from goalscope.experiment.summary_dialogues import PREDICTORS, read_dialogues
from goalscope.experiment.summary_episodes import read_episodes
from goalscope.experiment.summary_mcq import mcq_tables
from goalscope.experiment.summary_models import model_tables
from goalscope.stats import Interval, bootstrap_mean, proportion

pytest.importorskip("scipy.stats")

MODEL = {"model": "small"}
TABLE = Table(
    "t",
    "What & why",
    ("who", "share", "n", "time"),
    (
        ("=cmd|' /C calc'!A0", Estimate(0.72, Interval(0.651, 0.7821), "percent"), 50, 1.5),
        ("a_b 50% \x1b[31m\nred", None, 0, None),
        ("[x](http://y) <b>", Estimate(-0.00001, None, "percent"), 3, -2.0),
    ),
    ("n_1 is 100 %.",),
    "goalscope report x",
)


def column(table: Table, name: str) -> list:
    return [row[table.columns.index(name)] for row in table.rows]


def row(table: Table, *start: object) -> dict:
    (found,) = [r for r in table.rows if r[: len(start)] == start]
    return dict(zip(table.columns, found, strict=True))


def test_figures_read_as_people_write_them() -> None:
    assert TABLE.text_rows()[0][1:] == ("72.0 % [65.1, 78.2]", "50", "1.500")
    assert TABLE.text_rows()[1] == ("a_b 50% �[31m red", "-", "0", "-")
    assert TABLE.text_rows()[2][1] == "0.0 %"
    assert str(Estimate(0.1234, Interval(-0.1, 0.2))) == "0.123 [-0.100, 0.200]"
    assert (str(Estimate(0.0002)), str(Estimate(-3e-17))) == ("<0.001", "0.000")


def test_csv_has_numbers_and_no_formulas() -> None:
    rows = list(csv.reader(io.StringIO(TABLE.to_csv())))
    assert rows[0] == ["who", "share", "share, low", "share, high", "n", "time"]
    assert rows[1] == ["'=cmd|' /C calc'!A0", "0.72", "0.651", "0.7821", "50", "1.5"]
    assert rows[2] == ["a_b 50% �[31m red", "", "", "", "0", ""]
    assert rows[3][-1] == "-2.0"


@given(st.text())
def test_no_text_becomes_a_formula_or_breaks_a_row(text: str) -> None:
    table = Table("t", text, ("who", text), ((text, 1),), (text,), text)
    heads, line = csv.reader(io.StringIO(table.to_csv()))
    assert not line[0].startswith(("=", "+", "-", "@", "\t", "\r", "\uff1d", "\uff0b"))
    assert (len(heads), line[1]) == (2, "1")
    cells = [line for line in table.to_markdown().splitlines() if line.startswith("|")]
    assert len(cells) == 3
    latex = table.to_latex()
    for each in ("\\write", "\\input"):
        assert each not in latex
    assert all(line.startswith("%") for line in latex.splitlines() if "\\begin{table}" not in latex)


def test_markdown_shows_text_as_it_is() -> None:
    text = TABLE.to_markdown()
    assert "| who | share | n | time |\n| --- | ---: | ---: | ---: |" in text
    assert r"\[x\](http://y) &lt;b&gt;" in text
    assert r"=cmd\|' /C" in text
    assert "72.0 % [65.1, 78.2]" in text
    assert "Made by ` goalscope report x `" in text


def test_latex_is_escaped() -> None:
    text = TABLE.to_latex()
    assert text.startswith("% goalscope report x\n\\begin{table}")
    assert r"\caption{What \& why}" in text
    assert r"\begin{tabular}{lrrr}" in text
    assert r"a\_b 50\%" in text
    assert "{[}x{]}(http://y) \\textless{}b\\textgreater{} & 0.0 \\%" in text
    assert r"\par\footnotesize n\_1 is 100 \%." in text
    assert replace(TABLE, title=r"\input{/etc/passwd}").to_latex().count(r"\input") == 0


def test_json_has_numbers_as_numbers() -> None:
    found = json.loads(json.dumps(TABLE.to_dict(), allow_nan=False))
    share = {"value": 0.72, "low": 0.651, "high": 0.7821, "form": "percent"}
    assert found["rows"][0] == ["=cmd|' /C calc'!A0", share, 50, 1.5]
    assert found["rows"][1][1] is None
    assert found["notes"] == ["n_1 is 100 %."]


def test_numbers_that_are_none_are_refused() -> None:
    with pytest.raises(ValueError, match="finite"):
        Estimate(math.nan)
    with pytest.raises(ValueError, match="finite"):
        Estimate(1.0, Interval(0, math.inf))
    with pytest.raises(ValueError, match="finite"):
        Table("t", "t", ("a",), ((math.inf,),))
    with pytest.raises(ValueError, match="as many entries"):
        Table("t", "t", ("a",), ((1, 2),))


def test_labels_say_what_tells_settings_apart() -> None:
    one, two = {"model": MODEL, "layout": "goal-last"}, {"model": MODEL, "layout": "goal-first"}
    other = {"model": {"model": "large"}, "layout": "goal-last"}
    labels = Labels([one, two, other, dict(one)])
    assert (labels[one], labels[two]) == ("small, layout goal-last", "small, layout goal-first")
    assert labels[other] == "large"
    same = [{"model": {"model": "a/m"}}, {"model": {"model": "b/m"}}]
    assert len({Labels(same)[each] for each in same}) == 2


def test_slugs_are_short_and_distinct() -> None:
    assert slug("../etc/a b") == "etc-a-b"
    assert len(slug("x" * 500)) < 70
    assert slug("x" * 500) != slug("x" * 501)


# --- multiple choice ---

CHOICES = {"A": "tea", "B": "soup", "C": "tea"}
GOALS = [{"choice": choice, "text": f"{choice}{i}"} for choice in "ABC" for i in range(2)]


def mcq(id: str, answer: str, question: list, *, unspecified=-9.0, overlap=None, **more):
    conditions = {"question": {"log_likelihood": question, "unspecified": unspecified}}
    question_row = {"id": id, "prompt": "?", "choices": CHOICES, "answer": answer}
    return (
        {"kind": "mcq", "row": question_row, "model": MODEL, "layout": "goal-last"},
        {
            "tokens": 4,
            "goals": GOALS,
            "conditions": {**conditions, **more},
            "overlap": overlap or [0.0] * 6,
        },
    )


MCQ = [
    mcq("1", "B", [-8.0, -8, -4, -8, -8, -8], unspecified=-2.0, overlap=[0, 0, 1, 0, 0, 0]),
    mcq("2", "A", [-8.0, -8, -8, -8, -4, -8], overlap=[0, 0, 1, 0, 0, 0]),  # C says the same
    mcq("3", "A", [-4.0, -8, -4, -8, -8, -8]),  # a tie of right and wrong
    mcq("4", "B", [-4.0, -8, -8, -8, -8, -8], contrast={"log_likelihood": [0, 0, 1, 0, 0, 0]}),
]


def test_mcq_accuracy_is_the_papers() -> None:
    (table,) = mcq_tables(MCQ, command="make")
    found = row(table, "small", "question", "without")
    assert (found["n"], found["accuracy"]) == (4, Estimate(2.5 / 4, proportion(2.5, 4), "percent"))
    assert row(table, "small", "question", "with")["accuracy"].value == 1.5 / 4
    assert table.command == "make"


def test_mcq_log_loss_sums_over_rephrasings() -> None:
    (table,) = mcq_tables(MCQ)
    high, low = math.exp(-4), math.exp(-8)
    right = [high + low, high + 3 * low, high + 3 * low, 2 * low]
    total = [high + 5 * low, high + 5 * low, 2 * high + 4 * low, high + 5 * low]
    losses = [math.log(t / r) for r, t in zip(right, total, strict=True)]
    found = row(table, "small", "question", "without")
    assert found["log-loss, sum"].value == pytest.approx(np.mean(losses))
    high, low = math.exp(-1), math.exp(-2)
    right = [high + low, high + 3 * low, high + 3 * low, 2 * low]
    total = [high + 5 * low, high + 5 * low, 2 * high + 4 * low, high + 5 * low]
    losses = [math.log(t / r) for r, t in zip(right, total, strict=True)]
    assert found["log-loss, per-token mean"].value == pytest.approx(np.mean(losses))


def test_mcq_word_overlap_counts_each_row_once() -> None:
    more = [({**spec, "model": {"model": "large"}}, result) for spec, result in MCQ]
    (table,) = mcq_tables([*MCQ, *more])
    found = row(table, "word overlap")
    # right; wrong; no word: 4 of 6 goals say tea; no word: 2 of 6 say soup
    assert found["n"] == 4
    assert found["accuracy"].value == pytest.approx((1 + 0 + 4 / 6 + 2 / 6) / 4)
    assert row(table, "large", "question", "without")["n"] == 4


def test_mcq_conditions_have_rows_of_their_own_and_gaps_show() -> None:
    (table,) = mcq_tables(MCQ)
    found = row(table, "small", "contrast", "without")
    assert (found["n"], found["accuracy"].value) == (1, 1.0)
    assert row(table, "small", "contrast", "with")["n"] == 0
    blank = [r for r in table.text_rows() if r[1] == "no question"]
    assert [r[3:] for r in blank] == [("0", "-", "-", "-")] * 2
    assert mcq_tables([]) == ()


# --- dialogues ---


def dialogue(id: int, truth: int, turns: int, *, group: str | None = None, **result):
    case = {
        "id": str(id),
        "group": group or str(id),
        "task": "Help.",
        "turns": [{"query": "?", "utterance": "!"}] * turns,
        "goals": ["a", "b", "c", "d"],
        "truth": truth,
    }
    spec = {"kind": "dialogue", "set": "teach", "split": "valid", "goal_set": "hard", "case": case}
    return {**spec, "model": MODEL, "layout": "goal-last", "end_of_turn": False}, result


SURE = [2.0, 0.0, 0.0, 0.0]
DIALOGUES = [
    dialogue(
        1,
        0,
        2,
        **{"role-play": [SURE, SURE]},
        outright=[{"goal": 0, "sure": 1.0}, {"goal": None, "sure": None}],
        tfidf=[[1.0, 0, 0, 0], [1.0, 0, 0, 0]],
    ),
    dialogue(
        2,
        1,
        1,
        **{"role-play": [SURE]},
        outright=[{"goal": 1, "sure": 0.0}],
        tfidf=[[0, 1.0, 0, 0]],
    ),
]


def dialogues_table(cells: list = DIALOGUES) -> Table:
    (found,) = read_dialogues(cells)
    return found.table(command="make")


def test_role_play_adds_up_turns_and_divides_by_the_temperature() -> None:
    table = dialogues_table()
    first = row(table, "goalscope, T = 1", "1")
    e = math.exp(2)
    losses = [-math.log(e / (e + 3)), -math.log(1 / (e + 3))]
    assert (first["n"], first["top-1"].value, first["MRR"].value) == (2, 0.5, (1 + 1 / 3) / 2)
    assert first["log-loss"].value == pytest.approx(np.mean(losses))
    second = row(table, "goalscope, T = 1", "2")
    assert (second["n"], second["top-1"]) == (1, Estimate(1.0, None, "percent"))
    assert second["log-loss"].value == pytest.approx(-math.log(e**2 / (e**2 + 3)))
    tempered = row(table, "goalscope", "2")
    assert tempered["log-loss"].value == pytest.approx(losses[0])


def test_goals_that_an_adapter_was_fitted_on_are_shown_apart() -> None:
    cells = [
        dialogue(1, 0, 1, seen=True, **{"role-play": [SURE]}),
        dialogue(2, 1, 1, seen=False, **{"role-play": [SURE]}),
        dialogue(3, 1, 1, seen=None, **{"role-play": [SURE]}),
    ]
    table = dialogues_table(cells)
    assert row(table, "goalscope", "1")["n"] == 3
    assert row(table, "goalscope, goal seen", "1")["top-1"].value == 1.0
    assert row(table, "goalscope, goal unseen", "1")["top-1"].value == 0.0


def test_whether_the_goal_is_in_the_set_is_told_by_unspecified() -> None:
    cells = [
        dialogue(1, 0, 2, unspecified=[1.0, 0.0], **{"role-play": [SURE, SURE]}),
        dialogue(2, 1, 1, unspecified=[-1.0], **{"role-play": [SURE]}),
    ]
    (found,) = read_dialogues(cells)
    table = found.open_set_table(command="make")
    assert table.command == "make"
    first, second, last = table.rows
    # log-odds of the first without its goal and without a wrong one: 0.5 - log 3, 0.5 - log(e + 2);
    # of the second, whose evidence is for a wrong goal: -0.5 - log(e + 2), and the same or more
    assert first[:2] == ("1", 2)
    assert [each.value for each in first[2:]] == [0.5, 0.5, 0.0]
    assert second[:2] == ("2", 1)
    assert second[2] is None  # a single dialogue is not told from another
    assert [each.value for each in second[3:]] == [1.0, 0.0]
    assert last[:2] == ("last", 2)
    assert [each.value for each in last[2:]] == [0.5, 0.5, 0.0]


def test_the_last_turn_is_each_dialogues_own() -> None:
    last = row(dialogues_table(), "goalscope", "last")
    e = math.exp(2)
    assert last["n"] == 2
    expected = (-math.log(e / (e + 3)) - math.log(1 / (math.exp(1) + 3))) / 2
    assert last["log-loss"].value == pytest.approx(expected)


def test_uniform_is_what_one_expects() -> None:
    found = row(dialogues_table(), "uniform", "last")
    assert found["top-1"] == Estimate(0.25, None, "percent")
    assert found["MRR"].value == 0.4
    assert found["log-loss"].value == pytest.approx(math.log(4))
    assert found["Brier"].value == pytest.approx(0.75)
    assert found["ECE [if calibrated]"].value == pytest.approx(0)


def test_an_answer_counts_as_it_was_meant() -> None:
    table = dialogues_table()
    first = row(table, "model asked", "1")
    assert first["top-1"].value == 1.0  # what was named is its first choice, however unsure
    assert first["log-loss"].value == pytest.approx((-math.log(0.995) + math.log(4)) / 2, abs=1e-5)
    cells = [dialogue(1, 2, 1, outright=[{"goal": 2, "sure": None}])]
    unsure = row(dialogues_table(cells), "model asked", "1")
    assert (unsure["top-1"].value, unsure["n"]) == (1.0, 1)
    assert unsure["log-loss"].value == pytest.approx(math.log(4), abs=1e-5)
    unread = row(table, "model asked", "2")
    assert unread["log-loss"].value == pytest.approx(math.log(4))
    assert any("1 of 3 answers of the model" in note for note in table.notes)


def test_what_was_not_run_is_not_shown() -> None:
    table = dialogues_table()
    assert "BM25" not in column(table, "predictor")
    assert set(column(table, "turn")) == {"1", "2", "last"}
    assert all(column(table, "n"))


def test_a_file_of_ones_own_has_no_split() -> None:
    (found,) = read_dialogues([({**spec, "split": None}, result) for spec, result in DIALOGUES])
    assert found.table().name == "dialogues-teach-hard-small"
    assert "teach, 4 hard goals each, small" in found.table().title


def test_temperatures_are_fitted_on_other_groups() -> None:
    # What is similar is right in one group and wrong in the other: each gets the other's doubt.
    cells = [
        dialogue(i, 0, 1, group="right" if i < 3 else "wrong", tfidf=[[x, 0.0, 0.0, 0.0]])
        for i, x in enumerate([1.0] * 3 + [-1.0] * 3)
    ]
    table = dialogues_table(cells)
    found = row(table, "TF-IDF", "1")
    losses = [math.log(math.exp(0.01) + 3) - 0.01, 1000 + math.log(3)]
    assert found["top-1"].value == 0.5
    assert found["log-loss"].value == pytest.approx(np.mean(losses))
    assert any(note == "TF-IDF: temperature 0.001 to 1e+02." for note in table.notes)


def test_one_group_is_too_few_to_fit_on() -> None:
    table = dialogues_table(DIALOGUES[:1])
    assert "TF-IDF" not in column(table, "predictor")
    assert any("TF-IDF: one group is too few" in note for note in table.notes)


def test_intervals_resample_groups() -> None:
    cells = [dialogue(i, i % 2, 1, group=str(i // 4), **{"role-play": [SURE]}) for i in range(12)]
    found = row(dialogues_table(cells), "goalscope", "1")
    assert found["top-1"].interval is None  # all groups are half right
    values = [1.0, 0.0] * 6
    cells = [
        dialogue(i, 0 if value else 1, 1, group=str(i // 3), **{"role-play": [SURE]})
        for i, value in enumerate(values)
    ]
    found = row(dialogues_table(cells), "goalscope", "1")
    groups = [str(i // 3) for i in range(12)]
    assert found["top-1"] == Estimate(0.5, bootstrap_mean(values, groups), "percent")
    assert found["top-1"].interval != bootstrap_mean(values)


def test_equal_values_have_no_interval_and_the_notes_say_so() -> None:
    (found,) = read_episodes([*GOOD[:1], episode("good", "soup", 1.0)])
    assert row(found.by_method(), "good")["score"] == Estimate(1.0, None, "percent")
    for table in (found.by_method(), found.differences(), dialogues_table(), *mcq_tables(MCQ)):
        assert any(NO_INTERVAL in note for note in table.notes)


ALONE = ["red big cup", "red big pan", "red old cup", "blue big cup"]
"""The first goal differs from each other one in one word, and they from each other in two."""


def alone(id: int, truth: int, turns: int = 1):
    spec, result = dialogue(id, truth, turns)
    return {**spec, "case": {**spec["case"], "goals": ALONE}}, result


def test_goals_alone_prefer_the_goal_that_is_most_like_the_others() -> None:
    table = dialogues_table([alone(1, 0, 2), alone(2, 0), alone(3, 1)])
    found = row(table, "goals alone", "1")
    assert (found["n"], found["top-1"].value) == (3, pytest.approx(2 / 3))
    assert row(table, "goals alone", "2")["top-1"].value == 1.0
    note = [each for each in table.notes if "goals alone" in each]
    assert "reads no dialogue" in note[0]
    assert "goals alone: temperature" in note[1]


def test_goals_alone_have_jaccard_overlap_over_a_fitted_temperature() -> None:
    # The likeliest is right in one group and never in the other: each gets the other's doubt.
    table = dialogues_table([alone(1, 0), alone(2, 1)])
    likeness = [1 / 2, (1 / 2 + 2 * 1 / 5) / 3]  # of the first goal; of each other one
    gap = likeness[0] - likeness[1]
    losses = [
        math.log(1 + 3 * math.exp(-gap / 100)),
        gap / 0.001 + math.log(1 + 3 * math.exp(-gap / 0.001)),
    ]
    found = row(table, "goals alone", "1")
    assert found["log-loss"].value == pytest.approx(np.mean(losses))


def test_sets_goal_sets_and_models_have_tables_of_their_own() -> None:
    spec, result = DIALOGUES[0]
    others = [({**spec, "goal_set": "random"}, result), ({**spec, "model": {}}, result)]
    found = read_dialogues([*DIALOGUES, *others])
    assert [(d.goal_set, d.model, d.n) for d in found] == [
        ("hard", "small", 2),
        ("hard", "SmolLM2-135M-Instruct", 1),
        ("random", "small", 1),
    ]
    assert len({d.table().name for d in found}) == 3
    assert read_dialogues([]) == ()


def test_models_that_met_the_same_dialogues_are_compared() -> None:
    base = [
        dialogue(n, n % 2, 2, group=f"g{n // 2}", unspecified=[0.0, 0.0],
                 **{"role-play": [SURE, SURE]})
        for n in range(4)
    ]  # fmt: skip
    better = [
        (
            {**spec, "model": {}},
            {
                "role-play": [[4.0 * (i == n % 2) for i in range(4)]] * turns,
                "unspecified": [0.0] * turns,
            },
        )
        for n, (spec, _) in enumerate(base)
        for turns in [2 if n else 1]
    ]
    (table,) = model_tables(read_dialogues([*base, *better[:3]]), command="make")
    assert (table.name, table.command) == ("models-teach-valid-hard", "make")
    assert table.title == "Models compared: teach, valid, 4 hard goals each"
    found = {entries[:2]: dict(zip(table.columns, entries, strict=True)) for entries in table.rows}
    small, large = "small", "SmolLM2-135M-Instruct"
    assert list(found) == [
        (small, "1"), (large, "1"), (small, "2"), (large, "2"), (small, "last"), (large, "last")
    ]  # fmt: skip
    first, other = found[small, "1"], found[large, "1"]
    assert (first["n"], first["top-1"].value, first["top-1, difference"]) == (4, 0.5, None)
    assert (other["n"], other["top-1"].value) == (3, 1.0)
    assert other["top-1, difference"].value == pytest.approx(1 / 3)
    right, wrong = math.log(1 + 3 * math.exp(-1)), math.log(3 + math.exp(1))
    assert first["log-loss"].value == pytest.approx((right + wrong) / 2)
    now = math.log(1 + 3 * math.exp(-2))
    assert other["log-loss, difference"].value == pytest.approx(now - (2 * right + wrong) / 3)
    assert other["log-loss, difference"].interval is not None  # the groups differ
    assert found[large, "2"]["n"] == 2
    area = {each.model: each.area(1) for each in read_dialogues([*base, *better])}
    assert first["open-set AUROC"] == area[small]
    assert list(model_tables(read_dialogues(base))) == []


def test_figures_get_the_tables_numbers() -> None:
    (found,) = read_dialogues(DIALOGUES)
    table = found.table()
    by_turn = found.accuracy_by_turn()
    assert list(by_turn) == list(PREDICTORS)
    assert by_turn["BM25"] == []
    name = "goalscope"
    assert [(t, n) for t, n, _ in by_turn[name]] == [(1, 2), (2, 1)]
    assert by_turn[name][0][2] == row(table, name, "1")["top-1"]
    made = found.calibrations()
    assert "BM25" not in made
    assert made[name].ece == row(table, name, "last")["ECE [if calibrated]"].value
    assert made[name].n == 2


# --- episodes ---


X = {"model": "/m/x.gguf"}


def episode(method: str, profile: str, score: float, *, seed: int = 0, **result):
    settings = {"domain": "grocery", "human": "scripted", "method": method, "seed": seed}
    more = {"rounds": 4, "terminated": True, "replans": 1, "empty": False, "actions": ["add"]}
    return (
        {"kind": "episode", "settings": settings, "profile": profile, "model": X},
        {"score": score, "outcome": f"{method} {profile} {seed}", **more, **result},
    )


def judge(cell, trials: list, *, model: str = "judge", **more):
    spec, result = cell
    return (
        {
            "kind": "judge",
            "of": {**spec, "key": cell_key(spec)},
            "outcome": result["outcome"],
            "actions": [],
            "empty": result["empty"],
            "model": {"model": model},
            "trials": 4,
            "seed": 0,
            **more,
        },
        {"trials": [{"score": each, "explanation": "", "answer": ""} for each in trials]},
    )


GOOD = [episode("good", "cake", 1.0), episode("good", "soup", 0.5, terminated=False)]
NONE = [episode("no-goals", "cake", 0.5), episode("no-goals", "soup", 0.0, empty=True)]


def test_methods_by_hand() -> None:
    (found,) = read_episodes([*NONE, *GOOD], attempts=[1, 3, 1, 2])
    table = found.by_method()
    assert column(table, "method") == ["good", "no-goals"]
    good = row(table, "good")
    interval = bootstrap_mean([1.0, 0.5])
    assert good["score"] == Estimate(0.75, interval, "percent")
    assert (good["profiles"], good["runs"], good["rounds"], good["replans"]) == (2, 2, 4, 1)
    assert good["terminated"].value == 0.5
    assert good["SD"] is None  # one seed
    assert column(table, "retries") == [1, 2]
    assert found.model == "x"
    assert "judge score" not in table.columns


def test_profiles_weigh_the_same_whatever_their_seeds() -> None:
    more = [episode("good", "cake", 0.5, seed=1), episode("good", "cake", 0.0, seed=2)]
    (found,) = read_episodes([*GOOD, *more])
    good = row(found.by_method(), "good")
    assert good["runs"] == 4
    assert good["score"].value == 0.5  # profiles: (1 + .5 + 0) / 3 and .5
    pooled = math.sqrt(0.25 * (1 / 3 + 1)) / 2
    assert good["SD"].value == pytest.approx(pooled)


def test_unscored_trials_are_counted_and_in_no_mean() -> None:
    readings = [judge(GOOD[0], [3.0, 2.25, None, None]), judge(GOOD[1], [1.5, 1.5])]
    (found,) = read_episodes([*GOOD, *readings])
    good = row(found.by_method(), "good")
    assert good["judge score"].value == pytest.approx((0.875 + 0.5) / 2)
    assert (good["trials scored"], good["trials unscored"], good["runs judged"]) == (4, 2, 2)
    pooled = math.sqrt((2 * 0.125**2 + 0) / 2 * (1 / 2 + 1 / 2)) / 2
    assert good["judge SD"].value == pytest.approx(pooled)
    nothing = [judge(GOOD[0], [None, None])]
    (found,) = read_episodes([*GOOD, *nothing])
    good = row(found.by_method(), "good")
    assert (good["judge score"], good["trials unscored"], good["runs judged"]) == (None, 2, 0)


def test_a_run_that_left_nothing_scores_nothing_in_all_trials() -> None:
    for trials in ([3.0, None, 2.0, 1.0], []):
        (found,) = read_episodes([*NONE, judge(NONE[1], trials)])
        none = row(found.by_method(), "no-goals")
        assert none["judge score"].value == 0
        assert (none["trials scored"], none["trials unscored"]) == (4, 0)


def test_differences_pair_profiles() -> None:
    alone = episode("good", "pie", 0.0)
    readings = [judge(GOOD[0], [3.0]), judge(NONE[0], [1.5]), judge(GOOD[1], [3.0])]
    (found,) = read_episodes([*GOOD, *NONE, alone, *readings])
    table = found.differences()
    score = row(table, "score", "good minus no-goals")
    assert score["profiles"] == 2
    assert score["difference"] == Estimate(0.5, None, "percent")  # equal in both
    assert score["p"] == 0.5  # two pairs cannot show more
    judged = row(table, "judge score")
    assert (judged["profiles"], judged["difference"]) == (1, Estimate(0.5, None, "percent"))
    assert judged["p"] == 1


def test_differences_need_common_seeds() -> None:
    (found,) = read_episodes([GOOD[0], episode("no-goals", "cake", 0.0, seed=1)])
    assert found.differences().text_rows() == (("score", "good minus no-goals", "0", "-", "-"),)
    (found,) = read_episodes(NONE)
    assert found.differences().rows == ()


def test_profiles_show_what_was_not_run() -> None:
    (found,) = read_episodes([*GOOD, NONE[0]])
    table = found.by_profile()
    assert [r[:4] for r in table.text_rows()] == [
        ("cake", "good", "1", "100.0 %"),
        ("cake", "no-goals", "1", "50.0 %"),
        ("soup", "good", "1", "50.0 %"),
        ("soup", "no-goals", "0", "-"),
    ]
    assert table.text_rows()[-1][4:] == ("-", "-", "-")


def test_a_reading_belongs_to_the_run_that_it_names() -> None:
    spec, result = GOOD[0]
    other = ({**spec, "model": {"model": "y"}}, result)
    stray = judge(episode("good", "elsewhere", 1.0), [0.0])
    one, two = read_episodes([GOOD[0], other, judge(other, [3.0]), stray])
    assert (one.model, one.judges, two.model, two.judges) == ("x", (), "y", ("judge",))
    assert row(two.by_method(), "good")["judge score"].value == 1
    assert "1 readings by the judge belong to no run" in two.by_method().notes[-1]


def compared(one, other, *orders):
    """Scores: (first, second) with `one` first, then with `other` first."""
    run = [{**spec, "key": cell_key(spec)} for spec, _ in (one, other)]
    trials = [
        [[{"score": s, "explanation": "", "answer": ""} for s in pair] for pair in order]
        for order in orders
    ]
    spec = {"kind": "compare", "of": run, "model": {"model": "judge"}, "comparisons": 2, "seed": 0}
    return spec, {"orders": trials}


def test_the_order_effect_counts_only_what_was_read_in_both_orders() -> None:
    steady = compared(GOOD[0], NONE[0], ((3, 1), (1, 3)), ((3, None), (1, 3)))
    swayed = compared(GOOD[1], NONE[1], ((3, 1), (3, 1)))
    (found,) = read_episodes([*GOOD, *NONE, steady, swayed])
    table = found.by_order()
    (only,) = table.rows
    assert only[:5] == ("judge", "good, no-goals", 2, 3, 2)
    assert only[5].value == 1.0  # 0 of cake and 2 of soup
    assert found.tables()[-1] == table
    assert table.name.endswith("-order")


def test_each_pair_of_methods_has_an_order_effect_and_all_together() -> None:
    third = episode("no-inference", "cake", 0.0)
    pairs = [
        compared(GOOD[0], NONE[0], ((2, 1), (2, 1))),
        compared(GOOD[0], third, ((None, 1), (2, 1))),
    ]
    (found,) = read_episodes([*GOOD, *NONE, third, *pairs])
    assert [r[1:] for r in found.by_order().text_rows()] == [
        ("all", "1", "2", "1", "1.000"),
        ("good, no-goals", "1", "1", "1", "1.000"),
        ("good, no-inference", "1", "1", "0", "-"),
    ]


def test_a_comparison_of_runs_that_are_not_here_is_counted_as_lost() -> None:
    (found,) = read_episodes([GOOD[0], compared(GOOD[0], NONE[0], ((3, 1), (1, 3)))])
    assert len(found.tables()) == 3
    assert "1 readings by the judge belong to no run" in found.by_method().notes[-1]


def test_each_judge_has_its_own_columns() -> None:
    readings = [judge(GOOD[0], [3.0]), judge(GOOD[0], [0.0], model="other")]
    (found,) = read_episodes([GOOD[0], *readings])
    good = row(found.by_method(), "good")
    assert good["judge score by judge"].value == 1
    assert good["judge score by other"].value == 0
    assert row(found.by_profile(), "cake")["judge score by other"].value == 0
    assert len(found.differences().rows) == 0


def test_notes_name_the_judge_and_how_it_was_asked() -> None:
    (found,) = read_episodes([*GOOD, *NONE, judge(GOOD[0], [3.0]), compared(GOOD[0], NONE[0])])
    asked = (
        "The judge judge was asked 4 times about each run, at temperature 0.7 (the paper has 0)."
    )
    assert [table.notes.count(asked) for table in found.tables()] == [1, 1, 1, 0]
    asked = "The judge judge was asked 2 times in each order of two runs, at temperature 0.7"
    assert found.by_order().notes[-1].startswith(asked)
    assert "also acted" not in " ".join(note for t in found.tables() for note in t.notes)


def test_notes_say_that_the_judge_also_acted() -> None:
    spec, result = judge(GOOD[0], [3.0])
    for model in (X, {"generator": X["model"], "scorer": "else"}):
        (found,) = read_episodes([*GOOD, ({**spec, "model": model}, result)])
        assert found.by_method().notes[-1].endswith("It is the model that also acted.")
    assert not any("The judge" in note and "asked" in note for note in read_episodes(GOOD)[0].notes)


def test_models_that_write_and_score_are_both_named() -> None:
    spec, result = GOOD[0]
    (found,) = read_episodes([({**spec, "model": {"generator": "openai/gpt"}}, result)])
    assert found.model == "gpt + SmolLM2-135M-Instruct"
    names = [table.name for table in found.tables(command="make")]
    assert names[0] == "episodes-grocery-scripted-gpt-SmolLM2-135M-Instruct-methods"
    assert len(set(names)) == 3


def test_attempts_are_given_for_each_cell() -> None:
    with pytest.raises(ValueError, match="2 cells need as many attempts"):
        read_episodes(GOOD, attempts=[1])
