"""Relative addresses in a document, and the anchors of listings, outputs and models.

A link to the file of a lesson or page means the lesson or page itself, so that the same link works
on the site and where the files are read.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Iterator
from typing import TypeAlias
from urllib.parse import unquote, urlsplit

from msgspec import Struct

from coursebuild.core.model import blocks, walk
from coursebuild.core.model.course import Course
from coursebuild.core.model.inlines import (
    Image,
    Inline,
    Label,
    LessonTarget,
    PageTarget,
    RawInline,
    Target,
    Term,
    UrlTarget,
)
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Source, Span


def local_file(url: str, document_path: str) -> str:
    """The path, from the project root, of the file that a relative address in a document names."""
    path = unquote(url.split("#", 1)[0].split("?", 1)[0])
    base = "" if path.startswith("/") else posixpath.dirname(document_path)
    return posixpath.normpath(posixpath.join(base, path.lstrip("/")))


def resolve(target: Target, course: Course, document_path: str) -> Target:
    """The target of a link: a lesson or page if the link names its file, else unchanged."""
    if not isinstance(target, UrlTarget) or ".md" not in target.url:
        return target
    try:
        parts = urlsplit(target.url)
    except ValueError:
        return target
    if parts.scheme or parts.netloc or not parts.path.endswith(".md"):
        return target
    path, anchor = local_file(target.url, document_path), parts.fragment or None
    for page in course.pages:
        if page.path == path:
            return PageTarget(page.id, anchor)
    for lesson in course.lessons:
        if lesson.path == path:
            return LessonTarget(lesson.id, anchor)
    return target


AnchorOwner: TypeAlias = (
    blocks.Block | Inline | Label | walk.DisplayFormula | blocks.NumberedItem | Source
)
"""What an anchor of a document leads to; a source for the title of a page."""

_HTML_ID = regex(
    r"""<(?:[^<>]*?\sid|a\s(?:[^<>]*?\s)?name)\s*=\s*(["'])?((?(1)(?:(?!\1).)+|[^"'\s>]+))""",
    re.IGNORECASE,
)
_NO_MARKUP = regex(
    r"<!--.*?(?:-->|\Z)|(<(script|style|textarea|title)\b[^<>]*>).*?(?:</\2\s*>|\Z)",
    re.IGNORECASE | re.DOTALL,
)
"""Text in HTML in which no tag begins; what nothing closes goes on to the end."""


def document_anchors(document: blocks.Document) -> Iterator[tuple[str, AnchorOwner, Span]]:
    """The ids that a link may name, with what they lead to; not those of lines of listings."""
    source = document.source
    if document.title_anchor:
        yield document.title_anchor, source, source.span(0, 0)
    for item in document.numbered_items:  # a summary does not say where formulas and tables stand
        label = re.search(rf"\{{#{re.escape(item.id)}(?![\w-])", source.text)
        at = 0 if label is None else label.start()
        yield item.id, item, source.span(at, at)
    if document.summaries is None:
        for displayed in filter(lambda formula: formula.id, walk.display_formulas(document)):
            yield displayed.id, displayed, source.span(displayed.start, displayed.start)
        yield from (
            (label.id, label, block.span) for block, label in walk.labelled_blocks(document)
        )
    numbers = walk.output_numbers(document)
    for block, inlines in walk.inlines_by_block(document):
        if isinstance(block, blocks.Heading):
            yield block.anchor, block, block.span
        elif isinstance(block, blocks.FeatureBlock):
            yield from ((id, block, block.span) for id in block.anchors() if id)
        elif isinstance(block, blocks.Script):
            yield listing_anchor(block.path), block, block.span
        elif isinstance(block, blocks.Recording) and block.script is not None:
            yield output_anchor(block.script, numbers[block.span.start]), block, block.span
        elif isinstance(block, blocks.HtmlBlock):
            yield from ((id, block, block.span) for id in html_ids(block.html))
        for inline in inlines:
            if isinstance(inline, RawInline):
                yield from ((id, inline, inline.span) for id in html_ids(inline.html))
            elif isinstance(inline, Term):
                yield inline.anchor, inline, inline.span


def html_ids(html: str) -> list[str]:
    """The ids that tags of some HTML have."""
    return [tag[2] for tag in _HTML_ID.finditer(_NO_MARKUP.sub(r"\1", html))]


def heading_anchors(document: blocks.Document) -> frozenset[str]:
    """The anchors of a document's headings and of its title."""
    anchors = (heading.anchor for heading in walk.find_blocks(document, blocks.Heading))
    return frozenset((document.title_anchor, *anchors)) - {""}


def listing_anchor(path: str) -> str:
    """The anchor of a listing, `l4_2_inertia.py`; its dot is in no anchor made from a heading."""
    return re.sub(r"\s", "\u2423", path.removeprefix("examples/").removeprefix("models/"))


def line_anchor(path: str, line: int) -> str:
    """The anchor of a line of a listing, from 1: `l4_2_inertia.L12`."""
    return f"{_stem(path)}.L{line}"


def output_anchor(path: str, number: int) -> str:
    """The anchor of an output of a script, from 1: `l4_2_inertia.out`, `l4_2_inertia.out-2`."""
    return f"{_stem(path)}.out" + (f"-{number}" if number > 1 else "")


def _stem(path: str) -> str:
    return re.sub(r"\.(?:py|xml)\Z", "", listing_anchor(path))


def model_anchors(scenarios: Iterable[str]) -> tuple[str, ...]:
    """The ids on a model's page, without those in its file, given its declared scenarios."""
    return ("facts", "measured", *map(scenario_anchor, scenarios), "diet", "used", "file")


def scenario_anchor(name: str) -> str:
    """The id of the measurements of a declared scenario."""
    return f"measured-{name}"


_LINES = regex(r"(?P<stem>.+)\.L(?P<first>[1-9][0-9]{0,8})(?:-L(?P<last>[1-9][0-9]{0,8}))?")


def linked_lines(anchor: str) -> tuple[str, int, int] | None:
    """The listing's stem and the first and last line of an anchor, as in `l4_2_inertia.L12-L20`."""
    match = _LINES.fullmatch(anchor)
    if match is None:
        return None
    first = int(match["first"])
    last = int(match["last"] or first)
    return (match["stem"], first, last) if first <= last else None


class RecordedFigure(Struct, frozen=True):
    """A figure that a script draws and a lesson shows, or its data."""

    script: str
    name: str
    path: str
    span: Span

    @property
    def has_dark(self) -> bool:
        return self.name.endswith(".svg")


def recorded_figures(document: blocks.Document) -> tuple[RecordedFigure, ...]:
    """The figures of a document's scripts that its paragraphs show, each followed by its data."""
    script_by_name: dict[str, str] = {}
    figures: list[RecordedFigure] = []
    for block in walk.document_blocks(document):
        if isinstance(block, blocks.Script):
            script_by_name |= {figure.name: block.path for figure in block.figures}
        elif isinstance(block, blocks.Paragraph) and block.figure:
            inlines = walk.walk_inlines(walk.block_inlines(block))
            image = next(inline for inline in inlines if isinstance(inline, Image))
            path = local_file(image.url, document.source.path)
            for file in (path, f"{posixpath.splitext(path)[0]}.csv"):
                name = posixpath.basename(file)
                if name in script_by_name:
                    figures.append(RecordedFigure(script_by_name[name], name, file, image.url_span))
    return tuple(figures)


def unshown_figures(document: blocks.Document) -> tuple[blocks.FigureName, ...]:
    """The figures of a document's scripts that no paragraph below shows, and data without one."""
    shown_names = {(figure.script, figure.name) for figure in recorded_figures(document)}
    return tuple(
        figure
        for script in walk.document_scripts(document)
        for figure in script.figures
        if (script.path, figure.name) not in shown_names
    )
