"""Simulated people: a model plays them, and a line of its prompt is their habit."""

import typing

import pytest

from fakes import LampRoom, WordModel, said
from goalscope.agent.people import HABITS, Habit, SimulatedHuman
from goalscope.agent.settings import Settings
from goalscope.base.types import Profile
from goalscope.cli import chat as cli_chat
from goalscope.envs import completion_phrase
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.models import Completion
from goalscope.storage.session import Session
from goalscope.storage.store import Store

READER = Profile("reader", "You want to read in bed. You need a lamp.", ())


class Player(WordModel):
    """Says what it is given, and keeps the prompts and their seeds."""

    def __init__(self, text: str = "I say this.") -> None:
        super().__init__()
        self.text = text
        self.prompts: list[tuple[str, int]] = []

    def generate(self, messages, **settings) -> Completion:
        text = "\n".join(message.content for message in messages)
        self.prompts.append((text, settings.get("seed", 0)))
        return Completion(self.text, "stop", 1, 1)


@pytest.mark.parametrize("habit", typing.get_args(Habit))
def test_a_habit_is_one_line_of_the_prompt(habit) -> None:
    model = Player()
    for each in (None, habit):
        human = SimulatedHuman(model, READER, LampRoom(), 3, each)
        assert human.reply("What else?", said("Hello."), "") == "I say this."
    (plain, seed), (other, _) = model.prompts
    assert other == plain.replace(READER.description, f"{READER.description} {HABITS[habit]}")
    assert seed == 4  # the person's and the number of the turn, so that a resumed one goes on


def test_a_person_who_says_nothing_ends_the_task() -> None:
    human = SimulatedHuman(Player(" "), READER, LampRoom())
    assert human.reply("What else?", [], "") == completion_phrase(LampRoom())


def test_an_episode_keeps_the_habit(tmp_path) -> None:
    settings = Settings(human="terse", method="no-goals", rounds=1)
    model = Player()
    with Store.open(tmp_path / "episodes.db") as store:
        env = GroceryShop(Catalogue.load(None))
        first = Session(store, settings, env, model, profile="cafe")
        assert len([*first.run()]) == 1
        assert store.episode(first.id).settings["human"] == "terse"
    assert any(HABITS["terse"] in prompt for prompt, _ in model.prompts)


def test_the_command_line_knows_every_person() -> None:
    def literals(hint) -> set[str]:
        parts = typing.get_args(hint)
        return {name for part in parts for name in (literals(part) or {part})}

    offered = literals(typing.get_type_hints(cli_chat.run)["human"])
    assert offered | {"you"} == literals(typing.get_type_hints(Settings)["human"])
