"""Orders and corrections in random words: nothing breaks, and all of it can be taken back."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.grocery.search import Search
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.envs.house.hearing.vocabulary import BASE
from talks import Talk

CATALOGUE = Catalogue(Catalogue.load().items[::10])
SEARCH = Search(CATALOGUE)
SCENES = ("Kitchen1", "LivingRoom1", "Bedroom1", "Bathroom1")
COUNTS = [100, pytest.param(2_000, marks=pytest.mark.slow)]

ORDERS = (
    "add {} {}", "add two {} {}", "I need {} {}", "3 packs of {} {}", "500g of {} {}", "a dozen {}",
    "remove the {} {}", "take the {} out {}", "put the {} back {}", "swap the {} for {}",
    "double the {}", "half the {}", "no {}", "less {}", "more {} {}", "something cheaper than {}",
    "keep only the {}", "clear everything but the {}", "don't add {} {}", "I'm allergic to {}",
    "we are out of {}", "how much is the {}?", "is there any {}?",
)  # fmt: skip
ENDS = ("", "", "please", "instead", "too", "and {}", "instead of {}", "but no {}", "and 2 {}",
        "again", "only", "for six people", "under $5")  # fmt: skip
ANSWERS = (
    "no, two", "actually three", "make that two bottles", "take one out", "remove the last thing",
    "clear everything", "no wait, {}", "oops, the {}", "what do I have?", "I'm vegan", "undo that",
    "forget that I'm vegan", "my budget is 10", "too expensive", "cheaper", "put it back", "fewer",
    "not that one, the {}", "half of it", "one of each", "the {} one", "double it", "yes", "no",
)  # fmt: skip
WHICH = ("the", "a", "both", "all the", "two", "my", "the other", "some", "no", "every")
WHERE = (
    "", "", "on the table", "in the sink", "in the fridge", "next to the lamp", "back", "again",
    "too", "off", "on", "out", "in there", "under the bed", "with water", "to me", "please",
    "and close it", "and put it back", "instead",
)  # fmt: skip
REPLIES = (
    "undo that", "no, the other one", "the other one too", "put it back", "and off again", "again",
    "no, the one on the table", "not that one", "pull it back", "them too", "actually don't",
    "it should be clean", "only one", "both", "what did you do?", "where is it?", "on the floor",
    "stop", "never mind", "yes", "no",
)  # fmt: skip


def words(rng: random.Random, *forms: str) -> str:
    """One of these forms, with things of the shop in it."""
    text = rng.choice(forms)
    while "{}" in text:
        name = rng.choice(CATALOGUE.items).name.lower()
        text = text.replace("{}", rng.choice((name, name.split()[-1], rng.choice(ENDS))), 1)
    return text


@pytest.mark.parametrize("count", COUNTS)
def test_a_basket_filled_in_any_words_is_emptied_by_undoing_all(
    count: int, record_property: Callable[[str, object], None]
) -> None:
    rng = random.Random(9)
    filled = 0
    for _ in range(count):
        shop = GroceryShop(CATALOGUE, search=SEARCH)
        talk = Talk(shop)
        said = [words(rng, *ORDERS), *(words(rng, *ORDERS, *ANSWERS) for _ in range(4))]
        for each in said:
            talk.say(each)
        filled += bool(talk.history)
        talk.say("undo everything")
        assert shop.basket == {}, said
    assert filled > count / 3
    record_property("measured", f"{count:,} talks, {filled:,} that did something: all taken back")


@pytest.mark.parametrize("count", COUNTS)
def test_a_room_changed_in_any_words_is_as_before_or_what_stays_is_told(
    count: int, record_property: Callable[[str, object], None]
) -> None:
    rng = random.Random(9)
    done = told = 0
    for number in range(count):
        robot = HomeRobot(HouseController(SCENES[number % len(SCENES)]))
        talk, before = Talk(robot, "What should I do?"), robot.status()
        kinds = sorted({name.rstrip("0123456789 ") for name in robot.kinds("", 99)})
        said: list[str] = []
        for turn in range(4):
            which = (*WHICH, "the") if turn == 0 else ("it", "them", *WHICH)
            thing = rng.choice(which)
            thing = thing if thing in ("it", "them") else f"{thing} {rng.choice(kinds)}"
            order = f"{rng.choice([*BASE])} {thing} {rng.choice(WHERE)}".strip()
            said.append(order if turn == 0 or rng.random() < 0.5 else rng.choice(REPLIES))
            round = talk.say(said[-1])
            talk.query = round.question or "What should I do?"
        done += bool(talk.history)
        back = talk.say("undo everything")
        stays = [note for note in back.notes if note.startswith("I cannot undo that: ")]
        told += bool(stays)
        assert robot.status() == before or stays, said
    assert done > count / 5
    record_property(
        "measured",
        f"{count:,} talks, {done:,} that did something: all taken back, but for {told:,} of which "
        "it is told what stays",
    )
