"""The shop as an environment: a basket that is filled, emptied and bought."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from decimal import Decimal

from goalscope import envs
from goalscope.base.nouns import head_nouns, names
from goalscope.base.types import Action, Profile, StepResult
from goalscope.envs import Checks, Pick, Proactive, Resolution, State
from goalscope.envs.grocery.answers import ShopAnswers
from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.choosing import Chooser
from goalscope.envs.grocery.dietary import Bounds, avoided_name, bounds_of, diets_of, unset_budget
from goalscope.envs.grocery.profiles import checks_met, unwanted
from goalscope.envs.grocery.quantities import packages
from goalscope.envs.grocery.search import Search
from goalscope.envs.scenarios import Scenario, shipped_scenarios
from goalscope.language.dialogue_state import DialogueState, exceptions
from goalscope.language.orders import MORE, Order, Verb, with_examples

NAMES = (envs.SEARCH, "add item", "remove item", "buy basket")
"""What can be done here."""

MOST = 99
"""Units of one item that a basket holds at most."""

_AT_ONCE = 8  # things that are guessed at most: what is left of a budget must do for all of them
_SHOWN = 10  # items that the action `search inventory` lists


class GroceryShop(Proactive):
    """The world of a shopping agent (Sec. 4.2).

    Orders use `verbs`. The actions are `search inventory` (the target is a term), `add item` and
    `remove item` (the target is an item's exact name, with a quantity from 1 to 99), and `buy
    basket`. After the purchase, only searching is possible until `reset`.

    Attributes:
        catalogue: The items.
        bought: Whether the basket has been purchased.
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
        self._chooser = Chooser(catalogue, self._search)
        self._basket: dict[Item, int] = {}
        self._taken_out: set[Item] = set()
        self.bought = False

    @property
    def basket(self) -> dict[str, int]:
        """A copy of the basket: quantities by item name, in the order of adding."""
        return {item.name: number for item, number in self._basket.items()}

    @property
    def total(self) -> Decimal:
        """Price of the basket; items without a price count as 0."""
        return sum(((i.price or Decimal(0)) * n for i, n in self._basket.items()), Decimal(0))

    def reset(self) -> None:
        """Empty the basket, not bought."""
        self._basket.clear()
        self._taken_out.clear()
        self.bought = False

    def state(self) -> State:
        """The basket with quantities, prices and the total, one item a line."""
        fingerprint = f"{sorted(self.basket.items())} {self.bought}"
        if not self._basket:
            return State("The basket is empty.", fingerprint, "nothing")
        money = self.catalogue.money
        lines = ["Purchased:" if self.bought else "The basket holds:"]
        for item, number in self._basket.items():
            price = None if item.price is None else item.price * number
            lines.append(f"- {number} x {item.name}: {money(price)}")
        here = "; ".join(f"{number} x {item.name}" for item, number in self._basket.items())
        return State("\n".join([*lines, f"Total: {money(self.total)}"]), fingerprint, here)

    def resolve(self, order: Order, dialogue: DialogueState, pick: Pick) -> Resolution:
        """See `Environment.resolve`: limits remove violations.

        It warns of what comes and is not known to fit the diets.
        """
        bounds, order = bounds_of(dialogue, self.catalogue), self._chooser.in_shop_words(order)
        if order.do in ("add", "set", "remove") and len(each := self._chooser.parts(order)) > 1:
            found = [self.resolve(part, dialogue, pick) for part in each]
            return Resolution(
                tuple(action for part in found for action in part.actions),
                " ".join(filter(None, (part.why for part in found))),
                " ".join(filter(None, (part.warning for part in found))),
                any(part.missing for part in found),
            )
        match order.do:
            case "undo":
                found = self._undo(dialogue.to_undo, bounds)
            case _ if self.bought:
                found = Resolution(why="The basket is bought already.")
            case "add" | "set":
                found = self._add(order, bounds.without(exceptions(order)), dialogue)
            case "remove":
                found = self._remove(order, dialogue, pick)
            case "swap":
                found = self._swap(order, bounds.without(exceptions(order)), dialogue, pick)
            case "clear":
                found = self._without(order, [*self._basket], dialogue)
            case "have":
                found = self._had(order, dialogue)
            case "buy" if self._basket and order.but:
                found = Resolution(
                    why="Only the whole basket can be bought. Take out the rest first."
                )
            case "buy" if self._basket:
                found = Resolution((Action("buy basket", irreversible=True),))
            case "buy":
                found = Resolution(why="There is nothing to buy: the basket is empty.")
            case "budget":
                unset = unset_budget(order, self.catalogue.currency)
                found = Resolution(why=unset or self._over(bounds))
            case "avoid" | "only":
                found = self._bind(order, bounds, dialogue)
            case _:
                found = Resolution()
        coming = (self.catalogue.get(a.target) for a in found.actions if a.name == "add item")
        return replace(found, warning=bounds.unknown(filter(None, coming)))

    def _add(self, order: Order, bounds: Bounds, dialogue: DialogueState) -> Resolution:
        """More of a thing, or exactly so many of it; a guess counts towards what is asked for.

        It does not where there is to be more than there is: "another milk".
        """
        more = order.unit.endswith(MORE)
        order = replace(order, unit=order.unit.removesuffix(MORE).strip())
        said, before = order.what, self._asked_for(dialogue, order)
        item = self._chooser.meant(said, bounds, self._basket)
        if item is None and order.quantity is None:
            what, quantity = self._chooser.counted(said)
            order = replace(order, what=what, quantity=quantity)
            item = self._chooser.meant(what, bounds, self._basket)
        if item is None:
            missing = self._chooser.meant(said, Bounds()) is None
            return Resolution(why=self._chooser.lacking(said, bounds), missing=missing)
        (number, note), held = packages(order, item), self._basket.get(item, 0)
        if note and not number:
            return Resolution(why=note)
        if order.quantity is None and held:
            number = 0
        elif not more and (
            order.do == "set"
            or item not in (self._chooser.meant(each, bounds, self._basket) for each in before)
        ):
            number -= held
        if not number:
            return Resolution(why=f"The basket holds {held} x {item.name} already.")
        room = min(number, MOST - held)
        told = [note, self._over(bounds, (item.price or Decimal(0)) * room)]
        if room < number:
            told = [f"The basket may hold {MOST} of {item.name}."]
        return Resolution((_change(item, room),) if room else (), " ".join(filter(None, told)))

    def _without(self, order: Order, items: Sequence[Item], dialogue: DialogueState) -> Resolution:
        """What takes out all of some items of the basket, but for those to be left alone."""
        if not items:
            return Resolution(why="The basket is empty.")
        for each in exceptions(order):
            if not self._chooser.held(each, [*self._basket]):
                return Resolution(why=f'The basket holds nothing called "{each}", so all stays.')
        left = self._left(dialogue)
        out = tuple(_change(item, -self._basket[item]) for item in items if item not in left)
        return Resolution(out, "" if out else "All that is to be left alone, as you asked.")

    def _left(self, dialogue: DialogueState) -> set[Item]:
        """What of the basket is to be left alone."""
        named = (self._chooser.held(each.what, [*self._basket]) for each in dialogue.untouched)
        return {item for items in named for item in items}

    def _remove(self, order: Order, dialogue: DialogueState, pick: Pick) -> Resolution:
        """All of what a phrase means in the basket, or so many of the first such thing."""
        found = self._held(order.what, pick)
        if not found:
            return Resolution(why=f'The basket holds nothing called "{order.what}".')
        if order.quantity is None:
            return self._without(order, found, dialogue)
        found = [item for item in found if item not in self._left(dialogue)] or found
        item, held = found[0], self._basket[found[0]]
        number, note = round(order.quantity), ""
        if order.unit or order.quantity > held:
            number, note = packages(order, item)
        if not number:
            return Resolution(why=note)
        return Resolution((_change(item, -min(number, held)),))

    def _had(self, order: Order, dialogue: DialogueState) -> Resolution:
        """What takes a thing out that they have already, if it was guessed; else it says so."""
        held = [each for each in self._basket if names(each.name, order.what)]
        wanted = [
            item
            for phrase in self._asked_for(dialogue)
            for item in self._chooser.held(phrase, held)
        ]
        out = tuple(_change(item, -self._basket[item]) for item in held if item not in wanted)
        kept = (
            f'You asked for {wanted[0].name}, so it stays until you say "remove".' if wanted else ""
        )
        return Resolution(out, kept)

    def _swap(
        self, order: Order, bounds: Bounds, dialogue: DialogueState, pick: Pick
    ) -> Resolution:
        """One thing for as many of another; where there is no such thing, the other comes."""
        what, quantity = self._chooser.counted(order.for_)
        item = self._chooser.meant(what, bounds, self._basket)
        if item is None:
            return Resolution(why=self._chooser.lacking(order.for_, bounds))
        old, held = self._held(order.what, pick)[:1], self._basket.get(item, 0)
        if old == [item]:
            return Resolution(why=f"The basket holds {held} x {item.name} already.")
        if held == MOST:
            return Resolution(why=f"The basket may hold {MOST} of {item.name}.")
        count = self._basket[old[0]] if old else 1
        if old and order.quantity is not None:
            count = min(count, int(order.quantity) or 1)
        number, note = count, ""
        if quantity is not None:
            number, note = packages(replace(order, quantity=quantity, unit=""), item)
        elif not old:
            number, note = packages(order, item)
        before = self._asked_for(dialogue, order)
        if item not in (self._chooser.meant(each, bounds, self._basket) for each in before):
            number = max(number - held, 0)
        moved = [*(_change(each, -count) for each in old), _change(item, min(number, MOST - held))]
        missed = "" if old else f'The basket held nothing called "{order.what}".'
        told = " ".join(filter(None, (missed, note)))
        return Resolution(tuple(each for each in moved if each.quantity), told)

    def _held(self, phrase: str, pick: Pick) -> list[Item]:
        """What of the basket a phrase means; nothing like it, if the shop has the very thing."""
        if found := self._chooser.held(phrase, [*self._basket]):
            return found
        other = self._chooser.meant(phrase, Bounds())
        if other and names(other.name, phrase):
            return []
        return [item for item in self._basket if item.name == pick(phrase, [*self.basket])]

    def _bind(self, order: Order, bounds: Bounds, dialogue: DialogueState) -> Resolution:
        """What a limit takes out of the basket; what names and labels cannot tell is said.

        What only some people must not have stays where it was asked for, and a guess goes.
        """
        wanted = self._asked_for(dialogue)

        def stays(item: Item) -> bool:
            ordered = any(
                self._chooser.held(phrase, [item]) or self._chooser.meant(phrase, Bounds()) == item
                for phrase in wanted
            )
            return not bounds.against(item) if ordered else bounds.surely_suits(item)

        kept = [item for item in self._basket if stays(item)]
        out = tuple(_change(item, -n) for item, n in self._basket.items() if item not in kept)
        is_known = diets_of(order) or (
            order.do == "avoid"
            and (
                order.why != "allergy"
                or any(names(item.name, avoided_name(order)) for item in self.catalogue.items)
            )
        )
        why = "" if is_known else f'I cannot tell by names and labels what is "{order.what}".'
        return Resolution(out, " ".join(filter(None, (why, bounds.unknown(kept)))))

    def _asked_for(self, dialogue: DialogueState, but: Order | None = None) -> list[str]:
        """What orders ask to come, `but` for one; all else in the basket was guessed."""
        said = map(self._chooser.in_shop_words, dialogue.asked)
        orders = [part for order in said for part in self._chooser.parts(order)]
        if but in orders:
            orders.remove(but)
        coming = (each for each in orders if each.do in ("add", "set", "swap"))
        return [each.for_ if each.do == "swap" else each.what for each in coming]

    def _over(self, bounds: Bounds, more: Decimal = Decimal(0)) -> str:
        """That the basket costs more than it may, if it does or would."""
        total = self.total + more
        if bounds.budget is None or total <= bounds.budget:
            return ""
        named, comes = map(self.catalogue.money, (bounds.budget, total))
        return f"The basket comes to {comes}, above the {named} that you named."

    def _undo(self, results: Sequence[StepResult], bounds: Bounds) -> Resolution:
        """What takes out what `results` put in, and puts back what they took out.

        What is ruled out stays out.
        """
        if self.bought:
            return Resolution(why="The purchase cannot be undone.")
        moved = Counter[Item]()
        for result in results:
            sign = {"add item": -1, "remove item": 1}.get(result.action.name, 0)
            if sign and (item := self.catalogue.get(result.action.target)):
                moved[item] += sign * result.action.quantity
        told: list[str] = []
        for item in [item for item, number in moved.items() if number > 0]:
            if why := bounds.against(item):
                told.append(f"{item.name} stays out: {why}.")
                del moved[item]
        steps = [_change(item, max(n, -self._basket.get(item, 0))) for item, n in moved.items()]
        actions = tuple(step for step in steps if step.quantity)
        nothing = "" if actions else "Nothing in the basket has to change for that."
        return Resolution(actions, " ".join(told) or nothing)

    def offers(self, text: str, limit: int) -> list[str]:
        """Generic names such as "flour" that may serve `text`, nearest first."""
        return self._search.kinds(text, limit)

    def actions(self, name: str, dialogue: DialogueState) -> list[Action]:
        """Additions for a generic name that the basket does not cover yet, best first.

        Excludes what was ruled out, for whomever it was, what once left the basket, and what takes
        too large a share of the remaining budget.
        """
        if self.bought or any(
            each.do in ("avoid", "have") and names(name, each.what) for each in dialogue.limits
        ):
            return []
        bounds = bounds_of(dialogue, self.catalogue)
        most = None if bounds.budget is None else (bounds.budget - self.total) / _AT_ONCE
        found = self._chooser.offers(name, bounds, {*self._basket, *self._taken_out})
        had = [each.what for each in dialogue.limits if each.do == "have"]
        return [
            Action("add item", item.name)
            for item in found
            if (most is None or (item.price or 0) <= most)
            and not any(names(item.name, each) for each in had)
        ]

    def possible(self, terms: Sequence[str]) -> list[Action]:
        """See `Proactive.possible`: the paper's four kinds of actions.

        As in the paper, a search finds the one item most similar to its term.
        """
        found = (self._search.search(term, 1) for term in terms)
        return [
            *(Action("add item", item.name) for items in found for item in items),
            *(Action("remove item", item.name) for item in self._basket),
            *(Action(envs.SEARCH, term) for term in terms),
            *([Action("buy basket")] if self._basket else []),
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

    def answer(self, question: Order, said: str, dialogue: DialogueState, pick: Pick) -> str:
        """The facts about a thing, such as its price and labels; by default, about the basket."""
        bounds = bounds_of(dialogue, self.catalogue)
        answers = ShopAnswers(self.catalogue, self._chooser, self._basket, self.total, bounds)
        return answers.to(question, said)

    def step(self, action: Action) -> StepResult:
        """Take one action. An impossible one changes nothing and says why."""
        if type(action.target) is not str:
            return StepResult(action, False, "What an action is done to is named by a text.")
        match action.name:
            case envs.SEARCH:
                money, found = self.catalogue.money, self._search.search(action.target, _SHOWN)
                listed = "\n".join(f"- {item.name}: {money(item.price)}" for item in found)
                nothing = f"Nothing is found for {action.target!r}."
                return StepResult(action, bool(found), listed or nothing)
            case "add item" | "remove item" | "buy basket" if self.bought:
                return StepResult(action, False, "The basket is already purchased.")
            case "add item" | "remove item":
                return self._move(action)
            case "buy basket":
                return self._buy(action)
            case _:
                told = f"There is no action {action.name!r}; there are {', '.join(NAMES)}."
                return StepResult(action, False, told)

    def _move(self, action: Action) -> StepResult:
        """Put units of an item into the basket, or take them out."""
        name, number, item = action.target, action.quantity, self.catalogue.get(action.target)
        held, is_added = self._basket.get(item, 0) if item else 0, action.name == "add item"
        if type(number) is not int or not 1 <= number <= MOST:
            problem = f"The quantity must be a whole number from 1 to {MOST}."
        elif not is_added and held < number:
            problem = f"The basket holds {held} of {name!r}."
        elif item is None:
            problem = f"The shop has no item of the name {name!r}."
        elif is_added and held + number > MOST:
            problem = f"The basket holds {held} of {name!r} and may hold {MOST}."
        else:
            self._basket[item] = held + (number if is_added else -number)
            if not self._basket[item]:
                del self._basket[item]
                self._taken_out.add(item)
            times = f"{number} x " if number != 1 else ""
            unit = f" ({item.unit})" if item.unit not in ("", "each") else ""
            done = f"{unit} added to" if is_added else " removed from"
            return StepResult(action, True, f"{times}{name}{done} the basket.")
        return StepResult(action, False, problem)

    def _buy(self, action: Action) -> StepResult:
        """Buy the basket, which ends the task."""
        if action != Action("buy basket"):
            return StepResult(action, False, "The basket is bought as it is, and once.")
        if not self._basket:
            return StepResult(action, False, "The basket is empty; add something first.")
        self.bought = True
        total = self.catalogue.money(self.total)
        told = f"The basket is now purchased for {total}: {self.state().here}."
        return StepResult(action, True, told, terminated=True, irreversible=True)

    def irreversible(self, action: Action) -> bool:
        """Whether the action is the purchase."""
        return action.name == "buy basket"

    def checks_met(self, profile: Profile) -> Checks:
        """Which checks the basket meets, and which items no `must_have` nor `welcome` names."""
        contents = [*self._basket.items()]
        met = checks_met(profile.checks, contents, bought=self.bought)
        return Checks(tuple(met), unwanted(profile, contents))


def _change(item: Item, number: int) -> Action:
    """An addition, or where the number is negative a removal."""
    return Action("add item" if number > 0 else "remove item", item.name, abs(number))
