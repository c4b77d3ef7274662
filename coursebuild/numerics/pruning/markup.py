"""MJCF as text whose every element and attribute knows its place, in bytes.

Entry points: `Document`, `Element`, `parse_markup(path, data)`; `place_of`.

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
_NEWLINE = re.compile(rb"\r\n|\r|\n")


class MarkupError(Exception):
    """A text is no XML."""

    def __init__(self, path: str, line: int, column: int, message: str) -> None:
        super().__init__(f"{path}:{line}:{column}: {message}")
        self.path, self.line, self.column, self.message = path, line, column, message


class Attribute(Struct, frozen=True):
    """An attribute in a tag; places are bytes from the beginning of the file."""

    name: str
    value: str
    """Decoded: references are replaced."""
    start: int
    end: int
    """Past the closing quote."""

    @property
    def inner(self) -> tuple[int, int]:
        """Where the value stands, without its quotes."""
        return self._value, self.end - 1

    _value: int
    """Of the first byte of the value."""


class Element(Struct, eq=False):
    """An element of a file."""

    document: Document
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
    included: Document | None = None
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

    @property
    def is_empty(self) -> bool:
        """Whether it is one tag, `<a/>`."""
        return self.tail == self.head == self.end

    def walk(self) -> Iterator[Element]:
        """It and all below it, in the order of the text; an `include` is what it includes."""
        if self.included is not None:
            for child in self.included.root.children:
                yield from child.walk()
            return
        yield self
        for child in self.children:
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


class Document:
    """A file."""

    def __init__(self, path: str, data: bytes) -> None:
        self.path = path
        self.data = data
        self.root: Element
        self.at: Element | None = None
        """The `include` that pulls it in; `None` for a model's own file."""

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of a byte, both from 1; columns count characters."""
        before = self.data[:offset]
        last = 0
        line = 1
        for match in _NEWLINE.finditer(before):
            if match.end() == offset and self.data[offset - 1 : offset + 1] == b"\r\n":
                break
            line, last = line + 1, match.end()
        return line, len(before[last:].decode("utf-8", "replace").lstrip("\ufeff")) + 1


def parse_markup(path: str, data: bytes) -> Document:
    """A file's elements; includes are not followed.

    Raises:
        MarkupError: it is no XML, or declares entities of its own.
    """
    document = Document(path, data)
    _Reader(document).read()
    return document


class _Reader:
    """Builds elements while the parser goes through the text."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._open: list[Element] = []
        self._parser = parser = expat.ParserCreate("utf-8")
        parser.ordered_attributes = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.EntityDeclHandler = self._entity

    def read(self) -> None:
        data = self._document.data
        try:
            self._parser.Parse(data, True)
        except expat.ExpatError as error:
            line, column = self._document.position(self._parser.ErrorByteIndex)
            message = expat.errors.messages[error.code]
            raise MarkupError(self._document.path, line, column, message) from None

    def _start(self, tag: str, given: list[str]) -> None:
        data, start = self._document.data, self._parser.CurrentByteIndex
        name = _NAME.match(data, start)
        assert name is not None
        values = dict(zip(given[::2], given[1::2], strict=True))
        found: list[Attribute] = []
        at = name.end()
        for _ in values:
            match = _ATTRIBUTE.search(data, at)
            assert match is not None
            key = match[1].decode()
            found.append(
                Attribute(key, values[key], match.start(), match.end(), match.start(2) + 1)
            )
            at = match.end()
        head = data.index(b">", at) + 1
        parent = self._open[-1] if self._open else None
        element = Element(self._document, tag, parent, tuple(found), start, head)
        if parent is None:
            self._document.root = element
        else:
            parent.children.append(element)
        self._open.append(element)

    def _end(self, tag: str) -> None:
        element = self._open.pop()
        data = self._document.data
        if data[element.head - 2 : element.head] == b"/>":
            element.tail = element.end = element.head
            return
        element.tail = self._parser.CurrentByteIndex
        element.end = data.index(b">", element.tail) + 1

    def _entity(self, name: str, *rest: object) -> None:
        line, column = self._document.position(self._parser.CurrentByteIndex)
        message = f"it declares the entity `{name}`, which MuJoCo would not replace"
        raise MarkupError(self._document.path, line, column, message)


def place_of(element: Element) -> str:
    """The way to an element from the root, with names, and numbers where there is none."""
    parts: list[str] = []
    here: Element | None = element
    while here is not None:
        above = here.above
        name = here.get("name") or (here.get("class") if here.tag == "default" else None)
        part = here.tag
        if name:
            part += f'[@{"class" if here.tag == "default" else "name"}="{name}"]'
        elif above is not None:
            alike = [one for one in above.spliced() if one.tag == here.tag]
            if len(alike) > 1:
                part += f"[{alike.index(here) + 1}]"
        parts.append(part)
        here = above
    return "/".join(reversed(parts))
