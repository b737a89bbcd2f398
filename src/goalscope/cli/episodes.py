"""`goalscope episodes`, `replay` and `why`: look at stored episodes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from goalscope.base.types import GoalscopeError, InvalidInputError, pluralize
from goalscope.cli.options import Json, StoreFile
from goalscope.cli.terminal import console, settings_model

if TYPE_CHECKING:
    from rich.console import Console

    from goalscope.agent.round import Round
    from goalscope.base.types import Goal, Turn
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
    from goalscope.base.text import domain_shown, model_shown
    from goalscope.cli.display import show_episodes
    from goalscope.storage.store import Store

    with Store.open(store, new=False) as opened:
        infos = opened.episodes(text=text)
    if domain is not None:
        infos = [info for info in infos if domain_shown(info.domain) == domain_shown(domain)]
    if as_json:
        print(json.dumps([asdict(info) | {"model": model_shown(info.model)} for info in infos]))
    elif not infos and (text or domain):
        console().print("No stored episode fits. `goalscope episodes` lists them all.")
    else:
        show_episodes(console(), infos)


def replay(id: Episode, store: StoreFile = None, as_json: Json = False) -> None:
    """Show a stored episode round by round; no model is needed.

    As JSON, each round has its words, actions, notes, and the belief: goals, log_prior,
    log_likelihood (a row for each turn, nats), and the probability of each goal. The method
    no-inference has no evidence (inferred is false): its log_prior holds the model's order.
    """
    from goalscope.base.text import terminal_safe
    from goalscope.cli.display import show_header, show_round, show_summary
    from goalscope.storage.store import Store

    out = console()
    with Store.open(store, new=False) as opened:
        info = opened.episode(id)
        rounds = opened.rounds(info.id)
        corrections = _later_corrections(opened, info)
    if as_json:
        print(json.dumps(_episode_json(info, rounds)))
        return
    show_header(out, info)
    before = None
    for round in rounds:
        show_round(out, round, before)
        before = round.belief
    if corrections:
        out.print(terminal_safe(corrections), soft_wrap=True)
    if info.profile and info.score is not None:
        _show_checks_again(out, info, rounds)
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
    words: Annotated[
        bool,
        typer.Option(
            "--words", help="Also show the evidence of each word, for which the model scores again."
        ),
    ] = False,
    store: StoreFile = None,
    as_json: Json = False,
) -> None:
    """Explain why a goal is likely: the evidence of each utterance, and the belief without it.

    Evidence is in nats relative to the mean of the other goals, after calibration. An utterance
    that favours a goal can still make it less likely if another goal gains more. The belief "then"
    is over the current goals; if goals were added or removed since, the round itself showed a
    different belief, which --round explains.
    """
    from goalscope.base.text import terminal_safe
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
    turns = [each.turn for each in rounds]
    try:
        chosen = _chosen(belief, goal)
    except InvalidInputError as error:
        raise InvalidInputError(f"{error} {corrections}") from None
    found = reasons(belief, turns, chosen)
    evidence = _word_evidence(info, belief, turns, chosen) if words else []
    if as_json:
        told: dict[str, Any] = {
            "goal": chosen.text,
            "reasons": [asdict(each) for each in found],
            "confirmed": [{"goal": each.text, "turn": turns} for turns, each in belief.pinned],
        }
        print(dumps({**told, "words": evidence} if words else told))
    else:
        show_reasons(console(), chosen, found, evidence, pinned=belief.pinned)
    if corrections:
        console(stderr=True).print(terminal_safe(corrections), soft_wrap=True)


def _episode_json(info: EpisodeInfo, rounds: Sequence[Round]) -> dict[str, Any]:
    """An episode and its rounds, with the probabilities of each belief."""
    from goalscope.base.text import model_shown
    from goalscope.storage.store import round_to_json

    rows: list[dict[str, Any]] = []
    for round in rounds:
        row = json.loads(round_to_json(round))
        if round.belief.inferred:
            row["belief"]["probability"] = round.belief.probability.tolist()
        rows.append(row)
    return {**asdict(info), "model": model_shown(info.model), "rounds": rows}


def _show_checks_again(out: Console, info: EpisodeInfo, rounds: Sequence[Round]) -> None:
    """Replay the stored actions in goalscope's shop or room, and show which checks they meet."""
    from goalscope.agent.planner import undo
    from goalscope.agent.settings import settings_of
    from goalscope.base.text import terminal_safe
    from goalscope.cli.display import show_checks
    from goalscope.envs.registry import (
        BUILT_IN,
        domain_named,
        open_environment,
        profile_named,
    )

    settings = settings_of(info.settings)
    if settings.domain not in BUILT_IN or not domain_named(settings.domain).replays(settings):
        return  # other people's code is not run to look at something
    try:
        person = profile_named(settings, info.profile or "")
        env = open_environment(settings, person)
        undo(env, [result for round in rounds for result in round.results])
        met = env.checks_met(person).met
        if not met or sum(met) / len(met) != info.score:
            raise InvalidInputError("The catalogue, the scene or the profile has changed since.")
        show_checks(out, person.checks, met)
    except GoalscopeError as error:
        out.print(
            terminal_safe(f"Cannot show which checks were met: {error}", "dim"), soft_wrap=True
        )


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
        f"Corrected since the last round: {'; '.join(said)}. `{resuming(info)}` shows the "
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
        from goalscope.base.text import terminal_safe

        for each in belief.goals:
            console(stderr=True).print(terminal_safe(f"- {each.text}"), soft_wrap=True)
        what = "Several of these goals begin" if known else "None of these goals begins"
        raise InvalidInputError(f"{what} with {text!r}.")
    return known[0]


def _word_evidence(
    info: EpisodeInfo, belief: Belief, turns: list[Turn], goal: Goal
) -> list[list[tuple[str, float]]]:
    """Print the evidence of each word of each turn."""
    from goalscope.agent.settings import likelihood_for, settings_of
    from goalscope.belief.explain import word_evidence
    from goalscope.belief.likelihood import RolePlay

    settings = settings_of(info.settings)
    if settings.likelihood:
        raise InvalidInputError(
            f"The likelihood {settings.likelihood} scores whole utterances, not words. Leave out "
            "--words."
        )
    with settings_model(settings) as engine:
        likelihood = likelihood_for(settings, engine)
        assert isinstance(likelihood, RolePlay)
        return [
            word_evidence(likelihood, info.task, belief, turns[:end], goal)
            for end in range(1, len(turns) + 1)
        ]
