"""Time one belief update of the Transformers backend, at round 10 of a dialogue, mostly on a GPU.

Run `python benchmarks/gpu.py --json gpu.json` on a machine with a GPU (`--tiny --device cpu` tries
the script itself). The model has the shape of Llama 3 8B and random weights, made on the spot;
`--model FOLDER` adds a real one. For each layout of the prompt and number of goals it prints:

* warm: the round's scores, with what round 9 left in the cache;
* cold: the same with an empty cache;
* alone: the whole transcript again for each goal (timed on at most 20 goals, and scaled);
* floor: as many tokens as warm had to compute, at the best speed that plain batches reach here.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import tokenizers
import torch
import transformers

from goalscope.models.scoring import Pair
from goalscope.models.torch import network as torch_network
from goalscope.models.torch.model import Transformers

ROUND = 10
SYSTEM, QUERY, ANSWER, GOAL, MARKUP = 60, 30, 20, 20, 5  # tokens
PLAIN = ((1, 256), (1, 512), (1, 1024), (1, 2048), (1, 4096), (4, 1024), (16, 256), (8, 1024))
LLAMA_8B = {
    "vocab_size": 128256,
    "hidden_size": 4096,
    "intermediate_size": 14336,
    "num_hidden_layers": 32,
    "num_attention_heads": 32,
    "num_key_value_heads": 8,
    "max_position_embeddings": 8192,
    "rope_theta": 500000.0,
}
TINY = {
    **LLAMA_8B,
    "vocab_size": 1024,
    "hidden_size": 64,
    "intermediate_size": 128,
    "num_hidden_layers": 2,
    "num_attention_heads": 4,
    "num_key_value_heads": 2,
}


def main() -> None:
    """Print the table and write it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--goals", type=int, nargs="+", default=[20, 100, 500])
    parser.add_argument("--device", default=None)
    parser.add_argument("--tiny", action="store_true", help="a tiny model instead of 8B")
    parser.add_argument("--model", default=None, help="folder of a real model, timed too")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", type=Path, default=None)
    arguments = parser.parse_args()
    rows: list[dict[str, Any]] = []
    sources = [lambda: random_model(TINY if arguments.tiny else LLAMA_8B, arguments.device)]
    if arguments.model:
        sources.append(lambda: Transformers(arguments.model, device=arguments.device))
    for source in sources:
        model = source()
        print(f"{model.describe()}, torch {torch.__version__}, {card(model)}")
        report(model, arguments.goals, arguments.repeats, rows)
        model.close()
        del model
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1))


def report(model: Transformers, goals: list[int], repeats: int, rows: list[dict[str, Any]]) -> None:
    """Print the rows of one model."""
    speed, shape = plain_speed(model, repeats)
    print(f"plain batches: {speed:,.0f} tokens/s at best ({shape[0]} x {shape[1]})")
    print(f"{'layout':10} {'goals':>6} {'tokens':>7} {'warm s':>8} {'cold s':>8} {'alone s':>8} "
          f"{'floor s':>8} {'alone/warm':>11} {'warm/floor':>11} {'memory GB':>10}")  # fmt: skip
    for layout in ("goal-last", "goal-first"):
        for count in goals:
            before, now = (dialogue(model, layout, count, r) for r in (ROUND - 1, ROUND))
            warm, cold = [], []
            for _ in range(repeats):
                model.clear_cache()
                cold.append(seconds(model, lambda: model.score(now)))  # noqa: B023
                model.clear_cache()
                model.score(before)
                start = model.tokens_decoded
                warm.append(seconds(model, lambda: model.score(now)))  # noqa: B023
            tokens = model.tokens_decoded - start
            some = now[:20]
            alone = seconds(model, lambda: one_by_one(model, some)) * count / len(some)  # noqa: B023
            row = {
                "model": model.describe(),
                "card": card(model),
                "layout": layout,
                "goals": count,
                "tokens": tokens,
                "warm": min(warm),
                "cold": min(cold),
                "alone": alone,
                "floor": tokens / speed,
                "memory": memory(model),
            }
            rows.append(row)
            print(f"{layout:10} {count:6} {tokens:7} {min(warm):8.3f} {min(cold):8.3f} "
                  f"{alone:8.2f} {row['floor']:8.3f} {alone / min(warm):11.1f} "
                  f"{min(warm) / row['floor']:11.2f} {row['memory']:10.1f}",
                  flush=True)  # fmt: skip


def dialogue(model: Transformers, layout: str, goals: int, rounds: int) -> list[Pair]:
    """Random tokens in the shape of a round's prompts and the person's reply, one pair a goal."""
    random = np.random.default_rng(0)
    size = model.network.vocab_size

    def some(count: int) -> list[int]:
        return random.integers(0, size, count).tolist()

    system = some(SYSTEM)
    wants = [some(GOAL) for _ in range(goals)]
    turns = [(some(QUERY + MARKUP), some(MARKUP), some(ANSWER)) for _ in range(ROUND)]
    past = [token for turn in turns[: rounds - 1] for part in turn for token in part]
    query, markup, answer = turns[rounds - 1]
    if layout == "goal-last":
        return [Pair([*system, *past, *query, *want, *markup], answer) for want in wants]
    return [Pair([*system, *want, *past, *query, *markup], answer) for want in wants]


def one_by_one(model: Transformers, pairs: list[Pair]) -> None:
    """Score each pair from nothing, by one plain forward call."""
    for prompt, answer, _ in pairs:
        places = range(len(prompt) - 1, len(prompt) + len(answer) - 1)
        logits = model.network.read([*prompt, *answer[:-1]], places)
        logits.float().log_softmax(-1)[range(len(answer)), answer].cpu()


def plain_speed(model: Transformers, repeats: int) -> tuple[float, tuple[int, int]]:
    """Most tokens per second over some shapes of a batch, and the best shape."""
    best = (0.0, (0, 0))
    most = 512 if model.network.device.type == "cpu" else 8192
    for rows, width in PLAIN:
        if rows * width > most:
            continue
        ids = torch.randint(0, model.network.vocab_size, (rows, width))
        ids = ids.to(model.network.device)

        def forward(ids: Any = ids) -> None:
            with torch.inference_mode():
                model.network.model(input_ids=ids, use_cache=False, logits_to_keep=1)

        forward()
        time_ = min(seconds(model, forward) for _ in range(repeats))
        best = max(best, (rows * width / time_, (rows, width)))
    return best


def random_model(shape: dict[str, Any], device: str | None) -> Transformers:
    """A Llama with random weights, made where it will run."""
    device = device or ("cuda" if torch.cuda.is_available() else "cpu")
    dtype = torch.float32 if device == "cpu" else torch.bfloat16

    def load(*_: object) -> Any:
        torch.manual_seed(0)
        with torch.device(device):
            config = transformers.LlamaConfig(**shape)
            return transformers.AutoModelForCausalLM.from_config(config, dtype=dtype).eval()

    torch_network._load = load
    with tempfile.TemporaryDirectory(suffix="-random-llama") as folder:
        words = tokenizers.Tokenizer(tokenizers.models.WordLevel({"<s>": 0, "</s>": 1}, "<s>"))
        words.save(str(Path(folder, "tokenizer.json")))
        template = "{% for m in messages %}{{ m.content }}</s>{% endfor %}"
        settings = {"chat_template": template, "eos_token": "</s>"}
        Path(folder, "tokenizer_config.json").write_text(json.dumps(settings))
        return Transformers(folder, device=device)


def seconds(model: Transformers, work: Callable[[], object]) -> float:
    """Time that `work` takes."""
    wait(model)
    start = time.perf_counter()
    work()
    wait(model)
    return time.perf_counter() - start


def wait(model: Transformers) -> None:
    """Until the device has nothing left to do."""
    if model.network.device.type == "cuda":
        torch.cuda.synchronize()


def memory(model: Transformers) -> float:
    """Most GPU memory taken so far, GB."""
    return torch.cuda.max_memory_allocated() / 1e9 if model.network.device.type == "cuda" else 0.0


def card(model: Transformers) -> str:
    """What it runs on."""
    device = model.network.device
    return torch.cuda.get_device_name(device) if device.type == "cuda" else device.type


if __name__ == "__main__":
    main()
