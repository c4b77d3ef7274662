"""A recorded output beside what its script prints now, line by line, for a page.

Entry point: `diff_rows(recording, verdict, filters, stdout)`. Unlike the diff of a message it has
every line, and says which part of a line is another.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild.model import Filter, Recording, Table
from coursebuild.results import Verdict
from coursebuild.scripts.align import Step, StepKind, align
from coursebuild.scripts.changes import differences
from coursebuild.scripts.lines import LineMatcher
from coursebuild.scripts.traced import Side

Mark: TypeAlias = Literal[" ", "-", "+"]


class DiffPiece(Struct, frozen=True):
    """A stretch of a line."""

    text: str
    changed: bool


class DiffRow(Struct, frozen=True):
    """A line: as recorded (`-`), as it ran (`+`), or both (a space)."""

    mark: Mark
    pieces: tuple[DiffPiece, ...]


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
    return tuple(_in_order(row for step in steps for row in _rows(step, recorded, ran, matcher)))


def _whole(recorded: str, ran: str) -> Iterator[DiffRow]:
    for text in recorded.split("\n") if recorded else ():
        yield DiffRow("-", (DiffPiece(text, True),))
    for text in ran.split("\n") if ran else ():
        yield DiffRow("+", (DiffPiece(text, True),))


def _rows(step: Step, recorded: Side, ran: Side, matcher: LineMatcher) -> Iterator[DiffRow]:
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


def _in_order(rows: Iterator[DiffRow]) -> Iterator[DiffRow]:
    """What goes before what comes, as far as no common line lies between."""
    gone: list[DiffRow] = []
    come: list[DiffRow] = []
    for row in rows:
        if row.mark == " ":
            yield from (*gone, *come, row)
            gone, come = [], []
        else:
            (gone if row.mark == "-" else come).append(row)
    yield from (*gone, *come)
