"""A drawn page, ready for its frame, and what the rest of the site must know of it.

Entry point: `record(draft, base_url)`.
"""

from __future__ import annotations

from markupsafe import Markup
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.pages import fonts
from coursebuild.core.pages.draft import Draft
from coursebuild.core.pages.frame import parts_of
from coursebuild.core.pages.links import Reference, references, without_lines
from coursebuild.core.pages.postprocess import postprocess_html
from coursebuild.core.pages.shared import PageFacts


class PageRecord(Struct, frozen=True):
    """What the site must know of a page to put it together, but for the page's body."""

    draft: Draft
    """Without its body."""
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

    @property
    def facts(self) -> PageFacts:
        """What the shared files must know."""
        return PageFacts(
            frozenset(self.text), frozenset(self.mathematics), frozenset(self.declarations)
        )


def record(draft: Draft, base_url: str) -> tuple[PageRecord, str]:
    """The record of a page that was just drawn, and its body as it will be published."""
    made = postprocess_html(str(draft.body))
    found = PageRecord(
        draft=replace(draft, body=Markup()),
        parts=parts_of(made.html, draft.kind),
        text="".join(sorted(made.text.union(draft.title) - fonts.BASE)),
        mathematics="".join(sorted(made.mathematics)),
        declarations=tuple(sorted(made.declarations)),
        ids=tuple(sorted(without_lines(made.ids))),
        references=tuple(sorted(references(draft.path, made.addresses, base_url))),
    )
    return found, made.html
