"""Rounds drawn in a terminal. Text from people, models and catalogues is printed as plain text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import shorten
from typing import TYPE_CHECKING, Any, cast

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.padding import Padding
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from goalscope.base.text import domain_shown, model_shown, terminal_safe
from goalscope.base.types import TRACKING, UNSPECIFIED, Goal, pluralize
from goalscope.language.orders import Order, order_in_words

if TYPE_CHECKING:
    from goalscope.agent.round import Round
    from goalscope.belief.belief import Belief
    from goalscope.belief.explain import Reason
    from goalscope.envs import Outcome
    from goalscope.storage.store import EpisodeInfo

    Scored = tuple[EpisodeInfo, Outcome | None]
    """An episode, and what was made of the start, where the domain has a score."""

BAR = 20
SHOWN = 4
LEAST_CHANGE = 0.01  # chance of a change of mind
FIRST_WORDS = 22  # cells that they get before columns that are of less use


def show_header(console: Console, info: EpisodeInfo) -> None:
    """Print the episode's domain, person, method, model and task."""
    person = info.profile or "you"
    domain, model = domain_shown(info.domain), model_shown(info.model)
    line = f"episode {info.id} | {domain} | {person} | {info.method} | {model}"
    console.print(Panel(terminal_safe(info.task), title=terminal_safe(line), title_align="left"))


def show_round(console: Console, round: Round, previous: Belief | None = None) -> None:
    """Draw one round; see `show_understood`."""
    show_understood(console, round, previous)
    show_done(console, round)


def show_understood(
    console: Console,
    round: Round,
    previous: Belief | None = None,
    *,
    transcript: bool = True,
) -> None:
    """Draw how the utterance was read, and the belief after it.

    Args:
        console: Where to print.
        round: The round.
        previous: The belief before the round, for the arrows beside the bars.
        transcript: Whether to show the turn, which a person at this terminal has just typed.
    """
    console.rule(f"Round {round.number}", align="left", style="dim")
    if transcript:
        _rows(console, [(Text("Agent", "cyan"), terminal_safe(round.turn.query))])
        _rows(console, [(Text("Human", "magenta"), terminal_safe(round.turn.utterance))])
    if round.reading is not None:
        read = (order_in_words(each) for each in round.reading.orders if each != Order("aim"))
        _rows(console, [(Text("-", "dim"), terminal_safe(line)) for line in read], "Understood")
    if round.belief.goals:
        show_belief(console, round.belief, previous)
    signs = {"added": Text("+", "green"), "removed": Text("-", "red"), "pinned": Text("!", "cyan")}
    changes = [(signs[each.kind], _beside(each.goal.text, each.reason)) for each in round.changes]
    _rows(console, changes, "Goals")


def show_done(console: Console, round: Round) -> None:
    """Draw the actions of a round, the status after them, and the notes."""
    title = f"Actions (replanned {round.replans}x)" if round.replans else "Actions"
    done = [
        (_mark(console, each.ok), _beside(str(each.action), each.observation))
        for each in round.results
    ]
    _rows(console, done, title)
    if round.status:
        status = terminal_safe(round.status)
        console.print(Panel(status, title="Status", title_align="left", style="dim"))
    _rows(console, [(Text("!", "yellow"), terminal_safe(note)) for note in round.notes])


def show_summary(
    console: Console,
    info: EpisodeInfo,
    seconds: float | None = None,
    outcome: Outcome | None = None,
) -> None:
    """Print how an episode ended, and what its score is made of, if that is known."""
    score = "" if info.score is None else f", score {info.score:.2f}"
    if outcome:
        told = outcome.unwanted is not None
        unwanted = f", unwanted {len(outcome.unwanted or ())}" * told
        needs = f"needs {outcome.needs_met} of {outcome.needs}"
        score = f", {needs}, violated {outcome.violated}{unwanted}: score {outcome.score:.2f}"
    took = "" if seconds is None else f", {seconds:.1f} s"
    ended = f"{info.ending} after {pluralize(info.rounds, 'round')}"
    console.print(Text(f"Episode {info.id}: {ended}{score}{took}", "bold"))


def show_outcome(console: Console, checks: Sequence[Mapping[str, Any]], outcome: Outcome) -> None:
    """Print whether each need is met and each prohibition kept, and what is unwanted."""
    told = [*zip(checks, outcome.start, outcome.met, strict=True)]
    for title, held in (("Needs", False), ("Prohibitions", True)):
        rows = [
            (
                _mark(console, now),
                terminal_safe("; ".join(f"{key}: {_listed(each)}" for key, each in check.items())),
            )
            for check, before, now in told
            if before == held
        ]
        _rows(console, rows, title)
    unwanted = "not told: the profile has no welcome list"
    if outcome.unwanted is not None:
        unwanted = ", ".join(outcome.unwanted) or "nothing"
    console.print(terminal_safe(f"Unwanted: {unwanted}", "dim"), soft_wrap=True)


def show_scores(console: Console, scored: Sequence[Scored]) -> None:
    """Print a table of profiles with what the score is made of, and its mean."""
    scores = [info.score for info, _ in scored if info.score is not None]
    table = Table("profile", "ended", "episode")
    for heading in ("rounds", "needs", "violated", "unwanted", "score"):
        table.add_column(heading, justify="right")
    for info, outcome in scored:
        counts = ["", "", ""]
        if outcome:
            unwanted = "" if outcome.unwanted is None else str(len(outcome.unwanted))
            counts = [f"{outcome.needs_met} of {outcome.needs}", str(outcome.violated), unwanted]
        score = "" if info.score is None else f"{info.score:.2f}"
        who = terminal_safe(info.profile or "")
        table.add_row(who, info.ending, info.id, str(info.rounds), *counts, score)
    if scores:
        table.add_section()
        table.add_row("mean", *[""] * 6, f"{sum(scores) / len(scores):.2f}")
    console.print(table)


def show_episodes(console: Console, infos: Sequence[EpisodeInfo]) -> None:
    """Print a table of stored episodes, with fewer columns on a narrow terminal.

    What the person said first is cut to the cells that are left.
    """
    columns: dict[str, list[str]] = {
        "id": [info.id for info in infos],
        "started (UTC)": [info.created[:16].replace("T", " ") for info in infos],
        "domain": [domain_shown(info.domain) for info in infos],
        "profile": [
            shorten(info.task, 36, placeholder=" ...")
            if info.domain == TRACKING
            else info.profile or "you"
            for info in infos
        ],
        "method": [info.method for info in infos],
        "ended": [info.ending for info in infos],
        "rounds": [str(info.rounds) for info in infos],
        "score": ["" if info.score is None else f"{info.score:.2f}" for info in infos],
    }
    if not any(columns["score"]):
        del columns["score"]
    heading, words = "first words", [info.first_words for info in infos]
    longest = max(terminal_safe(each).cell_len for each in words)
    wanted = longest and max(len(heading), min(FIRST_WORDS, longest)) + 2
    widths = {name: max(map(len, (name, *cells))) + 2 for name, cells in columns.items()}
    for least in ("method", "ended", "domain", "started (UTC)", "score"):
        if sum(widths.values()) + wanted < console.width:
            break
        widths.pop(least, None)
    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for name in widths:
        numbers = name in ("rounds", "score")
        overflow = "ellipsis" if table.columns else "fold"  # the first is what one must type
        table.add_column(name, justify="right" if numbers else "left", overflow=overflow)
    cells = [columns[name] for name in widths]
    left = console.width - 3 - sum(widths.values())
    if wanted and left >= len(heading):
        table.add_column(heading, no_wrap=True, overflow="ellipsis", max_width=left)
        cells.append(words)
    for row in zip(*cells, strict=True):
        table.add_row(*map(terminal_safe, row))
    console.print(table)


def show_reasons(
    console: Console,
    goal: Goal,
    reasons: Sequence[Reason],
    *,
    pinned: Sequence[tuple[int, Goal]] = (),
) -> None:
    """Print the evidence of each utterance for a goal.

    Args:
        console: Where to print.
        goal: The goal.
        reasons: Of each turn.
        pinned: The goals that the person confirmed, as in `Belief`; they move every goal.
    """
    console.print(Text("Why ", "bold").append_text(terminal_safe(goal.text)))
    table = Table()
    for heading in ("", "evidence (nats)", "then", "without it"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("the person said", overflow="fold")
    for each in reasons:
        sign = "green" if each.evidence > 0 else "red"
        table.add_row(
            str(each.turn),
            Text(f"{each.evidence:+.2f}", sign),
            f"{each.probability:.1%}",
            f"{each.without:.1%}",
            terminal_safe(each.utterance),
        )
    console.print(table)
    for each in reasons:
        if each.change >= LEAST_CHANGE:
            console.print(
                f"The person may have changed their mind before turn {each.turn} "
                f"({each.change:.0%}), so earlier words count that much less."
            )
    for turns, each in pinned:
        named = "it" if each == goal else f'"{each.text}"'
        console.print(terminal_safe(f"You confirmed {named} {_when(turns)}."))
    console.print(
        "Evidence is relative to the mean of the other goals. Words that favour a goal can "
        "still make it less likely if another goal gains more. Then: the belief after these "
        "words, over the current goals; if goals were added or removed since, the round "
        "itself showed a different belief. Without it: the current belief without these "
        "words."
        + " Words without content about a goal count 0."
        * any(not e.evidence for e in reasons),
        style="dim",
    )


def show_belief(console: Console, belief: Belief, previous: Belief | None = None) -> None:
    """Print the likeliest goals, numbered from 1, with their probabilities if they were inferred.

    Args:
        console: Where to print.
        belief: The belief.
        previous: An earlier one; arrows show the change since.
    """
    before = dict(previous.top()) if previous is not None else {}
    full, empty, up, down = "#.^v" if console.options.ascii_only else "█░▲▼"
    table = Table.grid(padding=(0, 1))
    ranked = belief.top()
    for number, (goal, probability) in enumerate(ranked[:SHOWN], 1):
        filled = round(probability * BAR)
        arrow = Text(" ")
        change = probability - before.get(goal, probability)
        if abs(change) >= 0.001:
            arrow = Text(up, "green") if change > 0 else Text(down, "red")
        name = terminal_safe(goal.text)
        if goal == UNSPECIFIED:
            name = Text("Unspecified (none of these)", "italic yellow")
        bar = Text(full * filled, "blue").append(empty * (BAR - filled), "dim")
        if belief.pinned and goal == belief.pinned[-1][1]:
            turns = belief.pinned[-1][0]
            now = turns == len(belief.log_likelihood)
            when = "" if now else f" {_when(turns)}"
            name.append(f"  (you confirmed it{when})", "dim cyan")
        held = [] if not belief.inferred else [bar, Text(f"{probability:6.1%}"), arrow]
        table.add_row(Text(str(number), "dim"), *held, name)
    if rest := ranked[SHOWN:]:
        share = sum(probability for _, probability in rest)
        held = [] if not belief.inferred else ["", f"{share:6.1%}", ""]
        table.add_row("", *held, Text(f"and {len(rest)} more", "dim"))
    console.print(Text("Belief" if belief.inferred else "The model's order", "bold"))
    if belief.is_degenerate:
        console.print("  No goal explains what was said.")
    else:
        console.print(Padding(table, (0, 0, 0, 2)))


def _when(turns: int) -> str:
    return f"after turn {turns}" if turns else "at the start"


def _mark(console: Console, ok: bool) -> Text:
    good, bad = ("ok", "no") if console.options.ascii_only else ("✓", "✗")
    return Text(good, "green") if ok else Text(bad, "red")


def _listed(value: object) -> str:
    return (
        ", ".join(map(str, cast("list[object]", value))) if isinstance(value, list) else str(value)
    )


def _beside(text: str, more: str) -> Text:
    """A text, and dim beside it the first line of another one."""
    line, cut, _ = more.partition("\n")
    return terminal_safe(text).append_text(terminal_safe(f"  {line}{' ...' * bool(cut)}", "dim"))


def _rows(console: Console, rows: Sequence[tuple[Text, Text]], title: str = "") -> None:
    if not rows:
        return
    if title:
        console.print(Text(title, "bold"))
    table = Table.grid(padding=(0, 1))
    for row in rows:
        table.add_row(*row)
    console.print(Padding(table, (0, 0, 0, 2 if title else 0)))
