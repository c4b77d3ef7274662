"""Drawn HTML as a tree, whatever an author wrote into it.

Entry point: `parse_html(text)`.

What HTML lets a writer leave out is put in: end tags of paragraphs, items, rows and cells. An end
tag that closes nothing is passed over, and what is open at the end is closed there.
"""

from __future__ import annotations

from collections.abc import Iterator
from html.parser import HTMLParser
from typing import TypeAlias

from msgspec import Struct, field

Content: TypeAlias = "Node | str"

VOID = frozenset("area base br col embed hr img input link meta source track wbr".split())
BLOCKS = frozenset(
    "address article aside blockquote center details dialog div dl fieldset figcaption figure"
    " footer form h1 h2 h3 h4 h5 h6 header hgroup hr main nav ol p pre section summary table"
    " ul".split()
)
_CLOSED_BY = {
    "li": frozenset({"li"}),
    "dt": frozenset({"dt", "dd"}),
    "dd": frozenset({"dt", "dd"}),
    "tr": frozenset({"tr", "td", "th"}),
    "td": frozenset({"td", "th"}),
    "th": frozenset({"td", "th"}),
    "thead": frozenset({"tr", "td", "th", "thead", "tbody", "tfoot", "caption", "colgroup"}),
    "tbody": frozenset({"tr", "td", "th", "thead", "tbody", "tfoot", "caption", "colgroup"}),
    "tfoot": frozenset({"tr", "td", "th", "thead", "tbody", "tfoot", "caption", "colgroup"}),
    "option": frozenset({"option"}),
}
"""What the start of an element closes, as far as it is open in the same list or table."""
_LIMITS = frozenset({"ul", "ol", "dl", "table", "select"})


class Node(Struct, frozen=True):
    """An element."""

    name: str
    attributes: dict[str, str]
    children: list[Content] = field(default_factory=list)

    @property
    def elements(self) -> Iterator[Node]:
        """The elements directly in it."""
        return (child for child in self.children if isinstance(child, Node))

    @property
    def text(self) -> str:
        """All text in it."""
        return "".join(c if isinstance(c, str) else c.text for c in self.children)

    @property
    def classes(self) -> frozenset[str]:
        """The words of its `class`."""
        return frozenset(self.attributes.get("class", "").split())


def parse_html(text: str) -> tuple[Content, ...]:
    """The content of a piece of HTML."""
    reader = _Reader()
    reader.feed(text)
    reader.close()
    return tuple(reader.root.children)


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.root = Node("", {})
        self.open = [self.root]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._imply_ends(tag)
        found: dict[str, str] = {}
        for key, value in attrs:
            found.setdefault(key, value or "")
        node = Node(tag, found)
        self.open[-1].children.append(node)
        if tag not in VOID:
            self.open.append(node)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        inside = any(node.name in ("math", "svg") for node in self.open[:-1])
        if tag not in VOID and (inside or tag in ("math", "svg")):
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        names = [node.name for node in self.open]
        if tag in names[1:]:
            del self.open[len(names) - 1 - names[::-1].index(tag) :]

    def handle_data(self, data: str) -> None:
        self.open[-1].children.append(data)

    def _imply_ends(self, tag: str) -> None:
        closed = _CLOSED_BY.get(tag, frozenset())
        for at in range(len(self.open) - 1, 0, -1):
            name = self.open[at].name
            if name in _LIMITS:
                break
            if name in closed:
                del self.open[at:]
                self._imply_ends(tag)
                return
        if tag in BLOCKS and self.open[-1].name == "p":
            self.open.pop()
