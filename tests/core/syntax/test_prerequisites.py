"""Lessons that require each other in a circle."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.syntax.prerequisites import circles
from support.course_maps import LEVEL, lesson, parse


def test_a_circle_points_at_each_of_its_steps() -> None:
    text = LEVEL + lesson("4.1", "4.3") + lesson("4.2", "4.1") + lesson("4.3", "4.2")
    (found,) = parse(text).diagnostics
    assert [(n.message, n.span and n.span.line) for n in found.notes] == [
        ("4.3 requires 4.2 here", 23),
        ("4.2 requires 4.1 here", 17),
    ]


def test_circles_are_found_once_and_in_order() -> None:
    graph = {
        "a": ["b"],
        "b": ["c", "d"],
        "c": ["a"],
        "d": ["b"],
        "e": ["a", "f"],
        "f": ["g"],
        "g": ["f"],
        "h": ["h"],
        "i": [],
    }
    assert circles(graph, list("abcdefghi")) == [["a", "b", "c"], ["f", "g"], ["h"]]
    assert circles(graph, list("ihgfedcba")) == [["h"], ["g", "f"], ["d", "b"]]


@settings(max_examples=200)
@given(
    st.integers(1, 8).flatmap(
        lambda n: st.lists(st.lists(st.integers(0, n - 1), max_size=3), min_size=n, max_size=n)
    )
)
def test_circles_are_circles_and_none_is_missed(edges: list[list[int]]) -> None:
    graph = {str(i): [str(t) for t in targets] for i, targets in enumerate(edges)}
    found = circles(graph, list(graph))
    for circle in found:
        steps = zip(circle, [*circle[1:], circle[0]], strict=True)
        assert all(after in graph[before] for before, after in steps)
        assert len(set(circle)) == len(circle)
    # without the lessons of the circles nothing goes round: take them out by their groups
    reach = {name: set(targets) for name, targets in graph.items()}
    for _ in graph:
        for name in graph:
            reach[name] |= {t for target in reach[name] for t in reach[target]}
    on_circles = {name for name in graph if name in reach[name]}
    groups = {
        frozenset(o for o in on_circles if o in reach[n] and n in reach[o]) for n in on_circles
    }
    assert {
        frozenset(o for o in on_circles if o in reach[c[0]] and c[0] in reach[o]) for c in found
    } == groups
    assert len(found) == len(groups)
