"""Layouts of what a lesson holds, without another meaning: paragraphs, tables, JSON.

Entry points: `split_words` and `fill_lines`; `align_table`; `layout_json`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise

from coursebuild.core.syntax.json_text import to_one_line
from coursebuild.core.syntax.nodes import ArrayNode, Member, Node, ObjectNode
from coursebuild.core.text.characters import cells
from coursebuild.core.text.source import Span

GAP = re.compile(r"[ \t]*(?:\r\n|\r|\n)([ \t>]*)|[ \t]+")
"""White space between words; group 1 is the prefix of the next line in a quote or list."""
_OPENING = re.compile(r"[-+*#=_|]+$|>|\d+[.)]$|`{3}|~{3}|\$\$")
"""Words that would begin another block if they began a line."""
_PIPE = re.compile(r"(?<!\\)\|")


def split_words(span: Span, unbreakable: Sequence[Span]) -> list[str]:
    """Split a text into words, except within unbreakable parts."""
    words, word_start = [""], 0
    for gap in GAP.finditer(span.text):
        place = span.start + gap.start()
        words[-1] += span.text[word_start : gap.start()]
        word_start = gap.end()
        if any(part.start < place < part.end for part in unbreakable):
            words[-1] += gap[0] if gap[1] is None else " "
        else:
            words.append("")
    words[-1] += span.text[word_start:]
    return words


def fill_lines(words: Sequence[str], width: int, column: int, prefix: str) -> list[str]:
    """Fill lines with words; the first line begins at a column, the others with a prefix."""
    lines = [words[0]]
    column += cells(words[0])
    for word in words[1:]:
        column += 1 + cells(word)
        if column > width and not _OPENING.match(word):
            lines.append(word)
            column = len(prefix) + cells(word)
        else:
            lines[-1] += f" {word}"
    return lines


def align_table(rows: Sequence[str], width: int) -> list[str]:
    """Align the columns of a table where it is not too wide; the second row are the delimiters."""
    table = [[cell.strip(" \t") for cell in _PIPE.split(row)] for row in rows]
    table = [row[not row[0] : len(row) - (not row[-1])] for row in table]
    marks = table.pop(1)
    if any(len(row) > len(marks) for row in table):
        return list(rows)
    table = [row + [""] * (len(marks) - len(row)) for row in table]
    min_widths = [3 + mark.count(":") for mark in marks]
    widths = [max(cells(cell) for cell in column) for column in zip(*table, strict=True)]
    widths = [max(pair) for pair in zip(widths, min_widths, strict=True)]
    fits = sum(widths) + 3 * len(widths) + 1 <= width
    table = [
        [_pad(*cell) if fits else cell[0] for cell in zip(row, widths, marks, strict=True)]
        for row in table
    ]
    table.insert(
        1,
        [
            _write_delimiter(*mark)
            for mark in zip(marks, widths if fits else min_widths, strict=True)
        ],
    )
    return ["|" + "".join(f" {cell} |" if cell else " |" for cell in row) for row in table]


def _pad(cell: str, width: int, mark: str) -> str:
    room = width - cells(cell)
    left = 0 if not mark.endswith(":") else room // 2 if mark.startswith(":") else room
    return " " * left + cell + " " * (room - left)


def _write_delimiter(mark: str, width: int) -> str:
    left, right = mark.startswith(":"), mark.endswith(":")
    return ":" * left + "-" * (width - left - right) + ":" * right


# --- JSON


def layout_json(node: Node, width: int, column: int = 0, indent: int = 0) -> str:
    """Return the text of a value that begins at a column, inside a parent with this indent.

    Only white space between its values changes. An object or list keeps the line breaks of its
    author; one on a single line stays there where it fits. Members are indented by two columns more
    than their parent; those that begin on the line of the bracket are aligned after it.
    """
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
