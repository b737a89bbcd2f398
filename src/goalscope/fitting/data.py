"""Dialogues for training an adapter, and for validating it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import chain, zip_longest

from goalscope.base.types import InvalidInputError
from goalscope.datasets import Case, said_key
from goalscope.datasets.goal_sets import chance
from goalscope.datasets.sources import Source


def parted(
    sources: Sequence[Source], *, validation: int, seed: int, learned: Collection[str] = ()
) -> tuple[list[list[Case]], list[Case]]:
    """Split groups of dialogues into training, by source, and validation.

    Args:
        sources: At least one.
        validation: Maximum number of validation dialogues: the same number from each source, from
            at most a third of its groups.
        seed: Seed of the split.
        learned: Keys (`said_key`) of dialogues used for training before; their groups are not used
            for validation.

    Raises:
        InvalidInputError: A source has a single group, all its groups are validation for another
            source, or none is left for validation.
    """
    each = -(-validation // len(sources))
    held: set[tuple[str, str]] = set()
    lists: list[list[Case]] = []
    for source in sources:
        groups = sorted({case.group for case in source.cases})
        if len(groups) < 2:
            raise InvalidInputError(
                f"All dialogues of {source.name} are in one group, but training and "
                "validation need different groups. Add dialogues of another group."
                if len(source.cases) > 1
                else f"{source.name} has a single dialogue, but training and validation need one "
                "each. Add another one."
            )
        known = {case.group for case in source.cases if said_key(case.turns) in learned}
        chance(seed, source.name).shuffle(groups)
        most = max(1, len(groups) // 3)
        fresh = [group for group in groups if group not in known][:most]
        own = [case for case in source.cases if case.group in fresh]
        chance(seed, f"validation {source.name}").shuffle(own)
        new = {case.id: case for case in own if (source.sha256, case.group) not in held}
        lists.append([*new.values()][:each])
        held |= {(source.sha256, case.group) for case in lists[-1]}
    if not any(lists):
        raise InvalidInputError(
            "The adapter to start from was fitted on all these dialogues, so none is left "
            "for validation. Use other dialogues, or --start none."
        )
    train = [
        [case for case in source.cases if (source.sha256, case.group) not in held]
        for source in sources
    ]
    for source, own in zip(sources, train, strict=True):
        if not own:
            raise InvalidInputError(
                f"All dialogues of {source.name} are already validation for another part of "
                "the same file. Use each dialogue only once."
            )
    turns = chain.from_iterable(zip_longest(*lists))
    return train, [case for case in turns if case is not None][:validation]
