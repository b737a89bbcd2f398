"""A model that learns: LoRA adapters on some of its layers, and how likely words are to it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from goalscope.likelihood import RolePlay
from goalscope.models.adapters import MODULES, Adapter
from goalscope.models.extras import package
from goalscope.models.packing import parents
from goalscope.models.transformers import Transformers
from goalscope.models.trie import Trie
from goalscope.types import Goal, ModelError, Turn

__all__ = ["Example", "Learner"]


@dataclass(frozen=True, slots=True)
class Example:
    """A dialogue to learn from, or a part of it.

    Attributes:
        task: The assistant's task.
        goals: The true goal, `UNSPECIFIED`, and wrong ones.
        turns: Of the dialogue.
        scored: Indices of the turns whose words are scored, in their order.
    """

    task: str
    goals: Sequence[Goal]
    turns: Sequence[Turn]
    scored: Sequence[int]


class Learner:
    """A Hugging Face model with LoRA adapters whose weights can be trained.

    Attributes:
        roleplay: Scores words with the adapters as they are.
        parameters: What is trained.
    """

    def __init__(
        self, model: Transformers, roleplay: RolePlay, *, rank: int, layers: float, seed: int
    ) -> None:
        """Add adapters that change nothing yet.

        Args:
            model: The model; it is changed.
            roleplay: Puts its prompts.
            rank: Of the adapters.
            layers: The share of the model's layers, the last ones, that have adapters.
            seed: Of the adapters' first weights.

        Raises:
            ModelError: The model has other layers than adapters are known for.
        """
        peft, torch = package("peft"), package("torch")
        self.model, self.roleplay = model, roleplay
        network = model.network.model
        count = network.config.get_text_config().num_hidden_layers
        places = list(range(count - max(1, round(layers * count)), count))
        found = {place for name, _ in network.named_modules() if (place := _place(name))}
        if not {(number, name) for number in places for name in MODULES} <= found:
            raise ModelError(
                f"{model.name} lacks some of the layers {', '.join(MODULES)}, which adapters are "
                "made for. Choose a model such as Llama, Qwen or Gemma."
            )
        torch.manual_seed(seed)
        config = peft.LoraConfig(
            r=rank, lora_alpha=rank, target_modules=[*MODULES], layers_to_transform=places
        )
        self._peft = peft.get_peft_model(network, config)
        self._peft.peft_config["default"].base_model_name_or_path = model.name
        self._layers: dict[tuple[int, str], Any] = {}
        for name, module in network.named_modules():
            if (place := _place(name)) and hasattr(module, "lora_A"):
                self._layers[place] = module
        self.parameters = [each for each in network.parameters() if each.requires_grad]

    def log_likelihood(self, example: Example) -> tuple[Any, int]:
        """How likely the scored turns are under each goal, with gradients.

        Returns:
            A tensor [scored turns, goals] in nats; and how many tokens of words were scored.
        """
        torch = package("torch")
        trie, spots = Trie(), list[tuple[list[int], list[int]]]()
        words = 0
        for t in example.scored:
            turns = example.turns[
                self.roleplay.window(example.task, example.turns[: t + 1]) : t + 1
            ]
            answer = self.model.tokenizer.tokenize(example.turns[t].utterance)
            words += len(answer)
            for goal in example.goals:
                prompt = self.model.tokenizer.render(
                    self.roleplay.context(example.task, goal, turns)
                )
                path = trie.paths[trie.add([*prompt, *answer[:-1]])]
                spots.append((path[len(prompt) - 1 :], answer))
        places = sorted({node for nodes, _ in spots for node in nodes})
        rows = {node: row for row, node in enumerate(places)}
        logits = self.model.network.learn(
            np.array([trie.tokens]), np.array([trie.depths]), _ancestors(trie)[None], places
        )
        logprobs = torch.log_softmax(logits.float(), -1)
        table = torch.stack(
            [logprobs[[rows[node] for node in nodes], answer].sum() for nodes, answer in spots]
        )
        return table.reshape(len(example.scored), len(example.goals)), words

    def state(self) -> dict[str, Any]:
        """The adapters' weights now, as tensors of their own."""
        named = self._peft.named_parameters()
        return {name: each.detach().cpu().clone() for name, each in named if each.requires_grad}

    def restore(self, state: dict[str, Any]) -> None:
        """Take weights of `state`."""
        torch = package("torch")
        with torch.no_grad():
            for name, each in self._peft.named_parameters():
                if each.requires_grad:
                    each.copy_(state[name])

    def begin(self, adapter: Adapter) -> None:
        """Begin with an adapter, of the same rank and layers.

        Raises:
            ModelError: It has others.
        """
        torch = package("torch")
        for place, module in self._layers.items():
            own = module.lora_A["default"].weight, module.lora_B["default"].weight
            given = adapter.layers.get(place)
            if given is None or any(
                a.shape != tuple(b.shape) for a, b in zip(given, own, strict=True)
            ):
                raise ModelError(
                    f"The adapter to begin with has rank {adapter.rank} and "
                    f"{len(adapter.layers)} layers, others than asked for. Leave out --rank and "
                    "--layers, or begin with --start none."
                )
            scale = adapter.alpha / adapter.rank
            with torch.no_grad():
                own[0].copy_(torch.from_numpy(given[0]))
                own[1].copy_(torch.from_numpy(given[1] * scale))

    def adapter(self, metadata: dict[str, str]) -> Adapter:
        """The adapters as they are."""
        layers = {
            place: tuple(
                getattr(module, name)["default"].weight.detach().float().cpu().numpy()
                for name in ("lora_A", "lora_B")
            )
            for place, module in sorted(self._layers.items())
        }
        rank = next(iter(layers.values()))[0].shape[0]
        return Adapter(layers, rank, float(rank), metadata)

    def save_peft(self, folder: Any) -> None:
        """Write the adapters as PEFT has them, for other software."""
        self._peft.save_pretrained(folder, save_embedding_layers=False)


def _place(name: str) -> tuple[int, str] | None:
    """Number and name of a layer such as "model.layers.3.mlp.up_proj"."""
    match = re.search(r"\.layers\.(\d+)\.(?:self_attn|mlp)\.(\w+)$", name)
    return (int(match[1]), match[2]) if match else None


def _ancestors(trie: Trie) -> Any:
    """Whether each node sees each other one [nodes, nodes]: itself, and what leads to it."""
    sees = np.eye(len(trie), dtype=bool)
    for node, parent in enumerate(parents(trie)):
        if parent >= 0:
            sees[node] |= sees[parent]
    return sees
