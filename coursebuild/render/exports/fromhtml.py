"""HTML of our own templates as Markdown: the map of the course, levels, models, figures.

Entry point: `markdown_of(html, locate)`.

1. The HTML becomes a tree of blocks and lines, as its tags say.
2. What only serves the page is left out: ways through the site, buttons, drawings.
3. Headings, lists, tables, terms with their meanings, code and links become Markdown; what has no
   form there becomes its text.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from html import unescape

from msgspec import Struct, field

from coursebuild.render.exports.marks import (
    code_span,
    escaped,
    fence,
    guarded,
    hang,
    link,
    picture,
    quoted,
    table,
)
from coursebuild.render.exports.tags import VOID, End, Start, pieces

_SKIPPED = frozenset("nav script style svg template button form input select label dialog".split())
_BLOCKS = frozenset(
    "address article aside blockquote caption dd details div dl dt fieldset figcaption figure"
    " footer h1 h2 h3 h4 h5 h6 header hr li main ol p pre section summary table tbody td tfoot th"
    " thead tr ul".split()
)
_HEADINGS = frozenset("h1 h2 h3 h4 h5 h6".split())
_IMPLIED = {"li": ("li",), "dt": ("dt", "dd"), "dd": ("dt", "dd"), "tr": ("tr", "td", "th")}
_IMPLIED |= {"td": ("td", "th"), "th": ("td", "th"), "p": ("p",)}
"""What the start of an element ends, where its end was left out."""


class _Node(Struct, frozen=True):
    start: Start
    children: list[_Node | str] = field(default_factory=list)

    @property
    def name(self) -> str:
        return self.start.name


def markdown_of(html: str, locate: Callable[[str], str]) -> str:
    """The text of a page; `locate` says what becomes of an address."""
    return "\n\n".join(_Blocks(locate).of(_tree(html)))


def _tree(html: str) -> _Node:
    root = _Node(Start("main", (), False))
    open_: list[_Node] = [root]
    for piece in pieces(html):
        if isinstance(piece, str):
            open_[-1].children.append(unescape(piece) if "&" in piece else piece)
        elif isinstance(piece, Start):
            if piece.name in _IMPLIED and open_[-1].name in _IMPLIED[piece.name]:
                open_.pop()
            node = _Node(piece)
            open_[-1].children.append(node)
            if piece.name not in VOID and not piece.closed:
                open_.append(node)
        elif len(open_) > 1 and open_[-1].name == piece.name:
            open_.pop()
        else:
            _close(open_, piece)
    return root


def _close(open_: list[_Node], end: End) -> None:
    at = next((n for n in range(len(open_) - 1, 0, -1) if open_[n].name == end.name), 0)
    if at:
        del open_[at:]


class _Blocks:
    def __init__(self, locate: Callable[[str], str]) -> None:
        self.locate = locate

    def of(self, node: _Node) -> list[str]:
        """The blocks in an element; what stands there in line is a paragraph."""
        found: list[str] = []
        line: list[_Node | str] = []
        for child in (*node.children, None):
            if child is not None and (isinstance(child, str) or child.name not in _BLOCKS):
                if isinstance(child, str) or child.name not in _SKIPPED:
                    line.append(child)
                continue
            text = guarded(self._line(line))
            line = []
            found += [text] if text else []
            if isinstance(child, _Node):
                found += filter(None, self._block(child))
        return found

    def _block(self, node: _Node) -> Iterator[str]:
        name = node.name
        if name in _HEADINGS:
            text = self._line(node.children)
            yield f"{'#' * int(name[1])} {text}" if text else ""
        elif name in ("ul", "ol"):
            yield self._list(node)
        elif name == "pre":
            yield fence(_language(node), _text(node))
        elif name == "table":
            yield self._table(node)
        elif name == "dl":
            yield self._terms(node)
        elif name == "blockquote":
            yield quoted("\n\n".join(self.of(node)))
        elif name == "hr":
            yield "___"
        elif name in ("summary", "figcaption", "caption"):
            text = self._line(node.children)
            yield f"**{text}**" if text else ""
        else:
            yield from self.of(node)

    def _list(self, node: _Node) -> str:
        items = [child for child in node.children if isinstance(child, _Node)]
        number = int(node.start.get("start") or 1)
        written: list[str] = []
        for item in items:
            value = item.start.get("value")
            number = int(value) if value and value.isdigit() else number
            mark = "- " if node.name == "ul" else f"{number}. "
            number += 1
            written.append(hang(mark, "\n\n".join(self.of(item))))
        loose = any("\n\n" in one for one in written)
        return ("\n\n" if loose else "\n").join(written)

    def _terms(self, node: _Node) -> str:
        rows: list[str] = []
        for child in _inside(node, ("dt", "dd")):
            text = " ".join(" ".join(self.of(child)).split())
            if child.name == "dt":
                rows.append(f"- {text}:")
            elif rows:
                rows[-1] += f" {text}"
        return "\n".join(rows)

    def _table(self, node: _Node) -> str:
        rows = [
            (any(c.name == "td" for c in cells), cells)
            for row in _inside(node, ("tr",))
            if (cells := list(_inside(row, ("th", "td"))))
        ]
        if not rows:
            return ""
        width = max(len(cells) for _, cells in rows)
        written = [[self._cell(cell) for cell in cells] for _, cells in rows]
        written = [[*row, *[""] * (width - len(row))] for row in written]
        head = written.pop(0) if not rows[0][0] else [""] * width
        return table(head, written)

    def _cell(self, node: _Node) -> str:
        return " ".join(" ".join(self.of(node)).split())

    # --- lines

    def _line(self, nodes: list[_Node | str]) -> str:
        return re.sub(r"\s+", " ", "".join(map(self._inline, nodes))).strip()

    def _inline(self, node: _Node | str) -> str:
        if isinstance(node, str):
            return escaped(node)
        inner = "".join(map(self._inline, node.children))
        match node.name:
            case name if name in _SKIPPED:
                return ""
            case "a":
                href = node.start.get("href")
                text = " ".join(inner.split())
                return link(text, self.locate(href)) if href and text else inner
            case "code" | "kbd" | "samp":
                text = " ".join(_text(node).split())
                return code_span(text) if text else ""
            case "strong" | "b":
                return f"**{inner.strip()}**" if inner.strip() else ""
            case "em" | "i" | "dfn":
                return f"*{inner.strip()}*" if inner.strip() else ""
            case "img":
                source = node.start.get("src")
                return picture(node.start.get("alt") or "", self.locate(source)) if source else ""
            case "sup" | "sub":
                return f"<{node.name}>{inner}</{node.name}>" if inner else ""
            case "br":
                return " "
            case "math":
                tex = next((_text(one) for one in _inside(node, ("annotation",))), "")
                return f"${tex.strip()}$" if tex else escaped(_text(node))
            case "span" if node.start.get("class") == "sep":
                return f" {inner} "
            case _:
                return inner


def _inside(node: _Node, names: tuple[str, ...]) -> Iterator[_Node]:
    """The nearest elements of these names inside, in order."""
    for child in node.children:
        if isinstance(child, _Node):
            if child.name in names:
                yield child
            else:
                yield from _inside(child, names)


def _text(node: _Node) -> str:
    return "".join(c if isinstance(c, str) else _text(c) for c in node.children)


def _language(node: _Node) -> str:
    for code in _inside(node, ("code",)):
        for name in (code.start.get("class") or "").split():
            if name.startswith("language-"):
                return name.removeprefix("language-")
    return ""
