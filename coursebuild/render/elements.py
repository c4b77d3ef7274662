"""The tags of an HTML page, by a real parser.

Entry point: `StartTags.of(html)`.
"""

from __future__ import annotations

from html.parser import HTMLParser
from typing import TypeAlias

StartTag: TypeAlias = tuple[str, list[tuple[str, str | None]], int]
"""Name of the element, its attributes, and its line from 1."""


class StartTags(HTMLParser):
    """Collects where elements begin."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[StartTag] = []

    @classmethod
    def of(cls, html: str) -> list[StartTag]:
        """All of a page."""
        reader = cls()
        reader.feed(html)
        reader.close()
        return reader.found

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element."""
        self.found.append((tag, attrs, self.getpos()[0]))
