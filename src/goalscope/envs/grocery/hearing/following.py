"""What words mean by what was said before them, said so that they stand alone."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from goalscope.envs.grocery.heard import Hearing
from goalscope.envs.grocery.hearing.diets import is_diet
from goalscope.envs.grocery.hearing.phrases import NUMBER, SAME_ONE
from goalscope.envs.grocery.words import singulars
from goalscope.envs.speech import evened

__all__ = ["standing_alone"]

_LEAD = r"(?:(?:no|yes|ok|okay|oh|hmm|well|actually|sorry|please|then|and|so)[ ,.!]+)*"
_END = r"(?:,? (?:please|then|instead|thanks))*[.!?]*"
_RATHER = re.compile(
    rf"{_LEAD}(?:i|we)(?:'d| would) (?:rather|prefer to) (?:have|get|take|buy)"
    rf" (?:the |an? |some )?([a-z' -]+?){_END}"
)
_PREFERS = re.compile(
    rf"{_LEAD}(?:i|we)(?:(?:'d| would) (?:rather|prefer)(?: to)?(?: have| get| take)?| prefer)"
    rf" (?:the |an? |some )?([a-z-]+(?: [a-z-]+)?){_END}"
)
_SUCH = re.compile(rf"{_LEAD}(?:the )?([a-z-]+)(?: one)?,? (?:please|then|thanks)[.!]*")
_FOR_SUCH_ONE = re.compile(
    rf"{_LEAD}(?:(?:can|could) (?:you|we) )?(?:swap|change|exchange|replace|switch)"
    rf" (?:it|that|this) (?:for|with|to|by) (?:the|an?) ([a-z'-]+(?: [a-z'-]+)?) one{_END}"
)
_NAME = (
    r"the (?!(?:rest|others?|price|total|bill|usual)\b)"
    r"(?:(?!(?:and|or|for|with|i|we|is|are|instead|twice|ones?|too|back|again|please)\b)"
    rf"(?!{NUMBER}\b)[a-z'-]+ ?){{1,3}}"
)
_AND_THE = re.compile(
    rf"(?:and|oh and)[ ,]+({_NAME}(?:(?:, and |, |and |[.;] and |[.;] ){_NAME})*)[.!]*"
)
_SOMETHING_LIKE = re.compile(
    r"\b(?:an? |some )?[a-z]+, (?:something|anything|maybe something) like (?:an? |some )?"
    rf"([a-z]+(?: [a-z]+)?)(?={_END}$)",
    re.IGNORECASE,
)
_IF_THERE = re.compile(
    r"(?P<some>\b(?:an? |some )?)(?P<kind>[a-z]+)(?P<too>(?: as well| too| please)?),"
    r" (?P<sort>[a-z-]+(?: [a-z-]+)?)(?: ones?)? if (?:you(?: have|'ve got) (?:it|any|some|them)"
    r"|possible|available|there is (?:any|some|one))(?=[.,;!?]|$)",
    re.IGNORECASE,
)
_NOT_THE_OTHER = re.compile(
    r"\b(?P<new>[a-z-]+(?: [a-z-]+)? (?P<kind>[a-z]+) (?:instead of|rather than) )(?:the )?"
    r"(?P<old>[a-z-]+) one\b",
    re.IGNORECASE,
)
_NOT_THAT = re.compile(
    r"(?<=[a-z]), not (?:the |any )?(?P<old>[a-z-]+ (?P<kind>[a-z]+))(?=,| and\b|[.!]* *$)",
    re.IGNORECASE,
)
"""Behind one thing of several: "eggs and oat milk, not soy milk"."""
_HAVE_IT = re.compile(
    r"\b(?:i|we)(?:'ve| have)?(?: already| still)* (?:have|got)"
    r" (?:(?:enough|some|plenty of|the|our) )?"
    r"([a-z]+(?: (?!(?:at|left|already|here|so|and)\b)[a-z]+)?)"
    r"(?: (?:at home|left|already|here))*,? (?:so|and)(?: (?:you|we) can| please| just)*"
    r" (?:(?:remove|drop|not) (?:it|that|them|those)"
    r"|(?:leave|take) (?:it|that|them|those) (?:out|away|off|back))(?=[.,;!?]|$)",
    re.IGNORECASE,
)
_REFUSES = re.compile(
    r"\b(?:no|not|never|without|nothing|nobody|instead|rather|remove|delete|drop|take|leave|avoid"
    r"|allerg\w+|intoleran\w+|\w+n't)\b",
    re.IGNORECASE,
)
"""With such words nothing is taken for an order of what only an example or a wish names."""
_TELLS = re.compile(
    r"\b(?:get rid|have|had|got|drinks?|eats?|uses?|(?<!'d )(?<!would )likes?|loves?|said|wanted"
    r"|asked|meant|prefers?|is|are|was)\b",
    re.IGNORECASE,
)
"""No plain order of things."""


def standing_alone(
    text: str,
    before: Callable[[], Hearing],
    last: Callable[[], Sequence[str]],
    sells: Callable[[str], bool],
) -> str:
    """`text`, so that it says the same to who did not hear what was said before.

    "I'd rather have the red wine" takes the place of the white wine that was asked for, and "I'd
    prefer wholemeal" that of the bread that was spoken of. Behind what is to be taken out, "and the
    eggs" are to be, too. Of cake and plates, "the chocolate one" is a cake. Nor is heard by itself
    what names a thing twice: "rice, brown if you have it", "a dessert, something like tiramisu", "I
    have rice, so leave it out". A diet stays a diet.

    Args:
        text: What was said.
        before: Gives what all words before come to.
        last: Gives the things that were spoken of last.
        sells: Whether there are things of a name.
    """
    said = evened(text).strip()
    if (found := _RATHER.fullmatch(said)) and sells(found[1]) and not is_diet(found[1]):
        asked = [each.phrase for each in before().wanted]
        alike = [each for each in asked if _head(each) == _head(found[1]) and each != found[1]]
        return f"{found[1]} instead of {alike[0]}" if len(alike) == 1 else text
    if found := _FOR_SUCH_ONE.fullmatch(said):
        for spoken in (last(), [each.phrase for each in before().wanted]):
            olds = [each for each in spoken if sells(f"{found[1]} {_head(each)}")]
            olds = [each for each in olds if found[1] not in each]
            if len(olds) == 1:
                return f"{found[1]} {_head(olds[0])} instead of {olds[0]}"
    if (found := _AND_THE.fullmatch(said)) and before().removed and not before().newest:
        return f"take out {re.sub(r'[.;] (?:and )?(?=the )', ', ', found[1])}"
    if (found := _SUCH.fullmatch(said)) and before().words.rstrip().endswith("?"):
        wholes = {f"{found[1]} {each}" for each in last() if sells(f"{found[1]} {each}")}
        return f"add {wholes.pop()}" if len(wholes) == 1 and not is_diet(found[1]) else text
    if (found := _PREFERS.fullmatch(said)) and not (sells(found[1]) or is_diet(found[1])):
        olds = [each for each in last() if found[1] not in each]
        kinds = {_head(each) for each in olds if sells(f"{found[1]} {_head(each)}")}
        return f"{found[1]} {kinds.pop()} instead of {SAME_ONE}" if len(kinds) == 1 else text

    def of_kind(found: re.Match[str]) -> str:
        whole = f"{found['sort']} {found['kind']}"
        fits = sells(whole) and not sells(found["sort"])
        return f"{found['some']}{whole}{found['too']}" if fits else found[0]

    def of_both(found: re.Match[str]) -> str:
        old = f"{found['old']} {found['kind']}"
        return f"{found['new']}{old}" if sells(old) else found[0]

    def of_several(found: re.Match[str]) -> str:
        before, after = text[: found.start()], text[found.end() :]
        several = re.search(r",|\band\b", before + after)
        order = re.sub(rf"^{_LEAD}", "", before, flags=re.IGNORECASE)
        if _REFUSES.search(order) or _TELLS.search(order):
            return found[0]
        alike = singulars(found["kind"])[0] in singulars(before)
        return f", no {found['old']}" if several and alike and sells(found["old"]) else found[0]

    text = _NOT_THAT.sub(of_several, _NOT_THE_OTHER.sub(of_both, text))
    text = _HAVE_IT.sub(lambda have: f"remove the {have[1]}" if sells(have[1]) else have[0], text)
    if _REFUSES.search(text):
        return text
    text = _IF_THERE.sub(of_kind, text)
    return _SOMETHING_LIKE.sub(lambda like: like[1] if sells(like[1]) else like[0], text)


def _head(phrase: str) -> str:
    return " ".join(singulars(phrase)[-1:])
