"""How a tree of tokens is computed in few batches, and what of it is kept for the next tree."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from goalscope.base.optional_packages import package
from goalscope.models.llama.trie import Trie

ROOT = 0
"""Key of the empty prefix in a `PrefixStore`."""


@dataclass(frozen=True, slots=True)
class Row:
    """Nodes of a tree that are computed side by side, after a path that is known already.

    Attributes:
        trunk: That path, from its first node to its last; empty at the tree's root.
        nodes: What is computed; each node's parent comes before it, or ends the trunk.
    """

    trunk: list[int]
    nodes: list[int]


def pack(trie: Trie, fresh: Sequence[bool], *, width: int, limit: int) -> list[Row]:
    """Rows of nodes that can be computed now.

    Whole subtrees share a row if they have the same trunk. Of one that is wider than a row, what
    all its paths share comes first, with as many branches as fit; the others can come afterwards.

    Args:
        trie: The tree.
        fresh: Whether a node is still to be computed; above each other node, all are known.
        width: Most nodes of a row.
        limit: Most nodes of a row that is one unbranched path.
    """
    below: dict[int, list[int]] = {}
    nodes = [node for node, each in enumerate(fresh) if each]
    size = [0] * len(trie)
    for node in nodes:
        below.setdefault(trie.parents[node], []).append(node)
    for node in reversed(nodes):
        size[node] += 1
        if trie.parents[node] >= 0:
            size[trie.parents[node]] += size[node]
    rows: list[Row] = []
    for end, branches in below.items():
        if end >= 0 and fresh[end]:
            continue
        trunk = trie.paths[trie.through[end][0]][: trie.depths[end] + 1] if end >= 0 else []
        row: list[int] = []
        for branch in branches:
            if size[branch] > width:
                rows.append(Row(trunk, _top(branch, below, size, width, limit)))
                continue
            if len(row) + size[branch] > width:
                rows.append(Row(trunk, row))
                row = []
            row += _subtree(branch, below)
        if row:
            rows.append(Row(trunk, row))
    return rows


def batches(rows: Sequence[Row], *, tokens: int, known: int) -> Iterator[list[Row]]:
    """Group rows that are computed at once; all take the room of the longest.

    Args:
        rows: The rows.
        tokens: Most tokens to compute in one batch.
        known: Most tokens of the trunks in one batch.
    """
    batch: list[Row] = []
    trunk = width = 0
    for row in sorted(rows, key=lambda row: (len(row.trunk), len(row.nodes))):
        trunk, width = max(trunk, len(row.trunk)), max(width, len(row.nodes))
        if batch and ((len(batch) + 1) * width > tokens or (len(batch) + 1) * trunk > known):
            yield batch
            batch, trunk, width = [], len(row.trunk), len(row.nodes)
        batch.append(row)
    if batch:
        yield batch


def _top(
    node: int, below: dict[int, list[int]], size: Sequence[int], width: int, limit: int
) -> list[int]:
    nodes = [node]
    while len(nodes) < limit and len(below.get(nodes[-1], ())) == 1:
        nodes += below[nodes[-1]]
    for branch in below.get(nodes[-1], ()):
        if len(nodes) + size[branch] <= width:
            nodes += _subtree(branch, below)
    return nodes


def _subtree(node: int, below: dict[int, list[int]]) -> list[int]:
    nodes, waiting = list[int](), [node]
    while waiting:
        nodes.append(waiting.pop())
        waiting += reversed(below.get(nodes[-1], ()))
    return nodes


@dataclass(eq=False, slots=True)
class _Block:
    """Keys and values that were computed at once."""

    values: Any
    number: int
    used: int
    held: list[tuple[int, int, int]] = field(default_factory=list[tuple[int, int, int]])


class PrefixStore:
    """Keys and values of token sequences ("prefixes"), those with the same beginning kept once.

    A prefix is known by a key, under which stand the keys and values of its last token, flat: a row
    of a tensor [tokens, numbers of one token]. The least recently used are forgotten first.
    """

    def __init__(self, limit: int) -> None:
        """Begin with nothing; `limit` is in bytes."""
        self.limit = limit
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._blocks: list[_Block] = []
        self._children: dict[tuple[int, int], int] = {}
        self._places: dict[int, tuple[_Block, int]] = {}
        self._clock = self._last = ROOT

    @property
    def bytes(self) -> int:
        """Memory taken."""
        return sum(block.values.nbytes for block in self._blocks)

    def tick(self) -> None:
        """Begin a new time: what is found or added from now on is forgotten after all before."""
        self._clock += 1

    def find(self, key: int, token: int) -> int | None:
        """Key of a prefix that is one token longer than the one at `key`, if it is held."""
        longer = self._children.get((key, token))
        if longer is not None:
            self._places[longer][0].used = self._clock
        return longer

    def path(self, tokens: Sequence[int]) -> list[int]:
        """Keys of all prefixes of `tokens` that are held, from the shortest to the longest."""
        keys: list[int] = []
        key: int | None = ROOT
        for token in tokens:
            key = self.find(key, token)
            if key is None:
                break
            keys.append(key)
        return keys

    def add(self, values: Any) -> _Block:
        """Hold keys and values [tokens, numbers]; `put` says what they belong to."""
        block = _Block(values, len(self._blocks) and self._blocks[-1].number + 1, self._clock)
        self._blocks.append(block)
        return block

    def put(self, block: _Block, row: int, key: int, token: int) -> int:
        """Say that a row of a block belongs to `token` after the prefix at `key`; its own key."""
        self._last += 1
        block.held.append((key, token, self._last))
        self._places[self._last] = (block, row)
        self._children[key, token] = self._last
        return self._last

    def gather(self, keys: Sequence[int]) -> Any:
        """Keys and values [tokens, numbers] at keys; at least one."""
        torch = package("torch")
        runs: list[tuple[_Block, int, int]] = []
        for key in keys:
            block, row = self._places[key]
            if runs and runs[-1][0] is block and runs[-1][2] == row:
                runs[-1] = (block, runs[-1][1], row + 1)
            else:
                runs.append((block, row, row + 1))
        return torch.cat([block.values[start:end] for block, start, end in runs])

    def trim(self) -> None:
        """Forget the least recently used until the rest keeps within the limit.

        Of what was used at the same time the newest goes first, so that no prefix outlives the
        shorter ones that it is found by, and that a scan of too much still finds the first again.
        """
        size = self.bytes
        for block in sorted(self._blocks, key=lambda block: (block.used, -block.number)):
            if size <= self.limit:
                break
            size -= block.values.nbytes
            self._blocks.remove(block)
            for key, token, own in block.held:
                del self._places[own]
                del self._children[key, token]
