"""Amounts as people and shops write them: number words, figures and currencies.

Number words are read by number-parser. The marks between digits are read here, since a library that
guesses them is wrong at times, and silently: of "$1.5k" or "2 for $5" price-parser takes a part.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from typing import cast
from unicodedata import decimal, numeric

import number_parser  # pyright: ignore[reportMissingTypeStubs]

from goalscope.base.text import plain

__all__ = ["Money", "codes_of", "decimal_mark", "figures", "is_currency", "numbers_in", "price"]
__all__ += ["printed", "same_currency", "sums_in", "word_value"]

_CURRENCIES = """
USD: $ US$: dollar, US dollar, buck
CAD: $ C$ CA$: dollar, Canadian dollar, buck
AUD: $ A$ AU$: dollar, Australian dollar, buck
NZD: $ NZ$: dollar, New Zealand dollar, buck
HKD: $ HK$: dollar, Hong Kong dollar
SGD: $ S$: dollar, Singapore dollar
TWD: $ NT$: dollar, Taiwan dollar
MXN: $ MX$: peso, Mexican peso
ARS: $ AR$: peso, Argentine peso
CLP: $ CL$: peso, Chilean peso
COP: $ CO$: peso, Colombian peso
BRL: R$: reais, Brazilian real
EUR: €: euro
GBP: £: pound, British pound, pound sterling, quid
EGP: £ E£: pound, Egyptian pound
CHF: Fr SFr: franc, Swiss franc
SEK: kr: krona, kronor, Swedish krona, Swedish kronor
NOK: kr: krone, kroner, Norwegian krone, Norwegian kroner
DKK: kr: krone, kroner, Danish krone, Danish kroner
ISK: kr: krona, Icelandic krona
CZK: Kč: koruna, Czech koruna
PLN: zł zl: zloty, złoty
HUF: Ft: forint
RON: lei: leu
BGN: лв: lev
RSD: дин: dinar, Serbian dinar
UAH: ₴ грн: hryvnia
RUB: ₽ руб: ruble, rouble
TRY: ₺ TL: lira, Turkish lira
ILS: ₪ NIS: shekel
INR: ₹ Rs: rupee, Indian rupee
PKR: ₨ Rs: rupee, Pakistani rupee
LKR: Rs: rupee, Sri Lankan rupee
BDT: ৳: taka
JPY: ¥ JP¥ 円: yen
CNY: ¥ CN¥ RMB 元: yuan, renminbi
KRW: ₩ 원: won
THB: ฿ บาท: baht
VND: ₫ đ: dong
IDR: Rp: rupiah
MYR: RM: ringgit
PHP: ₱: peso, Philippine peso
AED: Dh Dhs: dirham
SAR: SR: riyal
ZAR: R: rand
NGN: ₦: naira
KES: KSh: shilling, Kenyan shilling
GHS: ₵ GH₵: cedi
"""  # noqa: RUF001
"""Currencies by their codes: marks, which stand before or after a sum, and names, which follow it.

Of several with the same mark, the first one is meant by the mark alone.
"""

_UNDIVIDED = frozenset({"CLP", "COP", "HUF", "IDR", "ISK", "JPY", "KRW", "VND"})
"""Currencies that nobody writes with decimals."""

_IN_THOUSANDTHS = frozenset({"BHD", "IQD", "JOD", "KWD", "LYD", "OMR", "TND"})
"""Currencies with three decimals."""

_FROM = 13
"""Number words from here on are put in figures: up to twelve, readers know them, and names such as
Seven Up hold them."""

_LEAST_CENTS = 10

_LONGEST = 12
"""Digits of an amount, at most."""

_OTHER = {".": ",", ",": "."}

_PARTS = (2, 3, 4, 8)
"""Denominators of fractions; other figures with a stroke are dates and the like."""

_THOUSANDS = {"k": 1_000, "m": 1_000_000}

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
_MARK = (
    rf"(?:(?<![^\W\d_])(?:{_LETTERED})(?:(?<=[^\W\d_])\.)?(?![^\W\d_])|{_SIGNS}|[\u20a0-\u20cf])"
)
_NOUN = rf"(?i:{_either(_nouns)})s?(?!\w)"
_DIGITS = r"\d+(?:[.,']\d+)*"
_APART = r"\d{1,3}(?: \d{3})+(?:[.,]\d{1,2})?(?![\d.,']?\d)"
_CENTS = r"(?:cents?|pence|p|c)(?!\w)"
_END = r"(?<=\d\d)(?=\s*(?:[.,;!?)]|$))"

_SMALL = r"(?:[gG]|gr|gms?|[Gg]ram(?:me)?s?|m[lL]|ML|[Mm]illilit(?:re|er)s?)"
"""Units of which nobody wants a thousandth: before them, three digits after a mark are none."""

_SUM = re.compile(
    rf"(?:(?P<before>{_MARK}) ?|(?<![\w.,'/]))(?P<digits>{_APART}|{_DIGITS})"
    rf"(?P<times>[kKmM](?!\w))?"
    rf"(?P<after>(?: ?{_MARK}(?! ?\d)|[ -]{_NOUN})(?P<named>))?"
    rf"(?P<rest>(?: and)? (?P<cents>\d{{1,2}})(?: ?{_CENTS}|(?(named){_END}|(?!))))?"
    r"(?P<beside>(?(named) \d\d(?![\d.,']?\d|\w))|)"
)
_MARKED = re.compile(
    rf"(?<![\w.,'/])(?=\d*[.,'])({_DIGITS})(?![\d/])(?P<small>[ -]?{_SMALL}(?!\w))?"
)
_FRACTION = re.compile(
    r"(?<![\w.,/])(?:(\d+)(?: (?=\d+/)| ?(?=[\u00bc-\u00be\u2150-\u215e])))?"
    r"(?:(\d)/(\d{1,2})|([\u00bc-\u00be\u2150-\u215e]))(?![\d/]|th|rd|nd)"
)
_WHOLE = re.compile(  # the last form is Indian
    r"\d*|\d{1,3}(?:([.,' ])\d{3})(?:\1\d{3})*|\d{1,2}(?:,\d{2})+,\d{3}"
)
_PRICE = re.compile(
    rf"(?P<before>{_MARK})? ?(?P<digits>\.\d+|{_APART}|{_DIGITS}) ?(?P<after>{_MARK}|{_NOUN})?"
    r"(?: ?/? ?(?:each|ea\.?))?"
)
_THEN = re.compile(rf"[ -]{_NOUN}(?: and)? ([^\W\d_]+)")
_PENNIES = re.compile(f" {_CENTS}")
_DASHED = re.compile(
    rf"(?<!\d)(?<!\d[.,'/])({_APART}|{_DIGITS})(?:([.,])[-\u2013-\u2015]{{1,2}}|/-)"
    rf"(?:(?![\w-])|(?={_MARK}|{_NOUN}))"
)
"""Sums with a dash for no cents: 30.- or 1.295,- or 30/-."""

_DOZEN = re.compile(r"(?<![^\W\d_])(?:doz|dz)\b\.?", re.IGNORECASE)
_TIMES = re.compile(r"(?<![\w.,'/])([0-9]+(?:\.[0-9]+)?)[ -]$")
_WORD = re.compile(r"(?<![^\W\d_])[A-Za-z]+(?!\w)")


@dataclass(frozen=True, slots=True)
class Money:
    """A sum of money.

    Attributes:
        amount: At least 0.
        currency: A mark, a code or a name, as written; "" for none.
        beside: The number right after it, which may be its cents: the fifty of "twelve pounds fifty
            please"; 0 for none.
    """

    amount: Decimal
    currency: str
    beside: int = 0


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


def figures(text: str) -> tuple[str, dict[str, str]]:
    """`text` with its amounts in plain figures, such as 1250.5, and how each one was written.

    Number words from thirteen on, marks between thousands, decimal commas and fractions change, and
    of sums of money also a "k" and what is said after the currency ("twelve pounds fifty"). An
    amount that may be read in two ways stays as it is, and so does whatever is plain.
    """
    written: dict[str, str] = {}

    def put(old: str, value: Decimal | None) -> str:
        if value is None:
            return old
        new = f"{round(value, 3).normalize():f}"
        if re.fullmatch(r"\d+(?:\.\d+)?", old) and Decimal(old) == value:
            return old
        written[new] = old
        return new

    def dashed(found: re.Match[str]) -> str:
        return put(found[0], _dashed(found))

    text = _DASHED.sub(dashed, _plain_digits(text))
    text = _spelled_out(_DOZEN.sub("dozen", text), put)

    def money(found: re.Match[str]) -> str:
        value = _amount(found)
        if value is None or not (found["before"] or found["after"]):
            return found[0]
        head = found.string[found.start() : found.start("digits")]
        typed = put(found["digits"] + (found["times"] or ""), value)
        return f"{head}{typed}{found['after'] or ''}{found['beside']}"

    def number(found: re.Match[str]) -> str:
        is_small = found["small"] and "." in found[1]
        return put(found[1], _value(found[1], "," if is_small else ".")) + (found["small"] or "")

    def fraction(found: re.Match[str]) -> str:
        over, under = int(found[2] or 0), int(found[3] or 1)
        if found[2] and not (0 < over < under and under in _PARTS):
            return found[0]
        part = numeric(found[4]) if found[4] else over / under
        return put(found[0], int(found[1] or 0) + Decimal(part))

    text = _SUM.sub(money, text)
    text = _MARKED.sub(number, text)
    return _FRACTION.sub(fraction, text), written


def sums_in(text: str) -> list[Money]:
    """The sums of money in a text that `figures` wrote."""
    found: list[Money] = []
    for match in _SUM.finditer(text):
        value, currency = _amount(match), match["before"] or (match["after"] or "").strip(" -")
        if currency and value is not None:
            found.append(Money(value, currency, int(match["beside"] or 0)))
    return found


def numbers_in(text: str, *, money: bool = True) -> frozenset[float]:
    """All numbers that a text holds in figures or words, read in each way that they may mean.

    Args:
        text: Any text.
        money: Whether sums of money count.
    """
    if not money:
        text = _SUM.sub(lambda m: " " if m["before"] or m["after"] else m[0], text)
    text = figures(text)[0]
    alone = (word_value(word[0]) for word in _WORD.finditer(text))
    values = {float(value) for value in alone if value is not None}
    values |= {float(value) for _, _, value in _spelled(text)}
    for match in re.finditer(rf"({_DIGITS})(k(?!\w))?", text, re.IGNORECASE):
        times = _THOUSANDS["k"] if match[2] else 1
        read = [value for mark in ".," if (value := _value(match[1], mark)) is not None]
        values |= {
            float(value * times) for value in read or map(Decimal, re.findall(r"\d+", match[1]))
        }
    return frozenset(values)


def price(text: str, mark: str = "", currency: str = "") -> Money | None:
    """The price that a cell of a table holds and nothing else; None if it is not understood.

    Args:
        text: The cell.
        mark: The one before decimals, "." or ",", where a mark with three digits after it may be
            either; "" if unknown.
        currency: The one that the table states for it; "" for none.
    """
    found = _PRICE.fullmatch(printed(text))
    if found is None:
        return None
    names = filter(None, (found["before"], found["after"]))
    named = sorted(names, key=lambda name: len(codes_of(name)))
    stated = named[0] if named else currency
    last = re.sub(r"[^.,]", "", found["digits"])[-1:]
    if stated.strip().upper() in _IN_THOUSANDTHS:
        mark = last
    elif _UNDIVIDED.issuperset(codes_of(stated) or ("",)):
        mark = _OTHER.get(last, "")
    value = _value(found["digits"], mark)
    if value is None or (len(named) == 2 and not same_currency(named[1], named[0])):
        return None
    return Money(value, named[0] if named else "")


def decimal_mark(cells: Iterable[str]) -> str:
    """The mark before decimals in a column of prices, "." or ","; "" if it is not known.

    The comma of "2,49" tells it, and so do the points of "1.234.567". Of 1,299 alone, the comma is
    taken for one between thousands, and so is the point where several prices are like 1.299. It is
    not known where the cells contradict: one of 1.500 and 1,500 must have decimals, and 1,500 may
    be either number beside 12.345,60.
    """
    decimals, thousands, unclear = set[str](), set[str](), set[str]()
    several = set[str]()
    for match in (each for cell in cells for each in re.finditer(_DIGITS, printed(cell))):
        if parted := re.fullmatch(r"(.*)([.,])(\d+)", match[0]):
            if _is_ambiguous(parted):
                unclear.add(parted[2])
                several.add(match[0])
            else:
                thousands |= {*parted[1]} & {".", ","}
                decimals |= {parted[2]} - {*parted[1]}
    if max(map(len, (unclear, decimals, thousands))) == 2 or decimals & thousands:
        return ""
    if thousands and decimals & unclear:
        return ""
    if decimals:
        return decimals.pop()
    parts = thousands or (unclear if "," in unclear or len(several) > 1 else set[str]())
    return _OTHER[parts.pop()] if parts else ""


def printed(text: str) -> str:
    """A cell as price takes it: plain, on one line, with zeros for a dash: "30.00" for "30.-"."""
    line = _plain_digits(" ".join(plain(text).split()))
    return _DASHED.sub(lambda found: f"{found[1]}{found[2]}00" if found[2] else found[1], line)


@lru_cache(maxsize=4096)
def word_value(word: str) -> int | None:
    """The value of one number word, such as 70 of "Seventy"; None of any other text."""
    return _parsed(word) if word.isascii() and word.isalpha() else None


def _parsed(words: str) -> int | None:
    return cast("int | None", number_parser.parse_number(words.casefold(), "en"))  # pyright: ignore


def _dashed(found: re.Match[str]) -> Decimal | None:
    """The amount of a sum with a dash for its cents."""
    return _value(f"{found[1]}{found[2]}00" if found[2] else found[1], ".")


def _plain_digits(text: str) -> str:
    """`text` with the digits of every script as 0 to 9."""
    return "".join(str(decimal(each)) if each.isdecimal() else each for each in text)


def _amount(found: re.Match[str]) -> Decimal | None:
    """The amount of a sum of money; three digits after one mark are no cents."""
    digits = found["digits"]
    value = _value(digits, "," if "." in digits else ".")
    if value is not None and found["times"]:
        value *= _THOUSANDS[found["times"].lower()]
    if value is not None and found["cents"]:
        value = value + Decimal(found["cents"]) / 100 if value == int(value) else None
    return value


def _is_ambiguous(parted: re.Match[str]) -> bool:
    """Whether the last mark may part thousands or decimals: 1,299 or 1.299, but not 0.299."""
    whole, _, rest = parted.groups()
    return len(rest) == 3 and whole.isdigit() and len(whole) <= 3 and whole[0] != "0"


def _value(digits: str, before_decimals: str) -> Decimal | None:
    """The number that digits with marks are: 1,299.00 or 1.299,00 or 1 299,00 or 2,49.

    None where the marks are misplaced, or where they may mean two things and that is unknown.
    """
    if len(re.sub(r"\D", "", digits)) > _LONGEST:
        return None
    whole, mark, rest = digits, "", ""
    if parted := re.fullmatch(r"(.*)([.,])(\d+)", digits):
        if _is_ambiguous(parted):
            if not before_decimals:
                return None
            if parted[2] == before_decimals:
                whole, mark, rest = parted.groups()
        elif parted[2] not in parted[1]:
            whole, mark, rest = parted.groups()
    if not _WHOLE.fullmatch(whole) or (mark and mark in whole):
        return None
    return Decimal(f"{re.sub(r'[^0-9]', '', whole) or 0}.{rest or 0}")


def _spelled_out(text: str, put: Callable[[str, Decimal], str]) -> str:
    """`text` with its larger numbers in figures, and small ones that cents follow."""
    done, parts = 0, list[str]()
    for start, end, value in _spelled(text):
        said = _THEN.match(text, end)
        cents = (said and word_value(said[1])) or 0
        if value < _FROM and cents < _LEAST_CENTS and not _PENNIES.match(text, end):
            continue
        parts += [text[done:start], put(text[start:end], value)]
        done = end
    return "".join([*parts, text[done:]])


def _spelled(text: str) -> Iterator[tuple[int, int, Decimal]]:
    """Where numbers in words begin and end, with their values: "one hundred and two", "5 hundred".

    "Hundred" alone is none: it may be a few hundred, and a reader knows a hundred.
    """
    words = [*_WORD.finditer(text)]
    at = 0
    while at < len(words):
        run = [*_run(text, words, at)]
        at += max(len(run), 1)
        value = _parsed(" ".join(word[0] for word in run)) if run else None
        if value is None or value >= 10**_LONGEST:
            continue
        start, end, first = run[0].start(), run[-1].end(), word_value(run[0][0]) or 0
        if first < 100:
            yield start, end, Decimal(value)
        elif times := _TIMES.search(text, max(start - _LONGEST, 0), start):
            yield times.start(), end, value + first * (Decimal(times[1]) - 1)
        elif len(run) > 1:
            yield start, end, Decimal(value)


def _run(text: str, words: Sequence[re.Match[str]], at: int) -> Sequence[re.Match[str]]:
    """The words from one on that are one number, with an "and" only after a hundred."""
    end, last = at, 0
    for place in range(at, len(words)):
        word, value = words[place], word_value(words[place][0])
        if place > at and text[words[place - 1].end() : word.start()] not in (" ", "-"):
            break
        if value is not None:
            end = place + 1
        elif word[0].casefold() != "and" or place in (at, end + 1) or last < 100:
            break
        last = value or 0
    return words[at:end]
