"""What is done unasked: what the whole belief speaks for, in an order, and never half of it."""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes import NEEDS, LampRoom, WordModel, plans, said
from goalscope.agent.agent import Agent
from goalscope.agent.planner import NeedPlanner, Outcome, Want, called_for, choose
from goalscope.agent.writer import JUDGEMENTS, Writer
from goalscope.base.types import Action, StepResult
from goalscope.envs import Environment
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.scenarios import Scenario
from goalscope.language.dialogue_state import DialogueState
from goalscope.language.orders import Order

FREE = DialogueState()
HELLO = said("hello")
READ, SLEEP = Want("read", 0.45), Want("sleep", 0.55)


@st.composite
def beliefs(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, float]:
    goals, things = draw(st.integers(1, 5)), draw(st.integers(1, 4))
    weights = np.array(draw(st.lists(st.floats(0.01, 1), min_size=goals, max_size=goals)))
    worth = st.lists(st.floats(-1, 1, allow_subnormal=False), min_size=things, max_size=things)
    rows = np.array(draw(st.lists(worth, min_size=goals, max_size=goals)))
    return weights / weights.sum(), rows, draw(st.floats(0.01, 0.9))


@given(beliefs())
def test_the_choice_has_the_greatest_expected_value(case) -> None:
    probability, worth, cost = case
    choice = choose(probability, worth, cost)
    for thing, value in enumerate(worth.T):
        known_first = sum(p * max(v, 0.0) for p, v in zip(probability, value, strict=True)) - cost
        values = {"act": probability @ value, "ask": known_first, "wait": 0.0}
        chosen = "act" if choice.act[thing] else "ask" if choice.hold[thing] else "wait"
        assert not (choice.act[thing] and choice.hold[thing])
        assert values[chosen] >= max(values.values()) - 1e-9
        assert choice.value[thing] == pytest.approx(values["act"])


class Lived(LampRoom):
    """A room of which it is known from life what some aims call for."""

    def __init__(self, offers: Sequence[str], table: Mapping[str, str]) -> None:
        super().__init__(offers)
        self.known = {
            aim: Scenario(f"x-{aim}", "room", aim, (), tuple(needed.split(", ")))
            for aim, needed in table.items()
        }

    def like(self, text: str, most: int) -> list[Scenario]:
        return [each for aim, each in self.known.items() if text.endswith(aim)][:most]


class Judges(WordModel):
    """As a writer it finds needed under an aim what its table says, and is sure of it."""

    def __init__(self, table: Mapping[str, str], written: str = "") -> None:
        super().__init__({NEEDS: written})
        self.table = table

    def token_logprobs(self, contexts, continuations):
        rows = []
        for context, text in zip(contexts, continuations, strict=True):
            told, _, thing = context[-1].content.rpartition("\nAnd ")
            aim = told.partition("Aim: ")[2]
            fits = thing.removesuffix("?") in self.table.get(aim, "").split(", ")
            rows.append(np.array([0.0 if text == JUDGEMENTS[0 if fits else 2] else -9.0]))
        return rows


def act(
    env: Environment, table: Mapping[str, str], *wants: Want, history=(), dialogue=FREE, **options
) -> Outcome:
    planner = NeedPlanner(Writer(Judges(table)), **options)
    return planner.act(env, wants, HELLO, history, dialogue)


def lived(
    offers: Sequence[str], table: Mapping[str, str], *wants: Want, **options
) -> tuple[Lived, Outcome]:
    """What is done where scenarios say it."""
    room = Lived(offers, table)
    return room, act(room, table, *wants, **options)


def test_what_several_goals_share_comes_first() -> None:
    table = {"read": "candle, lamp", "write": "lamp"}
    wants = [Want("read", 0.85), Want("write", 0.15)]
    room, outcome = lived(["candle", "lamp"], table, *wants, limit=1)
    (guess,) = outcome.guessed
    assert (guess.target, guess.goal, room.on) == ("lamp", "read", ["lamp"])
    room, _ = lived(["candle", "lamp"], table, *wants)
    assert sorted(room.on) == ["candle", "lamp"]


def test_what_is_wrong_for_a_likely_goal_waits_until_the_belief_is_clear() -> None:
    table = {"read": "lamp", "sleep": "pillow"}
    room, unsure = lived(["lamp"], table, READ, SLEEP)
    assert (unsure.results, unsure.held, room.on) == ((), ("lamp",), [])
    room, sure = lived(["lamp"], table, Want("read", 0.97), Want("sleep", 0.03))
    assert (sure.held, room.on) == ((), ["lamp"])


def test_what_is_held_back_could_be_done_and_takes_no_place_of_what_is_done() -> None:
    table = {"read": "candle, torch, moon", "sleep": "torch"}
    room, outcome = lived(["candle", "torch"], table, READ, SLEEP, limit=1)
    assert (room.on, outcome.held) == (["torch"], ("candle",))


def test_what_is_done_is_in_the_order_of_life_and_no_more_than_the_limit() -> None:
    names = [f"lamp {n}" for n in range(12)]
    room, outcome = lived(names, {"read": ", ".join(names[::-1])}, Want("read", 1.0))
    assert room.on == names[::-1][:8]
    assert [guess.target for guess in outcome.guessed] == room.on


def test_what_serves_two_needs_is_done_once() -> None:
    class Switched(Lived):
        def serving(self, need, dialogue):
            return [Action("switch on", "lamp")]

    table = {"read": "lamp, light"}
    room = Switched(["lamp"], table)
    outcome = act(room, table, Want("read", 1.0))
    assert (room.on, outcome.failed) == (["lamp"], ())


def test_nothing_lasting_is_done_unasked_and_no_part_of_it() -> None:
    class Fragile(Lived):
        def serving(self, need, dialogue):
            return [Action("switch on", need), *[Action("smash", need)] * (need == "vase")]

    table = {"read": "vase, lamp"}
    room = Fragile(["vase", "lamp"], table)
    act(room, table, Want("read", 1.0))
    assert (room.on, room.smashed) == (["lamp"], [])


class Wired(Lived):
    """Serves a need by several things at once."""

    def serving(self, need, dialogue):
        return [Action("switch on", name) for name in need.split(" and ")]


@pytest.mark.parametrize(
    ("needs", "on", "failed"),
    [
        ("lamp and fan", ["lamp", "fan"], []),
        ("lamp, fan and broken, light", ["lamp", "light"], ["broken"]),
    ],
)
def test_what_fails_is_told_and_undone_whole_and_all_the_rest_is_told(needs, on, failed) -> None:
    table = {"read": needs}
    room = Wired(["lamp", "fan", "broken", "light"], table)
    outcome = act(room, table, Want("read", 1.0))
    assert room.on == on
    assert [each.action.target for each in outcome.failed] == failed
    assert [each.target for each in outcome.guessed] == on


SWITCHED_OFF = [StepResult(Action("switch off", "lamp"), True, "It is off.")]


@pytest.mark.parametrize(
    ("offers", "needs", "more", "on"),
    [
        (
            ["lamp", "candle"],
            "lamp, candle",
            {"dialogue": DialogueState(limits=(Order("avoid", "lamp"),))},
            ["candle"],
        ),
        (["lamp"], "moon, lamp", {}, ["lamp"]),
        ([], "moon", {}, []),
        (["lamp", "fan"], "lamp, fan", {"history": SWITCHED_OFF}, ["fan"]),
    ],
    ids=["ruled out", "not here", "nothing here", "acted on before"],
)
def test_what_is_not_to_be_done_or_not_here_is_left_out(offers, needs, more, on) -> None:
    room, outcome = lived(offers, {"read": needs}, Want("read", 1.0), **more)
    assert (room.on, outcome.failed, outcome.held) == (on, (), ())


@pytest.mark.parametrize(("held", "comes"), [("Spreadable Butter", []), ("Garlic", ["unsalted"])])
def test_a_second_thing_of_a_kind_is_not_guessed(held, comes) -> None:
    class Shop(GroceryShop):
        like = Lived.like

    shop = Shop(Catalogue.load())
    needed = ("unsalted butter", "spreadable butter")
    shop.known = {"bake": Scenario("x-1", "grocery", "bake", (), needed)}
    history = [shop.step(Action("add item", held))]
    outcome = act(shop, {}, Want("bake", 1.0), history=history)
    assert [each.target.split()[0].lower() for each in outcome.guessed] == comes


@pytest.mark.parametrize(("rest", "on"), [(0.0, ["lamp"]), (0.05, ["lamp"]), (0.55, [])])
def test_goals_that_are_not_known_speak_by_the_persons_words_alone(rest, on) -> None:
    room, outcome = lived(["lamp"], {"read": "lamp"}, Want("read", 1 - rest))
    assert (room.on, outcome.held) == (on, () if on else ("lamp",))


@pytest.mark.parametrize(("agreed", "on"), [(0.3, ["lamp", "fan"]), (0.5, ["lamp"]), (0.9, [])])
def test_enough_scenarios_must_call_for_it(agreed, on) -> None:
    class Room(Lived):
        def like(self, text, most):
            return [NEAR, FAR]

    Room.agreed = agreed
    room = Room(["lamp", "fan"], {})
    act(room, {}, Want("read", 1.0))
    assert room.on == on


NEAR = Scenario("x-1", "room", "read", (), ("lamp", "books"), ("rug",), ("drum",))
FAR = Scenario("x-2", "room", "play", (), ("drum", "book", "fan"), ("lamps",), ("rug",))


def served(need: str) -> tuple[Action, ...]:
    name = need.removesuffix("s")
    return () if name == "moon" else (Action("switch on", name),)


def test_nearer_scenarios_speak_louder_and_what_is_unwanted_against() -> None:
    assert called_for([], served) == {}
    alone = {actions[0].target: share for actions, share in called_for([NEAR], served).items()}
    assert alone["lamp"] == 1
    assert alone["lamp"] > alone["book"] > alone["rug"] > 0
    assert [*alone] == ["lamp", "book", "rug"]  # what is unwanted is not called for
    both = called_for([NEAR, FAR], served)
    other = called_for([FAR, NEAR], served)
    lamp, drum, rug = ((Action("switch on", name),) for name in ("lamp", "drum", "rug"))
    assert 1 > both[lamp] > other[lamp] > 0.5  # "lamp" and "lamps" are one
    assert both[drum] < 0 < other[drum]
    assert other[rug] < 0


def test_one_of_a_kind_speaks_for_all() -> None:
    def kind(actions: tuple[Action, ...]) -> str:
        return "tea" if "tea" in str(actions) else "flour"

    rye = Scenario("x-1", "", "bake bread", (), ("rye",))
    oats = Scenario("x-2", "", "bake cakes", (), ("oats", "tea"))
    flour = Scenario("x-3", "", "bake scones", (), ("flour",))
    actions = {name: (Action("switch on", name),) for name in ("rye", "oat", "tea", "flour")}
    apart, found = called_for([rye, oats], served), called_for([rye, oats], served, kind)
    assert found[actions["rye"]] == pytest.approx(apart[actions["rye"]] + apart[actions["oat"]])
    assert [found[actions[each]] for each in ("oat", "tea")] == [
        apart[actions[each]] for each in ("oat", "tea")
    ]
    plain = called_for([rye, oats, flour], served, kind)
    assert 1 >= plain[actions["flour"]] > 0.95
    assert plain[actions["oat"]] < 1


def written(text: str, judged: str, *wants: Want) -> tuple[LampRoom, Outcome]:
    """What is done where nothing is known from life: the writer lists what is needed."""
    room = LampRoom(["lamp", "fan"])
    planner = NeedPlanner(Writer(Judges({"read": judged}, text)))
    return room, planner.act(room, wants, HELLO, [], FREE)


def test_the_person_is_told_what_is_held_back() -> None:
    class Torn(NeedPlanner):
        def act(self, env, wants, *rest):
            return super().act(env, [READ, SLEEP], *rest)

    table = {"read": "lamp", "sleep": "pillow"}
    agent = Agent(Lived(["lamp"], table), WordModel())
    plans(agent, Torn(Writer(Judges(table))))
    agent.correct("pin", "read")
    round = agent.step("What?", "more light")
    assert "Held back until it is clear what you want: lamp." in round.notes


@pytest.mark.parametrize(
    ("listed", "judged", "wants", "on", "held"),
    [
        ("needed: fan, moon\nnice: lamp", "fan, lamp", [Want("read", 1.0)], ["fan", "lamp"], ()),
        ("needed: lamp, fan", "lamp", [Want("read", 1.0)], ["lamp"], ()),
        ("needed: lamp", "lamp", [READ, SLEEP], [], ("lamp",)),
    ],
    ids=["all are needed", "one is judged unwanted", "one is wrong for another goal"],
)
def test_without_scenarios_the_writer_lists_and_judges(listed, judged, wants, on, held) -> None:
    room, outcome = written(listed, judged, *wants)
    assert (room.on, outcome.held) == (on, held)


@pytest.mark.parametrize("words", ["", "needed:", "I'm sorry, I can't.", "needed: ,,,\nnice:"])
def test_where_the_writer_lists_nothing_what_is_here_is_judged(words) -> None:
    room, outcome = written(words, "lamp", Want("read", 1.0))
    assert (outcome.failed, room.on) == ((), ["lamp"])
