"""The pages that the site adds to those of a course, as the foot of each page has them.

Entry point: `own_pages(library)`: the one place that says which there are, in their order.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library


class OwnPage(Struct, frozen=True):
    """A page of the site that no author wrote."""

    path: str
    """Its site path."""
    title: str
    """As the foot calls it."""


def own_pages(library: Library) -> tuple[OwnPage, ...]:
    """Those that this course has: first what looks things up, then the reader's own."""
    return tuple(_listed(library))


def _listed(library: Library) -> Iterator[OwnPage]:
    words = library.words
    yield OwnPage(urls.SEARCH, words("search.title"))
    if library.references.terms:
        yield OwnPage(urls.GLOSSARY, words("glossary.title"))
    if library.references.has_symbols:
        yield OwnPage(urls.SYMBOLS, words("symbols.title"))
    if library.reports.cases:
        yield OwnPage(urls.NUMERICS, words("numerics.title"))
    yield OwnPage(urls.PROGRESS, words("progress.title"))
    if library.asked:
        yield OwnPage(urls.REVIEW, words("review.title"))
    yield OwnPage(urls.OFFLINE, words("offline.title"))
