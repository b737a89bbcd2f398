"""Algorithm 1: ask, read, infer, manage the goals, and act on orders and likely goals."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from functools import partial
from typing import Literal, get_args

import numpy as np

from goalscope.agent.answers import UNKNOWN, Answers
from goalscope.agent.executor import Execution, Executor
from goalscope.agent.guards import UNSURE, by_number, second_look, with_more
from goalscope.agent.people import FALLBACK, OPENING, Human, ask, completes, question_of
from goalscope.agent.planner import Outcome, Want, replay, same_aim
from goalscope.agent.round import Round, retracted
from goalscope.agent.telling import done_in_words, notes_of
from goalscope.agent.toolkit import Preset, Toolkit, is_paper, toolkit_of
from goalscope.agent.writer import Recalling, Writer
from goalscope.base.text import is_question
from goalscope.base.types import (
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
    pluralize,
)
from goalscope.belief.belief import Belief
from goalscope.belief.calibration import DEFAULT, PAPER, Calibration
from goalscope.belief.goal_manager import UNEXPLAINED, GoalManager, Trigger
from goalscope.belief.goal_order import GoalOrder, Tracker
from goalscope.belief.likelihood import DEFAULT_LAYOUT, Layout, Likelihood, RolePlay
from goalscope.belief.method import Implied, Method, implied
from goalscope.belief.tracker import Correction, GoalTracker
from goalscope.envs import Environment, Pick, scenarios_like
from goalscope.language.cues import retracts
from goalscope.language.dialogue_state import acting
from goalscope.language.matcher import Matcher
from goalscope.language.orders import TELLING, Order, Reading, examples_of, is_aside
from goalscope.language.reader import Reader, ReadExample, reader_of
from goalscope.models import Model, Roles
from goalscope.models.embedding import embedded
from goalscope.models.trace import during, note

Ablation = Literal["good", "no-goals", "no-inference"]
"""The paper's agent and its ablations (Sec. 4.3); see `Agent`."""

K = 3
"""Number of goals that an agent acts on (k in Algorithm 1; the paper gives no figure)."""

GIVEN_UP = 0.1
"""Probability of a goal, and goals like it, below which what was guessed for it is taken back."""

ALIKE = 0.6
"""Cosine from which two goals mean nearly the same."""

NO_GOAL = "The goals do not explain the newest words, and no better ones were found."
"""A round's note where a goal is missing."""


class Agent:
    """The assistant: one call of `step` is one round of Algorithm 1.

    Args:
        env: Where it acts.
        model: Writes and scores.
        reader: Turns utterances into readings; by default the model's own (see `reader_of`).
        pick: Finds the thing that a phrase means; by default a `Matcher`.
        method: "good", or an ablation of Sec. 4.3: "no-goals" acts on the transcript alone,
            "no-inference" on the goal that the model names as the likeliest. Or a method of your
            own, which takes the place of the inference.
        preset: "paper" for Algorithm 1 as it stands: nothing is read and no order carried out, so
            that goals alone lead to actions, and to none while Unspecified leads. Unless given, the
            trigger, the calibration, the likelihood's prompt (without an adapter) and all modules
            are the paper's, too.
        k: Number of likeliest goals to act on and to ask about.
        patience: See `GoalManager`.
        propose: See `GoalManager`; None for its default. "no-inference" always proposes as in the
            paper.
        likelihood: Evidence of a turn, for "good"; by default the role-play likelihood of `model`.
        calibration: Turns evidence into probabilities; None for `DEFAULT`. (A calibration on given
            goals is too unsure of goals that the agent proposes itself; see docs/log.md.)
        toolkit: Proposes, removes, plans and asks; by default that of the model.
        unsure: Margin of an order, in nats, below which the agent asks before it acts.
        progress: Called with what the agent does next, before each part of a round.
        understood: Called before the agent acts, with the round so far: the reading, the belief,
            and the goals that came and went.

    Attributes:
        episode: The episode's name in a trace.

    Raises:
        InvalidInputError: There is no such method, or `k` is below 1.
    """

    def __init__(
        self,
        env: Environment,
        model: Model,
        *,
        reader: Reader | None = None,
        pick: Pick | None = None,
        method: Ablation | Method = "good",
        preset: Preset | None = None,
        k: int = K,
        patience: int = 3,
        propose: Trigger | None = None,
        likelihood: Likelihood | None = None,
        calibration: Calibration | None = None,
        toolkit: Toolkit | None = None,
        unsure: float = UNSURE,
        progress: Callable[[str], None] | None = None,
        understood: Callable[[Round], None] | None = None,
    ) -> None:
        self.env = env
        self.model = model
        self.episode = ""
        if not (hasattr(k, "__index__") and k >= 1):
            raise InvalidInputError(f"k must be a whole number, 1 or more, not {k!r}")
        if not isinstance(method, str):
            if likelihood or calibration:
                raise InvalidInputError(
                    "A method of one's own makes the probabilities: leave out likelihood and "
                    "calibration."
                )
            method, likelihood = "good", implied(method)
        if method not in get_args(Ablation):
            raise InvalidInputError(
                f'method must be "good", "no-goals" or "no-inference", not {method!r}'
            )
        self._is_paper = is_paper(preset)
        self.toolkit = toolkit or toolkit_of(model, preset=preset)
        self.k = k if method == "good" else 1
        self.reader = reader or reader_of(
            model, env.verbs, task=env.task, examples=examples_of(env.verbs)
        )
        self._pick = pick or Matcher(model)
        self._executor = Executor(env, self._pick, unsure)
        self._progress = progress or _silent
        self._understood = understood or _silent
        proposer = self.toolkit.proposer
        self.goal_manager = GoalManager(
            Recalling(proposer, partial(scenarios_like, env))
            if isinstance(proposer, Writer)
            else proposer,
            model,
            env.task,
            remover=self.toolkit.remover,
            propose="paper"
            if method == "no-inference"
            else (propose if propose is not None else "paper" if self._is_paper else UNEXPLAINED),
            patience=patience,
            same=partial(same_aim, env),
        )
        self.rounds: list[Round] = []
        self.tracker: Tracker
        if method == "good":
            own = PAPER if self._is_paper or isinstance(likelihood, Implied) else DEFAULT
            calibration = calibration or own
            self.tracker = GoalTracker(
                task=env.task,
                likelihood=likelihood or role_play(model, calibration, paper=self._is_paper),
                calibration=calibration,
            )
        else:
            self.tracker = GoalOrder(
                model, env.task, () if method == "no-goals" else (UNSPECIFIED,)
            )
        self._prior = self.belief
        self._corrections: list[GoalChange] = []
        self._uncorrected: list[tuple[Belief, list[GoalChange]]] = []

    @property
    def belief(self) -> Belief:
        """The belief with the corrections since the last round; see `Belief.inferred`."""
        return self.tracker.belief

    @property
    def turns(self) -> list[Turn]:
        """The transcript so far."""
        return [round.turn for round in self.rounds]

    def ask(self) -> str:
        """The next query (Conversation Module), after the answer to what the person asked.

        Where no aim was told there is nothing to find out: the agent asks what else they would
        like.
        """
        self._progress("asking")
        with self.placed(module="query"):
            if self._is_paper:
                asker, status = self.toolkit.asker, self.env.state().text
                question = question_of(asker.question(self.env.task, self.turns, status, ()))
                return question or (FALLBACK if self.rounds else OPENING)
            if not self.rounds:
                return OPENING
            question = self.rounds[-1].question or self._question()
            return "\n".join([*self._answers(), question])

    def placed(self, module: str = "") -> AbstractContextManager[None]:
        """Name the episode, the round and perhaps the module in a trace."""
        return during(episode=self.episode, round=len(self.rounds) + 1, module=module)

    def _question(self) -> str:
        last = self.rounds[-1].reading
        if not (last and self._has_aim(last)):
            return FALLBACK
        goals = [goal.text for goal, _ in self._top_goals]
        return ask(self.toolkit.asker, self.env, self.turns, done_in_words(self.rounds), goals)

    def _answers(self) -> list[str]:
        """Lines that answer what the newest words ask; none where they ask nothing."""
        last = self.rounds[-1]
        if not (last.reading and last.reading.tells("ask")):
            return []
        state = self._executor.dialogue_state(self.rounds)
        answers = Answers(self.env, self._pick, self.rounds, state, self.belief)
        told = (line for each in answers.all() for line in each.splitlines())
        return [*dict.fromkeys(told)] or [UNKNOWN]

    def step(
        self,
        query: str,
        utterance: str,
        *,
        confirmed: str = "",
        keep: Callable[[Round], None] | None = None,
    ) -> Round:
        """One round of Algorithm 1 after the person has answered.

        The words are read once. They are evidence for the goals, which then are proposed and
        removed. Then the agent acts: it follows the orders, and where the words tell an aim it
        plans for the likeliest goals. An order waits for a yes if nobody can undo it, if its
        reading is unsure or may lack an exception, if it ends the task without its phrase, if it
        has a condition, if it sweeps away several things, or if an allergy forbids it. The yes
        counts only in the state that was shown, and only for the things that were listed.

        On an error the agent and its environment stay as they were. The environment is reset and
        its past replayed, so that in a simulator even an irreversible action is undone.

        Args:
            query: What the agent asked.
            utterance: What the person answered.
            confirmed: Fingerprint of the state in which they confirmed, by a click, what waits for
                a yes; "" where they did not, or said so in words.
            keep: Stores the round. If it fails, the round is undone.

        Raises:
            ConflictError: The state has changed since it was shown; nothing was done.
            InvalidInputError: The utterance is empty, broken, or too long for the model.
        """
        turn = Turn(query, checked_text(utterance, "utterance"))
        if confirmed not in ("", self.env.state().fingerprint):
            raise ConflictError(
                "Things are no longer as they were shown, so nothing was done. Look again."
            )
        with self._all_or_nothing(), self.placed():
            reading, unread = self._read(turn)
            self._observe(turn, reading)  # Inference Module: Eq. 1 and 2
            changes, unexplained = self._manage(reading)  # Goal Management Module, Sec. 3.2
            begun = Round(len(self.rounds) + 1, turn, self.belief, changes, reading=reading)
            self._understood(begun)
            done = (
                self._executor.execute(self.rounds, turn, reading, confirmed=bool(confirmed))
                if reading
                else Execution(turn, Reading(()))
            )
            if reading and not (done.harm or done.kept) and (gone := self._given_up(turn, reading)):
                self._executor.give_up(self.rounds, gone, done)
            plan = self._act(turn, reading, done)  # Action Module, Sec. 3.3
            round = self._ended(begun, done, plan, unread + unexplained)
            if keep:
                keep(round)
            _trace_round(round)
        self.rounds.append(round)
        self._corrections, self._uncorrected = [], []
        return round

    def correct(self, correction: Correction, goal: str | Goal, text: str = "") -> Belief:
        """See `GoalTracker.correct`; the next round tells of it.

        Raises:
            InvalidInputError: There is no such goal or no belief, or a text is empty or broken.
        """
        before = (self.belief, self._corrections)
        self._corrections = [*self._corrections, *self.tracker.correct(correction, goal, text)]
        self._uncorrected.append(before)
        return self.belief

    def undo_correction(self) -> Belief:
        """Undo the newest correction since the last round.

        Raises:
            InvalidInputError: There is none.
        """
        if not self._uncorrected:
            raise InvalidInputError("There is no correction to take back.")
        belief, self._corrections = self._uncorrected.pop()
        self.tracker.restore(belief, self.turns)
        return belief

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
        replay(self.env, [result for round in rounds for result in round.results])
        last = rounds[-1] if rounds else None
        if last and (
            self.env.state().text != last.status
            or last.state not in ("", self.env.state().fingerprint)
        ):
            raise GoalscopeError(
                "Replaying the episode's actions led to another state; "
                "has the catalogue or scene changed since? Start a new episode."
            )
        self.rounds = list(rounds)
        self._corrections, self._uncorrected = [], []
        self.tracker.restore(last.belief if last else self._prior, self.turns)

    @contextmanager
    def _all_or_nothing(self) -> Generator[None]:
        """Restore the belief and the environment if an error ends the round."""
        belief, turns = self.tracker.belief, self.tracker.turns
        try:
            yield
        except BaseException:
            self.tracker.restore(belief, turns)
            replay(self.env, self._history)
            raise

    @property
    def _history(self) -> list[StepResult]:
        return [result for round in self.rounds for result in round.results]

    @during(module="read")
    def _read(self, turn: Turn) -> tuple[Reading | None, list[str]]:
        """The reading of a turn; where the model wrote none, an empty one and a note that says so.

        By the paper's preset nothing is read.

        The phrase that ends the task is no answer to the question before it. Said alone, it is
        the order to end the task, as the environment declares, and no model reads it.
        """
        if self._is_paper:
            return None, []
        ends = [verb.name for verb in self.env.verbs if verb.ends]
        if ends and completes(self.env, turn.utterance, alone=True):
            return Reading((Order(ends[0]),)), []
        self._progress("reading")
        before = [
            ReadExample(_question_of(each.turn), each.turn.utterance, each.reading.orders)
            for each in self.rounds
            if each.reading
        ]
        here = self.env.state().here
        read = partial(self.reader.read, here=here)
        question = "" if completes(self.env, turn.utterance) else _question_of(turn)
        try:
            reading = read(turn.utterance, question=question, before=before)
            reading = second_look(reading, turn.utterance, before, read)
        except UnreadableAnswerError as error:
            return Reading((Order("none"),)), [str(error)]
        reading = with_more(reading, turn.utterance, self.env.verbs)
        return by_number(reading, turn.utterance, here), []

    def _observe(self, turn: Turn, reading: Reading | None) -> None:
        """Update the belief (Eq. 1); how much words count as evidence depends on what they do."""
        if self.belief.goals:
            self._progress(f"scoring {pluralize(len(self.belief.goals), 'goal')}")
        weight = 1.0
        if reading and is_aside(reading.orders):
            weight = self.belief.calibration.aside
        elif reading and acting(reading.orders) and not any(map(reading.tells, ("ask", *TELLING))):
            weight = self.belief.calibration.orders
        self.tracker.observe(turn.query, turn.utterance, weight=weight)

    def _manage(self, reading: Reading | None) -> tuple[tuple[GoalChange, ...], list[str]]:
        """Propose and remove goals (Sec. 3.2).

        Returns:
            All changes since the last round, and notes on what could not be explained.
        """
        corrections = tuple(self._corrections)
        try:
            changes, unexplained = self.goal_manager.manage(
                self.tracker,
                self.rounds,
                reading,
                corrections=corrections,
                progress=self._progress,
            )
        except UnreadableAnswerError as error:
            return corrections, [f"The goals stay as they are. {error}"]
        return (*corrections, *changes), [NO_GOAL] if unexplained else []

    @during(module="plan")
    def _act(self, turn: Turn, reading: Reading | None, done: Execution) -> Outcome:
        """Act on the top k goals; the planner weighs the rest by the words.

        Algorithm 1 does not act while Unspecified leads; without goals it always does.
        """
        if reading:
            acts = self._may_act(turn, reading, done)
        else:
            acts = not self.belief.goals or self.belief.top(1)[0][0] != UNSPECIFIED
        if not acts:
            return Outcome()
        self._progress("planning")
        gone = retracted(self.rounds)
        turns = [*(each.turn for each in self.rounds if each.number not in gone), turn]
        wants = [Want(goal.text, probability) for goal, probability in self._top_goals]
        history = [*self._history, *done.results]
        try:
            return self.toolkit.planner.act(self.env, wants, turns, history, done.dialogue)
        except UnreadableAnswerError as error:
            done.notes.append(f"No plan was made. {error}")
            return Outcome()

    def _given_up(self, turn: Turn, reading: Reading) -> list[str]:
        """Goals for which something was guessed, and that are improbable by now.

        Only words that take something back give up a goal: a belief may also turn to another one
        because that is better worded. A goal is as probable as all goals together that mean nearly
        the same. Words that only give orders, such as to buy what is there, give up none.
        """
        says_so = retracts(turn.utterance, UNSPECIFIED)
        if not says_so or not (reading.tells("aim") or reading.only_tells):
            return []
        held = [(goal.text, p) for goal, p in self.belief.top() if goal != UNSPECIFIED]
        served = [*dict.fromkeys(guess.goal for each in self.rounds for guess in each.guessed)]
        if not served or not self.belief.inferred:
            return []
        alike = embedded(served) @ embedded([text for text, _ in held]).T >= ALIKE
        left = alike @ np.array([p for _, p in held])
        return [goal for goal, p in zip(served, left, strict=True) if goal and p < GIVEN_UP]

    def _may_act(self, turn: Turn, reading: Reading, done: Execution) -> bool:
        """Whether something may be done unasked.

        Nothing is, after words of harm, after a question that tells no aim, while something else
        waits, or once the task has ended. An order in vain may tell an aim: "get me spag bol".
        """
        asks = is_question(turn.utterance)
        has_aim = reading.tells("aim") if asks else self._has_aim(reading) or done.in_vain
        return has_aim and not (done.wary or done.kept or done.ended)

    def _has_aim(self, reading: Reading) -> bool:
        """Whether to act for a goal: an aim was told, or a goal explains words that ask nothing."""
        return reading.tells("aim") or (reading.only_tells and bool(self._top_goals))

    @property
    def _top_goals(self) -> list[tuple[Goal, float]]:
        """The top k goals with their probabilities, without "Unspecified"; 1 for a named goal."""
        found = [each for each in self.belief.top() if each[0] != UNSPECIFIED][: self.k]
        named = isinstance(self.tracker, GoalOrder)
        return [(goal, 1.0 if named else probability) for goal, probability in found]

    def _ended(
        self, begun: Round, done: Execution, outcome: Outcome, notes: Sequence[str]
    ) -> Round:
        """A round with what was done in it."""
        return replace(
            begun,
            results=(*done.results, *outcome.results),
            replans=outcome.replans,
            status=self.env.state().text,
            notes=(
                *notes,
                *self.tracker.notes,
                *notes_of(done, outcome, self.turns),
            ),
            question=done.question,
            pending=tuple(done.pending),
            listed=tuple(done.listed),
            awaits=done.awaits,
            released=done.released,
            retracts=done.retracts,
            reversals=done.reversals,
            guessed=outcome.guessed,
            given_up=done.given_up,
            state=self.env.state().fingerprint,
            terminated=done.ended
            or any(result.terminated for result in outcome.results)
            or (self._is_paper and completes(self.env, begun.turn.utterance)),
        )


def _question_of(turn: Turn) -> str:
    """The question that the words answer; "" where they were free to say anything."""
    question = turn.query.splitlines()[-1] if turn.query.strip() else ""
    return "" if question in (OPENING, FALLBACK) else question


def _trace_round(round: Round) -> None:
    """Add what a round came to, if there is a trace."""
    note(
        "round",
        query=round.turn.query,
        utterance=round.turn.utterance,
        belief={goal.text: probability for goal, probability in round.belief.top()},
        changes=[f"{each.kind}: {each.goal} ({each.reason})" for each in round.changes],
        actions=[str(each.action) for each in round.results],
        status=round.status,
        notes=round.notes,
    )


def role_play(
    model: Model,
    calibration: Calibration | None = None,
    layout: Layout | None = None,
    *,
    paper: bool = False,
) -> RolePlay:
    """The role-play likelihood with the similarity of a calibration, or else of its own.

    The paper's has its goal first, no adapter and no similarity.
    """
    if paper:
        scorer = model.scorer if isinstance(model, Roles) else model
        return RolePlay(scorer, layout=layout or "goal-first", similarity=0.0)
    similarity = calibration.similarity if calibration else None
    return RolePlay(model, layout=layout or DEFAULT_LAYOUT, similarity=similarity)


def run_episode(
    agent: Agent,
    human: Human,
    *,
    max_rounds: int = 20,
    keep: Callable[[Round], None] | None = None,
) -> Iterator[Round]:
    """Rounds until the task is complete, at most `max_rounds` in all (Algorithm 1).

    `keep` is as for `Agent.step`.
    """
    while len(agent.rounds) < max_rounds and not (agent.rounds and agent.rounds[-1].terminated):
        query = agent.ask()
        with agent.placed(module="human"):
            utterance = human.reply(query, agent.turns, agent.env.state().text)
        yield agent.step(query, utterance, keep=keep)


def _silent(_: object) -> None:
    """Nobody listens."""
