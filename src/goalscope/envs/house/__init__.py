"""The home robot of the paper (Sec. 4.2), in AI2-THOR or a compatible embedded house."""

from goalscope.envs.house.profiles import load_profiles
from goalscope.envs.house.robot import HomeRobot
from goalscope.envs.house.simulator.world import HouseController

__all__ = ["HomeRobot", "HouseController", "load_profiles"]
