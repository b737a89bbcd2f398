"""What reads text that others wrote: by name, a function of bytes, and bytes that it takes.

Each function raises nothing but goalscope's own errors, whatever it is given: `test_parsers.py`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from tempfile import mkdtemp

from fakes import LampRoom, WordModel, said
from goalscope.agent.people import ask
from goalscope.agent.planner import Want
from goalscope.agent.toolkit import toolkit_of
from goalscope.base.types import UNSPECIFIED, Goal, GoalscopeError, UnreadableAnswerError
from goalscope.belief.calibration import DEFAULT, calibration_named
from goalscope.belief.goal_manager import propose
from goalscope.datasets.case import read_cases
from goalscope.envs import grocery, house
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.grocery.profiles import checks_met
from goalscope.envs.house.profiles import checks_met as conditions_met
from goalscope.envs.house.simulator.scenes import read_scene
from goalscope.envs.house.simulator.state import State
from goalscope.experiment.judge import judge
from goalscope.experiment.multiple_choice import read_questions
from goalscope.experiment.plan import read_experiment
from goalscope.language.dialogue_state import DialogueState
from goalscope.study.plan import read_plan
from houses import house as home

FOLDER = Path(mkdtemp(prefix="goalscope-parsers-"))
CATALOGUE = Catalogue.load()
SHOP = GroceryShop(CATALOGUE)
KITCHEN = home("Kitchen1").metadata()


def kept(name: str, data: bytes) -> Path:
    path = FOLDER / name
    path.write_bytes(data)
    return path


def read_catalogue(data: bytes) -> None:
    shop = Catalogue.load(kept("shop.csv", data))
    assert all(0 < len(item.name) <= 130 and item.name.isprintable() for item in shop.items)


def read_metadata(data: bytes) -> None:
    State(read_scene(kept("scene.json", data)))


def read_room(data: bytes) -> None:
    State(read_scene(kept("room.toml", data)))


def read_profiles(data: bytes) -> None:
    basket = [(item, 2) for item in CATALOGUE.items[:50]]
    for load, met in (
        (grocery.load_profiles, lambda checks: checks_met(checks, basket, bought=True)),
        (house.load_profiles, lambda checks: conditions_met(checks, KITCHEN["objects"])),
    ):
        with suppress(GoalscopeError):
            for profile in load(kept("people.toml", data)):
                assert {*met(profile.checks)} <= {True, False}


class Writes(WordModel):
    """Writes one text, whatever it is asked; it was taught to, or is prompted."""

    def __init__(self, text: str, *, taught: bool = True) -> None:
        super().__init__({"": text})
        self.taught = taught

    @property
    def writer(self) -> WordModel | None:
        return self if self.taught else None


def read_goals(data: bytes) -> None:
    """What a model proposes, and what it names to look for, as plans are made of it."""
    turns = said("I want to bake a cake.")
    for taught in (True, False):
        found = toolkit_of(Writes(text_of(data), taught=taught))
        with suppress(UnreadableAnswerError):
            goals = [UNSPECIFIED, Goal("bake a cake")]
            for change in propose(found.proposer, None, "Shop.", turns, goals):
                assert 2 <= len(change.goal.text) <= 120
        assert "\n" not in ask(found.asker, LampRoom(), turns, "", [])
        for env in (LampRoom(["lamp", "cake", "flour"]), SHOP):
            env.reset()
            with suppress(UnreadableAnswerError):
                wants = [Want("bake a cake", 1.0)]
                outcome = found.planner.act(env, wants, turns, [], DialogueState())
                assert len(outcome.results) <= 40


def read_verdict(data: bytes) -> None:
    shown = {"task": "Shop.", "description": "A cake.", "outcome": "Flour x1"}
    for trial in judge(Writes(text_of(data)), **shown, trials=1):
        assert trial.score is None or 0 <= trial.score <= 3


def text_of(data: bytes) -> str:
    """As the text of a model, in which JSON may have left half a character."""
    return data.decode(errors="surrogateescape")


PROFILES = b"""
[[profile]]
name = "soup"
scene = "Kitchen1"
description = "You want soup."
replies = ["Tomato soup.", "No cream."]
checks = [{ must_have = ["tomatoes"], tag = "vegan", min_quantity = 2 }, { max_total = 60 },
    { must_not_have = ["cream"] }, { bought = false }]
"""
HOME_PROFILES = b"""
[[profile]]
name = "tidy"
scene = "Kitchen1"
description = "You want it tidy."
replies = ["Put the apple in the fridge."]
checks = [{ object = "Apple", in = "Fridge", count = 1 }, { no = "Fridge", isOpen = true }]
"""
ROOM = b"""
name = "Den"
size = [4, 3.5]
[agent]
position = [1, 1]
rotation = 90
[[object]]
type = "DiningTable"
at = [2.5, 2]
label = "desk"
size = [1, 0.7, 0.8]
[[object]]
type = "Mug"
on = "desk"
isDirty = true
[[object]]
type = "Fridge"
at = [3.5, 0.5]
"""
STUDY = b"""
name = "shop"
consent = "C"
instructions = "I"
transcript = true
domain = "grocery"
methods = ["good"]
scale = ["a", "b", "c", "d"]
seed = 3
"""
EXPERIMENT = b"""
title = "T"
models = ["embedded", { model = "http://a.test/v1", tokenizer = "t" }]
[episodes]
domain = "grocery"
profiles = ["all"]
methods = ["good", "no-goals"]
seeds = [0, 1]
[dialogues]
set = "teach"
[judge]
trials = 3
"""
DIALOGUE = {
    "id": "1", "task": "Help.", "goals": ["bake a cake", "make tea"],
    "turns": [{"query": "Yes?", "utterance": "Put the kettle on."}],
}  # fmt: skip
QUESTION = {
    "id": "1", "prompt": "What?", "choices": dict(zip("ABCDE", "vwxyz", strict=True)),
    "answer": "A", "rephrasings": {},
}  # fmt: skip
SCENE = {
    "sceneName": "FloorPlan1", "agent": KITCHEN["agent"],
    "objects": [o for o in KITCHEN["objects"] if o["objectType"] in ("Floor", "Mug", "Fridge")],
}  # fmt: skip
CALIBRATION = {"calibration": json.loads(json.dumps(asdict(DEFAULT)))}

ENTRIES: dict[str, tuple[Callable[[bytes], object], list[bytes]]] = {
    "catalogue": (
        read_catalogue,
        [
            b"name,category,unit,price,tags,brand\nTea,drinks,20 ct,$2.5,vegan,A\nTea,,40 ct,2,,\n",
            'Title;Price;Currency\n"Br\u00f6d; ""white""";1.299,00;\u20ac\n'.encode(),
        ],
    ),
    "scene": (read_metadata, [json.dumps(SCENE).encode()]),
    "room": (read_room, [ROOM]),
    "dialogues": (
        lambda data: read_cases(kept("dialogues.jsonl", data), labelled=False),
        [json.dumps(DIALOGUE).encode() + b"\n\n"],
    ),
    "profiles": (read_profiles, [PROFILES, HOME_PROFILES]),
    "goals": (
        read_goals,
        [
            b"flour\nsugar\n2 lamps\nneeded: cake, lamp\n",
            b'{"goals": ["flour"], "relevant": ["cake", "lamp"], "plan": [1, 2, 9]}',
        ],
    ),
    "verdict": (read_verdict, [b'{"score": 2.25, "explanation": "It fits."}']),
    "questions": (
        lambda data: read_questions(kept("questions.jsonl", data)),
        [json.dumps(QUESTION).encode() + b"\n"],
    ),
    "paper's questions": (
        lambda data: read_questions(kept("questions.csv", data)),
        [b"prompt,A,B,C,D,E,answer\nWhat?,v,w,x,y,z,A\n"],
    ),
    "experiment": (
        lambda data: read_experiment(kept("experiment.toml", data)),
        [EXPERIMENT],
    ),
    "study": (
        lambda data: read_plan(kept("study.toml", data)),
        [STUDY],
    ),
    "calibration": (
        lambda data: calibration_named(str(kept("calibration.json", data))),
        [json.dumps(CALIBRATION).encode()],
    ),
}
