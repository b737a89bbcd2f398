"""Measure one cell: a function from JSON to JSON that any process on any machine can run."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, get_args

from goalscope.agent.settings import (
    Domain,
    Settings,
    load_domain,
    load_likelihood,
    open_environment,
    own_likelihood,
    possible_actions,
    profile_named,
    settings_of,
)
from goalscope.base.types import Goal, GoalscopeError, InvalidInputError, Turn
from goalscope.datasets import Case
from goalscope.envs.grocery import GroceryShop
from goalscope.experiment.dialogue_scores import measure_dialogue, measure_evidence
from goalscope.experiment.identity import hashes_of, identity_of, opened, person_of
from goalscope.experiment.judge import JUDGE_TEMPERATURE, judge
from goalscope.experiment.multiple_choice import Question, measure_question, rephrase
from goalscope.models import OpenModel
from goalscope.models.opening import MODEL_KEYS, forget
from goalscope.storage.session import Session
from goalscope.storage.store import Store, round_to_json

__all__ = ["measure", "perform"]

_AGAIN = "Run it again to plan with what it is now."


def perform(task: Mapping[str, Any]) -> dict[str, Any]:
    """Measure a cell in a worker, with the code and model of the process that planned it.

    Args:
        task: The `spec` of the cell, and the expected `identity`.

    Raises:
        GoalscopeError: This worker has another model, prompt or code.
    """
    spec, expected = task["spec"], task["identity"]
    own = identity_of(spec["model"])
    wrong = [name for name, value in own.items() if expected.get(name) != value]
    if wrong:
        raise GoalscopeError(
            f"A worker has another {' and another '.join(wrong)} than the process that "
            "planned the experiment. Install the same version of goalscope and the same "
            "files on it."
        )
    settings = {**spec, **spec.get("settings", {})}
    load_domain(settings.get("domain", "grocery"))
    if settings.get("likelihood"):
        load_likelihood(settings["likelihood"])
    return measure(spec)


def measure(spec: Mapping[str, Any]) -> dict[str, Any]:
    """Measure a cell with an empty cache, so that the order of cells does not matter."""
    model = opened(spec["model"])
    forget(model)
    return KINDS[spec["kind"]](model, spec)


def _question(model: OpenModel, spec: Mapping[str, Any]) -> dict[str, Any]:
    question = Question(**spec["row"])
    written = not question.rephrasings
    if written:
        question = rephrase(model, question)
    measured = measure_question(model, question, layout=spec["layout"])
    return {**measured, "rephrased": written}


def _dialogue(model: OpenModel, spec: Mapping[str, Any]) -> dict[str, Any]:
    data = spec["case"]  # of `case_to_json`
    turns = tuple(Turn(**turn) for turn in data["turns"])
    goals = tuple(map(Goal, data["goals"]))
    case = Case(data["id"], data["group"], data["task"], turns, goals, data["truth"])
    way: dict[str, Any] = {"layout": spec["layout"]}
    if name := spec.get("likelihood"):
        if hashes_of(Settings(likelihood=name)) != spec["files"]:
            raise InvalidInputError(
                f"{name} has changed since the experiment was planned. {_AGAIN}"
            )
        way["likelihood"] = own_likelihood(name, model)
    if spec["kind"] == "change":
        return measure_evidence(model, case, **way)
    return measure_dialogue(model, case, **way, ask_outright=spec["outright"])


def _episode(model: OpenModel, spec: Mapping[str, Any]) -> dict[str, Any]:
    model_names = {key: spec["model"].get(key) for key in MODEL_KEYS}
    settings = settings_of({**spec["settings"], **model_names})
    profile = profile_named(settings, spec["profile"])
    if person_of(profile) != spec["person"] or hashes_of(settings) != spec["files"]:
        raise InvalidInputError(
            f"The files of {profile.name} (people, catalogue, scene and so on) have changed since "
            f"the experiment was planned. {_AGAIN}"
        )
    start = time.monotonic()
    with open_environment(settings, profile) as env, Store.in_memory() as store:
        session = Session(store, settings, env, model, profile=profile.name)
        rounds = list(session.run())
        info, met, unwanted = session.info, session.checks_met(), session.unwanted()
        verbs = [verb.name for verb in env.verbs]
    results = [result for round in rounds for result in round.results if result.ok]
    acts = [str(result.action) for result in results if not result.terminated]
    return {
        "episode": {
            "begin": {
                "domain": info.domain,
                "profile": info.profile,
                "method": info.method,
                "model": info.model,
                "task": info.task,
                "settings": dict(info.settings),
            },
            "rounds": [round_to_json(round) for round in rounds],
            "ended": info.ended,
            "score": info.score,
        },
        "score": info.score,
        "checks": met,
        "unwanted": unwanted,
        "rounds": len(rounds),
        "terminated": info.ended == "terminated",
        "replans": sum(round.replans for round in rounds),
        "task": info.task,
        "description": profile.description,
        "outcome": rounds[-1].status if rounds else "",
        "actions": acts,
        **({} if settings.domain in get_args(Domain) else {"possible": verbs}),
        "empty": not (env.basket if isinstance(env, GroceryShop) else acts),
        "seconds": time.monotonic() - start,
    }


def _judge(model: OpenModel, spec: Mapping[str, Any]) -> dict[str, Any]:
    trials = judge(
        model,
        task=spec["task"],
        description=spec["description"],
        outcome=spec["outcome"],
        actions=spec["actions"],
        possible=spec.get("possible") or possible_actions(spec["of"]["settings"]["domain"]),
        empty=spec["empty"],
        trials=spec["trials"],
        seed=spec["seed"],
        temperature=spec.get("temperature", JUDGE_TEMPERATURE),
    )
    return {"trials": [asdict(trial) for trial in trials]}


KINDS = {
    "mcq": _question,
    "dialogue": _dialogue,
    "change": _dialogue,
    "episode": _episode,
    "judge": _judge,
}
