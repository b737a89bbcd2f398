"""The paper's modules by prompts alone (Sec. 3.2, 4.2), for models that were not taught them.

Each is one generation at temperature 0 under a JSON schema. Invalid numbers, repeats and anything
beyond the limits are dropped.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any, cast

from goalscope.agent.planner import Outcome, Want, attempted
from goalscope.agent.round import Guess
from goalscope.base.types import (
    Action,
    Goal,
    GoalChange,
    InvalidInputError,
    Message,
    StepResult,
    Turn,
    UnreadableAnswerError,
    canonical,
)
from goalscope.envs import SEARCH, Environment, Proactive, is_irreversible
from goalscope.language.dialogue_state import DialogueState
from goalscope.models import Generator
from goalscope.models.trace import during
from goalscope.prompts import recent, render

_TURNS = 20  # as many as an episode of the paper has
_GOALS = 5  # of one list
_TERMS = 12
_POSSIBLE = 60  # actions that a plan is made from
_LONGEST = 120  # characters of what is written
_TOKENS = 400

_BEFORE_GOAL = re.compile(r"(the )?(human|person|user) wants( to\b)? ?", re.IGNORECASE)
"""What the prompt puts before each goal, and some models repeat."""


class PromptedWriter:
    """Names goals, removes goals and asks, with a prompt for each.

    Raises:
        InvalidInputError: `model` is no model that writes.
    """

    def __init__(self, model: Generator) -> None:
        if isinstance(model, type) or not hasattr(model, "generate"):
            raise InvalidInputError(
                "model must be a model that is open and can write, such as "
                f"open_model('model.gguf'), not {model!r}."
            )
        self.model = model

    def goals(self, task: str, turns: Sequence[Turn], held: Sequence[str] = ()) -> list[str]:
        """See `goalscope.belief.goal_manager.Proposer`.

        Raises:
            UnreadableAnswerError: The model wrote no list.
        """
        shown = recent(self.model, turns, _TURNS)
        told = {"task": task, "turns": shown, "goals": held}
        lines = self.listed("goals", _GOALS, "prompt_goals", **told)
        bare = {_BEFORE_GOAL.sub("", line): None for line in lines}
        return [goal for goal in bare if goal]

    def unfit(self, task: str, turns: Sequence[Turn], goals: Sequence[Goal]) -> list[GoalChange]:
        """Goals to remove: improbable, unsafe, or irrelevant to the task.

        Raises:
            UnreadableAnswerError: The model wrote no list.
        """
        if not goals:
            return []
        shown = recent(self.model, turns, _TURNS)
        prompt = render("prompt_remove", task=task, turns=shown, goals=goals)
        found = self.numbers("remove", len(goals), prompt)
        reason = "contradicted, irrelevant or unsafe, the model says"
        return [GoalChange("removed", goals[each], reason, final=True) for each in found]

    def question(
        self,
        task: str,
        turns: Sequence[Turn],
        done: str,
        goals: Sequence[str],
    ) -> str:
        """See `goalscope.agent.people.Asker`."""
        shown = recent(self.model, turns, _TURNS)
        prompt = render("prompt_query", task=task, turns=shown, status=done)
        form = {"question": {"type": "string", "maxLength": _LONGEST}}
        try:
            found = self._answer(prompt, form)["question"]
        except UnreadableAnswerError:
            return ""
        return " ".join(found.split()) if isinstance(found, str) else ""

    def listed(self, name: str, most: int, template: str, **values: object) -> list[str]:
        """A list of short, distinct texts.

        Raises:
            UnreadableAnswerError: The model wrote no list.
        """
        item = {"type": "string", "maxLength": _LONGEST}
        form = {name: {"type": "array", "items": item, "maxItems": most}}
        found = self._answer(render(template, **values), form)[name]
        texts = [each for each in cast("list[object]", found) if isinstance(each, str)]
        lines = [" ".join(each.split()).strip(" .") for each in texts]
        distinct = {canonical(line): line for line in lines if 2 < len(line) <= _LONGEST}
        return [*distinct.values()][:most]

    def numbers(self, name: str, count: int, prompt: Sequence[Message]) -> list[int]:
        """Indices (from 0) that the model chose among `count` things numbered from 1.

        Raises:
            UnreadableAnswerError: The model wrote no list.
        """
        item = {"type": "integer", "minimum": 1, "maximum": count}
        form = {name: {"type": "array", "items": item, "maxItems": min(count, _TERMS)}}
        found = cast("list[object]", self._answer(prompt, form)[name])
        given = [each for each in found if type(each) is int and 1 <= each <= count]
        return [each - 1 for each in dict.fromkeys(given)][:_TERMS]

    def _answer(self, prompt: Sequence[Message], form: Mapping[str, Any]) -> dict[str, Any]:
        """The model's answer as an object with these properties.

        Raises:
            UnreadableAnswerError: The model wrote something else.
        """
        schema = {
            "type": "object",
            "properties": form,
            "required": [*form],
            "additionalProperties": False,
        }
        written = self.model.generate(prompt, max_tokens=_TOKENS, schema=schema).text
        try:
            data = json.loads(written)
        except (ValueError, RecursionError):
            data = None
        if not isinstance(data, dict) or not {*form} <= cast("dict[str, Any]", data).keys():
            raise UnreadableAnswerError(
                f"The model was asked for {' and '.join(form)} as JSON, and wrote something else: "
                f"{written[:80]!r}"
            )
        answer = cast("dict[str, Any]", data)
        for key, rule in form.items():
            if rule["type"] == "array" and not isinstance(answer[key], list):
                raise UnreadableAnswerError(f"The model wrote no list of {key}.")
        return answer


class PromptedPlanner:
    """Plans as in the paper: lists what is relevant, then chooses from the possible actions.

    A plan uses each thing once per kind of action. If an action fails, it is excluded and the plan
    made again.

    Args:
        writer: Prompts the model.
        replans: Largest number of plans after the first in one round.
        guarded: Whether what the person ruled out, and what cannot be undone, is left to their
            orders. Without orders, as in the paper, a plan is made of all that is possible.
    """

    def __init__(self, writer: PromptedWriter, *, replans: int = 2, guarded: bool = True) -> None:
        self.writer = writer
        self.replans = replans
        self.guarded = guarded

    def act(
        self,
        env: Environment,
        wants: Sequence[Want],
        turns: Sequence[Turn],
        history: Sequence[StepResult],
        dialogue: DialogueState,
    ) -> Outcome:
        """See `Planner.act`; nothing is done unasked in an environment that is not `Proactive`."""
        if not isinstance(env, Proactive):
            return Outcome()
        shown = recent(self.writer.model, turns, _TURNS)
        goals = sorted((want for want in wants if want.text), key=lambda want: -want.probability)
        told: dict[str, Any] = {"task": env.task, "turns": shown, "goals": goals}
        impossible: dict[Action, StepResult] = {}
        guessed_for = goals[0].text if goals else ""
        with during(module="relevant"):
            terms = self.writer.listed(
                "relevant", _TERMS, "prompt_relevant", **told, things=env.offers("", _POSSIBLE)
            )
        for replans in range(self.replans + 1):
            if self.guarded:
                offered = [action for term in terms for action in env.actions(term, dialogue)]
                found = [action for action in offered if not is_irreversible(env, action)]
            else:
                found = env.possible(terms)
            possible = [each for each in dict.fromkeys(found) if each not in impossible][:_POSSIBLE]
            if not possible:
                break
            prompt = render(
                "prompt_plan", **told, status=env.state().text, actions=[*map(env.phrase, possible)]
            )
            chosen = [possible[each] for each in self.writer.numbers("plan", len(possible), prompt)]
            once: dict[tuple[str, str], Action] = {}
            for each in chosen:
                once.setdefault((each.name, each.target), each)
            plan = [*once.values()]
            done, problem = attempted(env, plan, history)
            if problem is None:
                changes = (each for each in plan if each.name != SEARCH)
                guesses = [Guess(each.target, guessed_for) for each in changes]
                failed = tuple(impossible.values())
                return Outcome(tuple(done), failed, (), tuple(guesses), replans)
            impossible[problem.action] = problem
        return Outcome((), tuple(impossible.values()), (), (), max(0, len(impossible) - 1))
