"""What asking about unsure orders costs people.

python benchmarks/asking.py FILE.toml --domain house

The people of a file talk to agents that ask below other margins, in two ways: some answer
truthfully whether what the agent would do is theirs, and silent ones never answer, and say what
they would have said next. An action is theirs if it brings or moves what their checks or `welcome`
name, or takes away what no check needs. To what cannot be undone all say "yes", if it is theirs.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from goalscope import Agent, open_model, run_episode
from goalscope.agent.people import ScriptedHuman, consents
from goalscope.agent.settings import Settings
from goalscope.base.types import Action, Profile, Turn
from goalscope.cli.options import Json
from goalscope.cli.terminal import progress, show_tables
from goalscope.envs import Environment, Outcome
from goalscope.envs.grocery import GroceryShop
from goalscope.envs.grocery.profiles import unwanted
from goalscope.envs.house import HomeRobot
from goalscope.envs.house.profiles import types_in
from goalscope.envs.house.view import View
from goalscope.envs.registry import open_environment, profiles_of
from goalscope.experiment.summary import Row, Table, percent

MARGINS = (0.0, 0.25, 0.5, 1.0)
"""Nats below which the agents ask."""

_ROUNDS = 24


class Person(ScriptedHuman):
    """A scripted person who answers truthfully, or passes over what does not have to be answered.

    Attributes:
        asked: Number of questions about orders that can be undone.
    """

    agent: Agent

    def __init__(self, profile: Profile, env: Environment, *, answers: bool) -> None:
        super().__init__(profile, env)
        self.answers = answers
        self.asked = self.said = 0

    def reply(self, query: str, turns: Sequence[Turn], status: str) -> str:
        """The reply for this round."""
        more = self.said < len(self.profile.replies)
        waits = self.agent.rounds[-1].listed if self.agent.rounds else ()
        if consent := consents(query, self.env, done=not more):
            return consent if not waits or self._mean(waits) else "no"
        if waits and query == self.agent.rounds[-1].question:
            self.asked += 1
            if self.answers:
                return "yes" if self._mean(waits) else "no"
        self.said += 1
        return super().reply(query, [Turn("", "")] * (self.said - 1), status)

    def _mean(self, actions: Sequence[Action]) -> bool:
        return all(means(self.profile, self.env, each) for each in actions)


def means(profile: Profile, env: Environment, action: Action) -> bool:
    """Whether a person wants an action, as far as their checks tell."""
    if isinstance(env, GroceryShop):
        item = env.catalogue.get(action.target)
        needless = bool(item and unwanted(profile, [(item, 1)]))
        return needless if action.name == "remove item" else not needless
    assert isinstance(env, HomeRobot)
    view = View(env.metadata, env.names)
    kinds = {view.type_of(name) for name in (action.target, action.destination) if name}
    return kinds <= types_in(profile)


def figures(file: Path, domain: str, margin: float, *, answers: bool) -> list[float]:
    """Share of needs met, mean score, unwanted things, and questions a person."""
    settings = Settings(domain=domain, profiles=str(file))
    outcomes: list[Outcome] = []
    asked = 0
    with open_model() as model, progress(f"{margin:g} nats") as show:
        people = profiles_of(settings)
        for number, profile in enumerate(people):
            show(number, len(people))
            with open_environment(settings, profile) as env:
                start = env.checks_met(profile).met
                person = Person(profile, env, answers=answers)
                person.agent = Agent(env, model, unsure=margin)
                for _ in run_episode(person.agent, person, max_rounds=_ROUNDS):
                    pass
                now = env.checks_met(profile)
                outcomes.append(Outcome(start, now.met, now.unwanted))
                asked += person.asked
    needs = sum(each.needs for each in outcomes)
    return [
        sum(each.needs_met for each in outcomes) / needs,
        sum(each.score for each in outcomes) / len(outcomes),
        sum(len(each.unwanted or ()) + each.violated for each in outcomes) / len(outcomes),
        asked / len(outcomes),
    ]


def main(
    file: Annotated[Path, typer.Argument(help="People, as for `run --profiles`.")],
    domain: str = "grocery",
    margin: Annotated[list[float], typer.Option(help="Nats; repeatable.")] = [*MARGINS],  # noqa: B006
    as_json: Json = False,
) -> None:
    """Print a row for each margin and kind of people."""
    rows: list[Row] = []
    for each in margin:
        for answers in (True, False):
            met, score, bad, asked = figures(file, domain, each, answers=answers)
            rows.append(
                {
                    "nats": f"{each:g}", "people": "answer" if answers else "silent",
                    "needs met": percent(met), "score": f"{score:.3f}",
                    "unwanted": f"{bad:.2f}", "questions": f"{asked:.2f}",
                }
            )  # fmt: skip
    show_tables([Table("asking", f"Asking the people of {file.name}", rows)], as_json)


if __name__ == "__main__":
    typer.run(main)
