"""A prefix tree of token sequences: what many prompts share is stored, and computed, once."""

from __future__ import annotations

from collections.abc import Sequence

from goalscope.models.scoring import Pair


class Trie:
    """Token sequences ("paths") merged wherever they begin alike.

    A node stands for one distinct non-empty prefix. Nodes are numbered in the order they are made,
    so a parent's number is always smaller than its children's.

    Attributes:
        tokens: Token id of each node.
        depths: Position of each node in its sequences, from 0.
        parents: The node before each, -1 where there is none.
        through: For each node, the paths that pass through it, in the order they were added.
        paths: For each path, its nodes from the first token to the last.
    """

    def __init__(self) -> None:
        """Begin with no path."""
        self.tokens: list[int] = []
        self.depths: list[int] = []
        self.parents: list[int] = []
        self.through: list[list[int]] = []
        self.paths: list[list[int]] = []
        self._children: dict[tuple[int, int], int] = {}
        self._path_ending_at: dict[int, int] = {}

    def __len__(self) -> int:
        """Number of nodes, which is the number of distinct non-empty prefixes."""
        return len(self.tokens)

    def add(self, tokens: Sequence[int]) -> int:
        """Add a non-empty path, unless the same one is there; return its number."""
        nodes = self.match(tokens)
        if len(nodes) == len(tokens) and nodes[-1] in self._path_ending_at:
            return self._path_ending_at[nodes[-1]]
        path = len(self.paths)
        for node in nodes:
            self.through[node].append(path)
        self.paths.append(nodes)
        for token in tokens[len(nodes) :]:
            self._grow(path, token)
        self._path_ending_at[nodes[-1]] = path
        return path

    def extend(self, path: int, token: int) -> int:
        """Lengthen a path by a token that no other path holds there; return the new node."""
        del self._path_ending_at[self.paths[path][-1]]
        node = self._grow(path, token)
        self._path_ending_at[node] = path
        return node

    def match(self, tokens: Sequence[int]) -> list[int]:
        """Nodes of the longest prefix of `tokens` that is in the tree."""
        nodes: list[int] = []
        node = -1
        for token in tokens:
            child = self._children.get((node, token))
            if child is None:
                break
            nodes.append(child)
            node = child
        return nodes

    def _grow(self, path: int, token: int) -> int:
        nodes = self.paths[path]
        node = len(self.tokens)
        parent = nodes[-1] if nodes else -1
        self._children[parent, token] = node
        self.tokens.append(token)
        self.parents.append(parent)
        self.depths.append(len(nodes))
        self.through.append([path])
        nodes.append(node)
        return node


def plant(
    pairs: Sequence[Pair], *, nodes: int, paths: int | None = None
) -> tuple[Trie, list[list[tuple[int, int]]]]:
    """A tree of as many pairs as fit, and for each the nodes with the token to score after.

    Args:
        pairs: The first one always fits.
        nodes: Most nodes of the tree.
        paths: Most paths; None for any number.
    """
    trie = Trie()
    spots: list[list[tuple[int, int]]] = []
    for prompt, answer, _ in pairs:
        path = [*prompt, *answer[:-1]]
        grown = len(trie) + len(path) - len(trie.match(path))
        if spots and (len(trie.paths) == paths or grown > nodes):
            break
        ends = trie.paths[trie.add(path)][len(prompt) - 1 :]
        spots.append(list(zip(ends, answer, strict=True)))
    return trie, spots
