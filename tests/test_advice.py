"""What an assistant should do next: sure goals are acted on, but not against what was said."""

import math
from dataclasses import dataclass, replace

import pytest

from fakes import WordModel, said
from goalscope.advice import advice, advised, doubtful, retracts
from goalscope.belief import Belief
from goalscope.tracker import GoalTracker
from goalscope.types import UNSPECIFIED, Goal, InvalidInputError, Turn

TEA = Goal("make tea")
BARE = Belief.uniform([UNSPECIFIED, TEA])


@dataclass
class Stand:
    belief: Belief
    turns: list[Turn]


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


@pytest.mark.parametrize(
    "words",
    [
        "Do not transfer money to Anna.",
        "I never asked you to block the credit card!",
        "What happens if I block the credit card?",
        "what happens if i block the card",
        "Whatever you do, don't delete my account!",
        "Whatever you do, don\u2019t delete my account!",
        "dont delete it",
        "Don\uff07t do that",
        "Transfer money to Anna?",
        "Block it\uff1f",
        "Nobody may touch my account.",
        "I no longer want to block it.",
        "Please stop.",
        "Pay it without telling Anna.",
        "Should I block it",
        "do I have to block it",
        "Suppose I block it.",
        "Could you tell me what blocking costs?",
        "Can you delete it? Is that possible?",
        "Can you block it or can't you?",
        "Maybe block it.",
        "I hate that card, keep me out of this.",
        "I doubt that I want to block it.",
        "Skip that plan.",
        "Anything but that.",
        "I cancelled it.",
        "On second thought, keep the booking.",
        "Sorry, I meant the flight.",
        "Let me quickly ask my husband.",
        "My husband wants to go after all.",
        "Ignore that, it was my kid typing.",
        "Later, I'm driving.",
        "I'll do it myself online.",
        "I'd hate to block the card.",
        "I would rather die than block the card.",
        "Blocking the card is out of the question.",
        "It would be a mistake to block it.",
        "I already blocked the card yesterday.",
        "Hold on, I changed my mind, leave it out.",
        "Block it. " + "It is mine. " * 200,
    ],
)
def test_nothing_is_done_where_the_newest_words_deny_ask_or_suppose(words: str) -> None:
    assert doubtful(words, TEA)
    assert told(BARE.observe([-9.0, 0.0]), words) == "ask"
    assert told(BARE.pin(TEA).observe([-9.0, 0.0]), words) == "ask"
    assert told(BARE.observe([-9.0, 0.0]).pin(TEA), words) == "act"


@pytest.mark.parametrize(
    "words",
    [
        "Please transfer 20 euros to Anna.",
        "Could you book a table for two, please?",
        "hi, can you block my card?",
        "Can I have a mocha?",
        "A cake, please?",
        "I was wondering if you could book me a room.",
        "If possible, a quiet room.",
        "Do the dishes.",
        "Have a table booked for us.",
        "Knot the rope. Another note, nobly.",
    ],
)
def test_a_polite_request_is_no_question(words: str) -> None:
    assert not doubtful(words, TEA)
    assert told(BARE.observe([-9.0, 0.0]), words) == "act"


def test_a_goal_may_deny_what_the_words_deny() -> None:
    stop = Goal("stop the newsletter, and never send it again")
    assert not doubtful("Stop the newsletter. Never again!", stop)
    assert doubtful("Don't stop the newsletter.", stop)
    assert doubtful("Never stop it, never.", stop)


def test_words_that_deny_are_no_evidence_to_act_on_later() -> None:
    belief = BARE.observe([-9.0, 0.0]).observe([0.0, 0.0])
    assert told(belief, "Don't make tea!", "Thanks.") == "ask"
    assert told(belief.observe([-9.0, 0.0]), "Don't!", "Thanks.", "Now make tea.") == "act"


@pytest.mark.parametrize(
    "words",
    [
        "Stop!",
        "No, wait, don't do that.",
        "Please do not make it.",
        "Sorry, I changed my mind.",
        "Forget the tea.",
        "That's not what I want.",
        "I never asked you for that.",
        "Never mind.",
        "nvm",
        "Call it off.",
        "Scratch that.",
        "I take that back.",
        "Revert that.",
        "Go back.",
        "Oh, I found it again, don't block it.",
    ],
)
def test_what_is_taken_back_stays_so_until_it_is_said_or_confirmed_again(words: str) -> None:
    sure = BARE.observe([-9.0, 0.0])
    taken_back = sure.observe([-1.0, 0.0])
    later = taken_back.observe([-0.1, 0.0])
    pinned = BARE.pin(TEA).observe([-1.0, 0.0]).observe([-0.1, 0.0])
    assert retracts(words, TEA)
    assert told(sure, "Tea!") == "act"
    assert told(taken_back, "Tea!", words) == "ask"
    assert told(later, "Tea!", words, "Good.") == "ask"
    assert told(pinned, words, "Good.") == "ask"
    assert told(later.pin(TEA), "Tea!", words, "Good.") == "act"
    assert told(later.observe([-9.0, 0.0]), "Tea!", words, "Good.", "Now tea, please.") == "act"


@pytest.mark.parametrize(
    "words",
    [
        "My sister can't eat gluten.",
        "No nuts, please.",
        "I can't wait!",
        "Don't forget the milk.",
        "Not too sweet.",
        "That's all, nothing else.",
        "I don't like raisins.",
        "Please don't use wheat flour.",
        "But don't make it too sweet.",
        "I don't want it too sweet.",
        "The wait staff at the bus stop sing non-stop songs.",
    ],
)
def test_a_restriction_takes_nothing_back(words: str) -> None:
    assert not retracts(words, TEA)
    sure = BARE.observe([-9.0, 0.0]).observe([0.0, 0.0]).observe([0.0, 0.0])
    assert told(sure, "Tea!", words, "Good.") == "act"


def test_a_goal_may_take_back_what_the_words_take_back() -> None:
    cancel = Goal("cancel a booking")
    assert not retracts("Please cancel my booking.", cancel)
    assert retracts("Please cancel that. Stop!", cancel)


def test_a_proposal_needs_later_words_that_speak_for_it() -> None:
    belief = BARE.observe([-9.0, 0.0])
    assert told(belief, proposed={TEA: 1}) == "ask"
    assert told(belief.observe([0.0, 0.0]), proposed={TEA: 1}) == "ask"
    assert told(belief.observe([-0.1, 0.0]), proposed={TEA: 1}) == "act"
    assert told(belief.observe([-0.1, 0.0]), "Tea.", "No tea!", proposed={TEA: 1}) == "ask"
    assert told(belief.pin(TEA), proposed={TEA: 1}) == "act"
    assert told(belief, proposed={Goal("bake"): 1}) == "act"
    assert told(belief, proposed={"Make tea.": 1}) == "ask"
    for wrong in (["make tea"], {5: 1}, {TEA: "one"}, 3):
        with pytest.raises(InvalidInputError, match="proposed must say"):
            told(belief, proposed=wrong)


@pytest.mark.parametrize(
    "words",
    [
        "Je ne veux pas louer un e-bike pour un weekend.",
        "Ich habe am Montag keine Zeit f\u00fcr die Reparatur.",
        "Mejor lo dejamos para otro d\u00eda, es muy caro.",
        "Lasciamo perdere, \u00e8 troppo caro.",
        "Het is te duur, laat maar zitten.",
        "Jeg vil ikke leje en cykel i weekenden, det er for dyrt.",
        "Nie chc\u0119 wypo\u017cycza\u0107 roweru, to za drogo.",
        "\u042f \u043d\u0435 \u0445\u043e\u0447\u0443.",
        "\u6211\u4e0d\u60f3\u79df\u7535\u52a8\u81ea\u884c\u8f66",
    ],
)
def test_what_shows_no_english_is_not_acted_on_unless_confirmed(words: str) -> None:
    assert doubtful(words, TEA)
    assert told(BARE.observe([-9.0, 0.0]), words) == "ask"
    assert told(BARE.observe([-9.0, 0.0]).observe([0.0, 0.0]), words, "Ok.") == "ask"
    assert told(BARE.observe([-9.0, 0.0]).pin(TEA), words) == "act"


@pytest.mark.parametrize(
    "words",
    [
        "Tea!",
        "Caf\u00e9 cr\u00e8me, please.",
        "boil some potato please",
        "prepare a coffee in clean mug",
        "Book a table for 7 at 17:15 on Saturday.",
        "I prefer something related to boats",
        "5 \u00b0C colder \U0001f600 tonight or so",
    ],
)
def test_short_and_plain_english_is_acted_on(words: str) -> None:
    assert told(BARE.observe([-9.0, 0.0]), words) == "act"


NO_YES = [
    "We'll pass.",
    "Too expensive.",
    "I'd rather take the bus.",
    "nvm",
    "Thanks, I'm good.",
    "Thanks.",
    "\U0001f44e",
    "\u274c",
    "Maybe later.",
    "I'll think about it.",
    "It's off.",
    "Hmm.",
    "Lass es lieber.",
    "Oops, wrong window.",
    "Yes, but later.",
    "Ok, too expensive.",
    "Fine, I'll walk.",
    "Yesterday.",
    "Book a taxi for my aunt, another time.",
    "Yes, I'd rather take the bus.",
    "Book something cheaper.",
    "Yes?",
    "Yes, to Porto.",
    "Yes, 90.",
    "Yes. The cheaper one, please.",
    "Yes, tomorrow.",
    "Yes, once my salary is in.",
    "Sure you want to charge me for that",
    "Yeah, right.",
]


def answered(query: str, *words: str, pin: bool = False) -> str:
    """Advice on a sure goal after an answer to `query`, and perhaps later words."""
    belief = BARE.observe([-9.0, 0.0])
    for _ in words:
        belief = belief.observe([0.0, 0.0])
    turns = [Turn("", "Tea!"), Turn(query, words[0]), *said(*words[1:])]
    return advice(Stand(belief.pin(TEA) if pin else belief, turns))


@pytest.mark.parametrize("words", NO_YES)
def test_a_question_for_leave_needs_a_yes(words: str) -> None:
    query = "It costs 120 euros. Shall I book it?"
    assert answered(query, words) == "ask"
    assert answered(query, words, pin=True) == "act"


@pytest.mark.parametrize("words", ["We'll pass.", "Too expensive.", "\U0001f44e"])
def test_what_was_given_no_leave_waits_for_words_that_speak_for_it(words: str) -> None:
    query = "Shall I book it?"
    assert answered(query, words, "Good.") == "ask"
    again = BARE.observe([-9.0, 0.0]).observe([0.0, 0.0]).observe([-0.1, 0.0])
    turns = [Turn("", "Tea!"), Turn(query, words), Turn("", "Now tea, please.")]
    assert advice(Stand(again, turns)) == "act"
    against = BARE.observe([-9.0, 0.0]).observe([0.0, 0.0]).observe([0.1, 0.0])
    leave = [*turns[:2], Turn("Shall I book it now?", "Yes.")]
    assert advice(Stand(against, turns)) == "ask"
    assert advice(Stand(against, leave)) == "act"
    confirmed = BARE.observe([-9.0, 0.0]).observe([0.0, 0.0]).pin(TEA).observe([0.0, 0.0])
    assert advice(Stand(confirmed, turns)) == "act"


@pytest.mark.parametrize(
    "words",
    [
        "Yes.",
        "y",
        "yeah, i need one ticket",
        "Sure!",
        "OK",
        "Okay, go ahead.",
        "Sounds good.",
        "Great, thanks!",
        "Yes, that would be fine. I'll need two, please.",
        "Please book it.",
        "Book it!",
        "Book the one for Friday.",
        "\U0001f44d",
        "Fine, do it.",
        "Alright then",
        "Works for me.",
        "Let's do it!",
        "\u2705",
        "Yes, please do that.",
        "Yes, 120 euros.",
        "Yes, thank you so much!",
        "Sure, go ahead and book it for me.",
        "Yep, that's right. Thanks a lot",
    ],
)
def test_a_yes_gives_leave(words: str) -> None:
    assert answered("It costs 120 euros. Shall I book it?", words) == "act"


@pytest.mark.parametrize(
    ("query", "leave"),
    [
        ("Should I go ahead and book it?", True),
        ("Shall the walnut tree go?", True),
        ("Do you want me to book it? It costs 120 euros.", True),
        ("For 120 euros, would you like me to book it?", True),
        ("120 euros. Is that ok?", True),
        ("Is that all right with you?", True),
        ("Do you confirm?", True),
        ("Ready to order?", True),
        ("I'll book it, OK?", True),
        ("Book it?", True),
        ("shall i book it", True),
        ("Does that work for you?", True),
        ("Would Monday suit you?", True),
        ("Please confirm: 120 euros.", True),
        ("Can you confirm your address?", False),
        ("Which day?", False),
        ("Shall I book it? And for which day?", False),
        ("What should I do next?", False),
        ("Can I help you with anything else?", False),
        ("May I have your name?", False),
        ("Do you have a time in mind?", False),
        ("I shall book it.", False),
        ("", False),
    ],
)
def test_other_questions_need_no_yes(query: str, leave: bool) -> None:
    assert answered(query, "Too expensive.") == ("ask" if leave else "act")


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ("Shall I cancel the reservation?", "Yes."),
        ("Shall I leave it then?", "Yes."),
        ("Shall I order coffee instead?", "Yes."),
        ("Shall I book it, or would you rather wait?", "Yes."),
        ("Do you mind if I book it now?", "Yes."),
        ("Would you mind waiting?", "Of course."),
        ("That is 1.50 euros, to be paid now. Okay for you?", "That's a lot."),
    ],
)
def test_a_yes_to_a_question_whether_not_to_gives_no_leave(query: str, words: str) -> None:
    assert answered(query, words) == "ask"


def test_a_yes_to_are_you_sure_takes_no_refusal_back() -> None:
    stand = BARE.observe([-9.0, 0.0])
    turns = [Turn("", "Tea!"), Turn("Shall I book it?", "No."), Turn("Are you sure?", "Yes.")]
    assert advice(Stand(stand.observe([0.0, 0.0]).observe([0.0, 0.0]), turns)) == "ask"


@pytest.mark.parametrize("words", ["That would be great.", "I'd love that!", "Mhm."])
def test_more_ways_to_say_yes(words: str) -> None:
    assert answered("Shall I book it?", words) == "act"


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
    for wrong in (tracker.belief, None, "act", replace):
        with pytest.raises(InvalidInputError, match="of a GoalTracker"):
            advice(wrong)  # pyright: ignore[reportArgumentType]


def test_who_wants_a_thing_ended_may_say_cancel_of_it() -> None:
    end = Goal("end my phone contract")
    sure = Belief.uniform([UNSPECIFIED, end]).observe([-9.0, 0.0])
    for words in ("Please cancel my contract.", "I'd like to cancel my old phone contract now."):
        assert advised(Stand(sure, said(words))) == ("act", "It has 100%.")
        assert retracts(words, TEA)
    asked = [Turn("Shall I end your contract?", "Yes, please cancel my contract.")]
    assert advised(Stand(sure, asked)).advice == "act"


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        ("end my contract", "Cancel that."),
        ("end my contract", "Cancel the order."),
        ("end my contract", "cancel the termination"),
        ("delete my account", "Please cancel my account deletion."),
        ("delete my account", "I want to cancel the deletion of my account"),
        ("close the bank account", "cancel the closing of my account"),
        ("book a hotel close to the beach", "Cancel my booking, please"),
        ("book a table at the end of May", "Cancel the table"),
        ("remove a user from the plan", "Cancel my change"),
    ],
)
def test_to_cancel_anything_else_takes_it_back(goal: str, words: str) -> None:
    belief = Belief.uniform([UNSPECIFIED, Goal(goal)]).observe([-9.0, 0.0]).observe([-9.0, 0.0])
    assert retracts(words, Goal(goal))
    assert advised(Stand(belief, said("Do it.", words))).advice == "ask"


def test_advice_has_its_reason() -> None:
    sure = BARE.observe([-9.0, 0.0])
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
            sure, [Turn("Shall I make tea?", "Hm.")]
        ),
        "The newest words deny, ask or suppose something, or ask for the opposite.": Stand(
            sure, said("No tea.")
        ),
        "Without the words that deny, ask, suppose or were taken back it has only 50%.": Stand(
            sure.observe([0.0, 0.0]), said("No tea.", "Good.")
        ),
        "The newest words take something back.": Stand(
            BARE.observe([0.0, 0.0]).observe([0.0, 0.0]), said("Tea!", "Stop!")
        ),
    }
    assert [advised(each).because for each in stands.values()] == [*stands]
    made = advised(Stand(sure, said("Tea!")), proposed={TEA: 1})
    assert made == ("ask", "Later words must speak for it first.")
