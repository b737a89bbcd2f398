"""Multiple-choice questions: what a file may hold, and the figures of each condition by hand."""

from __future__ import annotations

import json
import math
import os
from dataclasses import asdict
from pathlib import Path

import pytest

from fakes import WordModel
from goalscope.base.types import InvalidInputError, ModelError
from goalscope.experiment.multiple_choice import (
    Question,
    measure_question,
    read_questions,
    rephrase,
)
from goalscope.models import Completion

HEAD = "prompt,A,B,C,D,E,answer\n"
CHOICES = {"A": "red apples", "B": "green pears"}
ROW = {"id": "q", "prompt": "Which fruit?", "choices": CHOICES, "answer": "A"}
REPHRASED = {"A": ["apples of red"], "B": ["pears", "green ones"]}
UNSAID = Question("q", "Which fruit?", CHOICES, "A", {})
SAID = Question("q", "Which fruit?", CHOICES, "A", REPHRASED)


def read(tmp_path, text, name="q.csv", limit=None):
    (tmp_path / name).write_bytes(text.encode())
    return read_questions(tmp_path / name, limit)


def read_rows(tmp_path, *rows):
    return read(tmp_path, "\n".join(json.dumps(row) for row in rows), "q.jsonl")


def test_a_csv_file_is_read_as_text_and_nothing_else(tmp_path):
    rows = 'What?,None,NA,1.0,,"a, ""b""\nc",A\nAnd?,x\u2028y,x\x85y,TRUE,null,nan,E\n'
    with pytest.raises(InvalidInputError, match=r"q\.csv, row 1, choices, D: The text is empty"):
        read(tmp_path, HEAD + rows)
    one, two = read(tmp_path, HEAD + rows.replace(",,", ",0,"))
    assert (one.id, two.id) == ("row 1", "row 2")
    assert one.choices == {"A": "None", "B": "NA", "C": "1.0", "D": "0", "E": 'a, "b"\nc'}
    assert two.choices == {"A": "x\u2028y", "B": "x\x85y", "C": "TRUE", "D": "null", "E": "nan"}
    assert (one.answer, two.answer, one.rephrasings) == ("A", "E", {})


def test_what_was_read_is_written_and_read_again(tmp_path):
    rows = [ROW, {**ROW, "id": "r", "rephrasings": REPHRASED}]
    questions = read_rows(tmp_path, *rows)
    assert questions[1] == Question("r", "Which fruit?", CHOICES, "A", REPHRASED)
    assert read_rows(tmp_path, *map(asdict, questions)) == questions


def test_a_limit_takes_the_first(tmp_path):
    rows = "\ufeff" + HEAD + "1?,a,b,c,d,e,A\r\n2?,a,b,c,d,e,A\r\nbroken\n"
    assert [each.prompt for each in read(tmp_path, rows, limit=2)] == ["1?", "2?"]


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("question,A,B,C,D,E,answer\nx,a,b,c,d,e,A\n", "row 1: the key 'prompt' is missing"),
        ("promt,A,B,C,D,E,answer\nx,a,b,c,d,e,A\n", "row 1: the key 'promt' .* mean 'prompt'"),
        (HEAD + 'x,a,b,c,d,e,A\n"y,a,b,c,d,e,A\nz,a,b,c,d,e,A\n', r".*begins in line 3: "),
        (HEAD + 'x,"a" b,b,c,d,e,A\n', r".*begins in line 2: "),
        (HEAD + "x,a,b,c,d,e,A\nx,a,b,c\n", "row 2, choices: 'D' must be a text, not None"),
        (HEAD + "x,a,b,c,d,e,A,f\n", r".*begins in line 2: 8 cells for 7 columns"),
        (HEAD + "x,a,b,c,d,e,F\n", "row 1: 'answer' must be one of A, B, C, D, E, not 'F'"),
        ("", "has no questions"),
    ],
)
def test_a_csv_row_that_cannot_be_used_is_named(tmp_path, text, cause):
    with pytest.raises(InvalidInputError, match=rf"q\.csv(, | |$){cause}|{cause}.*q\.csv"):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("broken", "cause"),
    [
        ({**ROW, "id": "p"}, "two questions have the id 'p'"),
        ({**ROW, "choices": {"A": "one"}}, "at least 2"),
        ({k: v for k, v in ROW.items() if k != "prompt"} | {"Promt": "?"}, "mean 'prompt'"),
        ({**ROW, "choices": {"A": "one", "\x92": "two"}}, "short name such as A, not"),
        ({**ROW, "answer": "C"}, "one of A, B, not 'C'"),
        ({**ROW, "rephrasings": {"A": ["x"]}}, "a list for each choice"),
        (
            {**ROW, "rephrasings": {"A": ["x", "Red  Apples."], "B": ["y"]}},
            "rephrasing of A must not be the choice itself",
        ),
    ],
)
def test_a_json_row_that_cannot_be_used_is_named(tmp_path, broken, cause):
    with pytest.raises(InvalidInputError, match=cause) as caught:
        read_rows(tmp_path, {**ROW, "id": "p"}, broken)
    assert "q.jsonl" in str(caught.value)
    assert "line 2" in str(caught.value) or "two questions" in str(caught.value)


def test_the_papers_questions_are_read():
    if not (folder := os.environ.get("GOALSCOPE_DATA")):
        pytest.skip("GOALSCOPE_DATA is not set")
    assert len(read_questions(Path(folder) / "mcq/6000_train_examples.csv")) == 6000
    rephrased = read_questions(Path(folder) / "mcq/rephrased_dev.jsonl")
    assert all(len(texts) == 4 for each in rephrased for texts in each.rephrasings.values())


class Writer(WordModel):
    """Writes the next of its replies at each call, the last one for ever."""

    def __init__(self, *replies, finish="stop"):
        super().__init__()
        self.written, self.finish, self.seeds = list(replies), finish, []

    def generate(self, messages, **settings):
        self.seeds.append(settings["seed"])
        text = self.written.pop(0) if len(self.written) > 1 else self.written[0]
        return Completion(text, self.finish, 1, 1)


def test_rephrasings_differ_from_each_other_and_from_the_choice():
    writer = Writer("RED APPLES", "red  apples.", ' "One." ', "one", "Two", "", " Three\tthree ",
                    "Four", "Five")  # fmt: skip
    written = rephrase(writer, UNSAID, count=4).rephrasings
    assert written["A"] == ["One.", "Two", "Three three", "Four"]
    assert written["B"] == ["Five"] * 4
    assert writer.seeds == [*range(8), *range(12)]


def test_too_few_rephrasings_are_repeated_in_turn():
    writer = Writer(*["One", "Two", "Three"] * 4, "Four")
    assert rephrase(writer, UNSAID, count=5).rephrasings == {
        "A": ["One", "Two", "Three", "Four", "One"],
        "B": ["Four"] * 5,
    }


@pytest.mark.parametrize(
    "writer", [Writer(" Red apples!"), Writer("..."), Writer("cut", finish="length")]
)
def test_the_choices_own_words_are_no_rephrasing(writer):
    with pytest.raises(ModelError, match=r"choice A of the question 'q'.*--generator"):
        rephrase(writer, UNSAID, count=2)


def by_hand(context, text="red apples"):
    """log P(text | context) of a `WordModel`."""
    seen = {word.strip(".,:()?!-").lower() for word in context.split()} - {""}
    total = WordModel.vocabulary + len(seen) * (WordModel.boost - 1)
    return sum(math.log((WordModel.boost if w in seen else 1) / total) for w in text.split())


def prompt(query, goal):
    wanted = f" (You are a person who wants this: {goal})" if goal else ""
    return (
        "You are role playing a person who talks with an assistant. The assistant s task: Ask the "
        f"human a question. Say what this person would say next. {query}{wanted}"
    )


def test_each_condition_has_the_figures_computed_by_hand():
    measured = measure_question(WordModel(), SAID, layout="goal-last")
    queries = {
        "question": "Which fruit?",
        "choices": "Which fruit? A. red apples B. green pears",
        "others": "Which fruit? green pears",
        "blank": "What do you say?",
    }
    goals = ["apples of red", "pears", "green ones"]
    assert measured["goals"] == [
        {"choice": "A", "text": "apples of red"},
        {"choice": "B", "text": "pears"},
        {"choice": "B", "text": "green ones"},
    ]
    assert measured["tokens"] == 2
    assert measured["overlap"] == [1, 0, 0]
    assert set(measured["conditions"]) == set(queries)
    for name, query in queries.items():
        found = measured["conditions"][name]
        assert found["log_likelihood"] == pytest.approx([by_hand(prompt(query, g)) for g in goals])
        assert found["unspecified"] == pytest.approx(by_hand(prompt(query, "")))


def test_others_leave_out_the_persons_words_and_goals_stand_where_the_layout_has_them():
    class Spy(WordModel):
        heard = ""

        def token_logprobs(self, contexts, continuations, **settings):
            self.heard += "".join(f"<{context[-1].content}>" for context in contexts)
            return super().token_logprobs(contexts, continuations, **settings)

    spy = Spy()
    same = {"A": "pears", "B": "red apples", "C": "red apples"}
    rephrasings = {"A": ["x"], "B": ["y"], "C": ["z"]}
    measured = measure_question(
        spy, Question("q", "Fruit?", same, "C", rephrasings), layout="goal-last"
    )
    assert "<Fruit?\n- pears>" in spy.heard
    assert "- red apples" not in spy.heard
    assert len(measured["goals"]) == 3
    assert "wants this: x" in spy.heard
    spy.heard = ""
    measure_question(spy, SAID, layout="goal-first")
    assert "wants this" not in spy.heard  # but before the conversation
