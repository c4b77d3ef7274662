"""Lays out JSON: only white space between its values changes.

Entry point: `layout_json`.

An object or list keeps the line breaks of its author; one on a single line stays there where it
fits. Members are indented by two columns more than their parent; those that begin on the line of
the bracket are aligned after it.
"""

from __future__ import annotations

from itertools import pairwise

from coursebuild.core.syntax.json_text import to_one_line
from coursebuild.core.syntax.nodes import ArrayNode, Member, Node, ObjectNode


def layout_json(node: Node, width: int, column: int = 0, indent: int = 0) -> str:
    """Return the text of a value that begins at a column, inside a parent with this indent."""
    line = to_one_line(node).text
    parts = _child_nodes(node)
    if not parts or ("\n" not in node.raw and column + len(line) <= width):
        return line
    breaks = _count_breaks(node, parts)
    inner = indent + 2 if breaks[0] else column + 1 if any(breaks) else indent
    text, at = line[0], column + 1
    for part, lines in zip(parts, breaks, strict=False):
        if lines:
            text, at = text + "\n" * min(lines, 2) + " " * inner, inner
        elif part is not parts[0]:
            text, at = text + " ", at + 1
        key = f"{part.key.raw}: " if isinstance(part, Member) else ""
        value = part.value if isinstance(part, Member) else part
        text += key + layout_json(value, width, at + len(key), inner)
        text += "" if part is parts[-1] else ","
        at = len(text) - text.rfind("\n") - 1 if "\n" in text else column + len(text)
    if breaks[-1]:
        text += "\n" + " " * (indent if breaks[0] else column)
    return text + line[-1]


def _child_nodes(node: Node) -> list[Member] | list[Node]:
    if isinstance(node, ObjectNode):
        return list(node.members.values())
    return node.items if isinstance(node, ArrayNode) else []


def _count_breaks(node: Node, parts: list[Member] | list[Node]) -> list[int]:
    """Count the line ends before each part and the closing bracket; 1 each for a single line."""
    if "\n" not in node.raw:
        return [1] * (len(parts) + 1)
    places = [
        (p.key.start, p.value.end) if isinstance(p, Member) else (p.start, p.end) for p in parts
    ]
    places = [(0, node.start + 1), *places, (node.end - 1, 0)]
    return [node.body.text.count("\n", a[1], b[0]) for a, b in pairwise(places)]
