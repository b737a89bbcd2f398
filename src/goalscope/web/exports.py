"""Episodes as files that stand alone, and the room from above."""

from __future__ import annotations

from collections.abc import Sequence

from jinja2 import Environment as Templates
from jinja2 import PackageLoader, StrictUndefined

from goalscope.domains import open_environment, settings_of
from goalscope.episode import Round
from goalscope.policy import undo
from goalscope.store import EpisodeInfo
from goalscope.types import InvalidInputError
from goalscope.web.views import EpisodeView, RoundView, StoredEpisode

__all__ = ["as_html", "as_json", "room_picture"]

TEMPLATES = Templates(
    loader=PackageLoader("goalscope", "web"), autoescape=True, undefined=StrictUndefined,
    trim_blocks=True, lstrip_blocks=True,
)  # fmt: skip


def as_json(info: EpisodeInfo, rounds: Sequence[Round]) -> str:
    """An episode with all its rounds, as the page reads them."""
    return _stored(info, rounds).model_dump_json(indent=1)


def as_html(info: EpisodeInfo, rounds: Sequence[Round]) -> str:
    """An episode to read and print, without any script."""
    stored = _stored(info, rounds)
    return TEMPLATES.get_template("episode.html.jinja").render(
        episode=stored.episode, rounds=stored.rounds
    )


def room_picture(info: EpisodeInfo, rounds: Sequence[Round]) -> str:
    """The house's room from above after these rounds, as an SVG; what the last changed stands out.

    Raises:
        InvalidInputError: There is no room in this domain.
    """
    from goalscope.envs.house import HomeRobot
    from goalscope.envs.house.picture_svg import svg_picture

    settings = settings_of(info.settings)
    if info.domain != "house" or settings.simulator != "house":
        raise InvalidInputError("There is no room to be drawn in this episode.")
    env = open_environment(settings)
    try:
        assert isinstance(env, HomeRobot)
        undo(env, [result for round in rounds[:-1] for result in round.results])
        before = env.metadata
        for round in rounds[-1:]:
            for result in round.results:
                env.step(result.action)
        return svg_picture(env.metadata, before, env.names)
    finally:
        env.close()


def _stored(info: EpisodeInfo, rounds: Sequence[Round]) -> StoredEpisode:
    return StoredEpisode(
        episode=EpisodeView.of(info, mine=True), rounds=[RoundView.of(round) for round in rounds]
    )
