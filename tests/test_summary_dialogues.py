"""Tables of people's dialogues and of models that met them, by hand from a few cells."""

import math
from dataclasses import asdict

import numpy as np
import pytest

from goalscope.base.stats import Interval, bootstrap_mean
from goalscope.belief.calibration import Calibration
from goalscope.experiment.dialogues import (
    FITTED_FROM,
    after_turn,
    dialogue_differences,
    dialogue_table,
    following_table,
    number_of,
    read_dialogues,
    reliability_of,
)
from goalscope.experiment.summary import Estimate, Table, few_notes, mean_of
from test_summary import MODEL, column, row


def dialogue(id: int, truth: int, turns: int, *, group: str | None = None, **result):
    case = {
        "id": str(id),
        "group": group or str(id),
        "task": "Help.",
        "turns": [{"query": "?", "utterance": "!"}] * turns,
        "goals": ["a", "b", "c", "d"],
        "truth": truth,
    }
    spec = {"kind": "dialogue", "set": "teach", "split": "valid", "goal_set": "hard", "case": case}
    own = {"unspecified": [0.0] * turns, "calibration": asdict(Calibration(temperature=2.0))}
    result = {**own, **result}
    return {**spec, "model": MODEL, "layout": "goal-last"}, result


SURE = [2.0, 0.0, 0.0, 0.0]
DIALOGUES = [
    dialogue(
        1,
        0,
        2,
        **{"role-play": [SURE, SURE]},
        outright=[{"goal": 0, "sure": 1.0}, {"goal": None, "sure": None}],
        tfidf=[[1.0, 0, 0, 0], [1.0, 0, 0, 0]],
    ),
    dialogue(
        2,
        1,
        1,
        **{"role-play": [SURE]},
        outright=[{"goal": 1, "sure": 0.0}],
        tfidf=[[0, 1.0, 0, 0]],
    ),
]


def test_to_ask_the_model_outright_makes_no_other_model_of_it() -> None:
    asked = [({**spec, "outright": True}, result) for spec, result in DIALOGUES]
    others = [dialogue(n, 0, 1, **{"role-play": [SURE]}) for n in (3, 4)]
    again = [(spec, {**result, "outright": None}) for spec, result in DIALOGUES]
    alone = [({**spec, "outright": False}, result) for spec, result in [*again, *others]]
    for cells in (asked + alone, alone + asked):
        (found,) = read_dialogues(cells)
        assert found.title == read_dialogues(DIALOGUES)[0].title
        assert number_of(found) == "4 dialogues"
        asked_after_one = after_turn(found, "model asked", 1)
        assert sorted(each["case"]["id"] for each in asked_after_one) == ["1", "2"]


def test_a_dialogue_that_was_corrected_since_counts_once() -> None:
    wrong = ({**dialogue(1, 3, 1)[0], "outright": True}, dialogue(1, 3, 1, tfidf=[SURE])[1])
    right = ({**dialogue(1, 0, 1)[0], "outright": False}, dialogue(1, 0, 1, tfidf=[SURE])[1])
    (found,) = read_dialogues([wrong, right])
    assert number_of(found) == "1 dialogue"
    assert [each["top1"] for each in after_turn(found, "TF-IDF", 1)] == [1.0]


def dialogues_table(cells: list = DIALOGUES) -> Table:
    (found,) = read_dialogues(cells)
    return dialogue_table(found)


def test_role_play_adds_up_turns_and_is_calibrated_as_its_cell_says() -> None:
    table = dialogues_table()
    first = row(table, "goalscope, Eq. 1", "1")
    e = math.exp(2)
    losses = [-math.log(e / (e + 3)), -math.log(1 / (e + 3))]
    last_loss = (losses[0] - math.log(1 / (math.exp(1) + 3))) / 2
    assert (first["n"], first["top-1"].value, first["MRR"].value) == (2, 0.5, (1 + 1 / 3) / 2)
    assert first["log-loss"].value == pytest.approx(np.mean(losses))
    second = row(table, "goalscope, Eq. 1", "2")
    assert (second["n"], second["top-1"]) == (1, Estimate(1.0, None, "percent"))
    assert second["log-loss"].value == pytest.approx(-math.log(e**2 / (e**2 + 3)))
    tempered = row(table, "goalscope", "2")
    assert tempered["log-loss"].value == pytest.approx(losses[0])
    own = row(table, "goalscope", "last")  # of each dialogue its own last turn
    assert (own["n"], own["log-loss"].value) == (2, pytest.approx(last_loss))
    last = [(s, {**r, "calibration": asdict(Calibration(switching=0.9))}) for s, r in DIALOGUES]
    assert row(dialogues_table(last), "goalscope, Eq. 1", "2") == second


def test_a_calibration_saved_meanwhile_changes_no_experiment_under_way() -> None:
    other = asdict(Calibration(temperature=0.3, prior_unspecified=0.1))
    first, *others = DIALOGUES
    mixed = [first, *((spec, {**result, "calibration": other}) for spec, result in others)]
    assert others
    assert dialogues_table(mixed) == dialogues_table(DIALOGUES)


def test_goals_that_an_adapter_was_fitted_on_are_shown_apart() -> None:
    cells = [
        dialogue(1, 0, 1, seen=True, **{"role-play": [SURE]}),
        dialogue(2, 1, 1, seen=False, **{"role-play": [SURE]}),
        dialogue(3, 1, 1, seen=None, **{"role-play": [SURE]}),
    ]
    table = dialogues_table([*cells, dialogue(4, 1, 1, learned=True, **{"role-play": [SURE]})])
    assert row(table, "goalscope", "1")["n"] == 4
    assert row(table, "goalscope, goal seen", "1")["top-1"].value == 1.0
    assert row(table, "goalscope, goal unseen", "1")["top-1"].value == 0.0
    assert table.notes[0] == "The model's adapter was TRAINED on 1 of these dialogues."
    assert "goalscope, goal seen" not in column(dialogues_table(cells[:1]), "predictor")


def test_whether_the_goal_is_in_the_set_is_told_by_unspecified() -> None:
    cells = [
        dialogue(1, 0, 2, unspecified=[1.0, 0.0], **{"role-play": [SURE, SURE]}),
        dialogue(2, 1, 1, unspecified=[-1.0], **{"role-play": [SURE]}),
    ]
    table = dialogues_table(cells)
    # log-odds of the first without its goal and without a wrong one: 0.5 - log 3, 0.5 - log(e + 2);
    # of the second, whose evidence is for a wrong goal: -0.5 - log(e + 2), and the same or more
    leads = ("leads if absent", "leads if present")
    for belief in ("goalscope", "goalscope, Eq. 1"):
        first, second, last = (row(table, belief, turn) for turn in ("1", "2", "last"))
        assert [each["n"] for each in (first, second, last)] == [2, 1, 2]
        assert second["AUROC"] is None  # a single dialogue is not told from another
        assert [second[each].value for each in leads] == [1.0, 0.0]
        for found in (first, last):
            assert [found[each].value for each in ("AUROC", *leads)] == [0.5, 0.5, 0.0]
    assert row(table, "uniform", "1")["AUROC"] is None


def test_the_prior_of_unspecified_counts_where_the_goal_may_be_missing_and_only_there() -> None:
    def cells(prior_unspecified: float | None) -> list:
        own = {
            "calibration": asdict(Calibration(prior_unspecified=prior_unspecified)),
            "role-play": [SURE],
        }
        return [dialogue(n, 0, 1, unspecified=[1.0], **own) for n in range(2)]

    tables = [dialogues_table(cells(each)) for each in (None, 0.01, 0.99)]
    leads = [row(each, "goalscope", "1") for each in tables]
    assert [each["leads if absent"].value for each in leads] == [1.0, 0.0, 1.0]
    assert [each["leads if present"].value for each in leads] == [0.0, 0.0, 1.0]
    assert len({str(row(each, "goalscope, Eq. 1", "1")) for each in tables}) == 1
    assert len({row(each, "goalscope", "1")["log-loss"].value for each in tables}) == 1


def test_uniform_is_what_one_expects() -> None:
    found = row(dialogues_table(), "uniform", "last")
    assert found["top-1"] == Estimate(0.25, None, "percent")
    assert found["MRR"].value == 0.4
    assert found["log-loss"].value == pytest.approx(math.log(4))
    assert found["Brier"].value == pytest.approx(0.75)
    assert found["ECE"] == pytest.approx(0)


def test_an_answer_counts_as_it_was_meant() -> None:
    table = dialogues_table()
    first = row(table, "model asked", "1")
    assert first["top-1"].value == 1.0  # what was named is its first choice, however unsure
    assert first["log-loss"].value == pytest.approx((-math.log(0.995) + math.log(4)) / 2, abs=1e-5)
    cells = [dialogue(1, 2, 1, outright=[{"goal": 2, "sure": None}])]
    unsure = row(dialogues_table(cells), "model asked", "1")
    assert (unsure["top-1"].value, unsure["n"]) == (1.0, 1)
    assert unsure["log-loss"].value == pytest.approx(math.log(4), abs=1e-5)
    unread = row(table, "model asked", "2")
    assert unread["log-loss"].value == pytest.approx(math.log(4))
    assert any("1 of 3 answers of the model" in note for note in table.notes)


def similar(group: int, *, right: bool):
    """A dialogue in which the goal that is likest is the true one, or is not."""
    liked = [1.0, 0, 0, 0] if right else [0, 1.0, 0, 0]
    return dialogue(group, 0, 1, tfidf=[liked])


def test_temperatures_are_fitted_on_other_groups() -> None:
    # All but one are right: whoever is judged beside it gets no doubt from the others.
    cells = [similar(n, right=n > 0) for n in range(FITTED_FROM)]
    table = dialogues_table(cells)
    found = row(table, "TF-IDF", "1")
    doubt = np.geomspace(1e-3, 1e2, 51)
    best = (16 * np.logaddexp(np.log(3), 1 / doubt) - 15 / doubt).argmin()
    warm = float(doubt[best])
    right, wrong = math.log1p(3 * math.exp(-1 / warm)), 1000.0
    assert found["log-loss"].value == pytest.approx((16 * right + wrong) / FITTED_FROM)


def test_few_groups_are_no_ground_to_fit_on() -> None:
    cells = [similar(n, right=n > 0) for n in range(FITTED_FROM - 1)]
    table = dialogues_table(cells)
    right, wrong = (math.log(math.e + 3) - 1, math.log(math.e + 3))
    mean = ((FITTED_FROM - 2) * right + wrong) / (FITTED_FROM - 1)
    assert row(table, "TF-IDF", "1")["log-loss"].value == pytest.approx(mean)


def test_intervals_resample_groups() -> None:
    values = [1.0, 0.0] * 6
    cells = [
        dialogue(i, 0 if value else 1, 1, group=str(i // 3), **{"role-play": [SURE]})
        for i, value in enumerate(values)
    ]
    found = row(dialogues_table(cells), "goalscope", "1")
    groups = [str(i // 3) for i in range(12)]
    assert found["top-1"] == Estimate(0.5, bootstrap_mean(values, groups), "percent")


ALONE = ["red big cup", "red big pan", "red old cup", "blue big cup"]
"""The first goal differs from each other one in one word, and they from each other in two."""


def alone(id: int, truth: int, turns: int = 1):
    spec, result = dialogue(id, truth, turns)
    return {**spec, "case": {**spec["case"], "goals": ALONE}}, result


def test_goals_alone_have_jaccard_overlap_over_a_temperature() -> None:
    table = dialogues_table([alone(1, 0), alone(2, 1)])
    likeness = [1 / 2, (1 / 2 + 2 * 1 / 5) / 3]  # of the first goal; of each other one
    gap = likeness[0] - likeness[1]
    first = math.log(1 + 3 * math.exp(-gap))
    found = row(table, "goals alone", "1")
    assert found["log-loss"].value == pytest.approx(np.mean([first, gap + first]))


def test_sets_goal_sets_and_models_have_tables_of_their_own() -> None:
    spec, result = DIALOGUES[0]
    others = [({**spec, "goal_set": "random"}, result), ({**spec, "model": {}}, result)]
    found = read_dialogues([*DIALOGUES, *others])
    assert [(sample.name, number_of(sample)) for sample in found] == [
        ("teach-valid-hard-small", "2 dialogues"),
        ("teach-valid-hard-SmolLM2-135M-Instruct", "1 dialogue"),
        ("teach-valid-random-small", "1 dialogue"),
    ]
    assert read_dialogues([]) == ()
    (own,) = read_dialogues([({**spec, "split": None}, result)])  # a file has no split
    assert own.name == "teach-hard-small"


def test_few_groups_are_told_of_however_many_dialogues_they_have() -> None:
    cells = [dialogue(n, n % 3, 1, group=f"g{n < 7}", **{"role-play": [SURE]}) for n in range(24)]
    assert few_notes(dialogues_table(cells))[0].startswith(
        "With fewer than 10 people or groups, an interval says little"
    )
    apart = [dialogue(n, n % 3, 1, group=f"g{n}", **{"role-play": [SURE]}) for n in range(24)]
    assert few_notes(dialogues_table(apart)) == ()


def test_figures_get_the_tables_numbers() -> None:
    (found,) = read_dialogues(DIALOGUES)
    table, name = dialogue_table(found), "goalscope"
    assert after_turn(found, "BM25", None) == []
    assert [len(after_turn(found, name, turn)) for turn in (1, 2, None)] == [2, 1, 2]
    for turn, after in ((1, "1"), (None, "last")):
        figure = mean_of(after_turn(found, name, turn), "top1", "percent")
        assert figure == row(table, name, after)["top-1"]
    made = reliability_of(after_turn(found, name, None))
    last = row(table, name, "last")
    assert (made.n, made.ece) == (2, last["ECE"])
    assert made.band == Interval(last["if calibrated, from"], last["to"])


def test_methods_are_compared_in_pairs_over_groups() -> None:
    own = {"mine": np.log([[0.7, 0.1, 0.1, 0.1]]).tolist()}
    cells = [dialogue(n, n % 2, 1, methods=own, **{"role-play": [SURE]}) for n in range(4)]
    (found,) = read_dialogues(cells)
    table = dialogue_differences(found)
    pairs = [(each["measure"], each["methods"]) for each in table.rows]
    assert ("log-loss", "goalscope minus mine") in pairs
    assert ("log-loss", "mine minus uniform") in pairs
    assert ("log-loss", "mine minus goalscope") not in pairs
    losses = {name: row(dialogue_table(found), name, "1")["log-loss"].value for name in
              ("mine", "uniform")}  # fmt: skip
    compared = table.rows[pairs.index(("log-loss", "mine minus uniform"))]
    assert compared["difference"].value == pytest.approx(losses["mine"] - losses["uniform"])
    number = sum(each["p"] is not None for each in table.rows)
    assert f"comparisons of this table, {number}." in table.notes[1]
    assert all(each["p"] <= each["p (Holm)"] for each in table.rows if each["p"] is not None)


def changing(id: int, truths: list[int | None], nats: list[list[float]]):
    """A dialogue whose goal changes; evidence is for Unspecified first, then for each goal."""
    own = {"role-play": [each[1:] for each in nats], "unspecified": [each[0] for each in nats]}
    spec, result = dialogue(id, 0, len(truths), **own)
    spec["case"] |= {"truth": truths[-1], "truths": truths}
    return spec, result


def test_how_soon_a_belief_follows_a_change_is_counted_from_the_turn_that_tells_it() -> None:
    for_a, for_b, for_none = [0.0, 9, 0, 0, 0], [0.0, 0, 99, 0, 0], [999.0, 0, 0, 0, 0]
    cells = [
        changing(1, [0, 1, 1], [for_a, for_a, for_b]),  # a turn too late
        changing(2, [0, None], [for_a, for_none]),
        changing(3, [0, 0], [for_a, for_a]),
        changing(4, [None, 0, None], [for_none, for_a, for_a]),  # stays where it was
    ]
    (sample,) = read_dialogues(cells)
    found = row(following_table(sample), "goalscope")
    assert found["changes"] == 4
    assert found["at once"].value == pytest.approx(2 / 4)
    assert found["within 3"].value == pytest.approx(3 / 4)
    (steady,) = read_dialogues(DIALOGUES)
    assert following_table(steady).rows == []


def test_who_has_a_goal_that_is_not_listed_counts_for_unspecified_alone() -> None:
    cells = [
        changing(1, [None], [[9.0, 0, 0, 0, 0]]),
        changing(2, [0], [[1.0, 9, 0, 0, 0]]),
        changing(3, [0], [[0.0, 0, 9, 0, 0]]),
    ]
    found = row(dialogues_table(cells), "goalscope", "1")
    assert found["n"] == 3
    assert found["top-1"].value == 0.5
    assert found["AUROC"].value == 1.0
    assert found["leads if absent"].value > found["leads if present"].value


def test_likeness_of_words_and_goals_counts_as_much_as_the_calibration_says() -> None:
    like = [[0.0, 0.5, 0.0, 0.0]]
    table = {}
    for weight in (0.0, 8.0):
        own = asdict(Calibration(temperature=2.0, similarity=weight))
        cell = dialogue(1, 1, 1, **{"role-play": [SURE], "likeness": like}, calibration=own)
        (sample,) = read_dialogues([cell])
        (record,) = sample.where(predictor="goalscope")
        (paper,) = sample.where(predictor="goalscope, Eq. 1")
        table[weight] = record["log_loss"], paper["log_loss"]
    assert table[0.0][1] == table[8.0][1]
    nats = np.array([1.0, 2.0, 0.0, 0.0])  # 2 / 2 and 8 / 2 / 2
    assert table[8.0][0] == pytest.approx(np.log(np.exp(nats).sum()) - 2.0)
