"""Who takes part in a study, what they said, and whose ratings count."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from statistics import median

from goalscope.study.plan import Exclusion
from goalscope.types import counted, meaning

__all__ = ["Answer", "Participant", "excluded"]


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
        expected: The right rating of a check; None of an episode.
        episode: Its id; None of a check.
    """

    item: int
    place: int
    rating: int | None
    explanation: str
    revision: int
    opened: str | None
    answered: str | None
    expected: int | None
    episode: str | None

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
        external: How a recruiting service names them.
        joined: When they agreed, in UTC, ISO 8601.
        answers: In the order of their items.
    """

    number: int
    external: str | None
    joined: str
    answers: tuple[Answer, ...]

    @property
    def finished(self) -> bool:
        """Whether all items have a rating."""
        return all(each.rating is not None for each in self.answers)


def excluded(participant: Participant, rules: Exclusion) -> tuple[str, ...]:
    """Why the ratings of somebody who has finished do not count; nothing where they do."""
    answers = participant.answers
    checks = [each for each in answers if each.expected is not None]
    failed = sum(each.rating != each.expected for each in checks)
    seconds = [each.seconds for each in answers if each.seconds is not None]
    reasons: list[str] = []
    if rules.failed_checks and failed >= rules.failed_checks:
        reasons.append(f"failed {failed} of {counted(len(checks), 'check')}")
    episodes = [each for each in answers if each.expected is None]
    if len(episodes) > 1:  # what a check asks for tells nothing of how somebody rates
        if rules.same_rating and len({each.rating for each in episodes}) == 1:
            reasons.append("the same rating everywhere")
        if rules.same_explanation and len({meaning(each.explanation) for each in episodes}) == 1:
            reasons.append("the same explanation everywhere")
    if rules.min_seconds and seconds and median(seconds) < rules.min_seconds:
        reasons.append(f"a median of {median(seconds):.1f} seconds an item")
    return tuple(reasons)
