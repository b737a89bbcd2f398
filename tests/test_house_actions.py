"""AI2-THOR's actions: what each changes, what fails, and what then happens by itself."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

from goalscope.envs.house.simulator.state import box_of
from goalscope.envs.house.simulator.world import ACTIONS
from houses import changes, do, facts, house, named, run, thing

PLACES = ("position", "rotation", "axisAlignedBoundingBox")

EFFECTS = """
Kitchen1: OpenObject Cabinet
    Cabinet isOpen=true openness=1.0
Kitchen1: OpenObject Drawer openness=0.25
    Drawer isOpen=true openness=0.25
Kitchen1: OpenObject Drawer; OpenObject Drawer openness=0.5
    Drawer openness=0.5
Kitchen1: OpenObject Cabinet; CloseObject Cabinet
    Cabinet isOpen=false openness=0.0
Kitchen1: PickupObject SaltShaker
    SaltShaker isPickedUp=true parentReceptacles=null
    DiningTable receptacleObjectIds=["Bowl","Mug:1","PepperShaker"]
Kitchen1: PickupObject SaltShaker; PutObject Plate
    SaltShaker isPickedUp=false parentReceptacles=["Cabinet","Plate"]
    Plate receptacleObjectIds=["SaltShaker"]
    Cabinet receptacleObjectIds=["Plate","Plate:1","SaltShaker"]
Bedroom1: PickupObject Watch; DropHandObject
    Watch isPickedUp=false parentReceptacles=["Floor"]
    Floor receptacleObjectIds=[...,"Watch"]
Kitchen1: PushObject Chair
    Chair
Kitchen1: PullObject Chair
    Chair
LivingRoom1: ToggleObjectOn Television
    Television isToggled=true
LivingRoom1: ToggleObjectOff FloorLamp
    FloorLamp isToggled=false
Kitchen1: ToggleObjectOn StoveKnob:3
    StoveKnob:3 isToggled=true
    StoveBurner:1 isToggled=true
Kitchen1: ToggleObjectOn StoveKnob:3; ToggleObjectOff StoveKnob:3
    StoveKnob:3 isToggled=false
    StoveBurner:1 isToggled=false
Kitchen1: FillObjectWithLiquid Cup fillLiquid="wine"
    Cup isFilledWithLiquid=true fillLiquid="wine"
Kitchen1: FillObjectWithLiquid Cup fillLiquid="coffee"
    Cup isFilledWithLiquid=true fillLiquid="coffee" temperature="Hot"
Kitchen1: EmptyLiquidFromObject WineBottle
    WineBottle isFilledWithLiquid=false fillLiquid=null
Kitchen1: CookObject Potato
    Potato isCooked=true
Kitchen1: DirtyObject Plate
    Plate isDirty=true
Kitchen1: CleanObject Mug:1
    Mug:1 isDirty=false
Kitchen1: UseUpObject PaperTowelRoll
    PaperTowelRoll isUsedUp=true
Kitchen1: BreakObject Plate
    Plate isBroken=true parentReceptacles=null
    Cabinet receptacleObjectIds=["Plate:1"]
Kitchen1: BreakObject WineBottle
    WineBottle isBroken=true isFilledWithLiquid=false fillLiquid=null parentReceptacles=null
    Shelf receptacleObjectIds=[]
LivingRoom1: BreakObject Laptop
    Laptop isBroken=true isToggled=false
Kitchen1: Pass
Kitchen1: GetReachablePositions
Kitchen1: GetInteractablePoses Toaster
Kitchen1: MoveBack
"""
"""What the last action changes, besides places; [..., x] adds x to what was there."""

FAILURES = """
Kitchen1: OpenObject Apple
Kitchen1: OpenObject Fridge; OpenObject Fridge
Kitchen1: ToggleObjectOn Microwave; OpenObject Microwave
Kitchen1: OpenObject Fridge openness=1.01
Kitchen1: CloseObject Fridge
Kitchen1: PickupObject Fridge
Kitchen1: PickupObject Egg; PickupObject Apple
Kitchen1: SliceObject Apple; PickupObject Apple
Kitchen1: PickupObject Apple; PutObject objectId="Nowhere|+1|+1|+1"
Kitchen1: PickupObject Mug; PutObject Bowl; PickupObject Bowl; PutObject Mug
Kitchen1: PickupObject Apple; PutObject Drawer
Kitchen1: PickupObject Bowl; PutObject StoveBurner
Kitchen1: PickupObject Cup; PutObject CoffeeMachine
Kitchen1: PickupObject Egg; PutObject StoveBurner:1 forceAction=false
Kitchen1: PickupObject Pan; PutObject Bowl; PickupObject Plate; PutObject Bowl
Kitchen1: DropHandObject
Kitchen1: PushObject Fridge
Kitchen1: ToggleObjectOn Apple
Kitchen1: ToggleObjectOn StoveBurner
Kitchen1: ToggleObjectOn Faucet; ToggleObjectOn Faucet
Kitchen1: OpenObject Microwave; ToggleObjectOn Microwave
LivingRoom1: BreakObject Television; ToggleObjectOn Television
Kitchen1: FillObjectWithLiquid Cup fillLiquid="milk"
Kitchen1: FillObjectWithLiquid Pot fillLiquid="wine"
Kitchen1: EmptyLiquidFromObject WineBottle; FillObjectWithLiquid WineBottle fillLiquid="coffee"
Kitchen1: FillObjectWithLiquid WineBottle fillLiquid="wine"
Kitchen1: EmptyLiquidFromObject Cup
Kitchen1: SliceObject Bread; SliceObject Bread:1
Kitchen1: PickupObject Apple; SliceObject Apple
Kitchen1: OpenObject Fridge forceAction=false
Kitchen1: Teleport x=2.25 z=3.0; DirtyObject Plate:1 forceAction=false
Kitchen1: CookObject Potato; CookObject Potato
Kitchen1: BreakObject Fridge
Kitchen1: DirtyObject Fridge
Kitchen1: CleanObject Plate
Kitchen1: UseUpObject PaperTowelRoll; UseUpObject PaperTowelRoll
Kitchen1: Teleport z=3.25; MoveAhead forceAction=false
Kitchen1: Teleport x=2.25; MoveBack moveMagnitude=2 forceAction=false
Kitchen1: Teleport position={"x":0.5,"z":3.6} forceAction=false
Kitchen1: Teleport horizon=61 forceAction=false
""".strip().splitlines()
"""Steps of which the last one fails."""


def table(text: str) -> list[tuple[str, list[str]]]:
    """Each line that begins at the margin, with the indented ones below it."""
    found: list[tuple[str, list[str]]] = []
    for line in text.strip().splitlines():
        if line.startswith(" "):
            found[-1][1].append(line.strip())
        else:
            found.append((line, []))
    return found


EFFECT_ROWS = table(EFFECTS)


@pytest.mark.parametrize(("steps", "expected"), EFFECT_ROWS, ids=[row[0] for row in EFFECT_ROWS])
def test_an_action_changes_what_it_says_and_nothing_else(steps: str, expected: list[str]) -> None:
    scene, _, line = steps.partition(": ")
    *before, last = line.split("; ")
    home = do(house(scene), *before)
    start = facts(home)
    old = {each["objectId"]: each for each in start["objects"]}
    wanted: dict[tuple[str, str], Any] = {}
    places: set[str] = set()
    for words, *states in (each.split() for each in expected):
        own = named(home, words)
        places.add(own)
        for key, text in (state.split("=", 1) for state in states):
            value = json.loads(text.replace("[...,", '["...",'))
            if isinstance(value, list):
                kept = old[own][key] if "..." in value else []
                value = sorted([*kept, *(named(home, each) for each in value if each != "...")])
            wanted[own, key] = value
    metadata = run(home, last)
    assert metadata["lastActionSuccess"]
    assert (metadata["errorMessage"], metadata["errorCode"]) == ("", None)
    assert metadata["lastAction"] == last.split()[0]
    found = changes(start, metadata)
    assert {key: value for key, value in found.items() if key[1] not in PLACES} == wanted
    assert {own for own, key in found if key in PLACES} <= places


@pytest.mark.parametrize("steps", FAILURES)
def test_a_failure_says_why_and_changes_nothing(steps: str) -> None:
    scene, _, line = steps.partition(": ")
    *before, last = line.split("; ")
    home = do(house(scene), *before)
    start = facts(home)
    metadata = run(home, last)
    assert not metadata["lastActionSuccess"]
    assert metadata["errorMessage"]
    assert metadata["errorCode"] != "InvalidAction"
    assert facts(home) == start


def test_every_action_has_its_effect_in_these_tests() -> None:
    elsewhere = {"SliceObject", "Teleport"}
    elsewhere |= {"MoveAhead", "MoveLeft", "MoveRight", "RotateLeft", "RotateRight"}
    tested = {row[0].split("; ")[-1].split(": ")[-1].split()[0] for row in EFFECT_ROWS}
    assert tested | elsewhere == set(ACTIONS)


BAD_ARGUMENTS = [
    ("Dance", {}, "InvalidAction", "Dance is not an action."),
    (["Pass"], {}, "InvalidAction", "['Pass'] is not an action."),
    ("OpenObject", {}, "MissingArguments", "OpenObject needs the argument 'objectId'."),
    ("FillObjectWithLiquid", {"objectId": "Cup"}, "MissingArguments", "'fillLiquid'"),
    ("OpenObject", {"objectId": "Cup", "opennes": 1}, "InvalidArgument", "no argument 'opennes'"),
    ("OpenObject", {"objectId": None}, "InvalidArgument", "Object ID appears to be invalid."),
    ("OpenObject", {"objectId": "Cup"}, None, "Object ID appears to be invalid."),
    ("GetInteractablePoses", {"objectId": "Cup"}, None, "Object ID appears to be invalid."),
    ("Teleport", {"standing": 1}, "InvalidArgument", "standing must be true or false, not 1"),
    ("Teleport", {"x": math.nan}, "InvalidArgument", "x must be a number"),
]


@pytest.mark.parametrize(("name", "arguments", "code", "message"), BAD_ARGUMENTS)
def test_bad_arguments_have_an_error_code(
    name: Any, arguments: dict[str, Any], code: str | None, message: str
) -> None:
    home = house()
    start = facts(home)
    metadata = home.step({"action": name, **arguments})
    assert metadata["errorCode"] == code
    assert message in metadata["errorMessage"]
    assert facts(home) == start


@pytest.mark.parametrize(
    ("kind", "pieces"),
    [
        ("Apple", ["AppleSliced"] * 3),
        ("Bread", ["Bread"] + ["BreadSliced"] * 6),
        ("Egg", ["EggCracked"]),
        ("Lettuce", ["LettuceSliced"] * 7),
        ("Potato", ["PotatoSliced"] * 8),
        ("Tomato", ["TomatoSliced"] * 7),
    ],
)
def test_slices_lie_where_the_whole_thing_lay(kind: str, pieces: list[str]) -> None:
    home = house()
    before = set(home.state.objects)
    whole = thing(home, kind)
    parents = whole["parentReceptacles"]
    do(home, f"SliceObject {kind}")
    new = [own for own in home.state.objects if own not in before]
    ids = [f"{whole['objectId']}|{piece}_{n}" for n, piece in enumerate(pieces)]
    assert (new, whole["isSliced"], whole["parentReceptacles"]) == (ids, True, None)
    assert not whole["visible"]
    for own, piece in zip(ids, pieces, strict=True):
        each = home.state.objects[own]
        assert (each["objectType"], each["parentReceptacles"]) == (piece, parents)
        assert (each["sliceable"], each["isSliced"]) == (False, False)
        assert each["temperature"] == whole["temperature"]
        assert all(own in home.state.objects[parent]["receptacleObjectIds"] for parent in parents)
        assert box_of(whole).distance(box_of(each).center[0], box_of(each).center[2]) == 0


def test_a_broken_egg_is_a_cracked_egg() -> None:
    home = do(house(), "PickupObject Egg", "BreakObject Egg")
    egg = home.state.objects[named(home, "Egg")]
    cracked = thing(home, "EggCracked")
    assert egg["isBroken"]
    assert home.state.held is None
    assert (egg["parentReceptacles"], egg["isPickedUp"]) == (None, False)
    assert cracked["parentReceptacles"]


def test_what_stood_on_a_broken_plate_stays_where_the_plate_was() -> None:
    home = do(house(), "PickupObject Apple; PutObject Plate; BreakObject Plate")
    assert thing(home, "Apple")["parentReceptacles"] == [named(home, "Cabinet")]
    home = do(house(), "PickupObject Apple; PutObject Plate; Teleport x=1; PickupObject Plate")
    do(home, "BreakObject Plate")
    assert thing(home, "Apple")["parentReceptacles"] == [named(home, "Floor")]
    assert box_of(thing(home, "Apple")).low(1) < 0.2


BY_ITSELF = """
OpenObject Fridge; PickupObject Apple; PutObject Fridge -> Apple temperature="Cold"
PickupObject Apple; PutObject Pan -> Apple isCooked=false temperature="RoomTemp"
ToggleObjectOn StoveKnob -> Pan temperature="Hot"
ToggleObjectOn StoveKnob:1 -> Pan temperature="RoomTemp"
ToggleObjectOn StoveKnob; PickupObject Potato; PutObject Pan -> Potato isCooked=true
PickupObject Potato; PutObject Pan; ToggleObjectOn StoveKnob -> Potato temperature="Hot"
ToggleObjectOn StoveKnob; PickupObject Apple; PutObject Pan -> Apple isCooked=false
PickupObject Potato; PutObject Pan; PickupObject Pan; ToggleObjectOn StoveKnob -> Potato \
isCooked=false
SliceObject Bread; PickupObject BreadSliced; PutObject Toaster -> BreadSliced isCooked=false
SliceObject Bread; PickupObject BreadSliced; PutObject Toaster; ToggleObjectOn Toaster -> \
BreadSliced isCooked=true temperature="Hot"
OpenObject Microwave; PickupObject Potato; PutObject Microwave; CloseObject Microwave; \
ToggleObjectOn Microwave -> Potato isCooked=true temperature="Hot"
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


def test_a_tap_fills_nothing_that_is_closed_and_only_its_own_basin() -> None:
    home = house("Bathroom1")
    do(
        home,
        "DirtyObject Cloth; PickupObject Cloth; PutObject BathtubBasin; ToggleObjectOn Faucet:1",
    )
    assert thing(home, "Cloth")["isDirty"]
    do(home, "ToggleObjectOn Faucet")
    assert not thing(home, "Cloth")["isDirty"]


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
