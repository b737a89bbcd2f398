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

from goalscope.experiment.summary import Estimate, Labels, Table, few_notes, slug
from goalscope.experiment.summary_mcq import mcq_tables
from goalscope.stats import Interval, proportion

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


def test_an_interval_alone_is_a_span() -> None:
    table = Table("t", "Title", ("a", "span"), (("x", Interval(0.0001, 0.25)), ("y", None)))
    assert [row[1] for row in table.text_rows()] == ["<0.001 to 0.250", "-"]
    assert table.to_dict()["rows"] == [["x", {"low": 0.0001, "high": 0.25}], ["y", None]]
    rows = list(csv.reader(io.StringIO(table.to_csv())))
    assert rows == [["a", "span, low", "span, high"], ["x", "0.0001", "0.25"], ["y", "", ""]]


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


def test_intervals_of_few_have_a_note() -> None:
    sure, bare = Estimate(0.5, Interval(0.1, 0.9)), Estimate(0.5, None)
    for columns, rows, said in [
        (("n", "score"), ((5, sure), (9, bare), (200, sure)), "Of 5 groups"),
        (("n", "score"), ((5, bare), (10, sure)), ""),
        (("profiles", "n", "score"), ((9, 99, sure),), "Of 9 profiles"),
        (("who", "score"), (("a", sure),), ""),
    ]:
        notes = few_notes(Table("t", "t", columns, rows))
        assert [note[: len(said)] for note in notes] == [said] * bool(said)


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
