"""A drawn page, ready for its frame, and what the rest of the site must know of it.

Entry point: `record(head, body, base_url)`.

1. Formulas are set to what stands beside them (`formulas.glue`), styles in single elements become
   classes (`styles.hoist`), and forbidden characters are made visible (`characters.visible`).
2. Of what is left, the characters, the anchors and the addresses are noted.
"""

from __future__ import annotations

from msgspec import Struct

from coursebuild.core.pages import fonts, formulas, styles
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.common_files import page_characters
from coursebuild.core.pages.frame import parts_of
from coursebuild.core.pages.links import Reference, ids_and_addresses, references, without_lines
from coursebuild.core.pages.page_inputs import PageHead


class PageRecord(Struct, frozen=True):
    """What the site must know of a page to put it together, but for the page's body."""

    head: PageHead
    parts: tuple[str, ...]
    """See `frame.parts_of`."""
    text: str
    """Characters of its text, as `PageFacts` has them, sorted; so are the others."""
    mathematics: str
    declarations: tuple[str, ...]
    """Styles that were written in its elements, sorted."""
    ids: tuple[str, ...]
    """Anchors, sorted; see `links.without_lines`."""
    references: tuple[Reference, ...]
    """Where its links lead, sorted, each once."""
    notes: tuple[tuple[str, str], ...] = ()
    """What features noted of the page: the feature's name and a digest; see `added_files`."""


def record(head: PageHead, body: str, base_url: str) -> tuple[PageRecord, str]:
    """The record of a page that was just drawn, and its body as it will be published."""
    # Text: what is put into `Markup` would be escaped.
    html, declarations = styles.hoist(formulas.glue_formulas(str(body)))
    text, mathematics = page_characters(html)
    html = visible(html)
    ids, addresses = ids_and_addresses(html)
    found = PageRecord(
        head=head,
        parts=parts_of(html, head.kind),
        text="".join(sorted(text.union(head.title) - fonts.BASE)),
        mathematics="".join(sorted(mathematics)),
        declarations=tuple(sorted(declarations)),
        ids=tuple(sorted(without_lines(ids))),
        references=tuple(sorted(references(head.path, addresses, base_url))),
    )
    return found, html
