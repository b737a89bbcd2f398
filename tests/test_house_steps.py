"""What belongs to each of the robot's actions, and how it takes back a failure."""

from typing import Any

import pytest

from fakes import WordModel
from goalscope.agent.agent import Agent
from goalscope.base.types import Action, GoalscopeError, Profile
from goalscope.envs import Environment
from goalscope.envs.check import check_env
from goalscope.envs.house import HomeRobot, HouseController, load_profiles
from goalscope.language.dialogue_state import DialogueState, fold
from goalscope.language.orders import Reading, orders_from_text

FREE = DialogueState()


@pytest.fixture
def robot() -> HomeRobot:
    return HomeRobot(HouseController("Kitchen1"))


def thing(robot: HomeRobot, object_type: str, number: int = 0) -> dict[str, Any]:
    found = [each for each in robot.metadata["objects"] if each["objectType"] == object_type]
    return found[number]


class Counting(HouseController):
    """Keeps the names of all steps, and can be told to die."""

    def __init__(self, scene: str) -> None:
        self.steps: list[dict[str, Any]] = []
        self.dead = False
        super().__init__(scene)

    def step(self, action: Any = None, **arguments: Any) -> Any:
        if self.dead:
            raise TimeoutError("no answer")
        self.steps.append({"action": action, **arguments})
        return super().step(action, **arguments)


@pytest.mark.parametrize("scene", ["Kitchen1", "LivingRoom1", "Bedroom1", "Bathroom1"])
def test_the_robot_keeps_the_laws_of_an_environment(scene: str) -> None:
    environment: Environment = HomeRobot(HouseController(scene))
    check_env(environment, [each for each in load_profiles() if each.scene == scene])


def test_each_act_is_done_from_a_pose_that_reaches_the_object() -> None:
    controller = Counting("Kitchen1")
    robot = HomeRobot(controller)
    assert robot.step(Action("put", "tomato", destination="fridge")).ok
    names = [step["action"] for step in controller.steps]
    teleports = [n for n, name in enumerate(names) if name == "Teleport"]
    for n, step in enumerate(controller.steps):
        if step["action"] in ("PickupObject", "OpenObject", "PutObject"):
            assert n - 1 in teleports
            if step["action"] != "PutObject":
                assert "forceAction" not in step


def test_put_brings_the_object_and_leaves_doors_as_they_were(robot: HomeRobot) -> None:
    assert robot.step(Action("put", "tomato", destination="fridge")).ok
    assert "Fridge" in str(thing(robot, "Tomato")["parentReceptacles"])
    assert thing(robot, "Tomato")["temperature"] == "Cold"
    assert not thing(robot, "Fridge")["isOpen"]
    assert robot.step(Action("open", "fridge")).ok
    assert robot.step(Action("put", "apple", destination="fridge")).ok
    assert thing(robot, "Fridge")["isOpen"]


def test_hand_holds_one_object_and_puts_back_the_other(robot: HomeRobot) -> None:
    home = thing(robot, "Apple")["parentReceptacles"]
    assert robot.step(Action("pick up", "apple")).ok
    told = robot.step(Action("pick up", "tomato")).observation
    assert told == "The tomato is in the robot's hand; the apple went back to counter 2."
    assert [each["objectType"] for each in robot.metadata["inventoryObjects"]] == ["Tomato"]
    assert thing(robot, "Apple")["parentReceptacles"] == home


def test_knob_stands_for_its_burner(robot: HomeRobot) -> None:
    burners = [name for name in robot._view.names.values() if name.startswith("stove burner")]
    assert robot.step(Action("turn on", burners[0])).ok
    lit = [o for o in robot.metadata["objects"] if o["isToggled"] and "Stove" in o["objectType"]]
    assert sorted(each["objectType"] for each in lit) == ["StoveBurner", "StoveKnob"]


def test_failed_action_is_taken_back_whole() -> None:
    controller = Counting("Kitchen1")
    robot = HomeRobot(controller)
    assert robot.step(Action("pick up", "apple")).ok
    before = robot.state().fingerprint
    steps = len(controller.steps)
    result = robot.step(Action("put", "tomato", destination="toaster"))
    assert not result.ok
    assert result.observation == "the tomato does not go in or on the toaster"
    assert "PickupObject" in [step["action"] for step in controller.steps[steps:]]
    assert robot.state().fingerprint == before


class Drifting(HouseController):
    """A house in which the second start differs from the first."""

    def reset(self) -> Any:
        event = super().reset()
        if getattr(self, "started", 0) > 1:
            apple = next(each for each in self._house.state.objects if "Apple" in each)
            super().step("PickupObject", objectId=apple, forceAction=True)
            event = super().step("DropHandObject", forceAction=True)
        self.started = getattr(self, "started", 0) + 1
        return event


def test_robot_stops_when_the_house_is_not_as_it_was() -> None:
    robot = HomeRobot(Drifting("Kitchen1"))
    with pytest.raises(GoalscopeError, match="not as it was"):
        robot.step(Action("put", "tomato", destination="toaster"))


def test_simulator_that_dies_is_told_and_the_rounds_are_kept() -> None:
    controller = Counting("Kitchen1")
    robot = HomeRobot(controller)
    agent = Agent(robot, WordModel(), method="no-goals")
    agent.step("What?", "put tomato | where fridge")
    controller.dead = True
    with pytest.raises(GoalscopeError, match="stopped answering"):
        agent.step("What else?", "put apple | where fridge")
    assert len(agent.rounds) == 1
    again = Agent(HomeRobot(HouseController("Kitchen1")), WordModel(), method="no-goals")
    again.resume(agent.rounds)
    assert again.env.state().text == agent.rounds[-1].status


def test_what_an_action_tells_is_what_has_changed(robot: HomeRobot) -> None:
    acts = [
        (Action("clean", "mug 1"), "Mug 1 is clean."),
        (Action("fill", "mug 1"), "Mug 1 is filled with water."),
        (Action("empty", "mug 1"), "Mug 1 is empty."),
        (Action("open", "fridge"), "The fridge is open."),
        (Action("put", "mug 1", destination="fridge"), "Mug 1 is in the fridge."),
        (Action("close", "fridge"), "The fridge is closed."),
        (Action("pick up", "mug 1"), "Mug 1 is in the robot's hand."),
        (Action("turn on", "coffee machine"), "The coffee machine is on."),
        (Action("turn off", "coffee machine"), "The coffee machine is off."),
        (Action("slice", "bread"), "The bread is sliced; this cannot be undone."),
        (Action("break", "bowl"), "The bowl is broken; this cannot be undone."),
        (Action("push", "garbage can"), "The garbage can is on the floor."),
    ]
    for action, told in acts:
        assert robot.step(action).observation == told


def test_what_changed_of_a_type_that_the_profile_names_nowhere_is_unwanted(
    robot: HomeRobot,
) -> None:
    checks = ({"object": "Apple", "in": "Fridge"},)
    assert robot.step(Action("put", "apple", destination="fridge")).ok
    assert robot.step(Action("turn on", "coffee machine")).ok
    for welcome, unwanted in (("Mug", ("coffee machine",)), ("CoffeeMachine", ())):
        profile = Profile("p", "d", ("r",), checks, welcome=(welcome,))
        assert robot.checks_met(profile).unwanted == unwanted
    assert robot.checks_met(Profile("p", "d", ("r",), checks)).unwanted is None  # nobody can tell


@pytest.mark.parametrize(
    ("need", "actions"),
    [
        ("put apple | where fridge", ["put: apple -> fridge"]),
        ("open fridge", ["open: fridge"]),
        ("turn on coffee machine", ["turn on: coffee machine"]),
        ("turn on microwave", []),
        ("put pillow | where bed", []),
        ("put apple", ["pick up: apple"]),
        ("put apple | where moon", []),
        ("avoid apple", []),
        ("apple", []),
        ("\ud800", []),
        ("put apple | where fridge\nopen microwave", ["put: apple -> fridge", "open: microwave"]),
    ],
)
def test_a_need_is_an_order_of_what_is_here_that_heats_nothing(
    robot: HomeRobot, need: str, actions: list[str]
) -> None:
    assert [str(each) for each in robot.serving(need, FREE)] == actions


@pytest.mark.parametrize(
    "said", ["avoid apple", "avoid fridge", "put apple | where sink", "ask apple"]
)
def test_no_need_is_served_with_what_was_ruled_out_or_ordered(robot: HomeRobot, said: str) -> None:
    need = "put apple | where fridge"
    orders = orders_from_text(said, robot.verbs)
    served = robot.serving(need, fold([Reading(orders)]))
    assert bool(served) == (said == "ask apple")


def test_the_robot_tells_what_is_here_and_finds_scenarios_like_it(robot: HomeRobot) -> None:
    assert {"apple", "coffee machine", "fridge"} <= {*robot.room().split(", ")}
    like = robot.like("I'd like a coffee", 4)
    assert len(like) == 4
    assert {each.domain for each in like} == {"house"}
    assert any("coffee machine" in need for each in like for need in each.needed)


def test_fingerprint_tells_liquids_and_doors_apart_and_no_tremor(robot: HomeRobot) -> None:
    seen = {robot.state().fingerprint}
    for name in ("fill", "fill with wine"):
        robot.reset()
        assert robot.step(Action(name, "cup")).ok
        seen.add(robot.state().fingerprint)
    assert len(seen) == 3
    robot.reset()
    robot._view.table[robot._view.id("apple")]["position"]["x"] += 0.004
    assert robot.state().fingerprint in seen
    robot._view.table[robot._view.id("apple")]["position"]["x"] += 0.1
    assert robot.state().fingerprint not in seen


def test_thing_in_the_hand_goes_back_to_the_innermost_place(robot: HomeRobot) -> None:
    assert robot.step(Action("put", "apple", destination="plate 1")).ok
    assert robot.step(Action("pick up", "apple")).ok
    assert robot.step(Action("pick up", "knife")).ok
    assert "Plate" in str(thing(robot, "Apple")["parentReceptacles"])


def test_running_microwave_is_turned_off_to_be_opened_and_that_is_told(robot: HomeRobot) -> None:
    assert robot.step(Action("turn on", "microwave")).ok
    result = robot.step(Action("put", "apple", destination="microwave"))
    assert result.ok
    assert "microwave was running, and is off now" in result.observation


class Refusing(Counting):
    """Teleports fail after the second start."""

    starts = 0

    def reset(self) -> Any:
        self.starts += 1
        return super().reset()

    def step(self, action: Any = None, **arguments: Any) -> Any:
        if self.starts > 2 and action == "Teleport":
            return super().step("PutObject", objectId="nowhere")
        return super().step(action, **arguments)


def test_replay_that_fails_stops_the_robot_with_a_clear_error() -> None:
    robot = HomeRobot(Refusing("Kitchen1"))
    assert robot.step(Action("put", "apple", destination="fridge")).ok
    with pytest.raises(GoalscopeError, match="could not be done again"):
        robot.step(Action("put", "tomato", destination="toaster"))


def test_no_goal_lights_a_fire_or_runs_a_tap(robot: HomeRobot) -> None:
    for kind in robot.offers("", 99):
        for action in robot.actions(kind, FREE):
            hot = any(word in action.target for word in ("stove", "microwave", "toaster", "faucet"))
            assert not (action.name == "turn on" and hot)


@pytest.mark.parametrize(
    ("thing", "vessel"),
    [("lettuce", "mug"), ("knife", "bowl"), ("fork", "cup"), ("spatula", "mug"), ("bread", "cup")],
)
def test_nothing_is_put_unasked_where_it_would_stick_out(
    robot: HomeRobot, thing: str, vessel: str
) -> None:
    offered = robot.actions(thing, FREE)
    kinds = {action.destination.split(" ")[0] for action in offered if action.name == "put"}
    assert kinds
    assert vessel not in kinds


def test_nothing_is_put_unasked_into_a_vessel_without_room(robot: HomeRobot) -> None:
    put = Action("put", "tomato", destination="bowl")
    assert put in robot.actions("tomato", FREE)
    assert robot.step(Action("put", "apple", destination="bowl")).ok
    assert put not in robot.actions("tomato", FREE)
    assert not robot.step(put).ok
