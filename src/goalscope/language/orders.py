"""The meaning of an utterance: verbs, orders in canonical English, and readings.

Natural language becomes these types in `goalscope.language.reader`, and nowhere else.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib.resources import files
from typing import Any, cast

from goalscope.base.inputs import read_table
from goalscope.base.types import InvalidInputError

SLOTS = ("what", "quantity", "but", "for", "where", "if", "why", "about")
"""The slots of an order; `unit` goes with `quantity`."""

MORE = "more"
"""The end of a unit where there is to be so many more than there are: "add milk | 1 more"."""

ANY_VERB = ("but", "if")
"""The slots that every verb takes."""

PHRASES = ("what", "but", "for_", "where", "if_")
"""The attributes of an order that hold what was said."""

REASONS = ("allergy", "diet", "taste")
"""Reasons for a limit, the gravest first."""

ABOUT = (
    "why", "guessed", "added", "removed", "done", "asked", "enough", "total", "count", "any",
    "undo", "goal", "abilities",
)  # fmt: skip
"""What a question may be about; a plain one asks for facts about a thing.

Of what the agent did: why, what nobody had asked for, what came, what went, all else. Then: what
the person said; for how many it is enough; what all of it costs; how many there are; whether there
is any; what an undo takes back; what the person is thought to want; what the agent can do.
"""

CHOICES = {"why": REASONS, "about": ABOUT}
"""The slots that take one of a few values."""

_ACTS_IN_WORDS = {"ask": "ask about", "aim": "aim:", "have": "have already:"}

_OBJECTS = {"i": "me", "I": "me", "he": "him", "she": "her", "we": "us", "they": "them"}

_NUMBER = r"\d{1,6}(?:\.\d{1,3})?"
_QUANTITY = re.compile(rf"({_NUMBER})(?: (\S+(?: \S+){{0,2}}))?")
_WORD = re.compile(r"[^\s|,;:.!?()\[\]{}<>\"“”„«»…]+(?:[.,:][^\s|,;:.!?()\[\]{}<>\"“”„«»…]+)*")


@dataclass(frozen=True, slots=True)
class Verb:
    """A verb of a domain's language, declared by its environment.

    Attributes:
        name: Such as "add" or "turn on".
        doc: What it does, in one line, for the prompt.
        slots: Those of `SLOTS` that it takes besides `ANY_VERB`.
        irreversible: Whether no use of it can be undone.
        takes_away: Whether it removes the thing: no limit forbids that, and it lifts none.
        ends: Whether it ends the task.
        phrase: The words that a person says to end the task, of a verb that ends it.
        examples: Messages with their orders, for models that were not taught to read; they may
            have other verbs, too.
    """

    name: str
    doc: str
    slots: tuple[str, ...] = ("what",)
    irreversible: bool = False
    takes_away: bool = False
    ends: bool = False
    phrase: str = ""
    examples: tuple[Example, ...] = ()


DIALOGUE_ACTS: tuple[Verb, ...] = (
    Verb("avoid", "a thing that must not come", ("what", "for", "why")),
    Verb("only", "a property that all must have", ("what", "for", "why")),
    Verb("have", "a thing that they have already", ("what", "quantity")),
    Verb("budget", "the most it may cost", ("quantity",)),
    Verb("leave", "a thing not to be touched", ("what", "quantity", "where")),
    Verb("undo", "take back what was done last", ("what", "quantity")),
    Verb("ask", "a question, and the thing asked about", ("what", "where", "about")),
    Verb("yes", "agrees to what was asked", ()),
    Verb("no", "declines what was asked", ()),
    Verb("aim", "what it is all for, in few of their words"),
    Verb("none", "nothing of these", ()),
)
"""What utterances do in any domain, besides the domain's own verbs."""


TELLING = ("aim", "none", "avoid", "only", "have", "budget")
"""Dialogue acts that ask for nothing."""


@dataclass(frozen=True, slots=True)
class Order:
    """One thing that an utterance asks for, rules out or does; an empty slot is "" or None.

    Attributes:
        do: Name of a verb of the domain, or of a dialogue act.
        what: The thing, as said.
        quantity: How many or how much.
        unit: Of the quantity, in the singular.
        for_: What replaces the thing in a swap; whom a limit is for.
        where: Where the thing goes, or which one it is.
        if_: The condition, as said.
        why: Reason of a limit: "allergy", "diet" or "taste".
        but: What is excepted, as said.
        about: What a question is about, one of `ABOUT`; "" for facts.
    """

    do: str
    what: str = ""
    quantity: float | None = None
    unit: str = ""
    for_: str = ""
    where: str = ""
    if_: str = ""
    why: str = ""
    but: str = ""
    about: str = ""

    @property
    def phrases(self) -> tuple[str, ...]:
        """The values of `PHRASES`."""
        return tuple(getattr(self, name) for name in PHRASES)

    def reworded(self, change: Callable[[str], str]) -> Order:
        """The order with each of its phrases changed."""
        return replace(self, **{name: change(getattr(self, name)) for name in PHRASES})


@dataclass(frozen=True, slots=True)
class Example:
    """A message with its orders: a few-shot example for models that were not taught to read.

    Attributes:
        message: What a person says.
        orders: Its orders in canonical English (see `orders_to_text`).
        question: What they had been asked.
        here: What the agent saw; see `Reader.read`.
    """

    message: str
    orders: str
    question: str = ""
    here: str = ""


@dataclass(frozen=True, slots=True)
class Reading:
    """The meaning of one utterance.

    Attributes:
        orders: As they were said; a single "none" if there are none.
        log_probability: Of this reading under the model, nats; None if unknown.
        margins: For each order, the smallest lead of one of its tokens over the next likeliest
            one, nats; None if unknown.
    """

    orders: tuple[Order, ...]
    log_probability: float | None = None
    margins: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        """Check that each order has its margin."""
        if self.margins is not None and len(self.margins) != len(self.orders):
            raise InvalidInputError(
                f"A reading of {len(self.orders)} orders needs as many margins, or None, not "
                f"{len(self.margins)}."
            )

    def sure(self, order: Order, threshold: float) -> bool:
        """Whether an order's margin reaches the threshold, in nats, or is unknown."""
        if self.margins is None:
            return True
        return self.margins[self.orders.index(order)] >= threshold

    def tells(self, act: str) -> bool:
        """Whether an order has this verb or dialogue act."""
        return any(order.do == act for order in self.orders)

    @property
    def only_tells(self) -> bool:
        """Whether the words ask for nothing and agree to nothing, so that they may tell an aim."""
        return all(order.do in TELLING for order in self.orders)

    @property
    def says_nothing(self) -> bool:
        """Whether the words were read as nothing at all, as thanks are."""
        return all(order.do == "none" for order in self.orders)


def order_to_json(order: Order) -> dict[str, str | int | float]:
    """An order as JSON without its empty slots; whole quantities are integers."""
    found: dict[str, str | int | float] = {}
    for field in fields(order):
        value = getattr(order, field.name)
        if value not in ("", None):
            whole = isinstance(value, float) and value.is_integer()
            found[field.name.rstrip("_")] = int(value) if whole else value
    return found


def order_from_json(data: object) -> Order:
    """The order that `order_to_json` wrote; null stands for an empty slot.

    Raises:
        InvalidInputError: It is no such object; names the wrong key.
    """
    if not isinstance(data, dict):
        raise InvalidInputError(f"An order must be an object, not {data!r}.")
    names = {field.name.rstrip("_"): field.name for field in fields(Order)}
    values: dict[str, Any] = {}
    for key, value in cast("dict[str, Any]", data).items():
        if key not in names:
            raise InvalidInputError(
                f"An order has no key {key!r}. The keys are: {', '.join(names)}."
            )
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(
            value, (int, float) if key == "quantity" else str
        ):
            raise InvalidInputError(f"{key} of an order cannot be {value!r}.")
        values[names[key]] = float(value) if key == "quantity" else value
    if not values.get("do"):
        raise InvalidInputError('An order needs a verb under the key "do".')
    return Order(**values)


def orders_to_text(orders: Iterable[Order]) -> str:
    """Orders as canonical English, one a line: `add potatoes | 2 kg`, `put mug | where sink`."""
    return "\n".join(map(_line, orders))


def order_in_words(order: Order) -> str:
    """An order for people to read: `add potatoes (2 kg)`, `avoid nuts for him (allergy)`."""
    told = [_ACTS_IN_WORDS.get(order.do, order.do) if order.what else order.do, order.what]
    told += [f"for {_OBJECTS.get(order.for_, order.for_)}"] if order.for_ else []
    told += [f"except {order.but}"] if order.but else []
    told += [f"if {order.if_}"] if order.if_ else []
    details = ", ".join(filter(None, (_amount(order), order.where, order.why, order.about)))
    return " ".join(filter(None, [*told, f"({details})" * bool(details)]))


def orders_from_text(text: str, verbs: Sequence[Verb]) -> tuple[Order, ...]:
    """The orders that `orders_to_text` wrote.

    Args:
        text: Canonical English.
        verbs: Those of the domain; dialogue acts are always known.

    Raises:
        InvalidInputError: A line is no order; quotes it.
    """
    known = {verb.name: verb for verb in (*verbs, *DIALOGUE_ACTS)}
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return tuple(_order(line, known) for line in lines)


def words_of(text: str) -> list[str]:
    """The words of a text in lower case, without punctuation around them."""
    return [match[0].casefold() for match in _WORD.finditer(text)]


def speaks(order: Order) -> bool:
    """Whether an order asks for something or rules it out; yes, no, aim and none do not."""
    return order.do not in ("yes", "no", "aim", "none")


def is_aside(orders: Sequence[Order]) -> bool:
    """Whether words name nothing and tell no aim, such as "Yes, buy it" and "Undo that".

    Words that were read as nothing at all ("none") are no aside: they may tell anything.
    """
    return all(
        each == Order(each.do, about=each.about) and each.do not in ("aim", "none")
        for each in orders
    )


def _line(order: Order) -> str:
    told = order_to_json(order)
    parts = [f"{order.do} {order.what}".strip(), *filter(None, [_amount(order)])]
    return " | ".join([*parts, *(f"{slot} {told[slot]}" for slot in SLOTS[2:] if slot in told)])


def _amount(order: Order) -> str:
    if order.quantity is None:
        return ""
    number = f"{order.quantity:.3f}".rstrip("0").rstrip(".")
    return f"{number} {order.unit}".strip()


def _order(line: str, known: dict[str, Verb]) -> Order:
    head, *rest = (part.strip() for part in line.split("|"))
    names = [name for name in known if head == name or head.startswith(f"{name} ")]
    if not names:
        raise InvalidInputError(f"There is no verb in {line!r}. The verbs are: {', '.join(known)}.")
    verb = known[max(names, key=len)]
    values: dict[str, str] = {"what": head[len(verb.name) :].strip()}
    quantity, unit = None, ""
    for part in rest:
        name, _, value = part.partition(" ")
        if match := _QUANTITY.fullmatch(part):
            name, quantity, unit = "quantity", float(match[1]), match[2] or ""
        elif name in SLOTS and value:
            values[name] = value
        else:
            raise InvalidInputError(f"There is no slot {part!r}, in {line!r}.")
        if name not in (*verb.slots, *ANY_VERB):
            raise InvalidInputError(f"{verb.name} takes no {name}: {line!r}")
    if values["what"] and "what" not in verb.slots:
        raise InvalidInputError(f"{verb.name} takes no thing: {line!r}")
    for slot, choices in CHOICES.items():
        if slot in values and values[slot] not in choices:
            raise InvalidInputError(f"{slot} must be one of {', '.join(choices)}: {line!r}")
    return order_from_json({"do": verb.name, **values, "quantity": quantity, "unit": unit})


@cache
def with_examples(verbs: tuple[Verb, ...], package: str) -> tuple[Verb, ...]:
    """The verbs with the examples of a package's `data`: `examples.toml`, then `examples.jsonl`."""
    data = files(package) / "data"
    chosen = (data / "examples.jsonl").read_text(encoding="utf-8").splitlines()
    rows = [*read_table(data / "examples.toml")["example"], *map(json.loads, chosen)]
    return replace(verbs[0], examples=tuple(Example(**row) for row in rows)), *verbs[1:]


def examples_of(verbs: Iterable[Verb]) -> list[Example]:
    """The examples of all verbs."""
    return [example for verb in verbs for example in verb.examples]
