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

from coursebuild.core.pages.html_tree import HtmlContent, HtmlElement, parse_html
from coursebuild.core.pages.marks import (
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

_SKIPPED = frozenset("nav script style svg template button form input select label dialog".split())
_BLOCKS = frozenset(
    "address article aside blockquote caption dd details div dl dt fieldset figcaption figure"
    " footer h1 h2 h3 h4 h5 h6 header hr li main ol p pre section summary table tbody td tfoot th"
    " thead tr ul".split()
)
_HEADINGS = frozenset("h1 h2 h3 h4 h5 h6".split())


def markdown_of(html: str, locate: Callable[[str], str]) -> str:
    """The text of a page; `locate` says what becomes of an address."""
    return "\n\n".join(_Blocks(locate).of(parse_html(html)))


class _Blocks:
    def __init__(self, locate: Callable[[str], str]) -> None:
        self.locate = locate

    def of(self, content: list[HtmlContent]) -> list[str]:
        """The blocks in an element; what stands there in line is a paragraph."""
        found: list[str] = []
        line: list[HtmlContent] = []
        for child in (*content, None):
            if child is not None and (isinstance(child, str) or child.name not in _BLOCKS):
                if isinstance(child, str) or child.name not in _SKIPPED:
                    line.append(child)
                continue
            text = guarded(self._line(line))
            line = []
            found += [text] if text else []
            if isinstance(child, HtmlElement):
                found += filter(None, self._block(child))
        return found

    def _block(self, node: HtmlElement) -> Iterator[str]:
        name = node.name
        if name in _HEADINGS:
            text = self._line(node.children)
            yield f"{'#' * int(name[1])} {text}" if text else ""
        elif name in ("ul", "ol"):
            yield self._list(node)
        elif name == "pre":
            yield fence(_language(node), node.text)
        elif name == "table":
            yield self._table(node)
        elif name == "dl":
            yield self._terms(node)
        elif name == "blockquote":
            yield quoted("\n\n".join(self.of(node.children)))
        elif name == "hr":
            yield "___"
        elif name in ("summary", "figcaption", "caption"):
            text = self._line(node.children)
            yield f"**{text}**" if text else ""
        else:
            yield from self.of(node.children)

    def _list(self, node: HtmlElement) -> str:
        items = [child for child in node.children if isinstance(child, HtmlElement)]
        number = int(node.attributes.get("start") or 1)
        written: list[str] = []
        for item in items:
            value = item.attributes.get("value")
            number = int(value) if value and value.isdigit() else number
            mark = "- " if node.name == "ul" else f"{number}. "
            number += 1
            written.append(hang(mark, "\n\n".join(self.of(item.children))))
        loose = any("\n\n" in one for one in written)
        return ("\n\n" if loose else "\n").join(written)

    def _terms(self, node: HtmlElement) -> str:
        rows: list[str] = []
        for child in node.nearest("dt", "dd"):
            text = " ".join(" ".join(self.of(child.children)).split())
            if child.name == "dt":
                rows.append(f"- {text}:")
            elif rows:
                rows[-1] += f" {text}"
        return "\n".join(rows)

    def _table(self, node: HtmlElement) -> str:
        rows = [
            (any(c.name == "td" for c in cells), cells)
            for row in node.nearest("tr")
            if (cells := list(row.nearest("th", "td")))
        ]
        if not rows:
            return ""
        width = max(len(cells) for _, cells in rows)
        written = [[self._cell(cell) for cell in cells] for _, cells in rows]
        written = [[*row, *[""] * (width - len(row))] for row in written]
        head = written.pop(0) if not rows[0][0] else [""] * width
        return table(head, written)

    def _cell(self, node: HtmlElement) -> str:
        return " ".join(" ".join(self.of(node.children)).split())

    # --- lines

    def _line(self, nodes: list[HtmlContent]) -> str:
        return re.sub(r"\s+", " ", "".join(map(self._inline, nodes))).strip()

    def _inline(self, node: HtmlContent) -> str:
        if isinstance(node, str):
            return escaped(node)
        inner = "".join(map(self._inline, node.children))
        match node.name:
            case name if name in _SKIPPED:
                return ""
            case "a":
                href = node.attributes.get("href")
                text = " ".join(inner.split())
                return link(text, self.locate(href)) if href and text else inner
            case "code" | "kbd" | "samp":
                text = " ".join(node.text.split())
                return code_span(text) if text else ""
            case "strong" | "b":
                return f"**{inner.strip()}**" if inner.strip() else ""
            case "em" | "i" | "dfn":
                return f"*{inner.strip()}*" if inner.strip() else ""
            case "img":
                source = node.attributes.get("src")
                return (
                    picture(node.attributes.get("alt") or "", self.locate(source)) if source else ""
                )
            case "sup" | "sub":
                return f"<{node.name}>{inner}</{node.name}>" if inner else ""
            case "br":
                return " "
            case "math":
                tex = next((one.text for one in node.nearest("annotation")), "")
                return f"${tex.strip()}$" if tex else escaped(node.text)
            case "span" if node.attributes.get("class") == "sep":
                return f" {inner} "
            case _:
                return inner


def _language(node: HtmlElement) -> str:
    for code in node.nearest("code"):
        for name in code.attributes.get("class", "").split():
            if name.startswith("language-"):
                return name.removeprefix("language-")
    return ""
