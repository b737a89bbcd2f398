"""What an utterance comes to: the verbs of a domain, orders in canonical English, and a reading.

Natural language becomes these types in `goalscope.reader`, and nowhere else.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

from goalscope.types import InvalidInputError

__all__ = [
    "DIALOGUE_ACTS",
    "SLOTS",
    "TELLING",
    "Example",
    "Order",
    "Reading",
    "Verb",
    "is_aside",
    "order_from_json",
    "order_to_json",
    "orders_from_text",
    "orders_to_text",
    "speaks",
    "words_of",
]

SLOTS = ("what", "quantity", "for", "where", "if", "why")
"""What an order may hold besides its verb; `unit` goes with `quantity`, `if` with any verb."""

REASONS = ("allergy", "diet", "taste")
"""Why a thing must not come, the gravest first."""

_NUMBER = r"\d{1,6}(?:\.\d{1,3})?"
_QUANTITY = re.compile(rf"({_NUMBER})(?: (\S+(?: \S+){{0,2}}))?")
_WORD = re.compile(r"[^\s|,;:.!?()\[\]{}<>\"“”„«»…]+(?:[.,:][^\s|,;:.!?()\[\]{}<>\"“”„«»…]+)*")


@dataclass(frozen=True, slots=True)
class Verb:
    """A word of a domain's language, declared by its environment.

    Attributes:
        name: Such as "add" or "turn on".
        doc: What it does, in one line, for the prompt.
        slots: Those of `SLOTS` that it takes besides `if`.
        irreversible: Whether nobody can undo it.
        takes_away: Whether it removes what it names: no limit forbids that, and none is lifted.
    """

    name: str
    doc: str
    slots: tuple[str, ...] = ("what",)
    irreversible: bool = False
    takes_away: bool = False


DIALOGUE_ACTS: tuple[Verb, ...] = (
    Verb("avoid", "a thing that must not come", ("what", "for", "why")),
    Verb("only", "a property that all must have", ("what", "for", "why")),
    Verb("budget", "the most it may cost", ("quantity",)),
    Verb("leave", "a thing not to be touched", ("what", "quantity", "where")),
    Verb("undo", "take back what was done last", ("what", "quantity")),
    Verb("ask", "a question, and the thing asked about", ("what", "where")),
    Verb("yes", "agrees to what was asked", ()),
    Verb("no", "declines what was asked", ()),
    Verb("aim", "tells what it is all for", ()),
    Verb("none", "nothing of these", ()),
)
"""What words do in any domain, besides the domain's own verbs."""


TELLING = ("aim", "none", "avoid", "only", "budget")
"""Dialogue acts that ask for nothing."""


@dataclass(frozen=True, slots=True)
class Order:
    """One thing that an utterance asks for, rules out or does; what is absent is "" or None.

    Attributes:
        do: Name of a verb of the domain, or of a dialogue act.
        what: The thing, as said.
        quantity: How many or how much.
        unit: Of the quantity, in the singular.
        for_: What takes the thing's place in a swap; whom a limit is for.
        where: Where it goes, or which one it is.
        if_: The condition, as said.
        why: Why a limit holds: "allergy", "diet" or "taste".
    """

    do: str
    what: str = ""
    quantity: float | None = None
    unit: str = ""
    for_: str = ""
    where: str = ""
    if_: str = ""
    why: str = ""


@dataclass(frozen=True, slots=True)
class Example:
    """A message and what it comes to, which shows a model that was not taught how to read.

    Attributes:
        message: What a person says.
        orders: Its orders in canonical English (see `orders_to_text`).
        question: What they had been asked.
    """

    message: str
    orders: str
    question: str = ""


@dataclass(frozen=True, slots=True)
class Reading:
    """What one utterance comes to.

    Attributes:
        orders: In the order in which they were said; the only one is "none" where there is none.
        log_probability: Of this reading by the model, nats.
        margins: Order by order, the nats by which it was preferred to another one where it was
            least sure: the smallest lead of a token over the next likeliest. None where the model
            does not tell.
    """

    orders: tuple[Order, ...]
    log_probability: float | None = None
    margins: tuple[float, ...] | None = None

    def sure(self, order: Order, threshold: float) -> bool:
        """Whether an order of it was read with a margin of so many nats, or nobody knows."""
        if self.margins is None:
            return True
        return self.margins[self.orders.index(order)] >= threshold

    def tells(self, act: str) -> bool:
        """Whether a verb or dialogue act is among the orders."""
        return any(order.do == act for order in self.orders)

    @property
    def only_tells(self) -> bool:
        """Whether the words ask for nothing and agree to nothing: they may tell an aim."""
        return all(order.do in TELLING for order in self.orders)

    @property
    def says_nothing(self) -> bool:
        """Whether the words were read as nothing at all, as thanks are."""
        return all(order.do == "none" for order in self.orders)


def order_to_json(order: Order) -> dict[str, str | int | float]:
    """An order as JSON, without what is absent; whole quantities are integers."""
    found: dict[str, str | int | float] = {}
    for field in fields(order):
        value = getattr(order, field.name)
        if value not in ("", None):
            whole = isinstance(value, float) and value.is_integer()
            found[field.name.rstrip("_")] = int(value) if whole else value
    return found


def order_from_json(data: object) -> Order:
    """Read what `order_to_json` wrote; null stands for what is absent.

    Raises:
        InvalidInputError: It is no such object; says which key is wrong.
    """
    if not isinstance(data, dict):
        raise InvalidInputError(f"An order must be an object, not {data!r}.")
    names = {field.name.rstrip("_"): field.name for field in fields(Order)}
    values: dict[str, str | float] = {}
    for key, value in data.items():  # pyright: ignore[reportUnknownVariableType]
        if key not in names:
            raise InvalidInputError(
                f"An order has no key {key!r}. The keys are: {', '.join(names)}."
            )
        if value is None:
            continue
        if key == "quantity" and isinstance(value, int | float) and not isinstance(value, bool):
            values[names[key]] = float(value)
        elif key != "quantity" and isinstance(value, str):
            values[names[key]] = value
        else:
            raise InvalidInputError(f"{key} of an order cannot be {value!r}.")
    if not values.get("do"):
        raise InvalidInputError('An order needs a verb under the key "do".')
    return Order(**values)  # pyright: ignore[reportArgumentType]


def orders_to_text(orders: Iterable[Order]) -> str:
    """Orders as canonical English, one a line: `add potatoes | 2 kg`, `put mug | where sink`."""
    return "\n".join(map(_line, orders))


def orders_from_text(text: str, verbs: Sequence[Verb]) -> tuple[Order, ...]:
    """Read canonical English.

    Args:
        text: As of `orders_to_text`.
        verbs: Those of the domain; the dialogue acts need not be named.

    Raises:
        InvalidInputError: A line is none; says which one.
    """
    known = {verb.name: verb for verb in (*verbs, *DIALOGUE_ACTS)}
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return tuple(_order(line, known) for line in lines)


def words_of(text: str) -> list[str]:
    """The words of a text in lower case, without the marks around them."""
    return [match[0].casefold() for match in _WORD.finditer(text)]


def speaks(order: Order) -> bool:
    """Whether an order asks for or rules out something: no mere yes, no, aim or nothing."""
    return order.do not in ("yes", "no", "aim", "none")


def is_aside(orders: Sequence[Order]) -> bool:
    """Whether words name nothing and tell no aim, as "Yes, buy it" and "Undo that" do.

    Words that were read as nothing at all ("none") are no aside: they may tell anything.
    """
    return all(each == Order(each.do) and each.do not in ("aim", "none") for each in orders)


def _line(order: Order) -> str:
    parts = [f"{order.do} {order.what}".strip()]
    if order.quantity is not None:
        number = f"{order.quantity:.3f}".rstrip("0").rstrip(".")
        parts.append(f"{number} {order.unit}".strip())
    slots = (("for", order.for_), ("where", order.where), ("if", order.if_), ("why", order.why))
    return " | ".join([*parts, *(f"{name} {value}" for name, value in slots if value)])


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
        if name not in (*verb.slots, "if"):
            raise InvalidInputError(f"{verb.name} takes no {name}: {line!r}")
    if values["what"] and "what" not in verb.slots:
        raise InvalidInputError(f"{verb.name} takes no thing: {line!r}")
    if values.get("why", "taste") not in REASONS:
        raise InvalidInputError(f"why must be one of {', '.join(REASONS)}: {line!r}")
    return Order(
        verb.name,
        values["what"],
        quantity,
        unit,
        values.get("for", ""),
        values.get("where", ""),
        values.get("if", ""),
        values.get("why", ""),
    )
