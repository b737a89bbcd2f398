"""What is done, and what is asked, while it is not clear what the person wants."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from fakes import NEEDS, WordModel, said
from goalscope.agent.agent import Agent
from goalscope.agent.executor import Execution
from goalscope.agent.planner import Outcome
from goalscope.base.types import UNSPECIFIED, Goal
from goalscope.belief.belief import Belief
from goalscope.envs import Environment
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.language.orders import Order, Reading
from shops import SMALL, SMALL_SEARCH

WANTED = (
    "bake a cake", "wash the car", "cook tomato soup", "buy the basket", "have a party",
    "keep the kitchen tidy", "break everything", "drink coffee", "feed the cat", "sleep",
)  # fmt: skip


class Moody(WordModel):
    """How likely a text is hangs on nothing that means anything."""

    def token_logprobs(self, contexts, continuations):
        return [
            np.array([-6.0 + 3.0 * np.sin(zlib.crc32(f"{context[-1].content}{text}".encode()))])
            for context, text in zip(contexts, continuations, strict=True)
        ]


def unsure(rng: np.random.Generator) -> Belief:
    """A belief that Unspecified leads, alone or with others as likely."""
    goals = [Goal(text) for text in rng.permutation(WANTED)[: rng.integers(1, 7)]]
    weights = rng.dirichlet(np.ones(len(goals)) * rng.choice([0.1, 1.0, 10.0]))
    lead = weights.max() * (1.0 if rng.random() < 0.5 else rng.uniform(1.0, 30.0))
    if rng.random() < 0.2:
        weights[: len(weights) // 2 + 1] = lead
    prior = np.log(np.maximum(np.append(weights, lead), 1e-12))
    return Belief((*goals, UNSPECIFIED), prior, np.zeros((0, len(prior))))


NEEDED = {
    "shop": "flour, soap, milk, buy basket, coffee, cat food",
    "house": "put soap bar | where sink, turn on faucet, break mirror, put towel | where cabinet, "
    "open cabinet, use up soap bottle",
}

AIMS = (
    "It will be a long day, and I have guests.",
    "The bathroom is a disgrace, and I have guests.",
)


@pytest.mark.parametrize("count", [200, pytest.param(5_000, marks=pytest.mark.slow)])
def test_while_unspecified_leads_nothing_lasting_is_done_and_each_guess_is_told(
    count: int, figure: Callable[[str], None]
) -> None:
    rng = np.random.default_rng(3)
    shop, robot = GroceryShop(SMALL, search=SMALL_SEARCH), HomeRobot(HouseController("Bathroom1"))
    places: Sequence[tuple[Environment, Moody]] = (
        (shop, Moody({NEEDS: f"needed: {NEEDED['shop']}"})),
        (robot, Moody({NEEDS: f"needed: {NEEDED['house']}"})),
    )
    guessed, led = [0, 0], 0
    for number in range(count):
        env, model = places[number % 2]
        agent = Agent(env, model)
        assert agent.tracker is not None
        belief = agent.tracker.belief = unsure(rng)
        led += belief.probability.max() > np.sort(belief.probability)[-2] + 1e-9
        assert belief.probability[-1] >= belief.probability.max() - 1e-12
        words = f"Number {number}: {AIMS[number % 2]}"
        outcome = planned(agent, words)
        assert not any(each.irreversible for each in outcome.results)
        told = {each.target for each in outcome.guessed}
        assert {each.action.target for each in outcome.results} == told
        guessed[number % 2] += bool(told)
        if told:
            env.reset()
    assert not shop.bought
    assert min(guessed) > 0, "else the test could not fail"
    figure(
        f"{count:,} beliefs that Unspecified leads ({count - led:,} tied): 0 lasting acts; "
        f"something that can be undone is guessed, and told, in {sum(guessed):,}",
    )


def planned(agent: Agent, words: str) -> Outcome:
    """What an agent guesses for an aim."""
    done = Execution(said(words)[-1], Reading((Order("aim"),)))
    return agent._act(done.turn, done.reading, done)


def test_where_unspecified_is_all_there_is_only_what_the_words_call_for_is_guessed() -> None:
    model = WordModel({NEEDS: "needed: milk, flour"})
    for words, added in (("I have guests.", []), ("Something with milk.", ["Whole Milk"])):
        shop = GroceryShop(Catalogue([Item(1, "Whole Milk"), Item(2, "Plain Flour")]))
        agent = Agent(shop, model)
        assert agent.tracker is not None
        assert agent.tracker.belief.goals == (UNSPECIFIED,)
        outcome = planned(agent, words)
        assert [*shop.basket] == added
        assert [(each.target, each.goal) for each in outcome.guessed] == [(n, "") for n in added]
