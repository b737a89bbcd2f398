"""The evaluator: what it is shown, and that no score is ever guessed."""

import json

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes import WordModel
from goalscope.base.types import InvalidInputError, ModelError
from goalscope.envs.registry import domain_named
from goalscope.experiment.judge import SCORES, Trial, judge
from goalscope.models import Completion, unfinished_json

CASE = {"task": "The agent sells.", "description": "You want\ntea."}
GOOD = {"explanation": "There is tea.", "score": 2.25}


def possible(domain: str) -> tuple[str, ...]:
    return domain_named(domain).possible or ()


class Evaluator(WordModel):
    """Answers what it is given, one after another, and keeps what it was asked."""

    def __init__(self, *answers: object) -> None:
        super().__init__()
        self.answers = answers
        self.prompts: list[str] = []
        self.asked: list[dict] = []

    def generate(self, messages, **settings) -> Completion:
        answer = self.answers[len(self.asked) % len(self.answers)]
        self.asked.append(settings)
        self.prompts.append("\n".join(message.content for message in messages))
        if isinstance(answer, Exception):
            raise answer
        text = answer if isinstance(answer, str) else json.dumps(answer)
        return Completion(text, "stop", 1, 1)


def read(answer: object) -> Trial:
    (trial,) = judge(Evaluator(answer), **CASE, outcome="tea", trials=1)
    return trial


@pytest.mark.parametrize("score", SCORES)
def test_every_quarter_is_in_the_schema_and_read(score) -> None:
    model = Evaluator({**GOOD, "score": score})
    (trial,) = judge(model, **CASE, outcome="tea", trials=1)
    assert trial.score == score
    jsonschema.validate({**GOOD, "score": score}, model.asked[0]["schema"])
    assert list(model.asked[0]["schema"]["properties"]) == ["explanation", "score"]


@pytest.mark.parametrize(
    "answer",
    [
        '```json\n{"explanation": "x", "score": 2}\n```',
        "2.25",
        "",
        "[" * 100_000,
        {"score": 2},
        {**GOOD, "sure": True},
        {**GOOD, "explanation": None},
        *({**GOOD, "score": bad} for bad in ("2", None, True, 3.25, -0.25, 2.1, [2], 10**30)),
        '{"explanation": "x", "score": NaN}',
        '{"explanation": "x", "score": 1e999}',
    ],
)
def test_what_cannot_be_read_has_no_score_and_is_kept(answer) -> None:
    trial = read(answer)
    assert trial.score is None
    assert trial.explanation
    raw = answer if isinstance(answer, str) else json.dumps(answer)
    assert trial.answer[:1000] == raw[:1000]
    assert len(trial.answer) < 1010


@given(st.text(st.characters() | st.sampled_from("\ud800\udfff\x00")))
def test_whatever_a_model_explains_can_be_stored(text) -> None:
    for trial in (read({**GOOD, "explanation": text}), read(text or "x")):
        trial.explanation.encode()
        trial.answer.encode()


def test_a_trial_whose_json_is_not_finished_is_unscored_and_the_others_count() -> None:
    trials = judge(Evaluator(unfinished_json(512), GOOD), **CASE, outcome="tea", trials=4)
    assert [trial.score for trial in trials] == [None, 2.25, None, 2.25]
    assert "did not finish" in trials[0].explanation
    with pytest.raises(InvalidInputError, match="at least 1"):
        judge(Evaluator(GOOD), **CASE, outcome="tea", trials=0)


def test_other_trouble_with_the_model_is_not_a_missing_score() -> None:
    with pytest.raises(ModelError, match="No server"):
        judge(Evaluator(ModelError("No server answers.")), **CASE, outcome="tea")


@pytest.mark.parametrize(
    "shown", [{"outcome": "The basket is empty.", "empty": True}, {"outcome": " "}, {}]
)
def test_an_empty_outcome_is_worth_nothing_and_never_shown(shown) -> None:
    model = Evaluator(GOOD)
    trials = judge(model, **CASE, **shown, trials=3)
    assert [trial.score for trial in trials] == [0.0] * 3
    assert "not asked" in trials[0].explanation
    assert model.asked == []


def test_the_evaluator_is_shown_what_the_paper_shows() -> None:
    model = Evaluator(GOOD)
    judge(
        model,
        **CASE,
        outcome="1 x Green Tea",
        actions=["search inventory: tea", "add item: Green Tea"],
        possible=possible("grocery"),
        trials=1,
    )
    (prompt,) = model.prompts
    for text in (
        "The agent sells.\nThe agent can do this: search inventory, add item,",
        "The human's profile: You want tea.",
        "- search inventory: tea\n- add item: Green Tea\n",
        "In the end:\n1 x Green Tea\n",
        "from 0 (least reasonable) to 3 (most reasonable), rounded to the nearest 0.25",
        "Do not penalise inefficiency or repeats.",
    ):
        assert text in prompt
    judge(model, **CASE, actions=["open: fridge"], trials=1)
    assert "In the end" not in model.prompts[-1]
    assert "can do" not in model.prompts[-1]


def test_trials_differ_by_seed_and_share_none_with_another_seed() -> None:
    model = Evaluator(GOOD)
    for seed in (0, 1):
        judge(model, **CASE, outcome="tea", seed=seed)
    seeds = [asked["seed"] for asked in model.asked]
    assert len(set(seeds)) == len(seeds) == 40
    assert all(asked["temperature"] > 0 for asked in model.asked)


def test_at_the_papers_temperature_every_trial_is_asked_for() -> None:
    model = Evaluator(GOOD)
    trials = judge(model, **CASE, outcome="tea", temperature=0, trials=3)
    assert trials == [Trial(2.25, "There is tea.")] * 3
    assert [asked["temperature"] for asked in model.asked] == [0, 0, 0]
