"""Algorithm 1: ask, read, update the belief, manage the goals, act on orders and likely goals."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Literal

from goalscope.belief import Belief
from goalscope.calibration import DEFAULT, Calibration
from goalscope.dialog import FALLBACK, OPENING, Human, ask, completes
from goalscope.envs import GUESSED, Environment, Pick
from goalscope.episode import Round, retracted
from goalscope.executor import Execution, Executor
from goalscope.goals import UNEXPLAINED, GoalManager, Trigger
from goalscope.guards import UNSURE
from goalscope.likelihood import DEFAULT_LAYOUT, Layout, PromptedRanking, RolePlay
from goalscope.models import Model, OnText
from goalscope.modules import Modules, modules_of
from goalscope.orders import Order, Reading, is_aside
from goalscope.picking import Picker
from goalscope.policy import Guess, Outcome, Want, undo
from goalscope.reader import Exchange, Reader, reader_of
from goalscope.standing import Standing, acting
from goalscope.tracker import UNCORRECTABLE, Correction, GoalTracker
from goalscope.types import (
    UNSPECIFIED,
    ConflictError,
    Goal,
    GoalChange,
    GoalscopeError,
    InvalidInputError,
    StepResult,
    Turn,
    UnreadableAnswerError,
    checked_text,
)
from goalscope.why import in_words
from goalscope.writer import Recalling, Writer

__all__ = ["NO_ANSWER", "NO_GOAL", "Agent", "Method", "run_episode"]

Method = Literal["good", "no-goals", "no-inference"]
"""The paper's agent and its ablations (Sec. 4.3); see `Agent`."""

NO_GOAL = "The goals do not explain the newest words, and no better ones were found."
"""A round's note where a goal is missing."""

NO_ANSWER = "I cannot answer that."
"""The answer to a question about something that is not known here."""

_TELLING = ("aim", "none", "avoid", "only", "budget")
"""Dialogue acts that ask for nothing."""

_FAILURES = 3
"""Most failures that a round's notes tell one by one."""


class Agent:
    """The assistant: one call of `step` is one round of Algorithm 1.

    Args:
        env: Where it acts.
        model: Writes and scores.
        reader: Reads what the person says; by default, the model that writes, by a prompt.
        pick: Finds which of the things that are here is meant; by default, a `Picker`.
        method: "good"; or an ablation of Sec. 4.3: "no-goals" acts on the transcript alone,
            "no-inference" asks the model which goal is likeliest.
        k: Goals to act on.
        patience: See `GoalManager`, as for the next one.
        propose: When goals are proposed; where there are no probabilities, as in the paper.
        layout: Where the likelihood prompt states the goal; None takes the default.
        end_of_turn: Whether the end of the utterance is scored too.
        calibration: How evidence becomes probabilities; None for `DEFAULT`: what was calibrated on
            given goals is too unsure of goals that the agent proposes itself (LOG.md).
        modules: Who proposes, removes, plans and asks; by default, those of the model.
        unsure: Nats of an order's margin below which the agent asks before it does what it read.
        progress: Is told what the agent does, before each part of it.
        draft: Is told its question as it grows, where that is written as it is asked.
        understood: Is told a round as far as it is known before the agent acts: what was read, the
            belief after it, and the goals that came and went.

    Raises:
        InvalidInputError: There is no such method.
    """

    def __init__(
        self,
        env: Environment,
        model: Model,
        *,
        reader: Reader | None = None,
        pick: Pick | None = None,
        method: Method = "good",
        k: int = 3,
        patience: int = 3,
        propose: Trigger = UNEXPLAINED,
        layout: Layout | None = None,
        end_of_turn: bool = False,
        calibration: Calibration | None = None,
        modules: Modules | None = None,
        unsure: float = UNSURE,
        progress: Callable[[str], None] | None = None,
        draft: OnText | None = None,
        understood: Callable[[Round], None] | None = None,
    ) -> None:
        self.env = env
        self.model = model
        self.k = k
        self.reader = reader or reader_of(model, env.verbs, task=env.task, examples=env.examples)
        self._pick = pick or Picker(model)
        self._executor = Executor(env, self._pick, unsure)
        self._progress = progress or _silent
        self._draft = draft
        self._understood = understood
        self.modules = modules or modules_of(model)
        proposer = self.modules.proposer
        self.goals = GoalManager(
            Recalling(proposer, env.like) if isinstance(proposer, Writer) else proposer,
            model,
            env.task,
            remover=self.modules.remover,
            propose="paper" if method == "no-inference" else propose,
            patience=patience,
        )
        self.rounds: list[Round] = []
        self.tracker: GoalTracker | None = None
        self._corrections: list[GoalChange] = []
        self._uncorrected: list[tuple[Belief, list[GoalChange]]] = []
        if method == "good":
            roleplay = RolePlay(model, layout=layout or DEFAULT_LAYOUT, end_of_turn=end_of_turn)
            self.tracker = GoalTracker(
                task=env.task, likelihood=roleplay, calibration=calibration or DEFAULT
            )
        elif method == "no-inference":
            self.tracker = GoalTracker(task=env.task, likelihood=PromptedRanking(model))
        elif method != "no-goals":
            raise InvalidInputError(
                f'method must be "good", "no-goals" or "no-inference", not {method!r}'
            )

    @property
    def turns(self) -> list[Turn]:
        """The transcript so far."""
        return [round.turn for round in self.rounds]

    def ask(self) -> str:
        """The next query, and before it the answer to what the person asked.

        After orders that were followed there is nothing to ask about but what else they would like.
        """
        self._progress("asking")
        if not self.rounds:
            return OPENING
        question = self.rounds[-1].question or self._question()
        answer = self._answer()
        return f"{answer}\n{question}" if answer else question

    def _question(self) -> str:
        last = self.rounds[-1].reading
        if not (last and self._aimed(last)):
            return FALLBACK
        goals = [goal.text for goal, _ in self._stated(self.rounds[-1].belief)]
        return ask(self.modules.asker, self.env, self.turns, self._done(), goals, self._draft)

    def _done(self) -> str:
        """What stands of what was done, in words."""
        gone = retracted(self.rounds)
        results = [
            result.action
            for round in self.rounds
            for result in round.results
            if round.number not in gone and result.ok
        ]
        found: dict[str, list[str]] = {}
        for action in results:
            place = f" {action.destination}" if action.destination else ""
            found.setdefault(action.name, []).append(f"{action.target}{place}")
        return "; ".join(f"{name}: {', '.join(each)}" for name, each in found.items())

    def _answer(self) -> str:
        """The answer to what the newest words ask; "" where they ask nothing."""
        last = self.rounds[-1]
        asked = (
            [order for order in last.reading.orders if order.do == "ask"] if last.reading else []
        )
        standing = self._executor.standing(self.rounds)
        told = (self.env.answer(order, standing, self._pick) for order in asked)
        found = list(dict.fromkeys(each for each in told if each))
        return "\n".join(found) or (NO_ANSWER if asked else "")

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

        The words are read once. Orders are followed as the environment resolves them; what nobody
        can undo, what the reader is unsure of, what has a condition and what an allergy rules out
        waits for a yes to exactly that question, in the state that was shown. For the likeliest
        goals something is guessed where the words tell an aim.

        Args:
            query: What the agent asked.
            utterance: What the person answered.
            confirmed: Fingerprint of the state in which they confirm what waits for a yes; ""
                where they do not, or say it in words.
            keep: Stores the round; where it fails, there was no such round.

        Raises:
            ConflictError: What is confirmed is not the present state; nothing was done.
            InvalidInputError: The utterance is empty, broken, or too long for the model.
        """
        turn = Turn(query, checked_text(utterance, "utterance"))
        state = self.env.fingerprint()
        if confirmed not in ("", state):
            raise ConflictError(
                "Things are no longer as they were shown, so nothing was done. Look again."
            )
        tracker = self.tracker
        before = (tracker.belief, tracker.turns) if tracker else None
        history = [result for round in self.rounds for result in round.results]
        try:
            reading, trouble = self._read(turn)
            done = self._executor.begin(self.rounds, turn, reading, confirmed=bool(confirmed))
            done.notes += [trouble] if trouble else []
            standing = self._executor.standing(
                self.rounds, reading, released=done.released, retracts=done.retracts
            )
            changes, missing = list[GoalChange](), False
            if tracker:
                try:
                    changes, missing = self._update(tracker, turn, reading)
                except UnreadableAnswerError as error:
                    done.notes.append(f"The goals stay as they are. {error}")
            known = Round(
                number=len(self.rounds) + 1,
                turn=turn,
                belief=tracker.belief if tracker else None,
                changes=(*self._corrections, *changes),
                reading=reading,
            )
            if self._understood:
                self._understood(known)
            self._executor.follow(done, standing)
            outcome = Outcome()
            if self._aimed(reading) and not (done.wary or done.ended):
                self._progress("planning")
                past = [*history, *done.results]
                gone = retracted(self.rounds)
                turns = [*(each.turn for each in self.rounds if each.number not in gone), turn]
                outcome = self._planned(turns, past, standing, done.notes)
            round = replace(
                known,
                results=(*done.results, *outcome.results),
                replans=outcome.replans,
                status=self.env.status(),
                notes=(
                    *([NO_GOAL] if missing and not acting(reading.orders) else []),
                    *self._notes(done, outcome),
                    *self._thoughts(reading),
                ),
                terminated=done.ended or any(result.terminated for result in outcome.results),
                question=done.question,
                pending=tuple(done.pending),
                released=done.released,
                state=self.env.fingerprint(),
                retracts=done.retracts,
                reversals=done.reversals,
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

    def undo_correction(self) -> Belief:
        """Undo the newest correction since the last round.

        Raises:
            InvalidInputError: There is none.
        """
        if self.tracker is None or not self._uncorrected:
            raise InvalidInputError("There is no correction to take back.")
        self.tracker.belief, self._corrections = self._uncorrected.pop()
        return self.tracker.belief

    @property
    def can_undo_correction(self) -> bool:
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

    def _read(self, turn: Turn) -> tuple[Reading, str]:
        """What the words were read as; where the model wrote no reading, nothing and why."""
        self._progress("reading")
        before = [
            Exchange(_asked(each.turn), each.turn.utterance, each.reading.orders)
            for each in self.rounds
            if each.reading
        ]
        try:
            return (
                self.reader.read(
                    turn.utterance,
                    question="" if completes(self.env, turn.utterance) else _asked(turn),
                    before=before,
                    names=[self.env.status()],
                ),
                "",
            )
        except UnreadableAnswerError as error:
            return Reading((Order("none"),)), str(error)

    def _update(
        self, tracker: GoalTracker, turn: Turn, reading: Reading
    ) -> tuple[list[GoalChange], bool]:
        """Weigh the words, and manage the goals; see `GoalTracker.manage`."""
        stated = bool(self._stated(tracker.belief))
        known = len(tracker.belief.goals)
        self._progress(f"scoring {known} {'goal' if known == 1 else 'goals'}")
        weight = _weight(reading, tracker.belief.calibration)
        tracker.observe(turn.query, turn.utterance, weight=weight)
        aims = _tells(reading, "aim") or (
            _only_tells(reading) and not (stated and _says_nothing(reading))
        )
        return tracker.manage(
            self.goals,
            self.rounds,
            self._corrections,
            propose=aims or (bool(acting(reading.orders)) and not stated),
            anew=_tells(reading, "aim")
            and any(_tells(round.reading, "aim") for round in self.rounds),
            progress=self._progress,
        )

    def _aimed(self, reading: Reading) -> bool:
        """Whether to act for an aim: where one was told, or a goal explains what was told."""
        belief = self.tracker.belief if self.tracker else None
        return _tells(reading, "aim") or (_only_tells(reading) and bool(self._stated(belief)))

    def _planned(
        self,
        turns: Sequence[Turn],
        history: Sequence[StepResult],
        standing: Standing,
        notes: list[str],
    ) -> Outcome:
        """What is done for the top k goals; the planner weighs the rest by the words alone."""
        belief = self.tracker.belief if self.tracker else None
        wants = [Want(goal.text, p) for goal, p in self._stated(belief)]
        try:
            return self.modules.planner.act(self.env, wants, turns, history, standing)
        except UnreadableAnswerError as error:
            notes.append(f"No plan was made. {error}")
            return Outcome()

    def _stated(self, belief: Belief | None) -> list[tuple[Goal, float]]:
        """The top k goals, without "Unspecified"."""
        ranked = belief.top() if belief else ()
        return [each for each in ranked if each[0] != UNSPECIFIED][: self.k]

    def _thoughts(self, reading: Reading) -> list[str]:
        """What the agent takes the person to want, where they ask about nothing that is here."""
        asked = any(each.do == "ask" and not (each.what or each.where) for each in reading.orders)
        tracker = self.tracker
        if not asked or tracker is None or isinstance(tracker.likelihood, PromptedRanking):
            return []
        return [in_words(tracker.belief, tracker.turns)]

    def _notes(self, done: Execution, outcome: Outcome) -> Iterator[str]:
        """What the person should be told of a round."""
        if self.tracker:
            yield from self.tracker.notes
        yield from dict.fromkeys(done.notes)
        failed = [*done.failed, *outcome.failed]
        for each in failed[:_FAILURES]:
            yield f"Not done: {each.action}. {each.observation}"
        if len(failed) > _FAILURES:
            yield f"And {len(failed) - _FAILURES} more could not be done."
        if outcome.guessed:
            yield f"{GUESSED}{_told(outcome.guessed)}."
        for held in outcome.held:
            yield f"Held back until it is clear what you want: {held}."


def _told(guessed: Sequence[Guess]) -> str:
    """What was guessed, with the goal that it is for."""
    found: dict[str, list[str]] = {}
    for guess in guessed:
        found.setdefault(guess.goal, []).append(guess.target)
    return "; ".join(
        f"{', '.join(targets)}{f' (to {goal})' if goal else ''}" for goal, targets in found.items()
    )


def _asked(turn: Turn) -> str:
    """The question that the words answer; "" where they were free to say anything."""
    question = turn.query.splitlines()[-1] if turn.query.strip() else ""
    return "" if question in (OPENING, FALLBACK) else question


def _tells(reading: Reading | None, act: str) -> bool:
    """Whether a reading holds a dialogue act."""
    return reading is not None and any(order.do == act for order in reading.orders)


def _weight(reading: Reading, calibration: Calibration) -> float:
    """How much words count as evidence, by what they do."""
    if is_aside(reading.orders):
        return calibration.aside
    tells = any(order.do in (*_TELLING, "ask") for order in reading.orders)
    return 1.0 if tells or not acting(reading.orders) else calibration.orders


def _says_nothing(reading: Reading) -> bool:
    """Whether words were read as nothing at all, as thanks are."""
    return all(order.do == "none" for order in reading.orders)


def _only_tells(reading: Reading) -> bool:
    """Whether words ask for nothing, and agree to nothing: they may tell what it is all for."""
    return all(order.do in _TELLING for order in reading.orders)


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
