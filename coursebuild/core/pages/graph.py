"""Graphs of lessons that build on each other, as small drawings whose nodes are links.

A drawing is never the only source: the page also lists the lessons with their titles. Arrows that a
longer path implies are left out, and so are nodes beyond a limit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise

from markupsafe import Markup, escape
from msgspec import Struct

from coursebuild.core.drawing.layered import Layout, layered_layout, transitive_reduction
from coursebuild.core.drawing.scales import markup_text, shorten_to_width, text_width
from coursebuild.core.model import Lesson, Level
from coursebuild.core.pages import urls
from coursebuild.core.pages.context import GraphNode, LessonGraph
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.renderer import Strings

_MOST_LINKED = 5
"""The most prerequisites that are shown of a lesson, and the most lessons it leads to."""
_MOST_NEIGHBOURS = 12
"""The most lessons in a neighbourhood, unless direct neighbours alone are more."""
_MOST_IN_LEVEL = 40
"""The most lessons of a level in a drawing; as many again may be of other levels."""


class _Look(Struct, frozen=True):
    """Sizes in the units of the drawing, which are the pixels of CSS."""

    width: float
    height: float
    gap: float
    step: float
    titles: bool


_WIDE = _Look(132, 56, 12, 92, True)
_NARROW = _Look(50, 30, 5, 58, False)
_SIZE = 12.0
_LINE = 15.0
_CROSSING_WIDTH = 0.2
"""Room for an arrow that crosses a layer, in widths of nodes."""
_EDGE = 2.0
"""Room for the lines around nodes at the edge of a drawing."""


def neighbourhood(library: Library, place: urls.Place, lesson: Lesson) -> LessonGraph | None:
    """The prerequisites of a lesson, theirs, and what it leads to; `None` if too few."""
    # The last ones in the course, since the nearest prerequisites matter most.
    needs = sorted(lesson.prerequisites, key=library.positions.__getitem__)[-_MOST_LINKED:]
    leads = [follower.id for follower in library.leads[lesson.id]][:_MOST_LINKED]
    ids = dict.fromkeys([lesson.id, *needs, *leads])
    for need in needs:
        for further in library.lessons[need].prerequisites:
            if len(ids) < _MOST_NEIGHBOURS:
                ids.setdefault(further)
    return _graph(library, place, ids, current=lesson.id) if len(ids) > 2 else None


def level_graph(library: Library, place: urls.Place, level: Level) -> LessonGraph | None:
    """The lessons of a level, with their prerequisites of other levels."""
    own_ids = dict.fromkeys(lesson.id for lesson in level.lessons)
    if not 2 < len(own_ids) <= _MOST_IN_LEVEL:
        return None
    needed_ids = dict.fromkeys(
        need for lesson in level.lessons for need in lesson.prerequisites if need not in own_ids
    )
    ids = own_ids | needed_ids if len(needed_ids) <= _MOST_IN_LEVEL else own_ids
    graph = _graph(library, place, ids, level=level.id)
    return graph if graph.edges else None


def _graph(
    library: Library,
    place: urls.Place,
    wanted_ids: Iterable[str],
    *,
    current: str = "",
    level: str | None = None,
) -> LessonGraph:
    lessons = [library.lessons[id] for id in sorted(wanted_ids, key=library.positions.__getitem__)]
    ids = [lesson.id for lesson in lessons]
    edges = transitive_reduction(
        ids, ((n, dependent.id) for dependent in lessons for n in dependent.prerequisites)
    )
    return LessonGraph(
        tuple(
            GraphNode(
                lesson.id,
                lesson.title,
                place.href(urls.lesson_path(lesson)),
                lesson.status,
                lesson.id == current,
                level is not None and lesson.level != level,
            )
            for lesson in lessons
        ),
        edges,
    )


# --- drawing


def drawings(graph: LessonGraph, words: Strings) -> tuple[Markup, Markup]:
    """The drawing with titles and the one without, both with the same layout."""
    numbers = {node.id: number for number, node in enumerate(graph.nodes)}
    edges = tuple((numbers[a], numbers[b]) for a, b in graph.edges)
    layout = layered_layout(len(numbers), edges, _CROSSING_WIDTH)
    return _drawing(graph, layout, words, _WIDE), _drawing(graph, layout, words, _NARROW)


def _drawing(graph: LessonGraph, layout: Layout, words: Strings, look: _Look) -> Markup:
    longest = max(text_width(node.id, _SIZE) for node in graph.nodes)
    wide = max(look.width, longest + 26)
    unit = wide + look.gap
    width = layout.width * unit - look.gap + 2 * _EDGE
    height = (layout.layers - 1) * look.step + look.height + 2 * _EDGE
    name = "wide" if look.titles else "narrow"
    parts = [
        f'<svg class="graph-{name}" width="{width:.0f}" height="{height:.0f}" role="group"'
        f' aria-label="{escape(words("graph.label"))}">',
        *_edges(layout, look, unit),
    ]
    for node, placed_node in zip(graph.nodes, layout.nodes, strict=True):
        x, top = _x(placed_node.x, unit, look), _EDGE + placed_node.layer * look.step
        parts.append(_node(node, x, top, wide, words, look))
    return Markup("".join((*parts, "</svg>")))


def _x(place: float, unit: float, look: _Look) -> float:
    return place * unit - look.gap / 2 + _EDGE


def _edges(layout: Layout, look: _Look, unit: float) -> Iterator[str]:
    lines, heads = [], []
    for edge in layout.edges:
        xs = [_x(x, unit, look) for x in edge.xs]
        top = _EDGE + edge.layer * look.step
        path = [f"M{xs[0]:.1f} {top + look.height:.1f}"]
        for number, (x, following) in enumerate(pairwise(xs), 1):
            start, top = top + look.height, top + look.step
            bend = (start + top) / 2
            path.append(f"C{x:.1f} {bend:.1f} {following:.1f} {bend:.1f} {following:.1f} {top:.1f}")
            if number < len(xs) - 1:
                path.append(f"v{look.height:.1f}")
        lines.append("".join(path))
        heads.append(f"M{xs[-1] - 4:.1f} {top - 7:.1f}l4 7 4-7z")
    if lines:
        yield f'<path class="edges" d="{"".join(lines)}"/>'
        yield f'<path class="heads" d="{"".join(heads)}"/>'


def _node(node: GraphNode, x: float, top: float, width: float, words: Strings, look: _Look) -> str:
    """A node, its middle at `x`, with its status as a full or half disc, or a ring."""
    kinds = f"node node-{node.status}" + (" node-outside" if node.outside else "")
    left, middle = x - width / 2, top + look.height / 2
    texts = _lines(node.title, width - 12) if look.titles else []
    first = middle + 4.3 - len(texts) * _LINE / 2
    id_x, mark_x, mark_y = x, left + 10, top + 10
    if not look.titles:  # the mark is on the line of the number
        id_x += 5.5
        mark_x, mark_y = id_x - text_width(node.id, _SIZE) / 2 - 7, middle
    inner = [
        f'<rect x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{look.height:.1f}"'
        ' rx="3"/>',
        f'<circle class="ring" cx="{mark_x:.1f}" cy="{mark_y:.1f}" r="3.5"/>',
    ]
    if node.status == "complete":
        inner.append(f'<circle class="done" cx="{mark_x:.1f}" cy="{mark_y:.1f}" r="3.5"/>')
    elif node.status == "draft":
        half = f"M{mark_x:.1f} {mark_y - 3.5:.1f}a3.5 3.5 0 0 0 0 7z"
        inner.append(f'<path class="done" d="{half}"/>')
    inner.append(
        f'<text class="node-id" x="{id_x:.1f}" y="{first:.1f}">{markup_text(node.id)}</text>'
    )
    for number, text in enumerate(texts, 1):
        y = first + number * _LINE
        inner.append(f'<text x="{x:.1f}" y="{y:.1f}">{markup_text(text)}</text>')
    content = " ".join(inner)
    if node.current:
        return f'<g class="{kinds} node-current">{content}</g>'
    name = ""
    if not look.titles:  # otherwise the texts name it
        status = words(f"status.{node.status}")
        name = f' aria-label="{markup_text(f"{node.id} {node.title} ({status})")}"'
    return f'<a class="{kinds}" href="{escape(node.href)}"{name}>{content}</a>'


def _lines(title: str, room: float) -> list[str]:
    words = title.split()
    first = ""
    while words and text_width(f"{first} {words[0]}".strip(), _SIZE) <= room:
        first = f"{first} {words.pop(0)}".strip()
    if not first:
        return [shorten_to_width(title, room, _SIZE)]
    rest = " ".join(words)
    return [first, shorten_to_width(rest, room, _SIZE)] if rest else [first]
