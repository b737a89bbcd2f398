"""One table of beliefs before and after: its figures, found another way."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from goalscope.base.stats import auroc
from goalscope.belief.calibration import PAPER
from goalscope.datasets.goal_sets import chance
from goalscope.experiment.beliefs import belief_table
from goalscope.experiment.fit_calibration import fit_calibration, quality
from test_calibrating import believed, some

pytest.importorskip("scipy.optimize")

DIALOGUES = some(40, factor=3.0)


def cell(dialogue, calibration, **result) -> tuple[dict, dict]:
    turns, goals = dialogue.goals.shape
    case = {
        "id": dialogue.id,
        "group": dialogue.group,
        "goals": [f"goal {i}" for i in range(goals)],
        "turns": [{}] * turns,
        "truth": dialogue.truth,
    }
    spec = {"kind": "dialogue", "set": "s", "split": "t", "goal_set": "random", "case": case}
    table = {"role-play": dialogue.goals.tolist(), "unspecified": dialogue.unspecified.tolist()}
    return {**spec, "model": {}}, {**table, "calibration": asdict(calibration), **result}


def test_each_line_adds_a_part_and_the_last_is_the_whole() -> None:
    own = fit_calibration(DIALOGUES)
    table = belief_table(cell(each, own) for each in DIALOGUES)
    rows = table.rows
    assert [row["belief"] for row in rows] == [
        *(
            "Eq. 1",
            "+ prior",
            "+ temperature",
            "+ reference",
            "goalscope",
            "an agent's",
        )
    ]
    whole = quality(DIALOGUES, own)
    warm = quality(DIALOGUES, replace(PAPER, prior_unspecified=0.5, temperature=own.temperature))
    last, third = rows[-2], rows[2]
    assert last["open log-loss"].value == pytest.approx(whole.log_loss)
    assert third["open log-loss"].value == pytest.approx(warm.log_loss)
    shares = [last["90 % set holds it if present"].value, last["90 % set holds it if absent"].value]
    assert shares == pytest.approx(whole.coverage)
    assert last["goals in the 90 % set"].value == pytest.approx(whole.size)
    assert "goals in the 90 % set" not in third
    assert last["log-loss"].value < rows[0]["log-loss"].value


def test_unspecified_is_read_at_the_third_turn_and_before() -> None:
    table = belief_table(cell(each, PAPER) for each in DIALOGUES)
    found = table.rows[0]
    odds: dict[str, list[float]] = {"absent": [], "present": []}
    proposed: dict[str, list[bool]] = {"absent": [], "present": []}
    for each in DIALOGUES:
        wrong = [place for place in range(each.goals.shape[1]) if place != each.truth]
        for kind, out in (("absent", each.truth), ("present", chance(0, each.id).choice(wrong))):
            first = believed(each, out, PAPER).log_posteriors[1:4]
            odds[kind].append(first[-1, -1] - np.logaddexp.reduce(first[-1, :-1]))
            proposed[kind].append(bool((first.argmax(-1) == first.shape[-1] - 1).any()))
    groups = [each.group for each in DIALOGUES]
    assert found["AUROC by turn 3"].value == pytest.approx(
        auroc(odds["absent"], odds["present"], groups)[0]
    )
    assert found["proposes by turn 3 if absent"].value == np.mean(proposed["absent"])
    assert found["proposes by turn 3 if present"].value == np.mean(proposed["present"])


def test_what_taught_the_adapter_is_left_out() -> None:
    table = belief_table(cell(each, PAPER, learned=i < 30) for i, each in enumerate(DIALOGUES))
    assert {row["n"] for row in table.rows} == {10}
    assert belief_table(cell(each, PAPER, learned=True) for each in DIALOGUES).rows == []
