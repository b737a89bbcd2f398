"""The prefix tree: every path is there, every distinct prefix once."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from goalscope.models.trie import Trie

PATHS = st.lists(st.lists(st.integers(0, 2), min_size=1, max_size=8), min_size=1, max_size=12)


def built(paths: list[list[int]]) -> tuple[Trie, list[int]]:
    trie = Trie()
    return trie, [trie.add(path) for path in paths]


@given(PATHS)
def test_every_path_reads_back(paths: list[list[int]]) -> None:
    trie, numbers = built(paths)
    for path, number in zip(paths, numbers, strict=True):
        nodes = trie.paths[number]
        assert [trie.tokens[node] for node in nodes] == path
        assert [trie.depths[node] for node in nodes] == list(range(len(path)))


@given(PATHS)
def test_one_node_for_each_distinct_prefix(paths: list[list[int]]) -> None:
    trie, _ = built(paths)
    prefixes = {tuple(path[:end]) for path in paths for end in range(1, len(path) + 1)}
    assert len(trie) == len(prefixes)


@given(PATHS)
def test_one_number_for_each_distinct_path(paths: list[list[int]]) -> None:
    trie, numbers = built(paths)
    assert len(trie.paths) == len({tuple(path) for path in paths})
    again = [trie.add(path) for path in paths]
    assert again == numbers


@given(PATHS)
def test_a_node_lists_the_paths_through_it(paths: list[list[int]]) -> None:
    trie, _ = built(paths)
    for node, through in enumerate(trie.through):
        assert through == [n for n, nodes in enumerate(trie.paths) if node in nodes]


@given(PATHS)
def test_parents_come_before_children(paths: list[list[int]]) -> None:
    trie, _ = built(paths)
    assert all(nodes == sorted(nodes) for nodes in trie.paths)
    for nodes in trie.paths:
        assert [trie.parents[node] for node in nodes] == [-1, *nodes[:-1]]


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
