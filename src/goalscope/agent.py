"""Algorithm 1: ask, update the belief, manage the goals, act on the likeliest."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Literal, get_args

from goalscope.asking import COST, informative
from goalscope.belief import Belief
from goalscope.calibration import USUAL, Calibration
from goalscope.dialog import FALLBACK, Human, ask, with_answer
from goalscope.envs import GUESSED, SEARCH, Environment, taken
from goalscope.envs.remarks import asks_why, is_remark, takes_leave
from goalscope.envs.speech import is_question, refuses
from goalscope.episode import Round
from goalscope.goals import UNEXPLAINED, GoalManager, Trigger
from goalscope.likelihood import DEFAULT_LAYOUT, Layout, PromptedRanking, RolePlay
from goalscope.models import Heard, Model
from goalscope.policy import Outcome, Planner, Want, undo
from goalscope.reading import CONFIRM, Words, not_done, read, says_yes
from goalscope.taking_back import gone, heard, take_back
from goalscope.tracker import UNCORRECTABLE, Correction, GoalTracker
from goalscope.types import (
    UNSPECIFIED,
    ConflictError,
    Goal,
    GoalChange,
    GoalscopeError,
    InvalidInputError,
    StepResult,
    TakenBack,
    Turn,
    checked_text,
    spoken,
)

__all__ = ["ASKED_FOR", "NOTHING_DONE", "NO_ANSWER", "NO_GOAL"]
__all__ += ["Agent", "Method", "Questions", "run_episode"]

Method = Literal["good", "no-goals", "no-inference"]
"""The paper's agent and its ablations (Sec. 4.3); see `Agent`."""

Questions = Literal["likeliest", "informative"]
"""How an agent chooses what it asks; see `Agent`."""

NO_GOAL = "The goals do not explain the newest words, and no better ones were found."
"""A round's note where a goal is missing."""

ASKED_FOR = "I did what you asked for, and guessed nothing."
"""A round's note where a person asks why, and only what they asked for was done."""

NOTHING_DONE = "I did nothing for that."
"""A round's note where nothing was done for words that are no remark, and nothing told of them."""

NO_ANSWER = "I cannot answer that."
"""A round's note where a question is none about stock or things, and nothing came of it."""

_FAILURES = 3
"""Most failures that a round's notes tell one by one."""


class Agent:
    """The assistant: one call of `step` is one round of Algorithm 1.

    Args:
        env: Where it acts.
        model: Writes and scores.
        method: "good"; or an ablation of Sec. 4.3: "no-goals" acts on the transcript alone,
            "no-inference" asks the model which goal is likeliest.
        k: Goals to act on.
        patience: See `GoalManager`, as for the next one.
        propose: When goals are proposed; where there are no probabilities, as in the paper.
        layout: Where the likelihood prompt states the goal; None takes the default.
        end_of_turn: Whether the end of the utterance is scored too.
        calibration: How evidence becomes probabilities; None for `USUAL`: what was calibrated on
            given goals is too unsure of goals that the agent proposes itself (LOG.md).
        questions: "likeliest" asks the question whose words the model finds likeliest, as in the
            paper; "informative" the one whose answer is expected to tell most (see `informative`).
        cost: Nats that an informative question must be expected to tell.
        planner: Chooses what to do; None for the one that fills a basket.
        seed: Seed of everything that is drawn.
        confirm: Whether an end that nobody can undo, such as a purchase, waits until the person has
            confirmed the very state that they were shown (see `step`).
        progress: Is told what the agent does, before each part of it.
        draft: Is told each question that it writes, as it grows; it asks one of them.

    Raises:
        InvalidInputError: There is no such method or way to ask, or the method holds no belief
            that questions could inform.
    """

    def __init__(
        self,
        env: Environment,
        model: Model,
        *,
        method: Method = "good",
        k: int = 3,
        patience: int = 3,
        propose: Trigger = UNEXPLAINED,
        layout: Layout | None = None,
        end_of_turn: bool = False,
        calibration: Calibration | None = None,
        questions: Questions = "likeliest",
        cost: float = COST,
        planner: Planner | None = None,
        seed: int = 0,
        confirm: bool = False,
        progress: Callable[[str], None] | None = None,
        draft: Heard | None = None,
    ) -> None:
        self.env = env
        self.model = model
        self.k = k
        self.questions = questions
        self.cost = cost
        self.seed = seed
        self.confirm = confirm
        self._progress = progress or _silent
        self._draft = draft
        self.planner = planner or Planner(model, seed=seed)
        self.goals = GoalManager(
            model,
            env.task,
            propose="paper" if method == "no-inference" else propose,
            patience=patience,
            seed=seed,
        )
        self.rounds: list[Round] = []
        self.tracker: GoalTracker | None = None
        self._corrections: list[GoalChange] = []
        self._uncorrected: list[tuple[Belief, list[GoalChange]]] = []
        self._asked: tuple[str, float | None] = ("", None)
        if method == "good":
            roleplay = RolePlay(model, layout=layout or DEFAULT_LAYOUT, end_of_turn=end_of_turn)
            self.tracker = GoalTracker(
                task=env.task, likelihood=roleplay, calibration=calibration or USUAL
            )
        elif method == "no-inference":
            self.tracker = GoalTracker(task=env.task, likelihood=PromptedRanking(model))
        elif method != "no-goals":
            raise InvalidInputError(
                f'method must be "good", "no-goals" or "no-inference", not {method!r}'
            )
        if questions not in get_args(Questions):
            raise InvalidInputError(
                f'questions must be "likeliest" or "informative", not {questions!r}'
            )
        if questions == "informative" and method != "good":
            raise InvalidInputError(
                f'Informative questions need the belief of the method "good", not {method!r}.'
            )

    @property
    def turns(self) -> list[Turn]:
        """The transcript so far."""
        return [round.turn for round in self.rounds]

    def ask(self) -> str:
        """The next query (and before it the answer to what the person asked).

        After a remark, or an order that was understood and followed, there is nothing to ask about
        but what else they would like; an informative question is asked after orders, too.
        """
        self._progress("asking")
        turns = heard(self.rounds)
        if turns and (question := self.rounds[-1].question):
            return with_answer(self.env, turns, question)
        if turns and (isinstance(turns[-1], TakenBack) or is_remark(turns[-1].utterance)):
            return with_answer(self.env, turns, FALLBACK)
        seed = self.seed + len(self.rounds)
        tracker = self.tracker
        if self.questions == "informative" and tracker and isinstance(tracker.likelihood, RolePlay):
            self._asked = informative(
                self.model,
                tracker.likelihood,
                self.env,
                tracker.belief,
                self.turns,
                stands=turns,
                cost=self.cost,
                seed=seed,
                heard=self._draft,
            )
            return self._asked[0]
        acted = turns and len(self.rounds[-1].results) > self.rounds[-1].reversals
        if acted and self.env.is_order(turns):
            return with_answer(self.env, turns, FALLBACK)
        return ask(self.model, self.env, self.turns, stands=turns, seed=seed, heard=self._draft)

    def step(
        self,
        query: str,
        utterance: str,
        *,
        confirmed: str = "",
        keep: Callable[[Round], None] | None = None,
    ) -> Round:
        """Take in one turn, and act; on an error agent and environment stay as they were.

        (The environment is reset and its past replayed: in a simulator that takes back even what
        nobody could undo in the world.)

        Words that only ask what the environment can answer give no new goal, and nothing is done
        for them; remarks give none either, and orders that are understood only where there is no
        other. Nothing is guessed for remarks, nor for such orders, nor for a yes or no to the last
        round's question. Once the person says that the task is complete, only what they ask for in
        the same breath is done before it ends: they could not see, and refuse, anything else.

        Args:
            query: What the agent asked.
            utterance: What the person answered.
            confirmed: Fingerprint of the state in which they confirm what nobody can undo; "" where
                they do not. Without it, or a yes to that question, the agent with `confirm` asks
                before it ends the task.
            keep: Stores the round; where it fails, there was no such round.

        Raises:
            ConflictError: What is confirmed is not the present state; nothing was done.
            InvalidInputError: The utterance is empty, broken, or too long for the model.
        """
        turn = Turn(query, checked_text(utterance, "utterance"))
        if self.confirm and confirmed not in ("", self.env.fingerprint()):
            raise ConflictError(
                "Things are no longer as they were shown, so nothing was done. Look again."
            )
        confirmed = confirmed or (self._asked_of() if says_yes(self.env, turn) else "")
        tracker = self.tracker
        before = (tracker.belief, tracker.turns) if tracker else None
        history = [result for round in self.rounds for result in round.results]
        try:
            undone = take_back(self.env, self.rounds, turn)
            turns = heard(self.rounds, turn, away=undone.rounds)
            words = read(self.env, self.rounds, turn, turns, confirmed=bool(confirmed))
            changes, missing = self._update(tracker, turn, words) if tracker else ([], False)
            outcome = self._act(words, turns, [*history, *undone.results])
            outcome = replace(outcome, failed=(*undone.failed, *outcome.failed))
            results = (*undone.results, *outcome.results)
            complete, question = words.ends, outcome.question
            final = self.env.completion_actions() if complete else []
            if final and self.confirm and confirmed != self.env.fingerprint():
                complete, question = False, CONFIRM
            else:
                results += tuple(taken(self.env, action) for action in final)
            told = (
                *([NO_GOAL] if missing and not words.exact else []),
                *undone.notes,
                *self._notes(turns, outcome),
                *(self.env.unmet(turns, outcome.results) if words.act else []),
                *self._how_to_end(turn, words),
            )
            if not (words.asks or complete or results or question or told):
                if is_question(turns[-1].utterance):
                    told = () if with_answer(self.env, turns, "") else (NO_ANSWER,)
                elif not (words.exact or refuses(turns[-1].utterance)):
                    told = (NOTHING_DONE,)
            round = Round(
                number=len(self.rounds) + 1,
                turn=turn,
                belief=tracker.belief if tracker else None,
                changes=(*self._corrections, *changes),
                results=results,
                replans=outcome.replans,
                status=self.env.status(),
                notes=told,
                terminated=complete or any(result.terminated for result in results),
                question=question,
                state=self.env.fingerprint(),
                takes_back=undone.rounds,
                reversals=len(undone.results),
            )
            if keep:
                keep(round)
        except BaseException:
            if tracker and before:
                tracker.belief, tracker.turns = before
            undo(self.env, history)
            raise
        self.rounds.append(round)
        self._corrections, self._uncorrected = [], []
        return round

    def correct(self, correction: Correction, goal: str | Goal, text: str = "") -> Belief:
        """See `GoalTracker.correct`; the next round tells of it.

        Raises:
            InvalidInputError: There is no such goal or no belief, or a text is empty or broken.
        """
        tracker = self.tracker
        if tracker is None:
            raise InvalidInputError(UNCORRECTABLE)
        before = (tracker.belief, self._corrections)
        self._corrections = [*self._corrections, *tracker.correct(correction, goal, text)]
        self._uncorrected.append(before)
        return tracker.belief

    def take_back(self) -> Belief:
        """Undo the newest correction since the last round.

        Raises:
            InvalidInputError: There is none.
        """
        if self.tracker is None or not self._uncorrected:
            raise InvalidInputError("There is no correction to take back.")
        self.tracker.belief, self._corrections = self._uncorrected.pop()
        return self.tracker.belief

    @property
    def can_take_back(self) -> bool:
        """Whether there is a correction to take back."""
        return bool(self._uncorrected)

    @property
    def corrections(self) -> list[GoalChange]:
        """What the person said of the goals themselves since the last round."""
        return list(self._corrections)

    def resume(self, rounds: Sequence[Round]) -> None:
        """Continue after `rounds`: replay their successful actions, take over their belief.

        Raises:
            GoalscopeError: The replay led to another state than the one that was stored.
        """
        undo(self.env, [result for round in rounds for result in round.results])
        last = rounds[-1] if rounds else None
        if last and (
            self.env.status() != last.status or last.state not in ("", self.env.fingerprint())
        ):
            raise GoalscopeError(
                "Replaying the episode's actions led to another state; "
                "has the catalogue or scene changed since? Start a new episode."
            )
        self.rounds = list(rounds)
        if self.tracker and rounds and rounds[-1].belief:
            self.tracker.belief = rounds[-1].belief
            self.tracker.turns = self.turns

    def _update(
        self, tracker: GoalTracker, turn: Turn, words: Words
    ) -> tuple[list[GoalChange], bool]:
        """Weigh the words, and manage the goals; see `GoalTracker.manage`."""
        stated = bool(self._stated(tracker.belief))
        known = len(tracker.belief.goals)
        self._progress(f"scoring {known} {'goal' if known == 1 else 'goals'}")
        tracker.observe(turn.query, turn.utterance)
        return tracker.manage(
            self.goals,
            self.rounds,
            self._corrections,
            propose=not (words.silent or (words.order and stated)),
            progress=self._progress,
        )

    def _act(self, words: Words, turns: Sequence[Turn], history: Sequence[StepResult]) -> Outcome:
        """Do what was asked for, and what the likeliest goals want where something is left open."""
        if not words.act:
            return Outcome((), 0, self.rounds[-1].question if words.asks and self.rounds else "")
        wants = [] if words.exact else self._wants(turns)
        self._progress("planning")
        return self.planner.act(self.env, wants, turns, history)

    def _wants(self, turns: Sequence[Turn]) -> list[Want]:
        """What to act for: the top k goals; the planner weighs what remains by the words alone."""
        if self.tracker is None:
            return [Want(self.planner.newest(spoken(turns)), 1.0)]
        return [Want(goal.text, p) for goal, p in self._stated(self.tracker.belief)]

    def _stated(self, belief: Belief) -> list[tuple[Goal, float]]:
        """The top k goals, without "Unspecified"."""
        return [each for each in belief.top() if each[0] != UNSPECIFIED][: self.k]

    def _notes(self, turns: Sequence[Turn], outcome: Outcome) -> Iterator[str]:
        """What the person should be told of a round.

        What could not be done is told once, and again where they ask for it again.
        """
        turn = turns[-1]
        query, gain = self._asked
        if gain is not None and query == turn.query:
            yield f"The answer to this question was expected to tell {gain:.2f} nats."
        if self.tracker:
            yield from self.tracker.notes
            if asks_why(turn.utterance) and self._only_asked(turn.utterance):
                yield ASKED_FOR
            elif asks_why(turn.utterance) and (stated := self._stated(self.tracker.belief)):
                goals = "; ".join(f"{goal.text} ({p:.0%})" for goal, p in stated)
                yield f"I go by what you ask for, and by what I take you to want: {goals}."
        told = {note for round in self.rounds for note in round.notes}
        again = self.env.requests([turn]) if outcome.failed else []
        failures = [
            note
            for failed in outcome.failed
            for note in [f"Not done: {failed.action}. {failed.observation}"]
            if note not in told or failed.action in again
        ]
        yield from failures[:_FAILURES]
        if len(failures) > _FAILURES:
            yield f"And {len(failures) - _FAILURES} more could not be done."
        if outcome.guessed:
            yield f"{GUESSED}{', '.join(outcome.guessed)}."
        for held in outcome.held:
            yield f"Held back until it is clear what you want: {held}."

    def _how_to_end(self, turn: Turn, words: Words) -> Iterator[str]:
        """What to say where the person seems to want the end, or did not confirm it."""
        if (takes_leave(turn.utterance) or words.wants_end) and not words.ends:
            yield f'If that is all, say "{self.env.completion_phrase}".'
        if words.answers and not words.ends:
            yield not_done(self.env)

    def _asked_of(self) -> str:
        """Fingerprint of the present state, where the person was just asked to confirm it."""
        last = self.rounds[-1] if self.rounds else None
        asked = last and last.question == CONFIRM and last.state == self.env.fingerprint()
        return last.state if last and asked else ""

    def _only_asked(self, why: str) -> bool:
        """Whether nothing was guessed in what a person asks "why" of: the last acts, or all."""
        void = gone(self.rounds)
        standing = (r for r in self.rounds if r.number not in void)
        acted = [r for r in standing if any(each.action.name != SEARCH for each in r.results)]
        if re.search(r"\b(?:that|this|it)\b(?! all\b)", why.casefold()):
            acted = acted[-1:]
        notes = [note for round in acted for note in round.notes]
        return bool(acted) and not any(note.startswith(GUESSED) for note in notes)


def run_episode(agent: Agent, human: Human, *, max_rounds: int = 20) -> Iterator[Round]:
    """Rounds until the task is complete, at most `max_rounds` in all (Algorithm 1).

    Each round is yielded as soon as it is done; the caller stores it before the next begins.
    """
    while len(agent.rounds) < max_rounds and not (agent.rounds and agent.rounds[-1].terminated):
        query = agent.ask()
        utterance = human.reply(query, agent.turns, agent.env.status())
        yield agent.step(query, utterance)


def _silent(step: str) -> None:
    """Nobody listens."""
