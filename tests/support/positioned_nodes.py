"""Nodes of JSON and TOML with their places, and what is told of a text."""

from __future__ import annotations

from coursebuild.core.syntax.nodes import (
    ArrayNode,
    BoolNode,
    DateNode,
    Node,
    NullNode,
    NumberNode,
    ObjectNode,
    StringNode,
)
from coursebuild.core.text.diagnostics import Diagnostic


def format_diagnostics(diagnostics: tuple[Diagnostic, ...]) -> list[str]:
    """Each mistake in a line: its place, rule, message and help."""
    return [
        f"{d.span.line}:{d.span.column}-{d.span.end_column} {d.rule}: {d.message}"
        + (f" [{d.help}]" if d.help else "")
        for d in diagnostics
    ]


def plain(node: Node) -> object:
    """The value as `json.loads` and `tomllib.loads` give it, but for dates."""
    match node:
        case ObjectNode():
            return {name: plain(member.value) for name, member in node.members.items()}
        case ArrayNode():
            return [plain(item) for item in node.items]
        case StringNode():
            assert node.excerpt.text == node.value
            return node.value
        case NumberNode() | BoolNode():
            return node.value
        case NullNode():
            return None
        case DateNode():
            return "a date"
        case _:
            raise AssertionError(node)
