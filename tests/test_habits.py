"""Simulated people with habits: when they say what, whatever the model does."""

import dataclasses
import typing

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes import LampRoom, WordModel, said
from goalscope.agent.habits import CHANGED, HESITATION, REMARKS, WORDS, Habit, habitual, shortened
from goalscope.agent.people import SimulatedHuman, completes
from goalscope.agent.settings import Settings, settings_of
from goalscope.base.nouns import contains, singulars
from goalscope.base.types import InvalidInputError, Profile
from goalscope.cli import chat as cli_chat
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.house import HomeRobot, HouseController
from goalscope.models import Completion
from goalscope.storage.session import Session
from goalscope.storage.store import Store

HABITS = typing.get_args(Habit)
READER = Profile("reader", "You want to read: novels, in bed. You need a lamp.", ())
SLEEPER = Profile("sleeper", "You want to sleep. You need darkness.", ())
PEOPLE = (READER, SLEEPER)
TALK = said(*[f"word {n}" for n in range(20)])


class Player(WordModel):
    """Says which person it was told to be, in which round, and keeps what it was asked."""

    def __init__(self, *replies: str) -> None:
        super().__init__()
        self.said = replies
        self.asked: list[tuple[list, dict]] = []

    def generate(self, messages, **settings) -> Completion:
        self.asked.append((list(messages), settings))
        text = self.said[(len(self.asked) - 1) % len(self.said)] if self.said else "I say this."
        return Completion(text, "stop", 1, 1)

    @property
    def last(self) -> str:
        return "\n".join(message.content for message in self.asked[-1][0])


def spoken(habit, model, rounds=12, *, profile=READER, seed=0, env=None):
    """What a person says in each round of a conversation."""
    human = habitual(habit, model, profile, env or LampRoom(), seed=seed, people=PEOPLE)
    return [human.reply(f"Query {n}?", TALK[:n], "On: nothing.") for n in range(rounds)]


def prompts(model: Player) -> list[str]:
    return ["\n".join(message.content for message in messages) for messages, _ in model.asked]


@pytest.mark.parametrize("habit", HABITS)
@pytest.mark.parametrize("start", [1, 2, 3, 7])
def test_a_resumed_person_goes_on_as_they_would_have(habit, start) -> None:
    whole = Player()
    expected = spoken(habit, whole)
    resumed = Player()
    human = habitual(habit, resumed, READER, LampRoom(), people=PEOPLE)
    words = [human.reply(f"Query {n}?", TALK[:n], "On: nothing.") for n in range(start, 12)]
    assert words == expected[start:]
    assert resumed.asked == whole.asked[start:]


def test_a_person_without_habit_is_as_in_the_paper() -> None:
    model = Player()
    human = SimulatedHuman(model, READER, LampRoom())
    assert human.reply("Yes?", TALK[:5], "On: nothing.") == "I say this."
    ((messages, settings),) = model.asked
    assert settings == {"max_tokens": 80, "stop": ("\n",), "seed": 5}
    assert "in one or two short sentences at a time." in messages[0].content
    assert messages[2].content == "I'd like to grow roses for my wife."
    assert messages[4].content == "I don't have a garden, only a balcony."
    assert messages[5:-1] == [
        message
        for turn in TALK[:5]
        for message in (
            dataclasses.replace(messages[1], content=turn.query),
            dataclasses.replace(messages[2], content=turn.utterance),
        )
    ]
    assert messages[-1].content == (
        "(You are another human now: You want to read: novels, in bed. You need a lamp.\n"
        'On: nothing.\nSay "Good night" if nothing that you want is missing; '
        "else say what is missing.\n)\n\nYes?"
    )


def test_terse_people_say_few_words() -> None:
    model = Player("Well, I would like to have some lamp light", "Light. For reading in bed.", "")
    assert spoken("terse", model, 3) == [
        "Well, I would like to have",
        "Light. For reading in bed.",
        "Good night",
    ]
    assert f"at most {WORDS} words" in model.last
    assert all(settings["max_tokens"] < 40 for _, settings in model.asked)


def test_terse_people_end_the_task_in_whole_words() -> None:
    shop = GroceryShop(Catalogue.load(None))
    (words,) = spoken("terse", Player("Fine, that is all now, buy the basket."), 1, env=shop)
    assert words == "Buy the basket"


def test_terse_people_do_not_end_the_task_because_they_were_cut() -> None:
    shop = GroceryShop(Catalogue.load(None))
    said = "I'd like to buy the basket but first add two loaves of bread."
    cut = shortened(said, WORDS)
    assert completes(shop, cut)
    assert spoken("terse", Player(said), 1, env=shop) == [HESITATION]


@given(st.text(), st.integers(1, 9))
def test_what_is_shortened_is_a_beginning_of_so_many_words(text, most) -> None:
    words = shortened(text, most)
    assert len(words.split()) <= most
    assert " ".join(text.split()).startswith(" ".join(words.split()))


def test_distracted_people_answer_two_times_of_three_and_at_first() -> None:
    for seed in range(20):
        model = Player()
        spoken("distracted", model, 19, seed=seed)
        beside = ["About:" in prompt for prompt in prompts(model)]
        assert not beside[0]
        assert [sum(beside[n : n + 3]) for n in range(1, 19, 3)] == [1] * 6
    assert len({tuple(spoken("distracted", Player("a"), seed=s)) for s in range(3)}) == 1


def test_seeds_and_people_are_distracted_in_different_rounds() -> None:
    def beside(profile, seed):
        model = Player()
        spoken("distracted", model, 19, profile=profile, seed=seed)
        return tuple("About:" in prompt for prompt in prompts(model))

    assert len({beside(READER, seed) for seed in range(5)}) > 1
    assert beside(READER, 0) != beside(SLEEPER, 0)


def test_what_is_beside_the_point_is_drawn_without_the_goal_and_the_conversation() -> None:
    model = Player()
    spoken("distracted", model, 19)
    remarks = [prompt for prompt in prompts(model) if "About:" in prompt]
    assert len(set(remarks)) == len(remarks)
    for prompt in remarks:
        assert not any(word in prompt for word in ("novels", "Query", "word", "On:"))


@pytest.mark.parametrize("words", ["", "Good night", "Yes, the weather is fine.", "No!"])
def test_a_remark_neither_answers_nor_ends_the_task(words) -> None:
    model = Player(words)
    replies = spoken("distracted", model, 19)
    beside = [r for r, p in zip(replies, prompts(model), strict=True) if "About:" in p]
    assert set(beside) <= set(REMARKS.values())


@pytest.mark.parametrize("words", [*REMARKS.values(), HESITATION, CHANGED])
def test_fixed_words_mean_nothing_to_any_environment(words) -> None:
    robot = HomeRobot(HouseController("Kitchen1"))
    for env in (GroceryShop(Catalogue.load(None)), robot):
        assert not completes(env, words)
        names = [each for each in env.offers("", 1000) if contains(singulars(words), each)]
        assert names == []


def test_details_are_volunteered_late() -> None:
    model = Player()
    spoken("volunteers-late", model, 6)
    told = ["You need a lamp." in prompt for prompt in prompts(model)]
    assert told == [False, False, True, True, True, True]
    assert "You want to read.\n" in prompts(model)[0]
    assert "novels" not in prompts(model)[1]


def test_a_description_of_one_part_is_known_from_the_start() -> None:
    model = Player()
    plain = Profile("plain", "You want milk, e.g. oat milk.", ())
    spoken("volunteers-late", model, 1, profile=plain)
    assert "You want milk, e.g. oat milk." in model.last


def test_who_changes_their_mind_is_another_at_first_and_says_so() -> None:
    model = Player()
    replies = spoken("changes-mind", model, 9)
    first = ["You want to sleep." in prompt for prompt in prompts(model)]
    own = ["You want to read: novels" in prompt for prompt in prompts(model)]
    assert first == [True] * 2 + [False] * 7
    assert own == [False] * 2 + [True] * 7
    assert [reply.startswith(CHANGED) for reply in replies] == [False] * 2 + [True] + [False] * 6
    assert not any("word 0" in prompt or "word 1" in prompt for prompt in prompts(model)[2:])
    assert "word 2" in prompts(model)[3]


@pytest.mark.parametrize("habit", ["changes-mind", "volunteers-late"])
@pytest.mark.parametrize("words", ["", "Good night"])
def test_the_task_is_not_ended_before_the_goal_is_told(habit, words) -> None:
    replies = spoken(habit, Player(words), 5)
    assert replies[:2] == [HESITATION] * 2
    assert replies[-1] == "Good night"


def test_the_other_person_is_drawn_by_seed_from_the_same_scene_if_it_has_one() -> None:
    people = [dataclasses.replace(READER, description=f"You want {n}.") for n in range(9)]

    def first(seed, *more):
        human = habitual(
            "changes-mind", Player(), READER, LampRoom(), seed=seed, people=[*people, *more]
        )
        return getattr(human, "first").description  # noqa: B009

    assert len({first(seed) for seed in range(9)}) > 1
    here = Profile("here", "You want tea.", (), scene="Kitchen1")
    at_home = dataclasses.replace(READER, scene="Kitchen1")
    human = habitual("changes-mind", Player(), at_home, LampRoom(), people=[*people, here])
    assert getattr(human, "first") == here  # noqa: B009


def test_nobody_changes_their_mind_where_all_want_the_same() -> None:
    with pytest.raises(InvalidInputError, match="another profile"):
        habitual("changes-mind", Player(), READER, LampRoom(), people=[READER])


@pytest.mark.parametrize("habit", HABITS)
def test_an_episode_with_a_habit_is_stored_and_goes_on(habit, tmp_path) -> None:
    settings = Settings(human=habit, method="no-goals", rounds=3)
    with Store.open(tmp_path / "episodes.db") as store:

        def session(settings, **resume):
            env = GroceryShop(Catalogue.load(None))
            return Session(store, settings, env, Player(), profile="cafe", **resume)

        whole = [round.turn for round in session(settings).run()]
        first = session(dataclasses.replace(settings, rounds=2))
        before = [round.turn for round in first.run()]
        info = store.episode(first.id)
        assert info.settings["human"] == habit
        assert settings_of(info.settings).human == habit
        after = [round.turn for round in session(settings, resume=info).run()]
    assert [*before, *after] == whole


def test_the_command_line_knows_every_person() -> None:
    def literals(hint) -> set[str]:
        parts = typing.get_args(hint)
        return {name for part in parts for name in (literals(part) or {part})}

    offered = literals(typing.get_type_hints(cli_chat.run)["human"])
    assert offered | {"you"} == literals(typing.get_type_hints(Settings)["human"])
