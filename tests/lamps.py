"""An agent in a room with a lamp, for the tests of several files."""

from fakes import LampRoom, WordModel
from goalscope.agent import Agent
from goalscope.policy import Planner

REPLIES = {
    "name what the human may want": "- have lamp light\n- have lamp light\n- sleep without light",
    "lists of what is needed": "- lamp\n- book",
    "short question": "Is it bright enough?",
}
RANKS = {"the most likely": '"2"', "the least likely": '"1"'}

ROOM = ("lamp", "light", "fan")


def agent_in(room: LampRoom, method: str = "good", **settings) -> Agent:
    model = settings.pop("model", None) or WordModel(REPLIES)
    planner = Planner(model, limit=1)
    return Agent(room, model, method=method, planner=planner, **settings)
