"""The checks of a model by `goalscope doctor` and `goalscope models check`."""

from __future__ import annotations

import json
import time
from typing import Any

from goalscope.base.types import GoalscopeError, Message
from goalscope.models import Model
from goalscope.models.adapters import NO_ADAPTER
from goalscope.models.local import LocalModel
from goalscope.models.opening import ModelSet
from goalscope.models.scoring import TokenScorer

_CHAT = [Message("system", "You help a customer."), Message("user", "What do you sell?")]
_SCHEMA = {
    "type": "object",
    "properties": {"answer": {"enum": ["yes", "no"]}},
    "required": ["answer"],
    "additionalProperties": False,
}


def check(model: Model) -> tuple[dict[str, Any], list[str]]:
    """Test that a model writes, keeps to a JSON schema, and scores consistently.

    Returns:
        The findings by name, and the problems; a sound model has none.
    """
    speaker, generator = (
        (model.speaker, model.generator) if isinstance(model, ModelSet) else (model, model)
    )
    found: dict[str, Any] = {}
    problems: list[str] = []
    for attempt, part in ((_try_scoring, speaker), (_try_writing, generator)):
        try:
            attempt(part, found, problems)
        except GoalscopeError as error:
            problems.append(str(error))
    return found, problems


def _try_scoring(model: Any, found: dict[str, Any], problems: list[str]) -> None:
    test = model.self_test() if isinstance(model, TokenScorer) else None
    found["scores"] = model.describe()
    if isinstance(model, LocalModel):
        found["adapter"] = _adapter(model)
    if test is None:
        return
    found["self-test error (nats)"] = max(test.generation_error, test.batch_error)
    found["true over scrambled (nats a token)"] = test.preference
    prompt = model.tokenizer.render(_CHAT)
    found["scored words follow"] = repr(model.tokenizer.detokenize(prompt[-12:], markup=True))
    if test.complaint:
        remedy = "" if test.in_thought else f" {model.remedy}"
        problems.append(f"{model.describe()}: {test.complaint}{remedy}")
    model.clear_cache()
    goals = [f"You want {thing}." for thing in ("milk", "a cake", "soup", "tea", "bread")]
    contexts = [[Message("system", goal), *_CHAT[1:]] for goal in goals]
    start = time.perf_counter()
    model.token_logprobs(contexts, ["I would like something for tonight, please."] * len(goals))
    found["scoring 5 goals (s)"] = time.perf_counter() - start


def _adapter(model: LocalModel) -> list[str] | str:
    """The file of a model's adapter, and its metadata line by line."""
    if model.adapter is None:
        return NO_ADAPTER
    told = [
        f"{key}: {text}"
        for key, text in model.adapter_metadata.items()
        if key == "general.name" or key.startswith("goalscope.")
    ]
    return [str(model.adapter), *told]


def _try_writing(model: Any, found: dict[str, Any], problems: list[str]) -> None:
    found["writes"] = model.describe()
    start = time.perf_counter()
    reply = model.generate(_CHAT, max_tokens=24)
    if reply.completion_tokens:
        seconds = time.perf_counter() - start
        found["writing speed (tokens/s)"] = reply.completion_tokens / seconds
    if not reply.text.strip():
        problems.append("The model wrote nothing.")
    json.loads(model.generate(_CHAT, max_tokens=64, schema=_SCHEMA).text)
    found["keeps to a JSON schema"] = "yes"
