"""The conversations that judge: they load, and each checks something."""

import tomllib
from pathlib import Path

import pytest

from goalscope.envs import grocery, house

FOLDER = Path(__file__).parents[1] / "corpus" / "conversations"


@pytest.mark.parametrize(
    ("domain", "name", "most"),
    [(grocery, "grocery", 30), (house, "house", 20), (grocery, "changing_grocery", 30),
     (house, "changing_house", 15), (grocery, "strangers_grocery", 40),
     (house, "strangers_house", 30)],
)  # fmt: skip
def test_conversations_load_and_check(domain, name, most):
    profiles = domain.load_profiles(FOLDER / f"{name}.toml")
    assert len(profiles) >= most
    assert len({each.name for each in profiles}) == len(profiles)
    assert all(each.replies and len(each.checks) >= 3 for each in profiles)


def test_who_changes_their_aim_may_leave_things_over():
    left = tomllib.loads((FOLDER / "left_over.toml").read_text(encoding="utf-8"))
    names = [
        each.name
        for domain, name in ((grocery, "grocery"), (house, "house"))
        for each in domain.load_profiles(FOLDER / f"changing_{name}.toml")
    ]
    assert sorted(left) == sorted(names)
    assert all(left.values())
