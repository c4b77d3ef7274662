"""Drawn HTML as the part of XHTML that QTI 2.1 allows.

Entry points: `Flow(link, picture)`, and its `blocks` and `line`; `lost` says what was not kept.

QTI 2.1 has the text of XHTML (information model, chapter "Content Model"), pictures, links, tables
and MathML, and nothing that moves, plays or asks. An element that it does not have is opened where
only its content counts (a box, a mark of highlighted code), or left out and told in `lost`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeGuard
from urllib.parse import urlsplit

from coursebuild.core.pages.html_tree import HtmlContent, HtmlElement, parse_html
from coursebuild.core.pages.xml import Element, add, element
from coursebuild.features.qti.mathml import mathml

STRUCK = "struck"
"""A class of the package's style sheet."""
_BLOCKS = frozenset(
    "address article aside blockquote center details dialog div dl fieldset figcaption figure"
    " footer form h1 h2 h3 h4 h5 h6 header hgroup hr main nav ol p pre section summary table"
    " ul".split()
)
_INLINE = frozenset(
    "abbr acronym b big cite code dfn em i kbd q samp small strong sub sup tt var".split()
)
_NEVER_IN_PRE = frozenset("big small sub sup".split())
_HEADINGS = frozenset("h1 h2 h3 h4 h5 h6 address".split())
_EMPHASIS = frozenset("ins mark u".split())
_STRUCK = frozenset("del s strike".split())
_GONE = frozenset("area base col dialog link meta param script source style template title".split())
"""What shows nothing by itself."""
_ACTIVE = frozenset(
    "applet audio button canvas datalist embed iframe input keygen map meter object optgroup option"
    " output progress select svg textarea track video".split()
)
_ANCHOR = "anchor"
"""The class of links of headings to themselves, which a page adds for its own readers."""
_NUMBER = re.compile(r"[0-9]{1,5}")


class Flow:
    """Brings texts into the package, one after the other."""

    def __init__(
        self, link: Callable[[str], str | None], picture: Callable[[str], str | None]
    ) -> None:
        """`link` and `picture` say where an address on the drawn page leads in the package.

        They give `None` where it leads nowhere.
        """
        self._link_of = link
        self._picture_of = picture
        self.lost: list[str] = []
        """What was not kept, a sentence each, without repeats."""

    def blocks(self, html: str) -> list[Element]:
        """Blocks: what an item's body, an option or a feedback may hold."""
        return list(self._blocks(_joined(parse_html(html))))

    def line(self, html: str) -> list[Element | str]:
        """A line of text: what a paragraph may hold."""
        return list(self._line(_joined(parse_html(html))))

    def _lose(self, what: str) -> None:
        if what not in self.lost:
            self.lost.append(what)

    # --- blocks

    def _blocks(self, content: Iterable[HtmlContent]) -> Iterator[Element]:
        """Blocks, with a paragraph around each run of lines between them."""
        run: list[HtmlContent] = []
        for child in content:
            if isinstance(child, HtmlElement) and _is_block(child):
                yield from self._with_text("p", run)
                run = []
                yield from self._block(child)
            else:
                run.append(child)
        yield from self._with_text("p", run)

    def _with_text(self, name: str, run: Sequence[HtmlContent]) -> Iterator[Element]:
        """A block of one line, where there is something in it."""
        made = element(name, {}, *self._line(run))
        if len(made) or (made.text or "").strip():
            yield made

    def _block(self, node: HtmlElement) -> Iterator[Element]:
        name = node.name
        if name in _HEADINGS:
            yield from self._with_text(name, node.children)
        elif name == "pre":
            made = element("pre", {}, *self._line(node.children, pre=True))
            _trim(made)
            yield made
        elif name == "hr":
            yield element("hr")
        elif name in ("ul", "ol"):
            yield from self._list(node)
        elif name == "dl":
            parts = [self._holder(one.name, one) for one in node.nearest("dt", "dd")]
            yield from [element("dl", {}, *parts)] if parts else ()
        elif name == "table":
            yield from self._table(node)
        else:
            if name == "details":
                self._lose("`<details>` is open")
            inner = list(self._blocks(node.children))
            if name == "blockquote" and inner:
                yield element("blockquote", {}, *inner)
            else:
                yield from [element("div", {}, *inner)] if len(inner) > 1 and name != "p" else inner

    def _list(self, node: HtmlElement) -> Iterator[Element]:
        if node.attributes.get("start", "1") != "1" or "reversed" in node.attributes:
            self._lose("a numbered list counts from 1")
        items = [
            self._holder("li", one if _is_item(one) else HtmlElement("li", {}, [one]))
            for one in node.children
            if not isinstance(one, str) or one.strip()
        ]
        yield from [element(node.name, {}, *items)] if items else ()

    def _holder(
        self, name: str, node: HtmlElement, attributes: dict[str, str] | None = None
    ) -> Element:
        """What may hold lines as well as blocks; a term holds a line alone."""
        made = element(name, attributes)
        if name != "dt" and any(map(_is_block, node.elements)):
            add(made, *self._blocks(node.children))
        else:
            add(made, *self._line(node.children))
        return made

    def _table(self, node: HtmlElement) -> Iterator[Element]:
        """A table with one head at most and a body, which QTI requires; captions stand before."""
        head: list[Element] = []
        body: list[Element] = []
        for child in sorted(node.elements, key=lambda child: child.name == "tfoot"):
            if child.name == "caption":
                yield from self._blocks(child.children)
                continue
            for row in child.nearest("tr"):
                cells = list(map(self._cell, row.nearest("td", "th")))
                rows = head if child.name == "thead" else body
                rows += [element("tr", {}, *cells)] if cells else []
        if not body:
            head, body = [], head
        if body:
            top = element("thead", {}, *head) if head else None
            yield element("table", {}, top, element("tbody", {}, *body))

    def _cell(self, cell: HtmlElement) -> Element:
        kept = {k: v for k, v in cell.attributes.items() if k in ("colspan", "rowspan")}
        kept = {key: value for key, value in kept.items() if _NUMBER.fullmatch(value)}
        scope = cell.attributes.get("scope", "")
        if scope in ("row", "col", "rowgroup", "colgroup"):
            kept["scope"] = scope
        aligned = [c for c in sorted(cell.classes) if c in ("align-center", "align-right")]
        return self._holder(cell.name, cell, kept | ({"class": aligned[0]} if aligned else {}))

    # --- lines

    def _line(
        self, content: Iterable[HtmlContent], *, pre: bool = False
    ) -> Iterator[Element | str]:
        for child in content:
            if isinstance(child, str):
                yield child if pre else re.sub(r"[ \t\n\r\f]+", " ", child)
            else:
                yield from self._inline(child, pre)

    def _inline(self, node: HtmlElement, pre: bool) -> Iterator[Element | str]:
        name, inner = node.name, node.children
        if name in _GONE or _ANCHOR in node.classes:
            return
        if name == "math":
            yield mathml(node)
        elif name in _INLINE and not (pre and name in _NEVER_IN_PRE):
            yield element(name, {}, *self._line(inner, pre=pre))
            title = node.attributes.get("title", "").strip()
            if name in ("abbr", "acronym", "dfn") and title:
                yield f" ({title})"
        elif name == "br":
            yield "\n" if pre else element("br")
        elif name == "img":
            yield self._picture(node)
        elif name == "a":
            yield from self._link(node, pre)
        elif name in _STRUCK:
            self._lose("crossed-out text is marked by a class, which some platforms do not show")
            yield element("span", {"class": STRUCK}, *self._line(inner, pre=pre))
        elif name in _EMPHASIS:
            yield element("em", {}, *self._line(inner, pre=pre))
        elif name == "input" and node.attributes.get("type", "").lower() == "checkbox":
            yield "☑" if "checked" in node.attributes else "☐"
        elif name in _ACTIVE:
            self._lose(f"`<{name}>` has no place in QTI and is left out")
        else:
            yield from self._line(inner, pre=pre)

    def _picture(self, node: HtmlElement) -> Element | str:
        source, alt = node.attributes.get("src", ""), node.attributes.get("alt", "")
        place = self._picture_of(source)
        if place is None:
            self._lose(f"the picture `{source}` is replaced by its words")
            return alt
        size = {k: v for k, v in node.attributes.items() if k in ("height", "width")}
        size = {key: value for key, value in size.items() if _NUMBER.fullmatch(value)}
        return element("img", {"src": place, "alt": alt} | dict(sorted(size.items())))

    def _link(self, node: HtmlElement, pre: bool) -> Iterator[Element | str]:
        address = node.attributes.get("href", "")
        inner = self._line(node.children, pre=pre)
        place = self._link_of(address) if address else None
        if place is not None:
            yield element("a", {"href": place}, *inner)
            return
        if address:
            why = "" if urlsplit(address).scheme else ", as the course has no `base_url`"
            self._lose(f"the link to `{address}` is text{why}")
        yield from inner


def _trim(made: Element) -> None:
    """Take away the line ends at the end of a block of code."""
    while len(made) and not (made[-1].tail or "").strip("\n"):
        made[-1].tail = None
        made = made[-1]
    if len(made):
        made[-1].tail = (made[-1].tail or "").rstrip("\n")
    else:
        made.text = (made.text or "").rstrip("\n")


def _is_block(node: HtmlElement) -> bool:
    """Whether an element is, or holds, a block."""
    if node.name == "math" or node.name in _ACTIVE or node.name in _GONE:
        return False
    return node.name in _BLOCKS or any(map(_is_block, node.elements))


def _joined(content: Iterable[HtmlContent]) -> list[HtmlContent]:
    """Content in which formulas that were cut so that a line may break in them are whole again."""
    made: list[HtmlContent] = []
    for child in _without_spans(content):
        last = made[-1] if made else None
        if isinstance(child, HtmlElement):
            child = HtmlElement(child.name, child.attributes, _joined(child.children))
            if _is_in_line(child) and isinstance(last, HtmlElement) and _is_in_line(last):
                made[-1] = HtmlElement("math", last.attributes, [*last.children, *child.children])
                continue
        made.append(child)
    return made


def _without_spans(content: Iterable[HtmlContent]) -> Iterator[HtmlContent]:
    """Content without boxes that say nothing by themselves."""
    for child in content:
        if isinstance(child, HtmlElement) and child.name == "span":
            yield from _without_spans(child.children)
        else:
            yield child


def _is_item(content: HtmlContent) -> TypeGuard[HtmlElement]:
    return isinstance(content, HtmlElement) and content.name == "li"


def _is_in_line(node: HtmlElement) -> bool:
    """Whether an element is a formula in a line of text."""
    return node.name == "math" and node.attributes.get("display") != "block"
