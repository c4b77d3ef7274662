"""A recorded output beside what its script prints now, line by line.

Entry points: `diff_rows`; `text_diff`, `shortened`, `quoted`.

Lines that match under the comparison's mode are as recorded, even where their characters differ;
lines that a `...` stands for are left out. A row says which part of its line is another.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild.core.model import Filter, Table
from coursebuild.core.model.results import Verdict
from coursebuild.core.scripts.align import Step, StepKind, align
from coursebuild.core.scripts.changes import differences
from coursebuild.core.scripts.lines import LineMatcher
from coursebuild.core.scripts.mapped_text import Side

Mark: TypeAlias = Literal[" ", "-", "+"]
_LINES, _WIDTH = 12, 120


class DiffPiece(Struct, frozen=True):
    """A stretch of a line."""

    text: str
    changed: bool


class DiffRow(Struct, frozen=True):
    """A line: as recorded (`-`), as it ran (`+`), or both (a space)."""

    mark: Mark
    pieces: tuple[DiffPiece, ...]


def shortened(text: str, width: int) -> str:
    """The text, cut to a width with an ellipsis sign at its end."""
    return text if len(text) <= width else text[: width - 1] + "…"


def quoted(text: str, width: int) -> str:
    """A line of output as a message shows it: cut, without the white space around it."""
    return f"`{shortened(text.strip(), width)}`"


def text_diff(before: str, now: str) -> str:
    """The lines that two texts do not share, at most twelve of them."""
    lines = [
        shortened(line, _WIDTH)
        for line in difflib.unified_diff(before.splitlines(), now.splitlines(), n=0, lineterm="")
        if not line.startswith(("---", "+++", "@@"))
    ]
    if len(lines) > _LINES:
        lines[_LINES:] = [f"… and {len(lines) - _LINES} more lines"]
    return "\n".join(lines)


def diff_rows(verdict: Verdict, filters: tuple[Filter, ...], stdout: str) -> tuple[DiffRow, ...]:
    """The rows of a recording that a run differs from.

    Of a table only the cells that changed are shown, as one row each.
    """
    body = verdict.recording.body
    if isinstance(body, Table):
        return tuple(
            row for change in verdict.changes for row in _whole(change.recorded, change.ran)
        )
    matcher, filters = LineMatcher(verdict.comparison), (*filters, *verdict.comparison.filters)
    recorded, ran = Side.of(body.text, filters), Side.of(stdout, filters)
    steps = align(recorded, ran, matcher)
    rows = (row for step in steps for row in _rows(step, recorded, ran, matcher))
    # All that goes before all that comes, as far as no common line lies between.
    hunks = (list(group) for _, group in groupby(rows, key=lambda row: row.mark == " "))
    return tuple(row for hunk in hunks for row in sorted(hunk, key=lambda r: r.mark, reverse=True))


def _whole(recorded: str, ran: str) -> Iterator[DiffRow]:
    yield from (_row("-", text) for text in recorded.split("\n") if recorded)
    yield from (_row("+", text) for text in ran.split("\n") if ran)


def _rows(step: Step, recorded: Side, ran: Side, matcher: LineMatcher) -> Iterator[DiffRow]:
    """The rows of a step: one for a line on either side, none for what an ellipsis stands for."""
    match step.kind:
        case StepKind.SAME | StepKind.ELLIPSIS:
            yield from (_row(" ", text) for text in recorded.raw_lines(step.recorded))
        case StepKind.DIFFERS:
            one, two = recorded.lines[step.recorded], ran.lines[step.ran]
            found = differences(one, two, matcher)
            yield DiffRow("-", _pieces(one, [(d.start, d.end) for d in found]))
            yield DiffRow("+", _pieces(two, [(d.ran_start, d.ran_end) for d in found]))
        case StepKind.MISSING:
            yield _row("-", recorded.lines[step.recorded])
        case StepKind.EXTRA:
            yield _row("+", ran.lines[step.ran])
        case StepKind.ELIDED:
            pass


def _row(mark: Mark, text: str) -> DiffRow:
    return DiffRow(mark, (DiffPiece(text, mark != " "),))


def _pieces(text: str, changed: Sequence[tuple[int, int]]) -> tuple[DiffPiece, ...]:
    pieces: list[DiffPiece] = []
    at = 0
    for start, end in changed:
        pieces += (DiffPiece(text[at:start], False), DiffPiece(text[start:end], True))
        at = end
    pieces.append(DiffPiece(text[at:], False))
    return tuple(piece for piece in pieces if piece.text)
