"""The same robot in AI2-THOR's own Controller, which starts `unity.py` in place of Unity."""

import sys
from pathlib import Path

import pytest

from commands import run
from goalscope.base.types import Action, GoalscopeError, InvalidInputError
from goalscope.envs.check import check_env
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.envs.house.simulator.world import start_thor
from goalscope.language.dialogue_state import DialogueState
from goalscope.language.matcher import Matcher
from goalscope.language.orders import Order
from unity import executable

pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),  # AI2-THOR never closes its log
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture
def unity(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    pytest.importorskip("ai2thor", reason="the extra [thor] is not installed")
    monkeypatch.setenv("HOME", str(tmp_path))
    return str(executable(tmp_path))


def test_the_laws_of_an_environment_hold_under_the_real_controller(unity: str) -> None:
    robot = HomeRobot(start_thor("Kitchen1", unity))
    try:
        check_env(robot, most=12)
    finally:
        robot.__exit__(None, None, None)


def test_the_robot_cannot_tell_the_two_apart(unity: str) -> None:
    orders = (
        Order("put", "tomato", where="fridge"),
        Order("turn on", "coffee machine"),
        Order("slice", "bread"),
    )
    ours, theirs = HomeRobot(HouseController("Kitchen1")), HomeRobot(start_thor("Kitchen1", unity))
    try:
        assert ours.state().fingerprint == theirs.state().fingerprint
        found = [
            [robot.resolve(order, DialogueState(), Matcher()) for order in orders]
            for robot in (ours, theirs)
        ]
        assert found[0] == found[1]
        plan = [action for each in found[0] for action in each.actions]
        for action in [*plan, Action("put", "egg 1", destination="pan"), Action("open", "pan")]:
            assert ours.step(action) == theirs.step(action)
            assert ours.state().fingerprint == theirs.state().fingerprint
        assert ours.state().text == theirs.state().text
    finally:
        theirs.__exit__(None, None, None)


@pytest.mark.slow
def test_a_run_in_thor_ends_as_a_run_in_the_house(
    unity: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "episodes.db"))
    (tmp_path / "people.toml").write_text(
        '[[profile]]\nname = "cold"\nscene = "Kitchen1"\ndescription = "You want it cold."\n'
        'replies = ["Put the tomato in the fridge."]\n'
        'checks = [{ object = "Tomato", in = "Fridge" }, { no = "Fridge", isOpen = true }]\n'
    )
    common = ["run", "house", "--profile", "cold", "--method", "no-goals", "--json"]
    common += ["--profiles", str(tmp_path / "people.toml")]
    for extra in ([], ["--scene", "Kitchen1", "--simulator", "thor", "--unity", unity]):
        result = run(*[*common, *extra])
        assert result.exit_code == 0, result.output
        assert '"score": 1.0' in result.stdout


def test_what_does_not_start_is_said(unity: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="not an executable"):
        start_thor("Kitchen1", str(tmp_path / "missing"))
    with pytest.raises(GoalscopeError, match=r"does not start.*Atlantis"):
        start_thor("Atlantis", unity)


def test_without_thor_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ai2thor.controller", None)
    with pytest.raises(InvalidInputError, match=r"goalscope\[thor\]"):
        start_thor("Kitchen1")
