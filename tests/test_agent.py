"""Algorithm 1, round by round, on a room with a lamp."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from fakes import LampRoom, RefusesAll, WordModel, said
from goalscope.agent import ASKED_FOR, NO_ANSWER, NOTHING_DONE, Agent, run_episode
from goalscope.calibration import LAST_TURN, USUAL
from goalscope.dialog import FALLBACK, ConsoleHuman, ScriptedHuman, ask, question_of
from goalscope.policy import Planner, Want
from goalscope.prompts import recent
from goalscope.types import (
    UNSPECIFIED,
    Action,
    ConflictError,
    Goal,
    GoalChange,
    GoalscopeError,
    InvalidInputError,
    Profile,
    StepResult,
    Turn,
)
from shops import shop

REPLIES = {
    "name what the human may want": "- have lamp light\n- have lamp light\n- sleep without light",
    "lists of what is needed": "- lamp\n- book",
    "short question": "Is it bright enough?",
}
RANKS = {"the most likely": '"2"', "the least likely": '"1"'}
SLEEPER = Profile("sleeper", "likes light", ("lamp light please",))


class Obeys(LampRoom):
    """Whoever has named the one lamp wants it switched on."""

    def __init__(self, offers=("lamp",), asked: str = "broken") -> None:
        super().__init__(offers)
        self.asked = asked

    def requests(self, turns):
        named = any(self.asked in turn.utterance for turn in turns) and self.asked not in self.on
        return [Action("switch on", self.asked)] if named else []


def test_golden_episode() -> None:
    env = LampRoom()
    agent = Agent(env, WordModel(REPLIES))
    rounds = list(run_episode(agent, ScriptedHuman(SLEEPER, env)))
    assert [round.turn.utterance for round in rounds] == ["lamp light please", "Good night"]
    assert [(c.kind, c.goal.text) for c in rounds[0].changes] == [
        ("added", "have lamp light"),
        ("added", "sleep without light"),
    ]
    first = rounds[0].belief
    assert first is not None
    assert first.top(1)[0][0] == Goal("have lamp light")
    assert [result.action for result in rounds[0].results] == [
        Action("search inventory", "lamp"),
        Action("switch on", "lamp"),
    ]
    assert rounds[-1].terminated
    assert rounds[-1].status == "On: lamp."


def test_nothing_is_done_while_no_goal_is_known() -> None:
    env = LampRoom()
    agent = Agent(env, WordModel({**REPLIES, "name what the human may want": ""}))
    round = agent.step("What now?", "lamp light please")
    assert round.belief is not None
    assert round.belief.goals == (UNSPECIFIED,)
    assert round.results == ()
    assert env.on == []


def test_what_is_asked_for_outright_is_done_even_where_no_goal_is_known() -> None:
    env = Obeys(["lamp"], asked="lamp")
    agent = Agent(env, WordModel({**REPLIES, "name what the human may want": ""}))
    assert agent.step("What now?", "the lamp please").belief.goals == (UNSPECIFIED,)
    assert env.on == ["lamp"]


@pytest.mark.parametrize("method", ["good", "no-inference"])
@pytest.mark.parametrize("found", [True, False])
def test_words_that_no_goal_explains_are_told_of_if_none_is_found(method, found) -> None:
    none = {} if found else {"name what the human may want": ""}
    agent = Agent(LampRoom(), WordModel({**REPLIES, **RANKS, **none}), method=method)
    round = agent.step("What now?", "lamp light please")
    assert any("no better ones were found" in note for note in round.notes) != found
    asked = agent.step("What now?", "lamp light: which lamps are on?")
    assert asked.notes == ()  # none was looked for


@pytest.mark.parametrize("method", ["good", "no-goals", "no-inference"])
def test_resumed_agent_goes_on_where_it_was(method) -> None:
    replies = {**REPLIES, **RANKS}
    env = LampRoom()
    first = Agent(env, WordModel(replies), method=method)
    rounds = [first.step("What now?", "lamp light please")]
    second = Agent(other := LampRoom(), WordModel(replies), method=method)
    second.resume(rounds)
    assert other.status() == env.status()
    a, b = (agent.step("And now?", "more light please") for agent in (first, second))
    assert a.results == b.results
    if a.belief is not None and b.belief is not None:
        assert a.belief.probability == pytest.approx(b.belief.probability)


def test_error_in_a_round_leaves_everything_as_it_was() -> None:
    env = LampRoom()
    agent = Agent(env, WordModel(REPLIES))
    agent.step("What now?", "lamp light please")
    state, belief = env.status(), agent.tracker and agent.tracker.belief
    with pytest.raises(InvalidInputError):
        agent.step("And?", "word " * 5000)
    assert env.status() == state
    assert agent.tracker is not None
    assert agent.tracker.belief is belief
    assert len(agent.rounds) == 1


def test_no_goals_acts_on_the_words_alone() -> None:
    env = LampRoom()
    round = Agent(env, WordModel(REPLIES), method="no-goals").step("What?", "lamp light please")
    assert round.belief is None
    assert env.on == ["lamp"]


def test_nothing_unasked_is_done_when_the_person_ends_the_task() -> None:
    env = LampRoom(["lamp", "night"])
    agent = Agent(env, WordModel(REPLIES), method="no-goals")
    assert agent.step("What?", "lamp light and a night please").results
    env.reset()
    assert agent.step("What?", "Good night").terminated
    assert env.on == []


def test_episode_is_truncated_at_the_cap() -> None:
    env = LampRoom()
    human = ConsoleHuman(lambda query: "more lamp light")
    rounds = list(run_episode(Agent(env, WordModel(REPLIES)), human, max_rounds=3))
    assert len(rounds) == 3
    assert not rounds[-1].terminated


def test_ended_episode_has_no_further_round() -> None:
    env = LampRoom()
    rounds = list(run_episode(Agent(env, WordModel(REPLIES)), ScriptedHuman(SLEEPER, env)))
    other = Agent(LampRoom(), WordModel(REPLIES))
    other.resume(rounds)
    assert list(run_episode(other, ScriptedHuman(SLEEPER, env))) == []


def test_changed_world_cannot_be_resumed() -> None:
    env = LampRoom()
    agent = Agent(env, WordModel(REPLIES))
    round = agent.step("What?", "lamp light please")
    other = LampRoom()
    other.step = lambda action: StepResult(action, False, "The lamp is gone.")
    with pytest.raises(GoalscopeError, match="cannot be done again"):
        Agent(other, WordModel(REPLIES)).resume([round])


@pytest.mark.parametrize("final", [True, False])
def test_removed_goals_come_back_unless_that_was_for_good(final: bool) -> None:
    agent = Agent(LampRoom(), WordModel(REPLIES))
    lamp = Goal("have lamp light")
    first = agent.step("What?", "lamp light please")
    assert agent.tracker is not None
    agent.tracker.drop([lamp])
    changes = (*first.changes, GoalChange("removed", lamp, "no", final))
    agent.rounds[0] = replace(first, changes=changes)
    agent.step("What?", "have lamp please")
    assert (lamp in agent.tracker.belief.goals) != final


@pytest.mark.parametrize("refused", [False, True])
def test_a_goal_that_was_unlikely_comes_back_with_the_words_for_it(refused) -> None:
    sleep = Goal("sleep without light")
    model = RefusesAll(REPLIES) if refused else WordModel(REPLIES)
    agent = Agent(LampRoom(), model, patience=9 if refused else 0)
    first = agent.step("What?", "lamp light please")
    (gone,) = (change for change in first.changes if change.kind == "removed")
    assert (gone.goal, gone.final) == (sleep, refused)
    agent.model = WordModel({"name what the human may want": "- sleep without light"})
    second = agent.step("And?", "sleep without sleep without sleep")
    added = [change for change in second.changes if change.kind == "added"]
    assert [change.goal for change in added] == ([] if refused else [sleep])
    assert all("after it had been removed" in change.reason for change in added)
    assert agent.tracker is not None
    assert (sleep in agent.tracker.belief.goals) != refused


def test_long_turns_leave_room_in_every_prompt() -> None:
    model = WordModel(REPLIES, context_size=900)
    agent = Agent(LampRoom(), model)
    for _ in range(3):
        agent.step(agent.ask(), "lamp light " * 150)
    assert agent.ask()
    turns = [Turn("a b", f"{n} " * 100) for n in range(9)]
    assert recent(model, turns, 8) == turns[-4:]
    (cut,) = recent(model, [Turn("", "word " * 5000)], 8)
    assert 300 < len(cut.utterance.split()) < 450


@pytest.mark.parametrize(("method", "used"), [("good", USUAL), ("no-inference", LAST_TURN)])
def test_a_calibration_is_the_role_plays_and_not_the_rankings(method, used) -> None:
    replies = {**REPLIES, **RANKS}
    agent = Agent(LampRoom(), WordModel(replies), method=method, calibration=USUAL)
    round = agent.step("What?", "lamp light please")
    assert round.belief is not None
    assert round.belief.calibration == used


def test_a_yes_to_another_state_than_the_present_one_is_refused_before_anything_is_done() -> None:
    env = LampRoom()
    agent = Agent(env, WordModel(REPLIES), confirm=True)
    shown = agent.step("What?", "lamp light please").state
    env.step(Action("smash", "vase"))
    before, belief = env.fingerprint(), agent.tracker and agent.tracker.belief
    with pytest.raises(ConflictError, match="no longer"):
        agent.step("May I smash the lamp?", "yes", confirmed=shown)
    assert (env.fingerprint(), len(agent.rounds)) == (before, 1)
    assert agent.tracker is not None
    assert agent.tracker.belief is belief
    env.smashed.clear()
    assert agent.step("May I smash the lamp?", "yes", confirmed=shown).number == 2


def test_unknown_method_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="no-goals"):
        Agent(LampRoom(), WordModel(), method="best")  # pyright: ignore[reportArgumentType]


def test_failed_plan_is_undone_and_made_anew_without_the_failed_action() -> None:
    env = LampRoom(["lamp", "broken"])
    env.on.append("candle")
    history = [StepResult(Action("switch on", "candle"), True, "It is on.")]
    planner = Planner(WordModel())
    outcome = planner.act(env, [Want("lamp broken", 1.0)], said("hello"), history)
    assert outcome.replans == 1
    assert env.on == ["candle", "lamp"]


def test_plan_that_stays_impossible_ends_in_the_state_before_it() -> None:
    env = LampRoom(["broken"])
    planner = Planner(WordModel(), replans=0)
    outcome = planner.act(env, [Want("broken", 1.0)], said("hello"), [])
    assert outcome.results == ()
    assert env.on == []


def test_not_all_goals_are_removed() -> None:
    agent = Agent(LampRoom(), RefusesAll(REPLIES))
    round = agent.step("What now?", "lamp light please")
    assert round.belief is not None
    assert [goal.text for goal in round.belief.goals] == ["Unspecified", "have lamp light"]
    assert [c.goal.text for c in round.changes if c.kind == "removed"] == ["sleep without light"]


def test_question_is_answered_before_the_next_is_asked() -> None:
    env = LampRoom()
    query = ask(WordModel(REPLIES), env, [Turn("Yes?", "Which lamps are on?")])
    assert query == "On: nothing.\nIs it bright enough?"


def test_question_among_other_words_is_answered() -> None:
    turn = Turn("Yes?", "It is dark. Which lamps are on? I am tired.")
    assert ask(WordModel(REPLIES), LampRoom(), [turn]).startswith("On: nothing.")


def test_nothing_is_done_for_a_mere_question() -> None:
    env = LampRoom()
    agent = Agent(env, WordModel(REPLIES))
    assert agent.step("What?", "lamp light: which lamps are on?").results == ()
    assert agent.step("What?", "lamp light please").results != ()


@pytest.mark.parametrize("remark", ["Why?", "I never asked for light.", "Thanks, that's all."])
def test_nothing_is_guessed_and_no_goal_proposed_for_a_remark(remark: str) -> None:
    env = LampRoom(["lamp", "light", "lights"])
    agent = Agent(env, WordModel(REPLIES), planner=Planner(WordModel(REPLIES), limit=1))
    agent.step("What now?", "lamp light please")
    assert agent.step("And now?", "more light please").results
    before, goals = list(env.on), agent.rounds[-1].belief.goals
    round = agent.step("And now?", remark)
    assert env.on == before
    assert round.results == ()
    assert round.belief.goals == goals
    assert any("have lamp light (" in note for note in round.notes) == (remark == "Why?")


def test_a_remark_is_followed_by_the_plainest_question_and_leave_by_how_to_end() -> None:
    agent = Agent(LampRoom(), WordModel(REPLIES))
    agent.step("What now?", "lamp light please")
    assert agent.ask() == "Is it bright enough?"
    round = agent.step(agent.ask(), "Thanks, that's all.")
    assert agent.ask() == FALLBACK
    assert 'If that is all, say "Good night".' in round.notes
    again = agent.step(agent.ask(), "Yes.")
    assert again.notes == ('If that is all, say "Good night".',)
    assert not again.terminated


def test_an_order_that_was_followed_is_not_asked_about_and_gives_no_goal_beside_others() -> None:
    class Switchboard(LampRoom):
        def requests(self, turns: Sequence[Turn]) -> list[Action]:
            return self.actions(self.mentioned([turns[-1].utterance]))

    agent = Agent(Switchboard(["lamp", "fan"]), WordModel(REPLIES))
    agent.step(agent.ask(), "just some lamp light, please")
    goals = agent.tracker.belief.goals
    assert len(goals) > 1
    agent.goals.model = WordModel({"name what the human may want": "- fly with kings\n- fly far"})
    agent.step(agent.ask(), "just the fan, to fly with kings")
    assert agent.ask() == FALLBACK
    assert agent.tracker.belief.goals == goals
    agent.step(agent.ask(), "just a carpet to fly")
    assert agent.ask() == "Is it bright enough?"
    agent.step(agent.ask(), "Let us fly far with kings.")
    assert agent.tracker.belief.goals != goals


def test_a_question_about_the_person_is_not_put_to_them() -> None:
    model = WordModel({**REPLIES, "short question": "Which lamp does the human want?"})
    assert ask(model, LampRoom(), [Turn("Hello?", "It is dark.")]) == FALLBACK


def test_a_question_that_echoes_the_person_is_not_asked() -> None:
    turns = [Turn("Hello?", "Well, is it bright? Is it enough?")]
    assert ask(WordModel(REPLIES), LampRoom(), turns) == FALLBACK


def test_the_persons_question_is_answered_by_what_was_not_taken_back() -> None:
    agent = Agent(shop(), WordModel(REPLIES))
    for words in ("We're vegan", "undo that", "Which allergies do you know about?"):
        agent.step(agent.ask(), words)
    assert agent.ask().startswith("I heard of no allergy.")


def test_a_question_behind_other_words_that_is_answered_is_not_told_to_be_without_answer() -> None:
    agent = Agent(shop(), WordModel(REPLIES))
    round = agent.step(agent.ask(), "Keep it under $60. How much of my budget is left?")
    assert NO_ANSWER not in round.notes
    assert "$60.00" in agent.ask()


def test_a_question_about_what_the_examples_speak_of_is_not_asked() -> None:
    model = WordModel({**REPLIES, "short question": "How much sun does your garden get?"})
    assert ask(model, LampRoom(), [Turn("Hello?", "It is dark.")]) == FALLBACK
    model = WordModel({**REPLIES, "short question": "Which roses shall have light?"})
    assert ask(model, LampRoom(), [Turn("Hello?", "It is dark.")]) == FALLBACK
    turns = [Turn("Hello?", "My roses need light.")]
    assert ask(model, LampRoom(), turns) == "Which roses shall have light?"


def test_failures_beyond_the_third_are_counted() -> None:
    env = LampRoom()
    agent = Agent(env, WordModel(REPLIES), planner=Planner(WordModel(REPLIES), replans=9))
    env.requests = lambda turns: [Action("switch on", f"{n}") for n in range(5)]
    env.step = lambda action: StepResult(action, False, "No.")
    round = agent.step("What now?", "just do it")
    assert [note for note in round.notes if "could not be done" in note] == [
        "And 2 more could not be done."
    ]
    assert sum(note.startswith("Not done:") for note in round.notes) == 3


def test_goals_are_proposed_for_a_changed_mind_whatever_explains_the_words(monkeypatch) -> None:
    monkeypatch.setattr("goalscope.tracker.incomplete", lambda *_, **__: False)
    agent = Agent(LampRoom(), WordModel(REPLIES))
    assert not agent.step("What now?", "lamp light please").changes
    added = agent.step("And now?", "I changed my mind, lamp light please").changes
    assert {change.kind for change in added} == {"added"}


def test_nothing_is_guessed_for_an_order() -> None:
    env = Obeys(["lamp", "light"], asked="again")
    agent = Agent(env, WordModel(REPLIES), planner=Planner(WordModel(REPLIES), limit=1))
    agent.step("What now?", "just lamp light again please")
    assert env.on == ["again"]
    agent.step("And now?", "lamp light please")
    assert env.on != ["again"]


def test_what_a_remark_asks_for_outright_is_done() -> None:
    env = Obeys(asked="again")
    agent = Agent(env, WordModel(REPLIES))
    agent.step("What now?", "lamp light please")
    agent.step("And now?", "Thanks again!")
    assert "again" in env.on


def test_what_was_asked_for_and_not_done_is_told() -> None:
    agent = Agent(LampRoom(), WordModel(REPLIES))
    told = "There is no nightlamp here."
    assert told not in agent.step("What?", "lamp light: is the nightlamp on?").notes
    assert told in agent.step("What?", "lamp light, and the nightlamp please").notes
    assert told not in agent.step("What?", "Good night").notes


def test_where_nothing_was_done_and_nothing_is_told_that_is_told() -> None:
    assert NOTHING_DONE not in Agent(LampRoom(), WordModel(REPLIES)).step("", "lamp light").notes
    agent = Agent(LampRoom([]), WordModel(REPLIES))
    round = agent.step("What?", "more light please")
    assert (round.results, round.notes) == ((), (NOTHING_DONE,))
    for words in ("Thanks!", "just that", "Which is on?"):
        assert agent.step("What?", words).notes == ()
    agent = Agent(LampRoom([]), WordModel(REPLIES), method="no-goals")
    for words in ("Do you like me?", "where did you put it", "Thanks. What for?"):
        assert agent.step("What?", words).notes == (NO_ANSWER,)
    assert agent.step("What?", "Could you dance?").notes == (NOTHING_DONE,)
    assert agent.step("What?", "No bright light, please").notes == ()


@pytest.mark.parametrize(
    ("answer", "guessed"), [("yes", []), ("No, leave it.", []), ("lamp light!", ["lamp"])]
)
def test_nothing_is_guessed_for_a_yes_or_no_to_the_own_question(
    answer: str, guessed: list[str]
) -> None:
    class Breaks(LampRoom):
        def requests(self, turns):
            asked = "vase" in turns[0].utterance and "vase" not in self.smashed
            return [Action("smash", "vase")] if asked else []

    env = Breaks()
    agent = Agent(env, WordModel(REPLIES))
    first = agent.step("What now?", "just break the vase by the lamp light")
    assert (first.question, env.on) == ("May I smash the vase?", [])
    agent.step(agent.ask(), answer)
    assert env.on == guessed
    assert env.smashed == (["vase"] if answer == "yes" else [])


def test_what_nobody_asked_for_is_told_to_be_a_guess() -> None:
    guess = "Guessed, not asked for: lamp."
    assert guess in Agent(LampRoom(), WordModel(REPLIES)).step("What?", "lamp light please").notes
    agent = Agent(Obeys(asked="lamp"), WordModel(REPLIES))
    round = agent.step("What?", "lamp light please")
    assert [str(result.action) for result in round.results] == ["switch on: lamp"]
    assert guess not in round.notes


def test_why_is_answered_by_the_goals_only_where_something_was_guessed() -> None:
    agent = Agent(Obeys(asked="again"), WordModel(REPLIES), planner=Planner(WordModel(REPLIES)))
    why = "Why did you do that?"
    assert ASKED_FOR not in agent.step("What?", why).notes
    agent.step("What?", "just lamp light again please")
    assert ASKED_FOR in agent.step("What?", why).notes
    assert ASKED_FOR in agent.step("What?", "Why did you switch on the light?").notes
    agent.step("What?", "lamp light please")
    (note,) = [n for n in agent.step("What?", why).notes if "I take you to want" in n]
    assert "have lamp light" in note
    assert ASKED_FOR not in agent.step("What?", "Why did you switch on the light?").notes


def test_a_failure_is_told_once_and_again_when_it_is_asked_for_again() -> None:
    agent = Agent(Obeys(), WordModel(REPLIES))
    told = "Not done: switch on: broken. The switch does not move."
    assert told in agent.step("What?", "the broken lamp please").notes
    assert told not in agent.step("What?", "lamp light please").notes
    assert told in agent.step("What?", "the broken lamp, I said").notes


def test_question_is_never_asked_twice() -> None:
    turns = [Turn("Fine. Is it bright enough?", "no")]
    assert ask(WordModel(REPLIES), LampRoom(), turns) == "What else would you like?"


@pytest.mark.parametrize(
    ("text", "question"),
    [
        ('"Is it on?" she said.', "Is it on?"),
        ("Good. Which one?", "Which one?"),
        ("no question", "no question"),
    ],
)
def test_question_of(text: str, question: str) -> None:
    assert question_of(text) == question


def test_console_asks_again_until_the_words_can_be_used() -> None:
    said = iter(["", "\ud83c", "soup"])
    shown: list[str] = []
    human = ConsoleHuman(lambda query: (shown.append(query), next(said))[1])
    assert human.reply("Yes?", [], "") == "soup"
    assert "empty" in shown[1]
    assert "surrogate" in shown[2]
