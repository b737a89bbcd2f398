"""What happens by itself in the house: heat, cold, water, coffee, and what goes along."""

from __future__ import annotations

import json
import math

import pytest

from houses import do, house, named, run, thing

BY_ITSELF = """
OpenObject Fridge; PickupObject Apple; PutObject Fridge -> Apple temperature="Cold"
PickupObject Apple; PutObject Pan -> Apple isCooked=false temperature="RoomTemp"
ToggleObjectOn StoveKnob -> Pan temperature="Hot"
ToggleObjectOn StoveKnob:1 -> Pan temperature="RoomTemp"
ToggleObjectOn StoveKnob; PickupObject Potato; PutObject Pan -> Potato isCooked=true
ToggleObjectOn StoveKnob; PickupObject Potato; PutObject Pan -> Potato temperature="Hot"
PickupObject Potato; PutObject Pan; ToggleObjectOn StoveKnob -> Potato isCooked=true
ToggleObjectOn StoveKnob; PickupObject Apple; PutObject Pan -> Apple isCooked=false
PickupObject Potato; PutObject Pan; PickupObject Pan; ToggleObjectOn StoveKnob -> Potato \
isCooked=false
SliceObject Bread; PickupObject BreadSliced; PutObject Toaster -> BreadSliced isCooked=false
SliceObject Bread; PickupObject BreadSliced; PutObject Toaster; ToggleObjectOn Toaster -> \
BreadSliced isCooked=true temperature="Hot"
OpenObject Microwave; PickupObject Potato; PutObject Microwave -> Potato isCooked=false
OpenObject Microwave; PickupObject Potato; PutObject Microwave; CloseObject Microwave; \
ToggleObjectOn Microwave -> Potato isCooked=true temperature="Hot"
PickupObject Mug; PutObject CoffeeMachine -> Mug isFilledWithLiquid=false
PickupObject Mug; PutObject CoffeeMachine; ToggleObjectOn CoffeeMachine -> Mug \
isFilledWithLiquid=true fillLiquid="coffee" temperature="Hot"
PickupObject Mug; PutObject CoffeeMachine; FillObjectWithLiquid Mug fillLiquid="wine"; \
ToggleObjectOn CoffeeMachine -> Mug fillLiquid="wine" temperature="RoomTemp"
PickupObject Mug:1; PutObject SinkBasin -> Mug:1 isDirty=true isFilledWithLiquid=false
PickupObject Mug:1; PutObject SinkBasin; ToggleObjectOn Faucet -> Mug:1 isDirty=false \
isFilledWithLiquid=true fillLiquid="water"
ToggleObjectOn Faucet; PickupObject Mug:1; PutObject SinkBasin; ToggleObjectOff Faucet; \
EmptyLiquidFromObject Mug:1 -> Mug:1 isFilledWithLiquid=false
DirtyObject Plate; ToggleObjectOn Faucet -> Plate isDirty=true
PickupObject Mug:1; PutObject CounterTop; ToggleObjectOn Faucet -> Mug:1 isDirty=true
BreakObject Mug:1 -> Mug:1 isBroken=true isDirty=true
"""
"""Steps in Kitchen1, and what then is so."""


@pytest.mark.parametrize("row", BY_ITSELF.strip().splitlines())
def test_heat_cold_water_and_coffee_do_their_work_at_once(row: str) -> None:
    steps, _, states = row.partition(" -> ")
    words, *pairs = states.split()
    found = thing(do(house(), steps), words)
    wanted = {key: json.loads(value) for key, value in (pair.split("=") for pair in pairs)}
    assert {key: found[key] for key in wanted} == wanted


def test_coffee_is_emptied_and_brewed_anew() -> None:
    home = do(house(), "PickupObject Mug; PutObject CoffeeMachine; ToggleObjectOn CoffeeMachine")
    do(home, "EmptyLiquidFromObject Mug; Pass")
    assert thing(home, "Mug")["fillLiquid"] == "coffee"


def test_a_tap_fills_nothing_that_is_closed_and_only_its_own_basin() -> None:
    home = house("Bathroom1")
    do(
        home,
        "DirtyObject Cloth; PickupObject Cloth; PutObject BathtubBasin; ToggleObjectOn Faucet:1",
    )
    assert thing(home, "Cloth")["isDirty"]
    do(home, "ToggleObjectOn Faucet")
    assert not thing(home, "Cloth")["isDirty"]


def test_a_tap_rinses_no_counter_around_its_basin() -> None:
    home = house()
    basin = thing(home, "SinkBasin")
    old, new = basin["objectId"], "SinkBasin|+01.40|+00.80|+03.66"
    home.state.objects = {
        (new if own == old else own): {**each, "objectId": new} if own == old else each
        for own, each in home.state.objects.items()
    }
    home.state.attach(home.state.objects[new], [named(home, "CounterTop")])
    do(home, "PickupObject Mug:1; PutObject CounterTop; ToggleObjectOn Faucet")
    assert thing(home, "Mug:1")["isDirty"]


@pytest.mark.parametrize(
    ("steps", "words", "temperature", "stays"),
    [
        ("PickupObject Egg", "Egg", "Cold", False),
        ("ToggleObjectOn StoveKnob; PickupObject Pan", "Pan", "Hot", False),
        ('FillObjectWithLiquid Cup fillLiquid="coffee"', "Cup", "Hot", False),
        ("OpenObject Fridge", "Egg", "Cold", True),
        ("ToggleObjectOn StoveKnob", "Pan", "Hot", True),
        ("ToggleObjectOn StoveKnob; ToggleObjectOff StoveKnob", "Pan", "Hot", True),
    ],
)
def test_what_leaves_heat_or_cold_has_the_rooms_temperature_after_ten_seconds(
    steps: str, words: str, temperature: str, stays: bool
) -> None:
    home = do(house(), steps)
    home.advance(9.9)
    assert thing(home, words)["temperature"] == temperature
    for seconds in [5.0] * 10 if stays else [0.2]:
        home.advance(seconds)
    assert thing(home, words)["temperature"] == (temperature if stays else "RoomTemp")


def test_the_clock_runs_with_every_action_that_succeeds() -> None:
    home = house()
    for _ in range(5):
        run(home, "OpenObject Fridge")
    assert home.metadata()["currentTime"] == pytest.approx(0.02)
    home.advance(3)
    assert home.metadata()["currentTime"] == pytest.approx(3.02)


def test_slices_of_what_is_cooked_and_cold_are_so_too() -> None:
    home = do(house(), "CookObject Potato; SliceObject Potato; SliceObject Lettuce")
    assert thing(home, "PotatoSliced")["isCooked"]
    assert thing(home, "LettuceSliced")["temperature"] == "Cold"
    assert thing(home, "LettuceSliced")["parentReceptacles"] == [named(home, "Fridge")]


def test_what_lies_in_a_carried_thing_goes_with_it_at_any_depth() -> None:
    home = do(house(), "OpenObject Microwave; PickupObject SaltShaker; PutObject Mug")
    do(home, "PickupObject Mug; PutObject Bowl")
    do(home, "PickupObject Bowl; PutObject Plate; PickupObject Plate; PutObject Microwave")
    plate, bowl, mug = (named(home, kind) for kind in ("Plate", "Bowl", "Mug"))
    oven, counter = thing(home, "Microwave"), named(home, "CounterTop:1")
    assert oven["parentReceptacles"] == [counter]
    assert thing(home, "SaltShaker")["parentReceptacles"] == sorted(
        [plate, bowl, mug, oven["objectId"]]
    )
    assert math.dist(*(thing(home, kind)["position"].values() for kind in ("Mug", "Plate"))) < 0.3


def test_a_scenes_one_sided_list_carries_at_any_depth() -> None:
    home = do(house(), "PickupObject SaltShaker; PutObject Mug:1; PickupObject Mug:1")
    do(home, "PutObject Plate")
    plate, salt = thing(home, "Plate"), thing(home, "SaltShaker")
    plate["receptacleObjectIds"] = [named(home, "Mug:1")]
    do(home, "PickupObject Plate; Teleport x=1 rotation=90")
    assert abs(salt["position"]["x"] - plate["position"]["x"]) < 0.3
