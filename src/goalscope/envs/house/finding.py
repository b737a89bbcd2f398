"""Which of the things here a phrase means, what is true of them, and which not to touch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from goalscope.base.nouns import contains, head_words, singular, singulars, words
from goalscope.envs import Pick
from goalscope.envs.house.simulator.object_types import STATES as AFFORDANCES
from goalscope.envs.house.simulator.state import is_whole
from goalscope.envs.house.view import ENDED, STATES, View, are, called, the
from goalscope.language.dialogue_state import DialogueState, exceptions
from goalscope.language.orders import Order

EVERYTHING = "everything"
"""What names all that is here."""

_ADJECTIVES = (
    ("open", "openable", "isOpen", True),
    ("closed", "openable", "isOpen", False),
    ("lit", "toggleable", "isToggled", True),
    ("on", "toggleable", "isToggled", True),
    ("unlit", "toggleable", "isToggled", False),
    ("dirty", "dirtyable", "isDirty", True),
    ("clean", "dirtyable", "isDirty", False),
    ("full", "canFillWithLiquid", "isFilledWithLiquid", True),
    ("empty", "canFillWithLiquid", "isFilledWithLiquid", False),
    ("cooked", "cookable", "isCooked", True),
    ("raw", "cookable", "isCooked", False),
    ("hot", "pickupable", "temperature", "Hot"),
    ("cold", "pickupable", "temperature", "Cold"),
)
"""For each adjective: the affordance that it needs, the state, and its value."""

_ANYTHING = frozenset({"anything", "everything", "something", "thing", "still", "left", "else"})
"""Words that with an adjective mean all things in that state."""

_TOLD = 6
"""Things that an answer tells of at most."""

_INSIDE = 5
"""Things in or on one that an answer names at most."""

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


@dataclass(frozen=True, slots=True)
class Found:
    """What a phrase means.

    Attributes:
        things: Ids, the likeliest first; also of what is now in slices or in pieces.
        every: Whether all of them are meant.
        there: Whether they are in or on the place that was named with them; the nearest to it come
            first where not. A place that is not here counts for nothing.
        name: What the phrase was taken for: a name of their kinds.
    """

    things: tuple[str, ...] = ()
    every: bool = False
    there: bool = True
    name: str = ""


class Finder:
    """Finds things by the words for them.

    Args:
        view: The house.
        pick: Finds which of several names is meant.
    """

    def __init__(self, view: View, pick: Pick) -> None:
        self.view = view
        self.pick = pick
        self.kinds = _kinds(view)

    def find(self, said: str, where: str = "") -> Found:
        """What a phrase means, among what is at the place that is named with it if anything is."""
        if said[-1:].isdigit() and (numbered := self._numbered(said)) is not None:
            return self._near(Found(numbered), where)
        if said.casefold() == EVERYTHING:
            return self._near(Found(tuple(self.view.table), every=True), where)
        table = self.view.table
        rest = {*singulars(said)} - _ANYTHING
        if state := next((each for each in _ADJECTIVES if rest == {each[0]}), None):
            _, needs, key, value = state
            things = [own for own in table if table[own][needs] and table[own][key] == value]
            return self._near(Found(tuple(things), every=True, name=state[0]), where)
        name = self.pick(said, list(self.kinds))
        kinds = self.kinds.get(name, ())
        things = [own for kind in kinds for own in table if table[own]["objectType"] == kind]
        things = self._described(said, name, things)
        return self._near(Found(tuple(things), _is_every(said, name), name=name), where)

    def _numbered(self, said: str) -> tuple[str, ...] | None:
        """The thing of a numbered name, such as "burner 3"; None if no such things are numbered.

        It is empty if there are fewer of them.
        """
        if own := self.view.id(said.casefold()):
            return (own,)
        *kind, number = singulars(said)
        numbered = {
            own: [singulars(each) for each in called(self.view.table[own]["objectType"])]
            for own, name in self.view.names.items()
            if name[-1].isdigit()
        }
        same = [own for own, names in numbered.items() if kind in names] or [
            own
            for own, names in numbered.items()
            if any(name[-len(kind) :] == kind for name in names)
        ]
        if not kind or not same:
            return None
        return tuple(own for own in same if self.view.names[own].endswith(f" {number}"))[:1]

    def _described(self, said: str, name: str, things: list[str]) -> list[str]:
        """Those in the states that are named besides the kind."""
        table = self.view.table
        for word in words(said):
            if singular(word) in singulars(name):
                continue
            states = {
                state: those
                for state, needs, key, value in _ADJECTIVES
                if (those := [o for o in things if table[o][needs] and table[o][key] == value])
                and len(those) < len(things)
            }
            things = states.get(self.pick(word, list(states)) if states else "", things)
        return things

    def _near(self, found: Found, where: str) -> Found:
        """Those in or on a place; all of them, the nearest to it first, where none is."""
        if not where or not found.things:
            return found
        table = self.view.table
        places = {*self.find(where).things} - {*found.things}
        if there := _in(self.view, found.things, places):
            return replace(found, things=there)

        if not places:
            return found

        def distance(own: str) -> float:
            here = table[own]["position"].values()
            return min(math.dist(here, table[place]["position"].values()) for place in places)

        things = sorted(found.things, key=distance)
        return replace(found, things=tuple(things), there=False)


def facts_of(finder: Finder, question: Order) -> str:
    """One sentence for each thing that is meant, with its place and state; at most six."""
    what, where = question.what, question.where
    found = finder.find(what or where, where if what else "")
    view = finder.view
    gone = [own for own in found.things if not is_whole(view.table[own])]
    things = [*gone, *remains(view, found.things)]
    if not things:
        none = "Nothing is" if found.name and not found.things else "There is no"
        return f"{none} {found.name or what or where:.60} here."
    told = [f"{len(things)} in all."] * (question.about == "count")
    told += [_fact(view, own) for own in things[:_TOLD]]
    if len(things) > _TOLD:
        told.append(f"There are {len(things) - _TOLD} more.")
    return " ".join(told)


def _fact(view: View, own: str) -> str:
    thing, name = view.table[own], the(view.names[own])
    if not is_whole(thing):
        fate = "sliced" if thing["isSliced"] else "broken"
        return f"{name[0].upper()}{name[1:]} {are(name)} {fate}."
    facts = [
        word if thing[key] else ENDED[key]
        for key, word in STATES
        if thing[key] or (key in ENDED and thing[AFFORDANCES[key]])
    ]
    if thing["canFillWithLiquid"]:
        liquid = thing["fillLiquid"] or "a liquid"
        facts.append(f"full of {liquid}" if thing["isFilledWithLiquid"] else "empty")
    facts += [thing["temperature"].lower()] if thing["temperature"] != "RoomTemp" else []
    facts += [view.where(thing)] if thing["pickupable"] else []
    text = f"{name} {are(name)} {_listed(facts or [view.where(thing)])}"
    inside = [each for each in thing["receptacleObjectIds"] or () if each in view.table]
    names = sorted(view.names[each] for each in inside if is_whole(view.table[each]))
    if names:
        more = [f"{len(names) - _INSIDE} more"] * (len(names) > _INSIDE)
        held = _listed([*map(the, names[:_INSIDE]), *more])
        text += f"; {view.in_or_on(view.names[own])} it: {held}"
    return f"{text[0].upper()}{text[1:]}."


def _listed(parts: list[str]) -> str:
    return " and ".join(filter(None, (", ".join(parts[:-1]), *parts[-1:])))


def remains(view: View, things: Sequence[str]) -> list[str]:
    """The things that are whole, and the pieces of those that are not."""
    gone = {own for own in things if not is_whole(view.table[own])}
    pieces = [own for own in view.table if own.rpartition("|")[0] in gone]
    return [own for own in dict.fromkeys((*things, *pieces)) if own not in gone]


def bound(view: View, dialogue: DialogueState) -> set[str]:
    """Ids of what nobody may touch: what is to be left alone or must not come."""
    limits = (*dialogue.untouched, *(each for each in dialogue.limits if each.do == "avoid"))
    found = {own for limit in limits for own in _covered(view, limit)}
    return found | {own for own in view.table if own.rpartition("|")[0] in found}


def asked_about(view: View, dialogue: DialogueState) -> set[str]:
    """Ids of the things that the person has ordered something to be done with."""
    return {own for order in dialogue.asked for own in worded(view, order.what)}


def _covered(view: View, limit: Order) -> Sequence[str]:
    """What a limit names, by its words alone: where in doubt, more."""
    every = limit.what.casefold() == EVERYTHING or (limit.where and not limit.what)
    things = tuple(view.table) if every else worded(view, limit.what)
    things = _in(view, things, {*worded(view, limit.where)}) or things
    spared = {own for each in exceptions(limit) for own in worded(view, each)}
    return [own for own in things if own not in spared]


def worded(view: View, said: str) -> Sequence[str]:
    """What is called so; or else what is called so among other words, or with fewer words."""
    phrase = singulars(said)
    kinds = _kinds(view)
    alike = {name: singulars(name) for name in (*kinds, *view.names.values())}
    same = {name for name, each in alike.items() if each == phrase}
    near = {
        name
        for name, each in alike.items()
        if contains(each, phrase) or (phrase and phrase[-len(each) :] == each)
    }
    names = same or near
    types = {kind for name in names for kind in kinds.get(name, ())}
    return [
        own
        for own, thing in view.table.items()
        if thing["objectType"] in types or view.names[own] in names
    ]


def _in(view: View, things: Sequence[str], places: set[str]) -> tuple[str, ...]:
    """Those of the things that are in or on one of the places."""
    return tuple(own for own in things if places & {*(view.table[own]["parentReceptacles"] or ())})


def _kinds(view: View) -> dict[str, tuple[str, ...]]:
    """What the things here may be called, and the types of each name, the likeliest first."""
    types = dict.fromkeys(each["objectType"] for each in view.objects)
    ranked: dict[str, list[tuple[int, str]]] = {}
    for kind in types:
        for rank, name in enumerate(called(kind)):
            ranked.setdefault(name, []).append((rank, kind))
    kinds = {name: tuple(kind for _, kind in sorted(each)) for name, each in ranked.items()}
    for name, group in GROUPS.items():
        if here := tuple(kind for kind in group.split() if kind in types):
            kinds.setdefault(name, here)
    return kinds


def _is_every(said: str, name: str) -> bool:
    """Whether a phrase names several things: by its plural, or by a group such as food.

    What is always plural, such as keys, is one thing.
    """
    head = next(reversed(head_words(said)), "")
    plural = singular(head) != head and (name in GROUPS or head not in words(name))
    return plural or (name in GROUPS and singular(name) == name)
