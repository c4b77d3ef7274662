"""MJCF as text whose every element and attribute knows its place, in bytes.

Entry points: `Markup`, `Element`, `parse_markup(path, data)`; `place_of`.

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
    attributes: tuple[Attribute, ...]
    start: int
    head: int
    """Past its start tag."""
    tail: int = 0
    """Where its end tag begins; `head` where it has none."""
    end: int = 0
    children: list[Element] = field(default_factory=list)
    included: Markup | None = None
    """The file that an `include` pulls in."""

    def __repr__(self) -> str:
        return f"<{self.tag}> at byte {self.start} of {self.document.path}"

    def get(self, name: str) -> str | None:
        """The value of an attribute."""
        one = self.attribute(name)
        return None if one is None else one.value

    def attribute(self, name: str) -> Attribute | None:
        """The attribute of this name."""
        return next((one for one in self.attributes if one.name == name), None)

    def walk(self) -> Iterator[Element]:
        """It and all below it, in the order of the text; an `include` is what it includes."""
        if self.included is None:
            yield self
        for child in self.spliced() if self.included is None else self.included.root.spliced():
            yield from child.walk()

    def spliced(self) -> Iterator[Element]:
        """Its children, with those of files that are included among them."""
        for child in self.children:
            if child.included is None:
                yield child
            else:
                yield from child.included.root.spliced()

    @property
    def above(self) -> Element | None:
        """The element that it lies in, also where it is in a file included there."""
        parent = self.parent
        if parent is not None and parent.parent is None and self.document.at is not None:
            return self.document.at.above
        return parent


class Markup:
    """A file."""

    def __init__(self, path: str, data: bytes) -> None:
        self.path = path
        self.data = data
        self.root: Element
        self.at: Element | None = None
        """The `include` that pulls it in; `None` for a model's own file."""

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
        head = data.index(b">", at) + 1
        element = Element(document, tag, parent, found, begin, head)
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


def place_of(element: Element) -> str:
    """The way to an element from the root, with names, and numbers where there is none."""
    parts: list[str] = []
    here: Element | None = element
    while here is not None:
        above = here.above
        key = "class" if here.tag == "default" else "name"
        name = here.get("name") or (here.get("class") if here.tag == "default" else None)
        part = here.tag
        if name:
            part += f'[@{key}="{name}"]'
        elif above is not None:
            alike = [one for one in above.spliced() if one.tag == here.tag]
            if len(alike) > 1:
                part += f"[{alike.index(here) + 1}]"
        parts.append(part)
        here = above
    return "/".join(reversed(parts))
