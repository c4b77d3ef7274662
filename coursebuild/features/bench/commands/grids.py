"""What pages show of reports, on a terminal: their words in English, sentences and tables.

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
from coursebuild.report.terminal import FAINT, Column, Style, table, visible

_RAISED = str.maketrans("-\u22120123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@functools.cache
def english() -> Strings:
    """The words of pages."""
    return strings_for(template_texts(), "en")


def plain_text(text: str) -> str:
    """A sentence or a cell without its markup."""
    if not isinstance(text, Markup):
        return text
    raised = re.sub("<sup>(.*?)</sup>", lambda found: found[1].translate(_RAISED), str(text))
    return Markup(raised).striptags()


def grid_lines(grid: Grid, style: Style, marks: Sequence[tuple[str, str]] = ()) -> list[str]:
    """A table of numbers under its label, as wide as the terminal at most.

    `marks`: what stands before each row, and its colour. Without them remarks stand below, each
    with its row's name.
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
    for part, numbered in grid.bodies:
        lines += [] if part is None else [style.paint(visible(part.title), FAINT)]
        lines += [rows[number] for number, _ in numbered]
    if marks:
        return lines
    remarks = ((row[0], row[n]) for row in grid.rows for n in grid.left[1:])
    return [*lines, *(f"{visible(name)}: {told}" for name, told in remarks if told)]
