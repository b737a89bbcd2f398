"""Answers to what people ask about the agent itself: from its rounds and the state of the dialogue.

What is asked about things is for the environment to answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from goalscope.agent.round import Guess, Round, mentions, retracted, undoable
from goalscope.base.nouns import contains, names, singulars
from goalscope.base.types import Action, shortlist
from goalscope.belief.belief import Belief
from goalscope.belief.explain import in_words
from goalscope.envs import SEARCH, Environment, Pick, Proactive, completion_phrase
from goalscope.language.dialogue_state import DialogueState
from goalscope.language.orders import Order, order_in_words, speaks

UNKNOWN = "I cannot answer that."
"""The answer to a question about something that is not known here."""

_NAMED = 12
"""Most things that an answer names of a kind."""


@dataclass(frozen=True, slots=True)
class _Deed:
    """An action of a round that was not undone, and the guess that it was, if it was one."""

    action: Action
    round: Round
    guess: Guess | None

    def why(self, rounds: Sequence[Round]) -> str:
        """Why it was done."""
        said, back = self.round, {guess.target for guess in self.round.given_up}
        if self.guess:
            goal = f" to {self.guess.goal}" if self.guess.goal else ""
            return f'my guess{goal}, since you said "{said.turn.utterance}"'
        if self.action.target in back:
            return "it was a guess for a goal that you no longer have"
        for order in said.released:
            said = next((e for e in rounds if e.reading and order in e.reading.orders), said)
        return f'you said "{said.turn.utterance}"'


class Answers:
    """Answers questions after some rounds.

    Args:
        env: Where the agent acts.
        pick: Finds the thing that a phrase means.
        rounds: All so far, at least one.
        dialogue: What holds after them.
        belief: Over the person's goals.
    """

    def __init__(
        self,
        env: Environment,
        pick: Pick,
        rounds: Sequence[Round],
        dialogue: DialogueState,
        belief: Belief,
    ) -> None:
        self._env, self._pick, self._rounds = env, pick, rounds
        self._dialogue, self._belief = dialogue, belief
        self._away = [verb.name for verb in env.verbs if verb.takes_away]
        gone = retracted(rounds)
        self._deeds = [
            _Deed(
                action, round, next((g for g in round.guessed if g.target == action.target), None)
            )
            for round in rounds
            if round.number not in gone
            for action in (each.action for each in round.results[round.reversals :] if each.ok)
            if action.name != SEARCH
        ]

    def all(self) -> list[str]:
        """The answer to each question of the newest words; "" where there is none."""
        reading = self._rounds[-1].reading
        return [self._to(each) for each in reading.orders if each.do == "ask"] if reading else []

    def _to(self, question: Order) -> str:
        match question.about:
            case "done" | "added" | "removed" | "guessed" | "why":
                return self._deed(question) or self._all(question)
            case "asked":
                dialogue = self._dialogue
                limits = (*dialogue.limits, *filter(None, (dialogue.budget,)), *dialogue.untouched)
                told = "; ".join(map(order_in_words, (*dialogue.asked, *limits)))
                return f"I understood: {told or 'no order yet, and no limit'}."
            case "abilities":
                verbs = ", ".join(verb.name for verb in self._env.verbs)
                end = completion_phrase(self._env)
                return (
                    f"I know these orders: {verbs}, undo. Say what you want, what must not be, or "
                    f'only what it is all for, and ask what I did and why; "{end}" ends it.'
                )
            case "undo":
                last = undoable(self._rounds)[-1:]
                deeds = [each for each in self._deeds if each.round in last]
                told = f": {self._listed(deeds)}" if deeds else ""
                undo = [f'Undo takes back what came of "{e.turn.utterance}"{told}.' for e in last]
                return "".join(undo) or "There is nothing that undo could take back."
            case "goal":
                return self._wanted()
            case _:
                said = self._rounds[-1].turn.utterance
                return self._env.answer(question, said, self._dialogue, self._pick)

    def _wanted(self) -> str:
        if not self._belief.inferred:
            return "I go by your words alone, and make out no goal behind them."
        return in_words(self._belief, [each.turn for each in self._rounds])

    def _deed(self, question: Order) -> str:
        """What was done with the thing that is asked about, and why; "" for no such thing."""
        thing = question.what or question.where
        said = singulars(self._rounds[-1].turn.utterance)
        targets = [*dict.fromkeys(each.action.target for each in self._deeds if each.action.target)]
        found = [name for name in targets if names(name, thing)]
        found = found or [name for name in targets if mentions(said, name)]
        if not found and thing and question.about == "why":
            found = [self._pick(thing, targets)]
        last = {each.action.target: each for each in self._deeds if each.action.target in found}
        if last:
            away = all(self._is_away(each.action) for each in last.values())
            still = "Not taken out: " if question.about == "removed" and not away else ""
            return f"{still}{'; '.join([*map(self._explained, last.values())][-2:])}."
        for round in reversed(self._rounds):
            for order in round.reading.orders if round.reading else ():
                named = contains(said, singulars(order.what)) or names(order.what, thing)
                if named and speaks(order) and order.do != "ask":
                    return f'I did nothing with "{order.what}"; you said "{round.turn.utterance}".'
        of_goal = any(names(goal.text, thing) for goal, _ in self._belief.top(3))
        return self._wanted() if of_goal and question.about == "why" else ""

    def _all(self, question: Order) -> str:
        """All that was done, of the kind that is asked about."""
        last = {each.action.target: each for each in self._deeds}
        came = [each for each in last.values() if not self._is_away(each.action)]
        guessed = [each for each in came if each.guess]
        thing = question.what or question.where
        none = f'I did nothing with "{thing}", and know of no order for it.' if thing else ""
        match question.about:
            case "done":
                told = f"So far: {self._listed(self._deeds)}." if self._deeds else "Nothing so far."
            case "added":
                asked = [each for each in came if not each.guess]
                parts = (("You asked for ", asked), ("I guessed ", guessed))
                told = "; ".join(f"{head}{_things(deeds)}" for head, deeds in parts if deeds)
                told = f"{told}." if told else "I have added nothing."
            case "removed":
                away = [each for each in last.values() if self._is_away(each.action)]
                told = "; ".join(map(self._explained, away[-3:]))
                told = f"Taken out: {told}." if told else "I have taken out nothing."
            case "guessed":
                by_why: dict[str, list[_Deed]] = {}
                for each in guessed:
                    by_why.setdefault(each.why(self._rounds), []).append(each)
                told = "; ".join(f"{_things(deeds)} ({why})" for why, deeds in by_why.items())
                told = f"{told}." if told else "Nothing: I did only what you asked for."
            case _ if self._deeds and not thing:
                newest = [each for each in self._deeds if each.round is self._deeds[-1].round]
                whys = dict.fromkeys(each.why(self._rounds) for each in newest)
                told = f"{self._listed(newest)} ({'; '.join(whys)})."
            case _:
                told = "" if thing else self._wanted()
        return f"{none} {told}".strip()

    def _is_away(self, action: Action) -> bool:
        return any(f"{action.name} ".startswith(f"{verb} ") for verb in self._away)

    def _explained(self, deed: _Deed) -> str:
        return f"{self._phrase(deed.action)} ({deed.why(self._rounds)})"

    def _phrase(self, action: Action) -> str:
        return self._env.phrase(action) if isinstance(self._env, Proactive) else str(action)

    def _listed(self, deeds: Sequence[_Deed]) -> str:
        """What was done: "add: roses, pond; remove: hedge"."""
        groups: dict[str, list[str]] = {}
        for deed in deeds:
            head, _, rest = self._phrase(deed.action).rpartition(": ")
            groups.setdefault(head, []).append(rest)
        return "; ".join(
            f"{head}: {shortlist(each, _NAMED)}".removeprefix(": ") for head, each in groups.items()
        )


def _things(deeds: Sequence[_Deed]) -> str:
    return shortlist([each.action.target for each in deeds], _NAMED)
