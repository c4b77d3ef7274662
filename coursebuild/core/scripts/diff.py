"""A recorded output beside what its script prints now: a unified diff for messages, rows for pages.

Entry points: `diff_text`, `diff_rows(recording, verdict, filters, stdout)`; `shortened`.

1. Lines that match under the comparison's mode are as recorded, even where their characters differ;
   lines that a `...` stands for are left out.
2. The text is kept to a readable size. The rows are all lines, and say which part of a line is
   another.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Literal, TypeAlias, TypeVar

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


class _Row(Struct, frozen=True):
    mark: Mark
    text: str
    recorded: int
    ran: int


class DiffPiece(Struct, frozen=True):
    """A stretch of a line."""

    text: str
    changed: bool


class DiffRow(Struct, frozen=True):
    """A line: as recorded (`-`), as it ran (`+`), or both (a space)."""

    mark: Mark
    pieces: tuple[DiffPiece, ...]


_AnyRow = TypeVar("_AnyRow", _Row, DiffRow)


def shortened(text: str, width: int) -> str:
    """The text, cut to a width with an ellipsis sign at its end."""
    return text if len(text) <= width else text[: width - 1] + "…"


def diff_text(steps: Sequence[Step], recorded: Side, ran: Side) -> str:
    """The diff with two lines of context, at most 40 lines of at most 160 characters."""
    lines: list[str] = []
    more = 0
    for chunk in _chunks(steps):
        rows = _gone_first(row for step in chunk for row in _rows(step, recorded, ran))
        header = _header(rows)
        for line in (header, *(row.mark + shortened(row.text, _WIDTH) for row in rows)):
            if len(lines) < _LINES:
                lines.append(line)
            else:
                more += 1
    if more:
        lines.append(f"… and {more} more lines")
    return "\n".join(("--- recorded", "+++ this run", *lines)) if lines else ""


def _chunks(steps: Sequence[Step]) -> list[list[Step]]:
    """Stretches of steps around changes, with their context."""
    changed = (StepKind.DIFFERS, StepKind.MISSING, StepKind.EXTRA)
    shown: set[int] = set()
    for index, step in enumerate(steps):
        if step.kind in changed:
            shown.add(index)
            for way in (-1, 1):
                near = index + way
                while (
                    0 <= near < len(steps)
                    and abs(near - index) <= _CONTEXT
                    and steps[near].kind is StepKind.SAME
                ):
                    shown.add(near)
                    near += way
    chunks: list[list[Step]] = []
    for index in sorted(shown):
        if index - 1 not in shown:
            chunks.append([])
        chunks[-1].append(steps[index])
    return chunks


def _rows(step: Step, recorded: Side, ran: Side) -> list[_Row]:
    i, j = step.recorded, step.ran
    match step.kind:
        case StepKind.SAME:
            return [_Row(" ", recorded.lines[i].text, i, j)]
        case StepKind.DIFFERS:
            return [_Row("-", recorded.lines[i].text, i, j), _Row("+", ran.lines[j].text, i, j)]
        case StepKind.MISSING:
            return [_Row("-", recorded.lines[i].text, i, j)]
        case StepKind.EXTRA:
            return [_Row("+", ran.lines[j].text, i, j)]
        case StepKind.ELLIPSIS | StepKind.ELIDED:
            return []


def _gone_first(rows: Iterable[_AnyRow]) -> list[_AnyRow]:
    """All that goes before all that comes, as far as no common line lies between."""
    done: list[_AnyRow] = []
    gone: list[_AnyRow] = []
    come: list[_AnyRow] = []
    for row in rows:
        if row.mark == " ":
            done = done + gone + come + [row]
            gone, come = [], []
        else:
            (gone if row.mark == "-" else come).append(row)
    return done + gone + come


def _header(rows: Sequence[_Row]) -> str:
    recorded = [row for row in rows if row.mark in " -"]
    ran = [row for row in rows if row.mark in " +"]
    first_recorded = min(row.recorded for row in rows) + (1 if recorded else 0)
    first_ran = min(row.ran for row in rows) + (1 if ran else 0)
    return f"@@ -{first_recorded},{len(recorded)} +{first_ran},{len(ran)} @@"


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
    for text in recorded.split("\n") if recorded else ():
        yield DiffRow("-", (DiffPiece(text, True),))
    for text in ran.split("\n") if ran else ():
        yield DiffRow("+", (DiffPiece(text, True),))


def _page_rows(step: Step, recorded: Side, ran: Side, matcher: LineMatcher) -> Iterator[DiffRow]:
    match step.kind:
        case StepKind.SAME | StepKind.ELLIPSIS:
            for text in recorded.raw_lines(step.recorded):
                yield DiffRow(" ", (DiffPiece(text, False),))
        case StepKind.DIFFERS:
            one, two = recorded.lines[step.recorded].text, ran.lines[step.ran].text
            found = differences(one, two, matcher)
            yield DiffRow("-", _pieces(one, [(d.start, d.end) for d in found]))
            yield DiffRow("+", _pieces(two, [(d.ran_start, d.ran_end) for d in found]))
        case StepKind.MISSING:
            yield DiffRow("-", (DiffPiece(recorded.lines[step.recorded].text, True),))
        case StepKind.EXTRA:
            yield DiffRow("+", (DiffPiece(ran.lines[step.ran].text, True),))
        case StepKind.ELIDED:
            return


def _pieces(text: str, changed: Sequence[tuple[int, int]]) -> tuple[DiffPiece, ...]:
    pieces: list[DiffPiece] = []
    at = 0
    for start, end in changed:
        pieces += (DiffPiece(text[at:start], False), DiffPiece(text[start:end], True))
        at = end
    pieces.append(DiffPiece(text[at:], False))
    return tuple(piece for piece in pieces if piece.text)
