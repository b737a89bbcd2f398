"""Studies: what may be asked, who rates what, and what people say."""

import csv
import json
import shutil
from collections import Counter
from dataclasses import asdict, replace
from datetime import UTC, datetime, timedelta
from io import StringIO
from pathlib import Path
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom
from sqlalchemy import func, select

from databases import begin
from fakes import NamedModel
from goalscope.agent.round import Round
from goalscope.agent.settings import Settings
from goalscope.base.types import (
    TRACKING,
    Action,
    ConflictError,
    InvalidInputError,
    StepResult,
    Turn,
)
from goalscope.belief.belief import Belief
from goalscope.envs.registry import open_environment, profiles_of
from goalscope.experiment.results import Results
from goalscope.experiment.summary import inert
from goalscope.report import read_report
from goalscope.storage.session import Session
from goalscope.storage.store import Store
from goalscope.storage.tables import ANSWERS, CELLS, ITEMS, PARTICIPANTS
from goalscope.study import plan
from goalscope.study.plan import DID, LEFT, Plan, chosen_episodes, read_plan
from goalscope.study.store import StudyStore, assigned
from goalscope.study.summary import as_csv, krippendorff_alpha, study_tables
from test_summary import column, row

GARDEN = Path(__file__).parents[1] / "examples" / "garden.py"
EXAMPLE = Path(plan.__file__).with_name("example.toml")
PLAN = Plan("s", "Agree?", "Rate.", ratings_per_item=2, items_per_participant=2)
PEOPLE = [profile.name for profile in profiles_of(Settings())]


def fill(store: Store, methods=("good", "no-goals"), people=2, **more) -> list[str]:
    """Finished episodes, each person with each method."""
    ids = []
    for name in PEOPLE[:people]:
        for method in methods:
            settings = asdict(Settings(method=method, human="scripted"))
            id = begin(
        store,
                domain="grocery", method=method, model="m", task="You shop.",
                profile=name, settings=settings,
            )  # fmt: skip
            turn = Turn("What?", f"For {name}, please.")
            status = f"The basket holds:\n- {len(ids)} x Flour"
            store.append(id, Round(1, turn, Belief.uniform(()), (), (), 0, status, (), True))
            store.finish(id, ended="terminated", score=1.0 if method == "good" else 0.5)
            ids.append(id)
    return ids


@pytest.fixture
def store(place):
    with Results.open(place) as opened:
        yield opened


@pytest.fixture
def studies(store):
    """Over a store with episodes to rate."""
    fill(store)
    return StudyStore(store)


def rate(studies, person, rating, text="because it fits"):
    for answer in person.answers:
        given = rating(answer) if callable(rating) else rating
        studies.answer(person, answer.place, given, text, answer.revision + 1)


GOOD = 'name = "a"\nconsent = "Agree?"\ninstructions = "Rate."\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('name = "a"\ninstructions = "b"', "'consent' is missing"),
        (GOOD.replace('"a"', '"A b"'), "lowercase letters"),
        (GOOD.replace("Agree?", " "), "'consent' must be a text that is not blank"),
        (GOOD + "ratings_per_items = 1", "did you mean 'ratings_per_item'"),
        (GOOD + "items_per_participant = 201", "must be at most 200"),
        (GOOD + 'scale = ["a"]', "at least 4 items"),
        (GOOD + 'methods = ["god"]', "did you mean 'good'"),
        (GOOD + 'domain = "garden"', 'must be "grocery", "house" or an existing Python file'),
    ],
)
def test_what_is_no_study_is_refused_with_the_place(tmp_path, text, said):
    file = tmp_path / "a.toml"
    file.write_text(text)
    with pytest.raises(InvalidInputError) as error:
        read_plan(file)
    assert said in str(error.value)
    assert "a.toml" in str(error.value)


def test_a_study_shows_the_basket_and_hides_the_method(store):
    fill(store)
    person = StudyStore(store).join(StudyStore(store).add(PLAN), "v", "ann")
    shown = [StudyStore(store).open(person, n)[0] for n in (1, 2)]
    assert all(item.outcome.startswith("The basket holds:") for item in shown)
    assert all(item.transcript == () for item in shown)
    assert all(item.task == "You shop." for item in shown)
    assert not any("no-goals" in str(item) or "good" in str(item) for item in shown)


def test_a_robot_is_judged_by_what_it_did(store):
    settings = asdict(Settings(domain="house", human="scripted"))
    id = begin(
        store,
        domain="house", method="good", model="m", task="You help.",
        profile="valuables-in-safe", settings=settings,
    )  # fmt: skip
    status = "The robot's hand is empty.\nChanged so far:\n- safe: open"
    results = (
        StepResult(Action("open", "safe"), True, "Open."),
        StepResult(Action("slice", "watch"), False, "No."),
    )
    store.append(
        id,
        Round(1, Turn("What?", "Hide it."), Belief.uniform(()), (), results, 0, status, (), False),
    )
    with pytest.raises(InvalidInputError, match="No person has a finished episode"):
        StudyStore(store).add(PLAN)
    store.finish(id, ended="truncated", score=0.0)
    studies = StudyStore(store)
    person = studies.join(studies.add(replace(PLAN, transcript=True)), "v", "v")
    item, _ = studies.open(person, 1)
    assert item.outcome == f"{DID}\n- open: safe\n{LEFT}\n{status}"
    assert "slice" not in item.outcome
    assert item.transcript == (Turn("What?", "Hide it."),)
    assert "slice" in " ".join(item.possible).lower()


def test_a_domain_of_ones_own_is_judged_by_what_was_done_and_how_it_ended(store, tmp_path):
    for suffix in (".py", ".toml"):
        shutil.copy(GARDEN.with_suffix(suffix), tmp_path)
    (tmp_path / "study.toml").write_text(f'{GOOD}domain = "garden.py"')
    plan = read_plan(tmp_path / "study.toml")
    settings = Settings(domain=plan.domain, human="scripted")
    with open_environment(settings) as env:
        session = Session(store, settings, env, NamedModel(), profile="kitchen")
        rounds = [*session.run()]
    fill(store)
    studies = StudyStore(store)
    person = studies.join(studies.add(plan), "v", "ann")
    assert len(person.answers) == 1
    item, _ = studies.open(person, 1)
    assert item.possible == ("add", "remove", "swap", "finish")
    assert item.profile.startswith("You want to grow your own food.")
    assert item.outcome.endswith(f"{LEFT}\n{rounds[-1].status}")
    assert rounds[-1].status.startswith("In the garden: ")


def test_only_people_with_whom_each_method_has_an_episode_are_rated(store):
    ids = fill(store)
    fill(store, ("good",), people=3)
    talks = [
        begin(store, domain=domain, method="good", model="m", task="You shop.", settings={})
        for domain in ("grocery", TRACKING)
    ]
    for id in talks:
        store.finish(id, ended="terminated")

    def rated(**more):
        return {info.id for info in chosen_episodes(store, replace(PLAN, **more))}

    alike = {info.id for info in store.episodes() if info.profile in PEOPLE[:2]}
    assert rated() == rated(transcript=True) == rated(methods=("good", "no-goals")) == alike
    assert rated(methods=("no-goals",)) == {*ids[1::2]}
    of_good = {info.id for info in store.episodes() if info.method == "good"} - {talks[1]}
    assert rated(methods=("good",), transcript=True) == of_good
    assert rated(methods=("good",)) == of_good - {talks[0]}
    for more in ({"methods": ("good", "no-inference")}, {"domain": "house"}):
        with pytest.raises(InvalidInputError, match="No person has a finished episode"):
            StudyStore(store).add(replace(PLAN, **more))
    assert StudyStore(store).all() == []


def test_a_closed_study_takes_nobody_new_and_who_began_may_finish(studies, place):
    study = studies.add(PLAN)
    ann = studies.join(study, "ann", "ann")
    with Store.open(place) as elsewhere:
        there = StudyStore(elsewhere)
        assert there.over(there.named("s")) == ""
        studies.close(study)
        assert "is closed" in there.over(there.named("s"))
        for known in (study, there.named("s")):
            with pytest.raises(ConflictError, match="is closed"):
                there.join(known, "ben", "ben")
    assert studies.join(study, "ann", "ann") == ann
    rate(studies, ann, 2)
    assert studies.participant(study, "ann", "ann").finished
    closed = studies.named("s").closed
    studies.close(study)
    assert studies.named("s").closed == closed


def test_a_deleted_study_leaves_nothing_and_takes_nothing_else(store):
    ids = fill(store)
    studies = StudyStore(store)
    study, other = studies.add(PLAN), studies.add(replace(PLAN, name="t"))
    ann, ben = studies.join(study, "ann", "ann"), studies.join(other, "ben", "ben")
    rate(studies, ann, 2)
    rate(studies, ben, 1)
    kept = studies.participants(other)
    studies.delete(study)
    with pytest.raises(InvalidInputError, match="no study"):
        studies.named("s")
    assert [each.plan.name for each in studies.all()] == ["t"]
    assert studies.participants(other) == kept
    with store.reading() as connection:
        for table, count in ((PARTICIPANTS, 1), (ITEMS, 4), (ANSWERS, 2)):
            assert connection.scalar(select(func.count()).select_from(table)) == count
    assert [info.id for info in store.episodes()] == ids
    assert studies.participants(studies.add(PLAN)) == []


def test_the_interval_of_a_score_is_that_of_other_raters(store):
    """Half of the people give 3 and half 0: of n drawn people the share of 3 is binomial."""
    ids = fill(store, methods=("good",), people=2)
    studies = StudyStore(store)
    study = studies.add(replace(PLAN, ratings_per_item=20))
    for n in range(20):
        rate(studies, studies.join(study, f"v{n}", f"v{n}"), 3 * (n % 2))
    _, methods = study_tables(store, study)
    low, high = binom.ppf([0.025, 0.975], 20, 0.5) / 20
    (whole,) = column(methods, "human score")
    assert whole.value == pytest.approx(0.5)
    # whoever rates rates all alike: two episodes tell no more than one
    assert (whole.interval.low, whole.interval.high) == pytest.approx((low, high), abs=0.051)
    assert len(ids) == 2


@given(st.integers(1, 9), st.integers(1, 12), st.integers(1, 5), st.integers(0, 99))
def test_items_are_rated_evenly_until_all_have_enough(count, share, wanted, seed):
    ratings, rng, people = dict.fromkeys(range(count), 0), Random(seed), 0
    while items := assigned(ratings, wanted=wanted, share=share, rng=rng):
        people += 1
        assert len(items) == len(set(items)) == min(share, count)
        for item in items:
            ratings[item] += 1
        assert max(ratings.values()) - min(ratings.values()) <= 1
    assert people == -(-count * wanted // min(share, count))


def test_ties_and_order_are_drawn_and_the_same_seed_draws_the_same():
    orders = Counter(
        tuple(assigned(dict.fromkeys("abc", 0), wanted=1, share=2, rng=Random(seed)))
        for seed in range(600)
    )
    assert len(orders) == 6  # each pair in each order
    assert min(orders.values()) > 60


def test_alpha_of_krippendorffs_published_example():
    """Computing Krippendorff's Alpha-Reliability (2011), section D: ordinal, with missing data."""
    raters = ["123321412...", "1233224125.3", ".3332342251.", "12332441251."]
    units = [[int(r[n]) for r in raters if r[n] != "."] for n in range(12)]
    assert krippendorff_alpha(units) == pytest.approx(0.815, abs=5e-4)


def test_alpha_is_one_where_all_agree_and_unknown_without_a_difference():
    assert krippendorff_alpha([[0, 0, 0], [3, 3]]) == pytest.approx(1)
    assert krippendorff_alpha([[2, 2], [2, 2]]) is None
    assert krippendorff_alpha([[1], [2], []]) is None


def test_those_who_left_make_room(store, studies):
    study = studies.add(replace(PLAN, ratings_per_item=1))
    stays, gone = (studies.join(study, name, name) for name in ("stays", "gone"))
    rate(studies, stays, 2)
    with pytest.raises(ConflictError):
        studies.join(study, "more", "more")
    old = (datetime.now(UTC) - timedelta(minutes=61)).isoformat()
    both = PARTICIPANTS.c.number.in_([stays.number, gone.number])
    aged = PARTICIPANTS.update().where(both).values(joined=old)
    with store.writing() as connection:
        assert connection.execute(aged).rowcount == 2
    more = studies.join(study, "more", "more")
    assert {a.item for a in more.answers} == {a.item for a in gone.answers}


def test_who_takes_back_their_consent_is_forgotten(studies):
    study, other = studies.add(PLAN), studies.add(replace(PLAN, name="t"))
    ann, ben = (studies.join(study, name, name) for name in ("ann", "ben"))
    rate(studies, ann, 2)
    with pytest.raises(InvalidInputError, match="no participant"):
        studies.forget(other, ann.number)
    studies.forget(study, ann.number)
    assert studies.participants(study) == [ben]
    assert studies.participant(study, "ann", "ann") is None
    with pytest.raises(InvalidInputError, match="no participant"):
        studies.forget(study, ann.number)


def test_an_older_answer_never_replaces_a_newer(studies):
    ann = studies.join(studies.add(PLAN), "v", "v")
    first = studies.answer(ann, 1, 2, "first", 1)
    assert studies.answer(ann, 1, 2, "first", 1) == first
    newer = studies.answer(ann, 1, 3, "second", 2)
    assert newer.answered == first.answered
    for rating, text, revision in ((2, "first", 1), (3, "other", 2), (1, "second", 2)):
        with pytest.raises(ConflictError):
            studies.answer(ann, 1, rating, text, revision)
    assert studies.open(ann, 1)[1].explanation == "second"
    with pytest.raises(InvalidInputError, match="no question 3"):
        studies.answer(ann, 3, 1, "x", 1)


def test_scores_of_people_beside_those_of_the_judge_and_the_state(store):
    ids = fill(store, people=1)
    specs = [{"kind": "episode", "settings": {}, "n": id} for id in ids]
    runs = store.plan(specs)
    about = {"model": {"model": "j.gguf"}, "trials": 2, "seed": 0, "kind": "judge"}
    for run, id, scores in zip(runs, ids, ([3, 1.5], [None, 0.75]), strict=True):
        # `keep` would make an episode of its own: these refer to those that are here
        with store.writing() as connection:
            result = json.dumps({"episode": id, "empty": False})
            connection.execute(CELLS.update().where(CELLS.c.key == run.key).values(result=result))
        (judge,) = store.plan([{**about, "of": {"key": run.key}, "empty": False}])
        trials = [{"score": s, "explanation": "", "answer": ""} for s in scores]
        store.keep(judge.key, {"trials": trials}, {})
    studies = StudyStore(store)
    study = studies.add(replace(PLAN, ratings_per_item=3))
    worth = dict(zip(ids, ([3, 1, 0], [1, 1, 3]), strict=True))
    for n in range(3):
        rate(
            studies,
            studies.join(study, f"v{n}", f"v{n}"),
            lambda answer, n=n: worth[answer.episode][n],
        )
    progress, methods = study_tables(store, study)
    good, other = row(methods, "grocery", "m", "good"), row(methods, "grocery", "m", "no-goals")
    assert good["human score"].form == "percent"
    interval = good["human score"].interval
    assert interval.low <= good["human score"].value <= interval.high
    assert good["human score"].value == pytest.approx(4 / 9)
    assert good["judge score"].value == pytest.approx(0.75)
    assert good["state score"].value == 1
    # sample variance of 1, 1/3, 0 is 7/27; one run of three
    assert good["human SD"].value == pytest.approx((7 / 81) ** 0.5)
    assert other["judge score"].value == pytest.approx(0.25)
    assert good["ratings"] == 3
    assert row(progress, "finished")["value"] == 3
    assert row(progress, "episodes with 3 ratings")["value"] == 2


def test_all_scores_of_a_method_are_of_the_episodes_that_are_rated(store):
    one, other = fill(store, methods=("good",))
    store.finish(other, ended="terminated", score=0.0)
    studies = StudyStore(store)
    study = studies.add(replace(PLAN, items_per_participant=1))
    ann = studies.join(study, "ann", "ann")
    rate(studies, ann, 3)
    _, methods = study_tables(store, study)
    good = row(methods, "grocery", "m", "good")
    assert (good["episodes rated"], good["ratings"], good["human score"].value) == (1, 1, 1.0)
    assert good["state score"].value == (1.0 if ann.answers[0].episode == one else 0.0)


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@x", "\tx", "\rx", "\n=1", "\uff1dx"])
def test_no_cell_is_a_formula(store, studies, text):
    assert inert(text) == f"'{text}"
    study = studies.add(PLAN)
    ann = studies.join(study, "v", text)
    studies.answer(ann, 1, 2, text, 1)
    lines = list(csv.DictReader(StringIO(as_csv(store, study), newline="")))
    assert len(lines) == 2
    given = next(line for line in lines if line["place"] == "1")
    assert given["external_id"][0] == given["explanation"][0] == "'"
    assert (given["rating"], given["method"]) in {("2", "good"), ("2", "no-goals")}
    hidden = csv.DictReader(StringIO(as_csv(store, study, ids=False), newline=""))
    assert {line["external_id"] for line in hidden} == {""}
    assert inert("a = b") == "a = b"
    assert inert("") == ""


def test_a_report_shows_what_people_said(tmp_path):
    file = tmp_path / "results.db"
    with Store.open(file) as store:
        fill(store)
        StudyStore(store).add(PLAN)
    (section,) = read_report(file, draw=False).sections
    titles = [table.title for table in section.tables]
    assert titles == ["Study s: how far it is", "Study s: methods"]
