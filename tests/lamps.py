"""An agent in a room with a lamp, for the tests of several files."""

from fakes import GOALS, NEEDS, QUESTION, LampRoom, WordModel
from goalscope.agent.agent import Agent
from goalscope.base.types import UnreadableAnswerError

REPLIES = {
    GOALS: "have lamp light\nhave lamp light\nsleep without light",
    NEEDS: "needed: lamp, book",
    QUESTION: "Is it bright enough?",
}
RANKS = {"the most likely": '"2"', "the least likely": '"1"'}

ROOM = ("lamp", "light", "fan")


def agent_in(room: LampRoom, method: str = "good", **settings) -> Agent:
    model = settings.pop("model", None) or WordModel(REPLIES)
    return Agent(room, model, method=method, **settings)


class Writes:
    """Proposes the goals that it was given."""

    def __init__(self, *goals: str) -> None:
        self.given = goals

    def goals(self, task, turns, held):
        return list(self.given)


class Speechless:
    """Writes nothing that can be read when asked which goals to remove."""

    def unfit(self, task, turns, goals):
        raise UnreadableAnswerError("nothing that can be read")
