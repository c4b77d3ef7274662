"""Layouts of graphs in layers."""

from __future__ import annotations

from itertools import combinations, pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.drawing.layered import Edge, Layout, layered_layout, transitive_reduction

Graph = tuple[list[str], list[Edge]]


@st.composite
def graphs(draw: st.DrawFn) -> Graph:
    """Any graph without cycles; its nodes are given in any order."""
    nodes = [f"n{i}" for i in range(draw(st.integers(1, 14)))]
    pairs = list(combinations(nodes, 2))
    edges = draw(st.lists(st.sampled_from(pairs), max_size=30, unique=True)) if pairs else []
    return draw(st.permutations(nodes)), edges


def lay_out(nodes: list[str], edges: list[Edge], width: float = 40.0, gap: float = 8.0) -> Layout:
    return layered_layout(nodes, edges, width, gap, 10.0)


def reachable_pairs(nodes: list[str], edges: list[Edge] | tuple[Edge, ...]) -> set[Edge]:
    """All pairs of nodes with a path from the first to the second."""
    pairs = set(edges)
    while further := {(a, d) for a, b in pairs for c, d in pairs if b == c} - pairs:
        pairs |= further
    return pairs


@settings(max_examples=50)
@given(graphs())
def test_every_arrow_leads_down_and_meets_its_nodes(graph: Graph) -> None:
    layout = lay_out(*graph)
    nodes = {node.id: node for node in layout.nodes}
    assert list(nodes) == graph[0]
    assert [(edge.start, edge.end) for edge in layout.edges] == graph[1]
    for edge in layout.edges:
        start, end = nodes[edge.start], nodes[edge.end]
        assert start.layer < end.layer
        assert len(edge.xs) == end.layer - start.layer + 1
        assert (edge.xs[0], edge.xs[-1]) == (start.x, end.x)


@settings(max_examples=50)
@given(graphs(), st.floats(0, 30))
def test_no_node_overlaps_another_or_sticks_out(graph: Graph, gap: float) -> None:
    layout = lay_out(*graph, gap=gap)
    for level in range(layout.layers):
        row = sorted(node.x for node in layout.nodes if node.layer == level)
        assert row, "an empty layer"
        assert all(b - a >= 40 + gap - 1e-6 for a, b in pairwise(row))
    assert min(node.x for node in layout.nodes) >= 20 - 1e-6
    assert max(node.x for node in layout.nodes) <= layout.width - 20 + 1e-6


@settings(max_examples=50)
@given(graphs())
def test_a_reduced_graph_leads_as_far_with_no_arrow_too_many(graph: Graph) -> None:
    nodes, edges = graph
    edges_left = transitive_reduction(nodes, edges)
    assert set(edges_left) <= set(edges)
    assert reachable_pairs(nodes, edges_left) == reachable_pairs(nodes, edges)
    for edge in edges_left:
        assert edge not in reachable_pairs(nodes, [e for e in edges_left if e != edge])


def test_arrows_of_unknown_nodes_and_repeated_ones_are_left_out() -> None:
    assert transitive_reduction(["a", "b"], [("a", "b"), ("a", "b"), ("a", "x"), ("x", "b")]) == (
        ("a", "b"),
    )


def test_a_chain_longer_than_the_stack_is_laid_out() -> None:
    """Python calls functions a thousand deep."""
    nodes = [str(n) for n in range(1100)]
    edges = list(pairwise(nodes))
    assert transitive_reduction(nodes, [*edges, ("0", "1099")]) == tuple(edges)
    assert lay_out(nodes, edges).layers == 1100
