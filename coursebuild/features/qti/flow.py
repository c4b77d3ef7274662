"""The HTML of pages as the part of XHTML that QTI 2.1 allows.

QTI 2.1 has the text of XHTML (information model, chapter "Content Model"), pictures, links, tables
and MathML, and nothing that moves, plays or asks. Of an element that it does not have, only the
content is kept, or it is left out and listed in `losses`. Of the MathML Core of pages, MathML 2.0
and its attributes are kept.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from urllib.parse import urlsplit

from coursebuild.api import regex
from coursebuild.core.pages.html_xml import (
    Element,
    HtmlContent,
    HtmlElement,
    add,
    element,
    parse_html,
)

STRIKE_CLASS = "struck"
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
_STRIKE_ELEMENTS = frozenset("del s strike".split())
_HIDDEN_ELEMENTS = frozenset(
    "area base col dialog link meta param script source style template title".split()
)
"""Elements that show nothing by themselves."""
_ACTIVE = frozenset(
    "applet audio button canvas datalist embed iframe input keygen map meter object optgroup option"
    " output progress select svg textarea track video".split()
)
_ANCHOR = "anchor"
"""The class of a heading's link to itself, which only a page needs."""
_NUMBER = regex(r"[0-9]{1,5}")


class Flow:
    """Converts texts for the package, one after the other."""

    def __init__(
        self, link: Callable[[str], str | None], picture: Callable[[str], str | None]
    ) -> None:
        """`link` and `picture` turn an address on the page into one in the package.

        They return `None` if there is none.
        """
        self._link_of = link
        self._picture_of = picture
        self.losses: list[str] = []
        """What was not kept, one sentence each, without repeats."""

    def blocks(self, html: str) -> list[Element]:
        """Convert blocks, which an item's body, an option or a feedback may hold."""
        return list(self._blocks(_join_formulas(parse_html(html))))

    def line(self, html: str) -> list[Element | str]:
        """Convert a line of text, which a paragraph may hold."""
        return list(self._line(_join_formulas(parse_html(html))))

    def lose(self, loss: str) -> None:
        """Note what is not kept."""
        if loss not in self.losses:
            self.losses.append(loss)

    # --- blocks

    def _blocks(self, content: Iterable[HtmlContent]) -> Iterator[Element]:
        """Convert blocks, and put a paragraph around each run of lines between them."""
        run: list[HtmlContent] = []
        for child in content:
            if isinstance(child, HtmlElement) and _is_block(child):
                yield from self._text_block("p", run)
                run = []
                yield from self._block(child)
            else:
                run.append(child)
        yield from self._text_block("p", run)

    def _text_block(self, name: str, content: Sequence[HtmlContent]) -> Iterator[Element]:
        """Yield a block that holds one line, unless the line is empty."""
        block = element(name, {}, *self._line(content))
        if len(block) or (block.text or "").strip():
            yield block

    def _block(self, node: HtmlElement) -> Iterator[Element]:
        name = node.name
        if name in _HEADINGS:
            yield from self._text_block(name, node.children)
        elif name == "pre":
            code = element("pre", {}, *self._line(node.children, pre=True))
            _trim_line_ends(code)
            yield code
        elif name == "hr":
            yield element("hr")
        elif name in ("ul", "ol"):
            if node.attributes.get("start", "1") != "1" or "reversed" in node.attributes:
                self.lose("a numbered list counts from 1")
            items = [
                self._container("li", child)
                if isinstance(child, HtmlElement) and child.name == "li"
                else self._container("li", HtmlElement("li", {}, [child]))
                for child in node.children
                if not isinstance(child, str) or child.strip()
            ]
            yield from [element(node.name, {}, *items)] if items else ()
        elif name == "dl":
            parts = [self._container(part.name, part) for part in node.nearest("dt", "dd")]
            yield from [element("dl", {}, *parts)] if parts else ()
        elif name == "table":
            # Make a table with one head at most and a body, which QTI requires; captions go first
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
        else:
            if name == "details":
                self.lose("`<details>` is open")
            inner = list(self._blocks(node.children))
            if name == "blockquote" and inner:
                yield element("blockquote", {}, *inner)
            else:
                yield from [element("div", {}, *inner)] if len(inner) > 1 and name != "p" else inner

    def _container(
        self, name: str, node: HtmlElement, attributes: dict[str, str] | None = None
    ) -> Element:
        """Make an element that may hold blocks or a line; a term (`dt`) can only hold a line."""
        container = element(name, attributes)
        if name != "dt" and any(map(_is_block, node.elements)):
            add(container, *self._blocks(node.children))
        else:
            add(container, *self._line(node.children))
        return container

    def _cell(self, cell: HtmlElement) -> Element:
        attributes = _numbers(cell, ("colspan", "rowspan"))
        scope = cell.attributes.get("scope", "")
        if scope in ("row", "col", "rowgroup", "colgroup"):
            attributes["scope"] = scope
        alignments = [c for c in sorted(cell.classes) if c in ("align-center", "align-right")]
        if alignments:
            attributes["class"] = alignments[0]
        return self._container(cell.name, cell, attributes)

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
        if name in _HIDDEN_ELEMENTS or _ANCHOR in node.classes:
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
        elif name in _STRIKE_ELEMENTS:
            self.lose("crossed-out text is marked by a class, which some platforms do not show")
            yield element("span", {"class": STRIKE_CLASS}, *self._line(inner, pre=pre))
        elif name in _EMPHASIS:
            yield element("em", {}, *self._line(inner, pre=pre))
        elif name == "input" and node.attributes.get("type", "").lower() == "checkbox":
            yield "☑" if "checked" in node.attributes else "☐"
        elif name in _ACTIVE:
            self.lose(f"`<{name}>` has no place in QTI and is left out")
        else:
            yield from self._line(inner, pre=pre)

    def _picture(self, node: HtmlElement) -> Element | str:
        source, alt = node.attributes.get("src", ""), node.attributes.get("alt", "")
        place = self._picture_of(source)
        if place is None:
            self.lose(f"the picture `{source}` is replaced by its words")
            return alt
        size = _numbers(node, ("height", "width"))
        return element("img", {"src": place, "alt": alt} | dict(sorted(size.items())))

    def _link(self, node: HtmlElement, pre: bool) -> Iterator[Element | str]:
        address = node.attributes.get("href", "")
        inner = self._line(node.children, pre=pre)
        place = self._link_of(address) if address else None
        if place is not None:
            yield element("a", {"href": place}, *inner)
            return
        if address:
            reason = "" if urlsplit(address).scheme else ", as the course has no `base_url`"
            self.lose(f"the link to `{address}` is text{reason}")
        yield from inner


def _numbers(node: HtmlElement, names: Sequence[str]) -> dict[str, str]:
    attributes = node.attributes.items()
    return {k: value for k, value in attributes if k in names and _NUMBER.fullmatch(value)}


def _trim_line_ends(code: Element) -> None:
    while len(code) and not (code[-1].tail or "").strip("\n"):
        code[-1].tail = None
        code = code[-1]
    if len(code):
        code[-1].tail = (code[-1].tail or "").rstrip("\n")
    else:
        code.text = (code.text or "").rstrip("\n")


def _is_block(node: HtmlElement) -> bool:
    if node.name == "math" or node.name in _ACTIVE or node.name in _HIDDEN_ELEMENTS:
        return False
    return node.name in _BLOCKS or any(map(_is_block, node.elements))


def _join_formulas(content: Iterable[HtmlContent]) -> list[HtmlContent]:
    """Join the parts of formulas that a page cuts so that a line may break in them."""
    nodes: list[HtmlContent] = []
    for child in _unwrap_spans(content):
        last = nodes[-1] if nodes else None
        if isinstance(child, HtmlElement):
            child = HtmlElement(child.name, child.attributes, _join_formulas(child.children))
            if _is_inline_math(child) and isinstance(last, HtmlElement) and _is_inline_math(last):
                nodes[-1] = HtmlElement("math", last.attributes, [*last.children, *child.children])
                continue
        nodes.append(child)
    return nodes


def _unwrap_spans(content: Iterable[HtmlContent]) -> Iterator[HtmlContent]:
    """Replace each `span`, which says nothing by itself, by its children."""
    for child in content:
        if isinstance(child, HtmlElement) and child.name == "span":
            yield from _unwrap_spans(child.children)
        else:
            yield child


def _is_inline_math(node: HtmlElement) -> bool:
    return node.name == "math" and node.attributes.get("display") != "block"


_TOKEN = "mathvariant mathsize mathcolor mathbackground"
_SCRIPT = "subscriptshift superscriptshift"
_ATTRIBUTES = {
    "math": "display",
    "mi": _TOKEN,
    "mn": _TOKEN,
    "mo": f"{_TOKEN} form fence separator lspace rspace stretchy symmetric maxsize minsize"
    " largeop movablelimits accent",
    "mtext": _TOKEN,
    "ms": f"{_TOKEN} lquote rquote",
    "mspace": f"{_TOKEN} width height depth linebreak",
    "mrow": "",
    "mfrac": "linethickness numalign denomalign bevelled",
    "msqrt": "",
    "mroot": "",
    "mstyle": f"scriptlevel displaystyle scriptsizemultiplier scriptminsize background {_TOKEN}",
    "merror": "",
    "mpadded": "width height depth lspace",
    "mphantom": "",
    "menclose": "notation",
    "msub": "subscriptshift",
    "msup": "superscriptshift",
    "msubsup": _SCRIPT,
    "munder": "accentunder",
    "mover": "accent",
    "munderover": "accent accentunder",
    "mmultiscripts": _SCRIPT,
    "mprescripts": "",
    "none": "",
    "mtable": "align rowalign columnalign columnwidth width rowspacing columnspacing rowlines"
    " columnlines frame framespacing equalrows equalcolumns displaystyle side minlabelspacing",
    "mtr": "rowalign columnalign",
    "mtd": "rowspan columnspan rowalign columnalign",
}
_ALIGNMENTS = {"tml-left": "left", "tml-right": "right"}
"""Classes of columns that the site's style sheet aligns."""
_EMPTY = frozenset({"mspace", "mprescripts", "none"})
_WORDS = frozenset({"mi", "mn", "mo", "mtext", "ms"})
_COLOUR = regex(r"(?:^|;)\s*color\s*:\s*(#[0-9a-fA-F]{3,6}|[a-zA-Z]+)\s*(?:;|$)")
_LENGTH = regex(r"[+-]?\d*\.?\d+(?:%|em|ex|px|in|cm|mm|pt|pc)?|\w+mathspace")


def mathml(node: HtmlElement) -> Element:
    """Convert a formula; its elements have the prefix `m`."""
    return _convert_as(node, "math")


def _convert(node: HtmlElement) -> Element:
    name = node.name if node.name in _ATTRIBUTES and node.name != "math" else "mrow"
    formula = _convert_as(node, name)
    if "border:" in node.attributes.get("style", ""):
        return element("m:menclose", {"notation": "box"}, formula)
    return formula


def _convert_as(node: HtmlElement, name: str) -> Element:
    names = _ATTRIBUTES[name].split()
    attributes = {key: value for key, value in node.attributes.items() if key in names}
    if name == "mtd":
        for mark in sorted(node.classes & _ALIGNMENTS.keys()):
            attributes["columnalign"] = _ALIGNMENTS[mark]
    colour = _COLOUR.search(node.attributes.get("style", ""))
    if colour is not None and "mathcolor" in names:
        attributes["mathcolor"] = colour[1]
    for key in ("width", "height", "depth", "lspace", "rspace"):
        if key in attributes and not _LENGTH.fullmatch(attributes[key]):
            del attributes[key]
    formula = element(f"m:{name}", dict(sorted(attributes.items())))
    for child in node.children:
        if isinstance(child, str):
            if name in _WORDS:
                add(formula, child)
        elif child.name == "annotation" or name in _EMPTY:
            continue
        elif child.name == "semantics":
            parts = (c for c in child.elements if not c.name.startswith("annotation"))
            add(formula, *map(_convert, parts))
        elif name not in _WORDS:
            add(formula, _convert(child))
        else:
            add(formula, child.text)
    return formula
