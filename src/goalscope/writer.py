"""The writer: a model that was taught to name goals, what they call for, and the next question."""

from __future__ import annotations

from collections.abc import Sequence

from goalscope.occasions import Occasion
from goalscope.prompts import render
from goalscope.types import Message, Turn

__all__ = ["LIKE", "NEEDED", "NICE", "NOT", "goals_written", "needs_written", "prompts"]

LIKE = 4
"""Occasions in the prompt that asks what an aim calls for."""

NEEDED, NICE, NOT = "needed", "nice", "not"
"""What is said of a thing."""


class prompts:
    @staticmethod
    def goals(task: str, turns: Sequence[Turn]) -> list[Message]:
        return render("write_goals", task=task, turns=turns)

    @staticmethod
    def question(task: str, turns: Sequence[Turn], done: str, goals: Sequence[str]) -> list[Message]:
        return render("write_question", task=task, turns=turns, done=done, goals=goals)

    @staticmethod
    def needs(aim: str, said: str, like: Sequence[Occasion], room: str = "", thing: str = "") -> list[Message]:
        return render("write_needs", aim=aim, said=said, like=like, room=room, thing=thing)


def goals_written(goals: Sequence[str]) -> str:
    return "\n".join(goals) or "none"


def needs_written(needed: Sequence[str], nice: Sequence[str]) -> str:
    lines = [f"{NEEDED}: {', '.join(needed)}", *([f"{NICE}: {', '.join(nice)}"] if nice else [])]
    return "\n".join(lines)
