"""How like real people simulated ones talk."""

import typing

import pytest

from fakes import WordModel, said
from goalscope.agent.people import Habit
from goalscope.base.types import Goal
from goalscope.datasets.case import Case
from goalscope.experiment.realism import Talk, prompt_table, realism_table, words_of

TURNS = said("Boil the pasta.", "Which pan?")
CASE = Case("1", "a", "Help.", TURNS, (Goal("boil pasta"), Goal("fry an egg")), 0)


class Heard(WordModel):
    """Keeps the words that it scores."""

    def __init__(self) -> None:
        super().__init__()
        self.heard: list[list[str]] = []

    def token_logprobs(self, contexts, continuations):
        self.heard.append([*continuations])
        return super().token_logprobs(contexts, continuations)


def person(kind: str, *turns: str) -> Talk:
    return Talk(kind, "ann", "You boil pasta. Nothing else matters.", turns)


def test_real_people_are_like_themselves() -> None:
    again = Talk("twin", "a", "boil pasta", tuple(turn.utterance for turn in TURNS))
    real, twin = realism_table([again], "talks", [CASE]).rows
    assert {**real, "who": ""} == {**twin, "who": ""}
    assert real["from real"] == 0
    assert real["words"].value == 2.5
    assert real["questions"].value == 0.5
    assert real["goal's words"].value == pytest.approx((2 / 3 + 0) / 2)


def test_the_distance_is_the_mean_number_of_words_to_move() -> None:
    talks = [person("long", "one two three four five", "Is it six now?")]
    _, found = realism_table(talks, "talks", [CASE]).rows
    assert found["from real"] == pytest.approx(((4 - 2) + (5 - 3)) / 2)


def test_who_recites_their_goal_is_seen() -> None:
    talks = [person("recites", "Boil pasta."), person("hides", "It is late.", "...")]
    _, recites, hides = realism_table(talks, "talks", [CASE]).rows
    assert (recites["goal's words"].value, hides["goal's words"].value) == (1.0, 0.0)


def test_each_prompt_is_scored_on_the_same_real_words() -> None:
    model = Heard()
    rows = prompt_table("talks", [CASE], model).rows
    assert [row["person"] for row in rows] == ["simulated", *typing.get_args(Habit)]
    assert model.heard == [[turn.utterance for turn in TURNS]] * len(rows)
    assert all(row["dialogues"] == 1 and row["nats per word"].value > 0 for row in rows)


def test_a_prompt_that_holds_the_words_makes_them_likelier() -> None:
    def nats(goal: str) -> float:
        case = Case("1", "a", "Help.", TURNS, (Goal(goal), Goal("none")), 0)
        return prompt_table("talks", [case], WordModel()).rows[0]["nats per word"].value

    assert nats("Boil the pasta.") < nats("Feed the cat.")


def test_words_are_counted_without_marks() -> None:
    assert words_of("I'd like 2 eggs - no, three!") == ["i'd", "like", "2", "eggs", "no", "three"]
