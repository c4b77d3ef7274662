"""Drawings: what an SVG may hold, and layouts of graphs."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from itertools import combinations, pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.drawing.layered import layered_layout, transitive_reduction
from coursebuild.core.drawing.safe_svg import read_svg
from support.fixture_cases import fixture_tables
from support.hostile_svg import HARMLESS, HOSTILE, mutants

CASES = fixture_tables("safe_svg")

ROOT = Path(__file__).parents[3]
DRAWINGS = sorted(
    (*(ROOT / "content").rglob("*.svg"), *(ROOT / "tests/fixtures/drawings").glob("*.svg"))
)
SVG = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:x="{}">\n{}</svg>'
NOTES = "http://www.inkscape.org/namespaces/inkscape"
UNHARMED = frozenset(("image of SVG as PNG", "100,000 namespaces", "CSS of 300,000 escapes"))
"""Files that may be shown: nothing comes of what they try."""

WORDINGS = {
    **dict(CASES["parts"]),
    "<g>" * 100: "contains more than 100 elements inside each other on line 2",
}


def test_each_reason_has_its_words() -> None:
    wordings = {inside: read_svg(SVG.format("urn:x", inside).encode()) for inside in WORDINGS}
    assert wordings == WORDINGS


WHOLE = {
    b"": "is not an SVG file: no element found: line 1, column 0",
    b"<p/>": "is not an SVG file: its root is another element",
    b"\xff\xfe<\0": "is not an SVG file in UTF-8",
    b"<?xml version='1.0' encoding='utf-7'?><svg/>": "is not in UTF-8, but in `utf-7`",
    b"<!DOCTYPE svg [<!ENTITY a 'a'>]>": "contains a document type of its own on line 1",
    b"x" * (5 << 20): "is larger than 4 MiB",
}


def test_each_reason_why_a_file_is_no_drawing_has_its_words() -> None:
    assert {data: read_svg(data) for data in WHOLE} == WHOLE


def test_hostile_files_are_refused_in_words() -> None:
    readings = {name: read_svg(data) for name, data in HOSTILE}
    assert {name for name, reading in readings.items() if not isinstance(reading, str)} == UNHARMED
    wordings = [reading for reading in readings.values() if isinstance(reading, str)]
    assert [
        wording for wording in wordings if not re.match("contains|is|draws|repeats", wording)
    ] == []
    assert max(map(len, wordings)) < 200


def test_what_only_looks_like_an_attack_is_shown() -> None:
    assert {name: r for name, data in HARMLESS if isinstance(r := read_svg(data), str)} == {}


def test_what_programs_draw_is_shown() -> None:
    faults = {
        file.name: r for file in DRAWINGS if isinstance(r := read_svg(file.read_bytes()), str)
    }
    assert faults == {}


@pytest.mark.parametrize("seed", range(3))
def test_what_is_written_again_is_as_safe(seed: int) -> None:
    """A drawing that passes also passes as the elements that were read of it."""
    count = 0
    for name, data in (*HARMLESS, *mutants(1_000, seed)):
        drawing = read_svg(data)
        if not isinstance(drawing, str):
            again = read_svg(ET.tostring(drawing, encoding="utf-8"))
            assert not isinstance(again, str), f"{name}: {again}"
            count += 1
    assert count > len(HARMLESS)


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
