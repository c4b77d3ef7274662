"""Changes of MJCF as replacements of bytes: everything else stays as its author wrote it.

Entry points: `Edit`; `remove`, `set_attributes`, `drop_attribute`, `drop_numbers`,
`set_options` make them; `applied` makes the new bytes, `joined` fewer edits of many.

1. An element that has lines of its own goes with these; one that shares its line goes with the
   blanks beside it. Comments stay, also those beside what goes.
2. MuJoCo takes no included file without an element: where nothing is left in one, the `include`
   goes, and the file stays.
3. What is written newly takes the line ends and the indentation that it finds.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TypeAlias

from msgspec import Struct

from coursebuild.numerics.pruning.markup import Document, Element

Settings: TypeAlias = Sequence[tuple[str, str | None]]
"""Names of attributes and their values; `None` for one to take out."""
_BLANK = b" \t"
_NUMBER = re.compile(rb"[^\s]+")
_SECTIONS = frozenset(
    ("actuator", "asset", "contact", "default", "equality", "keyframe", "sensor", "tendon")
)
"""What may go when nothing is left in it."""


class Edit(Struct, frozen=True, order=True):
    """Bytes `[start, end)` of a file replaced."""

    path: str
    start: int
    end: int
    new: bytes


def applied(data: bytes, edits: Iterable[Edit]) -> bytes:
    """The bytes with all edits of one file; an edit inside of what another one removes is void.

    Raises:
        ValueError: two of them contradict each other.
    """
    parts: list[bytes] = []
    at, last = 0, 0
    for edit in sorted(set(edits), key=lambda one: (one.start, -one.end, one.new)):
        if edit.end <= last and edit.start < last:
            continue
        if edit.start < last:
            raise ValueError(f"two changes overlap at byte {edit.start} of {edit.path}")
        parts += [data[at : edit.start], edit.new]
        at = last = edit.end
    return b"".join((*parts, data[at:]))


def joined(edits: Iterable[Edit]) -> tuple[Edit, ...]:
    """The same changes in order, with removals that follow each other in one."""
    found: list[Edit] = []
    for edit in sorted(set(edits)):
        last = found[-1] if found else None
        removals = last is not None and not (last.new or edit.new)
        if last is not None and removals and (last.path, last.end) == (edit.path, edit.start):
            found[-1] = Edit(last.path, last.start, edit.end, b"")
        else:
            found.append(edit)
    return tuple(found)


def remove(elements: Collection[Element]) -> tuple[Edit, ...]:
    """Take elements out of their files, with sections of which nothing is left."""
    gone = {id(one): one for one in elements}
    waiting = list(elements)
    while waiting:
        parent = waiting.pop().parent
        if parent is None or id(parent) in gone:
            continue
        if not all(id(child) in gone for child in parent.children):
            continue
        pulled = parent.document.at if parent.parent is None else None
        if pulled is not None:
            for child in parent.children:
                gone.pop(id(child))
            gone[id(pulled)] = pulled
            waiting.append(pulled)
        elif parent.tag in _SECTIONS and not (parent.attributes or _has_more(parent)):
            gone[id(parent)] = parent
            waiting.append(parent)
    gone = {key: one for key, one in gone.items() if not _is_pulled(one, gone)}
    top = [one for one in gone.values() if one.parent is None or id(one.parent) not in gone]
    return tuple(sorted(_removal(one) for one in top))


def _is_pulled(element: Element, gone: Mapping[int, Element]) -> bool:
    """Whether it is in a file whose `include` goes."""
    at = element.document.at
    return at is not None and (id(at) in gone or _is_pulled(at, gone))


def _has_more(parent: Element) -> bool:
    """Whether there is something besides the children: a comment."""
    data, at = parent.document.data, parent.head
    for child in parent.children:
        if data[at : child.start].strip():
            return True
        at = child.end
    return bool(data[at : parent.tail].strip())


def _removal(element: Element) -> Edit:
    data, start, end = element.document.data, element.start, element.end
    left = start
    while left and data[left - 1 : left] in (b" ", b"\t"):
        left -= 1
    right = end
    while data[right : right + 1] and data[right : right + 1] in _BLANK:
        right += 1
    begins = left == 0 or data[left - 1 : left] in (b"\n", b"\r")
    line_end = _line_end(data, right)
    if begins and line_end:
        start, end = left, right + line_end
    elif begins:
        end = right
    else:
        start = left
    return Edit(element.document.path, start, end, b"")


def _line_end(data: bytes, at: int) -> int:
    """Bytes of the line end that stands there."""
    if data[at : at + 2] == b"\r\n":
        return 2
    return 1 if data[at : at + 1] in (b"\n", b"\r") else 0


def set_attributes(element: Element, values: Iterable[tuple[str, str]]) -> tuple[Edit, ...]:
    """Give attributes other values; write those that are not there behind the last."""
    path = element.document.path
    edits: list[Edit] = []
    new = ""
    for name, value in values:
        there = element.attribute(name)
        if there is not None:
            edits.append(Edit(path, *there.inner, value.encode()))
        else:
            new += f' {name}="{value}"'
    if new:
        tag = element.start + 1 + len(element.tag.encode())
        at = max([a.end for a in element.attributes], default=tag)
        edits.append(Edit(path, at, at, new.encode()))
    return tuple(edits)


def drop_attribute(element: Element, name: str) -> Edit:
    """Take out an attribute, with the blanks before it."""
    there = element.attribute(name)
    assert there is not None, name
    data, start = element.document.data, there.start
    while data[start - 1 : start].isspace():
        start -= 1
    return Edit(element.document.path, start, there.end, b"")


def drop_numbers(element: Element, name: str, places: Collection[int]) -> tuple[Edit, ...]:
    """Take numbers (from 0) out of an attribute that lists some; nothing where it has fewer."""
    there = element.attribute(name)
    if there is None or not places:
        return ()
    start, end = there.inner
    data = element.document.data[start:end]
    spans = [match.span() for match in _NUMBER.finditer(data)]
    gone = sorted(place for place in places if place < len(spans))
    if len(gone) == len(spans):
        return (drop_attribute(element, name),)
    found: list[Edit] = []
    for place in gone:
        # With the blanks behind it; the last number has none, and takes those before it.
        stop = spans[place + 1][0] if place + 1 < len(spans) else spans[place][1]
        begin = spans[place][0]
        if place + 1 == len(spans):
            first = place
            while first - 1 in places:
                first -= 1
            begin = spans[first - 1][1]
            found = [one for one in found if one.start < start + begin]
        found.append(Edit(element.document.path, start + begin, start + stop, b""))
    return tuple(found)


def set_options(main: Document, options: Settings, flags: Settings) -> tuple[Edit, ...]:
    """Set attributes of `option` and of its `flag`, or take them out (`None`), all at once.

    What is left without attributes goes; what is not there yet is written into the model's own
    file.
    """
    holders = [one for one in main.root.spliced() if one.tag == "option"]
    flagged = [one for holder in holders for one in holder.spliced() if one.tag == "flag"]
    own = [one for one in holders if one.document is main]
    edits, new, target = _settled(holders, options, main)
    more, new_flags, flag_target = _settled(flagged, flags, main)
    spared = [one for one in (target, flag_target) if one is not None]
    gone = _emptied(holders, flagged, options, flags, spared)
    edits += more
    text = "".join(f' {name}="{value}"' for name, value in new_flags.items())
    flag = f"<flag{text}/>".encode() if new_flags else b""
    if new and target is None:
        text = "".join(f' {name}="{value}"' for name, value in new.items())
        inner = b">" + flag + b"</option>" if flag else b"/>"
        edits.append(_first_child(main.root, f"<option{text}".encode() + inner))
    elif flag and not own:
        edits.append(_first_child(main.root, b"<option>" + flag + b"</option>"))
    elif flag:
        edits.append(_first_child(own[-1], flag))
        gone = [one for one in gone if one is not own[-1]]
    return (*edits, *remove(gone))


def _settled(
    elements: Sequence[Element], wanted: Settings, main: Document
) -> tuple[list[Edit], dict[str, str], Element | None]:
    """Edits of attributes that are there, those to be written newly, and where."""
    edits: list[Edit] = []
    new: dict[str, str] = {}
    for name, value in wanted:
        having = [one for one in elements if one.attribute(name) is not None]
        if value is None:
            edits += [drop_attribute(one, name) for one in having]
        elif having:
            edits += set_attributes(having[-1], ((name, value),))
        else:
            new[name] = value
    own = [one for one in elements if one.document is main]
    if not new or not own:
        return edits, new, None
    edits += set_attributes(own[-1], new.items())
    return edits, {}, own[-1]


def _emptied(
    holders: Sequence[Element],
    flagged: Sequence[Element],
    options: Settings,
    flags: Settings,
    spared: Sequence[Element],
) -> list[Element]:
    """Elements of which nothing is left."""

    def bare(one: Element, wanted: Settings) -> bool:
        dropped = {name for name, value in wanted if value is None}
        named = {attribute.name for attribute in one.attributes}
        return bool(named) and named <= dropped and not _has_more(one) and one not in spared

    gone = [one for one in flagged if bare(one, flags) and not one.children]
    for holder in holders:
        left = [one for one in holder.children if one not in gone]
        had = bool(holder.attributes)
        if left or holder in spared or _has_more(holder):
            continue
        if bare(holder, options) if had else bool(holder.children):
            gone.append(holder)
    return gone


def _first_child(parent: Element, new: bytes) -> Edit:
    """Write an element before the first child of another, on a line of its own."""
    document = parent.document
    data = document.data
    newline = b"\r\n" if b"\r\n" in data else b"\n"
    outer = _indent(data, parent.start)
    if parent.is_empty:
        inner = outer + b"  "
        slash = data.rindex(b"/", parent.start, parent.end)
        while data[slash - 1 : slash].isspace():
            slash -= 1
        text = b">" + newline + inner + new + newline + outer + f"</{parent.tag}>".encode()
        return Edit(document.path, slash, parent.end, text)
    if not parent.children:
        inner = outer + b"  "
        return Edit(document.path, parent.head, parent.head, newline + inner + new)
    first = parent.children[0]
    if data[parent.head : first.start].strip(b" \t") == b"":  # all on one line
        return Edit(document.path, parent.head, parent.head, new)
    inner = _indent(data, first.start)
    return Edit(document.path, parent.head, parent.head, newline + inner + new)


def _indent(data: bytes, at: int) -> bytes:
    """The blanks at the beginning of the line on which a byte stands."""
    begin = max(data.rfind(b"\n", 0, at), data.rfind(b"\r", 0, at)) + 1
    end = begin
    while data[end : end + 1] and data[end : end + 1] in _BLANK:
        end += 1
    return data[begin:end]
