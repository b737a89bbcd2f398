"""Nothing that is loaded is run, and no secret is told."""

from __future__ import annotations

import json
import pickle
import re
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest

from goalscope.base.types import Message, ModelError
from goalscope.models.adapters import read_adapter, shipped
from goalscope.models.chat import ChatTemplate
from goalscope.models.llama.model import embedded_path
from processes import environment

REACH = (
    "''.__class__.__mro__[1].__subclasses__()",
    "raise_exception.__globals__['__builtins__']['__import__']('os').system({run!r})",
    "joiner|attr('__init__')|attr('__globals__')",
    "'{{0.__class__.__init__.__globals__}}'.format(messages)",
    "messages.append(1)",
    "range(10**9)|list",
)


@pytest.mark.parametrize("reach", REACH)
def test_a_chat_template_reaches_nothing(reach: str, tmp_path: Path) -> None:
    mark = tmp_path / "ran"
    reached = reach.format(run=f"touch {mark}")
    chat = "{% for m in messages %}{{ m.content }}{% endfor %}"
    for source in (
        f"{chat}{{{{ {reached} }}}}", f"{{% set x = {reached} %}}{chat}{{{{ x }}}}",
        f"{{% include {reached} %}}", f"{{% import 'os' as os %}}{{{{ {reached} }}}}",
    ):  # fmt: skip
        shown = ""
        with suppress(ModelError):
            shown = str(ChatTemplate(source, "", "").layout([Message("user", "hello")]))
        assert not re.search(r"class|module|builtin|<function|PATH", shown), source
    assert not mark.exists()


class Touches:
    """Makes a file when it is unpickled."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.file,)


@pytest.mark.parametrize(
    "name", ["pytorch_model.bin", "model.safetensors", "custom.py", "torch.zip"]
)
def test_a_model_folder_runs_nothing(name: str, tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    from goalscope.models.torch.model import Transformers
    from test_transformers import tiny

    folder, mark = tiny(tmp_path / "model", "llama"), tmp_path / "ran"
    if name == "custom.py":
        config = json.loads((folder / "config.json").read_text())
        own = dict.fromkeys(["AutoConfig", "AutoModelForCausalLM", "AutoTokenizer"], "custom.Own")
        config |= {"auto_map": own, "model_type": "own", "architectures": ["Own"]}
        (folder / "config.json").write_text(json.dumps(config))
        (folder / name).write_text(f"open({str(mark)!r}, 'w')\n")
    else:
        (folder / "model.safetensors").unlink()
        file = folder / name.replace("torch.zip", "pytorch_model.bin")
        if name == "torch.zip":
            torch.save({"x": Touches(mark)}, file)
        else:
            file.write_bytes(pickle.dumps(Touches(mark)))
    with pytest.raises(ModelError, match="Cannot load"):
        Transformers(folder, device="cpu")
    assert not mark.exists()


TRY_EACH = """
import sys
from pathlib import Path
from goalscope.models.llama.weights import Weights
from goalscope.base.types import ModelError
for file in sys.argv[1:]:
    end = "loaded"
    try:
        weights = Weights(Path(file), vocabulary_only=True)
        weights.chat_tokenizer
        weights.free()
    except ModelError:
        end = "refused"
    print(end, flush=True)
"""


def mutated(data: bytes, number: int, most: int) -> bytes:
    """The bytes with some of the first ones changed; the same number, the same ones."""
    random = np.random.default_rng(number)
    changed = bytearray(data)
    for at in random.integers(4, most, random.integers(1, 6)):
        changed[at] = random.choice([0, 1, 127, 128, 255, random.integers(256)])
    return bytes(changed)


@pytest.mark.parametrize("count", [3, pytest.param(300, marks=pytest.mark.slow)])
def test_a_hostile_model_file_is_refused_or_ends_the_process(
    count: int, tmp_path: Path, figure: Callable[[str], None]
) -> None:
    """llama.cpp itself aborts where a vocabulary contradicts itself; nothing else goes wrong."""
    pytest.importorskip("gguf")
    head = small_gguf(tmp_path / "small")
    left = [tmp_path / f"{number}.gguf" for number in range(count)]
    for number, file in enumerate(left):
        file.write_bytes(mutated(head, number, len(head)))
    ends = Counter[str]()
    while left:
        done = subprocess.run(
            [sys.executable, "-c", TRY_EACH, *map(str, left)], capture_output=True, text=True,
            env=environment(GGML_NO_BACKTRACE="1"), timeout=600, check=False,
        )  # fmt: skip
        ends.update(done.stdout.split())
        left = left[len(done.stdout.split()) :]
        if done.returncode:
            assert done.returncode == -signal.SIGABRT, done.stderr[-500:]
            assert re.search("GGML_ASSERT|terminate called", done.stderr)
            ends["ended"] += 1
            left = left[1:]
    assert ends.total() == count
    assert ends["refused"] > 0
    told = (
        f"{ends['refused']} refused, {ends['loaded']} without harm, {ends['ended']} ended llama.cpp"
    )
    figure(f"{count} broken model files: {told}; 0 ran anything")


def small_gguf(path: Path) -> bytes:
    """A model's vocabulary and facts without its weights."""
    import gguf

    reader = gguf.GGUFReader(embedded_path())
    writer = gguf.GGUFWriter(path, "llama")
    kinds = gguf.GGUFValueType
    for name, field in reader.fields.items():
        if name.startswith("GGUF.") or name == "general.architecture":
            continue
        value, kind = field.contents(), field.types[0]
        if kind == kinds.ARRAY:
            writer.add_array(name, value)
        else:
            writer.add_key_value(name, value, kind)
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.close()
    return path.read_bytes()


@pytest.mark.parametrize("count", [4, pytest.param(60, marks=pytest.mark.slow)])
def test_a_hostile_adapter_is_refused(
    count: int, tmp_path: Path, figure: Callable[[str], None]
) -> None:
    pytest.importorskip("gguf")
    transformers = pytest.importorskip("transformers")
    data, refused = (shipped() or tmp_path).read_bytes(), 0
    config = transformers.AutoConfig.for_model("llama")
    file = tmp_path / "adapter.gguf"
    for number in range(count):
        file.write_bytes(mutated(data[: len(data) // 50], number, 4000) + data[len(data) // 50 :])
        try:
            read_adapter(file, config)
        except ModelError:
            refused += 1
    assert refused > 0
    figure(f"{count} broken adapters: {refused} refused, 0 other errors")


SECRET = "sk-verysecret-0123456789"
MAIN = "from goalscope.cli.main import main; main()"
FORGE = """
import logging
from goalscope.cli import main as cli

def app():
    text = "no\\nERROR:root:forged\\r\\x1b[2J\\u202e"
    try:
        raise ValueError(text)
    except ValueError:
        logging.getLogger("a").exception("a round of %s failed", text)

cli.app = app
cli.main()
"""


def test_no_text_forges_a_line_of_the_log() -> None:
    done = subprocess.run(
        [sys.executable, "-c", FORGE], env=environment(), capture_output=True, check=True
    )
    lines = done.stderr.decode().replace("\r", "\n\r").split("\n")
    assert lines[0].startswith("ERROR:a:a round of no")
    assert all(line.startswith("    ") or not line for line in lines[1:])
    assert sum("ERROR:root:forged" in line for line in lines) >= 2
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f\u202e]", done.stderr.decode())


def test_an_error_is_one_line_at_the_terminal(tmp_path: Path) -> None:
    for name in ("x\ny\r\x1b[2J", "\u202ex.toml"):
        command = [sys.executable, "-c", MAIN, "replay", name, "--store", str(tmp_path / "e")]
        done = subprocess.run(command, env=environment(), capture_output=True, check=False)
        told = done.stderr.decode()
        assert done.returncode == 2
        assert told.startswith("Error: ")
        assert told.count("\n") == 1
        assert told.strip().isprintable()


class Echo(BaseHTTPRequestHandler):
    """A model server that quotes the key in whatever it says."""

    def do_GET(self) -> None:
        said = json.dumps({"error": {"message": f"No: {dict(self.headers)}"}}).encode()
        self.server.heard.append(self.headers["Authorization"])  # type: ignore[attr-defined]
        self.send_response(500 if len(self.path) % 2 else 400)
        self.send_header("Content-Length", str(len(said)))
        self.end_headers()
        self.wfile.write(said)

    do_POST = do_GET

    def log_message(self, *_: object) -> None:
        pass


def test_a_key_and_a_password_are_told_nowhere(
    tmp_path: Path, figure: Callable[[str], None]
) -> None:
    row = {"id": "1", "task": "t", "goals": ["a"], "turns": [{"query": "q", "utterance": "u"}]}
    (tmp_path / "in.jsonl").write_text(json.dumps(row))
    store = ["--store", str(tmp_path / "e.db")]
    base = f"postgresql://someone:{SECRET}@127.0.0.1:9/episodes"
    with ThreadingHTTPServer(("127.0.0.1", 0), Echo) as echo, ExitStack() as after:
        echo.heard = []  # type: ignore[attr-defined]
        Thread(target=echo.serve_forever, daemon=True).start()
        after.callback(echo.shutdown)
        model = ["--model", f"http://127.0.0.1:{echo.server_port}/v1#m"]
        commands = [
            ["run", "grocery", "--profile", "chocolate-cake", *model, *store],
            ["infer", str(tmp_path / "in.jsonl"), "--out", str(tmp_path / "o"), *model],
            ["episodes", "--store", base], ["doctor", *model, "--store", base, "--json"],
            ["serve", "--host", "not.here.invalid", "--key", SECRET],
        ]  # fmt: skip
        env = environment(
            GOALSCOPE_API_KEY=SECRET, GOALSCOPE_PATIENCE="2", XDG_DATA_HOME=str(tmp_path)
        )
        run = [sys.executable, "-X", "dev", "-W", "ignore", "-c", MAIN]
        started = [
            subprocess.Popen(
                [*run, *each], env=env, stdout=-1, stderr=subprocess.STDOUT, cwd=tmp_path
            )
            for each in commands
        ]
        told = [process.communicate(timeout=600)[0].decode(errors="replace") for process in started]
    assert all(process.returncode for process in started)
    assert f"Bearer {SECRET}" in echo.heard  # type: ignore[attr-defined]
    kept = [file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()]
    for text in (*told, *(each.decode(errors="replace") for each in kept)):
        assert SECRET[:12] not in text
    assert all(told)
    figure(f"{len(commands)} commands, {len(kept)} files: told in none")
