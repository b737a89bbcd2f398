"""What holds after all that was said is a pure fold over readings."""

from hypothesis import given
from hypothesis import strategies as st

from goalscope.language.dialogue_state import DialogueState, fold
from goalscope.language.orders import DIALOGUE_ACTS, Order, Reading, Verb, orders_from_text

VERBS = (Verb("add", "have it", ("what", "quantity")), Verb("swap", "change", ("what", "for")))
ANY = st.builds(
    Order,
    st.sampled_from(["add", "swap", *(act.name for act in DIALOGUE_ACTS)]),
    st.sampled_from(["nuts", "milk", "oat milk", ""]),
    st.none() | st.just(2.0),
    for_=st.sampled_from(["", "nuts", "my son"]),
    why=st.sampled_from(["", "taste", "allergy", "diet"]),
)
READINGS = st.lists(
    st.lists(ANY, max_size=3).map(lambda orders: Reading(tuple(orders))), max_size=6
)


def read(*texts: str) -> list[Reading]:
    return [Reading(orders_from_text(text, VERBS)) for text in texts]


def limits(dialogue: DialogueState) -> list[str]:
    return [limit.what for limit in dialogue.limits]


def test_limits_stand_until_something_lifts_them() -> None:
    assert limits(fold(read("avoid nuts", "add milk"))) == ["nuts"]
    assert limits(fold(read("avoid mushrooms | why taste", "add mushrooms"))) == []
    assert limits(fold(read("avoid bread", "swap milk | for rye bread"))) == []
    assert limits(fold(read("avoid rye bread", "add bread"))) == ["rye bread"]


def test_an_order_lifts_no_allergy_and_no_diet() -> None:
    for why in ("allergy", "diet"):
        said = read(f"avoid nuts | for my son | why {why}", "add nuts")
        dialogue = fold(said)
        assert limits(dialogue) == ["nuts"]
        assert dialogue.forbids(Order("add", "mixed nuts")) == dialogue.limits[0]
        assert limits(fold(said, released=[(), (), (Order("add", "nuts"),)])) == ["nuts"]
        confirmed = fold(
            [*said, Reading((Order("yes"),))], released=[(), (), (Order("add", "nuts"),)]
        )
        assert limits(confirmed) == []


def test_what_takes_a_thing_away_lifts_nothing() -> None:
    for limit in ("avoid nuts | why allergy", "avoid nuts | why taste"):
        said = read(limit, "add nuts")
        for released in ((), [(), (Order("add", "nuts"),)]):
            assert limits(fold(said, released=released, takes_away={"add"})) == ["nuts"]


def test_undoing_leaves_readings_out_but_no_allergy() -> None:
    said = read("avoid nuts | why allergy\nadd milk", "budget | 30 $\navoid pork", "undo | 2")
    dialogue = fold(said, retracted={0, 1})
    assert (limits(dialogue), dialogue.budget, dialogue.asked) == (["nuts"], None, ())


def test_a_milder_word_does_not_weaken_an_allergy() -> None:
    (limit,) = fold(read("avoid nuts | why allergy", "avoid nuts | why taste")).limits
    assert limit.why == "allergy"


def test_one_person_need_not_follow_anothers_diet_nor_weakens_their_allergy() -> None:
    said = read("avoid nuts | why allergy", "avoid nuts | for my sister | why diet")
    assert [each.why for each in fold(said).limits] == ["allergy", "diet"]


def test_the_kind_without_it_lifts_no_limit() -> None:
    for why in ("taste", "allergy"):
        order = Order("add", "nut-free granola")
        said = [*read(f"avoid nuts | why {why}"), Reading((order,))]
        assert limits(fold(said, released=[(), (order,)])) == ["nuts"]


def test_what_waits_counts_for_nothing_but_an_allergy_does() -> None:
    said = read("avoid mushrooms | why taste", "add mushrooms\navoid nuts | why allergy")
    dialogue = fold(said, waiting=[(), said[1].orders])
    assert (limits(dialogue), dialogue.asked) == (["mushrooms", "nuts"], ())


def test_the_newest_budget_holds_and_what_is_left_alone_is_known() -> None:
    dialogue = fold(read("budget | 30 $\nleave milk", "budget | 20 $"))
    assert dialogue.budget == Order("budget", quantity=20, unit="$")
    assert [order.what for order in dialogue.untouched] == ["milk"]
    assert fold(read("leave milk", "swap milk | for oat milk")).untouched == ()


@given(READINGS, st.sets(st.integers(0, 5)))
def test_no_allergy_is_ever_lost_unless_confirmed(readings: list[Reading], gone: set[int]) -> None:
    told = {
        order.what
        for reading in readings
        for order in reading.orders
        if order.do == "avoid" and order.why == "allergy" and order.what
    }
    dialogue = fold(readings, retracted=gone)
    assert told <= {limit.what for limit in dialogue.limits if limit.why in ("allergy", "diet")}


@given(READINGS, st.sets(st.integers(0, 5)))
def test_the_fold_depends_on_nothing_but_its_arguments(
    readings: list[Reading], gone: set[int]
) -> None:
    assert fold(readings, retracted=gone) == fold(list(readings), retracted=set(gone))
    kept = [each for place, each in enumerate(readings) if place not in gone]
    assert fold(readings, retracted=gone).asked == fold(kept).asked
