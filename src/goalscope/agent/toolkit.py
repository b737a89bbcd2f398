"""Algorithm 1's modules besides inference: how an agent proposes, removes, plans and asks."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Literal, get_args

from goalscope.agent.people import Asker
from goalscope.agent.planner import NeedPlanner, Planner
from goalscope.agent.prompted import PromptedPlanner, PromptedWriter
from goalscope.agent.writer import Writer
from goalscope.base.types import InvalidInputError
from goalscope.belief.goal_manager import Proposer
from goalscope.models import Model, Roles

Preset = Literal["paper"]
"""A choice of all that differs from the paper; see `Agent`."""

Module = Literal["propose", "remove", "plan", "query"]

MODULES: tuple[Module, ...] = get_args(Module)
"""What the paper's prompts can do."""


def modules_named(names: Iterable[str]) -> tuple[Module, ...]:
    """The modules of these names; "all" stands for all of them.

    Raises:
        InvalidInputError: There is no such module.
    """
    found: list[Module] = []
    for name in names:
        if name not in (*MODULES, "all"):
            raise InvalidInputError(
                f"There is no module {name!r}. Choose one of {', '.join(MODULES)}, or all."
            )
        found.extend(each for each in MODULES if name in (each, "all"))
    return tuple(dict.fromkeys(found))


@dataclass(frozen=True, slots=True)
class Toolkit:
    """What an agent uses for each job.

    Attributes:
        proposer: Names goals.
        remover: Removes goals by a prompt; None to remove them by likelihood.
        planner: Chooses what to do unasked.
        asker: Writes queries.
    """

    proposer: Proposer
    remover: PromptedWriter | None
    planner: Planner
    asker: Asker


def is_paper(preset: Preset | None) -> bool:
    """Whether the preset is the paper's.

    Raises:
        InvalidInputError: There is no such preset.
    """
    if preset not in (None, "paper"):
        raise InvalidInputError(f'preset must be "paper" or None, not {preset!r}')
    return preset == "paper"


def toolkit_of(
    model: Model, prompted: Collection[Module] = (), *, preset: Preset | None = None
) -> Toolkit:
    """The modules of a model: those that it was taught, or else the paper's prompts.

    Args:
        model: From `open_model`, or any that writes.
        prompted: Modules that use the paper's prompts in any case.
        preset: "paper" to prompt them all, and to plan as in the paper.

    Raises:
        InvalidInputError: The model does not write, or there is no such preset.
    """
    paper = is_paper(preset)
    prompted = MODULES if paper else prompted
    by_prompt = PromptedWriter(model)
    writer = Writer(model.writer) if isinstance(model, Roles) and model.writer else None
    planner = PromptedPlanner(by_prompt, guarded=not paper)
    return Toolkit(
        proposer=writer if writer and "propose" not in prompted else by_prompt,
        remover=by_prompt if "remove" in prompted else None,
        planner=NeedPlanner(writer) if writer and "plan" not in prompted else planner,
        asker=writer if writer and "query" not in prompted else by_prompt,
    )
