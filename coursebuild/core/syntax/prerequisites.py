"""The graph of what lessons require.

Entry point: `check_prerequisites(lessons)`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence

from coursebuild.core.model import Lesson
from coursebuild.core.syntax.relations import repeated
from coursebuild.core.syntax.wording import short
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose, did_you_mean

Graph = Mapping[str, Sequence[str]]


def check_prerequisites(lessons: Sequence[Lesson], ids: Iterable[str]) -> Iterator[Diagnostic]:
    """Unknown and repeated prerequisites, and lessons that require each other in a circle.

    `ids` are those of all lessons, also of those with mistakes in other fields. Lessons that are
    tied together by several circles are reported by their shortest one, once.
    """
    known = {lesson.id: lesson for lesson in reversed(lessons)}
    names = {*known, *ids}
    for lesson in lessons:
        pairs = list(zip(lesson.prerequisites, lesson.prerequisite_spans, strict=True))
        yield from repeated(pairs, "field-value", "the prerequisite `{}` is named twice")
        for name, span in pairs:
            if name not in names:
                message = f"no lesson of the map has the id `{short(name)}`"
                help = did_you_mean(name, names)
                yield diagnose("prerequisite-unknown", span, message, help=help)
    graph = {name: [p for p in known[name].prerequisites if p in known] for name in known}
    for circle in circles(graph, [lesson.id for lesson in lessons]):
        yield _report([known[name] for name in circle])


def circles(graph: Graph, order: Sequence[str]) -> list[list[str]]:
    """One circle for each group of names that reach each other, in `order`.

    It is the shortest one through the first name of the group that lies on any; where several are
    as short, the first in the order in which a name lists what it requires.
    """
    left = _without_ends(graph)
    found: list[list[str]] = []
    done: set[str] = set()
    for name in order:
        if name in left and name not in done:
            circle = _shortest(left, name)
            if circle:
                found.append(circle)
                done |= _group(left, name)
    return found


def _without_ends(graph: Graph) -> dict[str, list[str]]:
    """The names that lead into a circle: what can be put into an order is taken away."""
    targets = {name: list(dict.fromkeys(required)) for name, required in graph.items()}
    waiting = {name: len(required) for name, required in targets.items()}
    backward = _turned(targets)
    ready = [name for name, count in waiting.items() if count == 0]
    while ready:
        for name in backward[ready.pop()]:
            waiting[name] -= 1
            if waiting[name] == 0:
                ready.append(name)
    left = {name for name, count in waiting.items() if count}
    return {name: [t for t in targets[name] if t in left] for name in graph if name in left}


def _turned(graph: Graph) -> dict[str, list[str]]:
    """The graph with every edge the other way round."""
    backward: dict[str, list[str]] = {name: [] for name in graph}
    for name, targets in graph.items():
        for target in targets:
            backward[target].append(name)
    return backward


def _shortest(graph: Graph, start: str) -> list[str]:
    """The names on the shortest way from `start` back to itself; empty where there is none."""
    before: dict[str, str] = {}
    queue = deque([start])
    while queue:
        name = queue.popleft()
        for target in graph[name]:
            if target == start:
                way = [name]
                while way[-1] != start:
                    way.append(before[way[-1]])
                return way[::-1]
            if target not in before:
                before[target] = name
                queue.append(target)
    return []


def _group(graph: Graph, start: str) -> set[str]:
    """The names that `start` reaches and that reach it."""
    return _reached(graph, start) & _reached(_turned(graph), start)


def _reached(graph: Graph, start: str) -> set[str]:
    seen = {start}
    stack = [start]
    while stack:
        for target in graph[stack.pop()]:
            if target not in seen:
                seen.add(target)
                stack.append(target)
    return seen


def _report(circle: list[Lesson]) -> Diagnostic:
    spans = [
        lesson.prerequisite_spans[lesson.prerequisites.index(following.id)]
        for lesson, following in zip(circle, [*circle[1:], circle[0]], strict=True)
    ]
    if len(circle) == 1:
        message = f"lesson {circle[0].id} requires itself"
        return diagnose("prerequisite-cycle", spans[0], message, help="remove it")
    names = " → ".join([*(lesson.id for lesson in circle), circle[0].id])
    notes = [
        Note(f"{lesson.id} requires {following.id} here", span)
        for lesson, following, span in zip(
            circle[1:], [*circle[2:], circle[0]], spans[1:], strict=True
        )
    ]
    return diagnose(
        "prerequisite-cycle",
        spans[0],
        f"lessons require each other in a circle: {names}",
        help="remove one of these prerequisites",
        notes=notes,
    )
