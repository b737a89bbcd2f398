"""Small honest stand-ins: a normalised model of words, and a room with a lamp."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from goalscope.agent.agent import Agent
from goalscope.agent.planner import Outcome, Planner, Want, attempted
from goalscope.base.types import Action, Message, Profile, StepResult, Turn
from goalscope.envs import Checks, Environment, Pick, Proactive, Resolution, State
from goalscope.language.dialogue_state import LIMITS, DialogueState
from goalscope.language.orders import Order, Verb
from goalscope.models import Completion
from goalscope.models.trace import traced

GOALS = "Name what a person"
NEEDS = "Tell what an aim calls for"
QUESTION = "one short question"
"""What stands in the prompts of a taught writer, for `WordModel`'s replies."""

_READS = {
    "Yes.": "yes",
    "yes": "yes",
    "No, not yet.": "no",
    "Good night": "finish",
    "Buy the basket": "buy",
    "Task completed": "finish",
}


class WordModel:
    """Words are drawn independently; a word that the context holds is `boost` times as likely.

    Over its vocabulary the probabilities sum to one, so posteriors have closed forms. It writes
    the scripted replies, whichever prompt's words they are listed under. It reads canonical English
    as what it is (with "; " for a new line), "Remove the X." likewise, what is listed in `reads`
    so, and all else as an aim. As its own writer it finds needed what shares a word with the aim or
    with what was said, and unwanted what does not. It finds no goal unsafe.
    """

    name = "words"
    vocabulary = 1000
    takes_grammar = True
    margins: tuple[float, ...] | None = None
    boost = 50.0

    def __init__(
        self,
        replies: Mapping[str, str] | None = None,
        context_size: int = 4096,
        *,
        reads: Mapping[str, str] | None = None,
    ) -> None:
        self.replies = dict(replies or {})
        self.reads = {**_READS, **(reads or {})}
        self.context_size = context_size
        self.calls = 0

    taught = False

    @property
    def writer(self) -> "WordModel | None":
        return self

    @property
    def generator(self) -> "WordModel":
        return self

    @property
    def scorer(self) -> "WordModel":
        return self

    @property
    def reader(self) -> "WordModel":
        return self

    @property
    def speaker(self) -> "WordModel":
        return self

    @traced
    def token_logprobs(
        self,
        contexts: Sequence[Sequence[Message]],
        continuations: Sequence[str],
    ) -> list[np.ndarray]:
        self.calls += 1
        rows = []
        for context, text in zip(contexts, continuations, strict=True):
            if judged := re.search(r"\nAnd (.*)\?$", context[-1].content):
                told = re.findall(r"^(?:Said|Aim): (.*)$", context[-1].content, re.MULTILINE)
                fits = bool({*words(judged[1])} & {*words(" ".join(told))})
                right = "needed" if fits else "not"
                rows.append(np.array([0.0 if text == right else -50.0]))
                continue
            if "criminal" in context[0].content:
                rows.append(np.full(len(words(text)), -50.0))
                continue
            seen = {word for message in context for word in words(message.content)}
            total = self.vocabulary + len(seen) * (self.boost - 1)
            row = [math.log((self.boost if w in seen else 1) / total) for w in words(text)]
            rows.append(np.array(row))
        return rows

    def count_tokens(self, messages: Sequence[Message]) -> int:
        return sum(len(words(message.content)) + 2 for message in messages)

    @traced
    def generate(self, messages: Sequence[Message], **settings) -> Completion:
        prompt = " ".join(message.content for message in messages)
        text = next((reply for mark, reply in self.replies.items() if mark in prompt), "")
        if grammar := settings.get("grammar"):
            said = messages[-1].content.splitlines()[-1]
            removed = re.sub(r"Remove the (.*?)\.(?: |$)", r"remove \1; ", said).removesuffix("; ")
            orders = self.reads.get(said, removed.replace("; ", "\n"))
            if not re.search(rf'"{re.escape(orders.split()[0])}( \w+)?"', grammar.splitlines()[0]):
                orders = "aim"
            return Completion(orders, "stop", 1, 1, -1.0, self.margins)
        return Completion(text, "stop", len(words(prompt)), len(words(text)))

    def close(self) -> None: ...


class NamedModel(WordModel):
    """A `WordModel` with the fingerprint that results keep."""

    fingerprint = "words 1"


class CondemnsAll(WordModel):
    """Finds every goal likelier from a criminal than from a kind person."""

    def token_logprobs(self, contexts, continuations):
        rows = super().token_logprobs(contexts, continuations)
        return [
            0 * row if "criminal" in context[0].content else row
            for context, row in zip(contexts, rows, strict=True)
        ]


class LampRoom(Proactive):
    """An environment with lamps; the switch `broken` always fails, and what is smashed stays so."""

    task = "The agent looks after a lamp."
    verbs = (
        Verb("switch on", "let there be light"),
        Verb("switch off", "let there be none", takes_away=True),
        Verb("smash", "break it", irreversible=True),
        Verb("finish", "that is all", (), ends=True, phrase="Good night"),
    )

    def __init__(self, offers: Sequence[str] = ("lamp",)) -> None:
        self.names = list(offers)
        self.on: list[str] = []
        self.smashed: list[str] = []

    def reset(self) -> None:
        self.on.clear()
        self.smashed.clear()

    def state(self) -> State:
        return State(f"On: {', '.join(self.on) or 'nothing'}.", f"{self.on} {self.smashed}")

    def offers(self, text: str, limit: int) -> list[str]:
        return self.names[:limit]

    def actions(self, name: str, dialogue: DialogueState) -> list[Action]:
        ruled_out = [limit.what for limit in dialogue.limits]
        there = name in self.names and name not in ruled_out
        return [Action("switch on", name)] if there else []

    def resolve(self, order: Order, dialogue: DialogueState, pick: Pick) -> Resolution:
        if order.do == "undo":
            return self.undo(dialogue.to_undo)
        if order.do == "finish":
            return Resolution((Action("finish"),))
        if order.do in LIMITS:
            lit = order.do == "avoid" and order.what in self.on
            return Resolution((Action("switch off", order.what),) if lit else ())
        if name := pick(order.what, self.names):
            return Resolution((Action(order.do, name),))
        return Resolution(why=f"There is no {order.what} here.")

    def undo(self, results: Sequence[StepResult]) -> Resolution:
        other = {"switch on": "switch off", "switch off": "switch on"}
        acts = [each.action for each in results]
        left = [act.target for act in acts if act.name == "smash"]
        back = tuple(Action(other[a.name], a.target) for a in reversed(acts) if a.name in other)
        return Resolution(back, "".join(f"The {each} stays in pieces." for each in left))

    def step(self, action: Action) -> StepResult:
        match action.name:
            case "search inventory":
                return StepResult(action, True, action.target)
            case "finish":
                return StepResult(action, True, "It is dark.", terminated=True)
            case "smash" if action.target in self.names:
                self.smashed.append(action.target)
                return StepResult(action, True, "It is in pieces.", irreversible=True)
            case "switch off" if action.target in self.on:
                self.on.remove(action.target)
                return StepResult(action, True, "It is off.")
            case "switch on" if action.target not in ("broken", *self.on):
                self.on.append(action.target)
                return StepResult(action, True, "It is on.")
        return StepResult(action, False, "The switch does not move.")

    def answer(self, question: Order, said: str, dialogue: DialogueState, pick: Pick) -> str:
        return self.state().text if question.what in ("", *self.names) else ""

    def checks_met(self, profile: Profile) -> Checks:
        return Checks((bool(self.on),))


class Plans:
    """Makes the plan that it is given."""

    def __init__(self, given: Sequence[Action]) -> None:
        self.given = given

    def act(
        self,
        env: Environment,
        wants: Sequence[Want],
        turns: Sequence[Turn],
        history: Sequence[StepResult],
        dialogue: DialogueState,
    ) -> Outcome:
        done, problem = attempted(env, self.given, history)
        return Outcome(tuple(done), (problem,) if problem else ())


def plans(agent: Agent, planner: Planner) -> Agent:
    """The agent, for which the planner plans from now on."""
    agent.toolkit = replace(agent.toolkit, planner=planner)
    return agent


def said(*utterances: str) -> list[Turn]:
    return [Turn("", utterance) for utterance in utterances]


def words(text: str) -> list[str]:
    return re.findall(r"\w+", text.lower())
