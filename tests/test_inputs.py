"""What people write in TOML becomes typed values, or one sentence on what is wrong and where."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from typing import Annotated, Literal

import pytest
from annotated_types import Ge, Le, MinLen

from goalscope.base.inputs import read_profiles, read_toml, validated
from goalscope.base.types import InvalidInputError


@dataclass(frozen=True, slots=True)
class Person:
    name: str
    age: Annotated[int, Ge(1), Le(120)] | None = None
    likes: Annotated[tuple[Literal["tea", "milk"], ...], MinLen(1)] = ("tea",)
    weight: float = 1.0
    tall: bool = False

    def __post_init__(self) -> None:
        if self.name == "Nobody":
            raise ValueError("nobody has this name.")


@dataclass(frozen=True, slots=True)
class Plan:
    people: tuple[Person, ...] = ()
    model: str | dict[Literal["scorer", "generator"], str] = ""
    best: Person | None = None


def read(tmp_path, text):
    (tmp_path / "plan.toml").write_text(text)
    return read_toml(tmp_path / "plan.toml", Plan)


def test_lists_become_tuples_and_tables_classes(tmp_path):
    text = "model = {scorer = 'x'}\n[[people]]\nname = 'Ann'\nlikes = ['milk']\nweight = 2"
    assert read(tmp_path, text) == Plan((Person("Ann", None, ("milk",), 2.0),), {"scorer": "x"})


ANN = "[[people]]\nname = 'Ann'\n"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("poeple = 1", "plan.toml: the key 'poeple' is unknown; did you mean 'people'?"),
        (ANN + "agee = 3", "plan.toml, people 1 'Ann': the key 'agee' is unknown; did you"),
        ("model = {scorr = 'x'}", "plan.toml, model: the key 'scorr' is unknown; did you"),
        ("[best]\nage = 3", "plan.toml, best: the key 'name' is missing."),
        ("people = 3", "plan.toml: 'people' must be a list, not 3."),
        ("people = [3]", "plan.toml, people 1 must be a table of keys, not 3."),
        ("model = 3", "plan.toml: 'model' must be a text or a table of keys, not 3."),
        ("model = {scorer = 3}", "plan.toml, model: 'scorer' must be a text, not 3."),
        (ANN + "age = true", "plan.toml, people 1 'Ann': 'age' must be a whole number, not True."),
        (ANN + "age = 3.0", "'age' must be a whole number, not 3.0."),
        (ANN + "age = 0", "'age' must be at least 1, not 0."),
        (ANN + "age = 121", "'age' must be at most 120, not 121."),
        (
            ANN + f"age = 0x{'f' * 9000}",
            "plan.toml: it is nested too deeply, or has too long a num",
        ),
        (ANN + "tall = 'yes'", "'tall' must be true or false, not 'yes'."),
        (ANN + "weight = nan", "'weight' must be a finite number, not nan."),
        (ANN + "likes = []", "'likes' must have at least 1 item, not 0."),
        (ANN + "likes = ['tae']", "people 1 'Ann', likes 1: 'tae' is unknown; did you mean 'tea'?"),
        ("[[people]]\nname = 'Nobody'", "plan.toml, people 1 'Nobody': nobody has this name."),
        ("people = ", "plan.toml is not valid TOML: "),
    ],
)
def test_one_sentence_names_the_place_what_was_expected_and_what_came(tmp_path, text, sentence):
    with pytest.raises(InvalidInputError) as caught:
        read(tmp_path, text)
    assert sentence in str(caught.value)


def test_an_entry_of_a_list_without_a_name_is_counted():
    with pytest.raises(InvalidInputError, match="rows, entry 2: the key 'name' is missing"):
        validated([{"name": "Ann"}, {}], tuple[Person, ...], "rows")


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (
            {"people": [{"nmae": "Ann"}]},
            "people 1: the key 'nmae' is unknown; did you mean 'name'?",
        ),
        ({"poeple": []}, "row: the key 'poeple' is unknown; did you mean 'people'?"),
        (
            {"best": {"name": "Ann", "liks": ["tea"]}},
            "the key 'liks' is unknown; did you mean 'likes'",
        ),
        ({"people": [{"Name": "Ann"}]}, "the key 'Name' is unknown; did you mean 'name'?"),
        ({"people": [{"title": "Ann"}]}, "people 1: the key 'name' is missing."),
        ({"people": [{"nmae": "Ann", "age": 0}]}, "the key 'nmae' is unknown"),
        ({"people": [{"name": "Ann", "age": 0, "born": 1}]}, "'age' must be at least 1, not 0."),
    ],
)
def test_where_other_keys_are_ignored_one_that_is_misspelt_is_not(data, sentence):
    with pytest.raises(InvalidInputError) as caught:
        validated(data, Plan, "row", ignore_extra=True)
    assert sentence in str(caught.value)


def test_other_keys_are_ignored_where_that_is_asked_for():
    data = {"people": [{"name": "Ann", "names": 1, "born": 1}], "source": {"file": "x"}}
    assert validated(data, Plan, "row", ignore_extra=True) == Plan((Person("Ann"),))
    with pytest.raises(InvalidInputError, match="the key 'names' is unknown"):
        validated(data, Plan, "row")


def test_a_file_that_is_missing_or_no_text_is_named(tmp_path):
    with pytest.raises(InvalidInputError, match=r"no.toml is not readable: No such file"):
        read_toml(tmp_path / "no.toml", Plan)
    (tmp_path / "bytes.toml").write_bytes(b"\xff")
    with pytest.raises(
        InvalidInputError, match=r"bytes.toml is not UTF-8: byte 0xff in line 1. Save"
    ):
        read_toml(tmp_path / "bytes.toml", Plan)


PROFILE = (
    "[[profile]]\nname = 'a'\ndescription = 'd'\nreplies = ['r']\nchecks = [{has = ['tea']}]\n"
)
CHECKS = dict[Literal["has", "lacks"], Annotated[list[Literal["tea", "milk"]], MinLen(1)]]


def test_profiles_are_read_and_may_start_with_a_byte_order_mark(tmp_path):
    (tmp_path / "p.toml").write_text("\ufeff" + PROFILE, encoding="utf-8")
    (profile,) = read_profiles(tmp_path / "p.toml", CHECKS)
    assert (profile.name, profile.checks) == ("a", ({"has": ["tea"]},))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "p.toml: the key 'profile' is missing."),
        ("profile = []", "p.toml: there is no [[profile]] table. Add at least one."),
        (PROFILE * 2, "p.toml, profile 2 'a': another profile has the same name. Rename one."),
        (PROFILE.replace("['r']", "[]"), "p.toml, profile 1 'a': 'replies' is missing or empty."),
        (PROFILE.replace("'d'", "' '"), "p.toml, profile 1 'a': a text is blank."),
        (PROFILE + "scene = 's'", "p.toml, profile 1 'a': the key 'scene' is unknown here."),
        (PROFILE.replace("has", "hass"), "p.toml, profile 1 'a', check 1: the key 'hass' is unk"),
        (PROFILE.replace("tea", "tae"), "check 1, has 1: 'tae' is unknown; did you mean 'tea'?"),
    ],
)
def test_a_profile_that_is_wrong_is_refused_with_its_place(tmp_path, text, sentence):
    (tmp_path / "p.toml").write_text(text)
    with pytest.raises(InvalidInputError) as caught:
        read_profiles(tmp_path / "p.toml", CHECKS)
    assert sentence in str(caught.value)


def test_reading_nothing_imports_no_pydantic():
    code = "import sys, goalscope.base.inputs; sys.exit('pydantic' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
