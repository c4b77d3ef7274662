"""MJCF as text whose every element and attribute knows its place, in bytes.

Entry points: `Markup`, `Element`, `parse_markup(path, data)`, `splice`; `place_of`.

1. The standard library's parser tells at which byte an element begins and ends; attributes are then
   looked up in its tag. Whatever the file declares, it is read as UTF-8, as MuJoCo does.
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
    """Around it, also where it is in a file included there."""
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
        one = self.attribute(name)
        return None if one is None else one.value

    def attribute(self, name: str) -> Attribute | None:
        """The attribute of this name."""
        return next((one for one in self.attributes if one.name == name), None)

    def walk(self) -> Iterator[Element]:
        """It and all below it, in the order in which MuJoCo meets them."""
        yield self
        for child in self.children:
            yield from child.walk()

    def above(self) -> Iterator[Element]:
        """The elements that it lies in, from the nearest on."""
        element = self.parent
        while element is not None:
            yield element
            element = element.parent


class Markup:
    """A file."""

    def __init__(self, path: str, data: bytes) -> None:
        self.path = path
        self.data = data
        self.root: Element
        self.at: Element | None = None
        """The `include` that pulls it in; `None` for a model's own file."""
        self.included: list[Markup] = []

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of a byte, both from 1; columns count characters."""
        before = self.data[:offset].decode("utf-8", "replace").lstrip("\ufeff")
        lines = _NEWLINE.split(before)
        return len(lines), len(lines[-1]) + 1


def parse_markup(path: str, data: bytes) -> Markup:
    """A file's elements; includes are not followed.

    Raises:
        MarkupError: it is no XML, or declares entities of its own.
    """
    document = Markup(path, data)
    opened: list[Element] = []
    parser = expat.ParserCreate("utf-8")
    parser.ordered_attributes = True

    def start(tag: str, given: list[str]) -> None:
        begin = parser.CurrentByteIndex
        found, at = _attributes(data, begin, given)
        parent = opened[-1] if opened else None
        element = Element(document, tag, parent, found, begin, data.index(b">", at) + 1)
        if parent is None:
            document.root = element
        else:
            parent.children.append(element)
        opened.append(element)

    def end(_: str) -> None:
        element = opened.pop()
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


def _attributes(data: bytes, start: int, given: list[str]) -> tuple[tuple[Attribute, ...], int]:
    """The attributes of a start tag, and where the last of them ends."""
    name = _NAME.match(data, start)
    assert name is not None
    at, found = name.end(), []
    for key, value in zip(given[::2], given[1::2], strict=True):
        match = _ATTRIBUTE.search(data, at)
        assert match is not None
        at = match.end()
        found.append(Attribute(key, value, match.start(), at, (match.start(2) + 1, at - 1)))
    return tuple(found), at


def splice(include: Element, inner: Markup) -> None:
    """Put what a file holds in place of the `include` that pulls it in."""
    parent = include.parent
    assert parent is not None
    inner.at = include
    include.document.included.append(inner)
    for child in inner.root.children:
        child.parent = parent
    at = parent.children.index(include)
    parent.children[at : at + 1] = inner.root.children


def place_of(element: Element) -> str:
    """The way to an element from the root, with names, and numbers where there is none."""
    parts: list[str] = []
    for here in (element, *element.above()):
        key = "class" if here.tag == "default" else "name"
        name = here.get("name") or (here.get("class") if here.tag == "default" else None)
        part = here.tag
        if name:
            part += f'[@{key}="{name}"]'
        elif here.parent is not None:
            alike = [one for one in here.parent.children if one.tag == here.tag]
            if len(alike) > 1:
                part += f"[{alike.index(here) + 1}]"
        parts.append(part)
    return "/".join(reversed(parts))
