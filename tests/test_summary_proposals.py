"""How often goals would be proposed, by hand from a few cells."""

from dataclasses import asdict

from goalscope.calibration import PAPER, Calibration
from goalscope.experiment.summary_dialogues import read_dialogues
from goalscope.experiment.summary_proposals import proposals_table
from test_summary_dialogues import dialogue

SURE = [4.0, 0.0, 0.0, 0.0]


def shares(*cells) -> dict[tuple[str, str], list[float]]:
    """By belief and rule: how often without the true goal, and with it."""
    (found,) = read_dialogues(cells)
    table = proposals_table(found, command="make")
    assert table.command == "make"
    return {
        (belief, rule): [n, absent.value, present.value]
        for belief, rule, n, absent, present in table.rows
    }


def test_goals_are_proposed_where_the_true_one_is_missing() -> None:
    paper = {"calibration": asdict(PAPER), "role-play": [SURE]}
    # with the goal Unspecified has e^2 / (e^4 + e^2 + 2) = 0.12, without it e^2 / (e^2 + 3) = 0.71;
    # where words without a goal are hardly likelier 0.03 and 0.35
    found = shares(
        dialogue(1, 0, 1, unspecified=[2.0], **paper),
        dialogue(2, 0, 1, unspecified=[0.5], **paper),
    )
    assert found["goalscope", "Unspecified has 50 %"] == [2, 0.5, 0.0]
    assert found["goalscope", "Unspecified leads"] == [2, 1.0, 0.0]
    assert found["goalscope, Eq. 1", "Unspecified leads"] == [2, 1.0, 0.0]
    assert len(found) == 6


def test_each_belief_has_its_own_calibration() -> None:
    own = {"calibration": asdict(Calibration(unstated=0.99)), "role-play": [SURE]}
    found = shares(dialogue(1, 0, 1, unspecified=[2.0], **own))
    assert found["goalscope", "Unspecified has 50 %"] == [1, 1.0, 1.0]
    assert found["goalscope, Eq. 1", "Unspecified has 50 %"] == [1, 1.0, 0.0]


def test_the_fourth_turn_is_too_late() -> None:
    paper = {"calibration": asdict(PAPER)}
    silent, missing = [0.0] * 4, [-9.0, 0.0, 0.0, 0.0]
    for turn, expected in ((2, 1.0), (3, 0.0)):
        rows = [silent] * 4
        rows[turn] = missing
        unspecified = [-1.0] * 4
        unspecified[turn] = 9.0
        cell = dialogue(1, 0, 4, unspecified=unspecified, **paper, **{"role-play": rows})
        assert shares(cell)["goalscope, Eq. 1", "Unspecified has 50 %"][1] == expected


def test_dialogues_with_too_few_goals_are_in_no_row() -> None:
    spec, result = dialogue(1, 0, 1, unspecified=[0.0], **{"role-play": [[0.0, 0.0]]})
    spec["case"]["goals"] = ["a", "b"]
    assert shares((spec, result)) == {}
