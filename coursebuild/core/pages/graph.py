"""Which lessons build on which, as a small drawing: nodes are links, arrows lead on.

Entry points: `neighbourhood(library, place, lesson)`, the lessons around one; `of_level`, the
lessons of a level with what they need from elsewhere; `drawings(graph, words)`, two of each, for
wide and for narrow screens.

A drawing is never the only place that says it: the page lists the same lessons with their titles.
Arrows that say no more than a longer way does are left out, and so are nodes that are too many.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator
from itertools import pairwise

from markupsafe import Markup, escape
from msgspec import Struct

from coursebuild.core.drawing.layered import Layout, layered_layout, transitive_reduction
from coursebuild.core.drawing.marks import markup_text, shorten_to_width, text_width
from coursebuild.core.model import Lesson, Level
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import GraphNode, LessonGraph
from coursebuild.core.pages.strings import Strings

_BESIDE = 5
"""Lessons that are shown of those that one needs, and of those that it leads to."""
_AROUND = 12
"""Lessons that a neighbourhood has at most, if those at one step are not more."""
_IN_LEVEL = 40
"""Lessons of a level that are drawn, and with those from elsewhere as many again."""


class _Look(Struct, frozen=True):
    """Sizes in the units of the drawing, which are the pixels of CSS."""

    width: float
    height: float
    gap: float
    step: float
    """From one layer to the next."""
    titles: bool


_WIDE = _Look(132, 56, 12, 92, True)
_NARROW = _Look(50, 30, 5, 58, False)
_SIZE = 12.0
"""Of letters."""
_LINE = 15.0
_PASSING = 0.2
"""Room for an arrow that passes a layer, in widths of nodes."""
_EDGE = 2.0
"""Room for the lines around nodes at the edge of a drawing."""


def neighbourhood(library: Library, place: urls.Place, lesson: Lesson) -> LessonGraph | None:
    """What a lesson needs and leads to, and what comes before that; `None` for next to nothing."""
    # The last few in the order of the course: what comes right before counts most.
    needs = sorted(lesson.prerequisites, key=library.positions.__getitem__)[-_BESIDE:]
    leads = [other.id for other in library.leads[lesson.id]][:_BESIDE]
    shown = dict.fromkeys([lesson.id, *needs, *leads])
    for need in needs:
        for further in library.lessons[need].prerequisites:
            if len(shown) < _AROUND:
                shown.setdefault(further)
    return _graph(library, place, shown, current=lesson.id) if len(shown) > 2 else None


def of_level(library: Library, place: urls.Place, level: Level) -> LessonGraph | None:
    """The lessons of a level, and those of other levels that they need."""
    own = dict.fromkeys(lesson.id for lesson in level.lessons)
    if not 2 < len(own) <= _IN_LEVEL:
        return None
    others = dict.fromkeys(
        need for lesson in level.lessons for need in lesson.prerequisites if need not in own
    )
    shown = own | others if len(others) <= _IN_LEVEL else own
    graph = _graph(library, place, shown, level=level.id)
    return graph if graph.edges else None


def _graph(
    library: Library,
    place: urls.Place,
    shown: Iterable[str],
    *,
    current: str = "",
    level: str | None = None,
) -> LessonGraph:
    lessons = [library.lessons[id] for id in sorted(shown, key=library.positions.__getitem__)]
    ids = [lesson.id for lesson in lessons]
    edges = transitive_reduction(ids, ((n, one.id) for one in lessons for n in one.prerequisites))
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
    """The drawing with titles, and the one without; what is where is the same in both."""
    places = {node.id: str(number) for number, node in enumerate(graph.nodes)}
    layout = _layout(len(places), tuple((places[a], places[b]) for a, b in graph.edges))
    return _drawing(graph, layout, words, _WIDE), _drawing(graph, layout, words, _NARROW)


@functools.lru_cache(maxsize=256)
def _layout(count: int, edges: tuple[tuple[str, str], ...]) -> Layout:
    """The layout of a graph whose nodes are called by their numbers: many lessons stand alike."""
    return layered_layout([str(number) for number in range(count)], edges, 1.0, 0.0, _PASSING)


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
    for node, placed in zip(graph.nodes, layout.nodes, strict=True):
        x, top = _x(placed.x, unit, look), _EDGE + placed.layer * look.step
        parts.append(_node(node, _Box(x, top, wide, look.height), words, look))
    return Markup("".join((*parts, "</svg>")))


def _x(place: float, unit: float, look: _Look) -> float:
    return place * unit - look.gap / 2 + _EDGE


class _Box(Struct, frozen=True):
    x: float
    """The middle."""
    top: float
    width: float
    height: float


def _edges(layout: Layout, look: _Look, unit: float) -> Iterator[str]:
    """Lines from box to box, and their heads."""
    layer = {node.id: node.layer for node in layout.nodes}
    lines, heads = [], []
    for edge in layout.edges:
        xs = [_x(x, unit, look) for x in edge.xs]
        top = _EDGE + layer[edge.start] * look.step
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


def _node(node: GraphNode, box: _Box, words: Strings, look: _Look) -> str:
    kinds = f"node node-{node.status}" + (" node-outside" if node.outside else "")
    left, middle = box.x - box.width / 2, box.top + box.height / 2
    texts = _lines(node, box) if look.titles else []
    first = middle + 4.3 - len(texts) * _LINE / 2
    x, mark = box.x, (left + 10, box.top + 10)
    if not look.titles:  # the mark stands on the line of the number
        x += 5.5
        mark = (x - text_width(node.id, _SIZE) / 2 - 7, middle)
    inner = [
        f'<rect x="{left:.1f}" y="{box.top:.1f}" width="{box.width:.1f}"'
        f' height="{box.height:.1f}" rx="3"/>',
        *_mark(node.status, *mark),
        f'<text class="node-id" x="{x:.1f}" y="{first:.1f}">{markup_text(node.id)}</text>',
    ]
    for number, text in enumerate(texts, 1):
        y = first + number * _LINE
        inner.append(f'<text x="{box.x:.1f}" y="{y:.1f}">{markup_text(text)}</text>')
    content = " ".join(inner)
    if node.current:
        return f'<g class="{kinds} node-current">{content}</g>'
    name = ""
    if not look.titles:  # else the texts say it
        status = words(f"status.{node.status}")
        name = f' aria-label="{markup_text(f"{node.id} {node.title} ({status})")}"'
    return f'<a class="{kinds}" href="{escape(node.href)}"{name}>{content}</a>'


def _mark(status: str, x: float, y: float) -> Iterator[str]:
    """How far a lesson is, by a shape: full, half, or a ring."""
    yield f'<circle class="ring" cx="{x:.1f}" cy="{y:.1f}" r="3.5"/>'
    if status == "complete":
        yield f'<circle class="done" cx="{x:.1f}" cy="{y:.1f}" r="3.5"/>'
    elif status == "draft":
        yield f'<path class="done" d="M{x:.1f} {y - 3.5:.1f}a3.5 3.5 0 0 0 0 7z"/>'


def _lines(node: GraphNode, box: _Box) -> list[str]:
    """The title in two lines at most."""
    room = box.width - 12
    words = node.title.split()
    first = ""
    while words and text_width(f"{first} {words[0]}".strip(), _SIZE) <= room:
        first = f"{first} {words.pop(0)}".strip()
    if not first:
        return [shorten_to_width(node.title, room, _SIZE)]
    rest = " ".join(words)
    return [first, shorten_to_width(rest, room, _SIZE)] if rest else [first]
