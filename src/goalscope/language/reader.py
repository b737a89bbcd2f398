"""The reader: an utterance in its conversation becomes a `Reading`.

A reading is one constrained generation. Verbs and dialogue acts are enumerated, and every word of a
thing was said, now or earlier, or is shown by the environment: so no reading orders what nobody
named. A grammar enforces this where the engine takes one; where a server only takes a JSON schema,
the answer is checked. Small models write short canonical English under a grammar better than free
text (Shin et al., 2021).

Models misread amounts: number words, marks between digits, sums of money. So they are shown all
amounts in plain figures, and a quantity that nobody said is asked about.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, cast
from unicodedata import category

from goalscope.base.nouns import singular
from goalscope.base.text import plain
from goalscope.base.types import (
    InvalidInputError,
    Message,
    UnreadableAnswerError,
    checked_text,
)
from goalscope.language.amounts import figures, numbers_in, sums_in
from goalscope.language.orders import (
    ANY_VERB,
    CHOICES,
    DIALOGUE_ACTS,
    PHRASES,
    SLOTS,
    Example,
    Order,
    Reading,
    Verb,
    examples_of,
    order_from_json,
    order_to_json,
    orders_from_text,
    orders_to_text,
    words_of,
)
from goalscope.language.questions import told_about
from goalscope.models import Generator, Roles
from goalscope.models.nearest import Nearest
from goalscope.prompts import render

Form = Literal["text", "json"]

MOST_ORDERS = 24
"""Largest number of orders in a reading."""

_FIXED, _NEAREST = 13, 6  # examples in every prompt, and for one message
_WINDOW = 9  # earlier messages that the prompt holds, for what the newest one refers to
_MOST_TOKENS = 320  # of a reading
_LONGEST_NAME = 12  # words of a thing
_UNWRITTEN = frozenset({"Cc", "Cn", "Co", "Cs"})  # Unicode categories that no word holds
_NAMING = ("avoid", "only", "have")  # acts that need a thing
_PACKS = ("pack", "pk")  # units that a number may belong to: a 6-pack
_SIZED = r"(?:(\w+) (?:x )?)?(?<![\w.,])(\w+?)[ -]?(?:pack|pk)(s?)(?!\w)"
_PRODUCT = re.compile(r"\d[^.;!?\d]*? ?(?:[x\u00d7*]|times) ?\d", re.IGNORECASE)
_PERCENTAGE = re.compile(r"(?<!\S)\S+?[ -]?(?:%|per ?cent|pct)(?!\w)", re.IGNORECASE)
_UP_TO = 12  # numbers that other words stand for: both, a few, half a dozen
_RANGE = re.compile(r"\b(\d{1,2})-(\d{1,2})\b")
SUREST = 99.0  # nats, where a model reports none


@dataclass(frozen=True, slots=True)
class ReadExample:
    """An earlier message of the conversation, with its reading.

    Attributes:
        question: What the agent had asked; "" if that does not matter.
        message: What the person said.
        orders: The orders that were read.
        here: What the agent saw; "" if that does not matter.
    """

    question: str
    message: str
    orders: tuple[Order, ...]
    here: str = ""


class Reader:
    """Reads what a person says in one domain.

    Args:
        model: Writes the readings.
        verbs: The domain's own verbs.
        task: The agent and its task, for a model that was not taught to read.
        examples: Few-shot examples for such a model. It is shown the first ones with each message,
            and those of the rest that are nearest to it (Liu et al., 2022: "What Makes Good
            In-Context Examples for GPT-3?").
        taught: Whether the model has an adapter that was fitted on reading. The prompt then only
            names the verbs.
        form: Canonical English ("text") or JSON. A model that takes no grammar always writes JSON.

    Raises:
        InvalidInputError: The domain has no verbs, two of the same name, or an unknown slot.
    """

    def __init__(
        self,
        model: Generator,
        verbs: Sequence[Verb],
        *,
        task: str = "",
        examples: Sequence[Example] = (),
        taught: bool = False,
        form: Form = "text",
    ) -> None:
        check_verbs(verbs)
        self.model = model
        self.verbs = (*verbs, *DIALOGUE_ACTS)
        self.form: Form = form if model.takes_grammar else "json"
        self._own = tuple(verbs)
        self._taught = taught
        if taught:
            self._opening = render("read", verbs=self.verbs)
        else:
            self._opening = render("read_untaught", verbs=self.verbs, task=task, form=self.form)
        known = [
            ReadExample(
                each.question, each.message, orders_from_text(each.orders, verbs), each.here
            )
            for each in (() if taught else examples)
        ]
        self._examples, self._others = known[:_FIXED], known[_FIXED:]

    def read(
        self,
        message: str,
        *,
        question: str = "",
        before: Sequence[ReadExample] = (),
        here: str = "",
    ) -> Reading:
        """Read one message.

        Args:
            message: What the person said.
            question: What the agent had asked.
            before: What was said earlier, oldest first, with its readings.
            here: What the agent sees, in few words: "2 x Whole Milk; 1 x Brown Bread". A reading
                may use these words, too.

        Raises:
            InvalidInputError: The message is empty, broken, or too long for the model.
            UnreadableAnswerError: The model wrote no valid reading.
        """
        typed = plain(checked_text(message, "utterance"))
        message = figures(typed)
        question = _legible(question)
        before = _newest(before)
        shown = [*self._shown(message), *before]
        here = _legible(here)
        line = self._line(here)
        prompt = self._prompt(_asked(message, question, line), shown)
        most = self.model.context_size - _MOST_TOKENS
        while (shown or line) and self.model.count_tokens(prompt) > most:
            shown, line = shown[1:], line if shown else ""
            prompt = self._prompt(_asked(message, question, line), shown)
        if (tokens := self.model.count_tokens(prompt)) > most:
            raise InvalidInputError(
                f"The message is too long to be read: {tokens} tokens with the prompt, of at most "
                f"{most}. Say it in several messages."
            )
        texts = [text for each in before for text in (each.question, each.message)]
        said = dict.fromkeys(
            word
            for text in (message, typed, question, *texts, _in_full(here))
            for word in words_of(text)
        )
        if self.form == "text":
            written = self.model.generate(
                prompt, max_tokens=_MOST_TOKENS, grammar=grammar_of(self._own, said)
            )
        else:
            written = self.model.generate(
                prompt, max_tokens=3 * _MOST_TOKENS, schema=schema_of(self._own)
            )
        lines = self._lines(written.text, said)
        lines = told_about(lines, typed) if self._taught else lines
        earlier = {each.quantity or 0.0 for exchange in before for each in exchange.orders}
        earlier |= {number for text in (question, *texts) for number in numbers_in(text)}
        said_numbers = numbers_in(message) | earlier
        lines = [_mended(each, message, said_numbers) for each in lines]
        orders = tuple(dict.fromkeys(lines))
        if len(orders) > 1:
            orders = tuple(each for each in orders if each.do != "none")
        orders = orders[:MOST_ORDERS] or (Order("none"),)
        doubts = [_is_doubtful(each, message, said_numbers) for each in orders]
        margins = written.margins and self._margins(orders, lines, written.margins)
        if any(doubts):
            sure = margins or [SUREST] * len(orders)
            margins = tuple(0.0 if each else m for each, m in zip(doubts, sure, strict=True))
        return Reading(orders, written.log_probability, margins)

    def prompt(
        self,
        message: str,
        *,
        question: str = "",
        before: Sequence[ReadExample] = (),
        here: str = "",
    ) -> list[Message]:
        """The chat that the model answers with the reading of `message`."""
        asked = _asked(_legible(message), _legible(question), self._line(_legible(here)))
        return self._prompt(asked, [*self._shown(_legible(message)), *_newest(before)])

    def _line(self, here: str) -> str:
        """What is here, if it is shown: the adapter was not fitted on it (docs/log.md)."""
        return "" if self._taught else here

    def _shown(self, message: str) -> list[ReadExample]:
        """The examples for a message, the nearest first: small models copy what stands last."""
        near = self._nearest(message, _NEAREST) if self._others else []
        return [*near, *self._examples]

    @cached_property
    def _nearest(self) -> Nearest[ReadExample]:
        return Nearest(self._others, lambda each: (each.message,))

    def _prompt(self, asked: str, shown: Sequence[ReadExample]) -> list[Message]:
        chat = [*self._opening]
        for each in shown:
            chat.append(Message("user", _asked(each.message, each.question, each.here)))
            chat.append(Message("assistant", self.written(each.orders)))
        return [*chat, Message("user", asked)]

    def written(self, orders: Sequence[Order]) -> str:
        """Orders as the model writes them."""
        if self.form == "text":
            return orders_to_text(orders)
        return json.dumps([order_to_json(each) for each in orders], ensure_ascii=False)

    def _margins(
        self, orders: Sequence[Order], lines: Sequence[Order], margins: Sequence[float]
    ) -> tuple[float, ...]:
        """The margin of each order's first line; in JSON, that of the whole reading."""
        found = dict.fromkeys(orders, min(margins))
        if self.form == "text":
            for order, margin in reversed([*zip(lines, margins, strict=False)]):
                found[order] = margin
        return tuple(found[order] for order in orders)

    def _lines(self, text: str, said: Mapping[str, None]) -> tuple[Order, ...]:
        """The orders that the model wrote, checked for words that nobody said."""
        try:
            if self.form == "text":
                orders = orders_from_text(text, self._own)
            else:
                data = json.loads(text)
                if not isinstance(data, list):
                    raise InvalidInputError("A reading must be a list of orders.")
                orders = tuple(order_from_json(each) for each in data)  # pyright: ignore
                orders = orders_from_text(orders_to_text(orders), self._own)
        except (ValueError, OverflowError, RecursionError, InvalidInputError) as error:
            raise UnreadableAnswerError(f"The model wrote no reading: {error}") from None
        for order in orders:
            for phrase in order.phrases:
                if unsaid := [word for word in words_of(phrase) if word not in said]:
                    raise UnreadableAnswerError(
                        f"The model read {unsaid[0]!r}, which nobody said and nothing here is "
                        "called. Please say it in other words."
                    )
        return orders


def _mended(order: Order, message: str, said: Collection[float]) -> Order:
    """An order with the unit that its number has in the message, if the model left it out.

    The number may be a sum of money, a percentage, or the size of a pack. A budget that nobody
    named is one without a number.
    """
    number, unit = order.quantity, order.unit
    if number is None:
        return order
    if order.do == "budget" and unit in ("k", "K"):
        return replace(order, quantity=1000 * number, unit="")
    counts = () if order.do == "budget" else numbers_in(message, money=False)
    money = (each.currency for each in sums_in(message) if float(each.amount) == number)
    if order.do == "budget" and number not in said:
        return Order("budget", if_=order.if_)
    if number not in counts and (order.do == "budget" or not unit):
        unit = next((singular(each) for each in money), unit)
    elif not unit and number in numbers_in(" ".join(_PERCENTAGE.findall(message))):
        rest = numbers_in(_PERCENTAGE.sub(" ", message))
        unit = "" if number in rest else "percent"
    elif unit in _PACKS:
        for count, size, many in re.findall(_SIZED, message):
            pack = max(numbers_in(size), default=0)
            packs = max(numbers_in(count), default=0) or (not many and 1.0)
            if pack > 1 and packs and number in (pack, packs):
                return replace(order, quantity=packs, unit=f"{pack:g}-{unit}")
    held = rf"\b{re.escape(unit)}(?:e?s)? of (\w+) {re.escape(order.what)}"
    if unit and (found := re.search(held, message, re.IGNORECASE)):
        size = max(numbers_in(found[1]), default=0)
        unit = f"{unit} of {size:g}" if size else unit
    return replace(order, unit=unit)


def _is_doubtful(order: Order, message: str, said: Collection[float]) -> bool:
    """Whether nobody said an order's number, or the message multiplies it.

    Numbers up to a dozen are said in many ways.
    """
    number = order.quantity or 0.0
    broken = number > 1 and not number.is_integer() and not order.unit
    unsaid = (number > _UP_TO or broken) and number not in said
    return unsaid or (order.quantity is not None and bool(_PRODUCT.search(message)))


def reader_of(
    model: Generator, verbs: Sequence[Verb], *, task: str = "", examples: Sequence[Example] = ()
) -> Reader:
    """The reader of a domain, by the part of the model that was taught to read if there is one.

    Args:
        model: From `open_model`, or any that writes.
        verbs: The domain's own verbs.
        task: The agent and its task.
        examples: Few-shot examples.
    """
    reader, taught = (model.reader, model.taught) if isinstance(model, Roles) else (model, False)
    return Reader(reader, verbs, task=task, examples=examples, taught=taught)


def grammar_of(verbs: Sequence[Verb], words: Iterable[str]) -> str:
    """A grammar, in GBNF, of the readings that use only these words; see `orders_from_text`.

    Words with control characters and the like are left out: a model may have no token for them.
    """
    known = [_literal(word) for word in words if not _UNWRITTEN & {*map(category, word)}]
    known = known or ['"nothing"']
    rules = [
        f'root ::= order ("\\n" order){{0,{MOST_ORDERS - 1}}}',
        f"words ::= word ({_literal(' ')} word){{0,{_LONGEST_NAME - 1}}}",
        f"word ::= {' | '.join(known)}",
        'quantity ::= [0-9]{1,6} ("." [0-9]{1,3})? (" " unit)?',
        'unit ::= part (" " part){0,2}',
        "part ::= [^ |\\n\\r\\t]{1,16}",
        *(f"{slot} ::= {' | '.join(map(_literal, each))}" for slot, each in CHOICES.items()),
    ]
    forms: list[str] = []
    for verb in (*verbs, *DIALOGUE_ACTS):
        parts = [_literal(verb.name)]
        for slot in SLOTS:
            if slot not in (*verb.slots, *ANY_VERB):
                continue
            if slot == "what":
                parts.append('" " words' if verb.name in _NAMING else '(" " words)?')
            elif slot == "quantity":
                parts.append('(" | " quantity)?')
            else:
                value = slot if slot in CHOICES else "words"
                parts.append(f"({_literal(f' | {slot} ')} {value})?")
        forms.append(" ".join(parts))
    return "\n".join([f"order ::= {' | '.join(forms)}", *rules])


def schema_of(verbs: Sequence[Verb]) -> dict[str, Any]:
    """A JSON schema of readings."""
    text: dict[str, Any] = {"type": "string", "maxLength": 120}
    order: dict[str, Any] = {
        "type": "object",
        "properties": {
            "do": {"enum": [verb.name for verb in (*verbs, *DIALOGUE_ACTS)]},
            **{name.rstrip("_"): text for name in PHRASES},
            "quantity": {"type": "number"},
            "unit": {"type": "string", "maxLength": 40},
            **{slot: {"enum": [*choices]} for slot, choices in CHOICES.items()},
        },
        "required": ["do"],
        "additionalProperties": False,
    }
    return {"type": "array", "items": order, "minItems": 1, "maxItems": MOST_ORDERS}


def _legible(text: str) -> str:
    """A text with plain characters and figures."""
    return figures(plain(text))


def _newest(before: Sequence[ReadExample]) -> list[ReadExample]:
    """The newest of the earlier messages, legible."""
    return [
        ReadExample(_legible(each.question), _legible(each.message), each.orders)
        for each in before[-_WINDOW:]
    ]


def _asked(message: str, question: str, here: str = "") -> str:
    here = " ".join(here.split())  # one line, so that no name passes for another part
    told = (("Here", here), ("Asked", question))
    return "\n".join([*(f"({name}: {text})" for name, text in told if text), message])


def _in_full(here: str) -> str:
    """What is here, and beside each range its numbers: "egg 1-3" has 2, too."""

    def with_numbers(found: re.Match[str]) -> str:
        return " ".join([found[0], *map(str, range(int(found[1]), int(found[2]) + 1))])

    return _RANGE.sub(with_numbers, here)


def _literal(text: str) -> str:
    escaped = re.sub(r'(["\\])', r"\\\1", text)
    return f'"{escaped}"'


def check_verbs(verbs: Sequence[Verb], examples: Sequence[Example] = ()) -> None:
    """Check that a reader can use these verbs with their examples, and further examples.

    Raises:
        InvalidInputError: There are none, something else, two of the same name, or an unknown slot;
            or an example does not parse.
    """
    if isinstance(verbs, Verb):
        raise InvalidInputError(
            f"`verbs` must be a tuple of Verbs, not the one Verb {verbs.name!r}. Write "
            "verbs = (Verb(...),), with the comma."
        )
    if not verbs:
        raise InvalidInputError(
            "The environment declares no verbs, so that nothing can be asked of it. Give `verbs`, "
            'such as (Verb("add", "plant something"),).'
        )
    taken = {act.name for act in DIALOGUE_ACTS}
    for verb in verbs:
        if not isinstance(cast("object", verb), Verb):
            raise InvalidInputError(f"`verbs` must be a tuple of Verbs; {verb!r} is none.")
        if isinstance(cast("object", verb.slots), str):
            raise InvalidInputError(
                f"The slots of the verb {verb.name!r} must be a tuple, not the text "
                f"{verb.slots!r}. Write ({verb.slots!r},), with the comma."
            )
        if verb.name in taken:
            raise InvalidInputError(
                f"There is a verb or dialogue act {verb.name!r} already. Choose another name."
            )
        taken.add(verb.name)
        if not re.fullmatch(r"[a-z]+(?: [a-z]+)*", verb.name):
            raise InvalidInputError(
                f"The verb {verb.name!r} must be words in small letters, such as 'turn on'."
            )
        for slot in verb.slots:
            if slot not in SLOTS:
                raise InvalidInputError(
                    f"The verb {verb.name!r} has a slot {slot!r}. The slots are: "
                    f"{', '.join(SLOTS)}."
                )
    for example in (*examples, *examples_of(verbs)):
        if not isinstance(cast("object", example), Example):
            raise InvalidInputError(f"`examples` must be a tuple of Examples; {example!r} is none.")
        try:
            orders_from_text(example.orders, verbs)
        except InvalidInputError as error:
            raise InvalidInputError(
                f"The orders of the example {example.message!r} cannot be read. {error} "
                "docs/reading.md shows their form."
            ) from None
