"""Algorithm 1, round by round, on a room with a lamp."""

from dataclasses import replace

import pytest

from fakes import GOALS, QUESTION, CondemnsAll, LampRoom, WordModel
from goalscope.agent.agent import Agent, run_episode
from goalscope.agent.answers import UNKNOWN
from goalscope.agent.people import (
    AGREES,
    DECLINES,
    FALLBACK,
    OPENING,
    ConsoleHuman,
    ScriptedHuman,
    ask,
)
from goalscope.agent.writer import Writer
from goalscope.base.text import plain
from goalscope.base.types import (
    UNSPECIFIED,
    Action,
    Goal,
    GoalscopeError,
    Profile,
    StepResult,
    Turn,
)
from goalscope.belief.calibration import DEFAULT, PAPER
from goalscope.language.orders import Order, Reading, Verb
from goalscope.prompts import recent
from lamps import RANKS, REPLIES, ROOM, agent_in

SLEEPER = Profile("sleeper", "likes light", ("lamp light please",))


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
    assert [result.action for result in rounds[0].results] == [Action("switch on", "lamp")]
    assert rounds[-1].terminated
    assert rounds[-1].status == "On: lamp."


@pytest.mark.parametrize("method", ["good", "no-inference"])
@pytest.mark.parametrize("found", [True, False])
def test_words_that_no_goal_explains_are_told_of_if_none_is_found(method, found) -> None:
    none = {} if found else {GOALS: ""}
    agent = Agent(LampRoom(), WordModel({**REPLIES, **RANKS, **none}), method=method)
    round = agent.step("What now?", "lamp light please")
    assert any("no better ones were found" in note for note in round.notes) != found
    asked = agent.step("What now?", "ask lamp")
    assert asked.notes == ()  # none was looked for


@pytest.mark.parametrize("method", ["good", "no-goals", "no-inference"])
def test_a_resumed_agent_goes_on_where_it_was_and_reads_nothing_again(method, monkeypatch) -> None:
    model = WordModel({**REPLIES, **RANKS})
    first, second = (Agent(LampRoom(ROOM), model, method=method) for _ in range(2))
    rounds = [first.step("", words) for words in ("avoid fan | why allergy", "lamp light please")]
    with monkeypatch.context() as patch:
        patch.setattr(second.reader, "read", None)
        second.resume(rounds)
    assert second.env.state().text == first.env.state().text == "On: light, lamp."
    a, b = (agent.step("And now?", "switch on fan") for agent in (first, second))
    assert a.pending == b.pending == (Order("switch on", "fan"),)
    assert dict(a.belief.top()) == pytest.approx(dict(b.belief.top()))


def test_no_goals_acts_on_the_words_alone() -> None:
    env = LampRoom()
    round = Agent(env, WordModel(REPLIES), method="no-goals").step("What?", "lamp light please")
    assert round.belief.goals == ()
    assert env.on == ["lamp"]


def test_episode_is_truncated_at_the_cap() -> None:
    env = LampRoom()
    human = ConsoleHuman(lambda query: "more lamp light")
    rounds = list(run_episode(Agent(env, WordModel(REPLIES)), human, max_rounds=3))
    assert len(rounds) == 3
    assert not rounds[-1].terminated


@pytest.mark.parametrize(
    "words",
    [
        "Good night",
        "good night.",
        " Good  night!",
        "*Good night*",
        "**Good night.**",
        "*Good night",
    ],
)
@pytest.mark.parametrize("read", ["none", "ask", "finish", "switch off lamp", "aim"])
def test_the_phrase_that_ends_the_task_ends_it_however_it_is_read(words, read) -> None:
    model = WordModel(REPLIES, reads={words.strip(): read, words: read, "hives": "none"})
    model.margins = (0.01,)
    agent = Agent(LampRoom(["lamp", "vase"]), model)
    agent.step("What now?", "hives")
    agent.step("What now?", "smash vase")
    round = agent.step(agent.ask(), words)
    assert round.terminated
    assert round.reading == Reading((Order("finish"),))


def test_a_domain_without_a_phrase_of_its_own_has_one() -> None:
    class Plain(LampRoom):
        verbs = (*LampRoom.verbs[:-1], Verb("finish", "that is all", (), ends=True))

    for words, ends in (("*That is all*", True), ("That is all.", True), ("That is all?", False)):
        model = WordModel(REPLIES, reads={words: "none"})
        assert Agent(Plain(), model).step("What now?", words).terminated == ends


def test_a_farewell_that_is_read_as_the_end_waits_for_a_yes() -> None:
    reads = {"I am off.": "finish", "yes": "yes"}
    agent = Agent(LampRoom(["lamp"]), WordModel(REPLIES, reads=reads))
    first = agent.step("What now?", "I am off.")
    assert (first.terminated, first.pending) == (False, (Order("finish"),))
    assert agent.step(first.question, "yes").terminated


@pytest.mark.parametrize("words", ["Good night, lamp", "Say good night", "Do not say good night"])
def test_words_around_the_phrase_are_read(words) -> None:
    model = WordModel(REPLIES, reads={words: "none"})
    assert not Agent(LampRoom(), model).step("What now?", words).terminated


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


@pytest.mark.parametrize("refused", [False, True])
def test_a_goal_that_was_unlikely_comes_back_with_the_words_for_it(refused, monkeypatch) -> None:
    monkeypatch.setattr("goalscope.belief.goal_manager.IMPROBABLE", 1.0)
    monkeypatch.setattr("goalscope.belief.goal_manager.FEWEST", 1)
    sleep = Goal("sleep without light")
    model = CondemnsAll(REPLIES) if refused else WordModel(REPLIES)
    agent = Agent(LampRoom(), model, patience=9 if refused else 0)
    first = agent.step("What?", "lamp light please")
    (gone,) = (change for change in first.changes if change.kind == "removed")
    assert (gone.goal, gone.final) == (sleep, refused)
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
        agent.step(agent.ask(), "lamp light " * 130)
    assert agent.ask()
    turns = [Turn("a b", f"{n} " * 100) for n in range(9)]
    assert recent(model, turns, 8) == turns[-4:]
    (cut,) = recent(model, [Turn("", "word " * 5000)], 8)
    assert 300 < len(cut.utterance.split()) < 450


def test_orders_are_followed_where_no_goal_is_known_and_nothing_is_guessed_for_them() -> None:
    env = LampRoom(ROOM)
    agent = agent_in(env, model=WordModel({**REPLIES, GOALS: ""}))
    round = agent.step("What now?", "switch on lamp")
    assert round.belief.goals == (UNSPECIFIED,)
    assert round.reading == Reading((Order("switch on", "lamp"),), -1.0)
    assert (env.on, round.notes) == (["lamp"], ())
    assert agent.ask() == FALLBACK


def test_several_orders_are_followed_in_turn_and_what_is_not_here_is_told() -> None:
    env = LampRoom(ROOM)
    round = agent_in(env).step("", "switch on lamp; switch off lamp; switch on moon; switch on fan")
    assert env.on == ["fan"]
    assert round.notes == ("There is no moon here.",)


def test_what_cannot_be_done_is_told_and_beyond_the_third_counted() -> None:
    env = LampRoom([f"lamp {n}" for n in range(5)])
    env.step = lambda action: StepResult(action, False, "No.")
    round = agent_in(env).step("", "; ".join(f"switch on lamp {n}" for n in range(5)))
    assert round.results == ()
    assert [note.startswith("Not done:") for note in round.notes] == [True] * 3 + [False]
    assert round.notes[-1] == "And 2 more could not be done."


@pytest.mark.parametrize(
    ("words", "read", "goal", "on"),
    [
        ("lamp light, but not the fan", "avoid fan", "have lamp light", ["lamp"]),
        ("lamp light in here", "none", "have lamp light", ["lamp"]),
        ("lamp light in here", "none", "", []),
        ("lamp light in here?", "none", "have lamp light", []),
        ("lamp light, no fan?", "avoid fan", "have lamp light", []),
        ("lamp light in here\uff1f", "none", "have lamp light", []),
        ("lamp light in here?", "aim", "have lamp light", ["lamp"]),
        ("lamp light in here", "yes", "have lamp light", []),
        ("lamp light as of the moon", "switch on moon", "have lamp light", []),
        ("lamp light as of the moon", "ask moon", "have lamp light", []),
        ("lamp light, but not the fan", "switch on fan", "have lamp light", []),
        ("lamp light, it is dark", "switch on lamp | if it is dark", "have lamp light", []),
    ],
)
def test_words_that_ask_for_nothing_are_acted_on_where_a_goal_explains_them(
    words, read, goal, on
) -> None:
    env = LampRoom(["lamp", "fan"])
    model = WordModel({**REPLIES, GOALS: goal}, reads={plain(words): read})
    round = agent_in(env, model=model).step("", words)
    assert round.reading
    assert str(round.reading.orders[0].do) in read
    assert env.on == on
    told = "Because you mentioned it: lamp (to have lamp light)."
    assert (told in round.notes) == (on == ["lamp"])


def test_a_question_is_answered_before_the_next_one_is_asked() -> None:
    reads = {"Is the lamp on?": "ask lamp", "Is the moon on?": "ask moon"}
    agent = agent_in(LampRoom(["lamp"]), model=WordModel(REPLIES, reads=reads))
    agent.step("Yes?", "Is the lamp on?")
    assert agent.ask() == f"On: nothing.\n{FALLBACK}"
    agent.step("Yes?", "Is the moon on?")
    assert agent.ask() == f"{UNKNOWN}\n{FALLBACK}"
    agent.step("Yes?", "aim; ask lamp")
    assert agent.ask().endswith("\nIs it bright enough?")


def test_asked_what_it_thinks_the_agent_tells_its_belief() -> None:
    reads = {"What do you think I want?": "ask | about goal", "How bright is that?": "ask"}
    agent = agent_in(LampRoom(["lamp"]), model=WordModel(REPLIES, reads=reads))
    agent.step("Yes?", "lamp light please")
    agent.step("And?", "What do you think I want?")
    assert ": have lamp light (" in agent.ask()
    assert agent.step("And?", "How bright is that?").notes == ()
    assert agent.ask() == f"On: lamp.\n{FALLBACK}"  # which names no goal to the belief


@pytest.mark.parametrize(
    ("calibration", "words", "weights"),
    [
        (DEFAULT, "yes", ((1, 0.0),)),
        (DEFAULT, "switch on lamp", ((1, 0.5),)),
        (DEFAULT, "ask lamp", ()),
        (PAPER, "yes", ()),
        (PAPER, "switch on lamp", ()),
    ],
)
def test_asides_are_no_evidence_and_orders_half_but_in_the_paper(
    calibration, words, weights
) -> None:
    agent = agent_in(LampRoom(["lamp"]), calibration=calibration)
    before = agent.step("Yes?", "lamp light please").belief
    after = agent.step("And?", words).belief
    assert before
    assert after
    assert after.weights == weights
    kept = dict(before.top()) == pytest.approx(dict(after.top()))
    assert kept is (weights == ((1, 0.0),))


@pytest.mark.parametrize(
    ("method", "words"), [("good", "ask lamp"), ("no-goals", "ask"), ("no-inference", "ask")]
)
def test_who_asks_about_a_thing_or_an_agent_without_a_belief_is_told_none(method, words) -> None:
    model = WordModel({**REPLIES, **RANKS})
    agent = agent_in(LampRoom(["lamp"]), method, model=model)
    agent.step("Yes?", "lamp light please")
    assert not any("what you want" in note for note in agent.step("And?", words).notes)


def test_words_that_the_model_cannot_read_are_told_and_nothing_is_done() -> None:
    env = LampRoom(["lamp"])
    model = WordModel(REPLIES, reads={"gibberish": "switch on the secret lamp"})
    agent = agent_in(env, model=model)
    round = agent.step("", "gibberish")
    assert round.reading is not None
    assert (env.on, round.reading.orders) == ([], (Order("none"),))
    assert any("nobody said" in note for note in round.notes)


def test_goals_are_proposed_anew_for_another_aim_whatever_explains_the_words(monkeypatch) -> None:
    monkeypatch.setattr("goalscope.belief.goal_manager.incomplete", lambda *_, **__: False)
    agent = agent_in(LampRoom())
    assert not agent.step("What now?", "lamp light please").changes
    added = agent.step("And now?", "rather a lamp please").changes
    assert {change.kind for change in added} == {"added"}


def test_words_that_say_nothing_call_for_goals_only_where_none_is_stated(monkeypatch) -> None:
    asked = []
    monkeypatch.setattr(
        "goalscope.belief.goal_manager.incomplete",
        lambda belief, *_, **__: asked.append(belief.goals),
    )
    agent = agent_in(LampRoom())
    agent.step("What now?", "none")
    assert asked == [(UNSPECIFIED,)]
    agent.step("What now?", "lamp light please")
    assert len(asked) == 2
    agent.tracker.add(["light the lamp"])
    agent.step("And now?", "none")
    assert len(asked) == 2


def test_what_was_understood_is_told_before_the_agent_acts() -> None:
    env, told = LampRoom(["lamp"]), []
    agent = agent_in(env, understood=lambda round: told.append((round, [*env.on])))
    done = agent.step("Yes?", "switch on lamp")
    ((known, on),) = told
    assert (on, env.on) == ([], ["lamp"])
    assert (known.number, known.turn, known.reading) == (1, done.turn, done.reading)
    assert (known.belief, known.changes) == (done.belief, done.changes)
    assert (known.results, len(done.results)) == ((), 1)


def test_a_scripted_person_confirms_and_does_not_end_before_all_is_said() -> None:
    class Final(LampRoom):
        last = Verb("finish", "that is all", (), irreversible=True, ends=True, phrase="Good night")
        verbs = (*LampRoom.verbs[:-1], last)

    env = Final(["lamp", "vase"])
    profile = Profile("late", "likes light", ("finish", "smash vase", "switch on lamp"))
    rounds = list(run_episode(agent_in(env), ScriptedHuman(profile, env)))
    said = [round.turn.utterance for round in rounds]
    assert said == [
        "finish",
        DECLINES,
        "smash vase",
        AGREES,
        "switch on lamp",
        "Good night",
        AGREES,
    ]
    assert (env.on, env.smashed, rounds[-1].terminated) == (["lamp"], ["vase"], True)


def test_not_all_goals_are_removed() -> None:
    agent = Agent(LampRoom(), CondemnsAll(REPLIES))
    round = agent.step("What now?", "lamp light please")
    assert [goal.text for goal in round.belief.goals] == ["Unspecified", "have lamp light"]
    assert [c.goal.text for c in round.changes if c.kind == "removed"] == ["sleep without light"]


def asked(text: str, *turns: Turn) -> str:
    writer = Writer(WordModel({QUESTION: text}))
    return ask(writer, LampRoom(), turns, "switch on: lamp", ["read"])


DARK = Turn(OPENING, "It is dark.")


@pytest.mark.parametrize(
    ("text", "before", "question"),
    [
        ("Is it bright?", [], OPENING),
        ("So. Is it bright?", [DARK], "Is it bright?"),
        ("", [DARK], FALLBACK),
        ("none", [DARK], FALLBACK),
        ("It is bright.", [DARK], FALLBACK),
        ("\n", [DARK], FALLBACK),
        ("Is it bright?", [Turn("Fine. Is it bright?", "no"), Turn(FALLBACK, "hm")], FALLBACK),
    ],
)
def test_the_agent_opens_asks_what_is_new_or_lets_the_person_say_anything(
    text: str, before: list[Turn], question: str
) -> None:
    assert asked(text, *before) == question


@pytest.mark.parametrize(("nats", "said"), [(-3.0, "Is it bright?"), (-12.0, FALLBACK)])
def test_a_question_of_which_the_writer_is_unsure_is_not_asked(nats: float, said: str) -> None:
    class Writes(WordModel):
        def generate(self, messages, **settings):
            return replace(super().generate(messages, **settings), log_probability=nats)

    writer = Writer(Writes({QUESTION: "Is it bright?"}))
    assert ask(writer, LampRoom(), [DARK], "", ["read"]) == said


def test_a_question_is_written_with_what_was_done_and_what_the_person_may_want() -> None:
    agent = agent_in(LampRoom(["lamp"]))
    agent.step("What now?", "lamp light please")
    given = []
    agent.toolkit.asker.question = lambda *those, **_: given.append(those) or "Why?"
    assert agent.ask() == "Why?"
    ((_, turns, done, goals),) = given
    assert (len(turns), done, goals[0]) == (1, "switch on: lamp", "have lamp light")


def test_console_asks_again_until_the_words_can_be_used() -> None:
    said = iter(["", "\ud83c", "soup"])
    shown: list[str] = []
    human = ConsoleHuman(lambda query: (shown.append(query), next(said))[1])
    assert human.reply("Yes?", [], "") == "soup"
    assert "empty" in shown[1]
    assert "surrogate" in shown[2]
