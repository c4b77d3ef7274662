"""The text of a page as it will be published, and what the rest of the site must know of it.

Entry point: `postprocess_html(html)`.

1. Formulas are set to what stands beside them (`formulas.glue`), styles in single elements become
   classes (`styles.hoist`), and forbidden characters are made visible (`characters.visible`).
2. Of what is left, the characters, the anchors and the addresses are noted.
"""

from __future__ import annotations

from msgspec import Struct

from coursebuild.core.pages import formulas, styles
from coursebuild.core.pages.characters import visible
from coursebuild.core.pages.links import ids_and_addresses
from coursebuild.core.pages.shared import page_characters


class ProcessedHtml(Struct, frozen=True):
    """See the module."""

    html: str
    text: frozenset[str]
    """Characters of its text, but most of those of ASCII."""
    mathematics: frozenset[str]
    """Characters of its formulas, but those of ASCII; a blank where there is a formula."""
    declarations: frozenset[str]
    """Styles that were written in its elements."""
    ids: frozenset[str]
    addresses: frozenset[str]
    """As they are written, but for character references."""


def postprocess_html(html: str) -> ProcessedHtml:
    """A page that was just drawn, or a part of one that is whole elements."""
    html = str(html)  # `Markup` would escape what is put into it
    html, declarations = styles.hoist(formulas.glue(html))
    text, mathematics = page_characters(html)
    html = visible(html)
    return ProcessedHtml(html, text, mathematics, declarations, *ids_and_addresses(html))
