"""Goal inference on real dialogues: the evidence for each goal after each turn, and baselines'."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from goalscope.base.types import UNSPECIFIED
from goalscope.belief.likelihood import Layout, Likelihood, RolePlay, evidence_of
from goalscope.datasets import Case, said_key
from goalscope.datasets.goal_sets import goal_key
from goalscope.experiment.baselines import bm25, embedding, outright, tfidf
from goalscope.models import OpenModel
from goalscope.models.adapters import FITTED_DIALOGUES, FITTED_GOALS
from goalscope.models.opening import adapter_metadata

__all__ = ["measure_dialogue", "measure_evidence"]


def measure_evidence(
    model: OpenModel,
    case: Case,
    *,
    layout: Layout,
    likelihood: Likelihood | None = None,
) -> dict[str, Any]:
    """Evidence for each goal from each turn, by the role-play likelihood or another one.

    Returns:
        `role-play` [T, G] log-likelihoods in nats, turn by turn; `unspecified` [T], the same
        without a goal; `calibration`, how they become probabilities; `window`, the first turn that
        the model could still read at the end.
    """
    scorer = likelihood or RolePlay(model, layout=layout)
    table = evidence_of(scorer, case.task, [*case.goals, UNSPECIFIED], case.turns)
    return {
        "role-play": table[:, :-1].tolist(),
        "unspecified": table[:, -1].tolist(),
        "calibration": asdict(scorer.calibration),
        "window": scorer.window(case.task, case.turns) if isinstance(scorer, RolePlay) else 0,
    }


def measure_dialogue(
    model: OpenModel,
    case: Case,
    *,
    layout: Layout,
    likelihood: Likelihood | None = None,
    ask_outright: bool = True,
) -> dict[str, Any]:
    """Evidence for each goal after each turn, by every way.

    Returns:
        What `measure_evidence` does; `tfidf`, `bm25`, `embedding` [T, G], how like each goal is to
        all words so far; `outright` [T], what the model answers if asked; `seen`, whether its
        adapter was fitted on the text of the true goal, and `learned`, whether on these very
        words; None where no adapter tells.
    """
    result: dict[str, Any] = {
        **measure_evidence(model, case, layout=layout, likelihood=likelihood),
        "tfidf": tfidf(case.goals, case.turns).tolist(),
        "bm25": bm25(case.goals, case.turns).tolist(),
        "embedding": embedding(case.goals, case.turns).tolist(),
    }
    told = adapter_metadata(model)
    for name, key, own in (
        ("seen", FITTED_GOALS, goal_key(case.goals[case.truth].text)),
        ("learned", FITTED_DIALOGUES, said_key(case.turns)),
    ):
        result[name] = own in told[key].split() if key in told else None
    if ask_outright:
        result["outright"] = outright(model, case.goals, case.turns)
    return result
