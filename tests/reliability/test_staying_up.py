"""What is too much, too slow or broken ends in time, and the process goes on."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fakes import NEEDS, WordModel
from goalscope.agent.agent import Agent, run_episode
from goalscope.agent.people import ScriptedHuman
from goalscope.agent.settings import Settings, toolkit_for
from goalscope.base.types import Profile
from goalscope.envs.registry import open_environment
from goalscope.models import Completion
from processes import environment


class Endless(WordModel):
    """Writes ever more, whatever it may, and keeps how long what it was asked is."""

    def __init__(self, *, taught: bool) -> None:
        super().__init__(context_size=2000)
        self.taught = taught
        self.longest = self.written = 0

    def generate(self, messages, **settings):
        self.longest = max(self.longest, self.count_tokens(messages))
        self.written += 1
        if "grammar" in settings:
            return Completion("aim\n" * 1000, "length", 1, 1)
        names = ["milk", "eggs", "apple", *(f"thing {self.written * 50 + n}" for n in range(50))]
        text = "\n".join(names)
        if any(NEEDS in each.content for each in messages):
            text = f"needed: {', '.join(names)}"
        if schema := settings.get("schema"):
            (name,) = schema["required"]
            whole = {"plan": [*range(1, 200)], "question": text}.get(name, names)
            text = json.dumps({name: whole})
        return Completion(text, "stop", 1, 1)

    @property
    def writer(self) -> Endless | None:
        return self if self.taught else None

    def token_logprobs(self, contexts, continuations):
        for context, text in zip(contexts, continuations, strict=True):
            self.longest = max(self.longest, self.count_tokens(context) + len(text.split()))
        return super().token_logprobs(contexts, continuations)


@pytest.mark.parametrize("domain", ["grocery", "house"])
@pytest.mark.parametrize("taught", [True, False])
def test_a_model_that_writes_without_end_gets_no_more_done(
    taught: bool, domain: str, figure: Callable[[str], None]
) -> None:
    settings, model = Settings(domain=domain, rounds=2), Endless(taught=taught)
    env = open_environment(settings)
    agent = Agent(env, model, toolkit=toolkit_for(settings, model))
    wish = "I want to bake a cake. Please add flour, milk and eggs."
    wish = wish if domain == "grocery" else "Please put the apple in the fridge, and tidy up."
    person = Profile("p", "d", (wish,) * 50, ())
    rounds = list(run_episode(agent, ScriptedHuman(person, env), max_rounds=settings.rounds))
    most = 8 * 4 if taught else 12  # things and what each leads to, or actions of a plan
    acts = [len(each.results) for each in rounds]
    assert len(rounds) <= settings.rounds
    assert max(acts) <= most
    assert max(acts) > 0 or domain == "house"
    assert max(each.replans for each in rounds) <= 3
    assert max(len(each.belief.goals) for each in rounds if each.belief) <= 1 + 3 * len(rounds)
    assert model.longest <= model.context_size
    assert all(
        len(goal.text) <= 120 for each in rounds if each.belief for goal in each.belief.goals
    )
    env.__exit__(None, None, None)
    told = f"{len(rounds)} rounds, at most {max(acts)} actions in one, prompts of at most"
    way = "taught" if taught else "prompted"
    figure(f"{domain}, {way}: {told} {model.longest} of {model.context_size} tokens")


@pytest.mark.parametrize("count", [2, pytest.param(50, marks=pytest.mark.slow)])
def test_too_little_memory_again_and_again_leaves_the_answers_as_they_are(
    count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, figure: Callable[[str], None]
) -> None:
    torch = pytest.importorskip("torch")
    from goalscope.models.torch.model import Transformers
    from test_transformers import assert_equal, family, reference, tiny

    model = Transformers(tiny(tmp_path / "llama", "llama"), device="cpu")
    pairs, forward = family(4, branches=3), model.network.model.forward
    expected, batch = reference(model, pairs), model._batch
    least, failed = 10**9, 0
    for number in range(count):
        room = int(np.random.default_rng(number).integers(40, 100))

        def limited(*args, input_ids, room=room, **rest):
            nonlocal failed
            if input_ids.numel() > room:
                failed += 1
                raise torch.OutOfMemoryError("CUDA out of memory")
            return forward(*args, input_ids=input_ids, **rest)

        monkeypatch.setattr(model.network.model, "forward", limited)
        model._batch, model._width = batch, min(batch, 512)
        model.clear_cache()
        assert_equal(model.score(pairs), expected)
        least = min(least, model._batch)
    assert failed >= count // 2
    assert least < batch
    figure(
        f"{count} of {count} calls survive {failed} times too little memory",
    )


MANY_GOALS = r"""
import json, re, sys, threading, os, signal, time
from pathlib import Path
import numpy as np
from goalscope import Goal
from goalscope.belief.likelihood import RolePlay
from goalscope.models.llama.model import LlamaCpp
from goalscope.base.types import Turn

signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have turned it off
goals, tokens = int(sys.argv[1]), int(sys.argv[2])
model = LlamaCpp(context_size=8192)
likelihood = RolePlay(model)
everything = [Goal(f"find thing {n}") for n in range(goals)]

def most():
    return int(re.search(r"VmHWM:\s*(\d+)", Path("/proc/self/status").read_text())[1])

def prompt():
    return model.count_tokens(likelihood.context("Help.", everything[0], turns))

turns = [Turn("What do you need?", "Something for my home.")]
while prompt() < tokens:
    words = f"In room {len(turns)} there is a table with a cake, and I would like some of it. " * 8
    turns.append(Turn("And what else do you need in that room?", words))
turns.append(Turn("Anything else?", "Put the kettle on."))
assert likelihood.window("Help.", turns) == 0
before = most()
start = time.monotonic()
row = likelihood.log_likelihood("Help.", everything, turns, since=len(turns) - 1)[0]
took = time.monotonic() - start
assert row.shape == (goals,) and np.isfinite(row).all()
peak = most()
model.clear_cache()
stopped = 0.0
def stop():
    global stopped
    stopped = time.monotonic()
    os.kill(os.getpid(), signal.SIGINT)
threading.Timer(min(3.0, took / 8), stop).start()
try:
    likelihood.log_likelihood("Help.", everything, turns, since=len(turns) - 1)
    time.sleep(60)
    ended = None
except KeyboardInterrupt:
    ended = time.monotonic() - stopped
print(json.dumps(
    {"before": before, "peak": peak, "took": took, "ended": ended, "prompt": prompt()}
))
"""


@pytest.mark.parametrize(
    ("goals", "tokens"), [(10, 300), pytest.param(500, 1000, marks=pytest.mark.slow)]
)
def test_many_goals_and_a_long_talk_keep_within_memory(
    goals: int, tokens: int, figure: Callable[[str], None]
) -> None:
    if not Path("/proc/self/status").exists():
        pytest.skip("the system does not tell how much memory was used")
    done = subprocess.run(
        [sys.executable, "-c", MANY_GOALS, str(goals), str(tokens)],
        env=environment(), capture_output=True, text=True, timeout=3000, check=True,
    )  # fmt: skip
    found = json.loads(done.stdout)
    grown = (found["peak"] - found["before"]) / 2**10
    assert found["prompt"] >= tokens
    assert grown < 2500
    assert found["ended"] < 60
    figure(
        f"{goals} goals, {found['prompt']:,} tokens of prompt: {grown:,.0f} MiB besides the model, "
        f"{found['peak'] / 2**10:,.0f} MiB in all, {found['took']:.0f} s; Ctrl-C ends it in "
        f"{found['ended']:.1f} s",
    )
