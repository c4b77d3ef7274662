"""Changes of MJCF as replacements of bytes: everything else stays as its author wrote it.

Entry points: `ModelEdit`; `remove`, `set_attributes`, `drop_attribute`, `drop_numbers` and
`set_option` make them; `apply_edits` makes the new bytes, `merge_edits` fewer edits of many.

1. An element that has lines of its own goes with these; one that shares its line goes with the
   blanks beside it. Comments stay, also those beside what goes.
2. A section goes with the last element in it, and so does the `include` of a file: MuJoCo takes no
   included file without an element.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.numerics.pruning.markup import Element, Markup

_BLANKS = re.compile(rb"[ \t]*")
_LINE_END = re.compile(rb"\r\n|\r|\n|\Z")
_NUMBER = re.compile(rb"[^\s]+\s*")
_SECTIONS = frozenset(
    "actuator asset contact default equality keyframe option sensor tendon".split(" ")
)
"""What may go when nothing is left in it."""


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
    """The same changes in order: removals that follow each other in one, and none inside of one."""
    found: list[ModelEdit] = []
    for edit in sorted(set(edits), key=lambda one: (one.path, one.start, -one.end, one.new)):
        last = found[-1] if found else None
        removed = last is not None and last.path == edit.path and not last.new
        if last is not None and removed and edit.start < last.end and edit.end <= last.end:
            continue
        if last is not None and removed and edit.start == last.end and not edit.new:
            found[-1] = replace(last, end=edit.end)
        else:
            found.append(edit)
    return tuple(found)


def remove(elements: Iterable[Element]) -> tuple[ModelEdit, ...]:
    """Take elements out of their files, with sections of which nothing is left."""
    gone = set(elements)
    waiting = list(gone)
    includes: set[Element] = set()
    while waiting:
        element = waiting.pop()
        document, parent = element.document, element.parent
        while document.at is not None and gone.issuperset(document.root.children):
            includes.add(document.at)
            document = document.at.document
        if parent is None or parent in gone or not gone.issuperset(parent.children):
            continue
        if _goes_too(parent, includes):
            gone.add(parent)
            waiting.append(parent)
    # A file that nothing includes any more stays as it is.
    return merge_edits(_removal(o) for o in gone | includes if o.document.at not in includes)


def _goes_too(section: Element, includes: Collection[Element]) -> bool:
    """Whether a section holds nothing besides its elements: no attribute, no comment."""
    if section.tag not in _SECTIONS or section.attributes:
        return False
    own = [one for one in section.children if one.document is section.document]
    inner = [one for one in includes if one.parent is section]
    data, at, rest = section.document.data, section.head, b""
    for one in sorted((*own, *inner), key=lambda each: each.start):
        rest += data[at : one.start]
        at = one.end
    return not (rest + data[at : section.tail]).strip()


def _removal(element: Element) -> ModelEdit:
    data, start, end = element.document.data, element.start, element.end
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
    return ModelEdit(element.document.path, start, end, b"")


def set_attributes(element: Element, values: Iterable[tuple[str, str]]) -> tuple[ModelEdit, ...]:
    """Give attributes other values; write those that are not there behind the last."""
    path = element.document.path
    edits: list[ModelEdit] = []
    new = ""
    for name, value in values:
        there = element.attribute(name)
        if there is not None:
            edits.append(ModelEdit(path, *there.inner, value.encode()))
        else:
            new += f' {name}="{value}"'
    if new:
        tag = element.start + 1 + len(element.tag.encode())
        at = max([a.end for a in element.attributes], default=tag)
        edits.append(ModelEdit(path, at, at, new.encode()))
    return tuple(edits)


def emptied(drops: Collection[tuple[Element, str]], edits: Collection[ModelEdit]) -> list[Element]:
    """Elements of which nothing is left without these attributes; not those in which edits are."""
    return [
        element
        for element in dict.fromkeys(element for element, _ in drops)
        if not element.children
        and all((element, one.name) in drops for one in element.attributes)
        and not any(
            one.path == element.document.path and element.start < one.start < element.end
            for one in edits
        )
    ]


def drop_attribute(element: Element, name: str) -> ModelEdit:
    """Take out an attribute with the blanks before it."""
    there = element.attribute(name)
    assert there is not None, name
    start = len(element.document.data[: there.start].rstrip())
    return ModelEdit(element.document.path, start, there.end, b"")


def drop_numbers(element: Element, name: str, places: Collection[int]) -> tuple[ModelEdit, ...]:
    """Take numbers (from 0) out of an attribute that lists some; nothing where it has fewer."""
    there = element.attribute(name)
    if there is None or not places:
        return ()
    start, end = there.inner
    numbers = [match.group() for match in _NUMBER.finditer(element.document.data[start:end])]
    left = [number for place, number in enumerate(numbers) if place not in places]
    if len(left) == len(numbers):
        return ()
    if not left:
        return (drop_attribute(element, name),)
    return (ModelEdit(element.document.path, start, end, b"".join(left).rstrip()),)


def set_option(main: Markup, tag: str, name: str, value: str) -> tuple[ModelEdit, ...]:
    """Set an attribute of `option`, or of its `flag`, where it stands or in a new element."""
    holders = [one for one in main.root.walk() if one.tag == tag]
    having = [one for one in holders if one.attribute(name) is not None]
    own = having or [one for one in holders if one.document is main]
    if own:
        return set_attributes(own[-1], ((name, value),))
    new = f'<{tag} {name}="{value}"/>'
    if tag == "flag":
        new = f"<option>{new}</option>"
    # On a line of its own, indented as the first element is.
    data, head = main.data, main.root.head
    blank = re.match(rb"\s*", data[head:])
    lead = blank.group() if blank is not None and b"\n" in blank.group() else b""
    return (ModelEdit(main.path, head, head, lead + new.encode()),)
