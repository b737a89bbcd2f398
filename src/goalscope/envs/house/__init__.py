"""The home robot of the paper (Sec. 4.2), in AI2-THOR or a compatible embedded house."""

from goalscope.envs.house.profiles import load_profiles
from goalscope.envs.house.robot import HomeRobot
from goalscope.envs.house.simulator.scenes import load_scene
from goalscope.envs.house.simulator.state import Scene
from goalscope.envs.house.simulator.world import House, HouseController, start_thor

__all__ = [
    "HomeRobot",
    "House",
    "HouseController",
    "Scene",
    "load_profiles",
    "load_scene",
    "start_thor",
]
