"""What waits for a yes, what a yes releases, and what undo takes back, in a room with a lamp."""

from dataclasses import replace
from pathlib import Path

import pytest

from fakes import LampRoom, WordModel
from goalscope.agent.executor import IDLE, NOT_CONFIRMED, NOTHING, STAYS, UNANSWERED
from goalscope.agent.guards import CONFIRM, HARM, SAY_YES, agrees
from goalscope.base.text import plain
from goalscope.base.types import (
    Action,
    ConflictError,
)
from goalscope.envs import Resolution
from goalscope.language.orders import Order
from lamps import REPLIES, ROOM, agent_in

CORPUS = Path(__file__).parents[1] / "corpus" / "yes"
BUY = [Order("buy")]


def test_what_lasts_waits_for_a_yes_to_exactly_that_question_in_that_state() -> None:
    env = LampRoom(["vase", "lamp"])
    agent = agent_in(env)
    round = agent.step("", "smash vase")
    assert (env.smashed, round.pending) == ([], (Order("smash", "vase"),))
    assert round.question == f'I understood "smash vase". {CONFIRM}'
    assert agent.ask() == round.question
    again = agent.step(agent.ask(), "yes; switch on lamp")  # another state than the one shown
    assert (env.smashed, env.on, again.pending) == ([], ["lamp"], ())
    assert NOT_CONFIRMED.format("you said something else", "smash vase") in again.notes
    agent.step("", "smash vase")
    declined = agent.step(agent.ask(), "no")
    assert declined.notes == (NOT_CONFIRMED.format("you said no", "smash vase"),)
    assert env.smashed == []
    assert agent.step(agent.ask(), "yes").results == ()
    agent.step("", "smash vase")
    confirmed = agent.step(agent.ask(), "yes")
    assert (env.smashed, confirmed.released) == (["vase"], (Order("smash", "vase"),))
    assert "As you confirmed: smash: vase. It is in pieces." in confirmed.notes


@pytest.mark.parametrize("words", ["none", "ask lamp", "smash vase", "rather not", "ok?", "maybe"])
def test_what_is_neither_a_yes_nor_a_no_leaves_the_question_open(words: str) -> None:
    env = LampRoom(["vase", "lamp"])
    reads = {"rather not": "yes", "ok?": "yes", "maybe": "yes | if maybe\nnone"}
    agent = agent_in(env, model=WordModel(REPLIES, reads=reads))
    asked = agent.step("", "smash vase")
    kept = agent.step(agent.ask(), words)
    assert (kept.question, kept.awaits, kept.pending, kept.listed) == (
        asked.question, "word", asked.pending, asked.listed
    )  # fmt: skip
    assert (UNANSWERED.format("smash vase") in kept.notes) == (words != "ask lamp")
    assert (env.smashed, env.on) == ([], [])
    assert agent.ask().endswith(asked.question)
    agent.step(agent.ask(), "yes")
    assert env.smashed == ["vase"]


@pytest.mark.parametrize("words", ["no", "no; yes", "none; switch on lamp", "aim light"])
def test_a_no_or_another_wish_drops_what_waits_and_says_why(words: str) -> None:
    env = LampRoom(["vase", "lamp"])
    agent = agent_in(env)
    agent.step("", "smash vase")
    dropped = agent.step(agent.ask(), words)
    why = "you said no" if "no" in words.split("; ") else "you said something else"
    assert NOT_CONFIRMED.format(why, "smash vase") in dropped.notes
    assert (env.smashed, dropped.pending) == ([], ())
    agent.step(agent.ask(), "yes")
    assert env.smashed == []


YESES = (
    "yes please", "Sure.", "yep", "OK", "ok do it", "Go ahead!", "Yes, smash it.", "yes, the vase",
    "Okay, thanks", "Yes - smash the vase now, please", "**Sure**",
    "\u201cYes!\u201d I said yes", "That's right, do that", "\N{THUMBS UP SIGN}", "yes :)",
)  # fmt: skip


@pytest.mark.parametrize("words", YESES)
def test_words_of_agreement_that_were_read_as_a_yes_confirm_what_lasts(words: str) -> None:
    for order in ("yes", "yes\nsmash vase", "smash vase"):
        env = LampRoom(["vase", "lamp"])
        agent = agent_in(env, model=WordModel(REPLIES, reads={plain(words): order}))
        agent.step("", "smash vase")
        agent.step(agent.ask(), words)
        assert env.smashed == ["vase"]


@pytest.mark.parametrize(
    "words",
    [
        "please", "thanks", "smash the vase", "right", "it", "now", "the vase please",
        "yes?", "sure it is", "sure it is?", "yes no", "ok, but later", "not ok", "okay-ish",
        "yes if it is ugly", "yes but not the vase", "I don't think so", "yes \N{THUMBS DOWN SIGN}",
        "do not do it", "sure, go ahead and", "yes/no", "you sure", "I'm fine", "yes to the lamp",
        "yes the lamp", "yes tomorrow", "ye\u0301s", "hmm", "maybe", "yes, smash the vase and go",
        "oui", "", "!", "yes, vase smash lamp", "ok not", "n\u200bo yes", "yes, one of them",
    ],
)  # fmt: skip
def test_nothing_else_confirms_what_lasts_however_it_is_read(words: str) -> None:
    assert not agrees(words, [Order("smash", "vase")], [Action("smash", "vase")])


def replies(name: str) -> list[str]:
    return (CORPUS / name).read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("name", ["dev_no.txt", "test_no.txt"])
def test_of_replies_that_do_not_agree_none_is_taken_for_a_yes(name: str) -> None:
    told = replies(name)
    assert len(told) >= 40
    assert [each for each in told if agrees(each, BUY, [])] == []


def test_most_replies_that_agree_are_taken_for_a_yes(figure) -> None:
    taken = {}
    for name in ("test_yes.txt", "dev_yes.txt"):
        told = replies(name)
        taken[name] = sum(agrees(each, BUY, []) for each in told) / len(told)
    figure(", ".join(f"{share:.1%} of {name}" for name, share in taken.items()))
    assert taken["test_yes.txt"] > 0.9


def test_of_several_things_a_yes_names_none() -> None:
    orders = [Order("smash", "vase"), Order("smash", "bowl")]
    listed = [Action("smash", "vase"), Action("smash", "bowl")]
    assert agrees("yes please", orders, listed)
    assert not agrees("yes, the vase", orders, listed)
    assert not agrees("yes, smash", orders, listed)
    dishes = [Order("smash", "dishes")]
    assert not agrees("yes, the vase", dishes, listed)
    assert not agrees("yes, the dishes", dishes, listed)  # they have other names here
    assert agrees("yes, smash them", dishes, listed)
    assert agrees("yes, buy the basket", [Order("buy")], [Action("buy basket")])
    assert agrees("Yes, buy it.", [Order("buy")], [Action("buy basket")])


def test_a_yes_does_what_the_question_listed_and_nothing_else() -> None:
    class Fickle(LampRoom):
        meant = ("vase",)

        def resolve(self, order, dialogue, pick):
            return Resolution(tuple(Action("smash", each) for each in self.meant))

    env = Fickle(["vase", "bowl"])
    agent = agent_in(env)
    round = agent.step("", "smash pot")
    assert round.question == f'I understood "smash pot" (vase). {CONFIRM}'
    env.meant = ("vase", "bowl")
    round = agent.step(agent.ask(), "yes")
    assert (env.smashed, round.question) == (
        [], f'I understood "smash pot" (vase, bowl). {CONFIRM}'
    )  # fmt: skip
    agent.step(agent.ask(), "yes")
    assert env.smashed == ["vase", "bowl"]


def test_no_reading_but_the_word_itself_or_a_card_confirms_what_lasts() -> None:
    env = LampRoom(["vase", "bowl"])
    agent = agent_in(env, model=WordModel(REPLIES, reads={"rather not": "yes", "YES!": "none"}))
    agent.step("", "smash vase")
    agent.step(agent.ask(), "rather not")
    agent.step("", "smash vase")
    agent.step(agent.ask(), "smash vase")
    assert env.smashed == []
    agent.step(agent.ask(), "YES!")
    state = agent.step("", "smash bowl").state
    agent.step(agent.ask(), "none", confirmed=state)
    assert env.smashed == ["vase", "bowl"]


@pytest.mark.parametrize(
    ("before", "order"),
    [
        ("none", "smash vase | if it is ugly"),
        ("avoid vase | why allergy", "smash vase"),
        ("none", "smash vase"),
    ],
)
def test_what_lasts_waits_for_the_word_whatever_else_it_waits_for(before: str, order: str) -> None:
    env = LampRoom(["vase"])
    model = WordModel(REPLIES, reads={"rather not": "yes"})
    agent = agent_in(env, model=model)
    agent.step("", before)
    model.margins = (0.01,)
    asked = agent.step("", order)
    assert asked.question.endswith(SAY_YES)
    for words in ("rather not", order):
        agent.step(asked.question, words)
        assert env.smashed == []
    asked = agent.rounds[-1] if agent.rounds[-1].pending else agent.step("", order)
    agent.step(asked.question, "Yes.")
    assert env.smashed == ["vase"]


@pytest.mark.parametrize(
    ("said", "order", "awaits"),
    [("", "smash vase", "word"), ("", "switch on lamp | if it is dark", "yes"),
     ("", "switch on lamp", ""), ("he gets hives", "switch on lamp", "harm")],
)  # fmt: skip
def test_what_a_question_waits_for_does_not_depend_on_its_wording(said, order, awaits) -> None:
    env = LampRoom(["vase", "lamp"])
    model = WordModel(REPLIES, reads={"he gets hives": order, "hm, so be it": "yes"})
    agent = agent_in(env, model=model)
    round = agent.step("", said or order)
    assert round.awaits == awaits
    agent.rounds[-1] = replace(round, question="Worded otherwise by an older version?")
    agent.step("", "hm, so be it")
    assert env.smashed == []
    assert env.on == (["lamp"] if awaits in ("", "yes") else [])


CONDITION = "switch on lamp | if it is dark"


@pytest.mark.parametrize("answer", ["yes", CONDITION])
def test_a_condition_is_asked_about_and_to_say_the_order_again_is_a_yes(answer: str) -> None:
    env = LampRoom(["lamp"])
    agent = agent_in(env)
    round = agent.step("", CONDITION)
    assert (env.on, 'You said "if it is dark"' in round.question) == ([], True)
    agent.step(agent.ask(), answer)
    assert env.on == ["lamp"]


def test_a_yes_to_another_state_than_the_present_one_is_refused_before_anything_is_done() -> None:
    env = LampRoom(["vase", "lamp"])
    agent = agent_in(env)
    shown = agent.step("What?", "smash vase").state
    env.step(Action("switch on", "lamp"))
    before, belief = env.state().fingerprint, agent.tracker and agent.tracker.belief
    with pytest.raises(ConflictError, match="no longer"):
        agent.step(agent.ask(), "yes", confirmed=shown)
    assert (env.state().fingerprint, len(agent.rounds)) == (before, 1)
    assert agent.tracker is not None
    assert agent.tracker.belief is belief
    assert agent.step("", "yes").results == ()  # by words neither


def test_an_undo_that_was_not_surely_read_waits() -> None:
    env = LampRoom(["lamp"])
    model = WordModel(REPLIES)
    agent = agent_in(env, model=model)
    agent.step("", "switch on lamp")
    model.margins = (0.01,)
    round = agent.step("", "undo")
    assert (env.on, 'I understood "undo". Shall I?' in round.question) == (["lamp"], True)
    assert agent.step(agent.ask(), "yes").retracts == (1,)
    assert env.on == []


def test_what_is_sure_is_done_though_another_order_is_not() -> None:
    env = LampRoom(["lamp", "lantern"])
    model = WordModel(REPLIES)
    model.margins = (0.01, 3.0)
    round = agent_in(env, model=model).step("", "switch on lamp; switch on lantern")
    assert env.on == ["lantern"]
    assert 'I understood "switch on lamp". Shall I?' in round.question


def test_an_allergy_binds_every_order_until_the_person_confirms_the_contrary() -> None:
    env = LampRoom(["lamp", "fan"])
    agent = agent_in(env)
    agent.step("", "avoid fan | for my son | why allergy")
    asked = agent.step("", "switch on fan")
    assert env.on == []
    assert asked.question.startswith('You said "no fan" (my son: allergy).')
    agent.step(agent.ask(), "no")
    agent.step("", "undo")
    assert agent.step("", "switch on fan").pending
    agent.step(agent.ask(), "yes; none")  # only the very word lifts it
    assert env.on == []
    assert agent.step("", "switch on fan").question.endswith(SAY_YES)
    agent.step(agent.ask(), "yes")
    assert env.on == ["fan"]
    agent.step("", "switch off fan; switch on fan")
    assert env.on == ["fan"]


def test_to_be_rid_of_what_harms_needs_no_leave_and_lifts_no_allergy() -> None:
    env = LampRoom(["fan"])
    agent = agent_in(env)
    agent.step("", "avoid fan | why allergy")
    env.on.append("fan")
    assert agent.step("", "switch off fan").pending == ()
    assert env.on == []
    agent.step("", "yes")
    assert agent.step("", "switch on fan").pending
    assert env.on == []


def test_a_word_of_harm_without_an_allergy_in_the_reading_stops_every_order() -> None:
    env = LampRoom(["lamp", "fan"])
    reads = {"lamp, and my son is allergic to fans": "switch on lamp", "to fans": "switch on fans"}
    agent = agent_in(env, model=WordModel(REPLIES, reads=reads))
    round = agent.step("", "lamp, and my son is allergic to fans")
    assert (env.on, round.question) == ([], HARM)
    assert agent.step(agent.ask(), "to fans").pending  # it may be the very thing that harms
    assert env.on == []
    agent.step("", "avoid fan | why allergy")
    agent.step("", "switch on lamp")
    assert env.on == ["lamp"]


def test_what_hints_at_harm_is_asked_about_once() -> None:
    env = LampRoom(["lamp"])
    agent = agent_in(env, model=WordModel(REPLIES, reads={"home from hospital": "switch on lamp"}))
    round = agent.step("", "home from hospital")
    assert (env.on, round.question) == ([], HARM)
    agent.step(agent.ask(), "switch on lamp")
    assert env.on == ["lamp"]


def test_a_yes_in_which_a_word_of_harm_is_said_releases_nothing() -> None:
    env = LampRoom(["fan"])
    reads = {"though his throat swells": "yes"}
    agent = agent_in(env, model=WordModel(REPLIES, reads=reads))
    agent.step("", "avoid fan | why allergy")
    agent.step("", "switch on fan")
    round = agent.step(agent.ask(), "though his throat swells")
    assert (env.on, round.question, round.released) == ([], HARM, ())
    agent.step(agent.ask(), "no")
    assert agent.step("", "switch on fan").pending


def test_an_allergy_to_nothing_is_no_answer_to_a_word_of_harm() -> None:
    env = LampRoom(["lamp"])
    reads = {"lamp, and he gets hives": "switch on lamp; avoid | why allergy"}
    round = agent_in(env, model=WordModel(REPLIES, reads=reads)).step("", "lamp, and he gets hives")
    assert (env.on, round.question) == ([], HARM)


def test_to_leave_a_thing_as_it_then_is_binds_no_order_of_the_same_breath() -> None:
    env = LeavingRoom(["lamp", "fan"])
    agent = agent_in(env)
    agent.step("", "switch on lamp; leave lamp")
    assert env.on == ["lamp"]
    agent.step("", "switch on fan; leave fan | where desk")
    assert env.on == ["lamp", "fan"]
    assert len(agent._executor.dialogue_state(agent.rounds).untouched) == 2


class LeavingRoom(LampRoom):
    """A room in which what is to be left alone is."""

    def resolve(self, order, dialogue, pick):
        if any(each.what == order.what for each in dialogue.untouched):
            return Resolution(why="I leave it alone.")
        return super().resolve(order, dialogue, pick)


def test_what_waits_changes_nothing_of_what_holds() -> None:
    env = LampRoom(["lamp"])
    agent = agent_in(env)
    agent.step("", "leave lamp; avoid lamp | why taste")
    agent.step("", "switch on lamp | if it is dark")
    agent.step("", "no")
    dialogue = agent._executor.dialogue_state(agent.rounds)
    assert (len(dialogue.limits), len(dialogue.untouched), dialogue.asked) == (1, 1, ())


def test_undo_takes_back_the_last_rounds_that_did_something() -> None:
    env = LampRoom(ROOM)
    agent = agent_in(env)
    for words in ("switch on lamp", "switch on fan", "ask fan"):
        agent.step("", words)
    round = agent.step("", "undo")
    assert (env.on, round.retracts, round.reversals) == (["lamp"], (2,), 1)
    assert round.notes == ('Taken back: "switch on fan".',)
    agent.step("", "switch on fan")
    assert agent.step("", "undo | 2").retracts == (5, 1)
    assert env.on == []
    assert agent.step("", "undo").notes == (NOTHING,)


def test_undo_says_that_an_allergy_stays() -> None:
    agent = agent_in(LampRoom(ROOM))
    agent.step("", "switch on lamp; avoid fan | for she | why allergy")
    notes = agent.step("", "undo").notes
    assert notes[-1] == f"{STAYS} avoid fan for her (allergy)."
    assert agent._executor.dialogue_state(agent.rounds).limits


def test_after_an_order_that_came_to_nothing_there_is_nothing_to_undo() -> None:
    env = LampRoom(ROOM)
    agent = agent_in(env)
    for words in ("switch on lamp", "switch on moon"):
        agent.step("", words)
    assert agent.step("", "undo").notes == (IDLE.format("switch on moon"),)
    assert env.on == ["lamp"]
    agent.step("", "switch on moon")
    assert agent.step("", "undo everything").retracts == (1,)
    agent.step("", "switch on lamp")
    agent.step("", "none")
    assert agent.step("", "undo").retracts == (6,)


def test_undo_counts_rounds_that_did_something_and_knows_no_names() -> None:
    env = LampRoom(ROOM)
    agent = agent_in(env)
    for words in ("switch on lamp", "switch on fan", "switch on unicorn"):
        agent.step("", words)
    assert agent.step("", "undo lamp").notes == (NOTHING,)
    assert agent.step("", "undo | 0.5").retracts == (2,)
    assert env.on == ["lamp"]


def test_what_could_not_be_brought_back_is_not_taken_back() -> None:
    env = LampRoom(["lamp"])
    agent = agent_in(env)
    agent.step("", "switch on lamp")
    env.on.clear()
    round = agent.step("", "undo")
    assert (round.retracts, len(round.results)) == ((), 0)
    assert "Not done: " in round.notes[-1]


def test_undo_everything_leaves_what_lasts_and_says_so() -> None:
    env = LampRoom(["vase", "lamp"])
    agent = agent_in(env)
    for words in ("smash vase", "yes", "switch on lamp"):
        agent.step("", words)
    round = agent.step("", "undo everything")
    assert (env.on, env.smashed) == ([], ["vase"])
    assert "The vase stays in pieces." in round.notes
