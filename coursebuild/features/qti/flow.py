"""Drawn HTML as the part of XHTML that QTI 2.1 allows.

Entry points: `Flow(link, picture)`, and its `blocks` and `line`; `lost` says what was not kept.

QTI 2.1 has the text of XHTML (information model, chapter "Content Model"), pictures, links, tables
and MathML, and nothing that moves, plays or asks. What has no place there is either

- opened, where only its content counts (a box, a mark of highlighted code), or
- told in `lost`, with what became of it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from urllib.parse import urlsplit

from coursebuild.core.pages.exports.xml import Element, add, element
from coursebuild.core.pages.html_tree import HtmlContent, HtmlElement, parse_html
from coursebuild.features.qti.mathml import mathml

_BLOCKS = frozenset(
    "address article aside blockquote center details dialog div dl fieldset figcaption figure"
    " footer form h1 h2 h3 h4 h5 h6 header hgroup hr main nav ol p pre section summary table"
    " ul".split()
)
STRUCK = "struck"
"""A class of the package's style sheet."""

_INLINE = frozenset(
    "abbr acronym b big cite code dfn em i kbd q samp small strong sub sup tt var".split()
)
_NEVER_IN_PRE = frozenset("big img object small sub sup".split())
_HEADINGS = frozenset("h1 h2 h3 h4 h5 h6 address".split())
_EMPHASIS = frozenset("ins mark u".split())
_STRUCK = frozenset("del s strike".split())
_GONE = frozenset("area base col dialog link meta param script source style template title".split())
"""What shows nothing by itself."""
_ACTIVE = frozenset(
    "applet audio button canvas datalist embed iframe input keygen map meter object optgroup option"
    " output picture progress select svg textarea track video".split()
)
_OWN = frozenset({"anchor"})
"""Classes of what a page adds for its own readers."""
_SPACE = re.compile(r"[ \t\n\r\f]+")
_NUMBER = re.compile(r"[0-9]{1,5}")
_LANGUAGE = re.compile(r"[A-Za-z]{1,8}(?:-[A-Za-z0-9]{1,8})*")


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
        return list(self._blocks(joined(parse_html(html))))

    def line(self, html: str) -> list[Element | str]:
        """A line of text: what a paragraph may hold."""
        return list(self._line(joined(parse_html(html))))

    def _lose(self, what: str) -> None:
        if what not in self.lost:
            self.lost.append(what)

    # --- blocks

    def _blocks(self, content: Iterable[HtmlContent]) -> Iterator[Element]:
        """Blocks, with a paragraph around each run of lines between them."""
        run: list[HtmlContent] = []
        for child in content:
            if isinstance(child, HtmlElement) and _is_block(child):
                yield from self._paragraph(run)
                run = []
                yield from self._block(child)
            else:
                run.append(child)
        yield from self._paragraph(run)

    def _paragraph(self, run: Sequence[HtmlContent]) -> Iterator[Element]:
        made = element("p", {}, *self._line(run))
        if len(made) or (made.text or "").strip():
            yield made

    def _block(self, node: HtmlElement) -> Iterator[Element]:
        name = node.name
        if name in _HEADINGS:
            yield from self._lines(name, node)
        elif name == "p":
            yield from self._blocks(node.children)
        elif name == "pre":
            made = element("pre", language_of(node), *self._line(node.children, pre=True))
            _trim(made)
            yield made
        elif name == "hr":
            yield element("hr")
        elif name in ("ul", "ol"):
            yield self._list(node)
        elif name == "dl":
            yield from self._definitions(node)
        elif name == "table":
            yield from self._table(node)
        elif name == "blockquote":
            inner = list(self._blocks(node.children))
            yield from [element("blockquote", language_of(node), *inner)] if inner else ()
        elif _holds_form(node):
            self._lose(f"what {tag(node)} holds stays, and does nothing")
            yield from self._blocks(node.children)
        else:
            if name == "details":
                self._lose("`<details>` is open")
            elif name in _INLINE or name == "a":
                self._lose(f"{tag(node)} around whole blocks is left out, and they stay")
            inner = list(self._blocks(node.children))
            yield from [element("div", language_of(node), *inner)] if len(inner) > 1 else inner

    def _lines(self, name: str, node: HtmlElement) -> Iterator[Element]:
        """A heading and the like; blocks in it, which HTML does not allow, follow it."""
        inside = [c for c in node.children if not (isinstance(c, HtmlElement) and _is_block(c))]
        made = element(name, language_of(node), *self._line(inside))
        if len(made) or (made.text or "").strip():
            yield made
        yield from self._blocks(c for c in node.elements if _is_block(c))

    def _list(self, node: HtmlElement) -> Element:
        if node.attributes.get("start", "1") != "1" or "reversed" in node.attributes:
            self._lose("a numbered list counts from 1")
        made = element(node.name, language_of(node))
        for child in node.children:
            if isinstance(child, HtmlElement) and child.name == "li":
                add(made, self._holder("li", child))
            elif not (isinstance(child, str) and not child.strip()):
                add(made, self._holder("li", HtmlElement("li", {}, [child])))
        return made if len(made) else element("p")

    def _holder(
        self, name: str, node: HtmlElement, attributes: dict[str, str] | None = None
    ) -> Element:
        """What may hold lines as well as blocks; a paragraph by itself stands without its box."""
        made = element(name, language_of(node) | (attributes or {}))
        if any(isinstance(c, HtmlElement) and _is_block(c) for c in node.children):
            add(made, *self._blocks(node.children))
        else:
            add(made, *self._line(node.children))
        return made

    def _definitions(self, node: HtmlElement) -> Iterator[Element]:
        made = element("dl", language_of(node))
        for child in flat(node, "div"):
            if child.name == "dt":
                add(made, element("dt", {}, *self._line([child])))
            elif child.name == "dd":
                add(made, self._holder("dd", child))
        if len(made):
            yield made

    # --- tables

    def _table(self, node: HtmlElement) -> Iterator[Element]:
        """`caption`, `thead`, `tfoot`, then at least one `tbody`, as QTI orders them."""
        captions = [child for child in node.elements if child.name == "caption"]
        groups = [
            (child.name, rows)
            for child in node.elements
            if child.name in ("thead", "tbody", "tfoot") and (rows := self._rows(child))
        ]
        yield from self._blocks(captions[1:])
        caption = element("caption", {}, *self._line(captions[:1])) if captions else None
        if groups:
            yield element("table", language_of(node), caption, *_grouped(groups))
        elif caption is not None:
            yield from self._blocks(captions[:1])

    def _rows(self, group: HtmlElement) -> list[Element]:
        """The rows that have cells."""
        rows = ([c for c in row.elements if c.name in ("td", "th")] for row in group.elements)
        return [element("tr", {}, *map(self._cell, cells)) for cells in rows if cells]

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
                yield child if pre else _SPACE.sub(" ", child)
            else:
                yield from self._inline(child, pre)

    def _inline(self, node: HtmlElement, pre: bool) -> Iterator[Element | str]:
        name, inner = node.name, node.children
        if name in _GONE or node.classes & _OWN:
            return
        if name == "math":
            yield mathml(node)
        elif pre and name in _NEVER_IN_PRE and name != "img":
            yield from self._line(inner, pre=pre)
        elif name in _INLINE:
            yield element(name, language_of(node), *self._line(inner, pre=pre))
            if name in ("abbr", "acronym", "dfn") and node.attributes.get("title", "").strip():
                yield f" ({node.attributes['title'].strip()})"
        elif name == "br":
            yield "\n" if pre else element("br")
        elif name == "img":
            yield from self._picture(node)
        elif name == "a":
            yield from self._link(node, pre)
        elif name in _STRUCK:
            self._lose("crossed-out text is marked by a class, which some platforms do not show")
            yield element("span", {"class": STRUCK}, *self._line(inner, pre=pre))
        elif name in _EMPHASIS:
            yield element("em", language_of(node), *self._line(inner, pre=pre))
        elif name in _ACTIVE:
            yield from self._active(node)
        elif name in ("ruby", "rt", "rp"):
            yield from self._ruby(node, pre)
        elif language_of(node):
            yield element("span", language_of(node), *self._line(inner, pre=pre))
        else:
            yield from self._line(inner, pre=pre)

    def _ruby(self, node: HtmlElement, pre: bool) -> Iterator[Element | str]:
        if node.name == "rt":
            yield " ("
        if node.name != "rp":
            yield from self._line(node.children, pre=pre)
        if node.name == "rt":
            yield ")"

    def _picture(self, node: HtmlElement) -> Iterator[Element | str]:
        place = self._picture_of(node.attributes.get("src", ""))
        alt = node.attributes.get("alt", "")
        if place is None:
            source = node.attributes.get("src", "")
            self._lose(f"the picture `{source}` is replaced by its words")
            yield alt
            return
        size = {k: v for k, v in node.attributes.items() if k in ("height", "width")}
        size = {key: value for key, value in size.items() if _NUMBER.fullmatch(value)}
        yield element("img", {"src": place, "alt": alt} | dict(sorted(size.items())))

    def _link(self, node: HtmlElement, pre: bool) -> Iterator[Element | str]:
        address = node.attributes.get("href", "")
        inner = list(self._line(node.children, pre=pre))
        place = self._link_of(address) if address else None
        if place is not None:
            yield element("a", {"href": place}, *inner)
            return
        if address:
            why = "" if urlsplit(address).scheme else ", as the course has no `base_url`"
            self._lose(f"the link to `{address}` is text{why}")
        yield from inner

    def _active(self, node: HtmlElement) -> Iterator[Element | str]:
        kind = node.attributes.get("type", "").lower()
        if node.name == "input" and kind == "checkbox":
            yield "☑" if "checked" in node.attributes else "☐"
            return
        inner = list(self._line(node.children)) if node.name in ("object", "picture") else []
        if node.name == "picture" and inner:
            yield from inner
            return
        self._lose(f"{tag(node)} has no place in QTI and is left out")
        yield from inner


def _grouped(groups: list[tuple[str, list[Element]]]) -> Iterator[Element]:
    """The rows of a table: one head and one foot at most, and a body, which QTI requires."""
    found: dict[str, list[Element]] = {}
    bodies: list[Element] = []
    bare = all(name in ("thead", "tfoot") for name, _ in groups)
    for name, rows in groups:
        if name in ("thead", "tfoot") and name not in found and not bare:
            found[name] = rows
        else:
            bodies.append(element("tbody", {}, *rows))
    yield from (element(n, {}, *found[n]) for n in ("thead", "tfoot") if n in found)
    yield from bodies


def tag(node: HtmlElement) -> str:
    """How an element begins: `<video>`."""
    return f"`<{node.name}>`"


def _trim(made: Element) -> None:
    """Take away the line ends at the end of a block of code."""
    while len(made) and not (made[-1].tail or "").strip("\n"):
        made[-1].tail = None
        made = made[-1]
    if len(made):
        made[-1].tail = (made[-1].tail or "").rstrip("\n")
    else:
        made.text = (made.text or "").rstrip("\n")


def _holds_form(node: HtmlElement) -> bool:
    return node.name in ("form", "fieldset")


def _is_block(node: HtmlElement) -> bool:
    """Whether an element is, or holds, a block."""
    if node.name == "math":
        return False
    if node.name in _ACTIVE or node.name in _GONE:
        return False
    return node.name in _BLOCKS or any(map(_is_block, node.elements))


def language_of(node: HtmlElement) -> dict[str, str]:
    """An attribute for the language that an element says it is in, if it says one."""
    said = node.attributes.get("lang", "")
    return {"xml:lang": said} if _LANGUAGE.fullmatch(said) else {}


def flat(node: HtmlElement, name: str) -> Iterator[HtmlElement]:
    """The elements in one, those in groups of a name as well."""
    for child in node.elements:
        if child.name == name:
            yield from flat(child, name)
        else:
            yield child


def joined(content: Iterable[HtmlContent]) -> list[HtmlContent]:
    """Content in which formulas that were cut so that a line may break in them are whole again."""
    made: list[HtmlContent] = []
    for child in _without_spans(content):
        last = made[-1] if made else None
        if isinstance(child, HtmlElement):
            child = HtmlElement(child.name, child.attributes, joined(child.children))
        if _is_formula(child) and _is_formula(last):
            assert isinstance(last, HtmlElement) and isinstance(child, HtmlElement)
            made[-1] = HtmlElement("math", last.attributes, [*last.children, *child.children])
        else:
            made.append(child)
    return made


def _without_spans(content: Iterable[HtmlContent]) -> Iterator[HtmlContent]:
    """Content without boxes that say nothing by themselves."""
    for child in content:
        if isinstance(child, HtmlElement) and child.name == "span" and not language_of(child):
            yield from _without_spans(child.children)
        else:
            yield child


def _is_formula(content: HtmlContent | None) -> bool:
    return (
        isinstance(content, HtmlElement)
        and content.name == "math"
        and content.attributes.get("display") != "block"
    )
