"""Orders of which nothing could be made, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from textwrap import shorten

from goalscope.envs.house.hearing.aims import is_aim
from goalscope.envs.house.hearing.corrections import Corrections
from goalscope.envs.house.hearing.orders import Clause
from goalscope.envs.house.hearing.phrases import Phrase
from goalscope.envs.house.meeting import NEEDS
from goalscope.envs.house.names import are, readable, the

__all__ = ["Misses"]


@dataclass
class Misses(Corrections):
    """What stands, and what of the newest words was missed.

    Attributes:
        stuck: See `Hearing.stuck`.
    """

    stuck: bool = field(default=False, init=False)

    def miss(self, clause: Clause, things: Sequence[Phrase]) -> None:
        """Keep that nothing could be made of an order, or of a thing in it.

        Behind a thing that is not here "it" is nothing that only earlier words named.
        """
        if clause.said and clause.things and all(t.word == "unknown" for t in clause.things):
            self.forget()
        named = (*clause.things, *((clause.place,) if clause.place else ()))
        unknown = any(thing.word == "unknown" for thing in named)
        nothing = not things if clause.verb else not clause.things
        if not clause.said or clause.later or clause.negated or not (nothing or unknown):
            return
        lacks = [thing.said for thing in named if thing.word == "unknown"]
        whole = clause.verb in NEEDS and (clause.verb != "put" or clause.place)
        if whole and len(lacks) == 1 and lacks[0] and not is_aim(clause.said):
            self.missed.append(f"There {are(lacks[0])} no {lacks[0]} here.")
            self.stuck = True
            return
        self.puzzle(clause)

    def puzzle(self, clause: Clause) -> None:
        """Keep that an order was not understood, or for an aim that it must be said how."""
        aim, said = is_aim(clause.said), shorten(clause.said, 80, placeholder=" ...")
        how = ' Please say what goes where, as in "put the mug in the sink".' if aim else ""
        self.missed.append(f"I did not understand: {said}.{how}")
        self.stuck = self.stuck or not aim

    def lacking(self, clause: Clause, said: Sequence[Phrase], lacks: Phrase | None) -> None:
        """Keep why an order cannot be carried out: no such thing is here, or it is not for that."""
        if not clause.said or lacks is None:
            return
        here = [kind for kind in lacks.types if kind in self.count]
        name = the(readable((here or lacks.types or ("",))[0]))
        fresh = {kind for new in self.newest for kind in new.object_types}
        carried = clause.verb in ("put", "pick up")
        if lacks not in (*said, clause.place) and (carried or fresh.isdisjoint(here)):
            if not self.missed:
                self.puzzle(clause)
            return
        self.stuck = True
        if not here:
            self.missed.append(f"There {are(name)} no {name.removeprefix('the ')} here.")
        elif lacks is clause.place:
            self.missed.append(f"I cannot put anything in or on {name}.")
        else:
            self.missed.append(f"I cannot {'carry' if carried else clause.verb} {name}.")
