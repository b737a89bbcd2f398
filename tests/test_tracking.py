"""Goal tracking for other programs: what a session holds, and what it goes on with."""

from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from databases import begin
from fakes import GOALS as NAMES
from fakes import WordModel
from goalscope.agent.settings import Settings
from goalscope.base.types import (
    TRACKING,
    UNSPECIFIED,
    ConflictError,
    Goal,
    GoalscopeError,
    InvalidInputError,
)
from goalscope.belief.advice import advice
from goalscope.belief.calibration import PAPER
from goalscope.belief.tracker import GoalTracker
from goalscope.cli.main import app
from goalscope.storage import tracking
from goalscope.storage.store import Store
from goalscope.storage.tracking import Tracked, Trackers

TASK = "Help in the kitchen."
GOALS = ["bake a cake", "cook tomato soup"]
CAKE = ("Yes?", "I bake a cake, a big cake.")
WRITES = {NAMES: "grow roses\nfeed the birds"}


class Kitchen:
    """Trackers over one store that can be closed and opened again."""

    def __init__(self, file: Path, **settings) -> None:
        self.file, self.settings = file, settings
        self.model = WordModel(WRITES)
        self.restart()

    def restart(self) -> Trackers:
        self.store = Store.open(self.file)
        self.trackers = Trackers(self.store, lambda: self.model, Settings(**self.settings))
        return self.trackers


@pytest.fixture
def kitchen(tmp_path: Path) -> Kitchen:
    return Kitchen(tmp_path / "episodes.db")


@pytest.fixture
def trackers(kitchen: Kitchen) -> Trackers:
    return kitchen.trackers


@pytest.fixture
def id(trackers: Trackers) -> str:
    """Of a session that was opened."""
    return trackers.open(TASK, GOALS).id


def same(one: Tracked, other: Tracked) -> bool:
    beliefs = [
        (each.goals, each.log_likelihood.tolist(), each.pinned, each.ruled_out)
        for each in (one.belief, other.belief)
    ]
    told = [(t.id, t.info.ended, t.turns, t.last.changes, t.advised.advice) for t in (one, other)]
    return beliefs[0] == beliefs[1] and told[0] == told[1]


def test_a_session_believes_what_a_tracker_does(trackers: Trackers) -> None:
    tracker = GoalTracker(WordModel(), task=TASK, goals=GOALS)
    id = trackers.open(TASK, GOALS).id
    for turn, (query, said) in enumerate([CAKE, ("What else?", "Tomato, please.")], 1):
        expected = tracker.observe(query, said)
        found = trackers.observe(id, turn, query, said)
        assert found.belief.goals == expected.goals
        assert found.belief.probability == pytest.approx(expected.probability)
    late = trackers.add(id, ["make tea"]).belief
    assert late.probability == pytest.approx(tracker.add(["make tea"]).probability)


@pytest.mark.parametrize("weight", [-0.1, 1.1, float("nan")])
def test_a_turn_counts_by_a_weight_from_nothing_to_all(weight) -> None:
    tracker = GoalTracker(WordModel(), goals=["bake cake", "cook soup"])
    before = dict(tracker.belief.top())
    tracker.observe("Yes?", "soup soup", weight=0)
    assert dict(tracker.belief.top()) == pytest.approx(before)
    with pytest.raises(InvalidInputError, match="weight must be a number from 0 to 1"):
        tracker.observe("And?", "soup soup", weight=weight)


def test_a_session_goes_on_after_a_restart_as_if_there_had_been_none(kitchen: Kitchen) -> None:
    steps = [
        lambda t, id: t.add(id, ["make tea", "wash the car"]),
        lambda t, id: t.correct(id, "veto", "wash the car"),
        lambda t, id: t.correct(id, "pin", "make tea"),
        lambda t, id: t.observe(id, 1, *CAKE),
        lambda t, id: t.add(id, ["eat"]),
        lambda t, id: t.correct(id, "reword", "bake a cake", "bake a chocolate cake"),
        lambda t, id: t.observe(id, 2, "", "soup"),
    ]
    through, restarted = (kitchen.trackers.open(TASK, GOALS).id for _ in range(2))
    for step in steps:
        one = step(kitchen.trackers, through)
        assert same(step(kitchen.restart(), restarted), kitchen.trackers.read(restarted))
        two = kitchen.restart().read(restarted)
        assert two.belief.goals == one.belief.goals
        assert two.belief.probability == pytest.approx(one.belief.probability)
        assert (two.turns, two.advised.advice) == (one.turns, one.advised.advice)
        assert two.last.changes == one.last.changes
    goals = [goal.text for goal in two.belief.goals]
    assert sorted(goals) == sorted(
        ["Unspecified", "cook tomato soup", "make tea", "eat", "bake a chocolate cake"]
    )


@pytest.mark.parametrize(
    ("turn", "query", "said"),
    [(1, "Yes?", "soup"), (1, "No?", CAKE[1]), (3, *CAKE), (0, *CAKE), (-1, *CAKE)],
)
def test_a_turn_that_does_not_fit_is_a_conflict(
    id: str, trackers: Trackers, turn: int, query: str, said: str
) -> None:
    before = trackers.observe(id, 1, *CAKE)
    with pytest.raises(ConflictError):
        trackers.observe(id, turn, query, said)
    assert same(trackers.read(id), before)


def test_the_assistant_learns_whether_to_act_to_ask_or_to_propose(tmp_path: Path) -> None:
    trackers = Kitchen(tmp_path / "s.db", calibration="paper").trackers
    opened = trackers.open(TASK, GOALS)
    assert (opened.advised.advice, opened.belief.calibration) == ("ask", PAPER)
    assert trackers.observe(opened.id, 1, "", "cake cake cake").advised.advice == "act"
    assert trackers.observe(trackers.open(TASK, GOALS).id, 1, "", "a").advised.advice == "ask"
    usual = Kitchen(tmp_path / "usual.db", calibration="default").trackers
    lost = usual.open(TASK, ["bake", "cook"]).id
    garden = "roses, red roses in my old garden, far away from any kitchen at all"
    said = [usual.observe(lost, number, "", garden).advised.advice for number in (1, 2)]
    assert said == ["ask", "propose"]
    assert usual.add(lost, ["grow roses"]).advised.advice != "propose"
    assert (
        usual.observe(lost, 3, "", "Grow roses, grow my red roses, grow!").advised.advice == "act"
    )


def test_goals_are_proposed_only_where_that_is_asked_for(trackers: Trackers) -> None:
    roses = ("Yes?", "I grow roses, red roses.")
    quiet = trackers.observe(trackers.open(TASK, []).id, 1, *roses)
    assert quiet.belief.goals == (UNSPECIFIED,)
    helped = trackers.observe(trackers.open(TASK, propose=True).id, 1, *roses)
    assert Goal("grow roses") in helped.belief.goals
    assert any(each.kind == "added" for each in helped.last.changes)


def test_the_model_takes_out_only_goals_of_its_own(
    kitchen: Kitchen, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("goalscope.belief.goal_manager.IMPROBABLE", 1.0)
    id = kitchen.trackers.open(TASK, GOALS, propose=True).id
    kitchen.trackers.observe(id, 1, "", "I grow roses and feed birds, roses, birds.")
    assert len(kitchen.trackers.read(id).belief.goals) > 3
    for turn in range(2, 8):
        kitchen.trackers.observe(id, turn, "", "grow roses")
    changes = [each for round in kitchen.store.rounds(id) for each in round.changes]
    removed = {each.goal.text for each in changes if each.kind == "removed"}
    assert removed
    assert not removed & set(GOALS)
    assert set(GOALS) <= {goal.text for goal in kitchen.trackers.read(id).belief.goals}


def test_a_closed_session_is_read_and_not_changed(id: str, trackers: Trackers) -> None:
    trackers.observe(id, 1, *CAKE)
    closed = trackers.close(id)
    assert closed.info.ended
    assert same(trackers.close(id), closed)
    assert same(trackers.observe(id, 1, *CAKE), closed)
    for change in (
        lambda: trackers.observe(id, 2, *CAKE),
        lambda: trackers.add(id, ["x"]),
        lambda: trackers.correct(id, "pin", "x"),
    ):
        with pytest.raises(ConflictError, match="closed"):
            change()


def test_a_session_belongs_to_its_model(id: str, kitchen: Kitchen) -> None:
    kitchen.model = type("Other", (WordModel,), {"name": "other"})()
    assert kitchen.trackers.read(id).id == id
    with pytest.raises(ConflictError, match="uses the model words"):
        kitchen.trackers.observe(id, 1, *CAKE)


def test_there_is_no_session_but_those_of_the_trackers(id: str, kitchen: Kitchen) -> None:
    shop = begin(kitchen.store, domain="grocery", method="good", model="words", task=TASK)
    for other in (id[:-1], "", "zz", shop):
        with pytest.raises(InvalidInputError, match="There is no tracking session"):
            kitchen.trackers.read(other)


@pytest.mark.parametrize(
    "goals",
    [
        ["tea", "Tea!"],
        [""],
        [" "],
        ["\ud800"],
        ["x" * 501],
        [f"goal {n}" for n in range(201)],
        ["unspecified"],
    ],
)
def test_goals_that_cannot_be_used_are_refused(
    id: str, trackers: Trackers, goals: list[str]
) -> None:
    before = trackers.observe(id, 1, *CAKE)
    for refused in (lambda: trackers.open(TASK, goals), lambda: trackers.add(id, goals)):
        with pytest.raises(InvalidInputError):
            refused()
    assert same(trackers.read(id), before)


def test_two_hundred_goals_and_not_one_more(trackers: Trackers) -> None:
    id = trackers.open(TASK, [f"goal {n}" for n in range(200)]).id
    trackers.observe(id, 1, *CAKE)
    with pytest.raises(InvalidInputError, match="at most 200 goals"):
        trackers.correct(id, "pin", "another one")
    assert len(trackers.read(id).belief.goals) == 201
    assert len(trackers.add(id, ["Goal 7."]).belief.goals) == 201


def test_turns_end_in_time(trackers: Trackers, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tracking, "MAX_TURNS", 1)
    id = trackers.open(TASK, GOALS).id
    trackers.observe(id, 1, *CAKE)
    with pytest.raises(ConflictError, match="at most 1 turns"):
        trackers.observe(id, 2, *CAKE)


def test_a_round_that_has_changed_meanwhile_is_not_overwritten(id: str, kitchen: Kitchen) -> None:
    kitchen.trackers.observe(id, 1, *CAKE)
    (old,) = kitchen.store.rounds(id)
    kitchen.store.amend(id, old, replace(old, status="one"))
    for change in (
        lambda: kitchen.store.amend(id, old, replace(old, status="two")),
        lambda: kitchen.store.append(id, replace(old, number=2), after=old),
    ):
        with pytest.raises(GoalscopeError, match="was changed elsewhere"):
            change()
    kitchen.trackers.observe(id, 2, *CAKE)
    with pytest.raises(GoalscopeError, match="was changed elsewhere"):
        kitchen.store.amend(id, replace(old, status="one"), old)
    assert kitchen.store.rounds(id)[0].status == "one"


def test_the_commands_show_a_session_and_do_not_go_on_with_it(id: str, kitchen: Kitchen) -> None:
    kitchen.trackers.observe(id, 1, *CAKE)

    def said(*words: str, code: int = 0) -> str:
        answer = CliRunner().invoke(app, [*words, "--store", str(kitchen.file)])
        assert answer.exit_code == code, answer.output
        return answer.output

    assert id in said("episodes")
    assert "bake a cake" in said("replay", id)
    assert CAKE[1] in " ".join(said("why", id, "--json").split())
    assert "another program" in said("chat", "--resume", id, code=2)


@pytest.mark.parametrize(
    "late",
    [
        lambda t, id: t.add(id, ["make tea"]),
        lambda t, id: t.correct(id, "pin", "make tea"),
        lambda t, id: t.observe(id, 1, *CAKE),
    ],
    ids=["add", "pin", "observe"],
)
@pytest.mark.parametrize(
    "first",
    [
        lambda t, id: t.add(id, ["feed the birds"]),
        lambda t, id: t.observe(id, 1, "", "I feed the birds."),
    ],
    ids=["added", "observed"],
)
def test_of_two_servers_none_undoes_what_the_other_did(
    id: str, kitchen: Kitchen, first, late
) -> None:

    def meanwhile() -> WordModel:
        nonlocal now
        now, others = None, now
        if others:
            first(others, id)
        return kitchen.model

    now: Trackers | None = None
    with Store.open(kitchen.file) as store:
        slow = Trackers(store, meanwhile)
        now = kitchen.trackers
        with pytest.raises(ConflictError):
            late(slow, id)
        assert same(slow.read(id), kitchen.trackers.read(id))
        told = kitchen.trackers.read(id)
        assert told.turns or Goal("feed the birds") in told.belief.goals
        assert Goal("make tea") not in told.belief.goals
        assert Goal("make tea") in slow.add(id, ["make tea"]).belief.goals


def test_nobody_acts_on_a_proposal_that_the_person_has_not_confirmed(
    tmp_path: Path,
) -> None:
    trackers = Kitchen(tmp_path / "s.db", calibration="paper").trackers
    id = trackers.open(TASK, propose=True).id
    first = trackers.observe(id, 1, "Yes?", "I grow and grow and grow.")
    assert first.belief.top(1)[0] == (Goal("grow roses"), pytest.approx(1.0, abs=0.2))
    assert (first.proposed, first.advised.advice) == ({Goal("grow roses")}, "ask")
    assert trackers.observe(id, 2, "And?", "Quickly.").advised.advice == "ask"
    assert trackers.observe(id, 3, "So?", "Roses, roses.").advised.advice == "ask"
    assert trackers.correct(id, "pin", "grow roses").advised.advice == "act"
    assert trackers.observe(id, 4, "So?", "Roses, roses.").advised.advice == "act"


def test_after_goals_were_added_others_are_asked_for_by_later_words_alone(
    id: str, kitchen: Kitchen
) -> None:
    tracker = GoalTracker(kitchen.model, task=TASK, goals=GOALS)
    odd = "Good morning, I am here. I have many things to do today. " * 3
    first = kitchen.trackers.observe(id, 1, "Yes?", odd)
    tracker.observe("Yes?", odd)
    assert (first.advised.advice, advice(tracker)) == ("propose", "propose")
    added = kitchen.trackers.add(id, ["fly a kite"])
    tracker.add(["fly a kite"])
    assert added.belief.probability.tolist() == tracker.belief.probability.tolist()
    assert (added.advised.advice, advice(tracker)) == ("ask", "ask")
    later = kitchen.trackers.observe(id, 2, "And?", odd)
    tracker.observe("And?", odd)
    assert (later.advised.advice, advice(tracker)) == ("propose", "propose")


def test_a_session_that_is_deleted_while_a_turn_is_read_stays_gone(kitchen: Kitchen) -> None:
    trackers, score = kitchen.trackers, kitchen.model.token_logprobs
    id, other = (trackers.open(TASK, GOALS).id for _ in range(2))
    trackers.observe(id, 1, *CAKE)
    trackers.observe(other, 1, *CAKE)

    def deleting(*given, **more):
        trackers.delete(id)
        return score(*given, **more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kitchen.model, "token_logprobs", deleting)
        with pytest.raises(GoalscopeError):
            trackers.observe(id, 2, "", "soup")
    assert [each.id for each in kitchen.store.episodes(domain=TRACKING)] == [other]
    assert len(trackers.read(other).turns) == 1
    for use in (trackers.read, trackers.delete, trackers.close):
        with pytest.raises(InvalidInputError, match="no tracking session"):
            use(id)
