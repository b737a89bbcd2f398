"""The conversations that judge: they load, and each checks something."""

from pathlib import Path

import pytest

from goalscope.envs import grocery, house

FOLDER = Path(__file__).parents[1] / "corpus" / "conversations"


@pytest.mark.parametrize(("domain", "most"), [(grocery, 30), (house, 20)])
def test_conversations_load_and_check(domain, most):
    name = domain.__name__.rpartition(".")[2]
    profiles = domain.load_profiles(FOLDER / f"{name}.toml")
    assert len(profiles) >= most
    assert len({each.name for each in profiles}) == len(profiles)
    assert all(each.replies and len(each.checks) >= 3 for each in profiles)
