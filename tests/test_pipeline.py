"""The order of a round's stages, and the number of goals to act on, as settings."""

from __future__ import annotations

import json
import re
from contextlib import closing
from dataclasses import asdict, replace
from itertools import permutations

import numpy as np
import pytest

from fakes import GOALS, LampRoom, RefusesAll, WordModel, plans
from goalscope.agent.agent import Agent, K
from goalscope.agent.planner import Outcome
from goalscope.agent.settings import Settings, open_environment, settings_of
from goalscope.agent.toolkit import PIPELINE, pipeline_of
from goalscope.base.types import Goal, InvalidInputError, UnreadableAnswerError
from goalscope.belief.calibration import PAPER
from goalscope.envs import GUESSED
from goalscope.models.opening import forget, open_model
from goalscope.storage.session import Session
from goalscope.storage.store import Store
from lamps import RANKS, REPLIES, agent_in

EVERY = [*permutations(PIPELINE)]
LIGHT, SLEEP = Goal("have lamp light"), Goal("sleep without light")
SAID = {"scoring": "infer", "proposing": "propose", "checking": "remove", "planning": "act"}


class Watches:
    """A planner that does nothing, and remembers for which goals it was to plan."""

    def __init__(self) -> None:
        self.wants: list[list[str]] = []

    def act(self, env, wants, turns, history, standing):
        self.wants.append([want.text for want in wants])
        return Outcome()


def watched(**settings) -> tuple[Agent, Watches]:
    planner = Watches()
    return plans(agent_in(LampRoom(), **settings), planner), planner


def kinds(round) -> list[str]:
    return [change.kind for change in round.changes]


@pytest.mark.parametrize("method", ["good", "no-inference"])
@pytest.mark.parametrize("pipeline", EVERY, ids="-".join)
def test_the_stages_of_a_round_run_in_their_order(pipeline, method) -> None:
    told: list[str] = []
    model = WordModel({**REPLIES, **RANKS})
    agent = agent_in(LampRoom(), method, model=model, pipeline=pipeline, progress=told.append)
    agent.step("What now?", "lamp light please")
    known = [SAID[word] for each in told if (word := each.split()[0]) in SAID]
    assert known == [*pipeline]


@pytest.mark.parametrize("pipeline", EVERY, ids="-".join)
def test_the_order_changes_what_is_acted_on_and_not_what_the_words_are_worth(pipeline) -> None:
    usual, other = agent_in(LampRoom()), agent_in(LampRoom(), pipeline=pipeline)
    for words in ("lamp light please", "have lamp please", "sleep without light"):
        a, b = (agent.step("What now?", words).belief for agent in (usual, other))
        assert a is not None
        assert b is not None
        assert a.goals == b.goals
        assert b.log_likelihood == pytest.approx(a.log_likelihood)
        assert b.probability == pytest.approx(a.probability)


@pytest.mark.parametrize("pipeline", EVERY, ids="-".join)
def test_the_planner_gets_the_goals_of_the_stages_before_it(pipeline) -> None:
    agent, planner = watched(pipeline=pipeline)
    agent.step("What now?", "lamp light please")
    agent.step("And now?", "lamp light please")
    both = [LIGHT.text, SLEEP.text]
    early = pipeline.index("act") < pipeline.index("propose")
    assert [sorted(each) for each in planner.wants] == [[] if early else both, both]


@pytest.mark.parametrize(
    ("k", "planned"),
    [(1, [LIGHT.text]), (2, [LIGHT.text, SLEEP.text]), (K, [LIGHT.text, SLEEP.text])],
)
def test_the_agent_acts_on_the_k_likeliest_goals(k, planned) -> None:
    agent, planner = watched(k=k)
    agent.step("What now?", "have lamp light please")
    assert planner.wants == [planned]


def test_what_is_removed_before_it_is_proposed_stays_for_a_round() -> None:
    first = agent_in(LampRoom(), model=RefusesAll(REPLIES)).step("What?", "lamp light please")
    assert "removed" in kinds(first)
    agent = agent_in(
        LampRoom(), model=RefusesAll(REPLIES), pipeline=("infer", "remove", "propose", "act")
    )
    assert kinds(agent.step("What?", "lamp light please")) == ["added", "added"]
    assert "removed" in kinds(agent.step("And?", "have lamp please"))


def test_goals_that_are_ruled_out_this_round_are_not_proposed_in_it() -> None:
    agent = agent_in(
        LampRoom(), model=RefusesAll(REPLIES), pipeline=("infer", "remove", "propose", "act")
    )
    agent.step("What?", "lamp light please")
    gone = [c.goal for c in agent.step("And?", "zebra").changes if c.kind == "removed"]
    belief = agent.belief
    assert belief is not None
    assert gone
    assert not {*gone} & {*belief.goals}


@pytest.mark.parametrize("pipeline", EVERY, ids="-".join)
def test_rounds_as_the_least_likely_are_counted_once(pipeline, monkeypatch) -> None:
    monkeypatch.setattr("goalscope.belief.goal_manager.IMPROBABLE", 1.0)
    monkeypatch.setattr("goalscope.belief.goal_manager.FEWEST", 0)
    agent = agent_in(LampRoom(), pipeline=pipeline, patience=2)
    rounds = [agent.step("What?", "have lamp light") for _ in range(6)]
    gone = min(round.number for round in rounds if "removed" in kinds(round))
    has_not_seen_its_own_words = pipeline.index("remove") < pipeline.index("infer")
    assert gone == 3 + has_not_seen_its_own_words


@pytest.mark.parametrize("pipeline", [PIPELINE, ("propose", "infer", "remove", "act")])
def test_goals_that_cannot_be_read_change_none(pipeline) -> None:
    class Mute:
        def goals(self, task, turns, held):
            raise UnreadableAnswerError("no list")

    agent = agent_in(LampRoom(), pipeline=pipeline)
    agent.goals.proposer = Mute()
    round = agent.step("What?", "lamp light please")
    assert round.changes == ()
    assert any(note.startswith("The goals stay as they are.") for note in round.notes)
    assert len(agent.turns) == 1


@pytest.mark.parametrize("pipeline", EVERY, ids="-".join)
def test_an_error_leaves_the_belief_as_it_was(pipeline) -> None:
    agent = agent_in(LampRoom(), pipeline=pipeline)
    agent.step("What?", "lamp light please")
    before, on = agent.belief, agent.env.status()

    def full(_: object) -> None:
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        agent.step("And?", "sleep without light", keep=full)
    assert (agent.belief, agent.env.status(), len(agent.turns)) == (before, on, 1)
    assert agent.tracker is not None
    assert len(agent.tracker.turns) == 1


def test_a_likelihood_of_ones_own_bears_goals_that_come_before_any_turn() -> None:
    class Flat:
        calibration = PAPER

        def log_likelihood(self, task, goals, turns, *, since=0):
            return np.zeros((len(turns) - since, len(goals)))

    agent = agent_in(LampRoom(), likelihood=Flat(), pipeline=("propose", "infer", "remove", "act"))
    round = agent.step("", "lamp light please")
    assert round.belief is not None
    assert round.belief.log_likelihood.shape == (1, len(round.belief.goals))


@pytest.mark.parametrize(
    "pipeline",
    [
        (),
        ("infer", "propose", "remove"),
        (*PIPELINE, "act"),
        ("infer", "propose", "remove", "plan"),
        ("infer", "infer", "remove", "act"),
        "infer,propose,remove,act",
        ("Infer", "propose", "remove", "act"),
    ],
)
def test_what_is_no_pipeline_is_refused_with_those_that_are(pipeline) -> None:
    for refuses in (pipeline_of, lambda given: Agent(LampRoom(), WordModel(), pipeline=given)):
        with pytest.raises(InvalidInputError, match="infer, propose, remove and act once each, in"):
            refuses(pipeline)


@pytest.mark.parametrize("k", [0, -1, 1.5, "3", None])
def test_k_is_a_whole_number_from_1(k) -> None:
    with pytest.raises(InvalidInputError, match="k must be a whole number, 1 or more"):
        Agent(LampRoom(), WordModel(), k=k)


def test_an_episode_keeps_its_settings_when_it_is_resumed() -> None:
    chosen = Settings(k=1, pipeline=("infer", "act", "propose", "remove"))
    assert settings_of(json.loads(json.dumps(asdict(chosen)))) == chosen
    old = {key: v for key, v in asdict(chosen).items() if key not in ("k", "pipeline")}
    assert settings_of(old) == replace(chosen, k=K, pipeline=PIPELINE)
    told: list[str] = []
    with Store.in_memory() as store:
        first = Session(store, chosen, LampRoom(), WordModel(REPLIES), read=str)
        first.step("What?", "lamp light please")
        info = store.episode(first.id)
        again = Session(
            store, settings_of(info.settings), LampRoom(), WordModel({**REPLIES, GOALS: ""}),
            read=str, resume=info, progress=told.append,
        )  # fmt: skip
        again.step("And?", "sleep without light")
    stages = [SAID[word] for each in told if (word := each.split()[0]) in SAID]
    assert stages[:2] == ["infer", "act"]
    assert again._agent.k == 1


def test_the_embedded_model_guesses_for_the_goals_that_it_had_when_it_acted() -> None:
    said = ("We are having friends over on Saturday.", "I'd like to bake a chocolate cake.")
    with closing(open_model()) as model:
        for settings in (Settings(), Settings(k=1), Settings(pipeline=("act", *PIPELINE[:3]))):
            forget(model)
            with Store.in_memory() as store:
                env = open_environment(settings)
                session = Session(store, settings, env, model, read=str)
                early, late = (session.step(session.ask(), words) for words in said)
            guessed = [note for note in late.notes if note.startswith(GUESSED)]
            goals = re.findall(r"\(to (.*?)\)", guessed[0])
            acts_first = settings.pipeline[0] == "act"
            assert bool(early.results) != acts_first
            assert ["cake" in goal for goal in goals] == [not acts_first] * len(goals)
            assert {change.goal.text for change in early.changes} >= {*goals} or not acts_first
            if settings.k == 1:
                assert len(goals) == 1
