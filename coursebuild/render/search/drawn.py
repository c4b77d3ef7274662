"""A drawn page as sections that are searched, for pages that are made from no document.

Entry point: `drawn_sections(body)`.
"""

from __future__ import annotations

from html.parser import HTMLParser

from coursebuild.render.search.values import Piece, Section

_HEADINGS = {f"h{level}": level for level in range(1, 7)}
_HIDDEN = frozenset(("script", "style", "nav", "svg", "pre", "template", "button", "select"))
"""Elements that say nothing to a search; code is known from the page's sheet."""
_LINES = frozenset(
    "p li dt dd td th tr table ul ol dl div section article figure figcaption summary main".split()
)
_VOID = frozenset("area base br col embed hr img input link meta source track wbr".split())


def drawn_sections(body: str) -> tuple[Section, ...]:
    """The sections of a page's body."""
    reader = _Reader()
    reader.feed(body)
    reader.close()
    return reader.ended()


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self._done: list[Section] = []
        self._open: list[str] = []
        self._anchor, self._heading, self._level = "", "", 0
        self._pieces: list[Piece] = []
        self._text: list[str] = []
        self._hidden = 0
        self._id = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Headings begin sections, other blocks lines."""
        if tag in _VOID:
            return
        if tag in _HIDDEN:
            self._hidden += 1
        if tag in _HEADINGS:
            self._line()
            self._id = dict(attrs).get("id") or ""
        elif tag in _LINES:
            self._line()
        self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """The same."""
        if tag not in self._open:
            return
        while self._open.pop() != tag:
            pass
        self._hidden = sum(name in _HIDDEN for name in self._open)
        if tag in _HEADINGS:
            heading = self._said()
            if tag != "h1":  # which is the page's title
                self._end()
                self._anchor, self._heading, self._level = self._id, heading, _HEADINGS[tag]
        elif tag in _LINES:
            self._line()

    def handle_data(self, data: str) -> None:
        """Text."""
        if not self._hidden:
            self._text.append(data)

    def ended(self) -> tuple[Section, ...]:
        """All sections."""
        self._line()
        self._end()
        return tuple(self._done)

    def _said(self) -> str:
        text = " ".join("".join(self._text).split())
        self._text.clear()
        return text

    def _line(self) -> None:
        text = self._said()
        if text:
            self._pieces.append(Piece("text", text))

    def _end(self) -> None:
        if self._heading or self._pieces:
            pieces = tuple(self._pieces)
            self._done.append(Section(self._anchor, self._heading, self._level, pieces))
        self._pieces = []
