"""Changes of MJCF as replacements of bytes: everything else stays as its author wrote it.

Entry points: `ModelEdit`; `remove`, `set_attributes`, `drop_attribute`, `drop_numbers`,
`set_options` make them; `apply_edits` makes the new bytes, `merge_edits` fewer edits of many.

1. An element that has lines of its own goes with these; one that shares its line goes with the
   blanks beside it. Comments stay, also those beside what goes.
2. MuJoCo takes no included file without an element: where nothing is left in one, the `include`
   goes, and the file stays.
3. What is written newly takes the line ends and the indentation that it finds.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from typing import TypeAlias

from msgspec import Struct

from coursebuild.numerics.pruning.markup import Element, Markup

Settings: TypeAlias = Sequence[tuple[str, str | None]]
"""Names of attributes and their values; `None` for one to take out."""
_BLANKS_BEFORE = re.compile(rb"[ \t]*\Z")
_BLANKS_AFTER = re.compile(rb"[ \t]*")
_LINE_END = re.compile(rb"\r\n|\r|\n")
_NUMBER = re.compile(rb"[^\s]+")
_SECTIONS = frozenset(
    ("actuator", "asset", "contact", "default", "equality", "keyframe", "sensor", "tendon")
)
"""What may go when nothing is left in it."""


class ModelEdit(Struct, frozen=True, order=True):
    """Bytes `[start, end)` of a file replaced."""

    path: str
    start: int
    end: int
    new: bytes


def apply_edits(data: bytes, edits: Iterable[ModelEdit]) -> bytes:
    """The bytes with all edits of one file; an edit inside of what another one removes is void.

    Raises:
        ValueError: two of them contradict each other.
    """
    parts: list[bytes] = []
    last = 0
    for edit in sorted(set(edits), key=lambda one: (one.start, -one.end, one.new)):
        if edit.end <= last and edit.start < last:
            continue
        if edit.start < last:
            raise ValueError(f"two changes overlap at byte {edit.start} of {edit.path}")
        parts += [data[last : edit.start], edit.new]
        last = edit.end
    return b"".join((*parts, data[last:]))


def merge_edits(edits: Iterable[ModelEdit]) -> tuple[ModelEdit, ...]:
    """The same changes in order, with removals that follow each other in one."""
    found: list[ModelEdit] = []
    for edit in sorted(set(edits)):
        last = found[-1] if found else None
        joins = last is not None and (last.path, last.end) == (edit.path, edit.start)
        if last is not None and joins and not (last.new or edit.new):
            found[-1] = ModelEdit(last.path, last.start, edit.end, b"")
        else:
            found.append(edit)
    return tuple(found)


# ---------------------------------------------------------------------------------------- elements


def remove(elements: Iterable[Element]) -> tuple[ModelEdit, ...]:
    """Take elements out of their files, with sections of which nothing is left."""
    gone = set(elements)
    waiting = list(gone)
    while waiting:
        parent = waiting.pop().parent
        if parent is None or parent in gone or not gone.issuperset(parent.children):
            continue
        include = parent.document.at if parent.parent is None else None
        if include is not None:
            gone -= set(parent.children)
            gone.add(include)
            waiting.append(include)
        elif parent.tag in _SECTIONS and not (parent.attributes or _has_more(parent)):
            gone.add(parent)
            waiting.append(parent)
    return tuple(sorted(_removal(one) for one in gone if not _goes_with_another(one, gone)))


def _goes_with_another(element: Element, gone: Collection[Element]) -> bool:
    """Whether its parent goes, or an `include` that pulls in the file that it is in."""
    if element.parent in gone:
        return True
    include = element.document.at
    return include is not None and (include in gone or _goes_with_another(include, gone))


def _has_more(parent: Element) -> bool:
    """Whether there is something besides the children: a comment."""
    ends = [parent.head, *(child.end for child in parent.children)]
    starts = [*(child.start for child in parent.children), parent.tail]
    data = parent.document.data
    return any(data[end:start].strip() for end, start in zip(ends, starts, strict=True))


def _removal(element: Element) -> ModelEdit:
    data, start, end = element.document.data, element.start, element.end
    left = _before(data, start)
    right = _after(data, end)
    line_end = _LINE_END.match(data, right)
    begins = left == 0 or data[left - 1 : left] in (b"\n", b"\r")
    if begins:  # of a line that holds nothing else, its end goes too
        start, end = (left, line_end.end()) if line_end else (start, right)
    else:
        start = left
    return ModelEdit(element.document.path, start, end, b"")


def _before(data: bytes, at: int) -> int:
    """Where the blanks begin that stand before a byte."""
    line = max(data.rfind(b"\n", 0, at), data.rfind(b"\r", 0, at)) + 1
    found = _BLANKS_BEFORE.search(data, line, at)
    return at if found is None else found.start()


def _after(data: bytes, at: int) -> int:
    """Where the blanks end that stand behind a byte."""
    found = _BLANKS_AFTER.match(data, at)
    return at if found is None else found.end()


# -------------------------------------------------------------------------------------- attributes


def set_attributes(element: Element, values: Iterable[tuple[str, str]]) -> tuple[ModelEdit, ...]:
    """Give attributes other values; write those that are not there behind the last."""
    path = element.document.path
    edits: list[ModelEdit] = []
    new: list[tuple[str, str]] = []
    for name, value in values:
        there = element.attribute(name)
        if there is not None:
            edits.append(ModelEdit(path, *there.inner, value.encode()))
        else:
            new.append((name, value))
    if new:
        tag = element.start + 1 + len(element.tag.encode())
        at = max([a.end for a in element.attributes], default=tag)
        edits.append(ModelEdit(path, at, at, _written(new)))
    return tuple(edits)


def _written(values: Iterable[tuple[str, str]]) -> bytes:
    return "".join(f' {name}="{value}"' for name, value in values).encode()


def drop_attribute(element: Element, name: str) -> ModelEdit:
    """Take out an attribute, with the blanks before it."""
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
    spans = [match.span() for match in _NUMBER.finditer(element.document.data[start:end])]
    left = [place for place in range(len(spans)) if place not in places]
    if not left:
        return (drop_attribute(element, name),)
    path, found = element.document.path, []
    for place in range(left[-1]):  # each with the blanks behind it
        if place not in left:
            found.append(ModelEdit(path, start + spans[place][0], start + spans[place + 1][0], b""))
    if left[-1] + 1 < len(spans):  # the last ones with the blanks before them
        found.append(ModelEdit(path, start + spans[left[-1]][1], start + spans[-1][1], b""))
    return tuple(found)


# ----------------------------------------------------------------------------------------- options


def set_options(main: Markup, options: Settings, flags: Settings) -> tuple[ModelEdit, ...]:
    """Set attributes of `option` and of its `flag`, or take them out (`None`), all at once.

    What is left without attributes goes; what is not there yet is written into the model's own
    file.
    """
    holders = [one for one in main.root.spliced() if one.tag == "option"]
    flagged = [one for holder in holders for one in holder.spliced() if one.tag == "flag"]
    own = [one for one in holders if one.document is main]
    spared: set[Element] = set()
    edits, new = _changed(holders, options, main, spared)
    more, new_flags = _changed(flagged, flags, main, spared)
    flag = b"<flag" + _written(new_flags) + b"/>" if new_flags else b""
    if new or (flag and not own):
        inner = b">" + flag + b"</option>" if flag else b"/>"
        edits.append(_first_child(main.root, b"<option" + _written(new) + inner))
    elif flag:
        edits.append(_first_child(own[-1], flag))
        spared.add(own[-1])
    gone: list[Element] = []
    for one, wanted in (*((one, flags) for one in flagged), *((one, options) for one in holders)):
        if one not in spared and _is_emptied(one, wanted, gone):
            gone.append(one)
    return (*edits, *more, *remove(gone))


def _changed(
    elements: Sequence[Element], wanted: Settings, main: Markup, spared: set[Element]
) -> tuple[list[ModelEdit], list[tuple[str, str]]]:
    """Edits of elements that are there, and what none of them can take."""
    edits: list[ModelEdit] = []
    new: list[tuple[str, str]] = []
    for name, value in wanted:
        having = [one for one in elements if one.attribute(name) is not None]
        if value is None:
            edits += [drop_attribute(one, name) for one in having]
        elif having:
            edits += set_attributes(having[-1], ((name, value),))
        else:
            new.append((name, value))
    own = [one for one in elements if one.document is main]
    if not new or not own:
        return edits, new
    spared.add(own[-1])
    return [*edits, *set_attributes(own[-1], new)], []


def _is_emptied(element: Element, wanted: Settings, gone: Collection[Element]) -> bool:
    """Whether something was in an element, and nothing is left."""
    dropped = {name for name, value in wanted if value is None}
    left = [one for one in element.attributes if one.name not in dropped]
    inside = [one for one in element.children if one not in gone]
    had = bool(element.attributes or element.children)
    return had and not (left or inside or _has_more(element))


def _first_child(parent: Element, new: bytes) -> ModelEdit:
    """Write an element before the first child of another, on a line of its own."""
    path, data = parent.document.path, parent.document.data
    newline = b"\r\n" if b"\r\n" in data else b"\n"
    outer = _indent(data, parent.start)
    inner = newline + outer + b"  " + new
    if parent.tail == parent.end:  # it is one tag, `<a/>`
        slash = len(data[: parent.end - 2].rstrip())
        text = b">" + inner + newline + outer + f"</{parent.tag}>".encode()
        return ModelEdit(path, slash, parent.end, text)
    if parent.children:
        first = parent.children[0]
        if data[parent.head : first.start].strip(b" \t") == b"":  # all on one line
            inner = new
        else:
            inner = newline + _indent(data, first.start) + new
    return ModelEdit(path, parent.head, parent.head, inner)


def _indent(data: bytes, at: int) -> bytes:
    """The blanks at the beginning of the line on which a byte stands."""
    line = max(data.rfind(b"\n", 0, at), data.rfind(b"\r", 0, at)) + 1
    return data[line : _after(data, line)]
