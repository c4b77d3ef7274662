"""HTML of our own templates as Markdown: the course map, levels, models, figures.

What only serves the page is left out: navigation, buttons, drawings. Headings, lists, tables,
definition lists, code and links become Markdown; of other elements their text remains.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from coursebuild.api import marks
from coursebuild.core.pages.html_xml import HtmlContent, HtmlElement, parse_html

_SKIPPED_ELEMENTS = frozenset(
    "nav script style svg template button form input select label dialog".split()
)
_BLOCKS = frozenset(
    "address article aside blockquote caption dd details div dl dt fieldset figcaption figure"
    " footer h1 h2 h3 h4 h5 h6 header hr li main ol p pre section summary table tbody td tfoot th"
    " thead tr ul".split()
)
_HEADINGS = frozenset("h1 h2 h3 h4 h5 h6".split())


def html_to_markdown(html: str, locate: Callable[[str], str]) -> str:
    """Return the Markdown of some HTML; `locate` converts addresses."""
    return "\n\n".join(_Converter(locate).blocks(parse_html(html)))


class _Converter:
    def __init__(self, locate: Callable[[str], str]) -> None:
        self.locate = locate

    def blocks(self, content: list[HtmlContent]) -> list[str]:
        """Convert the blocks in an element; a run of inline content is a paragraph."""
        blocks: list[str] = []
        line: list[HtmlContent] = []
        for child in (*content, None):
            if child is not None and (isinstance(child, str) or child.name not in _BLOCKS):
                if isinstance(child, str) or child.name not in _SKIPPED_ELEMENTS:
                    line.append(child)
                continue
            text = marks.guard_lines(self._line(line))
            line = []
            blocks += [text] if text else []
            if isinstance(child, HtmlElement):
                blocks += filter(None, self._block(child))
        return blocks

    def _block(self, node: HtmlElement) -> Iterator[str]:
        name = node.name
        if name in _HEADINGS:
            text = self._line(node.children)
            yield f"{'#' * int(name[1])} {text}" if text else ""
        elif name in ("ul", "ol"):
            yield self._list(node)
        elif name == "pre":
            names = (
                n for code in node.nearest("code") for n in code.attributes.get("class", "").split()
            )
            languages = (n.removeprefix("language-") for n in names if n.startswith("language-"))
            yield marks.fence(next(languages, ""), node.text)
        elif name == "table":
            yield self._table(node)
        elif name == "dl":
            yield self._terms(node)
        elif name == "blockquote":
            yield marks.block_quote("\n\n".join(self.blocks(node.children)))
        elif name == "hr":
            yield "___"
        elif name in ("summary", "figcaption", "caption") and not any(
            isinstance(child, HtmlElement) and child.name in _HEADINGS for child in node.children
        ):
            text = self._line(node.children)
            yield f"**{text}**" if text else ""
        else:
            yield from self.blocks(node.children)

    def _list(self, node: HtmlElement) -> str:
        items = [child for child in node.children if isinstance(child, HtmlElement)]
        number = int(node.attributes.get("start") or 1)
        texts: list[str] = []
        for item in items:
            value = item.attributes.get("value")
            number = int(value) if value and value.isdigit() else number
            mark = "- " if node.name == "ul" else f"{number}. "
            number += 1
            texts.append(marks.hang(mark, "\n\n".join(self.blocks(item.children))))
        is_loose = any("\n\n" in text for text in texts)
        return ("\n\n" if is_loose else "\n").join(texts)

    def _terms(self, node: HtmlElement) -> str:
        rows: list[str] = []
        for child in node.nearest("dt", "dd"):
            text = " ".join(" ".join(self.blocks(child.children)).split())
            if child.name == "dt":
                rows.append(f"- {text}:")
            elif rows:
                rows[-1] += f" {text}"
        return "\n".join(rows)

    def _table(self, node: HtmlElement) -> str:
        rows = [cells for row in node.nearest("tr") if (cells := list(row.nearest("th", "td")))]
        if not rows:
            return ""
        texts = []
        for cells in rows:
            row = list[str]()
            for cell in cells:
                row.append(" ".join(" ".join(self.blocks(cell.children)).split()))
                row += [""] * (int(cell.attributes.get("colspan") or 1) - 1)
            texts.append(row)
        width = max(map(len, texts))
        texts = [[*row, *[""] * (width - len(row))] for row in texts]
        has_head = not any(cell.name == "td" for cell in rows[0])
        head = texts.pop(0) if has_head else [""] * width
        return marks.table(head, texts)

    # --- lines

    def _line(self, nodes: list[HtmlContent]) -> str:
        return re.sub(r"\s+", " ", "".join(map(self._inline, nodes))).strip()

    def _inline(self, node: HtmlContent) -> str:
        if isinstance(node, str):
            return marks.escape_marks(node)
        inner = "".join(map(self._inline, node.children))
        match node.name:
            case name if name in _SKIPPED_ELEMENTS:
                return ""
            case "a":
                href = node.attributes.get("href")
                text = " ".join(inner.split())
                return marks.link(text, self.locate(href)) if href and text else inner
            case "code" | "kbd" | "samp":
                text = " ".join(node.text.split())
                return marks.code_span(text) if text else ""
            case "strong" | "b":
                return f"**{inner.strip()}**" if inner.strip() else ""
            case "em" | "i" | "dfn":
                return f"*{inner.strip()}*" if inner.strip() else ""
            case "img":
                source = node.attributes.get("src")
                return (
                    marks.picture(node.attributes.get("alt") or "", self.locate(source))
                    if source
                    else ""
                )
            case "sup" | "sub":
                return f"<{node.name}>{inner}</{node.name}>" if inner else ""
            case "br":
                return " "
            case "math":
                tex = next((annotation.text for annotation in node.nearest("annotation")), "")
                return f"${tex.strip()}$" if tex else marks.escape_marks(node.text)
            case "span" if node.attributes.get("class") == "sep":
                return f" {inner} "
            case _:
                return inner
