"""A trace holds what models were asked and answered, and answers in their place."""

import json
import subprocess
import sys
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

from commands import fails, run
from fakes import LampRoom, WordModel
from goalscope.agent.agent import Agent
from goalscope.base.types import InvalidInputError, Message, UnreadableAnswerError
from goalscope.belief.tracker import GoalTracker
from goalscope.models.trace import during, read_trace, traced, tracing
from test_paper import answers, paper, spoken

HELLO = [Message("user", "Hello")]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "trace.jsonl"


class Away(WordModel):
    """A model that is not there."""

    @traced
    def generate(self, messages, **settings):
        raise AssertionError("asked")

    @traced
    def token_logprobs(self, contexts, continuations):
        raise AssertionError("asked")


def lines(file: Path, module: str = "") -> list[dict]:
    return [each for each in read_trace(file) if not module or each["module"] == module]


def test_a_call_is_a_line_with_prompt_answer_tokens_and_time(file: Path) -> None:
    model = WordModel({"Hello": "Good day"})
    with tracing(file), during(episode="e", round=3, module="human"):
        model.generate(HELLO, max_tokens=7, seed=0)
        (row,) = model.token_logprobs([HELLO], ["Good day"])
    written, scored = lines(file)
    assert (written["event"], written["episode"], written["round"]) == ("model", "e", 3)
    assert (written["module"], written["model"]) == ("human", "words")
    assert written["input"] == [{"role": "user", "content": "Hello"}]
    assert written["config"] == {"max_tokens": 7}
    assert written["output"]["completion"] == "Good day"
    assert written["output"]["usage"] == {"input_tokens": 1, "output_tokens": 2}
    assert written["time"] >= 0
    assert (scored["event"], scored["words"]) == ("score", "Good day")
    assert [each["logprob"] for each in scored["output"]["logprobs"]] == row.tolist()


def test_the_embedded_model_shows_prompts_with_their_markup_and_tokens(file: Path, model) -> None:
    with tracing(file):
        model.generate(HELLO, max_tokens=2)
        model.token_logprobs([HELLO], ["Good day"])
    written, scored = lines(file)
    assert written["prompt"].endswith("Hello<|im_end|>\n<|im_start|>assistant\n")
    assert "".join(each["token"] for each in scored["output"]["logprobs"]) == "Good day"


def test_without_a_trace_nothing_is_written_and_answers_are_the_same(file: Path) -> None:
    def beliefs() -> list[list[float]]:
        agent = paper(answers())
        return [spoken(agent, "I read a book.").belief.probability.tolist() for _ in range(2)]

    free = beliefs()
    assert not file.exists()
    with tracing(file):
        assert beliefs() == free
    before = file.read_bytes()
    beliefs()
    assert file.read_bytes() == before


def test_a_recording_answers_without_the_model(file: Path, tmp_path: Path) -> None:
    with tracing(file):
        first = spoken(paper(answers()), "I read a book.")
    again = tmp_path / "again.jsonl"
    with tracing(again, read_trace(file)):
        agent = Agent(LampRoom(["lamp", "broken"]), Away(), preset="paper")
        second = spoken(agent, "I read a book.")
    np.testing.assert_array_equal(second.belief.probability, first.belief.probability)
    assert second.results == first.results
    calls = [each for each in lines(again) if each["event"] in ("model", "score")]
    assert {each["answer"] for each in calls} == {"recorded"}


def test_a_swapped_module_is_asked_and_the_others_are_answered_from_the_recording(
    file: Path, tmp_path: Path
) -> None:
    with tracing(file):
        spoken(paper(answers(relevant=[["lamp"]] * 2, plan=[[1]] * 2)), "I read a book.")
    other = answers(plan=[[]], question=[], goals=[], remove=[], relevant=[])
    again = tmp_path / "again.jsonl"
    with tracing(again, read_trace(file), ["plan"]):
        round = spoken(paper(other), "I read a book.")
    assert round.results == ()
    assert [key for key, _ in other.asked] == ["plan"]


def test_where_a_prompt_has_changed_the_answer_in_its_place_counts_and_says_so(file: Path) -> None:
    with tracing(file), during(module="human"):
        WordModel({"Hello": "Good day"}).generate(HELLO)
    recording = read_trace(file)
    with tracing(file, recording), during(module="human"):
        reply = Away().generate([Message("user", "Goodbye")])
    assert reply.text == "Good day"
    assert lines(file)[-1]["answer"] == "recorded for another prompt"


def test_words_under_a_new_goal_are_scored_by_the_model(file: Path) -> None:
    def told(goals: list[str]) -> GoalTracker:
        tracker = GoalTracker(WordModel(), goals=goals)
        tracker.observe("Yes?", "I read.")
        return tracker

    with tracing(file):
        told(["read"])
    expected = told(["read", "sleep"]).belief.probability
    with tracing(None, read_trace(file)):
        np.testing.assert_array_equal(told(["read", "sleep"]).belief.probability, expected)


@pytest.mark.parametrize("text", ["hello", "[]", "{}", '{"event": "model"}', "[" * 9999, "\ud800"])
def test_what_is_no_trace_is_refused_with_its_line(file: Path, text: str) -> None:
    file.write_text("\n" if text == "" else text, errors="surrogatepass")
    with pytest.raises(InvalidInputError, match=r"line 1|cannot be read"):
        read_trace(file)


def test_a_trace_is_shown_by_round_and_module(file: Path) -> None:
    agent = paper(answers())
    agent.episode = "abc"
    with tracing(file):
        spoken(agent, "I read a book.")
    shown = run("trace", str(file)).stdout
    assert "abc round 1" in shown
    modules = [line.split()[0] for line in shown.splitlines() if " s  " in line]
    assert [name for name, _ in groupby(modules)] == [
        "query", "infer", "propose", "infer", "remove", "relevant", "plan",
    ]  # fmt: skip
    whole = run("trace", str(file), "--module", "plan", "--full").stdout
    assert "Possible actions:" in whole
    assert '{"plan": [1]}' in whole
    assert "question" not in whole
    assert len(json.loads(run("trace", str(file), "--json").stdout)) == len(read_trace(file))


def test_two_traces_are_told_apart_by_module(tmp_path: Path) -> None:
    files = []
    for plan in ([1], []):
        files.append(tmp_path / f"{len(plan)}.jsonl")
        with tracing(files[-1]):
            spoken(paper(answers(plan=[plan])), "I read a book.")
    told = json.loads(run("trace", *map(str, files), "--json").stdout)
    assert {name: n for name, n in told["differ"].items() if n} == {"plan": 1}
    assert [each["output"]["completion"] for each in told["first"]] == [
        '{"plan": [1]}', '{"plan": []}',
    ]  # fmt: skip
    same = run("trace", str(files[0]), str(files[0])).stdout
    assert "plan       0 of 1 call differ" in same


def test_an_episode_runs_again_with_a_module_swapped(tmp_path: Path, words, shop) -> None:
    file, out = tmp_path / "a.jsonl", tmp_path / "b.jsonl"
    told = ["--profile", "baker", *shop, "--rounds", "2", "--store", str(tmp_path / "s.db")]
    assert run("run", *told, "--trace", str(file)).exit_code == 0
    again = run("trace", str(file), "--swap", "read", "--out", str(out))
    assert again.exit_code == 0, again.output

    def utterances(file: Path) -> list[str]:
        return [each["utterance"] for each in lines(file) if each["event"] == "round"]

    assert utterances(out) == utterances(file) != []
    answered = {each["module"] for each in lines(out) if "answer" in each}
    asked = {each["module"] for each in lines(out) if "time" in each and "answer" not in each}
    assert asked == {"read"}
    assert "read" not in answered != set()
    assert "exists" in fails(2, "trace", str(file), "--swap", "read", "--out", str(out))
    assert run("run", *told, "--trace", str(file)).exit_code == 0
    ids = [each["id"] for each in lines(file) if each["event"] == "episode"]
    more = tmp_path / "c.jsonl"
    assert "--episode" in fails(2, "trace", str(file), "--swap", "read", "--out", str(more))
    chosen = ["--swap", "read", "--out", str(more), "--episode", ids[1]]
    assert run("trace", str(file), *chosen).exit_code == 0
    assert utterances(more) == utterances(out)


def test_a_call_that_failed_fails_again(file: Path) -> None:
    class Failing(Away):
        @traced
        def generate(self, messages, **settings):
            raise UnreadableAnswerError("It was cut off.")

    with tracing(file), pytest.raises(UnreadableAnswerError):
        Failing().generate(HELLO)
    with tracing(None, read_trace(file)), pytest.raises(UnreadableAnswerError, match="cut off"):
        Away().generate(HELLO)
    assert "failed: It was cut off." in run("trace", str(file)).stdout


def test_a_worker_traces_until_it_ends(file: Path) -> None:
    code = (
        "import gc, sys; from pathlib import Path; from goalscope.experiment import run; "
        "from goalscope.models import trace; run._begin(1, Path(sys.argv[1])); "
        "gc.collect(); trace.note('round')"
    )
    subprocess.run([sys.executable, "-c", code, str(file)], check=True)
    assert [each["event"] for each in read_trace(file)] == ["round"]


@pytest.mark.parametrize(
    ("given", "why"),
    [
        (["--swap", "plan"], "add --out FILE"),
        (["--module", "plans"], "There is no module 'plans'"),
        (["{file}", "{file}"], "one trace, or two"),
    ],
)
def test_a_command_that_cannot_be_is_refused(file: Path, given: list[str], why: str) -> None:
    with tracing(file):
        WordModel().generate(HELLO)
    assert why in fails(2, "trace", str(file), *(each.format(file=file) for each in given))


def test_words_that_are_scored_stand_with_their_goal_and_turn(file: Path) -> None:
    with tracing(file):
        tracker = GoalTracker(WordModel(), goals=["bake a cake"])
        tracker.observe("Yes?", "A cake.")
        tracker.observe("Which?", "Chocolate.")
    scored = lines(file, "infer")
    assert {(each["goal"], each["turn"]) for each in scored} == {
        (goal.text, turn) for goal in tracker.belief.goals for turn in (1, 2)
    }
    shown = run("trace", file, "--module", "infer").stdout
    assert shown.count("turn 1 under bake a cake") == 1


def test_a_selection_without_calls_says_what_there_is(file: Path) -> None:
    with tracing(file):
        GoalTracker(WordModel(), goals=["bake a cake"]).observe("Yes?", "A cake.")
    message = fails(2, "trace", file, "--module", "plan")
    assert "no such call" in message
    assert "calls of infer" in message
