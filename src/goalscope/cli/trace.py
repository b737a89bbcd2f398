"""`goalscope trace`: read a trace, tell two apart, or run it again with modules swapped."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from goalscope.base.types import InvalidInputError, pluralize
from goalscope.cli.options import Adapter, Json, Model, Scorer, Tokenizer, Writer
from goalscope.cli.terminal import console, model_names, say, settings_model

if TYPE_CHECKING:
    from goalscope.models.trace import Line


def trace(
    files: Annotated[list[Path], typer.Argument(help="A trace, or two to tell apart.")],
    module: Annotated[
        list[str] | None, typer.Option(help="Show only this module; repeatable.")
    ] = None,
    round: Annotated[int | None, typer.Option(min=1, help="Show only this round.")] = None,
    episode: Annotated[
        str | None, typer.Option(metavar="ID", help="Use only the episode whose id begins so.")
    ] = None,
    full: Annotated[
        bool, typer.Option("--full", help="Show each prompt and answer whole.")
    ] = False,
    swap: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MODULE",
            help="Run the episode again, with this module answered by the model named here, and "
            "the others by the trace; repeatable.",
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Trace of that run.")] = None,
    model: Model = None,
    generator: Writer = None,
    scorer: Scorer = None,
    tokenizer: Tokenizer = None,
    adapter: Adapter = None,
    as_json: Json = False,
) -> None:
    """Show what the model was asked and what it answered, module by module.

    Two traces are compared call by call. With --swap the people say what they said before; a call
    whose prompt has changed gets the answer that the trace has in its place.
    """
    from goalscope.models.trace import TRACED_MODULES, read_trace

    for name in (*(module or ()), *(swap or ())):
        if name not in TRACED_MODULES:
            raise InvalidInputError(
                f"There is no module {name!r}. Choose one of {', '.join(TRACED_MODULES)}."
            )
    if len(files) > 2:
        raise InvalidInputError("Name one trace, or two to tell apart.")

    def of_episode(line: Line) -> bool:
        return not episode or (line.get("id") or line["episode"]).startswith(episode)

    lines = [*filter(of_episode, read_trace(files[0]))]
    if swap:
        if len(files) > 1 or out is None:
            raise InvalidInputError("--swap takes one trace, and writes another: add --out FILE.")
        if out.exists():
            raise InvalidInputError(f"{out} exists. Name another file with --out.")
        names = model_names(model, generator, scorer, tokenizer, adapter)
        _run_again(lines, swap, out, {key: name for key, name in names.items() if name})
        return

    def chosen(line: Line) -> bool:
        return (not module or line["module"] in module) and (not round or line["round"] == round)

    shown = [*filter(chosen, lines)]
    if len(files) == 2:
        _compare(
            shown, [*filter(chosen, filter(of_episode, read_trace(files[1])))], as_json=as_json
        )
    elif as_json:
        print(json.dumps(shown))
    elif any(line["event"] in ("model", "score") for line in shown):
        _show(shown, full=full)
    else:
        found = dict.fromkeys(line["module"] for line in lines if line["module"])
        last = max((line["round"] for line in lines), default=0)
        raise InvalidInputError(
            f"The trace has no such call. It has {pluralize(last, 'round')} and calls of "
            f"{', '.join(found) or 'no module'}."
        )


def _show(lines: Sequence[Line], *, full: bool) -> None:
    """Print the calls, a line each, or whole."""
    where: tuple[str, int] | None = None
    for line in lines:
        here = line["episode"], line["round"]
        if line["event"] not in ("model", "score", "round"):
            continue
        if here != where:
            where = here
            say(f"{line['episode']} round {line['round']}".strip(), "bold")
        if line["event"] == "round":
            for goal, probability in line["belief"].items():
                say(f"    {probability:6.1%}  {goal}", "dim")
            for each in (*line["changes"], *line["actions"]):
                say(f"    {each}", "dim")
        elif full:
            of = f" | turn {line['turn']} under {line['goal']}" if "goal" in line else ""
            say(f"{line['module']} | {line['model']}{of}", "cyan")
            say(line.get("prompt") or _chat(line))
            say(_answer(line), "green")
        else:
            answer = " ".join(_answer(line).split())
            say(f"  {line['module']:9} {line['time']:6.1f} s  {answer:.100}")


def _compare(one: Sequence[Line], other: Sequence[Line], *, as_json: bool) -> None:
    """Print the first call that differs, and how many of each module do."""
    from goalscope.models.trace import TRACED_MODULES

    ours, theirs = _placed(one), _placed(other)
    calls, differ = Counter[str](), Counter[str]()
    first: tuple[Line | None, Line | None] | None = None
    order = {name: i for i, name in enumerate(("", *TRACED_MODULES))}
    for place in sorted({*ours, *theirs}, key=lambda each: (each[0], order[each[1]], each[2])):
        a, b = ours.get(place), theirs.get(place)
        same = bool(a and b and (a["input"], _answer(a)) == (b["input"], _answer(b)))
        calls[place[1]] += 1
        differ[place[1]] += not same
        first = first or (None if same else (a, b))
    if as_json:
        print(json.dumps({"calls": calls, "differ": differ, "first": first}))
        return
    for module, number in calls.items():
        say(f"{module:10} {differ[module]} of {pluralize(number, 'call')} differ")
    for call in first or ():
        if call is None:
            say("--- no such call", "bold")
            continue
        say(f"--- round {call['round']}, {call['module']}, {call['model']}", "bold")
        say(call.get("prompt") or _chat(call))
        say(_answer(call), "green")


def _placed(lines: Sequence[Line]) -> dict[tuple[int, str, int], Line]:
    """The calls by round, module and order in them."""
    found: dict[tuple[int, str, int], Line] = {}
    counts = Counter[tuple[int, str]]()
    for line in lines:
        if line["event"] in ("model", "score"):
            place = line["round"], line["module"]
            found[*place, counts[place]] = line
            counts[place] += 1
    return found


def _chat(line: Line) -> str:
    return "\n".join(f"{each['role']}: {each['content']}" for each in line["input"])


def _answer(line: Line) -> str:
    """What was written, or the words that were scored, with their nats."""
    if "error" in line:
        return f"failed: {line['error']}"
    output = line["output"]
    if line["event"] == "model":
        return output["completion"]
    nats = sum(each["logprob"] for each in output["logprobs"])
    under = f"turn {line['turn']} under {line['goal']}" if "goal" in line else line["words"]
    return f"{nats:9.3f} nats: {under}"


def _run_again(
    lines: Sequence[Line], swap: Sequence[str], out: Path, names: dict[str, str]
) -> None:
    """Run the traced episode again with these modules by other models; see `Trace`."""
    from dataclasses import replace

    from goalscope.agent.settings import settings_of
    from goalscope.cli.display import show_summary
    from goalscope.envs.registry import open_environment, profile_named
    from goalscope.models.trace import tracing
    from goalscope.storage.session import Session
    from goalscope.storage.store import Store

    begun = [line for line in lines if line["event"] == "episode"]
    if len(begun) != 1:
        ids = ", ".join(line["id"] for line in begun) or "none"
        raise InvalidInputError(
            f"One episode is run again; name it with --episode. The trace has: {ids}."
        )
    said = [line["utterance"] for line in lines if line["event"] == "round"]
    try:
        before = settings_of(begun[0]["settings"])
    except TypeError as error:
        raise InvalidInputError(f"The trace is of another version of goalscope: {error}.") from None
    human = before.human if "human" in swap else "you"
    settings = replace(before, human=human, rounds=len(said), **names)
    name = begun[0]["profile"]
    profile = profile_named(settings, name) if name else None
    with (
        settings_model(settings) as engine,
        open_environment(settings, profile) as env,
        Store.in_memory() as store,
        tracing(out, lines, swap),
    ):
        words = iter(said)

        def repeat(_: str) -> str:
            for each in words:
                return each
            raise InvalidInputError("The trace has no further words of the person.")

        session = Session(store, settings, env, engine, profile=name, read=repeat)
        for round in session.run():
            say(f"Round {round.number}: {pluralize(len(round.results), 'action')}", "dim")
        show_summary(console(), session.info)
