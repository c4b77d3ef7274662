"""MJCF as text whose every element and attribute knows its place in bytes, and changes of it.

1. The standard library's parser gives the bytes at which an element begins and ends; attributes are
   then looked up in its tag. Whatever the file declares, it is read as UTF-8, as MuJoCo does.
2. Nothing is normalised: an edit replaces bytes, and all others stay as their author wrote them.
3. MuJoCo's own parser takes some texts that are no XML. These are refused, with the place.
4. An element on lines of its own is removed with these lines; one that shares its line with the
   blanks before it. Comments stay, also those beside what is removed.
5. A section is removed with the last element in it, and so is the `include` of a file: MuJoCo takes
   no included file without an element.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from xml.parsers import expat

from msgspec import Struct, field
from msgspec.structs import replace

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
        name = _NAME.match(data, begin)
        assert name is not None
        at, attributes = name.end(), []
        for key, value in zip(pairs[::2], pairs[1::2], strict=True):
            match = _ATTRIBUTE.search(data, at)
            assert match is not None
            at, value_span = match.end(), (match.start(2) + 1, match.end() - 1)
            attributes.append(Attribute(key, value, match.start(), at, value_span))
        parent = stack[-1] if stack else None
        head = data.index(b">", at) + 1
        element = Element(document, tag, parent, tuple(attributes), begin, head)
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


_BLANKS = re.compile(rb"[ \t]*")
_LINE_END = re.compile(rb"\r\n|\r|\n|\Z")
_NUMBER = re.compile(rb"[^\s]+\s*")
_SECTIONS = frozenset(
    "actuator asset contact default equality keyframe option sensor tendon".split(" ")
)
"""Elements that are removed when nothing is left in them."""


class ModelEdit(Struct, frozen=True, order=True):
    """Bytes `[start, end)` of a file replaced."""

    path: str
    start: int
    end: int
    new: bytes


def apply_edits(data: bytes, edits: Iterable[ModelEdit]) -> bytes:
    """The bytes with all edits of one file.

    Raises:
        ValueError: two of them contradict each other.
    """
    parts: list[bytes] = []
    last = 0
    for edit in merge_edits(edits):
        if edit.start < last:
            raise ValueError(f"two changes overlap at byte {edit.start} of {edit.path}")
        parts += [data[last : edit.start], edit.new]
        last = edit.end
    return b"".join((*parts, data[last:]))


def merge_edits(edits: Iterable[ModelEdit]) -> tuple[ModelEdit, ...]:
    """The same changes in order; adjoining removals are joined, those inside another dropped."""
    joined_edits: list[ModelEdit] = []
    for edit in sorted(set(edits), key=lambda e: (e.path, e.start, -e.end, e.new)):
        last = joined_edits[-1] if joined_edits else None
        follows_removal = last is not None and last.path == edit.path and not last.new
        if last is not None and follows_removal and edit.start < last.end and edit.end <= last.end:
            continue
        if last is not None and follows_removal and edit.start == last.end and not edit.new:
            joined_edits[-1] = replace(last, end=edit.end)
        else:
            joined_edits.append(edit)
    return tuple(joined_edits)


def remove_elements(elements: Iterable[Element]) -> tuple[ModelEdit, ...]:
    """Remove elements from their files, with sections that are empty then."""
    removals = set(elements)
    queue = list(removals)
    includes: set[Element] = set()
    while queue:
        element = queue.pop()
        document, parent = element.document, element.parent
        while document.include is not None and removals.issuperset(document.root.children):
            includes.add(document.include)
            document = document.include.document
        if parent is None or parent in removals or not removals.issuperset(parent.children):
            continue
        if _is_left_empty(parent, includes):
            removals.add(parent)
            queue.append(parent)
    edits = []
    for element in removals | includes:
        document, start, end = element.document, element.start, element.end
        if document.include in includes:
            continue  # a file that nothing includes any more stays as it is
        data = document.data
        line = max(data.rfind(b"\n", 0, start), data.rfind(b"\r", 0, start)) + 1
        left = line + len(data[line:start].rstrip(b" \t"))
        blanks = _BLANKS.match(data, end)
        right = end if blanks is None else blanks.end()
        line_end = _LINE_END.match(data, right)
        if left > line:
            start = left
        elif line_end is None:  # more stands behind it on its line
            end = right
        else:
            start, end = left, line_end.end()
        edits.append(ModelEdit(document.path, start, end, b""))
    return merge_edits(edits)


def _is_left_empty(section: Element, includes: Collection[Element]) -> bool:
    """Whether a section is empty without its elements: no attribute, no comment."""
    if section.tag not in _SECTIONS or section.attributes:
        return False
    children = [element for element in section.children if element.document is section.document]
    inner = [element for element in includes if element.parent is section]
    data, at, rest = section.document.data, section.head, b""
    for element in sorted((*children, *inner), key=lambda child: child.start):
        rest += data[at : element.start]
        at = element.end
    return not (rest + data[at : section.tail]).strip()


def set_attributes(element: Element, values: Iterable[tuple[str, str]]) -> tuple[ModelEdit, ...]:
    """Give attributes other values; write those that are not there behind the last."""
    path = element.document.path
    edits: list[ModelEdit] = []
    addition = ""
    for name, value in values:
        attribute = element.attribute(name)
        if attribute is not None:
            edits.append(ModelEdit(path, *attribute.inner, value.encode()))
        else:
            addition += f' {name}="{value}"'
    if addition:
        tag = element.start + 1 + len(element.tag.encode())
        at = max([a.end for a in element.attributes], default=tag)
        edits.append(ModelEdit(path, at, at, addition.encode()))
    return tuple(edits)


def find_emptied(
    drops: Collection[tuple[Element, str]], edits: Collection[ModelEdit]
) -> list[Element]:
    """Elements that have nothing left without these attributes, and no edit inside."""
    return [
        element
        for element in dict.fromkeys(element for element, _ in drops)
        if not element.children
        and all((element, attribute.name) in drops for attribute in element.attributes)
        and not any(
            edit.path == element.document.path and element.start < edit.start < element.end
            for edit in edits
        )
    ]


def drop_attribute(element: Element, name: str) -> ModelEdit:
    """Remove an attribute with the blanks before it."""
    attribute = element.attribute(name)
    assert attribute is not None, name
    start = len(element.document.data[: attribute.start].rstrip())
    return ModelEdit(element.document.path, start, attribute.end, b"")


def drop_numbers(element: Element, name: str, places: Collection[int]) -> tuple[ModelEdit, ...]:
    """Remove the numbers at these places (from 0) from an attribute that is a list."""
    attribute = element.attribute(name)
    if attribute is None or not places:
        return ()
    start, end = attribute.inner
    numbers = [match.group() for match in _NUMBER.finditer(element.document.data[start:end])]
    rest = [number for place, number in enumerate(numbers) if place not in places]
    if len(rest) == len(numbers):
        return ()
    if not rest:
        return (drop_attribute(element, name),)
    return (ModelEdit(element.document.path, start, end, b"".join(rest).rstrip()),)


def set_option(main: Markup, tag: str, name: str, value: str) -> tuple[ModelEdit, ...]:
    """Set an attribute of `option`, or of its `flag`, where it stands or in a new element."""
    holders = [element for element in main.root.walk() if element.tag == tag]
    carriers = [element for element in holders if element.attribute(name) is not None]
    choices = carriers or [element for element in holders if element.document is main]
    if choices:
        return set_attributes(choices[-1], ((name, value),))
    new = f'<{tag} {name}="{value}"/>'
    if tag == "flag":
        new = f"<option>{new}</option>"
    # On a line of its own, indented as the first element is.
    data, head = main.data, main.root.head
    blank = re.match(rb"\s*", data[head:])
    lead = blank.group() if blank is not None and b"\n" in blank.group() else b""
    return (ModelEdit(main.path, head, head, lead + new.encode()),)
