"""MJCF as text whose every element and attribute knows its place, in bytes.

Entry points: `Markup`, `Element`, `parse_markup(path, data)`, `splice`; `place_of`.

1. The standard library's parser gives the bytes at which an element begins and ends; attributes are
   then looked up in its tag. Whatever the file declares, it is read as UTF-8, as MuJoCo does.
2. Nothing is normalised: an edit made by these places leaves all other bytes as they are.
3. MuJoCo's own parser takes some texts that are no XML. These are refused, with the place.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.parsers import expat

from msgspec import Struct, field

_ATTRIBUTE = re.compile(rb"([^\s=/>\"']+)\s*=\s*(\"[^\"]*\"|'[^']*')")
_NAME = re.compile(rb"<[^\s/>]+")
_NEWLINE = re.compile(r"\r\n|\r|\n")


class MarkupError(Exception):
    """A text is no XML."""

    def __init__(self, document: Markup, offset: int, message: str) -> None:
        self.path, self.message = document.path, message
        self.line, self.column = document.position(offset)
        super().__init__(f"{self.path}:{self.line}:{self.column}: {message}")


class Attribute(Struct, frozen=True):
    """An attribute in a tag; places are bytes from the beginning of the file."""

    name: str
    value: str
    """Decoded: references are replaced."""
    start: int
    end: int
    """Past the closing quote."""
    inner: tuple[int, int]
    """Where the value stands, without its quotes."""


class Element(Struct, eq=False):
    """An element of a file."""

    document: Markup
    tag: str
    parent: Element | None
    """Also where the element comes from a file that is included in the parent."""
    attributes: tuple[Attribute, ...]
    start: int
    head: int
    """Past its start tag."""
    tail: int = 0
    """Where its end tag begins; `head` where it has none."""
    end: int = 0
    children: list[Element] = field(default_factory=list)
    """With those of included files in place of the `include`."""

    def get(self, name: str) -> str | None:
        """The value of an attribute."""
        attribute = self.attribute(name)
        return None if attribute is None else attribute.value

    def attribute(self, name: str) -> Attribute | None:
        """The attribute of this name."""
        return next((attribute for attribute in self.attributes if attribute.name == name), None)

    def walk(self) -> Iterator[Element]:
        """This element and its descendants, in the order in which MuJoCo meets them."""
        yield self
        for child in self.children:
            yield from child.walk()

    def ancestors(self) -> Iterator[Element]:
        """The elements around this one, the nearest first."""
        element = self.parent
        while element is not None:
            yield element
            element = element.parent


class Markup:
    """A file of MJCF and its elements."""

    def __init__(self, path: str, data: bytes) -> None:
        self.path = path
        self.data = data
        self.root: Element
        self.include: Element | None = None
        """The `include` that pulls it in; `None` for a model's own file."""
        self.included: list[Markup] = []

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of a byte, both from 1; columns count characters."""
        before = self.data[:offset].decode("utf-8", "replace").lstrip("\ufeff")
        lines = _NEWLINE.split(before)
        return len(lines), len(lines[-1]) + 1


def parse_markup(path: str, data: bytes) -> Markup:
    """Parse a file; includes are not followed.

    Raises:
        MarkupError: it is no XML, or declares entities of its own.
    """
    document = Markup(path, data)
    stack: list[Element] = []
    parser = expat.ParserCreate("utf-8")
    parser.ordered_attributes = True

    def start(tag: str, pairs: list[str]) -> None:
        begin = parser.CurrentByteIndex
        attributes, at = _attributes(data, begin, pairs)
        parent = stack[-1] if stack else None
        element = Element(document, tag, parent, attributes, begin, data.index(b">", at) + 1)
        if parent is None:
            document.root = element
        else:
            parent.children.append(element)
        stack.append(element)

    def end(_: str) -> None:
        element = stack.pop()
        if data[element.head - 2 : element.head] == b"/>":
            element.tail = element.end = element.head
        else:
            element.tail = parser.CurrentByteIndex
            element.end = data.index(b">", element.tail) + 1

    def entity(name: str, *_: object) -> None:
        message = f"it declares the entity `{name}`, which MuJoCo would not replace"
        raise MarkupError(document, parser.CurrentByteIndex, message)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        message = expat.errors.messages[error.code]
        raise MarkupError(document, parser.ErrorByteIndex, message) from None
    return document


def _attributes(data: bytes, start: int, pairs: list[str]) -> tuple[tuple[Attribute, ...], int]:
    """The attributes of a start tag, and where the last of them ends."""
    name = _NAME.match(data, start)
    assert name is not None
    at, attributes = name.end(), []
    for key, value in zip(pairs[::2], pairs[1::2], strict=True):
        match = _ATTRIBUTE.search(data, at)
        assert match is not None
        at = match.end()
        attributes.append(Attribute(key, value, match.start(), at, (match.start(2) + 1, at - 1)))
    return tuple(attributes), at


def splice(include: Element, inner: Markup) -> None:
    """Put the elements of a file in place of the `include` that pulls it in."""
    parent = include.parent
    assert parent is not None
    inner.include = include
    include.document.included.append(inner)
    for child in inner.root.children:
        child.parent = parent
    at = parent.children.index(include)
    parent.children[at : at + 1] = inner.root.children


def place_of(element: Element) -> str:
    """The path of an element from the root, with names, or numbers where they have none."""
    parts: list[str] = []
    for node in (element, *element.ancestors()):
        key = "class" if node.tag == "default" else "name"
        name = node.get("name") or (node.get("class") if node.tag == "default" else None)
        part = node.tag
        if name:
            part += f'[@{key}="{name}"]'
        elif node.parent is not None:
            siblings = [child for child in node.parent.children if child.tag == node.tag]
            if len(siblings) > 1:
                part += f"[{siblings.index(node) + 1}]"
        parts.append(part)
    return "/".join(reversed(parts))
