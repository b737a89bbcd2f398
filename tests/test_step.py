"""One round is one pass of Algorithm 1, whole or not at all."""

from __future__ import annotations

import json
from contextlib import closing
from dataclasses import asdict

import pytest

from fakes import GOALS, LampRoom, WordModel, plans
from goalscope.agent.agent import Agent, K
from goalscope.agent.planner import Outcome
from goalscope.agent.settings import Settings, settings_of
from goalscope.base.types import Goal, InvalidInputError, UnreadableAnswerError
from goalscope.models.opening import ModelSet, open_model
from goalscope.storage.session import Session
from goalscope.storage.store import Store
from lamps import RANKS, REPLIES, agent_in
from shops import shop

LIGHT, SLEEP = Goal("have lamp light"), Goal("sleep without light")


class Watches:
    """A planner that does nothing, and remembers for which goals it was to plan."""

    def __init__(self) -> None:
        self.wants: list[list[str]] = []

    def act(self, env, wants, turns, history, dialogue):
        self.wants.append([want.text for want in wants])
        return Outcome()


@pytest.mark.parametrize("method", ["good", "no-inference"])
def test_a_round_runs_in_the_order_of_algorithm_1(method) -> None:
    told: list[str] = []
    model = WordModel({**REPLIES, **RANKS})
    agent = agent_in(LampRoom(), method, model=model, progress=told.append)
    agent.step("What now?", "lamp light please")
    words = [each.split()[0] for each in told]
    assert words == ["reading", "scoring", "proposing", "checking", "planning"]


@pytest.mark.parametrize("k", [1, 2, K])
def test_the_agent_acts_on_the_k_likeliest_goals(k) -> None:
    planner = Watches()
    agent = plans(agent_in(LampRoom(), k=k), planner)
    agent.step("What now?", "have lamp light please")
    assert planner.wants == [[LIGHT.text, SLEEP.text][:k]]


def test_an_order_of_which_nothing_comes_may_tell_an_aim() -> None:
    planner, model = Watches(), WordModel(REPLIES)
    agent = plans(agent_in(shop(), "no-goals", model=model), planner)
    for said in ("add milk", "add milk", "add eggs; add caviar", "remove caviar", "add spag bol"):
        agent.step("What now?", said)
        assert len(planner.wants) == (said == "add spag bol"), said


def test_goals_that_cannot_be_read_change_none() -> None:
    class Mute:
        def goals(self, task, turns, held):
            raise UnreadableAnswerError("no list")

    agent = agent_in(LampRoom())
    agent.goal_manager.proposer = Mute()
    round = agent.step("What?", "lamp light please")
    assert round.changes == ()
    assert any(note.startswith("The goals stay as they are.") for note in round.notes)
    assert len(agent.turns) == 1


def test_an_error_leaves_the_belief_as_it_was() -> None:
    agent = agent_in(LampRoom())
    agent.step("What?", "lamp light please")
    before, on = agent.belief, agent.env.state().text

    def full(_: object) -> None:
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        agent.step("And?", "sleep without light", keep=full)
    assert (agent.belief, agent.env.state().text, len(agent.turns)) == (before, on, 1)

    assert len(agent.tracker.turns) == 1


@pytest.mark.parametrize(
    ("given", "told"),
    [({"k": 0}, "k must be a whole number, 1 or more"), ({"method": "best"}, '"no-goals"')],
)
def test_settings_that_there_are_not_are_refused(given, told: str) -> None:
    with pytest.raises(InvalidInputError, match=told):
        Agent(LampRoom(), WordModel(), **given)


def test_an_episode_keeps_its_settings_when_it_is_resumed() -> None:
    chosen = Settings(k=1)
    assert settings_of(json.loads(json.dumps(asdict(chosen)))) == chosen
    with Store.in_memory() as store:
        first = Session(store, chosen, LampRoom(), WordModel(REPLIES), read=str)
        first.step("What?", "lamp light please")
        info = store.episode(first.id)
        again = Session(
            store, settings_of(info.settings), LampRoom(), WordModel({**REPLIES, GOALS: ""}),
            read=str, resume=info,
        )  # fmt: skip
        assert again.agent.k == 1


def test_what_is_prepared_need_not_be_computed_in_the_first_round() -> None:
    def decoded(model: ModelSet) -> int:
        return sum(part.tokens_decoded for part in {*model.roles})

    spent: list[int] = []
    for prepares in (False, True):
        with Store.in_memory() as store, closing(open_model()) as model:
            session = Session(store, Settings(), LampRoom(), model, read=str)
            if prepares:
                session.prepare()
            assert not session.agent.rounds
            assert not session.is_stored
            before = decoded(model)
            session.step(session.agent.ask(), "It is dark, I would like to read.")
            spent.append(decoded(model) - before)
    assert spent[1] < 0.6 * spent[0]


def test_nothing_is_asked_of_a_model_elsewhere_before_the_person_speaks() -> None:
    model = WordModel(REPLIES)
    with Store.in_memory() as store:
        Session(store, Settings(), LampRoom(), model, read=str).prepare()
    assert model.calls == 0
