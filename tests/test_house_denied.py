"""What the robot is told not to do, what it is told to spare, and where it is told not to put."""

from __future__ import annotations

import pytest

from heard import heard, told


@pytest.mark.parametrize(
    "said",
    [
        "that apple is for tomorrow, don't eat or throw it away",
        "the egg on the counter is for my cake, don't cook it or throw it away",
        "don't slice the apple or cook it",
        "don't wash, slice or cook the potato",
        "don't close the fridge or open it",
        "Please don't wash the mug or fill it",
        "never slice the bread, or open the fridge",
        "don't wash the mug, slice the apple or open the fridge",
        "I don't want you to wash the mug, slice the apple, or open the fridge",
    ],
)
def test_what_stands_behind_or_is_denied_with_what_stands_before_it(said: str) -> None:
    assert told("Kitchen1", said) == (set(), [], "")


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        ("turn the light off or open the fridge", {"light switch: no longer on", "fridge: open"}),
        ("don't open the fridge, put the apple in the sink", {"apple: now in the sink basin"}),
        ("don't open the fridge, and wash the mug", {"mug 1: no longer dirty"}),
        ("don't forget to wash the mug or the cup", {"mug 1: no longer dirty"}),
        ("don't worry, open the fridge or close the cabinet", {"fridge: open"}),
        ("the mug isn't clean, wash it or close the fridge", {"mug 1: no longer dirty"}),
        ("turn off the light as nobody is here or needs it", {"light switch: no longer on"}),
        ("don't touch anything, just open the fridge or wash the egg", {"fridge: open"}),
        (
            "don't slice the apple, put it in the sink or on the table",
            {"apple: now in the sink basin"},
        ),
        ("I don't like the apple there, put it in the sink", {"apple: now in the sink basin"}),
        ("put the apple in the fridge, no wait, the sink", {"apple: now in the sink basin"}),
        ("put the apple in the fridge. no wait, the sink", {"apple: now in the sink basin"}),
        ("put the apple in the sink, actually on the table", {"apple: now on the dining table"}),
        ("put the bread, I mean the apple, in the sink", {"apple: now in the sink basin"}),
        ("put the bread, no wait, the apple, in the sink", {"apple: now in the sink basin"}),
        ("open the microwave, sorry, the fridge please", {"fridge: open"}),
        ("fill the cup with coffee. no, with water", {"cup: filled with water"}),
        ("throw the bread away, no wait", set[str]()),
        ("turn the light off, no, leave it on", set[str]()),
        ("give me a clean mug", {"mug 2: now in the robot's hand"}),
        ("give the mug a good clean", {"mug 1: no longer dirty"}),
        ("throw away the egg shells, and open the fridge", {"fridge: open"}),
        ("don't open the microwave, no, the fridge", set[str]()),
        ("I hate the apple there, put it in the sink", {"apple: now in the sink basin"}),
        ("I don't want the bread, throw it away", {"bread: now in the garbage can"}),
        ("the bread is old could you throw it away?", {"bread: now in the garbage can"}),
    ],
)
def test_an_order_that_is_not_denied_is_followed(said: str, changes: set[str]) -> None:
    assert told("Kitchen1", said)[0] == changes


@pytest.mark.parametrize(
    ("said", "place"),
    [
        ("Put the apple in the fridge, not in the sink", "in the fridge"),
        ("Put the apple in the fridge, but not in the sink or on the table", "in the fridge"),
        ("put the apple in the fridge, not in the freezer", "in the fridge"),
        ("put the apple in the fridge, careful with the knife, it's sharp", "in the fridge"),
        ("put the apple on the table not on the counter please", "on the dining table"),
        ("put the apple that is not in the fridge in the sink", "in the sink basin"),
        ("carefully put the apple in the sink", "in the sink basin"),
    ],
)
def test_a_place_behind_not_is_none(said: str, place: str) -> None:
    assert told("Kitchen1", said) == ({f"apple: now {place}"}, [], "")


@pytest.mark.parametrize(
    "said",
    [
        "put the bread in the fridge. careful with the wine bottle, don't touch it, it's a gift",
        "put the bread in the fridge, and be careful with the wine bottle: don't move it",
    ],
)
def test_care_is_taken_of_what_is_named_with_it(said: str) -> None:
    hearing = heard(said)
    assert hearing.refuses("put", "WineBottle")
    assert not hearing.refuses("put", "Bread")
    assert told("Kitchen1", said) == ({"bread: now in the fridge"}, [], "")


@pytest.mark.parametrize(
    ("second", "changes"),
    [
        ("put everything back except the apple", {"apple"}),
        ("Put everything back but the apple.", {"apple"}),
        ("put both back except the apple", {"apple"}),
        ("put them back, but not the apple", {"apple"}),
        ("put everything but the apple in the sink", {"apple", "potato 1"}),
        ("put everything back", set[str]()),
    ],
)
def test_what_is_excepted_stays_where_it_is(second: str, changes: set[str]) -> None:
    found, notes, _ = told("Kitchen1", "put the apple and a potato in the fridge", second)
    assert found == {f"{name}: now in the fridge" for name in changes}
    assert bool(notes) == ("in the sink" in second)


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        ("the apple is old, could you throw it away?", {"apple: now in the garbage can"}),
        ("The mug is dirty so can you wash it", {"mug 1: no longer dirty"}),
        ("how would you clean the mug?", set[str]()),
        ("if the fridge is closed, can you open it?", set[str]()),
        (
            "the apple belongs in the sink, and so does the fork",
            {"apple: now in the sink basin", "fork: now in the sink basin"},
        ),
    ],
)
def test_an_order_may_stand_behind_what_it_is_about(said: str, changes: set[str]) -> None:
    assert told("Kitchen1", said)[0] == changes


def test_what_follows_a_place_behind_not_is_done() -> None:
    said = "put the fork in the sink, not on the table, and the plate on the table"
    assert told("Kitchen1", said)[0] == {
        "fork: now in the sink basin",
        "plate 1: now on the dining table",
    }


@pytest.mark.parametrize(
    "said",
    [
        "wash the mug, careful with the plate, then put it in the sink",
        "wash the mug. Be careful with the plate or you'll break it! Now put it in the sink.",
    ],
)
def test_a_warning_orders_nothing(said: str) -> None:
    assert told("Kitchen1", said) == ({"mug 1: no longer dirty, now in the sink basin"}, [], "")


@pytest.mark.parametrize(
    ("said", "changes", "lost"),
    [
        ("put all mugs except mug 2 in the sink", set[str](), ""),
        (
            "put the apple in the fridge and everything else in the sink",
            {"apple: now in the fridge"},
            "everything else in the sink",
        ),
    ],
)
def test_what_is_said_of_the_rest_and_not_understood_is_told(
    said: str, changes: set[str], lost: str
) -> None:
    assert told("Kitchen1", said) == (changes, [f"I did not understand: {lost or said}."], "")


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        ("put all fruit but the apple in the fridge", {"tomato: now in the fridge"}),
        ("put the bread anywhere but on the floor", set[str]()),
        ("throw away the bread, but be careful with the knife and the fork",
         {"bread: now in the garbage can"}),
        ("don't cry, wash the mug or open the fridge", {"mug 1: no longer dirty", "fridge: open"}),
    ],
)  # fmt: skip
def test_what_is_spared_warned_of_or_soothed_changes_nothing_else(
    said: str, changes: set[str]
) -> None:
    assert told("Kitchen1", said)[0] == changes


@pytest.mark.parametrize(
    ("said", "left"),
    [
        (["put two eggs in the sink", "put one of them back"], {"egg 2: now in the sink basin"}),
        (["put two eggs in the sink", "put them back"], set[str]()),
        (["put one egg on the table and one egg in the sink", "put them back"], set[str]()),
    ],
)
def test_of_what_was_counted_as_many_go_back_as_are_meant(said: list[str], left: set[str]) -> None:
    assert told("Kitchen1", *said)[0] == left


def test_what_is_ordered_by_name_is_not_excepted_by_its_kind() -> None:
    said = "turn off the desk lamp but not the light"
    assert told("LivingRoom1", said)[0] == {"desk lamp: no longer on"}


def test_what_is_excepted_may_be_ordered_later() -> None:
    said = ["put the apple and the egg in the fridge", "put everything back but the apple"]
    assert told("Kitchen1", *said, "put the apple in the sink")[0] == {
        "apple: now in the sink basin"
    }
    assert told("Kitchen1", *said, "no, the apple too") == (set(), [], "")
    assert told("Kitchen1", *said, "put everything back") == (set(), [], "")


@pytest.mark.parametrize(
    ("said", "changes", "question"),
    [
        ("crack an egg into the pan and fry it", {"egg 1: now on the pan"}, "May I break egg 1?"),
        ("crack the egg in the fridge", set[str](), "May I break egg 1?"),
        ("make me a coffee in mug 1", {"mug 1: filled with coffee"}, ""),
        (
            "The dirty mug should go in the sink and be washed.",
            {"mug 1: no longer dirty, now in the sink basin"},
            "",
        ),
        ("put the apple in the fridge and close it a bit", {"apple: now in the fridge"}, ""),
    ],
)
def test_what_is_to_be_done_where_it_is_put(said: str, changes: set[str], question: str) -> None:
    assert told("Kitchen1", said) == (changes, [], question)


@pytest.mark.parametrize(
    ("said", "note"),
    [
        ("take the plates off the table", "There is no plate at the dining table."),
        ("bring me the dirty plate", "There is no dirty plate here."),
        ("bring me the sliced bread", "There is no slice of bread here."),
    ],
)
def test_what_cannot_be_fetched_is_told(said: str, note: str) -> None:
    assert told("Kitchen1", said) == (set(), [note], "")
