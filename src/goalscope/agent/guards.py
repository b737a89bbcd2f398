"""Guards on what was read: against harm, misreadings, conditions and irreversible actions.

The only English in them are short lists: stems of words of harm, words of agreement, words that
except something, and those for more of it or none.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Literal

from goalscope.base.nouns import singular, singulars
from goalscope.base.text import plain
from goalscope.base.types import Action, UnreadableAnswerError
from goalscope.language.amounts import figures, word_value
from goalscope.language.dialogue_state import GRAVE
from goalscope.language.orders import MORE, Order, Reading, Verb
from goalscope.language.reader import SUREST, ReadExample

Awaited = Literal["", "harm", "yes", "word"]
"""What a question waits for: nothing, who may come to harm, a yes as read, or words of a yes."""

SAY_YES = 'If that is all right, say "yes".'
"""End of a question that only words of agreement answer; see `is_yes` and `agrees`."""

CONFIRM = f"That cannot be undone. {SAY_YES}"
"""End of the question before an irreversible action."""

HARM = "It sounds as if something could harm someone. What must I avoid? I have done nothing yet."
"""The question after a word of harm that was not read as an allergy or a diet."""

WARY = "You mentioned harm, and I am not sure what to avoid."
"""Reason of an order that waits after a word of harm."""

UNSURE = 0.25
"""Margin, in nats, below which an order is asked about; docs/reading.md shows its cost."""

_HARM = re.compile(
    r"allerg|anaphyla|epi-?pen|c(?:o|œ)?eliac|intoleran|\bhives\b|\bswell|\bswoll|\brash\b"
    r"|\bchok|\bpoison",
    re.IGNORECASE,
)
_HINT = re.compile(r"\bthroat\b|hospital", re.IGNORECASE)
"""Words that may be about harm, or only about a cold or a visit: they are asked about once."""

_CLAUSE = re.compile(r"(?<=[.!?;,])\s+|\n+|\s+(?=(?:and|but|so)\s)")
"""What stands between clauses."""

_RANGE = re.compile(r" 1-\d+(?!\w)")
"""Ends what `State.here` shows of things that are told apart by numbers: "egg 1-3"."""

_NUMBER = r" (\d+)(?![\w:-]|[.,]\d| (?:to|or) \d| [a-z]{3,}s\b)"
"""A number behind a noun that is no amount of something else."""

_EXCEPTS = re.compile(
    r"\bexcept(?:ing|s)?\b|(?<!\w)'?cept\b|\bexcluding\b|\b(?:apart|aside) from\b|\bother than\b"
    r"|\b(?:all|any\w*|every\w*) (?:but|bar)\b|\bbut (?:not|keep|leave|without)\b",
    re.IGNORECASE,
)
"""Words that except something from what is said."""

_NONE = (
    r"(?<!have )(?<!has )(?<!had )(?<!got )(?<!'s )(?<!'ve )(?<!is )(?<!are )(?<!was )(?<!there )"
    r"\bno (?:more )?{thing}\b(?! left)"
)
"""What is said of a thing that is not to come; "we have no milk" is a reason to order some."""

_MORE = r"\b(?:another|(?:(\d+) )?(?:more|extra)|second|2nd)(?: [\w-]+)?(?: of)? {thing}"
"""What is said where there is to be more of a thing than there is."""

_DENIES = (
    r"\bnot (?:the |my |any )?{thing}\b"
    r"|\b{thing}\b.*\b(?:no|forget|scratch|scrap|skip|drop) (?:the |my |any )?{thing}\b"
)
"""What is said of a thing to take it back; many of the words also order to remove it."""

_AGREES = """
yes, yep, yeah, yup, yea, ye, yeh, yh, ya, yah, yas, y, yessir, yes sir, aye, uh huh, mhm, mm hm,
si, sure, surely, for sure, sure thing, ok, okay, oki, okey dokey, okie dokie, k, alright,
all right, fine, agreed, correct, exactly, confirm, confirmed, accept, accepted, approved,
granted, absolutely, certainly, definitely, defo, totally, obviously, naturally, of course,
ofcourse, ofc, by all means, with pleasure, affirmative, roger, righto, right you are, proceed,
continue, carry on, crack on, go on, go ahead, go right ahead, go for it, fire away, have at it,
do it, do that, do this, do so, please do, let's do it, let's go, lets go, let's go for it,
make it so, be my guest, you bet, you betcha, you may, you can, you can do it,
you have my approval, you have my permission, you got it, sounds good, sounds great, sounds right,
sounds fine, sounds perfect, sounds like a plan, looks good, looks great, looks right, looks fine,
all good, is good, is fine, is right, that's fine, that's right, that's correct, that is fine,
that is right, that is correct, that's the one, that works, that will do, that'll do, very well,
works for me, suits me, spot on, no problem, not a problem, no worries, no objection,
no objections, \N{THUMBS UP SIGN}, \N{OK HAND SIGN}, \N{WHITE HEAVY CHECK MARK},
\N{HUNDRED POINTS SYMBOL}, i agree, i accept, i confirm, i approve, i do, i can confirm, i'm sure,
im sure, i am sure, happy with that, i'm okay, i am okay, i'm ok, i am ok, i'm game, i'm down,
im down
"""
"""What agrees by itself. "Right", "good", "please" and "thanks" may as well end the matter."""

_BESIDE = """
please, pls, plz, kindly, thanks, thank you, thx, ty, ta, cheers, many, very much, so much, it,
all, that, this, them, the, then, now, right now, right away, go, great, good, lovely, perfect,
cool, brilliant, quite, fully, indeed, that's, to proceed, with it, with that, with this, as is,
by me, to me, with me, for me, from me, i said, oh, ah, hell, heck, dear, my dear, love, mate,
man, bro, boss, pal, bud, friend, my friend, sir, madam, robot, :), \N{SLIGHTLY SMILING FACE},
\N{SMILING FACE WITH SMILING EYES}, \N{PERSON WITH FOLDED HANDS}
"""
"""What may stand beside it: nothing that doubts, denies, chooses, delays or sets a condition."""

_YES = re.compile(r"(?:yes|yep|yeah|yup|yea|aye|sure)\b", re.IGNORECASE)
_MARKS = ".,!;'\"*-"
_WORD = re.compile(r"[\s-]+|(?<=\w)[.,!;](?=\w)")
_DRAWN = re.compile(r"(\w)\1+$")


def speaks_of_harm(utterance: str, reading: Reading) -> bool:
    """Whether a word of harm was said, but the reading holds no allergy or diet."""
    said = plain(utterance)
    grave = any(map(_is_grave, reading.orders))
    return not grave and bool(_HARM.search(said) or _HINT.search(said))


def second_look(
    reading: Reading,
    utterance: str,
    before: Sequence[ReadExample],
    read: Callable[..., Reading],
) -> Reading:
    """The reading with the allergies and diets that are found clause by clause.

    Long words hide them from a small model. Nothing else changes, and only where harm was spoken of
    and the reading holds none of them.

    Args:
        reading: Of the whole.
        utterance: What was said.
        before: What was said earlier, with its readings.
        read: Reads a clause after what was said `before` it; see `Reader.read`.
    """
    clauses = _CLAUSE.split(plain(utterance)) if speaks_of_harm(utterance, reading) else []
    past = list[ReadExample]()
    for clause in clauses if len(clauses) > 1 else ():
        with suppress(UnreadableAnswerError):
            part = read(clause, before=[*before, *past])
            past.append(ReadExample("", clause, part.orders))
    limits = [order for each in past for order in each.orders if _is_grave(order)]
    margins = reading.margins and (*[SUREST] * len(limits), *reading.margins)
    return replace(reading, orders=(*limits, *reading.orders), margins=margins)


def misses_an_exception(
    utterance: str, order: Order, reading: Reading, *, brings: bool = False
) -> bool:
    """Whether an exception was said that the reading lacks, or the very thing was taken back.

    Of an order that `brings` a thing, also whether none of it was to come.
    """
    thing = re.escape(order.what)
    denies = (f"{_DENIES}|{_NONE}" if brings else _DENIES).format(thing=thing)
    denied = thing and re.search(denies, plain(utterance), re.IGNORECASE)
    return bool(denied) or excepts(utterance, reading)


def excepts(utterance: str, reading: Reading) -> bool:
    """Whether words of exception were said, and the reading has none."""
    spared = any(each.but or each.do == "leave" for each in reading.orders)
    return bool(_EXCEPTS.search(plain(utterance))) and not spared


def with_more(reading: Reading, utterance: str, verbs: Iterable[Verb]) -> Reading:
    """A reading in which "another milk", or "2 more", has `MORE` behind its unit.

    Args:
        reading: Of the utterance.
        utterance: What was said.
        verbs: The domain's; those that count things and take none away are for more.
    """
    brings = {verb.name for verb in verbs if "quantity" in verb.slots and not verb.takes_away}
    said = _in_figures(figures(plain(utterance)))

    def more(order: Order) -> Order:
        thing = re.escape(order.what)
        may = order.do in brings and bool(order.what)
        found = may and re.search(_MORE.format(thing=thing), said, re.IGNORECASE)
        unit = f"{order.unit} {MORE}".strip()
        return replace(order, quantity=float(found[1] or 1), unit=unit) if found else order

    return replace(reading, orders=tuple(map(more, reading.orders)))


def by_number(reading: Reading, utterance: str, here: str) -> Reading:
    """A reading in which "crack egg 3" names one egg, if `State.here` has things with numbers."""
    if not _RANGE.search(here):
        return reading
    said = _in_figures(figures(plain(utterance)))
    return replace(reading, orders=tuple(_numbered(each, said) for each in reading.orders))


def _in_figures(text: str) -> str:
    """A text in lower case with each number word in figures."""
    return re.sub(r"[a-z]{3,}", lambda found: str(word_value(found[0]) or found[0]), text.lower())


def _numbered(order: Order, said: str) -> Order:
    """The order with the numbers that stand behind its thing and its place in their names."""

    def named(phrase: str) -> str:
        noun = re.sub(r" ?\d+$", "", phrase)
        found = {*re.findall(rf"\b{re.escape(noun)}{_NUMBER}", said)} if noun else set[str]()
        found = found & {*own} or found
        is_one = len(found) == 1 and singulars(noun) == noun.lower().split()
        return f"{noun} {found.pop()}" if is_one else phrase

    own = re.findall(r"\d+", f"{order.what} {order.where} {order.quantity or 0:g}")
    what, where = named(order.what), named(order.where)
    if order.unit or not what[-1:].isdigit():
        return replace(order, where=where)
    where = "" if _in_figures(where).isdigit() else where
    return replace(order, what=what, quantity=None, where=where)


def _is_grave(order: Order) -> bool:
    return order.do in ("avoid", "only") and bool(order.what) and order.why in GRAVE


def is_yes(utterance: str) -> bool:
    """Whether the utterance is the word that `SAY_YES` asks for; no reading is trusted here."""
    return plain(utterance).casefold().strip(" \t\n.!\"'") == "yes"


def begins_with_yes(utterance: str) -> bool:
    """Whether a yes comes first; "ok" and "right" may as well begin something new."""
    return bool(_YES.match(plain(utterance).strip()))


def agrees(utterance: str, waiting: Sequence[Order], listed: Sequence[Action]) -> bool:
    """Whether words of agreement make up the whole utterance; no reading is trusted here.

    Where just one order waits, its verb may stand beside them, and its thing in full, in words for
    it that are used here: where there are several, a person may mean only some.

    Args:
        utterance: What was said.
        waiting: The orders that wait for a yes.
        listed: The actions that they come to.
    """
    own: list[str] = []
    if len(waiting) == 1:
        here = {word for act in listed for word in singulars(" ".join(act.things))}
        is_here = here.issuperset(thing := singulars(waiting[0].what))
        own = " ".join((waiting[0].do, *(act.name for act in listed))).split()
        own += [" ".join(thing)] if is_here else []
    agreeing, beside = (_phrases(each.split(",")) for each in (_AGREES, _BESIDE))
    phrases = sorted((*agreeing, *beside, *_phrases(own)), key=len, reverse=True)
    words, agreed = _phrases([plain(utterance)])[0], False
    while words:
        said = next((each for each in phrases if words[: len(each)] == each), list[str]())
        if not said:
            return False
        agreed |= said in agreeing
        del words[: len(said)]
    return agreed


def _phrases(texts: Iterable[str]) -> list[list[str]]:
    """The words of each text in the singular, not drawn out, without marks around them."""
    words = ((each.strip(_MARKS) for each in _WORD.split(text.casefold())) for text in texts)
    return [[singular(_DRAWN.sub(r"\1", each)) for each in text if each] for text in words]


def is_wary(said: Iterable[tuple[str, Reading]]) -> bool:
    """Whether a word of harm was said, and since then neither an allergy nor a no.

    A mere hint at harm counts only in the newest utterance.

    Args:
        said: Utterances and their readings, newest first.
    """
    for age, (utterance, reading) in enumerate(said):
        if speaks_of_harm(utterance, reading) and (age == 0 or _HARM.search(plain(utterance))):
            return True
        if any(_is_grave(each) or each.do == "no" for each in reading.orders):
            return False
    return False


def reason_to_wait(
    order: Order, limit: Order | None = None, *, sure: bool, wary: bool = False
) -> str:
    """Why an order needs the person's yes; "" if it needs none.

    Args:
        order: The order.
        limit: The allergy or diet that forbids it; see `DialogueState.forbids`.
        sure: Whether its reading is sure; see `Reading.sure`.
        wary: See `is_wary`.
    """
    if limit:
        whom = f"{limit.for_}: " if limit.for_ else ""
        return f'You said "no {limit.what}" ({whom}{limit.why}).'
    if wary:
        return WARY
    if order.if_:
        return f'You said "if {order.if_}", which I cannot tell.'
    return "" if sure else "I am not sure that I understood you."
