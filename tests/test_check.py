"""`check_env` finds each defect that is planted in the garden, and so does what loads a domain."""

from pathlib import Path

import pytest

from commands import fails, run
from goalscope import Agent, GoalscopeError
from goalscope.agent.guards import CONFIRM, SAY_YES
from goalscope.agent.people import AGREES, DECLINES, consents
from goalscope.agent.settings import Settings
from goalscope.base.types import Action
from goalscope.envs import Resolution
from goalscope.envs.check import check_env
from goalscope.envs.grocery import GroceryShop
from goalscope.envs.registry import load_domain, open_environment, profiles_of
from goalscope.language.dialogue_state import DialogueState
from shops import CATALOGUE, SEARCH
from test_run import NamedModel

EXAMPLES = Path(__file__).parents[1] / "examples"
GARDEN = (EXAMPLES / "garden.py").read_text(encoding="utf-8")


def planted(tmp_path: Path, right: str, wrong: str) -> Settings:
    """The garden as a domain of one's own, in which `wrong` stands for `right`."""
    assert GARDEN.count(right) == 1
    file = tmp_path / "mine.py"
    file.write_text(GARDEN.replace(right, wrong), encoding="utf-8")
    (tmp_path / "mine.toml").write_text((EXAMPLES / "garden.toml").read_text(encoding="utf-8"))
    return Settings(domain=load_domain(str(file)))


RESULT = "return StepResult(action, True, self.state().text, terminated=ends, irreversible=lasts)"
MET = "return Checks(tuple(map(bool, met)))"


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        ("        self.things = (TREE,)\n", "        pass\n",
         "`reset` must lead back.* .first 'In the garden: walnut tree.', then 'In the garden: "),
        ('f"In the garden: {\', \'.join(self.things) or \'nothing\'}."', '"A garden."',
         r"`state` must show what an action changes"),
        ("or 'nothing'}.\")", "or 'nothing'}.\", 'x')",
         r"text of `state` must change its fingerprint: a"),
        ("            return StepResult(action, False,",
         "            self.things = ()\n            return StepResult(action, False,",
         "a failure must change nothing"),
        (RESULT, RESULT.replace("=lasts", "=False"), "action says True .* must agree"),
        (RESULT, RESULT.replace("=lasts", "=True"), "action says False .* must agree"),
        ("(FELLING if action == FELLING else action for", "(action for", "action says False"),
        (RESULT, RESULT.replace("=ends", "=False"), "'finish' ends the task, but no result"),
        (RESULT, RESULT.replace("=ends", "=True"), "terminates: give it ends=True"),
        (', (), ends=True, phrase="The garden is done")', ", ())", "no verb ends the task"),
        ("pick(said, names)", "pick(said, names) or THINGS[0]", "must not be replaced"),
        ("        plan = [(do,", "        self.things = ()\n        plan = [(do,",
         "`resolve` must change nothing"),
        ('plans.get(order.do, ())', 'plans.get(order.do, [goes])', "takes the limit"),
        ("return Resolution((Action(\"finish\"),))", "return Resolution(Action(\"finish\"))",
         r"a tuple of actions and a text"),
        ("return list(THINGS[:limit])", "return ['volcano'][:limit]", "no order and no guess has"),
        ("return list(THINGS[:limit])", "return list(THINGS)", "must give 1 names at most"),
        ("for each in dialogue.limits if", "for each in () if", "what the person ruled out"),
        ("        if name in self.things or any", "        if any", "what is done already"),
        ('[Action("add", name)] if', '[FELLING] if', "which no agent guesses"),
        ("return SCENARIOS(text, 1)", "return [text]", "`like` must give a list of Scenarios"),
        ('"wildflowers", "lavender", "insect hotel"),\n    ("watch',
         '"wildflowrs", "lavender", "insect hotel"),\n    ("watch', "did you mean .'wildflowers'"),
        (MET, "return met", "`checks_met` must give Checks, not"),
        (MET, "return Checks((True,))", "Checks with 3 bools, one for each check of bees, not Ch"),
        (MET, "return Checks((True,) * 3)", "all checks of bees hold before any action"),
        (MET, "return Checks(tuple(map(bool, met)), self.things)", "unwanted things for bees"),
        ('if each.name == "remove"]', 'if each.name == "x"]', "what `undo` gives must succeed"),
        ("in reversed(dialogue.to_undo) if each.action.name in INVERSE]",
         "in reversed(dialogue.to_undo) if each.action.name == 'add']",
         "`undo` must bring the state back"),
        ("for each in reversed(dialogue.to_undo) if", "for each in dialogue.to_undo if",
         "`undo` must bring the state back|what `undo` gives must succeed"),
        ("  self.things = tuple(sorted", "  type(self).things = self.things = tuple(sorted",
         "the instance's own"),
        ('may = {"add"', 'THINGS.index(action.target)\n        may = {"add"',
         r"`step` fails \(mine.py, line \d+: ValueError"),
    ],
)  # fmt: skip
def test_a_planted_defect_is_found(tmp_path: Path, right: str, wrong: str, told: str) -> None:
    settings = planted(tmp_path, right, wrong)
    with pytest.raises(GoalscopeError, match=told):
        check_env(open_environment(settings), profiles_of(settings))


@pytest.mark.parametrize(
    ("member", "given", "told"),
    [
        (
            "serving",
            lambda shop, need, _: [Action("add item", f"Some {need}")],
            "`serving` must give what can be done",
        ),
        (
            "actions",
            lambda shop, name, dialogue: (
                [] if dialogue.limits else [Action("add item", f"Some {name}")]
            ),
            "must give what can be done",
        ),
        (
            "actions",
            lambda shop, name, _: GroceryShop.actions(shop, name, DialogueState()),
            "must leave out what the person ruled out",
        ),
    ],
)
def test_a_planted_defect_of_the_shops_guesses_is_found(
    member: str, given: object, told: str
) -> None:
    wrong = type("Wrong", (GroceryShop,), {member: given})
    with pytest.raises(GoalscopeError, match=told):
        check_env(wrong(CATALOGUE, search=SEARCH), most=8)


def test_a_guess_that_ignores_a_ban_in_lower_case_is_found() -> None:
    class Wrong(GroceryShop):
        def offers(self, text, limit):
            return [name.title() for name in super().offers(text, limit)]

        def actions(self, name, dialogue):
            is_ruled_out = any(limit.what in name for limit in dialogue.limits)
            return [] if is_ruled_out else super().actions(name.lower(), DialogueState())

    with pytest.raises(GoalscopeError, match="must leave out what the person ruled out"):
        check_env(Wrong(CATALOGUE, search=SEARCH), most=8)


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        ("verbs, things = VERBS,", "verbs, things = VERBS[0],",
         "mine.py: `verbs` must be a tuple of Verbs, not the one Verb 'add'"),
        ('("what", "for")', '("what")', "must be a tuple, not the text 'what'. Write ('what',)"),
        ('"aim own food\\nadd pond\\navoid roses"', '"plant pond"', "The orders of the example"),
        ("examples=(SHOWN,)", "examples=('add pond',)", "`examples` must be a tuple of Examples"),
    ],
)  # fmt: skip
def test_a_wrong_declaration_is_one_line_before_the_first_round(
    tmp_path: Path, right: str, wrong: str, told: str
) -> None:
    settings = planted(tmp_path, right, wrong)
    line = fails(2, "run", settings.domain, "--profile", "bees", "--method", "no-goals")
    assert told in " ".join(line.split())


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (Action("add", "pond"), r"`resolve` of Wrong must return a Resolution\("),
        (Resolution((), None), "a tuple of actions and a text"),  # pyright: ignore[reportArgumentType]
    ],
)
def test_an_agent_names_the_member_that_gives_something_else(
    tmp_path: Path, given: object, told: str
) -> None:
    garden = open_environment(planted(tmp_path, "LIFE = (", "LIFE = ("))
    env = type("Wrong", (type(garden),), {"resolve": lambda *_: given})()
    with pytest.raises(GoalscopeError, match=told):
        Agent(env, NamedModel(), method="no-goals").step("What else?", "add pond")


def test_an_error_of_a_domain_is_one_line_that_names_its_place(tmp_path: Path) -> None:
    settings = planted(tmp_path, "        may = {", "        action.name[99]\n        may = {")
    store = tmp_path / "episodes.db"
    options = ("--profile", "kitchen", "--method", "no-goals", "--store", store)
    failed = run("run", settings.domain, *options)
    assert failed.exit_code == 1
    line = " ".join(failed.stderr.split())
    assert "Traceback" not in line
    assert "mine.py, line " in line
    assert "IndexError: string index out of range. Correct `step` in that file." in line


def test_a_request_to_confirm_is_declined_only_where_it_ends_the_task(tmp_path: Path) -> None:
    pay = 'Verb("pay", "pay the bill", (), irreversible=True),\n    Verb("finish"'
    garden = open_environment(planted(tmp_path, 'Verb("finish"', pay))
    assert consents(f'I understood "pay". {CONFIRM}', garden, done=False) == AGREES
    assert consents(f'I understood "finish". {CONFIRM}', garden, done=False) == DECLINES
    assert consents(f'I understood "finish". {CONFIRM}', garden, done=True) == AGREES
    assert consents(f'I understood "empty". {SAY_YES}', garden, done=False) == AGREES
    assert consents("What else?", garden, done=True) == ""
