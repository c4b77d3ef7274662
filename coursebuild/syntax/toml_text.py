"""TOML, every value with its place.

Entry point: `parse_toml(source)`.

1. `tomllib` says whether the text is TOML and what its values are.
2. The scanner says where they stand; the two trees are joined into the nodes that JSON gives too.
3. In a text that is not TOML the scanner looks for what is wrong. Where it finds nothing, the
   message and the place are those of `tomllib`.
"""

from __future__ import annotations

import re
import tomllib
from typing import assert_never

from coursebuild.diagnostics import Diagnostic, Note, Parsed, diagnose
from coursebuild.source import Excerpt, Source
from coursebuild.syntax.escapes import odd_character
from coursebuild.syntax.nodes import (
    ArrayNode,
    BoolNode,
    DateNode,
    Member,
    Node,
    NumberNode,
    ObjectNode,
    StringNode,
)
from coursebuild.syntax.toml_fault import FaultError
from coursebuild.syntax.toml_scan import Item, Scalar, Scanner, Sequence, Table

_PLACE = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")


def parse_toml(source: Source, *, rule: str = "map-syntax") -> Parsed[ObjectNode | None]:
    """The file as a table; no value, and one diagnostic, when it is not TOML. Never raises.

    `rule` is what that diagnostic is called. The value can be there along with diagnostics; a
    caller that finds any must not publish it.
    """
    body = _body(source)
    try:
        data = tomllib.loads(body.text)
    except (ValueError, RecursionError) as error:
        return Parsed(None, (_fault(body, str(error), rule),))
    faults: list[Diagnostic] = []
    try:
        root = Scanner(body, faults).scan()
    except FaultError as fault:  # nesting beyond the limit is TOML all the same
        return Parsed(None, (_diagnostic(body, fault, rule),))
    node = _join(body, root, data)
    assert isinstance(node, ObjectNode)
    return Parsed(node, tuple(faults))


def _body(source: Source) -> Excerpt:
    """The text with CRLF made LF, as `tomllib` reads it; a lone CR stays, since TOML refuses it."""
    lines: list[tuple[str, int]] = []
    at = 0
    for line in source.text.split("\r\n"):
        lines.append((line, at))
        at += len(line) + 2
    return Excerpt.of_lines(source, lines)


def _join(body: Excerpt, item: Item, value: object) -> Node:
    """The node of a place and the value that belongs there."""
    match item:
        case StringNode():
            return item
        case Table():
            assert isinstance(value, dict)
            members = tuple(
                Member(key, _join(body, inner, value[name]))
                for name, (key, inner) in item.members.items()
            )
            return ObjectNode(body, item.start, item.end, *item.mark, members)
        case Sequence():
            assert isinstance(value, list)
            items = tuple(_join(body, inner, v) for inner, v in zip(item.items, value, strict=True))
            return ArrayNode(body, item.start, item.end, item.mark_end, items)
        case Scalar():
            if isinstance(value, bool):
                return BoolNode(body, item.start, item.end, value)
            if isinstance(value, int | float):
                return NumberNode(body, item.start, item.end, value)
            return DateNode(body, item.start, item.end)
        case _:
            assert_never(item)


# -------------------------------------------------------------------------------------- mistakes


def _fault(body: Excerpt, message: str, rule: str) -> Diagnostic:
    """What is wrong with a text of which `tomllib` says `message`."""
    place = _PLACE.search(message)
    at = _offset(body.text, place) if place else 0
    fault: FaultError | None = None
    try:
        Scanner(body, [], strict=True).scan()
    except FaultError as found:
        fault = found
    odd = odd_character(body.text[at : at + 1])
    span = body.span(at, min(at + 1, len(body.text)))
    if odd and (fault is None or at <= fault.start):
        help = "remove it" if at == 0 else "replace it by a plain space, or remove it"
        return diagnose(rule, span, f"{odd} cannot stand here in TOML", help=help)
    if fault is not None:
        return _diagnostic(body, fault, rule)
    words = message[: place.start()] if place else message
    return diagnose(rule, span, words[:1].lower() + words[1:])


def _offset(text: str, place: re.Match[str]) -> int:
    if place[1] is None:
        return len(text)
    line, column = int(place[1]), int(place[2])
    starts = [0, *(match.end() for match in re.finditer("\n", text))]
    return min(starts[min(line, len(starts)) - 1] + column - 1, len(text))


def _diagnostic(body: Excerpt, fault: FaultError, rule: str) -> Diagnostic:
    span = body.span(fault.start, fault.end)
    if fault.first is None:
        return diagnose(rule, span, fault.message, help=fault.help)
    notes = (Note("the first one is here", fault.first.span),)
    return diagnose("field-repeated", span, fault.message, help=fault.help, notes=notes)
