"""Every answer of a study as CSV."""

from __future__ import annotations

import csv
import io

from goalscope.experiment.summary import inert
from goalscope.store import Store
from goalscope.study.store import Study, StudyStore

__all__ = ["as_csv"]

COLUMNS = (
    "study", "participant", "external_id", "joined", "finished", "place", "item", "episode",
    "domain", "profile", "method", "state_score", "rating", "explanation", "revision", "opened",
    "answered", "seconds",
)  # fmt: skip


def as_csv(store: Store, study: Study, *, ids: bool = True) -> str:
    """One line for each answer, those of people who have not finished, too.

    Args:
        store: Holds the study.
        study: Which one.
        ids: Whether the ids in people's links are told.
    """
    book = StudyStore(store)
    infos = {id: store.episode(id) for id in book.items(study).values()}
    file = io.StringIO(newline="")
    writer = csv.writer(file)
    writer.writerow(COLUMNS)
    for each in book.participants(study):
        person = (each.number, each.external if ids else None, each.joined, each.finished)
        for answer in each.answers:
            info = infos[answer.episode]
            line = (
                study.plan.name, *person, answer.place, answer.item, info.id, info.domain,
                info.profile, info.method, info.score, answer.rating, answer.explanation,
                answer.revision, answer.opened, answer.answered, answer.seconds,
            )  # fmt: skip
            writer.writerow([inert(cell) if isinstance(cell, str) else cell for cell in line])
    return file.getvalue()
