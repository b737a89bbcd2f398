"""Who takes part in a study, and what they said."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

__all__ = ["Answer", "Participant"]


@dataclass(frozen=True, slots=True)
class Answer:
    """An item that a participant has been given, and what they said of it.

    Attributes:
        item: Its number in the store.
        place: In the participant's order, from 1.
        rating: 0 to 3; None while there is none.
        explanation: Why.
        revision: How often it was said anew; 0 while there is no rating.
        opened: When it was first seen, in UTC, ISO 8601.
        answered: When the first rating came.
        episode: Of the item.
    """

    item: int
    place: int
    rating: int | None
    explanation: str
    revision: int
    opened: str | None
    answered: str | None
    episode: str

    @property
    def seconds(self) -> float | None:
        """From the first sight to the first rating."""
        if self.opened is None or self.answered is None:
            return None
        between = datetime.fromisoformat(self.answered) - datetime.fromisoformat(self.opened)
        return between.total_seconds()


@dataclass(frozen=True, slots=True)
class Participant:
    """Somebody who has agreed to take part.

    Attributes:
        number: In the store, counted over all studies.
        external: The id in their link.
        joined: When they agreed, in UTC, ISO 8601.
        answers: In the order of their items.
    """

    number: int
    external: str
    joined: str
    answers: tuple[Answer, ...]

    @property
    def finished(self) -> bool:
        """Whether all items have a rating."""
        return all(each.rating is not None for each in self.answers)
