"""Whether an environment keeps the laws that agents rely on, after Gymnasium's `check_env`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

from goalscope.envs import Environment, missing, taken
from goalscope.types import Action, GoalscopeError, StepResult, TakenBack, Turn

__all__ = ["check_env"]


def check_env(env: Environment, *, most: int = 40) -> None:
    """Try an environment: words, failures that change nothing, replays to one state.

    The environment is reset before and after.

    Args:
        env: To be tried.
        most: Actions to try.

    Raises:
        GoalscopeError: A law is broken; the message says which, and by what.
    """
    for name in missing(env):
        raise _broken(f"`{name}` is missing")
    env.reset()
    start = env.fingerprint()
    for name in ("task", "completion_phrase"):
        _hold(bool(getattr(env, name).strip()), f"`{name}` must be a text that is not empty")
    _hold(bool(str(env.status() or "").strip()), "`status()` must be a text that is not empty")
    _hold(type(start) is str, f"`fingerprint()` must be a text, not {start!r}")
    _try_words(env)
    ends = [env.is_completion(Turn("", text)) for text in (env.completion_phrase, "Hello.")]
    _hold(ends == [True, False], "`completion_phrase` must be a completion, and a greeting none")
    _hold(env.fingerprint() == start, "words alone must change nothing")
    env.reset()
    _hold(env.fingerprint() == start, "two resets must lead to the same state")
    for odd in _odd_actions():
        result = taken(env, odd)
        _hold(not result.ok, f"an action that does not exist must fail: {odd!r}")
        _hold(bool(result.observation), f"a failure must say why: {odd!r}")
        _hold(env.fingerprint() == start, f"a failure must change nothing: {odd!r}")
    _try_reversal(env)
    done = _try_all(env, most)
    end = env.fingerprint()
    env.reset()
    for result in done:
        again = taken(env, result.action)
        _hold(again.ok, f"an action must succeed again after a reset: {result.action}")
    _hold(env.fingerprint() == end, "the same actions after a reset must lead to the same state")
    env.reset()
    _hold(env.fingerprint() == start, "a reset must undo everything")


def _try_words(env: Environment) -> None:
    """Have things said, and see that each method answers with what it should."""
    things = _kinds(env, 3)
    said = ["Hello.", "What is there?", env.completion_phrase]
    said += [text for thing in things for text in (f"I'd like {thing}.", f"No {thing}, please.")]
    turns = [Turn("What can I do for you?", text) for text in said]
    for number in range(1, len(turns) + 1):
        past = turns[:number]
        text, words = past[-1].utterance, [turn.utterance for turn in past]
        calls: list[tuple[str, tuple[object, ...], Any, bool]] = [
            ("kinds", (text, 3), str, True),
            ("mentioned", (words,), str, True),
            ("actions", (things, past), Action, True),
            ("requests", (past,), Action, True),
            ("unmet", (past, []), str, True),
            ("permission", (Action(""), past), str, False),
            ("answer", (text,), str | None, False),
            ("is_order", (past,), bool, False),
            ("is_completion", (past[-1],), bool, False),
            ("completion_actions", (), Action, True),
        ]
        for name, arguments, kind, many in calls:
            try:
                found = getattr(env, name)(*arguments)
            except Exception as error:
                told = f"{type(error).__name__}: {error}"
                raise _broken(f"`{name}` fails after {text!r} ({told})") from error
            listed = isinstance(found, list)
            given = cast("list[object]", found) if many and listed else [found]
            right = many == listed and all(isinstance(one, kind) for one in given)
            what = getattr(kind, "__name__", "text or None")
            what = f"a list of {what}" if many else f"a {what}"
            _hold(right, f"`{name}` must give {what}, not {found!r}, after {text!r}")


def _kinds(env: Environment, limit: int) -> list[str]:
    try:
        return env.kinds("", limit)
    except Exception as error:
        raise _broken(f"`kinds` fails ({type(error).__name__}: {error})") from error


def _try_reversal(env: Environment) -> None:
    """Undo each kind of action once, where the environment says that it can."""
    start = env.status()
    if env.reversal([], [], []) is None:
        return
    tried: set[str] = set()
    turns = [TakenBack("", "Do something."), TakenBack("", "")]
    for kind in _kinds(env, 1000):
        for action in env.actions([kind]):
            result = None if action.name in tried else taken(env, action)
            if result is None or not result.ok:
                continue
            tried.add(action.name)
            back = env.reversal([result], [], turns)
            undone = [taken(env, each) for each in back[0]] if back else []
            _hold(all(each.ok for each in undone), f"what `reversal` gives must succeed: {action}")
            told = back is not None and (bool(back[1]) or env.status() == start)
            _hold(told, f"`reversal` must bring the state back, or say what it cannot: {action}")
            env.reset()


def _try_all(env: Environment, most: int) -> list[StepResult]:
    """Take at most `most` actions of every name on offer; returns those that succeeded."""
    done: list[StepResult] = []
    kinds = _kinds(env, 1000)
    tried: dict[str, int] = {}
    for kind in kinds:
        for action in env.actions([kind]):
            if len(done) >= most:
                return done
            if tried.get(action.name, 0) * 4 > most or action not in env.actions([kind]):
                continue
            tried[action.name] = tried.get(action.name, 0) + 1
            before, status = env.fingerprint(), env.status()
            result = taken(env, action)
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
