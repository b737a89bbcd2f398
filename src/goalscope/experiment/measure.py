"""Measure one cell: a function from JSON to JSON that any process on any machine can run."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from functools import cache
from pathlib import Path
from statistics import fmean
from typing import Any

import goalscope
from goalscope.agent.settings import Settings, load_own, own_likelihood, settings_of
from goalscope.base.stats import log_softmax
from goalscope.base.types import (
    UNSPECIFIED,
    Action,
    GoalscopeError,
    InvalidInputError,
    Profile,
)
from goalscope.belief.likelihood import Likelihood, RolePlay, evidence_of, likeness
from goalscope.datasets.case import case_from_json, said_key
from goalscope.datasets.goal_sets import goal_key
from goalscope.envs import Environment, Outcome, execute
from goalscope.envs.registry import (
    BUILT_IN,
    SHOP,
    Domain,
    domain_named,
    load_domain,
    open_environment,
    profile_named,
)
from goalscope.experiment.baselines import bm25, embedding, outright, outright_letters, tfidf
from goalscope.experiment.fitted_baselines import Fitted, fitted_on
from goalscope.experiment.judge import JUDGE_TEMPERATURE, judge
from goalscope.experiment.multiple_choice import Question, measure_question, rephrase
from goalscope.models.adapters import FITTED_DIALOGUES, FITTED_GOALS
from goalscope.models.opening import (
    MODEL_KEYS,
    ModelSet,
    adapter_metadata,
    forget,
    model_label,
    open_model,
)
from goalscope.storage.session import Session
from goalscope.storage.store import Store, round_to_json

_WITHOUT_EFFECT = ("cli", "datasets", "experiment", "fitting", "report", "study", "web")
"""Rooms that do not affect the results."""

_WITH_EFFECT = (
    "baselines.py", "fitted_baselines.py", "judge.py", "measure.py", "multiple_choice.py",
)  # fmt: skip
"""The modules of `experiment` that do."""

_open: dict[str, ModelSet] = {}
_fingerprints: dict[str, str] = {}
_methods: dict[tuple[str, str], Likelihood] = {}
"""The methods of one's own that a process has made, by their name and the model's."""


def opened(model: Mapping[Any, Any]) -> ModelSet:
    """The model of a cell, kept open until another one is opened."""
    key = _key(model)
    if key not in _open:
        _methods.clear()
        for other in list(_open):
            _open.pop(other).close()
        names: dict[str, Any] = {name: model.get(name) for name in MODEL_KEYS}
        _open[key] = open_model(**names)
    return _open[key]


def identity_of(model: Mapping[str, Any]) -> dict[str, str]:
    """Short hashes of the version, the code, the prompts and the model, which is opened for it."""
    key = _key(model)
    if key not in _fingerprints:
        _fingerprints[key] = _short(opened(model).fingerprint)
    label = f"model {model_label(model)}"
    return {**own_identity(), f"{label} #{_short(key)[:4]}" if model else label: _fingerprints[key]}


@cache
def own_identity() -> dict[str, str]:
    """The version of goalscope, and short hashes of its code and prompts."""
    root = Path(goalscope.__file__).parent
    files = sorted(each.relative_to(root) for each in root.rglob("*"))
    code = [
        file
        for file in files
        if (file.suffix in (".py", ".csv", ".toml", ".jsonl") or file.match("calibrations/*.json"))
        and (
            file.parts[0] not in _WITHOUT_EFFECT
            or (file.parts[0] == "experiment" and file.name in _WITH_EFFECT)
        )
    ]
    prompts = [file for file in files if file.suffix == ".jinja"]

    def digest(own: Iterable[Path]) -> str:
        return _short("".join(f"{f.name} {_short((root / f).read_bytes())}\n" for f in own))

    version = importlib.metadata.version("goalscope")
    return {"version": version, "code": digest(code), "prompts": digest(prompts)}


def person_of(profile: Profile) -> dict[str, Any]:
    """The whole profile as JSON: part of a cell, so that editing a person makes a new cell."""
    return _json_of(profile)


def hashes_of(settings: Settings) -> dict[str, str]:
    """Hashes of the files named in the settings: domain, catalogue and so on.

    Not of the file of people, of whom a cell holds its own (see `person_of`).
    """
    own = settings.likelihood.rpartition(":")[0] if settings.likelihood else None
    named = {
        "domain": None if settings.domain in BUILT_IN else settings.domain,
        "likelihood": own,
        "method": settings.method.rpartition(":")[0],
        "catalogue": settings.catalogue,
        "scene": settings.scene,
        "calibration": settings.calibration,
    }
    return {
        key: _short(Path(file).read_bytes())
        for key, file in named.items()
        if file and os.path.isfile(file)
    }


def _json_of(data: Profile | Outcome) -> dict[str, Any]:
    return json.loads(json.dumps(asdict(data)))


def _key(model: Mapping[Any, Any]) -> str:
    return json.dumps(dict(model), sort_keys=True)


def _short(content: str | bytes) -> str:
    data = content.encode() if isinstance(content, str) else content
    return hashlib.sha256(data).hexdigest()[:12]


def _check_files(what: str, found: Mapping[str, Any], planned: Mapping[str, Any]) -> None:
    """Refuse files that are not as they were when the experiment was planned."""
    if found != planned:
        raise InvalidInputError(
            f"{what} changed since the experiment was planned. Run it again to plan with what it "
            "is now."
        )


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
            "planned the experiment, so its files have changed since. Run the command again."
        )
    settings = {**spec, **spec.get("settings", {})}
    load_domain(settings.get("domain", SHOP))
    for own in (settings.get("likelihood"), settings.get("method"), *spec.get("methods", ())):
        if own and ":" in own:
            load_own(own)
    return measure(spec)


def measure(spec: Mapping[str, Any]) -> dict[str, Any]:
    """Measure a cell with an empty cache, so that the order of cells does not matter."""
    model = opened(spec["model"])
    forget(model)
    return KINDS[spec["kind"]](model, spec)


def _question(model: ModelSet, spec: Mapping[str, Any]) -> dict[str, Any]:
    question = Question(**spec["row"])
    written = not question.rephrasings
    if written:
        question = rephrase(model, question)
    measured = measure_question(model, question, layout=spec["layout"])
    return {**measured, "rephrased": written}


def _dialogue(model: ModelSet, spec: Mapping[str, Any]) -> dict[str, Any]:
    """Evidence for each goal after each turn, by every way.

    Returns:
        `role-play` [T, G] log-likelihoods in nats, turn by turn, by the role-play likelihood or
        another one; `unspecified` [T], the same without a goal; `likeness` [T, G] of the words and
        each goal, beside role-play; `calibration`, how they become probabilities; `window`, the
        first turn that the model could still read at the end; `tfidf`, `bm25`, `embedding` [T, G],
        how like each goal is to all words so far; `fitted` and `methods`, [T, G] log-probabilities
        by each fitted baseline and each method of one's own; `outright` [T] and `letters` [T, G],
        what the model answers if asked; `seen`, whether its adapter was fitted on the text of the
        true goal, and `learned`, whether on these very words; None where no adapter tells.
    """
    case = case_from_json(spec["case"])
    goals, turns = case.goals, case.turns
    if name := spec.get("likelihood"):
        _check_files(f"{name} has", hashes_of(Settings(likelihood=name)), spec["files"])
        likelihood = own_likelihood(name, model)
    else:
        likelihood = RolePlay(model, layout=spec["layout"], similarity=0.0)
    read = isinstance(likelihood, RolePlay)
    table = evidence_of(likelihood, case.task, [*goals, UNSPECIFIED], turns)
    result: dict[str, Any] = {
        "role-play": table[:, :-1].tolist(),
        "unspecified": table[:, -1].tolist(),
        "likeness": likeness(goals, turns).tolist() if read else [],
        "calibration": asdict(likelihood.calibration),
        "window": likelihood.window(case.task, turns) if read else 0,
    }
    fitted: Mapping[str, Fitted] = fitted_on(**spec["fit"]) if spec.get("fit") else {}
    result |= {
        "tfidf": tfidf(goals, turns).tolist(),
        "bm25": bm25(goals, turns).tolist(),
        "embedding": embedding(goals, turns).tolist(),
        "fitted": {name: each(goals, turns).tolist() for name, each in fitted.items()},
    }
    told = adapter_metadata(model)
    for name, key, own in (
        ("seen", FITTED_GOALS, goal_key(case.true_goal.text)),
        ("learned", FITTED_DIALOGUES, said_key(turns)),
    ):
        result[name] = own in told[key].split() if key in told else None
    if spec["outright"]:
        result["outright"] = outright(model, goals, turns)
        result["letters"] = outright_letters(model, goals, turns)
    result["methods"] = {}
    for name, planned in spec.get("methods", {}).items():
        _check_files(f"{name} has", hashes_of(Settings(method=name)), {"method": planned})
        if (key := (name, _key(spec["model"]))) not in _methods:
            _methods[key] = own_likelihood(name, model)
        evidence = evidence_of(_methods[key], case.task, goals, turns)
        result["methods"][name] = log_softmax(evidence.cumsum(axis=0)).tolist()
    return result


def _episode(model: ModelSet, spec: Mapping[str, Any]) -> dict[str, Any]:
    model_names = {key: spec["model"].get(key) for key in MODEL_KEYS}
    settings = settings_of({**spec["settings"], **model_names})
    profile = profile_named(settings, spec["profile"])
    _check_files(
        f"The files of {profile.name} (people, catalogue, scene and so on) have",
        {**hashes_of(settings), "person": person_of(profile)},
        {**spec["files"], "person": spec["person"]},
    )
    start = time.monotonic()
    with open_environment(settings, profile) as env, Store.in_memory() as store:
        at_start = env.state().fingerprint
        session = Session(store, settings, env, model, profile=profile.name)
        rounds = list(session.run())
        info, outcome = session.info, session.outcome()
        verbs = [verb.name for verb in env.verbs]
        unchanged = env.state().fingerprint == at_start
        domain = domain_named(settings.domain)
        trivial = trivial_figures(domain, env, profile) if outcome else {}
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
        **(_json_of(outcome) if outcome else {}),
        "trivial": trivial,
        "rounds": len(rounds),
        "terminated": info.ended == "terminated",
        "replans": sum(round.replans for round in rounds),
        "task": info.task,
        "description": profile.description,
        "outcome": rounds[-1].status if rounds else "",
        "actions": acts,
        **({} if domain.possible else {"possible": verbs}),
        "empty": unchanged,
        "seconds": time.monotonic() - start,
    }


def figures_of(outcome: Outcome) -> dict[str, float]:
    """The score and what it is made of, by the columns of tables; "unwanted" only if it is told."""
    told = {} if outcome.unwanted is None else {"unwanted": float(len(outcome.unwanted))}
    return {
        "score": outcome.score,
        "needs met": outcome.needs_met / outcome.needs,
        "violated": float(outcome.violated),
        **told,
    }


def trivial_figures(
    domain: Domain, env: Environment, profile: Profile
) -> dict[str, dict[str, float]]:
    """What the same for everybody reaches: doing nothing, and `domain.trivial`.

    Returns:
        `figures_of` each policy by its name, means over its lists of actions; none without any.
    """

    def after(actions: Sequence[Action]) -> dict[str, float]:
        env.reset()
        for action in actions:
            execute(env, action)
        now = env.checks_met(profile)
        return figures_of(Outcome(start, now.met, now.unwanted))

    env.reset()
    start = env.checks_met(profile).met
    policies = {"nothing": [()], **domain.trivial(env)}
    found = {name: [after(each) for each in lists] for name, lists in policies.items()}
    return {
        name: {key: fmean(each[key] for each in rows) for key in rows[0]}
        for name, rows in found.items()
        if rows
    }


def _judge(model: ModelSet, spec: Mapping[str, Any]) -> dict[str, Any]:
    trials = judge(
        model,
        task=spec["task"],
        description=spec["description"],
        outcome=spec["outcome"],
        actions=spec["actions"],
        possible=spec.get("possible")
        or domain_named(spec["of"]["settings"]["domain"]).possible
        or (),
        empty=spec["empty"],
        trials=spec["trials"],
        seed=spec["seed"],
        temperature=spec.get("temperature", JUDGE_TEMPERATURE),
    )
    return {"trials": [asdict(trial) for trial in trials]}


KINDS = {
    "mcq": _question,
    "dialogue": _dialogue,
    "episode": _episode,
    "judge": _judge,
}
