"""Draw docs/house.svg: a map of the kitchen after the robot has acted.

python docs/house_picture.py
"""

from pathlib import Path

from goalscope.base.types import Action
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.envs.house.room_map import RoomMap

ACTIONS = (
    Action("put", "tomato", destination="fridge"),
    Action("turn on", "coffee machine"),
    Action("open", "fridge"),
    Action("pick up", "apple"),
)


def main() -> None:
    """Act, and write the map."""
    robot = HomeRobot(HouseController("Kitchen1"))
    before = robot.metadata
    for action in ACTIONS:
        result = robot.step(action)
        assert result.ok, result.observation
    drawn = RoomMap(robot.metadata, before, robot.names).svg(720)
    Path(__file__).with_name("house.svg").write_text(drawn, encoding="utf-8")


if __name__ == "__main__":
    main()
