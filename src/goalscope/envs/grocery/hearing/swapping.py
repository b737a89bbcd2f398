"""What a person says to have one thing in the place of another, said more plainly."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from goalscope.envs.grocery.amounts import CONTAINER
from goalscope.envs.grocery.hearing.correcting import NAMED, QUALITY, SUCH
from goalscope.envs.grocery.hearing.diets import is_diet
from goalscope.envs.grocery.hearing.phrases import END, IT, NUMBER, SAME_ONE
from goalscope.envs.grocery.words import singulars
from goalscope.envs.speech import evened, kept

__all__ = ["swapped"]

_ONE_NOT_OTHER = re.compile(
    rf"^(?!(?:{IT}|the|for|on|in|at|by|to|with|i|we|you|no|and|but|if|my|our)\b)"
    rf"({NAMED}(?: {NAMED}){{0,3}}?)(?:,? please)?,? (?:and )?not (?:the |any )?"
    rf"(?![^.]*\bones?\b)({NAMED}(?: {NAMED}){{0,3}}?)(?: please)?[.!]*$"
)
"""One thing and not another, without a verb: "oat milk, not whole milk"."""
_NOT_THIS = re.compile(
    rf"^(?:(?:no|hm+|oh|wait|actually|sorry)[ ,.!]+)*not (?:the |any )?"
    rf"({NAMED}(?: {NAMED}){{0,3}}?)(?:,? (?:but|make (?:it|that)|(?:i|we)"
    r" (?:said|meant?|want(?:ed)?|asked for)) (?!to\b)|, (?=[^,]* instead(?: please)?[.!]*$))"
    rf"({NAMED}(?: {NAMED}){{0,4}}?)(?: instead)?(?: please)?[.!]*$"
)
"""The same the other way round: "not chips, I said bars"."""
_INSTEAD = re.compile(
    r"^(?:(?:no|nope|sorry|actually|oh|ok|okay|hmm|please|then)[ ,.!]+)*"
    r"(?:(?:(?:i|we)(?:'d| would|'ll| will) (?:like|have|take|prefer)|(?:i|we) (?:want|need)"
    r"|let's (?:have|take|do)|(?:can|could) (?:i|we|you) (?:have|get|take|add)|add|get|take|give me"
    rf"|make (?:it|that)) )?(?!(?:{IT}|i|we|no|not|nothing|do|use|swap|change|replace|remove)\b)"
    rf"({NAMED}(?: {NAMED}){{0,4}}) instead(?:,? please)?[.!?]*$"
    r"|^(?:(?:no|nope|sorry|actually|oh|ok|okay|hmm|please|then|wait)[ ,.!]+)*make (?:it|that) "
    rf"(?!(?:{IT}|an?|the|organic|vegan|double|cheaper|more|less|fewer|just|only|up|so|for|with"
    r"|without|all|about|exactly|sure|quick|easy|simple|nice|good|better|snappy|fast|work)\b"
    rf"|{NUMBER}\b)({NAMED}(?: {NAMED}){{0,3}})(?:,? please)?[.!?]*$"
)
"""What takes the place of the thing spoken of last: "coffee instead"."""
_FOR_OTHER = re.compile(
    rf"(?P<new>{NAMED})(?P<how> (?:instead of|rather than|in place of) (?:(?:the|my|our) )?)"
    rf"(?P<old>{NAMED}(?: {NAMED})??){END}",
    re.IGNORECASE,
)
_OTHER_FOR = re.compile(
    r"(?P<verb>\b(?:swap|exchange|switch|replace|substitute)(?: out)? (?:(?:the|my|our) )?)"
    rf"(?P<old>{NAMED}(?: {NAMED})??)(?P<how> (?:for|with|by|to) (?:(?:the|an?|some) )?)"
    rf"(?P<more>(?:{NAMED} ){{0,2}}?)(?P<new>{NAMED}){END}",
    re.IGNORECASE,
)
_GRAIN = re.compile(r"(?:whole ?)?(?:wheat|meal|grain)|multigrain")
"""What bread, rice or pasta may be of: "whole wheat"."""
_USUAL = re.compile(rf"{QUALITY}|normal|regular|ordinary|standard|usual")
_OTHER_SUCH = re.compile(
    rf"^(?!{QUALITY} )({NAMED}(?: {NAMED})?) (?:instead of|rather than)(?: the)?"
    rf" (?:{_USUAL.pattern})(?: ones?)?(?:,? please)?[.!]*$"
)
"""Another kind of the thing spoken of last: "whole wheat instead of white"."""
_NOT_SUCH = re.compile(
    rf"^(?:(?:no|sorry|actually|oh|wait)[ ,.!]+)*(?:the )?({NAMED}),? (?:and )?not (?:the )?"
    rf"({NAMED})(?: ones?)?(?:,? please)?[.!]*$"
)
"""Which kind of the thing spoken of last, and which not: "rye, not white"."""
_NORMAL = re.compile(
    r"^(?:(?:no|sorry|actually|oh|wait|then|ok|i(?:'d)? (?:want|like|prefer))[ ,.!]+)*(?:just )?the"
    r" (?:normal|regular|ordinary|standard|usual) (?:ones?|kind|version)(?: instead)?"
    r"(?:,? please)?[.!]*$"
)
_ON_ROLLS = r"(?:(?:(?:an?|one) )?(?:[a-z]+ )?pack of )?((?:[a-z]+ )?(?:paper|foil|wrap|towels?))"
_IN_ROLLS = re.compile(
    rf"\b(?:{_ON_ROLLS},? ({NUMBER}) rolls?|({NUMBER}) rolls? of {_ON_ROLLS})\b", re.IGNORECASE
)
"""How many rolls of paper, which come in packs: "toilet paper, 12 rolls"."""
_IN_ONE_BREATH = re.compile(
    rf"(?P<lead>(?:.{{0,100}}[,.;] |(?:add|get|buy) )?)(?P<other>{NAMED}(?: {NAMED}){{0,2}})[.,;!]+"
    r" (?:(?:no|wait|actually|oh|sorry|hmm)\b[ ,.!]*)+make (?:it|that)"
    rf" (?!{NUMBER}\b)(?P<one>{NAMED}(?: {NAMED}){{0,3}})(?:,? (?:please|instead))*[.!]*"
)
"""What is swapped as soon as it is said: "add milk. Wait, no, make it oat milk"."""
_SUCH_BEHIND = re.compile(
    r"(?:(?:and|but|actually|no|oh|please|also)[ ,.!]+)*(?:make )?(?:the|my|our)"
    rf" ({NAMED}(?: {NAMED})??) ({NAMED}(?: free)?)(?:,? (?:please|instead))*[.!]*"
)
"""A thing that was named, with what kind it is to be behind it: "and the milk lactose-free"."""
_KIND_AHEAD = re.compile(rf"(?:(?:and|also|add) )*({NAMED}), ({NAMED})(?:,? please)?[.!]*")
"""A thing, and which kind: "rice, basmati"."""
_ALL_ORGANIC = re.compile(
    r"^(?:(?:ok|okay|please|actually|no|can you|could you)[ ,.!]+)*make"
    r" (?:them|both|those|these|both of (?:them|those)) organic(?:,? please)?[.!?]*$"
)
_PART = re.compile(
    r"^(?:(?:no|nope|sorry|actually|oh|ok|okay|hmm|please|then|wait)[ ,.!]+)*make (?:it|that) "
    rf"(?!{NUMBER} )(?P<one>{NAMED}(?: {NAMED}){{0,3}}?)"
    rf"(?:, ?(?P<many>{NUMBER}) of (?:them|it|those))?(?=[.,;]| and )(?:,? and |[.,;] ?)",
    re.IGNORECASE,
)
"""One thing in the place of another, with more to follow: "make it oat milk, 2 of them, and"."""
_SO_MUCH = re.compile(
    r"\bmake (?:it|that) (?=(?:half|double|twice) (?:of )?(?:the|my|our)\b)", re.IGNORECASE
)
"""Before how much of a thing is to be left, which swaps nothing: "make it half the chicken"."""
_AMOUNT = re.compile(rf"^(?:(?:{NUMBER}|an?|some|the) )?(?:{CONTAINER} of )?")
_LONGEST = 160
"""Characters of a text that says no more than a swap, at most."""


def swapped(text: str, spoken: Callable[[], Sequence[str]], sells: Callable[[str], bool]) -> str:
    """`text`, said more plainly where one thing that is sold is to take the place of another.

    Anything else stays as it is: "thanks, not today" and "make it tomorrow" swap no things.

    Args:
        text: What was said.
        spoken: Gives the things that were spoken of last.
        sells: Whether there are things of a name.
    """
    if (found := _OTHER_SUCH.fullmatch(evened(text).strip())) and len(last := spoken()) == 1:
        one, kind = found[1], last[0]
        same = singulars(one)[-1:] == singulars(kind)[-1:]
        if not same and not is_diet(one) and sells(f"{one} {kind}"):
            return f"{one} {kind} instead of {SAME_ONE}"
    text = _IN_ROLLS.sub(lambda m: f"{m[2] or m[3]} {m[1] or m[4]}", text)
    if found := _IN_ONE_BREATH.fullmatch(evened(text).strip()):
        one = found["one"]
        if not is_diet(one) and sells(one) and sells(found["other"]):
            return f"{found['lead']}{one}"
    if found := _SUCH_BEHIND.fullmatch(evened(text).strip()):
        kind, such = found.groups()
        known = is_diet(such) or re.fullmatch(QUALITY, such) or not sells(such)
        whole = f"{such.replace(' free', '-free')} {kind}"
        if known and sells(kind) and sells(whole):
            return f"swap the {kind} for {whole}"
    if (found := _KIND_AHEAD.fullmatch(evened(text).strip())) and not sells(found[2]):
        kind, such = found.groups()
        if sells(f"{such} {kind}"):
            return f"{such} {kind}"
    if _ALL_ORGANIC.fullmatch(evened(text).strip()) and len(last := spoken()) > 1:
        return ". ".join(f"swap the {each} for organic {each}" for each in last)
    if _NORMAL.fullmatch(evened(text).strip()) and len(last := spoken()) == 1:
        kind = last[0].split()[-1]
        return f"{kind} instead of {last[0]}" if kind != last[0] and sells(kind) else text
    if (found := _NOT_SUCH.fullmatch(evened(text).strip())) and len(last := spoken()) == 1:
        one, other = found.groups()
        if not sells(one) and sells(f"{one} {last[0]}") and sells(f"{other} {last[0]}"):
            return f"the {one} one"
    text = _of_one_kind(text, spoken, sells)
    if (found := _PART.match(text)) and sells(found["one"]) and not is_diet(found["one"]):
        kind = singulars(found["one"])[-1:]
        if any(singulars(old)[-1:] == kind for old in spoken()):
            many = f"{found['many']} packs of " if found["many"] else ""
            rest = _of_one_kind(text[found.end() :], spoken, sells)
            return f"add {many}{found['one']} instead of {SAME_ONE}. {rest}"
    said = kept(evened(text)) if len(text) <= _LONGEST else ""
    if SUCH.fullmatch(said):
        return text
    if found := _INSTEAD.fullmatch(said):
        one = found[1] or found[2]
        name = _AMOUNT.sub("", one)
        last, kind = spoken(), singulars(name)[-1:]
        alike = any(singulars(old)[-1:] == kind for old in last)
        kinds = {old: f"{name} {old.split()[-1]}" for old in last}
        sorts = [old for old in last if name == one and not sells(name) and sells(kinds[old])]
        whole = len(last) == 1 and sells(f"{name} {last[0]}")
        if len(sorts) == 1 and not (whole or is_diet(name)):
            return f"{kinds[sorts[0]]} instead of {sorts[0]}"
        if is_diet(name) or (found[2] and len(last) != 1 and not alike):
            return text
        such = len(last) == 1 and name == one and not alike and sells(f"{name} {last[0]}")
        if such and (found[2] or not sells(name)):
            return f"the {name} one"
        return f"{one} instead of {SAME_ONE}" if sells(name) else text
    if (found := _ONE_NOT_OTHER.fullmatch(said)) or (found := _NOT_THIS.fullmatch(said)):
        one, other = found.groups() if found.re is _ONE_NOT_OTHER else found.groups()[::-1]
        name = _AMOUNT.sub("", one)
        which = re.fullmatch(QUALITY, other)
        known = sells(other) or sells(f"{other} {name.split()[-1]}")
        known = known or any(singulars(other)[-1:] == singulars(old)[-1:] for old in spoken())
        if sells(name) and (which or known):
            kind = f"{other} {name.split()[-1]}"
            old = (kind if sells(kind) else SAME_ONE) if which else other
            return f"add {one} instead of {old}"
    return text


def _of_one_kind(
    text: str, spoken: Callable[[], Sequence[str]], sells: Callable[[str], bool]
) -> str:
    """`text` where what is named by a quality alone is of the kind of what it is swapped with.

    "Brown rice instead of white" is so in the place of white rice, and of no other white thing.
    """

    def whole(found: re.Match[str]) -> str:
        said = found.groupdict("")
        old, new = said["old"].lower(), said["new"].lower()
        if (
            new in ("one", "ones")
            and said.get("more")
            and sells(f"{said['more']}{old.split()[-1]}")
        ):
            said["new"] = new = old.split()[-1]
        more = said.get("more", "")
        if _GRAIN.fullmatch(f"{more}{new}") and sells(f"{more}{new} {old.split()[-1]}"):
            said["new"] = new = f"{new} {old.split()[-1]}"
        usual = _USUAL.fullmatch(more.strip())
        if new in ("one", "ones") and usual and " " in old and sells(kind := old.split()[-1]):
            said |= {"more": "", "new": kind}
        bare = [bool(re.fullmatch(QUALITY, each)) or not sells(each) for each in (old, new)]
        if bare == [True, False] and sells(f"{old} {new}"):
            said["old"] += f" {said['new']}"
        elif bare == [True, False] and found.re is _FOR_OTHER and _USUAL.fullmatch(old):
            last = spoken()
            alike = any(singulars(each)[-1:] == singulars(new)[-1:] for each in last)
            if alike or re.fullmatch(QUALITY, old):
                said |= {"how": " instead of ", "old": SAME_ONE}
        elif bare == [False, True] and sells(f"{new} {old.split()[-1]}"):
            said["new"] += f" {said['old'].split()[-1]}"
        if "verb" in said:
            return f"{said['verb']}{said['old']}{said['how']}{said['more']}{said['new']}"
        return f"{said['new']}{said['how']}{said['old']}"

    return _OTHER_FOR.sub(whole, _FOR_OTHER.sub(whole, text))
