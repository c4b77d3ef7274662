"""Layouts of graphs of lessons."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations, pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.pages.graph import layered_layout, transitive_reduction

Edge = tuple[int, int]
Graph = tuple[int, tuple[Edge, ...]]


@st.composite
def graphs(draw: st.DrawFn) -> Graph:
    """Any graph without cycles; its nodes are in any order."""
    count = draw(st.integers(1, 14))
    order = draw(st.permutations(range(count)))
    pairs = list(combinations(order, 2))
    edges = draw(st.lists(st.sampled_from(pairs), max_size=30, unique=True)) if pairs else []
    return count, tuple(edges)


def reachable_pairs(edges: Iterable[tuple[str, str]]) -> set[tuple[str, str]]:
    """All pairs of nodes with a path from the first to the second."""
    pairs = set(edges)
    while further := {(a, d) for a, b in pairs for c, d in pairs if b == c} - pairs:
        pairs |= further
    return pairs


@settings(max_examples=50)
@given(graphs())
def test_every_arrow_leads_down_and_meets_its_nodes(graph: Graph) -> None:
    layout = layered_layout(*graph, 0.25)
    assert len(layout.nodes) == graph[0]
    for (a, b), edge in zip(graph[1], layout.edges, strict=True):
        start, end = layout.nodes[a], layout.nodes[b]
        assert edge.layer == start.layer < end.layer
        assert len(edge.xs) == end.layer - start.layer + 1
        assert (edge.xs[0], edge.xs[-1]) == (start.x, end.x)


@settings(max_examples=50)
@given(graphs())
def test_no_node_overlaps_another_or_sticks_out(graph: Graph) -> None:
    layout = layered_layout(*graph, 0.25)
    for level in range(layout.layers):
        row = sorted(node.x for node in layout.nodes if node.layer == level)
        assert row, "an empty layer"
        assert all(b - a >= 1 - 1e-6 for a, b in pairwise(row))
    assert min(node.x for node in layout.nodes) >= 0.5 - 1e-6
    assert max(node.x for node in layout.nodes) <= layout.width - 0.5 + 1e-6


@settings(max_examples=50)
@given(graphs())
def test_a_reduced_graph_leads_as_far_with_no_arrow_too_many(graph: Graph) -> None:
    edges = [(str(a), str(b)) for a, b in graph[1]]
    edges_left = transitive_reduction(map(str, range(graph[0])), edges)
    assert set(edges_left) <= set(edges)
    assert reachable_pairs(edges_left) == reachable_pairs(edges)
    for edge in edges_left:
        assert edge not in reachable_pairs(e for e in edges_left if e != edge)


def test_arrows_of_unknown_nodes_and_repeated_ones_are_left_out() -> None:
    assert transitive_reduction(["a", "b"], [("a", "b"), ("a", "b"), ("a", "x"), ("x", "b")]) == (
        ("a", "b"),
    )


def test_a_chain_longer_than_the_stack_is_laid_out() -> None:
    """Python calls functions a thousand deep."""
    nodes = [str(n) for n in range(1100)]
    edges = tuple(pairwise(nodes))
    assert transitive_reduction(nodes, [*edges, ("0", "1099")]) == edges
    assert layered_layout(1100, tuple(pairwise(range(1100))), 0.25).layers == 1100
