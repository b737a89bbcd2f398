"""What an assistant should do next: sure goals are acted on, but not against what was said."""

import math
from dataclasses import dataclass

import pytest

from fakes import WordModel, said
from goalscope.base.types import UNSPECIFIED, Goal, InvalidInputError, Turn
from goalscope.belief.advice import advice, advised
from goalscope.belief.belief import Belief
from goalscope.belief.tracker import GoalTracker

TEA = Goal("make tea")
BARE = Belief.uniform([UNSPECIFIED, TEA])
SURE_OF_TEA = BARE.observe([-9.0, 0.0])


@dataclass
class Stand:
    belief: Belief
    turns: list[Turn]
    since: int = 0


def told(belief: Belief, *words: str, **more) -> str:
    words = words or ("Tea, please.",) * len(belief.log_likelihood)
    return advice(Stand(belief, said(*words)), **more)


def test_any_belief_has_its_advice() -> None:
    expected = {
        "ask": [BARE, Belief.uniform([]), Belief.uniform([TEA]), BARE.observe([0.0, 0.5])],
        "act": [BARE.pin(TEA), BARE.observe([0.0, 0.0]).pin(TEA), BARE.observe([-9.0, 0.0])],
        "propose": [
            BARE.observe([0.0, -9.0]),
            BARE.observe([-math.inf, -math.inf]),
            Belief.uniform([TEA]).observe([-math.inf]),
        ],
    }
    for word, beliefs in expected.items():
        assert [told(each) for each in beliefs] == [word] * len(beliefs)
    assert told(BARE.observe([-1.5, 0.0])) == "act"
    assert told(BARE.observe([0.0, -0.42])) == "propose"
    assert told(BARE.observe([0.0, -0.39])) == "ask"
    assert told(BARE.observe([-1.3, 0.0])) == "ask"
    assert told(Belief.uniform([TEA, Goal("bake")]).observe([0.0, 0.0])) == "ask"


def test_words_that_deny_are_no_evidence_to_act_on_later() -> None:
    belief = BARE.observe([-9.0, 0.0]).observe([0.0, 0.0])
    assert told(belief, "Don't make tea!", "Thanks.") == "ask"
    assert told(belief.observe([-9.0, 0.0]), "Don't!", "Thanks.", "Now make tea.") == "act"


def test_a_proposal_needs_the_persons_word() -> None:
    belief = BARE.observe([-9.0, 0.0])
    for proposed in ([TEA], {TEA}, ["Make tea."], "Make tea."):
        assert told(belief, proposed=proposed) == "ask"
        assert told(belief.observe([-9.0, 0.0]), proposed=proposed) == "ask"
        assert told(belief.pin(TEA), proposed=proposed) == "act"
    confirmed = belief.pin(TEA).observe([-9.0, 0.0])
    assert told(confirmed, proposed=[TEA]) == "act"
    assert told(confirmed, "Tea.", "No tea!", proposed=[TEA]) == "ask"
    assert told(belief, proposed=[Goal("bake")]) == "act"


def test_how_sure_is_sure_enough_is_the_programs_choice() -> None:
    belief = BARE.observe([-1.3, 0.0])  # 79 %
    assert [told(belief, sure=sure) for sure in (0.7, 0.8, 1)] == ["act", "ask", "ask"]
    lost = BARE.observe([0.0, -0.39])  # Unspecified has 60 %
    assert [told(lost, lost=share) for share in (0.5, 0.7)] == ["propose", "ask"]
    assert told(belief.observe([0.0, 0.0]), "Tea.", "No tea!", sure=0.7) == "ask"
    for name in ("sure", "lost"):
        for wrong in (-0.1, 1.1, math.nan):
            with pytest.raises(InvalidInputError, match=f"{name} must be a probability"):
                told(belief, **{name: wrong})


def test_who_wants_to_cancel_something_takes_nothing_back() -> None:
    goal = Goal("cancel an order")
    belief = Belief.uniform([Goal("Unspecified"), goal]).observe([0.0, 0.0]).observe([-0.5, 0.0])
    words = ("Hi there.", "I want to cancel my order.")
    assert advised(Stand(belief, said(*words))).because.startswith("The likeliest goal has")
    assert advised(Stand(belief, said("Cancel it.", "Stop!"))).because == (
        "The newest words take something back."
    )


def test_who_takes_something_back_is_offered_nothing_else() -> None:
    lost = BARE.observe([0.0, -9.0])
    words = "Never mind, we'll take the bus."
    assert told(lost.observe([0.0, 0.0]), "Hi.", words) == "ask"
    assert told(lost.observe([0.0, 0.0]), "Hi.", "We take the bus.") == "propose"
    assert told(lost, "I want to cancel an order.") == "propose"


def test_it_is_given_of_a_tracker() -> None:
    tracker = GoalTracker(WordModel(), goals=["make tea", "bake a cake"], calibration="paper")
    tracker.observe("", "make tea, tea")
    assert advice(tracker) == "act"


def test_advice_has_its_reason() -> None:
    stands = {
        "Nothing was said yet.": Stand(BARE, []),
        "The likeliest goal has 50%; 80% is sure enough.": Stand(
            BARE.observe([0.0, 0.0]), said("A")
        ),
        "None of the goals explains the words well.": Stand(BARE.observe([0.0, -9.0]), said("A")),
        "No goal can have said these words.": Stand(
            BARE.observe([-math.inf, -math.inf]), said("A")
        ),
        "The answer to the question whether to go ahead is no plain yes.": Stand(
            SURE_OF_TEA, [Turn("Shall I make tea?", "Hm.")]
        ),
        "The newest words deny something.": Stand(SURE_OF_TEA, said("No tea.")),
        "The newest words ask something.": Stand(SURE_OF_TEA, said("How do you make tea?")),
        "Without the words that deny, ask, suppose or were taken back it has only 50%.": Stand(
            SURE_OF_TEA.observe([0.0, 0.0]), said("No tea.", "Good.")
        ),
        "The newest words take something back.": Stand(
            BARE.observe([0.0, 0.0]).observe([0.0, 0.0]), said("Tea!", "Stop!")
        ),
    }
    assert [advised(each).because for each in stands.values()] == [*stands]
    made = advised(Stand(SURE_OF_TEA, said("Tea!")), proposed=[TEA])
    assert made == ("ask", "A model proposed this goal, and the person has not confirmed it.")
    refused = [Turn("Shall I make tea?", "Hm."), Turn("What then?", "Well.")]
    later = advised(Stand(SURE_OF_TEA.observe([0.0, 0.0]), refused))
    assert later == ("ask", "Later words must speak for it first.")
