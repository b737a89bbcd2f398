"""Scenarios from life: those that ship are sound, and those nearest to words are found."""

import pytest

from corpus import scenario_from_json
from fakes import LampRoom
from goalscope.agent.planner import same_aim
from goalscope.base.types import InvalidInputError, canonical
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.envs.scenarios import Scenario, shipped_scenarios
from goalscope.language.orders import orders_from_text
from goalscope.models.nearest import Nearest
from shops import shop

CAKE = Scenario("a-1", "grocery", "bake a birthday cake", ("It is my son's birthday.",), ("flour",))
CAR = Scenario("a-2", "grocery", "wash the car", ("The car is filthy.",), ("sponge",))
SOUP = Scenario("b-1", "grocery", "cook tomato soup", ("A soup would be nice.",), ("tomatoes",))
THREE = Nearest([CAKE, CAR, SOUP], lambda each: each.texts)
DOMAINS = ("grocery", "house")
RIGHT = {"id": "w", "domain": "grocery", "aim": "eat", "said": ["We eat."], "needed": ["bread"]}


@pytest.mark.parametrize(
    ("text", "nearest"),
    [
        ("The car is filthy.", CAR),
        ("a cake for a birthday", CAKE),
        ("BIRTHDAYS", CAKE),
        ("I would like some hot broth with tomatoes", SOUP),
        ("clean my automobile", CAR),
    ],
)
def test_the_nearest_is_first_by_words_or_by_what_they_mean(text: str, nearest: Scenario) -> None:
    assert THREE(text, 3)[0] == nearest
    assert {*THREE(text, 9)} == {CAKE, CAR, SOUP}


@pytest.mark.parametrize("most", [0, 1, 2, 3, 4])
def test_no_more_are_found_than_asked_for_and_one_can_be_left_out(most: int) -> None:
    assert len(THREE("cake", most)) == min(most, 3)
    found = THREE("cake", most, without=CAKE)
    assert len(found) == min(most, 2)
    assert CAKE not in found
    assert THREE("cake", most, without=Scenario("none such", "", "", (), ())) == THREE("cake", most)


@pytest.mark.parametrize("text", ["", " ", "?!", "xyzzy", "\ud800", "cake " * 3000])
def test_words_that_mean_nothing_here_find_something_all_the_same(text: str) -> None:
    assert len(THREE(text, 2)) == 2


def test_among_none_none_is_found() -> None:
    assert Nearest([], str.split)("cake", 4) == []
    assert shipped_scenarios("garden")("a pond", 4) == []


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("bake a cake for my daughter's birthday", "bake a birthday cake", True),
        ("spring clean the whole house", "clean the whole house", True),
        ("bake a chocolate cake", "bake a gluten-free cake", False),
        ("cook Italian for two", "cook Mexican for two", False),
        ("cook a vegan dinner", "cook a dinner", False),
    ],
)
def test_goals_say_the_same_if_their_words_and_their_scenarios_are_close(
    one: str, other: str, same: bool
) -> None:
    assert same_aim(shop(), one, other) is same_aim(shop(), other, one) is same
    assert not same_aim(LampRoom(), one, other)


def test_opposites_do_not_say_the_same() -> None:
    assert not same_aim(
        HomeRobot(HouseController("Kitchen1")), "turn on the lamp", "turn off the lamp"
    )


def test_a_scenario_that_nobody_told_is_found_by_its_aim() -> None:
    quiet = Scenario("c-1", "grocery", "polish silver spoons", (), ("cloth",))
    assert Nearest([CAKE, quiet], lambda each: each.texts)("silver spoons", 1) == [quiet]


def test_shipped_scenarios_are_many_and_each_is_named_once() -> None:
    found = [each for domain in DOMAINS for each in shipped_scenarios(domain).things]
    assert len(found) > 2000
    assert len({each.id for each in found}) == len(found)
    assert {each.domain for each in found} == {*DOMAINS}


@pytest.mark.parametrize("domain", DOMAINS)
def test_each_shipped_scenario_has_its_lists_and_no_phrase_twice(domain: str) -> None:
    for each in shipped_scenarios(domain).things:
        assert each.said, each.id
        assert each.needed, each.id
        phrases = [*each.needed, *each.nice, *each.unwanted]
        assert len({*map(canonical, phrases)}) == len(phrases), each.id
        assert not any(mark in phrase for phrase in phrases for mark in ",\n:"), each.id
        assert bool(each.room) == (domain == "house"), each.id


def test_what_shipped_scenarios_of_the_house_call_for_are_orders() -> None:
    for each in shipped_scenarios("house").things:
        for phrase in (*each.needed, *each.nice, *each.unwanted):
            (order,) = orders_from_text(phrase, HomeRobot.verbs)
            assert order.what, (each.id, phrase)


def test_the_words_of_a_shipped_scenario_find_it() -> None:
    near = shipped_scenarios("grocery")
    tried = near.things[::40]
    found = sum(each in near(each.said[0], 4) for each in tried)
    assert found > 0.95 * len(tried)
    assert all(each not in near(each.said[0], 4, without=each) for each in tried)


@pytest.mark.parametrize(
    ("data", "cause"),
    [
        (RIGHT | {"id": ""}, "'id' must be a text"),
        (RIGHT | {"id": 3}, "'id' must be a text"),
        (RIGHT | {"domain": None}, "'domain' must be a text"),
        (RIGHT | {"aim": " "}, "'aim' must be a text"),
        (RIGHT | {"said": "We eat."}, "'said' must be a list of texts"),
        (RIGHT | {"needed": [1]}, "'needed' must be a list of texts"),
        (RIGHT | {"nice": [""]}, "'nice' must be a list of texts"),
        (RIGHT | {"unwanted": {"a": 1}}, "'unwanted' must be a list of texts"),
        *((data, "must be an object") for data in ([], 5, None, "eat")),
    ],
)
def test_a_wrong_scenario_is_refused(data: object, cause: str) -> None:
    assert scenario_from_json(RIGHT).needed == ("bread",)
    with pytest.raises(InvalidInputError, match=cause):
        scenario_from_json(data)
