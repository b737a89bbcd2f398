"""English cue phrases: denial, question, retraction, consent and the opposite of a goal.

How likely words are under a goal tells little of whether they deny it. These patterns only hold an
assistant back (see `advice`), so they find too many cues rather than too few.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter

from goalscope.base.text import plain
from goalscope.base.types import Goal, Turn

LONGEST = 2000
"""Characters of an utterance that are read."""

_SPELLINGS = [
    (re.compile(pattern), plainer)
    for pattern, plainer in (
        (
            r"\b(do|does|did|is|are|was|were|should|would|could|must|need|have|has)nt\b",
            r"\1n't",
        ),
        (r"\b(?:cannot|cant)\b", "can't"),
        (r"\bwont\b", "won't"),
        (r"\b(let|that|what|there)s\b(?! \d)", r"\1's"),
        (r"\bi(m|ve)\b", r"i'\1"),
        (r"\b(?:pls|plz|plse|pleas)\b", "please"),
        (r"\b(?:thx|thanx|thnx)\b", "thanks"),
        (r"\b(?:u|ya)\b", "you"),
        (r"\b(c|w|sh)ld\b", r"\1ould"),
        (r"\bteh\b", "the"),
        (r"\b(?:taht|thta|tath|thath)\b", "that"),
        (r"\b(?:unod|udno|undu)\b", "undo"),
        (r"\bgimme\b", "give me"),
        (r"\blemme\b", "let me"),
        (r"\bwanna\b", "want to"),
        (r"\bgonna\b", "going to"),
        (r"(?<=\w) n (?=\w)", " and "),
        (
            r"(?<=\w)(?:,? (?:btw|by the way|actually|either|though|tho|haha|lol|ofc|of course"
            r"|asap))+"
            r"(?=[ ,]*(?:[,.;!?]|$))",
            "",
        ),
        (r"(?:(?:^|(?<=[ ,.!?]))(?:uh+m?|um+|erm?|hm+|oh|lol|haha)\b[,.]* ?)+", ""),
        (
            r"(?:^|(?<=[.;!?] ))i (?:think|guess|suppose|believe),? (?:that )?(?="
            r"(?:i|we|you|it|he|she|they|there|let|please)\b|that(?:'s| is| will)\b"
            r"|(?!(?:about|all|at|both|for|half|in|just|like|maybe|most|not|of|on|only|so|with)\b)"
            r"\w+ (?:the|an?|my|our|it|them|this|that|these|those|some)\b"
            r"|[^.,;!?]{1,60} (?:should|must|can|could|needs?|has to|have to|would be"
            r"|(?:is|are) (?:a must|essential|needed))\b)",
            "",
        ),
        (r",? (?:i (?:guess|think|suppose|believe)|i'd say)(?=[ ,]*(?:[.;!?]|$))", ""),
        (r"\b(?:as well as|along with|together with)\b", "and"),
        (
            r"\b(?:i|we) (?:don't|do not) (?:really )?(?:think|believe|suppose|guess)(?: that)?"
            r" (i|we|you|they)(?:'ll|'d| will| would)? (?:(?:still|even|really|actually|all) )*"
            r"(?=(?:need|want|like|eat|drink|use)\b)",
            r"\1 don't ",
        ),
        (r"\b(?:evry|evrey|evey|evrything|every|eveyr|ever)[ -]?(?:th?ing|thign)\b", "everything"),
        (
            r"\b(hello|hi|good (?:morning|afternoon|evening)|please|thanks|thank you|yes|no|fine|ok"
            r"|okay|right),? (?:my )?(?:dear|love|darling)\b",
            r"\1",
        ),
        (
            r"^(?:(?:good )?(?:morning|afternoon|evening)|good day|hello|hey|hi)(?: there)?[.!]+"
            r" (?=\w)",
            "",
        ),
        (r"[ ,]+(?=[.;!?]|$)", ""),
    )
]
"""Patterns of hasty typing and of fillers, and what stands in their place."""


def normalize(text: str) -> str:
    """`text` in lower case and on one line, with hasty spelling written out and without fillers."""
    text = re.sub("[\u2018\u2019\u00b4`]", "'", text[:LONGEST].casefold())
    text = " ".join(text.split())
    for pattern, plainer in _SPELLINGS:
        text = pattern.sub(plainer, text)
    return text


_LEAD = (
    r"(?:(?:ok(?:ay)?|hi|hello|hey|so|and|but|well|sorry|excuse me|also|please|(?:can|could) you"
    r" tell me|do you know|tell me)[ ,]+)*"
)
"""What may stand before a question."""

_ASSENT = (
    r"yes|yeah|yep|yup|sure|of course|go ahead|please do|do it|you may|certainly|absolutely"
    r"|by all means"
)
"""A yes."""

_MILD = r"ok(?:ay)?|please|fine|that'?s (?:fine|ok(?:ay)?)|thanks|thank you"
"""Politeness, which is a weak yes by itself."""

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
"""Takes back what was said before, whatever it was."""

_ENDS = re.compile(r"(?:end|terminate|close|delete|unsubscribe from|stop|quit)\b")
_CANCELS = re.compile(
    r"\bcancel (?:my|our|the) (?:[a-z]+ ){0,2}?(?P<thing>[a-z]+)"
    r"(?=[.,;!?]|$| (?:please|now|then|today|immediately|for|as|because)\b)"
)
"""To "cancel my contract" ends a contract, and retracts nothing."""

_GIVEN_LEAVE = re.compile(
    r"\bif (?:possible|it's possible|you (?:please|like|wish|can|could|would)\b(?! not))"
    r"|\bi (?:was|am|'m) wondering if you (?:can|could|would)\b"
)
_SUPPOSED = re.compile(
    r"\b(?:if|whether|suppos(?:e|ing)|imagine|hypothetically|wonder(?:ed|ing)?|maybe|perhaps)\b"
)
_ASKED = re.compile(
    rf"{_LEAD}(?:(?:what|why|when|where|who|whose|how|which|is|are|am|was|were|does|did|should)\b"
    r"|(?:do|have) (?:i|we|you|they)\b|(?:has|had|will|would|shall|may|might|must|can|could)"
    r" (?:i|we|you|it|he|she|they|the|that|this|there|my|your)\b)|.*\?"
)
_REQUEST = re.compile(
    rf"{_LEAD}(?:(?:can|could|would) you (?:please |kindly |just )?"
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
"""A yes/no question whether to go ahead; a group holds the verb."""

_YES = (
    rf"(?:{_ASSENT}|y|yea|mm?-?hm+|uh-?huh|definitely|i'd love (?:that|to|it)"
    r"|(?:that|it)(?:'d| would) be (?:great|lovely|nice|good|perfect|wonderful|fine)"
    r"|(?:i|we) (?:do|confirm|agree|accept)|confirmed|correct|exactly"
    r"|go for it|let's do it|\U0001f44d|\u2705)"
)
_FINE = (
    rf"(?:{_MILD}|all? ?right|right|then|now|good|great|perfect|lovely|excellent|cool|agreed|deal"
    r"|(?:(?:that|it) )?(?:(?:works|suits)(?: for)?(?: me| us)?|sounds (?:good|great|perfect)))"
)
_IRONY = re.compile(r"(?:yeah|yes|sure|oh),? (?:right|sure)\b(?! away)[ .!]*")
_ADDED = re.compile(
    rf"[ ,.;!]*(?:(?:and|so|just|{_YES}|{_FINE})\b[ ,.;!]*)*"
    r"(?:(?:i|we|it|that|this|there)(?:'\w+)?\b[^.,;!?]*|(?P<new>[^.,;!?]*))"
)
"""A clause after a yes: a statement, or words that may replace a part of the question."""

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
"""Short words that English has and its neighbours do not."""


def doubt(utterance: str, goal: Goal) -> str:
    """Why words are not to be acted on, as the end of a sentence about them; "" if they are.

    They may deny, ask or suppose something, beyond what the goal itself denies, though not about
    the goal. A polite request is no question. Words of another language are doubtful, and words
    that ask for the opposite (see `opposes`).
    """
    if len(utterance) > LONGEST:
        return "are too many to be checked"
    text = _GIVEN_LEAVE.sub("", _read(utterance, goal))
    if _is_foreign(text):
        return "do not seem to be English"
    if _denials(text) - _denials(normalize(goal.text)):
        return "deny something"
    if _SUPPOSED.search(text):
        return "suppose something"
    if opposes(text, goal):
        return "may ask for the opposite"
    sentences = map(str.strip, re.findall(r"[^.!?;]+[.!?;]*", text))
    asked = any(_ASKED.match(each) and not _REQUEST.match(each) for each in sentences)
    return "ask something" if asked else ""


def retracts(utterance: str, goal: Goal) -> bool:
    """Whether words take back what was said before, beyond what the goal itself does."""
    text = _read(utterance, goal)
    own = Counter(each[0] for each in _RETRACTION.finditer(normalize(goal.text)))
    return bool(Counter(each[0] for each in _RETRACTION.finditer(text)) - own)


def _read(utterance: str, goal: Goal) -> str:
    """An utterance, normalized, with "cancel" as "end" where the goal is to end that thing."""
    text = normalize(unicodedata.normalize("NFKC", plain(utterance)))
    ends = _ENDS.match(normalize(goal.text))
    things = _words(ends.string[ends.end() :]) if ends else []
    return _CANCELS.sub(lambda said: "end" if said["thing"] in things else said[0], text)


def _is_foreign(text: str) -> bool:
    """Whether a text looks like another language; a few words may be of any."""
    words = re.findall(r"[^\W\d_]+", text)
    unread = any(letter > "\u024f" for word in words for letter in word)
    return unread or (len(words) > 4 and not _ENGLISH.search(text))


def consents(turn: Turn, goal: Goal) -> bool | None:
    """Whether the answer to a question whether to go ahead is a plain yes.

    None if the query is no such question. A yes with other words after it that are no statement
    ("Yes, to Porto.") is no plain yes; nor is any answer to a question whether not to do something,
    or whether to do something else.
    """
    query = normalize(unicodedata.normalize("NFKC", plain(turn.query))[-LONGEST:])
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


_SMALLER = "decrease lower reduce shrink downgrade cut less fewer smaller shorter slower quieter"
_BIGGER = "increase raise extend upgrade more bigger larger higher longer faster louder"
_PAIRS = [
    (frozenset(one.split()), frozenset(other.split()), frozenset(where.split()))
    for one, other, where in (
        (f"{_BIGGER} brighter warmer", f"{_SMALLER} dimmer cooler colder", ""),
        ("block freeze lock suspend disable deactivate", "activate reactivate enable reopen", ""),
        ("open", "close shut lock block", ""),
        ("start begin launch", "stop end finish shut", ""),
        ("slow", "hurry accelerate quicken", ""),
        ("merge join", "split separate", ""),
        ("delete erase close end terminate cancel", "restore recover reopen renew keep extend", ""),
        ("add insert include put register", "remove delete exclude off out", ""),
        ("buy purchase order book rent", "sell", ""),
        ("approve accept allow permit", "reject decline refuse forbid", ""),
        ("deposit", "withdraw", ""),
        ("lend", "borrow", ""),
        ("join", "leave", ""),
        ("push", "pull", ""),
        ("fill", "empty", ""),
        ("heat warm", "cool chill", ""),
        ("show", "hide", ""),
        ("earlier", "later", ""),
        ("on", "off", "turn switch light power"),
        ("up", "down", "turn volume heat roll"),
    )
]
"""Opposites; the third set, if any, has words of which the goal must have one."""

_REVERSES = re.compile(
    r"\b(?:revers|revert|undo|undid|reject|restor|withdr[ae]w)\w*"
    r"|\breturn (?:it|them|this|that|the|my)\b"
    r"|\b(?:bring|change|get|give|go|hand|have|move|pull|put|send|switch|take)\b"
    r"(?! you\b)(?:\s[\w'-]+){0,5} back\b"
)
"""Undoes what was done, whatever it was."""

_TOO = [
    (re.compile(rf"\b(?:too (?:{much})|{other})\b"), plainer)
    for much, other, plainer in (
        ("big|large|high|much|many|long|fast|loud|bright|warm|hot", "(?!)", "smaller"),
        ("small|little|low|few|short|slow|quiet|dark|dim|cold|cool", "not enough", "bigger"),
    )
]
"""Things that are "too big" are to be smaller."""

_PREFIXES = ("un", "dis")
_WAY = re.compile(r"\b(to|from) (?:(?:the|my|our|your|his|her|their|an?) )?([\w'-]+)")
_CLAUSES = re.compile(r"[.,;:!?]+(?: |$)|\b(?:and|but|then)\b")


def opposes(utterance: str, goal: Goal) -> bool:
    """Whether words seem to ask for the opposite of a goal.

    Of two opposites the goal has one, and the last clause that has either has the other ("smaller"
    for a bigger plan, "unblock" for blocking); or a clause undoes something, or reverses a
    direction ("from Anna" for a transfer to Anna).
    """
    aim = normalize(goal.text)
    words, ways = _bases(aim), {*_WAY.findall(aim)}
    pairs = [
        (own, other)
        for one, two, where in _PAIRS
        if not where or where & words
        for own, other in ((one, two), (two, one))
        if own & words and not other & words
    ]
    pairs += [(frozenset({word}), _negated(word)) for word in words if len(word) > 3]
    turned = {("from" if way == "to" else "to", where) for way, where in ways} - ways
    text = normalize(utterance)
    for said, plainer in _TOO:
        text = said.sub(plainer, text)
    clauses = _CLAUSES.split(text)
    back = not _REVERSES.search(aim) and any(map(_REVERSES.search, clauses))
    if back or any(turned.intersection(_WAY.findall(clause)) for clause in clauses):
        return True
    found = [_bases(clause) for clause in clauses]
    sides = ([own & each for each in found if (own | other) & each][-1:] for own, other in pairs)
    return any(side and not side[0] for side in sides)


def _bases(text: str) -> frozenset[str]:
    """The words of a text and their possible stems."""
    found: set[str] = set()
    for word in re.findall(r"[a-z]+", text):
        stems = {word, *(word.removesuffix(end) for end in ("s", "es", "d", "ed", "ing"))}
        stems |= {stem[:-1] for stem in stems if stem[-2:-1] == stem[-1:]}
        found |= stems | {f"{stem}e" for stem in stems}
    return frozenset(found)


def _negated(word: str) -> frozenset[str]:
    """A word with a negating prefix, or without the one that it has."""
    bare = {word.removeprefix(each) for each in _PREFIXES} - {word}
    return frozenset({f"{each}{word}" for each in _PREFIXES} | {b for b in bare if len(b) > 3})
