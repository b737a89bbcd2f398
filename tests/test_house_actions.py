"""AI2-THOR's actions: what each changes, when it fails, and that a failure changes nothing."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

from goalscope.envs.house.simulator.geometry import box_of
from goalscope.envs.house.simulator.world import ACTIONS
from houses import act, changes, do, facts, house, named, run, thing

PLACES = ("position", "rotation", "axisAlignedBoundingBox")

EFFECTS = """
Kitchen1: OpenObject Cabinet
    Cabinet isOpen=true openness=1.0
Kitchen1: OpenObject Drawer openness=0.25
    Drawer isOpen=true openness=0.25
Kitchen1: OpenObject Drawer; OpenObject Drawer openness=0.5
    Drawer openness=0.5
Kitchen1: OpenObject Drawer; OpenObject Drawer openness=0
    Drawer isOpen=false openness=0.0
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
Kitchen1: PullObject Chair moveMagnitude="200"
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
{id} is not an Openable object
    Kitchen1: OpenObject Apple
Object already open
    Kitchen1: OpenObject Fridge; OpenObject Fridge
Target must be OFF to open!
    Kitchen1: ToggleObjectOn Microwave; OpenObject Microwave
Please give an open percentage between 0.0f and 1.0f
    Kitchen1: OpenObject Fridge openness=1.01
object already closed
    Kitchen1: CloseObject Fridge
{id} must have the property CanPickup to be picked up.
    Kitchen1: PickupObject Fridge
Agent hand has something in it already! Can't pick up anything else
    Kitchen1: PickupObject Egg; PickupObject Apple
{id} is not visible and can't be picked up.
    Kitchen1: PickupObject Knife forceAction=false
    Kitchen1: SliceObject Apple; PickupObject Apple
Can't place an object if Agent isn't holding anything
    Kitchen1: PutObject CounterTop
No valid Receptacle found
    Kitchen1: PickupObject Apple; PutObject objectId="Nowhere|+1|+1|+1"
    Kitchen1: PickupObject Mug; PutObject Bowl; PickupObject Bowl; PutObject Mug
This target object is NOT a receptacle!
    Kitchen1: PickupObject Apple; PutObject Potato
Target openable Receptacle is CLOSED, can't place if target is not open!
    Kitchen1: PickupObject Apple; PutObject Drawer
{id} is full right now
    Kitchen1: PickupObject Bowl; PutObject StoveBurner
{held} is not a valid Object Type to be placed in {id}
    Kitchen1: PickupObject Cup; PutObject CoffeeMachine
{held} cannot be placed in {id}
    Kitchen1: PickupObject Egg; PutObject StoveBurner:1 forceAction=false
No valid positions to place object found
    Kitchen1: PickupObject Pan; PutObject Bowl; PickupObject Plate; PutObject Bowl
Nothing in hand to drop!
    Kitchen1: DropHandObject
Target object {id} is not Moveable or Pickupable, it can't be pushed or pulled.
    Kitchen1: PushObject Fridge
Target object is in the agent's hand, it can't be pushed or pulled.
    Kitchen1: PickupObject Egg; PushObject Egg
object is not toggleable.
    Kitchen1: ToggleObjectOn Apple
target object is controlled by another sim object. target object cannot be turned on/off directly
    Kitchen1: ToggleObjectOn StoveBurner
can't toggle object on if it's already on!
    Kitchen1: ToggleObjectOn Faucet; ToggleObjectOn Faucet
can't toggle object off if it's already off!
    Kitchen1: ToggleObjectOff Faucet
Target must be closed to Toggle On!
    Kitchen1: OpenObject Microwave; ToggleObjectOn Microwave
Target is broken and cannot be Toggled On!
    LivingRoom1: BreakObject Television; ToggleObjectOn Television
milk is not a valid Liquid Type
    Kitchen1: FillObjectWithLiquid Cup fillLiquid="milk"
{id} does not have CanBeFilled property!
    Kitchen1: FillObjectWithLiquid Apple fillLiquid="water"
{id} cannot be filled with wine
    Kitchen1: FillObjectWithLiquid Pot fillLiquid="wine"
{id} cannot be filled with coffee
    Kitchen1: EmptyLiquidFromObject WineBottle; FillObjectWithLiquid WineBottle fillLiquid="coffee"
{id} is already Filled!
    Kitchen1: FillObjectWithLiquid WineBottle fillLiquid="wine"
object already empty
    Kitchen1: EmptyLiquidFromObject Cup
{id} Does not have the CanBeSliced property!
    Kitchen1: SliceObject Plate
    Kitchen1: SliceObject Bread; SliceObject Bread:1
target object cannot be sliced if it is in the agent's hand
    Kitchen1: PickupObject Apple; SliceObject Apple
object not found: {id}
    Kitchen1: SliceObject Apple; SliceObject Apple
    Kitchen1: OpenObject Microwave forceAction=false
{id} is too far away to be interacted with
    Kitchen1: OpenObject Fridge forceAction=false
{id} is not interactable and (perhaps it is occluded by something).
    Kitchen1: Teleport x=2.25 z=3.0; DirtyObject Plate:1 forceAction=false
{id} does not have the CanBeCooked property!
    Kitchen1: CookObject Plate
{id} is already Toasted!
    Kitchen1: CookObject Potato; CookObject Potato
{id} does not have the CanBreak property!!
    Kitchen1: BreakObject Fridge
{id} is already broken!
    Kitchen1: BreakObject Plate; BreakObject Plate
{id} does not have dirtyable property!
    Kitchen1: DirtyObject Fridge
{id} is already dirty!
    Kitchen1: DirtyObject Mug:1
{id} is already Clean!
    Kitchen1: CleanObject Plate
{id} does not have CanBeUsedUp property!
    Kitchen1: UseUpObject Fridge
object already used up!
    Kitchen1: UseUpObject PaperTowelRoll; UseUpObject PaperTowelRoll
Something is in the way of the agent.
    Kitchen1: Teleport z=3.25; MoveAhead forceAction=false
    Kitchen1: Teleport x=2.25; MoveBack moveMagnitude=2 forceAction=false
Cannot teleport to (99.00, 0.90, 2.50): it is outside the room, or something stands there.
    Kitchen1: Teleport x=99 forceAction=false
Cannot teleport to (0.50, 0.90, 3.60): it is outside the room, or something stands there.
    Kitchen1: Teleport position={"x":0.5,"z":3.6} forceAction=false
horizon must be between -30 and 60
    Kitchen1: Teleport horizon=61 forceAction=false
"""
"""What leads to each message."""


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
FAILURE_ROWS = [(step, message) for message, steps in table(FAILURES) for step in steps]


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


@pytest.mark.parametrize(("steps", "message"), FAILURE_ROWS, ids=[row[0] for row in FAILURE_ROWS])
def test_a_failure_has_its_message_and_changes_nothing(steps: str, message: str) -> None:
    scene, _, line = steps.partition(": ")
    *before, last = line.split("; ")
    home = do(house(scene), *before)
    own = named(home, last.split()[1]) if " " in last and "=" not in last.split()[1] else ""
    start = facts(home)
    metadata = run(home, last)
    assert not metadata["lastActionSuccess"]
    assert metadata["errorMessage"] == message.format(id=own, held=home.state.held)
    assert facts(home) == start


def test_every_action_has_its_effect_in_these_tests() -> None:
    elsewhere = {"SliceObject", "Teleport"}
    elsewhere |= {"MoveAhead", "MoveLeft", "MoveRight", "RotateLeft", "RotateRight"}
    tested = {row[0].split("; ")[-1].split(": ")[-1].split()[0] for row in EFFECT_ROWS}
    assert tested | elsewhere == set(ACTIONS)


BAD_ARGUMENTS = [
    ("Dance", {}, "InvalidAction", "Dance is not an action."),
    (None, {}, "InvalidAction", "None is not an action."),
    (["Pass"], {}, "InvalidAction", "['Pass'] is not an action."),
    ("OpenObject", {}, "MissingArguments", "OpenObject needs the argument 'objectId'."),
    ("FillObjectWithLiquid", {"objectId": "Cup"}, "MissingArguments", "'fillLiquid'"),
    ("OpenObject", {"objectId": "Cup", "opennes": 1}, "InvalidArgument", "no argument 'opennes'"),
    ("OpenObject", {"objectId": None}, "InvalidArgument", "Object ID appears to be invalid."),
    ("OpenObject", {"objectId": ["Cup"]}, "InvalidArgument", "Object ID appears to be invalid."),
    ("OpenObject", {"objectId": "Cup"}, None, "Object ID appears to be invalid."),
    ("PickupObject", {"objectId": "Cup"}, None, "Object ID appears to be invalid."),
    ("GetInteractablePoses", {"objectId": "Cup"}, None, "Object ID appears to be invalid."),
    ("Teleport", {"standing": 1}, "InvalidArgument", "standing must be true or false, not 1"),
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


ODD = [math.nan, math.inf, 10**400, 1e9, True, "1", [], [None], {}, object()]


@pytest.mark.parametrize("odd", ODD, ids=lambda odd: type(odd).__name__ + repr(odd)[:8])
@pytest.mark.parametrize(
    ("name", "argument"),
    [
        ("OpenObject Fridge", "openness"),
        ("MoveAhead", "moveMagnitude"),
        ("RotateLeft", "degrees"),
        ("Teleport", "position"),
        ("Teleport", "x"),
        ("Teleport", "horizon"),
        ("PushObject Chair", "moveMagnitude"),
        ("FillObjectWithLiquid Cup", "fillLiquid"),
    ],
)
def test_an_odd_argument_is_refused_or_means_nothing(name: str, argument: str, odd: Any) -> None:
    home = house()
    start = facts(home)
    metadata = act(home, *name.split(), **{argument: odd})
    numbers = isinstance(odd, str | bool) and name.startswith("Push")
    nothing = odd == {} and argument == "position"
    if not numbers and not nothing:
        assert metadata["errorMessage"]
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
