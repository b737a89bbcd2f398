"""What people call the things of a house: readable names, other words for them, groups."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

from goalscope.envs.grocery.words import singular, singulars
from goalscope.envs.house.simulator.object_types import object_types
from goalscope.envs.speech import misspelt

__all__ = ["GROUPS", "OF_IT", "Naming", "are", "mentioned", "names", "naming", "readable"]
__all__ += ["synonyms", "the"]

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
    "DiningTable": "dining table, table, kitchen table, dinner table, dinning table",
    "DishSponge": "sponge, dish sponge",
    "Dresser": "dresser, chest of drawers",
    "Dumbbell": "dumbbell, weight",
    "EggCracked": "cracked egg, broken egg",
    "Faucet": "faucet, tap, water faucet, water tap",
    "FloorLamp": "floor lamp, lamp, standing lamp, light",
    "Footstool": "footstool, stool",
    "Fridge": "fridge, refrigerator, frig, ice box",
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
    "Plate": "plate, dish",
    "Pot": "pot, cooking pot, saucepan",
    "Potato": "potato, potatoe",
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
    "Tomato": "tomato, tomatoe",
    "Towel": "towel, bath towel",
    "VacuumCleaner": "vacuum cleaner, vacuum, hoover",
    "Watch": "watch, wrist watch",
    "WineBottle": "wine bottle, bottle of wine, wine, bottle",
}
"""What people say for a type, the usual name first, where that is not the type's own words."""

GROUPS = {
    **dict.fromkeys(
        ("electronics", "electronic device", "gadget"),
        "AlarmClock CellPhone Desktop Laptop RemoteControl Television",
    ),
    "food": "Apple Bread Egg EggCracked Lettuce Potato Tomato",
    "fruit": "Apple Tomato",
    **dict.fromkeys(("vegetable", "veggie"), "Lettuce Potato Tomato"),
    **dict.fromkeys(("dishware", "crockery"), "Bowl Cup Mug Plate"),
    "dishes": "Bowl Cup Mug Plate",
    "tableware": "Bottle Bowl Cup Mug PepperShaker Plate SaltShaker WineBottle",
    **dict.fromkeys(("drinkware", "drinking vessel"), "Bottle Cup Mug"),
    **dict.fromkeys(("cutlery", "silverware", "flatware"), "ButterKnife Fork Knife Spoon"),
    **dict.fromkeys(
        ("utensil", "kitchen utensil", "kitchen tool"),
        "ButterKnife Fork Knife Ladle Spatula Spoon",
    ),
    "cookware": "Kettle Pan Pot",
    **dict.fromkeys(("condiment", "spice"), "PepperShaker SaltShaker"),
    **dict.fromkeys(("valuables", "valuable thing"), "CellPhone CreditCard KeyChain Laptop Watch"),
    **dict.fromkeys(
        ("cleaning supplies", "cleaning product", "cleaning thing"),
        "Cloth DishSponge PaperTowelRoll ScrubBrush SoapBar SoapBottle SprayBottle",
    ),
    **dict.fromkeys(
        ("toiletries", "bathroom supplies"), "SoapBar SoapBottle TissueBox ToiletPaper"
    ),
    **dict.fromkeys(
        ("sports equipment", "sporting goods", "sports gear"),
        "BaseballBat BasketBall Dumbbell TennisRacket",
    ),
    **dict.fromkeys(("stationery", "writing utensil", "writing tool"), "Pen Pencil"),
    **dict.fromkeys(("reading material", "things to read"), "Book Newspaper"),
    "doors": "Cabinet Fridge Microwave Safe",
    "lights": "DeskLamp FloorLamp LightSwitch",
    "lamps": "DeskLamp FloorLamp",
    "appliances": "CoffeeMachine Fridge Microwave Toaster VacuumCleaner",
    "furniture": "ArmChair Bed Chair CoffeeTable Desk DiningTable Dresser Ottoman SideTable Sofa",
}
"""Words for several types at once. A word given in the plural alone is a group only so."""


@dataclass(frozen=True, slots=True)
class Naming:
    """Words that name types of things.

    Attributes:
        types: The types that they may name; a group's are all meant.
        end: Where in the list of words the naming ends.
        plural: Whether the last word is a plural.
        group: Whether the words name a group, such as "food".
        guessed: Whether the word is taken for another that is spelt much like it.
    """

    types: tuple[str, ...]
    end: int
    plural: bool
    group: bool = False
    guessed: bool = False


def readable(object_type: str) -> str:
    """What to call a thing of this type; of a type that is not known, "unknown thing"."""
    return _called(object_type)[0]


def synonyms(object_type: str) -> tuple[str, ...]:
    """Other words for a thing of this type."""
    return _called(object_type)[1:]


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


def mentioned(text: str, objects: Iterable[Mapping[str, Any]]) -> list[str]:
    """Readable types of the things here that `text` speaks of, in its order."""
    here = {str(o["objectType"]) for o in objects}
    words = re.findall(r"[a-z0-9']+", text.casefold())
    found: dict[str, None] = {}
    start = 0
    while start < len(words):
        named = naming(words, start, here)
        for object_type in named.types if named else ():
            whole = object_type.removesuffix("Sliced")
            if object_type in here or whole in here:
                found[readable(object_type if object_type in here else whole)] = None
        start = named.end if named else start + 1
    return list(found)


def naming(words: Sequence[str], start: int, here: Iterable[str] = ()) -> Naming | None:
    """The longest naming of known types, or of those `here`, that begins at `words[start]`."""
    known, strange = _vocabulary(), _strange(frozenset(here))
    for end in range(min(start + 5, len(words)), start, -1):
        span = words[start:end]
        if several := _groups().get("".join(span)):
            return Naming(several, end, plural=True, group=True)
        key = "".join(map(singular, span))
        guessed = end == start + 1 and key not in known and key not in strange
        if guessed:
            key = misspelt(key, _single_words())
        if words[end : end + 1] and words[end] in OF_IT:
            continue
        if types := known.get(key) or strange.get(key):
            noun = span[span.index("of") - 1] if "of" in span[1:] else span[-1]
            return Naming(types, end, plural=singular(noun) != noun, guessed=guessed)
    return None


OF_IT = frozenset({
    "core", "cores", "peel", "peels", "skin", "skins", "shell", "shells", "grounds", "pie", "pies",
    "juice", "cake", "sauce", "soup", "salad", "seed", "seeds", "stem", "stems", "crumb", "crumbs",
    "crust", "crusts", "carton", "cartons", "wrapper", "wrappers", "packaging",
})  # fmt: skip
"""What is no longer the thing whose name stands before it: "egg shells"."""


def _called(object_type: str) -> tuple[str, ...]:
    """The usual name first."""
    if object_type in _WORDS:
        return tuple(_WORDS[object_type].split(", "))
    if object_type in object_types() and object_type.endswith("Sliced"):
        whole = readable(object_type.removesuffix("Sliced"))
        loaf = ("toast",) if whole == "bread" else ()
        return (
            f"slice of {whole}",
            *(f"{whole} slice", f"sliced {whole}", f"piece of {whole}", f"{whole} piece"),
            *(f"slice of {a} {whole}" for a in ("the", "a", "that")),
            *(form for toast in loaf for form in (toast, f"slice of {toast}", f"piece of {toast}")),
        )
    if object_type not in object_types():
        return (_UNKNOWN,)
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+", object_type)
    words = [part if part.isupper() and 1 < len(part) < 4 else part.lower() for part in parts]
    return (" ".join(words),)


@cache
def _groups() -> dict[str, tuple[str, ...]]:
    """The types of each group word, in both numbers and without spaces."""
    found: dict[str, tuple[str, ...]] = {}
    for name, types in GROUPS.items():
        key = name.replace(" ", "")
        for form in (key, f"{key}s", f"{key.removesuffix('y')}ies"):
            found[form] = tuple(types.split())
    return found


@cache
def _vocabulary() -> dict[str, tuple[str, ...]]:
    return _keyed(object_types())


@cache
def _single_words() -> frozenset[str]:
    return frozenset(key for types in object_types() for key in map(singular, _called(types)))


@lru_cache(maxsize=8)
def _strange(types: frozenset[str]) -> dict[str, tuple[str, ...]]:
    """The words for types that are in a scene and not among AI2-THOR's."""
    return _keyed(sorted(types - object_types().keys()))


def _keyed(types: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Types by what they are called, in the singular and without spaces; the usual one first."""
    found: dict[str, tuple[str, ...]] = {}
    for object_type in types:
        for key in dict.fromkeys("".join(singulars(name)) for name in _called(object_type)):
            is_usual = key == "".join(singulars(readable(object_type)))
            others = found.get(key, ())
            found[key] = (object_type, *others) if is_usual else (*others, object_type)
    return found
