"""The page of the search.

Entry point: `search_sheet(library)`; `search_words`, the texts that come with the index.
"""

from __future__ import annotations

from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import PageInputs

_LIVE = "search.live."


def search_inputs(library: Library) -> PageInputs:
    """A form, which the page's script brings to life."""
    place = urls.Place(urls.SEARCH)
    words = library.words
    return PageInputs(
        urls.SEARCH,
        "search",
        words("search.title"),
        words("search.description"),
        "search.html",
        {"home": place.href(urls.HOME), "action": place.href(urls.SEARCH)},
        indexed=False,
    )


def search_words(library: Library) -> dict[str, str]:
    """Texts of the interface that a page carries only with its search, by the end of their key."""
    entries = library.words.entries
    return {key.removeprefix(_LIVE): text for key, text in entries if key.startswith(_LIVE)}
