"""Whether a person, in these words, tells the shop to buy now."""

from __future__ import annotations

import re

__all__ = ["consents"]

_FILLER = (
    r"(?:ok(?:ay)?|yes|yeah|yep|yup|sure|great|perfect|good|alright|all right|right|fine|thanks"
    r"|thank you|cool|awesome|excellent|lovely|wonderful|nice|please|now|then|so|well|and|just|oh"
    r"|actually|great job|looks (?:good|great|perfect|fine|right)(?: to me)?|sounds (?:good|great)"
    r"|(?:that|it|this|everything) (?:all )?looks (?:good|great|perfect|fine|right)(?: to me)?"
    r"|that'?s (?:great|perfect|fine|right|good|correct|lovely|it|all|everything|all i need"
    r"|everything i need|all for (?:today|now))|that is (?:it|all|everything)|i'?m (?:done|ready|"
    r"happy|all set|finished|good)(?: with (?:that|this|it|everything))?"
    r"|i am (?:done|ready|all set|finished)|we'?re (?:done|ready|all set|good)"
    r"|i have everything(?: i need)?|i'?ve got everything(?: i need)?|nope|nothing else"
    r"|no,? that'?s (?:all|it|everything)"
    r"|i (?:think|guess) that'?s (?:all|it|everything)|all done|done|for me|today|for now"
    r"|as it is|as is|go ahead"
    r"|go on|let'?s do it|let'?s go|right away|immediately|right now|at once"
    r"|it'?s (?:perfect|great|fine|good)"
    r"|no,? thanks|no thank you|all good|all set|everything is (?:here|there|in there)|i love it"
    r"|i like it)"
)
_WHOLE = (
    r"(?:(?:the|my|this|that|our) (?:whole |entire |current )?"
    r"(?:basket|cart|order|groceries|items|shopping|stuff|lot)"
    r"|it all|them all|everything(?: (?:in (?:the|my) (?:basket|cart)|you have))?"
    r"|all of (?:it|them|this|that)|what'?s in (?:the|my) (?:basket|cart))"
)
_ONE = r"(?:it|them|this|that|these)"
_ORDER = (
    r"(?:(?:(?:please|kindly|just|now|go ahead and|do go ahead and|you can|you may|you can now"
    r"|you may now|you can go ahead and|feel free to|i'?d like to|i would like to|i want to"
    r"|i want you to|i'?d like you to|i'?m ready to|we'?re ready to|i am ready to|let'?s|let us"
    r"|we can|we can now|can you|could you|would you|will you|can you please|could you please"
    r"|can we|time to|it'?s time to|i think we can|i think you can|ready to|i'?ll|i will|let me"
    r"|i'?m happy to|do|and|then|so)[ ,]+)*"
    r"(?:(?:buy|purchase|order|pay for) THING|(?:check ?out|pay)(?: THING)?"
    r"|(?:complete|finish|finalize|finalise|place|submit|confirm|make) (?:the|my|this|that|our)"
    r" (?:purchase|order|checkout|shopping)|proceed to (?:the )?(?:checkout|payment)"
    r"|go to (?:the )?checkout|ring (?:it|me|everything) up|take me to (?:the )?checkout))"
)
_SENTENCE_END = re.compile(r"[.!;\n]+|[?]")
_PHRASE = (
    rf"(?:{_FILLER}[ ,]+)*{_ORDER}(?:[ ,]+{_FILLER})*(?:[ ,]+(?:and )?{_ORDER}(?:[ ,]+{_FILLER})*)?"
)
_ORDERS_WHOLE = re.compile(_PHRASE.replace("THING", _WHOLE))
_ORDERS = re.compile(_PHRASE.replace("THING", f"(?:{_WHOLE}|{_ONE})"))
_DONE = re.compile(r"\b(?:that'?s (?:it|all|everything)|nothing else|done|finished|all set)\b")
_PREFACE = re.compile(rf"{_FILLER}(?:[ ,]+{_FILLER})*")
_POLITE = re.compile(r"(?:.*[ ,])?(?:(?:can|could|will) (?:you|we)|would you(?=.*please))\b.*")
_QUOTES = re.compile(r"[\"\u201c\u201d\u00ab\u00bb`]")
_DASH = re.compile(r"\s+[-\u2013\u2014]+\s+|[\u2013\u2014:]|,?\s*\.\.\.+|\u2026")


def consents(utterance: str, *, about_one: bool = False) -> bool:
    """Whether `utterance` is an order to buy the basket, as a whole and right now.

    Money is spent on a yes, so the words are read by a small grammar that knows orders and
    pleasantries. Anything else beside them (a condition, a wish to add something, a negation, a
    quotation, a question) makes it a no; the person is then simply asked again.

    Args:
        utterance: The person's words.
        about_one: Whether "it" may mean a single thing that was just spoken of.
    """
    text = utterance.casefold().replace("\u2019", "'").replace("\u2018", "'").strip()
    if _QUOTES.search(text.strip('"\u201c\u201d')) or len(text) > 200:
        return False
    text = _DASH.sub(", ", text.strip('"\u201c\u201d'))
    order = _ORDERS_WHOLE if about_one and not _DONE.search(text) else _ORDERS
    ordered = False
    start = 0
    for end in [*_SENTENCE_END.finditer(text), None]:
        mark = end[0] if end else ""
        sentence = " ".join(text[start : end.start() if end else len(text)].split()).strip(", ")
        start = end.end() if end else len(text)
        if not sentence:
            continue
        if order.fullmatch(sentence) and (mark != "?" or _POLITE.fullmatch(sentence)):
            ordered = True
        elif mark == "?" or not _PREFACE.fullmatch(sentence):
            return False
    return ordered
