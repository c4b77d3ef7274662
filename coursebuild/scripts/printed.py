"""What was printed, line by line, with its numbers: what a bound number in the prose can lean on.

Entry points: `printed_lines` (a recorded output), `lines_of_run` (the output of a run).
"""

from __future__ import annotations

import functools
from bisect import bisect_right
from collections.abc import Callable

from msgspec import Struct

from coursebuild.model import Recording, Table
from coursebuild.scripts.numbers import Number, scan
from coursebuild.scripts.tables import RowCell, table_rows
from coursebuild.scripts.traced import Side
from coursebuild.source import Excerpt, Span

Locate = Callable[[int, int], Span]


class PrintedLine(Struct, frozen=True):
    """A line of output, or a row of a recorded table with its cells joined."""

    text: str
    locate: Locate | None
    """Where `text[start:end]` stands in the lesson; `None` for what is not recorded."""

    @property
    def numbers(self) -> tuple[Number, ...]:
        """Its numbers: of most lines nobody asks for them."""
        return _numbers(self.text)


@functools.lru_cache(maxsize=512)
def _numbers(text: str) -> tuple[Number, ...]:
    return scan(text)


def lines_of_run(stdout: str) -> tuple[PrintedLine, ...]:
    """The lines of an output that is not recorded."""
    return tuple(PrintedLine(text, None) for text in Side.of(stdout).texts)


def printed_lines(recording: Recording) -> tuple[PrintedLine, ...]:
    """The lines of a recorded output, as the author sees them: no filter is applied."""
    if isinstance(recording.body, Table):
        return tuple(_row_line(row) for row in table_rows(recording.body) if row)
    side = Side.of(recording.body.text)
    return tuple(
        PrintedLine(line.text, _in_fence(recording.body, side, index))
        for index, line in enumerate(side.lines)
    )


def _in_fence(body: Excerpt, side: Side, line: int) -> Locate:
    return lambda start, end: body.span(*side.origin(line, start, end))


def _row_line(row: tuple[RowCell, ...]) -> PrintedLine:
    starts: list[int] = []
    at = 0
    for cell in row:
        starts.append(at)
        at += len(cell.traced.text) + 1
    text = " ".join(cell.traced.text for cell in row)

    def locate(start: int, end: int) -> Span:
        first = bisect_right(starts, start) - 1
        last = max(first, bisect_right(starts, max(start, end - 1)) - 1)
        low, _ = row[first].traced.origin(start - starts[first], start - starts[first])
        _, high = row[last].traced.origin(0, min(end - starts[last], len(row[last].traced.text)))
        return Span(row[first].cell.span.source, low, max(low, high))

    return PrintedLine(text, locate)
