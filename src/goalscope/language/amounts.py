"""Amounts as people and shops write them: number words, figures and currencies.

Number words are read by number-parser, and the marks between digits here: a library that guesses
them is wrong at times, and silently. Of "$1.5k" or "2 for $5" price-parser takes a part.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from typing import cast
from unicodedata import decimal, numeric

import number_parser  # pyright: ignore[reportMissingTypeStubs]

_CURRENCIES = """
USD: $ US$: dollar, US dollar, buck
CAD: $ C$ CA$: dollar, Canadian dollar, buck
AUD: $ A$ AU$: dollar, Australian dollar, buck
NZD: $ NZ$: dollar, New Zealand dollar, buck
HKD: $ HK$: dollar, Hong Kong dollar
SGD: $ S$: dollar, Singapore dollar
MXN: $ MX$: peso, Mexican peso
BRL: R$: reais, Brazilian real
EUR: €: euro
GBP: £: pound, British pound, pound sterling, quid
CHF: Fr SFr: franc, Swiss franc
SEK: kr: krona, kronor, Swedish krona, Swedish kronor
NOK: kr: krone, kroner, Norwegian krone, Norwegian kroner
DKK: kr: krone, kroner, Danish krone, Danish kroner
CZK: Kč: koruna, Czech koruna
PLN: zł zl: zloty, złoty
HUF: Ft: forint
TRY: ₺ TL: lira, Turkish lira
ILS: ₪ NIS: shekel
INR: ₹ Rs: rupee, Indian rupee
JPY: ¥ JP¥ 円: yen
CNY: ¥ CN¥ RMB 元: yuan, renminbi
KRW: ₩ 원: won
THB: ฿ บาท: baht
VND: ₫ đ: dong
IDR: Rp: rupiah
ZAR: R: rand
"""
"""Currencies by their codes: marks, which stand before or after a sum, and names, which follow it.

Of several with the same mark, the first one is meant by the mark alone.
"""

_FROM = 13
"""Number words from here on are put in figures: up to twelve, readers know them, and names such as
Seven Up hold them."""

_LONGEST = 12
"""Digits of an amount, at most."""

_PARTS = (2, 3, 4, 8)
"""Denominators of fractions; other figures with a stroke are dates and the like."""

_marks: set[str] = set()
_nouns: set[str] = set()
_codes: dict[str, list[str]] = {}
for _line in _CURRENCIES.strip().splitlines():
    _code, _listed, _named = _line.split(":")
    _lower = {_code.lower()} - {"try"}  # the word is no lira
    _marks |= {_code, *_lower, *_listed.split()}
    _small = {_mark for _mark in _listed.split() if _mark.islower()}
    _marks |= {*map(str.capitalize, _small), *map(str.upper, _small)}
    _nouns |= {*_named.strip().split(", ")}
    for _name in (_code, *_listed.split(), *_named.strip().split(", ")):
        _codes.setdefault(_name.casefold(), []).append(_code)


def _either(names: set[str]) -> str:
    return "|".join(map(re.escape, sorted(names, key=len, reverse=True)))


_LETTERED = _either({mark for mark in _marks if mark[0].isalpha()}).replace(r"\$", r" ?\$")
_SIGNS = _either({mark for mark in _marks if not mark[0].isalpha()})
MARK = rf"(?:(?<![^\W\d_])(?:{_LETTERED})(?:(?<=[^\W\d_])\.)?(?![^\W\d_])|{_SIGNS}|[\u20a0-\u20cf])"
NOUN = rf"(?i:{_either(_nouns)})s?(?!\w)"
DIGITS = r"\d+(?:[.,']\d+)*"
APART = r"\d{1,3}(?: \d{3})+(?:[.,]\d{1,2})?(?![\d.,']?\d)"

_SMALL = r"(?:[gG]|gr|gms?|[Gg]ram(?:me)?s?|m[lL]|ML|[Mm]illilit(?:re|er)s?)"
"""Units of which nobody wants a thousandth: before them, three digits after a mark are none."""

_SUM = re.compile(
    rf"(?:(?P<before>{MARK}) ?|(?<![\w.,'/]))(?P<digits>{APART}|{DIGITS})(?P<k>[kK](?!\w))?"
    rf"(?P<after> ?{MARK}(?! ?\d)|[ -]{NOUN})?"
)
_CENTS = re.compile(
    rf"(?<![\w.,'/])(\w+) ({NOUN})(?: and)? (\d\d)"
    r"(?: (?:cents?|pence|p)(?!\w)|(?=\s*(?:please\b|[.,;!?)]|$)))"
)
"""Twelve pounds 50 at the end of a clause, and 12 dollars and 50 cents."""

_MARKED = re.compile(
    rf"(?<![\w.,'/])(?=\d*[.,'])({DIGITS})(?![\d/])(?P<small>[ -]?{_SMALL}(?!\w))?"
)
_FRACTION = re.compile(
    r"(?<![\w.,/])(?:(\d+)(?: (?=\d+/)| ?(?=[\u00bc-\u00be\u2150-\u215e])))?"
    r"(?:(\d)/(\d{1,2})|([\u00bc-\u00be\u2150-\u215e]))(?![\d/]|th|rd|nd)"
)
_WHOLE = re.compile(  # the last form is Indian
    r"\d*|\d{1,3}(?:([.,' ])\d{3})(?:\1\d{3})*|\d{1,2}(?:,\d{2})+,\d{3}"
)
_DOZEN = re.compile(r"(?<![^\W\d_])(?:doz|dz)\b\.?", re.IGNORECASE)
_UNITS = "one|two|three|four|five|six|seven|eight|nine|ten|eleven|twelve"
_TENS = (
    "thirteen|fourteen|fifteen|sixteen|seventeen|eighteen|nineteen|twenty|thirty|forty|fifty|sixty"
    "|seventy|eighty|ninety"
)
_HUNDREDS = "hundred|thousand|million"
_SPELLED = re.compile(
    rf"\b(?:{_UNITS}|{_TENS}|(?:{_HUNDREDS})(?=[ -](?:and[ -])?(?:{_UNITS}|{_TENS})\b))"
    rf"(?:(?:(?<=hundred)[ -]and|(?<=thousand)[ -]and)?[ -](?:{_UNITS}|{_TENS}|{_HUNDREDS}))*\b",
    re.IGNORECASE,
)
_WORD = re.compile(r"(?<![^\W\d_])[A-Za-z]+(?!\w)")
_COUNT = rf"(?:\d+(?:\.\d+)?|\b(?:{_UNITS})\b)"
_COMPOUND = re.compile(
    rf"(?<![\w.,'/])({_COUNT})( ?(?:"
    r"(?P<metric>kg|kgs|kilos?|kilogram(?:me)?s?|l|lit(?:re|er)s?)|(?:lbs?|pounds?)))"
    rf" ({_COUNT}) ?(?:(?P<small>{_SMALL})|oz|ounces?)(?!\w)",
    re.IGNORECASE,
)
"""A weight or volume in two units, such as 2 lb 8 oz."""


@dataclass(frozen=True, slots=True)
class Money:
    """A sum of money.

    Attributes:
        amount: At least 0.
        currency: A mark, a code or a name, as written; "" for none.
    """

    amount: Decimal
    currency: str


def is_currency(name: str) -> bool:
    """Whether a text is the mark, the code or the name of a known currency."""
    return bool(codes_of(name))


def same_currency(name: str, other: str) -> bool:
    """Whether what is said in the currency `name` may be taken for `other`, such as a shop's.

    "Dollars" may be those of any shop whose prices are in dollars. Where a shop has a bare "$", and
    somebody names Canadian dollars, they are taken for others. What is not known is like itself.
    """
    said, meant = codes_of(name), codes_of(other)
    if not (said and meant):
        return _key(name) == _key(other)
    return said == meant[:1] if len(said) == 1 else not {*said}.isdisjoint(meant)


def codes_of(name: str) -> list[str]:
    """The codes of the currencies that a text may mean, the likeliest first."""
    return _codes.get(_key(name)) or _codes.get(_key(name).removesuffix("s")) or []


def _key(name: str) -> str:
    return re.sub(r" (?=\$)", "", name.strip().casefold().rstrip("."))


def figures(text: str) -> str:
    """`text` with its amounts in plain figures, such as 1250.5.

    Number words from thirteen on, marks between thousands, decimal commas and fractions change, and
    of sums of money also a "k" and the cents after the currency. "2 lb 8 oz" becomes 2.5 lb. An
    amount that may be read in two ways stays as it is.
    """

    def put(old: str, value: Decimal | None) -> str:
        plain = re.fullmatch(r"\d+(?:\.\d+)?", old) and Decimal(old) == value
        return old if value is None or plain else f"{round(value, 3).normalize():f}"

    def spelled(found: re.Match[str]) -> str:
        value = _parsed(found[0].replace("-", " "))
        return found[0] if value is None or value < _FROM else str(value)

    def cents(found: re.Match[str]) -> str:
        whole = found[1] if found[1].isdecimal() else word_value(found[1])
        return (
            found[0]
            if whole is None
            else f"{Decimal(f'{whole}.{found[3]}').normalize():f} {found[2]}"
        )

    def thousands(found: re.Match[str]) -> str:
        value = _amount(found)
        if value is None or not (found["before"] or found["after"]):
            return found[0]
        head = found.string[found.start() : found.start("digits")]
        return f"{head}{put(found['digits'] + (found['k'] or ''), value)}{found['after'] or ''}"

    def number(found: re.Match[str]) -> str:
        is_small = found["small"] and "." in found[1]
        return put(found[1], value_of(found[1], "," if is_small else ".")) + (found["small"] or "")

    def fraction(found: re.Match[str]) -> str:
        over, under = int(found[2] or 0), int(found[3] or 1)
        if found[2] and not (0 < over < under and under in _PARTS):
            return found[0]
        part = numeric(found[4]) if found[4] else over / under
        return put(found[0], int(found[1] or 0) + Decimal(part))

    def compound(found: re.Match[str]) -> str:
        if bool(found["metric"]) != bool(found["small"]):
            return found[0]
        whole, rest = (
            Decimal(each) if each[0].isdigit() else word_value(each) for each in found.group(1, 4)
        )
        parts = 1000 if found["metric"] else 16
        return f"{put('', (whole or 0) + Decimal(rest or 0) / parts)}{found[2]}"

    text = _SPELLED.sub(spelled, _DOZEN.sub("dozen", plain_digits(text)))
    text = _SUM.sub(thousands, _CENTS.sub(cents, text))
    return _COMPOUND.sub(compound, _FRACTION.sub(fraction, _MARKED.sub(number, text)))


def sums_in(text: str) -> list[Money]:
    """The sums of money in a text that `figures` wrote."""
    found: list[Money] = []
    for match in _SUM.finditer(text):
        value, currency = _amount(match), match["before"] or (match["after"] or "").strip(" -")
        if currency and value is not None:
            found.append(Money(value, currency))
    return found


def numbers_in(text: str, *, money: bool = True) -> frozenset[float]:
    """All numbers that a text holds in figures or words, read in each way that they may mean.

    Args:
        text: Any text.
        money: Whether sums of money count.
    """
    if not money:
        text = _SUM.sub(lambda m: " " if m["before"] or m["after"] else m[0], text)
    text = figures(text)
    words = (word_value(word[0]) for word in _WORD.finditer(text))
    values = {float(value) for value in words if value is not None}
    for digits in re.findall(DIGITS, text):
        read = [value for mark in ".," if (value := value_of(digits, mark)) is not None]
        values |= {float(value) for value in read or map(Decimal, re.findall(r"\d+", digits))}
    return frozenset(values)


@lru_cache(maxsize=4096)
def word_value(word: str) -> int | None:
    """The value of one number word, such as 70 of "Seventy"; None of any other text."""
    return _parsed(word) if word.isascii() and word.isalpha() else None


def _parsed(words: str) -> int | None:
    return cast("int | None", number_parser.parse_number(words.casefold(), "en"))  # pyright: ignore


def plain_digits(text: str) -> str:
    """`text` with the digits of every script as 0 to 9."""
    return "".join(str(decimal(each)) if each.isdecimal() else each for each in text)


def _amount(found: re.Match[str]) -> Decimal | None:
    """The amount of a sum of money; three digits after one mark are no cents."""
    digits = found["digits"]
    value = value_of(digits, "," if "." in digits else ".")
    return value * 1000 if value is not None and found["k"] else value


def is_ambiguous(parted: re.Match[str]) -> bool:
    """Whether the last mark may part thousands or decimals: 1,299 or 1.299, but not 0.299."""
    whole, _, rest = parted.groups()
    return len(rest) == 3 and whole.isdigit() and len(whole) <= 3 and whole[0] != "0"


def value_of(digits: str, before_decimals: str) -> Decimal | None:
    """The number that digits with marks are: 1,299.00 or 1.299,00 or 1 299,00 or 2,49.

    None where the marks are misplaced, or where they may mean two things and that is unknown.
    """
    if len(re.sub(r"\D", "", digits)) > _LONGEST:
        return None
    whole, mark, rest = digits, "", ""
    if parted := re.fullmatch(r"(.*)([.,])(\d+)", digits):
        if is_ambiguous(parted):
            if not before_decimals:
                return None
            if parted[2] == before_decimals:
                whole, mark, rest = parted.groups()
        elif parted[2] not in parted[1]:
            whole, mark, rest = parted.groups()
    if not _WHOLE.fullmatch(whole) or (mark and mark in whole):
        return None
    return Decimal(f"{re.sub(r'[^0-9]', '', whole) or 0}.{rest or 0}")
