"""A recorded output beside what its script prints now: a unified diff for messages, rows for pages.

Entry points: `diff_text`, `diff_rows(recording, verdict, filters, stdout)`; `shortened`.

1. Lines that match under the comparison's mode are as recorded, even where their characters differ;
   lines that a `...` stands for are left out.
2. The text is kept to a readable size. The rows are all lines, and say which part of a line is
   another.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild.core.model import Filter, Recording, Table
from coursebuild.core.model.results import Verdict
from coursebuild.core.scripts.align import Step, StepKind, align
from coursebuild.core.scripts.changes import differences
from coursebuild.core.scripts.lines import LineMatcher
from coursebuild.core.scripts.mapped_text import Side

Mark: TypeAlias = Literal[" ", "-", "+"]
_CONTEXT = 2
_LINES = 40
_WIDTH = 160
_CHANGED = (StepKind.DIFFERS, StepKind.MISSING, StepKind.EXTRA)


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


def diff_text(steps: Sequence[Step], recorded: Side, ran: Side) -> str:
    """The diff with two lines of context, at most 40 lines of at most 160 characters."""
    lines: list[str] = []
    for hunk in _hunks(steps):
        rows = _gone_first(row for step in hunk for row in _rows(step, recorded, ran))
        lines.append(_header(hunk))
        lines += (row.mark + shortened(row.pieces[0].text, _WIDTH) for row in rows)
    if len(lines) > _LINES:
        lines[_LINES:] = [f"… and {len(lines) - _LINES} more lines"]
    return "\n".join(("--- recorded", "+++ this run", *lines)) if lines else ""


def _hunks(steps: Sequence[Step]) -> list[list[Step]]:
    """Stretches of steps around changes, with their context."""
    shown: set[int] = set()
    for index, step in enumerate(steps):
        if step.kind in _CHANGED:
            shown.add(index)
            for way in (-1, 1):
                for near in range(index + way, index + way * (_CONTEXT + 1), way):
                    if not 0 <= near < len(steps) or steps[near].kind is not StepKind.SAME:
                        break
                    shown.add(near)
    hunks: list[list[Step]] = []
    for index in sorted(shown):
        if index - 1 not in shown:
            hunks.append([])
        hunks[-1].append(steps[index])
    return hunks


def _rows(step: Step, recorded: Side, ran: Side) -> Iterator[DiffRow]:
    """The rows of a step: one for a line on either side, none for what an ellipsis stands for."""
    if step.kind is StepKind.SAME:
        yield _row(" ", recorded.lines[step.recorded])
    if step.kind in (StepKind.DIFFERS, StepKind.MISSING):
        yield _row("-", recorded.lines[step.recorded])
    if step.kind in (StepKind.DIFFERS, StepKind.EXTRA):
        yield _row("+", ran.lines[step.ran])


def _row(mark: Mark, text: str) -> DiffRow:
    return DiffRow(mark, (DiffPiece(text, mark != " "),))


def _gone_first(rows: Iterable[DiffRow]) -> list[DiffRow]:
    """All that goes before all that comes, as far as no common line lies between."""
    done: list[DiffRow] = []
    for _, group in groupby(rows, key=lambda row: row.mark == " "):
        done += sorted(group, key=lambda row: row.mark, reverse=True)
    return done


def _header(hunk: Sequence[Step]) -> str:
    """Where a hunk begins on both sides, and how many lines of each it has."""
    recorded = sum(step.kind is not StepKind.EXTRA for step in hunk)
    ran = sum(step.kind is not StepKind.MISSING for step in hunk)
    first = hunk[0].recorded + (recorded > 0), hunk[0].ran + (ran > 0)
    return f"@@ -{first[0]},{recorded} +{first[1]},{ran} @@"


def diff_rows(
    recording: Recording, verdict: Verdict, filters: tuple[Filter, ...], stdout: str
) -> tuple[DiffRow, ...]:
    """The rows of a recording that a run differs from.

    Of a table only the cells that changed are shown, as one row each.
    """
    if isinstance(recording.body, Table):
        return tuple(
            row for change in verdict.changes for row in _whole(change.recorded, change.ran)
        )
    matcher = LineMatcher(verdict.comparison)
    recorded, ran = Side.of(recording.body.text, filters), Side.of(stdout, filters)
    steps = align(recorded, ran, matcher)
    return tuple(
        _gone_first(row for step in steps for row in _page_rows(step, recorded, ran, matcher))
    )


def _whole(recorded: str, ran: str) -> Iterator[DiffRow]:
    yield from (_row("-", text) for text in recorded.split("\n") if recorded)
    yield from (_row("+", text) for text in ran.split("\n") if ran)


def _page_rows(step: Step, recorded: Side, ran: Side, matcher: LineMatcher) -> Iterator[DiffRow]:
    if step.kind in (StepKind.SAME, StepKind.ELLIPSIS):
        yield from (_row(" ", text) for text in recorded.raw_lines(step.recorded))
    elif step.kind is StepKind.DIFFERS:
        one, two = recorded.lines[step.recorded], ran.lines[step.ran]
        found = differences(one, two, matcher)
        yield DiffRow("-", _pieces(one, [(d.start, d.end) for d in found]))
        yield DiffRow("+", _pieces(two, [(d.ran_start, d.ran_end) for d in found]))
    else:
        yield from _rows(step, recorded, ran)


def _pieces(text: str, changed: Sequence[tuple[int, int]]) -> tuple[DiffPiece, ...]:
    pieces: list[DiffPiece] = []
    at = 0
    for start, end in changed:
        pieces += (DiffPiece(text[at:start], False), DiffPiece(text[start:end], True))
        at = end
    pieces.append(DiffPiece(text[at:], False))
    return tuple(piece for piece in pieces if piece.text)
