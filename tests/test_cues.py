"""Words that hold an assistant back from a goal that it is sure of; the sentences are data."""

import tomllib
from pathlib import Path

import pytest

from fakes import said
from goalscope.base.types import UNSPECIFIED, Goal, Turn
from goalscope.belief.advice import advice, advised
from goalscope.belief.belief import Belief
from goalscope.language.cues import doubt, opposes, retracts
from test_advice import BARE, SURE_OF_TEA, TEA, Stand, told

CUES = tomllib.loads(Path(__file__).with_name("cues.toml").read_text(encoding="utf-8"))
LATER = [0.0, 0.0]  # log-likelihoods of words that say nothing


def sentences(*kinds: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("words", [each for kind in kinds for each in CUES[kind]])


def pairs(kind: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize(("other", "words"), CUES[kind])


@sentences("doubtful", "foreign")
def test_nothing_is_done_where_the_newest_words_are_doubtful(words: str) -> None:
    assert doubt(words, TEA)
    assert told(SURE_OF_TEA, words) == "ask"
    assert told(BARE.pin(TEA).observe([-9.0, 0.0]), words) == "ask"
    assert told(SURE_OF_TEA.observe(LATER), words, "Ok.") == "ask"
    assert told(SURE_OF_TEA.pin(TEA), words) == "act"


def test_what_is_too_long_to_be_read_is_doubtful() -> None:
    assert doubt("Block it. " + "It is mine. " * 200, TEA)


@sentences("plain")
def test_plain_requests_are_acted_on(words: str) -> None:
    assert not doubt(words, TEA)
    assert told(SURE_OF_TEA, words) == "act"


def test_a_goal_may_deny_what_the_words_deny() -> None:
    stop = Goal("stop the newsletter, and never send it again")
    assert not doubt("Stop the newsletter. Never again!", stop)
    assert doubt("Don't stop the newsletter.", stop)
    assert doubt("Never stop it, never.", stop)


@sentences("retracting")
def test_what_is_taken_back_stays_so_until_it_is_said_or_confirmed_again(words: str) -> None:
    taken_back = SURE_OF_TEA.observe([-1.0, 0.0])
    later = taken_back.observe([-0.1, 0.0])
    pinned = BARE.pin(TEA).observe([-1.0, 0.0]).observe([-0.1, 0.0])
    assert retracts(words, TEA)
    assert told(taken_back, "Tea!", words) == "ask"
    assert told(later, "Tea!", words, "Good.") == "ask"
    assert told(pinned, words, "Good.") == "ask"
    assert told(later.pin(TEA), "Tea!", words, "Good.") == "act"
    assert told(later.observe([-9.0, 0.0]), "Tea!", words, "Good.", "Now tea, please.") == "act"


@sentences("restricting")
def test_a_restriction_takes_nothing_back(words: str) -> None:
    assert not retracts(words, TEA)
    assert told(SURE_OF_TEA.observe(LATER).observe(LATER), "Tea!", words, "Good.") == "act"


def test_a_goal_may_take_back_what_the_words_take_back() -> None:
    cancel = Goal("cancel a booking")
    assert not retracts("Please cancel my booking.", cancel)
    assert retracts("Please cancel that. Stop!", cancel)


def test_who_wants_a_thing_ended_may_say_cancel_of_it() -> None:
    end = Goal("end my phone contract")
    sure = Belief.uniform([UNSPECIFIED, end]).observe([-9.0, 0.0])
    for words in ("Please cancel my contract.", "I'd like to cancel my old phone contract now."):
        assert advised(Stand(sure, said(words))) == ("act", '"end my phone contract" has 100%.')
        assert retracts(words, TEA)
    asked = [Turn("Shall I end your contract?", "Yes, please cancel my contract.")]
    assert advice(Stand(sure, asked)) == "act"


@pairs("cancelling_another")
def test_to_cancel_anything_else_takes_it_back(other: str, words: str) -> None:
    assert retracts(words, Goal(other))


@pairs("opposite")
def test_the_opposite_of_a_goal_is_doubtful(other: str, words: str) -> None:
    assert opposes(words, Goal(other))
    assert doubt(words, Goal(other))


@pairs("same")
def test_the_goal_itself_is_no_opposite(other: str, words: str) -> None:
    assert not opposes(words, Goal(other))


def answered(query: str, *words: str, pin: bool = False) -> str:
    """Advice on a sure goal after an answer to `query`, and perhaps later words."""
    belief = SURE_OF_TEA
    for _ in words:
        belief = belief.observe(LATER)
    turns = [Turn("", "Tea!"), Turn(query, words[0]), *said(*words[1:])]
    return advice(Stand(belief.pin(TEA) if pin else belief, turns))


COSTS = "It costs 120 euros. Shall I book it?"


@sentences("yes")
def test_a_yes_consents(words: str) -> None:
    assert answered(COSTS, words) == "act"


@sentences("no_yes")
def test_what_is_no_plain_yes_does_not(words: str) -> None:
    assert answered(COSTS, words) == "ask"
    assert answered(COSTS, words, pin=True) == "act"


@pytest.mark.parametrize(("kind", "asks"), [("asks_consent", True), ("asks_otherwise", False)])
def test_other_questions_need_no_yes(kind: str, asks: bool) -> None:
    for query in CUES[kind]:
        assert answered(query, "Too expensive.") == ("ask" if asks else "act"), query


@pairs("yes_to_the_contrary")
def test_a_yes_to_a_question_whether_not_to_is_no_consent(other: str, words: str) -> None:
    assert answered(other, words) == "ask"


def test_without_consent_a_goal_waits_for_words_that_speak_for_it() -> None:
    for words in ("We'll pass.", "Too expensive.", "\U0001f44e"):
        assert answered(COSTS, words, "Good.") == "ask"
    refused = [Turn("", "Tea!"), Turn("Shall I book it?", "Too expensive.")]
    turns = [*refused, Turn("", "Now tea, please.")]
    waiting = SURE_OF_TEA.observe(LATER)
    assert advice(Stand(waiting.observe([-0.1, 0.0]), turns)) == "act"
    against = waiting.observe([0.1, 0.0])
    assert advice(Stand(against, turns)) == "ask"
    assert advice(Stand(against, [*refused, Turn("Shall I book it now?", "Yes.")])) == "act"
    assert advice(Stand(waiting.pin(TEA).observe(LATER), turns)) == "act"
    sure = [Turn("", "Tea!"), Turn("Shall I book it?", "No."), Turn("Are you sure?", "Yes.")]
    assert advice(Stand(waiting.observe(LATER), sure)) == "ask"
