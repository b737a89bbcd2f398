"""Tables from what was measured, each computed by hand from a few cells; and how they read."""

import csv
import io
import json
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from goalscope.base.stats import Interval, proportion
from goalscope.experiment.summary import Estimate, Labels, Table, averaged, few_notes, slug
from goalscope.experiment.tables import question_tables

pytest.importorskip("scipy.stats")

MODEL = {"model": "small"}
TABLE = Table(
    "t",
    "What & why",
    [
        dict(zip(("who", "share", "n", "time"), entries, strict=False))
        for entries in (
            ("=cmd|' /C calc'!A0", Estimate(0.72, Interval(0.651, 0.7821), "percent"), 50, 1.5),
            ("a_b 50% \x1b[31m\nred", None, 0),
            ("[x](http://y) <b>", Estimate(-0.00001, None, "percent"), 3, -2.0),
        )
    ],
    ("n_1 is 100 %.",),
)


def column(table: Table, name: str) -> list:
    return [row[name] for row in table.rows]


def row(table: Table, *start: object) -> dict:
    """The row that begins with these entries; of a figure that it lacks, None."""
    (found,) = [r for r in table.rows if tuple(r.values())[: len(start)] == start]
    return dict.fromkeys(table.columns) | found


def made_of(score: float) -> dict[str, object]:
    """What the result of a run has of its checks, for a score that is a fraction."""
    met, needs = Fraction(score).limit_denominator(99).as_integer_ratio()
    end = [True] * met + [False] * (needs - met)
    return {"start": [False] * needs, "met": end, "unwanted": None}


def test_figures_read_as_people_write_them() -> None:
    heads, *rows = TABLE.texts()
    assert heads == ["who", "share", "n", "time"]
    assert rows[0][1:] == ["72.0 % [65.1, 78.2]", "50", "1.500"]
    assert rows[1] == ["a_b 50% �[31m red", "-", "0", "-"]
    assert rows[2][1] == "0.0 %"
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
    table = Table("t", text, [{"who": text, f"{text} n": 1}], (text,))
    for line in csv.reader(io.StringIO(table.to_csv())):
        assert len(line) == 2
        for each in line:
            assert not each.startswith(("=", "+", "-", "@", "\t", "\r", "\uff1d", "\uff0b"))
    written = table.to_markdown()
    assert len([line for line in written.splitlines() if line.startswith("|")]) == 3
    assert "<" not in written


def test_markdown_shows_text_as_it_is() -> None:
    text = TABLE.to_markdown()
    assert "| who | share | n | time |\n| --- | ---: | ---: | ---: |" in text
    assert r"\[x\](http://y) &lt;b&gt;" in text
    assert r"=cmd\|' /C" in text
    assert "72.0 % [65.1, 78.2]" in text


def test_json_has_numbers_as_numbers() -> None:
    found = json.loads(json.dumps(TABLE.to_dict(), allow_nan=False))
    share = {"share": 0.72, "share, low": 0.651, "share, high": 0.7821}
    assert found["rows"][0] == {"who": "=cmd|' /C calc'!A0", **share, "n": 50, "time": 1.5}
    assert found["rows"][1]["share"] is None
    assert found["notes"] == ["n_1 is 100 %."]
    with pytest.raises(ValueError, match="finite"):
        Estimate(math.nan)


def test_intervals_of_few_have_a_note() -> None:
    few, bare, many = averaged([0, 1] * 2), Estimate(0.5), averaged([0, 1] * 5)
    for found, said in [([few, bare, many], 1), ([bare, many], 0), (["a", 3], 0)]:
        notes = few_notes(Table("t", "t", [{"score": each} for each in found]))
        told = "With fewer than 10 people or groups, an interval says little about others."
        assert notes == (told,) * said


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
    mcq("4", "B", [-4.0, -8, -8, -8, -8, -8], blank={"log_likelihood": [0, 0, 1, 0, 0, 0]}),
]


def test_mcq_accuracy_is_the_papers() -> None:
    (table,) = question_tables(MCQ)
    found = row(table, "small", "question", "without")
    assert (found["n"], found["accuracy"]) == (4, Estimate(2.5 / 4, proportion(2.5, 4), "percent"))
    assert row(table, "small", "question", "with")["accuracy"].value == 1.5 / 4


def test_mcq_log_loss_sums_over_rephrasings() -> None:
    (table,) = question_tables(MCQ)
    high, low = math.exp(-4), math.exp(-8)
    right = [high + low, high + 3 * low, high + 3 * low, 2 * low]
    total = [high + 5 * low, high + 5 * low, 2 * high + 4 * low, high + 5 * low]
    losses = [math.log(t / r) for r, t in zip(right, total, strict=True)]
    found = row(table, "small", "question", "without")
    assert found["log-loss"].value == pytest.approx(np.mean(losses))


def test_mcq_word_overlap_counts_each_row_once() -> None:
    more = [({**spec, "model": {"model": "large"}}, result) for spec, result in MCQ]
    (table,) = question_tables([*MCQ, *more])
    found = row(table, "word overlap")
    # right; wrong; no word: 4 of 6 goals say tea; no word: 2 of 6 say soup
    assert found["n"] == 4
    assert found["accuracy"].value == pytest.approx((1 + 0 + 4 / 6 + 2 / 6) / 4)
    assert row(table, "large", "question", "without")["n"] == 4


def test_mcq_conditions_have_rows_of_their_own_and_gaps_show() -> None:
    (table,) = question_tables(MCQ)
    found = row(table, "small", "no question", "without")
    assert (found["n"], found["accuracy"].value) == (1, 1.0)
    assert row(table, "small", "no question", "with")["n"] == 0
    other = [r for r in table.texts() if r[1] == "question and choices"]
    assert [r[3:] for r in other] == [["0", "-", "-"]] * 2
    assert question_tables([]) == []
