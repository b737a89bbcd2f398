"""The writer: names goals that explain a conversation, what an aim calls for, and a question.

A `Writer` is a model that was taught these jobs (see `goalscope.fitting`), so its prompts are
short. Other models are prompted by `goalscope.agent.prompted`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from goalscope.base.arrays import Array
from goalscope.base.stats import log_softmax
from goalscope.base.types import Turn, canonical
from goalscope.envs.scenarios import Scenario
from goalscope.models import Model
from goalscope.models.scoring import logprobs_of
from goalscope.prompts import recent, render

JUDGEMENTS = ("needed", "nice", "not")
"""Judgements of a thing under an aim: needed, nice to have, or not wanted."""

NOTHING = "none"
"""The answer if there is no goal, or no question."""

_SURE = -7.0
"""Lowest log-probability, in nats, of a question that is asked.

Four in five of the questions above it are sensible, one in five of all.
"""
_TURNS = 6
_WRITTEN = 2  # goals of the writer, beside the one of a scenario
_MOST_TOKENS = {"goals": 96, "question": 32, "needs": 128}


class Writer:
    """A model that was taught to name goals, needs and questions.

    Args:
        model: Writes and scores.
    """

    def __init__(self, model: Model) -> None:
        self.model = model

    def goals(self, task: str, turns: Sequence[Turn], held: Sequence[str] = ()) -> list[str]:
        """See `goalscope.belief.goal_manager.Proposer`; goals of the belief may be among them."""
        written = self._written("goals", "write_goals", task=task, turns=self.recent(turns))
        lines = [" ".join(line.split()) for line in written.split("\n")]
        distinct = {canonical(line): line for line in reversed(lines) if 2 < len(line) <= 120}
        return [line for line in reversed(distinct.values()) if canonical(line) != NOTHING]

    def question(
        self,
        task: str,
        turns: Sequence[Turn],
        done: str,
        goals: Sequence[str],
    ) -> str:
        """See `goalscope.agent.people.Asker`; "" if the question is too unlikely to be sensible."""
        told = {"task": task, "turns": self.recent(turns), "done": done, "goals": goals}
        prompt = render("write_question", **told)
        reply = self.model.generate(prompt, max_tokens=_MOST_TOKENS["question"])
        line = " ".join(reply.text.split("\n")[0].split())
        sure = reply.log_probability is None or reply.log_probability > _SURE
        return line if sure and reply.finish != "length" and line.endswith("?") else ""

    def needs(self, aim: str, said: str, like: Sequence[Scenario], room: str = "") -> list[str]:
        """What an aim calls for, in the style of scenarios, the most needed first.

        Args:
            aim: In one phrase; "" if only the words are known.
            said: The person's words.
            like: Similar scenarios.
            room: Description of the place, if it matters.
        """
        written = self._written(
            "needs", "write_needs", aim=aim, said=said, like=like, room=room, thing=""
        )
        found: dict[str, None] = {}
        for line in written.split("\n"):
            head, _, rest = line.partition(":")
            if head in JUDGEMENTS[:2]:
                found |= dict.fromkeys(filter(None, (each.strip() for each in rest.split(","))))
        return [*found]

    def judged(
        self,
        things: Sequence[str],
        aims: Sequence[str],
        said: str,
        like: Sequence[Scenario],
        room: str = "",
    ) -> Array:
        """[aims, things, 3] probabilities of `JUDGEMENTS`.

        Args:
            things: Things to judge.
            aims: See `needs`, as for the others.
            said: The person's words.
            like: Similar scenarios.
            room: Description of the place.
        """
        told = {"said": said, "like": like, "room": room}
        prompts = [
            render("write_needs", aim=aim, thing=thing, **told) for aim in aims for thing in things
        ]
        contexts = [prompt for prompt in prompts for _ in JUDGEMENTS]
        scores = logprobs_of(self.model, contexts, [*JUDGEMENTS] * len(prompts))
        nats = np.array([float(score.sum()) for score in scores])
        return np.exp(log_softmax(nats.reshape(len(aims), len(things), len(JUDGEMENTS))))

    def recent(self, turns: Sequence[Turn]) -> Sequence[Turn]:
        """The newest turns, as many as a prompt shows."""
        return recent(self.model, turns, _TURNS)

    def _written(self, kind: str, template: str, **values: object) -> str:
        """The model's text; if it was cut short, without its last line or thing."""
        reply = self.model.generate(render(template, **values), max_tokens=_MOST_TOKENS[kind])
        if reply.finish != "length":
            return reply.text
        return reply.text.rpartition("," if kind == "needs" else "\n")[0]


class Recalling:
    """Adds the aim of the most similar scenario to the goals that a writer names.

    A writer's goals keep close to the words; a scenario's aim is worded as people would.

    Args:
        writer: Names goals. If it names none, nothing is added.
        like: Finds scenarios; see `goalscope.envs.Environment.like`.
    """

    def __init__(self, writer: Writer, like: Callable[[str, int], Sequence[Scenario]]) -> None:
        self.writer = writer
        self.like = like

    def goals(self, task: str, turns: Sequence[Turn], held: Sequence[str] = ()) -> list[str]:
        """See `goalscope.belief.goal_manager.Proposer`."""
        written = self.writer.goals(task, turns, held)
        if not written:
            return []
        said = " ".join(turn.utterance for turn in self.writer.recent(turns))
        return [*written[:_WRITTEN], *(each.aim for each in self.like(said, 1))]
