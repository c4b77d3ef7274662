"""Names in the code of a lab that do not exist, such as `data.qps`, `math.sin` or `data.qpos[5]`.

Entry points: `references(lab)`; `name_diagnostics(references, replies)`, once the engine has looked
them up (`site/js/lab/trial/names.js`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from msgspec import Struct
from tree_sitter import Node

from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.core.text.source import Excerpt, Span
from coursebuild.features.lab.compile import pieces
from coursebuild.features.lab.javascript import dotted_names, parse, text_of, walk
from coursebuild.features.lab.model import Lab

_OPEN_OBJECTS = ("ctx", "value", "globalThis")
"""Objects that may have any members."""
_SIZES = {"qpos": "nq", "qvel": "nv", "qacc": "nv", "ctrl": "nu", "act": "na"}
"""Arrays whose length is a size of the model."""


class NameReference(Struct, frozen=True):
    """A name with dots in the code of a lab, or an element of what it names."""

    path: tuple[str, ...]
    places: tuple[Span, ...]
    """The place of each part of the path."""
    index: int | None = None
    """The number in brackets after it."""
    element: Span | None = None
    """The place of all of it, brackets included."""


def references(lab: Lab) -> list[NameReference]:
    """List the names that the pieces of a lab use and do not declare themselves."""
    code = dict(lab.code)
    texts = (code[piece.entry] for piece in pieces(lab) if piece.entry in code)
    return [reference for text in texts for reference in _references(text)]


def _references(code: Excerpt) -> Iterator[NameReference]:
    data = code.text.encode("utf-8", "replace")
    nodes = list(walk(parse(code.text)))
    declared_names = {text_of(name) for node in nodes for name in _declarations(node)}

    def place(node: Node) -> Span:
        start, end = (len(data[:at].decode()) for at in (node.start_byte, node.end_byte))
        return code.span(start, end)

    for node in nodes:
        parts = dotted_names(node) if node.type == "member_expression" else ()
        path = tuple(map(text_of, parts))
        outer = node.parent
        is_longer_name = outer is not None and outer.type == "member_expression"
        if len(path) < 2 or path[0] in (*declared_names, *_OPEN_OBJECTS) or is_longer_name:
            continue
        places = tuple(map(place, parts))
        index = outer.child_by_field_name("index") if outer is not None else None
        if outer is not None and index is not None and text_of(index).isdecimal():
            yield NameReference(path, places, int(text_of(index)), place(outer))
        else:
            yield NameReference(path, places)


def _declarations(node: Node) -> Iterator[Node]:
    """Yield the names that a node declares."""
    if node.type in ("formal_parameters", "array_pattern", "object_pattern"):
        yield from node.named_children
    for field in ("name", "parameter", "left"):
        child = node.child_by_field_name(field)
        if child is not None and child.type == "identifier":
            yield child


def name_diagnostics(
    references: Sequence[NameReference], replies: Sequence[dict[str, Any]]
) -> Iterator[Diagnostic]:
    """Report the names that do not exist, as the engine's reply to each says."""
    for reference, reply in zip(references, replies, strict=True):
        path, length, at = reference.path, reply.get("length"), reply.get("at")
        if at is not None:
            owner = ".".join(path[:at])
            message = f"`{owner}` has no `{path[at]}`" if owner else f"there is no `{path[0]}`"
            help = did_you_mean(path[at], reply["names"])
            yield diagnose("lab-name", reference.places[at], message, help=help)
        elif length is not None and reference.index is not None and reference.index >= length:
            assert reference.element is not None
            size = _SIZES.get(path[-1]) if path[0] == "data" else None
            extent = f"`{size}` is {length}" if size else f"the array has {length} numbers"
            message = f"`{'.'.join(path)}[{reference.index}]` does not exist: {extent}"
            yield diagnose("lab-name", reference.element, message, help="numbers count from 0")
