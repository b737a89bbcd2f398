"""Draw docs/house.svg: one round of a real episode in the kitchen, as the terminal shows it.

python docs/house_picture.py
"""

import re
from pathlib import Path

from rich.console import Console

from goalscope.acting import ActionPlanner
from goalscope.agent import Agent
from goalscope.display import show_round
from goalscope.envs.house import HomeRobot, HouseController, load_profiles
from goalscope.envs.house.picture.terminal import terminal_picture
from goalscope.models.opening import open_model

ROUNDS = 3


def main() -> None:
    """Run the first rounds of the first profile, and keep the picture of the last."""
    model = open_model()
    profile = load_profiles()[0]
    robot = HomeRobot(HouseController(profile.scene))
    agent = Agent(robot, model, planner=ActionPlanner(model))
    before = belief = None
    for reply in profile.replies[:ROUNDS]:
        before, belief = robot.metadata, agent.tracker.belief if agent.tracker else None
        agent.step(agent.ask(), reply)
    console = Console(record=True, width=80, highlight=False, markup=False, emoji=False)
    show_round(console, agent.rounds[-1], belief)
    console.print(terminal_picture(robot.metadata, before))
    target = Path(__file__).with_name("house.svg")
    drawn = console.export_svg(title="goalscope chat house --scene Kitchen1")
    target.write_text(re.sub(r"@font-face \{.*?\}|<!--.*?-->", "", drawn, flags=re.DOTALL))


if __name__ == "__main__":
    main()
