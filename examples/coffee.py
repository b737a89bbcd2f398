"""A coffee counter: verbs, a menu, and what an order does to the cups."""

from itertools import chain

from goalscope.base.nouns import contains, singulars
from goalscope.base.types import Action, StepResult
from goalscope.envs import Environment, Resolution, State
from goalscope.language.matcher import mended
from goalscope.language.orders import Example, Verb

DRINKS: tuple[str, ...] = (
    "latte", "chai latte", "matcha latte", "mocha", "cortado", "cappuccino", "macchiato", "steamer",
    "americano", "espresso", "cold brew", "hot chocolate", "english breakfast", "jin xuan",
    "lavender earl grey", "wild strawberry", "peppermint rose", "cloud and mist", "ginger green",
    "tangerine rooibos",
)  # fmt: skip
OPTIONS: tuple[tuple[str, ...], ...] = (
    ("single", "double", "triple", "quadruple"), ("decaf",), ("iced",),
    ("whole milk", "2% milk", "2% lactose-free milk", "non-fat milk", "almond milk", "oat milk"),
    ("vanilla",), ("caramel",), ("hazelnut",), ("chocolate",),
)  # fmt: skip
CHOICES = tuple(option for group in OPTIONS for option in group)
EXAMPLES = (
    Example("Hi, a decaf latte with oat milk for Ann, please", "add decaf latte with oat milk"),
    Example("two mochas, one of them iced", "add mocha\nadd iced mocha"),
    Example("Actually make that almond milk", "add almond milk"),
    Example("Looks good!", "yes"),
)
VERBS = (
    Verb(
        "add",
        "order a drink, or what is to be in it",
        ("what", "quantity"),
        examples=EXAMPLES,
    ),
    Verb("remove", "leave out a drink, or what is in it", ("what", "quantity"), takes_away=True),
    Verb("swap", "take one thing for another", ("what", "quantity", "for")),
    Verb("finish", "that is all", (), ends=True, phrase="That is all"),
)


class CoffeeCounter(Environment):
    """The cups that were ordered, the newest first, each as "latte, decaf, oat milk"."""

    task = "The agent takes the human's order at a coffee counter."
    verbs, cups = VERBS, ()

    def reset(self):
        self.cups = ()

    def state(self):
        return State(f"Ordered: {'; '.join(reversed(self.cups)) or 'nothing'}.")

    def offers(self, text, limit):
        return list(DRINKS[:limit])

    def step(self, action):
        cups = [*self.cups]
        match action:
            case Action("add", cup, n, "") if n > 0 and cup_of(*cup.split(", ")) == cup:
                cups[:0] = [cup] * n
            case Action("remove", cup, n, "") if 0 < n <= cups.count(cup):
                for _ in range(n):
                    cups.remove(cup)
            case _ if action != Action("finish"):
                return StepResult(action, False, "There is no such cup.")
        self.cups = tuple(cups)
        return StepResult(action, True, self.state().text, terminated=action.name == "finish")

    def resolve(self, order, dialogue, pick):
        if order.do == "finish":
            return Resolution((Action("finish"),))
        if order.do in ("only", "have", "budget", "leave", "undo"):
            return Resolution()
        goes, comes = ("", order.what) if order.do == "add" else (order.what, order.for_)
        comes = "" if order.do == "avoid" else comes
        (drink, without), (new, more) = named(goes, pick), named(comes, pick)
        if order.do == "add" and new:
            return Resolution((Action("add", cup_of(new, *more), int(order.quantity or 1)),))
        meant = [cup for cup in self.cups if {drink, *without} <= {"", *cup.split(", ")}]
        cup = next(iter(meant or (self.cups if new or more else ())), "")
        if not cup or not (drink or without or new or more):
            said = order.for_ or order.what or "such thing"
            return Resolution(why="" if order.do == "avoid" else f"There is no {said} here.")
        count = min(int(order.quantity or 100), self.cups.count(cup))
        old, *options = cup.split(", ")
        kept = [option for option in options if option not in without]
        swapped = [Action("add", cup_of(new or old, *kept, *more), count)]
        gone = drink and not (new or more)
        return Resolution((Action("remove", cup, count), *([] if gone else swapped)))


def named(said, pick):
    """The drink that a noun phrase names, or "", and the options."""
    words = mended(said, singulars(" ".join((*DRINKS, *CHOICES))))
    drinks = [name for name in DRINKS if contains(words, singulars(name))]
    drink = max(drinks, key=lambda name: len(name.split()), default="")
    words = [word for word in words if word not in singulars(drink)]
    options = [name for name in CHOICES if contains(words, singulars(name))]
    other = [word for word in words if word not in singulars(" ".join(options))]
    options += [name for name in (pick(" ".join(other), CHOICES),) if name]
    return drink or ("" if options else pick(said, DRINKS)), options


def cup_of(drink, *options):
    """A cup's name: of each group of options the last one; None where there is no such drink."""
    chosen = [[each for each in options if each in group][-1:] for group in OPTIONS]
    return ", ".join([drink, *chain(*chosen)]) if drink in DRINKS else None


def open_environment(profile):
    """The counter before anybody has ordered."""
    return CoffeeCounter()


def load_profiles(path):
    """Nobody's: the orders that it is measured on are those of `benchmarks/orders.py`."""
    return ()
