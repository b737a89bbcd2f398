"""What an assistant should do next: act on the likeliest goal, ask, or propose others."""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple, Protocol, cast

import numpy as np

from goalscope.belief import Belief
from goalscope.goals import incomplete
from goalscope.opposites import opposes
from goalscope.speech import ASSENT, LEAD, LONGEST, MILD, normalize
from goalscope.types import UNSPECIFIED, Goal, InvalidInputError, Turn, canonical

__all__ = ["LOST", "SURE", "Advice", "Advised", "advice", "advised", "doubtful", "retracts"]

SURE = 0.8
"""Probability of a goal from which it is acted on: a question costs a fifth of a wrong act."""

LOST = 0.6
"""Probability of Unspecified above which other goals are asked for: before any word it has half."""

Advice = Literal["act", "ask", "propose"]
"""What an assistant should do next; see `advice`."""

_DENIAL = re.compile(
    r"(?P<not>n't|\b(?:can|do)not)\b|\b(?:aint|not|no|nope|nah|none|nor|neither|never|nothing"
    r"|nobody|nowhere|without|stop|halt|wait|abort|cancel\w*|forget|undo|refuse|avoid|except|unless"
    r"|wrong|rather\b[^.;!?]{0,60}\bthan|instead of|hold on|hang on"
    r"|chang(?:ed?|ing) (?:my|our) minds?"
    r"|hat(?:e|ed|es|ing)|dislik\w+|loath\w+|detest\w*|dread\w*|regret\w*|mistaken?|mistakes"
    r"|(?:keep|leave|count) (?:me|us|it|that|this|them) out|stay out|out of the question"
    r"|far from|already|yesterday|pointless|scrap|last thing|doubt\w*|skip|drop|hardly|scarcely"
    r"|barely|anything but|(?:done|finished|through) with|enough of|quit|leave|remove"
    r"|keep|ignore|disregard|meant|second thoughts?|after all"
    r"|let (?:me|us) (?:\w+ )?(?:ask|think|check|talk|sleep|see|consider)"
    r"|(?:do|does|did|doing|handle|manage|sort) (?:it|that|this) (?:my|our)sel(?:f|ves)"
    r"|later(?=[.,;!]|$))\b"
)
_OVER = r"(?=[ ,]*(?:[.,;!?]|$)|(?: please| now| yet| after all| any ?more))"
_RETRACTION = re.compile(
    r"(?<!n't )(?<!not )(?<!never )\b(?:halt|abort|cancel\w*|forget|undo|scrap|scratch|revert"
    r"|never ?mind|nvm|hold on|hang on|quit|chang(?:ed?|ing) (?:my|our) minds?|go back"
    r"|call(?:ed)? (?:it|that|this) off|take (?:it|that|this|them) back|not what (?:i|we)"
    r"|(?:keep|leave|count) (?:me|us|it|that|this|them) out)\b"
    rf"|(?<!n't )(?<!not )\b(?:stop|wait)\b(?:(?: it| that| this)?{_OVER}|,? (?:no|don't|do not)\b)"
    r"|(?:^|[,.;!?:] |\b(?:please|but|so|and|no|ok|okay|wait) )(?:don't|do not|never)"
    rf"(?! (?:forget|worry|hesitate|mind)\b)(?:(?: \w+){{0,3}} (?:it|that|this|them))?{_OVER}"
    r"|\b(?:i|we) (?:don't|do not|didn't|did not|no longer|never) (?:\w+ )?"
    r"(?:want(?:ed)?|need(?:ed)?|mean|meant|ask(?:ed)?|like|said|say)(?: \w+){0,2}"
    rf" (?:it|that|this|them|you){_OVER}"
)
"""What takes back what was said before, whatever that was."""

_ENDS = re.compile(r"(?:end|terminate|close|delete|unsubscribe from|stop|quit)\b")
_CANCELS = re.compile(
    r"\bcancel (?:my|our|the) (?:[a-z]+ ){0,2}?(?P<thing>[a-z]+)"
    r"(?=[.,;!?]|$| (?:please|now|then|today|immediately|for|as|because)\b)"
)
"""What ends a contract, and takes no words back."""

_GIVEN_LEAVE = re.compile(
    r"\bif (?:possible|it's possible|you (?:please|like|wish|can|could|would)\b(?! not))"
    r"|\bi (?:was|am|'m) wondering if you (?:can|could|would)\b"
)
_SUPPOSED = re.compile(
    r"\b(?:if|whether|suppos(?:e|ing)|imagine|hypothetically|wonder(?:ed|ing)?|maybe|perhaps)\b"
)
_ASKED = re.compile(
    rf"{LEAD}(?:(?:what|why|when|where|who|whose|how|which|is|are|am|was|were|does|did|should)\b"
    r"|(?:do|have) (?:i|we|you|they)\b|(?:has|had|will|would|shall|may|might|must|can|could)"
    r" (?:i|we|you|it|he|she|they|the|that|this|there|my|your)\b)|.*\?"
)
_REQUEST = re.compile(
    rf"{LEAD}(?:(?:can|could|would) you (?:please |kindly |just )?"
    r"(?!tell|explain|say|know|remind)\w"
    r"|(?:can|could|may) (?:i|we) (?:please |just )?(?:have|get|order|book|buy|take|try)\b)"
    r"|[^?]*\bplease\?$"
)

_DO = r"(?:go ahead and |just |now )?(\w+)"
_ASKS_LEAVE = re.compile(
    r"(?:^|[,;:] |\b(?:so|and|or|but|then|well|ok|okay) )"
    r"(?:(?:shall|should|may|can|could) (?:i|we) "
    r"(?!(?:help|assist|do|ask|have|know|see)\b|(?:get|take) (?:your|any|some|you (?:any|some)))"
    rf"{_DO}|shall\b|(?:do you want|would you like)(?: (?:me|us))? to {_DO}"
    r"|(?:do you want|would you like) (?:it|that|this|them)\b"
    r"|(?:(?:do|can|could|will) you (?:confirm|agree|accept|take)|(?:please )?confirm)\b(?! your)"
    r"|(?:ready|ok|okay) to\b"
    r"|(?:is|are|would) [^?]*\b(?:ok(?:ay)?|all? ?right|fine|happy|ready|sure)\b"
    r"|(?:does|do|would) [^?]{1,80} (?:work|suit|sound)\b)"
    r"|\b(?:ok(?:ay)?|all? ?right|right|agreed|deal|correct|go ahead|proceed)\?$"
    r"|\bok(?:ay)? (?:for|with) you\?|\b(?:do|would) you mind\b"
    r"|^(?!(?:is|was|does|did|what|why|how)\b)(\w+) (?:it|this|that|them)(?: now| then)?\?$"
)
"""A yes/no question whether to go ahead, with what is to be done."""

_YES = (
    rf"(?:{ASSENT}|y|yea|mm?-?hm+|uh-?huh|definitely|i'd love (?:that|to|it)"
    r"|(?:that|it)(?:'d| would) be (?:great|lovely|nice|good|perfect|wonderful|fine)"
    r"|(?:i|we) (?:do|confirm|agree|accept)|confirmed|correct|exactly"
    r"|go for it|let's do it|\U0001f44d|\u2705)"
)
_FINE = (
    rf"(?:{MILD}|all? ?right|right|then|now|good|great|perfect|lovely|excellent|cool|agreed|deal"
    r"|(?:(?:that|it) )?(?:(?:works|suits)(?: for)?(?: me| us)?|sounds (?:good|great|perfect)))"
)
_IRONY = re.compile(r"(?:yeah|yes|sure|oh),? (?:right|sure)\b(?! away)[ .!]*")
_ADDED = re.compile(
    rf"[ ,.;!]*(?:(?:and|so|just|{_YES}|{_FINE})\b[ ,.;!]*)*"
    r"(?:(?:i|we|it|that|this|there)(?:'\w+)?\b[^.,;!?]*|(?P<new>[^.,;!?]*))"
)
"""A clause behind a yes: a statement, or what may take the place of something in the question."""

_OTHERWISE = re.compile(
    r"\b(?:instead|you mind|or (?:would|should|shall|do|rather|wait|else|not))\b"
)
_HESITANT = re.compile(r"\b(?:but|later|rather|instead|first|another time|think about)\b")

_LINKS = frozenset({
    "a", "an", "the", "to", "of", "for", "and", "on", "in", "my", "our", "your", "me", "us", "him",
    "her", "them", "it", "is", "be", "so", "very", "much", "lot", "all", "good", "as", "well",
    "right", "away", "here", "thing",
})  # fmt: skip
"""Words that add nothing to a yes."""

_ENGLISH = re.compile(
    r"\b(?:the|th(?:is|at|ese|ose|ere|ey|eir|em|anks|ank you)|you|your|us|my|and|but|with|if|from"
    r"|about|into|out|up|to be|not|too|please|need|would|could|should|does|did|what|which|who|why"
    r"|when|where|how|yes|yeah|some|any|(?:some|any|every)(?:thing|one|where)|two|three|going"
    r"|looking|make|get|buy|find|today|tonight|tomorrow|let's|it's|it'll|i(?:'m|'d|'ll|'ve)|\w+n't"
    r"|(?:i|we) (?:am|are|want|will|have|can|just|like|prefer|wish)|(?:can|may) (?:i|we)|give me"
    r"|(?:put|place|prepare|book|want|have|order|cook|wash|slice|take|bring) (?:an?|it)"
    r"|(?:to|of|in|on|for|at) (?:the|an?|my|our|it))\b"
)
"""Short words of English that the languages around it do not have."""


class Tracking(Protocol):
    """A belief, and the words that it is made of, such as a `GoalTracker`."""

    @property
    def belief(self) -> Belief: ...

    @property
    def turns(self) -> Sequence[Turn]: ...


class Advised(NamedTuple):
    """What to do next, and why, in a sentence."""

    advice: Advice
    because: str


def advice(
    tracker: Tracking,
    *,
    since: int = 0,
    proposed: Mapping[Goal, int] | Mapping[str, int] | None = None,
) -> Advice:
    """What an assistant should do next.

    "act" on the likeliest goal, which has the probability `SURE` or more; "ask" the person; or
    "propose" goals: none explains the words, and Unspecified has more than `LOST`. Before the first
    turn there is only to ask, or to act on what the person has confirmed.

    How likely words are tells little of whether they deny, or ask for the opposite: so nothing is
    acted on where the newest are `doubtful`, nor where the goal would not be as likely without all
    those that were, and without all that a person said, and confirmed, before they took something
    back ("Stop!", "don't do that", "I changed my mind"); nor where the newest query asks whether to
    go ahead ("Shall I book it?") and the answer is no yes, or one with other words behind it that
    are no statement ("Yes, to Porto."), and after it until words speak for the goal again; nor on a
    goal that a model made from the person's words before later ones speak for it more than for
    none. What the person has confirmed since their newest words is acted on. Who takes something
    back is asked, and offered nothing else.

    Args:
        tracker: A `GoalTracker`, or what else has a belief and the turns that it is over.
        since: See `goalscope.goals.incomplete`.
        proposed: Goals that a model proposed, or their texts, with the number of turns that each
            was made from.

    Raises:
        InvalidInputError: It is no tracker, or `proposed` no such mapping.
    """
    return advised(tracker, since=since, proposed=proposed).advice


def advised(
    tracker: Tracking,
    *,
    since: int = 0,
    proposed: Mapping[Goal, int] | Mapping[str, int] | None = None,
) -> Advised:
    """The same as `advice`, with the reason."""
    belief, turns = getattr(tracker, "belief", None), getattr(tracker, "turns", None)
    if not isinstance(belief, Belief) or turns is None:
        raise InvalidInputError(
            f"advice is given of a GoalTracker, for its words count, too, not of {tracker!r}."
        )
    made = _made(proposed)
    goal, probability = next(iter(belief.top(1)), (UNSPECIFIED, 0.0))
    if goal != UNSPECIFIED and probability >= SURE:
        doubt = _held_back(belief, turns, goal, made.get(canonical(goal.text), 0))
        return Advised("ask", doubt) if doubt else Advised("act", f"It has {probability:.0%}.")
    if not turns or not len(belief.log_likelihood):
        return Advised("ask", "Nothing was said yet.")
    if (len(turns) > 1 or belief.pinned) and retracts(turns[-1].utterance, UNSPECIFIED):
        return Advised("ask", "The newest words take something back.")
    if belief.is_degenerate:
        return Advised("propose", "No goal can have said these words.")
    if UNSPECIFIED in belief.goals and incomplete(belief, LOST, since=since):
        return Advised("propose", "None of the goals explains the words well.")
    stated = next((p for each, p in belief.top() if each != UNSPECIFIED), 0.0)
    return Advised("ask", f"The likeliest goal has {stated:.0%}; {SURE:.0%} is sure enough.")


def doubtful(utterance: str, goal: Goal) -> bool:
    """Whether English words deny, ask or suppose something, beyond what the goal itself denies.

    They need not be about the goal: too many are found rather than too few. A polite request is no
    question. Words that seem to be of another language might deny anything. So are words doubtful
    that ask for the opposite (see `opposes`).
    """
    text = _GIVEN_LEAVE.sub("", _read(utterance, goal))
    sentences = re.findall(r"[^.!?;]+[.!?;]*", text)
    return bool(
        len(utterance) > LONGEST
        or _is_foreign(text)
        or _denials(text) - _denials(normalize(goal.text))
        or _SUPPOSED.search(text)
        or opposes(text, goal)
        or any(
            _ASKED.match(each) and not _REQUEST.match(each) for each in map(str.strip, sentences)
        )
    )


def retracts(utterance: str, goal: Goal) -> bool:
    """Whether English words take back what was said before, beyond what the goal itself does."""
    text = _read(utterance, goal)
    own = Counter(each[0] for each in _RETRACTION.finditer(normalize(goal.text)))
    return bool(Counter(each[0] for each in _RETRACTION.finditer(text)) - own)


def _read(utterance: str, goal: Goal) -> str:
    """An utterance, normalized; to cancel a contract is to end it, where that is the goal."""
    text = normalize(unicodedata.normalize("NFKC", utterance))
    ends = _ENDS.match(normalize(goal.text))
    things = _words(ends.string[ends.end() :]) if ends else []
    return _CANCELS.sub(lambda said: "end" if said["thing"] in things else said[0], text)


def _is_foreign(text: str) -> bool:
    """Whether no English is to be seen in a sentence; a few words may be of any language."""
    words = re.findall(r"[^\W\d_]+", text)
    unread = any(letter > "\u024f" for word in words for letter in word)
    return unread or (len(words) > 4 and not _ENGLISH.search(text))


def _leave(turn: Turn, goal: Goal) -> bool | None:
    """Whether the answer to a question whether to go ahead is a yes; None: no such question.

    A question whether not to, or what else to do, gives no leave, whatever the answer is.
    """
    query = normalize(unicodedata.normalize("NFKC", turn.query)[-LONGEST:])
    sentences = re.findall(r"[^.!?;]+[.!?;]*", query)
    questions = [each for each in sentences if "?" in each] or sentences
    asked = _ASKS_LEAVE.search(questions[-1].strip()) if questions else None
    if not asked or re.search(r"\b(?:sure|certain)\b", asked.string):
        return None
    opposed = _denials(asked.string) - _denials(normalize(goal.text))
    if opposed or _OTHERWISE.search(asked.string):
        return False
    said = _read(turn.utterance, goal)
    verb = next(filter(None, asked.groups()), "yes")
    done = rf"{verb}(?: (?:it|that|this|them|both|the|my|for|please|now)\b|(?=[ ,.!]*$))"
    yes = re.match(rf"(?:{_FINE}[ ,.!]+)*(?:(?P<yes>{_YES})|{done})(?!\w)", said)
    if yes and yes["yes"]:
        known = {*_words(query), *_words(normalize(goal.text)), *_LINKS}
        added = (clause["new"] or "" for clause in _ADDED.finditer(said, yes.end()))
        if _IRONY.fullmatch(said) or any(not known.issuperset(_words(each)) for each in added):
            return False
    if yes:
        return not _HESITANT.search(said, yes.end())
    return bool(re.fullmatch(rf"(?!(?:thanks|[ ,.!]|thank you)*$)(?:{_FINE}\b[ ,.!]*)+", said))


def _words(text: str) -> list[str]:
    return re.findall(r"[^\W_]+(?:'[^\W_]+)?", text)


def _denials(text: str) -> Counter[str]:
    return Counter("not" if each["not"] else each[0] for each in _DENIAL.finditer(text))


def _made(proposed: object) -> dict[str, int]:
    try:
        given = cast("Mapping[str | Goal, int]", proposed or {}).items()
        return {canonical(g.text if isinstance(g, Goal) else g): n + 0 for g, n in given}
    except (AttributeError, TypeError):
        raise InvalidInputError(
            f"proposed must say of goals how many turns each was made from, not {proposed!r}."
        ) from None


def _held_back(belief: Belief, turns: Sequence[Turn], goal: Goal, made: int) -> str:
    """Why a sure goal is only what is spoken of; "" where it is what the person says."""
    if (len(belief.log_likelihood), goal) in belief.pinned:
        return ""
    if not turns:
        return "Nothing was said yet."
    answers = [_leave(turn, goal) for turn in turns]
    if answers[-1] is False:
        return "The answer to the question whether to go ahead is no plain yes."
    said = [turn.utterance for turn in turns]
    taken_back = max((n for n, each in enumerate(said, 1) if retracts(each, goal)), default=0)
    doubts = [n <= taken_back or doubtful(each, goal) for n, each in enumerate(said, 1)]
    if doubts[-1]:
        return "The newest words deny, ask or suppose something, or ask for the opposite."
    pinned = tuple((when, each) for when, each in belief.pinned if when >= taken_back)
    plain, first = replace(belief, pinned=pinned), len(turns) - len(belief.log_likelihood)
    for number, doubt in enumerate(doubts[first:]):
        plain = plain.without(number) if doubt else plain
    left = plain.probability[belief.goals.index(goal)]
    if left < SURE:
        return (
            f"Without the words that deny, ask, suppose or were taken back it has only {left:.0%}."
        )
    refused = max((n for n, each in enumerate(answers, 1) if each is False), default=0)
    made = max(made, 0 if answers[-1] else refused)
    if not made or goal in {each for when, each in pinned if when >= refused}:
        return ""
    later = plain.evidence[made:]
    against = later[:, [each == UNSPECIFIED for each in belief.goals]].sum()
    speaks = later[:, belief.goals.index(goal)].sum() > against + np.finfo(float).eps
    return "" if speaks else "Later words must speak for it first."
