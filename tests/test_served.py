"""Models behind servers that score: the right numbers, or a refusal that says why.

`recordings/{vllm,llama_server}.json` were recorded from real servers.
`Simulated` gives the embedded model's own numbers in vLLM's form, honest or twisted.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from goalscope.base.types import Message, ModelError
from goalscope.models.llama.model import LlamaCpp
from goalscope.models.scoring import Pair
from goalscope.models.served import Forced, PromptTokens, ServedScorer
from goalscope.models.server import Server
from test_model_contract import TOLERANCE

httpx2 = pytest.importorskip("httpx2", reason="models behind a server need goalscope[remote]")

URL = "http://models.test/v1"
CONTEXTS = [
    [Message("system", f"You want {goal}."), Message("user", "What do you need?")]
    for goal in ("eggs", "wine")
]
REPLIES = ["Six eggs.", "A bottle of wine 🍷"]
SCHEMA = {
    "type": "object",
    "properties": {"item": {"enum": ["milk", "eggs"]}},
    "required": ["item"],
    "additionalProperties": False,
}


def recording(name: str) -> dict[str, Any]:
    return json.loads(Path(__file__).with_name("recordings").joinpath(f"{name}.json").read_text())


def replayed(name: str) -> Server:
    """A server that answers just what the recorded one did when it was sent the same."""
    exchanges = recording(name)["exchanges"]

    def answer(request: httpx2.Request) -> httpx2.Response:
        body = json.loads(request.content or "null")
        for each in exchanges:
            known = each.get("request") or {}
            if (each["method"], each["path"]) == (request.method, request.url.path) and all(
                known.get(key) == value for key, value in (body or {}).items()
            ):
                return httpx2.Response(each["status"], json=each["response"])
        raise AssertionError(f"Nothing was recorded for {request.url.path} {body}")

    return Server(URL + "#smollm2", transport=httpx2.MockTransport(answer))


def recorded_pairs(name: str) -> list[Pair]:
    chat = recording(name)["chat"]
    return [Pair(chat["prompt_ids"], each["ids"]) for each in chat["continuations"]]


FLOAT32 = [[-8.0310, -1.2261, -1.6313, -0.3950], [-5.4463, -4.7746, -5.8035, -13.5062]]


def test_prompt_tokens_read_the_recorded_numbers(model: LlamaCpp) -> None:
    rows = PromptTokens(replayed("vllm"), model.tokenizer).score(recorded_pairs("vllm"))
    for row, expected in zip(rows, FLOAT32, strict=True):
        np.testing.assert_allclose(row, expected, atol=1e-3)


def test_forced_tokens_read_the_recorded_numbers(model: LlamaCpp) -> None:
    prompt, answer, _ = recorded_pairs("llama_server")[0]
    (row,) = Forced(replayed("llama_server"), model.tokenizer).score([Pair(prompt, answer[:2])])
    np.testing.assert_allclose(row, [-8.1381, -1.2561], atol=2e-3)


Row = list[float | None]


class Simulated:
    """A server in vLLM's form, over the embedded model; `twist` changes a prompt's numbers."""

    def __init__(self, model: LlamaCpp) -> None:
        self.model = model
        self.twist: Callable[[Row], Row] = list
        self.change: Callable[[dict[str, Any]], Any] = dict
        self.bodies: list[dict[str, Any]] = []

    def __call__(self, request: httpx2.Request) -> httpx2.Response:
        if request.url.path == "/v1/models":
            return httpx2.Response(200, json={"data": [{"id": "m", "max_model_len": 512}]})
        body = json.loads(request.content)
        self.bodies.append(body)
        if request.url.path != "/v1/completions" or isinstance(body["prompt"], str):
            return httpx2.Response(404, json={"detail": "Not Found"})
        form = self.prompt_tokens if "prompt_logprobs" in body else self.next_token
        choices = [{"index": i, **each} for i, each in enumerate(form(body))]
        content = json.dumps(self.change({"choices": choices}))  # NaN as Python writes it
        return httpx2.Response(200, text=content, headers={"content-type": "application/json"})

    def prompt_tokens(self, body: dict[str, Any]) -> Iterator[dict[str, Any]]:
        rows = self.model.score([Pair(ids[:1], ids[1:]) for ids in body["prompt"]])
        for ids, row in zip(body["prompt"], rows, strict=True):
            entries = zip(ids[1:], self.twist(row.tolist()), strict=True)
            yield {"prompt_logprobs": [None, *({str(i): {"logprob": x}} for i, x in entries)]}

    def next_token(self, body: dict[str, Any]) -> Iterator[dict[str, Any]]:
        for ids in body["prompt"]:
            logprobs = self.model.next_logprobs(ids)
            tokens = [int(np.argmax(logprobs))]
            names = [f"token_id:{token}" for token in tokens]
            values = self.twist(logprobs[tokens].tolist())
            top = dict(zip(names, values, strict=True))
            told = {"tokens": names[:1], "token_logprobs": values[:1], "top_logprobs": [top]}
            yield {"logprobs": told}

    def scorer(self) -> ServedScorer:
        server = Server(URL, transport=httpx2.MockTransport(self))
        return ServedScorer(server, self.model.tokenizer)


@pytest.fixture
def simulated(model: LlamaCpp) -> Simulated:
    return Simulated(model)


def test_an_honest_server_passes_and_scores_like_the_model(
    model: LlamaCpp, simulated: Simulated
) -> None:
    scorer = simulated.scorer()
    assert scorer.protocol == PromptTokens.name
    ours = scorer.token_logprobs(CONTEXTS, REPLIES)
    theirs = model.token_logprobs(CONTEXTS, REPLIES)
    for row, expected in zip(ours, theirs, strict=True):
        assert row.sum() == pytest.approx(expected.sum(), abs=TOLERANCE)


def constant(row: Row) -> Row:
    return [-2.0] * len(row)


def clamped(row: Row) -> Row:
    return [value if value is not None and value > -1.5 else -9999.0 for value in row]


def one_late(row: Row) -> Row:
    return [*row[1:], -1.0] if len(row) > 1 else row


def generated_only(answer: dict[str, Any]) -> dict[str, Any]:
    for choice in answer["choices"]:
        choice.pop("prompt_logprobs", None)
    return answer


def unordered(answer: dict[str, Any]) -> dict[str, Any]:
    for choice in answer["choices"]:
        del choice["index"]
    return {"choices": answer["choices"][::-1]}


def refused(scorer: ServedScorer) -> str:
    with pytest.raises(ModelError) as caught:
        scorer.token_logprobs(CONTEXTS, REPLIES)
    text = str(caught.value)
    assert "\n" not in text
    assert URL in text
    assert "cannot score given words" in text
    assert "Use vLLM or llama.cpp's server" in text
    return text


@pytest.mark.parametrize(
    ("twist", "change", "said"),
    [
        pytest.param(list, generated_only, "tokens have 0 prompt_logprobs", id="generated only"),
        pytest.param(clamped, dict, "-9999 stands for a log-probability", id="clamped"),
        pytest.param(one_late, dict, "writes it and as it scores it differ", id="one late"),
        pytest.param(list, unordered, "tokens have", id="unordered"),
        pytest.param(constant, dict, "hardly likelier", id="constant"),
    ],
)
def test_the_self_test_refuses_a_server_that_does_not_tell_the_truth(
    simulated: Simulated,
    twist: Callable[[Row], Row],
    change: Callable[[dict[str, Any]], Any],
    said: str,
) -> None:
    simulated.twist, simulated.change = twist, change
    assert said in refused(simulated.scorer())


def test_after_a_refusal_or_an_interruption_a_server_is_tested_again(simulated: Simulated) -> None:
    scorer = simulated.scorer()

    def interrupt(_: dict[str, Any]) -> Any:
        raise KeyboardInterrupt

    simulated.change = interrupt
    with pytest.raises(KeyboardInterrupt):
        scorer.token_logprobs(CONTEXTS, REPLIES)
    simulated.change = generated_only
    for _ in range(2):
        simulated.bodies.clear()
        refused(scorer)
        assert simulated.bodies
    simulated.change = dict
    assert scorer.protocol == PromptTokens.name


def test_a_server_that_is_down_is_not_tested(simulated: Simulated) -> None:
    def down(_: httpx2.Request) -> httpx2.Response:
        return httpx2.Response(401, json={"error": "Unauthorized"})

    server = Server(URL, transport=httpx2.MockTransport(down))
    with pytest.raises(ModelError, match="Set GOALSCOPE_API_KEY"):
        ServedScorer(server, simulated.model.tokenizer).token_logprobs(CONTEXTS, REPLIES)
    assert server.usage["requests"] == 1


def broken(**changes: Any) -> Callable[[dict[str, Any]], Any]:
    def change(answer: dict[str, Any]) -> Any:
        for choice in answer["choices"]:
            choice.update(changes)
        return answer

    return change


@pytest.mark.parametrize(
    "change",
    [
        lambda _: {},
        lambda _: {"choices": None},
        lambda _: {"choices": [1, 2]},
        lambda _: {"choices": []},
        lambda answer: {"choices": answer["choices"] * 2},
        broken(prompt_logprobs=None),
        broken(prompt_logprobs=3),
        broken(prompt_logprobs=[None]),
        broken(prompt_logprobs={}),
        broken(index="x"),
    ],
)
def test_an_answer_in_another_form_is_one_clear_line(
    simulated: Simulated, change: Callable[[dict[str, Any]], Any]
) -> None:
    scorer = simulated.scorer()
    assert scorer.protocol == PromptTokens.name
    simulated.change = change
    with pytest.raises(ModelError, match=r"an unknown form|sent no answer") as caught:
        scorer.token_logprobs(CONTEXTS, REPLIES)
    assert "\n" not in str(caught.value)
    assert URL in str(caught.value)


@pytest.mark.parametrize("bad", [None, float("nan"), float("inf"), -float("inf"), 0.5, -9999.0])
def test_a_number_that_is_no_log_probability_is_refused(
    simulated: Simulated, bad: float | None
) -> None:
    scorer = simulated.scorer()
    assert scorer.protocol == PromptTokens.name
    simulated.twist = lambda row: [*row[:-1], bad]
    with pytest.raises(ModelError, match=r"invalid log-probabilities|an unknown form"):
        scorer.token_logprobs(CONTEXTS, REPLIES)


def test_numbers_of_other_tokens_are_refused(simulated: Simulated) -> None:
    scorer = simulated.scorer()
    assert scorer.protocol == PromptTokens.name
    simulated.change = lambda answer: {
        "choices": [
            {**each, "prompt_logprobs": [{"7": {"logprob": -1}}] * len(each["prompt_logprobs"])}
            for each in answer["choices"]
        ]
    }
    with pytest.raises(ModelError, match="KeyError"):
        scorer.token_logprobs(CONTEXTS, REPLIES)


def test_equal_prompts_are_sent_once_and_eight_in_one_request(simulated: Simulated) -> None:
    scorer = simulated.scorer()
    assert scorer.protocol
    simulated.bodies.clear()
    rows = scorer.token_logprobs([CONTEXTS[0]] * 12, [f"{n % 10} eggs" for n in range(12)])
    np.testing.assert_array_equal(rows[0], rows[10])
    assert [len(body["prompt"]) for body in simulated.bodies] == [8, 2]
