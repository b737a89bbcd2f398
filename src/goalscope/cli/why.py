"""`goalscope why`, and what a person at the terminal may say of the goals themselves."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from goalscope.cli.options import Json, StoreFile
from goalscope.cli.settings import engine_of
from goalscope.cli.terminal import console
from goalscope.types import Goal, InvalidInputError, checked_text, pluralize

if TYPE_CHECKING:
    from rich.console import Console

    from goalscope.belief import Belief
    from goalscope.session import Session
    from goalscope.store import EpisodeInfo, Store
    from goalscope.tracker import Correction
    from goalscope.types import Turn

__all__ = ["correct", "said_since", "why"]

HELP = """\
/goals               the goals, numbered
/pin NUMBER|TEXT     it is this goal, perhaps a new one
/veto NUMBER         it is not this one, and it shall not come back
/reword NUMBER TEXT  it is this one, in other words
/why NUMBER          what each of your sentences says for it"""

ORDER_HELP = """\
/goals               the goals, as the model orders them
This method weighs no evidence that could be corrected or explained."""

NO_HELP = "This method holds no belief that could be shown or corrected."

LEAVING = """
/help                this
quit                 leave; you can go on later"""


def why(
    id: Annotated[str, typer.Argument(help="The episode, or how its id begins.")],
    goal: Annotated[
        str | None, typer.Option(help="The goal, or how it begins.  [default: the likeliest]")
    ] = None,
    round: Annotated[
        int | None, typer.Option(min=1, help="After this round.  [default: the last]")
    ] = None,
    words: Annotated[
        bool, typer.Option("--words", help="Also word by word; the model scores again for it.")
    ] = False,
    store: StoreFile = None,
    as_json: Json = False,
) -> None:
    """Say why a goal is likely: what each utterance says for it, and what if it had not been said.

    Evidence is in nats against the mean of the other goals, as it counts after calibration. Words
    that speak for a goal can still make it less likely, as another goal gains more. The belief
    "then" is over the goals of now: where goals came or went since, the round itself showed
    another, which --round explains.
    """
    from goalscope.display import show_reasons
    from goalscope.rounds_json import dumps
    from goalscope.safe_text import terminal_safe
    from goalscope.store import Store
    from goalscope.why import reasons

    with Store.open(store, new=False) as episodes:
        info = episodes.episode(id)
        rounds = episodes.rounds(info.id)[:round]
        since = said_since(episodes, info) if len(rounds) == info.rounds else ""
    if not rounds or (round and len(rounds) < round):
        raise InvalidInputError(f"Episode {info.id} has {pluralize(len(rounds), 'round')}.")
    belief = rounds[-1].belief
    if belief is None or info.method != "good":
        raise InvalidInputError(f"The method {info.method} of this episode weighs no evidence.")
    turns = [each.turn for each in rounds]
    try:
        chosen = _chosen(belief, goal)
    except InvalidInputError as error:
        raise InvalidInputError(f"{error} {since}") from None
    found = reasons(belief, turns, chosen)
    said = _words(info, belief, turns, chosen) if words else []
    if as_json:
        told: dict[str, Any] = {
            "goal": chosen.text,
            "reasons": [asdict(each) for each in found],
            "confirmed": [{"goal": each.text, "turn": turns} for turns, each in belief.pinned],
        }
        print(dumps({**told, "words": said} if words else told))
    else:
        show_reasons(console(), chosen, found, said, pinned=belief.pinned)
    if since:
        console(stderr=True).print(terminal_safe(since), soft_wrap=True)


def said_since(store: Store, info: EpisodeInfo) -> str:
    """What a person said of the goals after the last round, and where it counts; "" if nothing."""
    from goalscope.session import resuming

    words = {"pin": 'it is "{}"', "veto": 'it is not "{}"', "reword": '"{}" means "{}"'}
    said = [
        words[correction].format(goal, text)
        for correction, goal, text in store.corrections(info.id, info.rounds)
    ]
    if not said:
        return ""
    return (
        f"Corrected since the last round: {'; '.join(said)}. `{resuming(info)}` shows the belief "
        "with that, and /why NUMBER there explains it."
    )


def correct(out: Console, session: Session, words: str) -> None:
    """Do what a line that begins with a slash says of the goals, and show the belief."""
    from goalscope.display import show_belief, show_reasons
    from goalscope.safe_text import terminal_safe
    from goalscope.why import reasons

    command, _, rest = words.strip().partition(" ")
    try:
        belief, order = session.belief, session.info.method == "no-inference"
        if command == "/help":
            told = NO_HELP if belief is None else ORDER_HELP if order else HELP
            raise InvalidInputError(told + LEAVING)
        if command not in ("/goals", "/pin", "/veto", "/reword", "/why"):
            raise InvalidInputError(f"There is no command {command}. /help shows those there are.")
        if belief is None:
            raise InvalidInputError(NO_HELP)
        if order and command != "/goals":
            raise InvalidInputError(ORDER_HELP)
        if command == "/pin" and rest.strip() and not rest.strip().isdecimal():
            session.correct("pin", Goal(checked_text(rest, "goal")))
        elif command != "/goals":
            number, _, text = rest.strip().partition(" ")
            goal = _numbered(belief, number, command)
            if command == "/why":
                found = reasons(belief, session.turns, goal)
                show_reasons(out, goal, found, pinned=belief.pinned)
                return
            corrections: dict[str, Correction] = {
                "/pin": "pin",
                "/veto": "veto",
                "/reword": "reword",
            }
            session.correct(corrections[command], goal, text)
        show_belief(out, session.belief or belief, belief, order=order)
    except InvalidInputError as error:
        out.print(terminal_safe(str(error), "dim"))


def _numbered(belief: Belief, number: str, command: str) -> Goal:
    """The goal of a number that `show_belief` gives it.

    Raises:
        InvalidInputError: There is none.
    """
    ranked = belief.top()
    if number.isdecimal() and 1 <= int(number) <= len(ranked):
        return ranked[int(number) - 1][0]
    words = ", or in your own words" if command == "/pin" else ""
    raise InvalidInputError(
        f"Name a goal by its number, 1 to {len(ranked)}{words}; /goals shows them."
    )


def _chosen(belief: Belief, text: str | None) -> Goal:
    """The goal that is meant.

    Raises:
        InvalidInputError: None is, or several are.
    """
    if text is None:
        return belief.top(1)[0][0]
    known = [each for each in belief.goals if each.text.casefold() == text.casefold()]
    known = known or [
        each for each in belief.goals if each.text.casefold().startswith(text.casefold())
    ]
    if len(known) != 1:
        from goalscope.safe_text import terminal_safe

        for each in belief.goals:
            console(stderr=True).print(terminal_safe(f"- {each.text}"), soft_wrap=True)
        what = "Several of these goals begin" if known else "None of these goals begins"
        raise InvalidInputError(f"{what} with {text!r}.")
    return known[0]


def _words(
    info: EpisodeInfo, belief: Belief, turns: list[Turn], goal: Goal
) -> list[list[tuple[str, float]]]:
    """Of each turn, each word with its evidence."""
    from goalscope.domains import roleplay_of, settings_of
    from goalscope.why import word_evidence

    settings = settings_of(info.settings)
    with engine_of(settings) as engine:
        likelihood = roleplay_of(settings, engine)
        return [
            word_evidence(likelihood, info.task, belief, turns[:end], goal)
            for end in range(1, len(turns) + 1)
        ]
