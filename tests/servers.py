"""Real model servers on 127.0.0.1, and a model file with exact weights for them."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from converting import convert
from goalscope.models.llama.model import embedded_path
from goalscope.models.opening import ModelSet, open_model

CONTEXT = 1024
"""Tokens that the servers read."""

_START = 120  # seconds


@contextmanager
def started(command: list[str], port: int, log: Path) -> Iterator[str]:
    """The address of a server while it runs; its output goes to `log`."""
    address = f"http://127.0.0.1:{port}/v1"
    with log.open("wb") as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
        try:
            end = time.monotonic() + _START
            while not _answers(address + "/models"):
                if process.poll() is not None or time.monotonic() > end:
                    tail = log.read_text(errors="replace")[-2000:]
                    raise RuntimeError(f"{' '.join(command)} does not start:\n{tail}")
                time.sleep(0.1)
            yield address
        finally:
            process.terminate()
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@pytest.fixture(scope="session")
def exact_gguf(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The embedded model with float32 weights, so that all engines agree closely."""
    path = tmp_path_factory.mktemp("exact") / "exact.gguf"
    convert(embedded_path(), path, "F32")
    yield path
    path.unlink()


@pytest.fixture(scope="session")
def llama_server_address(
    exact_gguf: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[str]:
    """Address of llama.cpp's own server."""
    pytest.importorskip("xllamacpp", reason="needs xllamacpp, llama.cpp's server as a package")
    port = free_port()
    command = [sys.executable, __file__, str(exact_gguf), str(port)]
    with started(command, port, tmp_path_factory.mktemp("llama_server") / "log") as address:
        yield address


@pytest.fixture(scope="session")
def llama_server(llama_server_address: str) -> Iterator[ModelSet]:
    """The embedded model's weights behind llama.cpp's own server, to write and to score."""
    model = open_model(llama_server_address, tokenizer=embedded_path())
    yield model
    model.close()


def free_port() -> int:
    """A port that nobody listens at."""
    with socket.create_server(("127.0.0.1", 0)) as door:
        return door.getsockname()[1]


def _answers(address: str) -> bool:
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(address, timeout=5) as answer:
            return answer.status == 200
    except (OSError, urllib.error.URLError):
        return False


def _serve(path: str, port: int) -> None:
    """Run llama.cpp's own server until this process is ended."""
    import xllamacpp  # pyright: ignore[reportMissingImports]

    params = xllamacpp.CommonParams()
    params.model.path = path
    params.n_ctx, params.n_parallel = CONTEXT, 1
    params.cache_type_k = params.cache_type_v = xllamacpp.ggml_type.GGML_TYPE_F32
    params.flash_attn_type = xllamacpp.llama_flash_attn_type.LLAMA_FLASH_ATTN_TYPE_DISABLED
    params.port = port  # of 127.0.0.1
    server = xllamacpp.Server(params)
    while server:
        time.sleep(60)


if __name__ == "__main__":
    _serve(sys.argv[1], int(sys.argv[2]))
