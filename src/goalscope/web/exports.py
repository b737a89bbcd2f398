"""Saved pages of episodes with ribbons of the belief, and pictures of the room."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from jinja2 import Environment as Templates
from jinja2 import PackageLoader, StrictUndefined
from markupsafe import Markup

from goalscope.agent.planner import undo
from goalscope.agent.round import Round
from goalscope.agent.settings import settings_of
from goalscope.base.text import FORMAT, domain_shown, model_shown, without_invisible
from goalscope.base.types import TRACKING, GoalscopeError, InvalidInputError, pluralize
from goalscope.envs.registry import BUILT_IN, domain_named, open_environment, profile_named
from goalscope.storage.store import EpisodeInfo
from goalscope.web.views import BeliefView, GoalView, StoredEpisode

STATIC = Path(__file__).parent / "static"
STYLES = ("style.css", "belief.css", "talk.css", "saved.css")
WIDTH, HEIGHT = 100, 100
"""Size of a column in the drawing, which the page stretches."""
LEVEL = 0.36
"""Share of a column in which a ribbon is level."""
COLOURS = 9
"""Number of goal colours in style.css: `.c0` and so on."""


@dataclass(frozen=True, slots=True)
class Ribbon:
    """A goal over the rounds.

    Attributes:
        goal: Its text.
        colour: Its class in style.css.
        path: Its outline, as the `d` of an SVG path.
    """

    goal: str
    colour: str
    path: str


def ribbons(beliefs: Sequence[BeliefView]) -> list[Ribbon]:
    """A ribbon for each goal of the episode, from the top; "Unspecified" is last."""
    values: dict[str, list[float]] = {}
    without: set[str] = set()
    for place, belief in enumerate(beliefs):
        for goal in belief.goals:
            row = values.setdefault(goal.text, [0.0] * len(beliefs))
            row[place] = goal.probability
            if goal.unspecified:
                without.add(goal.text)
    drawn: list[Ribbon] = []
    tops = [0.0] * len(beliefs)
    for text in sorted(values, key=lambda text: text in without):
        bottoms = [top + value for top, value in zip(tops, values[text], strict=True)]
        colour = "unspecified" if text in without else f"c{len(drawn) % COLOURS}"
        path = _outline(tops, bottoms)
        drawn.append(Ribbon(text, colour, path))
        tops = bottoms
    return drawn


def _outline(tops: Sequence[float], bottoms: Sequence[float]) -> str:
    """Level in the middle of each column, and straight to the next; back below."""
    places = [place + 0.5 + side for place in range(len(tops)) for side in (-LEVEL / 2, LEVEL / 2)]
    places[0], places[-1] = 0.0, float(len(tops))
    there = zip(places, [y for y in tops for _ in range(2)], strict=True)
    back = zip(places, [y for y in bottoms for _ in range(2)], strict=True)
    points = [*there, *reversed([*back])]
    return f"M{' L'.join(f'{x * WIDTH:.1f} {y * HEIGHT:.2f}' for x, y in points)} Z"


def as_html(info: EpisodeInfo, rounds: Sequence[Round]) -> str:
    """An episode as an HTML page without scripts, to read and print."""
    stored = StoredEpisode.of(info, rounds)
    believed = [round for round in stored.rounds if round.belief]
    drawn = ribbons([round.belief for round in believed if round.belief])
    colours = {ribbon.goal: ribbon.colour for ribbon in drawn}

    def shares_of(belief: BeliefView) -> list[tuple[str, str, float]]:
        return [(_name(goal), colours[goal.text], goal.probability) for goal in belief.goals]

    last = believed[-1].belief if believed else None
    there = {goal.text for goal in last.goals} if last else set[str]()
    gone = [
        (f"{each.goal} (dropped)", each.colour, 0.0) for each in drawn if each.goal not in there
    ]
    style = "\n".join((STATIC / name).read_text(encoding="utf-8") for name in STYLES)
    return _templates().get_template("episode.html.jinja").render(
        episode=stored.episode,
        rounds=stored.rounds,
        known=info.domain in BUILT_IN,
        facts=_facts(info),
        drawn=drawn,
        drawn_rounds=[round.number for round in believed],
        width=WIDTH * len(believed),
        height=HEIGHT,
        legend=[*(shares_of(last) if last else []), *gone],
        shares_of=shares_of,
        room=_room(info, rounds),
        style=style,
        style_hash=b64encode(sha256(style.encode()).digest()).decode(),
    )  # fmt: skip


@cache
def _templates() -> Templates:
    templates = Templates(
        loader=PackageLoader("goalscope", "web"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True, finalize=_visible,
    )  # fmt: skip
    templates.filters["percent"] = _percent
    return templates


def _visible(value: Any) -> Any:
    """What a template writes, without what nobody sees; its own mark-up stays."""
    if not isinstance(value, str) or isinstance(value, Markup):
        return value
    return without_invisible(value, kinds=FORMAT)


def _percent(probability: float) -> str:
    if 0 < probability < 0.005:
        return "<1 %"
    return ">99 %" if 0.995 < probability < 1 else f"{100 * probability:.0f} %"


def _name(goal: GoalView) -> str:
    name = "None of these yet" if goal.unspecified else goal.text
    return f"{name} (confirmed)" if goal.pinned else name


def _facts(info: EpisodeInfo) -> list[str]:
    """Facts about an episode, in the words of the page."""
    return [
        f"{info.created[:16].replace('T', ' ')} UTC",
        "goal tracking" if info.domain == TRACKING else domain_shown(info.domain),
        info.profile or "a person",
        f"method {info.method}",
        model_shown(info.model),
        pluralize(info.rounds, "round"),
        info.ending,
        *([] if info.score is None else [f"score {info.score:.2f}"]),
    ]


def _room(info: EpisodeInfo, rounds: Sequence[Round]) -> str:
    """The final room, in base 64; empty if there is no room to draw."""
    if info.domain not in BUILT_IN or domain_named(info.domain).snapshot is None:
        return ""
    try:
        return b64encode(room_picture(info, rounds).encode()).decode()
    except GoalscopeError:
        return ""


def room_picture(info: EpisodeInfo, rounds: Sequence[Round], *, width: int | None = None) -> str:
    """The room from above after these rounds, as an SVG; changes of the last round stand out.

    Args:
        info: The episode.
        rounds: Its rounds.
        width: Of the map, in px.

    Raises:
        InvalidInputError: There is no room in this domain.
    """
    settings = settings_of(info.settings)
    domain = domain_named(info.domain) if info.domain in BUILT_IN else None
    if domain is None or domain.snapshot is None or not domain.replays(settings):
        raise InvalidInputError("This episode has no room to draw.")
    person = None
    if info.profile and not settings.scene:
        person = profile_named(settings, info.profile)
    with open_environment(settings, person) as env:
        undo(env, [result for round in rounds[:-1] for result in round.results])
        before = domain.snapshot(env)
        for round in rounds[-1:]:
            for result in round.results:
                env.step(result.action)
        return domain.draw(env, before, width)
