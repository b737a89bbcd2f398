"""Orders that name an aim, and leave open what is to be done with what: "tidy up"."""

from __future__ import annotations

import re

from goalscope.envs.house.names import naming
from goalscope.envs.house.simulator.object_types import object_type

__all__ = ["is_aim"]

_MEAL = r"(?:dinner|lunch|breakfast|supper|brunch|tea|food|something|anything|everything)"
_OUR = r"(?:the|an?|my|our|your|this|some|these|those)"
_ROOM = (
    r"(?:kitchen|bath ?room|bed ?room|living ?room|room|house|home|place|flat|apartment|mess"
    r"|table|counter|desk|floor)"
)
_AIM = re.compile(
    r"(?:tidy|declutter|organi[sz]e|(?:re)?arrange|decorate|straighten|neaten|clear|sort|prepare"
    r"|help)\b.*"
    rf"|clean(?: up)?(?: {_OUR} (?:\w+ )?{_ROOM})?(?: up)?"
    rf"|(?:make|cook|serve)(?: me| us| him| her| them)? (?:{_OUR}|{_MEAL})\b.*"
    r"|set(?: up)? (?:(?!(?:on|in|off|to|fire|free)\b)\w+(?: |$))+"
    rf"|lay {_OUR} \w+(?: for .*)?"
    r"|get (?:\w+ ){1,3}ready\b.*"
    r"|(?:bring|get|give|fetch|find|hand|grab)(?: me| us)? (?:something|anything)\b.*"
    rf"|do {_OUR} (?:\w+ )?(?:laundry|chores?|housework|cleaning|tidying|cooking|dishes|washing)"
    r"\b.*"
)
_CLEARS = re.compile(
    r"(?:tidy|declutter|organi[sz]e|(?:re)?arrange|straighten|neaten|clear|sort)"
    rf"(?: up| off| out| away)? {_OUR} (?P<piece>[a-z ]{{1,40}}?)(?: up| off| out)?"
    r"(?:,? (?:please|now|(?:for|of|from) .*))?"
)
"""An order to clear something, which may be a piece of furniture."""


def is_aim(said: str) -> bool:
    """Whether an order, without what leads to it, leaves open how it is to be met.

    "Set the table" and "make me a sandwich" do; "set the house on fire" and "make me fly" do not,
    nor does "clear the sofa": that is about what is on it, and nothing else may be guessed for it.
    """
    clears = _CLEARS.fullmatch(said)
    return bool(_AIM.fullmatch(said)) and not (clears and _is_furniture(clears["piece"].split()))


def _is_furniture(words: list[str]) -> bool:
    """Whether the last of the words name what things stand on."""
    found = (naming(words, i) for i in range(len(words)))
    named = next((each for each in found if each and each.end == len(words)), None)
    flags = [object_type(kind).flags for kind in named.types] if named else []
    return bool(flags) and all("receptacle" in f and "pickupable" not in f for f in flags)
