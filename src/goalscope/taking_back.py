"""Undoing what a person takes back, from the record of what was said and done."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import shorten

from goalscope.envs import Environment, taken
from goalscope.envs.remarks import is_remark
from goalscope.envs.speech import agrees, is_question
from goalscope.envs.undoing import ALL, undoes
from goalscope.episode import Round
from goalscope.types import Action, StepResult, TakenBack, Turn

__all__ = [
    "AT_ONCE",
    "IDLE",
    "NOTHING",
    "NOT_HERE",
    "NOT_PLAIN",
    "TakingBack",
    "gone",
    "heard",
    "take_back",
]

NOT_HERE = "I cannot take anything back here. Please say what is to change."
"""A round's note where the environment undoes nothing."""

NOT_PLAIN = 'I did nothing for that. To take something back, say "Undo that" by itself.'
"""A round's note where it is not plain what is to be taken back."""

AT_ONCE = "You took that back at once, so I did nothing."
"""A round's note where words take back themselves."""

NOTHING = "There is nothing that I can take back. Please say what is to change."
"""A round's note where nothing was said that could be taken back."""

IDLE = "Nothing had been done for it. Say it again for what came before."
"""A round's note where what is taken back had led to nothing."""

_LASTING = "That cannot be undone."
_QUOTED = 8
"""Most utterances that a note quotes."""
_LONGEST = 100
"""Characters of one."""


@dataclass(frozen=True, slots=True)
class TakingBack:
    """What came of words that take others back.

    Attributes:
        rounds: Numbers of the rounds that are taken back, the newest first.
        results: What was done for that, in order.
        failed: What was tried and could not be done.
        notes: What the person should be told.
    """

    rounds: tuple[int, ...] = ()
    results: tuple[StepResult, ...] = ()
    failed: tuple[StepResult, ...] = ()
    notes: tuple[str, ...] = ()


def gone(rounds: Sequence[Round]) -> set[int]:
    """Numbers of the rounds that later ones take back."""
    return {number for round in rounds for number in round.takes_back}


def heard(rounds: Sequence[Round], *newest: Turn, away: Sequence[int] = ()) -> list[Turn]:
    """What an environment hears of a conversation: what is taken back as `TakenBack`.

    So is what is said along with words of which it is not plain what they take back. Words that
    only took others back are left out, but for the newest ones.

    Args:
        rounds: The rounds so far.
        *newest: The turn after them, if there is one.
        away: Numbers of the rounds that it takes back.
    """
    turns = [*(round.turn for round in rounds), *newest]
    void = {*gone(rounds), *away}
    found: list[Turn] = []
    for number, each in enumerate(turns, start=1):
        undoing = undoes(each.utterance)
        said = undoing.rest if undoing else each.utterance
        unclear = undoing is not None and undoing.number is None
        if undoing and undoing.own:
            found.append(TakenBack(each.query, undoing.own))
        if number in void or unclear or not said:
            found += [TakenBack(each.query, said)] if said or number == len(turns) else []
        else:
            found.append(Turn(each.query, said))
    return found


def take_back(env: Environment, rounds: Sequence[Round], turn: Turn) -> TakingBack:
    """Undo what the newest words take back: what the last rounds did, guesses among it.

    Rounds that did nothing for a question, a remark or an attempt to end the task are passed over.
    """
    undoing = undoes(turn.utterance)
    if undoing is None:
        return TakingBack()
    if undoing.number == 0:
        return TakingBack(notes=() if undoing.rest else (AT_ONCE,))
    if env.reversal([], [], []) is None:
        return TakingBack(notes=(NOT_HERE,))
    if undoing.number is None:
        return TakingBack(notes=(NOT_PLAIN,))
    standing = _standing(env, rounds)
    last = standing if undoing.number == ALL else standing[-undoing.number :]
    if not last:
        return TakingBack(notes=(NOTHING,))
    numbers = tuple(round.number for round in reversed(last))
    turns = heard(rounds, turn, away=numbers)
    results, failed, left = list[StepResult](), list[StepResult](), list[str]()
    for round in reversed(last):
        before = [each for earlier in rounds[: round.number - 1] for each in earlier.results]
        before += round.results[: round.reversals]
        back = env.reversal(round.results[round.reversals :], before, turns)
        actions, sentences = back or ([], [])
        left += sentences
        done, missed = _tried(env, actions, turns)
        results += done
        failed += missed
    quoted = [_quoted([round.turn.utterance for round in last])] if results or not left else []
    told = [*quoted, *dict.fromkeys(left)]
    idle = all(len(round.results) == round.reversals for round in last)
    told += [IDLE] if idle and not left else []
    return TakingBack(numbers, tuple(results), tuple(failed), tuple(told))


def _tried(
    env: Environment, actions: Sequence[Action], turns: Sequence[Turn]
) -> tuple[list[StepResult], list[StepResult]]:
    """What was done and what could not be; one action may make room for another."""
    done: list[StepResult] = []
    while True:
        failed: list[StepResult] = []
        for action in actions:
            if env.permission(action, turns):
                failed.append(StepResult(action, False, _LASTING))
                continue
            result = taken(env, action)
            (done if result.ok else failed).append(result)
        if not failed or len(failed) == len(actions):
            return done, failed
        actions = [each.action for each in failed]


def _standing(env: Environment, rounds: Sequence[Round]) -> list[Round]:
    """The rounds that can be taken back."""
    void = gone(rounds)
    found: list[Round] = []
    for number, round in enumerate(rounds, 1):
        undoing = undoes(round.turn.utterance)
        said = undoing.rest if undoing else round.turn.utterance
        acted = len(round.results) > round.reversals
        idle = (
            not said
            or is_remark(said)
            or agrees(said)
            or is_question(said)
            or env.answer(said, [each.turn for each in rounds[:number]]) is not None
            or env.is_completion(Turn(round.turn.query, said))
        )
        if round.number not in void and (acted or not idle):
            found.append(round)
    return found


def _quoted(utterances: Sequence[str]) -> str:
    """That these words are taken back."""
    said = [shorten(each, _LONGEST, placeholder=" ...") for each in utterances[-_QUOTED:]]
    more = len(utterances) - len(said)
    quoted = "; ".join(f'"{each}"' for each in said)
    return f"Taken back: {quoted}{f', and {more} more' if more else ''}."
