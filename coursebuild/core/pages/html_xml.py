"""HTML as a tree, parsed as a browser does, however malformed; and XML as elements and templates.

The parser of HTML is Lexbor: it adds what HTML allows a writer to omit, and repairs what is
misplaced. Comments are left out.
"""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from html import escape
from pathlib import Path
from typing import Any, TypeAlias
from xml.etree.ElementTree import Element as Element
from xml.etree.ElementTree import tostring

from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup
from msgspec import Struct, field
from selectolax.lexbor import LexborHTMLParser, LexborNode

from coursebuild.core.text.characters import clean_xml
from coursebuild.core.text.regex import regex

VOID = frozenset("area base br col embed hr img input link meta param source track wbr".split())
_RAW = frozenset("script style xmp iframe noembed noframes plaintext".split())
"""Elements whose text is not escaped."""
_MAX_DEPTH = 200
"""The most levels of a tree, so that recursion is safe; deeper text is moved up."""
_NAMESPACES = {
    "svg": "http://www.w3.org/2000/svg",
    "math": "http://www.w3.org/1998/Math/MathML",
}
_XLINK = "http://www.w3.org/1999/xlink"
_XML_NAME = regex(r"[A-Za-z_][A-Za-z0-9_.-]*")


class HtmlElement(Struct):
    """An element."""

    name: str
    """In lower case, except for SVG."""
    attributes: dict[str, str] = field(default_factory=dict)
    children: list[HtmlContent] = field(default_factory=list)

    @property
    def classes(self) -> frozenset[str]:
        return frozenset(self.attributes.get("class", "").split())

    @property
    def elements(self) -> Iterator[HtmlElement]:
        return (child for child in self.children if isinstance(child, HtmlElement))

    @property
    def text(self) -> str:
        return "".join(child if isinstance(child, str) else child.text for child in self.children)

    def nearest(self, *names: str) -> Iterator[HtmlElement]:
        """The elements of these names in it, without those inside another one."""
        for child in self.elements:
            if child.name in names:
                yield child
            else:
                yield from child.nearest(*names)


HtmlContent: TypeAlias = HtmlElement | str


def parse_html(html: str) -> list[HtmlContent]:
    """The content of the body of a page with this HTML."""
    page = _parse(html)
    root = HtmlElement("body")
    if page.body is not None:
        _copy_children(page.body, root, _MAX_DEPTH)
    return root.children


def elements_with(
    html: str, attributes: Iterable[str]
) -> Iterator[tuple[str, Mapping[str, str | None]]]:
    """The names and attributes of elements that have any of these attributes, each once."""
    page, node_ids = _parse(html), set[int]()
    for node in page.css(",".join(f"[{name}]" for name in attributes)):
        if node.mem_id not in node_ids:  # a node matches once for each of its attributes
            node_ids.add(node.mem_id)
            yield node.tag or "", node.attributes


def _parse(html: str) -> LexborHTMLParser:
    # The parser takes UTF-8, which cannot represent a lone surrogate.
    return LexborHTMLParser(f"<!DOCTYPE html><body>{html}".encode("utf-8", "replace").decode())


def _copy_children(parent: LexborNode, target: HtmlElement, levels: int) -> None:
    node = parent.child
    while node is not None:
        if node.is_text_node:
            text = node.text_content or ""
            if target.children and isinstance(target.children[-1], str):
                target.children[-1] += text
            else:
                target.children.append(text)
        elif node.is_element_node:
            name = node.tag or ""
            element = HtmlElement(
                name, {key: value or "" for key, value in node.attributes.items()}
            )
            target.children.append(element)
            if levels:
                _copy_children(node, element, levels - 1)
            else:
                target.children.append(node.text(deep=True))
        node = node.next


def to_html(content: Iterable[HtmlContent], *, raw: bool = False) -> str:
    """A tree as HTML; `raw`: without escapes, as in a script."""
    parts: list[str] = []
    for child in content:
        if isinstance(child, str):
            parts.append(child if raw else escape(child, quote=False))
            continue
        attributes = (f' {key}="{escape(value)}"' for key, value in child.attributes.items())
        parts.append(f"<{child.name}{''.join(attributes)}>")
        if child.name not in VOID:
            if child.name in ("pre", "textarea", "listing"):
                parts.append("\n")  # parsers drop the first line end in these
            parts += to_html(child.children, raw=child.name in _RAW), f"</{child.name}>"
    return "".join(parts)


def to_xml(content: Iterable[HtmlContent]) -> str:
    """A tree as XHTML; of elements with names that XML forbids only the content is kept."""
    parts: list[str] = []
    for child in content:
        if isinstance(child, str):
            parts.append(_xml_text(child))
        elif not _XML_NAME.fullmatch(child.name):
            parts.append(to_xml(child.children))
        else:
            parts.append(f"<{child.name}")
            if child.name in _NAMESPACES:
                parts.append(f' xmlns="{_NAMESPACES[child.name]}"')
            for key, value in child.attributes.items():
                space, _, local = key.rpartition(":")
                has_name = space in ("", "xml", "xlink") and _XML_NAME.fullmatch(local)
                if has_name and key != "xmlns":
                    namespace = f' xmlns:xlink="{_XLINK}"' if space == "xlink" else ""
                    text = _xml_text(value).replace('"', "&quot;")
                    parts.append(f'{namespace} {key}="{text}"')
            is_void = child.name in VOID
            parts.append("/>" if is_void else f">{to_xml(child.children)}</{child.name}>")
    return "".join(parts)


def _xml_text(text: str) -> str:
    return clean_xml(escape(text, quote=False))


# --- XML

Child: TypeAlias = "Element | str | None"


def element(name: str, attributes: dict[str, str] | None = None, *children: Child) -> Element:
    """An element; a child that is `None` is left out."""
    node = Element(name, {key: clean_xml(value) for key, value in (attributes or {}).items()})
    add(node, *children)
    return node


def add(parent: Element, *children: Child) -> None:
    """Append elements and texts, in their order."""
    for child in children:
        if child is None:
            continue
        if isinstance(child, Element):
            parent.append(child)
        elif len(parent):
            parent[-1].tail = (parent[-1].tail or "") + clean_xml(child)
        else:
            parent.text = (parent.text or "") + clean_xml(child)


def render_xml(template: Path, **values: Any) -> bytes:
    """A whole file; values that are not `Markup` are escaped."""
    return clean_xml(_template(template).render(values)).encode()


@functools.cache
def _template(path: Path) -> Template:
    environment = Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined
    )
    return environment.from_string(path.read_text(encoding="utf-8"))


def markup(content: Iterable[Element | str]) -> Markup:
    """Elements and texts as markup for a template."""
    parts = (
        Markup.escape(c) if isinstance(c, str) else Markup(tostring(c, "unicode")) for c in content
    )
    return Markup("").join(parts)


def identifier(prefix: str, text: str, *, most: int = 0) -> str:
    """An ASCII NCName of a text, another one for each.

    Beyond `most` characters it ends with digits of its hash.
    """
    name = prefix + re.sub("[^A-Za-z0-9.-]", lambda match: f"_{ord(match[0]):x}_", text)
    if most and len(name) > most:
        digest = hashlib.sha256(name.encode()).hexdigest()[:12]
        name = f"{name[: most - 13]}_{digest}"
    return name
