"""Infer a person's goals from open dialogue, as an explicit belief, and act on it."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    __version__: str
    from goalscope.agent.agent import Agent, run_episode
    from goalscope.agent.round import Round
    from goalscope.base.types import (
        UNSPECIFIED,
        ConflictError,
        Goal,
        GoalscopeError,
        InvalidInputError,
        ModelError,
        Turn,
        UnreadableAnswerError,
    )
    from goalscope.belief.belief import Belief
    from goalscope.belief.calibration import PAPER, Calibration
    from goalscope.belief.tracker import GoalTracker
    from goalscope.models.opening import open_model

__all__ = [
    "PAPER",
    "UNSPECIFIED",
    "Agent",
    "Belief",
    "Calibration",
    "ConflictError",
    "Goal",
    "GoalTracker",
    "GoalscopeError",
    "InvalidInputError",
    "ModelError",
    "Round",
    "Turn",
    "UnreadableAnswerError",
    "open_model",
    "run_episode",
]

_HOME = {
    "Agent": "agent.agent",
    "Belief": "belief.belief",
    "Calibration": "belief.calibration",
    "GoalTracker": "belief.tracker",
    "PAPER": "belief.calibration",
    "Round": "agent.round",
    "open_model": "models.opening",
    "run_episode": "agent.agent",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that `goalscope --help` stays quick."""
    if name == "__version__":
        return import_module("importlib.metadata").version("goalscope")
    if name not in __all__:
        raise AttributeError(f"module 'goalscope' has no attribute {name!r}")
    return getattr(import_module(f"goalscope.{_HOME.get(name, 'base.types')}"), name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
