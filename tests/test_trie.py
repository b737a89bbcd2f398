"""The prefix tree: every path is there, every distinct prefix once."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from goalscope.models.llama.trie import Trie

PATHS = st.lists(st.lists(st.integers(0, 2), min_size=1, max_size=8), min_size=1, max_size=12)


def built(paths: list[list[int]]) -> tuple[Trie, list[int]]:
    trie = Trie()
    return trie, [trie.add(path) for path in paths]


@given(PATHS)
def test_every_path_reads_back_and_every_distinct_prefix_is_one_node(
    paths: list[list[int]],
) -> None:
    trie, numbers = built(paths)
    for path, number in zip(paths, numbers, strict=True):
        nodes = trie.paths[number]
        assert nodes == sorted(nodes)
        assert [trie.tokens[node] for node in nodes] == path
        assert [trie.depths[node] for node in nodes] == list(range(len(path)))
        assert [trie.parents[node] for node in nodes] == [-1, *nodes[:-1]]
    assert len(trie) == len({tuple(p[:end]) for p in paths for end in range(1, len(p) + 1)})
    assert len(trie.paths) == len({tuple(path) for path in paths})
    assert [trie.add(path) for path in paths] == numbers
    for node, through in enumerate(trie.through):
        assert through == [n for n, nodes in enumerate(trie.paths) if node in nodes]


@given(PATHS, st.lists(st.integers(0, 2), max_size=8))
def test_match_is_the_longest_prefix_held(paths: list[list[int]], query: list[int]) -> None:
    trie, _ = built(paths)
    held = max(end for end in range(len(query) + 1) if any(p[:end] == query[:end] for p in paths))
    assert [trie.tokens[node] for node in trie.match(query)] == query[:held]


@given(st.lists(st.integers(0, 2), min_size=2, max_size=8))
def test_extending_equals_adding_at_once(path: list[int]) -> None:
    trie, _ = built([path[:1]])
    for token in path[1:]:
        trie.extend(0, token)
    assert trie.add(path) == 0
    assert trie.paths == built([path])[0].paths
