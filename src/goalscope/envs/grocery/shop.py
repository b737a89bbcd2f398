"""The shop as an environment: a basket that is filled, emptied and bought."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from decimal import Decimal

from goalscope import envs
from goalscope.envs.grocery.amounts import MOST, Request, packages
from goalscope.envs.grocery.answers import answered
from goalscope.envs.grocery.catalogue import Catalogue, Item
from goalscope.envs.grocery.changes import changes, dearer, guessed
from goalscope.envs.grocery.choosing import Choice, called
from goalscope.envs.grocery.heard import Hearing, kind_of
from goalscope.envs.grocery.hearing.consent import consents
from goalscope.envs.grocery.hearing.diets import undieted, waves_off
from goalscope.envs.grocery.hearing.hear import hear
from goalscope.envs.grocery.hearing.limits import budget, conditions, limits_of_things
from goalscope.envs.grocery.hearing.listing import chooses_size
from goalscope.envs.grocery.hearing.orders import (
    adds_it,
    besides_buying,
    buys_changed,
    buys_it,
    has_aim,
    is_order,
    leaves_open,
    tries_to_buy,
)
from goalscope.envs.grocery.hearing.phrases import SAME, SAME_ALL, SAME_TWO
from goalscope.envs.grocery.hearing.requests import amount, refuses, unrefused
from goalscope.envs.grocery.hearing.rewording import heard
from goalscope.envs.grocery.hearing.undoing import ALLERGY, calling_notes, harm, net, steps
from goalscope.envs.grocery.names import Names
from goalscope.envs.grocery.profiles import checks_met
from goalscope.envs.grocery.search import Search
from goalscope.envs.grocery.suiting import Bounds
from goalscope.envs.grocery.talk import Talk
from goalscope.envs.grocery.telling import (
    for_a_diet,
    for_some,
    labelled_alone,
    left_out,
    lifted,
    limited,
    listed,
    not_back,
    not_met,
    not_there,
    still_bound,
    taken_in,
    unlabelled,
)
from goalscope.envs.grocery.unheard import above_limit, not_replaced, undone
from goalscope.envs.grocery.words import singulars
from goalscope.envs.remarks import asks_for_guesses
from goalscope.types import Action, Profile, StepResult, TakenBack, Turn, spoken

__all__ = ["NAMES", "GroceryShop"]

NAMES = (envs.SEARCH, "add item", "remove item", "buy basket")
"""What can be done here."""

_AT_ONCE = 8
"""Things that are guessed at once at most: what is left of a budget must do for all of them."""

_SHOWN = 10
"""Items that the action `search inventory` lists."""


class GroceryShop:
    """A shopping agent's world (Sec. 4.2); implements `goalscope.envs.Environment`.

    The actions are `search inventory` (the target is a term), `add item` and `remove item` (the
    target is an item's exact name, with a quantity from 1 to 99), and `buy basket`. After the
    purchase only searching is possible, until `reset`.
    """

    def __init__(self, catalogue: Catalogue, *, search: Search | None = None) -> None:
        """Open the shop with an empty basket; `search` shares an index between shops."""
        self.catalogue = catalogue
        self._search = search or Search(catalogue)
        self._choice = Choice(catalogue, self._search)
        self._basket: dict[str, int] = {}
        self._taken_out: set[str] = set()
        self._talk = Talk(catalogue, self._search, self._choice)
        self._bought = False

    @property
    def task(self) -> str:
        """The agent and its task, for prompts."""
        return (
            "The agent is a shopping agent that is supposed to make purchases for the human. "
            "Its task is to identify a basket of groceries that matches the human's preferences."
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What reading the catalogue had to adapt."""
        return self.catalogue.notes

    @property
    def completion_phrase(self) -> str:
        """What a person says to have the basket bought."""
        return "Buy the basket"

    @property
    def basket(self) -> dict[str, int]:
        """A copy of the basket: item name to quantity, in the order of adding."""
        return dict(self._basket)

    @property
    def bought(self) -> bool:
        """Whether the basket has been purchased."""
        return self._bought

    @property
    def total(self) -> Decimal:
        """Price of the basket; items without a price count nothing."""
        return sum((i.price * n for i, n in self._contents() if i.price is not None), Decimal(0))

    def reset(self) -> None:
        """Empty the basket, not bought."""
        self._basket.clear()
        self._taken_out.clear()
        self._bought = False

    def close(self) -> None:
        """Nothing runs behind it."""

    def fingerprint(self) -> str:
        """The basket's contents, and whether it was bought."""
        return f"{sorted(self._basket.items())} {self._bought}"

    def search(self, text: str, limit: int) -> list[Item]:
        """The items nearest in meaning to `text`, best first, at most `limit`."""
        return self._search.search(text, limit)

    def nearness(self, text: str) -> float:
        """Cosine of `text` and the item nearest to it in meaning."""
        return self._search.nearness(text)

    def kinds(self, text: str, limit: int) -> list[str]:
        """Generic names such as "flour" that may serve `text`, nearest first."""
        text = self._talk.translated(text)
        said = self._names.hidden(text)
        if refuses(said):
            text = self._names.shown(unrefused(said))
        return self._search.kinds(text, limit)

    def mentioned(self, utterances: Sequence[str]) -> list[str]:
        """Generic names of things here that the person spoke of, and did not refuse."""
        utterances = [self._talk.translated(each) for each in utterances]
        hearing = hear(utterances, self._names)
        said = [self._names.brief(unrefused(self._names.hidden(each))) for each in utterances]
        text = f" {' '.join(singulars('. '.join(said)))} "
        for gone in (*hearing.refused, *hearing.dropped):
            text = text.replace(f" {' '.join(singulars(gone))} ", " . ")
        return [name for name in self._search.mentioned(text) if not hearing.spurns(name)]

    def status(self) -> str:
        """The basket with quantities, prices and the total, one item a line."""
        if not self._basket:
            return "The basket is empty."
        lines = ["Purchased:" if self._bought else "The basket holds:"]
        for item, number in self._contents():
            price = None if item.price is None else item.price * number
            lines.append(f"- {number} x {item.name}: {self.catalogue.money(price)}")
        lines.append(f"Total: {self.catalogue.money(self.total)}")
        return "\n".join(lines)

    def actions(self, relevant: Sequence[str], turns: Sequence[Turn] = ()) -> list[Action]:
        """Additions for each search term that the basket does not serve yet.

        What the person ruled out in `turns` is not offered, nor what once left the basket, what a
        diet that they hinted at speaks against, or what goes beyond their budget; nor anything
        where they want no guesses, or the newest words take things out, or ask for things, and
        state no aim besides. Removals and the
        purchase follow from the person's words alone: see `requests` and `completion_actions`.
        """
        hearing = self._heard(turns)
        hearing = replace(hearing, diets=hearing.diets | hearing.hinted)
        newest = self._talk.spoken(turns)[-1] if turns else ""
        stricter = bool(hearing.strict) and hearing.strict != self._heard(turns[:-1]).strict
        lessens = stricter or hearing.empties or hearing.unasked or hearing.removed
        orders = not has_aim(newest) and any(
            self._choice.meant(each.phrase, hearing, ()) or self._choice.lacking(each, hearing)
            for each in hearing.newest
        )
        lessens = (lessens or hearing.spared) and not hearing.newest
        if self._bought or not hearing.guesses or orders or lessens:
            return []
        most = None if hearing.budget is None else (hearing.budget - self._after(turns)) / _AT_ONCE
        found: dict[str, int] = {}
        for term in relevant:
            if offers := self._choice.offers(term, hearing, {*self._basket, *self._taken_out}):
                much = amount(term, hearing.words)
                for item in offers:
                    number = packages(much, item)
                    if most is None or (item.price or 0) * number <= most:
                        found.setdefault(item.name, number)
        return [Action("add item", name, number) for name, number in found.items()]

    def requests(self, turns: Sequence[Turn]) -> list[Action]:
        """Removals of what the person ruled out, then additions of what they asked for outright.

        A request counts where the shop has a thing of that name; it is met once, from what the
        removals leave.
        """
        if self._bought:
            return []
        hearing = self._heard(turns)
        dear = {item.name for item, _ in self._too_dear(hearing, turns)}
        found = self._changes(hearing)
        return [each for each in found if each.name != "add item" or each.target not in dear]

    def reversal(
        self, results: Sequence[StepResult], before: Sequence[StepResult], turns: Sequence[Turn]
    ) -> envs.Reversal:
        """What takes out what `results` put in, and puts back what they took out.

        What is ruled out stays out; what the newest words spare, as in "undo that, but keep the
        milk", stays as it is; and so does an allergy.
        """
        if self._bought:
            return [], ["The purchase cannot be undone."] if results else []
        hearing, moved = self._heard(turns), net(results)
        items = [item for name in moved if (item := self.catalogue.get(name))]
        for phrase in hear(spoken(turns[-1:]), self._names).kept:
            for item in called(phrase, items):
                moved[item.name] = 0
        out = [n for n in moved if moved[n] < 0 and not self._permits(n, hearing)]
        told = [not_back(item, hearing) for item in items if item.name in out]
        gone = (turn.utterance for turn in turns if isinstance(turn, TakenBack))
        told += [ALLERGY] if any(map(harm, gone)) else []
        return steps({**moved, **dict.fromkeys(out, 0)}, self.basket), told

    def is_order(self, turns: Sequence[Turn]) -> bool:
        """Whether the newest words say exactly what is to be done, or leave nothing to guess."""
        newest = turns[-1].utterance if turns else ""
        if not turns or asks_for_guesses(newest):
            return bool(turns)
        hearing = self._heard(turns)
        if hearing.unclear and not has_aim(newest):
            return True
        said = self._names.hidden(self._talk.spoken(turns)[-1])
        has = any(self._choice.meant(each.phrase, hearing, ()) for each in hearing.newest)
        return not leaves_open(said) or is_order(
            said, lambda each: self._means(listed(each, has=has), hearing)
        )

    def unmet(self, turns: Sequence[Turn], results: Sequence[StepResult]) -> list[str]:
        """What the newest turn asks for outright and did not get, one sentence each."""
        hearing = self._heard(turns)
        before = self.basket
        for name, number in net(results).items():
            before[name] = before.get(name, 0) - number
        held = [item for name, n in before.items() if n > 0 and (item := self.catalogue.get(name))]
        told: list[str] = []
        buys, tries = self.is_completion(turns[-1]), tries_to_buy(turns[-1].utterance)
        newest = turns[-1].utterance
        orders_it = bool(results) and (adds_it(newest) or buys_it(newest))
        if not self._basket and (buys or tries):
            told.append("The basket is empty, so nothing is bought.")
        elif buys_changed(newest) or (tries and not (buys or orders_it)):
            told.append(f'To have the basket bought, say "{self.completion_phrase}".')
        above = hearing.budget is not None and self.total > hearing.budget
        if above and (results or buys or budget(turns[-1].utterance) is not None):
            total, named = map(self.catalogue.money, (self.total, hearing.budget))
            told.append(f"The basket comes to {total}, above the {named} that you named.")
        unasked = [item.name for item in guessed(hearing, held, self._choice)]
        told += calling_notes(turns[-1].utterance, unasked)
        if buys and unasked:
            told.append(f"{envs.GUESSED}{', '.join(unasked)}.")
        before_now = self._heard(turns[:-1])
        former = before_now.diets
        stated = hearing.diets if buys else hearing.diets - former
        waved = waves_off(turns[-1].utterance, former)
        harmful = [each for each in hearing.harmful if each not in before_now.harmful]
        told += taken_in(hearing.diets - former, harmful)
        told += left_out(self._newly_left_out(hearing, before_now, results))
        if not above:
            told += limited(hearing.budget, before_now.budget, self.catalogue.money)
        told += labelled_alone(hearing.strict - before_now.strict)
        told += still_bound(waved & hearing.diets)
        told += lifted(former - hearing.diets - hearing.some)
        told += for_some(hearing.some - before_now.some)
        aisles = self.catalogue.labelled
        told += unlabelled(stated, [item for item, _ in self._contents()], aisles)
        fresh = {each.action.target for each in results if each.action.name == "add item"}
        told += unlabelled(
            hearing.diets - stated, [i for i, _ in self._contents() if i.name in fresh], aisles
        )
        if chooses_size(newest):
            told.append("I do not choose by size: what is added says how much it is.")
        if hearing.unclear:
            told.append("It is not clear which thing you mean. Please name it.")
        lessened = any(result.action.name == "remove item" for result in results)
        told += [] if waved else not_there(hearing.removed, held, lessened=lessened)
        told += not_replaced(hearing, held, self._choice)
        meant = [self._choice.meant(r.phrase, hearing, self._basket) for r in hearing.newest]
        things = {r.phrase: item for r, item in zip(hearing.newest, meant, strict=True) if item}
        lacks = [r for r, item in zip(hearing.newest, meant, strict=True) if item is None]
        money = self.catalogue.money
        for item, most in self._too_dear(hearing, turns[-1:]):
            told.append(f"Not added, above {money(most)}: {item.name}, {money(item.price)}.")
        for piece, most in limits_of_things(self._talk.translated(turns[-1].utterance)):
            lacked = {r.phrase for r in lacks if self._choice.lacking(r, hearing)}
            told.append(above_limit(piece, things, most, self.catalogue.money, lacked))
        for request, item in zip(hearing.newest, meant, strict=True):
            if request.change == "cheaper":
                item = dearer(request, self._contents()) or item
            if item is None and waved and undieted(request.phrase) != request.phrase:
                continue
            if item is None:
                told += self._choice.lacking(listed(request, has=any(meant)), hearing)
                continue
            told += for_a_diet(request, item, hearing, self._choice)
            price = self.catalogue.money(item.price)
            told += filter(None, [not_met(request, item, before, self._basket, price)])
        told = [each for each in told if each]
        return [*told, *self._undone(hearing, turns, results, told)]

    def _newly_left_out(
        self, hearing: Hearing, before: Hearing, results: Sequence[StepResult]
    ) -> Iterator[str]:
        """What is sold and refused, and was not `before`; none of what was there, or made way."""
        targets = [each.action.target for each in results if each.action.name == "remove item"]
        gone = [*targets, *(each.phrase for each in hearing.removed)]
        gone += [old for each in hearing.newest for old in each.replaces]
        known = {*before.refused, *hearing.harmful}
        for thing in [each for each in hearing.refused if each not in known]:
            if self._choice.sells(thing) and not any(kind_of(name, [thing]) for name in gone):
                yield thing

    def _undone(
        self,
        hearing: Hearing,
        turns: Sequence[Turn],
        results: Sequence[StepResult],
        told: Sequence[str],
    ) -> Iterator[str]:
        """That nothing was heard of things which the newest words order."""
        newest = "" if hearing.unclear else self._talk.spoken(turns)[-1]
        clauses = heard(besides_buying(self._names.brief(self._names.hidden(newest))))
        asked = (*hearing.newest, *hearing.removed)
        phrases = (phrase for each in asked for phrase in (each.phrase, *each.replaces))
        others = (*hearing.refused, *hearing.dropped, *hearing.lessened, *hearing.spared)
        targets = (result.action.target for result in results)
        done = (*phrases, *others, *targets, *told, *hearing.diets)
        return undone(clauses, self._search.mentioned, done, self._basket)

    def permission(self, action: Action, turns: Sequence[Turn]) -> str:
        """None for a purchase in a plan: it follows from the person's order alone."""
        buys = action.name == "buy basket"
        return f'To have the basket bought, say "{self.completion_phrase}".' if buys else ""

    def completion_actions(self) -> list[Action]:
        """The purchase, if there is something to buy."""
        return [Action("buy basket")] if self._basket and not self._bought else []

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

    def answer(self, question: str, turns: Sequence[Turn] = ()) -> str | None:
        """Answer a question about stock, prices, the basket, or what it has to be."""
        hearing = self._heard(turns)
        refused = tuple(filter(self._choice.sells, hearing.refused))
        some = hearing.some - hearing.diets
        bounds = Bounds(hearing.diets, some, hearing.budget, refused, hearing.harmful)
        before = self._talk.translated(turns[-2].utterance) if turns[1:] else ""
        return answered(self._talk.translated(question), self, bounds, before)

    def is_completion(self, turn: Turn) -> bool:
        """Whether the person orders the purchase of the basket here and now.

        After a query that names a thing of the shop, "buy it" may mean that thing.
        """
        return consents(turn.utterance, about_one=bool(self._search.mentioned(turn.query)))

    def checks_met(self, profile: Profile) -> list[bool]:
        """Which of the profile's checks the basket meets; an empty basket meets none."""
        return checks_met(profile.checks, self._contents(), bought=self._bought)

    @property
    def _names(self) -> Names:
        return self.catalogue.names

    def _heard(self, turns: Sequence[Turn]) -> Hearing:
        return self._talk.heard(turns, self._contents())

    def _changes(self, hearing: Hearing) -> list[Action]:
        out = self._taken_out - self._basket.keys()
        left = [item for name in sorted(out) if (item := self.catalogue.get(name))]
        return changes(hearing, self._contents(), self._choice, left)

    def _after(self, turns: Sequence[Turn]) -> Decimal:
        """Price of the basket once it is as the person asks for outright."""
        total = self.total
        for action in self.requests(turns):
            item = self.catalogue.get(action.target)
            price = (item.price if item else None) or Decimal(0)
            total += price * action.quantity * (1 if action.name == "add item" else -1)
        return total

    def _too_dear(self, hearing: Hearing, turns: Sequence[Turn]) -> Iterator[tuple[Item, Decimal]]:
        """What costs more than it may if it is to be bought, and how much that is."""
        for turn in turns:
            for piece, most in conditions(turn.utterance):
                for request in hearing.wanted:
                    again = request in hearing.newest and turn is not turns[-1]
                    if again or not kind_of(self._talk.translated(piece), [request.phrase]):
                        continue
                    item = self._choice.meant(request.phrase, hearing, self._basket)
                    if item and item.price is not None and item.price > most:
                        yield item, most

    def _permits(self, name: str, hearing: Hearing) -> bool:
        item = self.catalogue.get(name)
        return item is not None and hearing.permits(item)

    def _means(self, request: Request, hearing: Hearing) -> bool:
        """Whether a request is for a thing of the shop, or for one that it has not."""
        phrase = self._names.shown(request.phrase)
        if phrase in (SAME, SAME_ALL, SAME_TWO) or self._choice.meant(
            phrase, hearing, self._basket
        ):
            return True
        request = replace(request, phrase=phrase)
        return request.outright and bool(self._choice.lacking(request, hearing))

    def _contents(self) -> list[tuple[Item, int]]:
        pairs = ((self.catalogue.get(name), n) for name, n in self._basket.items())
        return [(item, n) for item, n in pairs if item is not None]

    def _look(self, action: Action) -> StepResult:
        found = self.search(action.target, _SHOWN)
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
        told = f"The basket is now purchased for {total}.\n{self.status()}"
        return StepResult(action, True, told, terminated=True, irreversible=True)
