"""The line-by-line difference between a recorded output and what its script prints now.

Entry points: `diff_rows`; `text_diff`, `shorten`, `quote`.

Lines that match under the comparison's mode count as recorded, even where their characters differ;
lines that a `...` stands for are left out. A row marks the parts of its line that changed.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Literal, TypeAlias

from coursebuild.core.model import Table
from coursebuild.core.model.results import Verdict
from coursebuild.core.scripts.align import Step, StepKind, align
from coursebuild.core.scripts.changes import find_differences
from coursebuild.core.scripts.lines import LineMatcher
from coursebuild.core.scripts.mapped_text import Side

Mark: TypeAlias = Literal[" ", "-", "+"]
_LINES, _WIDTH = 12, 120


DiffRow: TypeAlias = tuple[Mark, list[tuple[str, bool]]]
"""A line as recorded (`-`), as printed (`+`), or both (a space): its parts, and which changed."""


def shorten(text: str, width: int) -> str:
    """The text, cut to a width with an ellipsis sign at its end."""
    return text if len(text) <= width else text[: width - 1] + "…"


def quote(text: str, width: int) -> str:
    """A line of output as a message shows it: cut, without white space at its ends."""
    return f"`{shorten(text.strip(), width)}`"


def text_diff(before: str, now: str) -> str:
    """The lines that two texts do not share, at most twelve of them."""
    lines = [
        shorten(line, _WIDTH)
        for line in difflib.unified_diff(before.splitlines(), now.splitlines(), n=0, lineterm="")
        if not line.startswith(("---", "+++", "@@"))
    ]
    if len(lines) > _LINES:
        lines[_LINES:] = [f"… and {len(lines) - _LINES} more lines"]
    return "\n".join(lines)


def diff_rows(verdict: Verdict, stdout: str) -> tuple[DiffRow, ...]:
    """The rows of a recording that a run differs from.

    Of a table only the cells that changed are shown, as one row each.
    """
    body = verdict.recording.body
    if isinstance(body, Table):
        return tuple(
            row for change in verdict.changes for row in _cell_rows(change.recorded, change.printed)
        )
    matcher, filters = LineMatcher(verdict.comparison), verdict.comparison.filters
    recorded, printed = Side.of(body.text, filters), Side.of(stdout, filters)
    steps = align(recorded, printed, matcher)
    rows = (row for step in steps for row in _step_rows(step, recorded, printed, matcher))
    # Between two common lines, all removed lines come before all added ones.
    hunks = (list(group) for _, group in groupby(rows, key=lambda row: row[0] == " "))
    return tuple(row for hunk in hunks for row in sorted(hunk, key=lambda r: r[0], reverse=True))


def _cell_rows(recorded: str, printed: str) -> Iterator[DiffRow]:
    yield from (_row("-", text) for text in recorded.split("\n") if recorded)
    yield from (_row("+", text) for text in printed.split("\n") if printed)


def _step_rows(
    step: Step, recorded: Side, printed: Side, matcher: LineMatcher
) -> Iterator[DiffRow]:
    """The rows of a step: one for each line of either side, none for elided lines."""
    match step.kind:
        case StepKind.SAME | StepKind.ELLIPSIS:
            yield from (_row(" ", text) for text in recorded.raw_lines(step.recorded))
        case StepKind.DIFFERS:
            recorded_line, printed_line = recorded.lines[step.recorded], printed.lines[step.printed]
            line_differences = find_differences(recorded_line, printed_line, matcher)
            yield "-", _parts(recorded_line, ((d.start, d.end) for d in line_differences))
            ranges = ((d.printed_start, d.printed_end) for d in line_differences)
            yield "+", _parts(printed_line, ranges)
        case StepKind.MISSING:
            yield _row("-", recorded.lines[step.recorded])
        case StepKind.EXTRA:
            yield _row("+", printed.lines[step.printed])
        case StepKind.ELIDED:
            pass


def _row(mark: Mark, text: str) -> DiffRow:
    return mark, [(text, mark != " ")]


def _parts(text: str, ranges: Iterable[tuple[int, int]]) -> list[tuple[str, bool]]:
    parts: list[tuple[str, bool]] = []
    at = 0
    for start, end in ranges:
        parts += ((text[at:start], False), (text[start:end], True))
        at = end
    return [part for part in (*parts, (text[at:], False)) if part[0]]
