"""The home robot of the paper (Sec. 4.2), in AI2-THOR or in a house that speaks its language."""

from goalscope.envs.house.conditions import load_profiles
from goalscope.envs.house.robot import HomeRobot
from goalscope.envs.house.simulator.controller import HouseController
from goalscope.envs.house.simulator.scene import Scene
from goalscope.envs.house.simulator.scenes import load_scene
from goalscope.envs.house.simulator.thor import start as start_thor
from goalscope.envs.house.simulator.world import House

__all__ = [
    "HomeRobot",
    "House",
    "HouseController",
    "Scene",
    "load_profiles",
    "load_scene",
    "start_thor",
]
