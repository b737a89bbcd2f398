"""Tables of episodes and of those who judged them, computed by hand from a few cells."""

import math
from itertools import combinations

import pytest

from goalscope.base.stats import bootstrap_mean
from goalscope.experiment.episodes import episode_tables, read_episodes
from goalscope.experiment.results import Cell, cell_key
from goalscope.experiment.summary import Estimate, Table
from test_summary import column, made_of, row

X = {"model": "/m/x.gguf"}


def episode(method: str, profile: str, score: float, *, seed: int = 0, own: str = "", **result):
    settings = {"domain": "grocery", "human": "scripted", "method": method, "seed": seed}
    settings |= {"likelihood": own} if own else {}
    more = {"rounds": 4, "terminated": True, "replans": 1, "empty": False, "actions": ["add"]}
    return (
        {"kind": "episode", "settings": settings, "profile": profile, "model": X},
        {**made_of(score), "outcome": f"{method} {profile} {seed}", **more, **result},
    )


def judge(cell, trials: list, *, model: str = "judge", **more):
    spec, result = cell
    return (
        {
            "kind": "judge",
            "of": {**spec, "key": cell_key(spec)},
            "outcome": result["outcome"],
            "actions": [],
            "empty": result["empty"],
            "model": {"model": model},
            "trials": 4,
            "seed": 0,
            **more,
        },
        {"trials": [{"score": each, "explanation": "", "answer": ""} for each in trials]},
    )


def episodes_of(cells: list, attempts: list | None = None) -> list[dict[str, Table]]:
    """The tables of each domain and model, by their kind."""
    tries = attempts or [1] * len(cells)
    found = read_episodes(
        [Cell(cell_key(s), s, n, None, None, r) for (s, r), n in zip(cells, tries, strict=True)]
    )
    return [{each.name.rpartition("-")[2]: each for each in episode_tables(one)} for one in found]


GOOD = [episode("good", "cake", 1.0), episode("good", "soup", 0.5, terminated=False)]
NONE = [episode("no-goals", "cake", 0.5), episode("no-goals", "soup", 0.0, empty=True)]


def test_methods_by_hand() -> None:
    (found,) = episodes_of([*NONE, *GOOD], attempts=[1, 3, 1, 2])
    table = found["methods"]
    assert column(table, "method") == ["good", "no-goals"]
    good = row(table, "good")
    interval = bootstrap_mean([1.0, 0.5])
    assert good["score"] == Estimate(0.75, interval, "percent")
    assert (good["profiles"], good["runs"], good["rounds"], good["replans"]) == (2, 2, 4, 1)
    assert good["terminated"].value == 0.5
    assert good["SD"] is None  # one seed
    assert column(table, "retries") == [1, 2]
    assert table.title == "Episodes, methods: grocery, scripted human, x"
    assert "judge score" not in table.columns


def test_profiles_weigh_the_same_whatever_their_seeds() -> None:
    more = [episode("good", "cake", 0.5, seed=1), episode("good", "cake", 0.0, seed=2)]
    (found,) = episodes_of([*GOOD, *more])
    good = row(found["methods"], "good")
    assert good["runs"] == 4
    assert good["score"].value == 0.5  # profiles: (1 + .5 + 0) / 3 and .5
    pooled = math.sqrt(0.25 * (1 / 3 + 1)) / 2
    assert good["SD"].value == pytest.approx(pooled)


def test_unscored_trials_are_counted_and_in_no_mean() -> None:
    readings = [judge(GOOD[0], [3.0, 2.25, None, None]), judge(GOOD[1], [1.5, 1.5])]
    (found,) = episodes_of([*GOOD, *readings])
    good = row(found["methods"], "good")
    assert good["judge score"].value == pytest.approx((0.875 + 0.5) / 2)
    assert (good["trials scored"], good["trials unscored"], good["runs judged"]) == (4, 2, 2)
    pooled = math.sqrt((2 * 0.125**2 + 0) / 2 * (1 / 2 + 1 / 2)) / 2
    assert good["judge SD"].value == pytest.approx(pooled)


def test_a_run_that_left_nothing_scores_nothing_in_all_trials() -> None:
    for trials in ([3.0, None, 2.0, 1.0], []):
        (found,) = episodes_of([*NONE, judge(NONE[1], trials)])
        none = row(found["methods"], "no-goals")
        assert none["judge score"].value == 0
        assert (none["trials scored"], none["trials unscored"]) == (4, 0)


def test_differences_pair_profiles() -> None:
    alone = episode("good", "pie", 0.0)
    readings = [judge(GOOD[0], [3.0]), judge(NONE[0], [1.5]), judge(GOOD[1], [3.0])]
    (found,) = episodes_of([*GOOD, *NONE, alone, *readings])
    table = found["differences"]
    score = row(table, "score", "good minus no-goals")
    assert score["pairs"] == 2
    assert score["difference"] == Estimate(0.5, None, "percent")  # equal in both
    assert score["p"] == 0.5  # two pairs cannot show more
    assert score["p (Holm)"] == 1  # twice as much, for two comparisons
    assert "the comparisons of this table, 2." in table.notes[1]
    judged = row(table, "judge score")
    assert (judged["pairs"], judged["difference"]) == (1, Estimate(0.5, None, "percent"))
    assert judged["p"] == 1


def test_differences_need_common_seeds() -> None:
    (found,) = episodes_of([GOOD[0], episode("no-goals", "cake", 0.0, seed=1)])
    empty = ["score", "good minus no-goals", "0", "-", "-", "-"]
    assert found["differences"].texts()[1:] == [empty]
    (found,) = episodes_of(NONE)
    assert found["differences"].rows == []


def test_any_two_methods_are_compared_and_ones_own_has_its_name() -> None:
    mine = [episode("good", name, 0.0, own="/at/home/mine.py:Mine") for name in ("cake", "soup")]
    other = [episode("no-inference", name, 0.5) for name in ("cake", "soup")]
    (found,) = episodes_of([*mine, *other, *NONE, *GOOD])
    names = ["good", "no-goals", "no-inference", "mine.py:Mine"]
    assert column(found["methods"], "method") == names
    assert row(found["methods"], "mine.py:Mine")["score"].value == 0
    pairs = [f"{one} minus {two}" for one, two in combinations(names, 2)]
    assert column(found["differences"], "methods") == pairs
    last = row(found["differences"], "score", "no-inference minus mine.py:Mine")
    assert last["difference"].value == 0.5
    again = [episode("good", "cake", 0.0, own=f"/{folder}/mine.py:Mine") for folder in "ab"]
    (found,) = episodes_of(again)
    assert column(found["methods"], "method") == ["/a/mine.py:Mine", "/b/mine.py:Mine"]


def test_trivial_policies_are_rows_below_the_methods_and_are_compared_with_none() -> None:
    floor = {"score": 0.0, "needs met": 0.0, "violated": 0.0}
    some = {**floor, "score": 0.25, "needs met": 0.5, "unwanted": 1.0}
    told = {"trivial": {"random item": some, "nothing": floor}}
    runs = [episode(way, "cake", 1.0, seed=n, **told) for way in ("good", "mine") for n in (0, 1)]
    (found,) = episodes_of(runs)
    table = found["methods"]
    assert column(table, "method") == ["good", "mine", "nothing", "random item"]
    drawn = row(table, "random item")
    assert (drawn["profiles"], drawn["score"].value, drawn["unwanted"]) == (1, 0.25, 1)
    assert column(found["profiles"], "method") == ["good", "mine"]
    assert column(found["differences"], "methods") == ["good minus mine"]


def test_profiles_show_what_was_not_run() -> None:
    (found,) = episodes_of([*GOOD, NONE[0]])
    table = found["profiles"]
    assert [r[:4] for r in table.texts()[1:]] == [
        ["cake", "good", "1", "100.0 %"],
        ["cake", "no-goals", "1", "50.0 %"],
        ["soup", "good", "1", "50.0 %"],
        ["soup", "no-goals", "0", "-"],
    ]
    assert table.texts()[-1][4:] == ["-", "-", "-", "-", "-", "-", "-", "0"]


def test_unwanted_things_are_a_mean_over_the_runs_that_count_them() -> None:
    spec, result = GOOD[0]
    counts = (["pear", "pan"], [], None)
    runs = [
        ({**spec, "settings": {**spec["settings"], "seed": seed}}, {**result, "unwanted": each})
        for seed, each in enumerate(counts)
    ]
    (found,) = episodes_of(runs)
    assert row(found["methods"], "good")["unwanted"] == 1


def test_a_reading_belongs_to_the_run_that_it_names() -> None:
    spec, result = GOOD[0]
    other = ({**spec, "model": {"generator": "a/y"}}, result)
    stray = judge(episode("good", "elsewhere", 1.0), [0.0])
    one, two = episodes_of([GOOD[0], other, judge(other, [3.0]), stray])
    assert "judge score" not in one["methods"].columns
    assert two["methods"].title.endswith("human, y + SmolLM2-135M-Instruct")
    assert row(two["methods"], "good")["judge score"].value == 1


def test_each_judge_has_its_own_columns() -> None:
    readings = [judge(GOOD[0], [3.0]), judge(GOOD[0], [0.0], model="other")]
    (found,) = episodes_of([GOOD[0], *readings])
    good = row(found["methods"], "good")
    assert good["judge score by judge"].value == 1
    assert good["judge score by other"].value == 0
    assert row(found["profiles"], "cake")["judge score by other"].value == 0
    assert len(found["differences"].rows) == 0


def test_notes_say_that_the_judge_also_acted() -> None:
    spec, result = judge(GOOD[0], [3.0])
    for model in (X, {"generator": X["model"], "scorer": "else"}):
        (found,) = episodes_of([*GOOD, ({**spec, "model": model}, result)])
        assert found["methods"].notes[-1].endswith("It is the model that also acted.")
    (found,) = episodes_of(GOOD)
    assert not any("asked" in note for note in found["methods"].notes)


@pytest.mark.parametrize(
    ("heat", "said"), [(0.7, "0.7 (the paper has 0)"), (0, "0, as in the paper")]
)
def test_the_notes_say_at_what_temperature_was_judged(heat, said: str) -> None:
    more = {} if heat == 0.7 else {"temperature": heat}
    (found,) = episodes_of([*GOOD, *(judge(each, [3.0, 1.5], **more) for each in GOOD)])
    assert any(f"at temperature {said}." in note for note in found["methods"].notes)
    other = "judge score by judge, temperature 0"  # which is another evaluator
    (both,) = episodes_of([*GOOD, judge(GOOD[0], [3.0]), judge(GOOD[0], [3.0], temperature=0)])
    assert other in both["methods"].columns
