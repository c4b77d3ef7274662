"""Shows on a terminal what pages show of reports: sentences in English, and tables.

Entry points: `english`, `plain_text`, `grid_lines`.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence

from markupsafe import Markup

from coursebuild.core.files.resources import template_texts
from coursebuild.core.pages.assets import strings_for
from coursebuild.core.pages.strings import Strings
from coursebuild.features.bench.figures import Grid
from coursebuild.report.text import FAINT, Column, Style, table, visible

_SUPERSCRIPTS = str.maketrans("-\u22120123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@functools.cache
def english() -> Strings:
    """Return the words of English pages."""
    return strings_for(template_texts(), "en")


def plain_text(text: str) -> str:
    """Remove the markup of a sentence or a cell."""
    if not isinstance(text, Markup):
        return text
    html = re.sub("<sup>(.*?)</sup>", lambda match: match[1].translate(_SUPERSCRIPTS), str(text))
    return Markup(html).striptags()


def grid_lines(grid: Grid, style: Style, marks: Sequence[tuple[str, str]] = ()) -> list[str]:
    """Write a table of numbers under its label, not wider than the terminal.

    `marks` holds what stands before each row, and the row's colour. Without marks, remarks stand
    below, each with its row's name.
    """
    columns = [Column("", tuple(mark for mark, _ in marks), left=True)] if marks else []
    for n, (title, *cells) in enumerate(zip(grid.head, *grid.rows, strict=True)):
        if not n or n not in grid.left:
            rank = 0 if not n else 2 if n in grid.minor else 1
            columns.append(Column(title, tuple(map(plain_text, cells)), rank, left=not n))
    head, *rows = table(columns, max(style.width, 60) - 4)
    if marks:
        rows = [style.paint(row, code) for row, (_, code) in zip(rows, marks, strict=True)]
    lines = [style.paint(visible(grid.label), FAINT), style.paint(head, FAINT)]
    for part, numbered_rows in grid.bodies:
        lines += [] if part is None else [style.paint(visible(part.title), FAINT)]
        lines += [rows[number] for number, _ in numbered_rows]
    if marks:
        return lines
    remarks = ((row[0], row[n]) for row in grid.rows for n in grid.left[1:])
    return [*lines, *(f"{visible(name)}: {text}" for name, text in remarks if text)]
