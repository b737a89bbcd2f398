"""What a writer is taught by: rows of a corpus, and the prompts and answers made of them."""

import json
import random
from pathlib import Path

import pytest

import lessons
from corpus import Entry, Talk, read_entries
from fakes import WordModel
from goalscope.agent.writer import JUDGEMENTS, Writer
from goalscope.base.nouns import singulars
from goalscope.envs.scenarios import Scenario, shipped_scenarios
from goalscope.experiment.reading_scores import Language
from goalscope.language.orders import Verb
from lessons import Lesson, lessons_of

LANGUAGES = {"grocery": Language((Verb("add", ""), Verb("clear", "", ())), "You sell food.", ())}
ROWS = {
    "message": {
        "id": "a-1",
        "domain": "grocery",
        "turns": [{"message": "milk", "orders": []}],
    },
    "talk": {
        "id": "a-2",
        "domain": "grocery",
        "turns": [{"query": "Yes?", "utterance": "We have guests."}],
        "done": "add: milk",
        "goals": ["feed guests", "have a party"],
        "question": "How many?",
    },
    "scenario": {
        "id": "a-3",
        "domain": "grocery",
        "aim": "feed guests",
        "said": ["We have guests."],
        "needed": ["bread", "cheese"],
        "nice": ["wine"],
        "unwanted": ["dog food"],
    },
    "recipe": {
        "title": "Mom's Apple Pie (easy) II",
        "ingredients": [
            "2 1/2 cups all-purpose flour, sifted",
            "½ teaspoon salt",
            "6 large apples - peeled and sliced",
            "1 (8 ounce) package cold butter",
            "white sugar or honey",
            "1/2 cup water",
            "3 eggs",
            "1 tablespoon of something that has far too many words",
        ],
    },
}


def read(tmp_path: Path, *rows: object) -> list[Entry]:
    file = tmp_path / "ann.jsonl"
    file.write_text("".join(f"{json.dumps(each)}\n\n" for each in rows))
    return read_entries(file)


def drawn(found: list[Entry], *, known: list[Entry] | None = None, seed: int = 0) -> list[Lesson]:
    """All lessons of one epoch."""
    model, draw = WordModel(), random.Random(seed)
    made = lessons_of(found, model, LANGUAGES, known=known or found)
    return [lesson for each in made for lesson in each(draw)]


def test_a_recipe_becomes_what_its_dish_calls_for(tmp_path: Path) -> None:
    (found,) = read(tmp_path, ROWS["recipe"])
    assert isinstance(found, Scenario)
    assert (found.domain, found.aim, found.said) == ("grocery", "make mom's apple pie", ())
    assert found.needed == ("all-purpose flour", "apples", "butter", "white sugar", "eggs")


def test_recombined_messages_say_what_their_orders_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another thing takes the place of one, in message and order; a first message may join."""
    names = ["milk", "tea", "rice", "soap", "eggs", "pears"]
    rows = [
        ROWS["message"]
        | {
            "id": f"a-{n}",
            "turns": [{"message": f"{name}, please", "orders": [{"do": "add", "what": name}]}],
        }
        for n, name in enumerate(names)
    ]
    found = read(tmp_path, *rows)
    monkeypatch.setattr(lessons, "RENAMED", 1.0)
    for joined, count in ((0.0, {1}), (1.0, {1, 2})):
        monkeypatch.setattr(lessons, "JOINED", joined)
        made = [lesson for seed in range(9) for lesson in drawn(found, seed=seed)]
        assert {len(each.answer.splitlines()) for each in made} == count
        for each in made:
            said = [name for name in names if name in each.prompt[-1].content]
            assert sorted(said) == sorted(line.split()[-1] for line in each.answer.splitlines())


def test_what_is_taught_is_what_the_writer_is_asked_for(tmp_path: Path) -> None:
    """Its prompts are those of the lessons, and it understands their answers."""
    talk, scenario = read(tmp_path, ROWS["talk"], ROWS["scenario"])
    assert isinstance(talk, Talk)
    assert isinstance(scenario, Scenario)
    asked = []

    class Keeps(WordModel):
        def generate(self, messages, **settings):
            asked.append(list(messages))
            return super().generate(messages, **settings)

    made = drawn([talk, scenario])
    answers = {each.kind: each.answer for each in made}
    writer = Writer(Keeps({"Name what": answers["goals"], "aim calls": answers["needs"]}))
    assert writer.goals(LANGUAGES["grocery"].task, talk.turns) == [*talk.goals]
    assert writer.needs("feed guests", "", []) == ["bread", "cheese", "wine"]
    assert asked[0] == [*next(each.prompt for each in made if each.kind == "goals")]


def judged(made: list[Lesson]) -> list[tuple[str, str]]:
    """Things with what is said of them."""
    return [
        (each.prompt[-1].content.rpartition("\nAnd ")[2].removesuffix("?"), each.answer)
        for each in made
        if each.kind == "judging"
    ]


@pytest.mark.parametrize("domain", ["grocery", "house"])
def test_judgements_never_call_needed_what_is_unwanted_nor_the_reverse(domain: str) -> None:
    found = [*shipped_scenarios(domain).things[:120]]
    by_aim = {each.aim: each for each in found}
    labels = set[str]()
    made = lessons_of(found, WordModel(), LANGUAGES, known=found)
    for number, each in enumerate(found):
        for thing, label in judged(made[number](random.Random(number))):
            labels.add(label)
            right = {"needed": each.needed, "nice": each.nice}.get(label)
            if right is not None:
                assert thing in right
                assert thing not in each.unwanted
            else:
                assert thing not in each.needed + each.nice
                same = {" ".join(singulars(own)) for own in each.needed + each.nice}
                assert " ".join(singulars(thing)) not in same
    assert labels == {*JUDGEMENTS}
    assert len(by_aim) > 100


def test_a_scenario_never_lies_in_its_own_prompt() -> None:
    found = [*shipped_scenarios("grocery").things[:60]]
    made = lessons_of(found, WordModel(), LANGUAGES, known=found)
    shown = 0
    for number, each in enumerate(found):
        for lesson in made[number](random.Random(number)):
            text = lesson.prompt[-1].content
            assert f"{each.aim}\nneeded:" not in text
            shown += "\nneeded:" in text
    assert shown
