"""`goalscope episodes`, `replay` and `why`: look at stored episodes."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from goalscope.base.text import domain_shown, model_shown
from goalscope.base.types import InvalidInputError, pluralize
from goalscope.cli.options import Json, StoreFile
from goalscope.cli.terminal import console, say

if TYPE_CHECKING:
    from goalscope.base.types import Goal
    from goalscope.belief.belief import Belief
    from goalscope.storage.store import EpisodeInfo, Store

Episode = Annotated[str, typer.Argument(help="Id of the episode, or its first characters.")]


def episodes(
    text: Annotated[
        str,
        typer.Option(help="Only those in which this was said, or whose id or options hold it."),
    ] = "",
    domain: Annotated[
        str | None, typer.Option(help="Only those of this domain, such as grocery.")
    ] = None,
    store: StoreFile = None,
    as_json: Json = False,
) -> None:
    """List the stored episodes, each with what the person said first."""
    from goalscope.cli.display import show_episodes
    from goalscope.storage.store import Store

    with Store.open(store, new=False) as opened:
        infos = opened.episodes(text=text)
    if domain is not None:
        infos = [info for info in infos if domain_shown(info.domain) == domain_shown(domain)]
    if as_json:
        print(json.dumps([asdict(info) | {"model": model_shown(info.model)} for info in infos]))
    elif not infos and (text or domain):
        say(f"No stored episode fits. `{opened.command('episodes')}` lists them all.")
    elif not infos:
        say(f"There are no episodes yet. `{opened.command('chat')}` starts one.")
    else:
        show_episodes(console(), infos)


def replay(id: Episode, store: StoreFile = None, as_json: Json = False) -> None:
    """Show a stored episode round by round; no model is needed.

    As JSON, each round has its words, actions, notes, and the belief: goals, log_prior,
    log_likelihood (a row for each turn, nats), and the probability of each goal. The method
    no-inference has no evidence (inferred is false): its log_prior holds the model's order.
    """
    from goalscope.cli.display import show_header, show_round, show_summary
    from goalscope.storage.store import Store, round_to_json

    with Store.open(store, new=False) as opened:
        info = opened.episode(id)
        rounds = opened.rounds(info.id)
        corrections = _later_corrections(opened, info)
    if as_json:
        rows = [json.loads(round_to_json(round)) for round in rounds]
        for row, round in zip(rows, rounds, strict=True):
            if round.belief.inferred:
                row["belief"]["probability"] = round.belief.probability.tolist()
        print(json.dumps({**asdict(info), "model": model_shown(info.model), "rounds": rows}))
        return
    out = console()
    show_header(out, info)
    before = None
    for round in rounds:
        show_round(out, round, before)
        before = round.belief
    if corrections:
        say(corrections)
    show_summary(out, info)


def why(
    id: Episode,
    goal: Annotated[
        str | None,
        typer.Option(help="Text of the goal, or its beginning.  [default: the likeliest]"),
    ] = None,
    round: Annotated[
        int | None,
        typer.Option(min=1, help="Explain the belief after this round.  [default: the last]"),
    ] = None,
    store: StoreFile = None,
    as_json: Json = False,
) -> None:
    """Explain why a goal is likely: the evidence of each utterance, and the belief without it.

    Evidence is in nats relative to the mean of the other goals, after calibration. An utterance
    that favours a goal can still make it less likely if another goal gains more. The belief "then"
    is over the current goals; if goals were added or removed since, the round itself showed a
    different belief, which --round explains.
    """
    from goalscope.belief.explain import reasons
    from goalscope.cli.display import show_reasons
    from goalscope.storage.store import Store, dumps

    with Store.open(store, new=False) as opened:
        info = opened.episode(id)
        rounds = opened.rounds(info.id)[:round]
        corrections = _later_corrections(opened, info) if len(rounds) == info.rounds else ""
    if not rounds or (round and len(rounds) < round):
        raise InvalidInputError(f"Episode {info.id} has only {pluralize(len(rounds), 'round')}.")
    belief = rounds[-1].belief
    if not belief.inferred:
        raise InvalidInputError(f"This episode's method, {info.method}, computes no evidence.")
    try:
        chosen = _chosen(belief, goal)
    except InvalidInputError as error:
        raise InvalidInputError(f"{error} {corrections}") from None
    found = reasons(belief, [each.turn for each in rounds], chosen)
    if as_json:
        told = {
            "goal": chosen.text,
            "reasons": [asdict(each) for each in found],
            "confirmed": [{"goal": each.text, "turn": turns} for turns, each in belief.pinned],
        }
        print(dumps(told))
    else:
        show_reasons(console(), chosen, found, pinned=belief.pinned)
    if corrections:
        say(corrections, stderr=True)


def _later_corrections(store: Store, info: EpisodeInfo) -> str:
    """The corrections since the last round, and where they take effect; "" if there are none."""
    from goalscope.storage.session import resuming

    words = {"pin": 'it is "{}"', "veto": 'it is not "{}"', "reword": '"{}" means "{}"'}
    said = [
        words[correction].format(goal, text)
        for correction, goal, text in store.corrections(info.id, info.rounds)
    ]
    if not said:
        return ""
    return (
        f"Corrected since the last round: {'; '.join(said)}. `{resuming(store, info)}` shows the "
        "corrected belief, and /why NUMBER explains it."
    )


def _chosen(belief: Belief, text: str | None) -> Goal:
    """The goal whose text begins with `text`.

    Raises:
        InvalidInputError: It means none or several.
    """
    if text is None:
        return belief.top(1)[0][0]
    wanted = text.casefold()
    known = [each for each in belief.goals if each.text.casefold() == wanted]
    known = known or [each for each in belief.goals if each.text.casefold().startswith(wanted)]
    if len(known) != 1:
        for each in belief.goals:
            say(f"- {each.text}", stderr=True)
        what = "Several of these goals begin" if known else "None of these goals begins"
        raise InvalidInputError(f"{what} with {text!r}.")
    return known[0]
