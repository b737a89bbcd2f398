"""Whatever a file or a model holds, nothing but an error of goalscope's own comes of reading it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from entries import ENTRIES
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from goalscope.base.types import GoalscopeError
from processes import environment

ODD = [
    b"\0", b"\xff", b"\xef\xbb\xbf", b"\r", b"\n", b'"', b"'", b"\\ud800", b"\\u0000", b"{", b"}",
    b"[" * 2000, b"9" * 5000, b"1e999", b"-1", b"NaN", b"null", b"true", b"[]", b"{}", b'""', b"=",
    b",", b";", b":", b"\t", b"x" * 5000, b"0x10", b"1979-05-27", b"inf", b"- ", b"[[", b"]]",
    "\u202e\u200b".encode(), "\U0001f600".encode(), b"\x1b[2J",
]  # fmt: skip
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9)
    | st.sampled_from([10**400, -1, 0, 1e308, "", "\ud800", "Apple", "Floor|0"]),
    lambda inner: st.lists(inner, max_size=3)
    | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)  # fmt: skip


@st.composite
def edited(draw: st.DrawFn, samples: list[bytes]) -> bytes:
    """A sample with some of its bytes cut out, and odd ones put in."""
    data = draw(st.sampled_from(samples))
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, len(data)))
        cut = draw(st.sampled_from([0, 0, 1, 3, 30]))
        data = data[:at] + draw(st.sampled_from(ODD) | st.binary(max_size=3)) + data[at + cut :]
    return data


@st.composite
def replaced(draw: st.DrawFn, samples: list[bytes]) -> bytes:
    """A sample of JSON in which something has another value, is missing, or is there besides."""
    value = json.loads(draw(st.sampled_from(samples)))
    for _ in range(draw(st.integers(1, 2))):
        at: Any = value
        while True:
            keys = list(at) if isinstance(at, dict) else range(len(at))
            if not keys:
                break
            key = draw(st.sampled_from(keys))
            if isinstance(at[key], dict | list) and draw(st.booleans()):
                at = at[key]
                continue
            if draw(st.integers(0, 5)):
                at[key] = draw(VALUES)
            else:
                del at[key]
            break
    return json.dumps(value).encode()


@pytest.mark.parametrize("count", [50, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ENTRIES)
def test_only_typed_errors_come_of_reading(
    name: str, count: int, figure: Callable[[str], None]
) -> None:
    read, samples = ENTRIES[name]
    ends, told = Counter[str](), list[str]()
    for sample in samples:
        read(sample)
    texts = edited(samples)
    if samples[0].startswith(b"{"):
        texts |= replaced(samples)

    @settings(max_examples=count, suppress_health_check=list(HealthCheck), database=None)
    @given(texts)
    def tried(data: bytes) -> None:
        try:
            read(data)
            ends["read"] += 1
        except GoalscopeError as error:
            told.append(str(error))
            ends["refused"] += 1

    tried()
    assert all(each.isprintable() for each in told)
    figure(f"{name}: {ends.total():,} hostile texts, {ends['refused']:,} refused, 0 other errors")


LOAD = r"""
import re, sys
from pathlib import Path
from goalscope.envs.grocery import Catalogue
shop = Catalogue.load(Path(sys.argv[1]))
assert len({item.name for item in shop.items}) == len(shop)
print(len(shop), *re.findall(r"VmHWM:\s*(\d+)", Path("/proc/self/status").read_text()))
"""


@pytest.mark.parametrize("count", [5000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_a_catalogue_of_a_million_rows_fits(
    count: int, tmp_path: Path, figure: Callable[[str], None]
) -> None:
    if not Path("/proc/self/status").exists():
        pytest.skip("the system does not tell how much memory was used")
    file = tmp_path / "shop.csv"
    with file.open("w") as rows:
        rows.write("name,category,unit,price\n")
        for number in range(count):  # every fifth name is there again
            rows.write(f"Tea of kind {number - number % 5 // 4},drinks,20 ct,${number % 90}.50\n")
    done = subprocess.run(
        [sys.executable, "-c", LOAD, str(file)],
        env=environment(), capture_output=True, text=True, timeout=1800, check=True,
    )  # fmt: skip
    read, peak = map(int, done.stdout.split())
    assert read == count
    assert peak < 2**20  # KiB
    figure(f"{count:,} rows: {read:,} items, {peak / 2**10:,.0f} MiB at most")
