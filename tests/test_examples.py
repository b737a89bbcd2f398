"""The examples run, and a domain that is a file is one like the others."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from fakes import LampRoom
from goalscope import Agent, GoalscopeError, InvalidInputError, Turn
from goalscope.domains import Settings, load_domain, open_environment, profiles_of
from goalscope.envs import MAY_LACK, Environment
from goalscope.envs.check import check_env
from goalscope.policy import Planner, undo
from goalscope.store import Store
from goalscope.types import Action, StepResult
from test_cli import fails, invoke
from test_run import NamedModel

EXAMPLES = Path(__file__).parents[1] / "examples"
GARDEN = EXAMPLES / "garden.py"
ASK = "A felled tree does not come back. Shall the walnut tree go?"
FELL = Action("remove", "walnut tree")
NO_TREE = Turn("What else?", "No walnut tree, please.")


@pytest.fixture
def settings() -> Settings:
    return Settings(domain=load_domain(str(GARDEN)))


@pytest.fixture
def garden(settings: Settings) -> Environment:
    return open_environment(settings)


def test_the_garden_keeps_the_laws_of_an_environment(garden: Environment) -> None:
    check_env(garden)


NEEDED = set(vars(Environment)) - MAY_LACK


@pytest.mark.parametrize("name", sorted(name for name in NEEDED if not name.startswith("_")))
def test_an_environment_without_what_agents_call_is_refused(garden: Environment, name: str) -> None:
    lacking = type("Lacking", (type(garden),), {name: vars(Environment)[name]})
    with pytest.raises(GoalscopeError, match=f"`{name}` is missing"):
        check_env(lacking())


def test_what_inherits_nothing_must_have_it_all() -> None:
    room = LampRoom()
    room.step = lambda action: StepResult(action, False, "It is stuck.")
    check_env(room)
    with pytest.raises(GoalscopeError, match="`task` is missing"):
        check_env(object())  # pyright: ignore[reportArgumentType]


def test_a_fingerprint_tells_states_apart(garden: Environment) -> None:
    blind = type("Blind", (type(garden),), {"fingerprint": lambda self: "x"})
    with pytest.raises(
        GoalscopeError, match=r"changed `status\(\)` must change `fingerprint\(\)`: a"
    ):
        check_env(blind())


@pytest.mark.parametrize(
    ("name", "given", "told"),
    [
        ("requests", lambda self, turns: 1 / 0, r"`requests` fails after 'Hello.' \(ZeroDivision"),
        ("requests", lambda self, turns: [("add", "rose")], "`requests` must give a list of Act"),
        ("requests", lambda self, turns: None, "`requests` must give a list of Action, not None"),
        ("mentioned", lambda self, said: ["rose", 5], "`mentioned` must give a list of str"),
        ("is_completion", lambda self, turn: None, "`is_completion` must give a bool, not None"),
        ("is_completion", lambda self, turn: False, "`completion_phrase` must be a completion"),
        ("kinds", lambda self, text, limit: 1 / 0, r"`kinds` fails \(ZeroDivisionError"),
        ("status", lambda self: None, r"`status\(\)` must be a text"),
        ("answer", lambda self, question: 5, "`answer` must give a text or None, not 5"),
        ("fingerprint", lambda self: 5, r"`fingerprint\(\)` must be a text, not 5"),
    ],
)
def test_what_fails_or_gives_something_else_is_named(
    garden: Environment, name: str, given: object, told: str
) -> None:
    with pytest.raises(GoalscopeError, match=told):
        check_env(type("Wrong", (type(garden),), {name: given})())


@pytest.mark.parametrize("given", [True, None, "done"])
def test_a_step_without_a_result_is_named_by_all_that_take_it(
    garden: Environment, given: object
) -> None:
    told = rf"`step` of Wrong must return a StepResult\(.*, not {given!r}, for "
    env = type("Wrong", (type(garden),), {"step": lambda self, action: given})()
    with pytest.raises(GoalscopeError, match=told):
        check_env(env)
    with pytest.raises(GoalscopeError, match=told):
        Agent(env, NamedModel(), method="no-goals").step("What else?", "A pond, please.")
    with pytest.raises(GoalscopeError, match=told):
        undo(env, [StepResult(Action("add", "pond"), True, "")])


def test_a_file_whose_environment_lacks_something_is_refused_before_it_runs(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(GARDEN.read_text().replace("def fingerprint", "def fingerprnt"))
    (tmp_path / "mine.toml").write_text((EXAMPLES / "garden.toml").read_text())
    store = tmp_path / "episodes.db"
    line = fails(2, "run", file, "--profile", "bees", "--method", "no-goals", "--store", store)
    assert "`fingerprint` is missing in Garden" in line
    with Store.open(store) as episodes:
        assert not episodes.episodes()


@pytest.mark.parametrize(
    ("check", "told"),
    [
        ('{ lacks = "pond" }', "check 1: 'lacks' must be a list of texts, such as"),
        ("{ has = [5] }", "check 1: 'has' must be a list of texts"),
        ("{ has = [] }", "check 1: 'has' must be a list of texts"),
        ('{ has = ["pnd"] }', "check 1: 'pnd' is unknown; did you mean 'pond'"),
        ('{ lack = ["pond"] }', "the key 'lack' is unknown; did you mean 'lacks'"),
        ("{}", "check 1: it checks nothing; known are has, lacks"),
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


@pytest.mark.parametrize("made", ["None", "5", "profile"])
def test_a_domain_that_opens_no_environment_says_so(tmp_path: Path, made: str) -> None:
    file = tmp_path / "mine.py"
    opening = f"def open_environment(profile):\n    return {made}\n\n"
    file.write_text(f"{opening}def load_profiles(path):\n    return ()\n")
    settings = Settings(domain=load_domain(str(file)))
    with pytest.raises(InvalidInputError, match=r"mine\.py: open_environment returned .*, and no"):
        open_environment(settings)


def test_a_domain_takes_fewer_than_80_lines() -> None:
    assert sum(bool(line.strip()) for line in GARDEN.read_text().splitlines()) < 80


def test_what_was_said_last_of_a_thing_counts(garden: Environment) -> None:
    said = [Turn("", "A pond and a swing, please."), Turn("", "But no pond!")]
    assert garden.mentioned([turn.utterance for turn in said]) == ["swing"]
    assert garden.requests(said) == [Action("add", "swing")]
    assert garden.actions(["pond", "herbs"], said) == [Action("add", "herbs")]
    garden.step(Action("add", "pond"))
    assert garden.requests(said) == [Action("remove", "pond"), Action("add", "swing")]


@pytest.mark.parametrize("answer", ["Yes.", "yes, please!", "Yes, go ahead"])
def test_the_tree_goes_at_a_yes(garden: Environment, answer: str) -> None:
    turns = [NO_TREE, Turn(ASK, answer)]
    assert garden.permission(FELL, turns) == ""
    assert garden.requests(turns) == [FELL]


@pytest.mark.parametrize(
    "turns",
    [
        [],
        [NO_TREE],
        [NO_TREE, Turn("What else?", "Yes.")],
        [NO_TREE, Turn(ASK, "Yes, but not before autumn.")],
        [NO_TREE, Turn(ASK, "Yes?")],
        [NO_TREE, Turn(ASK, "Yesterday I would have said it may.")],
        [NO_TREE, Turn(ASK, "No.")],
        [NO_TREE, Turn(f"{ASK} What else?", "Yes.")],
        [Turn("", f"{ASK} Yes, please do."), NO_TREE],
    ],
)
def test_the_tree_stays_without_a_plain_yes_to_the_question(
    garden: Environment, turns: list[Turn]
) -> None:
    assert garden.permission(FELL, turns) == ASK


def test_the_agent_asks_before_it_fells_and_a_no_is_the_end_of_it(garden: Environment) -> None:
    words = NamedModel()
    agent = Agent(garden, words, method="no-goals", planner=Planner(words, bar=99.0))
    assert agent.step("What else?", NO_TREE.utterance).question == ASK
    refused = agent.step(agent.ask(), "No, wait.")
    assert (refused.question, refused.results) == ("", ())
    agent.step("What else?", NO_TREE.utterance)
    (felled,) = agent.step(agent.ask(), "Yes, please.").results
    assert (felled.action, felled.ok, felled.irreversible) == (FELL, True, True)


@pytest.mark.parametrize("name", [pytest.param("bees", marks=pytest.mark.slow), "kitchen"])
def test_they_get_the_garden_that_they_want(tmp_path: Path, name: str) -> None:
    """By the embedded model, as `goalscope run` runs it; and the episode is there to be seen."""
    store = tmp_path / "episodes.db"
    result = invoke("run", GARDEN, "--profile", name, "--json", "--store", store)
    assert result.exit_code == 0, result.output
    (outcome,) = json.loads(result.stdout)
    assert (outcome["terminated"], outcome["score"]) == (True, 1.0)
    with Store.open(str(store)) as episodes:
        rounds = episodes.rounds(outcome["episode"])
    lasting = [r.action for round in rounds for r in round.results if r.irreversible]
    assert lasting == ([FELL] if name == "kitchen" else [])
    notes = [note for round in rounds for note in round.notes]
    assert any(note.startswith("Guessed, not asked for: ") for note in notes)
    assert "walnut tree" in invoke("replay", outcome["episode"], "--store", store).stdout


def test_a_file_that_a_stored_episode_names_is_run_only_if_the_user_names_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("goalscope.domains._OWN", {})
    monkeypatch.setattr(
        "goalscope.models.opening.open_model",
        lambda *_, **__: type("Words", (NamedModel,), {"close": lambda self: None})(),
    )
    monkeypatch.setenv("GOALSCOPE_STORE", str(tmp_path / "episodes.db"))
    mine = tmp_path / "mine.py"
    mine.write_text(GARDEN.read_text())
    told = invoke("chat", mine, input="A pond, please.\n/pin grow herbs\nquit\n")
    assert told.exit_code == 0
    with Store.open(str(tmp_path / "episodes.db")) as episodes:
        (info,) = episodes.episodes()
    assert (info.domain, info.rounds) == (str(mine), 1)
    resuming = f"goalscope chat {mine} --resume {info.id}"
    assert resuming in told.stderr
    assert resuming in invoke("why", info.id).stderr
    monkeypatch.setattr("goalscope.domains._OWN", {})
    mine.write_text(f"{GARDEN.read_text()}\nPath({str(tmp_path / 'ran')!r}).touch()\n")
    assert f"{mine} is a file of Python" in fails(2, "chat", "--resume", info.id)
    assert not (tmp_path / "ran").exists()
    assert invoke("chat", mine, "--resume", info.id, input="A hedge, too.\n").exit_code == 0
    assert f"{resuming} --rounds 4" in fails(2, "chat", mine, "--resume", info.id, "--rounds", "2")
    assert (tmp_path / "ran").exists()
    with Store.open(str(tmp_path / "episodes.db")) as episodes:
        assert "pond" in episodes.rounds(info.id)[1].status


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        (None, "Is there such a file"),
        ("def open_environment(profile): ...", "the function load_profiles is missing"),
        ("open_environment = load_profiles = 1", "the function open_environment is missing"),
        ("x = 1\ndef f(:", r"own.py, line 2: .*syntax.*\. Mend the file"),
        ("x = 1\nimport no_such_thing", r"line 2: ModuleNotFoundError: No module named 'no_such"),
        ("def f():\n    return nothing\nf()", "line 2: NameError: name 'nothing' is not defined"),
        ("import json\n\njson.loads('')", "line 3: JSONDecodeError: Expecting value"),
        ("compile('(', 'other', 'exec')", "line 1: SyntaxError: "),
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
    with pytest.raises(InvalidInputError, match="Is there such a file"):
        load_domain(str(tmp_path))


def test_a_domain_without_people_says_so(tmp_path: Path) -> None:
    file = tmp_path / "empty.py"
    file.write_text("def open_environment(profile): ...\ndef load_profiles(path): return []\n")
    assert "empty.py has no people" in fails(2, "run", str(file), "--profile", "all")


def test_what_belongs_to_another_domain_is_refused_for_a_file() -> None:
    for option in ("--catalogue", "--scene"):
        assert option in fails(2, "run", GARDEN, "--profile", "bees", option, "x")


def test_profiles_of_ones_own_are_read_for_a_file(settings: Settings, tmp_path: Path) -> None:
    people = tmp_path / "people.toml"
    people.write_text((EXAMPLES / "garden.toml").read_text().replace("lacks", "lack"))
    with pytest.raises(GoalscopeError, match="did you mean 'lacks'"):
        profiles_of(replace(settings, profiles=str(people)))
    assert len(profiles_of(settings)) == 2


def test_a_module_is_not_taken_for_another_of_its_name(tmp_path: Path) -> None:
    (tmp_path / "json.py").write_text(GARDEN.read_text())
    load_domain(str(tmp_path / "json.py"))
    assert sys.modules["json"] is json
