"""What the things of a house are called: readable names, everyday ones, and groups."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from goalscope.envs.house.simulator.object_types import object_types

__all__ = ["GROUPS", "are", "called", "names", "readable", "the"]

_UNKNOWN = "unknown thing"
"""What a thing of an unknown type is called: its type may be anyone's words."""

_WORDS = {
    "AlarmClock": "alarm clock, clock, alarm",
    "AluminumFoil": "aluminum foil, aluminium foil, foil, tin foil",
    "ArmChair": "armchair, chair",
    "BasketBall": "basketball, ball",
    "Bathtub": "bathtub, tub, bath",
    "BathtubBasin": "bathtub basin, bathtub, tub, bath",
    "Blinds": "blinds, window blinds, shades",
    "Boots": "boots, shoes",
    "ButterKnife": "butter knife, knife, table knife",
    "Cabinet": "cabinet, cupboard, kitchen cabinet",
    "CD": "CD, disc, compact disc, DVD",
    "CellPhone": "phone, cell phone, mobile phone, mobile, smartphone",
    "Cloth": "cloth, rag, dishcloth",
    "CoffeeMachine": "coffee machine, coffee maker, coffee brewer",
    "CoffeeTable": "coffee table, table",
    "CounterTop": "counter, counter top, kitchen counter, kitchen island, island, worktop",
    "CreditCard": "credit card, bank card, card",
    "Cup": "cup, glass, water glass",
    "Curtains": "curtains, drapes",
    "Desk": "desk, table",
    "DeskLamp": "desk lamp, lamp, table lamp, light",
    "Desktop": "desktop computer, computer, desktop, PC",
    "DiningTable": "dining table, table, kitchen table, dinner table",
    "DishSponge": "sponge, dish sponge",
    "Dresser": "dresser, chest of drawers",
    "Dumbbell": "dumbbell, weight",
    "EggCracked": "cracked egg, broken egg",
    "Faucet": "faucet, tap, water faucet, water tap",
    "FloorLamp": "floor lamp, lamp, standing lamp, light",
    "Footstool": "footstool, stool",
    "Fridge": "fridge, refrigerator",
    "GarbageBag": "garbage bag, trash bag, bin bag",
    "GarbageCan": "garbage can, garbage, trash can, trash, trash bin, bin, rubbish bin",
    "HandTowel": "hand towel, towel",
    "HandTowelHolder": "hand towel holder, towel holder",
    "HousePlant": "plant, house plant, potted plant",
    "Kettle": "kettle, tea kettle, tea pot",
    "KeyChain": "keys, key chain, key",
    "Knife": "knife, kitchen knife, sharp knife",
    "Laptop": "laptop, notebook, laptop computer, computer",
    "LaundryHamper": "laundry hamper, hamper, laundry basket",
    "Lettuce": "lettuce, lettuce head, head of lettuce",
    "LightSwitch": "light switch, switch, light, ceiling light, ceiling lamp, overhead light"
    ", main light, big light, room light",
    "Microwave": "microwave, microwave oven, oven",
    "Mug": "mug, coffee mug, coffee cup",
    "Newspaper": "newspaper, paper",
    "Painting": "painting, picture",
    "Pan": "pan, frying pan, skillet",
    "PaperTowelRoll": "paper towel roll, paper towel, roll of paper towel",
    "PepperShaker": "pepper shaker, pepper, shaker",
    "Pillow": "pillow, cushion",
    "Pot": "pot, cooking pot, saucepan",
    "RemoteControl": "remote control, remote, TV remote, control, controller",
    "RoomDecor": "room decoration, decoration",
    "SaltShaker": "salt shaker, salt, shaker",
    "ShelvingUnit": "shelving unit, shelf",
    "ShowerGlass": "shower glass, shower screen",
    "ShowerHead": "shower head, shower",
    "SideTable": "side table, table, end table, night stand, bedside table",
    "Sink": "sink, wash basin, washbasin",
    "SinkBasin": "sink basin, sink, basin, wash basin",
    "SoapBar": "bar of soap, soap bar, soap",
    "SoapBottle": "soap bottle, bottle of soap, soap, dish soap, soap dispenser, liquid soap,"
    " hand soap",
    "Sofa": "sofa, couch",
    "SprayBottle": "spray bottle, spray",
    "Statue": "statue, sculpture, figurine",
    "StoveBurner": "stove burner, stove, burner, stove top, hob, cooker",
    "StoveKnob": "stove knob, knob, burner knob, stove, burner",
    "TVStand": "TV stand, television stand, TV table",
    "TableTopDecor": "table decoration, table top decor, decoration",
    "TeddyBear": "teddy bear, teddy, bear",
    "Television": "TV, television, telly",
    "TennisRacket": "tennis racket, racket",
    "TissueBox": "tissue box, box of tissues, tissues",
    "ToiletPaper": "toilet paper, toilet roll, toilet paper roll",
    "ToiletPaperHanger": "toilet paper hanger, toilet paper holder",
    "Towel": "towel, bath towel",
    "VacuumCleaner": "vacuum cleaner, vacuum, hoover",
    "Watch": "watch, wrist watch",
    "WineBottle": "wine bottle, bottle of wine, wine, bottle",
}
"""Everyday names of a type, the usual one first, where these are not the type's own words."""

GROUPS = {
    "food": "Apple Bread Egg EggCracked Lettuce Potato Tomato",
    "fruit": "Apple Tomato",
    "vegetables": "Lettuce Potato Tomato",
    "dishes": "Bowl Cup Mug Plate",
    "cutlery": "ButterKnife Fork Knife Spoon",
    "utensils": "ButterKnife Fork Knife Ladle Spatula Spoon",
    "cookware": "Kettle Pan Pot",
    "toiletries": "SoapBar SoapBottle TissueBox ToiletPaper",
    "cleaning supplies": "Cloth DishSponge PaperTowelRoll ScrubBrush SprayBottle",
    "sports equipment": "BaseballBat BasketBall Dumbbell TennisRacket",
    "stationery": "Pen Pencil",
    "valuables": "CellPhone CreditCard KeyChain Laptop Watch",
    "electronics": "AlarmClock CellPhone Desktop Laptop RemoteControl Television",
    "appliances": "CoffeeMachine Fridge Microwave Toaster VacuumCleaner",
    "furniture": "ArmChair Bed Chair CoffeeTable Desk DiningTable Dresser Ottoman SideTable Sofa",
}
"""Words for things of several types, and those types."""


def readable(object_type: str) -> str:
    """What to call a thing of this type; of a type that is not known, "unknown thing"."""
    return called(object_type)[0]


def called(object_type: str) -> tuple[str, ...]:
    """All that a thing of this type is called, the usual name first."""
    if object_type in _WORDS:
        return tuple(_WORDS[object_type].split(", "))
    if object_type not in object_types():
        return (_UNKNOWN,)
    if object_type.endswith("Sliced"):
        whole = readable(object_type.removesuffix("Sliced"))
        forms = (f"slice of {whole}", f"{whole} slice", f"sliced {whole}", f"piece of {whole}")
        return (*forms, "toast") if whole == "bread" else forms
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+", object_type)
    words = [part if part.isupper() and 1 < len(part) < 4 else part.lower() for part in parts]
    return (" ".join(words),)


def names(objects: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Object ids and their names in this scene: "egg", or "egg 1" and "egg 2", no name twice."""
    alike: dict[str, list[tuple[str, str]]] = {}
    for each in sorted({str(o["objectId"]): str(o["objectType"]) for o in objects}.items()):
        alike.setdefault(readable(each[1]).casefold(), []).append(each)
    found: dict[str, str] = {}
    for several in alike.values():
        for number, (object_id, object_type) in enumerate(several, 1):
            name = readable(object_type)
            found[object_id] = f"{name} {number}" if len(several) > 1 else name
    return found


def the(name: str) -> str:
    """A name in a sentence: "the egg", but "drawer 2"."""
    return name if name[-1:].isdigit() else f"the {name}"


def are(name: str) -> str:
    """The verb after a name: "is", but "are" after "the keys"."""
    word = name.rstrip(" 0123456789")
    return "are" if word.endswith("s") and not word.endswith("ss") else "is"
