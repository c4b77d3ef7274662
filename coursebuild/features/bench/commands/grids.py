"""What pages show of reports, on a terminal: their words in English, sentences and tables.

Entry points: `english`, `plain_text`, `grid_lines`.
"""

from __future__ import annotations

import functools
import re

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


def grid_lines(grid: Grid, style: Style) -> list[str]:
    """A table under its label and its titles; remarks stand below, each with its row's name."""
    columns = [
        Column(title, tuple(map(plain_text, cells)), left=not n)
        for n, (title, *cells) in enumerate(zip(grid.head, *grid.rows, strict=True))
        if not n or n not in grid.left
    ]
    head, *rows = table(columns)
    below = [f"{row[0]}: {row[n]}" for row in grid.rows for n in grid.left[1:] if row[n]]
    return [style.paint(grid.label, FAINT), style.paint(head, FAINT), *rows, *map(visible, below)]
