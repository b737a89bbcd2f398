"""The home robot as a domain."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from goalscope.base.types import InvalidInputError, Profile
from goalscope.envs import Environment
from goalscope.envs.house.actions import NAMES
from goalscope.envs.house.profiles import load_profiles
from goalscope.envs.house.robot import HomeRobot
from goalscope.envs.house.room_map import WIDTH, RoomMap
from goalscope.envs.house.simulator.scenes import known_scenes, load_scene
from goalscope.envs.house.simulator.world import HouseController, start_thor
from goalscope.envs.registry import HOUSE, Domain, DomainSettings

SCENE = "Kitchen1"
THOR_SCENE = "FloorPlan1"
"""Where the robot is when nobody says, in the embedded house and in AI2-THOR."""


def _open(settings: DomainSettings, profile: Profile | None) -> Environment:
    scene = settings.scene or (profile.scene if profile else "")
    if settings.simulator == "thor":
        if profile and not settings.scene:
            raise InvalidInputError(
                f"The profile {profile.name} needs the scene {scene}, which AI2-THOR may not "
                "have. Name one of its scenes with --scene."
            )
        return HomeRobot(start_thor(scene or THOR_SCENE, settings.unity))
    loaded = load_scene(scene or SCENE)
    notes = loaded.notes
    if profile and settings.scene and settings.scene != profile.scene:
        notes += (
            f"The profile {profile.name} is written for {profile.scene}; this room may lack "
            "what it needs.",
        )
    return HomeRobot(HouseController(loaded), notes=notes)


def _notes(env: Environment) -> Sequence[str]:
    return env.notes if isinstance(env, HomeRobot) else ()


def _snapshot(env: Environment) -> Any:
    assert isinstance(env, HomeRobot)
    return env.metadata


def _draw(env: Environment, before: Any, width: int | None) -> str:
    assert isinstance(env, HomeRobot)
    return RoomMap(env.metadata, before, env.names).svg(width or WIDTH)


DOMAIN = Domain(
    name=HOUSE,
    label="A robot in a home",
    open=_open,
    load_profiles=load_profiles,
    possible=NAMES,
    about="I find, move and tidy things in a home that you see from above.",
    view="map",
    settings=frozenset({"scene", "simulator", "unity"}),
    alias="robot",
    scenes=lambda: sorted(known_scenes()),
    notes=_notes,
    replays=lambda settings: settings.simulator == "embedded",
    judged=("actions",),
    snapshot=_snapshot,
    draw=_draw,
)
