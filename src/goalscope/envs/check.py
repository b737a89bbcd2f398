"""Whether an environment keeps the laws that agents rely on, after Gymnasium's `check_env`."""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from difflib import get_close_matches
from itertools import product
from pathlib import Path
from typing import Any, cast

from goalscope.base.types import Action, GoalscopeError, InvalidInputError, Profile, StepResult
from goalscope.envs import (
    SEARCH,
    Checks,
    Environment,
    Proactive,
    Resolution,
    State,
    completion_phrase,
    execute,
    is_irreversible,
    missing,
    resolve,
)
from goalscope.envs.scenarios import Scenario
from goalscope.language.dialogue_state import LIMITS, DialogueState, acting, fold
from goalscope.language.matcher import Matcher
from goalscope.language.orders import (
    Order,
    Reading,
    examples_of,
    orders_from_text,
    orders_to_text,
)
from goalscope.language.reader import check_verbs

NOWHERE = "no such thing"
"""What no domain has."""

_TEXTS = 6  # texts for which names are asked: nothing, the task, and examples
_NAMES = 15  # names asked for each of them
_THINGS = 3  # things that orders are tried with
_CHECKED = 12  # things of the profiles' checks that they are tried with, too
_TIMES = 8  # repetitions of an action that seems to change nothing
_TYPO = 0.85  # similarity (difflib) from which on a need is taken for a misspelt name


def check_env(env: Environment, profiles: Sequence[Profile] = (), *, most: int = 80) -> None:
    """Try an environment: orders alone and in pairs, guesses, undo, replays, and the score.

    Nothing is proved: the orders are those of the examples, and each verb with a few of the things
    that `offers` names; the guesses are for more of them. The environment is reset before and
    after.

    Args:
        env: To be tried.
        profiles: Its simulated people, for `checks_met`.
        most: Most orders to execute, and most things to guess.

    Raises:
        GoalscopeError: A law is broken; the message says which, and by what.
    """
    _hold(isinstance(cast("object", env), Environment), "it must inherit from `Environment`")
    for name in missing(env):
        _hold(False, f"`{name}` is missing")
    try:
        check_verbs(env.verbs)
    except InvalidInputError as error:
        _hold(False, str(error).rstrip("."))
    trial = _Trial(env, most)
    trial.try_names()
    trial.try_readings()
    trial.try_odd_actions()
    trial.try_profiles(profiles)
    trial.try_guesses()
    trial.try_orders()
    trial.reset()


class _Trial:
    """One environment under trial."""

    def __init__(self, env: Environment, most: int) -> None:
        self.env = env
        self.most = most
        self.shared = _shared(env)
        self.pick = Matcher()
        self.verbs = {verb.name: verb for verb in env.verbs}
        self.names: list[str] = []
        self.checked: list[str] = []
        task, phrase = cast("object", env.task), cast("object", completion_phrase(env))
        _hold(isinstance(task, str) and bool(task.strip()), "`task` must be a text, and not empty")
        _hold(isinstance(phrase, str), f"the `phrase` of a verb must be a text, not {phrase!r}")
        ending = any(verb.ends for verb in env.verbs)
        _hold(ending, 'no verb ends the task; add one, as in Verb("finish", "...", (), ends=True)')
        self.call("reset")
        self.start = self.state()

    def call(self, member: str, *given: Any) -> Any:
        """What a member gives; an error of its own, or a thing of another type, breaks a law."""
        try:
            if member in ("step", "resolve"):
                return (execute if member == "step" else resolve)(self.env, *given)
            found = getattr(self.env, member)(*given)
        except GoalscopeError:
            raise
        except Exception as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{Path(last.filename).name}, line {last.lineno}"
            told = f"`{member}` fails ({where}: {type(error).__name__}: {error})"
            raise GoalscopeError(f"The environment breaks a law: {told}.") from error
        kind, wanted = _GIVES.get(member, (object, ""))
        is_right = _is_list(found, kind) if wanted.startswith("a list") else isinstance(found, kind)
        about = f", for {given[0]}" if given else ""
        _hold(is_right, f"`{member}` must give {wanted}, not {found!r}{about}")
        if kind is Action:
            _hold_actions(found)
        return found

    def state(self) -> State:
        """See `Environment.state`."""
        found: State = self.call("state")
        text = cast("object", found.text)
        is_text = isinstance(text, str) and bool(text.strip())
        _hold(is_text, f"the text of `state` must be a text, and not empty: {text!r}")
        return found

    def reset(self) -> None:
        """Go back to the start, and see that it is the start."""
        self.call("reset")
        now = self.state()
        both = _both(self.start, now)
        _hold(now == self.start, f"`reset` must lead back to the same start{both}")
        is_own = _shared(self.env) == self.shared
        _hold(is_own, "the state must be the instance's own, and not its class's")

    def step(self, action: Action) -> StepResult:
        """Take one action, which keeps the laws of one action."""
        before = self.state()
        result: StepResult = self.call("step", action)
        _hold(result.action == action, f"a result must name its action: {action}")
        now = self.state()
        changed = now.fingerprint != before.fingerprint
        if not result.ok:
            _hold(bool(result.observation), f"a failure must say why: {action}")
            _hold(not changed, f"a failure must change nothing: {action}{_both(before, now)}")
        told = now.text == before.text or changed
        _hold(told, f"what changes the text of `state` must change its fingerprint: {action}")
        return result

    def take(self, action: Action) -> StepResult:
        """Take an action that the environment gave: both say the same of whether it lasts."""
        declared, result = is_irreversible(self.env, action), self.step(action)
        both = f"the action says {declared} and its result irreversible={result.irreversible}"
        agreed = not result.ok or declared == result.irreversible
        _hold(agreed, f"whether something cannot be undone: {both}; they must agree: {action}")
        return result

    def try_names(self) -> None:
        """Names on offer are things that there are."""
        said = [each.message for each in examples_of(self.env.verbs)]
        for text in ["", self.env.task, *said][:_TEXTS]:
            for limit in (1, _NAMES):
                found = self.call("offers", text, limit)
                _hold(
                    len(found) <= limit, f"`offers` must give {limit} names at most, not {found!r}"
                )
                self.names += found
        self.names = [*dict.fromkeys(self.names)]
        for name in self.names[:_THINGS]:
            orders = (self.resolve(each).actions for each in self.orders(name) if each.what)
            served = self.guesses(name) or any(orders)
            _hold(bool(served), f"`offers` names {name!r}, but no order and no guess has it")

    def orders(self, name: str) -> list[Order]:
        """Orders of a thing by all verbs, with and without a quantity; those without a thing."""
        found: list[Order] = []
        for verb in self.env.verbs:
            what = name if "what" in verb.slots else ""
            other = next((n for n in self.names if n != name), NOWHERE)
            for_ = other if "for" in verb.slots and verb.name == "swap" else ""
            found.append(Order(verb.name, what, for_=for_))
            if "quantity" in verb.slots:
                found.append(Order(verb.name, what, 2.0, for_=for_))
        return found

    def resolve(self, order: Order) -> Resolution:
        """What an order comes to; to find out changes nothing."""
        away = {verb.name for verb in self.env.verbs if verb.takes_away}
        before = self.state()
        dialogue = fold([Reading((order,))], takes_away=away)
        found: Resolution = self.call("resolve", order, dialogue, self.pick)
        _hold_actions(found.actions)
        _hold(self.state() == before, f"`resolve` must change nothing: {order}")
        return found

    def try_readings(self) -> None:
        """Orders and limits of things that are here, and of things that are not."""
        for name in [*self.names[:2], NOWHERE]:
            for order in self.orders(name):
                found = self.resolve(order)
                says = bool(found.actions or found.why)
                _hold(says, f"`resolve` must give actions, or say why not, for {order}")
                if order.what == NOWHERE:
                    gone = Order(order.do, NOWHERE, order.quantity, for_=NOWHERE)
                    acts = self.resolve(gone).actions
                    _hold(not acts, f"what is not here must not be replaced: {gone} gives {acts}")
                if "where" in self.verbs[order.do].slots:
                    self.resolve(Order(order.do, order.what, where="no such place"))
            named = (Order(limit, name) for limit in LIMITS if limit != "budget")
            for limit in (*named, Order("budget", quantity=1e6)):
                self._try_limit(limit)
            for asked in (Order("ask", name), Order("ask")):
                self.call("answer", asked, name, DialogueState(), self.pick)
        _hold(self.state() == self.start, "to resolve and to answer must change nothing")

    def _try_limit(self, limit: Order) -> None:
        """A limit that a domain ignores must not fall through to what is said of unknown verbs."""
        found = self.resolve(limit)
        other = Order("frobnicate", limit.what, limit.quantity)
        try:
            unknown = self.env.resolve(other, DialogueState(), self.pick)
        except Exception:  # a domain need not know what to do with it
            return
        said = repr((unknown.actions, unknown.why)).replace("frobnicate", limit.do)
        falls = said == repr((found.actions, found.why)) != repr(((), ""))
        _hold(not falls, f"`resolve` takes the limit {limit} for a verb, and gives {found}; "
              "return Resolution() for a limit that needs no action")  # fmt: skip

    def try_odd_actions(self) -> None:
        """What does not exist fails, says why, and changes nothing."""
        named = [verb.name for verb in self.env.verbs if "what" in verb.slots]
        odd = [Action(name, NOWHERE, 1, place) for name in named for place in ("", "no such place")]
        odd += [Action("no such action", NOWHERE), Action("open", "\x00<|im_end|>", 10**9)]
        odd += [Action("buy basket", quantity=-1), Action("add item", NOWHERE), Action("")]
        for action in odd:
            ok = self.step(action).ok
            _hold(not ok, f"an action that does not exist must fail: {action!r}")

    def try_profiles(self, profiles: Sequence[Profile]) -> None:
        """At the start something is still to do, and nothing unwanted is done."""
        for profile in profiles:
            found = self.call("checks_met", profile)
            wanted = f"Checks with {len(profile.checks)} bools, one for each check of"
            right = len(found.met) in (0, len(profile.checks))
            _hold(right, f"`checks_met` must give {wanted} {profile.name}, not {found!r}")
            idle = not found.met or not all(found.met)
            _hold(idle, f"all checks of {profile.name} hold before any action: there is no need")
            clean = not found.unwanted
            _hold(clean, f"`checks_met` finds unwanted things for {profile.name} at the start")
            values = [each for check in profile.checks for each in check.values()]
            self.checked += [name for each in values if _is_list(each, str) for name in each]

    def guesses(self, name: str, *limits: Order) -> list[Action]:
        """See `Proactive.actions`; none where these limits hold."""
        if not isinstance(self.env, Proactive):
            return []
        return self.call("actions", name, fold([Reading(limits)]))

    def try_guesses(self) -> None:
        """What may be done unasked: not what was ruled out, nor what is done already."""
        if not isinstance(self.env, Proactive):
            return
        ways: list[list[Action]] = []
        guesses = {name: found for name in self.names if (found := self.guesses(name))}
        for name, found in guesses.items():
            for words, why in product((name, name.casefold()), ("", "allergy")):
                ruled = self.guesses(name, Order("avoid", words, why=why))
                _hold(not ruled, f"`actions` must leave out what the person ruled out: {ruled}")
            guesses[name] = [each for each in found if not is_irreversible(self.env, each)]
        useful = not guesses or any(guesses.values())
        _hold(useful, "`actions` gives only what cannot be undone, which no agent guesses")
        for name, found in list(guesses.items())[: self.most]:
            done = any(self._try_guess(name, each) for each in found)
            _hold(done or not found, f"`actions` must give what can be done: {found}")
        for name in self.names[:_THINGS]:
            for scenario in self.call("like", name, 8):
                for need in (*scenario.needed, *scenario.nice):
                    way = self.call("serving", need, DialogueState())
                    close = get_close_matches(str(need), self.names, 1, _TYPO)
                    known = bool(way) or not close or need in close
                    _hold(known, f"a scenario needs {need!r}; did you mean {close}?")
                    if way and not any(is_irreversible(self.env, each) for each in way):
                        ways.append(way)
        done = any(self._try_guess(NOWHERE, *way) for way in ways[: self.most])
        _hold(done or not ways, f"`serving` must give what can be done: {ways[: self.most]}")

    def _try_guess(self, name: str, *actions: Action) -> bool:
        """Whether a guess for a name succeeds; what then fails is not to be guessed again."""
        done = all(self.take(each).ok for each in actions)
        if done and actions[-1] in self.guesses(name):
            again = self.step(actions[-1]).ok
            _hold(again, f"`actions` must leave out what is done already: {actions[-1]}")
        self.reset()
        return done

    def try_orders(self) -> None:
        """Orders, then each pair of orders of the same thing: laws, undo, and replay."""
        shown = [
            orders_from_text(each.orders, self.env.verbs) for each in examples_of(self.env.verbs)
        ]
        for order in (order for each in shown for order in acting(each)):
            self._try_pair((order,))
        things = dict.fromkeys((*self.names[:_THINGS], *self.checked[:_CHECKED]))
        first = [(n, each) for n in things for each in self.orders(n) if self._try_pair((each,))]
        for name, one in first:
            for two in self.orders(name):
                self._try_pair((one, two))

    def _try_pair(self, orders: Sequence[Order]) -> bool:
        """Do orders, undo the last and all of them, and replay; whether the first did something."""
        if self.most <= 0:
            return False
        self.most -= 1
        start = before = self.state().text
        done: list[StepResult] = []
        results: list[StepResult] = []
        for order in orders:
            before, results = self.state().text, self._follow(order)
            done += results
            if not results or results[-1].terminated:
                self.reset()
                return False
        end = self.state()
        self._undo(results, before, orders[-1:])
        self.reset()
        for result in done:
            again = self.step(result.action).ok
            _hold(again, f"an action must succeed again after a reset: {result.action}")
        now = self.state()
        same = now == end
        _hold(same, f"the same actions must lead to the same state: {orders}{_both(end, now)}")
        if len(orders) > 1:
            self._undo(done, start, orders)
        self.reset()
        return True

    def _follow(self, order: Order) -> list[StepResult]:
        """Do one order; the results of what succeeded."""
        verb, found = self.verbs[order.do], self.resolve(order)
        declared = any(is_irreversible(self.env, action) for action in found.actions)
        agreed = declared or not (verb.irreversible and found.actions)
        _hold(agreed, f"{verb.name!r} is irreversible, but its actions are not: {found.actions}")
        done: list[StepResult] = []
        for action in found.actions:
            before, result = self.state(), self.take(action)
            if not result.ok:
                return done
            done.append(result)
            _hold(
                verb.ends or not result.terminated, f"{verb.name!r} terminates: give it ends=True"
            )
            seems = self.state().fingerprint == before.fingerprint and not result.terminated
            if seems and action.name != SEARCH:
                same = all(self.step(action).ok for _ in range(_TIMES))  # as the state is the same
                _hold(same, f"`state` must show what an action changes: {action}")
        ended = not found.actions or not verb.ends or done[-1].terminated
        _hold(ended, f"{verb.name!r} ends the task, but no result says terminated=True: {order}")
        return done

    def _undo(self, results: Sequence[StepResult], before: str, orders: Sequence[Order]) -> None:
        """Undo results; the state is back, or it is said what is not."""
        dialogue = DialogueState(to_undo=tuple(results))
        found = self.call("resolve", Order("undo"), dialogue, self.pick)
        if found == Resolution():
            return
        said = orders_to_text(orders).replace("\n", "; ")
        for action in found.actions:
            _hold(self.step(action).ok, f"what `undo` gives must succeed: {action}, for {said!r}")
        now = self.state()
        told = bool(found.why) or now.text == before
        both = _both(State(before), now)
        _hold(told, f"`undo` must bring the state back, or say what it cannot: {said!r}{both}")


_GIVES: dict[str, tuple[type, str]] = {
    "state": (State, 'a State("...")'),
    "offers": (str, "a list of texts"),
    "answer": (str, "a text"),
    "checks_met": (Checks, "Checks"),
    "actions": (Action, "a list of actions"),
    "serving": (Action, "a list of actions"),
    "like": (Scenario, "a list of Scenarios"),
}
"""What members must give."""


def _hold_actions(actions: Sequence[Action]) -> None:
    """Actions have texts and a whole number."""
    for each in actions:
        right = type(each.quantity) is int and _is_list(
            (each.name, each.target, each.destination), str
        )
        _hold(right, f"an action needs texts, with an int as the quantity: {each!r}")


def _both(first: State, second: State) -> str:
    """Two states that should be the same; by their fingerprints if their texts are."""
    if first.text == second.text:
        return f" (first {first.fingerprint!r}, then {second.fingerprint!r})"
    return f" (first {first.text!r}, then {second.text!r})"


def _is_list(found: Any, kind: type) -> bool:
    return isinstance(found, list | tuple) and all(
        isinstance(each, kind) for each in cast("Sequence[object]", found)
    )


def _shared(env: Environment) -> dict[str, str]:
    """The plain values that the environment's class holds."""
    kinds = (str, int, float, list, dict, set, tuple)
    return {name: repr(each) for name, each in vars(type(env)).items() if type(each) in kinds}


def _hold(law: bool, text: str) -> None:
    if not law:
        raise GoalscopeError(f"The environment breaks a law: {text}.")
