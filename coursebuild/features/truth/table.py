"""The fence `truth`: how much of each lesson is proven, as a table.

Entry point: `KIND`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Literal

from markupsafe import Markup, escape
from msgspec import Struct

from coursebuild.core.features import FenceKind, MarkdownWriter
from coursebuild.core.model import Cell, FeatureBlock, Inline, Lesson, RawInline, Table, Text
from coursebuild.core.pages import urls
from coursebuild.core.syntax.fence import Fence
from coursebuild.core.syntax.texts import TextParser
from coursebuild.core.text.diagnostics import Parsed, diagnose
from coursebuild.core.text.source import Excerpt
from coursebuild.features.truth.claims import KINDS, course_claims, sum_claims

if TYPE_CHECKING:
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.pages.library import Library

_COLUMNS = ("part", "share", "numbers", *KINDS, "unsourced", "open")
_RIGHT: Literal["right"] = "right"


class TruthTable(FeatureBlock, frozen=True):
    """The place of the table."""

    def summary(self) -> TruthTable:
        """Return the block itself, which has no content of its own."""
        return self


class TruthRows(Struct, frozen=True):
    """The rows of the table: for each lesson and page a link and its numbers, the sum last."""

    rows: tuple[tuple[str, ...], ...]
    """The first cell of each is HTML."""


def parse_truth(fence: Fence, texts: TextParser) -> Parsed[TruthTable]:
    """Parse the fence, which has neither keys nor a text."""
    diagnostics = list(fence.keys().diagnostics)
    if fence.body.text.strip():
        help = "leave it empty: the table is made from the course"
        place = fence.body.span()
        diagnostics.append(diagnose("truth-text", place, "this text is not used", help=help))
    return Parsed(TruthTable(fence.span), tuple(diagnostics))


def values(library: Library, place: urls.Place, block: TruthTable) -> TruthRows:
    """Return the rows of the table."""
    rows: list[tuple[str, ...]] = []
    claims_by_owner = list(course_claims(library.course, library.results.runs))
    for owner, claims in claims_by_owner:
        name = f"{owner.id} {owner.title}" if isinstance(owner, Lesson) else owner.title
        link = Markup('<a href="{}">{}</a>').format(place.href(urls.owner_path(owner)), name)
        rows.append((str(link), claims.share, *claims.counts))
    total, name = sum_claims(claims for _, claims in claims_by_owner), library.words("truth.all")
    return TruthRows((*rows, (str(escape(name)), total.share, *total.counts)))


def _table(page: PageContext, block: TruthTable) -> Table:
    table = page.inputs.blocks[block.span.start]
    assert isinstance(table, TruthRows)

    def cell(inline: Inline) -> Cell:
        return Cell(block.span, Excerpt.of_span(block.span), (inline,))

    def cells(texts: Iterable[str]) -> Iterator[Cell]:
        return (cell(Text(block.span, text)) for text in texts)

    header = tuple(cells(page.renderer.words(f"truth.{name}") for name in _COLUMNS))
    rows = tuple((cell(RawInline(block.span, name)), *cells(row)) for name, *row in table.rows)
    return Table(block.span, ("left", *(_RIGHT for _ in _COLUMNS[1:])), header, rows)


def draw(page: PageContext, block: TruthTable) -> Markup:
    """Draw the table on a page."""
    return page.blocks((_table(page, block),))


def markdown(writer: MarkdownWriter, block: TruthTable) -> str:
    """Write the table in Markdown."""
    return writer.blocks((_table(writer.page, block),))


KIND = FenceKind(
    name="truth",
    block=TruthTable,
    parse=parse_truth,
    draw=draw,
    markdown=markdown,
    values=values,
)
