"""Check the laws that agents rely on in an environment, like Gymnasium's `check_env`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from goalscope.envs import Environment, Resolution, execute, missing
from goalscope.orders import DIALOGUE_ACTS, Order, Reading
from goalscope.picking import Picker
from goalscope.reader import check_verbs
from goalscope.standing import Standing, fold
from goalscope.types import Action, GoalscopeError, InvalidInputError, StepResult

__all__ = ["check_env"]


def check_env(env: Environment, *, most: int = 40) -> None:
    """Test an environment: orders, failures that change nothing, reproducible replays.

    The environment is reset before and after.

    Args:
        env: The environment.
        most: Maximum number of actions to try.

    Raises:
        GoalscopeError: A law is broken; the message says which, and by which action.
    """
    _hold(isinstance(cast("object", env), Environment), "it must inherit from `Environment`")
    for name in missing(env):
        raise _broken(f"`{name}` is missing")
    env.reset()
    start = env.fingerprint()
    for name in ("task", "completion_phrase"):
        _hold(bool(getattr(env, name).strip()), f"`{name}` must be a text that is not empty")
    _hold(bool(str(env.status() or "").strip()), "`status()` must be a text that is not empty")
    _hold(type(start) is str, f"`fingerprint()` must be a text, not {start!r}")
    try:
        check_verbs(env.verbs)
    except InvalidInputError as error:
        raise _broken(str(error)) from None
    _try_orders(env)
    _hold(env.fingerprint() == start, "to resolve orders and to answer must change nothing")
    env.reset()
    _hold(env.fingerprint() == start, "two resets must lead to the same state")
    for odd in _odd_actions():
        result = execute(env, odd)
        _hold(not result.ok, f"an action that does not exist must fail: {odd!r}")
        _hold(bool(result.observation), f"a failure must say why: {odd!r}")
        _hold(env.fingerprint() == start, f"a failure must change nothing: {odd!r}")
    _try_undo(env)
    done = _try_all(env, most)
    end = env.fingerprint()
    env.reset()
    for result in done:
        again = execute(env, result.action)
        _hold(again.ok, f"an action must succeed again after a reset: {result.action}")
    _hold(env.fingerprint() == end, "the same actions after a reset must lead to the same state")
    env.reset()
    _hold(env.fingerprint() == start, "a reset must undo everything")


def _try_orders(env: Environment) -> None:
    """Resolve orders by every verb and limit, of things that are here and things that are not."""
    pick = Picker()
    verbs = [*env.verbs, *(act for act in DIALOGUE_ACTS if act.name in ("avoid", "only", "leave"))]
    for thing in [*_offered(env, 2), "no such thing"]:
        for verb in verbs:
            order = Order(verb.name, thing if "what" in verb.slots else "", for_="no such thing")
            standing = fold([Reading((order,))])
            try:
                found = env.resolve(order, standing, pick)
                told = env.answer(Order("ask", thing), standing, pick)
            except Exception as error:
                told = f"{type(error).__name__}: {error}"
                raise _broken(f"`resolve` or `answer` fails for {order} ({told})") from error
            right = isinstance(cast("object", found), Resolution)
            _hold(right, f"`resolve` must return a Resolution, not {found!r}, for {order}")
            says = bool(found.actions or found.why) or verb in DIALOGUE_ACTS
            _hold(says, f"`resolve` must return actions, or say why not, for {order}")
            right = isinstance(cast("object", told), str)
            _hold(right, f"`answer` must return a text, not {told!r}, for {order}")


def _offered(env: Environment, limit: int) -> list[str]:
    try:
        return env.offers("", limit)
    except Exception as error:
        raise _broken(f"`offers` fails ({type(error).__name__}: {error})") from error


def _try_undo(env: Environment) -> None:
    """Undo each kind of action once, where the environment says that it can."""
    start = env.status()
    tried: set[str] = set()
    for name in _offered(env, 1000):
        for action in env.actions(name, Standing()):
            result = None if action.name in tried else execute(env, action)
            if result is None or not result.ok:
                continue
            tried.add(action.name)
            back = env.undo([result], Standing())
            if back is not None:
                undone = [execute(env, each) for each in back.actions]
                _hold(all(each.ok for each in undone), f"actions of `undo` must succeed: {action}")
                told = bool(back.why) or env.status() == start
                _hold(told, f"`undo` must bring the state back, or say what it cannot: {action}")
            env.reset()


def _try_all(env: Environment, most: int) -> list[StepResult]:
    """Take at most `most` actions of every name on offer; returns those that succeeded."""
    done: list[StepResult] = []
    names, standing = _offered(env, 1000), Standing()
    tried: dict[str, int] = {}
    for name in names:
        for action in env.actions(name, standing):
            if len(done) >= most:
                return done
            if tried.get(action.name, 0) * 4 > most or action not in env.actions(name, standing):
                continue
            tried[action.name] = tried.get(action.name, 0) + 1
            before, status = env.fingerprint(), env.status()
            result = execute(env, action)
            _hold(result.action == action, f"a result must name its action: {action}")
            if result.ok:
                done.append(result)
                told = env.status() == status or env.fingerprint() != before
                _hold(told, f"what changed `status()` must change `fingerprint()`: {action}")
            else:
                _hold(bool(result.observation), f"a failure must say why: {action}")
                _hold(env.fingerprint() == before, f"a failure must change nothing: {action}")
    return done


def _odd_actions() -> Sequence[Action]:
    return [
        Action("no such action", "no such thing"),
        Action("put", "no such thing", destination="no such place"),
        Action("add item", "no such thing"),
        Action("buy basket", quantity=-1),
        Action("open", "\x00<|im_end|>", 10**9),
        Action(""),
    ]


def _hold(law: bool, text: str) -> None:
    if not law:
        raise _broken(text)


def _broken(text: str) -> GoalscopeError:
    return GoalscopeError(f"The environment breaks a law: {text}.")
