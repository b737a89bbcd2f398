"""Fetching models: the real client of the hub, against a server that stands for the hub."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

pytest.importorskip("huggingface_hub")

COMMIT = "0123456789abcdef0123456789abcdef01234567"
FILES = {
    "owner/one": {"README.md": b"hello", "model.gguf": b"GGUF" + bytes(5000)},
    "owner/two": {"a.gguf": b"GGUF a", "b.gguf": b"GGUF b"},
    "owner/none": {"README.md": b"hello"},
}


class Hub(BaseHTTPRequestHandler):
    """As much of the hub as its client needs to list and to fetch files."""

    def do_GET(self) -> None:
        self.answer(body=True)

    def do_HEAD(self) -> None:
        self.answer(body=False)

    def answer(self, *, body: bool) -> None:
        path = unquote(urlsplit(self.path).path).strip("/").split("/")
        if path[:2] == ["api", "models"]:
            files = FILES.get("/".join(path[2:4]))
            rows = [
                {"type": "file", "path": name, "size": len(data), "oid": "0" * 40}
                for name, data in (files or {}).items()
            ]
            listing = rows if "tree" in path else {"id": "/".join(path[2:4]), "sha": COMMIT,
                "siblings": [{"rfilename": row["path"]} for row in rows]}  # fmt: skip
            data = json.dumps(listing).encode() if files else b"{}"
            self.send(200 if files else 404, data, body=body, code="" if files else "RepoNotFound")
            return
        files = FILES.get("/".join(path[:2]))
        name = "/".join(path[4:])
        if files is None:
            self.send(404, b"{}", body=body, code="RepoNotFound")
        elif name not in files:
            self.send(404, b"{}", body=body, code="EntryNotFound")
        else:
            self.send(200, files[name], body=body)

    def send(self, status: int, data: bytes, *, body: bool, code: str = "") -> None:
        self.send_response(status)
        self.send_header("Content-Length", str(len(data)))
        self.send_header("ETag", f'"{hashlib.sha1(data).hexdigest()}"')
        self.send_header("X-Repo-Commit", COMMIT)
        self.send_header("Content-Type", "application/json" if status != 200 else "binary/data")
        if code:
            self.send_header("X-Error-Code", code)
        self.end_headers()
        if body:
            self.wfile.write(data)

    def log_message(self, *_: object) -> None: ...


@pytest.fixture(scope="module")
def hub() -> Iterator[str]:
    """Address of the hub."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), Hub)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


def goalscope(home: Path, hub: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    source = str(Path(__file__).parents[1] / "src")
    environment = {
        **os.environ,
        "PYTHONPATH": source,
        "HF_HOME": str(home),
        "HF_ENDPOINT": hub,
        "HF_HUB_DISABLE_XET": "1",
        "HF_HUB_ETAG_TIMEOUT": "2",
    }
    return subprocess.run(
        [sys.executable, "-c", "from goalscope.cli.main import main; main()", *arguments],
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
    )


def test_the_only_gguf_file_is_fetched_listed_and_not_fetched_twice(
    hub: str, tmp_path: Path
) -> None:
    first = goalscope(tmp_path, hub, "models", "pull", "owner/one")
    assert first.returncode == 0, first.stderr
    path = Path(first.stdout.strip())
    assert path.read_bytes() == FILES["owner/one"]["model.gguf"]
    assert "--model" in first.stderr
    written = path.stat().st_mtime_ns
    again = goalscope(tmp_path, hub, "models", "pull", "owner/one", "model.gguf")
    assert Path(again.stdout.strip()) == path
    assert path.stat().st_mtime_ns == written
    listed = goalscope(tmp_path, hub, "models", "list", "--json")
    assert str(path) in [row["path"] for row in json.loads(listed.stdout)]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("owner/two",), "a.gguf, b.gguf. Name one"),
        (("owner/none",), "these GGUF files: none"),
        (("owner/one", "missing.gguf"), "no file missing.gguf"),
        (("owner/nowhere",), "owner/nowhere"),
        (("owner/nowhere", "x.gguf"), "owner/nowhere"),
        (("nobody",), "OWNER/NAME"),
        (("../up", "x.gguf"), "not the name of a repository"),
    ],
)
def test_what_is_not_there_is_said_in_one_line(
    hub: str, tmp_path: Path, arguments: tuple[str, ...], said: str
) -> None:
    result = goalscope(tmp_path, hub, "models", "pull", *arguments)
    assert result.returncode == 2
    assert said in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


@pytest.mark.slow
def test_a_hub_that_is_away_is_said_in_the_end(tmp_path: Path) -> None:
    result = goalscope(tmp_path, "http://127.0.0.1:9", "models", "pull", "owner/one", "m.gguf")
    assert result.returncode == 1
    *_, last = result.stderr.strip().splitlines()  # after the client's own notes on its attempts
    assert last.startswith("Error: Cannot fetch owner/one")
    assert "Check the connection" in last
    assert "Traceback" not in result.stderr
