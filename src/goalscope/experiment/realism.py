"""How like real people simulated ones talk: how much, how, and how likely real words are."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from goalscope.agent.guards import SAY_YES
from goalscope.agent.people import Habit, person_prompt
from goalscope.base.optional_packages import package
from goalscope.base.types import GoalscopeError
from goalscope.datasets.case import Case
from goalscope.experiment.results import Results
from goalscope.experiment.summary import (
    NO_INTERVAL,
    Columns,
    Record,
    Table,
    average,
    count,
    rows_of,
)
from goalscope.models import LikelihoodModel, Roles, model_name
from goalscope.models.opening import model_label

_INTERVALS = f"Intervals are 95 %, by a bootstrap over people. {NO_INTERVAL}"
NOTES = (
    "Words: the number in a turn. From real: by how many words, in the mean, each turn would have "
    "to change until lengths are as real people's (Wasserstein distance). Questions: turns with a "
    "question mark. Goal's words: share of a turn's words that stand in what the person is told of "
    'themselves, or in the real person\'s goal, without words such as "the". Who recites it has a '
    "high share; what people are told is longer than a goal, so compare them with one another.",
    _INTERVALS,
)
PROMPT_NOTES = (
    "How unlikely the real people's turns are by the prompt that plays this person, who is told "
    "the real goal, after the real talk so far. The fewer nats, the more like real people.",
    _INTERVALS,
)

_WORD = re.compile(r"[^\W_]+(?:['-][^\W_]+)*")


@dataclass(frozen=True, slots=True)
class Talk:
    """What one person said.

    Attributes:
        person: Whose talks are alike, such as all who are "terse" by one model.
        group: Talks of one group share a person.
        goal: What the person is told of themselves, or wants.
        said: Their turns.
    """

    person: str
    group: str
    goal: str
    said: tuple[str, ...]


def simulated_talks(results: Results) -> list[Talk]:
    """What models said as people in the episodes that an experiment measured.

    What a profile scripts is left out: scripted people, and answers to requests to confirm.
    """
    return [
        Talk(
            f"{cell.spec['settings']['human']}, {model_label(cell.spec['model'])}",
            cell.spec["profile"],
            cell.result["description"],
            tuple(
                round.turn.utterance
                for round in results.rounds(cell.result["episode"])
                if not round.turn.query.endswith(SAY_YES)
            ),
        )
        for cell in results.asked_for()
        if cell.spec["kind"] == "episode"
        and cell.spec["settings"]["human"] != "scripted"
        and cell.result
    ]


def nats_per_word(
    model: LikelihoodModel, cases: Sequence[Case], habit: Habit | None
) -> list[Record]:
    """For each case, how unlikely its turns are by the prompt of a person with a habit."""
    scorer = model.scorer if isinstance(model, Roles) else model
    records: list[Record] = []
    for case in cases:
        contexts = [
            person_prompt(
                scorer,
                task=case.task,
                description=f"You want this: {case.true_goal.text}",
                habit=habit,
                turns=case.turns[:t],
                query=turn.query,
            )
            for t, turn in enumerate(case.turns)
        ]
        said = [turn.utterance for turn in case.turns]
        nats = -sum(float(each.sum()) for each in scorer.token_logprobs(contexts, said))
        words = sum(len(words_of(text)) for text in said)
        records.append({"group": case.group, "nats": nats / max(words, 1)})
    return records


def words_of(text: str) -> list[str]:
    """The words, in lower case."""
    return _WORD.findall(text.casefold())


def realism_table(simulated: Sequence[Talk], name: str, cases: Sequence[Case]) -> Table:
    """A row for the real people, and for each kind of simulated ones.

    Args:
        simulated: Their talks.
        name: Of the real ones.
        cases: What those said.
    """
    real = f"real: {name}"
    talks = [
        Talk(real, case.group, case.true_goal.text, tuple(turn.utterance for turn in case.turns))
        for case in cases
    ]
    talks += simulated
    records = {
        kind: [each for talk in talks if talk.person == kind for each in _records(talk)]
        for kind in dict.fromkeys(talk.person for talk in talks)
    }
    lengths = [each["words"] for each in records[real]]
    columns: tuple[Columns, ...] = (
        lambda found: {"people": len({each["group"] for each in found})},
        count("turns"),
        average("words", "words"),
        lambda found: {"from real": _distance([each["words"] for each in found], lengths)},
        average("questions", "asks", "percent"),
        average("goal's words", "shared", "percent"),
    )
    rows = rows_of([({"who": kind}, found) for kind, found in records.items()], columns)
    return Table(f"realism-{name}", f"How like real people: {name}", rows, NOTES)


def prompt_table(name: str, cases: Sequence[Case], model: LikelihoodModel) -> Table:
    """How likely the real people's words are by the prompt of each kind of person.

    Args:
        name: Of the real people.
        cases: What they said.
        model: Plays the people.
    """
    habits: tuple[Habit | None, ...] = (None, *get_args(Habit))
    groups = [
        ({"person": each or "simulated"}, nats_per_word(model, cases, each)) for each in habits
    ]
    rows = rows_of(groups, [count("dialogues"), average("nats per word", "nats")])
    title = f"How likely real words are by each person's prompt: {name}, {model_name(model)}"
    return Table(f"realism-{name}-prompts", title, rows, PROMPT_NOTES)


def _records(talk: Talk) -> Iterator[Record]:
    common = package("sklearn.feature_extraction.text", "Statistics need", GoalscopeError)
    goal = {*words_of(talk.goal)} - common.ENGLISH_STOP_WORDS
    for text in talk.said:
        words = words_of(text)
        yield {
            "group": talk.group,
            "words": len(words),
            "asks": float("?" in text),
            "shared": float(np.mean([word in goal for word in words])) if words else 0.0,
        }


def _distance(some: Sequence[int], real: Sequence[int]) -> float:
    stats = package("scipy.stats", "Statistics need", GoalscopeError)
    return float(stats.wasserstein_distance(some, real))
