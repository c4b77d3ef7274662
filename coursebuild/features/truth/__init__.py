"""Measures how much of a course is proven: numbers that are bound, computed or given with a source.

The claims of a document are counted when it is read (`claims`), and stored with it. The fence
`truth` shows them lesson by lesson, and `[verify] truth` in the course map requires a share.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Literal

from markupsafe import Markup, escape
from msgspec import Struct

from coursebuild.core.features import Feature, FenceKind, MarkdownWriter
from coursebuild.core.model import (
    Cell,
    Course,
    Document,
    FeatureBlock,
    Inline,
    Lesson,
    RawInline,
    Table,
    Text,
)
from coursebuild.core.model.results import ScriptRun
from coursebuild.core.pages import urls
from coursebuild.core.syntax.fence import Fence, TextParser
from coursebuild.core.text.diagnostics import Diagnostic, Fix, Parsed, diagnose
from coursebuild.core.text.rules import Rule
from coursebuild.core.text.source import Excerpt
from coursebuild.features.truth.claims import (
    KINDS,
    Claims,
    check_sources,
    course_claims,
    document_claims,
    sum_claims,
)

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
        help = Fix("leave it empty: the table is made from the course", "")
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


_TEXTS = """\
[truth]
part = "Lesson or page"
numbers = "Numbers"
bound = "Printed by a script"
computed = "Computed"
given = "Given, with a source"
unsourced = "Given without a source"
open = "Unproven"
share = "Proven"
all = "All"
"""


def check(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Yield an error if less is proven than the map asks for, or a source lacks its number."""
    yield from _check_share(course, ())
    for document in documents:
        claims = (document.summaries or {}).get("truth")
        if isinstance(claims, Claims) and claims.named:
            yield from check_sources(course, claims.named)


def check_runs(course: Course, runs: Iterable[ScriptRun]) -> Iterator[Diagnostic]:
    """Yield the same error if only numbers of scripts that were not run make up the share."""
    if not any(_check_share(course, ())):
        yield from _check_share(course, runs)


def _check_share(course: Course, runs: Iterable[ScriptRun]) -> Iterator[Diagnostic]:
    if course.truth is None:
        return
    claims = sum_claims(claims for _, claims in course_claims(course, runs))
    if claims.proven < course.truth * claims.all:
        required = f"{100 * course.truth:g} %"
        message = f"{claims.share} of the numbers are proven; the course requires {required}"
        help = f"`coursebuild check --truth` lists the other {claims.all - claims.proven}"
        yield diagnose("truth-share", course.truth_span, message, help=help)


def unproven(course: Course, runs: Iterable[ScriptRun]) -> Iterator[Diagnostic | str]:
    """Yield the share of proven numbers by lesson, and each number that nothing proves."""
    rows = [
        (owner.id if isinstance(owner, Lesson) else owner.title, claims)
        for owner, claims in course_claims(course, runs)
    ]
    for name, claims in (*rows, ("all", sum_claims(claims for _, claims in rows))):
        if claims.all:
            yield (
                f"{name}: {claims.share} of {claims.all} numbers proven: {claims.bound} bound,"
                f" {claims.computed} computed, {claims.given} given with a source;"
                f" {len(claims.unsourced)} given without, {len(claims.open)} with no proof"
            )
    for _, claims in rows:
        for place in claims.open:
            yield diagnose("number-unproven", place, f"nothing proves `{place.text}`")
        for place in claims.unsourced:
            message = f"`{place.text}` is given without a source"
            help = 'name it, as in `{given="models/pendulum.xml"}` or `{given="chosen"}`'
            yield diagnose("number-unproven", place, message, help=help)


FEATURE = Feature(
    name="truth",
    needs=("arithmetic",),
    fences=(KIND,),
    summary=lambda document, mathml: Parsed(document_claims(document)),
    check=check,
    check_runs=check_runs,
    unproven=unproven,
    texts={"en": _TEXTS},
    rules=(
        Rule("number-unproven", "warning", "Nothing in the course proves this number."),
        Rule("given-source", "error", "A number is not in the file named as its source."),
        Rule("truth-share", "error", "Fewer numbers are proven than the map demands."),
        Rule("truth-text", "error", "A `truth` fence is not empty."),
    ),
)
