"""Which model a text names, and two models as one."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from commands import run
from fakes import WordModel
from goalscope.base.types import InvalidInputError, Message, ModelError
from goalscope.models.llama.model import LlamaCpp, embedded_path
from goalscope.models.opening import ModelSet, model_label, open_model

CHAT = [Message("user", "milk and eggs")]


class Named(WordModel):
    """A word model with a name; `closed` tells whether it was closed."""

    def __init__(self, name: str, context_size: int = 4096) -> None:
        super().__init__({"milk": f"by {name}"}, context_size)
        self.name = self.fingerprint = name
        self.closed = False

    def describe(self) -> str:
        return f"the {self.name}"

    def close(self) -> None:
        self.closed = True


def test_one_writes_and_the_other_scores() -> None:
    writer, scorer = Named("writer", 100), Named("scorer", 50)
    both = ModelSet(writer, scorer)
    assert both.generate(CHAT).text == "by writer"
    both.token_logprobs([CHAT], ["milk"])
    assert (writer.calls, scorer.calls) == (0, 1)
    assert both.context_size == 50
    assert both.name == "writer and scorer"
    both.close()
    assert (writer.closed, scorer.closed) == (True, True)


def test_nothing_names_the_embedded_model_and_one_for_both_is_one() -> None:
    model = open_model(generator=embedded_path(), scorer=embedded_path())
    assert isinstance(model.generator, LlamaCpp)
    assert model.roles == [model.generator]
    assert model.describe() == model.generator.describe()
    model.close()


def test_an_adapter_is_named_to_its_server_and_not_here(tmp_path: Path) -> None:
    for names in ({"model": "http://host/v1#base"}, {"scorer": "https://host/v1"}):
        with pytest.raises(InvalidInputError, match=r"--lora-modules.*://host/v1#NAME\."):
            open_model(**names, adapter=tmp_path)


@pytest.mark.parametrize(
    ("names", "label"),
    [
        ({}, "SmolLM2-135M-Instruct"),
        ({"adapter": "/home/me/mine/adapter.gguf"}, "SmolLM2-135M-Instruct + mine"),
        ({"adapter": "C:\\mine\\adapter.gguf"}, "SmolLM2-135M-Instruct + mine"),
        ({"adapter": "/home/me/mine"}, "SmolLM2-135M-Instruct + mine"),
        ({"adapter": "/home/me/mine.gguf"}, "SmolLM2-135M-Instruct + mine"),
        ({"adapter": "none"}, "SmolLM2-135M-Instruct without adapter"),
        ({"model": "/big.gguf", "adapter": "/mine"}, "big + mine"),
        ({"model": "/big.gguf", "adapter": "none"}, "big"),
        ({"scorer": "/big.gguf", "adapter": "none"}, "SmolLM2-135M-Instruct + big"),
        (
            {"generator": "http://host/v1#gpt", "adapter": "none"},
            "gpt + SmolLM2-135M-Instruct without adapter",
        ),
    ],
)
def test_a_label_names_the_adapter(names: dict[str, str], label: str) -> None:
    assert model_label(names) == label


def test_a_folder_that_holds_no_model_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.gguf").touch()
    with pytest.raises(ModelError, match=r"has no config.json.*GGUF file.*contains a\.gguf"):
        open_model(tmp_path)


def test_a_writer_is_closed_where_its_scorer_cannot_be_opened(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    writer = Named("writer")
    monkeypatch.setattr("goalscope.models.opening._generator", lambda *_: writer)
    with pytest.raises(ModelError, match="no model file"):
        open_model(generator="http://127.0.0.1:9/v1", scorer=tmp_path / "none.gguf")
    assert writer.closed


def test_a_served_model_of_a_private_name_is_looked_for_nowhere(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    hub = pytest.importorskip("huggingface_hub")
    asked: list[str] = []
    monkeypatch.setattr(hub, "hf_hub_download", lambda name, *_, **__: asked.append(name))
    monkeypatch.setattr("goalscope.models.server.Server.facts", {"id": "our-secret"})
    with pytest.raises(
        ModelError, match=r"our-secret is not a name.*open_model\(tokenizer=\.\.\.\)"
    ):
        open_model("http://127.0.0.1:9/v1#our-secret")
    assert asked == []


def test_a_real_server_without_its_tokenizer_asks_for_one(llama_server_address: str) -> None:
    with pytest.raises(ModelError, match="--tokenizer"):
        open_model(f"{llama_server_address}#/nowhere/model.gguf")


def test_a_real_server_is_checked_from_the_command_line(llama_server_address: str) -> None:
    arguments = ["models", "check", llama_server_address, "--tokenizer", str(embedded_path())]
    result = run(*[*arguments, "--json"])
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    assert "forced tokens" in report["scores"]
    assert report["self-test error (nats)"] < 0.01
    assert report["keeps to a JSON schema"] == "yes"
    assert report["problems"] == []


def test_a_server_may_write_for_the_embedded_scorer(
    llama_server_address: str, tmp_path: Path
) -> None:
    arguments = ["run", "--profile", "cafe", "--rounds", "1", "--seed", "1"]
    arguments += ["--generator", llama_server_address, "--store", str(tmp_path / "episodes.db")]
    result = run(*[*arguments, "--json"])
    assert result.exit_code == 0, result.output
    (outcome,) = json.loads(result.stdout)
    assert outcome["rounds"] == 1
    assert f"{llama_server_address}: " in result.stderr  # the requests that it took


@pytest.mark.parametrize("how", [{}, {"adapter": "x" * 5000}])
def test_a_name_that_is_too_long_for_a_file_is_no_file(how: dict[str, str]) -> None:
    with pytest.raises(ModelError, match=r"There is no (model file|adapter) at"):
        open_model("[" * 5000, **how)
