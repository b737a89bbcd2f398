"""The shop as an environment: a basket that is filled, emptied and bought."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from decimal import Decimal

from goalscope import envs
from goalscope.base.nouns import head_nouns, names, singulars
from goalscope.base.types import Action, Profile, StepResult
from goalscope.envs import Checks, Pick, Proactive, Resolution, State
from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.choosing import MOST, Choice, packages, without_percentage
from goalscope.envs.grocery.dietary import Bounds, diets_of, refusal
from goalscope.envs.grocery.diets import diet_named
from goalscope.envs.grocery.profiles import checks_met, unwanted
from goalscope.envs.grocery.search import Search
from goalscope.envs.scenarios import Scenario, shipped_scenarios
from goalscope.language.amounts import same_currency
from goalscope.language.dialogue_state import DialogueState
from goalscope.language.orders import Order, Verb, with_examples

__all__ = ["NAMES", "GroceryShop"]

NAMES = (envs.SEARCH, "add item", "remove item", "buy basket")
"""What can be done here."""

_AT_ONCE = 8
"""Things that are guessed at once at most: what is left of a budget must do for all of them."""

_SHOWN = 10
"""Items that the action `search inventory` lists."""

_MENTIONS = 4
"""Most things that a question is answered for besides the one that was read."""

_WHOLE = frozenset({
    "basket", "cart", "total", "budget", "order", "price", "cost", "bill", "money", "everything",
    "it", "all",
})  # fmt: skip
"""Words for the basket as a whole."""


class GroceryShop(Proactive):
    """The world of a shopping agent (Sec. 4.2).

    Orders use `verbs`. The actions are `search inventory` (the target is a term), `add item` and
    `remove item` (the target is an item's exact name, with a quantity from 1 to 99), and `buy
    basket`. After the purchase, only searching is possible until `reset`.
    """

    task = (
        "The agent is a shopping agent that is supposed to make purchases for the human. "
        "Its task is to identify a basket of groceries that matches the human's preferences."
    )
    verbs = (
        Verb("add", "put into the basket", ("what", "quantity", "for", "where")),
        Verb("remove", "take out of the basket", ("what", "quantity"), takes_away=True),
        Verb("set", "have exactly so many of it in the basket", ("what", "quantity")),
        Verb("swap", "take one thing out for another", ("what", "quantity", "for")),
        Verb("clear", "empty the basket", ()),
        Verb(
            "buy",
            "buy the basket, now",
            (),
            irreversible=True,
            ends=True,
            phrase="Buy the basket",
        ),
    )
    agreed = 0.45

    def __init__(self, catalogue: Catalogue, *, search: Search | None = None) -> None:
        """Open the shop with an empty basket; `search` shares an index between shops."""
        self.catalogue = catalogue
        self.verbs = with_examples(type(self).verbs, "goalscope.envs.grocery")
        self._search = search or Search(catalogue)
        self._choice = Choice(catalogue, self._search)
        self._basket: dict[str, int] = {}
        self._taken_out: set[str] = set()
        self._bought = False

    @property
    def basket(self) -> dict[str, int]:
        """A copy of the basket: quantities by item name, in the order of adding."""
        return dict(self._basket)

    @property
    def bought(self) -> bool:
        """Whether the basket has been purchased."""
        return self._bought

    @property
    def total(self) -> Decimal:
        """Price of the basket; items without a price count as 0."""
        return sum((i.price * n for i, n in self._contents() if i.price is not None), Decimal(0))

    def reset(self) -> None:
        """Empty the basket, not bought."""
        self._basket.clear()
        self._taken_out.clear()
        self._bought = False

    def offers(self, text: str, limit: int) -> list[str]:
        """Generic names such as "flour" that may serve `text`, nearest first."""
        return self._search.kinds(text, limit)

    def state(self) -> State:
        """The basket with quantities, prices and the total, one item a line."""
        return State(self._status(), f"{sorted(self._basket.items())} {self._bought}")

    def _status(self) -> str:
        if not self._basket:
            return "The basket is empty."
        lines = ["Purchased:" if self._bought else "The basket holds:"]
        for item, number in self._contents():
            price = None if item.price is None else item.price * number
            lines.append(f"- {number} x {item.name}: {self.catalogue.money(price)}")
        lines.append(f"Total: {self.catalogue.money(self.total)}")
        return "\n".join(lines)

    def actions(self, name: str, dialogue: DialogueState) -> list[Action]:
        """Additions for a generic name that the basket does not cover yet, best first.

        Excludes what was ruled out, for whomever it was, what once left the basket, and what takes
        too large a share of the remaining budget.
        """
        if self._bought or any(
            each.do == "avoid" and names(name, each.what) for each in dialogue.limits
        ):
            return []
        bounds = self._bounds(dialogue)
        most = None if bounds.budget is None else (bounds.budget - self.total) / _AT_ONCE
        found = self._choice.offers(name, bounds, {*self._basket, *self._taken_out})
        return [
            Action("add item", item.name)
            for item in found
            if most is None or (item.price or 0) <= most
        ]

    def kind(self, action: Action) -> str:
        """See `Proactive.kind`: the last word of a name, where it alone means such a thing."""
        item = self.catalogue.get(action.target)
        heads = head_nouns(item.name) if item else []
        plain = next(iter(self._search.search(heads[-1], 1)), None) if heads else None
        if not (item and plain and plain.category == item.category):
            return str(action)
        return heads[-1] if head_nouns(plain.name)[-1:] == heads[-1:] else str(action)

    def like(self, text: str, most: int) -> list[Scenario]:
        """See `Proactive.like`."""
        return shipped_scenarios("grocery")(text, most)

    def resolve(self, order: Order, dialogue: DialogueState, pick: Pick) -> Resolution:
        """See `Environment.resolve`: limits remove violations.

        It warns of what comes and is not known to fit the diets.
        """
        bounds = self._bounds(dialogue)
        found = self._resolved(without_percentage(order), bounds, dialogue, pick)
        coming = (self.catalogue.get(a.target) for a in found.actions if a.name == "add item")
        return replace(found, warning=bounds.unknown(filter(None, coming)))

    def _resolved(
        self, order: Order, bounds: Bounds, dialogue: DialogueState, pick: Pick
    ) -> Resolution:
        if order.do == "undo":
            return self._undo(dialogue.to_undo, bounds)
        if self._bought:
            return Resolution(why="The basket is bought already.")
        match order.do:
            case "add" | "set":
                return self._add(order, bounds, dialogue)
            case "remove":
                return self._remove(order, pick)
            case "swap":
                return self._swap(order, bounds, dialogue, pick)
            case "clear":
                return Resolution(tuple(self._out(self._contents())), self._if_empty())
            case "buy":
                buys = (Action("buy basket", irreversible=True),) if self._basket else ()
                nothing = "There is nothing to buy: the basket is empty."
                return Resolution(buys, "" if buys else nothing)
            case "budget":
                return Resolution(why=self._unset(order) or self._over(bounds))
            case "avoid" | "only":
                return self._bind(order, bounds, dialogue)
            case _:
                return Resolution()

    def _undo(self, results: Sequence[StepResult], bounds: Bounds) -> Resolution:
        """What takes out what `results` put in, and puts back what they took out.

        What is ruled out stays out.
        """
        if self._bought:
            return Resolution(why="The purchase cannot be undone.")
        moved: dict[str, int] = {}
        for result in results:
            sign = {"add item": -1, "remove item": 1}.get(result.action.name, 0)
            name = result.action.target
            moved[name] = moved.get(name, 0) + sign * result.action.quantity
        items = [item for name in moved if (item := self.catalogue.get(name))]
        out = [item for item in items if moved[item.name] > 0 and not bounds.permits(item)]
        told = [f"{item.name} stays out: {bounds.against(item)}." for item in out]
        moved |= {item.name: 0 for item in out}
        held = self._basket
        steps = [_change(name, max(n, -held.get(name, 0))) for name, n in moved.items() if n]
        actions = tuple(step for step in steps if step.quantity)
        nothing = "" if actions else "Nothing in the basket has to change for that."
        return Resolution(actions, " ".join(told) or nothing)

    def answer(self, order: Order, dialogue: DialogueState, pick: Pick, said: str) -> str:
        """The facts about a thing, such as its price and labels; by default, about the basket."""
        bounds = self._bounds(dialogue)
        about = " ".join(word for word in singulars(order.what) if word not in _WHOLE)
        if self._basket and (diet := diet_named(about)):
            return bounds.told(diet, (item for item, _ in self._contents()))
        if about:
            others = (
                n for n in self._choice.mentions(said)[:_MENTIONS] if not names(order.what, n)
            )
            facts = [self._choice.facts(n, self._basket, bounds) for n in (order.what, *others)]
            return "\n".join(facts)
        told = [self._status()]
        if bounds.budget is not None:
            named, left = self.catalogue.money(bounds.budget), bounds.budget - self.total
            money = self.catalogue.money(abs(left))
            told.append(
                f"That is {money} above the {named} that you named."
                if left < 0
                else f"That leaves {money} of the {named} that you named."
            )
        if bounds.diets:
            told.append(f"All of it has to be {' and '.join(sorted(bounds.diets))}.")
        if bounds.some:
            told.append(f"For some, it has to be {' and '.join(sorted(bounds.some))}.")
        if bounds.refused:
            told.append(f"You want no {', no '.join(bounds.refused)}.")
        told.append(bounds.unknown(item for item, _ in self._contents()))
        return "\n".join(filter(None, told))

    def step(self, action: Action) -> StepResult:
        """Take one action. An impossible one changes nothing and says why."""
        if type(action.target) is not str:
            return StepResult(action, False, "What an action is done to is named by a text.")
        match action.name:
            case envs.SEARCH:
                return self._look(action)
            case "add item" | "remove item" | "buy basket" if self._bought:
                return StepResult(action, False, "The basket is already purchased.")
            case "add item" | "remove item":
                if problem := self._problem(action):
                    return StepResult(action, False, problem)
                return self._move(action)
            case "buy basket":
                return self._buy(action)
            case _:
                return StepResult(
                    action,
                    False,
                    f"There is no action {action.name!r}; there are {', '.join(NAMES)}.",
                )

    def lasting(self, action: Action) -> bool:
        """Whether the action is the purchase."""
        return action.name == "buy basket"

    def checks_met(self, profile: Profile) -> Checks:
        """The score of the basket; an empty basket meets no check.

        Unwanted are the items that no `must_have` of the profile asks for, if none is welcome.
        """
        met = checks_met(profile.checks, self._contents(), bought=self._bought)
        return Checks(tuple(met), tuple(unwanted(profile, self._contents())))

    def _bounds(self, dialogue: DialogueState) -> Bounds:
        """What binds the basket; a budget in another currency than the shop's does not."""
        bounds = self._choice.bounds(dialogue)
        unset = dialogue.budget and self._unset(dialogue.budget)
        return replace(bounds, budget=None) if unset else bounds

    def _unset(self, budget: Order) -> str:
        """Why a budget sets no limit; "" if it does."""
        if budget.quantity is None:
            return "I did not understand how much it may cost. Please say the sum in figures."
        shown = self.catalogue.currency
        if not budget.unit or same_currency(budget.unit, shown):
            return ""
        return (
            f'The prices here are in {shown}, so "{budget.quantity:g} {budget.unit}" sets no '
            f"limit. Please say the most that it may cost in {shown}."
        )

    def _add(self, order: Order, bounds: Bounds, dialogue: DialogueState) -> Resolution:
        """More of a thing, or exactly so many of it; a guess counts towards what is asked for."""
        asked, item = order, self._choice.meant(order.what, bounds, self._basket)
        if item is None and order.quantity is None:
            asked = replace(order, **self._choice.counted(order.what))
            item = self._choice.meant(asked.what, bounds, self._basket)
        if item is None:
            return Resolution(why=self._choice.lacking(order.what, bounds))
        (number, note), held = packages(asked, item), self._basket.get(item.name, 0)
        if note and not number:
            return Resolution(why=note)
        if asked.quantity is None and held:
            number = 0
        elif order.do == "set" or self._is_guess(item, order, bounds, dialogue):
            number -= held
        room = min(number, MOST - held)
        over = "" if room == number else f"The basket may hold {MOST} of {item.name}."
        if not number:
            return Resolution(why=f"The basket holds {held} x {item.name} already.")
        price = (item.price or Decimal(0)) * room
        told = (over or note, "" if over else self._over(bounds, price))
        return Resolution((_change(item.name, room),) if room else (), " ".join(filter(None, told)))

    def _is_guess(self, item: Item, order: Order, bounds: Bounds, dialogue: DialogueState) -> bool:
        """Whether nobody has asked for an item before this order."""
        before = [*map(without_percentage, dialogue.asked)]
        if order in before:
            before.remove(order)
        wanted = _wanted(before)
        return all(self._choice.meant(each, bounds, self._basket) != item for each in wanted)

    def _remove(self, order: Order, pick: Pick) -> Resolution:
        """All of what a phrase means in the basket, or so many of the first such thing."""
        found = self._held(order.what, pick)
        if not found:
            return Resolution(why=f'The basket holds nothing called "{order.what}".')
        if order.quantity is None:
            return Resolution(tuple(self._out((i, self._basket[i.name]) for i in found)))
        item = found[0]
        held = self._basket[item.name]
        if not order.unit and order.quantity <= held:
            number, note = round(order.quantity), ""
        else:
            number, note = packages(order, item)
        out = (_change(item.name, -min(number, held)),) if number else ()
        return Resolution(out, "" if number else note)

    def _swap(
        self, order: Order, bounds: Bounds, dialogue: DialogueState, pick: Pick
    ) -> Resolution:
        """One thing for as many of another; where there is no such thing, the other comes."""
        coming = replace(order, unit="", **self._choice.counted(order.for_))
        item = self._choice.meant(coming.what, bounds, self._basket)
        if item is None:
            return Resolution(why=self._choice.lacking(order.for_, bounds))
        old, held = self._held(order.what, pick)[:1], self._basket.get(item.name, 0)
        if old == [item]:
            return Resolution(why=f"The basket holds {held} x {item.name} already.")
        count = self._basket[old[0].name] if old else 1
        if old and order.quantity is not None:
            count = min(count, int(order.quantity) or 1)
        number, note = packages(order, item) if not old else (count, "")
        if coming.what != order.for_:
            number, note = packages(coming, item)
        if self._is_guess(item, order, bounds, dialogue):
            number = max(number - held, 0)
        number = min(number, MOST - held)
        if held == MOST:
            return Resolution(why=f"The basket may hold {MOST} of {item.name}.")
        moved = [*(_change(each.name, -count) for each in old), _change(item.name, number)]
        missed = "" if old else f'The basket held nothing called "{order.what}".'
        told = " ".join(filter(None, (missed, note)))
        return Resolution(tuple(each for each in moved if each.quantity), told)

    def _bind(self, order: Order, bounds: Bounds, dialogue: DialogueState) -> Resolution:
        """What a limit takes out of the basket; what names and labels cannot tell is said.

        What only some people must not have stays where it was asked for, and a guess goes.
        """
        wanted = _wanted(dialogue.asked)

        def stays(item: Item) -> bool:
            ordered = any(
                self._choice.held(phrase, [item]) or self._choice.meant(phrase, Bounds()) == item
                for phrase in wanted
            )
            return bounds.permits(item) if ordered else bounds.surely_suits(item)

        against = [(item, n) for item, n in self._contents() if not stays(item)]
        told = order.do == "avoid" and (
            order.why != "allergy"
            or any(names(item.name, refusal(order)) for item in self.catalogue.items)
        )
        why = f'I cannot tell by names and labels what is "{order.what}".'
        kept = [item for item, _ in self._contents() if stays(item)]
        said = ("" if told or diets_of(order) else why, bounds.unknown(kept))
        return Resolution(tuple(self._out(against)), _sentences(said))

    def _held(self, phrase: str, pick: Pick) -> list[Item]:
        """What of the basket a phrase means; nothing like it, if the shop has the very thing."""
        items = [item for item, _ in self._contents()]
        if found := self._choice.held(phrase, items):
            return found
        other = self._choice.meant(phrase, Bounds())
        if other and names(other.name, phrase):
            return []
        return [item for item in items if item.name == pick(phrase, [each.name for each in items])]

    def _out(self, contents: Iterable[tuple[Item, int]]) -> Iterator[Action]:
        return (_change(item.name, -number) for item, number in contents)

    def _if_empty(self) -> str:
        return "" if self._basket else "The basket is empty."

    def _over(self, bounds: Bounds, more: Decimal = Decimal(0)) -> str:
        """That the basket costs more than it may, if it does or would."""
        total = self.total + more
        if bounds.budget is None or total <= bounds.budget:
            return ""
        named, comes = map(self.catalogue.money, (bounds.budget, total))
        return f"The basket comes to {comes}, above the {named} that you named."

    def _contents(self) -> list[tuple[Item, int]]:
        pairs = ((self.catalogue.get(name), n) for name, n in self._basket.items())
        return [(item, n) for item, n in pairs if item is not None]

    def _look(self, action: Action) -> StepResult:
        found = self._search.search(action.target, _SHOWN)
        if not found:
            return StepResult(action, False, f"Nothing is found for {action.target!r}.")
        money = self.catalogue.money
        return StepResult(action, True, "\n".join(f"- {i.name}: {money(i.price)}" for i in found))

    def _problem(self, action: Action) -> str | None:
        """Why `action` cannot be taken, or None if it can."""
        name, number = action.target, action.quantity
        if type(number) is not int or not 1 <= number <= MOST:
            return f"The quantity must be a whole number from 1 to {MOST}."
        held = self._basket.get(name, 0)
        if action.name == "remove item" and held < number:
            return f"The basket holds {held} of {name!r}."
        if self.catalogue.get(name) is None:
            return f"The shop has no item of the name {name!r}."
        if action.name == "add item" and held + number > MOST:
            return f"The basket holds {held} of {name!r} and may hold {MOST}."
        return None

    def _move(self, action: Action) -> StepResult:
        sign = 1 if action.name == "add item" else -1
        number = self._basket.get(action.target, 0) + sign * action.quantity
        if number:
            self._basket[action.target] = number
        else:
            del self._basket[action.target]
            self._taken_out.add(action.target)
        times = f"{action.quantity} x " if action.quantity != 1 else ""
        item = self.catalogue.get(action.target)
        unit = f" ({item.unit})" if item and item.unit not in ("", "each") else ""
        done = f"{unit} added to" if sign == 1 else " removed from"
        return StepResult(action, True, f"{times}{action.target}{done} the basket.")

    def _buy(self, action: Action) -> StepResult:
        if action != Action("buy basket"):
            return StepResult(action, False, "The basket is bought as it is, and once.")
        if not self._basket:
            return StepResult(action, False, "The basket is empty; add something first.")
        self._bought = True
        total = self.catalogue.money(self.total)
        told = f"The basket is now purchased for {total}.\n{self._status()}"
        return StepResult(action, True, told, terminated=True, irreversible=True)


def _sentences(told: Iterable[str]) -> str:
    """What there is to tell, on one line."""
    return " ".join(filter(None, told))


def _wanted(orders: Sequence[Order]) -> list[str]:
    """What orders ask to come."""
    coming = (without_percentage(o) for o in orders if o.do in ("add", "set", "swap"))
    return [each.for_ if each.do == "swap" else each.what for each in coming]


def _change(name: str, number: int) -> Action:
    """An addition, or where the number is negative a removal."""
    return Action("add item" if number > 0 else "remove item", name, abs(number))
