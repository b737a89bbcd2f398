"""The thin layer over PyTorch and Transformers: a model that runs on rows of tokens."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from functools import lru_cache, partial
from inspect import signature
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from goalscope.base.arrays import Flags
from goalscope.base.optional_packages import package
from goalscope.base.types import ModelError
from goalscope.models.adapters import Adapter

_VOCABULARY_PART = 1 << 14  # entries of the output layer that are widened at once
_ATTENTION = ("q_proj", "k_proj", "v_proj", "o_proj")

Ints = npt.NDArray[np.int64]


class Network:
    """A Hugging Face causal language model in memory.

    Attributes:
        model: The model.
        device: Where it is.
        window: How many tokens back its sliding layers look, None if all its layers see all.
        token_numbers: How many numbers the keys and values of one token are; 0 before any ran.
    """

    def __init__(self, source: str | Path, device: str | None, dtype: str | None) -> None:
        """Load a model from a folder, a GGUF file or the Hugging Face hub.

        Raises:
            ModelError: It is missing or broken, or cannot be put there, or PyTorch is missing.
        """
        torch = self._torch = package("torch")
        usual = "mps" if torch.backends.mps.is_available() else "cpu"
        usual = "cuda" if torch.cuda.is_available() else usual
        self.device: Any = torch.device(device or usual)
        dtype = dtype or ("float32" if self.device.type == "cpu" else "bfloat16")
        self.model = _load(source, self.device, getattr(torch, dtype))
        inputs = signature(self.model.forward).parameters
        # The second name is that before Transformers 5.24.
        self._cache = "cache" if "cache" in inputs else "past_key_values"
        config = self.model.config.get_text_config()
        self.vocab_size: int = config.vocab_size
        self.trained_on: int | None = getattr(config, "max_position_embeddings", None)
        self._layers, self.window = _attention(config)
        self._shapes: list[tuple[int, int]] = []
        self.token_numbers = 0

    @property
    def dtype(self) -> Any:
        """Type of the weights and of all that is computed, a `torch.dtype`."""
        return self.model.dtype

    @property
    def takes_trees(self) -> bool:
        """Whether all layers are such that an attention mask could say what each token sees."""
        return set(self._layers) <= {"full_attention", "sliding_attention"}

    def adapt(self, adapter: Adapter) -> None:
        """Let layers add what a LoRA adapter says, in 32 bits whatever the type of the weights.

        Raises:
            ModelError: They have no such layer, or one of another shape.
        """
        torch = self._torch
        modules: dict[str, Any] = dict(self.model.base_model.named_modules())
        for (number, name), factors in adapter.layers.items():
            block = "self_attn" if name in _ATTENTION else "mlp"
            a, b = (torch.from_numpy(each).to(self.device) for each in factors)
            shape = (b.shape[0], a.shape[1])
            layer = modules.get(f"layers.{number}.{block}.{name}")
            size = None if layer is None else tuple(layer.weight.shape)
            if layer is None or size != shape or a.shape[0] != b.shape[1]:
                own = "none" if size is None else f"one of {' x '.join(map(str, size))}"
                raise ModelError(
                    f"The adapter changes a {name} of {' x '.join(map(str, shape))} weights "
                    f"in layer {number}, where the model has {own}. Use the model that it was "
                    "fitted on, or fit an adapter for this model with `goalscope fit`."
                )
            layer.register_forward_hook(partial(_added, a, b * (adapter.alpha / adapter.rank)))

    def read(self, tokens: Sequence[int], places: Sequence[int]) -> Any:
        """Next-token logits [places, vocabulary] at places of a text, by nothing but the model."""
        with self._torch.inference_mode():
            ids = self._torch.tensor([tokens], device=self.device)
            return self._logits(places, input_ids=ids, use_cache=False)

    def run(
        self, ids: Ints, depths: Ints, sees: Flags, known: Any, places: Sequence[int]
    ) -> tuple[Any, Any]:
        """Run rows of tokens, each of which attends to chosen others.

        Args:
            ids: The tokens [rows, tokens].
            depths: The position of each in its text [rows, tokens].
            sees: Which known and which new tokens each looks at [rows, tokens, known + tokens].
            known: Keys and values [rows, known, numbers] of the tokens from position 0 on, or None.
            places: Row * tokens + column of the tokens whose next-token logits are computed.

        Returns:
            Logits [places, vocabulary]; keys and values [rows, tokens, numbers] of the tokens.
        """
        torch = self._torch
        with torch.inference_mode():
            cache = _extension()(known, self._shapes)
            logits = self._logits(
                places,
                input_ids=torch.from_numpy(ids).to(self.device),
                position_ids=torch.from_numpy(depths).to(self.device),
                attention_mask=self._masks(depths, sees),
                use_cache=True,
                **{self._cache: cache},
            )
            self._shapes, values = cache.flat()
        self.token_numbers = values.shape[-1]
        return logits, values

    def learn(self, ids: Ints, depths: Ints, sees: Flags, places: Sequence[int]) -> Any:
        """Next-token logits [places, vocabulary] of rows of tokens, with gradients; see `run`.

        Products are of 16-bit numbers where the processor has instructions for them; those of an
        output layer of 16 bits are exact.
        """
        torch = self._torch
        narrow = self.device.type == "cpu" and multiplies_bfloat16()
        with torch.autocast(self.device.type, torch.bfloat16, enabled=narrow):
            return self._logits(
                places,
                input_ids=torch.from_numpy(ids).to(self.device),
                position_ids=torch.from_numpy(depths).to(self.device),
                attention_mask=self._masks(depths, sees),
                use_cache=False,
            )

    def is_out_of_memory(self, error: BaseException) -> bool:
        """Whether an error says that the memory is too small."""
        if isinstance(error, (MemoryError, self._torch.OutOfMemoryError)):
            return True
        phrases = ("out of memory", "not enough memory", "can't allocate memory")
        return isinstance(error, RuntimeError) and any(each in str(error) for each in phrases)

    def free_unused(self) -> None:
        """Give back what PyTorch holds in reserve."""
        if self.device.type == "cuda":
            self._torch.cuda.empty_cache()

    def _masks(self, depths: Ints, sees: Flags) -> Any:
        """What attention adds [rows, 1, tokens, known + tokens]; one for each kind of layer."""
        rows, width = depths.shape
        known = sees.shape[2] - width
        kinds = {"full_attention": sees}
        if self.window is not None:
            before = np.tile(np.arange(known, dtype=np.int64), (rows, 1))
            away = depths[:, :, None] - np.concatenate([before, depths], axis=1)[:, None]
            kinds["sliding_attention"] = sees & (away < self.window)
        masks = [self._mask(kinds[layer]) for layer in self._layers]
        return masks[0] if len(masks) == 1 else dict(zip(self._layers, masks, strict=True))

    def _mask(self, sees: Flags) -> Any:
        hidden = self._torch.from_numpy(~sees[:, None]).to(self.device)
        mask = self._torch.zeros(hidden.shape, dtype=self.dtype, device=self.device)
        return mask.masked_fill_(hidden, self._torch.finfo(self.dtype).min)

    def _logits(self, places: Sequence[int], **inputs: Any) -> Any:
        """Next-token logits [places, vocabulary]; the output layer meets no other token."""
        head = self.model.get_output_embeddings()

        def select(_: Any, hidden: tuple[Any]) -> Any:
            return hidden[0].flatten(0, -2)[list(places)][None]

        hooks = [head.register_forward_pre_hook(select)]
        if type(head) is self._torch.nn.Linear and self.dtype != self._torch.float32:
            hooks.append(head.register_forward_hook(self._in_float32))
        try:
            return self.model(**inputs).logits[0]
        finally:
            for hook in hooks:
                hook.remove()

    def _in_float32(self, head: Any, hidden: tuple[Any], _: Any) -> Any:
        """An output layer's logits, not rounded to a type in which they are an eighth apart."""
        torch = self._torch
        precision = torch.get_float32_matmul_precision()
        torch.set_float32_matmul_precision("high")  # exact: TF32 holds all 16-bit numbers
        try:
            states = hidden[0].float()
            with torch.autocast(self.device.type, enabled=False):
                parts = [states @ part.float().T for part in head.weight.split(_VOCABULARY_PART)]
        finally:
            torch.set_float32_matmul_precision(precision)
        logits = torch.cat(parts, -1)
        return logits if head.bias is None else logits + head.bias


def multiplies_bfloat16() -> bool:
    """Whether the processor has instructions for products of 16-bit numbers."""
    known: dict[str, Any] = getattr(package("torch").cpu, "get_capabilities", dict[str, Any])()
    return any(known.get(each, False) for each in ("avx512_bf16", "amx_bf16"))


def _added(a: Any, b: Any, _: Any, inputs: tuple[Any, ...], output: Any) -> Any:
    return output + (inputs[0].float() @ a.T @ b.T).to(output.dtype)


@lru_cache(maxsize=1)
def _extension() -> Any:
    torch = package("torch")

    class Extension(package("transformers").DynamicCache):
        """Known keys and values, which stay as they are, and those of the tokens being run."""

        def __init__(self, known: Any, shapes: Sequence[tuple[int, int]]) -> None:
            """Begin with `known` [rows, tokens, numbers], flat; shapes are heads, head size."""
            # The package is not known to the type checker.
            super().__init__()  # pyright: ignore[reportUnknownMemberType]
            self._length: int = 0 if known is None else known.shape[1]
            self._new: dict[int, tuple[Any, Any]] = {}
            self._known: list[Any] = []
            if known is not None:
                parts = known.split([heads * size for heads, size in shapes], -1)
                self._known = [
                    part.unflatten(-1, shape).transpose(1, 2)
                    for part, shape in zip(parts, shapes, strict=True)
                ]

        def update(self, keys: Any, values: Any, layer: int, *_: Any, **__: Any) -> Any:
            at = 2 * len(self._new)
            self._new[layer] = keys, values
            if not self._known:
                return keys, values
            before = self._known[at : at + 2]
            return tuple(torch.cat(pair, -2) for pair in zip(before, (keys, values), strict=True))

        def get_seq_length(self, *_: Any) -> int:
            return self._length

        def flat(self) -> tuple[list[tuple[int, int]], Any]:
            """The shapes, and the new keys and values [rows, tokens, numbers], flat."""
            parts = list(chain.from_iterable(self._new.values()))
            shapes = [(part.shape[1], part.shape[3]) for part in parts]
            return shapes, torch.cat([part.transpose(1, 2).flatten(2) for part in parts], -1)

    return Extension


def _load(source: str | Path, device: Any, dtype: Any) -> Any:
    transformers = package("transformers")
    path = Path(os.path.expanduser(source))
    options: dict[str, Any] = {"dtype": dtype, "trust_remote_code": False}
    name = str(path) if path.exists() else str(source)
    if path.suffix == ".gguf":
        name, options["gguf_file"] = str(path.parent), path.name
    transformers.utils.logging.disable_progress_bar()
    transformers.utils.logging.set_verbosity_error()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FutureWarning)  # of Transformers to itself
            model = transformers.AutoModelForCausalLM.from_pretrained(name, **options)
        return model.to(device).eval()
    except Exception as error:  # each file format raises others
        reason = str(error).strip().partition("\n")[0]
        raise ModelError(
            f"Cannot load {source} on {device} ({reason}). Check that it is a complete causal "
            "language model and that there is enough memory."
        ) from None


def _attention(config: Any) -> tuple[list[str], int | None]:
    """The kinds of layers that a model has, and how far back those look that slide."""
    window: int | None = getattr(config, "sliding_window", None)
    kinds: list[str] | None = getattr(config, "layer_types", None)
    if kinds is None:
        slides = window is not None and getattr(config, "use_sliding_window", True)
        kinds = ["sliding_attention" if slides else "full_attention"]
    return sorted(set(kinds)), window if "sliding_attention" in kinds else None
