"""A model with trainable LoRA adapters, and its log-likelihood of words."""

from __future__ import annotations

import re
import warnings
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shutil import copymode
from typing import Any

import numpy as np

from goalscope.base.optional_packages import package
from goalscope.base.types import Goal, GoalscopeError, ModelError, Turn
from goalscope.belief.likelihood import RolePlay
from goalscope.models.adapters import ARCHITECTURES, MODULES, Adapter
from goalscope.models.llama.trie import Trie
from goalscope.models.torch.model import Transformers

_TREE = 700  # tokens from which a tree takes no further turn, as attention is quadratic


@dataclass(frozen=True, slots=True)
class Example:
    """The beginning of a dialogue.

    Attributes:
        task: The assistant's task.
        goals: `UNSPECIFIED`, the true ones, and wrong ones.
        turns: The turns.
        truths: [T] index of the true goal after each turn.
        negatives: Number of all wrong goals of the dialogue, from which some were drawn.
        compared: Whether the similarity of words and goals counts as evidence.
        group: Group of the dialogue.
    """

    task: str
    goals: Sequence[Goal]
    turns: Sequence[Turn]
    truths: Sequence[int]
    negatives: int
    compared: bool
    group: str

    @property
    def true(self) -> frozenset[int]:
        """Indices of the goals that are true at some turn."""
        return frozenset(self.truths)


class Learner:
    """A Hugging Face model with trainable LoRA adapters.

    Attributes:
        model: The model.
        roleplay: Makes its prompts.
        parameters: The trained parameters.
    """

    def __init__(
        self,
        model: Transformers,
        roleplay: RolePlay,
        *,
        rank: int,
        layers: float,
        seed: int,
        start: Adapter | None = None,
    ) -> None:
        """Add adapters to the model.

        Args:
            model: The model, which is modified.
            roleplay: Makes its prompts.
            rank: Rank of the adapters.
            layers: Share of the model's layers to adapt, counted from the last.
            seed: Seed of the initial weights, which change nothing yet.
            start: An adapter to start from, whose rank and layers are kept.

        Raises:
            ModelError: Some layers cannot be adapted, or differ from those of `start`.
        """
        peft, torch = package("peft"), package("torch")
        self.model, self.roleplay = model, roleplay
        network = model.network.model
        if network.config.model_type not in ARCHITECTURES:
            raise ModelError(
                f"{model.name} is a {network.config.model_type} model. Adapters are supported "
                f"for {', '.join(ARCHITECTURES)} models."
            )
        count = network.config.num_hidden_layers
        numbers = list(range(count - max(1, round(layers * count)), count))
        if start is not None:
            rank, numbers = start.rank, sorted({number for number, _ in start.layers})
        wanted = {(number, name) for number in numbers for name in MODULES}
        found = {place for name, _ in network.named_modules() if (place := _place(name))}
        if start is not None and not set(start.layers) == wanted <= found:
            raise ModelError(
                f"{model.name} and the adapter to start from have different layers. Use "
                "--start none."
            )
        if not wanted <= found:
            raise ModelError(
                f"{model.name} lacks some of the layers {', '.join(MODULES)}, which adapters "
                "need. Choose another model."
            )
        torch.manual_seed(seed)
        config = peft.LoraConfig(
            r=rank, lora_alpha=rank, target_modules=[*MODULES], layers_to_transform=numbers
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FutureWarning)  # of Transformers to PEFT
            self._peft = peft.get_peft_model(network, config)
        self._layers: dict[tuple[int, str], tuple[Any, Any]] = {}
        for name, module in network.named_modules():
            if (place := _place(name)) and hasattr(module, "lora_A"):
                pair = module.lora_A["default"].weight, module.lora_B["default"].weight
                self._layers[place] = pair
        self.parameters = [each for each in network.parameters() if each.requires_grad]
        if start is not None:
            self._begin(start)

    def log_likelihood(self, example: Example) -> Any:
        """[T, G] log-likelihood of each turn's words under each goal, nats, with gradients."""
        torch = package("torch")
        scores: list[Any] = []
        trie, spots = Trie(), list[tuple[list[int], list[int]]]()
        for t, turn in enumerate(example.turns):
            start = self.roleplay.window(example.task, example.turns[: t + 1])
            read = example.turns[start : t + 1]
            answer = self.model.tokenizer.tokenize(turn.utterance)
            for goal in example.goals:
                context = self.roleplay.context(example.task, goal, read)
                prompt = self.model.tokenizer.render(context)
                path = trie.paths[trie.add([*prompt, *answer[:-1]])]
                spots.append((path[len(prompt) - 1 :], answer))
            if len(trie) >= _TREE or t == len(example.turns) - 1:
                scores += self.answers(trie, spots)
                trie, spots = Trie(), []
        return torch.stack(scores).reshape(len(example.turns), len(example.goals))

    def answers(self, trie: Trie, spots: Sequence[tuple[list[int], list[int]]]) -> list[Any]:
        """The log-likelihood of each answer, nats, given the nodes before its tokens."""
        nodes = [node for each, _ in spots for node in each]
        logprobs, _ = self.at(trie, nodes, [token for _, answer in spots for token in answer])
        return [each.sum() for each in logprobs.split([len(answer) for _, answer in spots])]

    def at(self, trie: Trie, nodes: Sequence[int], tokens: Sequence[int]) -> tuple[Any, Any]:
        """[N] log-probabilities of tokens after nodes, nats, and whether each is the likeliest."""
        torch = package("torch")
        places = sorted({*nodes})
        row_of = {node: row for row, node in enumerate(places)}
        logits = self.model.network.learn(
            np.array([trie.tokens]), np.array([trie.depths]), _ancestors(trie)[None], places
        )
        device = self.model.network.device
        rows = torch.tensor([row_of[node] for node in nodes], device=device)
        wanted = torch.tensor([*tokens], device=device)
        logprobs = torch.log_softmax(logits.float(), -1)
        return logprobs[rows, wanted], logprobs.argmax(-1)[rows] == wanted

    @contextmanager
    def enough_memory(self) -> Generator[None]:
        """A context in which running out of memory raises a `GoalscopeError`."""
        try:
            yield
        except (RuntimeError, MemoryError) as error:
            if not self.model.network.is_out_of_memory(error):
                raise
            raise GoalscopeError(
                "Out of memory: a dialogue is too long. Close other programs and run the "
                "same command to resume, or use --device cpu or a smaller model with another "
                "--out."
            ) from None

    def tokens(self, example: Example) -> int:
        """Number of tokens in the person's words."""
        return sum(len(self.model.tokenizer.tokenize(turn.utterance)) for turn in example.turns)

    def state(self) -> dict[str, Any]:
        """A copy of the adapters' weights."""
        named = self._peft.named_parameters()
        return {name: each.detach().cpu().clone() for name, each in named if each.requires_grad}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore the weights of an earlier `state`."""
        with package("torch").no_grad():
            for name, each in self._peft.named_parameters():
                if each.requires_grad:
                    each.copy_(state[name])

    def adapter(self, metadata: dict[str, str]) -> Adapter:
        """The adapters with their current weights."""
        layers = {
            place: (a.detach().float().cpu().numpy(), b.detach().float().cpu().numpy())
            for place, (a, b) in sorted(self._layers.items())
        }
        rank = next(iter(layers.values()))[0].shape[0]
        return Adapter(layers, rank, float(rank), metadata)

    def save_peft(self, folder: Path, base: str) -> None:
        """Write the adapters in the format of PEFT, for other software.

        Raises:
            OSError: The folder cannot be written.
        """
        self._peft.peft_config["default"].base_model_name_or_path = base
        try:
            self._peft.save_pretrained(folder, save_embedding_layers=False)
        except package("safetensors").SafetensorError as error:
            raise OSError(str(error)) from None
        copymode(folder / "adapter_config.json", folder / "adapter_model.safetensors")

    def _begin(self, adapter: Adapter) -> None:
        torch = package("torch")
        for place, weights in self._layers.items():
            a, b = (torch.from_numpy(each) for each in adapter.layers[place])
            for own, given in zip(weights, (a, b * adapter.alpha / adapter.rank), strict=True):
                if own.shape != given.shape:
                    raise ModelError(
                        "The adapter to start from is for a model of another size than "
                        f"{self.model.name}. Use --start none."
                    )
                with torch.no_grad():
                    own.copy_(given)


def _place(name: str) -> tuple[int, str] | None:
    """The number and name of a layer such as "model.layers.3.mlp.up_proj"."""
    match = re.search(r"\.layers\.(\d+)\.(?:self_attn|mlp)\.(\w+)$", name)
    return (int(match[1]), match[2]) if match else None


def _ancestors(trie: Trie) -> Any:
    """[nodes, nodes] whether each node attends to another: itself and its ancestors."""
    sees = np.eye(len(trie), dtype=bool)
    for node, parent in enumerate(trie.parents):
        if parent >= 0:
            sees[node] |= sees[parent]
    return sees
