"""What asks for the opposite of a goal is not acted on as the goal."""

from __future__ import annotations

import pytest

from goalscope.advice import doubtful
from goalscope.opposites import opposes
from goalscope.types import Goal


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        ("block the credit card", "Unblock the credit card please."),
        ("block the credit card", "The credit card is blocked. Please activate it again."),
        ("unblock the credit card", "Block it, please."),
        ("transfer money to Anna", "Reverse the transfer to Anna."),
        ("transfer money to Anna", "Transfer money from my Anna to me."),
        ("transfer money to Anna", "Please send the money for Anna back."),
        ("increase the card limit", "Lowering the card limit would be good."),
        ("get a bigger data plan", "Give me a smaller data plan."),
        ("get a bigger data plan", "My data plan is too big."),
        ("get a smaller data plan", "My data is not enough."),
        ("subscribe to the newsletter", "Unsubscribe me from the newsletter."),
        ("add a driver to the contract", "Take my husband off the contract."),
        ("turn on the lights", "Turned off would be better, please."),
        ("open the window", "I opened the window, now shut it."),
    ],
)
def test_the_opposite_of_a_goal_is_no_leave_for_it(goal: str, words: str) -> None:
    assert opposes(words, Goal(goal))
    assert doubtful(words, Goal(goal))


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        ("block the credit card", "Block the card, please. I lost it on the train."),
        ("unblock the credit card", "Please unblock my credit card."),
        ("transfer money to Anna", "Send 50 euros from my savings to Anna."),
        ("increase the card limit", "Please increase my limit, it's too low."),
        ("get a bigger data plan", "My data plan is too small."),
        ("turn off the lights", "Turn off the lights on the terrace."),
        ("bring back the books", "I'd like to bring the books back."),
        ("open and close the blinds", "Close the blinds."),
        ("play a song", "I'd like some music while I understand all this."),
    ],
)
def test_the_goal_itself_is_no_opposite(goal: str, words: str) -> None:
    assert not opposes(words, Goal(goal))
