"""`goalscope chat` and `run`: episodes with people, real and simulated."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from goalscope.base.text import model_shown, terminal_safe
from goalscope.base.types import Goal, GoalscopeError, InvalidInputError, checked_text, pluralize
from goalscope.cli import options
from goalscope.cli.terminal import console, say, settings_model, spinner

if TYPE_CHECKING:
    from rich.console import Console

    from goalscope.agent.round import Round
    from goalscope.agent.settings import Settings
    from goalscope.base.types import Profile
    from goalscope.belief.belief import Belief
    from goalscope.belief.tracker import Correction
    from goalscope.cli.display import Scored
    from goalscope.envs import Environment, Outcome
    from goalscope.storage.session import Session
    from goalscope.storage.store import EpisodeInfo

HELP = """\
/goals               list the goals with their numbers
/pin NUMBER|TEXT     confirm this goal, or a new one in your own words
/veto NUMBER         rule this goal out
/reword NUMBER TEXT  confirm this goal in other words
/why NUMBER          show the evidence of each utterance for this goal"""

ORDER_HELP = """\
/goals               list the goals in the model's order
This method computes no evidence, so there is nothing to correct or explain."""

NO_HELP = "This method keeps no belief to show or correct."

LEAVING = """
/help                show this help
quit                 leave; the episode can be resumed"""


def chat(
    context: typer.Context,
    domain: options.Domain = None,
    resume: Annotated[
        str | None, typer.Option(metavar="ID", help="Resume the episode with this id.")
    ] = None,
    model: options.Model = None,
    generator: options.Writer = None,
    scorer: options.Scorer = None,
    tokenizer: options.Tokenizer = None,
    adapter: options.Adapter = None,
    method: options.Method = "good",
    preset: options.Preset = None,
    catalogue: options.Catalogue = None,
    columns: options.Columns = None,
    scene: options.Scene = None,
    simulator: options.Simulator = "embedded",
    unity: options.Unity = None,
    picture: options.Picture = None,
    likelihood: options.OwnLikelihood = None,
    layout: options.Layout = None,
    calibration: options.CalibrationName = None,
    propose: options.Propose = None,
    k: options.Likeliest = None,
    prompted: options.Prompted = None,
    seed: options.Seed = 0,
    rounds: Annotated[
        int | None, typer.Option(min=1, help="Maximum number of rounds.  [default: 100]")
    ] = None,
    trace: options.TraceFile = None,
    store: options.StoreFile = None,
) -> None:
    """Talk to the agent and watch its belief; "quit" leaves, --resume continues.

    A resumed episode keeps its options, except for --rounds and --picture.
    """
    from concurrent.futures import ThreadPoolExecutor

    from goalscope.agent.settings import Settings
    from goalscope.cli import display
    from goalscope.envs import completion_phrase
    from goalscope.envs.registry import profile_named
    from goalscope.models.trace import tracing
    from goalscope.storage.session import Session, saved_settings
    from goalscope.storage.store import Store

    out = console()
    busy = spinner(out, "Thinking...")

    def read(query: str) -> str:
        busy.stop()
        words = _read_words(out, query, lambda line: correct(out, session, line))
        busy.start()
        prepared.result()
        return words

    def understood(round: Round) -> None:
        is_typed = settings.human == "you"
        display.show_understood(out, round, before, transcript=not is_typed)

    with Store.open(store) as episodes:
        info = episodes.episode(resume) if resume else None
        if info:
            _refuse_other_options(context, info)
            options.check_picture(picture, info.domain)
            settings = saved_settings(episodes, info, rounds=rounds)
        else:
            settings = options.episode_settings(context, rounds=rounds or Settings().rounds)
        profile = info.profile if info else None
        person = profile_named(settings, profile) if profile else None
        with (
            settings_model(settings) as engine,
            _environment(settings, person) as env,
            tracing(trace),
            ThreadPoolExecutor(1) as beside,
        ):
            before = None
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
            display.show_header(out, session.info)
            prepared = beside.submit(session.prepare)
            told = f'"{completion_phrase(env)}" ends the task; '
            told += '"quit" leaves, and you can go on later'
            told += '; "/help" shows how to correct the goals' * session.agent.belief.inferred
            out.print(f"{told}.", style="dim")
            for round in session.earlier:
                display.show_round(out, round, before)
                before = round.belief
            if session.agent.corrections:
                display.show_belief(out, session.agent.belief, before)
            draw = _drawing(env, settings.domain, picture)
            try:
                with _resumable(session, picture=picture, trace=trace), busy:
                    for round in session.run():
                        display.show_done(out, round)
                        draw()
                        before = round.belief
            except EOFError:
                raise typer.Exit from None
            display.show_summary(out, session.info)
            if session.info.ended != "terminated":
                say(f"To continue, run `{session.resuming(picture=picture, trace=trace)}`.")


def run(
    context: typer.Context,
    domain: options.Domain = None,
    profile: Annotated[
        str | None, typer.Option(metavar="NAME|all", help="The person to simulate.")
    ] = None,
    human: Annotated[
        Literal[
            "scripted",
            "simulated",
            "terse",
            "distracted",
            "changes-mind",
            "volunteers-late",
            "forgets",
            "drifts",
            "tells-little",
            "bluffs",
        ],
        typer.Option(help="Fixed replies, or replies by a model, optionally with a habit."),
    ] = "scripted",
    profiles: Annotated[Path | None, typer.Option(help="TOML file with your own people.")] = None,
    model: options.Model = None,
    generator: options.Writer = None,
    scorer: options.Scorer = None,
    tokenizer: options.Tokenizer = None,
    adapter: options.Adapter = None,
    method: options.Method = "good",
    preset: options.Preset = None,
    catalogue: options.Catalogue = None,
    columns: options.Columns = None,
    scene: options.Scene = None,
    simulator: options.Simulator = "embedded",
    unity: options.Unity = None,
    picture: options.Picture = None,
    likelihood: options.OwnLikelihood = None,
    layout: options.Layout = None,
    calibration: options.CalibrationName = None,
    propose: options.Propose = None,
    k: options.Likeliest = None,
    prompted: options.Prompted = None,
    seed: options.Seed = 0,
    rounds: Annotated[int, typer.Option(min=1, help="Most rounds.")] = 20,
    trace: options.TraceFile = None,
    store: options.StoreFile = None,
    as_json: options.Json = False,
) -> None:
    """Run episodes with simulated people, and score the outcome."""
    from goalscope.cli import display
    from goalscope.envs.registry import profile_named, profiles_of
    from goalscope.models.opening import forget
    from goalscope.models.trace import tracing
    from goalscope.storage.session import Session
    from goalscope.storage.store import Store

    people_file = str(profiles.absolute()) if profiles else None
    settings = options.episode_settings(context, human=human, profiles=people_file, rounds=rounds)
    everyone = profiles_of(settings)
    if not everyone:
        raise InvalidInputError(
            f"The domain {settings.domain} has nobody to simulate: its load_profiles returns no "
            "profiles."
        )
    if not profile:
        names = ", ".join(person.name for person in everyone)
        raise InvalidInputError(f"Choose whom to simulate: --profile all, or one of {names}.")
    people = everyone if profile == "all" else (profile_named(settings, profile),)
    has_many = len(people) > 1
    scored: list[Scored] = []
    try:
        with Store.open(store) as episodes, settings_model(settings) as engine, tracing(trace):
            for person in people:
                forget(engine)  # so that each scores as it does alone
                file = picture
                if file and has_many:
                    file = file.with_stem(f"{file.stem}-{person.name}")
                with _environment(settings, person) as env:
                    session = Session(episodes, settings, env, engine, profile=person.name)
                    draw = _drawing(env, settings.domain, file)
                    with _resumable(session, picture=file, trace=trace):
                        scored.append(_run_one(session, draw, quiet=as_json, brief=has_many))
                if as_json and has_many:
                    typer.echo(f"{len(scored)} of {len(people)}: {person.name}", err=True)
    finally:  # one JSON value, also of what was done before an interruption
        if as_json and scored:
            print(json.dumps([_outcome_json(*each) for each in scored]))
    if has_many and not as_json:
        display.show_scores(console(), scored)


def _run_one(session: Session, draw: Callable[[], None], *, quiet: bool, brief: bool) -> Scored:
    """Run a simulated episode; print each round if it is the only one."""
    import time

    from goalscope.cli import display

    out, start, before = console(), time.monotonic(), None
    has_rounds = not (quiet or brief)
    if has_rounds:
        display.show_header(out, session.info)
    with spinner(out, "") as busy:
        busy.update(terminal_safe(f"{session.info.profile}: round 1"))
        for round in session.run():
            busy.update(terminal_safe(f"{session.info.profile}: round {round.number + 1}"))
            if has_rounds:
                display.show_round(out, round, before)
            draw()
            before = round.belief
    info, outcome = session.info, session.outcome()
    if session.profile and outcome and has_rounds:
        display.show_outcome(out, session.profile.checks, outcome)
    if not quiet:
        display.show_summary(out, info, time.monotonic() - start, outcome)
    return info, outcome


def correct(out: Console, session: Session, line: str) -> None:
    """Run a chat command, a line that begins with a slash, and show the belief."""
    from goalscope.belief.explain import reasons
    from goalscope.cli import display

    command, _, rest = line.strip().partition(" ")
    corrections: dict[str, Correction] = {"/pin": "pin", "/veto": "veto", "/reword": "reword"}
    belief = session.agent.belief
    try:
        if command == "/help":
            corrects = HELP if belief.inferred else ORDER_HELP
            commands = corrects if belief.goals else NO_HELP
            raise InvalidInputError(commands + LEAVING)
        if command not in ("/goals", "/why", *corrections):
            raise InvalidInputError(f"Unknown command {command}. /help lists the commands.")
        if not belief.goals:
            raise InvalidInputError(NO_HELP)
        if command == "/goals":
            display.show_belief(out, belief)
            return
        if not belief.inferred:
            raise InvalidInputError(ORDER_HELP)
        number, _, text = rest.strip().partition(" ")
        if command == "/why":
            goal = _numbered(belief, number, command)
            display.show_reasons(
                out, goal, reasons(belief, session.agent.turns, goal), pinned=belief.pinned
            )
            return
        if command == "/pin" and rest.strip() and not rest.strip().isdecimal():
            session.correct("pin", Goal(checked_text(rest, "goal")))
        else:
            goal = _numbered(belief, number, command)
            session.correct(corrections[command], goal, text)
        display.show_belief(out, session.agent.belief, belief)
    except InvalidInputError as error:
        out.print(terminal_safe(str(error), "dim"))


def _numbered(belief: Belief, number: str, command: str) -> Goal:
    """The goal with a number shown by `show_belief`.

    Raises:
        InvalidInputError: There is none.
    """
    ranked = belief.top()
    if number.isdecimal() and 1 <= int(number) <= len(ranked):
        return ranked[int(number) - 1][0]
    words = ", or in your own words" if command == "/pin" else ""
    raise InvalidInputError(
        f"Name a goal by its number (1 to {len(ranked)}){words}. /goals lists them."
    )


def _read_words(out: Console, query: str, command: Callable[[str], object]) -> str:
    """Show a query, and return the person's reply.

    Lines that begin with "/" go to `command`.

    Raises:
        EOFError: The person leaves.
    """
    out.print(terminal_safe("Agent  ", "cyan").append_text(terminal_safe(query)))
    while True:
        words = input("You    ")
        if not sys.stdin.isatty():
            out.print(terminal_safe(words))
        if words.strip(" .!").casefold().removeprefix("/") in ("quit", "exit"):
            raise EOFError
        if not words.lstrip().startswith("/"):
            return words
        command(words)


def _refuse_other_options(context: typer.Context, info: EpisodeInfo) -> None:
    """Refuse options that a resumed episode keeps from its start.

    Raises:
        InvalidInputError: One is given.
    """
    from goalscope.agent.settings import load_own
    from goalscope.envs.registry import load_domain

    free = ["resume", "rounds", "picture", "trace", "store"]
    domain = context.params["domain"]
    if domain and load_domain(domain) == info.domain:
        free.append("domain")
    for option in ("likelihood", "method"):
        own = context.params[option] or ""
        if ":" in own and load_own(own, option) == info.settings.get(option):
            free.append(option)
    given = [
        each.opts[0]
        for each in context.command.params
        if each.name not in free
        and (source := context.get_parameter_source(str(each.name)))
        and source.name == "COMMANDLINE"
    ]
    if given:
        raise InvalidInputError(
            f"A resumed episode keeps its options. Leave out {', '.join(given)}, or start a "
            "new episode without --resume."
        )


@contextmanager
def _environment(settings: Settings, person: Profile | None) -> Generator[Environment]:
    """The environment of an episode, closed at the end; prints its notes."""
    from goalscope.envs.registry import domain_named, open_environment

    with open_environment(settings, person) as env:
        for note in domain_named(settings.domain).notes(env):
            say(note, "dim", stderr=True)
        yield env


def _drawing(env: Environment, domain: str, file: Path | None) -> Callable[[], None]:
    """A function that draws the current state of the room; without a file it does nothing."""
    from goalscope.envs.registry import domain_named

    known = domain_named(domain)
    if file is None or known.snapshot is None:
        return lambda: None
    snapshot, seen = known.snapshot, known.snapshot(env)

    def draw() -> None:
        nonlocal seen
        file.write_text(known.draw(env, seen, None), encoding="utf-8")
        seen = snapshot(env)

    return draw


@contextmanager
def _resumable(session: Session, **written: Path | None) -> Generator[None]:
    """Print how to resume an interrupted episode, and to go on with what is `written`."""
    try:
        yield
    except (KeyboardInterrupt, EOFError, GoalscopeError):
        kept = "No round was finished, so no episode was saved."
        if session.is_stored:
            kept = (
                f"Episode {session.id} is saved, with "
                f"{pluralize(session.info.rounds, 'finished round')}. Resume it with: "
                f"{session.resuming(**written)}"
            )
        say(f"\n{kept}", stderr=True)
        raise


def _outcome_json(info: EpisodeInfo, outcome: Outcome | None) -> dict[str, Any]:
    parts = ("needs", "needs_met", "violated", "unwanted")
    return {
        "profile": info.profile,
        "method": info.method,
        "model": model_shown(info.model),
        "seed": info.settings.get("seed"),
        "score": info.score,
        "rounds": info.rounds,
        "terminated": info.ended == "terminated",
        "episode": info.id,
        **{name: outcome and getattr(outcome, name) for name in parts},
    }
