"""`goalscope chat`, `run`, `replay` and `episodes`: episodes with people, real and simulated."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from goalscope.cli.options import (
    Adapter,
    CalibrationName,
    Calls,
    Catalogue,
    Columns,
    Domain,
    EndOfTurn,
    Json,
    Layout,
    Method,
    Model,
    Picture,
    Prompted,
    Propose,
    Scene,
    Scorer,
    Seed,
    Simulator,
    StoreFile,
    Tokenizer,
    Unity,
    Writer,
)
from goalscope.cli.settings import check_picture, engine_of, settings_given
from goalscope.cli.terminal import console, spinner
from goalscope.types import GoalscopeError, InvalidInputError, pluralize

if TYPE_CHECKING:
    from rich.console import Console

    from goalscope.display import Scored
    from goalscope.domains import Settings
    from goalscope.envs import Environment
    from goalscope.episode import Round
    from goalscope.session import Session
    from goalscope.store import EpisodeInfo
    from goalscope.types import Profile

__all__ = ["chat", "episodes", "replay", "run"]


def chat(
    context: typer.Context,
    domain: Domain = "grocery",
    resume: Annotated[str | None, typer.Option(metavar="ID", help="Continue an episode.")] = None,
    method: Method = "good",
    model: Model = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    catalogue: Catalogue = None,
    column: Columns = None,
    scene: Scene = None,
    simulator: Simulator = "house",
    unity: Unity = None,
    picture: Picture = None,
    layout: Layout = None,
    end_of_turn: EndOfTurn = False,
    calibration: CalibrationName = None,
    propose: Propose = None,
    prompted: Prompted = None,
    seed: Seed = 0,
    rounds: Annotated[int | None, typer.Option(min=1, help="Most rounds.  [default: 100]")] = None,
    store: StoreFile = None,
) -> None:
    """Talk with the agent, and watch what it believes; "quit" leaves, and --resume goes on.

    A resumed episode keeps its options, but for --rounds and --picture.
    """
    from goalscope.cli.typed import typed
    from goalscope.cli.why import correct
    from goalscope.display import (
        show_belief,
        show_done,
        show_header,
        show_round,
        show_summary,
        show_understood,
    )
    from goalscope.domains import Settings, profile_named
    from goalscope.session import Session, more_rounds, saved_settings
    from goalscope.store import Store

    out = console()
    busy = spinner(out, "Thinking...")

    def read(query: str) -> str:
        busy.stop()
        words = typed(out, query, lambda words: correct(out, session, words))
        busy.start()
        return words

    with Store.open(store) as episodes:
        info = episodes.episode(resume) if resume else None
        if info:
            _refuse_others(context, info)
            check_picture(picture, info.domain)
        settings = (
            saved_settings(info, rounds=rounds)
            if info
            else settings_given(
                picture,
                domain=domain,
                method=method,
                model=model,
                generator=generator,
                scorer=scorer,
                tokenizer=tokenizer,
                adapter=adapter,
                catalogue=catalogue,
                columns=column,
                scene=scene,
                simulator=simulator,
                unity=unity,
                layout=layout,
                end_of_turn=end_of_turn,
                calibration=calibration,
                propose=propose,
                prompted=prompted,
                seed=seed,
                rounds=rounds or Settings().rounds,
            )
        )
        profile = info.profile if info else None
        person = profile_named(settings, profile) if profile else None
        with engine_of(settings) as engine, _environment(settings, person) as env:
            order = settings.method == "no-inference"
            before = None

            def understood(round: Round) -> None:
                transcript = settings.human != "you"
                show_understood(out, round, before, transcript=transcript, order=order)

            session = Session(
                episodes,
                settings,
                env,
                engine,
                profile=profile,
                read=read,
                resume=info,
                understood=understood,
            )
            show_header(out, session.info)
            ends = (
                f'"{env.completion_phrase}" ends the task; "quit" leaves, and you can go on later'
            )
            correctable = settings.method == "good"
            more = '; "/help" tells how to correct the goals.' if correctable else "."
            out.print(ends + more, style="dim")
            for round in session.earlier:
                show_round(out, round, before, order=order)
                before = round.belief
            if session.corrections and session.belief:
                show_belief(out, session.belief, before)
            draw = _drawing(env, picture)
            try:
                with _resumable(session), busy:
                    for round in session.run():
                        show_done(out, round)
                        draw()
                        before = round.belief
            except EOFError:
                raise typer.Exit from None
            show_summary(out, session.info)
            if session.info.ended != "terminated":
                out.print(more_rounds(session.info, settings.rounds), soft_wrap=True)


def run(
    domain: Domain = "grocery",
    profile: Annotated[
        str | None, typer.Option(metavar="NAME|all", help="The person to simulate.")
    ] = None,
    human: Annotated[
        Literal["scripted", "simulated", "terse", "distracted", "changes-mind", "volunteers-late"],
        typer.Option(help="Fixed replies, or a model's, with a habit if one is named."),
    ] = "scripted",
    method: Method = "good",
    model: Model = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    profiles: Annotated[Path | None, typer.Option(help="TOML file of your own people.")] = None,
    catalogue: Catalogue = None,
    column: Columns = None,
    scene: Scene = None,
    simulator: Simulator = "house",
    unity: Unity = None,
    picture: Picture = None,
    layout: Layout = None,
    end_of_turn: EndOfTurn = False,
    calibration: CalibrationName = None,
    propose: Propose = None,
    prompted: Prompted = None,
    seed: Seed = 0,
    rounds: Annotated[int, typer.Option(min=1, help="Most rounds.")] = 20,
    calls: Calls = None,
    store: StoreFile = None,
    as_json: Json = False,
) -> None:
    """Run episodes with a simulated person, and score the outcome."""
    from goalscope.display import show_scores
    from goalscope.domains import profile_named, profiles_of
    from goalscope.models.opening import forget
    from goalscope.session import Session
    from goalscope.store import Store

    settings = settings_given(
        picture,
        domain=domain,
        human=human,
        method=method,
        model=model,
        generator=generator,
        scorer=scorer,
        tokenizer=tokenizer,
        adapter=adapter,
        profiles=profiles,
        catalogue=catalogue,
        columns=column,
        scene=scene,
        simulator=simulator,
        unity=unity,
        layout=layout,
        end_of_turn=end_of_turn,
        calibration=calibration,
        propose=propose,
        prompted=prompted,
        seed=seed,
        rounds=rounds,
    )
    everyone = profiles_of(settings)
    if not everyone:
        raise InvalidInputError(f"{domain} has no people to simulate: load_profiles gives none.")
    if not profile:
        names = ", ".join(person.name for person in everyone)
        raise InvalidInputError(f"Say who is to be simulated: --profile all, or one of {names}.")
    people = everyone if profile == "all" else (profile_named(settings, profile),)
    scored: list[Scored] = []
    with (
        Store.open(store) as episodes,
        engine_of(settings, calls) as engine,
        _printed_at_the_end(scored, as_json),
    ):
        for person in people:
            forget(engine)  # so that each scores as it does alone
            with _environment(settings, person) as env:
                session = Session(episodes, settings, env, engine, profile=person.name)
                file = picture and picture.with_stem(f"{picture.stem}-{person.name}")
                file = picture if len(people) == 1 else file
                draw = _drawing(env, file)
                scored.append(_run_one(session, draw, quiet=as_json, brief=len(people) > 1))
            if as_json and len(people) > 1:
                typer.echo(f"{len(scored)} of {len(people)}: {person.name}", err=True)
    if len(people) > 1 and not as_json:
        show_scores(console(), scored)


def replay(
    id: Annotated[str, typer.Argument(help="The episode, or how its id begins.")],
    store: StoreFile = None,
    as_json: Json = False,
) -> None:
    """Show a stored episode again; no model is needed.

    As JSON, each round has what was said, done and noted, and the belief: goals, log_prior,
    log_likelihood (a row for each turn, nats), and the probability of each goal.
    """
    from goalscope.cli.why import said_since
    from goalscope.display import show_header, show_round, show_summary
    from goalscope.safe_text import terminal_safe
    from goalscope.store import Store

    out = console()
    with Store.open(store, new=False) as episodes:
        info = episodes.episode(id)
        if as_json:
            print(json.dumps(_told(info, episodes.rounds(info.id))))
            return
        show_header(out, info)
        before, rounds = None, episodes.rounds(info.id)
        for round in rounds:
            show_round(out, round, before, order=info.method == "no-inference")
            before = round.belief
        since = said_since(episodes, info)
    if since:
        out.print(terminal_safe(since), soft_wrap=True)
    if info.profile and info.score is not None:
        _show_checks_again(out, info, rounds)
    show_summary(out, info)


def episodes(store: StoreFile = None, as_json: Json = False) -> None:
    """List the stored episodes."""
    from goalscope.display import show_episodes
    from goalscope.safe_text import model_shown
    from goalscope.store import Store

    with Store.open(store, new=False) as opened:
        infos = opened.episodes()
    if as_json:
        print(json.dumps([asdict(info) | {"model": model_shown(info.model)} for info in infos]))
    else:
        show_episodes(console(), infos)


def _show_checks_again(out: Console, info: EpisodeInfo, rounds: Sequence[Round]) -> None:
    """Show which checks the stored acts meet, taken once more in the shop or room of goalscope."""
    from goalscope.display import show_checks
    from goalscope.domains import open_environment, profile_named, settings_of
    from goalscope.policy import undo
    from goalscope.safe_text import terminal_safe

    settings = settings_of(info.settings)
    if settings.domain not in ("grocery", "house") or settings.simulator != "house":
        return  # what is not goalscope's own is not set in motion to look at something
    try:
        person = profile_named(settings, info.profile or "")
        env = open_environment(settings, person)
        undo(env, [result for round in rounds for result in round.results])
        met = env.checks_met(person)
        if not met or sum(met) / len(met) != info.score:
            raise InvalidInputError("The catalogue, the scene or the person has changed since.")
        show_checks(out, person.checks, met)
    except GoalscopeError as error:
        out.print(
            terminal_safe(f"Which checks were met cannot be shown: {error}", "dim"), soft_wrap=True
        )


@contextmanager
def _environment(settings: Settings, person: Profile | None) -> Generator[Environment]:
    """The environment of an episode; what is to be known of it is said."""
    from goalscope.domains import open_environment

    env = open_environment(settings, person)
    try:
        for note in env.notes:
            console(stderr=True).print(note, style="dim")
        yield env
    finally:
        env.close()


def _refuse_others(context: typer.Context, info: EpisodeInfo) -> None:
    """Refuse the options that an episode keeps from when it was begun.

    Raises:
        InvalidInputError: One is given.
    """
    from goalscope.domains import load_domain

    free = ["resume", "rounds", "picture", "store"]
    free += ["domain"] * (load_domain(context.params["domain"]) == info.domain)
    given = [
        each.opts[0]
        for each in context.command.params
        if each.name not in free
        and (source := context.get_parameter_source(str(each.name)))
        and source.name == "COMMANDLINE"
    ]
    if given:
        raise InvalidInputError(
            f"A resumed episode keeps its options: leave out {', '.join(given)}, or begin another "
            "one without --resume."
        )


def _drawing(env: Environment, file: Path | None) -> Callable[[], None]:
    """A function that draws the house's room as it now is; without a file it does nothing."""
    from goalscope.envs.house import HomeRobot

    if file is None or not isinstance(env, HomeRobot):
        return lambda: None
    from goalscope.envs.house.picture import svg_picture

    seen = env.metadata

    def draw() -> None:
        nonlocal seen
        file.write_text(svg_picture(env.metadata, seen, env.names), encoding="utf-8")
        seen = env.metadata

    return draw


@contextmanager
def _resumable(session: Session) -> Generator[None]:
    """Say how an episode goes on, if it is interrupted."""
    from goalscope.session import resuming

    try:
        yield
    except (KeyboardInterrupt, EOFError, GoalscopeError):
        done = session.info.rounds
        typer.echo(
            f"\nEpisode {session.id} is kept, with {pluralize(done, 'finished round')}. "
            f"Go on with: {resuming(session.info)}",
            err=True,
        )
        raise


def _run_one(session: Session, draw: Callable[[], None], *, quiet: bool, brief: bool) -> Scored:
    """Run a simulated episode, drawing each round unless it is one of many."""
    import time

    from goalscope.display import (
        show_checks,
        show_header,
        show_round,
        show_summary,
        show_unwanted,
    )
    from goalscope.safe_text import terminal_safe

    out, start, before = console(), time.monotonic(), None
    if not (quiet or brief):
        show_header(out, session.info)
    with _resumable(session), spinner(out, "") as busy:
        busy.update(terminal_safe(f"{session.info.profile}: round 1"))
        for round in session.run():
            busy.update(terminal_safe(f"{session.info.profile}: round {round.number + 1}"))
            if not (quiet or brief):
                show_round(out, round, before, order=session.info.method == "no-inference")
            draw()
            before = round.belief
    info, unwanted = session.info, session.unwanted()
    if session.profile and not (quiet or brief):
        show_checks(out, session.profile.checks, session.checks_met())
        if unwanted is not None:
            show_unwanted(out, unwanted)
    if not quiet:
        show_summary(out, info, time.monotonic() - start)
    return info, unwanted


@contextmanager
def _printed_at_the_end(scored: Sequence[Scored], as_json: bool) -> Generator[None]:
    """Print the outcomes as one JSON value, also those of before an interruption."""
    try:
        yield
    finally:
        if as_json and scored:
            print(json.dumps([_outcome(*each) for each in scored]))


def _told(info: EpisodeInfo, rounds: Sequence[Round]) -> dict[str, Any]:
    """An episode and its rounds as JSON, with the probabilities that follow from each belief."""
    from goalscope.rounds_json import round_to_json
    from goalscope.safe_text import model_shown

    told: list[dict[str, Any]] = []
    for round in rounds:
        row = json.loads(round_to_json(round))
        if round.belief:
            row["belief"]["probability"] = round.belief.probability.tolist()
        told.append(row)
    return {**asdict(info), "model": model_shown(info.model), "rounds": told}


def _outcome(info: EpisodeInfo, unwanted: Sequence[str] | None) -> dict[str, Any]:
    from goalscope.safe_text import model_shown

    return {
        "profile": info.profile,
        "method": info.method,
        "model": model_shown(info.model),
        "seed": info.settings.get("seed"),
        "score": info.score,
        "rounds": info.rounds,
        "terminated": info.ended == "terminated",
        "episode": info.id,
        "unwanted": unwanted,
    }
