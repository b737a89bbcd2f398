"""The shortest complete domain: a lamp. See docs/domain.md."""

from goalscope.base.types import Action, StepResult
from goalscope.envs import Environment, Resolution, State
from goalscope.language.orders import Verb

VERBS = (
    Verb("turn on", "let there be light"),
    Verb("turn off", "let there be none", takes_away=True),
    Verb("finish", "that is all", (), ends=True, phrase="Good night"),
)
ACTIONS = (Action("turn on", "lamp"), Action("turn off", "lamp"), Action("finish"))


class Lamp(Environment):
    """A lamp that is on or off."""

    task = "The agent looks after a lamp."
    verbs, is_on = VERBS, False

    def reset(self):
        self.is_on = False

    def state(self):
        return State(f"The lamp is {'on' if self.is_on else 'off'}.")

    def step(self, action):
        if action not in ACTIONS:
            return StepResult(action, False, "There is only a lamp here.")
        ends = action.name == "finish"
        self.is_on = self.is_on if ends else action.name == "turn on"
        return StepResult(action, True, self.state().text, terminated=ends)

    def resolve(self, order, dialogue, pick):
        if order.do not in [verb.name for verb in VERBS]:
            return Resolution()
        if order.do != "finish" and not pick(order.what, ["lamp"]):
            return Resolution(why=f"There is no {order.what or 'such thing'} here.")
        return Resolution((Action(order.do, "" if order.do == "finish" else "lamp"),))

    def offers(self, text, limit):
        return ["lamp"][:limit]


def open_environment(profile):
    """The lamp, switched off."""
    return Lamp()


def load_profiles(path):
    """Nobody."""
    return ()
