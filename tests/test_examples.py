"""The examples run, and a domain that is a file is one like the others."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from commands import fails, run
from goalscope import Agent, GoalscopeError, InvalidInputError
from goalscope.agent.guards import CONFIRM
from goalscope.agent.planner import replay
from goalscope.agent.settings import Settings
from goalscope.base.types import Action, StepResult
from goalscope.envs import REQUIRED, Environment, Resolution
from goalscope.envs.check import check_env
from goalscope.envs.registry import load_domain, open_environment, profiles_of
from goalscope.storage.store import Store
from test_run import NamedModel

EXAMPLES = Path(__file__).parents[1] / "examples"
GARDEN = EXAMPLES / "garden.py"
FELL = Action("remove", "walnut tree")


@pytest.fixture
def settings() -> Settings:
    return Settings(domain=load_domain(str(GARDEN)))


@pytest.fixture
def garden(settings: Settings) -> Environment:
    return open_environment(settings)


@pytest.mark.parametrize("name", ["garden", "lamp", "coffee"])
def test_the_examples_keep_the_laws_of_an_environment(name: str) -> None:
    settings = Settings(domain=load_domain(str(EXAMPLES / f"{name}.py")))
    check_env(open_environment(settings), profiles_of(settings))


@pytest.mark.parametrize("name", REQUIRED)
def test_an_environment_without_what_agents_call_is_refused(garden: Environment, name: str) -> None:
    own = {key: value for key, value in vars(type(garden)).items() if key != name}
    with pytest.raises(GoalscopeError, match=f"`{name}` is missing"):
        check_env(type("Lacking", (Environment,), own)())


def test_what_inherits_nothing_is_no_environment() -> None:
    with pytest.raises(GoalscopeError, match="must inherit from `Environment`"):
        check_env(object())  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("name", "given", "told"),
    [
        ("verbs", (), "declares no verbs"),
        ("resolve", lambda *_: 1 / 0, r"`resolve` fails \(.*ZeroDivisionError"),
        ("resolve", lambda *_: Resolution(), "`resolve` must give actions, or say why not, for "),
        ("offers", lambda self, text, limit: 1 / 0, r"`offers` fails \(.*ZeroDivisionError"),
        ("state", lambda self: "In the garden.", r"`state` must give a State"),
        ("answer", lambda *_: 5, "`answer` must give a text, not 5"),
    ],
)
def test_what_fails_or_gives_something_else_is_named(
    garden: Environment, name: str, given: object, told: str
) -> None:
    with pytest.raises(GoalscopeError, match=told):
        check_env(type("Wrong", (type(garden),), {name: given})())


def test_a_step_without_a_result_is_named_by_all_that_take_it(garden: Environment) -> None:
    told = r"`step` of Wrong must return a StepResult\(.*, not True, for "
    env = type("Wrong", (type(garden),), {"step": lambda self, action: True})()
    with pytest.raises(GoalscopeError, match=told):
        check_env(env)
    with pytest.raises(GoalscopeError, match=told):
        Agent(env, NamedModel(), method="no-goals").step("What else?", "add pond")
    with pytest.raises(GoalscopeError, match=told):
        replay(env, [StepResult(Action("add", "pond"), True, "")])


def test_a_file_whose_environment_lacks_something_is_refused_before_it_runs(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(GARDEN.read_text().replace("def state(", "def stats("))
    (tmp_path / "mine.toml").write_text((EXAMPLES / "garden.toml").read_text())
    store = tmp_path / "episodes.db"
    line = fails(2, "run", file, "--profile", "bees", "--method", "no-goals", "--store", store)
    assert "`state` is missing in Garden" in line
    with Store.open(store) as episodes:
        assert not episodes.episodes()


@pytest.mark.parametrize(
    ("check", "told"),
    [
        ('{ lacks = "pond" }', "check 1: 'lacks' must be a list, not 'pond'"),
        ('{ has = ["pnd"] }', "check 1, has 1: 'pnd' is unknown; did you mean 'pond'"),
        ('{ lack = ["pond"] }', "the key 'lack' is unknown; did you mean 'lacks'"),
    ],
)
def test_a_check_is_a_list_of_things_that_there_are(
    settings: Settings, tmp_path: Path, check: str, told: str
) -> None:
    people = tmp_path / "people.toml"
    person = 'name = "a"\ndescription = "b"\nreplies = ["c"]\n'
    people.write_text(f"[[profile]]\n{person}checks = [{check}]\n")
    with pytest.raises(InvalidInputError, match=told):
        profiles_of(replace(settings, profiles=str(people)))


@pytest.mark.parametrize("made", ["None", "object()"])
def test_a_domain_that_opens_no_environment_says_so(tmp_path: Path, made: str) -> None:
    file = tmp_path / "mine.py"
    opening = f"def open_environment(profile):\n    return {made}\n\n"
    file.write_text(f"{opening}def load_profiles(path):\n    return ()\n")
    settings = Settings(domain=load_domain(str(file)))
    with pytest.raises(InvalidInputError, match=r"mine\.py: open_environment must return .*, not"):
        open_environment(settings)


def test_a_domain_takes_fewer_than_100_lines() -> None:
    assert sum(bool(line.strip()) for line in GARDEN.read_text().splitlines()) < 100


def said(garden: Environment, *utterances: str) -> Agent:
    """The agent after utterances in canonical English."""
    agent = Agent(garden, NamedModel(), method="no-goals")
    for utterance in utterances:
        agent.step(agent.ask(), utterance)
    return agent


@pytest.mark.parametrize(
    ("orders", "there"),
    [
        (["add pond; add roses"], "pond, roses, walnut tree"),
        (["add ponds"], "pond, walnut tree"),
        (["add pond; add roses", "avoid pond | why taste"], "roses, walnut tree"),
        (["add pond", "swap pond | for bird bath"], "bird bath, walnut tree"),
        (["add pond", "swap pond | for volcano"], "pond, walnut tree"),
        (["add pond", "swap pond | for roses", "undo"], "pond, walnut tree"),
        (["add pond", "avoid pond | why allergy", "undo"], "walnut tree"),
        (["add pond", "add pond", "avoid nonsense", "leave pond"], "pond, walnut tree"),
    ],
)
def test_orders_lay_out_the_garden(garden: Environment, orders: list[str], there: str) -> None:
    said(garden, *orders)
    assert garden.state().text == f"In the garden: {there}."


def test_an_order_that_cannot_be_followed_changes_nothing_and_says_why(garden: Environment) -> None:
    (round,) = said(garden, "swap walnut tree | for volcano").rounds
    told = ("There is no volcano here.",)
    assert (round.results, round.question, round.notes) == ((), "", told)


@pytest.mark.parametrize("order", ["remove walnut tree", "swap walnut tree | for pond"])
def test_the_tree_is_felled_at_a_yes_alone(garden: Environment, order: str) -> None:
    agent = said(garden, order)
    assert agent.rounds[-1].question.endswith(CONFIRM)
    refused = agent.step(agent.ask(), "no")
    assert (refused.question, refused.results) == ("", ())
    agent.step("What else?", order)
    felled = agent.step(agent.ask(), "Yes.").results[0]
    assert (felled.action, felled.ok, felled.irreversible) == (FELL, True, True)
    agent.step(agent.ask(), "undo")
    assert "walnut tree" not in garden.state().text


def test_the_tree_is_not_felled_at_a_dislike(garden: Environment) -> None:
    assert said(garden, "avoid walnut tree").rounds[-1].question.endswith(CONFIRM)


COUNTER = Settings(domain=load_domain(str(EXAMPLES / "coffee.py")))


@pytest.mark.parametrize(
    ("orders", "cups"),
    [
        ("add Decaf latte with oat milk", "latte, decaf, oat milk"),
        ("add chai tea latte", "chai latte"),
        ("add tripe machiato | 2", "macchiato, triple; macchiato, triple"),
        ("add lattes | 2; add decaf | 1", "latte; latte, decaf"),
        ("add lattes | 2; add iced", "latte, iced; latte, iced"),
        ("add mocha; add latte; remove mocha", "latte"),
        ("add iced mocha; remove iced", "mocha"),
        ("add iced mocha; avoid iced", "mocha"),
        ("add latte with 2% milk; swap 2% milk | for oat milk", "latte, oat milk"),
        ("add latte with oat milk; swap latte | for mocha", "mocha, oat milk"),
        ("add latte with 2% lactose-free milk", "latte, 2% lactose-free milk"),
        ("add oolong; remove latte; add decaf; avoid nuts", "nothing"),
    ],
)
def test_orders_fill_the_cups(orders: str, cups: str) -> None:
    counter = open_environment(COUNTER)
    said(counter, *orders.split("; "))
    assert counter.state().text == f"Ordered: {cups}."


def test_nothing_is_in_a_cup_twice_or_off_the_menu() -> None:
    counter = open_environment(COUNTER)
    for cup in ("latte, oat milk, decaf", "latte, decaf, decaf", "oat milk", "latte, gin", ""):
        assert not counter.step(Action("add", cup)).ok
    assert not counter.step(Action("add", "latte", 0)).ok


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bees", "kitchen"])
def test_they_get_the_garden_that_they_want(tmp_path: Path, name: str) -> None:
    """By the embedded model, as `goalscope run` runs it; and the episode is there to be seen."""
    store = tmp_path / "episodes.db"
    result = run("run", GARDEN, "--profile", name, "--json", "--store", store)
    assert result.exit_code == 0, result.output
    (outcome,) = json.loads(result.stdout)
    assert (outcome["terminated"], outcome["score"]) == (True, 1.0)
    with Store.open(str(store)) as episodes:
        rounds = episodes.rounds(outcome["episode"])
    lasting = [r.action for round in rounds for r in round.results if r.irreversible]
    assert lasting == ([FELL] if name == "kitchen" else [])
    notes = [note for round in rounds for note in round.notes]
    assert any(note.startswith("Guessed, not asked for: ") for note in notes)
    assert "walnut tree" in run("replay", outcome["episode"], "--store", store).stdout


def test_a_file_that_a_stored_episode_names_is_run_only_if_the_user_names_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("goalscope.envs.registry.OWN.modules", {})
    monkeypatch.setattr(
        "goalscope.models.opening.open_model",
        lambda *_, **__: NamedModel(),
    )
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "episodes.db"))
    mine = tmp_path / "mine.py"
    mine.write_text(GARDEN.read_text())
    told = run("chat", mine, input="add pond\n/pin grow herbs\nquit\n")
    assert told.exit_code == 0
    with Store.open(str(tmp_path / "episodes.db")) as episodes:
        (info,) = episodes.episodes()
    assert (info.domain, info.rounds) == (str(mine), 1)
    resuming = f"goalscope chat {mine} --resume {info.id}"
    assert resuming in told.stderr
    assert resuming in run("why", info.id).stderr
    monkeypatch.setattr("goalscope.envs.registry.OWN.modules", {})
    mine.write_text(f"{GARDEN.read_text()}\nPath({str(tmp_path / 'ran')!r}).touch()\n")
    assert f"{mine} is a Python file" in fails(2, "chat", "--resume", info.id)
    assert not (tmp_path / "ran").exists()
    assert run("chat", mine, "--resume", info.id, input="add hedge\n").exit_code == 0
    assert f"{resuming} --rounds 4" in fails(2, "chat", mine, "--resume", info.id, "--rounds", "2")
    assert (tmp_path / "ran").exists()
    with Store.open(str(tmp_path / "episodes.db")) as episodes:
        assert "pond" in episodes.rounds(info.id)[1].status


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        (None, "an existing Python file"),
        ("open_environment = load_profiles = 1", "the function open_environment is missing"),
        ("x = 1\ndef f(:", r"own.py, line 2: .*syntax.*\. Fix the file"),
        ("x = 1\nimport no_such_thing", r"line 2: ModuleNotFoundError: No module named 'no_such"),
        ("def f():\n    return nothing\nf()", "line 2: NameError: name 'nothing' is not defined"),
        ("import json\n\njson.loads('')", "line 3: JSONDecodeError: Expecting value"),
        ("\x00", "own.py: "),
        ("raise SystemExit(3)", "line 1: SystemExit: 3"),
    ],
)
def test_what_is_no_domain_is_refused(tmp_path: Path, text: str | None, cause: str) -> None:
    file = tmp_path / "own.py"
    if text:
        file.write_text(text)
    with pytest.raises(InvalidInputError, match=cause):
        load_domain(str(file))
    with pytest.raises(InvalidInputError, match="an existing Python file"):
        load_domain(str(tmp_path))


def test_a_module_is_not_taken_for_another_of_its_name(tmp_path: Path) -> None:
    (tmp_path / "json.py").write_text(GARDEN.read_text())
    load_domain(str(tmp_path / "json.py"))
    assert sys.modules["json"] is json
