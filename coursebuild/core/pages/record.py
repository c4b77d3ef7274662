"""Records of drawn pages: what the rest of the site must know of a page.

Entry point: `record(head, body, base_url, page)`.

1. Formulas are glued to punctuation and units (`formulas.glue_formulas`), inline styles become
   classes (`styles.hoist_styles`), and forbidden characters are made visible
   (`characters.visible`).
2. The record has the characters, anchors and addresses of the result, the parts that have scripts,
   and the ids that stand there twice, whoever has drawn them.
"""

from __future__ import annotations

from msgspec import Struct

from coursebuild.core.pages import fonts, formulas, styles
from coursebuild.core.pages.common_files import page_characters
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.frame import FRAME_IDS, parts_of
from coursebuild.core.pages.references import Reference, ids_and_addresses, merge_line_ids, references
from coursebuild.core.pages.page_inputs import PageHead
from coursebuild.core.text.characters import visible


class PageRecord(Struct, frozen=True, array_like=True):
    """What the site must know of a page, without its body."""

    kind: str
    """See `PageHead`."""
    title: str
    indexed: bool
    """Whether search engines should list it."""
    text: str
    """Characters of its text, as in `PageFacts`, sorted, like those of formulas."""
    mathematics: str
    declarations: tuple[str, ...]
    """Styles taken out of its elements, sorted."""
    ids: tuple[str, ...]
    """Anchors, sorted; see `links.merge_line_ids`."""
    references: tuple[Reference, ...]
    """The targets of its links, sorted, each once."""
    repeated_ids: tuple[tuple[str, int, int], ...] = ()
    """Ids that several elements have, sorted; each with the start and end of its place in the
    page's document (`PageContext.find_repetition`), or zeros."""
    parts: tuple[str, ...] = ()
    """See `parts_of`."""
    notes: tuple[tuple[str, str], ...] = ()
    """The features' notes of the page: a feature's name and a digest; see `added_files`."""


def record(
    head: PageHead, body: str, base_url: str, page: PageContext | None = None
) -> tuple[PageRecord, str]:
    """The record of a page just drawn, and its body as it will be published.

    `page` is the document on it, if any.
    """
    # A plain string, since `Markup` would escape what is inserted.
    html, declarations = styles.hoist_styles(formulas.glue_formulas(str(body)))
    text, mathematics = page_characters(html)
    html = visible(html)
    ids, addresses, repeated_ids = ids_and_addresses(html)
    repeated_ids |= ids & FRAME_IDS
    page_record = PageRecord(
        kind=head.kind,
        title=head.title,
        indexed=head.indexed,
        text="".join(sorted(text.union(head.title) - fonts.BASE)),
        mathematics="".join(sorted(mathematics)),
        declarations=tuple(sorted(declarations)),
        ids=tuple(sorted(merge_line_ids(ids))),
        references=tuple(sorted(references(head.path, addresses, base_url))),
        repeated_ids=tuple((name, *_place(name, page)) for name in sorted(repeated_ids)),
        parts=parts_of(html, head.kind),
    )
    return page_record, html


def _place(name: str, page: PageContext | None) -> tuple[int, int]:
    span = None if page is None else page.find_repetition(name)
    return (0, 0) if span is None else (span.start, span.end)
