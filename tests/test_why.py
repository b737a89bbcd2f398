"""Why a goal is likely: what each utterance and each word says for it, and how that is shown."""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commands import fails, run
from databases import begin
from fakes import WordModel, said
from goalscope.base.types import UNSPECIFIED, Goal, InvalidInputError, ModelError, Turn
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import DEFAULT, PAPER, Calibration
from goalscope.belief.explain import Reason, in_words, reasons, word_evidence
from goalscope.belief.goal_order import in_order
from goalscope.belief.likelihood import RolePlay
from goalscope.cli.display import show_reasons
from goalscope.storage.store import Store
from test_display import HOSTILE, drawn
from test_store import EPISODE, a_round

CAKE, SOUP, WASH = Goal("bake cake"), Goal("cook soup"), Goal("wash")
SUPPORT = (UNSPECIFIED, CAKE, SOUP, WASH)
CALIBRATIONS = (PAPER, Calibration(temperature=4.0), replace(DEFAULT, switching=0.2))
TURNS = [Turn("What now?", "Cake, cupcakes"), Turn("And then?", "a soup   and soap!")]

rows = st.lists(st.lists(st.floats(-50, 0), min_size=4, max_size=4), min_size=1, max_size=4)


def belief_of(table, calibration: Calibration = PAPER) -> Belief:
    return replace(Belief.uniform(SUPPORT, calibration), log_likelihood=np.array(table))


@pytest.mark.parametrize(
    ("row", "told"),
    [
        (
            [-9, -1, -4, -9],
            "I think this is what you want: bake cake (95%), mostly because you said "
            '"Cake, cupcakes".',
        ),
        (
            [-9, -2, -3, -9],
            "I think this is what you want: bake cake (73%), mostly because you said "
            '"Cake, cupcakes". It could also be: cook soup (27%).',
        ),
        (
            [-1, -2, -3, -3],
            "I am not sure what you want. Perhaps this: something else (61%). "
            "It could also be: bake cake (22%) or cook soup (8%).",
        ),
        (
            [-99, -1, -99, -99],
            "I think this is what you want: bake cake (99%), mostly because you said "
            '"Cake, cupcakes".',
        ),
        ([-0, -6, -7, -8], "I do not know yet what you want."),
    ],
)
def test_a_belief_is_told_in_words(row: list[float], told: str) -> None:
    assert in_words(belief_of([row]), TURNS[:1]) == told


@given(rows)
def test_what_is_told_in_words_names_the_likeliest_goal_once(table) -> None:
    belief = belief_of(table)
    told = in_words(belief, [Turn("And?", "Yes. " * 99)] * len(table))
    stated = [goal.text for goal, p in belief.top()[:3] if goal != UNSPECIFIED and p >= 0.05]
    assert [told.count(text) for text in stated] == [1] * len(stated)


@pytest.mark.parametrize(("spoken", "told"), [(1.0, False), (1.09, False), (1.11, True)])
def test_only_words_that_a_goal_makes_three_times_as_likely_are_told_as_a_reason(
    spoken: float, told: bool
) -> None:
    table = [[-9, -9 + spoken, -9, -9], [-9, -9 + spoken / 2, -9, -9]] * 4
    turns = [Turn("", "hi"), Turn("Yes?", "ok")] * 4
    assert ('you said "hi"' in in_words(belief_of(table), turns)) == told
    assert 'you said "ok"' not in in_words(belief_of(table), turns)


def test_what_is_not_to_be_acted_on_is_told_as_unsure_however_probable() -> None:
    belief = belief_of([[-99, -1, -99, -99]])
    told = in_words(belief, TURNS[:1], doubted=True)
    assert told.startswith("I am not sure what you want. Perhaps this: bake cake (99%)")


def test_a_belief_without_words_is_told_by_what_is_known() -> None:
    assert "I am not sure" in in_words(belief_of(np.zeros((0, 4))), [])
    assert in_words(Belief.uniform([UNSPECIFIED]), []) == "I do not know yet what you want."
    confirmed = belief_of([[-9, -4, -1, -9]]).pin(CAKE)
    assert in_words(confirmed, TURNS[:1]) == (
        "I think this is what you want: bake cake (99%), which you confirmed."
    )


class Pieces:
    """A tokenizer whose tokens are at most three letters, and may begin with spaces."""

    def tokenize(self, text: str) -> list[str]:
        return re.findall(r"\s*\S{1,3}", text)

    def detokenize(self, tokens: Sequence[str]) -> str:
        return "".join(tokens)


class Speller(WordModel):
    """Tokens that the context holds are likelier, and more so if they are long."""

    tokenizer = Pieces()

    def token_logprobs(self, contexts, continuations):
        texts = [" ".join(message.content for message in context).lower() for context in contexts]
        pieces = [self.tokenizer.tokenize(words) for words in continuations]
        return [
            np.array([-9.0 + len(p) * (p.strip().lower() in text) for p in row], dtype=float)
            for text, row in zip(texts, pieces, strict=True)
        ]


def test_words_that_speak_for_a_change_of_mind_are_told() -> None:
    table = [[-9.0, -1.0, -9.0, -9.0], [-9.0, -9.0, -1.0, -9.0]]
    changing, never = (
        reasons(belief_of(table, way), TURNS, SOUP) for way in (Calibration(switching=0.3), PAPER)
    )
    assert [each.change for each in never] == [0, 0]
    assert changing[0].change == 0
    assert 0.2 < changing[1].change <= 0.3
    assert changing[1].probability > never[1].probability
    told = drawn(show_reasons, SOUP, changing)
    assert "The person may have changed their mind before turn 2" in " ".join(told.split())
    assert "changed their mind" not in drawn(show_reasons, SOUP, never)


@given(rows, st.sampled_from([*CALIBRATIONS[:2], replace(DEFAULT, switching=0.0)]))
def test_evidence_is_what_moves_the_belief_after_the_calibration(table, way) -> None:
    belief = belief_of(table, way)
    moved = np.diff(belief.log_posteriors, axis=0)
    odds = belief.evidence - belief.evidence[:, :1]
    assert odds == pytest.approx(moved - moved[:, :1], abs=1e-7)
    stated = np.array(table)[:, 1:] / way.temperature
    assert belief.evidence[:, 1:] == pytest.approx(stated)


@given(rows, st.sampled_from(CALIBRATIONS), st.sampled_from(SUPPORT))
def test_evidence_is_against_the_mean_of_the_others_as_it_counts(table, way, goal) -> None:
    belief = belief_of(table, way)
    found = reasons(belief, said(*map(str, range(len(table)))), goal)
    place = SUPPORT.index(goal)
    for number, (row, each) in enumerate(zip(belief.evidence, found, strict=True)):
        others = (row.sum() - row[place]) / 3
        assert each.evidence == pytest.approx(row[place] - others, abs=1e-9)
        assert (each.turn, each.utterance) == (number + 1, str(number))
        until = belief_of(table[: number + 1], way).probability[place]
        assert each.probability == pytest.approx(until, abs=1e-9)
        rest = [*table[:number], [0.0] * 4, *table[number + 1 :]]
        assert each.without == pytest.approx(belief_of(rest, way).probability[place], abs=1e-9)


def test_a_goal_without_others_has_the_evidence_of_its_words() -> None:
    belief = Belief.uniform([CAKE], Calibration(temperature=2.0)).observe([-3.0])
    assert reasons(belief, said("x"), CAKE) == [Reason(1, "x", -1.5, 1.0, 1.0)]


@pytest.mark.parametrize("way", CALIBRATIONS)
@pytest.mark.parametrize("goal", [CAKE, UNSPECIFIED])
@pytest.mark.parametrize("pinned", [False, True])  # after all words, so that all still count
def test_words_add_up_to_what_their_turn_says(way, goal, pinned: bool) -> None:
    likelihood = RolePlay(Speller())
    turns = [*TURNS, Turn("Sure?", "a")]
    table = likelihood.log_likelihood("t", SUPPORT, turns)
    belief = belief_of(table, way).pin(CAKE) if pinned else belief_of(table, way)
    whole = reasons(belief, turns, goal)
    for end, reason in enumerate(whole, 1):
        found = word_evidence(likelihood, "t", belief, turns[:end], goal)
        assert "".join(word for word, _ in found) == turns[end - 1].utterance
        assert sum(nats for _, nats in found) == pytest.approx(reason.evidence, abs=1e-9)
        assert abs(reason.evidence) > 0.1 or end == 3


def test_a_word_is_all_its_tokens_and_the_space_before_it() -> None:
    likelihood = RolePlay(Speller())
    belief = belief_of(likelihood.log_likelihood("t", SUPPORT, TURNS))
    first, second = (word_evidence(likelihood, "t", belief, TURNS[:n], CAKE) for n in (1, 2))
    assert [word for word, _ in first] == ["Cake,", " cupcakes"]
    assert [word for word, _ in second] == ["a", " soup", "   and", " soap!"]
    assert first[0][1] > 1 > second[1][1]


def shown(utterance: str, *, width: int = 80, goal: Goal = CAKE) -> str:
    return drawn(show_reasons, goal, [Reason(1, utterance, 1.26, 0.5, 0.25)], width=width)


def test_reasons_are_shown_with_their_numbers() -> None:
    (line,) = (line for line in shown("I need cocoa").splitlines() if "cocoa" in line)
    assert re.findall(r"[-+.\w%]+", line) == ["1", "+1.26", "50.0%", "25.0%", "I", "need", "cocoa"]
    assert "Why bake cake" in shown("I need cocoa")
    assert max(map(len, shown("word " * 50, width=60).splitlines())) <= 60


def test_hostile_words_are_shown_and_not_obeyed() -> None:
    text = shown(HOSTILE, width=300, goal=Goal(HOSTILE))
    assert text.count("[red]x[/red][/]") == 2
    assert ":smile:" in text
    assert not set(text) & set("\x1b\x07\r\u202e")


GOALS = ["Make tea", "make toast", "bake"]


@pytest.fixture
def kept(store_file):
    """Id of an episode of two rounds, in which what is likeliest changes."""
    belief = Belief.uniform([UNSPECIFIED, *map(Goal, GOALS)]).observe([-3.0, -1.0, -4.0, -4.0])
    after = belief.observe([-9.0, -9.0, -8.0, -1.0])
    with Store.open(store_file) as store:
        id = begin(store, **EPISODE)
        store.append(id, a_round(1, belief=belief, turn=Turn("Yes?", "Tea")))
        store.append(id, a_round(2, belief=after, turn=Turn("And?", "Flour \x1b[31m")))
    return id


def test_why_tells_of_the_likeliest_goal_after_the_last_round_or_the_named_one(kept) -> None:
    last = json.loads(run("why", kept, "--json").stdout)
    assert last["goal"] == "bake"
    assert set(last) == {"goal", "reasons", "confirmed"}
    assert [each["utterance"] for each in last["reasons"]] == ["Tea", "Flour \x1b[31m"]
    evidence = [each["evidence"] for each in last["reasons"]]
    assert evidence == pytest.approx([-4 + 8 / 3, -1 + 26 / 3])
    first = json.loads(run("why", kept[:6], "--round", 1, "--json").stdout)
    assert (first["goal"], len(first["reasons"])) == ("Make tea", 1)
    assert first["reasons"][0]["without"] == pytest.approx(0.25)
    for name in ("make TOAST", "MAKE to"):
        named = json.loads(run("why", kept, "--goal", name, "--json").stdout)
        assert named["goal"] == "make toast"


def test_why_tells_what_was_confirmed_and_when(store_file) -> None:
    tea, toast = map(Goal, GOALS[:2])
    belief = Belief.uniform([tea, toast]).pin(toast).observe([-9.0, -1.0]).pin(tea)
    with Store.open(store_file) as store:
        id = begin(store, **EPISODE)
        store.append(id, a_round(1, belief=belief, turn=Turn("Yes?", "Toast")))
    told = json.loads(run("why", id, "--json").stdout)
    assert (told["goal"], told["confirmed"]) == (tea.text, [{"goal": tea.text, "turn": 1}])
    text = run("why", id).stdout
    assert "You confirmed it after turn 1." in text
    assert "make toast" not in text
    other = run("why", id, "--goal", toast.text).stdout
    assert 'You confirmed "Make tea" after turn 1.' in other


def test_what_why_cannot_tell_is_said_in_one_line(kept, store_file) -> None:
    with Store.open(store_file) as store:
        blind = begin(store, **{**EPISODE, "method": "no-goals"})
        store.append(blind, a_round(1, belief=in_order((), ())))
        unborn = begin(store, **EPISODE)
    for name, what in (("wash", "None of these goals begins"), ("make", "Several of these goals")):
        told = run("why", kept, "--goal", name)
        assert (told.exit_code, told.stdout) == (2, "")
        *goals, line = told.stderr.splitlines()
        assert goals == ["- Unspecified", "- Make tea", "- make toast", "- bake"]
        assert what in line
    assert "2 rounds" in fails(2, "why", kept, "--round", 3)
    assert "no-goals" in fails(2, "why", blind)
    assert "0 rounds" in fails(2, "why", unborn)
    assert "goalscope episodes" in fails(2, "why", "nothing")
    assert run("why", kept, "--round", 0).exit_code == 2


def test_characters_of_several_tokens_stay_whole(tmp_path: Path) -> None:
    fits = pytest.importorskip("fits")
    words = "Crème brûlée 🎂 für 茶"
    model = fits.Transformers(fits.tiny_folder(tmp_path / "t"), device="cpu", dtype="float32")
    pieces, table = RolePlay(model).token_log_likelihood("t", SUPPORT, [Turn("?", words)])
    assert "".join(pieces) == words
    assert len(pieces) == len(table) > len(words.split())


def test_a_scorer_without_tokens_is_said() -> None:
    belief = Belief.uniform(SUPPORT).observe([0.0] * len(SUPPORT))
    with pytest.raises(ModelError, match="has no tokenizer"):
        word_evidence(RolePlay(WordModel()), "t", belief, TURNS[:1], SUPPORT[1])


def test_a_goal_is_found_by_its_text_and_meaning() -> None:
    belief = Belief.uniform([CAKE, SOUP]).observe([-3.0, -1.0])
    for named in ("bake cake", " BAKE CAKE. ", Goal("bake cake!")):
        assert reasons(belief, said("x"), named) == reasons(belief, said("x"), CAKE)
    for wrong, cause in ((WASH, r"'wash'.*bake cake; cook soup"), ("", "empty")):
        with pytest.raises(InvalidInputError, match=cause):
            reasons(belief, said("x"), wrong)
        with pytest.raises(InvalidInputError, match=cause):
            word_evidence(RolePlay(WordModel()), "t", belief, said("x"), wrong)
    with pytest.raises(InvalidInputError, match="1 turn, not 2"):
        reasons(belief, said("x", "y"), CAKE)
